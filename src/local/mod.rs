//! Local models: the BSDF `f(w_i, w_o)` at one point, nothing about coupling between points.
//!
//! `f(w_i, w_o)` is always in the direction of *light*: light arrives from `w_i` and leaves along
//! `w_o`, both unit vectors pointing away from the surface, in the local shading frame (z = n_s).
//! The rendering and the potential equation differ by argument order only, so `f` has no transport
//! mode; only sampling knows which side is given ([`Equation::orient`]).
//!
//! A [`Material`](material::Material) is a model with its textures; resolving it at a point gives a
//! [`Closure`], plain numbers without textures, which is evaluated and sampled many times.

use crate::spectrum::Spectrum;
use glam::Vec3;

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
    /// The same for the other walker, arriving along `w_next` and leaving along `w_back`.
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
