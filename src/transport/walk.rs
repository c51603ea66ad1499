//! One step of either walker: what a walk carries from vertex to vertex.
//!
//! A step is an application of τ or τ': arrive at a surface, turn the density of the direction into
//! one of area, scatter, survive roulette. Both equations share every line of it; what differs is
//! how a walk starts (`gather`, `shoot`) and which joins it offers.

use super::cache::LightVertex;
use super::class::{PathFilter, Positions, Symbol};
use super::mis::{self, Eta, Partial};
use super::mutant::{Mutant, planted};
use super::settings::Plan;
use super::vertex::{Scatter, Vertex};
use super::{RayCounts, Technique};
use crate::local::{Breadth, Equation};
use crate::math::Random;
use crate::scene::emitter::{Emission, EmitterPoint, NextEvent};
use crate::scene::geometry::{End, Ray, offset_origin};
use crate::scene::{EmitterId, Scene, Surface};
use crate::spectrum::Spectrum;
use glam::{Vec2, Vec3};

/// What a walk needs to know of the world around it.
#[derive(Clone, Copy)]
pub struct Context<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Which joins, how many.
    pub plan: &'a Plan,
    /// Square of the radius in which this pass merges, at most; 0 where it does not.
    merge_radius2: f32,
    /// η of this pass: light paths times the area in which their vertices are merged.
    pub eta: Eta<f32>,
    /// Light vertices in the radius of this pass where merges are met by chance, for one in the largest of the first.
    crowded: f32,
    /// N of the weights for a gathering walk ([`Plan::n_at`]).
    pub n: f32,
    /// Part of what comes along chains of Dirac events (E S* L) that a sample counts: where several samples of chains
    /// belong to one gathering walk ([`super::chain::sample`]), one by their number.
    pub chain_part: f32,
}

impl<'a> Context<'a> {
    /// For one pass of a render.
    pub fn new(scene: &'a Scene, plan: &'a Plan, pass: u64) -> Self {
        let merge_radius2 = plan.merge_radius(pass).powi(2);
        let clear = plan.light_paths as f32 * std::f32::consts::PI * merge_radius2;
        let eta = Eta { clear, by_chance: clear * plan.by_chance };
        let crowded = plan.by_chance * merge_radius2 / plan.merge_radius(0).powi(2).max(f32::MIN_POSITIVE);
        Self { scene, plan, merge_radius2, eta, crowded, n: plan.n, chain_part: 1.0 }
    }

    /// The same for another plan, of the same radius.
    pub fn with_plan(self, plan: &'a Plan) -> Self {
        Self { plan, ..self }
    }

    /// Vertices are merged in this pass.
    #[inline]
    pub fn merges(&self) -> bool {
        self.merge_radius2 > 0.0
    }

    /// Square of the radius in which vertices are merged where all events between them and the eye are focused (`clear`), or not.
    #[inline]
    pub fn merge_radius2(&self, clear: bool) -> f32 {
        if clear { self.merge_radius2 } else { self.plan.by_chance * self.merge_radius2 }
    }

    /// How many more light vertices than usual a merge at `p` finds at once, on average.
    #[inline]
    pub fn crowd(&self, p: Vec3) -> f32 {
        self.plan.crowds.at(p) * self.crowded
    }

    /// What a merge at `p` counts for in the weights, where all events between it and the eye are focused (`clear`) or not.
    #[inline]
    pub fn merge_count(&self, p: Vec3, clear: bool) -> f32 {
        let crowd = if clear || planted(Mutant::Crowd) { 0.0 } else { self.crowd(p) };
        self.eta.count(clear, crowd)
    }

    /// The same for a gathering walk from a point of the film.
    #[inline]
    pub fn at(self, raster: Vec2) -> Self {
        Self { n: if planted(Mutant::SampleMap) { self.plan.n } else { self.plan.n_at(raster) }, ..self }
    }

    /// The same where a sample counts this part of what comes along chains.
    #[inline]
    pub fn with_chain_part(self, part: f32) -> Self {
        Self { chain_part: if planted(Mutant::ChainPart) { 1.0 } else { part }, ..self }
    }
}

