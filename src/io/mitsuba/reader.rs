//! XML text → [`Tree`]: elements, `include`, `path`, `alias` and ids, in document order.
//!
//! Everything that could grow without bound on hostile input is counted: depth of nesting and of
//! includes, number of included files and of elements; `parameters` counts the length of replaced text.

use super::files::{MAX_DIRECTORIES, Search};
use super::names;
use super::parameters::Parameters;
use super::text::{self, Locator, MAX_DEPTH};
use super::tree::{Attribute, DIRECTIVES, ELEMENTS, Node, NodeIndex, Tag, Tree};
use super::values::shown;
use crate::describe::{Place, Problems, SourceFile};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;

const MAX_INCLUDE_DEPTH: usize = 32;
const MAX_INCLUDES: usize = 10_000;
const MAX_NODES: usize = 1 << 24;

/// Reads a scene file and all that it includes.
pub struct Reader<'a> {
    /// What was read so far.
    pub tree: Tree,
    /// What is wrong so far.
    pub problems: &'a mut Problems,
    /// Where named files are looked for.
    pub search: Search,
    parameters: Parameters,
    /// Files that are being read now, outermost first.
    open: Vec<PathBuf>,
    loaded: HashMap<PathBuf, (Arc<str>, Rc<Locator>)>,
    includes: usize,
}

/// Where an element stands: its text, and whether it is inside an emitter.
struct Context<'t> {
    text: &'t str,
    locator: &'t Locator,
    depth: usize,
    emissive: bool,
}

impl<'a> Reader<'a> {
    /// A reader with parameters given from outside.
    pub fn new(defines: &[(String, String)], search: Search, problems: &'a mut Problems) -> Self {
        Self {
            tree: Tree::default(),
            problems,
            search,
            parameters: Parameters::new(defines),
            open: Vec::new(),
            loaded: HashMap::new(),
            includes: 0,
        }
    }

    /// Reads the scene's main file.
    pub fn read_file(&mut self, path: &Path) {
        match text::read(path) {
            Ok(text) => {
                let directory = path.parent().unwrap_or(Path::new("")).to_path_buf();
                self.open.push(path.canonicalize().unwrap_or_else(|_| path.to_path_buf()));
                self.read_main(path.to_path_buf(), directory, text);
            }
            Err(what) => {
                self.problems.error(Place::default(), what);
            }
        }
    }

    /// Reads the scene's main text; `path` is only its name in messages.
    pub fn read_main(&mut self, path: PathBuf, directory: PathBuf, text: String) {
        self.search.add(directory.clone());
        let (text, locator) = self.register(path, directory, text);
        self.tree.top = self.read_text(&text, &locator, 0, false, true);
        self.parameters.report_unused(self.problems);
    }

    /// Makes a text known to places.
    fn register(&mut self, path: PathBuf, directory: PathBuf, text: String) -> (Arc<str>, Rc<Locator>) {
        let text: Arc<str> = text.into();
        self.tree.sources.files.push(SourceFile { path, text: text.clone() });
        self.tree.directories.push(directory);
        let locator = Rc::new(Locator::new(&text, self.tree.sources.files.len() as u32));
        (text, locator)
    }

    /// Parses one text and returns what stands under its root.
    fn read_text(&mut self, text: &str, locator: &Locator, depth: usize, emissive: bool, main: bool) -> Vec<NodeIndex> {
        if !text::check(text, locator, self.problems) {
            return Vec::new();
        }
        let options = roxmltree::ParsingOptions { allow_dtd: false, nodes_limit: MAX_NODES as u32, ..Default::default() };
        let document = match roxmltree::Document::parse_with_options(text, options) {
            Ok(document) => document,
            Err(error) => {
                self.report_xml(&error, text, locator);
                return Vec::new();
            }
        };
        for node in document.descendants().filter(|n| n.is_element() && n.tag_name().name() == "default") {
            self.parameters.announce(node.attribute("name").unwrap_or(""));
        }
        let root = document.root_element();
        let context = Context { text, locator, depth, emissive };
        if root.tag_name().name() == "scene" {
            self.check_version(root, &context);
            return self.read_children(root, &context);
        }
        let place = locator.place(text, root.range().start);
        if main {
            let name = root.tag_name().name();
            self.problems
                .error(place, format!("the root element is <{}>, not <scene>", shown(name)))
                .hint("a scene starts with <scene version=\"3.0.0\">");
            return Vec::new();
        }
        self.read_element(root, &context).into_iter().collect()
    }

