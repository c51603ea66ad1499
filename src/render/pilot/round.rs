//! One round: walks of both kinds, and what each light path was worth to the picture.

use super::picture::Cell;
use super::trail::{NONE, Tracker, Trail, shifted};
use super::{Decisions, JOB, Pilot};
use crate::local::Breadth;
use crate::math::Random;
use crate::math::random::Family;
use crate::scene::emitter::Emission;
use crate::scene::emitter::guide::{Guide, Start};
use crate::scene::{Scene, Surface};
use crate::transport::cache::{LightCache, LightVertex};
use crate::transport::crowd::Crowds;
use crate::transport::gather::gather;
use crate::transport::incident::Lesson;
use crate::transport::settings::Plan;
use crate::transport::shoot::shoot;
use crate::transport::vertex::Scatter;
use crate::transport::walk::{Context, Join, Observe, Tally};
use crate::transport::{Contribution, RayCounts, Record, Technique};
use glam::{Vec2, Vec3};
use rayon::prelude::*;

/// A light path counts for at most so many times the mean.
const MOST: f64 = 50.0;

/// What a round taught.
pub(super) struct Round {
    /// Light vertices.
    pub(super) vertices: u64,
    /// How many more than usual a whole pass merges at once.
    pub(super) crowds: Crowds,
    /// What each light path that was of use is worth.
    pub(super) starts: Vec<(Start, f64)>,
    /// Where light was found to arrive.
    pub(super) incident: Vec<Lesson>,
}

/// A contribution to a cell of the picture.
#[derive(Clone, Copy)]
struct Seen {
    cell: Cell,
    value: f32,
    /// Index of the light path in the round; `u32::MAX` where none took part.
    path: u32,
    /// Last steps of both walks, in the trails of the round.
    steps: [u32; 2],
    /// Factor on the square of the value: how much more often a whole pass finds the like.
    often: f32,
}

/// Collects what one job finds.
struct Collect<'p> {
    pilot: &'p Pilot<'p>,
    seen: Vec<Seen>,
    starts: Vec<Option<Start>>,
    /// What a light path that has arrived nowhere yet started with.
    light: Option<Emission>,
    guide: &'p Guide,
    tracker: Tracker<'p>,
    /// Step of each vertex that went into the cache.
    cached: Vec<u32>,
    /// Step from which each splat was seen.
    seen_at: Vec<u32>,
}

impl Observe for Collect<'_> {
    fn started(&mut self, from: Vec3, light: Option<&Emission>) {
        self.tracker.started(from, light);
        self.light = light.copied();
    }
    fn arrived(&mut self, surface: &Surface) {
        if let (Some(light), Some(start)) = (self.light.take(), self.starts.last_mut()) {
            *start = self.pilot.scene.lights.start(self.guide, &light, surface.p.distance(light.point.y));
        }
        self.tracker.arrived(surface);
    }
    fn cached(&mut self, _: &LightVertex) {
        self.cached.push(self.tracker.last);
    }
    fn scattered(&mut self, s: &Scatter) {
        self.tracker.scattered(s);
    }
    fn joined(&mut self, join: Join<'_>) {
        // A lamp seen directly is no walk's.
        self.seen_at.push(if join.length > 1 { self.tracker.last } else { NONE });
    }
}

struct Splats<'a>(&'a mut Vec<(Vec2, f32)>);
impl Record for Splats<'_> {
    fn gathered(&mut self, _: Contribution) {}
    fn splatted(&mut self, raster: Vec2, _: &mut Random, c: Contribution) {
        self.0.push((raster, c.value.mean()));
    }
}

/// Joins of a gathering walk: values with the index of the light vertex, where one took part, and the walk's last step.
struct Joins<'a> {
    found: Vec<(f32, Technique, usize, u32)>,
    tracker: Tracker<'a>,
    scene: &'a Scene,
    /// Not all events were focused: what is merged is met by chance.
    by_chance: bool,
    /// Vertices that merge with all around, and how many they find.
    met: [u64; 2],
}
impl Observe for Joins<'_> {
    fn started(&mut self, from: Vec3, light: Option<&Emission>) {
        self.by_chance = false;
        self.tracker.started(from, light);
    }
    fn arrived(&mut self, surface: &Surface) {
        self.met[0] += u64::from(self.by_chance && self.scene.materials.breadth(surface.material) > Breadth::Sharp);
        self.tracker.arrived(surface);
    }
    fn scattered(&mut self, s: &Scatter) {
        self.by_chance |= !s.breadth.is_focused();
        self.tracker.scattered(s);
    }
    fn returned(&mut self, _: usize) {
        // To a vertex that only Dirac events led to: no step was made there.
        self.by_chance = false;
        self.tracker.last = NONE;
    }
    fn joined(&mut self, join: Join<'_>) {
        self.met[1] += u64::from(self.by_chance && join.technique == Technique::Merge);
        self.found.push((join.value.mean(), join.technique, join.light_vertex, self.tracker.last));
    }
}

