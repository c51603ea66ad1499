//! Identity of a scene: BLAKE3 over everything in its description that can change the image.
//!
//! Places, file names and the names of elements do not count; neither do the numbers of samples and
//! the seed, which films of the same scene may differ in. Of the sensors only the one in use counts.
//! Every type is taken apart without `..`, so that a new field cannot be forgotten here. Lists are
//! preceded by their length and variants by their name, so that no two scenes feed the same bytes.

use crate::describe::*;
use blake3::Hasher;
use glam::{Mat4, Vec2, Vec3};

/// Hash of what `sensor` sees of the scene.
pub(super) fn content_hash(scene: &SceneDescription, sensor: &SensorDescription) -> [u8; 32] {
    let SceneDescription { sources: _, integrator, sensors: _, bsdfs, shapes, emitters, groups, meshes, images } = scene;
    let mut h = Hasher::new();
    integrator.feed(&mut h);
    sensor.feed(&mut h);
    bsdfs.feed(&mut h);
    shapes.feed(&mut h);
    emitters.feed(&mut h);
    groups.feed(&mut h);
    meshes.feed(&mut h);
    images.feed(&mut h);
    *h.finalize().as_bytes()
}

trait Content {
    fn feed(&self, h: &mut Hasher);
}

macro_rules! number {
    ($($t:ty),*) => { $(impl Content for $t {
        fn feed(&self, h: &mut Hasher) {
            h.update(&self.to_le_bytes());
        }
    })* };
}
number!(f32, u32, u64);

impl Content for bool {
    fn feed(&self, h: &mut Hasher) {
        h.update(&[u8::from(*self)]);
    }
}

impl Content for str {
    fn feed(&self, h: &mut Hasher) {
        (self.len() as u64).feed(h);
        h.update(self.as_bytes());
    }
}

macro_rules! floats {
    ($($t:ty),*) => { $(impl Content for $t {
        fn feed(&self, h: &mut Hasher) {
            self.to_array().as_slice().iter().for_each(|v| v.feed(h));
        }
    })* };
}
floats!(Vec2, Vec3);

impl Content for Mat4 {
    fn feed(&self, h: &mut Hasher) {
        self.to_cols_array().feed(h);
    }
}

impl<T: Content, const N: usize> Content for [T; N] {
    fn feed(&self, h: &mut Hasher) {
        self.iter().for_each(|v| v.feed(h));
    }
}

impl<T: Content> Content for Vec<T> {
    fn feed(&self, h: &mut Hasher) {
        (self.len() as u64).feed(h);
        self.iter().for_each(|v| v.feed(h));
    }
}

impl<T: Content> Content for Option<T> {
    fn feed(&self, h: &mut Hasher) {
        self.is_some().feed(h);
        if let Some(v) = self {
            v.feed(h);
        }
    }
}

impl<T: Content + ?Sized> Content for Box<T> {
    fn feed(&self, h: &mut Hasher) {
        (**self).feed(h);
    }
}

impl<T: Content> Content for Placed<T> {
    fn feed(&self, h: &mut Hasher) {
        self.value.feed(h);
    }
}

/// `fields that count; fields that do not`.
macro_rules! structs {
    ($($t:ident { $($field:ident),* ; $($skip:ident),* })*) => { $(impl Content for $t {
        fn feed(&self, h: &mut Hasher) {
            let Self { $($field,)* $($skip: _),* } = self;
            $($field.feed(h);)*
        }
    })* };
}

/// Variants with named fields (or none), in the same form.
macro_rules! enums {
    ($($t:ident { $($variant:ident { $($field:ident),* $(; $($skip:ident),*)? })* })*) => { $(impl Content for $t {
        fn feed(&self, h: &mut Hasher) {
            match self {
                $(Self::$variant { $($field,)* $($($skip: _),*)? } => {
                    stringify!($variant).feed(h);
                    $($field.feed(h);)*
                })*
            }
        }
    })* };
}

macro_rules! ids {
    ($($t:ident),*) => { $(impl Content for $t {
        fn feed(&self, h: &mut Hasher) {
            self.0.feed(h);
        }
    })* };
}
ids!(BsdfId, ImageId, MeshId, GroupId);

