//! From the description to the built scene: ids resolved, every problem of every part reported.
//!
//! Reads no file: meshes and images must be [`Data`](crate::describe::MeshDescription::Data).
//! Shapes keep their order, so that shape k of the description is shape k of the geometry; emitter
//! ids count the shapes that emit, then the emitters that belong to no shape.

use super::emitter::{EmitterInfo, Lights};
use super::geometry::{Form, Geometry, ShapeInput};
use super::hash::content_hash;
use super::sensor::Sensor;
use super::{EmitterId, MaterialId, Scene};
use crate::describe::{
    AreaEmission, MeshDescription, Place, Problems, SceneDescription, ShapeDescription, ShapeModel, TextureDescription,
};
use crate::local::Materials;
use glam::Vec3;

/// What there is in a scene, for people.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneInfo {
    /// Shapes, members of groups included.
    pub shapes: usize,
    /// Triangles, those of a group counted once.
    pub triangles: usize,
    /// Placed copies of groups.
    pub instances: usize,
    /// Local models that shapes have.
    pub materials: usize,
    /// Corners of the box around all shapes; `None` without shapes.
    pub bounds: Option<(Vec3, Vec3)>,
    /// Emitters with power and probabilities.
    pub emitters: Vec<EmitterInfo>,
    /// Bytes of vertices, trees and tables.
    pub geometry_bytes: usize,
    /// Bytes of the emitters' tables.
    pub emitter_bytes: usize,
    /// Bytes of images, as textures and emitters keep them.
    pub image_bytes: usize,
}

impl Scene {
    /// Builds what is seen by sensor `sensor` of the description. The problems that come with a scene
    /// are warnings; if there is an error, there is no scene and all that could be found is reported.
    pub fn build(description: &SceneDescription, sensor: usize) -> Result<(Self, Problems), Problems> {
        let mut problems = Problems::default();
        let materials = keep(Materials::build(&description.bsdfs, &description.images), &mut problems);
        let chosen = description.sensors.get(sensor);
        if chosen.is_none() {
            let what = match description.sensors.len() {
                0 => "the scene has no sensor".to_owned(),
                n => format!("there is no sensor {sensor}: the scene has {n}, counted from 0"),
            };
            problems.error(Place::default(), what);
        }
        let built_sensor = chosen.and_then(|s| Sensor::build(s, &mut problems));
        let shapes = Shapes::gather(description, materials.as_ref(), &mut problems);
        let used_materials = shapes.materials();
        let geometry = keep(Geometry::build(shapes.top, shapes.groups), &mut problems);
        // Without geometry the emitters are still checked, against nothing.
        let empty = if geometry.is_none() { Geometry::build(vec![], vec![]).ok() } else { None };
        let areas: &[_] = if geometry.is_some() { &shapes.areas } else { &[] };
        let lights = (geometry.as_ref().or(empty.as_ref()))
            .map(|g| Lights::build(areas, &description.emitters, &description.images, g, &mut problems));
        if problems.has_errors() {
            return Err(problems);
        }
        let (Some(materials), Some(geometry), Some(lights), Some(sensor), Some(chosen)) =
            (materials, geometry, lights, built_sensor, chosen)
        else {
            problems.error(Place::default(), "the scene could not be built");
            return Err(problems);
        };
        problems.list.extend(geometry.warnings().list.iter().cloned());
        let scene = Self {
            geometry,
            materials,
            lights,
            sensor,
            film: chosen.film.clone(),
            integrator: description.integrator.clone(),
            sample_count: chosen.sample_count,
            seed: chosen.seed,
            used_materials,
            hash: content_hash(description, chosen),
        };
        Ok((scene, problems))
    }

    /// What there is.
    pub fn info(&self) -> SceneInfo {
        let bounds = self.geometry.bounds();
        SceneInfo {
            shapes: self.geometry.shape_count(),
            triangles: self.geometry.triangle_count(),
            instances: self.geometry.instance_count(),
            materials: self.used_materials.len(),
            bounds: (!bounds.is_empty()).then_some((bounds.min, bounds.max)),
            emitters: self.lights.infos().to_vec(),
            geometry_bytes: self.geometry.bytes(),
            emitter_bytes: self.lights.bytes(),
            image_bytes: self.materials.image_bytes() + self.lights.image_bytes(),
        }
    }
}

