//! Surface points with a bound of their rounding error, and ray origins moved off them.
//!
//! A point computed on a surface lies beside it by rounding, and the test of the next ray against
//! the same surface is itself rounded. `p_error` bounds the sum of both, from the magnitudes that
//! were really added (the coordinates and the extent of the triangle), so that an origin moved by
//! it is on the right side in the eyes of the traversal at any scale and place of the scene, and by
//! no more than some ulps: nothing nearby is skipped. Compare [Pharr 2023, sec. 6.8], whose bounds
//! cover the point but not the test.

use super::bake::Shape;
use crate::scene::Surface;
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

impl Local {
    /// As a point of shape `index`.
    #[inline(always)]
    pub(super) fn on(self, index: u32, shape: &Shape) -> Surface {
        Surface {
            p: self.p,
            p_error: self.p_error,
            n_g: self.n_g,
            n_s: self.n_s,
            dp_du: self.dp_du,
            uv: self.uv,
            shape: index,
            material: shape.material,
            emitter: shape.emitter,
        }
    }
}

/// Ray origin moved off the surface to the side of `d`, by no more than rounding asks for.
///
/// `p_error` is the bound that came with `p`; `n_g` the unit geometric normal, or zero for a point
/// that is not on a surface (a camera, a point light), which stays where it is. `d` need not be
/// unit.
#[inline]
pub fn offset_origin(p: Vec3, p_error: f32, n_g: Vec3, d: Vec3) -> Vec3 {
    let n = n_g.abs();
    // The sum itself is rounded by one unit roundoff of p. The rest clears the slack by which boxes
    // are widened for traversal (10 and 8 units), so that the flat box of a wall is not visited by
    // the rays that leave it.
    let distance = (p_error + 20.0 * UNIT * p.abs().max_element()) * (n.x + n.y + n.z);
    p + n_g * distance.copysign(d.dot(n_g))
}

/// Bound for the point `p` of a triangle with this [`triangle_slack`].
#[inline(always)]
pub(super) fn triangle_error(p: Vec3, slack: f32) -> f32 {
    UNIT * (p.abs().max_element() + slack)
}

/// What all points of a triangle with edges `e1`, `e2` from its first vertex have in common of that bound, in units of
/// roundoff.
///
/// The point `a + u·e1 + v·e2`: half an ulp of each coordinate and some roundings in the edges.
/// The test: the ray parameter is Σ z_i·area_i / Σ area_i over the corners as seen along the ray,
/// where areas are rounded relative to the product of two extents; the more skew a triangle is, the
/// larger that is against the area itself. The two factors are three times those at which twelve
/// million rays, leaving slivers, bumpy meshes and wide floors at all scales and in grazing
/// directions, met nothing.
#[inline(always)]
pub(super) fn triangle_slack(e1: Vec3, e2: Vec3, double_area: f32) -> f32 {
    let (a, b) = (e1.length_squared(), e2.length_squared());
    let longest = a.max(b).sqrt();
    let skew = (a * b).sqrt() / double_area;
    longest * (3.0 + 1.5 * skew)
}

/// Bound for a point that was computed in double precision and rounded once.
#[inline]
pub(super) fn rounded_error(p: Vec3) -> f32 {
    UNIT * p.abs().max_element() + f32::MIN_POSITIVE
}

/// Unit normal and length of a cross product in single precision, safe for tiny triangles.
#[inline(always)]
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
