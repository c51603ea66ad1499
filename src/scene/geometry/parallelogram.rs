//! Flat lamps of two triangles, of which all points are alike: what such a point needs, in one place of memory.
//!
//! A rectangle, and what a modelling program writes for one: next events on it wait for no list of triangles, and
//! points that fill the unit square evenly fill it evenly too.

use super::bake::{Shape, Vertex};
use super::sample::ShapePoint;
use super::surface::{UNIT, normal_of, triangle_error, triangle_slack};
use super::triangle;
use glam::{Vec2, Vec3};

/// a + (b − a)·u + (c − a)·v over the unit square of (u + v, v): the corners are a, b, c and a + c − b.
#[derive(Clone, Copy, Debug)]
pub(super) struct Parallelogram {
    corner: Vec3,
    edges: [Vec3; 2],
    uv: Vec2,
    uv_edges: [Vec2; 2],
    n_g: Vec3,
    /// See [`triangle_slack`].
    slack: f32,
}

impl Parallelogram {
    /// Of two triangles, if they are one on one side, with texture coordinates that go on from one to the other where those
    /// are needed.
    pub(super) fn of(triangles: [[&Vertex; 3]; 2], shape: &Shape) -> Option<Self> {
        let [first, second] = triangles;
        // b and d face the common edge from either side.
        let lone = |of: [&Vertex; 3], others| {
            let mut lone = (0..3).filter(|i| shared(of[*i], others).is_none());
            lone.next().filter(|_| lone.next().is_none())
        };
        let (i, d) = (lone(first, second)?, second[lone(second, first)?]);
        let [a, b, c] = [first[(i + 2) % 3], first[i], first[(i + 1) % 3]];
        let largest = [a, b, c, d].map(|v| v.p.abs().max_element()).into_iter().fold(0.0, f32::max);
        let off = (a.p.as_dvec3() + c.p.as_dvec3() - b.p.as_dvec3() - d.p.as_dvec3()).abs().max_element();
        // Each corner may be rounded by half an ulp.
        if off > f64::from(4.0 * UNIT * largest) || !one_sided(triangles, shape) {
            return None;
        }
        let seamless = |v: &Vertex| shared(v, second).is_some_and(|o| o.uv == v.uv);
        let goes_on = (a.uv + c.uv - b.uv - d.uv).abs().max_element() < 1e-5;
        if shape.needs_uv && !(shape.has_uvs && seamless(a) && seamless(c) && goes_on) {
            return None;
        }
        let at = |u, v| triangle::surface([a, b, c], shape, u, v);
        let (corner, edges) = (at(0.0, 0.0), [b.p - a.p, c.p - a.p]);
        Some(Self {
            corner: a.p,
            edges,
            uv: corner.uv,
            uv_edges: [at(1.0, 0.0).uv - corner.uv, at(0.0, 1.0).uv - corner.uv],
            n_g: corner.n_g,
            slack: triangle_slack(edges[0], edges[1], normal_of(edges[0], edges[1]).1),
        })
    }

    /// The point of `u` in the unit square, uniform by area if `u` is; `p_a` its density.
    #[inline]
    pub(super) fn at(&self, u: Vec2, p_a: f32) -> ShapePoint {
        let (u, v) = (u.x - u.y, u.y);
        let p = self.corner + (self.edges[0] * u + self.edges[1] * v);
        let uv = self.uv + self.uv_edges[0] * u + self.uv_edges[1] * v;
        ShapePoint { p, p_error: triangle_error(p, self.slack), n_g: self.n_g, uv, p_a }
    }
}

/// The vertex at the same place.
fn shared<'a>(v: &Vertex, among: [&'a Vertex; 3]) -> Option<&'a Vertex> {
    among.into_iter().find(|o| o.p == v.p)
}

/// Whether the geometric normal is the same all over two triangles in one plane.
fn one_sided(triangles: [[&Vertex; 3]; 2], shape: &Shape) -> bool {
    let normal = |t: [&Vertex; 3]| Some(normal_of(t[1].p - t[0].p, t[2].p - t[0].p).0 * triangle::side(t, shape)?);
    let [first, second] = triangles.map(normal);
    first.zip(second).is_some_and(|(a, b)| a.dot(b) > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{EmitterId, MaterialId};

    fn shape(has_normals: bool, needs_uv: bool) -> Shape {
        Shape {
            material: MaterialId(0),
            emitter: EmitterId(0),
            flip: false,
            has_normals,
            has_uvs: true,
            needs_tangent: false,
            needs_uv,
        }
    }

    fn square() -> [Vertex; 4] {
        [(0.1, 0.2), (2.3, 0.2), (2.3, 1.7), (0.1, 1.7)].map(|(x, y)| Vertex {
            p: Vec3::new(x, y, 0.7),
            n: Vec3::Z,
            uv: Vec2::new(x / 2.2, y / 1.5),
        })
    }

    #[test]
    fn two_triangles_in_any_order_of_corners_are_one() {
        let v = square();
        let turned = |t: [usize; 3], by: usize| [0, 1, 2].map(|i| &v[t[(i + by) % 3]]);
        for (i, j) in (0..9).map(|k| (k / 3, k % 3)) {
            for (first, second) in [([0, 1, 2], [0, 2, 3]), ([1, 2, 3], [1, 3, 0])] {
                let it = Parallelogram::of([turned(first, i), turned(second, j)], &shape(false, true)).unwrap();
                let mut reached = [false; 4];
                for u in [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE] {
                    let s = it.at(u, 1.0);
                    let k = v.iter().position(|v| (v.p - s.p).length() < 1e-6 && (v.uv - s.uv).length() < 1e-6);
                    reached[k.unwrap()] = true;
                    assert_eq!(s.n_g, Vec3::Z);
                }
                assert_eq!(reached, [true; 4], "{first:?} turned by {i}, {second:?} by {j}");
            }
        }
    }

    #[test]
    fn what_is_not_flat_or_changes_side_or_has_a_seam_stays_two_triangles() {
        let of = |v: [Vertex; 4], s: &Shape| Parallelogram::of([[&v[0], &v[1], &v[2]], [&v[0], &v[2], &v[3]]], s).is_some();
        let changed = |change: fn(&mut [Vertex; 4])| {
            let mut v = square();
            change(&mut v);
            v
        };
        assert!(of(square(), &shape(true, true)));
        assert!(!of(changed(|v| v[3].p.z += 1e-5), &shape(true, true)));
        assert!(!of(changed(|v| v[3].p.x -= 0.1), &shape(true, true)));
        assert!(!of(changed(|v| v[3].n = -Vec3::Z), &shape(true, true)));
        assert!(of(changed(|v| v[3].n = -Vec3::Z), &shape(false, true)));
        assert!(!of(changed(|v| v[3].uv.x += 0.1), &shape(true, true)));
        assert!(of(changed(|v| v[3].uv.x += 0.1), &shape(true, false)));
        let v = square();
        assert!(Parallelogram::of([[&v[0], &v[1], &v[2]], [&v[0], &v[3], &v[2]]], &shape(false, false)).is_none());
        assert!(Parallelogram::of([[&v[0], &v[1], &v[2]], [&v[0], &v[1], &v[2]]], &shape(false, false)).is_none());
    }
}
