//! The built scene: immutable, all indices resolved, ready to be walked.
//!
//! - `geometry`: shapes, ray casting h(x, ω), surface points.
//! - `emitter`: emission Lᵉ: evaluated, sampled for shooting, sampled for next events.
//! - `sensor`: the measurement Wᵉ of a pixel: rays out, points projected back.

mod build;
pub mod emitter;
pub mod geometry;
mod hash;
mod rigid;
pub mod sensor;
#[cfg(test)]
mod tests;

pub use crate::local::MaterialId;
pub use build::SceneInfo;

use crate::describe::{FilmDescription, IntegratorDescription};
use crate::local::Materials;
use emitter::Lights;
use geometry::Geometry;
use glam::{Vec2, Vec3};
use sensor::Sensor;

/// Everything that is measured, seen by one sensor. Immutable, shared by all threads.
pub struct Scene {
    /// Shapes: h(x, ω), surface points, visibility.
    pub geometry: Geometry,
    /// Local models f(w_i, w_o) with their textures.
    pub materials: Materials,
    /// Emission Lᵉ with its textures.
    pub lights: Lights,
    /// The measurement Wᵉ.
    pub sensor: Sensor,
    /// Size, crop window and filter of the image.
    pub film: FilmDescription,
    /// What the integrator element asks for.
    pub integrator: IntegratorDescription,
    /// Samples per pixel that the scene asks for.
    pub sample_count: Option<u32>,
    /// Seed that the scene asks for.
    pub seed: u64,
    /// Local models that some shape has, each once.
    pub used_materials: Vec<MaterialId>,
    hash: [u8; 32],
}

impl Scene {
    /// Identity of what is rendered: equal for equal content, wherever its files are and whatever its
    /// elements are called.
    pub fn hash(&self) -> [u8; 32] {
        self.hash
    }

    /// [`Self::hash`] in hexadecimal digits.
    pub fn hash_hex(&self) -> String {
        blake3::Hash::from_bytes(self.hash).to_hex().to_string()
    }
}

/// Index of a built emitter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EmitterId(pub u32);

impl EmitterId {
    /// "No emitter here."
    pub const NONE: Self = Self(u32::MAX);
}

impl Default for EmitterId {
    fn default() -> Self {
        Self::NONE
    }
}

/// All that is known of a surface point before its local model is resolved.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// Position, world.
    pub p: Vec3,
    /// Bound of the rounding error of `p`, same for all axes (metres).
    pub p_error: f32,
    /// Unit geometric normal, on the same side as `n_s`.
    pub n_g: Vec3,
    /// Unit shading normal.
    pub n_s: Vec3,
    /// Direction of growing u (not normalised; may be zero), for anisotropic models.
    pub dp_du: Vec3,
    /// Texture coordinates; anything where neither material nor emitter has a texture.
    pub uv: Vec2,
    /// Index of the shape in the built geometry.
    pub shape: u32,
    /// Its local model.
    pub material: MaterialId,
    /// Its area emitter, or [`EmitterId::NONE`].
    pub emitter: EmitterId,
}
