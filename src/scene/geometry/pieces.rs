//! Primitives as charts, (s, t) ↦ surface point, from which finite elements are cut.
//!
//! Every chart has a constant area element dA = A·ds dt: equal parts of the parameter set are equal
//! parts of the surface. A triangle has the barycentric coordinates of its second and third vertex
//! (s, t ≥ 0, s + t ≤ 1); the others have the unit square: a disk Shirley's concentric map, a cylinder
//! (φ/2π, z), a sphere the octahedral map that keeps areas [Pharr 2023, sec. 3.8.3], which has no
//! poles at which elements would be slivers.

use super::analytic::Analytic;
use super::bake::Prim;
use super::ray::{Hit, NONE};
use super::surface::{Local, rounded_error};
use super::{Geometry, triangle};
use crate::math::warp::disk_concentric_inverse;
use crate::scene::{EmitterId, MaterialId, Surface};
use glam::{DVec2, DVec3, Vec2, Vec3};
use std::f64::consts::{FRAC_2_PI, FRAC_PI_4};

/// A primitive where it is placed.
#[derive(Clone, Copy, Debug)]
pub struct Piece {
    prim: u32,
    instance: u32,
    /// Shape, as the geometry counts them.
    pub shape: u32,
    /// Local model of the shape.
    pub material: MaterialId,
    /// Area emitter of the shape, or none.
    pub emitter: EmitterId,
    /// Area in the world, m².
    pub area: f64,
    /// The chart is a triangle, not a square.
    pub triangle: bool,
    /// The chart keeps areas: all do but those of spheres and cylinders that an instance stretches.
    pub even: bool,
    /// Vertex normals that lean from the face by more than rounding would.
    pub smooth: bool,
}

/// All primitives where they are placed: those of the scene, then those of each instance.
pub struct Pieces {
    /// In the order of [`Self::index_of`].
    pub list: Vec<Piece>,
    /// What is added to the number of a primitive seen through an instance.
    shifts: Vec<i64>,
}

impl Pieces {
    /// The piece that a ray met.
    #[inline]
    pub fn index_of(&self, hit: &Hit) -> usize {
        let shift = if hit.instance == NONE { 0 } else { self.shifts[hit.instance as usize] };
        (i64::from(hit.prim) + shift) as usize
    }
}

impl Geometry {
    /// All pieces of the scene.
    pub fn pieces(&self) -> Pieces {
        let of = |range: std::ops::Range<usize>, instance: u32| range.map(move |prim| self.piece(prim as u32, instance));
        let mut list: Vec<Piece> = of(0..self.ends[0], NONE).collect();
        let mut shifts = vec![];
        for (i, group) in self.placed_groups.iter().enumerate() {
            let range = self.ends[*group as usize]..self.ends[*group as usize + 1];
            shifts.push(list.len() as i64 - range.start as i64);
            list.extend(of(range, i as u32));
        }
        Pieces { list, shifts }
    }

    fn piece(&self, prim: u32, instance: u32) -> Piece {
        let shape_index = self.tree.prims[prim as usize].shape;
        let shape = &self.shapes[shape_index as usize];
        let mut piece = Piece {
            prim,
            instance,
            shape: shape_index,
            material: shape.material,
            emitter: shape.emitter,
            area: 0.0,
            triangle: self.tree.prims[prim as usize].v[0] != NONE,
            even: true,
            smooth: false,
        };
        if piece.triangle {
            let [a, b, c] = self.corners(&piece);
            piece.area = 0.5 * (b - a).cross(c - a).length();
            piece.smooth = shape.has_normals && self.is_smooth(&self.tree.prims[prim as usize]);
        } else {
            let form = &self.tree.analytic[self.tree.prims[prim as usize].v[1] as usize].0;
            piece.area = form.area();
            if instance != NONE {
                let [a, b, c] = self.corners(&piece);
                let [oa, ob, oc] = self.corners(&Piece { instance: NONE, ..piece });
                let growth = (b - a).cross(c - a).length() / (ob - oa).cross(oc - oa).length();
                piece.area *= growth;
                piece.even = matches!(form, Analytic::Disk(_)) || self.tree.instances[instance as usize].is_similarity();
            }
        }
        piece
    }

    /// Three points of the piece that span a plane.
    fn corners(&self, piece: &Piece) -> [DVec3; 3] {
        let at = if piece.triangle {
            [Vec2::ZERO, Vec2::X, Vec2::Y]
        } else {
            [Vec2::new(0.3, 0.3), Vec2::new(0.7, 0.3), Vec2::new(0.3, 0.6)]
        };
        at.map(|st| self.piece_point(piece, st).p.as_dvec3())
    }

