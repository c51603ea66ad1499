//! Microfacet distributions: how many facets have the normal m, D(m), and which of them are seen.
//!
//! GGX and Beckmann, anisotropic by stretching [Heitz 2014, §5.3], with Smith's separable masking
//! G = G₁(w_back)·G₁(w_next) as in Mitsuba 3. Facets are sampled among those visible from a
//! direction, p(m) = D(m) G₁(w) |w·m| / |cosθ| [Heitz & d'Eon 2014].
//!
//! Masking is always needed over the cosine, and that quotient stays finite at grazing angles:
//! [`Masking`] holds it twice, once as the model is defined (Mitsuba's rational fit of Beckmann's G₁,
//! off by up to 0.35 %) and once exactly, since a density must be that of the sampler.

pub mod beckmann;
pub mod ggx;

use crate::describe::MicrofacetDescription;
use glam::{Vec2, Vec3};

/// Below this the distribution is narrower than f32 directions can follow (Mitsuba's bound).
pub const LEAST_ALPHA: f32 = 1e-4;

/// A distribution of facet normals.
#[derive(Clone, Copy, Debug)]
pub struct Microfacet {
    kind: MicrofacetDescription,
    /// Roughness along x and y.
    alpha: Vec2,
}

/// Smith's masking of one direction, divided by the cosine of that direction.
#[derive(Clone, Copy, Debug)]
pub struct Masking {
    /// G₁/|cosθ| in the model's value.
    pub g: f32,
    /// G₁/|cosθ| that normalises the visible facets.
    pub visible: f32,
}

impl Microfacet {
    /// With roughness `alpha` along x and y, raised to [`LEAST_ALPHA`] where it is smaller (or NaN).
    #[inline]
    pub fn new(kind: MicrofacetDescription, alpha: Vec2) -> Self {
        Self { kind, alpha: Vec2::new(alpha.x.max(LEAST_ALPHA), alpha.y.max(LEAST_ALPHA)) }
    }

    /// The lesser of the two roughnesses.
    #[inline]
    pub fn roughness(&self) -> f32 {
        self.alpha.min_element().min(1.0)
    }

    /// Density D(m) of facet normals, ∫ D(m) cosθ_m dω = 1; `m.z` > 0. Zero where it would be lost in
    /// the range of f32.
    #[inline]
    pub fn d(&self, m: Vec3) -> f32 {
        let d = match self.kind {
            MicrofacetDescription::Ggx => ggx::d(self.alpha, m),
            MicrofacetDescription::Beckmann => beckmann::d(self.alpha, m),
        };
        if d * m.z > 1e-20 { d } else { 0.0 }
    }

    /// Masking of the direction `w`, which must not be exactly grazing.
    #[inline]
    pub fn masking(&self, w: Vec3) -> Masking {
        let cos = w.z.abs();
        let stretched = (self.alpha * w.truncate()).length_squared();
        match self.kind {
            MicrofacetDescription::Ggx => {
                let g = ggx::g1_over_cos(cos, stretched);
                Masking { g, visible: g }
            }
            MicrofacetDescription::Beckmann => beckmann::masking(cos, stretched),
        }
    }

    /// A facet normal visible from `w` (`w.z` > 0), with density `D(m) · visible(w) · w·m`.
    #[inline]
    pub fn sample_visible(&self, w: Vec3, u: Vec2) -> Vec3 {
        match self.kind {
            MicrofacetDescription::Ggx => ggx::sample_visible(self.alpha, w, u),
            MicrofacetDescription::Beckmann => beckmann::sample_visible(self.alpha, w, u),
        }
    }

    /// The same with the map of the unit square that Mitsuba 3 uses, for tables made by quadrature
    /// in it.
    pub(super) fn sample_visible_tabulated(&self, w: Vec3, u: Vec2) -> Vec3 {
        match self.kind {
            MicrofacetDescription::Ggx => ggx::sample_visible_by_disk(self.alpha, w, u),
            MicrofacetDescription::Beckmann => beckmann::sample_visible(self.alpha, w, u),
        }
    }
}
