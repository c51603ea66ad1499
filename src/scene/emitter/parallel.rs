//! Ideally parallel light: irradiance E on every plane that faces it, from a single direction.

use crate::spectrum::Spectrum;
use glam::Vec3;

#[derive(Clone, Copy, Debug)]
pub(super) struct Parallel {
    /// Unit direction of travel.
    pub(super) direction: Vec3,
    /// W·m⁻² across the direction.
    pub(super) irradiance: Spectrum,
}
