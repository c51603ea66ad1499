//! Emitters: emission Lᵉ, evaluated where it is hit, sampled for next events and for shooting.
//!
//! Every emitter answers three questions with one set of densities, so that the weights of all
//! techniques agree:
//! - next event: a light point as seen from x, density ν (table in [`NextEvent::nu`]);
//! - emission: a light point and a direction, densities `p_k` and `p_next` ([`EmissionDensity`]);
//! - hit: radiance of the light point that a walk found, with both densities above.
//!
//! | emitter | ν | p_k | p_next | can be hit |
//! |---|---|---|---|---|
//! | area | P_n·p_A(y given x), m⁻² | P_e/A, m⁻² | cosθ/π, sr⁻¹ | yes |
//! | sphere, outside | P_n·p_A(y given x), m⁻² | P_e·cosθ/πr², m⁻² | 1/4π, sr⁻¹ | yes |
//! | point, spot | P_n | P_e | 1/4π, cone, sr⁻¹ | no |
//! | parallel | P_n | P_e | 1/πR², m⁻² | no |
//! | sky: constant, image, sun disk | P_n·p_w, sr⁻¹ | P_e·p_w, sr⁻¹ | 1/πR², m⁻² | yes |
//!
//! p_next is what a [`Guide`] changes, and P_e. P_n and P_e are the probabilities of choosing the emitter (`choice`), R the radius of the
//! sphere around the scene; infinite emitters shoot from a disk of that radius across the direction. Among
//! many emitters P_n depends on x: a tree over them (`tree`) finds those that matter there.
//! The set of emitters is closed: an enum, matched once per question.

mod aim;
mod area;
mod build;
mod choice;
mod envmap;
pub mod guide;
mod lights;
mod many;
mod parallel;
mod point;
mod sky;
mod spot;
mod subset;
mod sun;
#[cfg(test)]
mod tests;
mod tree;

pub use build::EmitterInfo;
pub use guide::Guide;
pub use lights::Lights;

use crate::scene::{EmitterId, Surface};
use crate::spectrum::Spectrum;
use area::Area;
use glam::{Vec2, Vec3};
use parallel::Parallel;
use point::Point;
use sky::Sky;
use spot::Spot;

/// A point on an emitter (finite) or a direction (infinite).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmitterPoint {
    /// Which emitter.
    pub emitter: EmitterId,
    /// Position, world; infinite emitters: start of the emission, meaningless for next events.
    pub y: Vec3,
    /// Bound of the rounding error of `y`.
    pub y_error: f32,
    /// Unit normal on the emitting side; zero for point and spot; the direction in which light
    /// travels for infinite emitters.
    pub n_g: Vec3,
    /// Texture coordinates (area emitters).
    pub uv: Vec2,
}

impl EmitterPoint {
    /// The point of an area emitter that a walk has hit.
    #[inline]
    pub fn on_surface(s: &Surface) -> Self {
        Self { emitter: s.emitter, y: s.p, y_error: s.p_error, n_g: s.n_g, uv: s.uv }
    }

    /// The place of a point or spot.
    #[inline]
    pub fn delta(emitter: EmitterId, y: Vec3) -> Self {
        Self { emitter, y, y_error: 0.0, n_g: Vec3::ZERO, uv: Vec2::ZERO }
    }

    /// The point at infinity that a walk leaving the scene along `w_out` has hit.
    #[inline]
    pub fn at_infinity(emitter: EmitterId, w_out: Vec3) -> Self {
        Self { emitter, y: Vec3::ZERO, y_error: 0.0, n_g: -w_out, uv: Vec2::ZERO }
    }
}

/// A light point as seen from a point x of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NextEvent {
    /// The light point.
    pub point: EmitterPoint,
    /// Unit direction from x to the light.
    pub w: Vec3,
    /// Distance from x; infinite for infinite emitters.
    pub distance: f32,
    /// Lᵉ toward x, W·m⁻²·sr⁻¹; intensity of a point or spot, W·sr⁻¹; irradiance across parallel
    /// light, W·m⁻².
    pub radiance: Spectrum,
    /// Geometric factor at the light: |cosθ_y|/d² of an area, 1/d² of a point, 1 at infinity.
    pub g: f32,
    /// 1/d², or 1 at infinity.
    pub inv_d2: f32,
    /// Density including the choice of the emitter. Area: per m²; point, spot, parallel: discrete;
    /// sky: per steradian. The estimate is `radiance · g / nu` times what happens at x.
    pub nu: f32,
    /// Cannot be hit.
    pub delta: bool,
}

/// Densities with which shooting makes a light point and a direction from it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EmissionDensity {
    /// Of the light point, including the choice of the emitter: P_e·p_A (area, m⁻²), P_e (point,
    /// spot, parallel), P_e·p_w (sky, sr⁻¹).
    pub p_k: f32,
    /// Of what follows: direction, sr⁻¹ (finite), or position across the direction, m⁻² (infinite).
    pub p_next: f32,
}

/// Start of a shooting walk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emission {
    /// The light point; its `y` is the origin of the walk, also for infinite emitters.
    pub point: EmitterPoint,
    /// Unit direction of travel.
    pub w: Vec3,
    /// Lᵉ·cosθ / (p_k·p_next): a sample of the emitted flux of all emitters, W.
    pub weight: Spectrum,
    /// The densities.
    pub density: EmissionDensity,
    /// Cannot be hit.
    pub delta: bool,
    /// At infinity: the first edge has no 1/d².
    pub infinite: bool,
}

/// The closed set of emitters.
#[derive(Clone, Debug)]
enum Emitter {
    Area(Area),
    Point(Point),
    Spot(Spot),
    Parallel(Parallel),
    Sky(Sky),
    /// Described but without effect: black or without area.
    Dark,
}
