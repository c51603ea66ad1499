//! Shapes in the coordinates of their tree, ready for rays: transforms applied, all of it checked.
//!
//! Vertices are mapped in double precision and rounded once, so that triangles of one mesh that
//! share a vertex still share it afterwards.

use super::analytic::Analytic;
use super::cylinder::Cylinder;
use super::disk::Disk;
use super::input::{Form, ShapeInput};
use super::meshes;
use super::parallelogram::Parallelogram;
use super::ray::NONE;
use super::sphere::Sphere;
use crate::describe::{Mesh, Place, Problems};
use crate::math::Frame;
use crate::scene::{EmitterId, MaterialId};
use glam::{DAffine3, DMat3, DMat4, DVec3, Vec2, Vec3};

/// A vertex of a mesh: half a cache line.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct Vertex {
    pub(super) p: Vec3,
    pub(super) n: Vec3,
    pub(super) uv: Vec2,
}

/// A triangle, or (with `v[0]` = [`NONE`]) the analytic shape `v[1]`.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub(super) struct Prim {
    pub(super) v: [u32; 3],
    pub(super) shape: u32,
}

/// What surface points of a shape have in common.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    pub(super) material: MaterialId,
    pub(super) emitter: EmitterId,
    pub(super) flip: bool,
    pub(super) has_normals: bool,
    pub(super) has_uvs: bool,
    pub(super) needs_tangent: bool,
    pub(super) needs_uv: bool,
}

/// How points of a shape are drawn uniformly by area.
#[derive(Clone, Debug)]
pub(super) enum Sampler {
    /// Instances and members of groups: not asked for.
    Never,
    /// Triangles from primitive `first` on, chosen by the running sum of areas (normalised).
    Triangles { first: u32, cdf: Vec<f64> },
    /// The two triangles from primitive `first` on, as one.
    Parallelogram { first: u32, plane: Parallelogram },
    /// An analytic shape.
    Analytic { index: u32 },
}

/// Everything of all trees but the trees.
#[derive(Default)]
pub(super) struct Baked {
    pub(super) vertices: Vec<Vertex>,
    pub(super) prims: Vec<Prim>,
    pub(super) shapes: Vec<Shape>,
    pub(super) samplers: Vec<(Sampler, f64)>,
    pub(super) analytic: Vec<(Analytic, u32)>,
    /// Group, transform and shape of each instance.
    pub(super) placed: Vec<(u32, DAffine3)>,
    pub(super) problems: Problems,
}

impl Baked {
    /// Adds a shape; `groups` = how many groups there are, `None` inside a group.
    pub(super) fn add(&mut self, input: &ShapeInput, groups: Option<usize>) {
        let index = self.shapes.len() as u32;
        self.shapes.push(Shape {
            material: input.material,
            emitter: input.emitter,
            flip: input.flip_normals,
            has_normals: false,
            has_uvs: false,
            needs_tangent: input.needs_tangent,
            needs_uv: input.needs_uv,
        });
        self.samplers.push((Sampler::Never, 0.0));
        if groups.is_none() && input.emitter != EmitterId::NONE {
            self.problems.error(input.place, "a shape inside a group cannot be an area emitter");
        }
        let Some(m) = self.affine(input) else { return };
        match &input.form {
            Form::Mesh { mesh, face_normals } => self.mesh(index, mesh, &m, *face_normals, input.place),
            Form::Cube => self.mesh(index, &meshes::cube(), &m, false, input.place),
            Form::Rectangle => self.mesh(index, &meshes::rectangle(), &m, false, input.place),
            Form::Disk => self.analytic(index, Analytic::Disk(Disk::new(m, input.flip_normals))),
            Form::Sphere { center, radius } => self.sphere(index, center.as_dvec3(), f64::from(*radius), &m, input),
            Form::Cylinder { p0, p1, radius } => {
                self.cylinder(index, [p0.as_dvec3(), p1.as_dvec3()], f64::from(*radius), &m, input)
            }
            Form::Instance { group } => match groups {
                None => {
                    self.problems.error(input.place, "an instance inside a group is not supported");
                }
                Some(n) if *group as usize >= n => {
                    self.problems.error(input.place, "the instance refers to a group that does not exist");
                }
                Some(_) => self.placed.push((*group, m)),
            },
        }
    }