    fn report_xml(&mut self, error: &roxmltree::Error, text: &str, locator: &Locator) {
        let at = error.pos();
        let whole = matches!(error, roxmltree::Error::UnclosedRootNode | roxmltree::Error::UnexpectedEndOfStream);
        let place = if whole {
            locator.place(text, text.trim_end().len())
        } else {
            Place { column: at.col, line: at.row, ..locator.place(text, 0) }
        };
        let mut what = error.to_string();
        if let Some(cut) = what.rfind(" at ").filter(|&cut| what[cut + 4..].chars().all(|c| c.is_ascii_digit() || c == ':')) {
            what.truncate(cut);
        }
        let what: String =
            what.chars().flat_map(|c| if c.is_control() { c.escape_default().collect() } else { vec![c] }).collect();
        self.problems.error(place, format!("malformed XML: {what}"));
    }

    fn check_version(&mut self, root: roxmltree::Node, context: &Context) {
        let place = context.locator.place(context.text, root.range().start);
        let Some(attribute) = root.attribute_node("version") else {
            self.problems
                .error(place, "the <scene> element has no version")
                .hint("add version=\"3.0.0\"; versions 2.x and 3.x are read");
            return;
        };
        let place = context.locator.place(context.text, attribute.range_value().start);
        let version = attribute.value().trim();
        let numbers: Option<Vec<u32>> = version.split('.').map(|part| part.parse().ok()).collect();
        match numbers.as_deref() {
            Some([2 | 3, rest @ ..]) if rest.len() <= 2 => {}
            Some([major, rest @ ..]) if rest.len() <= 2 => {
                let hint = if *major < 2 {
                    "files of Mitsuba 0.x use another language; Mitsuba 3 can convert them"
                } else {
                    "versions 2.x and 3.x are read"
                };
                self.problems.error(place, format!("scene version {} is not known", shown(version))).hint(hint);
            }
            _ => {
                self.problems
                    .error(place, format!("`{}` is not a scene version", shown(version)))
                    .hint("versions 2.x and 3.x are read");
            }
        }
    }

    /// Children of an element; directives are carried out, includes spliced in.
    fn read_children(&mut self, parent: roxmltree::Node, context: &Context) -> Vec<NodeIndex> {
        let mut children = Vec::new();
        for child in parent.children() {
            let place = context.locator.place(context.text, child.range().start);
            if child.is_text() && !child.text().unwrap_or("").trim().is_empty() {
                let at = child.range().start;
                let skipped = context.text[at..].len() - context.text[at..].trim_start().len();
                let place = context.locator.place(context.text, at + skipped);
                self.problems.warning(place, "text between elements has no meaning");
            } else if child.is_element() {
                match child.tag_name().name() {
                    "default" | "path" | "alias" => self.read_directive(child, context, place),
                    "include" => children.extend(self.read_include(child, context, place)),
                    _ => children.extend(self.read_element(child, context)),
                }
            }
        }
        children
    }

