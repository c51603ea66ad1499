//! Straight through, as if there were no surface: f is a Dirac function of w_next = −w_back.
//!
//! It marks a boundary that is none for light. It counts as an event of a path, as in [Mitsuba 3].
//!
//! ```xml
//! <bsdf type="null"/>
//! ```

use super::{Equation, Evaluation, Lobe, Lobes, Sample, Textured};
use crate::spectrum::Spectrum;
use crate::texture::Textures;
use glam::{Vec2, Vec3};

/// Nothing to be textured.
#[derive(Clone, Debug)]
pub struct Model;

/// Straight through.
#[derive(Clone, Copy, Debug)]
pub struct Null;

impl Textured for Model {
    type At<'a> = Null;

    #[inline]
    fn resolve<'a>(&'a self, _: &'a Textures, _: Vec2) -> Null {
        Null
    }

    fn lobes(&self) -> Lobes {
        Lobes { null: true, ..Lobes::default() }
    }

    fn albedo_bound(&self, _: &Textures) -> Spectrum {
        Spectrum::ONE
    }
}

impl Lobe for Null {
    #[inline]
    fn evaluate(&self, _: Equation, _: Vec3, _: Vec3) -> Evaluation {
        Evaluation::default()
    }

    #[inline]
    fn sample(&self, _: Equation, w_back: Vec3, _: f32, _: Vec2) -> Option<Sample> {
        Some(Sample::dirac(-w_back, Spectrum::ONE, 1.0, 1.0))
    }

    #[inline]
    fn is_delta(&self) -> bool {
        true
    }

    #[inline]
    fn roughness(&self) -> f32 {
        0.0
    }
}
