//! Which emitter: the probabilities P_n of next events and P_e of emission.
//!
//! Both are defensive mixtures `(1 − δ)·power share + δ·1/n`. Power is what a light could bring,
//! not what arrives where it matters: a small lamp in the room beside a sun outside has next to
//! none of the power and all of the picture. For next events the choice is uniform among few lights
//! (the distance to x counts for more than the power, and a wrong guess costs more than an even
//! one) and half uniform among many; for emission a tenth is, so that no light is ever left out.
//! This is the only place that decides it.

use crate::math::distribution::Discrete;

/// Up to so many lights are few.
const FEW: f64 = 8.0;
const UNIFORM_AMONG_MANY: f64 = 0.5;
const UNIFORM_EMISSION: f64 = 0.1;

#[derive(Clone, Debug)]
pub(super) struct Choice {
    pub(super) next_event: Discrete,
    pub(super) emission: Discrete,
}

impl Choice {
    /// From the power of every emitter (0 = never chosen); `None` where all are dark.
    pub(super) fn new(powers: &[f64]) -> Option<Self> {
        let total: f64 = powers.iter().sum();
        let lit = powers.iter().filter(|p| **p > 0.0).count() as f64;
        let mixture = |uniform: f64| {
            let share = move |p: &f64| if *p > 0.0 { (1.0 - uniform) * p / total + uniform / lit } else { 0.0 };
            Discrete::new(powers.iter().map(share))
        };
        let uniform = if lit <= FEW { 1.0 } else { UNIFORM_AMONG_MANY };
        Some(Self { next_event: mixture(uniform)?, emission: mixture(UNIFORM_EMISSION)? })
    }
}
