//! What bounds the light of an emitter, or of several: a box, a sphere in it, a cone, an intensity.

use crate::scene::emitter::point::Point;
use crate::scene::emitter::spot::Spot;
use crate::scene::geometry::{Aabb, Extent};
use glam::{DQuat, DVec3, Vec3};
use std::f64::consts::{FRAC_PI_2, PI};

/// Light leaves from within the box and the sphere, at up to `spread` from a direction that is within
/// `normals` of the axis.
#[derive(Clone, Copy, Debug)]
pub(in crate::scene::emitter) struct Bound {
    pub(super) bounds: Aabb,
    /// Of a sphere around the centre of the box.
    pub(super) radius: f32,
    pub(super) axis: DVec3,
    /// θ_o, radians.
    pub(super) normals: f64,
    /// θ_e, radians, at most π/2.
    pub(super) spread: f64,
    /// Along the axis and from afar, W·sr⁻¹.
    pub(super) intensity: f64,
}

impl Bound {
    /// A shape that emits `power` W: π·I is the power of its projection.
    pub(in crate::scene::emitter) fn area(e: &Extent, power: f64) -> Self {
        Self {
            bounds: e.bounds,
            radius: e.radius,
            axis: e.axis.as_dvec3(),
            normals: f64::from(e.half_angle),
            spread: FRAC_PI_2,
            intensity: power * f64::from(e.facing) / PI,
        }
    }

    pub(in crate::scene::emitter) fn point(p: &Point, power: f64) -> Self {
        Self::at(p.position, DVec3::Z, PI, FRAC_PI_2, power / (4.0 * PI))
    }

    /// The falloff of a spot between beam and cutoff takes the place of the cosine, which is zero at π/2.
    pub(in crate::scene::emitter) fn spot(s: &Spot, power: f64) -> Self {
        let (beam, cutoff) = s.half_angles();
        let normals = beam.max(cutoff - FRAC_PI_2);
        Self::at(s.position, s.axis().as_dvec3(), normals, cutoff - normals, power * f64::from(s.p_beam()))
    }

    fn at(position: Vec3, axis: DVec3, normals: f64, spread: f64, intensity: f64) -> Self {
        Self { bounds: Aabb::around([position]), radius: 0.0, axis, normals, spread, intensity }
    }

    pub(super) fn center(&self) -> Vec3 {
        self.bounds.center()
    }

    /// Both together; the sphere is the box's and may be made smaller by who knows all parts.
    pub(super) fn union(&self, other: &Self) -> Self {
        let bounds = self.bounds.union(other.bounds);
        let (axis, normals) = cone((self.axis, self.normals), (other.axis, other.normals));
        Self {
            bounds,
            radius: half_diagonal(&bounds),
            axis,
            normals,
            spread: self.spread.max(other.spread),
            intensity: self.intensity + other.intensity,
        }
    }

    /// Cost of a node in the orientation heuristic: intensity times a measure of the directions of its
    /// light times the surface of the sphere around its box (which a row of points has as well)
    /// [Conty Estevez & Kulla 2018].
    pub(super) fn cost(&self) -> f64 {
        let (o, w) = (self.normals, (self.normals + self.spread).min(PI));
        let beyond = 2.0 * w * o.sin() - (o - 2.0 * w).cos() - 2.0 * o * o.sin() + o.cos();
        let directions = 2.0 * PI * (1.0 - o.cos()) + FRAC_PI_2 * beyond;
        self.intensity * directions * f64::from(half_diagonal(&self.bounds)).powi(2)
    }
}

fn half_diagonal(b: &Aabb) -> f32 {
    0.5 * (b.max - b.min).length()
}

/// The narrowest cone (axis, half angle) around two.
fn cone(a: (DVec3, f64), b: (DVec3, f64)) -> (DVec3, f64) {
    let (a, b) = if a.1 >= b.1 { (a, b) } else { (b, a) };
    if a.1 >= PI || a.0 == b.0 {
        return a;
    }
    let across = a.0.cross(b.0);
    let between = across.length().atan2(a.0.dot(b.0));
    if between + b.1 <= a.1 {
        return a;
    }
    let half = 0.5 * (a.1 + between + b.1);
    let Some(turn) = across.try_normalize().filter(|_| half < PI) else { return (a.0, PI) };
    ((DQuat::from_axis_angle(turn, half - a.1) * a.0).normalize(), half)
}
