//! Surface points with a bound of their rounding error, and ray origins moved off them.
//!
//! A point computed on a surface lies beside it by rounding, and the test of the next ray against
//! the same surface is itself rounded. `p_error` bounds the sum of both, from the magnitudes that
//! were really added (the coordinates and the extent of the triangle), so that an origin moved by
//! it is on the right side in the eyes of the traversal at any scale and place of the scene, and by
//! no more than some ulps: nothing nearby is skipped. Compare [Pharr 2023, sec. 6.8], whose bounds
//! cover the point but not the test.

use glam::{DVec3, Vec2, Vec3};

/// Unit roundoff of single precision, 2⁻²⁴.
pub(super) const UNIT: f32 = f32::EPSILON / 2.0;

/// A surface point in the coordinates of its tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Local {
    pub(super) p: Vec3,
    pub(super) p_error: f32,
    pub(super) n_g: Vec3,
    pub(super) n_s: Vec3,
    pub(super) dp_du: Vec3,
    pub(super) uv: Vec2,
}

/// Ray origin moved off the surface to the side of `d`, by no more than rounding asks for.
///
/// `p_error` is the bound that came with `p`; `n_g` the unit geometric normal, or zero for a point
/// that is not on a surface (a camera, a point light), which stays where it is. `d` need not be
/// unit.
#[inline]
pub fn offset_origin(p: Vec3, p_error: f32, n_g: Vec3, d: Vec3) -> Vec3 {
    let n = n_g.abs();
    // The sum itself is rounded to the ulps of p: one unit roundoff of its largest coordinate, doubled.
    let distance = (p_error + 2.0 * UNIT * p.abs().max_element()) * (n.x + n.y + n.z);
    p + n_g * distance.copysign(d.dot(n_g))
}

/// Bound for the point of a triangle with edges `e1`, `e2` from its first vertex.
///
/// The point `a + u·e1 + v·e2`: half an ulp of each coordinate and five roundings in the edges.
/// The test: the ray's origin is seen at the side of n·(a − o), where the product of three terms
/// and the subtractions before it round relative to the triangle's extent, and the direction of n
/// is the worse the more skew the triangle is.
#[inline]
pub(super) fn triangle_error(p: Vec3, e1: Vec3, e2: Vec3, double_area: f32) -> f32 {
    let (a, b) = (e1.length_squared(), e2.length_squared());
    let longest = a.max(b).sqrt();
    let skew = (a * b).sqrt() / double_area;
    UNIT * (p.abs().max_element() + longest * (8.0 + 4.0 * skew))
}

/// Bound for a point that was computed in double precision and rounded once.
#[inline]
pub(super) fn rounded_error(p: Vec3) -> f32 {
    UNIT * p.abs().max_element() + f32::MIN_POSITIVE
}

/// Unit normal and length of a cross product in single precision, safe for tiny triangles.
#[inline]
pub(super) fn normal_of(e1: Vec3, e2: Vec3) -> (Vec3, f32) {
    let n = e1.cross(e2);
    let l2 = n.length_squared();
    if l2 > 1e-30 && l2 < 1e30 {
        let l = l2.sqrt();
        return (n / l, l);
    }
    let n: DVec3 = e1.as_dvec3().cross(e2.as_dvec3());
    let l = n.length();
    ((n / l).as_vec3(), l as f32)
}
