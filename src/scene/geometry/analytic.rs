//! Shapes that are kept as equations and met in double precision.
//!
//! A ray is some f32 numbers and therefore known exactly; roots computed from it in f64 have errors
//! far below an ulp of an f32 coordinate. That is why an origin rounded to f32 and moved off such a
//! shape by an ulp or two never meets it again, and a sphere of 1e-3 at distance 100 is round.

use super::bake::Shape;
use super::cylinder::Cylinder;
use super::disk::Disk;
use super::ray::{Aabb, Ray};
use super::sphere::Sphere;
use super::surface::Local;
use crate::math::warp::ONE_MINUS_EPSILON;
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

    /// The point of the shape that the ray met at `t`, with what `shape` needs.
    pub(super) fn surface(&self, ray: &Ray, t: f32, shape: &Shape) -> Local {
        let (o, d) = (ray.o.as_dvec3(), ray.d.as_dvec3());
        match self {
            Self::Sphere(s) => s.surface(o, d, f64::from(t), shape.needs_tangent, shape.needs_uv),
            Self::Disk(s) => s.surface(o, d, shape.needs_tangent, shape.needs_uv),
            Self::Cylinder(s) => s.surface(o, d, f64::from(t), shape.needs_tangent),
        }
    }

    /// Box, rounded outwards.
    pub(super) fn bounds(&self) -> Aabb {
        let (min, max) = each!(self, s => s.bounds());
        let out = |v: DVec3, up: bool| {
            Vec3::from_array(v.to_array().map(|x| if up { (x as f32).next_up() } else { (x as f32).next_down() }))
        };
        Aabb { min: out(min, false), max: out(max, true) }
    }

    /// Radius of the smallest sphere around the centre of the box that is known to hold the shape.
    pub(super) fn reach(&self) -> f64 {
        each!(self, s => s.reach())
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

/// Angle of (x, y) in turns, [0, 1).
#[inline]
pub(super) fn turns(y: f64, x: f64) -> f32 {
    let turn = angle(y.abs() as f32, x as f32) * (0.5 * std::f32::consts::FRAC_1_PI);
    if y < 0.0 { (1.0 - turn).min(ONE_MINUS_EPSILON) } else { turn }
}

/// Angle of (x, y), y ≥ 0, in [0, π], to 3e-7: arctangent's series economised on ±tan(π/8), after one
/// division; several times faster than the general function, and a part of every hit of a sphere.
#[inline]
pub(super) fn angle(y: f32, x: f32) -> f32 {
    use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};
    let across = x.abs();
    let (low, high) = (across.min(y), across.max(y));
    if high <= 0.0 {
        return 0.0;
    }
    let (numerator, denominator, start) =
        if low > 0.414_213_57 * high { (low - high, low + high, FRAC_PI_4) } else { (low, high, 0.0) };
    let t = numerator / denominator;
    let z = t * t;
    let series = ((8.053_744_6e-2 * z - 1.387_768_6e-1) * z + 1.997_771_1e-1) * z - 3.333_295e-1;
    let first = start + (series * z * t + t);
    let quarter = if y > across { FRAC_PI_2 - first } else { first };
    if x < 0.0 { PI - quarter } else { quarter }
}

#[cfg(test)]
mod tests {
    #[test]
    fn angles_are_those_of_atan2() {
        for i in 0..100_000 {
            let phi = f64::from(i) * 6.4e-5 - 0.05;
            let (y, x) = (phi.sin() * 1.7, phi.cos() * 1.7);
            let want = y.atan2(x);
            assert!((f64::from(super::angle(y.abs() as f32, x as f32)) - want.abs()).abs() < 4e-7, "{phi}");
            let turn = f64::from(super::turns(y, x)) * std::f64::consts::TAU;
            let far = (turn - want).rem_euclid(std::f64::consts::TAU);
            assert!(far.min(std::f64::consts::TAU - far) < 8e-7, "{phi}");
            assert!((0.0..std::f64::consts::TAU).contains(&turn), "{phi}");
        }
        assert_eq!(super::turns(0.0, 0.0), 0.0);
    }
}
