//! A surface that emits: radiance Lᵉ(u, v) on the side of its geometric normal, in all directions.
//!
//! Power Φ = π ∫ Lᵉ dA. Emission starts uniformly by area and leaves cosine-weighted,
//! `p = 1/A · cosθ/π`, so that the weight Lᵉ·π·A varies with the texture only.

use crate::scene::geometry::{Extent, Geometry};
use crate::spectrum::Spectrum;
use crate::texture::{TextureSlot, Textures};
use glam::Vec2;
use std::f32::consts::PI;

#[derive(Clone, Copy, Debug)]
pub(super) struct Area {
    /// Index in the geometry.
    pub(super) shape: u32,
    pub(super) radiance: TextureSlot,
    /// 1/A, m⁻².
    pub(super) p_a: f32,
    /// Where it lies.
    pub(super) extent: Extent,
    /// A sphere that shines outwards.
    pub(super) sphere: bool,
}

impl Area {
    /// Φ in W; a textured one by quadrature over the area.
    pub(super) fn power(&self, geometry: &Geometry, textures: &Textures) -> Spectrum {
        let scale = PI * geometry.area(self.shape);
        if self.radiance.is_constant() {
            return textures.eval(self.radiance, Vec2::ZERO) * scale;
        }
        const N: u32 = 120;
        let mut sum = Spectrum::BLACK;
        for i in 0..N * N {
            let u = (Vec2::new((i % N) as f32, (i / N) as f32) + 0.5) / N as f32;
            sum += textures.eval(self.radiance, geometry.sample_area(self.shape, u).uv);
        }
        let mean = sum / (N * N) as f32;
        // Spots of light smaller than the grid must not make the emitter seem dark.
        let floor = textures.max(self.radiance) * (0.1 / (N * N) as f32);
        mean.lane_max(floor) * scale
    }
}
