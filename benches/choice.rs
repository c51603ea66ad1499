//! What `auto` chooses against the best fixed set of joins, found by trying all of them at equal time.
//!
//! `cargo bench --bench choice -- [--time SECONDS] SCENE.xml ...`, each with the reference that `nephroid bench` keeps
//! beside it. Every set of joins with every number of light paths is rendered for the time (pilot included), the better
//! third again with a second and a third seed, then the best three beside `auto`, interleaved, with ten fresh seeds.
//! Errors are trimmed relMSE, the noise of the reference subtracted; ratios are of geometric means.

use nephroid::bench::{Subject, reference};
use nephroid::io::write::read_image;
use nephroid::render::{Budget, Control, Estimator, Options, Render};
use nephroid::report::Picture;
use nephroid::report::measures::distances_and_noise;
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
/// Of Student's distribution with nine degrees of freedom, one-sided 97.5 %.
const T: f64 = 2.262;

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
    fn error(&self, mut options: Options, seed: u64) -> f64 {
        options.settings.seed = seed;
        let began = Instant::now();
        let mut render = Render::new(self.scene, &options).expect("a scene that loads");
        render.run(&Budget::time(self.time.saturating_sub(began.elapsed())), |_| Control::Continue);
        let (d, noise) = distances_and_noise(&render.picture().mean, &self.reference.mean, self.reference.variance.as_deref());
        (d.relmse_trimmed - noise.relmse_trimmed).max(1e-9)
    }

    /// The sets with the lowest errors over seeds, the best first.
    fn best(&self) -> Vec<Fixed> {
        let mut sums: Vec<(f64, Fixed)> = Fixed::all().into_iter().map(|f| (0.0, f)).collect();
        for (seed, kept) in [(1, SECOND), (2, SECOND), (3, LAST)] {
            for (sum, fixed) in &mut sums {
                *sum += self.error(fixed.options(self.scene), seed).ln();
            }
            sums.sort_by(|a, b| a.0.total_cmp(&b.0));
            sums.truncate(kept);
        }
        sums.into_iter().map(|(_, f)| f).collect()
    }

    /// Logarithms of error ratios of `auto` to each of `fixed`, for fresh seeds.
    fn ratios(&self, fixed: &[Fixed]) -> Vec<Vec<f64>> {
        let mut ratios = vec![vec![]; fixed.len()];
        for seed in 1001..1001 + FRESH {
            let auto = self.error(Options::for_scene(self.scene, Estimator::Auto), seed);
            for (ratios, f) in ratios.iter_mut().zip(fixed) {
                ratios.push((auto / self.error(f.options(self.scene), seed)).ln());
            }
        }
        ratios
    }
}

/// Mean, and the half width of its 95 % interval.
fn interval(logarithms: &[f64]) -> (f64, f64) {
    let n = logarithms.len() as f64;
    let mean = logarithms.iter().sum::<f64>() / n;
    let variance = logarithms.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, T * (variance / n).sqrt())
}

fn trial(path: &Path, time: Duration) -> Result<f64, String> {
    let scene = nephroid::load(path, &Default::default()).map_err(|e| e.to_string())?.scene;
    let kept = reference::place(&Subject { name: String::new(), path, scene: &scene });
    let file =
        read_image(&kept).map_err(|e| format!("{e}\nmake a reference first: nephroid bench {} -o report", path.display()))?;
    let reference = Picture::of_file(&file).ok_or_else(|| format!("{}: not a picture", kept.display()))?;
    let trial = Trial { scene: &scene, reference, time };
    println!("{}, {time:?}", path.display());
    let best = trial.best();
    let ratios: Vec<(f64, f64)> = trial.ratios(&best).iter().map(|r| interval(r)).collect();
    for (fixed, (mean, half)) in best.iter().zip(&ratios) {
        println!("  auto / {}: {:.2} ({:.2} to {:.2})", fixed.name(), mean.exp(), (mean - half).exp(), (mean + half).exp());
    }
    // Of the best, which fresh seeds decide.
    Ok(ratios.iter().map(|r| r.0).fold(f64::NEG_INFINITY, f64::max))
}

fn main() {
    let mut time = Duration::from_secs(20);
    let mut ratios = vec![];
    let mut arguments = std::env::args().skip(1).filter(|a| a != "--bench");
    while let Some(argument) = arguments.next() {
        if argument == "--time" {
            let seconds = arguments.next().and_then(|t| t.parse().ok()).filter(|t| *t > 0.0 && *t < 1e6);
            time = Duration::from_secs_f64(seconds.expect("--time takes seconds"));
            continue;
        }
        match trial(Path::new(&argument), time) {
            Ok(ratio) => ratios.push(ratio),
            Err(e) => eprintln!("{e}"),
        }
    }
    if !ratios.is_empty() {
        let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
        println!("geometric mean of {} scenes: {:.2}", ratios.len(), mean.exp());
    }
}
