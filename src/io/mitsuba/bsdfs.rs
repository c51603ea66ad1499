//! Local models: tables and how they become a [`BsdfModel`].

use super::builder::{Builder, Given};
use super::plugin::{Kind, Plugin, Property, free, harmless, optional, required};
use super::spectral;
use super::tree::{NodeIndex, Tag};
use crate::describe::*;

const INTERFACE: &[Property] = &[
    optional("int_ior", Kind::Ior, "bk7", "Index of refraction on the side away from the normal"),
    optional("ext_ior", Kind::Ior, "air", "Index of refraction on the side of the normal"),
];
const COAT: &[Property] = &[
    optional("int_ior", Kind::Ior, "polypropylene", "Index of refraction of the coat"),
    optional("ext_ior", Kind::Ior, "air", "Index of refraction outside"),
    optional("nonlinear", Kind::Boolean, "false", "Colour shifts by reflections inside the coat"),
    optional("diffuse_reflectance", Kind::Texture, "0.5", "Reflectance of the base, in [0, 1]"),
    optional("specular_reflectance", Kind::Texture, "1", "Factor on the reflection of the coat, in [0, 1]"),
];
const REFLECTION: &[Property] = &[optional("specular_reflectance", Kind::Texture, "1", "Factor on the reflection, in [0, 1]")];
const TRANSMISSION: &[Property] =
    &[optional("specular_transmittance", Kind::Texture, "1", "Factor on the transmission, in [0, 1]")];
const METAL: &[Property] = &[
    free("material", Kind::Text(&[]), "`none`, a perfect mirror", "A named conductor (see the list below)"),
    free("eta", Kind::Texture, "by `material`", "Real part of the index of refraction; together with `k`"),
    free("k", Kind::Texture, "by `material`", "Imaginary part of the index of refraction; together with `eta`"),
];
const DISTRIBUTION: &[Property] = &[
    optional("distribution", Kind::Text(&["beckmann", "ggx"]), "beckmann", "Distribution of microfacet normals"),
    harmless("sample_visible", Kind::Boolean, "Visible normals are always sampled"),
];
const ROUGHNESS: &[Property] = &[
    optional("alpha", Kind::Texture, "0.1", "Roughness, the RMS slope of the microfacets"),
    free("alpha_u", Kind::Texture, "`alpha`", "Roughness along u; together with `alpha_v`"),
    free("alpha_v", Kind::Texture, "`alpha`", "Roughness along v; together with `alpha_u`"),
];
const PRINCIPLED: &[Property] = &[
    optional("base_color", Kind::Texture, "0.5", "Colour of the diffuse part, of metal, and of what went in and out of glass"),
    optional("roughness", Kind::Texture, "0.5", "Square root of the facets' roughness, of which 0.001 is the least"),
    optional("anisotropic", Kind::Texture, "0", "How much rougher it is along u than along v"),
    optional("metallic", Kind::Texture, "0", "Share that is metal"),
    optional("spec_trans", Kind::Texture, "0", "Share of the rest that is glass instead of opaque"),
    free("eta", Kind::Float, "by `specular`", "Index of refraction inside over that outside"),
    free("specular", Kind::Float, "0.5", "The same by what is reflected along the normal, 0.08 of this: 0.5 is 4 %"),
    optional("spec_tint", Kind::Texture, "0", "How far the reflection has the colour"),
    optional("sheen", Kind::Texture, "0", "Amount of a glow at grazing angles, as of cloth"),
    optional("sheen_tint", Kind::Texture, "0", "How far it has the colour"),
    optional("flatness", Kind::Texture, "0", "How far the diffuse part looks as if scattered below the surface"),
    optional("clearcoat", Kind::Texture, "0", "Amount of a second, faint reflection"),
    optional("clearcoat_gloss", Kind::Texture, "0", "How polished that is"),
    harmless("main_specular_sampling_rate", Kind::Float, "Lobes are chosen by what they reflect"),
    harmless("clearcoat_sampling_rate", Kind::Float, "Lobes are chosen by what they reflect"),
    harmless("diffuse_reflectance_sampling_rate", Kind::Float, "Lobes are chosen by what they reflect"),
];

