//! The principled model: one set of artist's numbers from plastic and cloth to metal and frosted glass.
//!
//! f = F D G / (4 |c_i| |c_o|) + b √ρ (refraction) + a (diffuse + sheen) + coat [Burley 2012] [Burley 2015], with the weights
//! a = (1 − metallic)(1 − spec_trans) and b = (1 − metallic) spec_trans. Facets are GGX with α = roughness²; F is a dielectric's
//! reflection, part of it tinted or that of a metal of the colour ρ by [Schlick 1994]. Refraction is that of
//! [`roughdielectric`](super::rough_dielectric). The diffuse part is (ρ/π)(1 − F_i/2)(1 − F_o/2) and what comes back at grazing
//! angles, or with `flatness` a surface's share of scattering below it [Hanrahan & Krueger 1993]; the coat is GTR of exponent 1.
//!
//! Values are those of Mitsuba 3. As there, diffuse part and reflection are simply added, so pale ones gain energy at grazing
//! angles: 1.6 of what came at most by the diffuse part. Lobes are chosen by about what they reflect, not at fixed rates.
//! From inside only facets are seen; without `spec_trans` it is black there.
//!
//! ```xml
//! <bsdf type="principled">
//!     <rgb name="base_color" value="0.8 0.3 0.1"/>
//!     <float name="roughness" value="0.3"/>
//!     <float name="spec_trans" value="0.7"/>
//!     <float name="eta" value="1.5"/>
//!     <float name="clearcoat" value="1"/>
//! </bsdf>
//! ```

use super::fresnel::{Boundary, boundary};
use super::microfacet::{Microfacet, gtr1};
use super::rough_dielectric::Facet;
use super::{Equation, Evaluation, Lobe, Lobes, Sample, Textured};
use crate::describe::MicrofacetDescription;
use crate::math::warp::hemisphere_cosine;
use crate::spectrum::Spectrum;
use crate::texture::{TextureSlot, Textures};
use glam::{Vec2, Vec3};
use std::f32::consts::FRAC_1_PI;

/// Least α of its facets.
const LEAST_ALPHA: f32 = 1e-3;
/// α of the coat without gloss, and with all of it.
const COAT_ALPHA: [f32; 2] = [0.1, 1e-3];
/// Roughness by which the coat's facets hide each other.
const COAT_MASKING: Vec2 = Vec2::splat(0.25);
/// About what a whole coat reflects.
const COAT_ALBEDO: f32 = 0.03;
/// What sheen scatters of light at grazing angles, at most.
const SHEEN_ALBEDO: f32 = 0.09;
/// Facets are chosen with this probability at least, over that of the rest.
const LEAST_FACETS: f32 = 0.02;

/// The parameters of a principled model, all in [0, 1].
#[derive(Clone, Debug)]
pub struct Parameters {
    /// ρ.
    pub base_color: TextureSlot,
    /// √α.
    pub roughness: TextureSlot,
    /// How much more α is along the tangent.
    pub anisotropic: TextureSlot,
    /// Share that is metal.
    pub metallic: TextureSlot,
    /// Share of the rest that lets light through.
    pub spec_trans: TextureSlot,
    /// Share of the dielectric reflection that has the colour ρ.
    pub spec_tint: TextureSlot,
    /// Amount of sheen.
    pub sheen: TextureSlot,
    /// Share of it that has the colour ρ.
    pub sheen_tint: TextureSlot,
    /// Share of the diffuse part that comes from below the surface.
    pub flatness: TextureSlot,
    /// Amount of coat.
    pub clearcoat: TextureSlot,
    /// How polished it is.
    pub clearcoat_gloss: TextureSlot,
}

/// The principled model with its textures.
#[derive(Clone, Debug)]
pub struct Model {
    // Apart, so that other models stay small.
    parameters: Box<Parameters>,
    /// Index inside over index outside.
    eta: f32,
    lobes: Lobes,
    anisotropic: bool,
}

impl Model {
    /// With the index `eta` inside over that outside; what lets light through needs one that is not 1.
    pub fn new(parameters: Parameters, eta: f32, textures: &Textures) -> Self {
        let p = &parameters;
        let some = |slot| textures.max(slot).max_lane() > 0.0;
        let all = |slot| textures.min(slot).to_rgb().iter().all(|v| *v >= 1.0);
        let clear = some(p.spec_trans) && !all(p.metallic);
        let diffuse = !all(p.metallic) && !all(p.spec_trans);
        let lobes = Lobes { diffuse, glossy: true, glossy_refraction: clear, ..Lobes::default() };
        let anisotropic = some(p.anisotropic);
        let eta = if clear && eta == 1.0 { 1.001 } else { eta };
        Self { parameters: Box::new(parameters), eta, lobes, anisotropic }
    }
}

