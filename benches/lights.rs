//! What ten thousand lights cost against ten of the same area and power: time to equal error.
//!
//! `cargo bench --bench lights`. The error of runs of equal samples (trimmed relMSE against a reference, whose
//! own noise is subtracted) times their time is inversely proportional to what a second is worth; runs
//! alternate between the scenes, on one thread, and medians are told.

#[path = "lights/tiles.rs"]
mod tiles;

use nephroid::render::{Budget, Control, Estimator, Options, Render};
use nephroid::report::measures::distances_and_noise;
use nephroid::scene::Scene;
use std::path::Path;
use std::time::Instant;

const RUNS: u64 = 15;
const PASSES: u64 = 32;
const REFERENCE_PASSES: u64 = 4096;

fn load(xml: &str) -> Scene {
    nephroid::load_str(xml, Path::new("."), &Default::default()).unwrap_or_else(|e| panic!("{e}")).scene
}

/// What a run took and gave.
#[derive(Clone, Copy, Default)]
struct Run {
    /// Pilot, s.
    start: f64,
    /// Passes, s.
    passes: f64,
    error: f64,
}

fn run(scene: &Scene, estimator: Estimator, seed: u64, reference: (&[[f32; 3]], &[[f32; 3]])) -> Run {
    let mut options = Options { threads: Some(1), ..Options::for_scene(scene, estimator) };
    options.settings.seed = seed;
    let began = Instant::now();
    let mut render = Render::new(scene, &options).expect("a scene of ours");
    let start = began.elapsed().as_secs_f64();
    let began = Instant::now();
    render.run_passes(0..PASSES);
    let passes = began.elapsed().as_secs_f64();
    let (d, noise) = distances_and_noise(&render.picture().mean, reference.0, Some(reference.1));
    Run { start, passes, error: d.relmse_trimmed - noise.relmse_trimmed }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn main() {
    if !std::env::args().any(|a| a == "--bench") {
        return;
    }
    let began = Instant::now();
    let few = load(&tiles::panels());
    let (few_loaded, began) = (began.elapsed(), Instant::now());
    let many = load(&tiles::tiles());
    println!("loaded: 10 lights in {few_loaded:.1?}, 10 000 in {:.1?}", began.elapsed());
    let options = Options::for_scene(&few, Estimator::Bidirectional);
    let mut render = Render::new(&few, &options).expect("a scene of ours");
    render.run(&Budget::passes(REFERENCE_PASSES), |_| Control::Continue);
    let reference = render.picture();
    println!("{:<14} {:>7} {:>10} {:>10} {:>12} {:>12}", "estimator", "lights", "pilot", "pass", "relMSE", "times time");
    for estimator in [Estimator::Gather, Estimator::Bidirectional] {
        let mut runs = [vec![], vec![]];
        for seed in 0..RUNS {
            for (scene, runs) in [&few, &many].into_iter().zip(&mut runs) {
                runs.push(run(scene, estimator, seed + 1, (&reference.mean, &reference.variance)));
            }
        }
        let products = [("10", &runs[0]), ("10 000", &runs[1])].map(|(lights, runs)| {
            let of = |f: fn(&Run) -> f64| median(runs.iter().map(f).collect());
            let product = of(|r| r.error * r.passes);
            println!(
                "{:<14} {lights:>7} {:>7.1} ms {:>7.2} ms {:>12.3e} {product:>12.3e}",
                estimator.name(),
                1e3 * of(|r| r.start),
                1e3 * of(|r| r.passes) / PASSES as f64,
                of(|r| r.error),
            );
            product
        });
        println!("{:<14} time to equal error grows {:.2} times", estimator.name(), products[1] / products[0]);
    }
}
