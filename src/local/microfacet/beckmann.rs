//! Beckmann: D(m) = exp(−(m_x²/α_u² + m_y²/α_v²)/m_z²) / (π α_u α_v m_z⁴) [Walter 2007, eq. 25].
//!
//! With a = 1/(α tanθ) the exact masking is G₁ = 2/(1 + erf a + e^(−a²)/(a√π)) [Walter 2007, eq. 26];
//! the model's value uses the rational fit [Walter 2007, eq. 27], as Mitsuba 3 does. Visible slopes are
//! found by inverting the distribution of the slope along the direction, in the variable erf(slope),
//! where it is nearly straight [Jakob 2014], by Newton's method inside a shrinking bracket.

use super::Masking;
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

const FRAC_1_SQRT_PI: f32 = 0.564_189_6;

/// Density of facet normals.
#[inline]
pub fn d(alpha: Vec2, m: Vec3) -> f32 {
    let cos2 = m.z * m.z;
    let slope2 = (m.truncate() / alpha).length_squared() / cos2;
    (-slope2).exp() / (PI * alpha.x * alpha.y * cos2 * cos2)
}

/// Masking over the cosine, where `stretched` is α²sin²θ.
#[inline]
pub fn masking(cos: f32, stretched: f32) -> Masking {
    let s = stretched.sqrt();
    // Beyond a = 4 both forms are 1 to the last bit but one.
    if cos >= 4.0 * s {
        return Masking { g: 1.0 / cos, visible: 1.0 / cos };
    }
    let a = cos / s;
    let g = if a >= 1.6 { 1.0 / cos } else { (3.535 + 2.181 * a) / (s * (1.0 + a * (2.276 + 2.577 * a))) };
    let (erf, gauss) = erf_and_gauss(a);
    Masking { g, visible: 2.0 / (cos * (1.0 + erf) + gauss * s * FRAC_1_SQRT_PI) }
}

/// erf(x) and exp(−x²); erf to an absolute error of 1.5e-7 [Abramowitz & Stegun 1964, 7.1.26].
#[inline]
pub fn erf_and_gauss(x: f32) -> (f32, f32) {
    let gauss = (-x * x).exp();
    let t = 1.0 / (1.0 + 0.327_591_1 * x.abs());
    let series = [1.061_405_4, -1.453_152, 1.421_413_7, -0.284_496_74, 0.254_829_6f32];
    let poly = series.into_iter().fold(0.0, |sum, c| sum * t + c) * t;
    ((1.0 - poly * gauss).copysign(x), gauss)
}

/// Inverse of erf on (−1, 1), single precision [Giles 2012].
#[inline]
pub fn erf_inv(x: f32) -> f32 {
    const CENTRE: [f32; 9] = [
        2.810_226_4e-8,
        3.432_739_4e-7,
        -3.523_387_7e-6,
        -4.391_506_5e-6,
        2.185_808_7e-4,
        -1.253_725e-3,
        -4.177_681_6e-3,
        0.246_640_72,
        1.501_409_4,
    ];
    const TAIL: [f32; 9] = [
        -2.002_142_6e-4,
        1.009_505_6e-4,
        1.349_343_2e-3,
        -3.673_428_4e-3,
        5.739_507_7e-3,
        -7.622_461_3e-3,
        9.438_870_5e-3,
        1.001_674,
        2.832_976_8,
    ];
    let w = -((1.0 - x) * (1.0 + x)).max(f32::MIN_POSITIVE).ln();
    let (series, t) = if w < 5.0 { (CENTRE, w - 2.5) } else { (TAIL, w.sqrt() - 3.0) };
    series.into_iter().fold(0.0, |sum, c| sum * t + c) * x
}

/// A facet normal visible from `w`.
pub fn sample_visible(alpha: Vec2, w: Vec3, u: Vec2) -> Vec3 {
    let s = (w * alpha.extend(1.0)).normalize();
    let sin = s.truncate().length();
    let (cos_phi, sin_phi) = if sin > 0.0 { (s.x / sin, s.y / sin) } else { (1.0, 0.0) };
    let slope = Vec2::new(sample_slope(sin / s.z.max(1e-7), u.x), erf_inv((2.0 * u.y - 1.0).clamp(-0.999_999, 0.999_999)));
    let turned = Vec2::new(cos_phi * slope.x - sin_phi * slope.y, sin_phi * slope.x + cos_phi * slope.y);
    (-turned * alpha).extend(1.0).normalize()
}

/// Slope along the direction, for unit roughness and a direction of tangent `tan`.
///
/// Solves `1 + x + tan·exp(−slope²)/√π = u·(1 + erf(cot) + tan·exp(−cot²)/√π)`, x = erf(slope).
fn sample_slope(tan: f32, u: f32) -> f32 {
    let u = u.clamp(1e-6, 1.0 - 1e-6);
    if tan < 1e-6 {
        return erf_inv(2.0 * u - 1.0);
    }
    let cot = 1.0 / tan;
    let (most, gauss) = erf_and_gauss(cot);
    let target = u * (1.0 + most + FRAC_1_SQRT_PI * tan * gauss);
    // The start is the exact solution at grazing incidence.
    let (mut lo, mut hi) = (-1.0, most);
    let mut x = most - (most + 1.0) * erf_and_gauss((-u.ln()).sqrt()).0;
    for _ in 0..12 {
        if !(x > lo && x < hi) {
            x = 0.5 * (lo + hi);
        }
        let slope = erf_inv(x);
        let excess = 1.0 + x + FRAC_1_SQRT_PI * tan * (-slope * slope).exp() - target;
        if excess.abs() < 2e-6 * target {
            break;
        }
        if excess < 0.0 {
            lo = x;
        } else {
            hi = x;
        }
        x -= excess / (1.0 - slope * tan);
    }
    erf_inv(x.clamp(-0.999_999_9, 0.999_999_9))
}
