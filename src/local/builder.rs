//! Builds materials: flattens trees of models, checks their parameters, collects what is wrong.

use super::closure::Model;
use super::composite::{Entry, MAX_LOBES, Part};
use super::conductor::IndexModel;
use super::material::{Lobes, Side};
use super::microfacet::Microfacet;
use super::rough_conductor::RoughnessModel;
use super::rough_plastic::Coat;
use super::{
    blend, conductor, dielectric, diffuse, mask, null, plastic, principled, rough_conductor, rough_dielectric, rough_plastic,
    thin_dielectric, two_sided,
};
use crate::describe::{
    BsdfDescription, BsdfId, BsdfModel, ImageDescription, MicrofacetDescription, Place, Problems, TextureDescription,
};
use crate::texture::{TextureSlot, Textures};
use glam::Vec2;
use std::sync::Arc;

/// What is needed while materials are built.
pub(super) struct Builder<'a> {
    bsdfs: &'a [BsdfDescription],
    images: &'a [ImageDescription],
    pub textures: Textures,
    pub problems: Problems,
    /// Something of the material at hand is a texture.
    pub textured: bool,
    /// Models built so far, and whether something of them is a texture; `Some(None)` where one is wrong.
    leaves: Vec<Option<Option<(Model, bool)>>>,
    /// Models that are being flattened, outermost first.
    path: Vec<BsdfId>,
    /// Elements of the present tree seen so far.
    visited: usize,
    /// Tables of rough coats made so far.
    coats: Vec<Arc<Coat>>,
}

/// Most elements in the tree of one material: shared elements may make a tree that grows without
/// bound out of few of them.
const MOST_ELEMENTS: usize = 256;

impl<'a> Builder<'a> {
    /// With nothing built yet.
    pub fn new(bsdfs: &'a [BsdfDescription], images: &'a [ImageDescription]) -> Self {
        Self {
            bsdfs,
            images,
            textures: Textures::default(),
            problems: Problems::default(),
            leaves: vec![None; bsdfs.len()],
            path: Vec::new(),
            visited: 0,
            coats: Vec::new(),
            textured: false,
        }
    }

    /// One side of a material.
    pub fn side(&mut self, id: BsdfId, front: bool) -> Side {
        let mut entries = Vec::new();
        self.visited = 0;
        self.flatten(id, front, &Part::WHOLE, &mut entries);
        if entries.len() > MAX_LOBES || self.visited > MOST_ELEMENTS {
            let place = self.bsdfs[id.0 as usize].place;
            self.problems
                .error(place, format!("this model combines more than {MAX_LOBES} models"))
                .hint("use fewer nested `blendbsdf` and `mask` elements");
            return Side::Black;
        }
        if let [only] = &mut entries[..]
            && only.part.is_whole()
        {
            return Side::Single(only.model.clone());
        }
        if entries.is_empty() { Side::Black } else { Side::Composite(entries.into()) }
    }

    /// Appends the models below `id` on one side, each with its share.
    fn flatten(&mut self, id: BsdfId, front: bool, part: &Part, out: &mut Vec<Entry>) {
        let place = self.path.last().map_or(Place::default(), |outer| self.bsdfs[outer.0 as usize].place);
        let Some(bsdf) = self.bsdfs.get(id.0 as usize) else {
            self.problems.error(place, "this model refers to a model that does not exist");
            return;
        };
        if self.path.contains(&id) {
            self.problems.error(bsdf.place, "this model contains itself");
            return;
        }
        self.visited += 1;
        if self.visited > MOST_ELEMENTS {
            return;
        }
        self.path.push(id);
        match &bsdf.model {
            BsdfModel::TwoSided { front: on_front, back: on_back } => {
                let from = out.len();
                self.flatten(two_sided::side(*on_front, *on_back, front), true, part, out);
                let nested = out[from..].iter().fold(Default::default(), |all: Lobes, e| all.union(e.model.lobes()));
                if let Some(why) = two_sided::refusal(nested) {
                    self.problems.error(bsdf.place, why).hint("models that transmit have two sides already");
                }
            }
            BsdfModel::Mask { opacity, inner } => {
                let opacity = self.texture(opacity, "opacity", bsdf.place);
                let [solid, hole] = mask::split(part, opacity);
                if let Some(solid) = solid {
                    self.flatten(*inner, front, &solid, out);
                }
                if let Some(part) = hole {
                    out.push(Entry { model: null::Model.into(), part, smooth: false });
                }
            }
            BsdfModel::Blend { weight, first, second } => {
                let weight = self.texture(weight, "weight", bsdf.place);
                for (share, id) in blend::split(part, weight).iter().zip([*first, *second]) {
                    if let Some(share) = share {
                        self.flatten(id, front, share, out);
                    }
                }
            }
            _ => {
                if let Some(model) = self.leaf(id)
                    && (front || model.both_sides())
                {
                    let smooth = model.lobes().has_smooth();
                    out.push(Entry { model, part: part.clone(), smooth });
                }
            }
        }
        self.path.pop();
    }

