//! What is infinitely far and can be hit: radiance L(w), w pointing from the scene outwards.
//!
//! All kinds share one measure (solid angle of the direction, then the disk of the scene's sphere
//! across it), so transport needs to know only this type.

use super::envmap::Envmap;
use super::sun::Sun;
use crate::math::warp;
use crate::spectrum::Spectrum;
use glam::{Vec2, Vec3};

#[derive(Clone, Debug)]
pub(super) enum Sky {
    Constant(Spectrum),
    Sun(Sun),
    Envmap(Box<Envmap>),
}

impl Sky {
    /// L of the unit direction `w`.
    #[inline]
    pub(super) fn radiance(&self, w: Vec3) -> Spectrum {
        match self {
            Self::Constant(l) => *l,
            Self::Sun(s) => s.radiance(w),
            Self::Envmap(e) => e.radiance(w),
        }
    }

    /// A direction, its density per steradian and its radiance. All three are those of the point that
    /// was meant: a rounded direction at the rim of a disk may fail [`Self::radiance`]'s test.
    #[inline]
    pub(super) fn sample(&self, u: Vec2) -> (Vec3, f32, Spectrum) {
        match self {
            Self::Constant(l) => (warp::sphere_uniform(u), warp::SPHERE_UNIFORM_P_W, *l),
            Self::Sun(s) => s.sample(u),
            Self::Envmap(e) => e.sample(u),
        }
    }

    /// Density per steradian of [`Self::sample`].
    #[inline]
    pub(super) fn density(&self, w: Vec3) -> f32 {
        match self {
            Self::Constant(_) => warp::SPHERE_UNIFORM_P_W,
            Self::Sun(s) => s.density(w),
            Self::Envmap(e) => e.density(w),
        }
    }

    /// ∫ L dω over the sphere, W·m⁻².
    pub(super) fn integral(&self) -> Spectrum {
        match self {
            Self::Constant(l) => *l * (4.0 * std::f32::consts::PI),
            Self::Sun(s) => s.integral(),
            Self::Envmap(e) => e.integral(),
        }
    }

    /// Bytes of tables.
    pub(super) fn bytes(&self) -> usize {
        match self {
            Self::Envmap(e) => e.bytes(),
            _ => 0,
        }
    }

    /// Bytes of its image.
    pub(super) fn image_bytes(&self) -> usize {
        match self {
            Self::Envmap(e) => e.image_bytes(),
            _ => 0,
        }
    }
}
