//! Replaces the file names of a scene by what the files hold, in parallel.
//!
//! A file that is named several times is read once and shared. Problems come in the order of the
//! scene's lists, whichever thread was first. A mesh without normals gets smooth ones here unless
//! all shapes that use it ask for face normals (Mitsuba's rule, see [`smooth_normals`]).
//!
//! [`smooth_normals`]: crate::describe::smooth_normals

use super::fault::{Decoded, Fault, quote, read_bytes};
use super::{image, obj, ply, serialized};
use crate::describe::{
    Image, ImageDescription, Mesh, MeshDescription, MeshFormat, Place, Problems, SceneDescription, ShapeDescription, ShapeModel,
};
use rayon::prelude::*;
use std::collections::HashMap;
use std::hash::Hash;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Replaces every `File` among the meshes and images by `Data`. What cannot be read stays and adds
/// an error at the place where the scene names it.
pub fn decode(description: &mut SceneDescription, problems: &mut Problems) {
    let smooth = smooth_meshes(description);
    let mut meshes = Jobs::default();
    for (i, mesh) in description.meshes.iter().enumerate() {
        if let MeshDescription::File { path, format, shape_index, flip_tex_coords, place } = mesh {
            let key =
                MeshKey { path: path.clone(), format: *format, shape: *shape_index, flip: *flip_tex_coords, smooth: smooth[i] };
            meshes.add(i, *place, key);
        }
    }
    let mut images = Jobs::default();
    for (i, image) in description.images.iter().enumerate() {
        if let ImageDescription::File { path, raw, place } = image {
            images.add(i, *place, (path.clone(), *raw));
        }
    }
    let (read_meshes, read_images) =
        rayon::join(|| meshes.run(MeshKey::read), || images.run(|(path, raw)| read_texture(path, *raw)));
    let name = |key: &MeshKey| format!("mesh {}", quote(&key.path));
    meshes.deliver(read_meshes, problems, name, |i, mesh| description.meshes[i] = MeshDescription::Data(mesh));
    let name = |(path, _): &(PathBuf, bool)| format!("image {}", quote(path));
    images.deliver(read_images, problems, name, |i, image| description.images[i] = ImageDescription::Data(image));
}

/// Reads a mesh file. Without normals in the file they stay empty.
pub fn read_mesh(path: &Path, format: MeshFormat, shape_index: u32, flip_tex_coords: bool) -> Result<Decoded<Mesh>, Fault> {
    let bytes = read_bytes(path)?;
    match format {
        MeshFormat::Obj => obj::parse(&bytes, flip_tex_coords),
        MeshFormat::Ply => ply::parse(&bytes, flip_tex_coords),
        MeshFormat::Serialized => serialized::parse(&bytes, shape_index, flip_tex_coords),
    }
}

/// Reads a texture; `raw` leaves sRGB encoded numbers as they are.
pub fn read_texture(path: &Path, raw: bool) -> Result<Decoded<Image>, Fault> {
    image::parse(&read_bytes(path)?, path, raw)
}

#[derive(Clone, PartialEq, Eq, Hash)]
struct MeshKey {
    path: PathBuf,
    format: MeshFormat,
    shape: u32,
    flip: bool,
    smooth: bool,
}

impl MeshKey {
    fn read(&self) -> Result<Decoded<Mesh>, Fault> {
        let mut decoded = read_mesh(&self.path, self.format, self.shape, self.flip)?;
        if self.smooth && decoded.value.normals.is_empty() {
            decoded.value.compute_normals();
        }
        Ok(decoded)
    }
}

/// Per mesh, whether any shape wants its vertex normals.
fn smooth_meshes(description: &SceneDescription) -> Vec<bool> {
    let mut smooth = vec![false; description.meshes.len()];
    let in_groups = description.groups.iter().flat_map(|g| &g.shapes);
    for ShapeDescription { model, .. } in description.shapes.iter().chain(in_groups) {
        if let ShapeModel::Mesh { mesh, face_normals: false } = model
            && let Some(wanted) = smooth.get_mut(mesh.0 as usize)
        {
            *wanted = true;
        }
    }
    smooth
}

/// Distinct files to read, each with the list entries that want it.
struct Jobs<K> {
    keys: Vec<K>,
    index: HashMap<K, usize>,
    /// List entry, place, job.
    wanted: Vec<(usize, Place, usize)>,
}

impl<K> Default for Jobs<K> {
    fn default() -> Self {
        Self { keys: Vec::new(), index: HashMap::new(), wanted: Vec::new() }
    }
}

impl<K: Clone + Eq + Hash + Sync> Jobs<K> {
    fn add(&mut self, entry: usize, place: Place, key: K) {
        let job = *self.index.entry(key.clone()).or_insert_with(|| {
            self.keys.push(key);
            self.keys.len() - 1
        });
        self.wanted.push((entry, place, job));
    }

    fn run<T: Send>(&self, read: impl Fn(&K) -> Result<Decoded<T>, Fault> + Sync + Send) -> Vec<Result<Decoded<T>, Fault>> {
        self.keys.par_iter().map(read).collect()
    }

    /// Hands every entry its value. Errors are told wherever the file is named, warnings once.
    fn deliver<T>(
        self,
        results: Vec<Result<Decoded<T>, Fault>>,
        problems: &mut Problems,
        name: impl Fn(&K) -> String,
        mut set: impl FnMut(usize, Arc<T>),
    ) {
        let mut told = vec![false; results.len()];
        let results: Vec<_> = results.into_iter().map(|r| r.map(|d| (Arc::new(d.value), d.warnings))).collect();
        for (entry, place, job) in self.wanted {
            let first = !std::mem::replace(&mut told[job], true);
            match &results[job] {
                Ok((value, warnings)) => {
                    set(entry, value.clone());
                    for warning in warnings.iter().filter(|_| first) {
                        problems.warning(place, format!("{}: {warning}", name(&self.keys[job])));
                    }
                }
                Err(fault) => {
                    let problem = problems.error(place, format!("{}: {}", name(&self.keys[job]), fault.what));
                    problem.hint.clone_from(&fault.hint);
                }
            }
        }
    }
}