/// State of a walk on its way from one vertex to the next.
#[derive(Clone, Debug)]
pub struct Walk {
    /// Product of kernels over densities, roulette included.
    pub throughput: Spectrum,
    /// Density of the walk relative to one by local models alone: not 1 where gathering went where light comes from.
    pub guided: f32,
    /// MIS sum of the vertex that was left, resolved for the direction taken (already raised).
    pub k: f32,
    /// Density per steradian of the direction taken (first edge: see the walkers), or the
    /// probability of the lobe where it is a Dirac event.
    pub p: f32,
    /// The vertex that was left scattered by a Dirac event.
    pub delta: bool,
    /// How widely it scattered; of a walk that begins, wide.
    pub breadth: Breadth,
    /// All events so far were focused, if there were any.
    pub clear: bool,
    /// Of the gathering walker: there is a merge at the vertex that was left if the next event is narrow, with all events before
    /// focused (`true`) or not.
    pub merges: Option<bool>,
    /// Of the shooting walker: what merges behind add to the MIS sum of the vertex that was left (already raised) if all events
    /// from there to the eye are focused.
    pub merge: f32,
    /// Position of the vertex that was left.
    pub from: Vec3,
    /// Its geometric cosine towards the direction taken; 1 for a light at infinity.
    pub cos_from: f32,
    /// The edge under way has no inverse square (light or sensor at infinity).
    pub parallel: bool,
    /// Edges walked.
    pub length: u32,
    /// Product of relative refractive indices.
    pub eta: f32,
    /// Positions of the path expression reached so far.
    pub class: Positions,
    /// The first scattering event was a Dirac event.
    pub first_delta: bool,
    /// How far it is a chain of Dirac events from the eye.
    pub chain: Chain,
}

/// A walk that began with Dirac events, see [`super::chain`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Chain {
    /// Nothing else so far, and there was one way on at each.
    Single,
    /// Nothing else so far; light at its end is found along all branches, not by this walk.
    Branched,
    /// It scattered otherwise, or began at a light.
    Ended,
}

/// What arrival at a surface adds.
#[derive(Clone, Copy, Debug)]
pub struct Arrival {
    /// 1/d², or 1 on a parallel edge.
    pub inv_d2: f32,
    /// Density per m² with which the walk made the point.
    pub p_a: f32,
}

/// MIS sums on arrival at a vertex.
#[derive(Clone, Copy, Debug)]
pub struct Sums {
    /// In any case.
    pub partial: Partial<f32>,
    /// What `b` is more by where the event at the vertex is narrow; of the shooting walker, where all events from here to the
    /// eye are.
    pub merged: f32,
}

impl Sums {
    /// Where that is so, or not.
    #[inline]
    pub fn at(&self, so: bool) -> Partial<f32> {
        if so { self.partial.and(self.merged) } else { self.partial }
    }
}

/// Area densities are kept within these bounds so that no product over- or underflows.
const DENSITY_RANGE: std::ops::RangeInclusive<f32> = 1e-30..=1e30;

impl Walk {
    /// Density and inverse square of arrival at `surface` along unit `d`.
    #[inline]
    pub fn arrive(&self, surface: &Surface, d: Vec3) -> Arrival {
        let inv_d2 = if self.parallel { 1.0 } else { 1.0 / (surface.p - self.from).length_squared().max(1e-30) };
        let cos = if planted(Mutant::AreaCosine) { 1.0 } else { d.dot(surface.n_g).abs() };
        let p_a = (self.p * cos * inv_d2).clamp(*DENSITY_RANGE.start(), *DENSITY_RANGE.end());
        Arrival { inv_d2, p_a }
    }

    /// MIS sum of the vertex arrived at, whose events have this breadth; `count` joins could have made the edge.
    #[inline]
    pub fn partial(&self, cx: Context<'_>, arrival: Arrival, count: f32, breadth: Breadth) -> Sums {
        let h = cx.plan.settings.heuristic;
        let j = self.cos_from * arrival.inv_d2;
        let partial = Partial::arrive(h, count, arrival.p_a, j, self.k);
        let merge = match self.merges {
            Some(clear) if breadth.is_narrow() => h.raise(cx.merge_count(self.from, clear)),
            _ => self.merge,
        };
        // Most walks have none, and where the density underflows 0 / 0 must not enter.
        let merges = merge > 0.0 && !planted(Mutant::MergeWeight);
        Sums { partial, merged: if merges { mis::merge_before(h, merge, arrival.p_a, j) } else { 0.0 } }
    }

    /// Leaves a vertex along a sampled direction, `sums` those of [`Self::partial`] there.
    #[inline]
    pub fn leave(&mut self, cx: Context<'_>, equation: Equation, vertex: &Vertex<'_>, sums: Sums, s: &Scatter) {
        let h = cx.plan.settings.heuristic;
        self.throughput *= s.weight;
        self.guided *= s.guided;
        let resolved =
            |partial: Partial<f32>| if s.delta { partial.at_delta(h, s.p_rev, s.dirac_ratio) } else { partial.at(h, s.p_rev) };
        self.k = resolved(if equation == Equation::Rendering { sums.at(s.breadth.is_narrow()) } else { sums.partial });
        self.merges = (equation == Equation::Rendering && self.length > 0 && s.breadth > Breadth::Sharp && cx.merges())
            .then_some(self.clear);
        self.merge = 0.0;
        if equation == Equation::Potential {
            if s.breadth.is_focused() {
                self.merge = resolved(Partial { a: 0.0, b: sums.merged });
            }
            // There is one if the event before was narrow, and it counts for more if all that comes is focused.
            if self.breadth.is_narrow() && s.breadth > Breadth::Sharp && cx.merges() && !planted(Mutant::MergeWeight) {
                let [clear, by_chance] = [true, false].map(|clear| h.raise(cx.merge_count(vertex.surface.p, clear)));
                self.k += by_chance;
                self.merge += clear - by_chance;
            }
        }
        self.clear &= s.breadth.is_focused();
        self.breadth = s.breadth;
        self.p = s.p;
        self.delta = s.delta;
        self.from = vertex.surface.p;
        self.cos_from = s.cos_g;
        self.parallel = false;
        self.length += 1;
        self.eta *= s.eta;
        if self.length == 1 {
            self.first_delta = s.delta;
        }
        if !s.delta {
            self.chain = Chain::Ended;
        }
    }