    fn is_smooth(&self, prim: &Prim) -> bool {
        let [a, b, c] = prim.v.map(|i| &self.vertices[i as usize]);
        let face = (b.p - a.p).as_dvec3().cross((c.p - a.p).as_dvec3()).normalize_or_zero();
        [a, b, c].iter().any(|v| v.n.as_dvec3().dot(face).abs() < 1.0 - 1e-5)
    }

    /// The point of a piece with parameters `st`.
    pub fn piece_point(&self, piece: &Piece, st: Vec2) -> Surface {
        let prim = &self.tree.prims[piece.prim as usize];
        let shape = &self.shapes[prim.shape as usize];
        let local = if piece.triangle {
            triangle::surface(prim.v.map(|i| &self.vertices[i as usize]), shape, st.x, st.y)
        } else {
            let (p, n, uv) = match &self.tree.analytic[prim.v[1] as usize].0 {
                Analytic::Sphere(sphere) => sphere.at(octahedral(st.as_dvec2())),
                Analytic::Disk(disk) => disk.sample_area(st),
                Analytic::Cylinder(cylinder) => cylinder.sample_area(st),
            };
            let (p, n) = (p.as_vec3(), n.as_vec3());
            Local { p, p_error: rounded_error(p), n_g: n, n_s: n, dp_du: Vec3::ZERO, uv }
        };
        let placed = match piece.instance {
            NONE => local,
            i => self.tree.instances[i as usize].point_to_world(&local),
        };
        placed.on(prim.shape, shape)
    }

    /// Parameters of the point that a ray met, in the chart of its piece.
    #[inline]
    pub fn chart(&self, hit: &Hit, surface: &Surface) -> Vec2 {
        let prim = &self.tree.prims[hit.prim as usize];
        if prim.v[0] != NONE {
            return Vec2::new(hit.u, hit.v);
        }
        let p = match hit.instance {
            NONE => surface.p,
            i => self.tree.instances[i as usize].point_to_group(surface.p),
        };
        match &self.tree.analytic[prim.v[1] as usize].0 {
            Analytic::Sphere(sphere) => octahedral_inverse(sphere.direction(p.as_dvec3())).as_vec2(),
            Analytic::Disk(disk) => disk_concentric_inverse(disk.place(p.as_dvec3()).as_vec2()),
            Analytic::Cylinder(_) => surface.uv,
        }
    }
}

/// Unit square to unit sphere, keeping areas, without a seam ([`crate::math::warp::sphere_charts`] has
/// one, at which cells would have no corners).
fn octahedral(st: DVec2) -> DVec3 {
    let o = 2.0 * st - DVec2::ONE;
    let a = o.abs();
    let inside = 1.0 - (a.x + a.y);
    let r = 1.0 - inside.abs();
    let phi = if r == 0.0 { FRAC_PI_4 } else { ((a.y - a.x) / r + 1.0) * FRAC_PI_4 };
    let across = r * (2.0 - r * r).sqrt();
    let (sin, cos) = phi.sin_cos();
    DVec3::new((cos * across).copysign(o.x), (sin * across).copysign(o.y), (1.0 - r * r).copysign(inside))
}

/// Unit sphere to unit square.
fn octahedral_inverse(w: DVec3) -> DVec2 {
    let a = w.abs();
    let r = (1.0 - a.z).max(0.0).sqrt();
    let phi = a.y.atan2(a.x) * FRAC_2_PI;
    let v = phi * r;
    let u = r - v;
    let (u, v) = if w.z < 0.0 { (1.0 - v, 1.0 - u) } else { (u, v) };
    0.5 * (DVec2::new(u.copysign(w.x), v.copysign(w.y)) + DVec2::ONE)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid() -> impl Iterator<Item = Vec2> {
        (0..32 * 32).map(|i| (Vec2::new((i % 32) as f32, (i / 32) as f32) + Vec2::new(0.37, 0.61)) / 32.0)
    }

    #[test]
    fn the_octahedral_map_has_an_inverse() {
        for st in grid() {
            let back = octahedral_inverse(octahedral(st.as_dvec2()));
            assert!((back - st.as_dvec2()).length() < 1e-9, "{st} {back}");
        }
    }

    #[test]
    fn the_octahedral_map_keeps_areas() {
        let h = 1e-4;
        for st in grid().map(|st| st.as_dvec2()) {
            let [s, t] = [DVec2::X, DVec2::Y].map(|e| (octahedral(st + e * h) - octahedral(st - e * h)) / (2.0 * h));
            let area = s.cross(t).length();
            // Across a crease of the map the difference quotient means nothing.
            let crease = (st - 0.5).abs().min_element() < 2.0 * h || ((st - 0.5).abs().element_sum() - 0.5).abs() < 2.0 * h;
            assert!(crease || (area - 4.0 * std::f64::consts::PI).abs() < 1e-3, "{st}: {area}");
        }
    }
}
