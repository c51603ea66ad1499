//! Smooth boundary of two dielectrics: a mirror of share F and a refraction of share 1 − F.
//!
//! Both are Dirac functions. Basic radiance L/n² is what a refraction keeps, so that radiance is
//! multiplied by (n_back/n_next)² where a gathering walk refracts and potential by nothing where a
//! shooting walk does [Veach 1997, §5.2.2]. The lobe is chosen by F of [`fresnel`](super::fresnel);
//! `specular_reflectance` and `specular_transmittance` scale what is then carried (absorbing glass).
//! The side of the normal has the index `ext_ior`.
//!
//! ```xml
//! <bsdf type="dielectric">
//!     <string name="int_ior" value="bk7"/>
//!     <string name="ext_ior" value="air"/>
//!     <rgb name="specular_transmittance" value="0.9 1.0 0.95"/>
//! </bsdf>
//! ```

use super::fresnel::boundary;
use super::{Equation, Evaluation, Lobe, Lobes, Sample, Textured};
use crate::spectrum::Spectrum;
use crate::texture::{TextureSlot, Textures};
use glam::{Vec2, Vec3};

/// Smooth boundary with its textures.
#[derive(Clone, Debug)]
pub struct Model {
    /// Index inside over index outside.
    pub eta: f32,
    /// Scales the mirror.
    pub reflectance: TextureSlot,
    /// Scales the refraction.
    pub transmittance: TextureSlot,
}

/// Smooth boundary at a point.
#[derive(Clone, Copy, Debug)]
pub struct Dielectric {
    reflectance: Spectrum,
    transmittance: Spectrum,
    eta: f32,
    inv_eta: f32,
}

impl Textured for Model {
    type At<'a> = Dielectric;

    #[inline]
    fn resolve<'a>(&'a self, textures: &'a Textures, uv: Vec2) -> Dielectric {
        Dielectric {
            reflectance: textures.eval(self.reflectance, uv),
            transmittance: textures.eval(self.transmittance, uv),
            eta: self.eta,
            inv_eta: 1.0 / self.eta,
        }
    }

    fn lobes(&self) -> Lobes {
        Lobes { mirror: true, refraction: true, ..Lobes::default() }
    }

    fn albedo_bound(&self, textures: &Textures) -> Spectrum {
        textures.max(self.reflectance).lane_max(textures.max(self.transmittance))
    }
}

impl Lobe for Dielectric {
    #[inline]
    fn evaluate(&self, _: Equation, _: Vec3, _: Vec3) -> Evaluation {
        Evaluation::default()
    }

    #[inline]
    fn sample(&self, equation: Equation, w_back: Vec3, u_lobe: f32, _: Vec2) -> Option<Sample> {
        let b = boundary(w_back.z, self.eta, self.inv_eta);
        if u_lobe < b.reflected {
            let mirrored = Vec3::new(-w_back.x, -w_back.y, w_back.z);
            return Some(Sample::dirac(mirrored, self.reflectance, b.reflected, b.reflected));
        }
        if b.cos_t == 0.0 {
            return None;
        }
        let p = 1.0 - b.reflected;
        let weight = match equation {
            Equation::Rendering => self.transmittance * (b.inv_eta * b.inv_eta),
            Equation::Potential => self.transmittance,
        };
        let dirac_ratio = (w_back.z / b.cos_t).abs() * (b.inv_eta * b.inv_eta);
        Some(Sample { w_next: b.refract(w_back), weight, p, p_rev: p, delta: true, dirac_ratio, eta: b.eta })
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