/// The principled model at a point.
#[derive(Clone, Copy, Debug)]
pub struct Principled {
    base: Spectrum,
    facets: Microfacet,
    eta: f32,
    inv_eta: f32,
    roughness: f32,
    metallic: f32,
    spec_tint: f32,
    /// a: what is opaque and no metal.
    opaque: f32,
    /// b: what lets light through.
    clear: f32,
    flatness: f32,
    /// Of what is no metal.
    sheen: f32,
    sheen_tint: f32,
    coat: f32,
    coat_alpha: f32,
}

impl Textured for Model {
    type At<'a> = Principled;

    fn resolve<'a>(&'a self, textures: &'a Textures, uv: Vec2) -> Principled {
        let p = &self.parameters;
        let share = |slot| textures.eval1(slot, uv).clamp(0.0, 1.0);
        let (roughness, metallic, spec_trans) = (share(p.roughness), share(p.metallic), share(p.spec_trans));
        let aspect = if self.anisotropic { (1.0 - 0.9 * share(p.anisotropic)).sqrt() } else { 1.0 };
        let alpha = roughness * roughness * Vec2::new(1.0 / aspect, aspect);
        let [rough, polished] = COAT_ALPHA;
        Principled {
            base: textures.eval(p.base_color, uv),
            facets: Microfacet::new(MicrofacetDescription::Ggx, alpha.max(Vec2::splat(LEAST_ALPHA))),
            eta: self.eta,
            inv_eta: 1.0 / self.eta,
            roughness,
            metallic,
            spec_tint: share(p.spec_tint),
            opaque: (1.0 - metallic) * (1.0 - spec_trans),
            clear: (1.0 - metallic) * spec_trans,
            flatness: share(p.flatness),
            sheen: (1.0 - metallic) * share(p.sheen),
            sheen_tint: share(p.sheen_tint),
            coat: share(p.clearcoat),
            coat_alpha: rough + (polished - rough) * share(p.clearcoat_gloss),
        }
    }

    fn lobes(&self) -> Lobes {
        self.lobes
    }

    fn is_anisotropic(&self) -> bool {
        self.anisotropic
    }

    fn albedo_bound(&self, textures: &Textures) -> Spectrum {
        let p = &self.parameters;
        let most = |slot| textures.max(slot).max_lane().clamp(0.0, 1.0);
        // No lane of a tint is more than that of pure blue.
        let tint = 1.0 / Spectrum::rgb(0.0, 0.0, 1.0).luminance();
        let (tinted, sheen_tinted) = (most(p.spec_tint) > 0.0, most(p.sheen_tint) > 0.0);
        let facets = if tinted { (tint * at_normal(self.eta)).max(1.0) } else { 1.0 };
        let refraction = if tinted && self.lobes.glossy_refraction { 1.0 } else { 0.0 };
        let sheen = SHEEN_ALBEDO * most(p.sheen) * if sheen_tinted { tint } else { 1.0 };
        let diffuse = if most(p.flatness) > 0.0 { 1.6 } else { 1.0 + 0.6 * most(p.roughness) };
        let below =
            if self.lobes.diffuse { textures.max(p.base_color) * diffuse + Spectrum::grey(sheen) } else { Spectrum::default() };
        below + Spectrum::grey(facets + refraction + COAT_ALBEDO * most(p.clearcoat))
    }
}

/// Reflection at normal incidence.
fn at_normal(eta: f32) -> f32 {
    let root = (eta - 1.0) / (eta + 1.0);
    root * root
}

/// (1 − cos)⁵ [Schlick 1994].
#[inline]
fn rise(cos: f32) -> f32 {
    let m = (1.0 - cos).clamp(0.0, 1.0);
    let m2 = m * m;
    m2 * m2 * m
}

/// `at_normal`, and at grazing angles all.
#[inline]
fn schlick(at_normal: Spectrum, rise: f32) -> Spectrum {
    at_normal.lerp(Spectrum::grey(1.0), rise)
}

/// Probabilities of the lobes; they sum to 1.
struct Shares {
    facets: f32,
    coat: f32,
    diffuse: f32,
}

/// A facet as its two sides see it.
#[derive(Clone, Copy)]
struct Seen {
    /// Share that a dielectric reflects.
    dielectric: f32,
    /// Cosine on the side of the normal, and beyond.
    outside: f32,
    inside: f32,
}

impl Seen {
    /// Seen from a direction of cosine `cos` with its normal.
    #[inline]
    fn of(b: &Boundary, cos: f32) -> Self {
        let (outside, inside) = if cos > 0.0 { (cos, b.cos_t.abs()) } else { (b.cos_t.abs(), cos.abs()) };
        Self { dielectric: b.reflected, outside, inside }
    }
}

