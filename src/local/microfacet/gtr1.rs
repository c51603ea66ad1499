//! GTR with exponent 1: D(m) = (α² − 1) / (π ln α² (1 + (α² − 1) m_z²)) [Burley 2012, §B.2].
//!
//! Its tail is longer than that of GGX. Facets are sampled by D(m) m_z alone: what is coated with them reflects little.

use crate::math::warp::sin_cos_turn;
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// Density of facet normals of cosine `cos` with the surface's, for α² below 1.
#[inline]
pub fn d(alpha2: f32, cos: f32) -> f32 {
    (alpha2 - 1.0) / (PI * alpha2.ln() * (1.0 + (alpha2 - 1.0) * cos * cos))
}

/// A facet normal, with density `d · m_z`.
#[inline]
pub fn sample(alpha2: f32, u: Vec2) -> Vec3 {
    let cos2 = ((1.0 - alpha2.powf(1.0 - u.y)) / (1.0 - alpha2)).clamp(0.0, 1.0);
    let (sin, cos) = sin_cos_turn(u.x);
    let radius = (1.0 - cos2).sqrt();
    Vec3::new(radius * cos, radius * sin, cos2.sqrt())
}
