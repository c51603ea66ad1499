//! Maps of the unit square onto sets of points and directions, with their densities.
//!
//! All directions are in local coordinates (z = axis), all densities per steradian (`p_w`) or per
//! unit area (`p_a`) as named.

use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, PI};

/// Largest float below one.
pub const ONE_MINUS_EPSILON: f32 = 1.0 - f32::EPSILON / 2.0;

/// Unit disk, uniform and without distortion of strata [Shirley & Chiu 1997].
#[inline]
pub fn disk_concentric(u: Vec2) -> Vec2 {
    let o = 2.0 * u - Vec2::ONE;
    if o == Vec2::ZERO {
        return Vec2::ZERO;
    }
    // Beyond the diagonal the angle is π/2 − φ: sine and cosine change places.
    let swapped = o.x.abs() <= o.y.abs();
    let (r, phi) = if swapped { (o.y, (PI / 4.0) * (o.x / o.y)) } else { (o.x, (PI / 4.0) * (o.y / o.x)) };
    let (s, c) = sin_cos_small(phi);
    if swapped { Vec2::new(r * s, r * c) } else { Vec2::new(r * c, r * s) }
}

/// Sine and cosine of |x| ≤ π/4 by their series, to 1 ulp or so: several times faster than the
/// general functions, and the same on every machine.
#[inline]
fn sin_cos_small(x: f32) -> (f32, f32) {
    let x2 = x * x;
    let sin = x + x * x2 * (-1.0 / 6.0 + x2 * (1.0 / 120.0 + x2 * (-1.0 / 5040.0 + x2 * (1.0 / 362_880.0))));
    let cos = 1.0 + x2 * (-0.5 + x2 * (1.0 / 24.0 + x2 * (-1.0 / 720.0 + x2 * (1.0 / 40_320.0))));
    (sin, cos)
}

/// Cosine-weighted hemisphere around +z: `p_w = cosθ / π`.
#[inline]
pub fn hemisphere_cosine(u: Vec2) -> Vec3 {
    let d = disk_concentric(u);
    d.extend((1.0 - d.length_squared()).max(0.0).sqrt())
}

/// Density of [`hemisphere_cosine`].
#[inline]
pub fn hemisphere_cosine_p_w(cos: f32) -> f32 {
    cos.max(0.0) * FRAC_1_PI
}

/// Uniform sphere: `p_w = 1 / 4π`.
#[inline]
pub fn sphere_uniform(u: Vec2) -> Vec3 {
    let z = 1.0 - 2.0 * u.x;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (s, c) = (2.0 * PI * u.y).sin_cos();
    Vec3::new(r * c, r * s, z)
}

/// Density of [`sphere_uniform`].
pub const SPHERE_UNIFORM_P_W: f32 = 0.25 * FRAC_1_PI;

/// Uniform cone around +z of half angle with cosine `cos_max`: `p_w = 1 / (2π(1 − cos_max))`.
#[inline]
pub fn cone_uniform(u: Vec2, cos_max: f32) -> Vec3 {
    let one_minus_cos = u.x * (1.0 - cos_max);
    let z = 1.0 - one_minus_cos;
    let r = (one_minus_cos * (1.0 + z)).max(0.0).sqrt();
    let (s, c) = (2.0 * PI * u.y).sin_cos();
    Vec3::new(r * c, r * s, z)
}

/// Density of [`cone_uniform`].
#[inline]
pub fn cone_uniform_p_w(cos_max: f32) -> f32 {
    1.0 / (2.0 * PI * (1.0 - cos_max))
}

/// Barycentric coordinates (b1, b2) of a uniform point in a triangle.
#[inline]
pub fn triangle_uniform(u: Vec2) -> Vec2 {
    let t = (1.0 - u.x).max(0.0).sqrt();
    Vec2::new(1.0 - t, t * u.y)
}
