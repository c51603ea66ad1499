//! The scene file as a tree: elements with their places, after `$name`, `<include>` and `<alias>`.
//!
//! Files that are included stand where they were included; references are still names here
//! (`links` resolves them).

use crate::describe::{Place, Sources};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Index into [`Tree::nodes`].
pub type NodeIndex = usize;

/// What an element is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum Tag {
    Scene,
    Shape,
    Bsdf,
    Emitter,
    Sensor,
    Film,
    Rfilter,
    Sampler,
    Integrator,
    Texture,
    Medium,
    Phase,
    Volume,
    Spectrum,
    Rgb,
    Float,
    Integer,
    Boolean,
    Text,
    Point,
    Vector,
    Transform,
    Translate,
    Rotate,
    Scale,
    LookAt,
    Matrix,
    Ref,
}

/// An element that the reader knows: tag, name in the file, attributes it may carry.
pub struct ElementKind {
    /// What it is.
    pub tag: Tag,
    /// Its name in the file.
    pub name: &'static str,
    /// Attributes that it may carry.
    pub attributes: &'static [&'static str],
}

const fn element(tag: Tag, name: &'static str, attributes: &'static [&'static str]) -> ElementKind {
    ElementKind { tag, name, attributes }
}

const OBJECT: &[&str] = &["type", "id", "name"];
const VALUE: &[&str] = &["name", "value"];
const TRIPLE: &[&str] = &["name", "value", "x", "y", "z"];

/// All elements that become part of the tree. `default`, `include`, `path` and `alias` do not.
pub const ELEMENTS: &[ElementKind] = &[
    element(Tag::Scene, "scene", &["version", "type", "id", "name"]),
    element(Tag::Shape, "shape", OBJECT),
    element(Tag::Bsdf, "bsdf", OBJECT),
    element(Tag::Emitter, "emitter", OBJECT),
    element(Tag::Sensor, "sensor", OBJECT),
    element(Tag::Film, "film", OBJECT),
    element(Tag::Rfilter, "rfilter", OBJECT),
    element(Tag::Sampler, "sampler", OBJECT),
    element(Tag::Integrator, "integrator", OBJECT),
    element(Tag::Texture, "texture", OBJECT),
    element(Tag::Medium, "medium", OBJECT),
    element(Tag::Phase, "phase", OBJECT),
    element(Tag::Volume, "volume", OBJECT),
    element(Tag::Spectrum, "spectrum", &["type", "id", "name", "value", "filename"]),
    element(Tag::Rgb, "rgb", VALUE),
    element(Tag::Float, "float", VALUE),
    element(Tag::Integer, "integer", VALUE),
    element(Tag::Boolean, "boolean", VALUE),
    element(Tag::Text, "string", VALUE),
    element(Tag::Point, "point", TRIPLE),
    element(Tag::Vector, "vector", TRIPLE),
    element(Tag::Transform, "transform", &["name"]),
    element(Tag::Translate, "translate", &["value", "x", "y", "z"]),
    element(Tag::Rotate, "rotate", &["value", "x", "y", "z", "angle"]),
    element(Tag::Scale, "scale", &["value", "x", "y", "z"]),
    element(Tag::LookAt, "lookat", &["origin", "target", "up"]),
    element(Tag::Matrix, "matrix", &["value"]),
    element(Tag::Ref, "ref", &["id", "name"]),
];

/// Elements that steer the reading.
pub const DIRECTIVES: &[(&str, &[&str])] =
    &[("default", &["name", "value"]), ("include", &["filename"]), ("path", &["value"]), ("alias", &["id", "as"])];

impl Tag {
    /// The name of the element in the file.
    pub fn name(self) -> &'static str {
        ELEMENTS.iter().find(|e| e.tag == self).map_or("?", |e| e.name)
    }

    /// An element with a `type` that is built from properties (a `spectrum` may be one).
    pub fn is_object(self) -> bool {
        use Tag::*;
        matches!(
            self,
            Scene | Shape | Bsdf | Emitter | Sensor | Film | Rfilter | Sampler | Integrator | Texture | Medium | Phase | Volume
        )
    }

    /// A step of a transform.
    pub fn is_transform_step(self) -> bool {
        matches!(self, Tag::Translate | Tag::Rotate | Tag::Scale | Tag::LookAt | Tag::Matrix)
    }
}

/// An attribute after `$name` was replaced.
#[derive(Clone, Debug)]
pub struct Attribute {
    /// Its name.
    pub name: &'static str,
    /// Its value.
    pub value: String,
    /// Where the value stands.
    pub place: Place,
}

/// An element of the tree.
#[derive(Clone, Debug)]
pub struct Node {
    /// What it is.
    pub tag: Tag,
    /// Its attributes, each at most once.
    pub attributes: Vec<Attribute>,
    /// Nested elements in file order.
    pub children: Vec<NodeIndex>,
    /// Where it starts.
    pub place: Place,
    /// Nested in an emitter, directly or deeper: `spectrum` values are emission.
    pub emissive: bool,
    /// What a `ref` leads to, once links are resolved.
    pub target: Option<NodeIndex>,
}

impl Node {
    /// An attribute.
    pub fn attribute(&self, name: &str) -> Option<&Attribute> {
        self.attributes.iter().find(|a| a.name == name)
    }

    /// The text of an attribute.
    pub fn text(&self, name: &str) -> Option<&str> {
        self.attribute(name).map(|a| a.value.as_str())
    }

    /// Where an attribute's value stands, or else the element.
    pub fn place_of(&self, name: &str) -> Place {
        self.attribute(name).map_or(self.place, |a| a.place)
    }

    /// The `type` of an object.
    pub fn plugin(&self) -> &str {
        self.text("type").unwrap_or("")
    }

    /// An object with a plugin (a plain `spectrum` value is none).
    pub fn is_object(&self) -> bool {
        self.tag.is_object() || (self.tag == Tag::Spectrum && self.attribute("type").is_some())
    }
}

/// The whole file with its includes.
#[derive(Clone, Debug, Default)]
pub struct Tree {
    /// All elements.
    pub nodes: Vec<Node>,
    /// Elements directly under the scene, in order.
    pub top: Vec<NodeIndex>,
    /// Objects by `id` and alias.
    pub ids: BTreeMap<String, NodeIndex>,
    /// The texts.
    pub sources: Sources,
    /// The directory of each text, for relative file names.
    pub directories: Vec<PathBuf>,
}

impl Tree {
    /// What a child is: itself, or what a reference leads to (nothing if it dangles).
    pub fn resolve(&self, child: NodeIndex) -> Option<NodeIndex> {
        if self.nodes[child].tag == Tag::Ref { self.nodes[child].target } else { Some(child) }
    }

    /// The directory of the text in which a place lies.
    pub fn directory(&self, place: Place) -> PathBuf {
        (place.file as usize).checked_sub(1).and_then(|i| self.directories.get(i)).cloned().unwrap_or_default()
    }
}
