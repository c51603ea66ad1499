//! Smooth conductor: a mirror of share F(cosθ; η + ik) per lane, black on the inside.
//!
//! F is Fresnel's equation with a complex index [Born & Wolf 1999, §14.2]; without an index
//! (material "none") it is a perfect mirror, F = 1.
//!
//! ```xml
//! <bsdf type="conductor">
//!     <string name="material" value="Au"/>
//! </bsdf>
//! ```

use super::{Equation, Evaluation, Lobe, Lobes, Sample, Textured, fresnel};
use crate::spectrum::Spectrum;
use crate::texture::{TextureSlot, Textures};
use glam::{Vec2, Vec3};

/// Complex index of a conductor with its textures; `None` reflects everything.
#[derive(Clone, Debug)]
pub struct IndexModel(pub Option<[TextureSlot; 2]>);

/// Complex index η + ik at a point; a perfect mirror has neither.
#[derive(Clone, Copy, Debug)]
pub struct Index {
    perfect: bool,
    eta: Spectrum,
    k: Spectrum,
}

impl IndexModel {
    /// Plain numbers at `uv`.
    #[inline]
    pub fn resolve(&self, textures: &Textures, uv: Vec2) -> Index {
        match self.0 {
            None => Index { perfect: true, eta: Spectrum::BLACK, k: Spectrum::BLACK },
            Some([eta, k]) => Index { perfect: false, eta: textures.eval(eta, uv), k: textures.eval(k, uv) },
        }
    }
}

impl Index {
    /// Reflected share for a cosine ≥ 0.
    #[inline]
    pub fn reflected(&self, cos: f32) -> Spectrum {
        if self.perfect { Spectrum::ONE } else { fresnel::conductor(cos, self.eta, self.k) }
    }
}

/// Smooth conductor with its textures.
#[derive(Clone, Debug)]
pub struct Model {
    /// Complex index relative to the outside.
    pub index: IndexModel,
    /// Scales the mirror.
    pub reflectance: TextureSlot,
}

/// Smooth conductor at a point.
#[derive(Clone, Copy, Debug)]
pub struct Conductor {
    index: Index,
    reflectance: Spectrum,
}

impl Textured for Model {
    type At<'a> = Conductor;

    #[inline]
    fn resolve<'a>(&'a self, textures: &'a Textures, uv: Vec2) -> Conductor {
        Conductor { index: self.index.resolve(textures, uv), reflectance: textures.eval(self.reflectance, uv) }
    }

    fn lobes(&self) -> Lobes {
        Lobes { mirror: true, ..Lobes::default() }
    }

    fn albedo_bound(&self, textures: &Textures) -> Spectrum {
        textures.max(self.reflectance)
    }
}

impl Lobe for Conductor {
    #[inline]
    fn evaluate(&self, _: Equation, _: Vec3, _: Vec3) -> Evaluation {
        Evaluation::default()
    }

    #[inline]
    fn sample(&self, _: Equation, w_back: Vec3, _: f32, _: Vec2) -> Option<Sample> {
        let cos = w_back.z.abs();
        if cos == 0.0 {
            return None;
        }
        let mirrored = Vec3::new(-w_back.x, -w_back.y, w_back.z);
        Some(Sample::dirac(mirrored, self.reflectance * self.index.reflected(cos), 1.0, 1.0))
    }

    #[inline]
    fn is_delta(&self) -> bool {
        true
    }

    #[inline]
    fn roughness(&self) -> f32 {
        0.0
    }
}
