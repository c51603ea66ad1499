//! Local models and textures: ranges of their parameters, and nesting that ends.

use super::Check;
use crate::describe::*;

/// Deepest nesting of local models.
const MAX_NESTING: usize = 32;

impl Check<'_> {
    /// Indices first: with a wrong one nothing else of the model can be followed.
    pub(super) fn bsdfs(&mut self) {
        let bsdfs = &self.scene.bsdfs;
        for bsdf in bsdfs {
            for child in bsdf.model.children().into_iter().flatten() {
                self.index(child.0, bsdfs.len(), bsdf.place, "local model");
            }
        }
        let depths = nesting(bsdfs);
        for (bsdf, depth) in bsdfs.iter().zip(&depths) {
            match depth {
                None => {
                    self.problems.error(bsdf.place, "this local model contains itself");
                }
                Some(depth) if *depth > MAX_NESTING => {
                    self.problems.error(bsdf.place, format!("local models are nested deeper than {MAX_NESTING}"));
                }
                Some(_) => self.bsdf(bsdf),
            }
        }
    }

    fn bsdf(&mut self, bsdf: &BsdfDescription) {
        use BsdfModel::*;
        let place = bsdf.place;
        match &bsdf.model {
            Diffuse { reflectance } => self.unit(reflectance, place, "reflectance"),
            Dielectric { int_ior, ext_ior, specular_reflectance, specular_transmittance }
            | ThinDielectric { int_ior, ext_ior, specular_reflectance, specular_transmittance } => {
                self.interface(*int_ior, *ext_ior, place);
                self.unit(specular_reflectance, place, "specular_reflectance");
                self.unit(specular_transmittance, place, "specular_transmittance");
            }
            RoughDielectric { alpha_u, alpha_v, int_ior, ext_ior, specular_reflectance, specular_transmittance, .. } => {
                self.interface(*int_ior, *ext_ior, place);
                if int_ior == ext_ior {
                    let what = format!("`int_ior` and `ext_ior` are both {int_ior}: there is no boundary");
                    self.problems.error((self.locate)(place, "int_ior"), what).hint("use the `null` model");
                }
                self.rough(alpha_u, alpha_v, place);
                self.unit(specular_reflectance, place, "specular_reflectance");
                self.unit(specular_transmittance, place, "specular_transmittance");
            }
            Conductor { eta, k, specular_reflectance, .. } => {
                self.not_negative(eta, place, "eta");
                self.not_negative(k, place, "k");
                self.unit(specular_reflectance, place, "specular_reflectance");
            }
            RoughConductor { alpha_u, alpha_v, eta, k, specular_reflectance, .. } => {
                self.rough(alpha_u, alpha_v, place);
                self.not_negative(eta, place, "eta");
                self.not_negative(k, place, "k");
                self.unit(specular_reflectance, place, "specular_reflectance");
            }
            Plastic { int_ior, ext_ior, diffuse_reflectance, specular_reflectance, .. } => {
                self.interface(*int_ior, *ext_ior, place);
                self.unit(diffuse_reflectance, place, "diffuse_reflectance");
                self.unit(specular_reflectance, place, "specular_reflectance");
            }
            RoughPlastic { alpha, int_ior, ext_ior, diffuse_reflectance, specular_reflectance, .. } => {
                self.interface(*int_ior, *ext_ior, place);
                self.positive(*alpha, place, "alpha");
                self.unit(diffuse_reflectance, place, "diffuse_reflectance");
                self.unit(specular_reflectance, place, "specular_reflectance");
            }
            Principled { parameters: p } => {
                self.positive(p.eta, place, "eta");
                for (name, texture) in p.textures() {
                    self.unit(texture, place, name);
                }
            }
            TwoSided { front, back } => {
                if [front, back].into_iter().any(|id| transmits(&self.scene.bsdfs, *id)) {
                    self.problems
                        .error(place, "a `twosided` model contains one that transmits light")
                        .hint("glass, `null` and `mask` have two sides already");
                }
            }
            Mask { opacity, .. } => self.unit(opacity, place, "opacity"),
            Blend { weight, .. } => self.unit(weight, place, "weight"),
            Null => {}
        }
    }

    fn interface(&mut self, int_ior: f32, ext_ior: f32, place: Place) {
        self.positive(int_ior, place, "int_ior");
        self.positive(ext_ior, place, "ext_ior");
    }

    fn rough(&mut self, u: &TextureDescription, v: &TextureDescription, place: Place) {
        let must = "be greater than 0 (use the smooth model for a polished surface)";
        self.constants(u, place, "alpha_u", &|v| v > 0.0, must);
        if u != v {
            self.constants(v, place, "alpha_v", &|v| v > 0.0, must);
        }
    }

    fn unit(&mut self, texture: &TextureDescription, place: Place, name: &'static str) {
        self.constants(texture, place, name, &|v| (0.0..=1.0).contains(&v), "lie in [0, 1]: no more light than came");
    }

    pub(super) fn not_negative(&mut self, texture: &TextureDescription, place: Place, name: &'static str) {
        self.constants(texture, place, name, &|v| v >= 0.0, "be finite and not negative");
    }

    /// Every constant of a texture, and its references.
    fn constants(
        &mut self,
        texture: &TextureDescription,
        place: Place,
        name: &'static str,
        ok: &dyn Fn(f32) -> bool,
        must: &str,
    ) {
        match texture {
            TextureDescription::Constant(rgb) => {
                let fulfilled = rgb.iter().all(|v| v.is_finite() && ok(*v));
                if rgb[0] == rgb[1] && rgb[1] == rgb[2] {
                    self.need(fulfilled, place, name, rgb[0], must);
                } else {
                    self.need(fulfilled, place, name, rgb, must);
                }
            }
            TextureDescription::Bitmap { image, to_uv, place, .. } => {
                self.index(image.0, self.scene.images.len(), *place, "image");
                self.need(to_uv.is_finite(), *place, "to_uv", to_uv, "be finite");
            }
            TextureDescription::Checkerboard { color0, color1, to_uv, place } => {
                self.constants(color0, *place, "color0", ok, must);
                self.constants(color1, *place, "color1", ok, must);
                self.need(to_uv.is_finite(), *place, "to_uv", to_uv, "be finite");
            }
        }
    }
}

