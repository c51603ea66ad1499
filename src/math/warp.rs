//! Maps of the unit square onto sets of points and directions, with their densities.
//!
//! All directions are in local coordinates (z = axis), all densities per steradian (`p_w`) or per
//! unit area (`p_a`) as named.

use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, PI};

/// Largest float below one.
pub const ONE_MINUS_EPSILON: f32 = 1.0 - f32::EPSILON / 2.0;

/// (sin, cos) of `t·π/4` for |t| ≤ 1, to one unit in the last place of 1: the first terms of the
/// series, which is all that f32 can hold there, at a third of the cost of a library call.
#[inline]
fn sin_cos_eighth(t: f32) -> (f32, f32) {
    const Q: f32 = PI / 4.0;
    let x = t * Q;
    let x2 = x * x;
    let sin = x + x * x2 * (-1.0 / 6.0 + x2 * (1.0 / 120.0 + x2 * (-1.0 / 5040.0 + x2 * (1.0 / 362_880.0))));
    let cos = 1.0 + x2 * (-0.5 + x2 * (1.0 / 24.0 + x2 * (-1.0 / 720.0 + x2 * (1.0 / 40_320.0))));
    (sin, cos)
}

/// (sin, cos) of `2πu` for u in [0, 1]. Without a library call, also where there is no instruction for
/// rounding.
#[inline]
pub fn sin_cos_turn(u: f32) -> (f32, f32) {
    let quarters = 4.0 * u;
    let q = (quarters + 0.5) as i32;
    let (s, c) = sin_cos_eighth(2.0 * (quarters - q as f32));
    let (s, c) = if q & 1 == 0 { (s, c) } else { (c, -s) };
    if q & 2 == 0 { (s, c) } else { (-s, -c) }
}

/// Unit disk, uniform and without distortion of strata [Shirley & Chiu 1997].
///
/// Written without a branch on the sector, which no predictor could guess.
#[inline]
pub fn disk_concentric(u: Vec2) -> Vec2 {
    let o = 2.0 * u - Vec2::ONE;
    let flat = o.x.abs() > o.y.abs();
    let (r, across) = if flat { (o.x, o.y) } else { (o.y, o.x) };
    let safe = if r == 0.0 { 1.0 } else { r };
    let (s, c) = sin_cos_eighth(across / safe);
    let (along, aside) = (r * c, r * s);
    if flat { Vec2::new(along, aside) } else { Vec2::new(aside, along) }
}

/// Inverse of [`disk_concentric`], to about 1e-6.
#[inline]
pub fn disk_concentric_inverse(d: Vec2) -> Vec2 {
    let flat = d.x.abs() > d.y.abs();
    let (along, aside) = if flat { (d.x, d.y) } else { (d.y, d.x) };
    let r = d.length().copysign(along);
    let t = if along == 0.0 { 0.0 } else { aside / along };
    let across = r * (atan_unit(t) * (4.0 * FRAC_1_PI));
    let o = if flat { Vec2::new(r, across) } else { Vec2::new(across, r) };
    (0.5 * (o + Vec2::ONE)).clamp(Vec2::ZERO, Vec2::splat(ONE_MINUS_EPSILON))
}

/// Arctangent of |t| ≤ 1 to 3e-7: half of the angle by the tangent's half-angle formula, then a short
/// series.
#[inline]
fn atan_unit(t: f32) -> f32 {
    let half = t / (1.0 + (1.0 + t * t).sqrt());
    let z = half * half;
    let series = ((8.053_744_6e-2 * z - 1.387_768_6e-1) * z + 1.997_771_1e-1) * z - 3.333_295e-1;
    2.0 * (series * z * half + half)
}

/// Sphere from the square, area to area: z ≥ 0 over u.x < ½, z < 0 over the rest, each hemisphere a
/// concentric disk under Lambert's azimuthal projection.
#[inline]
pub fn sphere_charts(u: Vec2) -> Vec3 {
    let below = u.x >= 0.5;
    let x = 2.0 * u.x - f32::from(u8::from(below));
    let d = disk_concentric(Vec2::new(x, u.y));
    let r2 = d.length_squared().min(1.0);
    let z = 1.0 - r2;
    (d * (2.0 - r2).sqrt()).extend(if below { -z } else { z })
}

/// Inverse of [`sphere_charts`] for a unit vector.
#[inline]
pub fn sphere_charts_inverse(w: Vec3) -> Vec2 {
    let d = w.truncate() / (1.0 + w.z.abs()).sqrt();
    let u = disk_concentric_inverse(d);
    // The charts meet at x = ½: nothing of the first may be rounded into the second.
    if w.z >= 0.0 {
        Vec2::new((0.5 * u.x).min(0.5 - f32::EPSILON), u.y)
    } else {
        Vec2::new((0.5 + 0.5 * u.x).min(ONE_MINUS_EPSILON), u.y)
    }
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
    let (s, c) = sin_cos_turn(u.y);
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
    let (s, c) = sin_cos_turn(u.y);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_those_of_the_library() {
        for i in 0..=100_000 {
            let u = i as f32 / 100_000.0;
            let (s, c) = sin_cos_turn(u);
            let exact = (2.0 * std::f64::consts::PI * f64::from(u)).sin_cos();
            assert!((f64::from(s) - exact.0).abs() < 1.5e-7 && (f64::from(c) - exact.1).abs() < 1.5e-7, "{u}: {s} {c}");
        }
    }

    #[test]
    fn disk_is_concentric() {
        for (u, expected) in
            [((0.5, 0.5), (0.0, 0.0)), ((1.0, 0.5), (1.0, 0.0)), ((0.5, 0.0), (0.0, -1.0)), ((0.0, 0.5), (-1.0, 0.0))]
        {
            let d = disk_concentric(Vec2::new(u.0, u.1));
            assert!((d - Vec2::new(expected.0, expected.1)).length() < 1e-6, "{u:?}: {d}");
        }
        let corner = disk_concentric(Vec2::new(1.0, 0.0));
        assert!((corner - Vec2::new(0.5f32.sqrt(), -(0.5f32.sqrt()))).length() < 1e-6, "{corner}");
    }

    #[test]
    fn inverses_undo() {
        for i in 0..20_000u32 {
            let at = |m: u32| (i.wrapping_mul(m) >> 8) as f32 / 16_777_216.0;
            let u = Vec2::new(at(2_654_435_769), at(3_812_015_801));
            assert!((disk_concentric_inverse(disk_concentric(u)) - u).length() < 2e-6, "{u}");
            let w = sphere_charts(u);
            assert!((w.length() - 1.0).abs() < 1e-6, "{u}");
            let back = sphere_charts_inverse(w);
            // Near the rim of a chart the same direction lies in the other as well.
            assert!((back - u).length() < 3e-6 || w.z.abs() < 1e-5, "{u} {back}");
        }
    }

    #[test]
    fn sphere_charts_keep_area() {
        let (n, mut sums) = (400, [0.0f64; 3]);
        for i in 0..n * n {
            let w = sphere_charts((Vec2::new((i % n) as f32, (i / n) as f32) + 0.5) / n as f32);
            for (sum, x) in sums.iter_mut().zip([w.x * w.x, w.y * w.y, w.z.powi(4)]) {
                *sum += f64::from(x) / f64::from(n * n);
            }
        }
        assert!((sums[0] - 1.0 / 3.0).abs() < 1e-4 && (sums[1] - 1.0 / 3.0).abs() < 1e-4 && (sums[2] - 0.2).abs() < 1e-4);
    }
}
