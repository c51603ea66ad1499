//! Finite elements: diffuse scenes as a finite system of equations, L = b + ρ F L.
//!
//! The surfaces are cut into elements on which radiance is constant. What the rendering equation
//! says of its mean over element i is then
//!
//! ```text
//! L_i = b_i + ρ_i Σ_j F_ij L_j,     A_i F_ij = A_j F_ji = ∫_i ∫_j G V / π dA dA',     Σ_j F_ij ≤ 1
//! ```
//!
//! in radiance (radiosity is π L). ρ_i is the mean reflectance and b_i what needs no coupling of
//! surfaces: mean emission, and the light of point, spot, parallel and sky emitters after one
//! reflection. That is the operator τ* which stands for τ; the solutions of both differ by at most
//! ‖τL − τ*L‖ / (1 − q) ([`bound`]).
//!
//! - [`mesh`]: which elements there are, and which one a ray meets.
//! - [`subdivide`]: finer where radiance varies.
//! - [`sources`]: ρ_i and b_i.
//! - [`factors`]: F by ray casting, reciprocity and closure enforced.
//! - [`invert`]: L = (1 − ρF)⁻¹ b.
//! - [`iterate`]: L_n = b + ρF L_{n−1} by gathering or shooting.
//! - [`stochastic`]: the same without a matrix, by rays.
//! - [`view()`], [`facets()`], [`Smooth`]: the solution as an image, as triangles with colours, interpolated.
//!
//! Surfaces are what geometry says they are: interpolated normals are ignored. Local models other
//! than diffuse ones are refused ([`refusals`]).

mod adapt;
pub mod bound;
mod cell;
mod facets;
pub mod factors;
pub mod invert;
pub mod iterate;
pub mod mesh;
mod refuse;
mod smooth;
pub mod sources;
pub mod stochastic;
pub mod view;

pub use adapt::{Subdivision, subdivide};
pub use facets::{Facets, facets};
pub use factors::Factors;
pub use mesh::Elements;
pub use refuse::refusals;
pub use smooth::Smooth;
pub use sources::Sources;
pub use view::{View, view};

/// Linear sRGB in double precision: what is solved for, channel by channel.
pub type Rgb = [f64; 3];

/// Why there is no finite-element solution.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ElementsError {
    /// A local model of the scene is not diffuse.
    #[error("local model {0} of the scene scatters otherwise than diffusely")]
    NotDiffuse(u32),
    /// An instance stretches a sphere or a cylinder.
    #[error("an instance stretches shape {0}, a sphere or a cylinder, differently along its axes: use a mesh")]
    Stretched(u32),
    /// No surface reflects or emits.
    #[error("no surface of the scene reflects or emits")]
    Empty,
    /// More elements than can be numbered.
    #[error("{0} elements are too many")]
    TooMany(usize),
    /// The matrix takes more memory than allowed (needed, allowed).
    #[error("{elements} elements take a matrix of {needed} bytes, {allowed} are allowed")]
    Memory {
        /// Elements.
        elements: usize,
        /// Bytes that the solution would take.
        needed: u64,
        /// Bytes that it may take.
        allowed: u64,
    },
    /// Reflectances are so large that the system has no solution.
    #[error("the system is singular: surfaces reflect all that they receive")]
    Singular,
}
