//! Meshes by construction: surfaces of revolution, tubes, boxes and convex polyhedra, and their PLY file.
//!
//! Everything is computed in f64 and rounded once on writing. Triangles are counter-clockwise seen
//! from the side of the normals; curved surfaces carry vertex normals, flat ones none.

use glam::{DMat4, DVec2, DVec3};
use std::f64::consts::TAU;

/// Triangles under construction.
#[derive(Default)]
pub struct Mesh {
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    uvs: Vec<DVec2>,
    triangles: Vec<[u32; 3]>,
}

/// A run of a profile (radius, height) without corners.
pub type Run = Vec<DVec2>;

impl Mesh {
    /// Revolves smooth runs about the z axis. Along a run the outside is on the right-hand side of
    /// the direction of travel: upwards at positive radius the normal points away from the axis.
    pub fn revolve(runs: &[Run], segments: u32) -> Self {
        let mut mesh = Self::default();
        for run in runs {
            let first = mesh.positions.len() as u32;
            for (i, p) in run.iter().enumerate() {
                let tangent = run[(i + 1).min(run.len() - 1)] - run[i.saturating_sub(1)];
                let normal = DVec2::new(tangent.y, -tangent.x).normalize();
                for k in 0..segments {
                    let (sin, cos) = (TAU * f64::from(k) / f64::from(segments)).sin_cos();
                    mesh.positions.push(DVec3::new(p.x * cos, p.x * sin, p.y));
                    mesh.normals.push(DVec3::new(normal.x * cos, normal.x * sin, normal.y));
                }
            }
            for i in 0..run.len() as u32 - 1 {
                for k in 0..segments {
                    let next = (k + 1) % segments;
                    let at = |row: u32, column: u32| first + (i + row) * segments + column;
                    mesh.quad([at(0, k), at(0, next), at(1, next), at(1, k)]);
                }
            }
        }
        mesh
    }

    /// A tube along `path` with elliptic sections: `size(t)` gives the half widths along the
    /// path's in-plane normal and along `binormal`, t from 0 to 1.
    pub fn tube(path: &[DVec3], binormal: DVec3, size: impl Fn(f64) -> DVec2, segments: u32) -> Self {
        let mut mesh = Self::default();
        let last = path.len() - 1;
        for (i, &p) in path.iter().enumerate() {
            let tangent = (path[(i + 1).min(last)] - path[i.saturating_sub(1)]).normalize();
            let side = binormal.cross(tangent).normalize();
            let half = size(i as f64 / last as f64);
            for k in 0..segments {
                let (sin, cos) = (TAU * f64::from(k) / f64::from(segments)).sin_cos();
                mesh.positions.push(p + side * (half.x * cos) + binormal * (half.y * sin));
                mesh.normals.push((side * (half.y * cos) + binormal * (half.x * sin)).normalize());
            }
        }
        for i in 0..last as u32 {
            for k in 0..segments {
                let at = |row: u32, column: u32| (i + row) * segments + column % segments;
                mesh.quad([at(0, k), at(1, k), at(1, k + 1), at(0, k + 1)]);
            }
        }
        mesh
    }

