//! Rendering: passes of walks into a film, under a budget, observed and interruptible.
//!
//! A pass is one gathering walk per pixel, or more where a pilot found that they vary more, and N shooting walks. First all light paths of the pass
//! are shot (jobs of [`SHOOT_JOB`] paths), their splats sorted by tile and their vertices kept for
//! connections; then the tiles gather and add their splats. Every random number is a function of
//! (walker, pixel or path, pass, seed) and the film adds integers, so threads and interruptions
//! leave no trace in the image.
//!
//! ```no_run
//! use nephroid::render::{Budget, Control, Estimator, Options, Render};
//! let scene = nephroid::load("scenes/cup/scene.xml".as_ref(), &Default::default())?.scene;
//! let mut render = Render::new(&scene, &Options::for_scene(&scene, Estimator::Bidirectional))?;
//! render.run(&Budget::passes(64), |_| Control::Continue);
//! let picture = render.picture();
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod estimator;
mod known;
pub mod layers;
mod left_out;
mod measure;
mod order;
mod passes;
mod pilot;
mod sink;
pub mod truncation;

pub use estimator::{Estimator, Options};
pub use known::film_of;
pub use layers::{Layers, Partition};
pub use left_out::left_out;
pub use measure::{Measurement, PixelMeasurement, measure};
pub(crate) use order::order;
pub use passes::SHOOT_JOB;
pub(crate) use passes::{light_path_random, pixel_randoms};
pub use truncation::Truncation;

use crate::film::{Film, FilmError, Filter};
use crate::scene::Scene;
use crate::transport::RayCounts;
use crate::transport::settings::Plan;
use std::time::{Duration, Instant};

/// When a render ends: at whichever comes first; with neither, after one pass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Budget {
    /// Passes in all (samples per pixel, at least).
    pub passes: Option<u64>,
    /// Time from the start of [`Render::run`]; it ends with the pass, or the pair of passes, that comes closest to it.
    pub time: Option<Duration>,
}

impl Budget {
    /// So many samples per pixel.
    pub fn passes(n: u64) -> Self {
        Self { passes: Some(n), time: None }
    }

    /// So much time.
    pub fn time(t: Duration) -> Self {
        Self { passes: None, time: Some(t) }
    }
}

/// Where so many pairs of passes fit into the time of a render, it ends with a pair.
const PAIRS_IN_TIME: u32 = 5;

/// How far a render is.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Passes done.
    pub passes: u64,
    /// Passes wanted, where the budget says.
    pub wanted: Option<u64>,
    /// Time since the start of this run.
    pub elapsed: Duration,
    /// Rays so far.
    pub rays: RayCounts,
}

/// What a progress callback answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Control {
    /// Go on.
    Continue,
    /// End now; what is done is kept.
    Stop,
}

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The budget is used up.
    Finished,
    /// A callback said stop.
    Stopped,
}

/// Why a render cannot start.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RenderError {
    /// The film cannot be made.
    #[error(transparent)]
    Film(#[from] FilmError),
    /// The filter's parameters make no sense.
    #[error("the reconstruction filter has no positive integral")]
    Filter,
    /// No join is allowed.
    #[error("no technique is left: choose at least one of hit, nee, splat, connect, merge")]
    NoTechnique,
    /// A thread pool could not be made.
    #[error("threads cannot be started: {0}")]
    Threads(String),
    /// A pixel outside the film.
    #[error("pixel {0},{1} is outside the film of {2} × {3} pixels")]
    Pixel(u32, u32, u32, u32),
}

/// An image with its uncertainty, rows from the top.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Linear sRGB radiance.
    pub mean: Vec<[f32; 3]>,
    /// Variance of `mean`; infinite with less than two passes.
    pub variance: Vec<[f32; 3]>,
}

/// What a render did.
#[derive(Clone, Copy, Debug, Default)]
pub struct Statistics {
    /// Passes in the film.
    pub passes: u64,
    /// Rays cast.
    pub rays: RayCounts,
    /// Contributions that were not finite and were dropped.
    pub dropped: u64,
    /// Contributions cut to the film's range.
    pub cut: u64,
    /// Time spent in passes.
    pub time: Duration,
    /// Part of it spent shooting.
    pub shoot_time: Duration,
    /// Light vertices kept by the last pass.
    pub light_vertices: u64,
}

/// A render in progress.
pub struct Render<'a> {
    scene: &'a Scene,
    plan: Plan,
    film: Film,
    layers: Vec<Layers>,
    filter: Filter,
    /// Crop window in the whole film: x, y, width, height.
    crop: [u32; 4],
    pool: Option<rayon::ThreadPool>,
    statistics: Statistics,
}

