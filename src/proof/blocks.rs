//! Independent estimates of a film by path length, class and block of pixels, straight from the walks.
//!
//! What a walker finds by luck has another distribution than what it always finds, and their sum would
//! hide the rare from the tests. Paths are therefore told apart by the events at their ends ([`Kind`]):
//! gathering has a hard time with narrow events beside the light, shooting with narrow ones beside the eye.
//!
//! A *draw* is the sum of some passes of its own; more passes per draw make its distribution more
//! nearly normal, which the tests of [`crate::report::agreement`] assume. Passes are added to all
//! draws alike, so that a series can grow until it can be tested.

use crate::film::Filter;
use crate::math::Random;
use crate::math::random::Family;
use crate::render::{Options, Render, RenderError};
use crate::report::agreement::BlockSeries;
use crate::scene::emitter::Emission;
use crate::scene::{MaterialId, Scene, Surface};
use crate::transport::cache::LightCache;
use crate::transport::gather::gather;
use crate::transport::settings::{Plan, Settings};
use crate::transport::shoot::shoot;
use crate::transport::vertex::Scatter;
use crate::transport::walk::{Context, Join, Observe, Tally};
use crate::transport::{Contribution, RayCounts, Record, Technique};
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use std::cell::Cell;

/// Side of a block in pixels.
pub const BLOCK: u32 = 16;

/// A growing series of estimates by one estimator.
pub struct Series<'a> {
    scene: &'a Scene,
    plan: Plan,
    filter: Filter,
    crop: [u32; 4],
    columns: usize,
    rows: usize,
    passes: u64,
    /// `sums[draw][class][block]`, see [`Class::index`].
    sums: Vec<Vec<Vec<f64>>>,
    /// The largest contributions of each class, of all draws.
    tops: Vec<Top>,
    /// Whether a material is narrow, by its number.
    narrow: Vec<bool>,
}

/// An event as it decides how hard a path is to find.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Into all directions.
    Wide,
    /// Into few: all lobes rougher than Dirac, one of them less rough than `NARROW`.
    Narrow,
    /// A Dirac event.
    Dirac,
}

/// Roughness below which an event is narrow.
const NARROW: f32 = 0.25;

impl Kind {
    /// D, G or S.
    pub fn letter(self) -> char {
        ['D', 'G', 'S'][self as usize]
    }
}

/// Paths of one length with these events beside eye and light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Class {
    /// Edges.
    pub length: usize,
    /// Events beside the eye and beside the light; none on a path of one edge.
    pub ends: Option<(Kind, Kind)>,
}

impl Class {
    /// Classes of each length.
    const PER_LENGTH: usize = 9;

    /// All classes of a length; those of a single event have it at both ends.
    pub fn of_length(length: usize) -> Vec<Self> {
        let kinds = [Kind::Wide, Kind::Narrow, Kind::Dirac];
        if length == 1 {
            return vec![Self { length, ends: None }];
        }
        let pairs = kinds.into_iter().flat_map(|a| kinds.map(|b| (a, b)));
        pairs.filter(|(a, b)| length > 2 || a == b).map(|e| Self { length, ends: Some(e) }).collect()
    }

    fn index(self) -> usize {
        Self::PER_LENGTH * self.length + self.ends.map_or(0, |(a, b)| 3 * a as usize + b as usize)
    }

    /// As `E D … S L`.
    pub fn name(self) -> String {
        match (self.ends, self.length) {
            (None, _) => "E L".into(),
            (Some((a, _)), 2) => format!("E {} L", a.letter()),
            (Some((a, b)), 3) => format!("E {} {} L", a.letter(), b.letter()),
            (Some((a, b)), _) => format!("E {} … {} L", a.letter(), b.letter()),
        }
    }
}

impl<'a> Series<'a> {
    /// `draws` empty draws of paths of up to `settings.max_length` edges, by hits, next events or splats.
    pub fn new(scene: &'a Scene, settings: &Settings, draws: usize) -> Result<Self, RenderError> {
        let film = &scene.film;
        let crop = film.crop.unwrap_or([0, 0, film.width, film.height]);
        let filter = Filter::new(film.filter).ok_or(RenderError::Filter)?;
        let (columns, rows) = (crop[2].div_ceil(BLOCK) as usize, crop[3].div_ceil(BLOCK) as usize);
        // With what a pilot finds out for these settings.
        let options = Options { settings: settings.clone(), ..Options::default() };
        let plan = Render::new(scene, &options)?.plan().clone();
        let classes = Class::PER_LENGTH * (plan.settings.max_length as usize + 1);
        let sums = vec![vec![vec![0.0; columns * rows]; classes]; draws];
        Ok(Self {
            scene,
            plan,
            filter,
            crop,
            columns,
            rows,
            passes: 0,
            sums,
            tops: vec![Top::default(); classes],
            narrow: narrow(scene),
        })
    }

