//! Which classes of paths each estimator cannot make in a scene, told from its description.
//!
//! With Dirac events S (mirrors, smooth glass) and other events D, and a light L that is a Dirac one
//! (point, spot, parallel) or not, a path `E … L` is made by a *hit* if the light is not Dirac, by a
//! *next event* if its last event is D, by a *splat* if its first event is D, by a *connection* if
//! two neighbouring events are both D. What none of an estimator's joins makes is missing from its
//! image: no number of samples brings it back.

use crate::describe::{BsdfDescription, BsdfModel, EmitterModel, SceneDescription};

/// What one estimator misses.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Blind {
    /// The estimator.
    pub estimator: &'static str,
    /// A class of paths as an expression for `--paths`.
    pub paths: &'static str,
    /// The same for people.
    pub what: &'static str,
}

/// What the estimators miss in this scene; empty where each sees everything.
pub fn blind_spots(scene: &SceneDescription) -> Vec<Blind> {
    let specular = scene.bsdfs.iter().any(is_specular);
    let dirac_light = scene.emitters.iter().any(|e| match e.model {
        EmitterModel::Point { .. } | EmitterModel::Spot { .. } => true,
        EmitterModel::Directional { angular_diameter_deg, .. } => angular_diameter_deg == 0.0,
        EmitterModel::Constant { .. } | EmitterModel::Envmap { .. } => false,
    });
    let mut blind = Vec::new();
    if specular {
        let what = "what is first seen in a mirror or through smooth glass";
        blind.push(Blind { estimator: "shoot", paths: "E S .* L", what });
    }
    if specular && dirac_light {
        let what = "light of point, spot and parallel lights that arrives by a mirror or smooth glass";
        blind.push(Blind { estimator: "gather", paths: "E .* S L", what });
        let what = "such light seen by a mirror or smooth glass, without two matt surfaces in succession on its way";
        blind.push(Blind { estimator: "bidirectional", paths: "E S+ (D S+)* L", what });
    }
    blind
}

/// Has a Dirac part of its own; those of nested models are in the list themselves.
fn is_specular(b: &BsdfDescription) -> bool {
    match b.model {
        BsdfModel::Dielectric { .. }
        | BsdfModel::ThinDielectric { .. }
        | BsdfModel::Conductor { .. }
        | BsdfModel::Plastic { .. }
        | BsdfModel::Mask { .. }
        | BsdfModel::Null => true,
        BsdfModel::Diffuse { .. }
        | BsdfModel::RoughDielectric { .. }
        | BsdfModel::RoughConductor { .. }
        | BsdfModel::RoughPlastic { .. }
        | BsdfModel::TwoSided { .. }
        | BsdfModel::Blend { .. } => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::describe::{EmitterDescription, Place};
    use glam::Vec3;

    #[test]
    fn blind_where_mirrors_and_points_are() {
        let mut scene = SceneDescription::default();
        assert!(blind_spots(&scene).is_empty());
        scene.bsdfs.push(BsdfDescription { id: None, model: BsdfModel::Null, place: Place::default() });
        assert_eq!(blind_spots(&scene).iter().map(|b| b.estimator).collect::<Vec<_>>(), ["shoot"]);
        let model = EmitterModel::Point { position: Vec3::ZERO, intensity: [1.0; 3] };
        scene.emitters.push(EmitterDescription { id: None, model, place: Place::default() });
        let names: Vec<_> = blind_spots(&scene).iter().map(|b| b.estimator).collect();
        assert_eq!(names, ["shoot", "gather", "bidirectional"]);
    }
}