    /// The convex solid `{p : n·p ≤ d}` of planes (n, d), within a cube of half width `bound`.
    pub fn convex(planes: &[(DVec3, f64)], bound: f64) -> Self {
        let mut mesh = Self::default();
        for (i, &(normal, distance)) in planes.iter().enumerate() {
            let normal_length = normal.length();
            let (n, d) = (normal / normal_length, distance / normal_length);
            let (a, b) = n.any_orthonormal_pair();
            let mut face: Vec<DVec3> = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)]
                .map(|(u, v)| n * d + (a * u + b * v) * (4.0 * bound))
                .to_vec();
            for (j, &(n, d)) in planes.iter().enumerate() {
                if i != j {
                    face = clip(&face, n, d);
                }
            }
            mesh.fan(&face);
        }
        mesh
    }

    /// An axis-aligned box whose edges are cut at 45° by `bevel`.
    pub fn bevelled_box(low: DVec3, high: DVec3, bevel: f64) -> Self {
        let (centre, half) = ((low + high) * 0.5, (high - low) * 0.5);
        let mut planes = Vec::new();
        for (axis, sign) in (0..3).flat_map(|axis| [-1.0, 1.0].map(|sign| (axis, sign))) {
            let mut n = DVec3::ZERO;
            n[axis] = sign;
            planes.push((n, half[axis]));
            for other in (axis + 1)..3 {
                for other_sign in [-1.0, 1.0] {
                    let mut edge = n;
                    edge[other] = other_sign;
                    planes.push((edge, half[axis] + half[other] - bevel));
                }
            }
        }
        Self::convex(&planes, half.max_element()).transformed(DMat4::from_translation(centre))
    }

    /// A height field or any other surface over [0, 1]² with uv; `f` gives position and normal.
    pub fn surface(columns: u32, rows: u32, f: impl Fn(f64, f64) -> (DVec3, DVec3)) -> Self {
        let mut mesh = Self::default();
        for j in 0..=rows {
            for i in 0..=columns {
                let (u, v) = (f64::from(i) / f64::from(columns), f64::from(j) / f64::from(rows));
                let (p, n) = f(u, v);
                mesh.positions.push(p);
                mesh.normals.push(n);
                mesh.uvs.push(DVec2::new(u, v));
            }
        }
        for j in 0..rows {
            for i in 0..columns {
                let at = |row: u32, column: u32| (j + row) * (columns + 1) + i + column;
                mesh.quad([at(0, 0), at(0, 1), at(1, 1), at(1, 0)]);
            }
        }
        mesh
    }

    /// Moved by an affine map of positive determinant.
    pub fn transformed(mut self, map: DMat4) -> Self {
        let normal_map = map.inverse().transpose();
        for p in &mut self.positions {
            *p = map.transform_point3(*p);
        }
        for n in &mut self.normals {
            *n = normal_map.transform_vector3(*n).normalize();
        }
        self
    }

    /// Both together; both must have the same attributes.
    pub fn join(mut self, other: Self) -> Self {
        let first = self.positions.len() as u32;
        self.positions.extend(other.positions);
        self.normals.extend(other.normals);
        self.uvs.extend(other.uvs);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + first)));
        self
    }

    /// Binary little-endian PLY.
    pub fn to_ply(&self) -> Vec<u8> {
        let mut properties = String::from("property float x\nproperty float y\nproperty float z\n");
        if !self.normals.is_empty() {
            properties.push_str("property float nx\nproperty float ny\nproperty float nz\n");
        }
        if !self.uvs.is_empty() {
            properties.push_str("property float u\nproperty float v\n");
        }
        let mut out = format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {}\n{properties}element face {}\n\
             property list uchar int vertex_indices\nend_header\n",
            self.positions.len(),
            self.triangles.len()
        )
        .into_bytes();
        for (i, p) in self.positions.iter().enumerate() {
            let uv = self.uvs.get(i).map_or([0.0; 2], |uv| uv.to_array());
            let normal = self.normals.get(i).map_or([0.0; 3], |n| n.to_array());
            let numbers = p.to_array().into_iter();
            let numbers = numbers.chain(normal.into_iter().take(if self.normals.is_empty() { 0 } else { 3 }));
            let numbers = numbers.chain(uv.into_iter().take(if self.uvs.is_empty() { 0 } else { 2 }));
            // Adding 0 turns −0 into 0, so that the bytes do not depend on the sign of a zero.
            numbers.for_each(|x| out.extend(((x + 0.0) as f32).to_le_bytes()));
        }
        for triangle in &self.triangles {
            out.push(3);
            triangle.iter().for_each(|v| out.extend((*v as i32).to_le_bytes()));
        }
        out
    }

    /// Two triangles, or one where the quad has collapsed at a pole.
    fn quad(&mut self, q: [u32; 4]) {
        for t in [[q[0], q[1], q[2]], [q[0], q[2], q[3]]] {
            let [a, b, c] = t.map(|v| self.positions[v as usize]);
            if (b - a).cross(c - a).length() > 1e-12 {
                self.triangles.push(t);
            }
        }
    }

    /// A convex polygon with vertices of its own.
    fn fan(&mut self, polygon: &[DVec3]) {
        let first = self.positions.len() as u32;
        self.positions.extend(polygon);
        self.triangles.extend((2..polygon.len() as u32).map(|i| [first, first + i - 1, first + i]));
    }
}

/// The part of a convex polygon with n·p ≤ d.
fn clip(polygon: &[DVec3], n: DVec3, d: f64) -> Vec<DVec3> {
    let mut kept = Vec::new();
    for (i, &p) in polygon.iter().enumerate() {
        let q = polygon[(i + 1) % polygon.len()];
        let (h_p, h_q) = (n.dot(p) - d, n.dot(q) - d);
        if h_p <= 1e-12 {
            kept.push(p);
        }
        if (h_p < -1e-12 && h_q > 1e-12) || (h_p > 1e-12 && h_q < -1e-12) {
            kept.push(p + (q - p) * (h_p / (h_p - h_q)));
        }
    }
    kept
}