impl Principled {
    /// The colour ρ without its brightness.
    #[inline]
    fn tint(&self) -> Spectrum {
        let y = self.base.luminance();
        if y > 0.0 { self.base * (1.0 / y) } else { Spectrum::grey(1.0) }
    }

    /// F on the side of the normal.
    #[inline]
    fn reflected(&self, seen: Seen) -> Spectrum {
        let rise = rise(if self.eta > 1.0 { seen.outside } else { seen.inside });
        let plain = (1.0 - self.metallic) * (1.0 - self.spec_tint) * seen.dielectric;
        let mut f = Spectrum::grey(plain);
        if self.metallic > 0.0 {
            f += schlick(self.base, rise) * self.metallic;
        }
        if self.spec_tint > 0.0 {
            f += schlick(self.tint() * at_normal(self.eta), rise) * ((1.0 - self.metallic) * self.spec_tint);
        }
        f
    }

    /// Share that is refracted.
    #[inline]
    fn refracted(&self, dielectric: f32) -> Spectrum {
        self.base.sqrt() * (self.clear * (1.0 - dielectric))
    }

    /// Share that a facet mirrors, from the side of the normal or from inside.
    #[inline]
    fn mirrored(&self, seen: Seen, front: bool) -> Spectrum {
        if front { self.reflected(seen) } else { Spectrum::grey(self.clear * seen.dielectric) }
    }

    /// Probability that a facet mirrors where it mirrors this share, and what it mirrors and refracts.
    #[inline]
    fn mirrors(&self, seen: Seen, mirrored: Spectrum) -> (f32, f32) {
        let through = if self.clear > 0.0 { self.refracted(seen.dielectric).mean() } else { 0.0 };
        let mirrored = mirrored.mean();
        let both = mirrored + through;
        (if through > 0.0 { mirrored / both } else { 1.0 }, both)
    }

    /// By about what each lobe scatters of light from a direction of cosine `cos` with the normal.
    #[inline]
    fn shares(&self, cos: f32) -> Shares {
        if cos <= 0.0 {
            return Shares { facets: 1.0, coat: 0.0, diffuse: 0.0 };
        }
        let b = boundary(cos, self.eta, self.inv_eta);
        let seen = Seen::of(&b, cos);
        let (_, facets) = self.mirrors(seen, self.reflected(seen));
        let diffuse = if self.opaque > 0.0 { self.opaque * self.base.mean() + SHEEN_ALBEDO * self.sheen } else { 0.0 };
        let (facets, coat) = (facets.max(LEAST_FACETS), COAT_ALBEDO * self.coat);
        let norm = 1.0 / (facets + coat + diffuse);
        Shares { facets: facets * norm, coat: coat * norm, diffuse: diffuse * norm }
    }

    /// Of the diffuse part and the sheen, for two cosines with the normal and that of the half direction.
    #[inline]
    fn diffuse(&self, [c_i, c_o]: [f32; 2], c_d: f32) -> Spectrum {
        let (f_i, f_o) = (rise(c_i), rise(c_o));
        let grazing = 2.0 * self.roughness * c_d * c_d;
        let back = grazing * (f_o + f_i + f_o * f_i * (grazing - 1.0));
        let mut f = (1.0 - 0.5 * f_i) * (1.0 - 0.5 * f_o) + back;
        if self.flatness > 0.0 {
            let within = |f: f32| 1.0 + (0.5 * grazing - 1.0) * f;
            let below = 1.25 * (within(f_i) * within(f_o) * (1.0 / (c_i + c_o) - 0.5) + 0.5);
            f += self.flatness * (below - f);
        }
        let plain = self.base * (self.opaque * f * FRAC_1_PI);
        if self.sheen == 0.0 {
            return plain;
        }
        plain + Spectrum::grey(1.0).lerp(self.tint(), self.sheen_tint) * (self.sheen * rise(c_d))
    }

