//! nephroid: a bidirectional renderer using the potential equation.
//!
//! Two equations describe the same light. The rendering equation `L = Lᵉ + τL` is solved from the
//! sensor by a gathering walk, the potential equation `W = Wᵉ + τ'W` from the lights by a shooting
//! walk, and a pixel is the one number `Φ = ⟨L, Wᵉ⟩ = ⟨Lᵉ, W⟩` that both of them estimate.
//!
//! Rooms, each using only those above it:
//! - [`math`]: frames, warps, distributions, random numbers.
//! - [`spectrum`]: what a colour is.
//! - [`describe`]: the scene as plain data, every value with its place in the file.
//! - [`texture`]: numbers that vary over a surface.
//! - [`local`]: local models `f(w_i, w_o)`, no coupling between points.
//! - [`scene`]: the built, immutable scene: geometry, emitters `Lᵉ`, sensors `Wᵉ`.
//! - [`transport`]: the walks and the measurement.
//! - [`film`]: exact accumulation into images.
//! - [`render`]: passes of walks into a film, under a budget.
//! - [`elements`]: the rendering equation of diffuse scenes as a finite system of equations.
//! - [`io`]: one file per format.
//! - [`report`]: comparison of images.
//! - [`proof`]: statements of the theory, tested on a scene.
//! - [`mod@bench`]: estimators side by side in equal time, as a page.
//! - [`cli`]: the command line.
//!
//! ```no_run
//! use nephroid::render::{Budget, Control, Estimator, Options, PixelMeasurement, Render};
//!
//! let scene = nephroid::load("scenes/cup/scene.xml".as_ref(), &Default::default())?.scene;
//! let options = Options::for_scene(&scene, Estimator::Bidirectional);
//! let mut render = Render::new(&scene, &options)?;
//! render.run(&Budget::passes(64), |_| Control::Continue);
//! let picture = render.picture(); // mean and variance of every pixel
//!
//! // One pixel as one number, by gathering, by shooting, by both and with merges, each with its standard error.
//! let phi = PixelMeasurement::new(&scene, &options, (200, 120), 1000)?;
//! println!("{:?} {:?} {:?} {:?}", phi.gather, phi.shoot, phi.bidirectional, phi.merging);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod bench;
pub mod cli;
pub mod describe;
pub mod elements;
pub mod film;
pub mod io;
pub mod local;
pub mod math;
pub mod proof;
pub mod render;
pub mod report;
pub mod scene;
pub mod spectrum;
pub mod texture;
pub mod transport;

/// Vectors and matrices of the interface.
pub use glam;

use std::path::Path;

/// A scene ready to render, and what may not be as meant.
pub struct Loaded {
    /// The built scene.
    pub scene: scene::Scene,
    /// Warnings; render them for people with [`describe::Problems::render`] and `sources`.
    pub warnings: describe::Problems,
    /// The texts that the places of the warnings point into.
    pub sources: describe::Sources,
}

/// Reads, decodes and builds a Mitsuba 3 scene file; all problems at once on failure.
pub fn load(path: &Path, options: &io::mitsuba::LoadOptions) -> Result<Loaded, io::mitsuba::LoadError> {
    finish(io::mitsuba::load(path, options)?)
}

/// The same from a text; relative file names in it start at `directory`.
pub fn load_str(text: &str, directory: &Path, options: &io::mitsuba::LoadOptions) -> Result<Loaded, io::mitsuba::LoadError> {
    finish(io::mitsuba::from_str(text, directory, options)?)
}

/// Decodes the files that a description names and builds its first sensor's scene.
pub fn finish(read: io::mitsuba::Loaded) -> Result<Loaded, io::mitsuba::LoadError> {
    let (mut description, mut warnings) = (read.scene, read.warnings);
    io::assets::decode(&mut description, &mut warnings);
    let sources = std::mem::take(&mut description.sources);
    if warnings.has_errors() {
        return Err(io::mitsuba::LoadError { problems: warnings, sources });
    }
    match scene::Scene::build(&description, 0) {
        Ok((scene, more)) => {
            warnings.list.extend(more.list);
            Ok(Loaded { scene, warnings, sources })
        }
        Err(problems) => {
            warnings.list.extend(problems.list);
            Err(io::mitsuba::LoadError { problems: warnings, sources })
        }
    }
}
