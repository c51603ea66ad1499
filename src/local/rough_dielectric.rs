//! Rough boundary of two dielectrics: mirrors and refractions at facets of normal m.
//!
//! Reflection f = F D G / (4 |c_i| |c_o|); refraction, with light from w_i to w_o,
//! f = (1 − F) D G n_o² |w_i·m| |w_o·m| / (|c_i| |c_o| (n_i w_i·m + n_o w_o·m)²)
//! [Walter 2007, eq. 20 and 21]. Hence f(i→o)/n_o² = f(o→i)/n_i²: what Mitsuba 3 calls a mode of
//! transport is nothing but the order of the arguments. The lobe is chosen by F at the sampled
//! facet. One bounce among the facets only.
//!
//! ```xml
//! <bsdf type="roughdielectric">
//!     <string name="distribution" value="ggx"/>
//!     <float name="alpha" value="0.1"/>
//!     <string name="int_ior" value="bk7"/>
//!     <string name="ext_ior" value="air"/>
//! </bsdf>
//! ```

use super::fresnel::{Boundary, boundary};
use super::microfacet::Microfacet;
use super::rough_conductor::RoughnessModel;
use super::{Equation, Evaluation, Lobe, Lobes, Sample, Textured};
use crate::spectrum::Spectrum;
use crate::texture::{TextureSlot, Textures};
use glam::{Vec2, Vec3};

/// Rough boundary with its textures.
#[derive(Clone, Debug)]
pub struct Model {
    /// Roughness.
    pub roughness: RoughnessModel,
    /// Index inside over index outside, not 1.
    pub eta: f32,
    /// Scales the reflection.
    pub reflectance: TextureSlot,
    /// Scales the refraction.
    pub transmittance: TextureSlot,
}

/// Rough boundary at a point.
#[derive(Clone, Copy, Debug)]
pub struct RoughDielectric {
    reflectance: Spectrum,
    transmittance: Spectrum,
    facets: Microfacet,
    eta: f32,
    inv_eta: f32,
}

impl Textured for Model {
    type At<'a> = RoughDielectric;

    #[inline]
    fn resolve<'a>(&'a self, textures: &'a Textures, uv: Vec2) -> RoughDielectric {
        RoughDielectric {
            reflectance: textures.eval(self.reflectance, uv),
            transmittance: textures.eval(self.transmittance, uv),
            facets: self.roughness.resolve(textures, uv),
            eta: self.eta,
            inv_eta: 1.0 / self.eta,
        }
    }

    fn lobes(&self) -> Lobes {
        Lobes { glossy: true, glossy_refraction: true, ..Lobes::default() }
    }

    fn is_anisotropic(&self) -> bool {
        self.roughness.is_anisotropic()
    }

    fn albedo_bound(&self, textures: &Textures) -> Spectrum {
        textures.max(self.reflectance).lane_max(textures.max(self.transmittance))
    }
}

/// A facet that connects two directions.
struct Facet {
    d: f32,
    /// w_back·m and w_next·m.
    cos_back: f32,
    cos_next: f32,
    b: Boundary,
    reflects: bool,
}

impl RoughDielectric {
    /// The facet that turns `w_back` into `w_next`, where there is one.
    #[inline]
    fn facet(&self, w_back: Vec3, w_next: Vec3) -> Option<Facet> {
        let side = w_back.z * w_next.z;
        if side == 0.0 {
            return None;
        }
        let reflects = side > 0.0;
        let scale = match (reflects, w_back.z > 0.0) {
            (true, _) => 1.0,
            (false, true) => self.eta,
            (false, false) => self.inv_eta,
        };
        let m = (w_back + w_next * scale).normalize_or_zero();
        let m = if m.z < 0.0 { -m } else { m };
        let (cos_back, cos_next) = (w_back.dot(m), w_next.dot(m));
        // A facet is seen from the front of the surface where it is seen from its own front.
        if !(cos_back * w_back.z > 0.0 && cos_next * w_next.z > 0.0) {
            return None;
        }
        Some(Facet { d: self.facets.d(m), cos_back, cos_next, b: boundary(cos_back, self.eta, self.inv_eta), reflects })
    }