impl<'a> Render<'a> {
    /// Prepares a render: runs the pilot where the estimator needs one.
    pub fn new(scene: &'a Scene, options: &Options) -> Result<Self, RenderError> {
        let t = options.settings.techniques;
        if !t.gathers() && !t.shoots() {
            return Err(RenderError::NoTechnique);
        }
        let d = &scene.film;
        let crop = options.crop.or(d.crop).unwrap_or([0, 0, d.width, d.height]);
        let filter = Filter::new(d.filter).ok_or(RenderError::Filter)?;
        let mut film = Film::new(crop[2], crop[3], Film::exponent_for(estimator::radiance_scale(scene)))?;
        let pool = match options.threads {
            Some(n) => Some(
                rayon::ThreadPoolBuilder::new().num_threads(n.max(1)).build().map_err(|e| RenderError::Threads(e.to_string()))?,
            ),
            None => None,
        };
        let decide = || pilot::decide(scene, &options.settings, crop);
        let decisions = pool.as_ref().map_or_else(decide, |p| p.install(decide));
        let plan = decisions.plan(scene, crop);
        film.identity.decisions = decisions.bytes();
        film.identity.hash = options.identity(scene);
        let layers = options.layers.iter().map(|p| Layers::new(&p.chosen(&plan.settings), &film)).collect::<Result<_, _>>()?;
        Ok(Self { scene, plan, film, layers, filter, crop, pool, statistics: Statistics::default() })
    }

    /// Renders until the budget is used up or `progress` says stop; may be called again to go on.
    pub fn run(&mut self, budget: &Budget, mut progress: impl FnMut(&Progress) -> Control + Send) -> Outcome {
        let (start, before_this) = (Instant::now(), self.statistics.time);
        loop {
            let done = self.film.passes().next();
            let rest = budget.passes.map(|n| n.saturating_sub(done));
            let in_time = budget.time.map(|t| (self.usual_time(1), before_this + t));
            let group = usual_group(done, self.plan.light_paths > 0, in_time);
            let group = rest.map_or(group, |r| r.min(group)).max(1);
            let out_of_time = budget.time.is_some_and(|t| is_closest(start.elapsed(), self.usual_time(group), t));
            let unbounded = budget.passes.is_none() && budget.time.is_none();
            if rest == Some(0) || (out_of_time && done > 0) || (unbounded && done > 0) {
                return Outcome::Finished;
            }
            let before = Instant::now();
            self.run_passes(done..done + group);
            self.statistics.time += before.elapsed();
            self.statistics.passes = self.film.passes().count();
            let report = Progress {
                passes: self.statistics.passes,
                wanted: budget.passes,
                elapsed: start.elapsed(),
                rays: self.statistics.rays,
            };
            if progress(&report) == Control::Stop {
                return Outcome::Stopped;
            }
        }
    }

    /// What so many passes take, by those so far.
    fn usual_time(&self, passes: u64) -> Duration {
        self.statistics.time.mul_f64(passes as f64 / self.statistics.passes.max(1) as f64)
    }

    /// Renders exactly these passes, which must not be in the film yet (shards of a render).
    pub fn run_passes(&mut self, range: std::ops::Range<u64>) {
        let pool = self.pool.take();
        match &pool {
            Some(p) => p.install(|| passes::run(self, range)),
            None => passes::run(self, range),
        }
        self.pool = pool;
    }

    /// The film so far.
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// The same taken apart, in the order of [`Options::layers`].
    pub fn layers(&self) -> &[Layers] {
        &self.layers
    }

    /// The film, without the render.
    pub fn into_film(self) -> Film {
        self.film
    }

    /// The counts that the walks use.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Mean and variance so far.
    pub fn picture(&self) -> Picture {
        Picture {
            width: self.film.width(),
            height: self.film.height(),
            mean: self.film.mean(),
            variance: self.film.variance_of_mean(),
        }
    }

    /// What was done so far.
    pub fn statistics(&self) -> Statistics {
        Statistics { dropped: self.film.dropped(), cut: self.film.cut(), ..self.statistics }
    }
}

/// Passes to make at once after `done` of them; of a render by time, how long one takes and all are to take.
fn usual_group(done: u64, shoots: bool, in_time: Option<(Duration, Duration)>) -> u64 {
    match (shoots, in_time) {
        // Nothing couples the passes of pure gathering: several at a time stay in the cache.
        (false, None) => 4,
        (false, Some(_)) => 2,
        // Points of a sequence come in pairs, and where one of two lights is picked, each for one: an odd one out may bring more noise
        // than it takes.
        (true, Some((pass, all))) if done > 0 && PAIRS_IN_TIME * 2 * pass <= all => 2 - done % 2,
        (true, _) => 1,
    }
}

/// Whether a render that has taken `elapsed` is no farther from `wanted` than with another `more`.
fn is_closest(elapsed: Duration, more: Duration, wanted: Duration) -> bool {
    elapsed + more / 2 >= wanted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_render_ends_with_the_pass_that_comes_closest() {
        let seconds = Duration::from_secs_f64;
        let is = |elapsed, pass| is_closest(seconds(elapsed), seconds(pass), seconds(20.0));
        // 19 or 21.5, 18.5 or 21, and whatever is beyond.
        assert!(is(19.0, 2.5) && !is(18.5, 2.5) && is(20.0, 0.0) && is(25.0, 2.5) && !is(0.0, 2.5));
    }

    #[test]
    fn passes_come_in_pairs_where_they_are_short() {
        let seconds = Duration::from_secs_f64;
        let of = |done, pass| usual_group(done, true, Some((seconds(pass), seconds(20.0))));
        assert_eq!([of(0, 0.0), of(1, 2.0), of(2, 2.0), of(7, 1.0), of(2, 2.1)], [1, 1, 2, 1, 1]);
        assert_eq!([usual_group(6, true, None), usual_group(6, false, None)], [1, 4]);
        assert_eq!(usual_group(6, false, Some((seconds(9.0), seconds(20.0)))), 2);
    }
}
