//! Which emitter: the probabilities P_n of next events and P_e of emission.
//!
//! Both are defensive mixtures `(1 − δ)·power share + δ·1/n`. Power is what a light could bring,
//! not what arrives where it matters: a small lamp in the room beside a sun outside has next to
//! none of the power and all of the picture. For next events half is uniform (the distance to x
//! counts for more than the power); for emission a tenth, so that no light is ever left out.
//! This is the only place that decides it.

use crate::math::distribution::Discrete;

const UNIFORM_NEXT_EVENT: f64 = 0.5;
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
        Some(Self { next_event: mixture(UNIFORM_NEXT_EVENT)?, emission: mixture(UNIFORM_EMISSION)? })
    }
}
