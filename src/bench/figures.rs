//! What the runs say: figures of a run, of a contender, of a pair, of a scene, of the whole bench.
//!
//! `variance` is that of the image at the end, relative as in relMSE; `efficiency = 1 / (variance · seconds)`
//! does not depend on when a run ends. Errors are given as measured; where two contenders are compared, what the
//! noise of the reference is expected to add is taken off first, and an error that is mostly that (less
//! than twice of it) is said to be below the noise of the reference.

use super::cost::Cost;
use super::effort::{Effort, Mark};
use super::layers::Layers;
use super::race::Entry;
use super::ratios::{Measure, Ratio, ratios};
use super::reference::Reference;
use super::statistics::{Interval, geometric_mean, mean};
use super::{Subject, size, verdict};
use crate::report::coverage::{Blind, Coverage};
use crate::report::measures::{Noise, own};
use crate::transport::RayCounts;
use serde::Serialize;

/// A first pass may end so much later than a mark and still count for it.
const OVERSHOOT: f64 = 1.2;

/// Everything.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Report {
    /// Of the program.
    pub version: &'static str,
    /// As it could be typed again.
    pub command: String,
    /// The processor, where the system tells it.
    pub machine: String,
    /// Threads.
    pub threads: usize,
    /// Where runs end, for people.
    pub marks: Vec<String>,
    /// Runs of each contender.
    pub runs: u32,
    /// Scenes in their order.
    pub scenes: Vec<SceneReport>,
    /// Somebody stopped it.
    pub interrupted: bool,
}

/// A scene.
#[derive(Clone, Debug, Default, Serialize)]
pub struct SceneReport {
    /// For people.
    pub name: String,
    /// The file.
    pub path: String,
    /// Content of the scene.
    pub hash: String,
    /// Width and height of the image.
    pub size: [u32; 2],
    /// Why there are no figures.
    pub failure: Option<String>,
    /// What errors are taken from.
    pub reference: Option<ReferenceFigures>,
    /// Who took part.
    pub contenders: Vec<ContenderFigures>,
    /// Every pair, at every mark.
    pub ratios: Vec<Ratio>,
    /// What coupling costs here.
    pub cost: Vec<Cost>,
    /// What estimators cannot make here.
    pub blind: Vec<Blind>,
    /// In words.
    pub verdict: Vec<String>,
}

/// The reference.
#[derive(Clone, Debug, Serialize)]
pub struct ReferenceFigures {
    /// Where it came from.
    pub origin: String,
    /// Relative standard error, where it is known.
    pub error: Option<f64>,
    /// The error that was wanted.
    pub wanted: f64,
    /// Samples per pixel, where they are known.
    pub samples: Option<u64>,
    /// What went wrong with keeping it.
    pub warning: Option<String>,
}

/// A contender on a scene.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ContenderFigures {
    /// As in tables.
    pub name: String,
    /// Not one of ours.
    pub peer: bool,
    /// What has to be known of its figures.
    pub remark: Option<String>,
    /// Why it stopped.
    pub failure: Option<String>,
    /// Each run.
    pub runs: Vec<RunFigures>,
    /// Relative variance of the images at the end, from the runs alone.
    pub variance_between_runs: Option<f64>,
    /// All runs together; nothing without a run.
    pub summary: Option<Summary>,
    /// The estimator of ours that sees the same paths, of a peer.
    pub like: Option<&'static str>,
    /// Who carries what, of one of ours.
    pub layers: Option<Layers>,
}

/// A run.
#[derive(Clone, Debug, Serialize)]
pub struct RunFigures {
    /// Of its random numbers.
    pub seed: u64,
    /// At the end.
    pub seconds: f64,
    /// Per pixel, at the end.
    pub samples: u64,
    /// Where they are counted.
    pub rays: Option<Rays>,
    /// Resident bytes of the process.
    pub memory: Option<u64>,
    /// Relative variance of the image at the end.
    pub variance: Option<f64>,
    /// Exponent of relMSE trimmed over samples.
    pub slope: Option<f64>,
    /// Light of the image over that of the reference.
    pub energy: f64,
    /// Errors on the way.
    pub curve: Vec<Point>,
}

/// Rays by kind.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Rays {
    /// Closest hits of gathering walks.
    pub gather: u64,
    /// Closest hits of shooting walks.
    pub shoot: u64,
    /// Any hits of joins.
    pub shadow: u64,
}

impl From<RayCounts> for Rays {
    fn from(r: RayCounts) -> Self {
        Self { gather: r.gather, shoot: r.shoot, shadow: r.shadow }
    }
}

/// Errors at a checkpoint, as measured.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Point {
    /// Since the start.
    pub seconds: f64,
    /// Per pixel.
    pub samples: u64,
    /// Root mean squared error.
    pub rmse: f64,
    /// Relative mean squared error.
    pub relmse: f64,
    /// The same without the worst 0.1 % of pixels.
    pub relmse_trimmed: f64,
    /// Mean LDR-FLIP error.
    pub flip: f64,
    /// What the reference is expected to have added.
    pub noise: Noise,
}

