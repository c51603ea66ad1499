//! What is said about images and scenes: how far apart two images are, whether chance explains it,
//! and what an estimator misses.
//!
//! - [`agreement`]: whether estimators agree, block by block, over independent renders.
//! - [`memory`]: what this process holds.
//! - [`measures`]: RMSE, relMSE plain and trimmed, ratio of means.
//! - [`flip`]: what an eye flipping between the two would see.
//! - [`welch`]: whether two estimates with known variance have the same expectation.
//! - [`comparison`]: all of them, as text and as JSON.
//! - [`picture`]: what is compared.
//! - [`coverage`]: which paths an estimator cannot make in a scene.
//! - [`pyramid`]: what each join adds to each path length.
//! - [`sheet`]: contact sheets of pictures.

pub mod agreement;
pub mod comparison;
pub mod coverage;
pub mod flip;
pub mod measures;
pub mod memory;
pub mod picture;
pub mod pyramid;
pub mod sheet;
pub mod welch;

pub use comparison::{Comparison, compare};
pub use picture::Picture;
