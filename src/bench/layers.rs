//! Who carries what: light and noise of an estimator by join and length, and by class of paths.
//!
//! A few passes are walked as a render walks them, but what they find is told apart instead of summed: a
//! *layer* is all that one join finds of paths of one length, or all paths of one class. Its energy is its mean
//! over that of the reference, its noise its variance per sample, relative to the reference as in relMSE (of the
//! mean of the channels). Energies of layers add up to that of the image; variances only where layers of a
//! pixel do not vary together. Each pixel is looked at by its own walks alone: where pixels share walks, under filters wider
//! than they are, the image has less noise, in all layers alike.
//!
//! Films of their own, as [`crate::render::layers`] has them, would take many times the memory of the render, and do not
//! know classes; here a layer is two floats per pixel where it has any light. Of large images some tiles stand for all.

use super::contender::Stop;
use super::reference::Reference;
use crate::film::layout::TILE_PIXELS;
use crate::film::{Filter, Layout};
use crate::math::Random;
use crate::render::{Budget, Options, Render, SHOOT_JOB, light_path_random, pixel_randoms};
use crate::scene::emitter::Emission;
use crate::scene::{Scene, Surface};
use crate::transport::cache::{LightCache, LightVertex};
use crate::transport::gather::gather;
use crate::transport::settings::Plan;
use crate::transport::shoot::shoot;
use crate::transport::vertex::Scatter;
use crate::transport::walk::{Context, Join, Observe, Tally};
use crate::transport::{Contribution, RayCounts, Record, Technique};
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use serde::Serialize;
use std::cell::Cell;
use std::ops::Range;
use std::time::{Duration, Instant};

/// Lengths that are told apart; the last stands for all longer ones.
pub const LENGTHS: usize = 10;
/// Number of joins.
const TECHNIQUES: usize = Technique::ALL.len();
/// Tiles that are looked at, at most (as many as 512 × 384 pixels have).
const TILES: usize = 768;
/// Fewest passes that a variance is taken of.
pub const LEAST_PASSES: u64 = 4;

/// Classes that every path is one of, as expressions and in words.
pub const CLASSES: [(&str, &str); 8] = [
    ("E L", "lamps seen directly"),
    ("E S+ L", "lamps in mirrors and through glass"),
    ("E D L", "direct light"),
    ("E D D+ L", "indirect light between matt surfaces"),
    ("E D .* S L", "caustics"),
    ("E D .* S .* D L", "light by way of mirrors and glass"),
    ("E S .* D L", "lit surfaces in mirrors and through glass"),
    ("E S .* D .* S L", "caustics in mirrors and through glass"),
];

/// A layer's share.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Share {
    /// Light over that of the reference.
    pub energy: f64,
    /// Relative variance per sample.
    pub noise: f64,
}

/// All layers of an estimator.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Layers {
    /// Passes that were walked.
    pub passes: u64,
    /// Seconds per pass, as it takes to tell layers apart (a render is faster).
    pub seconds_per_pass: f64,
    /// By join; each by length from 1, the last for all longer ones.
    pub techniques: Vec<(String, Vec<Share>)>,
    /// In the order of [`CLASSES`].
    pub classes: Vec<Share>,
}

/// Walks at least [`LEAST_PASSES`] passes and until the first limit of the budget; nothing where `stop` said so before.
pub fn layers(scene: &Scene, options: &Options, reference: &Reference, budget: &Budget, stop: Stop<'_>) -> Option<Layers> {
    let plan = Render::new(scene, options).ok()?.plan().clone();
    let mut walked = Walked::new(scene, plan)?;
    let begin = Instant::now();
    let goes_on = |passes: u64| budget.passes.is_none_or(|n| passes < n) && budget.time.is_none_or(|t| begin.elapsed() < t);
    while walked.passes < LEAST_PASSES || goes_on(walked.passes) {
        if stop() {
            return None;
        }
        walked.pass();
    }
    Some(walked.layers(reference, begin.elapsed()))
}

/// What the events of a path say of its class.
#[derive(Clone, Copy, Debug, Default)]
struct Events {
    count: u32,
    dirac: u32,
    /// The event nearest to the start of the walk is a Dirac event.
    first_dirac: bool,
    /// The event nearest to its end.
    last_dirac: bool,
}

impl Events {
    /// So many Dirac events.
    fn dirac(count: u32) -> Self {
        Self { count, dirac: count, first_dirac: count > 0, last_dirac: count > 0 }
    }

