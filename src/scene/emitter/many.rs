//! The choice among many lights for a next event at x: first infinite or finite, then which.
//!
//! ```text
//! P_n(finite | x)   = q(x) · ((1 − δ)·tree(x) + δ·share)
//! P_n(infinite | x) = (1 − q(x)) · share among the infinite ones
//! q(x) = ½ · 1/(1 + n) + ½ · E_f(x)/(E_f(x) + E_∞)
//! ```
//!
//! Infinite emitters have no place, so they are outside of the `tree` of the finite ones. Half of the
//! time irradiance decides between the two, which every place has of its own: E_f as the root of the tree bounds
//! it, E_∞ as it is without anything in the way. Half of the time the tree counts as one light beside
//! the n infinite ones: indoors the sky is brighter than any lamp and not seen, beneath a lamp the
//! other way round may be true.
//!
//! The tree knows distances and sides but no walls: behind one, the lamps next door take nearly all of
//! its probability, and a lamp that alone is seen would be chosen rarely, to count the more. A part
//! δ of the finite choice is therefore made without the tree, half by power and half uniform: no light
//! counts for more than 1/δ times what it would by that choice alone, which costs others at most
//! the factor 1/(1 − δ) in variance.

use super::choice::mixture;
use super::tree::{Bound, LightTree};
use crate::math::distribution::Discrete;
use crate::math::warp::ONE_MINUS_EPSILON;
use glam::Vec3;

/// Uniform part of all choices that do not look at x, and of the one between finite and infinite.
const UNIFORM: f64 = 0.5;
/// δ.
const UNSEEING: f32 = 0.1;

#[derive(Clone, Debug)]
pub(super) struct Many {
    tree: LightTree,
    /// Among the finite emitters, if any; of all indices.
    finite: Option<Discrete>,
    /// Indices of the infinite emitters, ascending, and the choice among them, if any.
    infinite: Vec<u32>,
    infinite_shares: Option<Discrete>,
    /// E_∞ of all infinite emitters, W·m⁻².
    irradiance: f32,
}

impl Many {
    /// From the power of every emitter and the bounds of those that are finite; `p_across` = 1/(πR²) of the
    /// scene's sphere, which infinite emitters fill with their power. `None` where all are dark.
    pub(super) fn new(powers: &[f64], p_across: f32, bound: impl Fn(usize) -> Option<Bound>) -> Option<Self> {
        let lit = (0..powers.len()).filter(|i| powers[*i] > 0.0);
        let bounds: Vec<_> = lit.clone().filter_map(|i| Some((i, bound(i)?))).collect();
        let mut finite = vec![0.0; powers.len()];
        bounds.iter().for_each(|(i, _)| finite[*i] = powers[*i]);
        let infinite: Vec<u32> = lit.filter(|i| finite[*i] == 0.0).map(|i| i as u32).collect();
        let sky: Vec<f64> = infinite.iter().map(|i| powers[*i as usize]).collect();
        let many = Self {
            tree: LightTree::new(bounds, powers.len()),
            finite: mixture(&finite, UNIFORM),
            infinite,
            infinite_shares: mixture(&sky, UNIFORM),
            irradiance: sky.iter().sum::<f64>() as f32 * p_across,
        };
        (many.finite.is_some() || many.infinite_shares.is_some()).then_some(many)
    }

    /// An emitter for a next event at `x` and its probability. One `u` makes all decisions.
    #[inline]
    pub(super) fn sample(&self, x: Vec3, u: f32) -> (usize, f32) {
        let q = self.prob_any_finite(x);
        match (&self.finite, &self.infinite_shares) {
            (Some(finite), _) if u < q => {
                let u = stretch(u, 0.0, q);
                let (i, by_tree) = if u < UNSEEING {
                    let (i, _, _) = finite.sample(stretch(u, 0.0, UNSEEING));
                    (i, self.tree.prob(i, x))
                } else {
                    self.tree.sample(x, stretch(u, UNSEEING, 1.0))
                };
                (i, q * self.prob_among_finite(i, by_tree))
            }
            (_, Some(infinite)) => {
                let (at, prob, _) = infinite.sample(stretch(u, q, 1.0));
                (self.infinite[at] as usize, (1.0 - q) * prob)
            }
            // One of the two exists, and q is 1 without the second.
            _ => (0, 0.0),
        }
    }

    /// Probability of emitter `i`, the one that [`Self::sample`] tells bit for bit.
    #[inline]
    pub(super) fn prob(&self, i: usize, x: Vec3) -> f32 {
        let q = self.prob_any_finite(x);
        if self.tree.contains(i) {
            q * self.prob_among_finite(i, self.tree.prob(i, x))
        } else {
            (1.0 - q) * self.prob_among_infinite(i)
        }
    }

    /// q(x).
    #[inline]
    fn prob_any_finite(&self, x: Vec3) -> f32 {
        if self.infinite.is_empty() {
            return 1.0;
        }
        self.finite.as_ref().map_or(0.0, |_| {
            let by_irradiance = 1.0 / (1.0 + self.irradiance / self.tree.irradiance(x));
            UNIFORM as f32 / (1 + self.infinite.len()) as f32 + (1.0 - UNIFORM as f32) * by_irradiance
        })
    }

    #[inline]
    fn prob_among_finite(&self, i: usize, by_tree: f32) -> f32 {
        let share = self.finite.as_ref().map_or(0.0, |s| s.prob(i));
        (1.0 - UNSEEING) * by_tree + UNSEEING * share
    }

    #[inline]
    fn prob_among_infinite(&self, i: usize) -> f32 {
        let at = self.infinite.binary_search(&(i as u32)).ok();
        at.zip(self.infinite_shares.as_ref()).map_or(0.0, |(at, shares)| shares.prob(at))
    }

    /// Probability of emitter `i` if power and number had to do for places.
    pub(super) fn prob_anywhere(&self, i: usize) -> f32 {
        let n = self.infinite.len() as f32;
        if self.tree.contains(i) {
            self.finite.as_ref().map_or(0.0, |s| s.prob(i)) / (1.0 + n)
        } else {
            let others = if self.finite.is_some() { n / (1.0 + n) } else { 1.0 };
            self.prob_among_infinite(i) * others
        }
    }

    pub(super) fn tree(&self) -> &LightTree {
        &self.tree
    }

    /// Bytes of tables.
    pub(super) fn bytes(&self) -> usize {
        self.tree.bytes() + size_of_val(&self.infinite[..])
    }

    /// The tree's own probability of emitter `i`, without the defensive part.
    #[cfg(test)]
    pub(super) fn prob_by_tree(&self, i: usize, x: Vec3) -> f32 {
        self.tree.prob(i, x)
    }
}

/// `u` in [from, to) stretched to [0, 1).
#[inline]
fn stretch(u: f32, from: f32, to: f32) -> f32 {
    ((u - from) / (to - from)).clamp(0.0, ONE_MINUS_EPSILON)
}
