//! Elements where they are needed: the scene is solved coarsely without a matrix, and the elements within
//! which Lᵉ + τL̃ varies most are split, several times over.
//!
//! What a piecewise constant solution gets wrong first of all is the variation of radiance within its
//! elements; A_i Var_i(Lᵉ + τL̃) is the square of that part of its error. Shadows, corners and
//! textures thus get small elements, even walls large ones.

use super::bound::{bound, variation};
use super::stochastic::{Effort, stochastic};
use super::{Elements, ElementsError, Sources};
use crate::scene::Scene;

/// How fine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Subdivision {
    /// Elements at most (more only where pieces of surface need more).
    pub elements: usize,
    /// Stop where the relative error bound of the coarse solution is below this.
    pub error: Option<f64>,
    /// Points per element for emitters that are no surfaces.
    pub source_samples: u32,
    /// Of all random numbers.
    pub seed: u64,
}

/// The first mesh has this share of all elements; every further one twice as many.
const FIRST: usize = 8;
/// Rays per element of a coarse solution, and of its iterations.
const RAYS: u64 = 128;
const ITERATIONS: u32 = 16;
/// Points per element, pairs of rays per point.
const PROBES: [u32; 2] = [8, 8];
/// Points and pairs of rays for the error bound.
const BOUND: [u32; 2] = [4096, 16];

/// A mesh with small elements where radiance varies.
pub fn subdivide(scene: &Scene, how: &Subdivision) -> Result<Elements, ElementsError> {
    let mut mesh = Elements::new(scene, how.elements / FIRST)?;
    let mut round = 0;
    while mesh.len() < how.elements {
        let seed = how.seed ^ (round << 48);
        let sources = Sources::new(scene, &mesh, how.source_samples, seed);
        let rays = RAYS * mesh.len() as u64 / u64::from(ITERATIONS);
        let solution = stochastic(scene, &mesh, &sources, Effort { iterations: ITERATIONS, rays, seed }, |_| true);
        if let Some(wanted) = how.error {
            let known = bound(scene, &mesh, &solution.radiance, BOUND[0], BOUND[1], seed);
            if known.relative().is_some_and(|e| e <= wanted) {
                break;
            }
        }
        let gains = variation(scene, &mesh, &sources, &solution.radiance, PROBES, seed);
        let (before, next) = (mesh.len(), (2 * mesh.len()).min(how.elements));
        mesh.refine(&gains, next)?;
        if mesh.len() == before {
            break;
        }
        round += 1;
    }
    Ok(mesh)
}
