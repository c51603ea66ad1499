//! What geometry is built from: shapes with all names resolved and all files read.

use crate::describe::{Mesh, Place};
use crate::scene::{EmitterId, MaterialId};
use glam::{Mat4, Vec3};
use std::sync::Arc;

/// A shape of the scene or of a group.
#[derive(Clone, Debug)]
pub struct ShapeInput {
    /// Geometry in its own coordinates.
    pub form: Form,
    /// Own coordinates to world (or to the group's coordinates).
    pub to_world: Mat4,
    /// Normals point the other way.
    pub flip_normals: bool,
    /// Its local model.
    pub material: MaterialId,
    /// Its area emitter, or [`EmitterId::NONE`].
    pub emitter: EmitterId,
    /// Its material asks for ∂p/∂u; otherwise `Surface::dp_du` is zero.
    pub needs_tangent: bool,
    /// Its material or its emitter asks for texture coordinates; otherwise `Surface::uv` may be anything.
    pub needs_uv: bool,
    /// Where it is described.
    pub place: Place,
}

impl ShapeInput {
    /// A shape with material 0, no emission and no transform.
    pub fn new(form: Form) -> Self {
        Self {
            form,
            to_world: Mat4::IDENTITY,
            flip_normals: false,
            material: MaterialId(0),
            emitter: EmitterId::NONE,
            needs_tangent: false,
            needs_uv: true,
            place: Place::default(),
        }
    }

    /// The same under `to_world`.
    #[must_use]
    pub fn at(self, to_world: Mat4) -> Self {
        Self { to_world, ..self }
    }
}

/// Geometry of a shape.
#[derive(Clone, Debug)]
pub enum Form {
    /// Triangle mesh.
    Mesh {
        /// Vertices and triangles.
        mesh: Arc<Mesh>,
        /// Face normals even where the mesh has vertex normals.
        face_normals: bool,
    },
    /// [-1, 1]² in the plane z = 0, normal +z.
    Rectangle,
    /// Unit disk in the plane z = 0, normal +z.
    Disk,
    /// [-1, 1]³.
    Cube,
    /// Sphere.
    Sphere {
        /// Centre before `to_world`.
        center: Vec3,
        /// Radius before `to_world`.
        radius: f32,
    },
    /// Open cylinder.
    Cylinder {
        /// One end of the axis.
        p0: Vec3,
        /// Other end of the axis.
        p1: Vec3,
        /// Radius before `to_world`.
        radius: f32,
    },
    /// A copy of a group; material, emitter and `flip_normals` are those of the group's shapes.
    Instance {
        /// Index into the groups.
        group: u32,
    },
}