    fn leaf(&mut self, id: BsdfId) -> Option<Model> {
        let i = id.0 as usize;
        if self.leaves[i].is_none() {
            let others = std::mem::take(&mut self.textured);
            self.leaves[i] = Some(self.build_leaf(&self.bsdfs[i]).map(|model| (model, self.textured)));
            self.textured = others;
        }
        let (model, textured) = self.leaves[i].clone().flatten()?;
        self.textured |= textured;
        Some(model)
    }

    fn build_leaf(&mut self, bsdf: &BsdfDescription) -> Option<Model> {
        let place = bsdf.place;
        Some(match &bsdf.model {
            BsdfModel::Diffuse { reflectance } => {
                diffuse::Model { reflectance: self.texture(reflectance, "reflectance", place) }.into()
            }
            BsdfModel::Dielectric { int_ior, ext_ior, specular_reflectance, specular_transmittance } => dielectric::Model {
                eta: self.eta(*int_ior, *ext_ior, true, place)?,
                reflectance: self.texture(specular_reflectance, "specular_reflectance", place),
                transmittance: self.texture(specular_transmittance, "specular_transmittance", place),
            }
            .into(),
            BsdfModel::ThinDielectric { int_ior, ext_ior, specular_reflectance, specular_transmittance } => {
                thin_dielectric::Model {
                    eta: self.eta(*int_ior, *ext_ior, true, place)?,
                    reflectance: self.texture(specular_reflectance, "specular_reflectance", place),
                    transmittance: self.texture(specular_transmittance, "specular_transmittance", place),
                }
                .into()
            }
            BsdfModel::RoughDielectric {
                distribution,
                alpha_u,
                alpha_v,
                int_ior,
                ext_ior,
                specular_reflectance,
                specular_transmittance,
            } => rough_dielectric::Model {
                eta: self.eta(*int_ior, *ext_ior, false, place)?,
                roughness: self.roughness(*distribution, [alpha_u, alpha_v], place),
                reflectance: self.texture(specular_reflectance, "specular_reflectance", place),
                transmittance: self.texture(specular_transmittance, "specular_transmittance", place),
            }
            .into(),
            BsdfModel::Conductor { perfect, eta, k, specular_reflectance } => conductor::Model {
                index: self.index(*perfect, eta, k, place),
                reflectance: self.texture(specular_reflectance, "specular_reflectance", place),
            }
            .into(),
            BsdfModel::RoughConductor { distribution, alpha_u, alpha_v, perfect, eta, k, specular_reflectance } => {
                rough_conductor::Model {
                    roughness: self.roughness(*distribution, [alpha_u, alpha_v], place),
                    index: self.index(*perfect, eta, k, place),
                    reflectance: self.texture(specular_reflectance, "specular_reflectance", place),
                }
                .into()
            }
            BsdfModel::Plastic { int_ior, ext_ior, nonlinear, diffuse_reflectance, specular_reflectance } => {
                let eta = self.eta(*int_ior, *ext_ior, true, place)?;
                let diffuse = self.texture(diffuse_reflectance, "diffuse_reflectance", place);
                let specular = self.texture(specular_reflectance, "specular_reflectance", place);
                plastic::Model::new(eta, *nonlinear, diffuse, specular, &self.textures).into()
            }
            BsdfModel::RoughPlastic {
                distribution,
                alpha,
                int_ior,
                ext_ior,
                nonlinear,
                diffuse_reflectance,
                specular_reflectance,
            } => {
                let eta = self.eta(*int_ior, *ext_ior, false, place)?;
                let diffuse = self.texture(diffuse_reflectance, "diffuse_reflectance", place);
                let specular = self.texture(specular_reflectance, "specular_reflectance", place);
                if !alpha.is_finite() {
                    self.problems.error(place, "`alpha` is not finite");
                    return None;
                }
                let coat = self.coat(*distribution, *alpha, eta);
                rough_plastic::Model::new(coat, *nonlinear, [diffuse, specular], &self.textures).into()
            }
            BsdfModel::Principled { parameters: p } => {
                let parameters = principled::Parameters {
                    base_color: self.texture(&p.base_color, "base_color", place),
                    roughness: self.texture(&p.roughness, "roughness", place),
                    anisotropic: self.texture(&p.anisotropic, "anisotropic", place),
                    metallic: self.texture(&p.metallic, "metallic", place),
                    spec_trans: self.texture(&p.spec_trans, "spec_trans", place),
                    spec_tint: self.texture(&p.spec_tint, "spec_tint", place),
                    sheen: self.texture(&p.sheen, "sheen", place),
                    sheen_tint: self.texture(&p.sheen_tint, "sheen_tint", place),
                    flatness: self.texture(&p.flatness, "flatness", place),
                    clearcoat: self.texture(&p.clearcoat, "clearcoat", place),
                    clearcoat_gloss: self.texture(&p.clearcoat_gloss, "clearcoat_gloss", place),
                };
                let eta = self.eta(p.eta, 1.0, true, place)?;
                principled::Model::new(parameters, eta, &self.textures).into()
            }
            BsdfModel::Null => null::Model.into(),
            // The three that combine others are taken apart before this is asked.
            BsdfModel::TwoSided { .. } | BsdfModel::Mask { .. } | BsdfModel::Blend { .. } => return None,
        })
    }

