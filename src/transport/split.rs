//! Gathering walks that split: behind glass, what a walk sees depends on which way it takes.
//!
//! A walk that chooses between reflection and refraction takes the rare way rarely and then counts in full, so that what
//! lies there, a bright spot seen by way of two reflections in the glass, is one spark among thousands of samples.
//! As long as a walk is a chain of Dirac events from the eye it therefore takes both ways, and each counts for its
//! coefficient. Densities and weights stay those of a walk that chooses: they are the same function of the
//! path for all joins, which is all that the sum of the weights needs. The paths that end on a light while they are still
//! such chains are followed in all branches by [`super::chain`].

use super::mutant::{Mutant, planted};
use super::vertex::{Scatter, Vertex};
use super::walk::{Chain, Context, Observe, Walk};
use crate::local::Equation;
use crate::scene::Surface;
use crate::scene::geometry::Ray;
use arrayvec::ArrayVec;

/// Ways that can wait while the first is walked.
const WAITING: usize = 8;

/// A way on from a vertex at which the walk took the other.
pub struct Other {
    /// The walk as it leaves the vertex.
    pub walk: Walk,
    /// Its ray.
    pub ray: Ray,
    /// The vertex.
    pub surface: Surface,
    /// What happens there.
    pub event: Scatter,
}

/// Those of one sample, the last come first.
#[derive(Default)]
pub struct Others(ArrayVec<Other, WAITING>);

impl Others {
    /// Keeps one for later.
    #[inline]
    pub fn push(&mut self, other: Other) {
        // `both_ways` has seen to it that there is room.
        let _ = self.0.try_push(other);
    }

    /// The next one; whoever watches goes back to its vertex.
    #[inline]
    pub fn pop(&mut self, observe: &mut impl Observe) -> Option<(Walk, Ray)> {
        let Other { walk, ray, surface, event } = self.0.pop()?;
        observe.returned(walk.length as usize - 1);
        observe.arrived(&surface);
        observe.scattered(&event);
        Some((walk, ray))
    }
}

/// The two events of `vertex`, the stronger first, if `walk`, which began with `weight`, takes both. The coefficient of each is
/// its weight.
#[inline]
pub fn both_ways(cx: Context<'_>, walk: &Walk, vertex: &Vertex<'_>, weight: f32, others: &Others) -> Option<[Scatter; 2]> {
    let least = cx.plan.settings.faintest_split;
    if least >= 1.0 || walk.chain == Chain::Ended || others.0.is_full() || !vertex.closure.is_delta() {
        return None;
    }
    let mut ways: ArrayVec<Scatter, 2> = ArrayVec::new();
    let mut more = false;
    vertex.each_dirac(Equation::Rendering, |s| {
        let probability = if planted(Mutant::SplitInFull) { 1.0 } else { s.p };
        more |= ways.try_push(Scatter { weight: s.weight * probability, ..s }).is_err();
    });
    // Radiance is scaled by η² inside glass, what a way carries is not.
    let share = |s: &Scatter| (walk.throughput * s.weight).max_lane() * (walk.eta * s.eta).powi(2) / weight;
    let [a, b] = *ways.as_slice() else { return None };
    if more || !(share(&a).min(share(&b)) >= least) {
        return None;
    }
    Some(if share(&a) < share(&b) { [b, a] } else { [a, b] })
}