/// Local models.
pub const BSDFS: &[Plugin] = &[
    Plugin {
        tag: Tag::Bsdf,
        name: "diffuse",
        doc: "Lambert's law: the same radiance in all directions of the normal's side.",
        properties: &[&[optional("reflectance", Kind::Texture, "0.5", "Reflected share of the light, in [0, 1]")]],
        example: r#"<bsdf type="diffuse" id="red">
    <rgb name="reflectance" value="0.6, 0.06, 0.05"/>
</bsdf>"#,
    },
    Plugin {
        tag: Tag::Bsdf,
        name: "dielectric",
        doc: "A smooth boundary between two transparent media: glass, water, air bubbles.",
        properties: &[INTERFACE, REFLECTION, TRANSMISSION],
        example: r#"<bsdf type="dielectric" id="water">
    <string name="int_ior" value="water"/>
    <float name="ext_ior" value="1"/>
    <rgb name="specular_transmittance" value="0.9, 1, 1"/>
</bsdf>"#,
    },
    Plugin {
        tag: Tag::Bsdf,
        name: "thindielectric",
        doc: "A thin sheet of a transparent medium, all reflections inside summed, without displacement.",
        properties: &[INTERFACE, REFLECTION, TRANSMISSION],
        example: r#"<bsdf type="thindielectric" id="pane">
    <float name="int_ior" value="1.5"/>
</bsdf>"#,
    },
    Plugin {
        tag: Tag::Bsdf,
        name: "roughdielectric",
        doc: "A rough boundary between two transparent media: frosted glass.",
        properties: &[DISTRIBUTION, ROUGHNESS, INTERFACE, REFLECTION, TRANSMISSION],
        example: r#"<bsdf type="roughdielectric" id="frosted">
    <string name="distribution" value="ggx"/>
    <float name="alpha" value="0.2"/>
    <float name="int_ior" value="1.5"/>
    <float name="ext_ior" value="1"/>
</bsdf>"#,
    },
    Plugin {
        tag: Tag::Bsdf,
        name: "conductor",
        doc: "A smooth metal, by name or by its complex index of refraction eta + i k.",
        properties: &[METAL, REFLECTION],
        example: r#"<bsdf type="conductor" id="silver">
    <string name="material" value="Ag"/>
</bsdf>"#,
    },
    Plugin {
        tag: Tag::Bsdf,
        name: "roughconductor",
        doc: "A rough metal, brushed if `alpha_u` and `alpha_v` differ.",
        properties: &[METAL, DISTRIBUTION, ROUGHNESS, REFLECTION],
        example: r#"<bsdf type="roughconductor" id="brushed">
    <string name="distribution" value="ggx"/>
    <float name="alpha_u" value="0.05"/>
    <float name="alpha_v" value="0.3"/>
    <rgb name="eta" value="0.143, 0.375, 1.442"/>
    <rgb name="k" value="3.983, 2.386, 1.603"/>
</bsdf>"#,
    },
    Plugin {
        tag: Tag::Bsdf,
        name: "plastic",
        doc: "A diffuse base under a smooth transparent coat.",
        properties: &[COAT],
        example: r#"<bsdf type="plastic" id="billiard">
    <rgb name="diffuse_reflectance" value="0.1, 0.27, 0.36"/>
    <float name="int_ior" value="1.9"/>
</bsdf>"#,
    },
    Plugin {
        tag: Tag::Bsdf,
        name: "roughplastic",
        doc: "A diffuse base under a rough transparent coat.",
        properties: &[
            DISTRIBUTION,
            &[optional("alpha", Kind::Float, "0.1", "Roughness, the RMS slope of the microfacets")],
            COAT,
        ],
        example: r#"<bsdf type="roughplastic" id="glaze">
    <string name="distribution" value="ggx"/>
    <float name="alpha" value="0.15"/>
    <rgb name="diffuse_reflectance" value="0.1, 0.28, 0.55"/>
    <boolean name="nonlinear" value="true"/>
</bsdf>"#,
    },
    Plugin {
        tag: Tag::Bsdf,
        name: "principled",
        doc: "Plastic, cloth, metal and frosted glass by one set of numbers, all in [0, 1]; what modellers export.",
        properties: &[PRINCIPLED],
        example: r#"<bsdf type="principled" id="lacquer">
    <rgb name="base_color" value="0.6, 0.05, 0.03"/>
    <float name="roughness" value="0.4"/>
    <float name="specular" value="0.6"/>
    <float name="clearcoat" value="1"/>
    <float name="clearcoat_gloss" value="0.9"/>
</bsdf>"#,
    },
    Plugin {
        tag: Tag::Bsdf,
        name: "twosided",
        doc: "Opaque models for both sides: the first for the normal's side, the second (or the first again) for the other.",
        properties: &[&[required("bsdf", Kind::Objects(Tag::Bsdf, 2), "One or two models that transmit nothing")]],
        example: r#"<bsdf type="twosided" id="card">
    <bsdf type="diffuse"/>
    <bsdf type="conductor"/>
</bsdf>"#,
    },
    Plugin {
        tag: Tag::Bsdf,
        name: "mask",
        doc: "Another model where it is opaque; elsewhere light passes straight through.",
        properties: &[&[
            optional("opacity", Kind::Texture, "0.5", "Share of the light that meets the nested model, in [0, 1]"),
            required("bsdf", Kind::Objects(Tag::Bsdf, 1), "The model where it is opaque"),
        ]],
        example: r#"<bsdf type="mask" id="veil">
    <float name="opacity" value="0.7"/>
    <bsdf type="diffuse"/>
</bsdf>"#,
    },
    Plugin {
        tag: Tag::Bsdf,
        name: "null",
        doc: "No surface at all: light passes straight through.",
        properties: &[],
        example: r#"<bsdf type="null" id="nothing"/>"#,
    },
    Plugin {
        tag: Tag::Bsdf,
        name: "blendbsdf",
        doc: "A mixture: (1 − weight) of the first model and weight of the second.",
        properties: &[&[
            required("weight", Kind::Texture, "Share of the second model, in [0, 1]"),
            required("bsdf", Kind::Objects(Tag::Bsdf, 2), "The two models"),
        ]],
        example: r#"<bsdf type="blendbsdf" id="worn">
    <float name="weight" value="0.3"/>
    <bsdf type="conductor"/>
    <bsdf type="diffuse"/>
</bsdf>"#,
    },
];

