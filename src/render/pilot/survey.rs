//! How many gathering walks each part of the picture should have: by what walks vary there, and what they take.
//!
//! Pixels are looked at by two sets of walks each, which fill space evenly as in a render; their difference is the noise of
//! a walk among others of its pass, without that of light vertices, which all of them share. With σ² relative to the picture and
//! a cost c, n ∝ σ/√c makes least error of a time [Neyman 1934].

use super::chains::Sum;
use super::choice::COSTS;
use super::picture::near;
use super::{Decisions, Pilot};
use crate::film::Filter;
use crate::math::random::Family;
use crate::math::{Random, limit};
use crate::render::passes::GATHER_AXES;
use crate::transport::RayCounts;
use crate::transport::cache::{LightCache, LightVertex};
use crate::transport::gather::gather;
use crate::transport::sample_map::{SampleMap, cell};
use crate::transport::settings::Plan;
use crate::transport::shoot::shoot;
use crate::transport::walk::{Context, Tally};
use rayon::prelude::*;

/// Cells along the longer side of the picture, at most,
const CELLS: u32 = 64;
/// and pixels along a side of a cell, at least.
const LEAST_CELL: u32 = 8;
/// Pictures of fewer pixels have one walk everywhere.
const LEAST_PIXELS: u32 = 4096;
/// Walks of a survey, at most; in pictures of fewer pixels one for each.
const MOST_WALKS: u32 = 196_608;
/// Walks of a set; a pixel has two.
const SET: u32 = 4;
/// Pixels of a job.
const JOB: u32 = 128;
/// Light paths that lend their vertices, at most.
const LIGHT_PATHS: u32 = 65_536;
/// A pixel counts for at most so many times the mean.
const MOST: f64 = 24.0;
/// Steps towards that.
const CLIPPINGS: u32 = 16;
/// Cost of all gathering walks of a pass, at most, for one of each pixel.
const MOST_COST: f64 = 2.0;
/// Most walks of a pixel that are chosen.
const MOST_CHOSEN: u8 = 8;
/// Part of the noise of splats that is left of what the choice of techniques expects: their relative weight where they crowd is
/// overrated by coarse cells, and all light paths of a render fill space evenly.
const LEFT_OF_SPLATS: f64 = 0.5;
/// Noise times cost must fall to this part.
const MUST_WIN: f64 = 0.95;

/// What light paths bring to a pass beside gathering walks.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Beside {
    /// Of splats, relative to the picture, mean over pixels.
    pub(super) noise: f64,
    /// Of light paths, for one of a gathering walk in each pixel.
    pub(super) cost: f64,
}

/// What was seen of a pixel, or of many: sums over them.
#[derive(Clone, Copy, Default)]
struct Look {
    /// Variance of a walk, relative to the square of the picture.
    noise: f64,
    /// Of a walk.
    cost: f64,
    pixels: f64,
}

impl Look {
    /// With so much of another.
    fn and(self, part: f64, other: Self) -> Self {
        Self {
            noise: self.noise + part * other.noise,
            cost: self.cost + part * other.cost,
            pixels: self.pixels + part * other.pixels,
        }
    }
}

