//! The choice of techniques: what each join is worth for this picture, against what it costs.
//!
//! A mixture of all joins finds paths with density Σ n_τ p_τ; with the balance heuristic each brings
//! the contribution C = f / Σ n_τ p_τ. Other numbers n'_τ of the same joins would have found it with ρ
//! times that density,
//!
//! ```text
//! ρ = Σ_τ r_τ n'_τ / n_τ,     r_τ = n_τ p_τ / Σ n_τ p_τ  (the joins' weights)
//! ```
//!
//! so that the second moment of an estimator with n' is E[Σ C² / ρ], over the same paths
//! [Grittmann 2022, eq. 9]. Relative to the square of the picture and summed over it, that is the
//! noise of a pass as relMSE counts it; times the cost of a pass it is the error at equal time. One
//! mixture judges all candidates, also on paths that they would hardly ever find themselves.
//!
//! Costs are counts of operations times fixed weights ([`Costs`]), so that the choice is a
//! function of scene, settings and seed alone.

use super::branching::{BranchRays, LEAST};
use super::chains::{ChainNoise, SAMPLES};
use super::{Cell, Decisions, JOB, Pilot};
use crate::math::Random;
use crate::math::random::Family;
use crate::scene::Surface;
use crate::transport::cache::{LightCache, LightVertex};
use crate::transport::gather::gather;
use crate::transport::mis::Heuristic;
use crate::transport::reference::{Subpath, Testimony, Witness};
use crate::transport::settings::{Settings, Techniques};
use crate::transport::shoot::shoot;
use crate::transport::vertex::Scatter;
use crate::transport::walk::{Context, Join, Observe, Tally};
use crate::transport::{Contribution, RayCounts, Record, Technique};
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use std::sync::Arc;

/// Light paths per pixel that are considered.
const LIGHT_PATHS: [f64; 6] = [0.0, 0.25, 0.5, 1.0, 2.0, 4.0];
/// Paths that a candidate finds less often than this are as good as lost to it.
const LOST: f64 = 1e-5;
/// Merging blurs, so it must win by this factor.
const MERGE_MUST_WIN: f64 = 1.25;
/// Everything is on unless doing without wins by this factor: the estimate has noise itself.
const LESS_MUST_WIN: f64 = 1.02;
/// A single path counts for at most this part of all: one that luck found must not decide.
const MOST: f64 = 5e-3;
/// Steps towards the bound of what a path can say.
const CLIPPINGS: u32 = 16;

/// Cost of operations, in units of a step of a gathering walk: user time of passes of five scenes with and
/// without each join, divided by its counts. Only ratios matter, and only as far as they change the order of candidates.
struct Costs {
    gather_walk: f64,
    gather_step: f64,
    next_event: f64,
    connect: f64,
    merge: f64,
    shoot_walk: f64,
    shoot_step: f64,
    splat: f64,
    keep: f64,
    branch: f64,
    /// A ray from the eye that only chains ask for.
    look: f64,
}
const COSTS: Costs = Costs {
    gather_walk: 1.7,
    gather_step: 1.0,
    next_event: 1.1,
    connect: 2.6,
    merge: 1.0,
    shoot_walk: 2.8,
    shoot_step: 1.0,
    splat: 0.8,
    keep: 0.4,
    branch: 1.2,
    look: 0.7,
};

/// Operations per walk.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    walks: f64,
    /// Rays.
    steps: f64,
    /// Vertices at which walks can be joined.
    ends: f64,
}

/// What one path found by the mixture tells.
#[derive(Clone, Copy, Debug)]
struct Evidence {
    /// C² relative to the square of the picture, as a whole pass would find it.
    square: f64,
    /// r_τ by the number of the join.
    shares: [f64; Technique::ALL.len()],
    /// Without noise where next events are on: a delta light seen at the first vertex.
    steady: bool,
    /// Share of the pixel that its chain carries, where it is one of [`crate::transport::chain`].
    chain: Option<f32>,
}

/// Numbers of joins that could be used.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Candidate {
    light_paths: f64,
    next_event: bool,
    connect: bool,
    merge: bool,
}

impl Candidate {
    fn all(settings: &Settings, pixels: u32) -> Vec<Self> {
        let allowed = settings.techniques;
        let given = settings.light_paths.map(|n| vec![f64::from(n) / f64::from(pixels)]);
        let either = |allowed: bool| if allowed { &[true, false][..] } else { &[false][..] };
        let mut all = vec![];
        for light_paths in given.unwrap_or_else(|| LIGHT_PATHS.to_vec()) {
            for &next_event in either(allowed.next_event) {
                for &connect in either(allowed.connect && light_paths > 0.0) {
                    for &merge in either(allowed.merge && light_paths > 0.0) {
                        all.push(Self { light_paths, next_event, connect, merge });
                    }
                }
            }
        }
        all
    }

