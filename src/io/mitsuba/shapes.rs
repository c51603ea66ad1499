//! Shapes: tables and how they become a [`ShapeDescription`] or a [`GroupDescription`].

use super::builder::{Builder, Given};
use super::plugin::{Kind, Plugin, Property, free, harmless, optional, required};
use super::tree::{NodeIndex, Tag};
use super::{bsdfs, emitters, values};
use crate::describe::*;
use glam::Vec3;

const COMMON: &[Property] = &[
    free("to_world", Kind::Transform, "identity", "Object to world"),
    optional("flip_normals", Kind::Boolean, "false", "Turn the normals round"),
    free("bsdf", Kind::Objects(Tag::Bsdf, 1), "`diffuse`, black with an emitter", "The local model"),
    free("emitter", Kind::Objects(Tag::Emitter, 1), "none", "An `area` emitter"),
    harmless("silhouette_sampling_weight", Kind::Float, "Differentiable rendering only"),
];
const FLAT: &[Property] = &[harmless("face_normals", Kind::Boolean, "The shape is flat")];
const FACE_NORMALS: Property = optional("face_normals", Kind::Boolean, "false", "Ignore the vertex normals of the file");

/// Shapes.
pub const SHAPES: &[Plugin] = &[
    Plugin {
        tag: Tag::Shape,
        name: "obj",
        doc: "A triangle mesh from a Wavefront OBJ file.",
        properties: &[
            &[
                required("filename", Kind::File, "The mesh"),
                FACE_NORMALS,
                optional("flip_tex_coords", Kind::Boolean, "true", "Use 1 − v for v"),
            ],
            COMMON,
        ],
        example: r#"<shape type="obj">
    <string name="filename" value="cup.obj"/>
    <bsdf type="diffuse"/>
</shape>"#,
    },
    Plugin {
        tag: Tag::Shape,
        name: "ply",
        doc: "A triangle mesh from a Stanford PLY file, ASCII or binary.",
        properties: &[
            &[
                required("filename", Kind::File, "The mesh"),
                FACE_NORMALS,
                optional("flip_tex_coords", Kind::Boolean, "false", "Use 1 − v for v"),
            ],
            COMMON,
        ],
        example: r#"<shape type="ply">
    <string name="filename" value="cup.ply"/>
    <boolean name="face_normals" value="true"/>
</shape>"#,
    },
    Plugin {
        tag: Tag::Shape,
        name: "serialized",
        doc: "A triangle mesh from a file in Mitsuba's serialized format.",
        properties: &[
            &[
                required("filename", Kind::File, "The mesh"),
                optional("shape_index", Kind::Integer(0, u32::MAX as i64), "0", "Which mesh of the file"),
                FACE_NORMALS,
            ],
            COMMON,
        ],
        example: r#"<shape type="serialized">
    <string name="filename" value="cup.serialized"/>
    <integer name="shape_index" value="0"/>
</shape>"#,
    },
    Plugin {
        tag: Tag::Shape,
        name: "rectangle",
        doc: "The square [−1, 1]² in the plane z = 0; its normal is +z.",
        properties: &[COMMON, FLAT],
        example: r#"<shape type="rectangle">
    <transform name="to_world">
        <scale x="2"/>
        <rotate x="1" angle="-90"/>
    </transform>
</shape>"#,
    },
    Plugin {
        tag: Tag::Shape,
        name: "disk",
        doc: "The unit disk in the plane z = 0; its normal is +z.",
        properties: &[COMMON],
        example: r#"<shape type="disk">
    <boolean name="flip_normals" value="true"/>
</shape>"#,
    },
    Plugin {
        tag: Tag::Shape,
        name: "cube",
        doc: "The cube [−1, 1]³; normals point out.",
        properties: &[COMMON, FLAT],
        example: r#"<shape type="cube">
    <transform name="to_world">
        <scale value="0.5"/>
        <translate y="0.5"/>
    </transform>
</shape>"#,
    },
    Plugin {
        tag: Tag::Shape,
        name: "sphere",
        doc: "A sphere; normals point out.",
        properties: &[
            &[
                optional("center", Kind::Triple, "0, 0, 0", "Centre before `to_world`"),
                optional("radius", Kind::Float, "1", "Radius before `to_world`"),
            ],
            COMMON,
        ],
        example: r#"<shape type="sphere">
    <point name="center" value="0, 1, 0"/>
    <float name="radius" value="0.5"/>
</shape>"#,
    },
    Plugin {
        tag: Tag::Shape,
        name: "cylinder",
        doc: "A cylinder without caps; normals point out.",
        properties: &[
            &[
                optional("p0", Kind::Triple, "0, 0, 0", "One end of the axis before `to_world`"),
                optional("p1", Kind::Triple, "0, 0, 1", "Other end of the axis before `to_world`"),
                optional("radius", Kind::Float, "1", "Radius before `to_world`"),
            ],
            COMMON,
        ],
        example: r#"<shape type="cylinder">
    <point name="p0" value="0, 0, 0"/>
    <point name="p1" value="0, 2, 0"/>
    <float name="radius" value="0.1"/>
</shape>"#,
    },
    Plugin {
        tag: Tag::Shape,
        name: "shapegroup",
        doc: "Shapes that are placed by `instance`. They carry no emitters and no instances; alone they are not seen.",
        properties: &[&[required("shape", Kind::Objects(Tag::Shape, usize::MAX), "The members")]],
        example: r#"<shape type="shapegroup" id="tree">
    <shape type="cylinder"/>
    <shape type="sphere">
        <point name="center" value="0, 0, 2"/>
    </shape>
</shape>"#,
    },
    Plugin {
        tag: Tag::Shape,
        name: "instance",
        doc: "A copy of a shape group at another place, at no cost in memory.",
        properties: &[&[
            required("shapegroup", Kind::Objects(Tag::Shape, 1), "The group, by reference"),
            free("to_world", Kind::Transform, "identity", "Group to world"),
        ]],
        example: r#"<shape type="shapegroup" id="bush">
    <shape type="sphere"/>
</shape>
<shape type="instance">
    <ref id="bush"/>
    <transform name="to_world">
        <translate x="3"/>
    </transform>
</shape>"#,
    },
];