/// The local model that an object describes, built once however often it is referred to.
pub fn build(b: &mut Builder, index: NodeIndex) -> BsdfId {
    if let Some(&id) = b.bsdfs.get(&index) {
        return id;
    }
    let fallback = || BsdfModel::Diffuse { reflectance: TextureDescription::grey(0.5) };
    let model = match b.given(index) {
        Some(given) => model(b, &given).unwrap_or_else(fallback),
        None => fallback(),
    };
    let description = BsdfDescription { id: b.id(index), model, place: b.node(index).place };
    b.scene.bsdfs.push(description);
    let id = BsdfId(b.scene.bsdfs.len() as u32 - 1);
    b.bsdfs.insert(index, id);
    id
}

fn model(b: &mut Builder, given: &Given) -> Option<BsdfModel> {
    let g = given;
    Some(match g.plugin.name {
        "diffuse" => BsdfModel::Diffuse { reflectance: b.texture(g, "reflectance") },
        "dielectric" => BsdfModel::Dielectric {
            int_ior: b.ior(g, "int_ior"),
            ext_ior: b.ior(g, "ext_ior"),
            specular_reflectance: b.texture(g, "specular_reflectance"),
            specular_transmittance: b.texture(g, "specular_transmittance"),
        },
        "thindielectric" => BsdfModel::ThinDielectric {
            int_ior: b.ior(g, "int_ior"),
            ext_ior: b.ior(g, "ext_ior"),
            specular_reflectance: b.texture(g, "specular_reflectance"),
            specular_transmittance: b.texture(g, "specular_transmittance"),
        },
        "roughdielectric" => {
            let (alpha_u, alpha_v) = roughness(b, g);
            BsdfModel::RoughDielectric {
                distribution: distribution(b, g),
                alpha_u,
                alpha_v,
                int_ior: b.ior(g, "int_ior"),
                ext_ior: b.ior(g, "ext_ior"),
                specular_reflectance: b.texture(g, "specular_reflectance"),
                specular_transmittance: b.texture(g, "specular_transmittance"),
            }
        }
        "conductor" => {
            let (perfect, eta, k) = metal(b, g);
            BsdfModel::Conductor { perfect, eta, k, specular_reflectance: b.texture(g, "specular_reflectance") }
        }
        "roughconductor" => {
            let (perfect, eta, k) = metal(b, g);
            let (alpha_u, alpha_v) = roughness(b, g);
            let specular_reflectance = b.texture(g, "specular_reflectance");
            BsdfModel::RoughConductor {
                distribution: distribution(b, g),
                alpha_u,
                alpha_v,
                perfect,
                eta,
                k,
                specular_reflectance,
            }
        }
        "plastic" => BsdfModel::Plastic {
            int_ior: b.ior(g, "int_ior"),
            ext_ior: b.ior(g, "ext_ior"),
            nonlinear: b.boolean(g, "nonlinear"),
            diffuse_reflectance: b.texture(g, "diffuse_reflectance"),
            specular_reflectance: b.texture(g, "specular_reflectance"),
        },
        "roughplastic" => BsdfModel::RoughPlastic {
            distribution: distribution(b, g),
            alpha: b.float(g, "alpha"),
            int_ior: b.ior(g, "int_ior"),
            ext_ior: b.ior(g, "ext_ior"),
            nonlinear: b.boolean(g, "nonlinear"),
            diffuse_reflectance: b.texture(g, "diffuse_reflectance"),
            specular_reflectance: b.texture(g, "specular_reflectance"),
        },
        "principled" => BsdfModel::Principled { parameters: Box::new(principled(b, g)) },
        "null" => BsdfModel::Null,
        "twosided" => {
            let inner = nested(b, g);
            let front = *inner.first()?;
            BsdfModel::TwoSided { front, back: inner.get(1).copied().unwrap_or(front) }
        }
        "mask" => {
            let opacity = b.texture(g, "opacity");
            BsdfModel::Mask { opacity, inner: *nested(b, g).first()? }
        }
        _ => {
            let weight = b.texture(g, "weight");
            let inner = nested(b, g);
            let [first, second] = inner[..] else {
                if inner.len() == 1 {
                    b.problems.error(g.place, format!("{} needs two nested models, not one", g.label()));
                }
                return None;
            };
            BsdfModel::Blend { weight, first, second }
        }
    })
}

