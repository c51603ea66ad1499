//! One file per format: what a file holds, as plain data, or why it cannot be used.
//!
//! - `assets`: replaces the file names in a scene by decoded meshes and images.
//! - `obj`, `ply`, `serialized`: triangle meshes; `mesh` holds what they have in common.
//! - `image`, `exr`, `png`: pictures in and out; `write`: output files, atomically.
//! - `mitsuba`: the XML scene language of Mitsuba 3.
//! - `fault`: why a file cannot be read or written.

pub mod assets;
pub mod exr;
pub mod fault;
pub mod image;
mod mesh;
pub mod mitsuba;
pub mod obj;
pub mod ply;
pub mod png;
pub mod serialized;
pub mod write;
