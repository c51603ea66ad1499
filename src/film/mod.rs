//! Film: `Φ_j = (1/n) Σ_p x_jp`, the mean over passes of what each pass found at pixel `j`.
//!
//! The unit of sampling is the pass: gathering walks of every pixel, one unless a pilot gives some more, or `N` shooting walks, or both.
//! `x_jp` is all that pass `p` contributed to pixel `j`, splats included, so that its variance over
//! passes is the variance of the estimate, whichever walkers made it.
//!
//! Sums are integers. Every single contribution is rounded once onto a fixed grid ([`exact`]) and
//! from there on only integers are added, which is associative: any number of threads, any order of
//! splats, any splitting into layers or films gives the same bits. A film therefore can be merged
//! from films of disjoint passes, or resumed, without a trace of how it was made.
//!
//! - [`exact`]: the grid and the rounding.
//! - [`layout`]: pixels in 16 × 16 tiles.
//! - [`passes`]: which passes a film holds.
//! - [`accumulator`]: the film itself.
//! - [`splat`]: messages from shooting walks, sorted by tile.
//! - [`filter`]: reconstruction filters for both walkers.
//! - [`reconstruct`]: pixels share walks and splats where filters are wider than a pixel.

pub mod accumulator;
pub mod exact;
pub mod filter;
pub mod layout;
pub mod passes;
pub mod reconstruct;
pub mod splat;

pub use accumulator::{Film, FilmError, Identity, MergeError, Tile, TileBuffer};
pub use exact::{Exact, Rounded};
pub use filter::Filter;
pub use layout::{Layout, Rect, TILE};
pub use passes::PassSet;
pub use reconstruct::{Dealt, Patch, Sharing, Taps};
pub use splat::{Splat, SplatBins};
