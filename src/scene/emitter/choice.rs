//! Which emitter: the probabilities P_n of next events and P_e of emission.
//!
//! Power is what a light could bring, not what arrives where it matters: a small lamp in the room
//! beside a sun outside has next to none of the power and all of the picture. So every choice by power is
//! a defensive mixture `(1 − δ)·power share + δ·1/n`. For emission δ is a tenth, so that no light is ever
//! left out. For next events the choice is uniform among few lights (the distance to x counts for more
//! than the power, and a wrong guess costs more than an even one); among many it looks at x ([`Many`]).
//! This is the only place that decides it.

use super::lights::Picked;
use super::many::Many;
use super::tree::{Bound, LightTree};
use crate::math::distribution::Discrete;
use glam::Vec3;

/// Up to so many lights are few enough for a choice that is the same everywhere.
const FEW: usize = 8;
/// Up to so many are few enough to see all of them where the picture shows it.
const ALL_SEEN: usize = 4;
const UNIFORM_EMISSION: f64 = 0.1;

#[derive(Clone, Debug)]
pub(super) struct Choice {
    pub(super) next_event: NextEventChoice,
    /// All that may be picked for a next event, where two to [`ALL_SEEN`] may.
    few: Vec<Picked>,
    pub(super) emission: Discrete,
}

/// P_n, for a next event at x.
#[derive(Clone, Debug)]
pub(super) enum NextEventChoice {
    /// The same for every x.
    Few(Discrete),
    Many(Box<Many>),
}

impl Choice {
    /// From the power of every emitter (0 = never chosen), 1/(πR²) of the scene's sphere and the bounds
    /// of the finite emitters; `None` where all are dark.
    pub(super) fn new(powers: &[f64], p_across: f32, bound: impl Fn(usize) -> Option<Bound>) -> Option<Self> {
        let lit: Vec<usize> = (0..powers.len()).filter(|i| powers[*i] > 0.0).collect();
        let (next_event, few) = if lit.len() <= FEW {
            let choice = mixture(powers, 1.0)?;
            let all = (2..=ALL_SEEN).contains(&lit.len());
            let few = if all { lit.iter().map(|i| (*i, choice.prob(*i))).collect() } else { vec![] };
            (NextEventChoice::Few(choice), few)
        } else {
            (NextEventChoice::Many(Box::new(Many::new(powers, p_across, bound)?)), vec![])
        };
        Some(Self { next_event, few, emission: mixture(powers, UNIFORM_EMISSION)? })
    }

    /// See [`Lights::few`](super::Lights::few).
    #[inline]
    pub(super) fn few(&self) -> &[Picked] {
        &self.few
    }

    /// The tree of finite emitters, if they are many.
    pub(super) fn tree(&self) -> Option<&LightTree> {
        match &self.next_event {
            NextEventChoice::Few(_) => None,
            NextEventChoice::Many(many) => Some(many.tree()),
        }
    }

    /// Bytes of tables.
    pub(super) fn bytes(&self) -> usize {
        match &self.next_event {
            NextEventChoice::Few(_) => 0,
            NextEventChoice::Many(many) => many.bytes(),
        }
    }
}

impl NextEventChoice {
    /// An emitter for a next event at `x` and its probability.
    #[inline]
    pub(super) fn sample(&self, x: Vec3, u: f32) -> (usize, f32) {
        match self {
            Self::Few(discrete) => {
                let (i, prob, _) = discrete.sample(u);
                (i, prob)
            }
            Self::Many(many) => many.sample(x, u),
        }
    }

    /// Probability of emitter `i` for a next event at `x`.
    #[inline]
    pub(super) fn prob(&self, i: usize, x: Vec3) -> f32 {
        match self {
            Self::Few(discrete) => discrete.prob(i),
            Self::Many(many) => many.prob(i, x),
        }
    }

    /// The same without knowing where: the part of the choice in which places do not count.
    pub(super) fn prob_anywhere(&self, i: usize) -> f32 {
        match self {
            Self::Few(discrete) => discrete.prob(i),
            Self::Many(many) => many.prob_anywhere(i),
        }
    }
}

/// Shares of power, of which the part `uniform` is shared evenly among all that have any.
pub(super) fn mixture(powers: &[f64], uniform: f64) -> Option<Discrete> {
    let total: f64 = powers.iter().sum();
    let lit = powers.iter().filter(|p| **p > 0.0).count() as f64;
    let share = |p: &f64| if *p > 0.0 { (1.0 - uniform) * p / total + uniform / lit } else { 0.0 };
    Discrete::new(powers.iter().map(share))
}
