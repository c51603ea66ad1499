//! One pass after another: shoot, sort, gather.

use super::order::order;
use super::sink::{Divided, Sink, Whole};
use super::{Partition, Render};
use crate::film::filter::MAX_RADIUS;
use crate::film::{Dealt, Filter, Layout, Rect, Sharing, Splat, SplatBins, Taps};
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
/// Emission and the first scattering of a light path; all light paths of all passes share a sequence.
const SHOOT_AXES: u32 = 8;
/// The film, where pixels share walks; all passes share a sequence.
const FILM_AXES: u32 = 4;
/// Pixels beyond the border of a film have numbers of their own as far as filters reach.
const MARGIN: i64 = MAX_RADIUS as i64 + 1;
/// Film and lens of a sample of chains; all of a pixel share a sequence.
const CHAIN_AXES: u32 = 4;
/// Film, lens and the first vertices of a gathering walk; all passes of a pixel share a sequence.
pub(super) const GATHER_AXES: u32 = 16;

/// Hands what gathering walks find to the pixel being sampled.
struct PixelRecord<F>(F);

impl<F: FnMut(&Contribution)> Record for PixelRecord<F> {
    #[inline]
    fn gathered(&mut self, c: Contribution) {
        self.0(&c);
    }
    fn splatted(&mut self, _: Vec2, _: &mut Random, _: Contribution) {}
}

/// Writes what shooting walks find as messages to pixels.
struct SplatRecord<'a, S: Sink> {
    filter: &'a Filter,
    sharing: Sharing,
    layout: Layout,
    crop: [u32; 4],
    splats: Vec<Splat<S::Kept>>,
}

