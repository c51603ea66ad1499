//! Reader of the Mitsuba 3 scene language (XML): text → tree → links → [`SceneDescription`].
//!
//! [`load`] reads a file, [`from_str`] a text. Nothing is decoded here: meshes and images are named,
//! `io::assets` reads them. All problems are collected, each with file, line and column; whatever
//! the input, nothing panics and nothing grows beyond fixed limits.
//!
//! `text` checks a text before it is parsed · `reader` makes the tree (`include`, `path`, `alias`) ·
//! `parameters` are `default` and `$name` · `links` resolves references · `plugin` and the tables beside
//! each `build` declare what is known · `builder` matches an element with its table · `properties` reads
//! its values · `manual` writes docs/scene-format.md.

mod bsdfs;
mod builder;
mod emitters;
mod files;
mod integrators;
mod links;
mod manual;
mod names;
mod parameters;
mod plugin;
mod properties;
mod reader;
mod sensors;
mod shapes;
mod spectral;
mod text;
mod textures;
mod tree;
mod values;

pub use manual::{Example, examples, scene_format_markdown};

use crate::describe::{Place, Problems, SceneDescription, Sources};
use builder::Builder;
use files::Search;
use reader::Reader;
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use tree::{Tag, Tree};

/// How to read a scene.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// Values for `$name`, stronger than the scene's `<default>`s.
    pub defines: Vec<(String, String)>,
    /// If given, no file outside of this directory is read.
    pub sandbox: Option<PathBuf>,
}

/// A scene that was read without errors.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The scene; its `sources` belong to the places of the warnings too.
    pub scene: SceneDescription,
    /// What may not be as meant.
    pub warnings: Problems,
}

/// Why a scene was not read.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{}", problems.render(sources))]
pub struct LoadError {
    /// All errors and warnings.
    pub problems: Problems,
    /// The texts that their places point into.
    pub sources: Sources,
}

/// Reads a scene file.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded, LoadError> {
    run(options, path.parent().unwrap_or(Path::new("")), |reader| reader.read_file(path))
}

/// Reads a scene from a text; relative file names in it start at `directory`.
pub fn from_str(text: &str, directory: &Path, options: &LoadOptions) -> Result<Loaded, LoadError> {
    run(options, directory, |reader| {
        reader.read_main(PathBuf::from("scene"), directory.to_path_buf(), text.to_string());
    })
}

fn run(options: &LoadOptions, directory: &Path, read: impl FnOnce(&mut Reader)) -> Result<Loaded, LoadError> {
    let mut problems = Problems::default();
    let mut search = Search::default();
    if let Some(sandbox) = &options.sandbox {
        match sandbox.canonicalize() {
            Ok(real) => search.sandbox = Some(real),
            Err(error) => {
                problems.error(Place::default(), format!("sandbox directory `{}`: {error}", sandbox.display()));
                return Err(LoadError { problems, sources: Sources::default() });
            }
        }
    }
    search.add(directory.to_path_buf());
    let mut reader = Reader::new(&options.defines, search, &mut problems);
    read(&mut reader);
    let (mut tree, search) = (std::mem::take(&mut reader.tree), std::mem::take(&mut reader.search));
    links::resolve(&mut tree, &mut problems);
    let scene = build(&tree, &search, &mut problems);
    order(&mut problems);
    if problems.has_errors() {
        return Err(LoadError { problems, sources: scene.sources });
    }
    Ok(Loaded { scene, warnings: problems })
}

/// By place; what is used twice is reported once.
fn order(problems: &mut Problems) {
    let mut seen = HashSet::new();
    problems.list.retain(|p| seen.insert((p.place, p.what.clone())));
    problems.list.sort_by_key(|p| (p.place.file, p.place.line, p.place.column));
}

/// Builds everything at top level, in file order, and checks the whole.
fn build(tree: &Tree, search: &Search, problems: &mut Problems) -> SceneDescription {
    let unreadable = problems.has_errors() && tree.nodes.is_empty();
    let mut b = Builder::new(tree, search, problems);
    let mut integrator = None;
    for &index in &tree.top {
        let node = &tree.nodes[index];
        match node.tag {
            Tag::Shape => shapes::build(&mut b, index),
            Tag::Bsdf => drop(bsdfs::build(&mut b, index)),
            Tag::Texture | Tag::Spectrum if node.is_object() => drop(textures::build(&mut b, index)),
            Tag::Emitter if node.plugin() != "area" => emitters::build(&mut b, index),
            Tag::Emitter => {}
            Tag::Sensor => sensors::build(&mut b, index),
            Tag::Integrator => match integrator {
                None => integrator = Some((integrators::build(&mut b, index), node.place)),
                Some((_, first)) => {
                    let first = tree.sources.locate(first).unwrap_or_default();
                    b.problems.error(node.place, "the scene has two integrators").hint(format!("the first is at {first}"));
                }
            },
            Tag::Medium | Tag::Phase | Tag::Volume => {
                b.problems.error(node.place, format!("Mitsuba's <{}> is not supported yet", node.tag.name()));
            }
            Tag::Film | Tag::Rfilter | Tag::Sampler => drop(b.given(index)),
            Tag::Ref => {
                b.problems.warning(node.place, "a reference at top level has no effect");
            }
            tag => {
                b.problems.error(node.place, format!("<{}> has no meaning at top level", tag.name()));
            }
        }
    }
    if let Some((Some(description), _)) = integrator {
        b.scene.integrator = description;
    }
    report_loose_area_emitters(&mut b);
    let Builder { scene, places, problems, .. } = b;
    if !unreadable {
        let locate = |place: Place, name: &'static str| places.get(&(place, name)).copied().unwrap_or(place);
        scene.validate_located(&locate, problems);
    }
    scene
}

/// An area emitter that no shape carries emits nothing; its values are checked all the same.
fn report_loose_area_emitters(b: &mut Builder) {
    for &index in &b.tree.top {
        let node = &b.tree.nodes[index];
        if node.tag == Tag::Emitter && node.plugin() == "area" && !b.carried.contains(&index) {
            emitters::area(b, index, node.place);
            b.problems.warning(node.place, "this area emitter belongs to no shape and emits nothing");
        }
    }
}