    fn read_element(&mut self, xml: roxmltree::Node, context: &Context) -> Option<NodeIndex> {
        if self.problems.is_flooded() {
            return None;
        }
        let place = context.locator.place(context.text, xml.range().start);
        let name = xml.tag_name().name();
        let Some(kind) = ELEMENTS.iter().find(|e| e.name == name) else {
            let known = ELEMENTS.iter().map(|e| e.name).chain(DIRECTIVES.iter().map(|d| d.0));
            self.problems.error(place, format!("unknown element <{}>", shown(name))).hint(names::hint(name, known));
            return None;
        };
        if self.tree.nodes.len() >= MAX_NODES || context.depth >= MAX_DEPTH {
            let too = if context.depth >= MAX_DEPTH { "nested deeper than 256 through includes" } else { "too many" };
            self.problems.error(place, format!("the scene's elements are {too}"));
            return None;
        }
        let attributes = self.read_attributes(xml, kind.name, kind.attributes, context);
        let emissive = context.emissive || kind.tag == Tag::Emitter;
        let index = self.tree.nodes.len();
        self.tree.nodes.push(Node { tag: kind.tag, attributes, children: Vec::new(), place, emissive, target: None });
        self.check_required(index, place);
        self.register_id(index);
        let inner = Context { depth: context.depth + 1, emissive, ..*context };
        let children = self.read_children(xml, &inner);
        self.check_children(index, &children);
        self.tree.nodes[index].children = children;
        Some(index)
    }