    /// Passes in every draw.
    pub fn passes(&self) -> u64 {
        self.passes
    }

    /// Adds `passes` passes to every draw.
    pub fn grow(&mut self, passes: u64) {
        let first = self.passes * self.sums.len() as u64;
        let mut draws = std::mem::take(&mut self.sums);
        let none = || vec![Top::default(); self.tops.len()];
        let tops = draws.par_iter_mut().enumerate().map(|(i, sums)| {
            let start = first + i as u64 * passes;
            let mut blocks = Blocks { crop: self.crop, columns: self.columns, sums, tops: none() };
            (start..start + passes).for_each(|pass| self.pass(pass, &mut blocks));
            blocks.tops
        });
        let join = |mut a: Vec<Top>, b: Vec<Top>| {
            a.iter_mut().zip(&b).for_each(|(a, b)| a.join(b));
            a
        };
        let tops = tops.reduce(none, join);
        self.tops = join(std::mem::take(&mut self.tops), tops);
        self.sums = draws;
        self.passes += passes;
    }

    fn pass(&self, pass: u64, blocks: &mut Blocks<'_>) {
        let (plan, seed) = (&self.plan, self.plan.settings.seed);
        let cx = Context::new(self.scene, plan, pass);
        let found = Cell::new(None);
        let mut rays = RayCounts::default();
        let mut at = At { filter: &self.filter, pixel: (0, 0), found: &found };
        let mut ends = Ends { narrow: &self.narrow, events: Vec::new(), found: &found, blocks };
        let mut tally = Tally { record: &mut at, rays: &mut rays, observe: &mut ends };
        for index in 0..plan.light_paths {
            let mut random = Random::new(Family::Shoot, u64::from(index), pass, seed);
            shoot(cx, None, &mut random, &mut tally);
        }
        if !plan.settings.techniques.gathers() {
            return;
        }
        let cache = LightCache::default();
        for y in self.crop[1]..self.crop[1] + self.crop[3] {
            for x in self.crop[0]..self.crop[0] + self.crop[2] {
                let id = u64::from(y) * u64::from(self.scene.film.width) + u64::from(x);
                let mut random = Random::new(Family::Gather, id, pass, seed);
                let (offset, weight) = self.filter.sample_offset(random.unit2());
                tally.record.pixel = (i64::from(x), i64::from(y));
                let raster = Vec2::new(x as f32 + 0.5, y as f32 + 0.5) + offset;
                gather(cx, raster, weight, &cache, &mut random, &mut tally);
            }
        }
    }

    /// Block values of a class: mean radiance times the block's share of the film.
    pub fn of(&self, class: Class) -> BlockSeries {
        let class = class.index();
        let scale = 1.0 / (self.passes.max(1) as f64 * f64::from(self.crop[2]) * f64::from(self.crop[3]));
        let draws = self.sums.iter().map(|d| d[class].iter().map(|v| v * scale).collect()).collect();
        BlockSeries {
            columns: self.columns,
            rows: self.rows,
            draws,
            largest: self.tops[class].largest() * scale,
            heavy: self.tops[class].heavy(),
        }
    }
}

/// Which materials have an event that is narrow without being a Dirac one; told in the middle of their
/// textures, so that both walkers say the same of a point.
pub(super) fn narrow(scene: &Scene) -> Vec<bool> {
    let narrow = |i: u32| {
        let roughness = |front| scene.materials.resolve(MaterialId(i), Vec2::splat(0.5), front).roughness();
        roughness(true).min(roughness(false)) < NARROW
    };
    (0..scene.materials.len() as u32).map(narrow).collect()
}

/// The largest contributions of a class.
#[derive(Clone, Debug, Default)]
pub(super) struct Top {
    values: Vec<f32>,
    /// The least of them once there are enough.
    least: f32,
    /// Contributions in all.
    count: usize,
}

impl Top {
    const KEPT: usize = 128;
    /// The shortest tail that tells anything.
    const FEW: usize = 16;

    pub(super) fn add(&mut self, value: f32) {
        self.count += 1;
        if value <= self.least {
            return;
        }
        self.values.push(value);
        if self.values.len() == 2 * Self::KEPT {
            self.trim();
        }
    }

