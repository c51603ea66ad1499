//! Statements of the theory, tested: on any scene without reference images or settings, and against closed forms.
//!
//! On a scene:
//! - [`blocks`]: independent estimates of a film by path length and block, straight from the walks.
//! - [`adjoint`]: `⟨τⁿLᵉ, Wᵉ⟩ = ⟨Lᵉ, τ'ⁿWᵉ⟩` for every n.
//! - [`residual`]: `L − (Lᵉ + τL)` and `W − (Wᵉ + τ'W)` at random points.
//! - [`explain`]: the strongest paths of a pixel, and every join's density of them.
//!
//! Against closed forms:
//! - [`furnace`]: pictures that are constant.
//! - [`caustics`]: light behind Dirac events.
//! - [`form_factors`]: of cubes and discs.
//! - [`scattering`]: densities, energy and reciprocity of local models.
//! - [`selfcheck`]: all of them in one table.

pub mod adjoint;
pub mod blocks;
pub mod caustics;
mod compare;
pub mod explain;
pub mod form_factors;
pub mod furnace;
mod once;
pub mod residual;
pub mod scattering;
pub mod selfcheck;

pub use compare::Estimate;
