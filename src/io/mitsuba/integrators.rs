//! The integrator element: table and how it becomes an [`IntegratorDescription`].
//!
//! It says which paths count (their length, roulette, visible emitters); which estimator runs is
//! chosen elsewhere.

use super::builder::{Builder, Given};
use super::plugin::{Kind, Plugin, Property, differs, harmless, optional, required};
use super::tree::{NodeIndex, Tag};
use crate::describe::*;

const DEPTH: &[Property] = &[
    optional("max_depth", Kind::Integer(-1, u32::MAX as i64), "-1", "Longest path in edges; −1: no limit"),
    optional("rr_depth", Kind::Integer(1, u32::MAX as i64), "5", "Path length from which Russian roulette may end a path"),
];
const HIDE: Property = optional("hide_emitters", Kind::Boolean, "false", "Leave out emitters that the sensor sees directly");
const HIDDEN: &[Property] = &[HIDE];
const WRAPPED: &[Property] = &[harmless("hide_emitters", Kind::Boolean, "The nested integrator decides")];
const SHARED: &[Property] = &[
    harmless("samples_per_pass", Kind::Integer(0, i64::MAX), "Passes are chosen by the renderer"),
    harmless("block_size", Kind::Integer(0, i64::MAX), "Blocks are chosen by the renderer"),
    harmless("timeout", Kind::Float, "The budget is given on the command line"),
];

macro_rules! integrator {
    ($name:literal, $doc:literal) => {
        Plugin {
            tag: Tag::Integrator,
            name: $name,
            doc: $doc,
            properties: &[DEPTH, HIDDEN, SHARED],
            example: concat!("<integrator type=\"", $name, "\">\n    <integer name=\"max_depth\" value=\"12\"/>\n</integrator>"),
        }
    };
}

/// Integrators.
pub const INTEGRATORS: &[Plugin] = &[
    integrator!("path", "Gathering walks: path tracing. The default."),
    integrator!("volpath", "As `path`."),
    Plugin {
        tag: Tag::Integrator,
        name: "volpathmis",
        doc: "As `path`.",
        properties: &[DEPTH, HIDDEN, SHARED, &[harmless("use_spectral_mis", Kind::Boolean, "Media only")]],
        example: r#"<integrator type="volpathmis"/>"#,
    },
    integrator!("ptracer", "Shooting walks: light tracing."),
    integrator!("bdpt", "Both walks, combined (not in Mitsuba 3)."),
    Plugin {
        tag: Tag::Integrator,
        name: "direct",
        doc: "Gathering walks of at most two edges: emitters, and surfaces that they light directly.",
        properties: &[
            HIDDEN,
            SHARED,
            &[
                harmless("shading_samples", Kind::Integer(0, i64::MAX), "The techniques are weighted by the renderer"),
                harmless("emitter_samples", Kind::Integer(0, i64::MAX), "The techniques are weighted by the renderer"),
                harmless("bsdf_samples", Kind::Integer(0, i64::MAX), "The techniques are weighted by the renderer"),
            ],
        ],
        example: r#"<integrator type="direct">
    <boolean name="hide_emitters" value="true"/>
</integrator>"#,
    },
    Plugin {
        tag: Tag::Integrator,
        name: "moment",
        doc: "Its nested integrator; variance is always recorded.",
        properties: &[
            &[required("integrator", Kind::Objects(Tag::Integrator, 1), "The integrator that is used")],
            WRAPPED,
            SHARED,
        ],
        example: r#"<integrator type="moment">
    <integrator type="path"/>
</integrator>"#,
    },
    Plugin {
        tag: Tag::Integrator,
        name: "aov",
        doc: "Its nested integrator; other channels are not written.",
        properties: &[
            &[
                differs("aovs", Kind::Text(&[]), "only the colour channels are written"),
                required("integrator", Kind::Objects(Tag::Integrator, 1), "The integrator that is used"),
            ],
            WRAPPED,
            SHARED,
        ],
        example: r#"<integrator type="aov">
    <string name="aovs" value="depth:depth"/>
    <integrator type="path"/>
</integrator>"#,
    },
];

/// The integrator at top level, wrappers taken off.
pub fn build(b: &mut Builder, index: NodeIndex) -> Option<IntegratorDescription> {
    let given = b.given(index)?;
    if let Some((inner, _)) = given.objects(Tag::Integrator).next() {
        return build(b, inner);
    }
    describe(b, &given)
}

fn describe(b: &mut Builder, given: &Given) -> Option<IntegratorDescription> {
    let name = given.plugin.name;
    if matches!(name, "moment" | "aov") {
        return None;
    }
    let direct = name == "direct";
    let max_depth = if direct { 2 } else { b.integer(given, "max_depth") };
    let rr_depth = if direct { 5 } else { b.integer(given, "rr_depth") as u32 };
    Some(IntegratorDescription {
        name: name.into(),
        max_depth: u32::try_from(max_depth).ok(),
        rr_depth,
        hide_emitters: b.boolean(given, "hide_emitters"),
        place: given.place,
    })
}