    fn noise(&self, evidence: &[Evidence]) -> f64 {
        let on = |b: bool| if b { 1.0 } else { 0.0 };
        let n = self.light_paths;
        let numbers = Technique::ALL.map(|technique| match technique {
            Technique::Hit => 1.0,
            Technique::NextEvent => on(self.next_event),
            Technique::Connect => on(self.connect),
            Technique::Splat => n,
            Technique::Merge => n * on(self.merge),
        });
        let one = |e: &Evidence| {
            if (e.steady && self.next_event) || e.chain.is_some() {
                return 0.0;
            }
            let rho: f64 = e.shares.iter().zip(numbers).map(|(r, n)| r * n).sum();
            e.square / rho.max(LOST)
        };
        evidence.iter().map(one).sum()
    }

    /// Per pixel.
    fn cost(&self, eye: &Counts, light: &Counts, merges: f64) -> f64 {
        let c = COSTS;
        let on = |b: bool, cost: f64| if b { cost } else { 0.0 };
        let at_eye = on(self.next_event, c.next_event) + on(self.connect, c.connect);
        let at_light = c.splat + on(self.connect, c.keep);
        c.gather_walk
            + c.gather_step * eye.steps
            + at_eye * eye.ends
            + on(self.merge, c.merge * self.light_paths * merges)
            + self.light_paths * (c.shoot_walk + c.shoot_step * light.steps + at_light * light.ends)
    }

    fn settings(&self, settings: &Settings, pixels: u32) -> Settings {
        let shoots = self.light_paths > 0.0;
        let techniques = Techniques {
            hit: settings.techniques.hit,
            next_event: self.next_event,
            splat: settings.techniques.splat && shoots,
            connect: self.connect,
            merge: self.merge,
        };
        let light_paths = shoots.then(|| ((f64::from(pixels) * self.light_paths).round() as u32).max(1));
        Settings { techniques, light_paths, ..settings.clone() }
    }
}

/// Values of splats by pixel position, in the order in which they are witnessed.
struct Splats(Vec<Vec2>);
impl Record for Splats {
    fn gathered(&mut self, _: Contribution) {}
    fn splatted(&mut self, raster: Vec2, _: &mut Random, c: Contribution) {
        if c.length > 1 {
            self.0.push(raster);
        }
    }
}

/// A witness that also counts operations.
struct Watch {
    witness: Witness,
    counts: Counts,
    branches: BranchRays,
    /// Share of the branch that is followed.
    share: Option<f32>,
    /// Shares of what was seen on branches, by its place among all that was seen.
    chains: Vec<(usize, f32)>,
    /// The vertex last reached has not scattered.
    pending: bool,
}
impl Observe for Watch {
    fn started(&mut self, from: Vec3, light: Option<&crate::scene::emitter::Emission>) {
        self.counts.walks += 1.0;
        self.pending = false;
        self.share = None;
        self.witness.started(from, light);
    }
    fn arrived(&mut self, surface: &Surface) {
        self.counts.ends += 1.0;
        self.pending = true;
        self.witness.arrived(surface);
    }
    fn cached(&mut self, vertex: &LightVertex) {
        self.witness.cached(vertex);
    }
    fn scattered(&mut self, s: &Scatter) {
        self.counts.ends -= if s.delta { 1.0 } else { 0.0 };
        self.pending = false;
        self.witness.scattered(s);
    }
    fn returned(&mut self, vertices: usize) {
        // Nothing is joined at the end of a branch.
        self.counts.ends -= if self.pending { 1.0 } else { 0.0 };
        self.pending = false;
        self.share = None;
        self.witness.returned(vertices);
    }
    fn followed(&mut self, share: f32) {
        self.branches.count(share);
        self.share = Some(share);
    }
    fn joined(&mut self, join: Join<'_>) {
        let before = self.witness.seen.len();
        self.witness.joined(join);
        if let (Some(share), true) = (self.share, self.witness.seen.len() > before) {
            self.chains.push((before, share));
        }
    }
}

impl Watch {
    fn new(witness: Witness) -> Self {
        Self { witness, counts: Counts::default(), branches: BranchRays::default(), share: None, chains: vec![], pending: false }
    }
}

/// What a job found.
#[derive(Default)]
struct Found {
    evidence: Vec<Evidence>,
    counts: Counts,
    branches: BranchRays,
    merges: f64,
}