impl Pilot<'_> {
    /// Numbers of walks for a render by `decisions`.
    pub(super) fn survey(&self, decisions: &Decisions, beside: Beside) -> SampleMap {
        let mut plan = self.plan(decisions);
        if self.pixels() < LEAST_PIXELS || !plan.settings.techniques.gathers() {
            return SampleMap::default();
        }
        let paths = plan.light_paths.min(LIGHT_PATHS);
        // Fewer light vertices, but as many to merge, within a wider radius.
        plan.merge_radius *= (plan.light_paths as f32 / paths.max(1) as f32).sqrt();
        plan.light_paths = paths;
        plan.inv_light_paths = 1.0 / paths.max(1) as f32;
        let cache = LightCache::new(self.lent(&plan), plan.merge_radius);
        let looks = self.looks(&plan, &cache);
        let most = limit(looks.iter().map(|(_, look)| look.noise), MOST / looks.len().max(1) as f64, CLIPPINGS);
        let step = self.crop[2].max(self.crop[3]).div_ceil(CELLS).max(LEAST_CELL);
        let cells = [self.crop[2].div_ceil(step), self.crop[3].div_ceil(step)];
        let mut sums = vec![Look::default(); (cells[0] * cells[1]) as usize];
        for (pixel, look) in looks {
            let sum = &mut sums[cell(self.crop, cells, pixel)];
            *sum = sum.and(1.0, Look { noise: look.noise.min(most), ..look });
        }
        dealt(&blurred(&sums, cells), beside)
    }

    /// Vertices of the light paths of a pass.
    fn lent(&self, plan: &Plan) -> Vec<Vec<LightVertex>> {
        let cx = Context::new(self.scene, plan, 0);
        let paths = if plan.keeps_vertices() { plan.light_paths } else { 0 };
        let job = |job: u32| {
            let mut vertices = vec![];
            for index in job * super::JOB..((job + 1) * super::JOB).min(paths) {
                let mut random = Random::new(Family::Pilot, u64::from(index) | 1 << 40, 0, plan.settings.seed);
                let mut tally = Tally { record: &mut (), rays: &mut RayCounts::default(), observe: &mut () };
                shoot(cx, Some(&mut vertices), &mut random, &mut tally);
            }
            vertices
        };
        (0..paths.div_ceil(super::JOB)).into_par_iter().map(job).collect()
    }

    /// Looks at pixels that are evenly spread; each with its place in the crop window.
    fn looks(&self, plan: &Plan, cache: &LightCache) -> Vec<((i32, i32), Look)> {
        let cx = Context::new(self.scene, plan, 0).with_chain_part(1.0 / plan.chain_samples() as f32);
        let squares = self.picture.squares_around(0);
        // Where pixels share walks, all of a pass stand at the same place in their pixels.
        let together = Filter::new(self.scene.film.filter).is_some_and(|f| f.reach() > 0);
        let pixels = self.pixels().min(MOST_WALKS) / (2 * SET);
        let look = |index: u32| {
            let mut random = Random::new(Family::Pilot, u64::from(index) | 1 << 41, 0, plan.settings.seed);
            let corner = self.pixel(index, pixels, &mut random);
            let place = random.unit2();
            let mut rays = RayCounts::default();
            let mut set = |set: u32| {
                let id = u64::from(2 * index + set) | 1 << 42;
                let mut sum = Sum::default();
                for i in 0..u64::from(SET) {
                    let mut random = plan.random(Family::Pilot, (id, i), (id, i), GATHER_AXES);
                    // As in a render, where it is free to differ.
                    let own = random.axis2();
                    let raster = corner + if together { place } else { own };
                    let mut tally = Tally { record: &mut sum, rays: &mut rays, observe: &mut () };
                    gather(cx, raster, 1.0, cache, &mut random, &mut tally);
                }
                sum.0
            };
            let difference = set(0) - set(1);
            let square = squares[self.picture.cell(corner)? as usize].max(f64::MIN_POSITIVE);
            let walks = f64::from(2 * SET);
            // The variance of either sum is SET times that of a walk.
            let noise = difference * difference / (walks * square);
            let of_rays = COSTS.gather_step * rays.gather as f64 + COSTS.next_event * rays.shadow as f64;
            let cost = COSTS.gather_walk + of_rays / walks;
            let pixel = (corner.x as i32 - self.crop[0] as i32, corner.y as i32 - self.crop[1] as i32);
            noise.is_finite().then_some((pixel, Look { noise, cost, pixels: 1.0 }))
        };
        let job = |job: u32| (job * JOB..((job + 1) * JOB).min(pixels)).filter_map(look).collect::<Vec<_>>();
        (0..pixels.div_ceil(JOB)).into_par_iter().map(job).collect::<Vec<_>>().concat()
    }
}

/// Noise and cost of a walk in a cell.
type Worth = (f64, f64);

/// Of each cell, in rows; with those around, since few of its pixels were looked at.
fn blurred(sums: &[Look], [columns, rows]: [u32; 2]) -> Vec<Vec<Worth>> {
    // A cell, half of those beside it, and a quarter of those at its corners.
    let part = |a: u32, b: u32| if a == b { 1.0 } else { 0.5 };
    let around = |x: u32, y: u32| {
        let cells = near(y, rows, 1).flat_map(|v| near(x, columns, 1).map(move |u| (u, v)));
        let sum = cells.fold(Look::default(), |sum, (u, v)| sum.and(part(x, u) * part(y, v), sums[(v * columns + u) as usize]));
        let pixels = sum.pixels.max(f64::MIN_POSITIVE);
        (sum.noise / pixels, (sum.cost / pixels).max(COSTS.gather_walk))
    };
    (0..rows).map(|y| (0..columns).map(|x| around(x, y)).collect()).collect()
}

