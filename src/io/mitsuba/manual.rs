//! The manual of the scene language, written from the tables that the reader itself follows.

use super::builder::expected;
use super::plugin::{Absent, Effect, Kind, Plugin, Property, TABLES};
use super::tree::Tag;
use std::fmt::Write;

/// A small scene that uses one plugin.
#[derive(Clone, Debug)]
pub struct Example {
    /// The element, as `bsdf`.
    pub element: &'static str,
    /// The plugin, as `diffuse`.
    pub plugin: &'static str,
    /// A whole scene.
    pub scene: String,
    /// Files that must lie beside it.
    pub files: Vec<&'static str>,
}

/// One example for each plugin that is read.
pub fn examples() -> Vec<Example> {
    TABLES.iter().flat_map(|table| table.iter()).map(example).collect()
}

fn example(plugin: &'static Plugin) -> Example {
    let needs = |tag: &str| !plugin.example.contains(tag);
    let mut scene = String::from("<scene version=\"3.0.0\">\n");
    for (tag, line) in [
        ("<sensor", "<sensor type=\"perspective\"/>\n"),
        ("<emitter", "<emitter type=\"constant\"/>\n"),
        ("<shape", "<shape type=\"sphere\"/>\n"),
    ] {
        if needs(tag) {
            scene.push_str(line);
        }
    }
    let files = plugin.example.match_indices("name=\"filename\" value=\"").map(|(at, found)| {
        let rest = &plugin.example[at + found.len()..];
        &rest[..rest.find('"').unwrap_or(0)]
    });
    let files = files.collect();
    scene.push_str(plugin.example);
    scene.push_str("\n</scene>\n");
    Example { element: plugin.tag.name(), plugin: plugin.name, scene, files }
}

const SECTIONS: &[(Tag, &str, &str)] = &[
    (Tag::Integrator, "Integrators", "Which paths count. At most one; without one: `path` with its defaults."),
    (Tag::Sensor, "Sensors", "At least one; the first is rendered unless another is chosen."),
    (Tag::Film, "Films", "Nested in a sensor."),
    (Tag::Rfilter, "Reconstruction filters", "Nested in a film."),
    (Tag::Sampler, "Samplers", "Nested in a sensor."),
    (Tag::Shape, "Shapes", "A shape without a local model is `diffuse` with reflectance 0.5."),
    (Tag::Bsdf, "Local models", "At top level with an `id`, or nested in a shape."),
    (Tag::Emitter, "Emitters", "`area` is nested in a shape; the others stand at top level."),
    (Tag::Texture, "Textures", "At top level with an `id`, or nested with the `name` of the property they are for."),
    (Tag::Spectrum, "Spectra", "Nested with the `name` of the property they are for; see also *Colours*."),
];

/// The text of docs/scene-format.md.
pub fn scene_format_markdown() -> String {
    let mut out = String::from(INTRODUCTION);
    for (tag, title, note) in SECTIONS {
        let _ = write!(out, "\n## {title}\n\n{note}\n");
        for plugin in TABLES.iter().flat_map(|table| table.iter()).filter(|p| p.tag == *tag) {
            write_plugin(&mut out, plugin);
        }
    }
    write_materials(&mut out);
    out
}

fn write_plugin(out: &mut String, plugin: &Plugin) {
    let _ = write!(out, "\n### {} `{}`\n\n{}\n", plugin.tag.name(), plugin.name, plugin.doc);
    let known: Vec<&Property> = plugin.all().filter(|p| p.effect == Effect::Full).collect();
    if !known.is_empty() {
        out.push_str("\n| property | type | default | meaning |\n|---|---|---|---|\n");
        for p in known {
            let name = if matches!(p.kind, Kind::Objects(..)) { "(nested)".into() } else { format!("`{}`", p.name) };
            let _ = writeln!(out, "| {name} | {} | {} | {} |", kind(p.kind), absent(p.absent), p.doc);
        }
    }
    let silent: Vec<String> = plugin.all().filter(|p| p.effect == Effect::None).map(|p| format!("`{}`", p.name)).collect();
    if !silent.is_empty() {
        let _ = write!(out, "\nAccepted without effect: {}.\n", silent.join(", "));
    }
    for p in plugin.all() {
        if let Effect::Differs(why) = p.effect {
            let _ = write!(out, "\nAccepted with a warning: `{}` ({why}).\n", p.name);
        }
    }
    let _ = write!(out, "\n```xml\n{}\n```\n", plugin.example);
}

fn kind(kind: Kind) -> String {
    match kind {
        Kind::Text(choices) if !choices.is_empty() => choices.iter().map(|c| format!("`{c}`")).collect::<Vec<_>>().join(", "),
        Kind::File => "file name".into(),
        Kind::Objects(tag, 1) => format!("`{}`", tag.name()),
        Kind::Objects(tag, usize::MAX) => format!("`{}`, any number", tag.name()),
        Kind::Objects(tag, most) => format!("`{}`, up to {most}", tag.name()),
        Kind::Ior => "float, or name of a dielectric".into(),
        Kind::Texture => "float, rgb, spectrum, texture".into(),
        Kind::Colour => "float, rgb, spectrum".into(),
        other => expected(other).trim_start_matches("an ").trim_start_matches("a ").into(),
    }
}