    /// `D(m)` times the Jacobian and the probability of the lobe, without masking: the factor that
    /// both densities share.
    #[inline]
    fn shared_density(facet: &Facet) -> f32 {
        if facet.reflects {
            return 0.25 * facet.d * facet.b.reflected;
        }
        let root = facet.cos_back + facet.b.eta * facet.cos_next;
        let product = (facet.cos_back * facet.cos_next).abs();
        // Without refraction (index 1) no facet can be told from the two directions.
        if root == 0.0 { 0.0 } else { facet.d * (1.0 - facet.b.reflected) * product / (root * root) }
    }
}

impl Lobe for RoughDielectric {
    #[inline]
    fn evaluate(&self, equation: Equation, w_back: Vec3, w_next: Vec3) -> Evaluation {
        let Some(facet) = self.facet(w_back, w_next) else { return Evaluation::default() };
        let shared = Self::shared_density(&facet);
        let (back, next) = (self.facets.masking(w_back), self.facets.masking(w_next));
        let eta2 = facet.b.eta * facet.b.eta;
        let (scale, p_scale, n_o2) = match (facet.reflects, equation) {
            (true, _) => (self.reflectance, 1.0, 1.0),
            (false, Equation::Rendering) => (self.transmittance, eta2, 1.0),
            (false, Equation::Potential) => (self.transmittance, eta2, eta2),
        };
        Evaluation {
            f: scale * (shared * back.g() * next.g() * n_o2),
            p_w: shared * back.visible * p_scale,
            p_w_rev: shared * next.visible,
        }
    }

    #[inline]
    fn density(&self, w_back: Vec3, w_next: Vec3) -> f32 {
        let Some(facet) = self.facet(w_back, w_next) else { return 0.0 };
        let p_scale = if facet.reflects { 1.0 } else { facet.b.eta * facet.b.eta };
        Self::shared_density(&facet) * self.facets.masking(w_back).visible * p_scale
    }

    #[inline]
    fn sample(&self, equation: Equation, w_back: Vec3, u_lobe: f32, u: Vec2) -> Option<Sample> {
        if w_back.z == 0.0 {
            return None;
        }
        let m = self.facets.sample_visible(if w_back.z < 0.0 { -w_back } else { w_back }, u);
        let cos_back = w_back.dot(m);
        let b = boundary(cos_back, self.eta, self.inv_eta);
        let reflects = u_lobe < b.reflected;
        let w_next = if reflects { 2.0 * cos_back * m - w_back } else { b.refract_at(w_back, m, cos_back) };
        let cos_next = w_next.dot(m);
        let same_side = w_back.z * w_next.z > 0.0;
        if !(cos_back * w_back.z > 0.0 && cos_next * w_next.z > 0.0 && same_side == reflects) {
            return None;
        }
        let facet = Facet { d: self.facets.d(m), cos_back, cos_next, b, reflects };
        let shared = Self::shared_density(&facet);
        let (back, next) = (self.facets.masking(w_back), self.facets.masking(w_next));
        let masked = back.ratio * next.g() * w_next.z.abs();
        let (weight, p_scale, eta) = match (reflects, equation) {
            (true, _) => (self.reflectance * masked, 1.0, 1.0),
            (false, Equation::Rendering) => (self.transmittance * (masked * b.inv_eta * b.inv_eta), b.eta * b.eta, b.eta),
            (false, Equation::Potential) => (self.transmittance * masked, b.eta * b.eta, b.eta),
        };
        let p = shared * back.visible * p_scale;
        if !(p > 0.0 && p < f32::INFINITY) {
            return None;
        }
        Some(Sample { eta, ..Sample::smooth(w_next, weight, p, shared * next.visible) })
    }

    #[inline]
    fn is_delta(&self) -> bool {
        false
    }

    #[inline]
    fn roughness(&self) -> f32 {
        self.facets.roughness()
    }
}