    /// The coat of these parameters, made once for all models that have it.
    fn coat(&mut self, distribution: MicrofacetDescription, alpha: f32, eta: f32) -> Arc<Coat> {
        let facets = Microfacet::new(distribution, Vec2::splat(alpha));
        if let Some(coat) = self.coats.iter().find(|coat| coat.is(facets, eta)) {
            return coat.clone();
        }
        let coat = Arc::new(Coat::new(facets, eta));
        self.coats.push(coat.clone());
        coat
    }

    /// A texture that must not be negative where it is constant.
    fn texture(&mut self, texture: &TextureDescription, name: &str, place: Place) -> TextureSlot {
        let slot = self.textures.add(texture, self.images, &mut self.problems);
        self.textured |= !slot.is_constant();
        let least = self.textures.min(slot);
        if !(least.is_finite() && self.textures.max(slot).is_finite()) {
            self.problems.error(place, format!("`{name}` is not finite"));
        } else if slot.is_constant() && least.to_rgb().iter().any(|v| *v < 0.0) {
            self.problems.error(place, format!("`{name}` is negative"));
        }
        slot
    }

    fn roughness(
        &mut self,
        distribution: MicrofacetDescription,
        alpha: [&TextureDescription; 2],
        place: Place,
    ) -> RoughnessModel {
        let [u, v] = alpha;
        RoughnessModel { distribution, alpha: [self.texture(u, "alpha_u", place), self.texture(v, "alpha_v", place)] }
    }

    fn index(&mut self, perfect: bool, eta: &TextureDescription, k: &TextureDescription, place: Place) -> IndexModel {
        IndexModel((!perfect).then(|| [self.texture(eta, "eta", place), self.texture(k, "k", place)]))
    }

    /// Index inside over index outside; some models need the two to differ.
    fn eta(&mut self, int_ior: f32, ext_ior: f32, may_be_equal: bool, place: Place) -> Option<f32> {
        let eta = int_ior / ext_ior;
        if !(int_ior > 0.0 && ext_ior > 0.0 && eta.is_finite() && eta > 0.0) {
            self.problems.error(place, format!("`int_ior` ({int_ior}) and `ext_ior` ({ext_ior}) must be positive"));
            return None;
        }
        if eta == 1.0 && !may_be_equal {
            self.problems
                .error(place, format!("`int_ior` and `ext_ior` are both {int_ior}, but must differ in a rough boundary"))
                .hint("use `null` for a boundary that does nothing");
            return None;
        }
        Some(eta)
    }
}
