//! Scenes from text, and block values of independent renders straight from the walks.

use glam::Vec2;
use nephroid::math::Random;
use nephroid::math::random::Family;
use nephroid::render::{Budget, Control, Options, Render};
use nephroid::report::agreement::BlockSeries;
use nephroid::scene::Scene;
use nephroid::scene::emitter::Guide;
use nephroid::transport::cache::{LightCache, LightVertex};
use nephroid::transport::class::PathFilter;
use nephroid::transport::gather::gather;
use nephroid::transport::settings::{Plan, Settings, Techniques};
use nephroid::transport::shoot::shoot;
use nephroid::transport::walk::{Context, Tally};
use nephroid::transport::{Contribution, RayCounts, Record};
use rayon::prelude::*;

/// Side of a block in pixels.
pub const BLOCK: u32 = 16;

/// A seed for all statistical tests; CI leaves it alone.
pub fn seed() -> u64 {
    std::env::var("NEPHROID_TEST_SEED").ok().and_then(|s| s.parse().ok()).unwrap_or(1)
}

/// The built scene of a text.
pub fn scene(xml: &str) -> Scene {
    nephroid::load_str(xml, std::path::Path::new("."), &Default::default()).map(|l| l.scene).unwrap_or_else(|e| panic!("{e}"))
}

/// The plan with what a bidirectional render would learn, a good start for every join: where light starts, and where
/// gathering goes.
pub fn with_lessons(scene: &Scene, settings: &Settings, plan: Plan) -> Plan {
    if !settings.guided && !settings.guided_gathering {
        return plan;
    }
    let learned = learned(scene, settings);
    let guide = if settings.guided { learned.guide } else { Guide::default() };
    Plan { guide, incident: learned.incident, ..plan }
}

fn learned(scene: &Scene, settings: &Settings) -> Plan {
    let settings = Settings { techniques: Techniques::BIDIRECTIONAL, paths: PathFilter::default(), ..settings.clone() };
    let options = Options { settings, ..Options::default() };
    Render::new(scene, &options).expect("a film").plan().clone()
}

/// Sums of one render by path length and block.
struct Blocks {
    crop: [u32; 4],
    columns: usize,
    sums: Vec<Vec<f64>>,
    /// The largest contribution, by path length.
    largest: Vec<f64>,
    at: (u32, u32),
}

impl Blocks {
    fn add(&mut self, x: i64, y: i64, c: &Contribution) {
        let (x, y) = (x - i64::from(self.crop[0]), y - i64::from(self.crop[1]));
        if x < 0 || y < 0 || x >= i64::from(self.crop[2]) || y >= i64::from(self.crop[3]) {
            return;
        }
        let block = (y as usize / BLOCK as usize) * self.columns + x as usize / BLOCK as usize;
        assert!(c.value.is_finite(), "a contribution is not finite: {c:?}");
        if let Some(sums) = self.sums.get_mut(c.length as usize) {
            let value = f64::from(c.value.mean());
            sums[block] += value;
            self.largest[c.length as usize] = self.largest[c.length as usize].max(value);
        }
    }
}

impl Record for Blocks {
    fn gathered(&mut self, c: Contribution) {
        self.add(i64::from(self.at.0), i64::from(self.at.1), &c);
    }
    fn splatted(&mut self, raster: Vec2, _: &mut Random, c: Contribution) {
        self.add(raster.x.floor() as i64, raster.y.floor() as i64, &c);
    }
}

/// How much to render.
#[derive(Clone, Copy)]
pub struct Effort {
    pub renders: u64,
    pub passes: u64,
    pub max_length: u32,
}

/// Block values by path length (index = length) of independent renders; the scene's box filter is
/// assumed. Seeds differ between series so that both sides of a comparison are independent.
pub fn series(scene: &Scene, settings: &Settings, effort: Effort) -> Vec<BlockSeries> {
    let film = &scene.film;
    let crop = film.crop.unwrap_or([0, 0, film.width, film.height]);
    let (columns, rows) = (crop[2].div_ceil(BLOCK) as usize, crop[3].div_ceil(BLOCK) as usize);
    let mut settings = settings.clone();
    settings.max_length = settings.max_length.min(effort.max_length);
    // Any constant is a valid number of vertices for the weights.
    let plan = Plan::new(&settings, crop[2] * crop[3], film.width * film.height, 2.0);
    let plan = with_lessons(scene, &settings, plan);
    let renders: Vec<Blocks> = (0..effort.renders)
        .into_par_iter()
        .map(|render| {
            let sums = vec![vec![0.0; columns * rows]; effort.max_length as usize + 1];
            let largest = vec![0.0; sums.len()];
            let mut blocks = Blocks { crop, columns, sums, largest, at: (0, 0) };
            let mut rays = RayCounts::default();
            let mut tally = Tally { record: &mut blocks, rays: &mut rays, observe: &mut () };
            for pass in render * effort.passes..(render + 1) * effort.passes {
                // All renders of a series merge in the same radii.
                let cx = Context::new(scene, &plan, pass % effort.passes);
                let mut vertices: Vec<LightVertex> = Vec::new();
                for index in 0..plan.light_paths {
                    let mut random = Random::new(Family::Shoot, u64::from(index), pass, settings.seed);
                    shoot(cx, plan.keeps_vertices().then_some(&mut vertices), &mut random, &mut tally);
                }
                if !settings.techniques.gathers() {
                    continue;
                }
                let cache = LightCache::new(vec![vertices], plan.merge_radius(pass % effort.passes));
                for y in crop[1]..crop[1] + crop[3] {
                    for x in crop[0]..crop[0] + crop[2] {
                        let id = u64::from(y) * u64::from(film.width) + u64::from(x);
                        let mut random = Random::new(Family::Gather, id, pass, settings.seed);
                        tally.record.at = (x, y);
                        let raster = Vec2::new(x as f32, y as f32) + random.unit2();
                        gather(cx, raster, 1.0, &cache, &mut random, &mut tally);
                    }
                }
            }
            blocks
        })
        .collect();
    // Blocks that wait for a contribution as large as the largest look calm and are too low.
    let largest = |k: usize| renders.iter().map(|r| r.largest[k]).fold(0.0, f64::max);
    (0..=effort.max_length as usize)
        .map(|k| BlockSeries {
            columns,
            rows,
            draws: renders.iter().map(|r| r.sums[k].clone()).collect(),
            largest: largest(k),
            heavy: false,
        })
        .collect()
}

/// Block sums of whole renders of four passes, each with options of its own.
pub fn pictures(world: &Scene, renders: u64, options: impl Fn(u64) -> Options) -> BlockSeries {
    let (columns, rows) = ((world.film.width / BLOCK) as usize, (world.film.height / BLOCK) as usize);
    let draw = |r: u64| {
        let mut render = Render::new(world, &options(r)).unwrap();
        render.run(&Budget::passes(4), |_| Control::Continue);
        let picture = render.picture();
        let mut sums = vec![0.0; columns * rows];
        for (i, p) in picture.mean.iter().enumerate() {
            let (x, y) = (i as u32 % picture.width, i as u32 / picture.width);
            sums[(y / BLOCK) as usize * columns + (x / BLOCK) as usize] += f64::from(p[0] + p[1] + p[2]);
        }
        sums
    };
    BlockSeries { columns, rows, draws: (0..renders).map(draw).collect(), ..BlockSeries::default() }
}
