//! Who takes part: something that renders a scene with a seed, and shows its image on the way.

use super::effort::Mark;
use super::layers::{Layers, layers};
use super::reference::Reference;
use crate::render::{Budget, Control, Estimator, Options, Outcome, Progress, Render};
use crate::report::{Picture, memory};
use crate::scene::Scene;
use crate::transport::RayCounts;
use crate::transport::settings::Coupling;
use std::time::{Duration, Instant};

/// An image on the way.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// Time so far, pilot included; without the time that taking images took.
    pub seconds: f64,
    /// Samples per pixel so far.
    pub samples: u64,
    /// Linear sRGB, rows from the top.
    pub image: Vec<[f32; 3]>,
}

/// What one run leaves.
#[derive(Clone, Debug, Default)]
pub struct Run {
    /// At every checkpoint; the last is the result.
    pub snapshots: Vec<Snapshot>,
    /// Variance of the pixels of the result, where the contender knows it.
    pub variance: Option<Vec<[f32; 3]>>,
    /// Rays, where they are counted.
    pub rays: Option<RayCounts>,
    /// Resident memory of the process at the end, in bytes.
    pub memory: Option<u64>,
}

/// Asked now and then whether to end.
pub type Stop<'a> = &'a (dyn Fn() -> bool + Sync);

/// Renders a scene.
pub trait Contender {
    /// As in tables.
    fn name(&self) -> String;

    /// Whether it is one of ours.
    fn is_peer(&self) -> bool {
        false
    }

    /// What has to be known of its figures, as a sentence.
    fn remark(&self) -> Option<String> {
        None
    }

    /// The estimator of ours that sees the same paths, where this is not one of ours.
    fn like(&self) -> Option<&'static str> {
        None
    }

    /// Who carries what, found out within a budget; nothing where that is not known.
    fn layers(&mut self, _: &Reference, _: &Budget, _: Stop<'_>) -> Option<Layers> {
        None
    }

    /// Renders until the last checkpoint; `Ok(None)` where `stop` said so before. An error is a sentence.
    fn run(&mut self, seed: u64, checkpoints: &[Mark], stop: Stop<'_>) -> Result<Option<Run>, String>;
}

/// One of our own estimators on a scene.
pub struct Walker<'a> {
    name: String,
    scene: &'a Scene,
    options: Options,
}

impl<'a> Walker<'a> {
    /// With the settings that the scene asks for.
    pub fn new(scene: &'a Scene, estimator: Estimator) -> Self {
        Self::with(estimator.name().into(), scene, Options::for_scene(scene, estimator))
    }

    /// With any settings.
    pub fn with(name: String, scene: &'a Scene, options: Options) -> Self {
        Self { name, scene, options }
    }
}

impl Contender for Walker<'_> {
    fn name(&self) -> String {
        self.name.clone()
    }

    fn layers(&mut self, reference: &Reference, budget: &Budget, stop: Stop<'_>) -> Option<Layers> {
        // Recursion has no joins to tell apart.
        let walks = self.options.settings.coupling == Coupling::All;
        walks.then(|| layers(self.scene, &self.options, reference, budget, stop)).flatten()
    }

    fn run(&mut self, seed: u64, checkpoints: &[Mark], stop: Stop<'_>) -> Result<Option<Run>, String> {
        let mut clock = Clock::start();
        self.options.settings.seed = seed;
        let mut render = Render::new(self.scene, &self.options).map_err(|e| e.to_string())?;
        let mut run = Run::default();
        for mark in checkpoints {
            let passes = render.statistics().passes;
            let budget = match mark {
                Mark::Time(t) if passes == 0 || clock.elapsed() < *t => Budget::time(t.saturating_sub(clock.elapsed())),
                Mark::Samples(n) if passes < *n => Budget::passes(*n),
                // A pass was longer than the time between two checkpoints.
                _ => continue,
            };
            let control = |_: &Progress| if stop() { Control::Stop } else { Control::Continue };
            if render.run(&budget, control) == Outcome::Stopped {
                return Ok(None);
            }
            let samples = render.statistics().passes;
            if samples == passes {
                // What was left of the time is too short for another pass.
                continue;
            }
            clock.pause(|seconds| {
                run.snapshots.push(Snapshot { seconds, samples, image: render.film().mean() });
            });
        }
        run.variance = Picture::of_film(render.film()).variance;
        run.rays = Some(render.statistics().rays);
        run.memory = memory::resident();
        Ok(Some(run))
    }
}

/// Somebody who cannot take part, and why.
pub struct Absent {
    /// As in tables.
    pub name: String,
    /// A sentence.
    pub reason: String,
}

impl Contender for Absent {
    fn name(&self) -> String {
        self.name.clone()
    }

    fn is_peer(&self) -> bool {
        true
    }

    fn run(&mut self, _: u64, _: &[Mark], _: Stop<'_>) -> Result<Option<Run>, String> {
        Err(self.reason.clone())
    }
}

/// A clock that can be stopped while something is done that does not count.
struct Clock {
    start: Instant,
    paused: Duration,
}

impl Clock {
    fn start() -> Self {
        Self { start: Instant::now(), paused: Duration::ZERO }
    }

    fn elapsed(&self) -> Duration {
        self.start.elapsed().saturating_sub(self.paused)
    }

    /// Does `what`, which is told the seconds so far.
    fn pause(&mut self, what: impl FnOnce(f64)) {
        let before = Instant::now();
        what(self.elapsed().as_secs_f64());
        self.paused += before.elapsed();
    }
}
