//! How many samples of chains (E S* L) a pixel should have: what they vary within pixels against the rays they take.

use super::branching::Branching;
use super::{JOB, Pilot};
use crate::math::Random;
use crate::math::random::Family;
use crate::transport::chain;
use crate::transport::settings::Plan;
use crate::transport::walk::{Context, Tally};
use crate::transport::{Contribution, RayCounts, Record};
use glam::Vec2;
use rayon::prelude::*;

/// Numbers of samples that are considered.
pub(super) const SAMPLES: [u32; 6] = [1, 2, 4, 8, 16, 32];
/// Pixels looked at, at most.
const PIXELS: u32 = 4096;
/// Samples of each.
const LOOKS: u32 = 16;

/// What one sample of chains per pixel leaves of noise in a pass, and its rays.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ChainNoise {
    noise: f64,
    /// Per sample, beyond the one from the eye.
    branches: f64,
}

/// The sum of what a sample finds.
#[derive(Default)]
struct Sum(f64);
impl Record for Sum {
    fn gathered(&mut self, c: Contribution) {
        self.0 += f64::from(c.value.mean());
    }
    fn splatted(&mut self, _: Vec2, _: &mut Random, _: Contribution) {}
}

impl ChainNoise {
    /// Looks at evenly spread pixels; nothing where `plan` does not follow chains.
    pub(super) fn measured(pilot: &Pilot<'_>, plan: &Plan, dark_squares: &[f64]) -> Self {
        let s = &plan.settings;
        if !s.follows_chains() {
            return Self::default();
        }
        let cx = Context::new(pilot.scene, plan, 0);
        let all = pilot.crop[2].saturating_mul(pilot.crop[3]);
        let looked = all.min(PIXELS);
        let jobs = (0..looked.div_ceil(JOB)).into_par_iter().map(|job| {
            let (mut noise, mut rays) = (0.0, RayCounts::default());
            for index in job * JOB..((job + 1) * JOB).min(looked) {
                let mut random = Random::new(Family::Pilot, u64::from(index) | 1 << 36, 0, s.seed);
                let pixel = pilot.raster(index, looked, &mut random).floor();
                let Some(cell) = pilot.cell(pixel) else { continue };
                let (mut sum, mut squares) = (0.0, 0.0);
                for _ in 0..LOOKS {
                    let mut found = Sum::default();
                    let raster = pixel + random.unit2();
                    let mut tally = Tally { record: &mut found, rays: &mut rays, observe: &mut () };
                    chain::sample(cx, raster, 1.0, &mut random, &mut tally);
                    sum += found.0;
                    squares += found.0 * found.0;
                }
                let n = f64::from(LOOKS);
                let mean = sum / n;
                let variance = (squares - sum * mean).max(0.0) / (n - 1.0);
                let relative = variance / (mean * mean + dark_squares[cell as usize]);
                noise += if relative.is_finite() { relative } else { 0.0 };
            }
            (noise, rays.gather)
        });
        // In the order of the jobs, so that sums do not depend on threads.
        let found = jobs.collect::<Vec<_>>().into_iter().fold((0.0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
        let samples = f64::from(looked) * f64::from(LOOKS);
        Self {
            noise: found.0 * f64::from(all) / f64::from(looked.max(1)),
            branches: (found.1 as f64 / samples.max(1.0) - 1.0).max(0.0),
        }
    }

    /// Noise of a pass with so many samples, with what `branching` leaves to chance.
    pub(super) fn noise(&self, branching: &Branching, samples: u32) -> f64 {
        (self.noise + branching.noise) / f64::from(samples)
    }

    /// Cost of the samples beyond the walk's own: `eye` for each ray from the eye, `branch` for each branch.
    pub(super) fn cost(&self, samples: u32, eye: f64, branch: f64) -> f64 {
        f64::from(samples - 1) * (eye + branch * self.branches)
    }
}
