//! One pass after another: shoot, sort, gather.

use super::sink::{Divided, Sink, Whole};
use super::{Partition, Render};
use crate::film::{Layout, Splat, SplatBins};
use crate::math::Random;
use crate::math::random::Family;
use crate::transport::cache::{LightCache, LightVertex};
use crate::transport::chain;
use crate::transport::gather::gather;
use crate::transport::recursive::recursive;
use crate::transport::settings::{Coupling, Plan};
use crate::transport::shoot::shoot;
use crate::transport::walk::{Context, Tally};
use crate::transport::{Contribution, RayCounts, Record};
use glam::Vec2;
use rayon::prelude::*;
use std::ops::Range;
use std::time::Instant;

/// Light paths of one job.
pub const SHOOT_JOB: u32 = 4096;
/// Emission and the first scattering of a light path; all light paths of a pass share a sequence.
const SHOOT_AXES: u32 = 8;
/// Film and lens of a sample of chains; all of a pixel share a sequence.
const CHAIN_AXES: u32 = 4;
/// Film, lens and the first vertices of a gathering walk; all passes of a pixel share a sequence.
const GATHER_AXES: u32 = 16;

/// Writes what gathering walks find into the pixel being sampled.
struct PixelRecord<'a, S> {
    sink: &'a mut S,
    local: usize,
}

impl<S: Sink> Record for PixelRecord<'_, S> {
    #[inline]
    fn gathered(&mut self, c: Contribution) {
        self.sink.add(self.local, &S::keep(&c));
    }
    fn splatted(&mut self, _: Vec2, _: &mut Random, _: Contribution) {}
}

/// Writes what shooting walks find as messages to pixels.
struct SplatRecord<'a, S: Sink> {
    filter: &'a crate::film::Filter,
    layout: Layout,
    crop: [u32; 4],
    splats: Vec<Splat<S::Kept>>,
}

impl<S: Sink> Record for SplatRecord<'_, S> {
    fn gathered(&mut self, _: Contribution) {}
    #[inline]
    fn splatted(&mut self, raster: Vec2, random: &mut Random, c: Contribution) {
        let Some((x, y, weight)) = self.filter.splat_pixel(raster, random.unit2()) else { return };
        let (x, y) = (i64::from(x) - i64::from(self.crop[0]), i64::from(y) - i64::from(self.crop[1]));
        if (0..i64::from(self.crop[2])).contains(&x) && (0..i64::from(self.crop[3])).contains(&y) {
            let pixel = self.layout.pixel(x as u32, y as u32);
            self.splats.push(Splat { pixel, value: S::keep(&Contribution { value: c.value * weight, ..c }) });
        }
    }
}

/// What a shooting job found.
struct Shot<V> {
    splats: Vec<Splat<V>>,
    vertices: Vec<LightVertex>,
    rays: RayCounts,
}

/// Runs these passes into the film of `render`, and into its layers where there are any.
pub fn run(render: &mut Render<'_>, range: Range<u64>) {
    if render.layers.is_empty() { run_into::<Whole>(render, range) } else { run_into::<Divided>(render, range) }
}

fn run_into<S: Sink>(render: &mut Render<'_>, range: Range<u64>) {
    if render.plan.light_paths == 0 {
        gather_passes::<S>(render, range, &LightCache::default(), None);
        return;
    }
    let mut bins = SplatBins::default();
    for pass in range {
        let before = Instant::now();
        let (cache, splats) = shoot_pass::<S>(render, pass);
        bins.fill(render.film.layout(), &splats);
        render.statistics.light_vertices = u64::from(cache.len());
        render.statistics.shoot_time += before.elapsed();
        gather_passes::<S>(render, pass..pass + 1, &cache, Some(&bins));
    }
}

/// The random numbers of light path `index` of a pass.
pub(crate) fn light_path_random(plan: &Plan, index: u32, pass: u64) -> Random {
    let (index, seed) = (u64::from(index), plan.settings.seed);
    let random = Random::new(Family::Shoot, index, pass, seed);
    if plan.settings.stratified { random.with_point(Family::Shoot, pass, index, seed, SHOOT_AXES) } else { random }
}

/// The random numbers of the pixel with number `id` in the whole film.
pub(crate) fn pixel_random(plan: &Plan, id: u64, pass: u64) -> Random {
    let seed = plan.settings.seed;
    let random = Random::new(Family::Gather, id, pass, seed);
    if plan.settings.stratified { random.with_point(Family::Gather, id, pass, seed, GATHER_AXES) } else { random }
}

/// The random numbers of sample `sample` of chains alone of the pixel with number `id` in the whole film.
fn chain_random(plan: &Plan, id: u64, sample: u64) -> Random {
    let seed = plan.settings.seed;
    let random = Random::new(Family::Chain, id, sample, seed);
    if plan.settings.stratified { random.with_point(Family::Chain, id, sample, seed, CHAIN_AXES) } else { random }
}

