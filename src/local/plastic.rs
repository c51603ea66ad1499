//! Smooth plastic: a dielectric coat, a Dirac mirror of share F, over a diffuse base.
//!
//! Base: f = (ρ/π) (1 − F_i)(1 − F_o) / (η² (1 − ρ' F_int)), where F_int is what the coat sends back
//! inside on average and ρ' is ρ (`nonlinear`) or 1 (colour is kept): all orders of light between
//! base and coat summed. The product (1 − F_i)(1 − F_o) is that of the coupled model of
//! [Shirley 1997], the series that of [Mitsuba 3]. Coat or base is chosen by F and by the means of
//! the two reflectances. Black on the inside.
//!
//! ```xml
//! <bsdf type="plastic">
//!     <rgb name="diffuse_reflectance" value="0.1 0.27 0.36"/>
//!     <float name="int_ior" value="1.9"/>
//!     <boolean name="nonlinear" value="true"/>
//! </bsdf>
//! ```

use super::fresnel::{dielectric, diffuse_reflectance};
use super::{Equation, Evaluation, Lobe, Lobes, Sample, Textured};
use crate::math::warp::hemisphere_cosine;
use crate::spectrum::Spectrum;
use crate::texture::{TextureSlot, Textures};
use glam::{Vec2, Vec3};
use std::f32::consts::FRAC_1_PI;

/// Smooth plastic with its textures.
#[derive(Clone, Debug)]
pub struct Model {
    eta: f32,
    inside: f32,
    nonlinear: bool,
    coat_share: f32,
    diffuse: TextureSlot,
    specular: TextureSlot,
}

impl Model {
    /// `eta` is the index of the coat over that outside.
    pub fn new(eta: f32, nonlinear: bool, diffuse: TextureSlot, specular: TextureSlot, textures: &Textures) -> Self {
        let inside = diffuse_reflectance(1.0 / eta);
        Self { eta, inside, nonlinear, coat_share: coat_share(diffuse, specular, textures), diffuse, specular }
    }
}

/// Share of the coat in the choice of lobes before F is known: its mean reflectance over both means.
pub(super) fn coat_share(diffuse: TextureSlot, specular: TextureSlot, textures: &Textures) -> f32 {
    let (base, coat) = (textures.mean(diffuse), textures.mean(specular));
    if base + coat > 0.0 { (coat / (base + coat)).clamp(0.0, 1.0) } else { 0.5 }
}

/// Probability of the coat where it reflects `reflected`, for its share of the means.
#[inline]
pub(super) fn prob_coat(reflected: f32, coat_share: f32) -> f32 {
    let coat = reflected * coat_share;
    let base = (1.0 - reflected) * (1.0 - coat_share);
    if coat > 0.0 { coat / (coat + base) } else { 0.0 }
}

/// `ρ / (η² (1 − ρ' F_int))`: the base with all orders between it and the coat.
#[inline]
pub(super) fn base(reflectance: Spectrum, nonlinear: bool, inside: f32, inv_eta: f32) -> Spectrum {
    let orders = if nonlinear { reflectance.map(|r| 1.0 / (1.0 - r * inside)) } else { Spectrum::grey(1.0 / (1.0 - inside)) };
    reflectance * orders * (inv_eta * inv_eta)
}

/// Smooth plastic at a point.
#[derive(Clone, Copy, Debug)]
pub struct Plastic {
    base: Spectrum,
    specular: Spectrum,
    eta: f32,
    inv_eta: f32,
    coat_share: f32,
}

impl Textured for Model {
    type At<'a> = Plastic;

    #[inline]
    fn resolve<'a>(&'a self, textures: &'a Textures, uv: Vec2) -> Plastic {
        let inv_eta = 1.0 / self.eta;
        Plastic {
            base: base(textures.eval(self.diffuse, uv), self.nonlinear, self.inside, inv_eta),
            specular: textures.eval(self.specular, uv),
            eta: self.eta,
            inv_eta,
            coat_share: self.coat_share,
        }
    }

    fn lobes(&self) -> Lobes {
        Lobes { diffuse: true, mirror: true, ..Lobes::default() }
    }

    fn albedo_bound(&self, textures: &Textures) -> Spectrum {
        let inv_eta = 1.0 / self.eta;
        let most = base(textures.max(self.diffuse), self.nonlinear, self.inside, inv_eta);
        // F·s + (1 − F)·b ≤ max(s, b), the base leaving through a coat that passes no more than 1.
        textures.max(self.specular).lane_max(most)
    }
}

impl Lobe for Plastic {
    #[inline]
    fn evaluate(&self, _: Equation, w_back: Vec3, w_next: Vec3) -> Evaluation {
        if w_back.z * w_next.z <= 0.0 {
            return Evaluation::default();
        }
        let (c_back, c_next) = (w_back.z.abs(), w_next.z.abs());
        let f_back = dielectric(c_back, self.eta, self.inv_eta);
        let f_next = dielectric(c_next, self.eta, self.inv_eta);
        Evaluation {
            f: self.base * (FRAC_1_PI * (1.0 - f_back) * (1.0 - f_next)),
            p_w: (1.0 - prob_coat(f_back, self.coat_share)) * c_next * FRAC_1_PI,
            p_w_rev: (1.0 - prob_coat(f_next, self.coat_share)) * c_back * FRAC_1_PI,
        }
    }

    #[inline]
    fn density(&self, w_back: Vec3, w_next: Vec3) -> f32 {
        if w_back.z * w_next.z <= 0.0 {
            return 0.0;
        }
        let f_back = dielectric(w_back.z.abs(), self.eta, self.inv_eta);
        (1.0 - prob_coat(f_back, self.coat_share)) * w_next.z.abs() * FRAC_1_PI
    }

    #[inline]
    fn sample(&self, _: Equation, w_back: Vec3, u_lobe: f32, u: Vec2) -> Option<Sample> {
        let c_back = w_back.z.abs();
        if c_back == 0.0 {
            return None;
        }
        let f_back = dielectric(c_back, self.eta, self.inv_eta);
        let prob = prob_coat(f_back, self.coat_share);
        if u_lobe < prob {
            let mirrored = Vec3::new(-w_back.x, -w_back.y, w_back.z);
            return Some(Sample::dirac(mirrored, self.specular * (f_back / prob), prob, prob));
        }
        let mut w_next = hemisphere_cosine(u);
        if w_next.z <= 0.0 {
            return None;
        }
        let f_next = dielectric(w_next.z, self.eta, self.inv_eta);
        let p = (1.0 - prob) * w_next.z * FRAC_1_PI;
        let p_rev = (1.0 - prob_coat(f_next, self.coat_share)) * c_back * FRAC_1_PI;
        let weight = self.base * ((1.0 - f_back) * (1.0 - f_next) / (1.0 - prob));
        w_next.z = w_next.z.copysign(w_back.z);
        Some(Sample::smooth(w_next, weight, p, p_rev))
    }

    #[inline]
    fn is_delta(&self) -> bool {
        false
    }

    /// That of the coat.
    #[inline]
    fn roughness(&self) -> f32 {
        0.0
    }
}
