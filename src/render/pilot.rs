//! What is measured before a render starts: how many light vertices a light path leaves, and where
//! light paths should start.
//!
//! The pilot is a small bidirectional render of the same measurement: some of the pixels gather, a
//! proportional number of light paths is shot, in rounds that double. After each round the guide of
//! emission is refined by what each light path added to the noise of the image, relative to the image
//! (as relMSE counts it): the squares of its weighted splats and connections. What the pilot decides
//! enters weights and densities and must not depend on the samples that are weighted with it; it
//! draws from its own family of random numbers and sums in a fixed order, so it is a function of
//! scene, settings and seed alone, the same for all shards of a render.

use crate::math::Random;
use crate::math::random::Family;
use crate::scene::Scene;
use crate::scene::emitter::Emission;
use crate::scene::emitter::guide::{Guide, Start};
use crate::transport::cache::LightCache;
use crate::transport::gather::gather;
use crate::transport::settings::{Plan, Settings};
use crate::transport::shoot::shoot;
use crate::transport::walk::{Context, Join, Observe, Tally};
use crate::transport::{Contribution, RayCounts, Record, Technique};
use glam::{Vec2, Vec3};
use rayon::prelude::*;

/// Light paths of a job.
const JOB: u32 = 1024;
/// Rounds, each of twice the paths of the one before.
const ROUNDS: u32 = 5;
/// Least and most light paths of the last round.
const LAST_ROUND: std::ops::RangeInclusive<u32> = 4096..=131_072;
/// A light path counts for at most so many times the mean.
const MOST: f64 = 50.0;
/// Cells of the coarse image along its longer side, at most.
const CELLS: u32 = 64;

/// What a pilot decides.
#[derive(Clone, Debug, Default)]
pub struct Decisions {
    /// Mean number of light vertices per light path; 0 where connections are off.
    pub vertices_per_path: f64,
    /// Where light paths start.
    pub guide: Guide,
}

/// Runs the pilot of a render of the crop window `crop` (x, y, width, height).
pub fn decide(scene: &Scene, settings: &Settings, crop: [u32; 4]) -> Decisions {
    let t = settings.techniques;
    let connects = t.connect && settings.connections > 0;
    if !(t.splat || connects) || scene.lights.is_empty() {
        return Decisions::default();
    }
    let mut pilot = Pilot::new(scene, settings, crop);
    let last = pilot.plan(0.0, Guide::default()).light_paths.clamp(*LAST_ROUND.start(), *LAST_ROUND.end());
    // The first round only counts, since without a count there are no connections to learn from.
    let mut decisions = Decisions::default();
    let mut learner = Guide::new(&scene.lights);
    for round in 0..ROUNDS {
        let paths = (last >> (ROUNDS - 1 - round)).max(JOB);
        let (vertices, lessons) = pilot.round(&decisions, round, paths, connects);
        if connects {
            decisions.vertices_per_path = vertices as f64 / f64::from(paths);
        }
        if settings.guided {
            lessons.iter().for_each(|(start, value)| learner.learn(start, *value));
            learner = learner.refined(&scene.lights);
            decisions.guide = learner.clone();
        }
    }
    decisions
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
}

/// Collects what one job finds.
struct Collect<'p> {
    pilot: &'p Pilot<'p>,
    seen: Vec<Seen>,
    starts: Vec<Option<Start>>,
    guide: &'p Guide,
}

impl Observe for Collect<'_> {
    fn started(&mut self, _from: Vec3, light: Option<&Emission>) {
        let start = light.and_then(|e| self.pilot.scene.lights.start(self.guide, e));
        if let Some(last) = self.starts.last_mut() {
            *last = start;
        }
    }
}

struct Splats<'a>(&'a mut Vec<(Vec2, f32)>);
impl Record for Splats<'_> {
    fn gathered(&mut self, _: Contribution) {}
    fn splatted(&mut self, raster: Vec2, _: &mut Random, c: Contribution) {
        self.0.push((raster, c.value.mean()));
    }
}

/// Joins of a gathering walk: values with the index of the light vertex of connections.
#[derive(Default)]
struct Joins(Vec<(f32, Option<usize>)>);
impl Observe for Joins {
    fn joined(&mut self, join: Join<'_>) {
        self.0.push((join.value.mean(), (join.technique == Technique::Connect).then_some(join.light_vertex)));
    }
}

struct Nothing;
impl Record for Nothing {
    fn gathered(&mut self, _: Contribution) {}
    fn splatted(&mut self, _: Vec2, _: &mut Random, _: Contribution) {}
}

/// What a shooting job leaves.
struct Shot {
    seen: Vec<Seen>,
    starts: Vec<Option<Start>>,
    vertices: Vec<crate::transport::cache::LightVertex>,
    /// Light path of each vertex.
    owners: Vec<u32>,
}

impl<'a> Pilot<'a> {
    fn new(scene: &'a Scene, settings: &'a Settings, crop: [u32; 4]) -> Self {
        let step = crop[2].max(crop[3]).div_ceil(CELLS).max(1);
        let cells = [crop[2].div_ceil(step), crop[3].div_ceil(step)];
        let count = cells[0] as usize * cells[1] as usize;
        Self { scene, settings, crop, step, cells, image: vec![0.0; count], weight: 0.0 }
    }