fn nested(b: &mut Builder, given: &Given) -> Vec<BsdfId> {
    given.objects(Tag::Bsdf).map(|(node, _)| build(b, node)).collect()
}

fn distribution(b: &mut Builder, given: &Given) -> MicrofacetDescription {
    match b.text(given, "distribution").as_deref() {
        Some("ggx") => MicrofacetDescription::Ggx,
        _ => MicrofacetDescription::Beckmann,
    }
}

/// `alpha`, or `alpha_u` together with `alpha_v`.
fn roughness(b: &mut Builder, given: &Given) -> (TextureDescription, TextureDescription) {
    let u = b.maybe_texture(given, "alpha_u");
    let v = b.maybe_texture(given, "alpha_v");
    if given.has("alpha_u") != given.has("alpha_v") {
        let there = if given.has("alpha_u") { "alpha_u" } else { "alpha_v" };
        b.problems
            .error(given.place_of(there), format!("{} needs both `alpha_u` and `alpha_v`", given.label()))
            .hint("for the same roughness in all directions use `alpha`");
    } else if given.has("alpha") && given.has("alpha_u") {
        let what = format!("{} has both `alpha` and `alpha_u`, `alpha_v`", given.label());
        b.problems.error(given.place_of("alpha"), what);
    }
    match (u, v) {
        (Some(u), Some(v)) => (u, v),
        _ => {
            let alpha = b.texture(given, "alpha");
            if let Some(&place) = b.places.get(&(given.place, "alpha")) {
                b.places.extend(["alpha_u", "alpha_v"].map(|name| ((given.place, name), place)));
            }
            (alpha.clone(), alpha)
        }
    }
}

