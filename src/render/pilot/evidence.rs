//! What a pilot's walks find and count, for the choice of techniques ([`super::choice`]).

use super::branching::{BranchRays, Branching};
use super::picture::Cell;
use super::{JOB, Pilot};
use crate::math::random::Family;
use crate::math::{Random, limit};
use crate::render::passes::GATHER_AXES;
use crate::scene::{Scene, Surface};
use crate::transport::cache::{LightCache, LightVertex};
use crate::transport::gather::gather;
use crate::transport::reference::{JoinKey, Path, Subpath, Testimony, Witness, products};
use crate::transport::settings::Plan;
use crate::transport::shoot::shoot;
use crate::transport::vertex::Scatter;
use crate::transport::walk::{Context, Join, Observe, Tally};
use crate::transport::{Contribution, RayCounts, Record, Technique};
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use std::sync::Arc;

/// A single path counts for at most this part of all: one that luck found must not decide.
const MOST: f64 = 5e-3;
/// Walks of a pixel that share a sequence of points, as in a render; each pixel has two such sets.
pub(super) const SET: u32 = 8;
/// Steps towards the bound of what a path can say.
const CLIPPINGS: u32 = 16;

/// Operations per walk.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Counts {
    walks: f64,
    /// Rays.
    pub(super) steps: f64,
    /// Vertices at which walks can be joined.
    pub(super) ends: f64,
    /// Light points that these ask for.
    pub(super) next_events: f64,
}

/// What one path found by the mixture tells.
#[derive(Clone, Copy, Debug)]
pub(super) struct Evidence {
    /// C² relative to the square of the picture, as a whole pass would find it.
    pub(super) square: f64,
    /// C relative to the picture.
    pub(super) value: f64,
    /// The join that found it.
    pub(super) technique: Technique,
    /// Number of the walk that found it.
    pub(super) walk: u32,
    /// r_τ by the number of the join.
    pub(super) shares: [f64; Technique::ALL.len()],
    /// Part of the merges' r that is met by chance.
    pub(super) by_chance: f64,
    /// How many more light vertices than usual such merges find at once, as a whole pass has them.
    pub(super) crowd: f64,
    /// Without noise where next events are on: a delta light seen at the first vertex.
    pub(super) steady: bool,
    /// How much more rarely it would be found without guided gathering, where that is on: a factor on the density.
    pub(super) unguided: f64,
    /// Share of the pixel that its chain carries, where it is one of [`crate::transport::chain`].
    pub(super) chain: Option<f32>,
}

#[cfg(test)]
impl Evidence {
    /// Of a path that only this join finds.
    pub(super) fn of(technique: Technique, square: f64) -> Self {
        let mut shares = [0.0; Technique::ALL.len()];
        shares[technique as usize] = 1.0;
        let (value, walk, by_chance, crowd) = (0.0, 0, 0.0, 0.0);
        Self { square, value, technique, walk, shares, by_chance, crowd, steady: false, unguided: 1.0, chain: None }
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
    /// The picture shows the vertex,
    clear: bool,
    /// which asks for so many light points then.
    few: f64,
}
impl Observe for Watch {
    fn started(&mut self, from: Vec3, light: Option<&crate::scene::emitter::Emission>) {
        self.counts.walks += 1.0;
        self.pending = false;
        self.clear = true;
        self.share = None;
        self.witness.started(from, light);
    }
    fn arrived(&mut self, surface: &Surface) {
        self.count_ends(1.0);
        self.pending = true;
        self.witness.arrived(surface);
    }
    fn cached(&mut self, vertex: &LightVertex) {
        self.witness.cached(vertex);
    }
    fn scattered(&mut self, s: &Scatter) {
        if s.delta {
            self.count_ends(-1.0);
        }
        self.pending = false;
        self.clear &= s.breadth.is_focused();
        self.witness.scattered(s);
    }
    fn returned(&mut self, vertices: usize) {
        // Nothing is joined at the end of a branch, and none begins but behind mirrors and glass.
        if self.pending {
            self.count_ends(-1.0);
        }
        self.pending = false;
        self.clear = true;
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
    fn new(witness: Witness, scene: &Scene) -> Self {
        let (counts, branches, share, chains) = (Counts::default(), BranchRays::default(), None, vec![]);
        let few = scene.lights.few().len().max(1) as f64;
        Self { witness, counts, branches, share, chains, pending: false, clear: true, few }
    }

    fn count_ends(&mut self, n: f64) {
        self.counts.ends += n;
        self.counts.next_events += n * if self.clear { self.few } else { 1.0 };
    }
}

/// What a job found.
#[derive(Default)]
struct Found {
    evidence: Vec<Evidence>,
    counts: Counts,
    branches: BranchRays,
    merges: Merges,
}

/// Numbers of merges.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Merges {
    /// Where all is focused between them and the eye.
    pub(super) clear: f64,
    /// Elsewhere.
    pub(super) by_chance: f64,
}

impl Found {
    fn join(mut self, other: Self) -> Self {
        self.evidence.extend(other.evidence);
        self.counts.walks += other.counts.walks;
        self.counts.steps += other.counts.steps;
        self.counts.ends += other.counts.ends;
        self.counts.next_events += other.counts.next_events;
        self.merges.clear += other.merges.clear;
        self.merges.by_chance += other.merges.by_chance;
        self.branches.join(other.branches);
        self
    }

