//! What a plugin is to the reader: a name, its properties with type, default and meaning, an example.
//!
//! The tables in `shapes`, `bsdfs`, `emitters`, `textures`, `sensors` and `integrators` are the only
//! place where a property is declared: reading, defaults, errors and the manual all follow them.

use super::tree::Tag;

/// Type of a property.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// A number.
    Float,
    /// A whole number from the first to the last given.
    Integer(i64, i64),
    /// `true` or `false`.
    Boolean,
    /// A text that must be one of these, if any are listed.
    Text(&'static [&'static str]),
    /// A name of a file that exists.
    File,
    /// A point or vector.
    Triple,
    /// An affine map.
    Transform,
    /// A colour: `rgb`, `spectrum` or `float`.
    Colour,
    /// A colour that may vary over the surface: also a texture.
    Texture,
    /// Index of refraction: a number or the name of a material.
    Ior,
    /// Nested objects of this tag, by position; at most that many.
    Objects(Tag, usize),
}

/// What a property does here.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Effect {
    /// It means what it means in Mitsuba.
    Full,
    /// It does nothing here, and the picture is the same without.
    None,
    /// It does nothing here, and the picture may differ.
    Differs(&'static str),
}

/// What stands for a property that is not given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Absent {
    /// An error.
    Required,
    /// This value, written as in the file.
    Value(&'static str),
    /// What the words say.
    Means(&'static str),
}

/// A property of a plugin.
#[derive(Clone, Copy, Debug)]
pub struct Property {
    /// Its name.
    pub name: &'static str,
    /// Its type.
    pub kind: Kind,
    /// Its default.
    pub absent: Absent,
    /// Its effect.
    pub effect: Effect,
    /// One line for the manual.
    pub doc: &'static str,
}

/// A property with a default.
pub const fn optional(name: &'static str, kind: Kind, default: &'static str, doc: &'static str) -> Property {
    Property { name, kind, absent: Absent::Value(default), effect: Effect::Full, doc }
}

/// A property whose absence means what the words say.
pub const fn free(name: &'static str, kind: Kind, means: &'static str, doc: &'static str) -> Property {
    Property { name, kind, absent: Absent::Means(means), effect: Effect::Full, doc }
}

/// A property that must be given.
pub const fn required(name: &'static str, kind: Kind, doc: &'static str) -> Property {
    Property { name, kind, absent: Absent::Required, effect: Effect::Full, doc }
}

/// A property that is accepted and does nothing.
pub const fn harmless(name: &'static str, kind: Kind, doc: &'static str) -> Property {
    Property { name, kind, absent: Absent::Means("—"), effect: Effect::None, doc }
}

/// A property that is accepted with a warning, because the picture differs.
pub const fn differs(name: &'static str, kind: Kind, why: &'static str) -> Property {
    Property { name, kind, absent: Absent::Means("—"), effect: Effect::Differs(why), doc: why }
}

/// A plugin that is read.
#[derive(Debug)]
pub struct Plugin {
    /// Element in which it is named.
    pub tag: Tag,
    /// Its `type`.
    pub name: &'static str,
    /// What it is, one or two sentences.
    pub doc: &'static str,
    /// Its properties, in groups that plugins share.
    pub properties: &'static [&'static [Property]],
    /// A small element that uses it, as it may stand in a scene.
    pub example: &'static str,
}

impl Plugin {
    /// All properties.
    pub fn all(&self) -> impl Iterator<Item = &'static Property> + Clone + use<> {
        self.properties.iter().flat_map(|group| group.iter())
    }

    /// A property by name.
    pub fn property(&self, name: &str) -> Option<&'static Property> {
        self.all().find(|p| p.name == name)
    }

    /// The property that takes nested objects of a tag.
    pub fn nested(&self, tag: Tag) -> Option<&'static Property> {
        self.all().find(|p| matches!(p.kind, Kind::Objects(t, _) if t == tag))
    }
}

/// Every plugin that is read, grouped by element.
pub const TABLES: &[&[Plugin]] = &[
    super::integrators::INTEGRATORS,
    super::sensors::SENSORS,
    super::sensors::FILMS,
    super::sensors::FILTERS,
    super::sensors::SAMPLERS,
    super::shapes::SHAPES,
    super::bsdfs::BSDFS,
    super::emitters::EMITTERS,
    super::textures::TEXTURES,
    super::textures::SPECTRA,
];

/// Plugins of Mitsuba 3 that are not read yet: the message must not call them unknown.
const NOT_YET: &[(Tag, &[&str])] = &[
    (
        Tag::Shape,
        &["bsplinecurve", "linearcurve", "ellipsoids", "ellipsoidsmesh", "merge", "sdfgrid", "blender", "heightfield", "hair"],
    ),
    (
        Tag::Bsdf,
        &[
            "bumpmap",
            "normalmap",
            "principledthin",
            "hair",
            "measured",
            "measured_polarized",
            "pplastic",
            "polarizer",
            "retarder",
            "circular",
        ],
    ),
    (Tag::Emitter, &["projector", "directionalarea", "sunsky", "timed_sunsky", "sky", "sun"]),
    (Tag::Sensor, &["distant", "radiancemeter", "irradiancemeter", "batch", "mdistant", "distantflux"]),
    (Tag::Film, &["specfilm", "ldrfilm"]),
    (Tag::Texture, &["mesh_attribute", "volume", "blackbody", "irregular"]),
    (Tag::Spectrum, &["irregular", "regular", "blackbody", "rawconstant", "srgb"]),
    (
        Tag::Integrator,
        &[
            "depth",
            "stokes",
            "prb",
            "prb_basic",
            "prbvolpath",
            "direct_projective",
            "prb_projective",
            "emission_reparam",
            "direct_reparam",
            "prb_reparam",
        ],
    ),
    (Tag::Medium, &["homogeneous", "heterogeneous"]),
    (Tag::Phase, &["isotropic", "hg", "rayleigh", "sggx", "tabphase", "blendphase"]),
    (Tag::Volume, &["constvolume", "gridvolume"]),
];

/// Names of all plugins of an element that are read.
pub fn known(tag: Tag) -> impl Iterator<Item = &'static str> + Clone {
    TABLES.iter().flat_map(|t| t.iter()).filter(move |p| p.tag == tag).map(|p| p.name)
}

/// A plugin by element and `type`.
pub fn find(tag: Tag, name: &str) -> Option<&'static Plugin> {
    TABLES.iter().flat_map(|t| t.iter()).find(|p| p.tag == tag && p.name == name)
}

/// A plugin of Mitsuba that is not read yet.
pub fn not_yet(tag: Tag, name: &str) -> bool {
    NOT_YET.iter().any(|(t, names)| *t == tag && names.contains(&name))
}
