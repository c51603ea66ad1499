//! Emitters: tables and how they become an [`EmitterModel`] or an [`AreaEmission`].

use super::builder::{Builder, Given};
use super::plugin::{Kind, Plugin, Property, free, harmless, optional, required};
use super::tree::{NodeIndex, Tag};
use crate::describe::*;
use glam::Vec3;

const COMMON: &[Property] = &[harmless("sampling_weight", Kind::Float, "How often the emitter is chosen")];

/// Emitters.
pub const EMITTERS: &[Plugin] = &[
    Plugin {
        tag: Tag::Emitter,
        name: "area",
        doc: "A shape that emits on the side of its normal, with the same radiance in all directions. Nested in a shape.",
        properties: &[&[optional("radiance", Kind::Texture, "1", "W·m⁻²·sr⁻¹, textured if wanted")], COMMON],
        example: r#"<shape type="rectangle">
    <emitter type="area">
        <rgb name="radiance" value="17, 14, 10"/>
    </emitter>
</shape>"#,
    },
    Plugin {
        tag: Tag::Emitter,
        name: "point",
        doc: "A point that emits equally in all directions.",
        properties: &[
            &[
                free("position", Kind::Triple, "the origin, moved by `to_world`", "Where it is, in world coordinates"),
                free("to_world", Kind::Transform, "identity", "Instead of `position`"),
                optional("intensity", Kind::Colour, "1", "W·sr⁻¹"),
            ],
            COMMON,
        ],
        example: r#"<emitter type="point">
    <point name="position" x="-2.6" y="3.6" z="-1.6"/>
    <rgb name="intensity" value="62, 57, 48"/>
</emitter>"#,
    },
    Plugin {
        tag: Tag::Emitter,
        name: "spot",
        doc: "A point that emits into a cone around its +z axis.",
        properties: &[
            &[
                free("to_world", Kind::Transform, "identity", "Emitter to world"),
                optional("intensity", Kind::Colour, "1", "W·sr⁻¹ on the axis"),
                optional("cutoff_angle", Kind::Float, "20", "Half angle beyond which there is nothing, in degrees"),
                free("beam_width", Kind::Float, "3/4 of `cutoff_angle`", "Half angle of full intensity, in degrees"),
                free("texture", Kind::Texture, "none", "Image that multiplies the intensity"),
            ],
            COMMON,
        ],
        example: r#"<emitter type="spot">
    <transform name="to_world">
        <lookat origin="0, 3, 0" target="0, 0, 0" up="0, 0, 1"/>
    </transform>
    <rgb name="intensity" value="15"/>
    <float name="cutoff_angle" value="30"/>
</emitter>"#,
    },
    Plugin {
        tag: Tag::Emitter,
        name: "directional",
        doc: "Light from infinitely far away, in one direction, or from a disk around it: a sun.",
        properties: &[
            &[
                free("direction", Kind::Triple, "+z, turned by `to_world`", "Direction in which the light travels"),
                free("to_world", Kind::Transform, "identity", "Instead of `direction`"),
                optional("irradiance", Kind::Colour, "1", "W·m⁻² on a plane that faces the light"),
                optional("angular_diameter", Kind::Float, "0", "Diameter of the disk in degrees (not in Mitsuba); the sun: 0.53"),
            ],
            COMMON,
        ],
        example: r#"<emitter type="directional">
    <vector name="direction" value="0.4, -1, 0.3"/>
    <rgb name="irradiance" value="3, 2.9, 2.7"/>
    <float name="angular_diameter" value="0.53"/>
</emitter>"#,
    },
    Plugin {
        tag: Tag::Emitter,
        name: "constant",
        doc: "The same radiance from all directions.",
        properties: &[
            &[
                optional("radiance", Kind::Colour, "1", "W·m⁻²·sr⁻¹"),
                harmless("to_world", Kind::Transform, "All directions are the same"),
            ],
            COMMON,
        ],
        example: r#"<emitter type="constant">
    <rgb name="radiance" value="0.2, 0.27, 0.36"/>
</emitter>"#,
    },
    Plugin {
        tag: Tag::Emitter,
        name: "ambient",
        doc: "The same radiance at every point from all directions, whatever is in the way (not in Mitsuba). It stands for all that local \
illumination and recursive ray tracing leave out, and is known to them alone (`--estimator local`, `local-unshadowed`, \
`recursive`): every surface reflects its albedo times the radiance, except as a mirror.",
        properties: &[&[optional("radiance", Kind::Colour, "1", "W·m⁻²·sr⁻¹")], COMMON],
        example: r#"<emitter type="ambient">
    <rgb name="radiance" value="0.1"/>
</emitter>"#,
    },
    Plugin {
        tag: Tag::Emitter,
        name: "envmap",
        doc: "A latitude–longitude image of the radiance from all directions; the upper edge is +y.",
        properties: &[
            &[
                required("filename", Kind::File, "The image: EXR or HDR, or PNG or JPEG decoded from sRGB"),
                optional("scale", Kind::Float, "1", "Factor on the image"),
                free("to_world", Kind::Transform, "identity", "Emitter to world"),
                harmless("mis_compensation", Kind::Boolean, "Sampling only"),
            ],
            COMMON,
        ],
        example: r#"<emitter type="envmap">
    <string name="filename" value="sky.exr"/>
    <float name="scale" value="0.5"/>
</emitter>"#,
    },
];

