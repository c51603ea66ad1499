//! What is measured before a render starts: how many light vertices a light path leaves, where light
//! paths should start, and how far apart vertices may be to be merged.
//!
//! The pilot is a small bidirectional render of the same measurement: some of the pixels gather, a
//! proportional number of light paths is shot, in rounds that double, and some more while it still learns. After each round the guide of
//! emission is refined by what each light path added to the noise of the image, relative to the image
//! (as relMSE counts it): the squares of its weighted splats and connections. What the pilot decides
//! enters weights and densities and must not depend on the samples that are weighted with it; it
//! draws from its own family of random numbers and sums in a fixed order, so it is a function of
//! scene, settings and seed alone, the same for all shards of a render.

mod branching;
mod chains;
mod choice;
mod evidence;
mod lessons;
mod noise;
mod trail;

use crate::local::Breadth;
use crate::math::Random;
use crate::math::random::Family;
use crate::scene::emitter::Emission;
use crate::scene::emitter::guide::{Guide, Start};
use crate::scene::{Scene, Surface};
use crate::transport::cache::{LightCache, LightVertex};
use crate::transport::crowd::Crowds;
use crate::transport::first_seen::FirstSeen;
use crate::transport::gather::{follow, gather};
use crate::transport::incident::{Incident, Lesson};
use crate::transport::settings::{Coupling, NO_BRANCHES, NO_SPLITS, Plan, Settings, Techniques};
use crate::transport::shoot::shoot;
use crate::transport::vertex::Scatter;
use crate::transport::walk::{Context, Join, Observe, Tally};
use crate::transport::{Contribution, RayCounts, Record, Technique};
use choice::Chosen;
use glam::{Vec2, Vec3};
use lessons::Lessons;
use rayon::prelude::*;
use std::sync::Arc;
use trail::{NONE, Tracker, Trail, shifted};

/// Light paths of a job.
const JOB: u32 = 1024;
/// Rounds, each of twice the paths of the one before.
const ROUNDS: u32 = 6;
/// At most so many more follow, as large as the last, as long as guided emission is still on its way.
const MORE_ROUNDS: u32 = 8;
/// Least and most light paths of the last round.
const LAST_ROUND: std::ops::RangeInclusive<u32> = 4096..=65_536;
/// A light path counts for at most so many times the mean.
const MOST: f64 = 50.0;
/// Gathering walks that look for vertices to merge.
const SCOUTS: u32 = 4096;
/// Vertices are merged within so many times the side of a pixel.
const MERGED_PIXELS: f32 = 2.0;
/// A gathering walk that comes to a merge by chance finds so many light vertices, not more: by then the noise is the walk's, and each
/// costs time.
const FEW: f64 = 3.0;
/// The round before which techniques are chosen for the first time.
const CHOICE: u32 = 3;
/// Light paths that judge techniques, at most.
const JUDGES: u32 = 8192;
/// Cells on each side of one that are taken together with it.
const BLUR: u32 = 2;
/// Cells of the coarse image along its longer side, at most.
const CELLS: u32 = 64;

/// Index of a cell of the coarse image.
type Cell = u32;

/// What a pilot decides.
#[derive(Clone, Debug)]
pub struct Decisions {
    /// What is asked for, with what was left to the pilot filled in.
    pub settings: Settings,
    /// Mean number of light vertices per light path; 0 where connections are off.
    pub vertices_per_path: f64,
    /// Radius of merges in the first pass; 0 where there is nothing to merge.
    pub merge_radius: f32,
    /// Merges that are met by chance have this part of the area of others.
    pub by_chance: f32,
    /// Where many light vertices are merged at once.
    pub crowds: Arc<Crowds>,
    /// Which pixels have more than one sample of chains.
    pub first_seen: Arc<FirstSeen>,
    /// Where light paths start.
    pub guide: Guide,
    /// Where gathering walks find light, if they are to go there.
    pub incident: Option<Arc<Incident>>,
}

/// Part of its area that a merge has where a gathering walk comes by chance and would find `usual` light vertices.
fn part_by_chance(usual: f64) -> f64 {
    (FEW / usual).min(1.0)
}

/// Runs the pilot of a render of the crop window `crop` (x, y, width, height).
pub fn decide(scene: &Scene, settings: &Settings, crop: [u32; 4]) -> Decisions {
    let decisions = measured(scene, settings, crop);
    if decisions.first_seen.is_unknown() && decisions.settings.chain_samples > 1 {
        let first_seen = Arc::new(FirstSeen::looked_at(scene, crop, settings.seed));
        return Decisions { first_seen, ..decisions };
    }
    decisions
}

