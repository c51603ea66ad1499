//! What every mesh file has in common: numbers are finite, indices exist, triangles have an area.
//!
//! A reader hands over what it parsed as [`RawMesh`]; [`RawMesh::finish`] gives the mesh or names
//! the first vertex or face that is wrong. Degenerate triangles (zero area in f64) are dropped and
//! counted in one warning: they carry no light and would only divide by zero later.

use super::fault::{Decoded, Fault};
use crate::describe::{Mesh, smooth_normals};
use glam::{Vec2, Vec3};

/// A mesh as parsed, before anything is checked.
#[derive(Debug, Default)]
pub(super) struct RawMesh {
    pub mesh: Mesh,
    /// Warnings so far.
    pub warnings: Vec<String>,
}

impl RawMesh {
    /// Checks everything and normalises the normals. `flip_v` replaces v by 1 − v.
    pub fn finish(mut self, flip_v: bool) -> Result<Decoded<Mesh>, Fault> {
        let m = &mut self.mesh;
        fits(m.positions.len() as u64, "vertices")?;
        fits(m.triangles.len() as u64, "triangles")?;
        check_finite(&m.positions, Vec3::is_finite, "position")?;
        check_finite(&m.normals, Vec3::is_finite, "normal")?;
        check_finite(&m.uvs, Vec2::is_finite, "texture coordinate")?;
        let count = m.positions.len();
        let beyond = |t: &[u32; 3]| t.iter().find(|&&i| i as usize >= count).copied();
        if let Some((face, index)) = m.triangles.iter().enumerate().find_map(|(f, t)| beyond(t).map(|i| (f, i))) {
            return Err(bad_index(format_args!("face {face}"), i64::from(index), count as u64));
        }
        if m.triangles.is_empty() {
            return Err(Fault::new("the mesh has no triangles").hint("the file may hold only points, lines or curves"));
        }
        let before = m.triangles.len();
        let positions = &m.positions;
        m.triangles.retain(|t| has_area(positions, t));
        let dropped = before - m.triangles.len();
        if m.triangles.is_empty() {
            return Err(Fault::new(format!("all {before} triangles of the mesh are degenerate (zero area)")));
        }
        if dropped > 0 {
            self.warnings.push(format!("{dropped} of {before} triangles are degenerate (zero area) and left out"));
        }
        self.fix_normals();
        if flip_v {
            self.mesh.uvs.iter_mut().for_each(|uv| uv.y = 1.0 - uv.y);
        }
        Ok(Decoded { value: self.mesh, warnings: self.warnings })
    }

    /// Normals of unit length; those of zero length become the smooth normal of their vertex.
    fn fix_normals(&mut self) {
        let m = &mut self.mesh;
        let mut zero = Vec::new();
        for (i, n) in m.normals.iter_mut().enumerate() {
            match unit(*n) {
                Some(u) => *n = u,
                None => zero.push(i),
            }
        }
        if !zero.is_empty() {
            let smooth = smooth_normals(&m.positions, &m.triangles);
            zero.iter().for_each(|&i| m.normals[i] = smooth[i]);
            self.warnings.push(format!("{} vertices without a normal get that of the faces around them", zero.len()));
        }
    }
}

/// Unit vector along `n`, also where the square of its length leaves the range of f32.
fn unit(n: Vec3) -> Option<Vec3> {
    n.try_normalize().or_else(|| n.as_dvec3().try_normalize().map(|u| u.as_vec3()))
}

/// Whether the triangle has an area; in f64, whose range the products of f32 differences cannot leave.
fn has_area(positions: &[Vec3], t: &[u32; 3]) -> bool {
    let [a, b, c] = t.map(|i| positions[i as usize]);
    // Most triangles are plainly fine in f32; the rest is decided in f64.
    let n = (b - a).cross(c - a).length_squared();
    (n > 1e-30 && n.is_finite()) || {
        let (a, b, c) = (a.as_dvec3(), b.as_dvec3(), c.as_dvec3());
        (b - a).cross(c - a) != glam::DVec3::ZERO
    }
}

fn check_finite<T: Copy>(values: &[T], is_finite: impl Fn(T) -> bool, name: &str) -> Result<(), Fault> {
    match values.iter().position(|&v| !is_finite(v)) {
        None => Ok(()),
        Some(i) => Err(Fault::new(format!("the {name} of vertex {i} (counted from 0) is not finite"))),
    }
}

/// The fault of an index that names no vertex; `face` says which face.
pub(super) fn bad_index(face: impl std::fmt::Display, index: i64, count: u64) -> Fault {
    let reason = if index < 0 { "is negative".to_owned() } else { format!("is not below the number of vertices {count}") };
    Fault::new(format!("{face}: vertex index {index} {reason}"))
}

/// Counts are kept in 32 bits.
pub(super) fn fits(count: u64, what: &str) -> Result<(), Fault> {
    match count < u64::from(u32::MAX) {
        true => Ok(()),
        false => Err(Fault::new(format!("{count} {what} are more than the {} that are possible", u32::MAX - 1))),
    }
}
