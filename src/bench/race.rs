//! The runs of one scene, interleaved: A B C A B C …

use super::contender::{Contender, Run, Stop};
use super::effort::Effort;
use super::figures::{ContenderFigures, Point, RunFigures};
use super::reference::Reference;
use super::statistics::{Images, slope};
use crate::report::flip::{Range, flip};
use crate::report::measures::{distances_and_noise, own, relative_variance};

/// A contender with what it did.
pub struct Entry {
    /// All figures.
    pub figures: ContenderFigures,
    /// The result of its first run.
    pub image: Vec<[f32; 3]>,
}

/// Seed of a run: different for every run of every contender.
pub fn run_seed(seed: u64, contender: usize, run: u32) -> u64 {
    let mut h = blake3::Hasher::new();
    h.update(b"bench run");
    h.update(&seed.to_le_bytes());
    h.update(&(contender as u64).to_le_bytes());
    h.update(&run.to_le_bytes());
    let bytes = h.finalize();
    u64::from_le_bytes(std::array::from_fn(|i| bytes.as_bytes()[i]))
}

/// Runs all contenders; `tell` hears of every run that ended. What was done before `stop` is kept.
pub fn race(
    contenders: &mut [Box<dyn Contender + '_>],
    reference: &Reference,
    effort: &Effort,
    stop: Stop<'_>,
    tell: &mut dyn FnMut(&str),
) -> Vec<Entry> {
    let checkpoints = effort.checkpoints();
    let mut entries: Vec<Entry> = contenders.iter().map(|c| Entry::new(c.as_ref())).collect();
    let mut images: Vec<Images> = vec![Images::default(); contenders.len()];
    for run in 0..effort.runs {
        for (i, contender) in contenders.iter_mut().enumerate() {
            let entry = &mut entries[i];
            if entry.figures.failure.is_some() || stop() {
                continue;
            }
            let seed = run_seed(effort.seed, i, run);
            match contender.run(seed, &checkpoints, stop) {
                Ok(Some(done)) => {
                    let figures = figures(seed, &done, reference);
                    tell(&format!("run {} of {}, {}: {}", run + 1, effort.runs, entry.figures.name, figures.summary()));
                    if let Some(last) = done.snapshots.into_iter().next_back() {
                        images[i].add(&last.image);
                        if entry.image.is_empty() {
                            entry.image = last.image;
                        }
                    }
                    entry.figures.runs.push(figures);
                }
                Ok(None) => {}
                Err(reason) => {
                    tell(&format!("{}: {reason}", entry.figures.name));
                    entry.figures.failure = Some(reason);
                }
            }
        }
    }
    for (entry, contender) in entries.iter_mut().zip(contenders.iter_mut()) {
        if !entry.figures.runs.is_empty() && !stop() {
            entry.figures.layers = contender.layers(reference, &effort.of_layers(), stop);
        }
    }
    for (entry, images) in entries.iter_mut().zip(&images) {
        // Who does not know its variance has that of its runs.
        let of_runs = images.variance().map(|v| relative_variance(&v, &reference.picture.mean));
        entry.figures.variance_between_runs = of_runs;
        for run in &mut entry.figures.runs {
            run.variance = run.variance.or(of_runs);
        }
    }
    entries
}

impl Entry {
    fn new(contender: &dyn Contender) -> Self {
        let figures = ContenderFigures {
            name: contender.name(),
            peer: contender.is_peer(),
            remark: contender.remark(),
            like: contender.like(),
            ..ContenderFigures::default()
        };
        Self { figures, image: Vec::new() }
    }
}

/// What a run says.
pub fn figures(seed: u64, run: &Run, reference: &Reference) -> RunFigures {
    let curve: Vec<Point> = run.snapshots.iter().map(|s| point(s.seconds, s.samples, &s.image, reference)).collect();
    let errors: Vec<_> = curve.iter().map(|p| (p.samples as f64, own(p.relmse_trimmed, p.noise.relmse_trimmed))).collect();
    let errors: Vec<_> = errors.into_iter().filter_map(|(n, e)| e.map(|e| (n, e))).collect();
    let variance = run.variance.as_ref().map(|v| relative_variance(v, &reference.picture.mean));
    RunFigures {
        seed,
        seconds: curve.last().map_or(0.0, |p| p.seconds),
        samples: curve.last().map_or(0, |p| p.samples),
        rays: run.rays.map(Into::into),
        memory: run.memory,
        variance,
        slope: slope(&errors),
        energy: run.snapshots.last().map_or(f64::NAN, |s| energy(&s.image, reference)),
        curve,
    }
}

fn point(seconds: f64, samples: u64, image: &[[f32; 3]], reference: &Reference) -> Point {
    let picture = &reference.picture;
    let (d, noise) = distances_and_noise(image, &picture.mean, picture.variance.as_deref());
    let map = flip(image, &picture.mean, picture.width as usize, Range::Ldr);
    let flip = map.iter().map(|e| f64::from(*e)).sum::<f64>() / map.len().max(1) as f64;
    Point { seconds, samples, rmse: d.rmse, relmse: d.relmse, relmse_trimmed: d.relmse_trimmed, flip, noise }
}

/// Light of an image over that of the reference.
fn energy(image: &[[f32; 3]], reference: &Reference) -> f64 {
    let sum = |pixels: &[[f32; 3]]| pixels.iter().flatten().filter(|v| v.is_finite()).map(|v| f64::from(*v)).sum::<f64>();
    sum(image) / sum(&reference.picture.mean)
}