impl Point {
    /// Powers of the time between two points.
    fn towards(&self, o: &Self, share: f64) -> Self {
        let between = |a: f64, b: f64| if a > 0.0 && b > 0.0 { a * (b / a).powf(share) } else { b };
        Self {
            seconds: between(self.seconds, o.seconds),
            samples: between(self.samples as f64, o.samples as f64).round() as u64,
            rmse: between(self.rmse, o.rmse),
            relmse: between(self.relmse, o.relmse),
            relmse_trimmed: between(self.relmse_trimmed, o.relmse_trimmed),
            flip: between(self.flip, o.flip),
            noise: o.noise,
        }
    }

    /// The image's own error by a measure.
    pub fn error(&self, measure: Measure) -> Option<f64> {
        match measure {
            Measure::Relmse => own(self.relmse, self.noise.relmse),
            Measure::RelmseTrimmed => own(self.relmse_trimmed, self.noise.relmse_trimmed),
            Measure::Rmse => own(self.rmse * self.rmse, self.noise.mse).map(f64::sqrt),
            Measure::Flip => Some(self.flip),
            Measure::Cost => None,
        }
    }
}

impl RunFigures {
    /// One line for people.
    pub fn summary(&self) -> String {
        let error = self.curve.last().map_or(f64::NAN, |p| p.relmse);
        format!("relMSE {error:.3e} after {} samples per pixel in {:.2} s", self.samples, self.seconds)
    }

    /// At a mark: between the checkpoints on both sides of it as if errors were powers of the time, since a
    /// run goes on to the end of a pass; the last one where the run is shorter; none where the first pass ended
    /// long after the mark.
    pub fn at(&self, mark: Mark) -> Option<Point> {
        let place = |p: &Point| mark.of(p.seconds, p.samples);
        let Some(next) = self.curve.iter().position(|p| place(p) >= mark.amount()) else { return self.curve.last().copied() };
        let after = self.curve[next];
        let Some(before) = next.checked_sub(1).map(|i| self.curve[i]) else {
            return Some(after).filter(|p| place(p) <= OVERSHOOT * mark.amount());
        };
        let share = (mark.amount() / place(&before)).ln() / (place(&after) / place(&before)).ln();
        Some(before.towards(&after, share))
    }

    /// By a measure at a mark.
    pub fn error(&self, measure: Measure, mark: Mark) -> Option<f64> {
        match measure {
            Measure::Cost => self.variance.map(|v| v * self.seconds),
            _ => self.at(mark)?.error(measure),
        }
    }
}

/// All runs of a contender.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Mean seconds at the end.
    pub seconds: f64,
    /// Mean samples per pixel at the end.
    pub samples: f64,
    /// Samples per pixel and second.
    pub rate: Option<Interval>,
    /// Errors at each mark.
    pub errors: Vec<Errors>,
    /// Relative variance of the image at the end.
    pub variance: Option<Interval>,
    /// 1 / (variance · seconds).
    pub efficiency: Option<Interval>,
    /// Exponent of relMSE trimmed over samples; −1 for an estimate without bias.
    pub slope: Option<Interval>,
    /// Light over that of the reference; the interval holds the reference's own uncertainty.
    pub energy: Option<Interval>,
    /// Largest resident memory.
    pub memory: Option<u64>,
}

/// Errors at a mark: means over runs, as measured.
#[derive(Clone, Debug, Serialize)]
pub struct Errors {
    /// For people.
    pub mark: String,
    /// Root mean squared error.
    pub rmse: Option<Interval>,
    /// Relative mean squared error.
    pub relmse: Option<Interval>,
    /// The same without the worst 0.1 % of pixels.
    pub relmse_trimmed: Option<Interval>,
    /// Mean LDR-FLIP error.
    pub flip: Option<Interval>,
    /// The relMSE of some run is less than twice what the reference adds to it.
    pub below_reference: bool,
}

impl Report {
    /// Some scene or contender did not get to its end.
    pub fn failed(&self) -> bool {
        self.scenes.iter().any(|s| s.failure.is_some() || s.contenders.iter().any(|c| c.failure.is_some()))
    }
}

impl SceneReport {
    /// A scene that could not be run.
    pub fn failed(name: String, path: String, reason: String) -> Self {
        Self { name, path, failure: Some(reason), ..Self::default() }
    }

