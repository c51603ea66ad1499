//! What errors are taken from: a given image, or one made once and kept beside the scene.
//!
//! A reference that is made is bidirectional, with random numbers that no run uses; with merges where every
//! unbiased join is blind, or so rarely finds the light that `auto` merges (their blur shrinks with the
//! passes, of which a reference has far more than a run). It is kept as `NAME.reference-HASH.exr`, named by
//! the content of the scene, and made anew only where more is wanted than it has.
//!
//! It is made of two halves with different random numbers, whose difference tells its variance without bias
//! ([`Picture::of_halves`]). What an error owes to it is subtracted ([`crate::report::measures::Noise`]), and an error that is mostly
//! that is said to be so. The variance of any other image may be a bound, as that of a film is where samples fill space evenly;
//! to subtract it would make errors too small, so it is not used. (Bounds on means of blocks are: they only widen the interval of the
//! light that an image has.)

use super::contender::Stop;
use super::effort::Effort;
use super::{Subject, size};
use crate::io::png::PngOptions;
use crate::io::write::{read_image, write_image};
use crate::render::{Budget, Control, Estimator, Options, Outcome, Progress, Render, RenderError};
use crate::report::Picture;
use crate::report::coverage::Coverage;
use crate::report::measures::relative_variance;
use crate::scene::Scene;
use crate::transport::settings::Techniques;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Mixed into the seeds of both halves of a reference; see [`run_seed`](super::race::run_seed) for the others.
const SEEDS: [u64; 2] = [0x5ef0_a11c_0de5_eed5, 0x0dd_ba11_5eed_0f2a];
/// Says in a file that its variance is that of [`Picture::of_halves`].
const VARIANCE: (&str, &str) = ("varianceFrom", "halves");

/// A reference with what is known of it.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Mean and, where it is known, variance.
    pub picture: Picture,
    /// Where it came from, as a sentence for people.
    pub origin: String,
    /// √(mean relative variance), where the variance is known.
    pub error: Option<f64>,
    /// What went wrong with keeping it.
    pub warning: Option<String>,
}

/// The reference of a scene; `Ok(None)` where `stop` said so before it was made.
pub fn reference(
    subject: &Subject<'_>,
    given: Option<&Path>,
    effort: &Effort,
    stop: Stop<'_>,
) -> Result<Option<Reference>, String> {
    if let Some(path) = given {
        return read(subject, path).map(|picture| Some(Reference::new(picture, format!("given: {}", path.display()))));
    }
    let path = place(subject);
    let options = suited(subject.scene).map_err(|e| e.to_string())?;
    if let Some(kept) = kept(subject, &path, effort, options.settings.techniques) {
        return Ok(Some(kept));
    }
    make(subject, &path, effort, options, stop)
}

/// Where the reference of a scene is kept.
pub fn place(subject: &Subject<'_>) -> PathBuf {
    let stem = subject.path.file_stem().unwrap_or_default().to_string_lossy();
    subject.path.with_file_name(format!("{stem}.reference-{}.exr", &subject.scene.hash_hex()[..16]))
}

impl Reference {
    fn new(picture: Picture, origin: String) -> Self {
        let error = picture.variance.as_ref().map(|v| relative_variance(v, &picture.mean).sqrt());
        Self { picture, origin, error, warning: None }
    }
}

fn read(subject: &Subject<'_>, path: &Path) -> Result<Picture, String> {
    let file = read_image(path).map_err(|f| f.to_string())?;
    let mut picture = Picture::of_file(&file).ok_or_else(|| format!("{}: no channels R, G, B or Y", path.display()))?;
    if file.attributes.get(VARIANCE.0).is_none_or(|from| from != VARIANCE.1) {
        picture.variance = None;
    }
    let ([w, h], (width, height)) = (size(subject.scene), (picture.width, picture.height));
    if (w, h) != (width, height) {
        return Err(format!("the reference {} has {width} × {height} pixels, the scene {w} × {h}", path.display()));
    }
    Ok(picture)
}

