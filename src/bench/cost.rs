//! What coupling costs, as the theory orders it: none (local), some (recursive), all (global).
//!
//! The same few samples of each; time, error and what is missing stand side by side.

use super::contender::{Contender, Stop, Walker};
use super::effort::{Effort, Mark, Marks};
use super::race::{figures, run_seed};
use super::ratios::Measure;
use super::reference::Reference;
use super::statistics::{Interval, mean};
use crate::render::Estimator;
use crate::scene::Scene;
use serde::Serialize;

/// Estimators by how much of the coupling they follow.
const ORDER: [(&str, Estimator); 3] =
    [("local", Estimator::Local), ("recursive", Estimator::Recursive), ("global", Estimator::Bidirectional)];

/// Share of a whole run that these take.
const SHARE: u32 = 4;

/// One of them.
#[derive(Clone, Debug, Serialize)]
pub struct Cost {
    /// How much of the coupling.
    pub coupling: &'static str,
    /// Who follows it.
    pub estimator: &'static str,
    /// Seconds for a sample of every pixel.
    pub seconds: Option<Interval>,
    /// relMSE at the end, without what the reference adds where it is known to be more than that.
    pub relmse: Option<Interval>,
    /// Samples per pixel at the end, on average.
    pub samples: f64,
    /// Share of the light that is missing.
    pub missing: Option<Interval>,
}

/// All three; fewer where `stop` said so. An estimator that refuses the scene is left out.
pub fn cost(scene: &Scene, reference: &Reference, effort: &Effort, stop: Stop<'_>) -> Vec<Cost> {
    let end = match &effort.marks {
        Marks::Time(t) => t.iter().max().map(|t| Mark::Time(*t / SHARE / effort.runs)),
        Marks::Samples(n) => n.iter().max().map(|n| Mark::Samples((n / u64::from(SHARE)).max(2))),
    };
    let Some(end) = end else { return Vec::new() };
    let of = |(k, (coupling, estimator)): (usize, (&'static str, Estimator))| {
        let mut walker = Walker::new(scene, estimator);
        // Numbers of contenders that no race has.
        let seed = |run: u32| run_seed(effort.seed, usize::MAX - k, run);
        let runs = (0..effort.runs)
            .map(|r| walker.run(seed(r), &[end], stop).ok().flatten().map(|done| figures(seed(r), &done, reference)));
        let runs = runs.collect::<Option<Vec<_>>>()?;
        let over = |f: &dyn Fn(&super::figures::RunFigures) -> f64| mean(&runs.iter().map(f).collect::<Vec<_>>());
        Some(Cost {
            coupling,
            estimator: estimator.name(),
            seconds: over(&|r| r.seconds / r.samples as f64),
            relmse: over(&|r| r.curve.last().map_or(f64::NAN, |p| p.error(Measure::Relmse).unwrap_or(p.relmse))),
            samples: runs.iter().map(|r| r.samples as f64).sum::<f64>() / runs.len() as f64,
            missing: over(&|r| 1.0 - r.energy),
        })
    };
    ORDER.into_iter().enumerate().filter_map(of).collect()
}