/// The same, without a look into every pixel where the choice of techniques had none.
fn measured(scene: &Scene, settings: &Settings, crop: [u32; 4]) -> Decisions {
    let t = settings.techniques;
    let connects = t.connect && settings.connections > 0;
    let nothing = Decisions::nothing(settings);
    // Where gathering walks go is learned where it is asked for, or may be chosen.
    let mut goes =
        settings.coupling == Coupling::All && t.gathers() && (settings.guided_gathering || settings.automatic && settings.guided);
    if !(t.splat || connects || t.merge || goes) || scene.lights.is_empty() {
        return nothing;
    }
    let mut pilot = Pilot::new(scene, settings, crop);
    // The first round only counts, since without a count there are no connections to learn from.
    let merge_radius = if t.merge { settings.merge_radius.unwrap_or_else(|| pilot.merge_radius()) } else { 0.0 };
    let mut so_far = Lessons::new(scene, Decisions { merge_radius, ..nothing });
    let last = (pilot.part(&pilot.plan(&so_far.decisions)) / 2).clamp(*LAST_ROUND.start(), *LAST_ROUND.end());
    let halved = |round: u32| last >> (ROUNDS - 1).saturating_sub(round);
    for round in 0..ROUNDS + MORE_ROUNDS {
        if round >= ROUNDS && !so_far.still_learns() {
            break;
        }
        if round == CHOICE && settings.automatic {
            let paths = so_far.paths(&pilot, halved(round));
            so_far.choose(&pilot, paths, Chosen::ForRounds);
        }
        let paths = if round < CHOICE { halved(round).max(JOB) } else { so_far.paths(&pilot, halved(round)) };
        so_far.learn(&mut pilot, (round, paths), goes);
        let decides = round == CHOICE && goes && !settings.guided_gathering;
        if decides && !choice::goes(&pilot, &so_far.decisions, paths.min(JUDGES / 2)) {
            goes = false;
            so_far.decisions.incident = None;
        }
        if !goes && !so_far.shoots() {
            break;
        }
    }
    if settings.automatic {
        // Once more, knowing what light paths find by now; then a round counts for what is chosen.
        so_far.choose(&pilot, JUDGES, Chosen::ForRender);
        if so_far.shoots() {
            let paths = so_far.paths(&pilot, last / 4);
            so_far.learn(&mut pilot, (ROUNDS + MORE_ROUNDS, paths), goes);
        }
    }
    so_far.decided()
}

impl Decisions {
    fn nothing(settings: &Settings) -> Self {
        Self {
            settings: settings.clone(),
            vertices_per_path: 0.0,
            merge_radius: 0.0,
            by_chance: 1.0,
            crowds: Arc::default(),
            first_seen: Arc::default(),
            guide: Guide::default(),
            incident: None,
        }
    }

    /// The counts that follow for a render of the crop window `crop`.
    pub fn plan(&self, scene: &Scene, crop: [u32; 4]) -> Plan {
        let pixels = crop[2].saturating_mul(crop[3]);
        let film = scene.film.width.saturating_mul(scene.film.height);
        let settings = Settings { merge_radius: Some(self.merge_radius), ..self.settings.clone() };
        let incident = self.incident.clone();
        Plan {
            guide: self.guide.clone(),
            incident,
            by_chance: self.by_chance,
            crowds: self.crowds.clone(),
            first_seen: self.first_seen.clone(),
            ..Plan::new(&settings, pixels, film, self.vertices_per_path)
        }
    }

    /// For the identity of a film: all that enters densities and weights and is not the scene's or the
    /// settings'.
    pub fn bytes(&self) -> Vec<u8> {
        let Techniques { hit, next_event, splat, connect, merge } = self.settings.techniques;
        let mut bytes = [hit, next_event, splat, connect, merge].map(u8::from).to_vec();
        bytes.extend(self.settings.light_paths.unwrap_or(0).to_le_bytes());
        bytes.extend(self.vertices_per_path.to_bits().to_le_bytes());
        bytes.extend(self.merge_radius.to_bits().to_le_bytes());
        bytes.extend(self.by_chance.to_bits().to_le_bytes());
        bytes.extend(self.settings.faint.to_bits().to_le_bytes());
        bytes.extend(self.settings.chain_samples.to_le_bytes());
        bytes.push(u8::from(self.settings.guided_gathering));
        bytes
    }
}

struct Pilot<'a> {
    scene: &'a Scene,
    settings: &'a Settings,
    crop: [u32; 4],
    /// Pixels per cell of the coarse image, along each axis.
    step: u32,
    /// Cells per row, rows.
    cells: [u32; 2],
    /// Sum over rounds of estimates of the coarse image (weighted by light paths), and their weight.
    image: Vec<f64>,
    weight: f64,
}