fn absent(absent: Absent) -> String {
    match absent {
        Absent::Required => "**required**".into(),
        Absent::Value(text) => text.into(),
        Absent::Means(words) => words.into(),
    }
}

fn write_materials(out: &mut String) {
    out.push_str("\n## Named materials\n\nDielectrics, with their index of refraction: ");
    let rows = include_str!("data/dielectrics.csv").lines().skip(1).filter_map(|row| row.split_once(','));
    let dielectrics: Vec<String> = rows.map(|(name, value)| format!("`{name}` {value}")).collect();
    let conductors: Vec<String> = include_str!("data/conductors.csv")
        .lines()
        .skip(1)
        .filter_map(|row| row.split(',').next())
        .map(|n| format!("`{n}`"))
        .collect();
    let _ = write!(out, "{}.\n\nConductors: `none` (a perfect mirror), {}.\n", dielectrics.join(", "), conductors.join(", "));
}

const INTRODUCTION: &str = r#"# The scene format

nephroid reads the XML scene language of Mitsuba 3, versions 2.x and 3.x. This page is generated from
the tables that the reader follows (`cargo test --test formats -- --ignored bless` writes it anew);
every example on it is read by a test.

A scene that cannot be rendered as written is refused: unknown elements, plugins and properties, wrong
types and values out of range are errors, all reported at once with file, line and column. A property
of Mitsuba that makes no difference here is accepted; one that would change the picture gives a warning.

```xml
<scene version="3.0.0">
    <default name="spp" value="64"/>
    <sensor type="perspective">
        <float name="fov" value="42"/>
        <transform name="to_world">
            <lookat origin="0, 1, 5" target="0, 1, 0" up="0, 1, 0"/>
        </transform>
        <sampler type="independent">
            <integer name="sample_count" value="$spp"/>
        </sampler>
    </sensor>
    <bsdf type="dielectric" id="glass"/>
    <shape type="sphere">
        <ref id="glass"/>
    </shape>
    <emitter type="constant"/>
</scene>
```

## Language

**Objects.** `<shape>`, `<bsdf>`, `<emitter>`, `<sensor>`, `<film>`, `<rfilter>`, `<sampler>`,
`<integrator>`, `<texture>` have a `type` and may have an `id`. `<ref id="…"/>` stands for the object of
that id, wherever in the file it is (`name` says which property a referenced texture is for).
`<alias id="…" as="…"/>` gives an object that was described before a second id.

**Parameters.** `<default name="n" value="v"/>` lets `$n` in any later attribute stand for `v`;
`-D n=other` on the command line is stronger, and the first of two defaults counts. `$n` takes the
longest known name.

**Files.** `<include filename="…"/>` puts the contents of another scene file in its place; parameters are
shared. File names are looked for beside the file that names them, then in the directories given by
`<path value="…"/>` (relative to the file it stands in), then beside the scene.

**Values.** `<float>`, `<integer>`, `<boolean>` (`true`, `false`), `<string>`: `name` and `value`.
`<point>`, `<vector>`: `x`, `y`, `z`, or `value` with three numbers (one number counts for all three).
Numbers in lists are separated by commas or blanks. Numbers must be finite.

**Transforms.** The steps of a `<transform>` apply one after the other, the first one first.

| step | attributes |
|---|---|
| `<translate>` | `x`, `y`, `z` (absent: 0), or `value` |
| `<scale>` | `x`, `y`, `z` (absent: 1), or `value` (one number: uniform) |
| `<rotate>` | `angle` in degrees; axis by `x`, `y`, `z` or `value` (any length) |
| `<lookat>` | `origin`, `target`, `up`: the frame at `origin` whose +z looks at `target` |
| `<matrix>` | `value`: 16 numbers by rows, or 9 for the linear part |

## Colours

| element | meaning |
|---|---|
| `<rgb value="r, g, b"/>` | linear sRGB as given; one number is a grey; `#rrggbb` is decoded from sRGB |
| `<float value="v"/>` | grey |
| `<spectrum value="c"/>` | grey c; in an emitter equal energy, c · (1.2048, 0.9484, 0.9087) |
| `<spectrum value="400:0.1, 500:0.7, …"/>` | values at wavelengths in nm, linear in between, zero outside |
| `<spectrum filename="….spd"/>` | the same from a file with `wavelength value` on each line |

Wavelengths are integrated with the CIE 1931 observer from 360 to 830 nm, under D65 except in an emitter;
negative lanes become 0, and those of a list within [0, 1] at most 1. Reflectances must lie in [0, 1]; radiance and the like must be finite and not negative.
"#;
