//! Disk: x² + y² ≤ 1, z = 0 in its own coordinates, with u = radius, v = φ/2π, under any affine map.

use super::analytic::turns;
use super::surface::{Local, rounded_error};
use crate::math::warp::disk_concentric;
use glam::{DAffine3, DVec2, DVec3, Vec2, Vec3};
use std::f64::consts::PI;

/// A disk in the coordinates of its tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disk {
    to_world: DAffine3,
    to_own: DAffine3,
    n: DVec3,
}

impl Disk {
    /// The unit disk under `to_world`, normal +z or, flipped, −z.
    pub(super) fn new(to_world: DAffine3, flip: bool) -> Self {
        let to_own = to_world.inverse();
        let n = to_own.matrix3.row(2).normalize();
        Self { to_world, to_own, n: if flip { -n } else { n } }
    }

    #[inline]
    pub(super) fn intersect(&self, o: DVec3, d: DVec3, t_max: f64) -> Option<f64> {
        let (t, q) = self.meet(o, d);
        (t > 0.0 && t < t_max && q.length_squared() <= 1.0).then_some(t)
    }

    #[inline]
    fn meet(&self, o: DVec3, d: DVec3) -> (f64, glam::DVec2) {
        let (o, d) = (self.to_own.transform_point3(o), self.to_own.transform_vector3(d));
        let t = -o.z / d.z;
        (t, o.truncate() + d.truncate() * t)
    }

    pub(super) fn surface(&self, o: DVec3, d: DVec3, tangent: bool, with_uv: bool) -> Local {
        let (_, q) = self.meet(o, d);
        let p = self.to_world.transform_point3(q.extend(0.0)).as_vec3();
        let n = self.n.as_vec3();
        let dp_du = if tangent {
            let along = q.try_normalize().unwrap_or(glam::DVec2::X);
            self.to_world.transform_vector3(along.extend(0.0)).as_vec3()
        } else {
            Vec3::ZERO
        };
        let uv = if with_uv { uv(q) } else { Vec2::ZERO };
        Local { p, p_error: rounded_error(p), n_g: n, n_s: n, dp_du, uv }
    }

    /// A point of the disk in its own coordinates.
    pub(super) fn place(&self, p: DVec3) -> DVec2 {
        self.to_own.transform_point3(p).truncate()
    }

    pub(super) fn bounds(&self) -> (DVec3, DVec3) {
        let m = self.to_world.matrix3;
        let (x, y) = (m.x_axis, m.y_axis);
        let reach = (x * x + y * y).map(f64::sqrt);
        (self.to_world.translation - reach, self.to_world.translation + reach)
    }

    /// The longer half axis of the ellipse.
    pub(super) fn reach(&self) -> f64 {
        let m = self.to_world.matrix3;
        let (xx, yy, xy) = (m.x_axis.length_squared(), m.y_axis.length_squared(), m.x_axis.dot(m.y_axis));
        (0.5 * (xx + yy + (xx - yy).hypot(2.0 * xy))).sqrt()
    }

    pub(super) fn normal(&self) -> DVec3 {
        self.n
    }

    pub(super) fn area(&self) -> f64 {
        let m = self.to_world.matrix3;
        PI * m.x_axis.cross(m.y_axis).length()
    }

    pub(super) fn sample_area(&self, u: Vec2) -> (DVec3, DVec3, Vec2) {
        let q = disk_concentric(u).as_dvec2();
        (self.to_world.transform_point3(q.extend(0.0)), self.n, uv(q))
    }
}

#[inline]
fn uv(q: DVec2) -> Vec2 {
    Vec2::new(q.length() as f32, turns(q.y, q.x))
}