impl Found {
    fn join(mut self, other: Self) -> Self {
        self.evidence.extend(other.evidence);
        self.counts.walks += other.counts.walks;
        self.counts.steps += other.counts.steps;
        self.counts.ends += other.counts.ends;
        self.merges += other.merges;
        self.branches.join(other.branches);
        self
    }

    fn per_walk(&self) -> Counts {
        let Counts { walks, steps, ends } = self.counts;
        Counts { walks, steps: steps / walks.max(1.0), ends: ends / walks.max(1.0) }
    }
}

/// The settings of the best candidate, judged on `paths` light paths and as large a part of the pixels.
pub(super) fn choose(pilot: &Pilot<'_>, decisions: &Decisions, paths: u32) -> Settings {
    let mut plan = pilot.plan(decisions);
    plan.settings.heuristic = Heuristic::Balance;
    if pilot.settings.faint < 1.0 {
        plan.settings.faint = LEAST;
    }
    let (squares, dark_squares) = (pilot.squares(), pilot.dark_squares());
    let share = f64::from(paths) / f64::from(plan.light_paths.max(1));
    let tell = |cx: Context<'_>, t: &Testimony, cell: Cell, often: f64| evidence(cx, t, squares[cell as usize], often);

    let mut shot = Found::default();
    let (mut pieces, mut subpaths) = (vec![], vec![]);
    let shots: Vec<_> = (0..paths.div_ceil(JOB))
        .into_par_iter()
        .map(|job| {
            let cx = Context::new(pilot.scene, &plan, 0);
            let mut watch = Watch::new(Witness::default());
            watch.witness.expect_shooting(true);
            let (mut vertices, mut splats, mut rays) = (vec![], Splats(vec![]), RayCounts::default());
            for index in job * JOB..((job + 1) * JOB).min(paths) {
                let mut random = Random::new(Family::Pilot, u64::from(index) | 1 << 34, 0, plan.settings.seed);
                let mut tally = Tally { record: &mut splats, rays: &mut rays, observe: &mut watch };
                shoot(cx, Some(&mut vertices), &mut random, &mut tally);
            }
            watch.counts.steps = rays.shoot as f64;
            let seen = watch.witness.seen.iter().zip(&splats.0);
            let evidence =
                seen.filter_map(|(t, raster)| pilot.cell(*raster).and_then(|cell| tell(cx, t, cell, 1.0 / share))).collect();
            let found = Found { evidence, counts: watch.counts, ..Found::default() };
            (found, vertices, watch.witness.into_subpaths())
        })
        .collect();
    for (found, vertices, paths) in shots {
        shot = shot.join(found);
        pieces.push(vertices);
        subpaths.extend(paths);
    }
    let cache = LightCache::new(pieces, plan.merge_radius);
    let subpaths: Arc<Vec<Subpath>> = Arc::new(subpaths);
    let pixels = pilot.crop[2].saturating_mul(pilot.crop[3]);
    let walks = (f64::from(pixels) * share).ceil() as u32;
    plan.inv_light_paths = 1.0 / paths as f32;
    let gathered: Vec<Found> = (0..walks.div_ceil(JOB))
        .into_par_iter()
        .map(|job| {
            let cx = Context::new(pilot.scene, &plan, 0);
            let mut watch = Watch::new(Witness::with_subpaths(subpaths.clone()));
            let mut rays = RayCounts::default();
            let (mut evidence, mut merges) = (vec![], 0.0);
            for index in job * JOB..((job + 1) * JOB).min(walks) {
                let mut random = Random::new(Family::Pilot, u64::from(index) | 1 << 35, 0, plan.settings.seed);
                let raster = pilot.raster(index, walks, &mut random);
                let mut tally = Tally { record: &mut (), rays: &mut rays, observe: &mut watch };
                gather(cx, raster, 1.0, &cache, &mut random, &mut tally);
                let Some(cell) = pilot.cell(raster) else { continue };
                let mut chains = watch.chains.drain(..).peekable();
                for (i, t) in watch.witness.seen.drain(..).enumerate() {
                    let chain = chains.next_if(|(at, _)| *at == i).map(|(_, share)| share);
                    if chain.is_none() && plan.settings.faint < 1.0 && t.path.vertices.iter().all(|v| v.dirac.is_some()) {
                        // What chains vary is measured apart.
                        continue;
                    }
                    let merge = t.key.0 == Technique::Merge;
                    merges += if merge { 1.0 / share } else { 0.0 };
                    let told = tell(cx, &t, cell, if merge { 1.0 } else { 1.0 / share });
                    // A lamp's image shines on its cell alone, its reflections on dark ones around it.
                    let darker = if chain.is_some() { squares[cell as usize] / dark_squares[cell as usize] } else { 1.0 };
                    evidence.extend(told.map(|e| Evidence { chain, square: e.square * darker, ..e }));
                }
            }
            watch.counts.steps = rays.gather as f64 - watch.branches.all;
            Found { evidence, counts: watch.counts, branches: watch.branches, merges }
        })
        .collect();
    let eye = gathered.into_iter().fold(Found::default(), Found::join);
    let (eye_counts, light_counts) = (eye.per_walk(), shot.per_walk());
    let merges = eye.merges / f64::from(walks.max(1));
    let mut evidence = eye.evidence;
    evidence.extend(shot.evidence);
    clip(&mut evidence);
    let followed = evidence.iter().filter_map(|e| e.chain.map(|share| (e.square, share)));
    let branchings = eye.branches.judged(pilot.settings.faint, followed, walks);
    let chains = ChainNoise::measured(pilot, &plan, &dark_squares);
    let ways: Vec<_> = branchings.iter().flat_map(|b| SAMPLES.map(|samples| (b, samples))).collect();
    let ways = if chains.is_some() { ways } else { vec![(&branchings[0], pilot.settings.chain_samples)] };
    let chains = chains.unwrap_or_default();
    let candidates = Candidate::all(pilot.settings, pixels);
    let judged = candidates.iter().flat_map(|c| {
        let blurs = if c.merge { MERGE_MUST_WIN } else { 1.0 };
        let lacks = if c.next_event && c.connect { 1.0 } else { LESS_MUST_WIN };
        let (noise, cost) = (c.noise(&evidence), c.cost(&eye_counts, &light_counts, merges));
        ways.iter().map(move |(b, samples)| {
            let noise = noise + chains.noise(b, *samples);
            let cost = cost + COSTS.branch * b.rays + chains.cost(*samples, COSTS.look, COSTS.branch);
            (noise * cost * blurs * lacks, c, (b.faint, *samples))
        })
    });
    let best = judged.min_by(|a, b| a.0.total_cmp(&b.0));
    let with = |(_, c, (faint, chain_samples)): (f64, &Candidate, _)| Settings {
        faint,
        chain_samples,
        ..c.settings(pilot.settings, pixels)
    };
    best.map_or_else(|| pilot.settings.clone(), with)
}

