//! Surface points of triangles: p = a + u·(b − a) + v·(c − a), never o + t·d.

use super::bake::{Shape, Vertex};
use super::surface::{Local, normal_of, triangle_error, triangle_slack};
use crate::math::Frame;
use glam::{Vec2, Vec3};

/// The point with barycentric coordinates (1 − u − v, u, v).
#[inline(always)]
pub(super) fn surface([a, b, c]: [&Vertex; 3], shape: &Shape, u: f32, v: f32) -> Local {
    let (e1, e2) = (b.p - a.p, c.p - a.p);
    let p = a.p + (e1 * u + e2 * v);
    let (face, double_area) = normal_of(e1, e2);
    let w = 1.0 - u - v;
    let (n_g, n_s) = orient([a, b, c], shape, face, [w, u, v]);
    let uv = if shape.has_uvs { a.uv * w + b.uv * u + c.uv * v } else { Vec2::new(u, v) };
    let dp_du = if shape.needs_tangent { tangent([a, b, c], shape, n_g) } else { Vec3::ZERO };
    Local { p, p_error: triangle_error(p, triangle_slack(e1, e2, double_area)), n_g, n_s, dp_du, uv }
}

/// Geometric and shading normal. Vertex normals decide the side (they are flipped already);
/// without them the order of the vertices does.
#[inline(always)]
pub(super) fn orient([a, b, c]: [&Vertex; 3], shape: &Shape, face: Vec3, [w, u, v]: [f32; 3]) -> (Vec3, Vec3) {
    if shape.has_normals {
        let n = a.n * w + b.n * u + c.n * v;
        let l2 = n.length_squared();
        if l2 > 1e-12 {
            let n_s = n / l2.sqrt();
            return (face * 1f32.copysign(face.dot(n_s)), n_s);
        }
    }
    let n = if shape.flip { -face } else { face };
    (n, n)
}

/// Below this cosine between face and vertex normal, rounding may decide the side.
const DOUBTFUL: f32 = 1e-3;

/// +1 where the geometric normal is that of the order of the vertices, −1 where it is the other one; `None`
/// where vertex normals may choose either within the triangle.
pub(super) fn side([a, b, c]: [&Vertex; 3], shape: &Shape) -> Option<f32> {
    if !shape.has_normals {
        return Some(if shape.flip { -1.0 } else { 1.0 });
    }
    let (face, _) = normal_of(b.p - a.p, c.p - a.p);
    let cosines = [a, b, c].map(|v| v.n.dot(face));
    if cosines.iter().all(|c| *c > DOUBTFUL) {
        Some(1.0)
    } else if cosines.iter().all(|c| *c < -DOUBTFUL) {
        Some(-1.0)
    } else {
        None
    }
}

/// ∂p/∂u from the three texture coordinates; the first edge without any (u is then its barycentric
/// coordinate); any tangent where they are degenerate.
fn tangent([a, b, c]: [&Vertex; 3], shape: &Shape, n_g: Vec3) -> Vec3 {
    let (e1, e2) = (b.p - a.p, c.p - a.p);
    if !shape.has_uvs {
        return e1;
    }
    let (d1, d2) = (b.uv - a.uv, c.uv - a.uv);
    let det = d1.perp_dot(d2);
    let dp_du = (e1 * d2.y - e2 * d1.y) / det;
    if det != 0.0 && dp_du.is_finite() { dp_du } else { Frame::around(n_g).s }
}
