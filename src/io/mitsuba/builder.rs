//! Matches one element of the tree with its plugin's table: what is given, unknown, misplaced or missing.
//!
//! `properties` then reads the values.

use super::files::Search;
use super::names;
use super::plugin::{self, Absent, Effect, Kind, Plugin, Property};
use super::tree::{Node, NodeIndex, Tag, Tree};
use super::values;
use crate::describe::*;
use std::collections::{HashMap, HashSet};
use std::path::PathBuf;

/// Fills a [`SceneDescription`] from a tree.
pub struct Builder<'a> {
    /// The file as a tree.
    pub tree: &'a Tree,
    /// What is wrong.
    pub problems: &'a mut Problems,
    /// Where named files are looked for.
    pub search: &'a Search,
    /// What was built.
    pub scene: SceneDescription,
    /// Local models already built, by element.
    pub bsdfs: HashMap<NodeIndex, BsdfId>,
    /// Shape groups already built, by element.
    pub groups: HashMap<NodeIndex, GroupId>,
    /// Area emitters that some shape carries.
    pub carried: HashSet<NodeIndex>,
    /// Where each given property stands, by its element.
    pub places: HashMap<(Place, &'static str), Place>,
    /// Meshes already named, by file and options.
    pub meshes: HashMap<(PathBuf, u32, bool, MeshFormat), MeshId>,
    /// Images already named, by file and `raw`.
    pub images: HashMap<(PathBuf, bool), ImageId>,
    /// Textures built so far, each use of a shared one counted.
    pub textures: usize,
}

/// The properties of one element, matched with its plugin's table.
#[derive(Clone)]
pub struct Given {
    /// Its plugin.
    pub plugin: &'static Plugin,
    /// Where the element stands.
    pub place: Place,
    values: Vec<(&'static Property, NodeIndex, Place)>,
    objects: Vec<(Tag, NodeIndex, Place)>,
}

impl Given {
    /// Whether a property is given.
    pub fn has(&self, name: &str) -> bool {
        self.values.iter().any(|(p, _, _)| p.name == name)
    }

    /// Where a property is given, or else the element.
    pub fn place_of(&self, name: &str) -> Place {
        self.value(name).map_or(self.place, |(_, _, place)| *place)
    }

    /// Nested objects of a tag, references resolved, each with the place where it is nested.
    pub fn objects(&self, tag: Tag) -> impl Iterator<Item = (NodeIndex, Place)> + '_ {
        self.objects.iter().filter(move |(t, _, _)| *t == tag).map(|&(_, node, place)| (node, place))
    }

    /// A given property with its element and place.
    pub fn value(&self, name: &str) -> Option<&(&'static Property, NodeIndex, Place)> {
        self.values.iter().find(|(p, _, _)| p.name == name)
    }

    /// `bsdf `diffuse``, for messages.
    pub fn label(&self) -> String {
        format!("{} `{}`", self.plugin.tag.name(), self.plugin.name)
    }
}

impl<'a> Builder<'a> {
    /// A builder of nothing yet.
    pub fn new(tree: &'a Tree, search: &'a Search, problems: &'a mut Problems) -> Self {
        Self {
            tree,
            problems,
            search,
            scene: SceneDescription { sources: tree.sources.clone(), ..Default::default() },
            bsdfs: HashMap::new(),
            groups: HashMap::new(),
            carried: HashSet::new(),
            places: HashMap::new(),
            meshes: HashMap::new(),
            images: HashMap::new(),
            textures: 0,
        }
    }

