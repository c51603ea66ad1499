//! Smooth normals of a triangle mesh: n(v) ∝ Σ over the corners at v of angle · face normal.
//!
//! A mesh file without normals is smooth unless its shape asks for face normals (Mitsuba's rule).
//! The weight is the corner's angle [Thürmer 1998], so that the result does not depend on how
//! a flat face is cut into triangles. Vertices count as the same only when they have the same
//! index: a seam in the texture coordinates is a seam in the normals too.

use super::Mesh;
use glam::Vec3;

impl Mesh {
    /// Fills [`Mesh::normals`] with [`smooth_normals`].
    pub fn compute_normals(&mut self) {
        self.normals = smooth_normals(&self.positions, &self.triangles);
    }
}

/// Unit normals, one per position, averaged over the adjacent triangles with the corner angles as
/// weights. A vertex without any triangle of positive area gets (1, 0, 0).
pub fn smooth_normals(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut normals = vec![Vec3::ZERO; positions.len()];
    for &[a, b, c] in triangles {
        let (pa, pb, pc) = (positions[a as usize], positions[b as usize], positions[c as usize]);
        let (ab, bc, ca) = ((pb - pa).normalize_or_zero(), (pc - pb).normalize_or_zero(), (pa - pc).normalize_or_zero());
        // Of unit edges, so that neither tiny nor huge triangles leave the range of f32.
        let n = ab.cross(bc).normalize_or_zero();
        normals[a as usize] += n * angle(ab, -ca);
        normals[b as usize] += n * angle(bc, -ab);
        normals[c as usize] += n * angle(ca, -bc);
    }
    for n in &mut normals {
        *n = n.try_normalize().unwrap_or(Vec3::X);
    }
    normals
}

/// Angle between unit vectors; accurate near 0 and π, where acos of the dot product is not.
fn angle(a: Vec3, b: Vec3) -> f32 {
    let half = if a.dot(b) < 0.0 { (a + b).length() } else { (a - b).length() };
    let small = 2.0 * (0.5 * half).min(1.0).asin();
    if a.dot(b) < 0.0 { std::f32::consts::PI - small } else { small }
}