/// Limits what a single path can say; chains are all found, none by luck.
fn clip(evidence: &mut [Evidence]) {
    let by_luck = |e: &&Evidence| e.chain.is_none();
    // Of few, each may be twice their mean.
    let part = MOST.max(2.0 / evidence.iter().filter(by_luck).count().max(1) as f64);
    let mut most = f64::INFINITY;
    // Falls to the value that is the wanted part of the sum it leaves.
    for _ in 0..CLIPPINGS {
        most = part * evidence.iter().filter(by_luck).map(|e| e.square.min(most)).sum::<f64>();
    }
    evidence.iter_mut().filter(|e| e.chain.is_none()).for_each(|e| e.square = e.square.min(most));
}

fn evidence(cx: Context<'_>, t: &Testimony, square: f64, often: f64) -> Option<Evidence> {
    let value = f64::from(t.value.mean());
    if !(value > 0.0 && value.is_finite() && square > 0.0) {
        return None;
    }
    let mut shares = [0.0; Technique::ALL.len()];
    for ((technique, _), weight) in t.path.weights(cx) {
        shares[technique as usize] += weight;
    }
    let steady = t.path.light_delta && t.path.vertices.len() == 1;
    shares.iter().sum::<f64>().is_finite().then_some(Evidence {
        square: often * value * value / square,
        shares,
        steady,
        chain: None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn luck_does_not_decide() {
        let of = |square| Evidence { square, shares: [1.0, 0.0, 0.0, 0.0, 0.0], steady: false, chain: None };
        let mut evidence: Vec<Evidence> = (0..1000).map(|_| of(1.0)).collect();
        clip(&mut evidence);
        assert!(evidence.iter().all(|e| e.square == 1.0));
        evidence.push(of(1e12));
        clip(&mut evidence);
        // A two-hundredth of all, itself included.
        assert!((evidence[1000].square - 5.0).abs() < 0.1, "{}", evidence[1000].square);
        let mut few = vec![of(1.0), of(1e12), of(1.0)];
        clip(&mut few);
        assert!(few[1].square < 1e10 && few[0].square == 1.0, "{}", few[1].square);
    }
}
