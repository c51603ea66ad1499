//! Between the elements: what arrives is interpolated, what the surface makes of it is exact.
//!
//! The radiance (L_i − Lᵉ_i)/ρ_i that a white element would have is averaged at the corners that
//! elements of one shape share (same side, same normal) and interpolated inside, linearly in triangles,
//! bilinearly in squares. Seen at x it is L(x) = Lᵉ(x) + ρ(x)·white(x), with the texture's own ρ and Lᵉ.
//! A picture, not a solution: no bound is known for it. Where small elements border on large ones
//! it may have a seam, and at edges of shadows it overshoots no more than the elements do.

use super::mesh::Elements;
use super::{Rgb, Sources};
use crate::scene::Scene;
use glam::{DVec3, Vec2};
use std::collections::HashMap;

/// White radiance at the corners of all elements.
pub struct Smooth {
    /// Corners of every element, the fourth of a triangle unused.
    corners: Vec<[u32; 4]>,
    white: Vec<[f32; 3]>,
    triangle: Vec<bool>,
}

/// What makes two corners one: shape, side, place and normal, rounded.
#[derive(PartialEq, Eq, Hash)]
struct Key(u32, bool, [i64; 3], [i16; 3]);

impl Smooth {
    /// Of a solution.
    pub fn new(scene: &Scene, mesh: &Elements, sources: &Sources, radiance: &[Rgb]) -> Self {
        let bounds = scene.geometry.bounds();
        let grain = f64::from((bounds.max - bounds.min).max_element()).max(f64::MIN_POSITIVE) / f64::from(1 << 19);
        let mut known: HashMap<Key, u32> = HashMap::new();
        let mut sums: Vec<([f64; 3], f64)> = vec![];
        let mut smooth = Self { corners: Vec::with_capacity(mesh.len()), white: vec![], triangle: vec![] };
        for (i, flat) in radiance.iter().enumerate() {
            let white: Rgb = std::array::from_fn(|c| {
                let rho = sources.reflectance[i][c];
                if rho > 0.0 { (flat[c] - sources.emitted[i][c]) / rho } else { 0.0 }
            });
            let area = mesh.area(i);
            let mut own = [0; 4];
            for (k, s) in mesh.corners(scene, i).into_iter().enumerate() {
                // Off the round numbers on which many corners lie, so that rounding does not part them.
                let place = s.p.as_dvec3() / grain + DVec3::new(0.317, 0.283, 0.361);
                let normal = s.n_s.as_dvec3() * 40.0 + DVec3::new(0.217, 0.183, 0.261);
                let key = Key(
                    mesh.shape(i),
                    mesh.is_front(i),
                    place.round().to_array().map(|v| v as i64),
                    normal.round().to_array().map(|v| v as i16),
                );
                let next = sums.len() as u32;
                own[k] = *known.entry(key).or_insert(next);
                if own[k] == next {
                    sums.push(([0.0; 3], 0.0));
                }
                let (sum, weight) = &mut sums[own[k] as usize];
                (0..3).for_each(|c| sum[c] += area * white[c]);
                *weight += area;
            }
            smooth.corners.push(own);
            smooth.triangle.push(mesh.is_triangle(i));
        }
        smooth.white = sums.iter().map(|(sum, weight)| sum.map(|v| (v / weight) as f32)).collect();
        smooth
    }

    /// White radiance at local coordinates of an element.
    #[inline]
    pub fn at(&self, element: usize, u: Vec2) -> [f32; 3] {
        let weights = if self.triangle[element] {
            [1.0 - u.x - u.y, u.x, u.y, 0.0]
        } else {
            [(1.0 - u.x) * (1.0 - u.y), u.x * (1.0 - u.y), (1.0 - u.x) * u.y, u.x * u.y]
        };
        let mut sum = [0.0; 3];
        for (corner, weight) in self.corners[element].iter().zip(weights) {
            let white = &self.white[*corner as usize];
            (0..3).for_each(|c| sum[c] += weight * white[c]);
        }
        sum
    }
}