/// The one that is there, if it is as good as wanted or took as long as allowed.
fn kept(subject: &Subject<'_>, path: &Path, effort: &Effort, techniques: Techniques) -> Option<Reference> {
    let file = read_image(path).ok()?;
    if *file.attributes.get("techniques")? != techniques.names() {
        return None;
    }
    let seconds: f64 = file.attributes.get("renderTime")?.parse().ok()?;
    let picture = read(subject, path).ok()?;
    let reference = Reference::new(picture, format!("kept beside the scene, made in {seconds:.0} s"));
    let enough = reference.error? <= effort.reference_error || seconds >= 0.95 * effort.reference_time.as_secs_f64();
    enough.then_some(reference)
}

/// The most suitable estimator that does not choose by itself.
fn suited(scene: &Scene) -> Result<Options, RenderError> {
    let mut options = Options::for_scene(scene, Estimator::Bidirectional);
    let blind = Coverage::of(scene).blind.iter().any(|b| b.estimator == Estimator::Bidirectional.name());
    let merges = blind || Render::new(scene, &Options::for_scene(scene, Estimator::Auto))?.plan().settings.techniques.merge;
    options.settings.techniques.merge = merges;
    Ok(options)
}

fn make(
    subject: &Subject<'_>,
    path: &Path,
    effort: &Effort,
    mut options: Options,
    stop: Stop<'_>,
) -> Result<Option<Reference>, String> {
    let begin = Instant::now();
    let mut half = |seed: u64| {
        options.settings.seed = effort.seed ^ seed;
        Render::new(subject.scene, &options).map_err(|e| e.to_string())
    };
    let mut halves = [half(SEEDS[0])?, half(SEEDS[1])?];
    let control = |_: &Progress| if stop() { Control::Stop } else { Control::Continue };
    let (mut passes, mut before) = (8, None);
    let picture = loop {
        for (render, parts) in halves.iter_mut().zip([2, 1]) {
            let left = effort.reference_time.saturating_sub(begin.elapsed()) / parts;
            let budget = Budget { passes: Some(passes), time: Some(left.max(Duration::from_millis(1))) };
            if render.run(&budget, control) == Outcome::Stopped {
                return Ok(None);
            }
        }
        let picture = Picture::of_halves(halves[0].film(), halves[1].film());
        let error = picture.variance.as_ref().map_or(f64::INFINITY, |v| relative_variance(v, &picture.mean).sqrt());
        // What is left of the time may be too short for another pass.
        let out_of_time = begin.elapsed() >= effort.reference_time || picture.samples == before;
        if error <= effort.reference_error || out_of_time {
            break picture;
        }
        before = picture.samples;
        // As many as the error promises to need, at most twice as many.
        let done = halves[0].statistics().passes;
        let promised = done as f64 * (error / effort.reference_error).powi(2) * 1.05;
        passes = (promised.min(2.0 * done as f64) as u64).max(done + 1);
    };
    let seconds = begin.elapsed().as_secs_f64();
    let mut file = picture.to_file();
    let attributes = [
        ("software", format!("nephroid {}", env!("CARGO_PKG_VERSION"))),
        ("sceneHash", subject.scene.hash_hex()),
        ("estimator", Estimator::Bidirectional.name().into()),
        ("techniques", options.settings.techniques.names()),
        ("renderTime", format!("{seconds:.3}")),
        (VARIANCE.0, VARIANCE.1.into()),
    ];
    file.attributes.extend(attributes.map(|(k, v)| (k.to_owned(), v)));
    let fault = write_image(path, &file, PngOptions::default()).err();
    let merges = if options.settings.techniques.merge { " with merges" } else { "" };
    let passes = picture.samples.unwrap_or(0);
    let origin = format!("made in {seconds:.0} s by the bidirectional estimator{merges}, {passes} samples per pixel");
    let mut reference = Reference::new(picture, origin);
    reference.warning = fault.map(|f| format!("the reference could not be kept: {f}"));
    Ok(Some(reference))
}
