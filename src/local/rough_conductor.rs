//! Rough conductor: f = F(w·m) D(m) G(w_i, w_o) / (4 |cosθ_i| |cosθ_o|), m the half direction.
//!
//! The reflection of [Torrance & Sparrow 1967] in the form of [Walter 2007, eq. 20] with a complex
//! index; facets are sampled as visible ones, p_w = D(m) G₁(w_back) / (4 |cosθ_back|). One bounce
//! among the facets only: what they shadow is lost. Black on the inside.
//!
//! ```xml
//! <bsdf type="roughconductor">
//!     <string name="material" value="Al"/>
//!     <string name="distribution" value="ggx"/>
//!     <float name="alpha_u" value="0.05"/>
//!     <float name="alpha_v" value="0.3"/>
//! </bsdf>
//! ```

use super::conductor::{Index, IndexModel};
use super::microfacet::Microfacet;
use super::{Equation, Evaluation, Lobe, Lobes, Sample, Textured};
use crate::describe::MicrofacetDescription;
use crate::spectrum::Spectrum;
use crate::texture::{TextureSlot, Textures};
use glam::{Vec2, Vec3};

/// Roughness of a microfacet model with its textures.
#[derive(Clone, Debug)]
pub struct RoughnessModel {
    /// GGX or Beckmann.
    pub distribution: MicrofacetDescription,
    /// Along the tangent and across it.
    pub alpha: [TextureSlot; 2],
}

impl RoughnessModel {
    /// The distribution at `uv`.
    #[inline]
    pub fn resolve(&self, textures: &Textures, uv: Vec2) -> Microfacet {
        let [u, v] = self.alpha;
        let alpha_u = textures.eval1(u, uv);
        let alpha_v = if u == v { alpha_u } else { textures.eval1(v, uv) };
        Microfacet::new(self.distribution, Vec2::new(alpha_u, alpha_v))
    }

    /// The two roughnesses differ somewhere.
    pub fn is_anisotropic(&self) -> bool {
        self.alpha[0] != self.alpha[1]
    }
}

/// Rough conductor with its textures.
#[derive(Clone, Debug)]
pub struct Model {
    /// Roughness.
    pub roughness: RoughnessModel,
    /// Complex index relative to the outside.
    pub index: IndexModel,
    /// Scales the reflection.
    pub reflectance: TextureSlot,
}

/// Rough conductor at a point.
#[derive(Clone, Copy, Debug)]
pub struct RoughConductor {
    facets: Microfacet,
    index: Index,
    reflectance: Spectrum,
}

impl Textured for Model {
    type At<'a> = RoughConductor;

    #[inline]
    fn resolve<'a>(&'a self, textures: &'a Textures, uv: Vec2) -> RoughConductor {
        RoughConductor {
            facets: self.roughness.resolve(textures, uv),
            index: self.index.resolve(textures, uv),
            reflectance: textures.eval(self.reflectance, uv),
        }
    }

    fn lobes(&self) -> Lobes {
        Lobes { glossy: true, ..Lobes::default() }
    }

    fn is_anisotropic(&self) -> bool {
        self.roughness.is_anisotropic()
    }

    fn albedo_bound(&self, textures: &Textures) -> Spectrum {
        textures.max(self.reflectance)
    }
}

impl Lobe for RoughConductor {
    #[inline]
    fn evaluate(&self, _: Equation, w_back: Vec3, w_next: Vec3) -> Evaluation {
        if w_back.z * w_next.z <= 0.0 {
            return Evaluation::default();
        }
        let m = half_direction(w_back, w_next);
        let quarter_d = 0.25 * self.facets.d(m);
        let (back, next) = (self.facets.masking(w_back), self.facets.masking(w_next));
        let reflected = self.index.reflected(w_back.dot(m).abs());
        Evaluation {
            f: self.reflectance * reflected * (quarter_d * back.g() * next.g()),
            p_w: quarter_d * back.visible,
            p_w_rev: quarter_d * next.visible,
        }
    }

    #[inline]
    fn density(&self, w_back: Vec3, w_next: Vec3) -> f32 {
        if w_back.z * w_next.z <= 0.0 {
            return 0.0;
        }
        0.25 * self.facets.d(half_direction(w_back, w_next)) * self.facets.masking(w_back).visible
    }

    #[inline]
    fn sample(&self, _: Equation, w_back: Vec3, _: f32, u: Vec2) -> Option<Sample> {
        let r = FacetReflection::sample(&self.facets, w_back, u)?;
        let next = self.facets.masking(r.w_next);
        let masked = r.ratio * next.g() * r.w_next.z.abs();
        let weight = self.reflectance * self.index.reflected(r.cos) * masked;
        Some(Sample::smooth(r.w_next, weight, r.p, r.quarter_d * next.visible))
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

/// The facet normal that reflects one direction into the other, on the side z > 0. Zero where the
/// two nearly cancel, which they cannot on the same side.
#[inline]
pub(super) fn half_direction(a: Vec3, b: Vec3) -> Vec3 {
    let m = (a + b).normalize_or_zero();
    if m.z < 0.0 { -m } else { m }
}

/// A mirror direction at a facet visible from `w_back`.
#[derive(Clone, Copy)]
pub(super) struct FacetReflection {
    /// On the side of `w_back`.
    pub w_next: Vec3,
    /// Cosine of both directions with the facet's normal.
    pub cos: f32,
    /// D(m)/4.
    pub quarter_d: f32,
    /// Density of `w_next`.
    pub p: f32,
    /// The model's masking of `w_back` over the exact one.
    pub ratio: f32,
}

impl FacetReflection {
    /// `None` where the facet mirrors into the surface.
    #[inline]
    pub fn sample(facets: &Microfacet, w_back: Vec3, u: Vec2) -> Option<Self> {
        if w_back.z == 0.0 {
            return None;
        }
        let outside = Vec3::new(w_back.x, w_back.y, w_back.z.abs());
        let m = facets.sample_visible(outside, u);
        let cos = outside.dot(m);
        let mut w_next = 2.0 * cos * m - outside;
        if !(w_next.z > 0.0 && cos > 0.0) {
            return None;
        }
        let back = facets.masking(outside);
        let quarter_d = 0.25 * facets.d(m);
        let p = quarter_d * back.visible;
        if !(p > 0.0 && p < f32::INFINITY) {
            return None;
        }
        w_next.z = w_next.z.copysign(w_back.z);
        Some(Self { w_next, cos, quarter_d, p, ratio: back.ratio })
    }
}
