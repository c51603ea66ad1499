//! What is said about images and scenes: how far apart two images are, whether chance explains it,
//! and what an estimator misses.
//!
//! - [`agreement`]: whether estimators agree, block by block, over independent renders.
//! - [`measures`]: RMSE, relMSE plain and trimmed, ratio of means.
//! - [`flip`]: what an eye flipping between the two would see.
//! - [`welch`]: whether two estimates with known variance have the same expectation.
//! - [`comparison`]: all of them, as text and as JSON.
//! - [`coverage`]: which paths an estimator cannot make in a scene.
//! - [`pyramid`]: what each join adds to each path length.
//! - [`sheet`]: contact sheets of pictures.

pub mod agreement;
pub mod comparison;
pub mod coverage;
pub mod flip;
pub mod measures;
pub mod pyramid;
pub mod sheet;
pub mod welch;

pub use comparison::{Comparison, compare};

/// An image with what is known of its error.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Linear sRGB, row by row from the top.
    pub mean: Vec<[f32; 3]>,
    /// Variance of each number of `mean`.
    pub variance: Option<Vec<[f32; 3]>>,
    /// At every pixel, the variance of the mean over its block of 16 × 16 pixels, counted from the left
    /// upper corner; with what the pixels of a block have in common.
    pub block_variance: Option<Vec<[f32; 3]>>,
    /// Independent samples that each number of `mean` is the mean of.
    pub samples: Option<u64>,
}
