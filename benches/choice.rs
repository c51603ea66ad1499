//! What `auto` chooses against the best fixed set of joins, found by trying all of them at equal time.
//!
//! `cargo bench --bench choice -- [--time SECONDS] [--scale FACTOR] SCENE.xml ...`; sides of the pictures are so many times those
//! of the scene (with half of them and a quarter of the time, the samples are as many, and what `auto` learns from costs it more).
//! Every set of joins with every number of light paths is
//! rendered for the time (pilot included), the better third again with a second and a third seed, then the best three
//! beside `auto`, interleaved, with ten fresh seeds. Errors are trimmed relMSE against the reference that `nephroid bench`
//! makes and keeps beside the scene, its noise subtracted; ratios are of geometric means.

use nephroid::bench::Subject;
use nephroid::bench::effort::{Effort, Marks};
use nephroid::bench::reference::reference;
use nephroid::bench::statistics::{Interval, geometric_mean, ratio};
use nephroid::cli::open::resize;
use nephroid::render::{Budget, Control, Estimator, Options, Render};
use nephroid::report::Picture;
use nephroid::report::measures::{distances_and_noise, own};
use nephroid::scene::Scene;
use nephroid::transport::settings::Techniques;
use std::path::Path;
use std::time::{Duration, Instant};

/// Light paths per pixel.
const LIGHT_PATHS: [f64; 5] = [0.25, 0.5, 1.0, 2.0, 4.0];
/// Sets that go on after the first seed, and after the third.
const SECOND: usize = 14;
const LAST: usize = 3;
const FRESH: u64 = 10;
/// Never reached, so that references of scenes which render fast are as long as those of others.
const LEAST_REFERENCE_ERROR: f64 = 1e-3;
/// A reference may take as long as so many runs.
const REFERENCE_RUNS: u32 = 12;

/// A fixed set of joins.
#[derive(Clone, Copy, PartialEq)]
struct Fixed {
    techniques: Techniques,
    /// Per pixel.
    light_paths: f64,
}

impl Fixed {
    fn all() -> Vec<Self> {
        let mut all = vec![Self { techniques: Techniques::GATHER, light_paths: 0.0 }];
        for light_paths in LIGHT_PATHS {
            for bits in 0..8 {
                let on = |bit: u32| bits >> bit & 1 == 1;
                let techniques = Techniques { hit: true, splat: true, next_event: on(0), connect: on(1), merge: on(2) };
                all.push(Self { techniques, light_paths });
            }
        }
        all
    }

    fn options(self, scene: &Scene) -> Options {
        let mut options = Options::for_scene(scene, Estimator::Bidirectional);
        let film = &scene.film;
        let [_, _, width, height] = film.crop.unwrap_or([0, 0, film.width, film.height]);
        options.settings.techniques = self.techniques;
        options.settings.light_paths =
            (self.light_paths > 0.0).then_some((self.light_paths * f64::from(width) * f64::from(height)) as u32);
        options
    }

    fn name(self) -> String {
        format!("{} with {} light paths a pixel", self.techniques.names(), self.light_paths)
    }
}

/// A scene and what its pictures are measured against.
struct Trial<'a> {
    scene: &'a Scene,
    reference: Picture,
    time: Duration,
}

