//! Microfacet distributions: how many facets have the normal m, D(m), and which of them are seen.
//!
//! GGX and Beckmann, anisotropic by stretching [Heitz 2014, §5.3], with Smith's separable masking
//! G = G₁(w_back)·G₁(w_next) as in Mitsuba 3. Facets are sampled among those visible from a
//! direction, p(m) = D(m) G₁(w) |w·m| / |cosθ| [Heitz & d'Eon 2014].
//!
//! Masking is always needed over the cosine, and that quotient stays finite at grazing angles:
//! [`Masking`] holds it exactly, since a density must be that of the sampler, together with the ratio
//! of the model's value to it: Mitsuba's rational fit of Beckmann's G₁ is off by up to 0.35 %.

pub mod beckmann;
pub mod ggx;
pub mod gtr1;

use crate::describe::MicrofacetDescription;
use glam::{Vec2, Vec3};

/// Below this the distribution is narrower than f32 directions can follow (Mitsuba's bound).
pub const LEAST_ALPHA: f32 = 1e-4;

/// A distribution of facet normals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Microfacet {
    kind: MicrofacetDescription,
    /// Roughness along x and y.
    alpha: Vec2,
}

/// Smith's masking of one direction, divided by the cosine of that direction.
#[derive(Clone, Copy, Debug)]
pub struct Masking {
    /// G₁/|cosθ|, normalises the visible facets.
    pub visible: f32,
    /// G₁ as the model has it over the exact one: 1 for GGX.
    pub ratio: f32,
}

impl Masking {
    /// G₁/|cosθ| as the model has it.
    #[inline]
    pub fn g(self) -> f32 {
        self.visible * self.ratio
    }
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
            MicrofacetDescription::Ggx => Masking { visible: ggx::g1_over_cos(cos, stretched), ratio: 1.0 },
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

    /// Visits facet normals visible from `w` at all pairs of `nodes` (point of [0, 1], weight), each
    /// with the product of its weights: a quadrature over the visible facets, in the map of the unit
    /// square that Mitsuba 3 uses.
    pub(super) fn visit_visible(&self, w: Vec3, nodes: &[(f32, f32)], mut visit: impl FnMut(Vec3, f32)) {
        match self.kind {
            MicrofacetDescription::Ggx => {
                for (v, weight_v) in nodes {
                    for (u, weight_u) in nodes {
                        visit(ggx::sample_visible_by_disk(self.alpha, w, Vec2::new(*u, *v)), weight_u * weight_v);
                    }
                }
            }
            MicrofacetDescription::Beckmann => {
                let facets = beckmann::VisibleSlopes::new(self.alpha, w);
                // The two slopes are independent: as many inversions as nodes, not as pairs of them.
                let across: Vec<f32> = nodes.iter().map(|(v, _)| beckmann::VisibleSlopes::across(*v)).collect();
                for (u, weight_u) in nodes {
                    let along = facets.along(*u);
                    for (across, (_, weight_v)) in across.iter().zip(nodes) {
                        visit(facets.normal(Vec2::new(along, *across)), weight_u * weight_v);
                    }
                }
            }
        }
    }
}
