//! GGX: D(m) = 1 / (π α_u α_v (m_x²/α_u² + m_y²/α_v² + m_z²)²) [Walter 2007, eq. 33].
//!
//! Stretched by (α_u, α_v, 1) the facets are a hemisphere, and those visible from a direction are
//! the halves between it and a spherical cap of uniform mirror directions [Dupuy & Benyoub 2023]:
//! one square root and one angle instead of a warped disk.

use crate::math::warp::{disk_concentric, sin_cos_turn};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// Density of facet normals, with the only division at the end.
#[inline]
pub fn d(alpha: Vec2, m: Vec3) -> f32 {
    let product = alpha.x * alpha.y;
    let s = Vec3::new(m.x * alpha.y, m.y * alpha.x, m.z * product).length_squared();
    product * product * product / (PI * s * s)
}

/// G₁/|cosθ| = 2 / (|cosθ| + √(cos²θ + α²sin²θ)), where `stretched` is α²sin²θ.
#[inline]
pub fn g1_over_cos(cos: f32, stretched: f32) -> f32 {
    2.0 / (cos + (cos * cos + stretched).sqrt())
}

/// A facet normal visible from `w`.
#[inline]
pub fn sample_visible(alpha: Vec2, w: Vec3, u: Vec2) -> Vec3 {
    let s = (w * alpha.extend(1.0)).normalize();
    // h = s + c with c uniform on the cap z > −s.z; its height is written so as not to cancel.
    let height = (1.0 - u.y) * (1.0 + s.z);
    let c_z = height - s.z;
    let r = (1.0 - c_z * c_z).max(0.0).sqrt();
    let (sin, cos) = sin_cos_turn(u.x);
    let h = Vec3::new(s.x + r * cos, s.y + r * sin, height);
    (h * alpha.extend(1.0)).normalize()
}

/// The same distribution by the map of [Heitz 2018]: a disk whose one half is squeezed towards the
/// projection of the far hemisphere.
pub fn sample_visible_by_disk(alpha: Vec2, w: Vec3, u: Vec2) -> Vec3 {
    let s = (w * alpha.extend(1.0)).normalize();
    let sin_s = s.truncate().length();
    let (cos_phi, sin_phi) = if sin_s > 0.0 { (s.x / sin_s, s.y / sin_s) } else { (1.0, 0.0) };
    let p = disk_concentric(u);
    let t = 0.5 * (1.0 + s.z);
    let y = (1.0 - t) * (1.0 - p.x * p.x).max(0.0).sqrt() + t * p.y;
    let z = (1.0 - p.x * p.x - y * y).max(0.0).sqrt();
    let norm = 1.0 / (sin_s * y + s.z * z);
    let slope = Vec2::new(s.z * y - sin_s * z, p.x) * norm;
    let turned = Vec2::new(cos_phi * slope.x - sin_phi * slope.y, sin_phi * slope.x + cos_phi * slope.y);
    (-turned * alpha).extend(1.0).normalize()
}
