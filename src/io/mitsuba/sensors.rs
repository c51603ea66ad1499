//! Sensors with their film, filter and sampler: tables and how they become a [`SensorDescription`].

use super::builder::{Builder, Given};
use super::plugin::{Kind, Plugin, Property, free, harmless, optional, required};
use super::tree::{NodeIndex, Tag};
use super::values;
use crate::describe::*;
use glam::Vec2;

const COMMON: &[Property] = &[
    free("to_world", Kind::Transform, "identity", "Sensor to world; it looks along +z, +y is up, +x is to the left"),
    optional("near_clip", Kind::Float, "0.01", "Nearest visible distance along the axis"),
    optional("far_clip", Kind::Float, "10000", "Farthest visible distance along the axis"),
    free("film", Kind::Objects(Tag::Film, 1), "`hdrfilm`", "Size and filter of the image"),
    free("sampler", Kind::Objects(Tag::Sampler, 1), "`independent`", "Number of samples and seed"),
    harmless("shutter_open", Kind::Float, "Nothing moves"),
    harmless("shutter_close", Kind::Float, "Nothing moves"),
];
const LENS: &[Property] = &[
    free("fov", Kind::Float, "by `focal_length`", "Field of view in degrees, between 0 and 180"),
    optional("fov_axis", Kind::Text(&["x", "y", "diagonal", "smaller", "larger"]), "x", "Side of the image that `fov` spans"),
    free("focal_length", Kind::Text(&[]), "50mm", "Instead of `fov`: focal length for 36 × 24 mm film, as `50mm`"),
    optional("principal_point_offset_x", Kind::Float, "0", "Shift of the image's centre, as a share of its width"),
    optional("principal_point_offset_y", Kind::Float, "0", "Shift of the image's centre, as a share of its height"),
];

/// Sensors.
pub const SENSORS: &[Plugin] = &[
    Plugin {
        tag: Tag::Sensor,
        name: "perspective",
        doc: "A pinhole camera.",
        properties: &[LENS, COMMON],
        example: r#"<sensor type="perspective">
    <float name="fov" value="42"/>
    <transform name="to_world">
        <lookat origin="0, 1, 5" target="0, 1, 0" up="0, 1, 0"/>
    </transform>
    <sampler type="independent">
        <integer name="sample_count" value="64"/>
    </sampler>
    <film type="hdrfilm">
        <integer name="width" value="512"/>
        <integer name="height" value="384"/>
    </film>
</sensor>"#,
    },
    Plugin {
        tag: Tag::Sensor,
        name: "thinlens",
        doc: "A camera with a circular aperture: what is not at `focus_distance` is blurred.",
        properties: &[
            &[
                required("aperture_radius", Kind::Float, "Radius of the lens in scene units"),
                free("focus_distance", Kind::Float, "`far_clip`", "Distance of the sharp plane along the axis"),
            ],
            LENS,
            COMMON,
        ],
        example: r#"<sensor type="thinlens">
    <float name="fov" value="30"/>
    <float name="aperture_radius" value="0.05"/>
    <float name="focus_distance" value="4"/>
</sensor>"#,
    },
    Plugin {
        tag: Tag::Sensor,
        name: "orthographic",
        doc: "Parallel projection; the image is 2 units wide before `to_world`.",
        properties: &[COMMON],
        example: r#"<sensor type="orthographic">
    <transform name="to_world">
        <scale x="1.5" y="1.5"/>
        <lookat origin="-5, 0, 3" target="0, 0, 1" up="0, 0, 1"/>
    </transform>
</sensor>"#,
    },
];

const SIZE: i64 = u32::MAX as i64;

/// Films.
pub const FILMS: &[Plugin] = &[Plugin {
    tag: Tag::Film,
    name: "hdrfilm",
    doc: "Size, crop window and filter of the image. The format of the file follows its name on the command line.",
    properties: &[&[
        optional("width", Kind::Integer(0, SIZE), "768", "Width in pixels"),
        optional("height", Kind::Integer(0, SIZE), "576", "Height in pixels"),
        optional("crop_offset_x", Kind::Integer(0, SIZE), "0", "Left edge of the crop window in pixels"),
        optional("crop_offset_y", Kind::Integer(0, SIZE), "0", "Upper edge of the crop window in pixels"),
        free("crop_width", Kind::Integer(0, SIZE), "`width`", "Width of the crop window in pixels"),
        free("crop_height", Kind::Integer(0, SIZE), "`height`", "Height of the crop window in pixels"),
        free("rfilter", Kind::Objects(Tag::Rfilter, 1), "`gaussian`", "The reconstruction filter"),
        harmless("file_format", Kind::Text(&[]), "By the name of the output file"),
        harmless("pixel_format", Kind::Text(&[]), "Always RGB"),
        harmless("component_format", Kind::Text(&[]), "Always 32-bit floating point"),
        harmless("banner", Kind::Boolean, "None"),
        harmless("high_quality_edges", Kind::Boolean, "Always"),
        harmless("sample_border", Kind::Boolean, "Always where the filter needs it"),
        harmless("compensate", Kind::Boolean, "Sums are always exact"),
        harmless("attach_log", Kind::Boolean, "None"),
    ]],
    example: r#"<sensor type="perspective">
    <film type="hdrfilm">
        <integer name="width" value="640"/>
        <integer name="height" value="480"/>
        <integer name="crop_offset_x" value="100"/>
        <integer name="crop_offset_y" value="50"/>
        <integer name="crop_width" value="200"/>
        <integer name="crop_height" value="150"/>
        <rfilter type="box"/>
    </film>
</sensor>"#,
}];

