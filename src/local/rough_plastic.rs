//! Rough plastic: a rough dielectric coat over a diffuse base.
//!
//! f = s F D G / (4 |c_i| |c_o|) + (ρ/π) T(c_i) T(c_o) / (η² (1 − ρ' R_int)): the reflection of
//! [Walter 2007, eq. 20] and a base as in [`plastic`](super::plastic), where T(c), what the rough
//! coat lets in, and R_int, what it sends back inside on average, are integrals over its visible
//! facets. They are tabulated when the scene is built, T at 64 cosines and joined by straight lines,
//! by the same quadrature as Mitsuba 3 uses. Coat or base is chosen by T and by the means of the two
//! reflectances. Black on the inside.
//!
//! ```xml
//! <bsdf type="roughplastic">
//!     <string name="distribution" value="ggx"/>
//!     <float name="alpha" value="0.3"/>
//!     <float name="int_ior" value="1.61"/>
//!     <rgb name="diffuse_reflectance" value="0.5 0.1 0.1"/>
//! </bsdf>
//! ```

use super::fresnel::{boundary, dielectric};
use super::microfacet::Microfacet;
use super::plastic::{base, coat_share, prob_coat};
use super::rough_conductor::{FacetReflection, half_direction};
use super::{Equation, Evaluation, Lobe, Lobes, Sample, Textured};
use crate::math::warp::hemisphere_cosine;
use crate::spectrum::Spectrum;
use crate::texture::{TextureSlot, Textures};
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use std::f32::consts::FRAC_1_PI;
use std::sync::Arc;

/// Number of cosines at which the coat's transmittance is known.
const RESOLUTION: usize = 64;

/// The coat as the base sees it.
#[derive(Debug)]
pub struct Coat {
    facets: Microfacet,
    eta: f32,
    inv_eta: f32,
    transmittance: [f32; RESOLUTION],
    inside: f32,
}

impl Coat {
    /// Is it that of these parameters?
    pub fn is(&self, facets: Microfacet, eta: f32) -> bool {
        self.facets == facets && self.eta == eta
    }

    /// For facets and the index `eta`, not 1, of the coat over that outside.
    pub fn new(facets: Microfacet, eta: f32) -> Self {
        let directions: Vec<Vec3> = (0..RESOLUTION)
            .map(|i| (i as f32 / (RESOLUTION - 1) as f32).max(1e-6))
            .map(|mu| Vec3::new((1.0 - mu * mu).sqrt(), 0.0, mu))
            .collect();
        let nodes = |eta: f32| gauss_legendre(if eta > 1.0 { 32 } else { 128 });
        let (outer, inner) = (nodes(eta), nodes(1.0 / eta));
        let table: Vec<f32> = directions.par_iter().map(|w| transmitted(&facets, *w, eta, &outer)).collect();
        let inside: Vec<f32> = directions.par_iter().map(|w| reflected(&facets, *w, 1.0 / eta, &inner) * w.z).collect();
        let mut transmittance = [0.0; RESOLUTION];
        transmittance.copy_from_slice(&table);
        Self { facets, eta, inv_eta: 1.0 / eta, transmittance, inside: 2.0 * inside.iter().sum::<f32>() / RESOLUTION as f32 }
    }

    /// Share of light from a direction of cosine `cos` that reaches the base.
    #[inline]
    pub fn transmitted(&self, cos: f32) -> f32 {
        let x = cos * (RESOLUTION - 1) as f32;
        let i = (x as usize).min(RESOLUTION - 2);
        let t = x - i as f32;
        self.transmittance[i] * (1.0 - t) + self.transmittance[i + 1] * t
    }

    /// Share of diffuse light from inside that is sent back.
    pub fn inside(&self) -> f32 {
        self.inside
    }
}

