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
//! - [`io`]: one file per format.
//! - [`report`]: comparison of images.
//! - [`cli`]: the command line.

pub mod cli;
pub mod describe;
pub mod film;
pub mod io;
pub mod local;
pub mod math;
pub mod render;
pub mod report;
pub mod scene;
pub mod spectrum;
pub mod texture;
pub mod transport;
