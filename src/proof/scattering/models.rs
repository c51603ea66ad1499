//! Local models under test: every kind, with parameters from smooth to rough, alone and combined.

use crate::describe::{
    BitmapFilter, BitmapWrap, BsdfDescription, BsdfId, BsdfModel, Image, ImageDescription, ImageId, MicrofacetDescription, Place,
    PrincipledDescription, TextureDescription,
};
use crate::local::{Closure, MaterialId, Materials};
use glam::{Mat4, Vec2, Vec3};
use std::sync::Arc;

/// Texture coordinates of all tests.
pub const UV: Vec2 = Vec2::new(0.3, 0.4);

/// A model under test.
pub struct Case {
    /// Unique; the same as in `reference.py`.
    pub name: &'static str,
    /// Absorbs nothing (facets may still shadow).
    pub lossless: bool,
    /// Index inside over index outside.
    pub eta: f32,
    materials: Materials,
}

impl Case {
    /// The last of these models.
    ///
    /// # Panics
    /// If they are not right.
    pub fn of(name: &'static str, lossless: bool, eta: f32, models: &[BsdfDescription]) -> Self {
        let materials = Materials::build(models, &images()).unwrap_or_else(|p| panic!("{name}: {p:?}"));
        Self { name, lossless, eta, materials }
    }

    /// The model for events that come along `w_back`.
    pub fn at(&self, w_back: Vec3) -> Closure<'_> {
        self.materials.resolve(self.id(), UV, w_back.z > 0.0)
    }

    /// Its materials.
    pub fn materials(&self) -> &Materials {
        &self.materials
    }

    /// Which of them it is.
    pub fn id(&self) -> MaterialId {
        MaterialId(self.materials.len() as u32 - 3)
    }
}

/// A grey constant.
pub fn grey(v: f32) -> TextureDescription {
    TextureDescription::grey(v)
}

fn rgb(r: f32, g: f32, b: f32) -> TextureDescription {
    TextureDescription::Constant([r, g, b])
}

fn bitmap() -> TextureDescription {
    TextureDescription::Bitmap {
        image: ImageId(0),
        filter: BitmapFilter::Bilinear,
        wrap: BitmapWrap::Repeat,
        to_uv: Mat4::IDENTITY,
        place: Place::default(),
    }
}

fn checkerboard(a: f32, b: f32) -> TextureDescription {
    TextureDescription::Checkerboard {
        color0: Box::new(grey(a)),
        color1: Box::new(grey(b)),
        to_uv: Mat4::IDENTITY,
        place: Place::default(),
    }
}

/// Two columns, two rows.
pub fn images() -> Vec<ImageDescription> {
    let data = vec![0.1, 0.2, 0.3, 0.9, 0.5, 0.4, 0.3, 0.8, 0.2, 0.6, 0.6, 0.1];
    vec![ImageDescription::Data(Arc::new(Image { width: 2, height: 2, channels: 3, data }))]
}

/// A model as described in no file.
pub fn described(model: BsdfModel) -> BsdfDescription {
    BsdfDescription { id: None, model, place: Place::default() }
}

fn diffuse(reflectance: TextureDescription) -> BsdfModel {
    BsdfModel::Diffuse { reflectance }
}

fn dielectric(int_ior: f32, ext_ior: f32, reflectance: TextureDescription, transmittance: TextureDescription) -> BsdfModel {
    BsdfModel::Dielectric { int_ior, ext_ior, specular_reflectance: reflectance, specular_transmittance: transmittance }
}

fn rough_dielectric(distribution: MicrofacetDescription, alpha: [f32; 2], int_ior: f32, ext_ior: f32) -> BsdfModel {
    BsdfModel::RoughDielectric {
        distribution,
        alpha_u: grey(alpha[0]),
        alpha_v: grey(alpha[1]),
        int_ior,
        ext_ior,
        specular_reflectance: grey(1.0),
        specular_transmittance: grey(1.0),
    }
}

fn rough_conductor(distribution: MicrofacetDescription, alpha: [f32; 2], perfect: bool) -> BsdfModel {
    BsdfModel::RoughConductor {
        distribution,
        alpha_u: grey(alpha[0]),
        alpha_v: grey(alpha[1]),
        perfect,
        eta: rgb(0.143, 0.375, 1.442),
        k: rgb(3.983, 2.386, 1.603),
        specular_reflectance: grey(1.0),
    }
}

fn conductor(perfect: bool) -> BsdfModel {
    let (eta, k) = (rgb(0.143, 0.375, 1.442), rgb(3.983, 2.386, 1.603));
    BsdfModel::Conductor { perfect, eta, k, specular_reflectance: grey(1.0) }
}

