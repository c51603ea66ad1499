//! Rays that branch: all Dirac events of a vertex are followed, not one at random.
//!
//! The coefficient of an event takes the place of its probability, so that what a rare branch finds comes in
//! every sample with little weight, not rarely with all of it [Whitted 1980]. Branching doubles the work, so
//! after some events, or where no more rays can wait, one of them is chosen; that keeps the expectation and
//! bounds memory.

use super::class::{PathFilter, Positions, Symbol};
use super::vertex::{Scatter, Vertex};
use super::walk::spawn;
use crate::local::Equation;
use crate::math::Random;
use crate::scene::Surface;
use crate::scene::geometry::Ray;
use crate::scene::sensor::SensorRay;
use crate::spectrum::Spectrum;
use arrayvec::ArrayVec;

/// Directions that a vertex can have: two of each lobe.
const CHILDREN: usize = 2 * crate::local::composite::MAX_LOBES;
/// Rays that can wait while the first is followed.
const WAITING: usize = 96;

/// A ray that is still to be followed.
#[derive(Clone, Copy, Debug)]
pub struct Branch {
    /// The ray.
    pub ray: Ray,
    /// Product of coefficients.
    pub throughput: Spectrum,
    /// Product of relative refractive indices.
    pub eta: f32,
    /// Edges before this one.
    pub length: u32,
    /// Positions of the path expression reached so far.
    pub class: Positions,
    /// The first event was a Dirac event.
    pub first_delta: bool,
    /// So was the last.
    pub last_delta: bool,
    /// Where the ray comes from, and the event there; `None` for the lens.
    pub event: Option<(Surface, Scatter)>,
}

impl Branch {
    /// The ray of a sample of the sensor, `weight` the factor of its reconstruction filter.
    pub fn from_lens(start: &SensorRay, weight: f32, filter: &PathFilter) -> Self {
        Self {
            ray: Ray { o: start.o, d: start.d, t_max: start.t_max },
            throughput: Spectrum::ONE * weight,
            eta: 1.0,
            length: 0,
            class: filter.eye(),
            first_delta: false,
            last_delta: false,
            event: None,
        }
    }
}

/// Rays of one sample that wait to be followed, the last come first.
pub struct Branches {
    open: ArrayVec<Branch, WAITING>,
    branching: u32,
}

impl Branches {
    /// None yet; all directions are followed at the first `branching` events of a path.
    pub fn new(branching: u32) -> Self {
        Self { open: ArrayVec::new(), branching }
    }

    /// The ray from the lens.
    pub fn start(&mut self, branch: Branch) {
        let _ = self.open.try_push(branch);
    }

    /// The next ray.
    pub fn take(&mut self) -> Option<Branch> {
        self.open.pop()
    }

    /// Adds what `from` becomes at `vertex` by all Dirac events there, or by one of them, chosen by what it
    /// scatters. Returns the number of events.
    pub fn split(&mut self, from: &Branch, vertex: &Vertex<'_>, filter: &PathFilter, random: &mut Random) -> usize {
        let mut events: ArrayVec<(Scatter, Spectrum), CHILDREN> = ArrayVec::new();
        vertex.each_dirac(Equation::Rendering, |s| {
            let coefficient = s.weight * s.p;
            if coefficient.max_lane() > 0.0 {
                // There is room for two of each lobe.
                let _ = events.try_push((s, coefficient));
            }
        });
        let child = |s: &Scatter, factor: Spectrum| Branch {
            ray: spawn(&vertex.surface, s.w_next),
            throughput: from.throughput * factor,
            eta: from.eta * s.eta,
            length: from.length + 1,
            class: filter.forward(from.class, Symbol::S),
            first_delta: from.first_delta || from.length == 0,
            last_delta: true,
            event: Some((vertex.surface, *s)),
        };
        let room = self.open.remaining_capacity() >= events.len();
        if events.len() < 2 || (room && from.length < self.branching) {
            events.iter().for_each(|(s, c)| {
                let _ = self.open.try_push(child(s, *c));
            });
            return events.len();
        }
        let total: f32 = events.iter().map(|(_, c)| c.max_lane()).sum();
        let mut rest = random.unit() * total;
        let found = events.iter().find(|(_, c)| {
            rest -= c.max_lane();
            rest < 0.0
        });
        if let Some((s, c)) = found.or(events.last()) {
            let _ = self.open.try_push(child(s, *c * (total / c.max_lane())));
        }
        events.len()
    }
}