fn principled(b: &mut Builder, g: &Given) -> PrincipledDescription {
    PrincipledDescription {
        base_color: b.texture(g, "base_color"),
        roughness: b.texture(g, "roughness"),
        anisotropic: b.texture(g, "anisotropic"),
        metallic: b.texture(g, "metallic"),
        spec_trans: b.texture(g, "spec_trans"),
        spec_tint: b.texture(g, "spec_tint"),
        sheen: b.texture(g, "sheen"),
        sheen_tint: b.texture(g, "sheen_tint"),
        flatness: b.texture(g, "flatness"),
        clearcoat: b.texture(g, "clearcoat"),
        clearcoat_gloss: b.texture(g, "clearcoat_gloss"),
        eta: principled_eta(b, g),
    }
}

/// By `eta`, or by `specular`.
fn principled_eta(b: &mut Builder, given: &Given) -> f32 {
    let (eta, specular) = (b.maybe_float(given, "eta"), b.maybe_float(given, "specular"));
    if given.has("eta") && given.has("specular") {
        let what = format!("{} has both `eta` and `specular`, which say the same", given.label());
        b.problems.error(given.place_of("specular"), what);
    }
    let specular = match specular {
        Some(v) if !(0.0..12.5).contains(&v) => {
            b.problems
                .error(given.place_of("specular"), format!("`specular` is {v}, but must lie in [0, 12.5), usually in [0, 1]"));
            0.5
        }
        v => v.unwrap_or(0.5),
    };
    eta.unwrap_or_else(|| PrincipledDescription::eta(specular))
}

/// `(perfect, eta, k)` by name or by value.
fn metal(b: &mut Builder, given: &Given) -> (bool, TextureDescription, TextureDescription) {
    let grey = TextureDescription::grey;
    let material = b.text(given, "material");
    let by_value = given.has("eta") || given.has("k");
    if given.has("material") && by_value {
        b.problems
            .error(given.place_of("material"), format!("{} has both `material` and `eta` or `k`", given.label()))
            .hint("give either the name or both numbers");
    }
    if by_value {
        if given.has("eta") != given.has("k") {
            let missing = if given.has("eta") { "k" } else { "eta" };
            b.problems.error(given.place, format!("{} needs both `eta` and `k`; `{missing}` is missing", given.label()));
        }
        let eta = b.maybe_texture(given, "eta").unwrap_or(grey(0.0));
        return (false, eta, b.maybe_texture(given, "k").unwrap_or(grey(1.0)));
    }
    match material.as_deref() {
        None | Some("none") => (true, grey(0.0), grey(1.0)),
        Some(name) => match spectral::conductor(name) {
            Ok((eta, k)) => (false, TextureDescription::Constant(eta), TextureDescription::Constant(k)),
            Err(what) => {
                b.problems.error(given.place_of("material"), what);
                (true, grey(0.0), grey(1.0))
            }
        },
    }
}