    /// An element of the tree.
    pub fn node(&self, index: NodeIndex) -> &'a Node {
        &self.tree.nodes[index]
    }

    /// The `id` of an element.
    pub fn id(&self, index: NodeIndex) -> Option<String> {
        self.node(index).text("id").map(str::to_string)
    }

    /// Matches an object with its plugin's table; `None` if there is no such plugin (reported).
    pub fn given(&mut self, index: NodeIndex) -> Option<Given> {
        if self.problems.is_flooded() {
            return None;
        }
        let node = self.node(index);
        let name = node.attribute("type")?.value.as_str();
        let Some(plugin) = plugin::find(node.tag, name) else {
            let (place, tag) = (node.place_of("type"), node.tag.name());
            if plugin::not_yet(node.tag, name) {
                self.problems.error(place, format!("Mitsuba's `{name}` ({tag}) is not supported yet"));
            } else {
                let what = format!("unknown {tag} `{}`", values::shown(name));
                self.problems.error(place, what).hint(names::hint(name, plugin::known(node.tag)));
            }
            return None;
        };
        let mut given = Given { plugin, place: node.place, values: Vec::new(), objects: Vec::new() };
        for &child in &node.children {
            self.take(&mut given, child);
        }
        for property in plugin.all().filter(|p| p.absent == Absent::Required) {
            let missing = match property.kind {
                Kind::Objects(tag, _) => given.objects(tag).next().is_none(),
                _ => !given.has(property.name),
            };
            if missing {
                self.problems
                    .error(node.place, format!("{} needs `{}`", given.label(), property.name))
                    .hint(format!("{}: {}", property.name, property.doc));
            }
        }
        Some(given)
    }

    /// One nested element of an object: a value, a nested object, or a mistake.
    fn take(&mut self, given: &mut Given, child: NodeIndex) {
        let Some(target) = self.tree.resolve(child) else { return };
        let (outer, inner) = (self.node(child), self.node(target));
        let name = outer.text("name");
        if inner.is_object() {
            let fits = |p: &&Property| match inner.tag {
                Tag::Texture => p.kind == Kind::Texture,
                Tag::Spectrum => matches!(p.kind, Kind::Texture | Kind::Colour),
                _ => false,
            };
            if let Some(property) = name.and_then(|n| given.plugin.property(n)).filter(fits) {
                self.take_value(given, property, target, outer.place);
            } else if let Some(property) = given.plugin.nested(inner.tag) {
                self.take_object(given, property, target, outer.place);
            } else {
                self.report_misplaced(given, outer, inner);
            }
            return;
        }
        let Some(name) = name else { return };
        match given.plugin.property(name) {
            Some(property) => {
                let place = if inner.attribute("value").is_some() { inner.place_of("value") } else { inner.place };
                if accepts(property.kind, inner.tag) {
                    self.take_value(given, property, target, place);
                } else {
                    let what = format!(
                        "`{name}` of {} must be {}, not {}",
                        given.label(),
                        expected(property.kind),
                        article(inner.tag.name())
                    );
                    self.problems.error(outer.place, what);
                }
            }
            None => self.report_unknown(given, name, outer.place_of("name")),
        }
    }

    fn take_value(&mut self, given: &mut Given, property: &'static Property, node: NodeIndex, place: Place) {
        if given.has(property.name) {
            let first = self.tree.sources.locate(given.place_of(property.name)).unwrap_or_default();
            self.problems
                .error(place, format!("`{}` of {} is given twice", property.name, given.label()))
                .hint(format!("it was first given at {first}"));
            return;
        }
        if let Effect::Differs(why) = property.effect {
            self.problems.warning(place, format!("`{}` of {} has no effect: {why}", property.name, given.label()));
        }
        self.places.insert((given.place, property.name), place);
        given.values.push((property, node, place));
    }

    fn take_object(&mut self, given: &mut Given, property: &Property, node: NodeIndex, place: Place) {
        let Kind::Objects(tag, most) = property.kind else { return };
        if given.objects(tag).count() >= most {
            let what = format!("{} takes at most {most} <{}>", given.label(), tag.name());
            self.problems.error(place, what);
            return;
        }
        given.objects.push((tag, node, place));
    }

    fn report_unknown(&mut self, given: &Given, name: &str, place: Place) {
        let known = given.plugin.all().filter(|p| !matches!(p.kind, Kind::Objects(..))).map(|p| p.name);
        self.problems
            .error(place, format!("unknown property `{}` of {}", values::shown(name), given.label()))
            .hint(names::hint(name, known));
    }

    fn report_misplaced(&mut self, given: &Given, outer: &Node, inner: &Node) {
        if matches!(inner.tag, Tag::Medium | Tag::Phase | Tag::Volume) {
            self.problems.error(outer.place, format!("Mitsuba's <{}> is not supported yet", inner.tag.name()));
            return;
        }
        match outer.attribute("name") {
            Some(name) if matches!(inner.tag, Tag::Texture | Tag::Spectrum) => match given.plugin.property(&name.value) {
                Some(property) => {
                    let what = format!(
                        "`{}` of {} must be {}, not a <{}>",
                        property.name,
                        given.label(),
                        expected(property.kind),
                        inner.tag.name()
                    );
                    self.problems.error(outer.place, what);
                }
                None => self.report_unknown(given, &name.value, name.place),
            },
            None if matches!(inner.tag, Tag::Texture | Tag::Spectrum) => {
                let takers = given.plugin.all().filter(|p| p.kind == Kind::Texture).map(|p| p.name);
                self.problems
                    .error(outer.place, format!("the <{}> in {} has no `name`", inner.tag.name(), given.label()))
                    .hint(format!("the name says which property it is for: {}", takers.collect::<Vec<_>>().join(", ")));
            }
            _ => {
                self.problems.error(outer.place, format!("{} takes no <{}>", given.label(), inner.tag.name()));
            }
        }
    }

    /// An image by file and `raw`, each named once.
    pub fn image(&mut self, path: PathBuf, raw: bool, place: Place) -> ImageId {
        *self.images.entry((path.clone(), raw)).or_insert_with(|| {
            self.scene.images.push(ImageDescription::File { path, raw, place });
            ImageId(self.scene.images.len() as u32 - 1)
        })
    }
}

/// Which value elements a property accepts.
fn accepts(kind: Kind, tag: Tag) -> bool {
    match kind {
        Kind::Float => matches!(tag, Tag::Float | Tag::Integer),
        Kind::Integer(..) => tag == Tag::Integer,
        Kind::Boolean => tag == Tag::Boolean,
        Kind::Text(_) | Kind::File => tag == Tag::Text,
        Kind::Triple => matches!(tag, Tag::Point | Tag::Vector),
        Kind::Transform => tag == Tag::Transform,
        Kind::Colour | Kind::Texture => matches!(tag, Tag::Rgb | Tag::Spectrum | Tag::Float | Tag::Integer),
        Kind::Ior => matches!(tag, Tag::Float | Tag::Integer | Tag::Text),
        Kind::Objects(..) => false,
    }
}

/// A kind in words.
pub fn expected(kind: Kind) -> String {
    match kind {
        Kind::Float => "a float".into(),
        Kind::Integer(..) => "an integer".into(),
        Kind::Boolean => "a boolean".into(),
        Kind::Text(_) | Kind::File => "a string".into(),
        Kind::Triple => "a point or vector".into(),
        Kind::Transform => "a transform".into(),
        Kind::Colour => "a colour (rgb, spectrum or float)".into(),
        Kind::Texture => "a float, rgb, spectrum or texture".into(),
        Kind::Ior => "a float or the name of a material".into(),
        Kind::Objects(tag, _) => format!("a nested <{}>", tag.name()),
    }
}

fn article(name: &str) -> String {
    format!("{} {name}", if name.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" })
}