    fn push(&mut self, dirac: bool) {
        self.first_dirac = if self.count == 0 { dirac } else { self.first_dirac };
        self.last_dirac = dirac;
        self.count += 1;
        self.dirac += u32::from(dirac);
    }

    /// Number in [`CLASSES`], of the events from eye to light.
    fn class(self) -> usize {
        match (self.count, self.dirac, self.first_dirac, self.last_dirac) {
            (0, ..) => 0,
            (n, d, ..) if n == d => 1,
            (1, ..) => 2,
            (_, 0, ..) => 3,
            (_, _, false, true) => 4,
            (_, _, false, false) => 5,
            (_, _, true, false) => 6,
            (_, _, true, true) => 7,
        }
    }

    /// From the other end.
    fn reversed(self) -> Self {
        Self { first_dirac: self.last_dirac, last_dirac: self.first_dirac, ..self }
    }

    /// These and, further on, those of a walk that came from the other end.
    fn joined(self, from_light: Self) -> Self {
        let rest = from_light.reversed();
        match (self.count, rest.count) {
            (_, 0) => self,
            (0, _) => rest,
            _ => Self {
                count: self.count + rest.count,
                dirac: self.dirac + rest.dirac,
                first_dirac: self.first_dirac,
                last_dirac: rest.last_dirac,
            },
        }
    }
}

/// What a walk found: a pixel, a value, and its two layers.
#[derive(Clone, Copy)]
struct Found {
    pixel: u32,
    value: f32,
    technique: u8,
    class: u8,
}

/// Layers of one tile; made when something falls into them.
#[derive(Clone, Default)]
struct Tile {
    layers: Vec<Option<Box<Sums>>>,
}

#[derive(Clone)]
struct Sums {
    pass: [f32; TILE_PIXELS],
    sum: [f32; TILE_PIXELS],
    square: [f32; TILE_PIXELS],
}

impl Tile {
    fn add(&mut self, f: &Found) {
        let local = Layout::local_of(f.pixel);
        for layer in [usize::from(f.technique), TECHNIQUES * LENGTHS + usize::from(f.class)] {
            let none = [0.0; TILE_PIXELS];
            let sums = self.layers[layer].get_or_insert_with(|| Box::new(Sums { pass: none, sum: none, square: none }));
            sums.pass[local] += f.value;
        }
    }

    fn commit(&mut self) {
        for sums in self.layers.iter_mut().flatten() {
            let Sums { pass, sum, square } = &mut **sums;
            for ((p, s), q) in pass.iter_mut().zip(sum).zip(square) {
                *s += *p;
                *q += *p * *p;
                *p = 0.0;
            }
        }
    }
}

/// Passes so far.
struct Walked<'a> {
    scene: &'a Scene,
    plan: Plan,
    filter: Filter,
    crop: [u32; 4],
    layout: Layout,
    /// Every so many tiles one is looked at.
    step: usize,
    tiles: Vec<Tile>,
    passes: u64,
}

impl<'a> Walked<'a> {
    fn new(scene: &'a Scene, plan: Plan) -> Option<Self> {
        let film = &scene.film;
        let crop = film.crop.unwrap_or([0, 0, film.width, film.height]);
        let layout = Layout { width: crop[2], height: crop[3] };
        // Odd, so that the tiles that are looked at do not stand in columns.
        let step = layout.tiles().div_ceil(TILES) | 1;
        let step = if layout.tiles() <= TILES { 1 } else { step };
        let none = Tile { layers: vec![None; TECHNIQUES * LENGTHS + CLASSES.len()] };
        Some(Self {
            scene,
            plan,
            filter: Filter::new(film.filter)?,
            crop,
            layout,
            step,
            tiles: vec![none; layout.tiles().div_ceil(step)],
            passes: 0,
        })
    }

    fn pass(&mut self) {
        let shots: Vec<_> = (0..self.plan.light_paths.div_ceil(SHOOT_JOB)).into_par_iter().map(|job| self.shoot(job)).collect();
        let (mut pieces, mut events, mut bins) = (Vec::new(), Vec::new(), vec![Vec::new(); self.tiles.len()]);
        for (vertices, watch) in shots {
            pieces.push(vertices);
            events.extend(watch.cached);
            for f in watch.found {
                bins[Layout::tile_of(f.pixel) / self.step].push(f);
            }
        }
        let cache = LightCache::new(pieces, self.plan.merge_radius(self.passes));
        let gathers = self.plan.settings.techniques.gathers();
        let mut tiles = std::mem::take(&mut self.tiles);
        tiles.par_iter_mut().zip(&bins).enumerate().for_each(|(i, (tile, splats))| {
            splats.iter().for_each(|f| tile.add(f));
            if gathers {
                self.gather(i * self.step, tile, &cache, &events);
            }
            tile.commit();
        });
        self.tiles = tiles;
        self.passes += 1;
    }

