//! Estimators side by side: the same scenes in the same time, errors against a reference, a page.
//!
//! Runs are interleaved (A B A B …), each with random numbers of its own, so that a machine that is busy
//! for a while is busy for all. Whatever is said about a pair of estimators comes from the runs and has an
//! interval; with one run there is none, and no ratio is printed.
//!
//! - [`effort`]: how much is rendered, and when errors are taken.
//! - [`contender`]: who takes part; [`peers`]: renderers that are not ours.
//! - [`reference`](mod@reference): what errors are taken from, given or made once and kept beside the scene.
//! - [`race`]: the runs of one scene.
//! - [`statistics`]: means, ratios and slopes with intervals.
//! - [`figures`]: what the runs say; [`ratios`]: of pairs.
//! - [`layers`]: who carries which light and which noise.
//! - [`cost`]: what following more of the coupling costs.
//! - [`verdict`]: all that in words.
//! - [`table`]: as CSV; [`page`]: as one HTML file.

pub mod contender;
pub mod cost;
pub mod effort;
pub mod figures;
pub mod layers;
pub mod page;
pub mod peers;
pub mod race;
pub mod ratios;
pub mod reference;
pub mod statistics;
pub mod table;
pub mod verdict;

pub use effort::{Effort, Marks};
pub use figures::{Report, SceneReport};

/// A scene on the bench.
pub struct Subject<'a> {
    /// For people; also the name in tables.
    pub name: String,
    /// The file.
    pub path: &'a std::path::Path,
    /// What is in it.
    pub scene: &'a crate::scene::Scene,
}

/// Width and height of the image of a scene.
pub(crate) fn size(scene: &crate::scene::Scene) -> [u32; 2] {
    let film = &scene.film;
    film.crop.map_or([film.width, film.height], |[_, _, w, h]| [w, h])
}
