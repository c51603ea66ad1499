//! Local models: the BSDF `f(w_i, w_o)` at one point, nothing about coupling between points.
//!
//! `f(w_i, w_o)` is always in the direction of *light*: light arrives from `w_i` and leaves along
//! `w_o`, both unit vectors pointing away from the surface, in the local shading frame (z = n_s).
//! The rendering and the potential equation differ by argument order only, so `f` has no transport
//! mode; only sampling knows which side is given ([`Equation::orient`]).
//!
//! [`Materials`] holds all models of a scene with their textures; resolving one at a point gives a
//! [`Closure`], plain numbers, which is evaluated and sampled many times.
//!
//! One file per model: formula, source, limits, and an example as it stands in a scene file.
//! Three of the models only combine others ([`two_sided`], [`mask`], [`blend`]): they disappear when
//! materials are built, into a front and a back side and a list of weighted lobes.

pub mod blend;
mod builder;
mod closure;
pub mod composite;
pub mod conductor;
pub mod dielectric;
pub mod diffuse;
pub mod fresnel;
pub mod mask;
mod material;
pub mod microfacet;
pub mod null;
pub mod plastic;
pub mod principled;
pub mod rough_conductor;
pub mod rough_dielectric;
pub mod rough_plastic;
pub mod thin_dielectric;
pub mod two_sided;

pub use closure::{Closure, MODEL_SOURCES};
pub use material::{Breadth, Lobes, MaterialId, Materials};

use crate::spectrum::Spectrum;
use crate::texture::Textures;
use glam::{Vec2, Vec3};

/// Which equation a walk expands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Equation {
    /// `L = Lᵉ + τL`, walked from the sensor by gathering.
    Rendering,
    /// `W = Wᵉ + τ'W`, walked from the lights by shooting.
    Potential,
}

impl Equation {
    /// `(w_i, w_o)` in the direction of light, from the walk's own `(w_back, w_next)`.
    #[inline]
    pub fn orient(self, w_back: Vec3, w_next: Vec3) -> (Vec3, Vec3) {
        match self {
            Self::Rendering => (w_next, w_back),
            Self::Potential => (w_back, w_next),
        }
    }
}

/// The non-Dirac part of a local model for one pair of directions.
#[derive(Clone, Copy, Debug, Default)]
pub struct Evaluation {
    /// BSDF value `f(w_i, w_o)`, sr⁻¹, without any cosine.
    pub f: Spectrum,
    /// Density per steradian of sampling `w_next` where `w_back` is given.
    pub p_w: f32,
    /// Density per steradian of sampling `w_back` where `w_next` is given (the other walker's).
    pub p_w_rev: f32,
}

/// A sampled scattering event.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Direction in which the walk goes on, local, unit.
    pub w_next: Vec3,
    /// Non-Dirac: `f·|cosθ_next| / p_w` with the *shading* cosine, f oriented by the equation.
    /// Dirac: coefficient of the Dirac function divided by the probability of the lobe; for a
    /// refraction under [`Equation::Rendering`] it holds the factor (n_back/n_next)²; under
    /// [`Equation::Potential`] it does not.
    pub weight: Spectrum,
    /// Non-Dirac: density per steradian of all non-Dirac lobes together (lobe choice included).
    /// Dirac: discrete probability of this lobe.
    pub p: f32,
    /// The same for the other walker, arriving along `w_next` and leaving along `w_back`. Always
    /// valid: it shares most of its factors with `p`, so that giving it here costs less than asking
    /// for it afterwards.
    pub p_rev: f32,
    /// A Dirac event (mirror, smooth refraction, straight through).
    pub delta: bool,
    /// For Dirac events `(n_b² cosθ_b) / (n_f² cosθ_f)` with b = side of `w_back`, f = side of
    /// `w_next`: the ratio of the Dirac densities p_rev/p apart from lobe probabilities. 1 for
    /// reflection and for straight through.
    pub dirac_ratio: f32,
    /// Refractive index on the side of `w_next` over that on the side of `w_back`.
    pub eta: f32,
}

impl Sample {
    /// A non-Dirac event that stays on its side.
    #[inline]
    pub(crate) fn smooth(w_next: Vec3, weight: Spectrum, p: f32, p_rev: f32) -> Self {
        Self { w_next, weight, p, p_rev, delta: false, dirac_ratio: 1.0, eta: 1.0 }
    }

    /// A Dirac event without refraction.
    #[inline]
    pub(crate) fn dirac(w_next: Vec3, weight: Spectrum, p: f32, p_rev: f32) -> Self {
        Self { w_next, weight, p, p_rev, delta: true, dirac_ratio: 1.0, eta: 1.0 }
    }
}

/// What every local model can do once its parameters are plain numbers.
///
/// Directions are local and of unit length. Models that only reflect need not ask on which side
/// they are: [`Materials::resolve`] gives [`Closure::Black`] on their dark side, so that a pair of
/// directions on the same side is on the right side.
pub(crate) trait Lobe {
    /// `f`, `p_w` and `p_w_rev` of the non-Dirac part; zero where there is none.
    fn evaluate(&self, equation: Equation, w_back: Vec3, w_next: Vec3) -> Evaluation;

    /// `p_w` alone.
    #[inline]
    fn density(&self, w_back: Vec3, w_next: Vec3) -> f32 {
        self.evaluate(Equation::Rendering, w_back, w_next).p_w
    }

    /// The next event. `u_lobe` decides between lobes, `u` inside a lobe.
    fn sample(&self, equation: Equation, w_back: Vec3, u_lobe: f32, u: Vec2) -> Option<Sample>;

    /// Only Dirac events.
    fn is_delta(&self) -> bool;

    /// Least roughness of its lobes: 0 for Dirac, α of a microfacet distribution, 1 for diffuse.
    fn roughness(&self) -> f32;
}

/// A model whose parameters are textures.
pub(crate) trait Textured {
    /// The same with plain numbers.
    type At<'a>: Lobe
    where
        Self: 'a;

    /// Plain numbers at texture coordinates `uv`.
    fn resolve<'a>(&'a self, textures: &'a Textures, uv: Vec2) -> Self::At<'a>;

    /// Which kinds of events it has.
    fn lobes(&self) -> Lobes;

    /// Scatters on both sides of the surface; else it is black on the inside.
    fn both_sides(&self) -> bool {
        self.lobes().transmits()
    }

    /// Depends on the direction of the tangent.
    fn is_anisotropic(&self) -> bool {
        false
    }

    /// No direction is scattered into more than this share of what arrives, counted in basic
    /// radiance `L/n²`, in every lane.
    fn albedo_bound(&self, textures: &Textures) -> Spectrum;
}
