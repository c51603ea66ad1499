//! Tests that prove the physics: every join alone against every other, weights against their
//! definition, furnaces, closed forms, and planted mistakes that must be caught.

mod agreement;
mod caustic_room;
mod chains;
mod choice;
mod determinism;
mod few;
mod furnace;
mod lamps;
mod led;
mod lights;
mod merging;
mod mirrors;
mod samples;
mod scenes;
mod splats;
mod splits;
mod support;
mod uneven;
mod weights;