/// The value, its problems moved to `problems` if it is none.
fn keep<T>(built: Result<T, Problems>, problems: &mut Problems) -> Option<T> {
    built.map_err(|p| problems.list.extend(p.list)).ok()
}

/// Shapes with their ids resolved.
#[derive(Default)]
struct Shapes<'a> {
    top: Vec<ShapeInput>,
    groups: Vec<Vec<ShapeInput>>,
    /// Shape and emission of every area emitter, by emitter id.
    areas: Vec<(u32, &'a AreaEmission)>,
}

impl<'a> Shapes<'a> {
    /// Local models of all that has a surface, in order.
    fn materials(&self) -> Vec<MaterialId> {
        let all = self.top.iter().chain(self.groups.iter().flatten());
        let mut ids: Vec<u32> = all.filter(|s| !matches!(s.form, Form::Instance { .. })).map(|s| s.material.0).collect();
        ids.sort_unstable();
        ids.dedup();
        ids.into_iter().map(MaterialId).collect()
    }

    /// All shapes; those that refer to what does not exist are reported and left out.
    fn gather(description: &'a SceneDescription, materials: Option<&Materials>, problems: &mut Problems) -> Self {
        let mut shapes = Self::default();
        for shape in &description.shapes {
            let Some(mut input) = input(shape, description, materials, problems) else { continue };
            if let Some(emission) = &shape.emission {
                if matches!(shape.model, ShapeModel::Instance { .. }) {
                    problems.error(emission.place, "an instance cannot be an area emitter");
                    continue;
                }
                input.emitter = EmitterId(shapes.areas.len() as u32);
                input.needs_uv |= !matches!(emission.radiance, TextureDescription::Constant(_));
                shapes.areas.push((shapes.top.len() as u32, emission));
            }
            shapes.top.push(input);
        }
        for group in &description.groups {
            for emission in group.shapes.iter().filter_map(|s| s.emission.as_ref()) {
                problems
                    .error(emission.place, "a shape inside a group cannot be an area emitter")
                    .hint("put the emitting shape beside the group, at top level");
            }
            let members = group.shapes.iter().filter_map(|s| input(s, description, materials, problems));
            shapes.groups.push(members.collect());
        }
        shapes
    }
}

/// A shape without emission.
fn input(
    shape: &ShapeDescription,
    description: &SceneDescription,
    materials: Option<&Materials>,
    problems: &mut Problems,
) -> Option<ShapeInput> {
    let form = form(shape, description, problems)?;
    let material = match (shape.bsdf, materials) {
        (Some(id), _) if id.0 as usize >= description.bsdfs.len() => {
            problems.error(shape.place, format!("the shape refers to bsdf {} of {}", id.0, description.bsdfs.len()));
            return None;
        }
        (Some(id), Some(_)) => MaterialId(id.0),
        (None, Some(materials)) => materials.default_id(shape.emission.is_some()),
        (_, None) => MaterialId(0),
    };
    Some(ShapeInput {
        form,
        to_world: shape.to_world.value,
        flip_normals: shape.flip_normals,
        material,
        emitter: EmitterId::NONE,
        needs_tangent: materials.is_some_and(|m| m.needs_tangent(material)),
        needs_uv: materials.is_none_or(|m| m.needs_uv(material)),
        place: shape.place,
    })
}

fn form(shape: &ShapeDescription, description: &SceneDescription, problems: &mut Problems) -> Option<Form> {
    Some(match &shape.model {
        ShapeModel::Mesh { mesh, face_normals } => match description.meshes.get(mesh.0 as usize) {
            Some(MeshDescription::Data(mesh)) => Form::Mesh { mesh: mesh.clone(), face_normals: *face_normals },
            Some(MeshDescription::File { path, .. }) => {
                problems.error(shape.place, format!("the mesh {} was not loaded", path.display()));
                return None;
            }
            None => {
                problems.error(shape.place, format!("the shape refers to mesh {} of {}", mesh.0, description.meshes.len()));
                return None;
            }
        },
        ShapeModel::Rectangle => Form::Rectangle,
        ShapeModel::Disk => Form::Disk,
        ShapeModel::Cube => Form::Cube,
        ShapeModel::Sphere { center, radius } => Form::Sphere { center: *center, radius: *radius },
        ShapeModel::Cylinder { p0, p1, radius } => Form::Cylinder { p0: *p0, p1: *p1, radius: *radius },
        ShapeModel::Instance { group } => Form::Instance { group: group.0 },
    })
}