/// A contribution to a cell of the coarse image.
#[derive(Clone, Copy)]
struct Seen {
    cell: u32,
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

/// Area across a pixel's rays of the vertices that a gathering walk could merge.
#[derive(Default)]
struct Footprints {
    last: Vec3,
    distance: f32,
    /// Pixels per steradian, or per area where rays are parallel.
    density: f32,
    parallel: bool,
    after_narrow: bool,
    found: Vec<f32>,
}
impl Observe for Footprints {
    fn started(&mut self, from: Vec3, _: Option<&Emission>) {
        *self = Self {
            last: from,
            parallel: self.parallel,
            density: self.density,
            found: std::mem::take(&mut self.found),
            ..Self::default()
        };
    }
    fn arrived(&mut self, surface: &Surface) {
        self.distance += surface.p.distance(self.last);
        self.last = surface.p;
        if self.after_narrow {
            let spread = if self.parallel { 1.0 } else { self.distance * self.distance };
            self.found.push(spread / self.density);
        }
    }
    fn scattered(&mut self, s: &Scatter) {
        if s.breadth.is_narrow() && self.after_narrow {
            self.found.pop();
        }
        self.after_narrow = s.breadth.is_narrow();
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

/// What a round taught.
struct Round {
    /// Light vertices.
    vertices: u64,
    /// How many more than usual a whole pass merges at once.
    crowds: Crowds,
    /// What each light path that was of use is worth.
    starts: Vec<(Start, f64)>,
    /// Where light was found to arrive.
    incident: Vec<Lesson>,
}

impl<'a> Pilot<'a> {
    fn new(scene: &'a Scene, settings: &'a Settings, crop: [u32; 4]) -> Self {
        let step = crop[2].max(crop[3]).div_ceil(CELLS).max(1);
        let cells = [crop[2].div_ceil(step), crop[3].div_ceil(step)];
        let count = cells[0] as usize * cells[1] as usize;
        Self { scene, settings, crop, step, cells, image: vec![0.0; count], weight: 0.0 }
    }

    fn plan(&self, decisions: &Decisions) -> Plan {
        decisions.plan(self.scene, self.crop)
    }

    /// Radius in which vertices should be merged in the first pass: some pixels as they appear on what
    /// can be merged, so that merging blurs less than the film does.
    fn merge_radius(&self) -> f32 {
        let techniques = Techniques { next_event: false, ..Techniques::GATHER };
        let settings = Settings { techniques, faint: NO_BRANCHES, faintest_split: NO_SPLITS, ..self.settings.clone() };
        let plan = Plan::new(&settings, 1, 1, 0.0);
        let jobs = (0..SCOUTS / JOB).into_par_iter().map(|job| {
            let mut footprints = Footprints { parallel: self.scene.sensor.is_orthographic(), ..Footprints::default() };
            for index in job * JOB..(job + 1) * JOB {
                let mut random = Random::new(Family::Pilot, u64::from(index) | 1 << 33, 0, self.settings.seed);
                let raster = self.raster(index, SCOUTS, &mut random);
                let start = self.scene.sensor.sample_ray(raster, random.unit2());
                footprints.density = self.scene.sensor.density(start.d);
                let mut tally = Tally { record: &mut (), rays: &mut RayCounts::default(), observe: &mut footprints };
                follow(Context::new(self.scene, &plan, 0), start, 1.0, &LightCache::default(), &mut random, &mut tally);
            }
            footprints.found
        });
        let mut areas: Vec<f32> = jobs.collect::<Vec<_>>().concat();
        if areas.is_empty() {
            return 0.0;
        }
        areas.sort_by(f32::total_cmp);
        MERGED_PIXELS * areas[areas.len() / 2].sqrt()
    }

    /// A point of the `index`-th of `walks` pixels that are evenly spread in the order of rows.
    fn raster(&self, index: u32, walks: u32, random: &mut Random) -> Vec2 {
        self.pixel(index, walks, random) + random.unit2()
    }

    /// The corner of that pixel.
    fn pixel(&self, index: u32, walks: u32, random: &mut Random) -> Vec2 {
        let pixels = f64::from(self.crop[2]) * f64::from(self.crop[3]);
        let pixel = ((f64::from(index) + f64::from(random.unit())) / f64::from(walks) * pixels) as u32;
        let (x, y) = (pixel % self.crop[2], (pixel / self.crop[2]).min(self.crop[3] - 1));
        Vec2::new((self.crop[0] + x) as f32, (self.crop[1] + y) as f32)
    }

    /// Cell of the coarse image around a point of the film, if it is in the crop window.
    fn cell(&self, raster: Vec2) -> Option<u32> {
        let at = raster - Vec2::new(self.crop[0] as f32, self.crop[1] as f32);
        let (x, y) = (at.x.floor() as i64, at.y.floor() as i64);
        if x < 0 || y < 0 || x >= i64::from(self.crop[2]) || y >= i64::from(self.crop[3]) {
            return None;
        }
        Some(y as u32 / self.step * self.cells[0] + x as u32 / self.step)
    }

    /// Pixels of a cell.
    fn cell_pixels(&self, cell: u32) -> f64 {
        let (x, y) = (cell % self.cells[0] * self.step, cell / self.cells[0] * self.step);
        f64::from((self.crop[2] - x).min(self.step) * (self.crop[3] - y).min(self.step))
    }

    fn pixels(&self) -> u32 {
        self.crop[2].saturating_mul(self.crop[3])
    }

    /// Walks of either kind in a whole pass, of which a round has a part.
    fn part(&self, plan: &Plan) -> u32 {
        if plan.light_paths > 0 { plan.light_paths } else { self.pixels() }
    }

    /// One round, with so many light paths or, where there are none, as many gathering walks.
    fn round(&mut self, so_far: &Decisions, (round, paths): (u32, u32), goes: bool) -> Round {
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
        self.weight += share;
        for s in &seen {
            self.image[s.cell as usize] += f64::from(s.value);
        }
        for s in gathered.iter().flat_map(|(seen, ..)| seen) {
            self.image[s.cell as usize] += f64::from(s.value) * share / eye_share;
        }
        let mut met = [0u64; 2];
        for (found, steps, more) in gathered {
            met = [0, 1].map(|i| met[i] + more[i]);
            let offset = trail.append(steps);
            seen.extend(found.into_iter().map(|s| Seen { steps: [shifted(s.steps[0], offset), s.steps[1]], ..s }));
        }
        let squares = self.squares();
        let relative = |s: &Seen| f64::from(s.value) / squares[s.cell as usize].max(f64::MIN_POSITIVE).sqrt();
        let incident = trail.lessons(seen.iter().flat_map(|s| s.steps.map(|step| (step, relative(s)))));
        let usual = met[1] as f64 / (met[0].max(1) as f64 * share * f64::from(plan.by_chance));
        let crowds = Crowds::new(merging.into_iter(), plan.merge_radius, share as f32).with_usual(usual as f32);
        Round { vertices: u64::from(cache.len()), crowds, starts: self.lessons(&squares, &seen, &starts), incident }
    }

    /// Square of the coarse image per pixel, and a little more, so that black parts do not outweigh all.
    /// A cell has seen few walks, so it is taken together with those around it: where it was missed by
    /// chance, the first contribution would seem enormous.
    fn squares(&self) -> Vec<f64> {
        self.each_cell(|at| {
            let add = |(s, p): (f64, f64), c: u32| (s + self.image[c as usize], p + self.cell_pixels(c));
            let (sum, pixels) = self.around(at).fold((0.0, 0.0), add);
            sum / (self.weight * pixels)
        })
    }

    /// The cells around one, itself included.
    fn around(&self, (x, y): (u32, u32)) -> impl Iterator<Item = u32> {
        let [columns, rows] = self.cells;
        let near = |at: u32, size: u32| at.saturating_sub(BLUR)..(at + BLUR + 1).min(size);
        let row = near(x, columns);
        near(y, rows).flat_map(move |y| row.clone().map(move |x| y * columns + x))
    }

    /// Squares of a radiance of each cell, and a little more.
    fn each_cell(&self, radiance: impl Fn((u32, u32)) -> f64) -> Vec<f64> {
        let [columns, rows] = self.cells;
        let mean = self.image.iter().sum::<f64>() / (self.weight * f64::from(self.crop[2]) * f64::from(self.crop[3]));
        let all = (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y)));
        all.map(|at| radiance(at).powi(2) + 0.01 * mean * mean).collect()
    }

    /// The same from the median of the cells around: beside something far brighter, what the dark ones have.
    fn dark_squares(&self) -> Vec<f64> {
        self.each_cell(|at| {
            let radiance = |c: u32| self.image[c as usize] / (self.weight * self.cell_pixels(c));
            let mut all: Vec<f64> = self.around(at).map(radiance).collect();
            let middle = all.len() / 2;
            *all.select_nth_unstable_by(middle, f64::total_cmp).1
        })
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
                if let Some(cell) = self.cell(raster) {
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
            let Some(cell) = self.cell(raster) else { continue };
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
