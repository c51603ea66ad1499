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
pub(super) struct Facet {
    /// D(m).
    pub d: f32,
    /// w_back·m and w_next·m.
    pub cos_back: f32,
    pub cos_next: f32,
    /// What it is for w_back.
    pub b: Boundary,
    /// Both directions are on the same side of the surface.
    pub reflects: bool,
}

impl Facet {
    /// The facet that turns `w_back` into `w_next`, where there is one; with the index inside over that outside, and its inverse.
    #[inline]
    pub fn between(facets: &Microfacet, [eta, inv_eta]: [f32; 2], w_back: Vec3, w_next: Vec3) -> Option<Self> {
        let side = w_back.z * w_next.z;
        if side == 0.0 {
            return None;
        }
        let reflects = side > 0.0;
        let scale = match (reflects, w_back.z > 0.0) {
            (true, _) => 1.0,
            (false, true) => eta,
            (false, false) => inv_eta,
        };
        let m = (w_back + w_next * scale).normalize_or_zero();
        let m = if m.z < 0.0 { -m } else { m };
        let (cos_back, cos_next) = (w_back.dot(m), w_next.dot(m));
        // A facet is seen from the front of the surface where it is seen from its own front.
        if !(cos_back * w_back.z > 0.0 && cos_next * w_next.z > 0.0) {
            return None;
        }
        Some(Self { d: facets.d(m), cos_back, cos_next, b: boundary(cos_back, eta, inv_eta), reflects })
    }

    /// One visible from `w_back`, and the direction into which it mirrors or refracts, as `reflects` decides by what it is and
    /// by w_back·m.
    #[inline]
    pub fn sample(
        facets: &Microfacet,
        [eta, inv_eta]: [f32; 2],
        w_back: Vec3,
        u: Vec2,
        reflects: impl FnOnce(&Boundary, f32) -> bool,
    ) -> Option<(Vec3, Self)> {
        let m = facets.sample_visible(if w_back.z < 0.0 { -w_back } else { w_back }, u);
        let cos_back = w_back.dot(m);
        let b = boundary(cos_back, eta, inv_eta);
        let reflects = reflects(&b, cos_back);
        let w_next = if reflects { 2.0 * cos_back * m - w_back } else { b.refract_at(w_back, m, cos_back) };
        let cos_next = w_next.dot(m);
        let same_side = w_back.z * w_next.z > 0.0;
        if !(cos_back * w_back.z > 0.0 && cos_next * w_next.z > 0.0 && same_side == reflects) {
            return None;
        }
        Some((w_next, Self { d: facets.d(m), cos_back, cos_next, b, reflects }))
    }

    /// `D(m)` times the Jacobian, without masking and the share of light: the factor that both densities share.
    #[inline]
    pub fn density(&self) -> f32 {
        if self.reflects {
            return 0.25 * self.d;
        }
        let root = self.cos_back + self.b.eta * self.cos_next;
        let product = (self.cos_back * self.cos_next).abs();
        // Without refraction (index 1) no facet can be told from the two directions.
        if root == 0.0 { 0.0 } else { self.d * product / (root * root) }
    }

    /// The same times the share of light of a dielectric.
    #[inline]
    fn shared_density(&self) -> f32 {
        self.density() * if self.reflects { self.b.reflected } else { 1.0 - self.b.reflected }
    }
}

impl RoughDielectric {
    #[inline]
    fn facet(&self, w_back: Vec3, w_next: Vec3) -> Option<Facet> {
        Facet::between(&self.facets, [self.eta, self.inv_eta], w_back, w_next)
    }
}

impl Lobe for RoughDielectric {
    #[inline]
    fn evaluate(&self, equation: Equation, w_back: Vec3, w_next: Vec3) -> Evaluation {
        let Some(facet) = self.facet(w_back, w_next) else { return Evaluation::default() };
        let shared = facet.shared_density();
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
        facet.shared_density() * self.facets.masking(w_back).visible * p_scale
    }

    #[inline]
    fn sample(&self, equation: Equation, w_back: Vec3, u_lobe: f32, u: Vec2) -> Option<Sample> {
        if w_back.z == 0.0 {
            return None;
        }
        let eta = [self.eta, self.inv_eta];
        let (w_next, facet) = Facet::sample(&self.facets, eta, w_back, u, |b, _| u_lobe < b.reflected)?;
        let (b, reflects) = (facet.b, facet.reflects);
        let shared = facet.shared_density();
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