/// Shoots all light paths of a pass.
fn shoot_pass<S: Sink>(render: &mut Render<'_>, pass: u64) -> (LightCache, Vec<Vec<Splat<S::Kept>>>) {
    let plan = &render.plan;
    let cx = Context::new(render.scene, plan, pass);
    let jobs = plan.light_paths.div_ceil(SHOOT_JOB);
    let shots: Vec<Shot<S::Kept>> = (0..jobs)
        .into_par_iter()
        .map(|job| {
            let paths = job * SHOOT_JOB..((job + 1).saturating_mul(SHOOT_JOB)).min(plan.light_paths);
            let mut record = SplatRecord::<S> {
                filter: &render.filter,
                layout: render.film.layout(),
                crop: render.crop,
                splats: Vec::with_capacity(SHOOT_JOB as usize),
            };
            let mut vertices = Vec::with_capacity(if plan.c > 0.0 { 3 * SHOOT_JOB as usize } else { 0 });
            let mut rays = RayCounts::default();
            let mut tally = Tally { record: &mut record, rays: &mut rays, observe: &mut () };
            for index in paths {
                let mut random = light_path_random(plan, index, pass);
                let cache = plan.keeps_vertices().then_some(&mut vertices);
                shoot(cx, cache, &mut random, &mut tally);
            }
            Shot { splats: record.splats, vertices, rays }
        })
        .collect();
    let mut pieces = Vec::with_capacity(shots.len());
    let mut splats = Vec::with_capacity(shots.len());
    for shot in shots {
        render.statistics.rays.add(&shot.rays);
        pieces.push(shot.vertices);
        splats.push(shot.splats);
    }
    (LightCache::new(pieces, plan.merge_radius(pass)), splats)
}

/// Gathers one sample per pixel and pass, adds the splats, and commits the passes to the film.
fn gather_passes<S: Sink>(render: &mut Render<'_>, range: Range<u64>, cache: &LightCache, bins: Option<&SplatBins<S::Kept>>) {
    let (scene, plan, filter, crop) = (render.scene, &render.plan, &render.filter, render.crop);
    let exponent = render.film.exponent();
    let gathers = plan.settings.techniques.gathers();
    let film_width = u64::from(scene.film.width);
    let passes = range.clone();
    let layout = render.film.layout();
    let partitions: Vec<Partition> = render.layers.iter().map(|l| l.partition.clone()).collect();
    let rays = S::tiles(&mut render.film, &mut render.layers)
        .into_par_iter()
        .enumerate()
        .map(|(index, mut tiles)| {
            let mut sink = S::new(exponent, &partitions);
            let rect = layout.tile_rect(index);
            let mut rays = RayCounts::default();
            for pass in passes.clone() {
                let more = plan.more_chains();
                let cx = Context::new(scene, plan, pass).with_chain_samples(1 + more);
                if let Some(bins) = bins {
                    for s in bins.tile(index) {
                        sink.add(Layout::local_of(s.pixel), &s.value);
                    }
                }
                if gathers {
                    for (x, y, local) in rect.pixels() {
                        let (px, py) = (crop[0] + x, crop[1] + y);
                        let id = u64::from(py) * film_width + u64::from(px);
                        let mut random = pixel_random(plan, id, pass);
                        let somewhere = |random: &mut Random| {
                            let (offset, weight) = filter.sample_offset(random.axis2());
                            (Vec2::new(px as f32 + 0.5, py as f32 + 0.5) + offset, weight)
                        };
                        let (raster, weight) = somewhere(&mut random);
                        let mut record = PixelRecord { sink: &mut sink, local };
                        let mut tally = Tally { record: &mut record, rays: &mut rays, observe: &mut () };
                        let (r, t) = (&mut random, &mut tally);
                        match plan.settings.coupling {
                            Coupling::All => gather(cx, raster, weight, cache, r, t),
                            Coupling::Specular => recursive(cx, raster, weight, true, r, t),
                            Coupling::None { shadows } => recursive(cx, raster, weight, shadows, r, t),
                        }
                        for i in 0..u64::from(more) {
                            let mut random = chain_random(plan, id, pass * u64::from(more) + i);
                            let (raster, weight) = somewhere(&mut random);
                            chain::sample(cx, raster, weight, &mut random, &mut tally);
                        }
                    }
                }
                sink.commit(&mut tiles);
            }
            rays
        })
        .reduce(RayCounts::default, |mut a, b| {
            a.add(&b);
            a
        });
    render.statistics.rays.add(&rays);
    // The range was free: `run` and `run_passes` ask for passes that are not in the film.
    for film in std::iter::once(&mut render.film).chain(render.layers.iter_mut().flat_map(|l| &mut l.films)) {
        let added = film.add_passes(range.clone());
        debug_assert!(added.is_ok());
    }
}