    fn plan(&self, vertices_per_path: f64, guide: Guide) -> Plan {
        let pixels = self.crop[2].saturating_mul(self.crop[3]);
        let film = self.scene.film.width.saturating_mul(self.scene.film.height);
        Plan { guide, ..Plan::new(self.settings, pixels, film, vertices_per_path) }
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

    /// One round: the number of light vertices, and what each light path that was of use is worth.
    fn round(&mut self, so_far: &Decisions, round: u32, paths: u32, connects: bool) -> (u64, Vec<(Start, f64)>) {
        let plan = self.plan(so_far.vertices_per_path, so_far.guide.clone());
        let shots: Vec<Shot> =
            (0..paths.div_ceil(JOB)).into_par_iter().map(|job| self.shoot(&plan, round, job, paths, connects)).collect();
        let (mut seen, mut starts, mut owners, mut pieces) = (vec![], vec![], vec![], vec![]);
        for shot in shots {
            seen.extend(shot.seen);
            starts.extend(shot.starts);
            owners.extend(shot.owners);
            pieces.push(shot.vertices);
        }
        let cache = LightCache::new(pieces);
        // Of N light paths and P pixels per pass, n light paths and n·P/N pixels take part.
        let pixels = f64::from(self.crop[2]) * f64::from(self.crop[3]);
        let share = f64::from(paths) / f64::from(plan.light_paths.max(1));
        let walks = if plan.settings.techniques.gathers() { (pixels * share).ceil() as u32 } else { 0 };
        let gathered: Vec<Vec<Seen>> = (0..walks.div_ceil(JOB))
            .into_par_iter()
            .map(|job| self.gather(&plan, round, (job, walks), (&cache, &owners)))
            .collect();
        let eye_share = f64::from(walks) / pixels;
        self.weight += share;
        for s in &seen {
            self.image[s.cell as usize] += f64::from(s.value);
        }
        for s in gathered.iter().flatten() {
            self.image[s.cell as usize] += f64::from(s.value) * share / eye_share;
        }
        seen.extend(gathered.into_iter().flatten().filter(|s| s.path != u32::MAX));
        (u64::from(cache.len()), self.lessons(&seen, &starts))
    }

    /// √Σ (v/I)² of each light path over its contributions.
    fn lessons(&self, seen: &[Seen], starts: &[Option<Start>]) -> Vec<(Start, f64)> {
        let cells = self.image.iter().enumerate();
        let mut squares: Vec<f64> = cells.map(|(i, sum)| (sum / (self.weight * self.cell_pixels(i as u32))).powi(2)).collect();
        let mean = self.image.iter().sum::<f64>() / (self.weight * f64::from(self.crop[2]) * f64::from(self.crop[3]));
        squares.iter_mut().for_each(|s| *s += 0.01 * mean * mean);
        let mut worth = vec![0.0f64; starts.len()];
        for s in seen {
            let square = squares[s.cell as usize];
            if square > 0.0 {
                worth[s.path as usize] += f64::from(s.value).powi(2) / square;
            }
        }
        let of_use: Vec<_> = starts.iter().zip(worth).filter_map(|(s, w)| s.filter(|_| w > 0.0).map(|s| (s, w))).collect();
        // One path that was lucky once must not draw all others after it.
        let most = MOST * of_use.iter().map(|(_, w)| w).sum::<f64>() / of_use.len().max(1) as f64;
        of_use.into_iter().map(|(start, w)| (start, w.min(most).sqrt())).collect()
    }

    fn shoot(&self, plan: &Plan, round: u32, job: u32, paths: u32, connects: bool) -> Shot {
        let cx = Context { scene: self.scene, plan };
        let mut observe = Collect { pilot: self, seen: vec![], starts: vec![], guide: &plan.guide };
        let (mut vertices, mut owners, mut pending, mut rays) = (vec![], vec![], vec![], RayCounts::default());
        for index in job * JOB..((job + 1) * JOB).min(paths) {
            let mut random = Random::new(Family::Pilot, u64::from(index), u64::from(round), plan.settings.seed);
            observe.starts.push(None);
            let mut tally = Tally { record: &mut Splats(&mut pending), rays: &mut rays, observe: &mut observe };
            shoot(cx, connects.then_some(&mut vertices), &mut random, &mut tally);
            owners.resize(vertices.len(), index);
            for (raster, value) in pending.drain(..).filter(|(_, value)| value.is_finite()) {
                if let Some(cell) = self.cell(raster) {
                    observe.seen.push(Seen { cell, value, path: index });
                }
            }
        }
        Shot { seen: observe.seen, starts: observe.starts, vertices, owners }
    }

    /// Gathers on `walks` pixels, evenly spread in the order of rows.
    fn gather(&self, plan: &Plan, round: u32, (job, walks): (u32, u32), (cache, owners): (&LightCache, &[u32])) -> Vec<Seen> {
        let cx = Context { scene: self.scene, plan };
        let (mut seen, mut rays) = (vec![], RayCounts::default());
        let pixels = f64::from(self.crop[2]) * f64::from(self.crop[3]);
        for index in job * JOB..((job + 1) * JOB).min(walks) {
            // A walk's number beyond those of all light paths: the two never share a stream.
            let mut random = Random::new(Family::Pilot, u64::from(index) | 1 << 32, u64::from(round), plan.settings.seed);
            let pixel = ((f64::from(index) + f64::from(random.unit())) / f64::from(walks) * pixels) as u32;
            let (x, y) = (pixel % self.crop[2], (pixel / self.crop[2]).min(self.crop[3] - 1));
            let raster = Vec2::new((self.crop[0] + x) as f32, (self.crop[1] + y) as f32) + random.unit2();
            let mut joins = Joins::default();
            let mut tally = Tally { record: &mut Nothing, rays: &mut rays, observe: &mut joins };
            gather(cx, raster, 1.0, cache, &mut random, &mut tally);
            let Some(cell) = self.cell(raster) else { continue };
            for (value, vertex) in joins.0.into_iter().filter(|(value, _)| value.is_finite()) {
                let path = vertex.and_then(|v| owners.get(v)).copied().unwrap_or(u32::MAX);
                seen.push(Seen { cell, value, path });
            }
        }
        seen
    }
}