    /// From the runs.
    pub fn new(subject: &Subject<'_>, reference: &Reference, effort: &Effort, entries: &[Entry]) -> Self {
        let marks = effort.marks();
        let uncertainty = energy_uncertainty(reference);
        let mut contenders: Vec<ContenderFigures> = entries.iter().map(|e| e.figures.clone()).collect();
        for c in &mut contenders {
            c.summary = (!c.runs.is_empty()).then(|| summary(&c.runs, &marks, uncertainty));
        }
        let coverage = Coverage::of(subject.scene);
        let mut out = Self {
            name: subject.name.clone(),
            path: subject.path.display().to_string(),
            hash: subject.scene.hash_hex(),
            size: size(subject.scene),
            failure: None,
            reference: Some(ReferenceFigures {
                origin: reference.origin.clone(),
                error: reference.error,
                wanted: effort.reference_error,
                samples: reference.picture.samples,
                warning: reference.warning.clone(),
            }),
            ratios: ratios(&contenders, &marks),
            contenders,
            cost: Vec::new(),
            blind: coverage.blind,
            verdict: Vec::new(),
        };
        out.verdict = verdict::verdict(&out);
        out
    }
}

fn summary(runs: &[RunFigures], marks: &[Mark], uncertainty: f64) -> Summary {
    let n = runs.len() as f64;
    let over = |f: &dyn Fn(&RunFigures) -> Option<f64>| runs.iter().map(f).collect::<Option<Vec<f64>>>();
    let energy = over(&|r| Some(r.energy)).and_then(|e| mean(&e)).map(|e| Interval {
        bounds: e.half().map(|h| {
            let half = h.hypot(1.96 * uncertainty * e.value);
            [e.value - half, e.value + half]
        }),
        ..e
    });
    Summary {
        seconds: runs.iter().map(|r| r.seconds).sum::<f64>() / n,
        samples: runs.iter().map(|r| r.samples as f64).sum::<f64>() / n,
        rate: over(&|r| Some(r.samples as f64 / r.seconds)).and_then(|v| mean(&v)),
        errors: marks.iter().map(|m| errors(runs, *m)).collect(),
        variance: over(&|r| r.variance).and_then(|v| mean(&v)),
        efficiency: over(&|r| r.variance.map(|v| 1.0 / (v * r.seconds))).and_then(|v| geometric_mean(&v)),
        slope: over(&|r| r.slope).and_then(|v| mean(&v)),
        energy,
        memory: runs.iter().filter_map(|r| r.memory).max(),
    }
}

fn errors(runs: &[RunFigures], mark: Mark) -> Errors {
    let points: Vec<Point> = runs.iter().filter_map(|r| r.at(mark)).collect();
    let over = |f: &dyn Fn(&Point) -> f64| mean(&points.iter().map(f).collect::<Vec<_>>());
    Errors {
        mark: mark.text(),
        rmse: over(&|p| p.rmse),
        relmse: over(&|p| p.relmse),
        relmse_trimmed: over(&|p| p.relmse_trimmed),
        flip: over(&|p| p.flip),
        below_reference: points.iter().any(|p| p.error(Measure::Relmse).is_none()),
    }
}

/// Relative standard error of the light of the whole reference; 0 where its variance is not known.
fn energy_uncertainty(reference: &Reference) -> f64 {
    let p = &reference.picture;
    let Some(of_blocks) = &p.block_variance else { return 0.0 };
    // A block of 16 × 16 pixels is independent of others, its variance is that of its mean.
    let side = crate::report::welch::BLOCK;
    let mut variance = 0.0;
    for y in (0..p.height).step_by(side as usize) {
        for x in (0..p.width).step_by(side as usize) {
            let pixels = f64::from((p.width - x).min(side)) * f64::from((p.height - y).min(side));
            let v = of_blocks[y as usize * p.width as usize + x as usize];
            // Channels are taken as moving together.
            let deviation: f64 = v.iter().map(|v| f64::from(*v).max(0.0).sqrt()).sum::<f64>() * pixels;
            variance += if deviation.is_finite() { deviation * deviation } else { 0.0 };
        }
    }
    let sum: f64 = p.mean.iter().flatten().filter(|v| v.is_finite()).map(|v| f64::from(*v)).sum();
    if sum > 0.0 { variance.sqrt() / sum } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn errors_at_a_mark_lie_between_checkpoints() {
        let point = |seconds: f64, relmse: f64| Point {
            seconds,
            samples: seconds as u64,
            rmse: relmse.sqrt(),
            relmse,
            relmse_trimmed: relmse,
            flip: relmse,
            noise: Noise::default(),
        };
        let run = |curve| RunFigures {
            seed: 0,
            seconds: 8.0,
            samples: 8,
            rays: None,
            memory: None,
            variance: None,
            slope: None,
            energy: 1.0,
            curve,
        };
        let at = |curve: &[Point], seconds| run(curve.to_vec()).at(Mark::Time(Duration::from_secs(seconds))).map(|p| p.relmse);
        let curve = [point(2.0, 0.4), point(8.0, 0.1)];
        assert!((at(&curve, 4).unwrap() - 0.2).abs() < 1e-12);
        assert_eq!((at(&curve, 8), at(&curve, 20)), (Some(0.1), Some(0.1)));
        // A pass of 12 seconds says nothing of the fourth, one of 4.2 nearly all.
        assert_eq!(at(&[point(12.0, 0.1)], 4), None);
        assert_eq!(at(&[point(4.2, 0.3)], 4), Some(0.3));
    }
}
