//! Layers: the same render taken apart, in the same passes.
//!
//! A measurement is a sum over paths, Φ = Σ_x̄ φ(x̄), and any partition of the paths makes it a sum of
//! images. A [`Partition`] says to which part a contribution belongs; each part has a film of its own,
//! to which the contribution is added beside the whole. Both round it in the same way and films add
//! integers, so the films of the parts sum to the film of the whole bit for bit, and each part knows
//! its own variance.

use crate::film::{Film, FilmError};
use crate::transport::Contribution;

/// How paths are divided.
#[derive(Clone, Debug, PartialEq)]
pub enum Partition {
    /// By the number n of scatterings: the terms ⟨τⁿLᵉ, Wᵉ⟩ of the Neumann series.
    Scatterings {
        /// Number of the last part, which holds all that is beyond it too.
        last: u32,
        /// There is something beyond the last part.
        rest: bool,
    },
}

impl Partition {
    /// Number of parts.
    pub fn parts(&self) -> usize {
        match self {
            Self::Scatterings { last, .. } => *last as usize + 1,
        }
    }

    /// Name of a part, as layers of image files have it.
    pub fn name(&self, part: usize) -> String {
        match self {
            Self::Scatterings { last, rest: true } if part as u32 == *last => format!("n{part}+"),
            Self::Scatterings { .. } => format!("n{part}"),
        }
    }

    /// The part of a contribution.
    #[inline]
    pub fn part(&self, c: &Contribution) -> usize {
        match self {
            Self::Scatterings { last, .. } => (c.length - 1).min(*last) as usize,
        }
    }
}

/// The parts of one partition.
#[derive(Clone, Debug)]
pub struct Layers {
    /// How the render is divided.
    pub partition: Partition,
    /// The film of each part.
    pub films: Vec<Film>,
}

impl Layers {
    /// Empty films like `whole`, one for each part.
    pub(super) fn new(partition: &Partition, whole: &Film) -> Result<Self, FilmError> {
        let film = || Film::new(whole.width(), whole.height(), whole.exponent());
        let films = (0..partition.parts()).map(|_| film()).collect::<Result<_, _>>()?;
        Ok(Self { partition: partition.clone(), films })
    }

    /// Memory that the films take, in bytes.
    pub fn bytes(partition: &Partition, width: u32, height: u32) -> u64 {
        Film::bytes(width, height).saturating_mul(partition.parts() as u64)
    }
}
