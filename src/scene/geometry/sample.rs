//! Points drawn on shapes, for area emitters: p_a = 1/A, or uniform in solid angle for spheres.
//!
//! The density returned with a sample is the one that `density_toward` gives for the same rounded
//! point, so that the strategies of one measurement agree on it bit for bit.

use super::analytic::Analytic;
use super::bake::Sampler;
use super::sphere::Sphere;
use super::surface::{normal_of, rounded_error, triangle_error, triangle_slack};
use super::{Geometry, triangle};
use crate::math::warp::{ONE_MINUS_EPSILON, disk_concentric, triangle_uniform};
use glam::{DVec3, Vec2, Vec3};

/// A point drawn on a shape.
#[derive(Clone, Copy, Debug)]
pub struct ShapePoint {
    /// Position, world.
    pub p: Vec3,
    /// Bound of the rounding error of `p`.
    pub p_error: f32,
    /// Unit geometric normal on the side of the shape's normal, where an area emitter shines.
    pub n_g: Vec3,
    /// Texture coordinates.
    pub uv: Vec2,
    /// Density per unit area (m⁻²).
    pub p_a: f32,
}

impl Geometry {
    /// Area of a shape in the world, m²; 0 for instances.
    pub fn area(&self, shape: u32) -> f32 {
        self.samplers[shape as usize].1 as f32
    }

    /// A point of a shape uniform by area; for a shape without area, or an instance, `p_a` = 0.
    pub fn sample_area(&self, shape: u32, u: Vec2) -> ShapePoint {
        let (sampler, area) = &self.samplers[shape as usize];
        let p_a = (1.0 / area) as f32;
        match sampler {
            Sampler::Triangles { first, cdf } => {
                let x = f64::from(u.x);
                let i = cdf.partition_point(|c| *c <= x).clamp(1, cdf.len() - 1) - 1;
                let rest = (((x - cdf[i]) / (cdf[i + 1] - cdf[i])) as f32).clamp(0.0, ONE_MINUS_EPSILON);
                let b = triangle_uniform(Vec2::new(rest, u.y));
                self.triangle_point(shape, self.tree.prims[(first + i as u32) as usize].v, b.x, b.y, p_a)
            }
            Sampler::Parallelogram { plane, .. } => plane.at(u, p_a),
            Sampler::Analytic { index } => point(self.tree.analytic[*index as usize].0.sample_area(u), p_a),
            Sampler::Never => ShapePoint { p: Vec3::ZERO, p_error: 0.0, n_g: Vec3::Z, uv: Vec2::ZERO, p_a: 0.0 },
        }
    }

    fn triangle_point(&self, shape: u32, corners: [u32; 3], u: f32, v: f32, p_a: f32) -> ShapePoint {
        let shape = &self.shapes[shape as usize];
        let [a, b, c] = corners.map(|i| &self.vertices[i as usize]);
        let (e1, e2) = (b.p - a.p, c.p - a.p);
        let (face, double_area) = normal_of(e1, e2);
        let w = 1.0 - u - v;
        let (n_g, _) = triangle::orient([a, b, c], shape, face, [w, u, v]);
        let p = a.p + (e1 * u + e2 * v);
        let uv = if shape.has_uvs { a.uv * w + b.uv * u + c.uv * v } else { Vec2::new(u, v) };
        ShapePoint { p, p_error: triangle_error(p, triangle_slack(e1, e2, double_area)), n_g, uv, p_a }
    }

    /// A point of a shape for a next event at `x`: spheres are sampled uniformly in solid angle where
    /// `x` is outside, all others uniformly by area. Texture coordinates are only right if they are wanted. `None` where nothing can
    /// be drawn.
    pub fn sample_toward(&self, shape: u32, x: Vec3, u: Vec2, with_uv: bool) -> Option<ShapePoint> {
        if let Sampler::Analytic { index } = self.samplers[shape as usize].0
            && let Analytic::Sphere(sphere) = &self.tree.analytic[index as usize].0
            && let Some(sample) = sphere.sample_toward(x, u, with_uv)
        {
            let mut at = point(sample, 0.0);
            at.p_a = self.density_toward(shape, x, at.p, at.n_g);
            return (at.p_a > 0.0).then_some(at);
        }
        let at = self.sample_area(shape, u);
        (at.p_a > 0.0 && at.p_a.is_finite()).then_some(at)
    }

    /// A point of a sphere uniform across the unit direction `w`, in which it shines there: light that
    /// leaves along `w` then has one value per direction. `None` for other shapes.
    pub fn sample_across(&self, shape: u32, w: Vec3, u: Vec2) -> Option<ShapePoint> {
        let sphere = self.outward_sphere(shape)?;
        let mut at = point(sphere.sample_across(w, disk_concentric(u))?, 0.0);
        at.p_a = self.density_across(shape, at.n_g, w)?;
        Some(at)
    }

    /// Density per unit area of [`Self::sample_across`] at a point with normal `n_g`: cosθ/(πr²).
    #[inline]
    pub fn density_across(&self, shape: u32, n_g: Vec3, w: Vec3) -> Option<f32> {
        self.outward_sphere(shape)?;
        // πr² is a quarter of the area.
        Some(n_g.dot(w).max(0.0) * (4.0 / self.samplers[shape as usize].1) as f32)
    }

    /// Is it a sphere that shines outwards?
    #[inline]
    pub fn is_outward_sphere(&self, shape: u32) -> bool {
        self.outward_sphere(shape).is_some()
    }

    #[inline]
    fn outward_sphere(&self, shape: u32) -> Option<&Sphere> {
        if let Sampler::Analytic { index } = self.samplers[shape as usize].0
            && let Analytic::Sphere(sphere) = &self.tree.analytic[index as usize].0
            && sphere.is_outward()
        {
            return Some(sphere);
        }
        None
    }

    /// Density per unit area with which [`Self::sample_toward`] draws the point `y` with normal
    /// `n_g` for a next event at `x`.
    pub fn density_toward(&self, shape: u32, x: Vec3, y: Vec3, n_g: Vec3) -> f32 {
        let (sampler, area) = &self.samplers[shape as usize];
        if let Sampler::Analytic { index } = sampler
            && let Analytic::Sphere(sphere) = &self.tree.analytic[*index as usize].0
            && let Some(p_w) = sphere.cone_p_w(x)
        {
            let d = x.as_dvec3() - y.as_dvec3();
            let d2 = d.length_squared();
            let cos = n_g.as_dvec3().dot(d) / d2.sqrt();
            return (p_w * cos.max(0.0) / d2) as f32;
        }
        if *area > 0.0 { (1.0 / area) as f32 } else { 0.0 }
    }
}

fn point((p, n, uv): (DVec3, DVec3, Vec2), p_a: f32) -> ShapePoint {
    let p = p.as_vec3();
    ShapePoint { p, p_error: rounded_error(p), n_g: n.as_vec3(), uv, p_a }
}