impl Trial<'_> {
    /// `None` where the reference is too noisy to tell.
    fn error(&self, mut options: Options, seed: u64) -> Option<f64> {
        options.settings.seed = seed;
        let began = Instant::now();
        let mut render = Render::new(self.scene, &options).expect("a scene that loads");
        render.run(&Budget::time(self.time.saturating_sub(began.elapsed())), |_| Control::Continue);
        let (d, noise) = distances_and_noise(&render.picture().mean, &self.reference.mean, self.reference.variance.as_deref());
        own(d.relmse_trimmed, noise.relmse_trimmed)
    }

    /// The sets with the lowest errors over seeds, the best first.
    fn best(&self) -> Option<Vec<Fixed>> {
        let mut sums: Vec<(f64, Fixed)> = Fixed::all().into_iter().map(|f| (0.0, f)).collect();
        for (seed, kept) in [(1, SECOND), (2, SECOND), (3, LAST)] {
            for (sum, fixed) in &mut sums {
                *sum += self.error(fixed.options(self.scene), seed)?.ln();
            }
            sums.sort_by(|a, b| a.0.total_cmp(&b.0));
            sums.truncate(kept);
        }
        Some(sums.into_iter().map(|(_, f)| f).collect())
    }

    /// Error of `auto` over that of each of `fixed`, with fresh seeds.
    fn ratios(&self, fixed: &[Fixed]) -> Option<Vec<Interval>> {
        let (mut auto, mut others) = (vec![], vec![vec![]; fixed.len()]);
        for seed in 1001..1001 + FRESH {
            auto.push(self.error(Options::for_scene(self.scene, Estimator::Auto), seed)?);
            for (errors, f) in others.iter_mut().zip(fixed) {
                errors.push(self.error(f.options(self.scene), seed)?);
            }
        }
        others.iter().map(|errors| ratio(&auto, errors)).collect()
    }
}

fn trial(path: &Path, time: Duration, scale: f64) -> Result<f64, String> {
    let mut read = nephroid::io::mitsuba::load(path, &Default::default()).map_err(|e| e.to_string())?;
    if let Some(sensor) = read.scene.sensors.first_mut() {
        let side = |n: u32| ((f64::from(n) * scale).round() as u32).max(1);
        let size = [sensor.film.width, sensor.film.height].map(side);
        resize(&mut sensor.film, size);
    }
    let scene = nephroid::finish(read).map_err(|e| e.to_string())?.scene;
    let subject = Subject { name: String::new(), path, scene: &scene };
    let effort = Effort {
        marks: Marks::Time(vec![time]),
        runs: 1,
        seed: 0,
        reference_error: LEAST_REFERENCE_ERROR,
        reference_time: REFERENCE_RUNS * time,
    };
    let found = reference(&subject, None, &effort, &|| false)?.ok_or("no reference")?;
    println!("{}, {time:?}, reference {}", path.display(), found.origin);
    let trial = Trial { scene: &scene, reference: found.picture, time };
    let noisy = || format!("{}: the error is mostly that of the reference", path.display());
    let best = trial.best().ok_or_else(noisy)?;
    let ratios = trial.ratios(&best).ok_or_else(noisy)?;
    for (fixed, r) in best.iter().zip(&ratios) {
        let [low, high] = r.bounds.unwrap_or_default();
        println!("  auto / {}: {:.2} ({low:.2} to {high:.2})", fixed.name(), r.value);
    }
    // Of the best, which fresh seeds decide.
    Ok(ratios.iter().map(|r| r.value).fold(0.0, f64::max))
}

fn main() {
    let mut time = Duration::from_secs(20);
    let mut scale = 1.0;
    let mut ratios = vec![];
    let mut arguments = std::env::args().skip(1).filter(|a| a != "--bench");
    while let Some(argument) = arguments.next() {
        let mut number = |most: f64| {
            let number = arguments.next().and_then(|t| t.parse().ok()).filter(|t| *t > 0.0 && *t < most);
            number.unwrap_or_else(|| panic!("{argument} takes a number above 0"))
        };
        match argument.as_str() {
            "--time" => time = Duration::from_secs_f64(number(1e6)),
            "--scale" => scale = number(100.0),
            path => match trial(Path::new(path), time, scale) {
                Ok(ratio) => ratios.push(ratio),
                Err(e) => eprintln!("{e}"),
            },
        }
    }
    if let Some(mean) = geometric_mean(&ratios) {
        println!("geometric mean of {} scenes: {:.2}", ratios.len(), mean.value);
    }
}