fn plastic(nonlinear: bool, diffuse: TextureDescription, specular: TextureDescription) -> BsdfModel {
    BsdfModel::Plastic {
        int_ior: 1.49,
        ext_ior: 1.000277,
        nonlinear,
        diffuse_reflectance: diffuse,
        specular_reflectance: specular,
    }
}

fn rough_plastic(distribution: MicrofacetDescription, alpha: f32, int_ior: f32, nonlinear: bool) -> BsdfModel {
    BsdfModel::RoughPlastic {
        distribution,
        alpha,
        int_ior,
        ext_ior: 1.000277,
        nonlinear,
        diffuse_reflectance: rgb(0.1, 0.27, 0.66),
        specular_reflectance: grey(1.0),
    }
}

fn principled(parameters: PrincipledDescription) -> BsdfModel {
    BsdfModel::Principled { parameters: Box::new(parameters) }
}

/// All models; the last description of each is the one under test.
pub fn all_models() -> Vec<Case> {
    use BsdfModel::{Blend, Mask, Null, ThinDielectric, TwoSided};
    use MicrofacetDescription::{Beckmann, Ggx};
    let id = BsdfId;
    let lossless = true;
    let lossy = false;
    let table: Vec<(&'static str, bool, f32, Vec<BsdfModel>)> = vec![
        ("diffuse", lossy, 1.0, vec![diffuse(rgb(0.2, 0.5, 0.7))]),
        ("diffuse_white", lossless, 1.0, vec![diffuse(grey(1.0))]),
        ("diffuse_bitmap", lossy, 1.0, vec![diffuse(bitmap())]),
        ("diffuse_checkerboard", lossy, 1.0, vec![diffuse(checkerboard(0.4, 0.2))]),
        ("dielectric", lossless, 1.5, vec![dielectric(1.5, 1.0, grey(1.0), grey(1.0))]),
        ("dielectric_absorbing", lossy, 1.3, vec![dielectric(1.3, 1.0, grey(0.9), rgb(0.5, 0.8, 1.0))]),
        ("dielectric_bubble", lossless, 1.0 / 1.5, vec![dielectric(1.0, 1.5, grey(1.0), grey(1.0))]),
        ("dielectric_matched", lossless, 1.0, vec![dielectric(1.3, 1.3, grey(1.0), grey(1.0))]),
        (
            "thindielectric",
            lossless,
            1.0,
            vec![ThinDielectric {
                int_ior: 1.5,
                ext_ior: 1.0,
                specular_reflectance: grey(1.0),
                specular_transmittance: grey(1.0),
            }],
        ),
        ("conductor", lossy, 1.0, vec![conductor(false)]),
        ("conductor_perfect", lossless, 1.0, vec![conductor(true)]),
        ("roughconductor_ggx_001", lossless, 1.0, vec![rough_conductor(Ggx, [0.001; 2], true)]),
        ("roughconductor_beckmann_001", lossless, 1.0, vec![rough_conductor(Beckmann, [0.001; 2], true)]),
        ("roughconductor_ggx_02", lossy, 1.0, vec![rough_conductor(Ggx, [0.2; 2], false)]),
        ("roughconductor_beckmann_01", lossy, 1.0, vec![rough_conductor(Beckmann, [0.1; 2], false)]),
        ("roughconductor_ggx_1", lossless, 1.0, vec![rough_conductor(Ggx, [1.0; 2], true)]),
        ("roughconductor_beckmann_1", lossless, 1.0, vec![rough_conductor(Beckmann, [1.0; 2], true)]),
        ("roughconductor_ggx_brushed", lossy, 1.0, vec![rough_conductor(Ggx, [0.05, 0.4], false)]),
        ("roughconductor_beckmann_brushed", lossy, 1.0, vec![rough_conductor(Beckmann, [0.5, 0.2], false)]),
        ("roughdielectric_ggx_001", lossless, 1.5, vec![rough_dielectric(Ggx, [0.001; 2], 1.5, 1.0)]),
        ("roughdielectric_ggx_03", lossless, 1.5, vec![rough_dielectric(Ggx, [0.3; 2], 1.5, 1.0)]),
        ("roughdielectric_ggx_1", lossless, 2.4, vec![rough_dielectric(Ggx, [1.0; 2], 2.4, 1.0)]),
        ("roughdielectric_beckmann_01", lossless, 1.5, vec![rough_dielectric(Beckmann, [0.1; 2], 1.5, 1.0)]),
        ("roughdielectric_beckmann_bubble", lossless, 0.75, vec![rough_dielectric(Beckmann, [0.4; 2], 1.0, 1.0 / 0.75)]),
        ("roughdielectric_ggx_brushed", lossless, 1.33, vec![rough_dielectric(Ggx, [0.6, 0.2], 1.33, 1.0)]),
        ("plastic", lossy, 1.0, vec![plastic(false, rgb(0.1, 0.27, 0.66), grey(1.0))]),
        ("plastic_nonlinear", lossy, 1.0, vec![plastic(true, rgb(0.1, 0.27, 0.96), grey(0.5))]),
        ("plastic_bitmap", lossy, 1.0, vec![plastic(true, bitmap(), checkerboard(0.4, 0.8))]),
        ("roughplastic_beckmann_01", lossy, 1.0, vec![rough_plastic(Beckmann, 0.1, 1.49, false)]),
        ("roughplastic_ggx_03", lossy, 1.0, vec![rough_plastic(Ggx, 0.3, 1.9, true)]),
        ("roughplastic_beckmann_1", lossy, 1.0, vec![rough_plastic(Beckmann, 1.0, 1.49, true)]),
        ("principled", lossy, 1.0, vec![principled(PrincipledDescription::default())]),
        (
            "principled_metal",
            lossy,
            1.0,
            vec![principled(PrincipledDescription {
                base_color: rgb(0.9, 0.6, 0.2),
                roughness: grey(0.4),
                anisotropic: grey(0.7),
                metallic: grey(1.0),
                ..Default::default()
            })],
        ),
        (
            "principled_glass",
            lossy,
            1.5,
            vec![principled(PrincipledDescription {
                base_color: rgb(0.9, 0.8, 0.3),
                roughness: grey(0.6),
                spec_trans: grey(1.0),
                eta: 1.5,
                ..Default::default()
            })],
        ),
        (
            "principled_cloth",
            lossy,
            1.0,
            vec![principled(PrincipledDescription {
                base_color: bitmap(),
                roughness: grey(0.9),
                spec_tint: grey(0.8),
                sheen: grey(1.0),
                sheen_tint: grey(0.5),
                flatness: grey(0.6),
                eta: PrincipledDescription::eta(0.3),
                ..Default::default()
            })],
        ),
        (
            "principled_all",
            lossy,
            1.4,
            vec![principled(PrincipledDescription {
                base_color: rgb(0.5, 0.3, 0.2),
                roughness: checkerboard(0.5, 0.7),
                anisotropic: grey(0.3),
                metallic: grey(0.3),
                spec_trans: grey(0.4),
                spec_tint: grey(0.5),
                sheen: grey(0.5),
                sheen_tint: grey(0.7),
                flatness: grey(0.2),
                clearcoat: grey(0.8),
                clearcoat_gloss: grey(0.4),
                eta: 1.4,
            })],
        ),
        ("twosided", lossy, 1.0, vec![diffuse(grey(0.5)), TwoSided { front: id(0), back: id(0) }]),
        (
            "twosided_different",
            lossy,
            1.0,
            vec![diffuse(grey(0.5)), rough_conductor(Ggx, [0.5, 0.2], false), TwoSided { front: id(0), back: id(1) }],
        ),
        ("null", lossless, 1.0, vec![Null]),
        ("mask", lossy, 1.0, vec![diffuse(grey(0.5)), Mask { opacity: grey(0.3), inner: id(0) }]),
        (
            "mask_checkerboard",
            lossy,
            1.0,
            vec![rough_plastic(Ggx, 0.3, 1.9, false), Mask { opacity: checkerboard(0.25, 0.75), inner: id(0) }],
        ),
        (
            "blendbsdf",
            lossy,
            1.0,
            vec![
                diffuse(rgb(0.9, 0.5, 0.2)),
                rough_conductor(Ggx, [0.2; 2], false),
                Blend { weight: bitmap(), first: id(0), second: id(1) },
            ],
        ),
        (
            "blendbsdf_nested",
            lossy,
            1.5,
            vec![
                diffuse(rgb(0.9, 0.5, 0.2)),
                TwoSided { front: id(0), back: id(0) },
                rough_dielectric(Ggx, [0.3; 2], 1.5, 1.0),
                dielectric(1.5, 1.0, grey(1.0), grey(1.0)),
                Blend { weight: grey(0.6), first: id(1), second: id(2) },
                Blend { weight: grey(0.2), first: id(4), second: id(3) },
                Mask { opacity: grey(0.9), inner: id(5) },
            ],
        ),
    ];
    table
        .into_iter()
        .map(|(name, lossless, eta, models)| {
            let models: Vec<_> = models.into_iter().map(described).collect();
            Case::of(name, lossless, eta, &models)
        })
        .collect()
}

/// Directions on both sides from nearly normal to nearly grazing, no two in the same plane.
pub fn directions() -> Vec<Vec3> {
    let angles = [0.0, 20.0, 45.0, 70.0, 85.0, 89.9];
    let both = angles.iter().enumerate().flat_map(|(i, theta)| {
        let (theta, phi) = (f32::to_radians(*theta), 0.4 + 1.3 * i as f32);
        let w = Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
        [w, -w]
    });
    both.collect()
}
