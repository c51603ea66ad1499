//! Frames, warps with their inverses, discrete and tabulated distributions, random numbers.

pub mod distribution;
pub mod frame;
mod limit;
mod prefetch;
pub mod quadtree;
pub mod random;
mod sobol;
pub mod warp;

pub use frame::Frame;
pub use limit::limit;
pub use prefetch::prefetch;
pub use random::Random;