/// What a shooting job leaves.
struct Shot {
    seen: Vec<Seen>,
    starts: Vec<Option<Start>>,
    vertices: Vec<LightVertex>,
    /// Light path of each vertex, and its step.
    owners: Vec<(u32, u32)>,
    trail: Trail,
}

impl Pilot<'_> {
    /// One round, with so many light paths or, where there are none, as many gathering walks.
    pub(super) fn round(&mut self, so_far: &Decisions, (round, paths): (u32, u32), goes: bool) -> Round {
        let mut plan = self.plan(so_far);
        let shot = if plan.light_paths > 0 { paths } else { 0 };
        let shots: Vec<Shot> =
            (0..shot.div_ceil(JOB)).into_par_iter().map(|job| self.shoot(&plan, round, (job, paths), goes)).collect();
        let (mut seen, mut starts, mut owners, mut pieces, mut trail) = (vec![], vec![], vec![], vec![], Trail::default());
        for shot in shots {
            let offset = trail.append(shot.trail);
            seen.extend(shot.seen.into_iter().map(|s| Seen { steps: s.steps.map(|i| shifted(i, offset)), ..s }));
            starts.extend(shot.starts);
            owners.extend(shot.owners.into_iter().map(|(path, step)| (path, shifted(step, offset))));
            pieces.push(shot.vertices);
        }
        let merging: Vec<Vec3> = pieces.iter().flatten().filter(|v| v.merges.is_some()).map(|v| v.surface.p).collect();
        let cache = LightCache::new(pieces, plan.merge_radius);
        // Of N light paths and P pixels per pass, n light paths and n·P/N pixels take part.
        let pixels = f64::from(self.crop[2]) * f64::from(self.crop[3]);
        let share = f64::from(paths) / f64::from(self.part(&plan).max(1));
        let walks = if plan.settings.techniques.gathers() { (pixels * share).ceil() as u32 } else { 0 };
        // Connections and merges of the whole pass are estimated from the light vertices of this part.
        plan.inv_light_paths = 1.0 / paths as f32;
        let gathered: Vec<(Vec<Seen>, Trail, [u64; 2])> = (0..walks.div_ceil(JOB))
            .into_par_iter()
            .map(|job| self.gather(&plan, round, (job, walks), (&cache, &owners, share as f32), goes))
            .collect();
        let eye_share = f64::from(walks) / pixels;
        self.picture.expect(share);
        seen.iter().for_each(|s| self.picture.add(s.cell, s.value.into()));
        for s in gathered.iter().flat_map(|(seen, ..)| seen) {
            self.picture.add(s.cell, f64::from(s.value) * share / eye_share);
        }
        let mut met = [0u64; 2];
        for (found, steps, more) in gathered {
            met = [0, 1].map(|i| met[i] + more[i]);
            let offset = trail.append(steps);
            seen.extend(found.into_iter().map(|s| Seen { steps: [shifted(s.steps[0], offset), s.steps[1]], ..s }));
        }
        let squares = self.picture.squares();
        let relative = |s: &Seen| f64::from(s.value) / squares[s.cell as usize].max(f64::MIN_POSITIVE).sqrt();
        let incident = trail.lessons(seen.iter().flat_map(|s| s.steps.map(|step| (step, relative(s)))));
        let usual = met[1] as f64 / (met[0].max(1) as f64 * share * f64::from(plan.by_chance));
        let crowds = Crowds::new(merging.into_iter(), plan.merge_radius, share as f32).with_usual(usual as f32);
        Round { vertices: u64::from(cache.len()), crowds, starts: self.lessons(&squares, &seen, &starts), incident }
    }

    /// √Σ (v/I)² of each light path over its contributions.
    fn lessons(&self, squares: &[f64], seen: &[Seen], starts: &[Option<Start>]) -> Vec<(Start, f64)> {
        let mut worth = vec![0.0f64; starts.len()];
        for s in seen.iter().filter(|s| s.path != u32::MAX) {
            let square = squares[s.cell as usize];
            if square > 0.0 {
                worth[s.path as usize] += f64::from(s.often) * f64::from(s.value).powi(2) / square;
            }
        }
        let of_use: Vec<_> = starts.iter().zip(worth).filter_map(|(s, w)| s.filter(|_| w > 0.0).map(|s| (s, w))).collect();
        // One path that was lucky once must not draw all others after it.
        let most = MOST * of_use.iter().map(|(_, w)| w).sum::<f64>() / of_use.len().max(1) as f64;
        of_use.into_iter().map(|(start, w)| (start, w.min(most).sqrt())).collect()
    }

    fn shoot(&self, plan: &Plan, round: u32, (job, paths): (u32, u32), goes: bool) -> Shot {
        let cx = Context::new(self.scene, plan, 0);
        let keeps = plan.settings.techniques.connect || plan.keeps_vertices();
        let tracker = Tracker::new(self.scene, plan.settings.techniques.next_event, goes);
        let (guide, starts, cached, seen_at) = (&plan.guide, vec![], vec![], vec![]);
        let mut observe = Collect { pilot: self, seen: vec![], starts, light: None, guide, tracker, cached, seen_at };
        let (mut vertices, mut owners, mut pending, mut rays) = (vec![], vec![], vec![], RayCounts::default());
        for index in job * JOB..((job + 1) * JOB).min(paths) {
            let mut random = Random::new(Family::Pilot, u64::from(index), u64::from(round), plan.settings.seed);
            observe.starts.push(None);
            let mut tally = Tally { record: &mut Splats(&mut pending), rays: &mut rays, observe: &mut observe };
            shoot(cx, keeps.then_some(&mut vertices), &mut random, &mut tally);
            owners.extend(observe.cached.drain(..).map(|step| (index, step)));
            for ((raster, value), step) in
                pending.drain(..).zip(observe.seen_at.drain(..)).filter(|((_, value), _)| value.is_finite())
            {
                if let Some(cell) = self.picture.cell(raster) {
                    observe.seen.push(Seen { cell, value, path: index, often: 1.0, steps: [NONE, step] });
                }
            }
        }
        Shot { seen: observe.seen, starts: observe.starts, vertices, owners, trail: observe.tracker.trail }
    }

    /// Gathers on `walks` pixels, with the light vertices of `share` of a pass; with what is seen and the trail, how many vertices
    /// merged by chance, and how many they found.
    fn gather(
        &self,
        plan: &Plan,
        round: u32,
        (job, walks): (u32, u32),
        (cache, owners, share): (&LightCache, &[(u32, u32)], f32),
        goes: bool,
    ) -> (Vec<Seen>, Trail, [u64; 2]) {
        let cx = Context::new(self.scene, plan, 0);
        let (mut seen, mut rays) = (vec![], RayCounts::default());
        let tracker = Tracker::new(self.scene, plan.settings.techniques.next_event, goes);
        let mut joins = Joins { found: vec![], tracker, scene: self.scene, by_chance: false, met: [0; 2] };
        for index in job * JOB..((job + 1) * JOB).min(walks) {
            // A walk's number beyond those of all light paths: the two never share a stream.
            let mut random = Random::new(Family::Pilot, u64::from(index) | 1 << 32, u64::from(round), plan.settings.seed);
            let raster = self.raster(index, walks, &mut random);
            let mut tally = Tally { record: &mut (), rays: &mut rays, observe: &mut joins };
            gather(cx, raster, 1.0, cache, &mut random, &mut tally);
            let found = joins.found.drain(..);
            let Some(cell) = self.picture.cell(raster) else { continue };
            for (value, technique, vertex, step) in found.filter(|(value, ..)| value.is_finite()) {
                // A whole pass connects each light vertex as often, since there are more of both walks; a
                // merge finds the more gathering vertices, each to share with more light vertices.
                let ((path, light_step), often) = match technique {
                    Technique::Connect => (owners[vertex], 1.0),
                    Technique::Merge => (owners[vertex], share),
                    _ => ((u32::MAX, NONE), 1.0),
                };
                seen.push(Seen { cell, value, path, often, steps: [step, light_step] });
            }
        }
        (seen, joins.tracker.trail, joins.met)
    }
}
