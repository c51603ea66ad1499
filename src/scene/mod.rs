//! The built scene: immutable, all indices resolved, ready to be walked.
//!
//! - `geometry`: shapes, ray casting h(x, ω), surface points.
//! - `emitter`: emission Lᵉ: evaluated, sampled for shooting, sampled for next events.
//! - `sensor`: the measurement Wᵉ of a pixel: rays out, points projected back.

pub mod emitter;
pub mod geometry;
mod rigid;
pub mod sensor;

pub use crate::local::MaterialId;
use glam::{Vec2, Vec3};

/// Index of a built emitter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EmitterId(pub u32);

impl EmitterId {
    /// "No emitter here."
    pub const NONE: Self = Self(u32::MAX);
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
    /// Texture coordinates.
    pub uv: Vec2,
    /// Index of the shape in the built geometry.
    pub shape: u32,
    /// Its local model.
    pub material: MaterialId,
    /// Its area emitter, or [`EmitterId::NONE`].
    pub emitter: EmitterId,
}