    fn shoot(&self, job: u32) -> (Vec<LightVertex>, Watch<'_>) {
        let cx = Context::new(self.scene, &self.plan, self.passes);
        let (found, mut vertices, mut rays) = (Cell::new(None), Vec::new(), RayCounts::default());
        let mut watch = Watch::new(&[]);
        let mut at = At { walked: self, pixel: 0, part: 1.0, found: &found };
        let paths = job * SHOOT_JOB..(job + 1).saturating_mul(SHOOT_JOB).min(self.plan.light_paths);
        let mut observe = Observing { watch: &mut watch, found: &found };
        let mut tally = Tally { record: &mut at, rays: &mut rays, observe: &mut observe };
        for index in paths {
            let mut random = light_path_random(&self.plan, index, self.passes);
            shoot(cx, self.plan.keeps_vertices().then_some(&mut vertices), &mut random, &mut tally);
        }
        (vertices, watch)
    }

    fn gather(&self, index: usize, tile: &mut Tile, cache: &LightCache, events: &[Events]) {
        let cx = Context::new(self.scene, &self.plan, self.passes);
        let (found, mut rays) = (Cell::new(None), RayCounts::default());
        let mut watch = Watch::new(events);
        for (x, y, _) in self.layout.tile_rect(index).pixels() {
            let (px, py) = (self.crop[0] + x, self.crop[1] + y);
            let id = u64::from(py) * u64::from(self.scene.film.width) + u64::from(px);
            let walks = pixel_randoms(&self.plan, (x as i32, y as i32), id, self.passes);
            let part = 1.0 / walks.len() as f32;
            for mut random in walks {
                let (offset, weight) = self.filter.sample_offset(random.axis2());
                let raster = Vec2::new(px as f32 + 0.5, py as f32 + 0.5) + offset;
                let mut at = At { walked: self, pixel: self.layout.pixel(x, y), part, found: &found };
                let mut observe = Observing { watch: &mut watch, found: &found };
                let mut tally = Tally { record: &mut at, rays: &mut rays, observe: &mut observe };
                gather(cx, raster, weight, cache, &mut random, &mut tally);
            }
            watch.found.drain(..).for_each(|f| tile.add(&f));
        }
    }

    /// Tile and place of a pixel of the whole film, if it is looked at.
    fn pixel(&self, x: u32, y: u32) -> Option<u32> {
        let (x, y) = (x.checked_sub(self.crop[0])?, y.checked_sub(self.crop[1])?);
        let pixel = (x < self.crop[2] && y < self.crop[3]).then(|| self.layout.pixel(x, y))?;
        Layout::tile_of(pixel).is_multiple_of(self.step).then_some(pixel)
    }

    /// Energies and noise of all layers.
    fn layers(&self, reference: &Reference, time: Duration) -> Layers {
        let grey = |p: &[f32; 3]| f64::from(p.iter().sum::<f32>()) / 3.0;
        let all = &reference.picture.mean;
        let floor = 0.01 * (all.iter().map(grey).sum::<f64>() / all.len().max(1) as f64).powi(2);
        let mut shares = vec![Share::default(); TECHNIQUES * LENGTHS + CLASSES.len()];
        let (mut light, mut pixels, n) = (0.0, 0.0, self.passes as f64);
        for (i, tile) in self.tiles.iter().enumerate() {
            for (x, y, local) in self.layout.tile_rect(i * self.step).pixels() {
                let r = grey(&all[y as usize * self.layout.width as usize + x as usize]);
                light += r;
                pixels += 1.0;
                for (share, sums) in shares.iter_mut().zip(&tile.layers) {
                    let Some(sums) = sums else { continue };
                    let (sum, square) = (f64::from(sums.sum[local]), f64::from(sums.square[local]));
                    share.energy += sum / n;
                    share.noise += (square - sum * sum / n).max(0.0) / (n - 1.0) / (r * r + floor).max(f64::MIN_POSITIVE);
                }
            }
        }
        for s in &mut shares {
            *s = Share { energy: s.energy / light, noise: s.noise / pixels };
        }
        // Joins that found nothing have no layers.
        let met = |layers: &Range<usize>| self.tiles.iter().any(|t| t.layers[layers.clone()].iter().any(Option::is_some));
        let of = |technique: Technique| {
            let layers = technique as usize * LENGTHS..(technique as usize + 1) * LENGTHS;
            met(&layers).then(|| (name_of(technique), shares[layers].to_vec()))
        };
        Layers {
            passes: self.passes,
            seconds_per_pass: time.as_secs_f64() / n,
            techniques: Technique::ALL.into_iter().filter_map(of).collect(),
            classes: shares[TECHNIQUES * LENGTHS..].to_vec(),
        }
    }
}

