//! Sphere: |x − c| = r, with u = φ/2π, v = θ/π in its own coordinates (Mitsuba's parametrisation).
//!
//! Sampling toward a point x draws a direction uniformly from the cone that the sphere fills as seen
//! from x [Shirley 1996], in the form that stays exact for a tiny far sphere [Pharr 2023, sec. 6.2.4]:
//! everything follows from sin²θ_max = r²/|x − c|², never from 1 − cosθ_max by subtraction.

use super::analytic::{angle, first_root, roots, turns};
use super::surface::{Local, rounded_error};
use crate::math::warp::{sin_cos_turn, sphere_uniform};
use glam::{DMat3, DVec3, Vec2, Vec3};
use std::f64::consts::PI;

/// Up to so many radii away a rounded t is as good as the root: brought back onto the sphere, the point is off by a millionth
/// of the radius at most, along it.
const NEAR: f64 = 16.0;

/// A sphere in the coordinates of its tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sphere {
    center: DVec3,
    radius: f64,
    /// Unit sphere to world, without translation: rotation (and reflection) times radius.
    linear: DMat3,
    /// +1: normals point outwards, −1: inwards.
    side: f64,
}

impl Sphere {
    /// `linear` is a rotation or reflection times the radius.
    pub(super) fn new(center: DVec3, linear: DMat3, flip: bool) -> Self {
        let det = linear.determinant();
        // A reflected sphere has inward normals, as in Mitsuba.
        Self { center, radius: det.abs().cbrt(), linear, side: if flip != (det < 0.0) { -1.0 } else { 1.0 } }
    }

    #[inline]
    pub(super) fn intersect(&self, o: DVec3, d: DVec3, t_max: f64) -> Option<f64> {
        let (t0, t1) = self.roots(o, d)?;
        first_root(t0, t1, t_max, |_| true)
    }

    #[inline]
    fn roots(&self, o: DVec3, d: DVec3) -> Option<(f64, f64)> {
        let q = o - self.center;
        let (dd, qd) = (d.dot(d), q.dot(d));
        let nearest = q - d * (qd / dd);
        roots(dd, qd, nearest.dot(nearest), self.radius)
    }

    pub(super) fn surface(&self, o: DVec3, d: DVec3, t: f64, tangent: bool, with_uv: bool) -> Local {
        let t = if t * t * d.length_squared() < NEAR * NEAR * self.radius * self.radius { t } else { self.exact_root(o, d, t) };
        let out = (o + d * t - self.center).normalize();
        let p = (self.center + out * self.radius).as_vec3();
        let n = (out * self.side).as_vec3();
        let dp_du = if tangent {
            let own = self.own(out);
            (self.linear * DVec3::new(-own.y, own.x, 0.0) * (2.0 * PI)).as_vec3()
        } else {
            Vec3::ZERO
        };
        let uv = if with_uv { uv(self.own(out)) } else { Vec2::ZERO };
        Local { p, p_error: rounded_error(p), n_g: n, n_s: n, dp_du, uv }
    }

    /// The root beside the rounded `t`.
    fn exact_root(&self, o: DVec3, d: DVec3, t: f64) -> f64 {
        match self.roots(o, d) {
            Some((t0, t1)) if (t - t0).abs() < (t - t1).abs() => t0,
            Some((_, t1)) => t1,
            None => t,
        }
    }

    /// Unit vector from the centre in the sphere's own coordinates.
    #[inline]
    fn own(&self, out: DVec3) -> DVec3 {
        self.linear.transpose() * out / self.radius
    }

    /// Unit vector from the centre to a point of the sphere, in the sphere's own coordinates.
    pub(super) fn direction(&self, p: DVec3) -> DVec3 {
        self.own((p - self.center).normalize())
    }

    pub(super) fn bounds(&self) -> (DVec3, DVec3) {
        (self.center - self.radius, self.center + self.radius)
    }

    pub(super) fn reach(&self) -> f64 {
        self.radius
    }

