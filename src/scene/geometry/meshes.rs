//! The two polyhedra that are given by name, with the vertices, normals and uv of Mitsuba's.

use crate::describe::Mesh;
use glam::{Vec2, Vec3};

/// [-1, 1]² in the plane z = 0, normal +z, uv = (xy + 1)/2.
pub(super) fn rectangle() -> Mesh {
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    Mesh {
        positions: corners.map(|(x, y)| Vec3::new(x, y, 0.0)).to_vec(),
        normals: vec![Vec3::Z; 4],
        uvs: corners.map(|(x, y)| Vec2::new(0.5 * (x + 1.0), 0.5 * (y + 1.0))).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

/// [-1, 1]³, every face with its own four vertices.
///
/// A face starts at the corner with uv = (0, 1) and goes round by (1, 1), (1, 0), (0, 0).
pub(super) fn cube() -> Mesh {
    /// Normal, first corner, and the direction to the second corner (u grows).
    const FACES: [([f32; 3], [f32; 3], [f32; 3]); 6] = [
        ([0., -1., 0.], [1., -1., -1.], [0., 0., 1.]),
        ([0., 1., 0.], [1., 1., -1.], [-1., 0., 0.]),
        ([1., 0., 0.], [1., -1., -1.], [0., 1., 0.]),
        ([0., 0., 1.], [1., -1., 1.], [0., 1., 0.]),
        ([-1., 0., 0.], [-1., -1., 1.], [0., 1., 0.]),
        ([0., 0., -1.], [1., 1., -1.], [0., -1., 0.]),
    ];
    let mut mesh = Mesh::default();
    for (n, first, along) in FACES.map(|(n, p, a)| (Vec3::from(n), Vec3::from(p), Vec3::from(a))) {
        let at = mesh.positions.len() as u32;
        let up = n.cross(along);
        mesh.positions.extend([first, first + 2.0 * along, first + 2.0 * along + 2.0 * up, first + 2.0 * up]);
        mesh.normals.extend([n; 4]);
        mesh.uvs.extend([Vec2::new(0., 1.), Vec2::new(1., 1.), Vec2::new(1., 0.), Vec2::new(0., 0.)]);
        mesh.triangles.extend([[at, at + 1, at + 2], [at + 3, at, at + 2]]);
    }
    mesh
}