    /// The transform, if it is affine, finite and invertible.
    fn affine(&mut self, input: &ShapeInput) -> Option<DAffine3> {
        let m: DMat4 = input.to_world.as_dmat4();
        if !m.is_finite() {
            self.problems.error(input.place, "the transform `to_world` has entries that are not finite");
            return None;
        }
        if m.row(3) != glam::DVec4::W {
            self.problems.error(input.place, "the transform `to_world` is not affine (last row other than 0 0 0 1)");
            return None;
        }
        let affine = DAffine3::from_mat4(m);
        let columns = affine.matrix3.to_cols_array_2d().map(|c| DVec3::from(c).length());
        let det = affine.matrix3.determinant().abs();
        let invertible = det > 1e-12 * columns.iter().product::<f64>() && det > 1e-60;
        if !invertible {
            let p = self.problems.error(input.place, "the transform `to_world` is not invertible");
            p.hint("a scale of zero along some axis makes a shape without extent");
            return None;
        }
        Some(affine)
    }

    fn analytic(&mut self, shape: u32, form: Analytic) {
        let index = self.analytic.len() as u32;
        self.analytic.push((form, self.prims.len() as u32));
        self.prims.push(Prim { v: [NONE, index, 0], shape });
        self.samplers[shape as usize] = (Sampler::Analytic { index }, form.area());
    }

    fn sphere(&mut self, shape: u32, center: DVec3, radius: f64, m: &DAffine3, input: &ShapeInput) {
        if !self.sound(center, radius, "sphere", input.place) {
            return;
        }
        let [x, y, z] = [m.matrix3.x_axis, m.matrix3.y_axis, m.matrix3.z_axis];
        if !(square(x, y) && square(y, z) && square(z, x)) {
            let p = self.problems.error(input.place, "a sphere cannot be scaled differently along its axes or sheared");
            p.hint("use a mesh for an ellipsoid");
            return;
        }
        let sphere = Sphere::new(m.transform_point3(center), m.matrix3 * radius, input.flip_normals);
        self.analytic(shape, Analytic::Sphere(sphere));
    }

    fn cylinder(&mut self, shape: u32, [p0, p1]: [DVec3; 2], radius: f64, m: &DAffine3, input: &ShapeInput) {
        if !self.sound(p0, radius, "cylinder", input.place) || !self.sound(p1, radius, "cylinder", input.place) {
            return;
        }
        let axis = p1 - p0;
        let Some(n) = axis.try_normalize() else {
            self.problems.error(input.place, "the two ends of the cylinder's axis are the same point");
            return;
        };
        let frame = Frame::around(n.as_vec3());
        let own = DMat3::from_cols(frame.s.as_dvec3() * radius, frame.t.as_dvec3() * radius, axis);
        let own = DAffine3 { matrix3: m.matrix3 * own, translation: m.transform_point3(p0) };
        let [x, y, z] = [own.matrix3.x_axis, own.matrix3.y_axis, own.matrix3.z_axis];
        let upright = |a: DVec3| a.dot(z).abs() < 1e-4 * a.length() * z.length();
        if !(square(x, y) && upright(x) && upright(y)) {
            self.problems.error(input.place, "a cylinder's section must stay round: no shear, no unequal scale across its axis");
            return;
        }
        self.analytic(shape, Analytic::Cylinder(Cylinder::new(own, input.flip_normals)));
    }

    fn sound(&mut self, p: DVec3, radius: f64, what: &str, place: Place) -> bool {
        let sound = p.is_finite() && radius.is_finite() && radius > 0.0;
        if !sound {
            self.problems.error(place, format!("a {what} needs finite points and a radius above zero"));
        }
        sound
    }