impl BsdfModel {
    /// The models nested in this one.
    pub fn children(&self) -> [Option<BsdfId>; 2] {
        match *self {
            Self::TwoSided { front, back } => [Some(front), Some(back)],
            Self::Mask { inner, .. } => [Some(inner), None],
            Self::Blend { first, second, .. } => [Some(first), Some(second)],
            _ => [None, None],
        }
    }
}

/// Depth of nesting of each model; `None` if it contains itself.
fn nesting(bsdfs: &[BsdfDescription]) -> Vec<Option<usize>> {
    let children =
        |i: usize| bsdfs[i].model.children().into_iter().flatten().map(|id| id.0 as usize).filter(|&c| c < bsdfs.len());
    let mut parents = vec![Vec::new(); bsdfs.len()];
    let mut waiting: Vec<usize> = (0..bsdfs.len()).map(|i| children(i).count()).collect();
    for i in 0..bsdfs.len() {
        children(i).for_each(|child| parents[child].push(i));
    }
    let mut depths = vec![None; bsdfs.len()];
    let mut ready: Vec<usize> = (0..bsdfs.len()).filter(|&i| waiting[i] == 0).collect();
    while let Some(i) = ready.pop() {
        depths[i] = Some(children(i).filter_map(|c| depths[c]).max().map_or(0, |d: usize| d + 1));
        for &parent in &parents[i] {
            waiting[parent] -= 1;
            if waiting[parent] == 0 {
                ready.push(parent);
            }
        }
    }
    depths
}

/// Whether light gets through a model; called only where nesting is finite, visits each model once.
fn transmits(bsdfs: &[BsdfDescription], start: BsdfId) -> bool {
    use BsdfModel::*;
    let mut open = vec![start.0 as usize];
    let mut seen = vec![false; bsdfs.len()];
    while let Some(i) = open.pop() {
        let Some(bsdf) = bsdfs.get(i).filter(|_| !std::mem::replace(&mut seen[i], true)) else { continue };
        let through = match &bsdf.model {
            Dielectric { .. } | ThinDielectric { .. } | RoughDielectric { .. } | Null | Mask { .. } => true,
            Principled { parameters: p } => p.spec_trans != TextureDescription::grey(0.0),
            _ => false,
        };
        if through {
            return true;
        }
        open.extend(bsdf.model.children().into_iter().flatten().map(|id| id.0 as usize));
    }
    false
}
