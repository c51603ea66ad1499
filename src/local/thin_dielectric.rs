//! A thin sheet of a dielectric, as a window pane without thickness: all reflections between its two
//! faces summed, R = F + (1−F)²F/(1−F²) = 2F/(1+F), and 1 − R straight through.
//!
//! The geometric series is that of a pile of plates [Stokes 1860]. Light leaves with the direction
//! it came with, so this is no refraction: no factor η², and a straight Dirac function as in
//! [`null`](super::null). `int_ior` is the sheet's index, `ext_ior` that of its surroundings.
//!
//! ```xml
//! <bsdf type="thindielectric">
//!     <float name="int_ior" value="1.5"/>
//!     <string name="ext_ior" value="air"/>
//! </bsdf>
//! ```

use super::{Equation, Evaluation, Lobe, Lobes, Sample, Textured, fresnel};
use crate::spectrum::Spectrum;
use crate::texture::{TextureSlot, Textures};
use glam::{Vec2, Vec3};

/// Thin sheet with its textures.
#[derive(Clone, Debug)]
pub struct Model {
    /// Index of the sheet over that around it.
    pub eta: f32,
    /// Scales the mirror.
    pub reflectance: TextureSlot,
    /// Scales what passes.
    pub transmittance: TextureSlot,
}

/// Thin sheet at a point.
#[derive(Clone, Copy, Debug)]
pub struct ThinDielectric {
    reflectance: Spectrum,
    transmittance: Spectrum,
    eta: f32,
}

impl Textured for Model {
    type At<'a> = ThinDielectric;

    #[inline]
    fn resolve<'a>(&'a self, textures: &'a Textures, uv: Vec2) -> ThinDielectric {
        ThinDielectric {
            reflectance: textures.eval(self.reflectance, uv),
            transmittance: textures.eval(self.transmittance, uv),
            eta: self.eta,
        }
    }

    fn lobes(&self) -> Lobes {
        Lobes { mirror: true, null: true, ..Lobes::default() }
    }

    fn albedo_bound(&self, textures: &Textures) -> Spectrum {
        textures.max(self.reflectance).lane_max(textures.max(self.transmittance))
    }
}

impl Lobe for ThinDielectric {
    #[inline]
    fn evaluate(&self, _: Equation, _: Vec3, _: Vec3) -> Evaluation {
        Evaluation::default()
    }

    #[inline]
    fn sample(&self, _: Equation, w_back: Vec3, u_lobe: f32, _: Vec2) -> Option<Sample> {
        let once = fresnel::dielectric(w_back.z.abs(), self.eta, 1.0 / self.eta);
        let reflected = 2.0 * once / (1.0 + once);
        Some(if u_lobe < reflected {
            let mirrored = Vec3::new(-w_back.x, -w_back.y, w_back.z);
            Sample::dirac(mirrored, self.reflectance, reflected, reflected)
        } else {
            let p = 1.0 - reflected;
            Sample::dirac(-w_back, self.transmittance, p, p)
        })
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