    /// Back to the side it came from.
    fn back(&self, facet: &Facet, w_back: Vec3, w_next: Vec3) -> Evaluation {
        let seen = Seen::of(&facet.b, facet.cos_back);
        let front = w_back.z > 0.0;
        let mirrored = self.mirrored(seen, front);
        let (mirrors, _) = self.mirrors(seen, mirrored);
        let quarter_d = facet.density();
        let (back, next) = (self.facets.masking(w_back), self.facets.masking(w_next));
        let (share, share_rev) = (self.shares(w_back.z), self.shares(w_next.z));
        let mut e = Evaluation {
            f: mirrored * (quarter_d * back.g() * next.g()),
            p_w: share.facets * mirrors * quarter_d * back.visible,
            p_w_rev: share_rev.facets * mirrors * quarter_d * next.visible,
        };
        if !front {
            return e;
        }
        let (c_back, c_next, c_d) = (w_back.z, w_next.z, seen.outside);
        if self.coat > 0.0 {
            let m_z = (c_back + c_next) / (2.0 * c_d);
            let d = gtr1::d(self.coat_alpha * self.coat_alpha, m_z);
            let hidden = Microfacet::new(MicrofacetDescription::Ggx, COAT_MASKING);
            let g = hidden.masking(w_back).g() * hidden.masking(w_next).g() * c_back * c_next;
            let reflected = schlick(Spectrum::grey(0.04), rise(if self.eta > 1.0 { c_d } else { seen.inside }));
            let p = d * m_z / (4.0 * c_d);
            e.f += reflected * (0.25 * self.coat * d * g);
            e.p_w += share.coat * p;
            e.p_w_rev += share_rev.coat * p;
        }
        if self.opaque > 0.0 {
            e.f += self.diffuse([c_back, c_next], c_d);
            e.p_w += share.diffuse * c_next * FRAC_1_PI;
            e.p_w_rev += share_rev.diffuse * c_back * FRAC_1_PI;
        }
        e
    }

    /// Refracted to the other side.
    fn through(&self, equation: Equation, facet: &Facet, w_back: Vec3, w_next: Vec3) -> Evaluation {
        let seen = Seen::of(&facet.b, facet.cos_back);
        let front = w_back.z > 0.0;
        let d = facet.density();
        let (back, next) = (self.facets.masking(w_back), self.facets.masking(w_next));
        let eta2 = facet.b.eta * facet.b.eta;
        let n_o2 = if equation == Equation::Potential { eta2 } else { 1.0 };
        let leaves = |w: Vec3, front| self.shares(w.z).facets * (1.0 - self.mirrors(seen, self.mirrored(seen, front)).0);
        Evaluation {
            f: self.refracted(seen.dielectric) * (d * back.g() * next.g() * n_o2),
            p_w: leaves(w_back, front) * d * back.visible * eta2,
            p_w_rev: leaves(w_next, !front) * d * next.visible,
        }
    }

    #[inline]
    fn at(&self, equation: Equation, facet: &Facet, w_back: Vec3, w_next: Vec3) -> Evaluation {
        match facet.reflects {
            true => self.back(facet, w_back, w_next),
            false => self.through(equation, facet, w_back, w_next),
        }
    }

    /// Nothing is seen of it from inside where it lets nothing through.
    #[inline]
    fn is_black(&self, w_back: Vec3, w_next: Vec3) -> bool {
        self.clear <= 0.0 && (w_back.z < 0.0 || w_next.z < 0.0)
    }
}

impl Lobe for Principled {
    #[inline]
    fn evaluate(&self, equation: Equation, w_back: Vec3, w_next: Vec3) -> Evaluation {
        if self.is_black(w_back, w_next) {
            return Evaluation::default();
        }
        let facet = Facet::between(&self.facets, [self.eta, self.inv_eta], w_back, w_next);
        facet.map_or(Evaluation::default(), |facet| self.at(equation, &facet, w_back, w_next))
    }

    #[inline]
    fn sample(&self, equation: Equation, w_back: Vec3, u_lobe: f32, u: Vec2) -> Option<Sample> {
        if w_back.z == 0.0 || self.is_black(w_back, w_back) {
            return None;
        }
        let share = self.shares(w_back.z);
        let eta = [self.eta, self.inv_eta];
        let facet = |w_next| Some((w_next, Facet::between(&self.facets, eta, w_back, w_next)?));
        let (w_next, facet) = if u_lobe < share.diffuse {
            facet(hemisphere_cosine(u))?
        } else if u_lobe < share.diffuse + share.coat {
            let m = gtr1::sample(self.coat_alpha * self.coat_alpha, u);
            facet(2.0 * w_back.dot(m) * m - w_back).filter(|(_, facet)| facet.reflects)?
        } else {
            let u_facet = (u_lobe - share.diffuse - share.coat) / share.facets;
            Facet::sample(&self.facets, eta, w_back, u, |b, cos| {
                let seen = Seen::of(b, cos);
                u_facet < self.mirrors(seen, self.mirrored(seen, w_back.z > 0.0)).0
            })?
        };
        let e = self.at(equation, &facet, w_back, w_next);
        if !(e.p_w > 0.0 && e.p_w < f32::INFINITY) {
            return None;
        }
        let eta = if facet.reflects { 1.0 } else { facet.b.eta };
        Some(Sample { eta, ..Sample::smooth(w_next, e.f * (w_next.z.abs() / e.p_w), e.p_w, e.p_w_rev) })
    }

    #[inline]
    fn is_delta(&self) -> bool {
        false
    }

    /// That of the facets; the coat reflects too little to count.
    #[inline]
    fn roughness(&self) -> f32 {
        self.facets.roughness()
    }
}