    fn read_attributes(
        &mut self,
        xml: roxmltree::Node,
        element: &str,
        allowed: &[&'static str],
        context: &Context,
    ) -> Vec<Attribute> {
        let mut attributes = Vec::new();
        for attribute in xml.attributes() {
            let Some(name) = allowed.iter().find(|a| **a == attribute.name()) else {
                let place = context.locator.place(context.text, attribute.range().start);
                self.problems
                    .error(place, format!("unknown attribute `{}` of <{element}>", shown(attribute.name())))
                    .hint(names::hint(attribute.name(), allowed.iter().copied()));
                continue;
            };
            let place = context.locator.place(context.text, attribute.range_value().start);
            attributes.push(Attribute { name, value: self.parameters.replace(attribute.value(), place, self.problems), place });
        }
        attributes
    }

    /// Attributes without which the element means nothing.
    fn check_required(&mut self, index: NodeIndex, place: Place) {
        let node = &self.tree.nodes[index];
        let required: &[&str] = match node.tag {
            Tag::Float | Tag::Integer | Tag::Boolean | Tag::Text | Tag::Rgb => VALUE_REQUIRED,
            Tag::Transform | Tag::Point | Tag::Vector => &["name"],
            Tag::Ref => &["id"],
            Tag::Rotate => &["angle"],
            Tag::Matrix => &["value"],
            Tag::LookAt => &["origin", "target"],
            tag if tag.is_object() && tag != Tag::Scene => &["type"],
            _ => &[],
        };
        for name in required.iter().filter(|name| node.attribute(name).is_none()) {
            self.problems.error(place, format!("<{}> has no `{name}`", node.tag.name()));
        }
    }

    fn register_id(&mut self, index: NodeIndex) {
        let node = &self.tree.nodes[index];
        let Some(id) = node.attribute("id").filter(|_| node.tag != Tag::Ref) else { return };
        let (id, place) = (id.value.clone(), id.place);
        self.name(id, index, place);
    }

    fn name(&mut self, id: String, index: NodeIndex, place: Place) {
        match self.tree.ids.get(&id) {
            Some(&first) => {
                let at = self.tree.nodes[first].place_of("id");
                let first = self.tree.sources.locate(at).unwrap_or_default();
                self.problems
                    .error(place, format!("the id `{}` is used twice", shown(&id)))
                    .hint(format!("it was first used at {first}"));
            }
            None => {
                self.tree.ids.insert(id, index);
            }
        }
    }

    /// Which elements may stand inside which.
    fn check_children(&mut self, index: NodeIndex, children: &[NodeIndex]) {
        let parent = self.tree.nodes[index].tag;
        let object = self.tree.nodes[index].is_object();
        for &child in children {
            let node = &self.tree.nodes[child];
            let fits =
                if parent == Tag::Transform { node.tag.is_transform_step() } else { object && !node.tag.is_transform_step() };
            if !fits || node.tag == Tag::Scene {
                self.problems.error(node.place, format!("<{}> cannot stand inside <{}>", node.tag.name(), parent.name()));
            }
        }
    }

    fn read_directive(&mut self, xml: roxmltree::Node, context: &Context, place: Place) {
        let name = xml.tag_name().name();
        let allowed = DIRECTIVES.iter().find(|d| d.0 == name).map_or(&[][..], |d| d.1);
        let attributes = self.read_attributes(xml, name, allowed, context);
        let mut values = Vec::new();
        for wanted in allowed {
            match attributes.iter().find(|a| a.name == *wanted) {
                Some(attribute) => values.push(attribute),
                None => {
                    self.problems.error(place, format!("<{name}> has no `{wanted}`"));
                    return;
                }
            }
        }
        match (name, &values[..]) {
            ("default", [name, value]) => self.parameters.set_default(name, value, self.problems),
            ("path", [value]) => self.add_path(value),
            ("alias", [id, new]) => match self.tree.ids.get(&id.value) {
                Some(&index) => self.name(new.value.clone(), index, new.place),
                None => {
                    let known: Vec<String> = self.tree.ids.keys().cloned().collect();
                    self.problems
                        .error(id.place, format!("no element before this alias has the id `{}`", shown(&id.value)))
                        .hint(names::hint(&id.value, known.iter().map(String::as_str)));
                }
            },
            _ => {}
        }
    }

    fn add_path(&mut self, value: &Attribute) {
        let directory = self.tree.directory(value.place).join(&value.value);
        if directory.is_dir() {
            if !self.search.add(directory) {
                self.problems.error(value.place, format!("the scene names more than {MAX_DIRECTORIES} directories"));
            }
        } else {
            self.problems.warning(value.place, format!("`{}` is not a directory", shown(&directory.display().to_string())));
        }
    }

    fn read_include(&mut self, xml: roxmltree::Node, context: &Context, place: Place) -> Vec<NodeIndex> {
        let attributes = self.read_attributes(xml, "include", &["filename"], context);
        let Some(name) = attributes.first() else {
            self.problems.error(place, "<include> has no `filename`");
            return Vec::new();
        };
        let path = match self.search.resolve(&name.value, &self.tree.directory(place)) {
            Ok(path) => path,
            Err((what, hint)) => {
                self.problems.error(name.place, what).hint = hint;
                return Vec::new();
            }
        };
        let real = path.canonicalize().unwrap_or_else(|_| path.clone());
        if let Some(start) = self.open.iter().position(|p| *p == real) {
            let shown = |p: &Path| p.file_name().map_or_else(|| p.display().to_string(), |f| f.to_string_lossy().into_owned());
            let cycle: Vec<String> = self.open[start..].iter().chain([&real]).map(|p| shown(p)).collect();
            self.problems.error(name.place, format!("cyclic include: {}", cycle.join(" -> ")));
            return Vec::new();
        }
        self.includes += 1;
        if self.open.len() > MAX_INCLUDE_DEPTH || self.includes > MAX_INCLUDES {
            let limit = format!("{MAX_INCLUDES} files or {MAX_INCLUDE_DEPTH} levels");
            if self.includes <= MAX_INCLUDES + 1 {
                self.problems.error(place, format!("more includes than {limit}"));
            }
            return Vec::new();
        }
        let Some((text, locator)) = self.load_include(&path, &real, name.place) else { return Vec::new() };
        self.open.push(real);
        let children = self.read_text(&text, &locator, context.depth, context.emissive, false);
        self.open.pop();
        children
    }

    fn load_include(&mut self, path: &Path, real: &Path, place: Place) -> Option<(Arc<str>, Rc<Locator>)> {
        if let Some(known) = self.loaded.get(real) {
            return Some(known.clone());
        }
        match text::read(path) {
            Ok(text) => {
                let directory = path.parent().unwrap_or(Path::new("")).to_path_buf();
                let entry = self.register(path.to_path_buf(), directory, text);
                self.loaded.insert(real.to_path_buf(), entry.clone());
                Some(entry)
            }
            Err(what) => {
                self.problems.error(place, what);
                None
            }
        }
    }
}

const VALUE_REQUIRED: &[&str] = &["name", "value"];