    fn mesh(&mut self, shape: u32, mesh: &Mesh, m: &DAffine3, face_normals: bool, place: Place) {
        if !self.check_mesh(mesh, place) {
            return;
        }
        let has_normals = !face_normals && !mesh.normals.is_empty();
        let flip = self.shapes[shape as usize].flip;
        let turn = m.matrix3.inverse().transpose() * if flip { -1.0 } else { 1.0 };
        let base = self.vertices.len() as u32;
        let first = self.prims.len() as u32;
        for (i, p) in mesh.positions.iter().enumerate() {
            let n = if has_normals { (turn * mesh.normals[i].as_dvec3()).normalize_or_zero().as_vec3() } else { Vec3::ZERO };
            let uv = mesh.uvs.get(i).copied().unwrap_or(Vec2::ZERO);
            self.vertices.push(Vertex { p: m.transform_point3(p.as_dvec3()).as_vec3(), n, uv });
        }
        if let Some(at) = self.vertices[base as usize..].iter().position(|v| !v.p.is_finite()) {
            self.problems.error(place, format!("vertex {at} of the mesh is not finite where the transform puts it"));
            return;
        }
        let mut cdf = vec![0.0f64];
        let mut area = 0.0;
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| self.vertices[(base + i) as usize].p.as_dvec3());
            let double = (b - a).cross(c - a).length();
            // Below this, single precision sees no plane.
            if double > 1e-36 && double > 1e-14 * (b - a).length_squared().max((c - a).length_squared()) {
                area += 0.5 * double;
                cdf.push(area);
                self.prims.push(Prim { v: t.map(|i| base + i), shape });
            }
        }
        let dropped = mesh.triangles.len() - (cdf.len() - 1);
        if dropped > 0 {
            self.problems.warning(place, format!("{dropped} triangles without area were left out"));
        }
        cdf.iter_mut().for_each(|c| *c /= area);
        self.samplers[shape as usize] =
            if area > 0.0 { (Sampler::Triangles { first, cdf }, area) } else { (Sampler::Never, 0.0) };
        let own = &mut self.shapes[shape as usize];
        own.has_normals = has_normals;
        own.has_uvs = !mesh.uvs.is_empty();
        if let [one, two] = self.prims[first as usize..]
            && let Some(plane) = Parallelogram::of([one, two].map(|p| p.v.map(|v| &self.vertices[v as usize])), own)
        {
            self.samplers[shape as usize] = (Sampler::Parallelogram { first, plane }, area);
        }
    }

    fn check_mesh(&mut self, mesh: &Mesh, place: Place) -> bool {
        let n = mesh.positions.len();
        let before = self.problems.list.len();
        if !mesh.normals.is_empty() && mesh.normals.len() != n {
            self.problems.error(place, format!("the mesh has {n} vertices but {} normals", mesh.normals.len()));
        }
        if !mesh.uvs.is_empty() && mesh.uvs.len() != n {
            self.problems.error(place, format!("the mesh has {n} vertices but {} texture coordinates", mesh.uvs.len()));
        }
        if let Some(at) = mesh.positions.iter().position(|p| !p.is_finite()) {
            self.problems.error(place, format!("vertex {at} of the mesh is not finite"));
        }
        if let Some(at) = mesh.triangles.iter().position(|t| t.iter().any(|i| *i as usize >= n)) {
            self.problems.error(place, format!("triangle {at} of the mesh refers to a vertex beyond the {n} there are"));
        }
        self.problems.list.len() == before
    }
}

/// Orthogonal and of equal length, as far as single precision can say after some products?
fn square(a: DVec3, b: DVec3) -> bool {
    let (aa, bb) = (a.length_squared(), b.length_squared());
    a.dot(b).abs() < 1e-4 * aa.max(bb) && (aa - bb).abs() < 2e-4 * aa.max(bb)
}
