//! What is measured before a render starts: how many light vertices a light path leaves.
//!
//! The number enters the weights of connections and must not depend on the samples that are
//! weighted with it; the pilot draws from its own family of random numbers, as a function of scene
//! and seed alone.

use crate::math::Random;
use crate::math::random::Family;
use crate::scene::Scene;
use crate::transport::settings::{Plan, Settings};
use crate::transport::shoot::shoot;
use crate::transport::walk::{Context, Tally};
use crate::transport::{Contribution, RayCounts, Record};
use glam::Vec2;
use rayon::prelude::*;

const PATHS: u64 = 16_384;
const JOB: u64 = 1024;

struct Nothing;
impl Record for Nothing {
    fn gathered(&mut self, _: Contribution) {}
    fn splatted(&mut self, _: Vec2, _: &mut Random, _: Contribution) {}
}

/// Mean number of light vertices per light path; 0 where connections are off.
pub fn vertices_per_path(scene: &Scene, settings: &Settings, pixels: u32) -> f64 {
    if !settings.techniques.connect || settings.connections == 0 {
        return 0.0;
    }
    let mut alone = settings.clone();
    alone.techniques.splat = false;
    let plan = Plan::new(&alone, pixels, pixels, 0.0);
    let cx = Context { scene, plan: &plan };
    let vertices: u64 = (0..PATHS / JOB)
        .into_par_iter()
        .map(|job| {
            let mut cache = Vec::new();
            let mut rays = RayCounts::default();
            let mut tally = Tally { record: &mut Nothing, rays: &mut rays, observe: &mut () };
            for index in job * JOB..(job + 1) * JOB {
                let mut random = Random::new(Family::Pilot, index, 0, settings.seed);
                shoot(cx, Some(&mut cache), &mut random, &mut tally);
            }
            cache.len() as u64
        })
        .sum();
    vertices as f64 / PATHS as f64
}