/// For people: `NextEvent` as `next event`.
fn name_of(technique: Technique) -> String {
    let name = format!("{technique:?}");
    let spaced = name.chars().enumerate().flat_map(|(i, c)| {
        let space = (i > 0 && c.is_uppercase()).then_some(' ');
        space.into_iter().chain(c.to_lowercase())
    });
    spaced.collect()
}

/// Notes where a contribution falls and what it is worth.
struct At<'a> {
    walked: &'a Walked<'a>,
    pixel: u32,
    /// Of what walks of the pixel find.
    part: f32,
    found: &'a Cell<Option<(u32, f32)>>,
}

impl Record for At<'_> {
    fn gathered(&mut self, c: Contribution) {
        self.found.set(Some((self.pixel, self.part * c.value.mean())));
    }
    fn splatted(&mut self, raster: Vec2, random: &mut Random, c: Contribution) {
        let splat = self.walked.filter.splat_pixel(raster, random.unit2());
        let inside = splat.and_then(|(x, y, w)| Some((u32::try_from(x).ok()?, u32::try_from(y).ok()?, w)));
        self.found.set(inside.and_then(|(x, y, w)| Some((self.walked.pixel(x, y)?, c.value.mean() * w))));
    }
}

/// What walks found, and the events of the one under way.
struct Watch<'a> {
    events: Events,
    /// The last event is not known yet; wide unless it scatters otherwise.
    pending: bool,
    /// Events between each light vertex and the light, of this job or of the whole cache.
    cached: Vec<Events>,
    cache: &'a [Events],
    found: Vec<Found>,
}

impl<'a> Watch<'a> {
    fn new(cache: &'a [Events]) -> Self {
        Self { events: Events::default(), pending: false, cached: Vec::new(), cache, found: Vec::new() }
    }

    /// Events so far, the vertex last reached as one that is not a Dirac event.
    fn here(&self) -> Events {
        let mut events = self.events;
        if self.pending {
            events.push(false);
        }
        events
    }
}

/// A watch, with what the recorder hands on.
struct Observing<'a, 'b> {
    watch: &'a mut Watch<'b>,
    found: &'a Cell<Option<(u32, f32)>>,
}

impl Observe for Observing<'_, '_> {
    fn started(&mut self, _: Vec3, _: Option<&Emission>) {
        (self.watch.events, self.watch.pending) = (Events::default(), false);
    }
    fn arrived(&mut self, _: &Surface) {
        self.watch.pending = true;
    }
    fn scattered(&mut self, s: &Scatter) {
        self.watch.events.push(s.delta);
        self.watch.pending = false;
    }
    fn returned(&mut self, vertices: usize) {
        // What branches is a chain of Dirac events.
        let events = Events::dirac(vertices as u32);
        (self.watch.events, self.watch.pending) = (events, false);
    }
    fn cached(&mut self, _: &LightVertex) {
        let before = self.watch.here();
        self.watch.cached.push(before);
    }
    fn joined(&mut self, join: Join<'_>) {
        let watch = &mut *self.watch;
        let Some((pixel, value)) = self.found.take().filter(|f| f.1.is_finite()) else { return };
        let events = match join.technique {
            _ if join.length == 1 => Events::default(),
            Technique::Splat => watch.here().reversed(),
            Technique::Connect => watch.here().joined(watch.cache.get(join.light_vertex).copied().unwrap_or_default()),
            Technique::Merge => {
                let both = watch.here().joined(watch.cache.get(join.light_vertex).copied().unwrap_or_default());
                // The merged vertex is in both walks.
                Events { count: both.count - 1, ..both }
            }
            Technique::Hit | Technique::NextEvent => watch.here(),
        };
        let layer = join.technique as usize * LENGTHS + (join.length as usize).clamp(1, LENGTHS) - 1;
        watch.found.push(Found { pixel, value, technique: layer as u8, class: events.class() as u8 });
    }
}