structs! {
    IntegratorDescription { max_depth, rr_depth, hide_emitters; name, place }
    SensorDescription { model, to_world, near_clip, far_clip, film; id, sample_count, seed, place }
    FilmDescription { width, height, crop, filter; place }
    BsdfDescription { model; id, place }
    PrincipledDescription {
        base_color, roughness, anisotropic, metallic, spec_trans, spec_tint, sheen, sheen_tint, flatness, clearcoat, clearcoat_gloss, eta;
    }
    ShapeDescription { model, to_world, flip_normals, bsdf, emission; id, place }
    AreaEmission { radiance; id, place }
    GroupDescription { shapes; id, place }
    EmitterDescription { model; id, place }
}

enums! {
    FovAxis { X {} Y {} Diagonal {} Smaller {} Larger {} }
    SensorModel {
        Perspective { fov_deg, fov_axis, principal_point_offset }
        ThinLens { fov_deg, fov_axis, principal_point_offset, aperture_radius, focus_distance }
        Orthographic {}
    }
    FilterDescription {
        Box {}
        Tent { radius }
        Gaussian { stddev }
        Mitchell { b, c }
        CatmullRom {}
        Lanczos { lobes }
    }
    BitmapFilter { Bilinear {} Nearest {} }
    BitmapWrap { Repeat {} Mirror {} Clamp {} }
    MicrofacetDescription { Beckmann {} Ggx {} }
    BsdfModel {
        Diffuse { reflectance }
        Dielectric { int_ior, ext_ior, specular_reflectance, specular_transmittance }
        ThinDielectric { int_ior, ext_ior, specular_reflectance, specular_transmittance }
        RoughDielectric { distribution, alpha_u, alpha_v, int_ior, ext_ior, specular_reflectance, specular_transmittance }
        Conductor { perfect, eta, k, specular_reflectance }
        RoughConductor { distribution, alpha_u, alpha_v, perfect, eta, k, specular_reflectance }
        Plastic { int_ior, ext_ior, nonlinear, diffuse_reflectance, specular_reflectance }
        RoughPlastic { distribution, alpha, int_ior, ext_ior, nonlinear, diffuse_reflectance, specular_reflectance }
        Principled { parameters }
        TwoSided { front, back }
        Mask { opacity, inner }
        Null {}
        Blend { weight, first, second }
    }
    ShapeModel {
        Mesh { mesh, face_normals }
        Rectangle {}
        Disk {}
        Cube {}
        Sphere { center, radius }
        Cylinder { p0, p1, radius }
        Instance { group }
    }
    EmitterModel {
        Point { position, intensity }
        Spot { to_world, intensity, cutoff_angle_deg, beam_width_deg, texture }
        Directional { direction, irradiance, angular_diameter_deg }
        Constant { radiance }
        Ambient { radiance }
        Envmap { image, scale, to_world }
    }
}

impl Content for TextureDescription {
    fn feed(&self, h: &mut Hasher) {
        match self {
            Self::Constant(rgb) => {
                "Constant".feed(h);
                rgb.feed(h);
            }
            Self::Bitmap { image, filter, wrap, to_uv, place: _ } => {
                "Bitmap".feed(h);
                image.feed(h);
                filter.feed(h);
                wrap.feed(h);
                to_uv.feed(h);
            }
            Self::Checkerboard { color0, color1, to_uv, place: _ } => {
                "Checkerboard".feed(h);
                color0.feed(h);
                color1.feed(h);
                to_uv.feed(h);
            }
        }
    }
}

/// Long arrays in one piece; their length first.
fn feed_array<T: bytemuck::NoUninit>(values: &[T], h: &mut Hasher) {
    (values.len() as u64).feed(h);
    let bytes = bytemuck::cast_slice(values);
    if cfg!(target_endian = "little") {
        h.update(bytes);
    } else {
        for b in bytes.chunks_exact(4) {
            h.update(&[b[3], b[2], b[1], b[0]]);
        }
    }
}

impl Content for MeshDescription {
    fn feed(&self, h: &mut Hasher) {
        if let Self::Data(mesh) = self {
            let Mesh { positions, normals, uvs, triangles } = &**mesh;
            feed_array(positions, h);
            feed_array(normals, h);
            feed_array(uvs, h);
            feed_array(triangles, h);
        }
    }
}

impl Content for ImageDescription {
    fn feed(&self, h: &mut Hasher) {
        if let Self::Data(image) = self {
            let Image { width, height, channels, data } = &**image;
            [*width, *height, *channels].feed(h);
            feed_array(data, h);
        }
    }
}
