//! Beckmann: D(m) = exp(−(m_x²/α_u² + m_y²/α_v²)/m_z²) / (π α_u α_v m_z⁴) [Walter 2007, eq. 25].
//!
//! With a = 1/(α tanθ) the exact masking is G₁ = 2/(1 + erf a + e^(−a²)/(a√π)) [Walter 2007, eq. 26];
//! the model's value uses the rational fit [Walter 2007, eq. 27], as Mitsuba 3 does. Visible slopes are
//! found by inverting the distribution of the slope along the direction: a start that is exact at
//! grazing incidence [Jakob 2014] or at normal incidence, then Halley's method inside a shrinking bracket.

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
        return Masking { visible: 1.0 / cos, ratio: 1.0 };
    }
    let a = cos / s;
    let (erf, gauss) = erf_and_gauss(a);
    // Twice cosθ/G₁.
    let inverse = cos * (1.0 + erf) + gauss * s * FRAC_1_SQRT_PI;
    let ratio =
        if a >= 1.6 { 0.5 * inverse / cos } else { 0.5 * inverse * (3.535 + 2.181 * a) / (s * (1.0 + a * (2.276 + 2.577 * a))) };
    Masking { visible: 2.0 / inverse, ratio }
}

/// erf(x) and exp(−x²); erf to an absolute error of 1.5e-7 [Abramowitz & Stegun 1964, 7.1.26].
#[inline]
pub fn erf_and_gauss(x: f32) -> (f32, f32) {
    let gauss = (-x * x).exp();
    let t = 1.0 / (1.0 + 0.327_591_1 * x.abs());
    const SERIES: [f32; 5] = [0.254_829_6, -0.284_496_74, 1.421_413_7, -1.453_152, 1.061_405_4];
    let [a, b, c, d, e] = SERIES;
    let poly = t * (a + t * (b + t * (c + t * (d + t * e))));
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
    let (series, t) = if w < 5.0 { (&CENTRE, w - 2.5) } else { (&TAIL, w.sqrt() - 3.0) };
    let [a, b, c, d, e, f, g, h, i] = *series;
    (i + t * (h + t * (g + t * (f + t * (e + t * (d + t * (c + t * (b + t * a)))))))) * x
}

/// A facet normal visible from `w`.
pub fn sample_visible(alpha: Vec2, w: Vec3, u: Vec2) -> Vec3 {
    let facets = VisibleSlopes::new(alpha, w);
    facets.normal(Vec2::new(facets.along(u.x), VisibleSlopes::across(u.y)))
}

/// Slopes of the facets visible from a direction, stretched to unit roughness and turned so that the
/// direction lies above the x axis; the slope along it and the one across are independent.
pub struct VisibleSlopes {
    alpha: Vec2,
    /// Cosine and sine of the azimuth of the stretched direction.
    azimuth: Vec2,
    /// Tangent of its angle with the normal.
    tan: f32,
}

impl VisibleSlopes {
    /// Those visible from `w`.
    pub fn new(alpha: Vec2, w: Vec3) -> Self {
        let s = (w * alpha.extend(1.0)).normalize();
        let sin = s.truncate().length();
        let azimuth = if sin > 0.0 { s.truncate() / sin } else { Vec2::X };
        Self { alpha, azimuth, tan: sin / s.z.max(1e-7) }
    }

    /// Slope along the direction.
    pub fn along(&self, u: f32) -> f32 {
        sample_slope(self.tan, u)
    }

    /// Slope across it.
    pub fn across(u: f32) -> f32 {
        erf_inv((2.0 * u - 1.0).clamp(-0.999_999, 0.999_999))
    }

    /// The normal with these slopes.
    pub fn normal(&self, slope: Vec2) -> Vec3 {
        (-self.azimuth.rotate(slope) * self.alpha).extend(1.0).normalize()
    }
}

/// Slope along the direction, for unit roughness and a direction of tangent `tan`.
///
/// Solves `1 + erf(s) + tan·exp(−s²)/√π = u·(1 + erf(cot) + tan·exp(−cot²)/√π)` for s below cot,
/// where the left side grows: its derivative is `2/√π·exp(−s²)·(1 − s·tan)`.
fn sample_slope(tan: f32, u: f32) -> f32 {
    let u = u.clamp(1e-6, 1.0 - 1e-6);
    if tan < 1e-6 {
        return erf_inv(2.0 * u - 1.0);
    }
    let cot = 1.0 / tan;
    let (most, gauss) = erf_and_gauss(cot);
    let target = u * (1.0 + most + FRAC_1_SQRT_PI * tan * gauss);
    // Exact at grazing and at normal incidence, respectively.
    let start = if tan > 0.7 { most - (most + 1.0) * erf_and_gauss((-u.ln()).sqrt()).0 } else { 2.0 * u - 1.0 };
    let (mut lo, mut hi) = (-4.0, cot.min(4.0));
    let mut slope = erf_inv(start);
    for _ in 0..8 {
        // Also false for a NaN.
        if !(slope > lo && slope < hi) {
            slope = 0.5 * (lo + hi);
        }
        let (erf, gauss) = erf_and_gauss(slope);
        let excess = 1.0 + erf + FRAC_1_SQRT_PI * tan * gauss - target;
        if excess < 0.0 {
            lo = slope;
        } else {
            hi = slope;
        }
        // Newton's step, then the curvature of the left side.
        let rise = 1.0 - slope * tan;
        let step = excess / (2.0 * FRAC_1_SQRT_PI * gauss * rise);
        let step = step / (1.0 + step * (slope + 0.5 * tan / rise));
        slope -= step;
        // Convergence is cubic: after a step of this size nothing is left that f32 could tell.
        if step.abs() < 2e-3 {
            break;
        }
    }
    slope.clamp(-4.0, 4.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::function::erf;

    #[test]
    fn error_function_and_its_inverse() {
        for i in -400..=400 {
            let x = i as f32 * 0.01;
            let (e, g) = erf_and_gauss(x);
            assert!((f64::from(e) - erf::erf(f64::from(x))).abs() < 3e-7, "erf {x}");
            assert!((g - (-x * x).exp()).abs() < 1e-7, "gauss {x}");
            let y = (i as f32 * 0.002_499).clamp(-0.999_75, 0.999_75);
            assert!((f64::from(erf_inv(y)) - erf::erf_inv(f64::from(y))).abs() < 3e-6, "inverse {y}");
        }
    }

    #[test]
    fn slopes_invert_their_distribution() {
        for tan in [1e-5, 0.01, 0.3, 1.0, 10.0, 1e4, 1e7f32] {
            let below = |s: f64| {
                let tan = f64::from(tan);
                1.0 + erf::erf(s) + tan * (-s * s).exp() / std::f64::consts::PI.sqrt()
            };
            for i in 0..1000 {
                let u = (i as f32 + 0.5) / 1000.0;
                let share = below(f64::from(sample_slope(tan, u))) / below(1.0 / f64::from(tan));
                assert!((share - f64::from(u)).abs() < 2e-6 + 1e-5 * f64::from(u), "tan {tan}: {u} became {share}");
            }
        }
    }
}
