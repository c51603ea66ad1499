//! From one element of the tree to typed values: each property by its declaration in the table.
//!
//! A value that cannot be read is reported and replaced by its default, so that one mistake gives
//! one message and everything else is still checked.

use super::files::Search;
use super::names;
use super::plugin::{self, Absent, Effect, Kind, Plugin, Property};
use super::spectral;
use super::textures;
use super::tree::{Node, NodeIndex, Tag, Tree};
use super::values;
use crate::describe::*;
use glam::{DMat4, DVec3, Mat4, Vec3};
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

    fn value(&self, name: &str) -> Option<&(&'static Property, NodeIndex, Place)> {
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

    /// A property by a parser: as given, else its default, else nothing.
    pub fn read<T>(&mut self, given: &Given, name: &str, parse: impl Fn(&str) -> Result<T, String>) -> Option<T> {
        let property = declared(given, name);
        if let Some(&(_, node, place)) = given.value(name) {
            match parse(self.node(node).text("value").unwrap_or("")) {
                Ok(value) => return Some(value),
                Err(what) => {
                    self.problems.error(place, format!("`{name}` of {}: {what}", given.label()));
                }
            }
        }
        match property.absent {
            Absent::Value(text) => parse(text).ok(),
            _ => None,
        }
    }

    /// A number that has a default or is required.
    pub fn float(&mut self, given: &Given, name: &str) -> f32 {
        self.read(given, name, values::float).unwrap_or(1.0)
    }

    /// A number that may be absent.
    pub fn maybe_float(&mut self, given: &Given, name: &str) -> Option<f32> {
        self.read(given, name, values::float)
    }

    /// A whole number within the range that its kind declares.
    pub fn maybe_integer(&mut self, given: &Given, name: &str) -> Option<i64> {
        let (low, high) = match declared(given, name).kind {
            Kind::Integer(low, high) => (low, high),
            _ => (i64::MIN, i64::MAX),
        };
        self.read(given, name, |text| {
            let value = values::integer(text)?;
            let range = if high == i64::MAX { format!("at least {low}") } else { format!("from {low} to {high}") };
            if (low..=high).contains(&value) { Ok(value) } else { Err(format!("{value} is not {range}")) }
        })
    }

    /// A whole number that has a default.
    pub fn integer(&mut self, given: &Given, name: &str) -> i64 {
        self.maybe_integer(given, name).unwrap_or(1)
    }

    /// A truth value that has a default.
    pub fn boolean(&mut self, given: &Given, name: &str) -> bool {
        self.read(given, name, values::boolean).unwrap_or(false)
    }

    /// A text; one of the choices if its kind lists any.
    pub fn text(&mut self, given: &Given, name: &str) -> Option<String> {
        let choices = match declared(given, name).kind {
            Kind::Text(choices) => choices,
            _ => &[],
        };
        self.read(given, name, |text| {
            if choices.is_empty() || choices.contains(&text) {
                return Ok(text.to_string());
            }
            Err(format!("`{}` is none of its values; {}", values::shown(text), names::hint(text, choices.iter().copied())))
        })
    }

    /// A point or vector.
    pub fn triple(&mut self, given: &Given, name: &str) -> Option<Vec3> {
        if let Some(&(_, node, place)) = given.value(name) {
            match self.triple_of(node) {
                Ok(value) => return Some(values::point(value)),
                Err(what) => {
                    self.problems.error(place, format!("`{name}` of {}: {what}", given.label()));
                }
            }
        }
        match declared(given, name).absent {
            Absent::Value(text) => values::triple(text).ok().map(values::point),
            _ => None,
        }
    }

    fn triple_of(&self, node: NodeIndex) -> Result<DVec3, String> {
        let node = self.node(node);
        let axes = ["x", "y", "z"].map(|axis| node.text(axis));
        match (node.text("value"), axes) {
            (Some(_), axes) if axes.iter().any(Option::is_some) => Err("either `value` or x, y, z, not both".into()),
            (Some(text), _) => values::triple(text),
            (None, [Some(x), Some(y), Some(z)]) => Ok(DVec3::new(values::number(x)?, values::number(y)?, values::number(z)?)),
            (None, _) => Err("x, y and z are all needed".into()),
        }
    }

    /// An affine map; the identity by default.
    pub fn transform(&mut self, given: &Given, name: &str) -> Placed<Mat4> {
        let Some(&(_, node, place)) = given.value(name) else { return Placed { value: Mat4::IDENTITY, place: given.place } };
        Placed { value: self.transform_of(node).as_mat4(), place }
    }

    /// Each step applies after those before it: `M = step · M`.
    fn transform_of(&mut self, node: NodeIndex) -> DMat4 {
        let mut total = DMat4::IDENTITY;
        for &step in &self.node(node).children {
            match self.step(step) {
                Ok(matrix) => total = matrix * total,
                Err(what) => {
                    let node = self.node(step);
                    self.problems.error(node.place, format!("<{}>: {what}", node.tag.name()));
                }
            }
        }
        total
    }

    fn step(&self, index: NodeIndex) -> Result<DMat4, String> {
        let node = self.node(index);
        match node.tag {
            Tag::Translate => self.axes(node, 0.0).map(DMat4::from_translation),
            Tag::Scale => self.axes(node, 1.0).map(DMat4::from_scale),
            Tag::Rotate => {
                let axis = self.axes(node, 0.0)?;
                let angle = values::number(node.text("angle").unwrap_or("0"))?;
                let axis = axis.try_normalize().ok_or("the axis is zero")?;
                Ok(DMat4::from_axis_angle(axis, angle.to_radians()))
            }
            Tag::Matrix => {
                let matrix = values::matrix(node.text("value").unwrap_or(""))?;
                if values::is_affine(matrix) { Ok(matrix) } else { Err("the last row must be 0 0 0 1".into()) }
            }
            Tag::LookAt => {
                let part = |name: &str| node.text(name).map(values::triple).transpose();
                let (origin, target) = (part("origin")?.unwrap_or_default(), part("target")?.unwrap_or(DVec3::Z));
                if origin == target {
                    return Err("origin and target are the same point".into());
                }
                values::look_at(origin, target, part("up")?).ok_or_else(|| "`up` is zero or parallel to the line of sight".into())
            }
            _ => Ok(DMat4::IDENTITY),
        }
    }

    /// `value` (one or three numbers) or any of x, y, z.
    fn axes(&self, node: &Node, absent: f64) -> Result<DVec3, String> {
        let mut axes = [absent; 3];
        let mut single = false;
        for (axis, name) in axes.iter_mut().zip(["x", "y", "z"]) {
            if let Some(text) = node.text(name) {
                *axis = values::number(text)?;
                single = true;
            }
        }
        match node.text("value") {
            Some(_) if single => Err("either `value` or x, y, z, not both".into()),
            Some(text) => values::triple(text),
            None => Ok(DVec3::from_array(axes)),
        }
    }

    /// A colour that is the same everywhere.
    pub fn colour(&mut self, given: &Given, name: &str) -> [f32; 3] {
        match self.texture(given, name) {
            TextureDescription::Constant(rgb) => rgb,
            _ => [1.0; 3],
        }
    }

    /// A colour that may vary over the surface.
    pub fn texture(&mut self, given: &Given, name: &str) -> TextureDescription {
        self.maybe_texture(given, name).unwrap_or(TextureDescription::grey(1.0))
    }

    /// A texture that may be absent.
    pub fn maybe_texture(&mut self, given: &Given, name: &str) -> Option<TextureDescription> {
        if let Some(&(_, node, place)) = given.value(name) {
            if self.node(node).is_object() {
                if let Some(texture) = textures::build(self, node) {
                    return Some(texture);
                }
            } else {
                match self.colour_of(node) {
                    Ok(rgb) => return Some(TextureDescription::Constant(rgb)),
                    Err(what) => {
                        self.problems.error(place, format!("`{name}` of {}: {what}", given.label()));
                    }
                }
            }
        }
        match declared(given, name).absent {
            Absent::Value(text) => values::rgb(text).ok().map(TextureDescription::Constant),
            _ => None,
        }
    }

    fn colour_of(&mut self, index: NodeIndex) -> Result<[f32; 3], String> {
        let node = self.node(index);
        let text = node.text("value");
        match node.tag {
            Tag::Rgb => values::rgb(text.unwrap_or("")),
            Tag::Spectrum => match (text, node.attribute("filename")) {
                (Some(text), None) => spectral::parse(text, node.emissive),
                (None, Some(file)) => {
                    let found = self.search.resolve(&file.value, &self.tree.directory(file.place));
                    let path = found.map_err(|(what, hint)| format!("{what}; {}", hint.unwrap_or_default()))?;
                    spectral::read_file(&path, node.emissive)
                }
                _ => Err("a spectrum has either `value` or `filename`".into()),
            },
            _ => values::float(text.unwrap_or("")).map(|v| [v; 3]),
        }
    }

    /// An index of refraction.
    pub fn ior(&mut self, given: &Given, name: &str) -> f32 {
        self.read(given, name, |text| values::float(text).or_else(|_| spectral::dielectric(text))).unwrap_or(1.5)
    }

    /// A file that exists.
    pub fn file(&mut self, given: &Given, name: &str) -> Option<PathBuf> {
        let &(_, node, place) = given.value(name)?;
        let text = self.node(node).text("value").unwrap_or("");
        match self.search.resolve(text, &self.tree.directory(place)) {
            Ok(path) => Some(path),
            Err((what, hint)) => {
                self.problems.error(place, what).hint = hint;
                None
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

/// The declaration of a property that the code asks for.
fn declared(given: &Given, name: &str) -> &'static Property {
    debug_assert!(given.plugin.property(name).is_some(), "{} declares no `{name}`", given.plugin.name);
    given.plugin.property(name).unwrap_or(&UNDECLARED)
}

static UNDECLARED: Property = plugin::harmless("", Kind::Boolean, "");

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
