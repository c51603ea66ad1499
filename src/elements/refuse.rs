//! Which local models stand in the way of finite elements, by name and place.

use crate::describe::{BsdfId, BsdfModel, Place, Problems, SceneDescription, ShapeDescription, TextureDescription};
use std::collections::HashSet;

/// An error for every local model in use that is not diffuse.
pub fn refusals(description: &SceneDescription) -> Problems {
    let mut problems = Problems::default();
    let mut seen = HashSet::new();
    let members = description.groups.iter().flat_map(|g| &g.shapes);
    let used = description.shapes.iter().chain(members).filter_map(|s: &ShapeDescription| s.bsdf);
    for id in used {
        visit(description, id, &mut seen, &mut problems);
    }
    problems
}

fn visit(description: &SceneDescription, id: BsdfId, seen: &mut HashSet<BsdfId>, problems: &mut Problems) {
    let Some(bsdf) = description.bsdfs.get(id.0 as usize) else { return };
    if !seen.insert(id) {
        return;
    }
    match &bsdf.model {
        BsdfModel::Diffuse { .. } => {}
        BsdfModel::TwoSided { front, back } => [*front, *back].into_iter().for_each(|id| visit(description, id, seen, problems)),
        BsdfModel::Blend { first, second, .. } => {
            [*first, *second].into_iter().for_each(|id| visit(description, id, seen, problems))
        }
        BsdfModel::Mask { opacity: TextureDescription::Constant(o), inner } if *o == [1.0; 3] => {
            visit(description, *inner, seen, problems);
        }
        other => refuse(name(other), bsdf.id.as_deref(), bsdf.place, problems),
    }
}

fn refuse(name: &str, id: Option<&str>, place: Place, problems: &mut Problems) {
    let which = id.map_or(String::new(), |id| format!(" `{id}`"));
    problems
        .error(place, format!("the local model{which} is `{name}`; finite elements are for diffuse models only"))
        .hint("use gather, shoot or bidirectional for this scene, or make the model `diffuse`");
}

fn name(model: &BsdfModel) -> &'static str {
    match model {
        BsdfModel::Diffuse { .. } => "diffuse",
        BsdfModel::Dielectric { .. } => "dielectric",
        BsdfModel::ThinDielectric { .. } => "thindielectric",
        BsdfModel::RoughDielectric { .. } => "roughdielectric",
        BsdfModel::Conductor { .. } => "conductor",
        BsdfModel::RoughConductor { .. } => "roughconductor",
        BsdfModel::Plastic { .. } => "plastic",
        BsdfModel::RoughPlastic { .. } => "roughplastic",
        BsdfModel::Principled { .. } => "principled",
        BsdfModel::TwoSided { .. } => "twosided",
        BsdfModel::Mask { .. } => "mask",
        BsdfModel::Null => "null",
        BsdfModel::Blend { .. } => "blendbsdf",
    }
}