/// Nodes and weights on [0, 1] of the rule of Gauss and Legendre of order `n`: roots of P_n by
/// Newton's method.
fn gauss_legendre(n: usize) -> Vec<(f32, f32)> {
    let order = n as f64;
    (0..n)
        .map(|i| {
            let mut x = -(std::f64::consts::PI * (i as f64 + 0.75) / (order + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..8 {
                let (mut below, mut p) = (1.0, x);
                for k in 2..=n {
                    let k = k as f64;
                    (below, p) = (p, ((2.0 * k - 1.0) * x * p - (k - 1.0) * below) / k);
                }
                slope = order * (x * p - below) / (x * x - 1.0);
                x -= p / slope;
            }
            ((0.5 + 0.5 * x) as f32, (1.0 / ((1.0 - x * x) * slope * slope)) as f32)
        })
        .collect()
}

/// Share of light from `w` that facets refract to the other side, masked there.
fn transmitted(facets: &Microfacet, w: Vec3, eta: f32, nodes: &[(f32, f32)]) -> f32 {
    let inv_eta = 1.0 / eta;
    let mut sum = 0.0;
    facets.visit_visible(w, nodes, |m, weight| {
        let cos = w.dot(m);
        let b = boundary(cos, eta, inv_eta);
        let out = b.refract_at(w, m, cos);
        if out.z < 0.0 && out.dot(m) < 0.0 {
            sum += weight * facets.masking(out).g() * out.z.abs() * (1.0 - b.reflected);
        }
    });
    sum
}

/// Share of light from `w` that facets mirror to the same side, masked there.
fn reflected(facets: &Microfacet, w: Vec3, eta: f32, nodes: &[(f32, f32)]) -> f32 {
    let inv_eta = 1.0 / eta;
    let mut sum = 0.0;
    facets.visit_visible(w, nodes, |m, weight| {
        let cos = w.dot(m);
        let out = 2.0 * cos * m - w;
        if out.z > 0.0 && cos > 0.0 {
            sum += weight * facets.masking(out).g() * out.z * dielectric(cos, eta, inv_eta);
        }
    });
    sum
}

/// Rough plastic with its textures.
#[derive(Clone, Debug)]
pub struct Model {
    nonlinear: bool,
    coat_share: f32,
    diffuse: TextureSlot,
    specular: TextureSlot,
    coat: Arc<Coat>,
}

impl Model {
    /// A base under a coat.
    pub fn new(coat: Arc<Coat>, nonlinear: bool, [diffuse, specular]: [TextureSlot; 2], textures: &Textures) -> Self {
        Self { nonlinear, coat_share: coat_share(diffuse, specular, textures), diffuse, specular, coat }
    }

    fn base(&self, reflectance: Spectrum) -> Spectrum {
        base(reflectance, self.nonlinear, self.coat.inside, self.coat.inv_eta)
    }
}

/// Rough plastic at a point.
#[derive(Clone, Copy, Debug)]
pub struct RoughPlastic<'a> {
    base: Spectrum,
    specular: Spectrum,
    coat: &'a Coat,
    coat_share: f32,
}

impl Textured for Model {
    type At<'a> = RoughPlastic<'a>;

    #[inline]
    fn resolve<'a>(&'a self, textures: &'a Textures, uv: Vec2) -> RoughPlastic<'a> {
        RoughPlastic {
            base: self.base(textures.eval(self.diffuse, uv)),
            specular: textures.eval(self.specular, uv),
            coat: &self.coat,
            coat_share: self.coat_share,
        }
    }

    fn lobes(&self) -> Lobes {
        Lobes { diffuse: true, glossy: true, ..Lobes::default() }
    }

    fn albedo_bound(&self, textures: &Textures) -> Spectrum {
        textures.max(self.specular).lane_max(self.base(textures.max(self.diffuse)))
    }
}

impl RoughPlastic<'_> {
    /// Probability of the coat and transmittance for a direction of cosine `cos`.
    #[inline]
    fn coat(&self, cos: f32) -> (f32, f32) {
        let t = self.coat.transmitted(cos);
        (prob_coat(1.0 - t, self.coat_share), t)
    }
}

impl Lobe for RoughPlastic<'_> {
    #[inline]
    fn evaluate(&self, _: Equation, w_back: Vec3, w_next: Vec3) -> Evaluation {
        if w_back.z * w_next.z <= 0.0 {
            return Evaluation::default();
        }
        let (c_back, c_next) = (w_back.z.abs(), w_next.z.abs());
        let m = half_direction(w_back, w_next);
        let quarter_d = 0.25 * self.coat.facets.d(m);
        let (back, next) = (self.coat.facets.masking(w_back), self.coat.facets.masking(w_next));
        let reflected = dielectric(w_back.dot(m).abs(), self.coat.eta, self.coat.inv_eta);
        let ((coat_back, t_back), (coat_next, t_next)) = (self.coat(c_back), self.coat(c_next));
        Evaluation {
            f: self.specular * (reflected * quarter_d * back.g() * next.g()) + self.base * (FRAC_1_PI * t_back * t_next),
            p_w: coat_back * quarter_d * back.visible + (1.0 - coat_back) * c_next * FRAC_1_PI,
            p_w_rev: coat_next * quarter_d * next.visible + (1.0 - coat_next) * c_back * FRAC_1_PI,
        }
    }

    #[inline]
    fn density(&self, w_back: Vec3, w_next: Vec3) -> f32 {
        if w_back.z * w_next.z <= 0.0 {
            return 0.0;
        }
        let quarter_d = 0.25 * self.coat.facets.d(half_direction(w_back, w_next));
        let (coat, _) = self.coat(w_back.z.abs());
        coat * quarter_d * self.coat.facets.masking(w_back).visible + (1.0 - coat) * w_next.z.abs() * FRAC_1_PI
    }

    #[inline]
    fn sample(&self, equation: Equation, w_back: Vec3, u_lobe: f32, u: Vec2) -> Option<Sample> {
        if w_back.z == 0.0 {
            return None;
        }
        let (coat, _) = self.coat(w_back.z.abs());
        let w_next = if u_lobe < coat {
            FacetReflection::sample(&self.coat.facets, w_back, u)?.w_next
        } else {
            let w = hemisphere_cosine(u);
            Vec3::new(w.x, w.y, w.z.copysign(w_back.z))
        };
        let e = self.evaluate(equation, w_back, w_next);
        if !(e.p_w > 0.0 && e.p_w < f32::INFINITY) {
            return None;
        }
        Some(Sample::smooth(w_next, e.f * (w_next.z.abs() / e.p_w), e.p_w, e.p_w_rev))
    }

    #[inline]
    fn is_delta(&self) -> bool {
        false
    }

    /// That of the coat.
    #[inline]
    fn roughness(&self) -> f32 {
        self.coat.facets.roughness()
    }
}
