//! How far apart vertices may be to be merged: some pixels, as they appear on what can be merged.

use super::{JOB, Pilot};
use crate::math::Random;
use crate::math::random::Family;
use crate::scene::Surface;
use crate::scene::emitter::Emission;
use crate::transport::RayCounts;
use crate::transport::cache::LightCache;
use crate::transport::gather::follow;
use crate::transport::settings::{NO_BRANCHES, NO_SPLITS, Plan, Settings, Techniques};
use crate::transport::vertex::Scatter;
use crate::transport::walk::{Context, Observe, Tally};
use glam::Vec3;
use rayon::prelude::*;

/// Gathering walks that look for vertices to merge.
const SCOUTS: u32 = 4096;
/// Vertices are merged within so many times the side of a pixel.
const MERGED_PIXELS: f32 = 2.0;

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

impl Pilot<'_> {
    /// Radius in which vertices should be merged in the first pass: some pixels as they appear on what
    /// can be merged, so that merging blurs less than the film does.
    pub(super) fn merge_radius(&self) -> f32 {
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
}