    fn per_walk(&self) -> Counts {
        let Counts { walks, steps, ends, next_events } = self.counts;
        let [steps, ends, next_events] = [steps, ends, next_events].map(|n| n / walks.max(1.0));
        Counts { walks, steps, ends, next_events }
    }
}

/// All that a pilot knows to judge by.
#[derive(Default)]
pub(super) struct Findings {
    /// Paths, none of which says too much.
    pub(super) evidence: Vec<Evidence>,
    /// Per gathering walk.
    pub(super) eye: Counts,
    /// Per light path.
    pub(super) light: Counts,
    /// Merges per gathering walk, with as many light paths as the plan has.
    pub(super) merges: Merges,
    /// What walks found that came in sets of [`SET`], two for each pixel.
    pub(super) sets: Vec<Evidence>,
    branches: BranchRays,
    walks: u32,
}

impl Findings {
    /// From `paths` light paths and as large a part of the pixels, all joins of `plan` on; with walks in sets if these are wanted.
    pub(super) fn collected(pilot: &Pilot<'_>, mut plan: Plan, dark_squares: &[f64], (paths, with_sets): (u32, bool)) -> Self {
        let share = f64::from(paths) / f64::from(pilot.part(&plan).max(1));
        let squares = pilot.picture.squares();
        let unguided = plan.incident.is_some().then(|| Plan { incident: None, ..plan.clone() });
        let (shot, pieces, subpaths) =
            shot(pilot, (&plan, unguided.as_ref()), &squares, if plan.light_paths > 0 { paths } else { 0 }, share);
        let cache = LightCache::new(pieces, plan.merge_radius);
        let walks = (f64::from(pilot.pixels()) * share).ceil() as u32;
        plan.inv_light_paths = 1.0 / paths as f32;
        let subpaths = Arc::new(subpaths);
        let gathered = |walks, share, sets| {
            gathered(pilot, (&plan, unguided.as_ref()), (&squares, dark_squares), (walks, share, sets), &cache, &subpaths)
        };
        let eye = gathered(walks, share, false);
        let in_sets = if with_sets { (walks / 2).next_multiple_of(2 * SET) } else { 0 };
        let sets = gathered(in_sets, f64::from(in_sets) / f64::from(pilot.pixels()), true).evidence;
        let per_walk = |n: f64| n / f64::from(walks.max(1));
        let merges = Merges { clear: per_walk(eye.merges.clear), by_chance: per_walk(eye.merges.by_chance) };
        let light = shot.per_walk();
        let mut found = Self { eye: eye.per_walk(), light, merges, branches: eye.branches, evidence: eye.evidence, sets, walks };
        found.evidence.extend(shot.evidence);
        clip(&mut found.evidence);
        found
    }

    #[cfg(test)]
    pub(super) fn of(evidence: Vec<Evidence>, sets: Vec<Evidence>) -> Self {
        Self { evidence, sets, ..Self::default() }
    }

