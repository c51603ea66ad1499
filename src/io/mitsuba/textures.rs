//! Textures and spectra: tables and how they become a [`TextureDescription`].

use super::builder::{Builder, Given};
use super::plugin::{Kind, Plugin, Property, free, harmless, optional, required};
use super::tree::{NodeIndex, Tag};
use crate::describe::*;

const TO_UV: &[Property] = &[free("to_uv", Kind::Transform, "identity", "Affine map applied to (u, v) before the look-up")];

/// Most textures of a scene, each use of a shared one counted.
const MAX_TEXTURES: usize = 1 << 20;

/// Textures.
pub const TEXTURES: &[Plugin] = &[
    Plugin {
        tag: Tag::Texture,
        name: "bitmap",
        doc: "An image file: PNG, JPEG, BMP, TGA, EXR or HDR.",
        properties: &[
            &[
                required("filename", Kind::File, "The image"),
                optional("raw", Kind::Boolean, "false", "Use the numbers as they are, without decoding sRGB"),
                optional("filter_type", Kind::Text(&["bilinear", "nearest"]), "bilinear", "Interpolation between texels"),
                optional("wrap_mode", Kind::Text(&["repeat", "mirror", "clamp"]), "repeat", "What lies outside of the image"),
                harmless("format", Kind::Text(&[]), "Storage in memory"),
                harmless("accel", Kind::Boolean, "Hardware look-ups"),
            ],
            TO_UV,
        ],
        example: r#"<texture type="bitmap" id="wood">
    <string name="filename" value="wood.png"/>
    <string name="wrap_mode" value="mirror"/>
    <transform name="to_uv">
        <scale x="2" y="2"/>
    </transform>
</texture>"#,
    },
    Plugin {
        tag: Tag::Texture,
        name: "checkerboard",
        doc: "Two colours in squares, 2 × 2 squares per unit of (u, v).",
        properties: &[
            &[
                optional("color0", Kind::Texture, "0.4", "First colour"),
                optional("color1", Kind::Texture, "0.2", "Second colour"),
            ],
            TO_UV,
        ],
        example: r#"<texture type="checkerboard" id="board">
    <rgb name="color0" value="0.8, 0.7, 0.6"/>
    <rgb name="color1" value="0.1"/>
    <transform name="to_uv">
        <scale value="4"/>
    </transform>
</texture>"#,
    },
];

/// Spectra written as objects.
pub const SPECTRA: &[Plugin] = &[
    Plugin {
        tag: Tag::Spectrum,
        name: "d65",
        doc: "Daylight of 6504 K, which is white (1, 1, 1) in linear sRGB.",
        properties: &[&[optional("scale", Kind::Float, "1", "Factor")]],
        example: r#"<emitter type="constant">
    <spectrum type="d65" name="radiance">
        <float name="scale" value="2"/>
    </spectrum>
</emitter>"#,
    },
    Plugin {
        tag: Tag::Spectrum,
        name: "uniform",
        doc: "The same in all three lanes.",
        properties: &[&[optional("value", Kind::Float, "1", "The value")]],
        example: r#"<bsdf type="diffuse" id="grey">
    <spectrum type="uniform" name="reflectance">
        <float name="value" value="0.3"/>
    </spectrum>
</bsdf>"#,
    },
];

/// The texture or spectrum that an object describes; `None` if it cannot be read (reported).
pub fn build(b: &mut Builder, index: NodeIndex) -> Option<TextureDescription> {
    b.textures += 1;
    if b.textures > MAX_TEXTURES {
        if b.textures == MAX_TEXTURES + 1 {
            b.problems.error(b.node(index).place, format!("the scene's textures unfold to more than {MAX_TEXTURES}"));
        }
        return None;
    }
    let given = b.given(index)?;
    match given.plugin.name {
        "bitmap" => bitmap(b, &given),
        "checkerboard" => Some(TextureDescription::Checkerboard {
            color0: Box::new(b.texture(&given, "color0")),
            color1: Box::new(b.texture(&given, "color1")),
            to_uv: b.transform(&given, "to_uv").value,
            place: given.place,
        }),
        "d65" => Some(TextureDescription::grey(b.float(&given, "scale"))),
        _ => Some(TextureDescription::grey(b.float(&given, "value"))),
    }
}

fn bitmap(b: &mut Builder, given: &Given) -> Option<TextureDescription> {
    let raw = b.boolean(given, "raw");
    let filter = match b.text(given, "filter_type").as_deref() {
        Some("nearest") => BitmapFilter::Nearest,
        _ => BitmapFilter::Bilinear,
    };
    let wrap = match b.text(given, "wrap_mode").as_deref() {
        Some("mirror") => BitmapWrap::Mirror,
        Some("clamp") => BitmapWrap::Clamp,
        _ => BitmapWrap::Repeat,
    };
    let to_uv = b.transform(given, "to_uv").value;
    let path = b.file(given, "filename")?;
    let image = b.image(path, raw, given.place_of("filename"));
    Some(TextureDescription::Bitmap { image, filter, wrap, to_uv, place: given.place })
}
