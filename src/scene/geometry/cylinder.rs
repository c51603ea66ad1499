//! Open cylinder: x² + y² = 1, 0 ≤ z ≤ 1 in its own coordinates, with u = φ/2π, v = z.
//!
//! Normals point outwards unless flipped, also under a reflection (as Mitsuba's ray casting has it).

use super::analytic::{first_root, roots, turns};
use super::surface::{Local, rounded_error};
use glam::{DAffine3, DVec3, Vec2, Vec3};
use std::f64::consts::PI;

/// A cylinder in the coordinates of its tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cylinder {
    to_world: DAffine3,
    to_own: DAffine3,
    side: f64,
}

impl Cylinder {
    /// The unit cylinder under `to_world`, which keeps its section round and its axis upright.
    pub(super) fn new(to_world: DAffine3, flip: bool) -> Self {
        Self { to_world, to_own: to_world.inverse(), side: if flip { -1.0 } else { 1.0 } }
    }

    /// Parameters at which the line meets the endless cylinder, and the line in own coordinates.
    #[inline]
    fn meet(&self, o: DVec3, d: DVec3) -> Option<((f64, f64), DVec3, DVec3)> {
        let (o, d) = (self.to_own.transform_point3(o), self.to_own.transform_vector3(d));
        let (o2, d2) = (o.truncate(), d.truncate());
        let (dd, qd) = (d2.dot(d2), o2.dot(d2));
        let nearest = o2 - d2 * (qd / dd);
        Some((roots(dd, qd, nearest.length_squared(), 1.0)?, o, d))
    }

    #[inline]
    pub(super) fn intersect(&self, o: DVec3, d: DVec3, t_max: f64) -> Option<f64> {
        let ((t0, t1), o, d) = self.meet(o, d)?;
        first_root(t0, t1, t_max, |t| (0.0..=1.0).contains(&(o.z + t * d.z)))
    }

    pub(super) fn surface(&self, o: DVec3, d: DVec3, t: f64, tangent: bool) -> Local {
        let q = match self.meet(o, d) {
            Some(((t0, t1), o, d)) => o + d * if (t - t0).abs() < (t - t1).abs() { t0 } else { t1 },
            None => self.to_own.transform_point3(o + d * t),
        };
        let round = q.truncate().normalize();
        let z = q.z.clamp(0.0, 1.0);
        let p = self.to_world.transform_point3(round.extend(z)).as_vec3();
        let n = self.normal(round).as_vec3();
        let dp_du = if tangent {
            self.to_world.transform_vector3(DVec3::new(-round.y, round.x, 0.0) * (2.0 * PI)).as_vec3()
        } else {
            Vec3::ZERO
        };
        Local { p, p_error: rounded_error(p), n_g: n, n_s: n, dp_du, uv: Vec2::new(turns(round.y, round.x), z as f32) }
    }

    fn normal(&self, round: glam::DVec2) -> DVec3 {
        self.to_world.transform_vector3(round.extend(0.0)).normalize() * self.side
    }

    pub(super) fn bounds(&self) -> (DVec3, DVec3) {
        let m = self.to_world.matrix3;
        let (x, y) = (m.x_axis, m.y_axis);
        let reach = (x * x + y * y).map(f64::sqrt);
        let (a, b) = (self.to_world.translation, self.to_world.translation + m.z_axis);
        (a.min(b) - reach, a.max(b) + reach)
    }

    pub(super) fn reach(&self) -> f64 {
        let m = self.to_world.matrix3;
        m.x_axis.length().hypot(0.5 * m.z_axis.length())
    }

    pub(super) fn area(&self) -> f64 {
        let m = self.to_world.matrix3;
        2.0 * PI * m.x_axis.length() * m.z_axis.length()
    }

    pub(super) fn sample_area(&self, u: Vec2) -> (DVec3, DVec3, Vec2) {
        let (sin, cos) = (2.0 * PI * f64::from(u.x)).sin_cos();
        let round = glam::DVec2::new(cos, sin);
        (self.to_world.transform_point3(round.extend(f64::from(u.y))), self.normal(round), u)
    }
}