    /// What comes of following branches down to this or that share.
    pub(super) fn branchings(&self, given: f32) -> Vec<Branching> {
        let followed = self.evidence.iter().filter_map(|e| e.chain.map(|share| (e.square, share)));
        self.branches.judged(given, followed, self.walks)
    }
}

/// What light paths find; their vertices, and the subpaths that led to these.
fn shot(
    pilot: &Pilot<'_>,
    (plan, unguided): (&Plan, Option<&Plan>),
    squares: &[f64],
    paths: u32,
    share: f64,
) -> (Found, Vec<Vec<LightVertex>>, Vec<Subpath>) {
    let shots: Vec<_> = (0..paths.div_ceil(JOB))
        .into_par_iter()
        .map(|job| {
            let cx = Context::new(pilot.scene, plan, 0);
            let mut watch = Watch::new(Witness::default(), pilot.scene);
            watch.witness.expect_shooting(true);
            let (mut vertices, mut splats, mut rays) = (vec![], Splats(vec![]), RayCounts::default());
            for index in job * JOB..((job + 1) * JOB).min(paths) {
                let mut random = Random::new(Family::Pilot, u64::from(index) | 1 << 34, 0, plan.settings.seed);
                let mut tally = Tally { record: &mut splats, rays: &mut rays, observe: &mut watch };
                shoot(cx, Some(&mut vertices), &mut random, &mut tally);
            }
            watch.counts.steps = rays.shoot as f64;
            let seen = watch.witness.seen.iter().zip(&splats.0);
            let tell = |t, cell: Cell| evidence((cx, unguided), t, squares[cell as usize], share);
            let evidence = seen.filter_map(|(t, raster)| tell(t, pilot.picture.cell(*raster)?)).collect();
            let found = Found { evidence, counts: watch.counts, ..Found::default() };
            (found, vertices, watch.witness.into_subpaths())
        })
        .collect();
    let (mut all, mut pieces, mut subpaths) = (Found::default(), vec![], vec![]);
    for (found, vertices, paths) in shots {
        all = all.join(found);
        pieces.push(vertices);
        subpaths.extend(paths);
    }
    (all, pieces, subpaths)
}

/// What `walks` gathering walks find, a `share` of a pass.
fn gathered(
    pilot: &Pilot<'_>,
    (plan, unguided): (&Plan, Option<&Plan>),
    (squares, dark_squares): (&[f64], &[f64]),
    (walks, share, sets): (u32, f64, bool),
    cache: &LightCache,
    subpaths: &Arc<Vec<Subpath>>,
) -> Found {
    let follows = plan.settings.follows_chains();
    let found: Vec<Found> = (0..walks.div_ceil(JOB))
        .into_par_iter()
        .map(|job| {
            let cx = Context::new(pilot.scene, plan, 0);
            let mut watch = Watch::new(Witness::with_subpaths(subpaths.clone()), pilot.scene);
            let mut rays = RayCounts::default();
            let (mut found, mut merges) = (vec![], Merges::default());
            for index in job * JOB..((job + 1) * JOB).min(walks) {
                let (mut random, raster) = if sets {
                    of_set(pilot, plan, index, walks)
                } else {
                    let mut random = Random::new(Family::Pilot, u64::from(index) | 1 << 35, 0, plan.settings.seed);
                    let raster = pilot.raster(index, walks, &mut random);
                    (random, raster)
                };
                let mut tally = Tally { record: &mut (), rays: &mut rays, observe: &mut watch };
                gather(cx, raster, 1.0, cache, &mut random, &mut tally);
                let Some(cell) = pilot.picture.cell(raster) else { continue };
                let mut chains = watch.chains.drain(..).peekable();
                for (i, t) in watch.witness.seen.drain(..).enumerate() {
                    let chain = chains.next_if(|(at, _)| *at == i).map(|(_, share)| share);
                    if chain.is_none() && follows && t.path.vertices.iter().all(|v| v.dirac.is_some()) {
                        // What chains vary is measured apart.
                        continue;
                    }
                    let merge = t.key.0 == Technique::Merge;
                    if merge && sets {
                        continue;
                    }
                    if merge {
                        let clear =
                            t.path.vertices[..merged(&t.path, t.key.1) - 1].iter().all(|v| v.breadth(pilot.scene).is_focused());
                        *(if clear { &mut merges.clear } else { &mut merges.by_chance }) += 1.0 / share;
                    }
                    let told = evidence((cx, unguided), &t, squares[cell as usize], share);
                    // A lamp's image shines on its cell alone, its reflections on dark ones around it.
                    let darker = if chain.is_some() { squares[cell as usize] / dark_squares[cell as usize] } else { 1.0 };
                    found.extend(told.map(|e| Evidence { walk: index, chain, square: e.square * darker, ..e }));
                }
            }
            watch.counts.steps = rays.gather as f64 - watch.branches.all;
            Found { evidence: found, counts: watch.counts, branches: watch.branches, merges }
        })
        .collect();
    found.into_iter().fold(Found::default(), Found::join)
}

/// A walk of a set, and its start.
fn of_set(pilot: &Pilot<'_>, plan: &Plan, index: u32, walks: u32) -> (Random, Vec2) {
    let seed = plan.settings.seed;
    let (pair, set) = (index / (2 * SET), index / SET);
    let numbers = |i: u32| Random::new(Family::Pilot, u64::from(i) | 1 << 38, 0, seed);
    let pixel = pilot.pixel(pair, walks / (2 * SET), &mut numbers(pair));
    let [walk, set] = [index, set].map(|i| u64::from(i) | 1 << 39);
    let mut random = plan.random(Family::Pilot, (walk, 0), (set, u64::from(index % SET)), GATHER_AXES);
    let raster = pixel + random.axis2();
    (random, raster)
}

/// The number of the vertex (1: the first from the eye) at which a merge joined a path to `s` vertices that shooting made.
fn merged(path: &Path, s: usize) -> usize {
    path.vertices.len() + 2 - s
}

/// Limits what a single path can say; chains are all found, none by luck.
fn clip(evidence: &mut [Evidence]) {
    let by_luck = |e: &&Evidence| e.chain.is_none();
    // Of few, each may be twice their mean.
    let part = MOST.max(2.0 / evidence.iter().filter(by_luck).count().max(1) as f64);
    let most = limit(evidence.iter().filter(by_luck).map(|e| e.square), part, CLIPPINGS);
    evidence.iter_mut().filter(|e| e.chain.is_none()).for_each(|e| e.square = e.square.min(most));
}

/// `unguided`: the plan without guided gathering, where it has that. Shares are those of the balance heuristic.
fn evidence((cx, unguided): (Context<'_>, Option<&Plan>), t: &Testimony, square: f64, share: f64) -> Option<Evidence> {
    let value = f64::from(t.value.mean());
    if !(value > 0.0 && value.is_finite() && square > 0.0) {
        return None;
    }
    let (mut shares, mut by_chance, mut crowd) = ([0.0; Technique::ALL.len()], 0.0, 0.0);
    let total = |joins: &[(JoinKey, f64)]| joins.iter().map(|j| j.1).sum::<f64>();
    let densities = t.path.densities(cx);
    let found = products(&densities, cx.plan, cx.eta.into());
    let density = total(&found);
    let crowd_at = |s: usize| {
        let i = merged(&t.path, s);
        (!densities.is_clear(i)).then_some(densities.crowd[i])
    };
    for ((technique, s), product) in &found {
        let share = if density > 0.0 { product / density } else { 0.0 };
        shares[*technique as usize] += share;
        if *technique == Technique::Merge
            && let Some(more) = crowd_at(*s)
        {
            by_chance += share;
            crowd += share * more;
        }
    }
    crowd /= by_chance.max(f64::MIN_POSITIVE);
    by_chance /= shares[Technique::Merge as usize].max(f64::MIN_POSITIVE);
    // What is merged at once is one find, and each part of it has but a part of the weight.
    let at_once = if t.key.0 == Technique::Merge { 1.0 + crowd_at(t.key.1).unwrap_or(0.0) } else { 1.0 };
    let unguided = unguided.map_or(1.0, |plan| {
        let cx = cx.with_plan(plan);
        total(&products(&t.path.densities(cx), plan, cx.eta.into())) / density
    });
    let steady = t.path.light_delta && t.path.vertices.len() == 1;
    // Of merges, each is as much more worth as it is more rare in a part of a pass.
    let often = if t.key.0 == Technique::Merge { 1.0 } else { 1.0 / share };
    (shares.iter().sum::<f64>().is_finite() && unguided.is_finite()).then_some(Evidence {
        square: often * at_once * value * value / square,
        value: value / square.sqrt() * if t.key.0 == Technique::Merge { share } else { 1.0 },
        technique: t.key.0,
        walk: 0,
        shares,
        by_chance,
        crowd,
        unguided,
        steady,
        chain: None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn luck_does_not_decide() {
        let of = |square| Evidence::of(Technique::Hit, square);
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