    pub(super) fn area(&self) -> f64 {
        4.0 * PI * self.radius * self.radius
    }

    pub(super) fn sample_area(&self, u: Vec2) -> (DVec3, DVec3, Vec2) {
        self.point(sphere_uniform(u).as_dvec3().normalize())
    }

    /// The point in direction `own` (unit) from the centre, in the sphere's own coordinates.
    pub(super) fn at(&self, own: DVec3) -> (DVec3, DVec3, Vec2) {
        self.point((self.linear * own / self.radius).normalize())
    }

    fn point(&self, out: DVec3) -> (DVec3, DVec3, Vec2) {
        (self.center + out * self.radius, out * self.side, uv(self.own(out)))
    }

    /// A point uniform across the unit direction `w` on the side that shines along it: density
    /// cosθ/(πr²); `None` where the sphere shines inwards.
    pub(super) fn sample_across(&self, w: Vec3, disk: Vec2) -> Option<(DVec3, DVec3, Vec2)> {
        if self.side < 0.0 {
            return None;
        }
        let axis = w.as_dvec3().normalize();
        let (s, t) = axis.any_orthonormal_pair();
        let d = disk.as_dvec2();
        Some(self.point((s * d.x + t * d.y + axis * (1.0 - d.length_squared()).max(0.0).sqrt()).normalize()))
    }

    /// Shines outwards?
    pub(super) fn is_outward(&self) -> bool {
        self.side > 0.0
    }

    /// sin²θ_max of the cone in which x sees the outside of the sphere; `None` where x is not safely
    /// outside or the sphere shines inwards: there sampling is uniform by area.
    #[inline]
    fn sin2_max(&self, x: Vec3) -> Option<f64> {
        if self.side < 0.0 {
            return None;
        }
        let sin2 = self.radius * self.radius / (x.as_dvec3() - self.center).length_squared();
        (sin2 < 0.9999).then_some(sin2)
    }

    /// Density per steradian of [`Sphere::sample_toward`], constant in the cone.
    #[inline]
    pub(super) fn cone_p_w(&self, x: Vec3) -> Option<f64> {
        Some(1.0 / (2.0 * PI * one_minus_cos(self.sin2_max(x)?)))
    }

    /// A point uniform in solid angle as seen from x, with texture coordinates if they are wanted; `None` as for the density.
    pub(super) fn sample_toward(&self, x: Vec3, u: Vec2, with_uv: bool) -> Option<(DVec3, DVec3, Vec2)> {
        let sin2_max = self.sin2_max(x)?;
        let m = f64::from(u.x) * one_minus_cos(sin2_max);
        let (cos, sin2) = (1.0 - m, m * (2.0 - m));
        // Angle at the centre between the axis and the point.
        let cos_a = sin2 / sin2_max.sqrt() + cos * (1.0 - sin2 / sin2_max).max(0.0).sqrt();
        let sin_a = (1.0 - cos_a * cos_a).max(0.0).sqrt();
        let axis = (x.as_dvec3() - self.center).normalize();
        let (s, t) = axis.any_orthonormal_pair();
        // Rounded, the angle is another one nearby; the point is on the sphere all the same.
        let (sin_phi, cos_phi) = sin_cos_turn(u.y);
        let out = (s * (sin_a * f64::from(cos_phi)) + t * (sin_a * f64::from(sin_phi)) + axis * cos_a).normalize();
        let uv = if with_uv { uv(self.own(out)) } else { Vec2::ZERO };
        Some((self.center + out * self.radius, out * self.side, uv))
    }
}

/// 1 − cosθ from sin²θ without cancellation, θ ≤ π/2.
#[inline]
fn one_minus_cos(sin2: f64) -> f64 {
    sin2 / (1.0 + (1.0 - sin2).sqrt())
}

#[inline]
fn uv(own: DVec3) -> Vec2 {
    let rho = own.truncate().length() as f32;
    Vec2::new(turns(own.y, own.x), angle(rho, own.z as f32) * std::f32::consts::FRAC_1_PI)
}
