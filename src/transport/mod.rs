//! The theory: `L = Lᵉ + τL`, `W = Wᵉ + τ'W`, and the measurement `Φ = ⟨L, Wᵉ⟩ = ⟨Lᵉ, W⟩`.
//!
//! A path `v_0 v_1 … v_k` runs from the lens `v_0` to a light point `v_k`. The gathering walker makes
//! vertices from `v_1` upwards, the shooting walker from `v_{k−1}` downwards, and five joins turn
//! subpaths into whole paths: a *hit* (the gathering walk arrives on a light), a *next event* (it
//! picks a light point), a *splat* (the shooting walk is seen by the lens), a *connection* (a
//! vertex of one is joined to a vertex of the other) and a *merge* (vertices of both are so near to
//! each other that they count as one; only in caustics that are not seen directly). Each path is weighted by multiple importance
//! sampling over all joins that could have made it ([`mis`]).
//!
//! - [`settings`]: which joins, how many of each, which paths.
//! - [`class`]: path expressions such as `E D S+ L`.
//! - [`mis`]: the two-number recursion of the weights.
//! - [`vertex`]: the one kernel of both equations.
//! - [`walk`]: one step of either walker.
//! - [`gather`], [`shoot`]: the two walks, alike on purpose.
//! - `lamp`: paths without a vertex between, lamps seen directly.
//! - [`recursive`]: part of the coupling, or none: recursive ray tracing, local illumination.
//! - [`chain`], [`branch`]: Dirac events followed in all directions, beside a gathering walk.
//! - [`split`]: a gathering walk that goes both ways where it sees glass.
//! - [`incident`]: where light comes from, as learned, for gathering walks to go there.
//! - [`sample_map`]: how many gathering walks each pixel has in a pass.
//! - [`cache`], [`merge`]: light vertices kept for connections and merges.
//! - [`mod@reference`]: the same weights the slow way, for tests.

pub mod branch;
pub mod cache;
pub mod chain;
pub mod class;
pub mod crowd;
pub mod first_seen;
pub mod gather;
pub mod incident;
mod lamp;
pub mod merge;
pub mod mis;
pub mod mutant;
pub mod recursive;
pub mod reference;
pub mod sample_map;
pub mod settings;
pub mod shoot;
pub mod split;
pub mod vertex;
pub mod walk;

use crate::math::Random;
use crate::scene::EmitterId;
use crate::spectrum::Spectrum;
use glam::Vec2;

/// The join that made a path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Technique {
    /// The gathering walk arrived on an emitter: s = 0.
    #[default]
    Hit,
    /// A light point was picked from the last gathering vertex: s = 1.
    NextEvent,
    /// A gathering vertex was joined to a shooting vertex: s ≥ 2, t ≥ 2.
    Connect,
    /// A shooting vertex (or a light point) was seen by the lens: t = 1.
    Splat,
    /// A gathering vertex and a shooting vertex near it count as one, behind a narrow event from the light.
    Merge,
}

impl Technique {
    /// Gathering walks find it, each for itself: what two find has nothing in common.
    pub(crate) fn gathers_alone(self) -> bool {
        matches!(self, Self::Hit | Self::NextEvent | Self::Connect)
    }

    /// All, in the order of their numbers.
    pub const ALL: [Self; 5] = [Self::Hit, Self::NextEvent, Self::Connect, Self::Splat, Self::Merge];

    /// As on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hit => "hit",
            Self::NextEvent => "nee",
            Self::Connect => "connect",
            Self::Splat => "splat",
            Self::Merge => "merge",
        }
    }
}

/// One weighted path of a measurement.
#[derive(Clone, Copy, Debug, Default)]
pub struct Contribution {
    /// Estimate of the pixel's measurement by this path, MIS weight included.
    pub value: Spectrum,
    /// That weight; the value without it is the estimate of the join alone.
    pub weight: f32,
    /// Length in edges.
    pub length: u32,
    /// Number of vertices made by the shooting walker (s), light point included.
    pub light_vertices: u32,
    /// The join.
    pub technique: Technique,
    /// Where the light comes from.
    pub emitter: EmitterId,
}

/// Receives what the walks find. Gathered paths belong to the pixel being sampled.
pub trait Record {
    /// A path of the current pixel.
    fn gathered(&mut self, contribution: Contribution);
    /// A path that is seen at `raster` (pixels of the whole film); `random` chooses the pixel of the
    /// reconstruction filter.
    fn splatted(&mut self, raster: Vec2, random: &mut Random, contribution: Contribution);
}

/// The unit type records nothing: for those who only watch.
impl Record for () {
    fn gathered(&mut self, _: Contribution) {}
    fn splatted(&mut self, _: Vec2, _: &mut Random, _: Contribution) {}
}

/// Rays cast, for statistics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCounts {
    /// Closest-hit rays of gathering walks.
    pub gather: u64,
    /// Closest-hit rays of shooting walks.
    pub shoot: u64,
    /// Any-hit rays of joins.
    pub shadow: u64,
    /// Gathering walks started.
    pub gather_walks: u64,
    /// Shooting walks started.
    pub shoot_walks: u64,
}

impl RayCounts {
    /// Sum, field by field.
    pub fn add(&mut self, o: &Self) {
        self.gather += o.gather;
        self.shoot += o.shoot;
        self.shadow += o.shadow;
        self.gather_walks += o.gather_walks;
        self.shoot_walks += o.shoot_walks;
    }

    /// All rays.
    pub fn total(&self) -> u64 {
        self.gather + self.shoot + self.shadow
    }
}
