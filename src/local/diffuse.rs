//! Lambert's diffuse reflection: f = ρ/π on one side of the surface, p_w = |cosθ_next|/π.
//!
//! [Lambert 1760]. Black on the inside; wrap it in `twosided` for both sides. Sampling is exact: the
//! weight of every sample is ρ.
//!
//! ```xml
//! <bsdf type="diffuse">
//!     <rgb name="reflectance" value="0.2 0.25 0.7"/>
//! </bsdf>
//! ```

use super::{Equation, Evaluation, Lobe, Lobes, Sample, Textured};
use crate::math::warp::hemisphere_cosine;
use crate::spectrum::Spectrum;
use crate::texture::{TextureSlot, Textures};
use glam::{Vec2, Vec3};
use std::f32::consts::FRAC_1_PI;

/// Diffuse reflection with its texture.
#[derive(Clone, Debug)]
pub struct Model {
    /// ρ.
    pub reflectance: TextureSlot,
}

/// Diffuse reflection at a point.
#[derive(Clone, Copy, Debug)]
pub struct Diffuse {
    /// ρ.
    pub reflectance: Spectrum,
}

impl Textured for Model {
    type At<'a> = Diffuse;

    #[inline]
    fn resolve<'a>(&'a self, textures: &'a Textures, uv: Vec2) -> Diffuse {
        Diffuse { reflectance: textures.eval(self.reflectance, uv) }
    }

    fn lobes(&self) -> Lobes {
        Lobes { diffuse: true, ..Lobes::default() }
    }

    fn albedo_bound(&self, textures: &Textures) -> Spectrum {
        textures.max(self.reflectance)
    }
}

impl Lobe for Diffuse {
    #[inline]
    fn evaluate(&self, _: Equation, w_back: Vec3, w_next: Vec3) -> Evaluation {
        if w_back.z * w_next.z <= 0.0 {
            return Evaluation::default();
        }
        Evaluation { f: self.reflectance * FRAC_1_PI, p_w: w_next.z.abs() * FRAC_1_PI, p_w_rev: w_back.z.abs() * FRAC_1_PI }
    }

    #[inline]
    fn density(&self, w_back: Vec3, w_next: Vec3) -> f32 {
        if w_back.z * w_next.z <= 0.0 { 0.0 } else { w_next.z.abs() * FRAC_1_PI }
    }

    #[inline]
    fn sample(&self, _: Equation, w_back: Vec3, _: f32, u: Vec2) -> Option<Sample> {
        let mut w_next = hemisphere_cosine(u);
        if w_next.z * w_back.z.abs() <= 0.0 {
            return None;
        }
        let p = w_next.z * FRAC_1_PI;
        w_next.z = w_next.z.copysign(w_back.z);
        Some(Sample::smooth(w_next, self.reflectance, p, w_back.z.abs() * FRAC_1_PI))
    }

    #[inline]
    fn is_delta(&self) -> bool {
        false
    }

    #[inline]
    fn roughness(&self) -> f32 {
        1.0
    }
}