    /// Follows the path expression over the event just sampled, from the eye or from the light.
    #[inline]
    pub fn classify(&mut self, filter: &PathFilter, equation: Equation, delta: bool) {
        self.class = match equation {
            Equation::Rendering => filter.forward(self.class, Symbol::event(delta)),
            Equation::Potential => filter.backward(self.class, Symbol::event(delta)),
        };
    }

    /// Russian roulette on the throughput relative to `start`; false ends the walk. Survival
    /// probabilities depend on the history of the walk, so they stay out of the MIS densities. A walk that was led to the light
    /// carries little because it is found often, not because it matters little: what counts is what it would carry
    /// had local models led it.
    #[inline]
    pub fn survives(&mut self, plan: &Plan, start: f32, random: &mut Random) -> bool {
        let t = self.throughput.max_lane();
        if t.is_nan() || t <= 0.0 {
            return false;
        }
        if self.length < plan.settings.rr_depth {
            return true;
        }
        let q = (t * self.guided * self.eta * self.eta / start).min(0.95);
        if random.unit() >= q {
            return false;
        }
        if !planted(Mutant::RouletteFactor) {
            self.throughput /= q;
        }
        true
    }
}

/// The ray that leaves a vertex along unit `w`.
#[inline]
pub fn spawn(surface: &Surface, w: Vec3) -> Ray {
    Ray { o: offset_origin(surface.p, surface.p_error, surface.n_g, w), d: w, t_max: f32::INFINITY }
}

/// An end of a shadow segment on a surface.
#[inline]
pub fn end(s: &Surface) -> End {
    (s.p, s.p_error, s.n_g)
}

/// An end of a shadow segment that is on no surface.
#[inline]
pub fn free(p: Vec3) -> End {
    (p, 0.0, Vec3::ZERO)
}

/// Whether nothing stands between `x` and a light point.
#[inline]
pub fn sees_light(scene: &Scene, x: &Surface, ne: &NextEvent) -> bool {
    if ne.distance.is_infinite() {
        return scene.geometry.visible_infinite(end(x), ne.w);
    }
    // A point light has no normal and stays where it is.
    scene.geometry.visible(end(x), (ne.point.y, ne.point.y_error, ne.point.n_g))
}

/// A join as an observer sees it.
#[derive(Clone, Copy, Debug)]
pub struct Join<'a> {
    /// Which.
    pub technique: Technique,
    /// Its MIS weight.
    pub weight: f32,
    /// Edges of the whole path.
    pub length: u32,
    /// The light point, where the join made or found it.
    pub light: Option<&'a EmitterPoint>,
    /// The emitter that the path starts from.
    pub emitter: EmitterId,
    /// It cannot be hit.
    pub light_delta: bool,
    /// Index in the cache of the light vertex of a connection or a merge.
    pub light_vertex: usize,
    /// The lens point of a splat.
    pub lens: Vec3,
    /// What it adds to the measurement.
    pub value: Spectrum,
}

/// Watches a walk without taking part in it: tests rebuild whole paths from what they see.
/// The unit type watches nothing and costs nothing.
pub trait Observe {
    /// A walk starts: at a lens point, or with an emission.
    fn started(&mut self, _from: Vec3, _light: Option<&Emission>) {}
    /// A vertex was reached.
    fn arrived(&mut self, _surface: &Surface) {}
    /// A light vertex went into the cache.
    fn cached(&mut self, _vertex: &LightVertex) {}
    /// The vertex last reached scattered.
    fn scattered(&mut self, _s: &Scatter) {}
    /// The walk goes back and branches: all but the first `vertices` vertices are forgotten.
    fn returned(&mut self, _vertices: usize) {}
    /// A branch of a chain goes on, which carries this share of the pixel (before roulette made it more).
    fn followed(&mut self, _share: f32) {}
    /// A path was finished.
    fn joined(&mut self, _join: Join<'_>) {}
}
impl Observe for () {}

/// Who watches and who counts, handed down a walk together.
pub struct Tally<'a, R, O> {
    /// Receives contributions.
    pub record: &'a mut R,
    /// Counts rays.
    pub rays: &'a mut RayCounts,
    /// Watches.
    pub observe: &'a mut O,
}
