//! Physics of the local models: densities, energy, reciprocity, robustness, agreement with Mitsuba 3.
//!
//! Every test walks through the one list in `nephroid::proof::scattering::models`, so that a new model is covered by adding a
//! line there; a model without a line, a source or an example fails `documents`.

mod documents;
mod energy;
mod reciprocity;
mod reference;
mod robustness;
mod sampling;