    pub(super) fn join(&mut self, other: &Self) {
        self.count += other.count;
        self.values.extend(&other.values);
        self.trim();
    }

    fn trim(&mut self) {
        self.values.sort_unstable_by(|a, b| b.total_cmp(a));
        self.values.truncate(Self::KEPT);
        if let (Self::KEPT, Some(last)) = (self.values.len(), self.values.last()) {
            self.least = *last;
        }
    }

    /// The largest, 0 where nothing was found.
    pub(super) fn largest(&self) -> f64 {
        self.values.first().map_or(0.0, |v| f64::from(*v))
    }

    /// Whether the sums have no variance: where the tail falls off as x^(−1/k), that takes k < 1/2.
    /// k is estimated by the mean logarithm of the largest over the least of them [Hill 1975].
    pub(super) fn heavy(&self) -> bool {
        // A tenth of all is tail; more would tell of the middle.
        let tail = (self.count / 10).clamp(Self::FEW, Self::KEPT).min(self.values.len());
        let Some(last) = self.values[..tail].last().map(|v| f64::from(*v)) else { return false };
        let k = self.values[..tail].iter().map(|v| (f64::from(*v) / last).ln()).sum::<f64>() / tail as f64;
        self.values.len() >= Self::KEPT && k >= 0.5
    }
}

/// Sums of one draw.
struct Blocks<'a> {
    crop: [u32; 4],
    columns: usize,
    sums: &'a mut [Vec<f64>],
    tops: Vec<Top>,
}

impl Blocks<'_> {
    fn add(&mut self, class: Class, (x, y): (i64, i64), value: f64) {
        let (x, y) = (x - i64::from(self.crop[0]), y - i64::from(self.crop[1]));
        let inside = x >= 0 && y >= 0 && x < i64::from(self.crop[2]) && y < i64::from(self.crop[3]);
        if !inside || !value.is_finite() {
            return;
        }
        let block = (y as usize / BLOCK as usize) * self.columns + x as usize / BLOCK as usize;
        let class = class.index();
        if let Some(sums) = self.sums.get_mut(class) {
            sums[block] += value;
            self.tops[class].add(value.abs() as f32);
        }
    }
}

/// A contribution on its way from the recorder to the observer, who knows its class: pixel, value.
type Found<'a> = &'a Cell<Option<((i64, i64), f64)>>;

/// Notes where a contribution falls and what it is worth.
struct At<'a> {
    filter: &'a Filter,
    pixel: (i64, i64),
    found: Found<'a>,
}

impl Record for At<'_> {
    fn gathered(&mut self, c: Contribution) {
        self.found.set(Some((self.pixel, f64::from(c.value.mean()))));
    }
    fn splatted(&mut self, raster: Vec2, random: &mut Random, c: Contribution) {
        let pixel = self.filter.splat_pixel(raster, random.unit2());
        self.found.set(pixel.map(|(x, y, w)| ((i64::from(x), i64::from(y)), f64::from(c.value.mean() * w))));
    }
}

/// Watches the events of a walk and puts what it finds into the sums of its class.
struct Ends<'a, 'b> {
    narrow: &'a [bool],
    events: Vec<Kind>,
    found: Found<'a>,
    blocks: &'a mut Blocks<'b>,
}

impl Observe for Ends<'_, '_> {
    fn started(&mut self, _: Vec3, _: Option<&Emission>) {
        self.events.clear();
    }
    fn arrived(&mut self, surface: &Surface) {
        let narrow = self.narrow[surface.material.0 as usize];
        self.events.push(if narrow { Kind::Narrow } else { Kind::Wide });
    }
    fn scattered(&mut self, s: &Scatter) {
        if let (true, Some(event)) = (s.delta, self.events.last_mut()) {
            *event = Kind::Dirac;
        }
    }
    fn returned(&mut self, vertices: usize) {
        self.events.truncate(vertices);
    }
    fn joined(&mut self, join: Join<'_>) {
        let Some((pixel, value)) = self.found.take() else { return };
        let (first, last) = (self.events.first().copied(), self.events.last().copied());
        let ends = match (first, last) {
            // Shooting begins at the light.
            (Some(light), Some(eye)) if join.technique == Technique::Splat => Some((eye, light)),
            (first, last) => first.zip(last),
        };
        let length = join.length as usize;
        self.blocks.add(Class { length, ends: ends.filter(|_| length > 1) }, pixel, value);
    }
}
