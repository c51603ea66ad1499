//! Statements of the theory, tested on a scene: no reference image, no settings.
//!
//! - [`blocks`]: independent estimates of a film by path length and block, straight from the walks.
//! - [`adjoint`]: `⟨τⁿLᵉ, Wᵉ⟩ = ⟨Lᵉ, τ'ⁿWᵉ⟩` for every n.

pub mod adjoint;
pub mod blocks;
