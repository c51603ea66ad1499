//! Where a shape lies and which way it faces, as one sphere and one cone: bounds for emitters.

use super::Geometry;
use super::analytic::Analytic;
use super::bake::{Prim, Sampler};
use super::ray::{Aabb, NONE};
use super::surface::normal_of;
use super::triangle;
use glam::{DVec3, Vec3};
use std::f32::consts::PI;

/// Bounds of a shape in the world. They hold for every point that can be drawn on it or hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// Box around the shape.
    pub bounds: Aabb,
    /// Radius of a sphere around the centre of the box that holds the shape, m.
    pub radius: f32,
    /// Unit axis of a cone that holds all geometric normals.
    pub axis: Vec3,
    /// Its half angle, radians; π where normals point anywhere.
    pub half_angle: f32,
    /// |∫ n dA| / A, at least that of a closed convex shape seen from anywhere: the share of the
    /// area, projected, that is seen from far along the axis.
    pub facing: f32,
}

/// Mean projected area of a closed convex shape, in parts of its area (Cauchy).
const CLOSED: f32 = 0.25;

impl Geometry {
    /// Bounds of a shape of the scene; `None` for one without area and for instances.
    pub fn extent(&self, shape: u32) -> Option<Extent> {
        match &self.samplers[shape as usize].0 {
            Sampler::Never => None,
            Sampler::Triangles { first, .. } | Sampler::Parallelogram { first, .. } => Some(self.extent_of_mesh(shape, *first)),
            Sampler::Analytic { index } => {
                let analytic = &self.tree.analytic[*index as usize].0;
                let around = |axis: Vec3, half_angle, facing| Extent {
                    bounds: analytic.bounds(),
                    radius: outwards(analytic.reach()),
                    axis,
                    half_angle,
                    facing,
                };
                Some(match analytic {
                    Analytic::Disk(disk) => around(disk.normal().as_vec3(), 0.0, 1.0),
                    // Seen across its axis a tube covers 1/π of its area, from elsewhere less.
                    Analytic::Sphere(_) | Analytic::Cylinder(_) => around(Vec3::Z, PI, CLOSED),
                })
            }
        }
    }

    fn extent_of_mesh(&self, shape: u32, first: u32) -> Extent {
        // All triangles of a shape follow each other.
        let prims = self.tree.prims[first as usize..].iter().take_while(|p| p.shape == shape && p.v[0] != NONE);
        let bounds = Aabb::around(prims.clone().flat_map(|p| self.corner_points(p)));
        let center = bounds.center().as_dvec3();
        let (mut reach2, mut area, mut sum, mut two_sided) = (0.0f64, 0.0f64, DVec3::ZERO, false);
        for prim in prims.clone() {
            let [a, b, c] = self.corner_points(prim).map(Vec3::as_dvec3);
            [a, b, c].iter().for_each(|p| reach2 = reach2.max((p - center).length_squared()));
            let vector = (b - a).cross(c - a);
            area += vector.length();
            match self.side(prim) {
                Some(side) => sum += vector * side,
                None => two_sided = true,
            }
        }
        let (axis, length) = (sum.normalize_or_zero(), sum.length());
        let mut half_angle = if two_sided || length < 1e-6 * area { std::f64::consts::PI } else { 0.0 };
        for prim in prims {
            let [a, b, c] = self.corner_points(prim);
            // As rounded as the normals of the points themselves.
            let n = normal_of(b - a, c - a).0.as_dvec3() * self.side(prim).unwrap_or(1.0);
            half_angle = half_angle.max(axis.cross(n).length().atan2(axis.dot(n)));
        }
        let facing = ((length / area) as f32).max(CLOSED);
        Extent { bounds, radius: outwards(reach2.sqrt()), axis: axis.as_vec3(), half_angle: half_angle as f32, facing }
    }

    fn corner_points(&self, prim: &Prim) -> [Vec3; 3] {
        prim.v.map(|v| self.vertices[v as usize].p)
    }

    fn side(&self, prim: &Prim) -> Option<f64> {
        let corners = prim.v.map(|v| &self.vertices[v as usize]);
        triangle::side(corners, &self.shapes[prim.shape as usize]).map(f64::from)
    }
}

/// A radius that rounding cannot make too small.
fn outwards(radius: f64) -> f32 {
    (radius * (1.0 + 1e-6)) as f32
}
