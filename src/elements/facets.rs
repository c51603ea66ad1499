//! A solution as triangles with the colour of their corners, for programs that show meshes.

use super::mesh::Elements;
use super::smooth::Smooth;
use super::{Rgb, Sources};
use crate::scene::Scene;
use glam::{Vec2, Vec3};

/// Triangles, three corners of their own each, wound so that they face the side that shines.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Facets {
    /// World, metres.
    pub positions: Vec<Vec3>,
    /// Radiance of every corner, linear sRGB.
    pub radiance: Vec<[f32; 3]>,
    /// Corners of every triangle.
    pub triangles: Vec<[u32; 3]>,
}

/// Of every element one triangle, or two for a square one; `smooth` to interpolate.
pub fn facets(scene: &Scene, mesh: &Elements, sources: &Sources, radiance: &[Rgb], smooth: Option<&Smooth>) -> Facets {
    let mut facets = Facets::default();
    for (i, flat) in radiance.iter().enumerate() {
        let first = facets.positions.len() as u32;
        let (rho, emitted) = (&sources.reflectance[i], &sources.emitted[i]);
        let corners = mesh.corners(scene, i);
        let normal = corners[0].n_g * if mesh.is_front(i) { 1.0 } else { -1.0 };
        for (s, u) in corners.iter().zip([Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE]) {
            facets.positions.push(s.p);
            facets.radiance.push(match smooth {
                Some(smooth) => {
                    let white = smooth.at(i, u);
                    std::array::from_fn(|c| (emitted[c] + rho[c] * f64::from(white[c])) as f32)
                }
                None => flat.map(|v| v as f32),
            });
        }
        let edges = [corners[1].p - corners[0].p, corners[2].p - corners[0].p];
        let along = edges[0].cross(edges[1]).dot(normal) >= 0.0;
        let wound = |t: [u32; 3]| if along { t } else { [t[0], t[2], t[1]] }.map(|k| first + k);
        facets.triangles.push(wound([0, 1, 2]));
        if corners.len() == 4 {
            facets.triangles.push(wound([3, 2, 1]));
        }
    }
    facets
}