/// An emitter at top level.
pub fn build(b: &mut Builder, index: NodeIndex) {
    let Some(given) = b.given(index) else { return };
    if let Some(model) = model(b, &given) {
        let emitter = EmitterDescription { id: b.id(index), model, place: given.place };
        b.scene.emitters.push(emitter);
    }
}

/// The emission of a shape; `None` if the emitter is none for shapes (reported).
pub fn area(b: &mut Builder, index: NodeIndex, place: Place) -> Option<AreaEmission> {
    let given = b.given(index)?;
    if given.plugin.name != "area" {
        b.problems
            .error(place, format!("a shape cannot carry an {}", given.label()))
            .hint("only an `area` emitter belongs to a shape");
        return None;
    }
    b.carried.insert(index);
    Some(AreaEmission { radiance: b.texture(&given, "radiance"), id: b.id(index), place: given.place })
}

fn model(b: &mut Builder, given: &Given) -> Option<EmitterModel> {
    let g = given;
    Some(match g.plugin.name {
        "point" => {
            let matrix = b.transform(g, "to_world");
            let position = exclusive(b, g, "position").unwrap_or(matrix.value.transform_point3(Vec3::ZERO));
            EmitterModel::Point { position, intensity: b.colour(g, "intensity") }
        }
        "spot" => {
            let cutoff_angle_deg = b.float(g, "cutoff_angle");
            let beam_width_deg = b.maybe_float(g, "beam_width").unwrap_or(cutoff_angle_deg * 0.75);
            EmitterModel::Spot {
                to_world: b.transform(g, "to_world"),
                intensity: b.colour(g, "intensity"),
                cutoff_angle_deg,
                beam_width_deg,
                texture: b.maybe_texture(g, "texture"),
            }
        }
        "directional" => {
            let matrix = b.transform(g, "to_world");
            let direction = exclusive(b, g, "direction").unwrap_or(matrix.value.transform_vector3(Vec3::Z));
            let irradiance = b.colour(g, "irradiance");
            EmitterModel::Directional { direction, irradiance, angular_diameter_deg: b.float(g, "angular_diameter") }
        }
        "ambient" => EmitterModel::Ambient { radiance: b.colour(g, "radiance") },
        "constant" => EmitterModel::Constant { radiance: b.colour(g, "radiance") },
        "envmap" => {
            let (scale, to_world) = (b.float(g, "scale"), b.transform(g, "to_world"));
            let path = b.file(g, "filename")?;
            let image = b.image(path, false, g.place_of("filename"));
            EmitterModel::Envmap { image, scale, to_world }
        }
        _ => return None,
    })
}

/// A property that replaces `to_world`.
fn exclusive(b: &mut Builder, given: &Given, name: &str) -> Option<Vec3> {
    if given.has(name) && given.has("to_world") {
        let what = format!("{} has both `{name}` and `to_world`", given.label());
        b.problems.error(given.place_of(name), what);
    }
    b.triple(given, name)
}