impl<S: Sink> Record for SplatRecord<'_, S> {
    fn gathered(&mut self, _: Contribution) {}
    #[inline]
    fn splatted(&mut self, raster: Vec2, random: &mut Random, c: Contribution) {
        if self.filter.reach() > 0 {
            let corner = Vec2::new(self.crop[0] as f32, self.crop[1] as f32);
            if let Some((pixel, offset)) = self.sharing.place(raster - corner) {
                self.splats.push(Splat { pixel, offset, value: S::keep(&c) });
            }
            return;
        }
        let Some((x, y, weight)) = self.filter.splat_pixel(raster, random.unit2()) else { return };
        let (x, y) = (i64::from(x) - i64::from(self.crop[0]), i64::from(y) - i64::from(self.crop[1]));
        if (0..i64::from(self.crop[2])).contains(&x) && (0..i64::from(self.crop[3])).contains(&y) {
            let pixel = self.layout.pixel(x as u32, y as u32);
            self.splats.push(Splat { pixel, offset: [0; 2], value: S::keep(&Contribution { value: c.value * weight, ..c }) });
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
    let index = u64::from(index);
    let point = pass.wrapping_mul(u64::from(plan.light_paths)).wrapping_add(index);
    plan.random(Family::Shoot, (index, pass), (0, point), SHOOT_AXES)
}

/// The random numbers of each walk of a pass of pixel (x, y) of the crop window, with number `id` in the whole film.
#[inline]
pub(crate) fn pixel_randoms(plan: &Plan, pixel: (i32, i32), id: u64, pass: u64) -> impl ExactSizeIterator<Item = Random> {
    let samples = plan.settings.samples.at(pixel);
    (0..samples).map(move |i| {
        let sample = pass * u64::from(samples) + u64::from(i);
        plan.random(Family::Gather, (id, sample), (id, sample), GATHER_AXES)
    })
}

/// The random numbers that all pixels of a pass have in common.
fn film_random(plan: &Plan, pass: u64) -> Random {
    plan.random(Family::Film, (0, pass), (0, pass), FILM_AXES)
}

/// The random numbers of sample `sample` of chains alone of the pixel with number `id` in the whole film.
fn chain_random(plan: &Plan, id: u64, sample: u64) -> Random {
    plan.random(Family::Chain, (id, sample), (id, sample), CHAIN_AXES)
}

/// Shoots all light paths of a pass.
fn shoot_pass<S: Sink>(render: &mut Render<'_>, pass: u64) -> (LightCache, Vec<Vec<Splat<S::Kept>>>) {
    let plan = &render.plan;
    let cx = Context::new(render.scene, plan, pass);
    let shots: Vec<Shot<S::Kept>> = order(render.scene, plan, pass)
        .par_chunks(SHOOT_JOB as usize)
        .map(|paths| {
            let mut record = SplatRecord::<S> {
                filter: &render.filter,
                sharing: Sharing::new(render.film.layout(), &render.filter),
                layout: render.film.layout(),
                crop: render.crop,
                splats: Vec::with_capacity(SHOOT_JOB as usize),
            };
            let mut vertices = Vec::with_capacity(if plan.c > 0.0 { 3 * SHOOT_JOB as usize } else { 0 });
            let mut rays = RayCounts::default();
            let mut tally = Tally { record: &mut record, rays: &mut rays, observe: &mut () };
            for index in paths {
                let mut random = light_path_random(plan, *index, pass);
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

/// What gathering walks need, of whatever pixel.
struct Gathering<'a> {
    plan: &'a Plan,
    filter: &'a Filter,
    crop: [u32; 4],
    film: [u32; 2],
    cache: &'a LightCache,
}

impl Gathering<'_> {
    /// Corner of a pixel of the crop window in the whole film, and the number of its random numbers. Pixels beyond the film
    /// have none among those of the film.
    fn pixel(&self, (x, y): (i32, i32)) -> (Vec2, u64) {
        let (x, y) = (i64::from(self.crop[0]) + i64::from(x), i64::from(self.crop[1]) + i64::from(y));
        let [width, height] = self.film.map(i64::from);
        let inside = (0..width).contains(&x) && (0..height).contains(&y);
        let beyond = || i64::MIN | ((y + MARGIN) * (width + 2 * MARGIN) + x + MARGIN);
        let id = if inside { y * width + x } else { beyond() };
        (Vec2::new(x as f32, y as f32), id as u64)
    }

    /// A point of its filter, from the centre of a pixel with this corner.
    #[inline]
    fn place(&self, corner: Vec2, random: &mut Random) -> (Vec2, f32) {
        let (offset, weight) = self.filter.sample_offset(random.axis2());
        (corner + 0.5 + offset, weight)
    }

    /// Samples of chains alone of a pixel of the crop window, and the part that each counts. The walk counts the same part, or,
    /// where pixels share walks, [`Self::shared_part`] in all of them: a pixel that needs one sample then has another for the rest.
    #[inline]
    fn chains(&self, (x, y): (u32, u32), shared: bool) -> (u32, f32) {
        let all = self.plan.chain_samples();
        match (self.plan.first_seen.at(x, y), shared && all > 1) {
            (true, _) => (all - 1, self.shared_part()),
            (false, true) => (1, 1.0 - self.shared_part()),
            (false, false) => (0, 1.0),
        }
    }

    /// Part that a walk counts of chains where pixels share it.
    fn shared_part(&self) -> f32 {
        1.0 / self.plan.chain_samples() as f32
    }

    /// The samples of a pixel of the crop window in a pass, each of which counts its part: where `taps` say, or by the filter.
    #[inline]
    fn samples(
        &self,
        cx: Context<'_>,
        (pixel, pass): ((i32, i32), u64),
        taps: Option<&Taps>,
        rays: &mut RayCounts,
        mut found: impl FnMut(&Contribution),
    ) {
        let (corner, id) = self.pixel(pixel);
        let walks = pixel_randoms(self.plan, pixel, id, pass);
        let part = 1.0 / walks.len() as f32;
        let mut record = PixelRecord(|c: &Contribution| found(&Contribution { value: c.value * part, ..*c }));
        for mut random in walks {
            let (raster, weight) = match taps {
                Some(taps) => (corner + 0.5 + taps.offset, 1.0),
                None => self.place(corner, &mut random),
            };
            let mut tally = Tally { record: &mut record, rays: &mut *rays, observe: &mut () };
            let (r, t) = (&mut random, &mut tally);
            match self.plan.settings.coupling {
                Coupling::All => gather(cx, raster, weight, self.cache, r, t),
                Coupling::Specular => recursive(cx, raster, weight, true, r, t),
                Coupling::None { shadows } => recursive(cx, raster, weight, shadows, r, t),
            }
        }
    }

    /// More samples of chains of a pixel of the crop window.
    #[inline]
    fn more_chains(
        &self,
        cx: Context<'_>,
        (pixel, pass): ((i32, i32), u64),
        more: u32,
        rays: &mut RayCounts,
        found: impl FnMut(&Contribution),
    ) {
        let more = u64::from(more);
        let (corner, id) = self.pixel(pixel);
        let mut tally = Tally { record: &mut PixelRecord(found), rays, observe: &mut () };
        for i in 0..more {
            let mut random = chain_random(self.plan, id, pass * more + i);
            let (raster, weight) = self.place(corner, &mut random);
            chain::sample(cx, raster, weight, &mut random, &mut tally);
        }
    }
}

/// Gathers the samples of all pixels in each pass, adds the splats, and commits the passes to the film.
fn gather_passes<S: Sink>(render: &mut Render<'_>, range: Range<u64>, cache: &LightCache, bins: Option<&SplatBins<S::Kept>>) {
    let (scene, plan, filter, crop) = (render.scene, &render.plan, &render.filter, render.crop);
    let exponent = render.film.exponent();
    let gathers = plan.settings.techniques.gathers();
    let gathering = Gathering { plan, filter, crop, film: [scene.film.width, scene.film.height], cache };
    let layout = render.film.layout();
    let sharing = Sharing::new(layout, filter);
    let partitions: Vec<Partition> = render.layers.iter().map(|l| l.partition.clone()).collect();
    let context = |pass| Context::new(scene, plan, pass);
    // Where pixels share walks, those of a pass come first.
    let shared: Vec<Option<Shared<S>>> = range
        .clone()
        .map(|pass| share(&gathering, context(pass).with_chain_part(gathering.shared_part()), sharing, exponent, pass))
        .collect();
    let rays = S::tiles(&mut render.film, &mut render.layers)
        .into_par_iter()
        .enumerate()
        .map(|(tile, mut tiles)| {
            let mut sink = S::new(exponent, &partitions);
            let rect = layout.tile_rect(tile);
            let mut rays = RayCounts::default();
            for (pass, shared) in range.clone().zip(&shared) {
                let cx = context(pass);
                if let Some(bins) = bins {
                    add_splats(&mut sink, bins, filter, sharing, (tile, rect));
                }
                if let Some(shared) = shared {
                    sink.reconstruct(sharing, tile, rect, &shared.taps, &shared.found);
                }
                if gathers {
                    for (x, y, local) in rect.pixels() {
                        let pixel = (x as i32, y as i32);
                        let mut found = |c: &Contribution| sink.add(local, &S::keep(c));
                        let (more, part) = gathering.chains((x, y), shared.is_some());
                        let cx = cx.with_chain_part(part);
                        if shared.is_none() {
                            gathering.samples(cx, (pixel, pass), None, &mut rays, &mut found);
                        }
                        gathering.more_chains(cx, (pixel, pass), more, &mut rays, &mut found);
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
    shared.iter().flatten().for_each(|s| render.statistics.rays.add(&s.rays));
    // The range was free: `run` and `run_passes` ask for passes that are not in the film.
    for film in std::iter::once(&mut render.film).chain(render.layers.iter_mut().flat_map(|l| &mut l.films)) {
        let added = film.add_passes(range.clone());
        debug_assert!(added.is_ok());
    }
}

/// Adds the splats that reach a tile.
fn add_splats<S: Sink>(sink: &mut S, bins: &SplatBins<S::Kept>, filter: &Filter, sharing: Sharing, (tile, rect): (usize, Rect)) {
    if filter.reach() == 0 {
        bins.tile(tile).for_each(|s| sink.add(Layout::local_of(s.pixel), &s.value));
        return;
    }
    for t in sharing.neighbours(tile) {
        for s in bins.tile(t) {
            let at = sharing.from_corner(tile, s.pixel, s.offset);
            if let Some(dealt) = Dealt::new(filter, at, t == tile) {
                sink.deal(rect, &dealt, &s.value);
            }
        }
    }
}

/// What the walks of a pass found that pixels share.
struct Shared<S: Sink> {
    taps: Taps,
    found: Vec<S::Found>,
    rays: RayCounts,
}

/// The walks of a pass, where the filter is wider than a pixel.
fn share<S: Sink>(gathering: &Gathering<'_>, cx: Context<'_>, sharing: Sharing, exponent: i32, pass: u64) -> Option<Shared<S>> {
    let (plan, filter) = (gathering.plan, gathering.filter);
    if filter.reach() == 0 || !plan.settings.techniques.gathers() {
        return None;
    }
    let taps = Taps::new(filter, film_random(plan, pass).axis2())?;
    let of_tile = |tile| {
        let (mut found, mut rays) = (S::nothing(sharing, tile, exponent), RayCounts::default());
        for pixel in sharing.share(tile).pixels() {
            gathering.samples(cx, (pixel, pass), Some(&taps), &mut rays, |c| S::find(&mut found, pixel, &S::keep(c)));
        }
        (found, rays)
    };
    let (found, all): (Vec<_>, Vec<_>) = (0..sharing.tiles()).into_par_iter().map(of_tile).unzip();
    let mut rays = RayCounts::default();
    all.iter().for_each(|r| rays.add(r));
    Some(Shared { taps, found, rays })
}
