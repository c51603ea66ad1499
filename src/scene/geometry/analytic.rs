//! Shapes that are kept as equations and met in double precision.
//!
//! A ray is some f32 numbers and therefore known exactly; roots computed from it in f64 have errors
//! far below an ulp of an f32 coordinate. That is why an origin rounded to f32 and moved off such a
//! shape by an ulp or two never meets it again, and a sphere of 1e-3 at distance 100 is round.

use super::cylinder::Cylinder;
use super::disk::Disk;
use super::ray::{Aabb, Ray};
use super::sphere::Sphere;
use super::surface::Local;
use glam::{DVec3, Vec2, Vec3};

/// One of the analytic shapes.
#[derive(Clone, Copy, Debug)]
pub(super) enum Analytic {
    Sphere(Sphere),
    Disk(Disk),
    Cylinder(Cylinder),
}

macro_rules! each {
    ($shape:expr, $s:ident => $do:expr) => {
        match $shape {
            Analytic::Sphere($s) => $do,
            Analytic::Disk($s) => $do,
            Analytic::Cylinder($s) => $do,
        }
    };
}

impl Analytic {
    /// Smallest t in (0, `t_max`) at which `o + t·d` is on the shape.
    #[inline(never)]
    pub(super) fn intersect(&self, o: Vec3, d: Vec3, t_max: f32) -> Option<f32> {
        each!(self, s => s.intersect(o.as_dvec3(), d.as_dvec3(), f64::from(t_max))).map(|t| t as f32).filter(|t| *t > 0.0)
    }

    /// The point of the shape that the ray met at `t`.
    pub(super) fn surface(&self, ray: &Ray, t: f32, tangent: bool) -> Local {
        let (o, d) = (ray.o.as_dvec3(), ray.d.as_dvec3());
        each!(self, s => s.surface(o, d, f64::from(t), tangent))
    }

    /// Box, rounded outwards.
    pub(super) fn bounds(&self) -> Aabb {
        let (min, max) = each!(self, s => s.bounds());
        let out = |v: DVec3, up: bool| {
            Vec3::from_array(v.to_array().map(|x| if up { (x as f32).next_up() } else { (x as f32).next_down() }))
        };
        Aabb { min: out(min, false), max: out(max, true) }
    }

    /// Surface area.
    pub(super) fn area(&self) -> f64 {
        each!(self, s => s.area())
    }

    /// A point uniform by area: position, normal and uv.
    pub(super) fn sample_area(&self, u: Vec2) -> (DVec3, DVec3, Vec2) {
        each!(self, s => s.sample_area(u))
    }
}

/// The first of two roots `t0 ≤ t1` within (0, `t_max`) that passes `accept`.
#[inline]
pub(super) fn first_root(t0: f64, t1: f64, t_max: f64, accept: impl Fn(f64) -> bool) -> Option<f64> {
    let fits = |t: f64| t > 0.0 && t < t_max && accept(t);
    if fits(t0) {
        Some(t0)
    } else if fits(t1) {
        Some(t1)
    } else {
        None
    }
}

/// Roots of `|q + t·d|² = r²` in as many dimensions as the caller keeps: `dd = d·d`, `qd = q·d`,
/// `miss2` = squared distance of the line from the centre.
#[inline]
pub(super) fn roots(dd: f64, qd: f64, miss2: f64, r: f64) -> Option<(f64, f64)> {
    let inside = (r * r - miss2) / dd;
    if inside.is_nan() || inside < 0.0 {
        return None;
    }
    let (middle, half) = (-qd / dd, inside.sqrt());
    Some((middle - half, middle + half))
}

/// Angle in turns, [0, 1).
#[inline]
pub(super) fn turns(y: f64, x: f64) -> f32 {
    let phi = (y as f32).atan2(x as f32) * (0.5 * std::f32::consts::FRAC_1_PI);
    if phi < 0.0 { phi + 1.0 } else { phi }
}
