//! Isotropic point: intensity I in every direction, power 4π·I.

use crate::spectrum::Spectrum;
use glam::Vec3;

#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub(super) position: Vec3,
    /// W·sr⁻¹.
    pub(super) intensity: Spectrum,
}