/// A shape at top level; a shape group is kept for its instances.
pub fn build(b: &mut Builder, index: NodeIndex) {
    if b.node(index).plugin() == "shapegroup" {
        group(b, index);
    } else if let Some(shape) = shape(b, index) {
        b.scene.shapes.push(shape);
    }
}

fn shape(b: &mut Builder, index: NodeIndex) -> Option<ShapeDescription> {
    let given = b.given(index)?;
    let g = &given;
    let bsdf = g.objects(Tag::Bsdf).next().map(|(node, _)| bsdfs::build(b, node));
    let mut emission = g.objects(Tag::Emitter).next().and_then(|(node, place)| emitters::area(b, node, place));
    if let Some(emission) = &mut emission {
        // A lamp is known by its shape where its emitter has no name.
        emission.id = emission.id.take().or_else(|| b.id(index));
    }
    let to_world = b.transform(g, "to_world");
    let instance = g.plugin.name == "instance";
    let flip_normals = !instance && b.boolean(g, "flip_normals");
    let model = model(b, g)?;
    Some(ShapeDescription { id: b.id(index), model, to_world, flip_normals, bsdf, emission, place: g.place })
}

fn model(b: &mut Builder, given: &Given) -> Option<ShapeModel> {
    let g = given;
    Some(match g.plugin.name {
        "obj" => mesh(b, g, MeshFormat::Obj)?,
        "ply" => mesh(b, g, MeshFormat::Ply)?,
        "serialized" => mesh(b, g, MeshFormat::Serialized)?,
        "rectangle" => ShapeModel::Rectangle,
        "disk" => ShapeModel::Disk,
        "cube" => ShapeModel::Cube,
        "sphere" => ShapeModel::Sphere { center: b.triple(g, "center").unwrap_or(Vec3::ZERO), radius: b.float(g, "radius") },
        "cylinder" => ShapeModel::Cylinder {
            p0: b.triple(g, "p0").unwrap_or(Vec3::ZERO),
            p1: b.triple(g, "p1").unwrap_or(Vec3::Z),
            radius: b.float(g, "radius"),
        },
        "instance" => {
            let (node, place) = g.objects(Tag::Shape).next()?;
            if b.node(node).plugin() != "shapegroup" {
                b.problems.error(
                    place,
                    format!("{} copies a `shapegroup`, not a `{}`", g.label(), values::shown(b.node(node).plugin())),
                );
                return None;
            }
            ShapeModel::Instance { group: group(b, node) }
        }
        _ => {
            b.problems.error(g.place, "a `shapegroup` cannot stand in another");
            return None;
        }
    })
}

fn mesh(b: &mut Builder, given: &Given, format: MeshFormat) -> Option<ShapeModel> {
    let face_normals = b.boolean(given, "face_normals");
    let serialized = format == MeshFormat::Serialized;
    let shape_index = if serialized { b.integer(given, "shape_index") as u32 } else { 0 };
    let flip_tex_coords = !serialized && b.boolean(given, "flip_tex_coords");
    let path = b.file(given, "filename")?;
    let place = given.place_of("filename");
    let mesh = *b.meshes.entry((path.clone(), shape_index, flip_tex_coords, format)).or_insert_with(|| {
        b.scene.meshes.push(MeshDescription::File { path, format, shape_index, flip_tex_coords, place });
        MeshId(b.scene.meshes.len() as u32 - 1)
    });
    Some(ShapeModel::Mesh { mesh, face_normals })
}

/// A shape group, built once however many instances it has.
fn group(b: &mut Builder, index: NodeIndex) -> GroupId {
    if let Some(&id) = b.groups.get(&index) {
        return id;
    }
    let mut shapes = Vec::new();
    if let Some(given) = b.given(index) {
        let members: Vec<NodeIndex> = given.objects(Tag::Shape).map(|(node, _)| node).collect();
        shapes = members.into_iter().filter_map(|member| shape(b, member)).collect();
    }
    let description = GroupDescription { id: b.id(index), shapes, place: b.node(index).place };
    b.scene.groups.push(description);
    let id = GroupId(b.scene.groups.len() as u32 - 1);
    b.groups.insert(index, id);
    id
}