macro_rules! filter_example {
    ($inner:literal) => {
        concat!("<sensor type=\"perspective\">\n    <film type=\"hdrfilm\">\n        ", $inner, "\n    </film>\n</sensor>")
    };
}

/// Reconstruction filters.
pub const FILTERS: &[Plugin] = &[
    Plugin {
        tag: Tag::Rfilter,
        name: "box",
        doc: "One pixel wide: pixels are independent of each other.",
        properties: &[],
        example: filter_example!(r#"<rfilter type="box"/>"#),
    },
    Plugin {
        tag: Tag::Rfilter,
        name: "tent",
        doc: "Falls linearly to zero at `radius`.",
        properties: &[&[optional("radius", Kind::Float, "1", "Half width in pixels")]],
        example: filter_example!(r#"<rfilter type="tent"/>"#),
    },
    Plugin {
        tag: Tag::Rfilter,
        name: "gaussian",
        doc: "A Gaussian, cut off at four standard deviations.",
        properties: &[&[optional("stddev", Kind::Float, "0.5", "Standard deviation in pixels")]],
        example: filter_example!(r#"<rfilter type="gaussian"><float name="stddev" value="0.4"/></rfilter>"#),
    },
    Plugin {
        tag: Tag::Rfilter,
        name: "mitchell",
        doc: "The cubic filter of Mitchell and Netravali; it has small negative lobes.",
        properties: &[&[
            optional("B", Kind::Float, "0.333333333", "Blur, as in the paper"),
            optional("C", Kind::Float, "0.333333333", "Ringing, as in the paper"),
        ]],
        example: filter_example!(r#"<rfilter type="mitchell"/>"#),
    },
    Plugin {
        tag: Tag::Rfilter,
        name: "catmullrom",
        doc: "The sharp cubic filter with B = 0, C = 1/2; it has negative lobes.",
        properties: &[],
        example: filter_example!(r#"<rfilter type="catmullrom"/>"#),
    },
    Plugin {
        tag: Tag::Rfilter,
        name: "lanczos",
        doc: "A sinc in a sinc window, the sharpest; it has negative lobes.",
        properties: &[&[optional("lobes", Kind::Integer(1, 32), "3", "Number of lobes, the radius in pixels")]],
        example: filter_example!(r#"<rfilter type="lanczos"/>"#),
    },
];

const SAMPLER: &[Property] = &[
    optional("sample_count", Kind::Integer(0, SIZE), "4", "Samples per pixel"),
    optional("seed", Kind::Integer(0, i64::MAX), "0", "Seed of the random numbers"),
    harmless("jitter", Kind::Boolean, "This renderer has its own sampler"),
];

macro_rules! sampler {
    ($name:literal, $doc:literal) => {
        Plugin {
            tag: Tag::Sampler,
            name: $name,
            doc: $doc,
            properties: &[SAMPLER],
            example: concat!(
                "<sensor type=\"perspective\">\n    <sampler type=\"",
                $name,
                "\">\n        <integer name=\"sample_count\" value=\"16\"/>\n    </sampler>\n</sensor>"
            ),
        }
    };
}

/// Samplers; only their numbers are used.
pub const SAMPLERS: &[Plugin] = &[
    sampler!("independent", "Number of samples per pixel and seed."),
    sampler!("stratified", "Read as `independent`: the expected image is the same."),
    sampler!("multijitter", "Read as `independent`: the expected image is the same."),
    sampler!("orthogonal", "Read as `independent`: the expected image is the same."),
    sampler!("ldsampler", "Read as `independent`: the expected image is the same."),
];

/// A sensor at top level.
pub fn build(b: &mut Builder, index: NodeIndex) {
    let Some(given) = b.given(index) else { return };
    let g = &given;
    let far_clip = b.float(g, "far_clip");
    let model = match g.plugin.name {
        "perspective" => {
            let (fov_deg, fov_axis) = field_of_view(b, g);
            SensorModel::Perspective { fov_deg, fov_axis, principal_point_offset: offset(b, g) }
        }
        "thinlens" => {
            let (fov_deg, fov_axis) = field_of_view(b, g);
            SensorModel::ThinLens {
                fov_deg,
                fov_axis,
                principal_point_offset: offset(b, g),
                aperture_radius: b.float(g, "aperture_radius"),
                focus_distance: b.maybe_float(g, "focus_distance").unwrap_or(far_clip),
            }
        }
        _ => SensorModel::Orthographic,
    };
    let (sample_count, seed) = sampler(b, g);
    let sensor = SensorDescription {
        id: b.id(index),
        model,
        to_world: b.transform(g, "to_world"),
        near_clip: b.float(g, "near_clip"),
        far_clip,
        sample_count,
        seed,
        film: film(b, g),
        place: g.place,
    };
    b.scene.sensors.push(sensor);
}

fn offset(b: &mut Builder, given: &Given) -> Vec2 {
    Vec2::new(b.float(given, "principal_point_offset_x"), b.float(given, "principal_point_offset_y"))
}

/// `fov` along `fov_axis`, or the diagonal field of a 36 × 24 mm film at `focal_length`.
fn field_of_view(b: &mut Builder, given: &Given) -> (f32, FovAxis) {
    let axis = match b.text(given, "fov_axis").as_deref() {
        Some("y") => FovAxis::Y,
        Some("diagonal") => FovAxis::Diagonal,
        Some("smaller") => FovAxis::Smaller,
        Some("larger") => FovAxis::Larger,
        _ => FovAxis::X,
    };
    if given.has("fov") && given.has("focal_length") {
        let what = format!("{} has both `fov` and `focal_length`", given.label());
        b.problems.error(given.place_of("focal_length"), what);
    }
    if given.has("fov") {
        return (b.maybe_float(given, "fov").unwrap_or(45.0), axis);
    }
    let length = b.read(given, "focal_length", |text| {
        let number = text.trim().strip_suffix("mm").unwrap_or(text);
        values::number(number).ok().filter(|v| *v > 0.0).ok_or("a focal length is a positive number followed by mm".to_string())
    });
    let half_diagonal = (36.0f64 * 36.0 + 24.0 * 24.0).sqrt() / 2.0;
    let fov = 2.0 * (half_diagonal / length.unwrap_or(50.0)).atan();
    (fov.to_degrees() as f32, FovAxis::Diagonal)
}

/// `(sample_count, seed)`.
fn sampler(b: &mut Builder, sensor: &Given) -> (Option<u32>, u64) {
    let Some((node, _)) = sensor.objects(Tag::Sampler).next() else { return (None, 0) };
    let Some(given) = b.given(node) else { return (None, 0) };
    if let Some(&place) = b.places.get(&(given.place, "sample_count")) {
        b.places.insert((sensor.place, "sample_count"), place);
    }
    let count = b.integer(&given, "sample_count") as u32;
    (given.has("sample_count").then_some(count), b.integer(&given, "seed") as u64)
}

fn film(b: &mut Builder, sensor: &Given) -> FilmDescription {
    let nothing = FilmDescription {
        width: 768,
        height: 576,
        crop: None,
        filter: FilterDescription::Gaussian { stddev: 0.5 },
        place: sensor.place,
    };
    let Some((node, _)) = sensor.objects(Tag::Film).next() else { return nothing };
    let Some(given) = b.given(node) else { return nothing };
    let g = &given;
    let (width, height) = (b.integer(g, "width") as u32, b.integer(g, "height") as u32);
    let (x, y) = (b.integer(g, "crop_offset_x") as u32, b.integer(g, "crop_offset_y") as u32);
    let crop_width = b.maybe_integer(g, "crop_width").map_or(width, |v| v as u32);
    let crop_height = b.maybe_integer(g, "crop_height").map_or(height, |v| v as u32);
    let crop = [x, y, crop_width, crop_height];
    let crop = (crop != [0, 0, width, height]).then_some(crop);
    if let Some(place) =
        ["crop_width", "crop_height", "crop_offset_x", "crop_offset_y"].iter().find_map(|n| b.places.get(&(g.place, n)))
    {
        b.places.insert((g.place, "crop"), *place);
    }
    FilmDescription { width, height, crop, filter: filter(b, g), place: g.place }
}

fn filter(b: &mut Builder, film: &Given) -> FilterDescription {
    let nothing = FilterDescription::Gaussian { stddev: 0.5 };
    let Some((node, _)) = film.objects(Tag::Rfilter).next() else { return nothing };
    let Some(given) = b.given(node) else { return nothing };
    b.places.insert((film.place, "rfilter"), given.place);
    let g = &given;
    match g.plugin.name {
        "box" => FilterDescription::Box,
        "tent" => FilterDescription::Tent { radius: b.float(g, "radius") },
        "gaussian" => FilterDescription::Gaussian { stddev: b.float(g, "stddev") },
        "mitchell" => FilterDescription::Mitchell { b: b.float(g, "B"), c: b.float(g, "C") },
        "catmullrom" => FilterDescription::CatmullRom,
        _ => FilterDescription::Lanczos { lobes: b.integer(g, "lobes") as u32 },
    }
}
