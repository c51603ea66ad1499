//! The expansion Σ τⁿLᵉ taken apart: layers, techniques and lights of one render, and what is left out of it.

mod direct;
mod layers;
mod lights;
mod partial;
mod pyramid;
mod support;
mod truncation;
