//! How many samples of chains (E S* L) a pixel should have: what they vary within pixels against the rays they take.

use super::Pilot;
use super::branching::Branching;
use crate::math::random::Family;
use crate::math::{Random, limit};
use crate::transport::chain;
use crate::transport::first_seen::FirstSeen;
use crate::transport::settings::Plan;
use crate::transport::walk::{Context, Tally};
use crate::transport::{Contribution, RayCounts, Record};
use glam::Vec2;
use rayon::prelude::*;

/// Numbers of samples that are considered.
pub(super) const SAMPLES: [u32; 6] = [1, 2, 4, 8, 16, 32];
/// Pixels looked at, at most.
const PIXELS: usize = 4096;
/// Samples of each.
const LOOKS: u32 = 16;
/// Pixels whose radiance is then looked for, at most, among those where samples differ,
const BRIGHT: usize = 512;
/// and samples of each. An image of a lamp behind several balls of glass is met once in thousands of samples, so what one
/// lucky sample says of a pixel must not be compared with itself.
const LONGER_LOOKS: u32 = 128;

/// A single pixel counts for at most this part of the noise of all: where a second look misses what one lucky sample of the first
/// found, a pixel says anything, but so do not four.
const MOST: f64 = 0.25;
/// Steps towards that.
const CLIPPINGS: u32 = 32;

/// What one sample of chains per pixel leaves of noise in a pass, and its rays.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ChainNoise {
    noise: f64,
    /// Part of the pixels that need more than one sample.
    part: f64,
    /// Per sample of these, beyond the one from the eye.
    branches: f64,
}

/// The sum of what walks find.
#[derive(Default)]
pub(super) struct Sum(pub(super) f64);
impl Record for Sum {
    fn gathered(&mut self, c: Contribution) {
        self.0 += f64::from(c.value.mean());
    }
    fn splatted(&mut self, _: Vec2, _: &mut Random, _: Contribution) {}
}

impl ChainNoise {
    /// Looks at pixels of `first_seen`, evenly spread.
    pub(super) fn measured(pilot: &Pilot<'_>, plan: &Plan, first_seen: &FirstSeen, dark_squares: &[f64]) -> Self {
        let all = first_seen.pixels().count();
        let pixels: Vec<Vec2> = first_seen.pixels().step_by(all.div_ceil(PIXELS).max(1)).collect();
        let (found, rays) = looked(pilot, plan, &pixels, (LOOKS, 0));
        let differ: Vec<(Vec2, f64)> = found
            .into_iter()
            .zip(&pixels)
            .filter_map(|((_, variance), pixel)| (variance > 0.0).then_some((*pixel, variance)))
            .collect();
        let few: Vec<(Vec2, f64)> = differ.iter().step_by(differ.len().div_ceil(BRIGHT).max(1)).copied().collect();
        let again: Vec<Vec2> = few.iter().map(|(pixel, _)| *pixel).collect();
        let (bright, _) = looked(pilot, plan, &again, (LONGER_LOOKS, 1 << 32));
        let relative: Vec<f64> = few
            .iter()
            .zip(&bright)
            .filter_map(|((pixel, variance), (mean, _))| {
                let relative = variance / (mean * mean + dark_squares[pilot.picture.cell(*pixel)? as usize]);
                relative.is_finite().then_some(relative)
            })
            .collect();
        let samples = pixels.len() as f64 * f64::from(LOOKS);
        let times = |all: usize, some: usize| all as f64 / some.max(1) as f64;
        Self {
            noise: in_all(&relative) * times(differ.len(), few.len()) * times(all, pixels.len()),
            part: all as f64 / f64::from(pilot.pixels().max(1)),
            branches: (rays as f64 / samples.max(1.0) - 1.0).max(0.0),
        }
    }

    /// Noise of a pass with so many samples, with what `branching` leaves to chance.
    pub(super) fn noise(&self, branching: &Branching, samples: u32) -> f64 {
        (self.noise + branching.noise) / f64::from(samples)
    }

    /// Cost of the samples beyond the walk's own: `eye` for each ray from the eye, `branch` for each branch.
    pub(super) fn cost(&self, samples: u32, eye: f64, branch: f64) -> f64 {
        f64::from(samples - 1) * self.part * (eye + branch * self.branches)
    }
}

/// The sum of what pixels say, none of which says too much.
fn in_all(relative: &[f64]) -> f64 {
    let most = limit(relative.iter().copied(), MOST, CLIPPINGS);
    relative.iter().map(|r| r.min(most)).sum()
}

/// Mean and variance of what samples of chains of these pixels find, and the rays that they take; `first` numbers the first pixel.
fn looked(pilot: &Pilot<'_>, plan: &Plan, pixels: &[Vec2], (looks, first): (u32, u64)) -> (Vec<(f64, f64)>, u64) {
    let cx = Context::new(pilot.scene, plan, 0);
    let look = |(i, &pixel): (usize, &Vec2)| {
        let mut random = Random::new(Family::Pilot, (first + i as u64) | 1 << 36, 0, plan.settings.seed);
        let (mut sum, mut squares, mut rays) = (0.0, 0.0, RayCounts::default());
        for _ in 0..looks {
            let mut found = Sum::default();
            let raster = pixel + random.unit2();
            let mut tally = Tally { record: &mut found, rays: &mut rays, observe: &mut () };
            chain::sample(cx, raster, 1.0, &mut random, &mut tally);
            sum += found.0;
            squares += found.0 * found.0;
        }
        let n = f64::from(looks);
        ((sum / n, (squares - sum * sum / n).max(0.0) / (n - 1.0)), rays.gather)
    };
    let (found, rays): (Vec<_>, Vec<u64>) = pixels.par_iter().enumerate().map(look).unzip();
    (found, rays.iter().sum())
}

#[cfg(test)]
mod tests {
    use super::in_all;

    #[test]
    fn one_lucky_pixel_does_not_decide_and_many_do() {
        let with = |lucky| {
            let mut relative = vec![1.0; 300];
            relative.extend(vec![1e5; lucky]);
            in_all(&relative)
        };
        assert_eq!(with(0), 300.0);
        assert!((with(1) - 400.0).abs() < 1.0, "{}", with(1));
        assert_eq!(with(4), 300.0 + 4e5);
    }
}