/// Numbers of walks for cells, so that the noise of a pass times its cost is least; one everywhere where that is nearly as good.
fn dealt(cells: &[Vec<Worth>], beside: Beside) -> SampleMap {
    let all = || cells.iter().flatten();
    let (noise, cost) = all().fold((0.0, 0.0), |(n, c), (noise, cost)| (n + noise, c + cost));
    let root: f64 = all().map(|(noise, cost)| (noise * cost).sqrt()).sum();
    if root <= 0.0 {
        return SampleMap::default();
    }
    // With the scale 1 walks would cost as much as one for each pixel, were numbers not whole and at least one.
    let number = |scale: f64, (n, c): Worth| (scale * (n / c).sqrt() * cost / root).round().clamp(1.0, MOST_CHOSEN.into());
    // Noise and cost of gathering, relative to those of one walk everywhere.
    let gathering = |scale: f64| {
        let of = |(n, c), worth: &Worth| (n + worth.0 / number(scale, *worth), c + worth.1 * number(scale, *worth));
        let (n, c) = all().fold((0.0, 0.0), of);
        (n / noise, c / cost)
    };
    let mean = noise / all().count() as f64;
    let splats = LEFT_OF_SPLATS * beside.noise / mean;
    let error = |(n, c): (f64, f64)| (n + splats) * (c + beside.cost);
    let even = error((1.0, 1.0));
    let scales = (1..=64).map(|i| f64::from(i) / 16.0);
    let judged = scales.map(|scale| (scale, gathering(scale))).filter(|(_, (_, cost))| *cost <= MOST_COST);
    match judged.map(|(scale, g)| (scale, error(g))).min_by(|a, b| a.1.total_cmp(&b.1)) {
        Some((scale, least)) if least < MUST_WIN * even => {
            let row = |row: &Vec<Worth>| row.iter().map(|worth| number(scale, *worth) as u8).collect();
            SampleMap::from_rows(&cells.iter().map(row).collect::<Vec<Vec<u8>>>()).unwrap_or_default()
        }
        _ => SampleMap::default(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A row of cells with this noise and a cost.
    fn row(cells: &[Worth], beside: Beside) -> Vec<u8> {
        dealt(&[cells.to_vec()], beside).rows().flatten().copied().collect()
    }

    #[test]
    fn more_walks_go_where_they_vary_more_and_cost_less() {
        let alone = Beside::default();
        let of = |noisy: Worth| row(&[vec![(0.01, 10.0); 9], vec![noisy]].concat(), alone);
        assert!(of((0.01, 10.0)).is_empty());
        let (noisy, dear) = (of((1.0, 10.0)), of((1.0, 40.0)));
        assert!(noisy[..9] == [1; 9] && noisy[9] >= 6, "{noisy:?}");
        assert!(dear.is_empty() || dear[9] < noisy[9], "{dear:?}");
        // What no walk changes: noise of splats; and what makes walks cheap: light paths that cost more.
        let splats = Beside { noise: 5.0, cost: 0.0 };
        let shooting = Beside { noise: 0.0, cost: 20.0 };
        let cells = [vec![(0.04, 10.0); 5], vec![(0.16, 10.0); 5]].concat();
        assert!(row(&cells, splats).is_empty());
        let sum = |walks: &[u8]| walks.iter().map(|n| u32::from(*n)).sum::<u32>();
        assert!(sum(&row(&cells, shooting)) > sum(&row(&cells, alone)));
        // Nothing varies, or nothing was found.
        assert_eq!((row(&[(0.0, 1.7); 4], alone), dealt(&[], alone)), (vec![], SampleMap::default()));
    }

    #[test]
    fn a_cell_is_taken_with_those_around() {
        let mut sums = vec![Look { noise: 0.0, cost: 40.0, pixels: 8.0 }; 15];
        sums[7] = Look { noise: 16.0, cost: 40.0, pixels: 8.0 };
        let cells = blurred(&sums, [5, 3]);
        let noise: Vec<Vec<f64>> = cells.iter().map(|row| row.iter().map(|c| c.0).collect()).collect();
        // Of 1 + 4/2 + 4/4 cells of eight pixels.
        assert!((noise[1][2] - 16.0 / 32.0).abs() < 1e-12 && (noise[1][1] - 8.0 / 32.0).abs() < 1e-12);
        assert!((noise[0][2] - 8.0 / (8.0 * 3.0)).abs() < 1e-12 && noise[0][0] == 0.0);
        assert!(cells.iter().flatten().all(|c| (c.1 - 5.0).abs() < 1e-12));
    }
}
