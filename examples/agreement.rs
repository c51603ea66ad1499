//! Do gathering, shooting and both together measure the same? Welch's test per block of 16 × 16 pixels
//! over independent renders of a scene file, on the classes of paths that both sides can see.
//! `cargo run --release --example agreement -- SCENE.xml [RENDERS] [PASSES] [SEED] [NAME=VALUE ...]`
//! More passes per render make the draws more nearly normal, which the test assumes.

use nephroid::io::mitsuba::LoadOptions;
use nephroid::render::{Estimator, Options, Render};
use nephroid::report::agreement::{BlockSeries, agreement};
use nephroid::scene::Scene;
use nephroid::transport::class::PathFilter;
use std::error::Error;
use std::path::Path;

const BLOCK: u32 = 16;

/// Block means of independent renders: each is a range of passes of its own.
fn series(
    scene: &Scene,
    estimator: Estimator,
    paths: &str,
    (renders, passes, seed): (u64, u64, u64),
) -> Result<BlockSeries, Box<dyn Error>> {
    let mut options = Options::for_scene(scene, estimator);
    options.settings.paths = PathFilter::parse(paths)?;
    options.settings.seed = seed;
    let mut render = Render::new(scene, &options)?;
    let (width, height) = (render.film().width(), render.film().height());
    let (columns, rows) = (width.div_ceil(BLOCK) as usize, height.div_ceil(BLOCK) as usize);
    let mut before = vec![0.0; columns * rows];
    let mut draws = Vec::new();
    for r in 0..renders {
        render.run_passes(r * passes..(r + 1) * passes);
        let film = render.film();
        let mut sums = vec![0.0; columns * rows];
        for y in 0..height {
            for x in 0..width {
                let rgb = film.sum(x, y).to_f64(film.exponent());
                sums[(y / BLOCK) as usize * columns + (x / BLOCK) as usize] += rgb.iter().sum::<f64>();
            }
        }
        draws.push(sums.iter().zip(&before).map(|(s, b)| (s - b) / passes as f64).collect());
        before = sums;
    }
    Ok(BlockSeries { columns, rows, draws, ..BlockSeries::default() })
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let scene = arguments.first().ok_or("usage: agreement SCENE.xml [RENDERS] [PASSES] [SEED] [NAME=VALUE ...]")?;
    let number = |i: usize, default| arguments.get(i).map_or(Ok(default), |n| n.parse::<u64>());
    let (renders, passes, seed) = (number(1, 40)?, number(2, 2)?, number(3, 1)?);
    let defines = arguments.iter().filter_map(|a| a.split_once('=')).map(|(n, v)| (n.to_owned(), v.to_owned())).collect();
    let options = LoadOptions { defines, sandbox: None };
    let scene = nephroid::load(Path::new(scene), &options)?.scene;
    use Estimator::{Bidirectional, Gather, Shoot};
    let mut agree = true;
    for (i, (a, b, paths)) in [
        (Gather, Shoot, "visible-to:gather,shoot"),
        (Gather, Bidirectional, "visible-to:gather"),
        (Shoot, Bidirectional, "visible-to:shoot"),
    ]
    .into_iter()
    .enumerate()
    {
        let seeds = seed * 100 + 2 * i as u64;
        let (sa, sb) =
            (series(&scene, a, paths, (renders, passes, seeds))?, series(&scene, b, paths, (renders, passes, seeds + 1))?);
        let v = agreement(&sa, &sb);
        agree &= v.p > 1e-4;
        println!(
            "{:13} and {:13} on {paths:24} p = {:8.2e} over {:4} blocks, {:5.1} % of the energy tested, totals {:.4} and {:.4}",
            a.name(),
            b.name(),
            v.p,
            v.tests.len(),
            100.0 * v.energy_tested,
            v.totals.0,
            v.totals.1
        );
    }
    println!("{}", if agree { "they agree" } else { "THEY DISAGREE" });
    Ok(())
}
