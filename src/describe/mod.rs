//! The scene as read: plain data, no behaviour, every value that can be wrong with its place.
//!
//! A format reader (today `io::mitsuba`) fills a [`SceneDescription`]; `io::assets` replaces file
//! names by decoded meshes and images; `scene::Scene::build` turns it into the immutable scene.
//! A scene built in code fills the same types with default places.

mod mesh;
mod place;
mod problem;
mod validate;

pub use mesh::smooth_normals;
pub use place::{Place, Placed, SourceFile, Sources};
pub use problem::{Problem, Problems, Severity};

use glam::{Mat4, Vec2, Vec3};
use std::path::PathBuf;
use std::sync::Arc;

/// Index into [`SceneDescription::bsdfs`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BsdfId(pub u32);
/// Index into [`SceneDescription::images`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ImageId(pub u32);
/// Index into [`SceneDescription::meshes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MeshId(pub u32);
/// Index into [`SceneDescription::groups`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct GroupId(pub u32);

/// A whole scene.
#[derive(Clone, Debug, Default)]
pub struct SceneDescription {
    /// Texts that places point into.
    pub sources: Sources,
    /// What the integrator element asks for.
    pub integrator: IntegratorDescription,
    /// Sensors in file order; the first is rendered unless another is chosen.
    pub sensors: Vec<SensorDescription>,
    /// Local models; shapes and other models refer to them by index. Acyclic.
    pub bsdfs: Vec<BsdfDescription>,
    /// Shapes at top level.
    pub shapes: Vec<ShapeDescription>,
    /// Emitters that belong to no shape.
    pub emitters: Vec<EmitterDescription>,
    /// Shape groups for instancing.
    pub groups: Vec<GroupDescription>,
    /// Triangle meshes, from files or from code.
    pub meshes: Vec<MeshDescription>,
    /// Images, from files or from code.
    pub images: Vec<ImageDescription>,
}

/// What the integrator element says.
#[derive(Clone, Debug, PartialEq)]
pub struct IntegratorDescription {
    /// The element's type (`path`, `ptracer`, `direct`, `bdpt`, …), `moment` already unwrapped.
    pub name: String,
    /// Longest path in edges; `None` = unbounded (−1 in the file). 0 = nothing at all.
    pub max_depth: Option<u32>,
    /// Path length from which Russian roulette may end a walk.
    pub rr_depth: u32,
    /// Emitters seen directly by the sensor are left out.
    pub hide_emitters: bool,
    /// Where.
    pub place: Place,
}

impl Default for IntegratorDescription {
    fn default() -> Self {
        Self { name: "path".into(), max_depth: None, rr_depth: 5, hide_emitters: false, place: Place::default() }
    }
}

/// An angle axis of a perspective sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum FovAxis {
    /// Image width.
    #[default]
    X,
    /// Image height.
    Y,
    /// Image diagonal.
    Diagonal,
    /// The shorter side.
    Smaller,
    /// The longer side.
    Larger,
}

/// Which camera.
#[derive(Clone, Debug, PartialEq)]
pub enum SensorModel {
    /// Pinhole.
    Perspective {
        /// Field of view in degrees along `fov_axis`.
        fov_deg: f32,
        /// The axis `fov_deg` is measured along.
        fov_axis: FovAxis,
        /// Offset of the principal point relative to the film size (x, y).
        principal_point_offset: Vec2,
    },
    /// Finite circular aperture.
    ThinLens {
        /// Field of view in degrees along `fov_axis`.
        fov_deg: f32,
        /// The axis `fov_deg` is measured along.
        fov_axis: FovAxis,
        /// Offset of the principal point relative to the film size (x, y).
        principal_point_offset: Vec2,
        /// Radius of the lens in scene units.
        aperture_radius: f32,
        /// Distance of the plane in focus, along the optical axis.
        focus_distance: f32,
    },
    /// Parallel projection; the film covers [-1, 1] along x of the sensor's frame.
    Orthographic,
}

/// A sensor and its film.
#[derive(Clone, Debug)]
pub struct SensorDescription {
    /// `id` of the element, if any.
    pub id: Option<String>,
    /// Which camera.
    pub model: SensorModel,
    /// Sensor to world; looks along +z, +y up, +x to the left of the image (Mitsuba's convention).
    pub to_world: Placed<Mat4>,
    /// Nearest visible distance along the axis.
    pub near_clip: f32,
    /// Farthest visible distance along the axis.
    pub far_clip: f32,
    /// Samples per pixel asked for by the sampler element.
    pub sample_count: Option<u32>,
    /// Seed asked for by the sampler element.
    pub seed: u64,
    /// The film.
    pub film: FilmDescription,
    /// Where.
    pub place: Place,
}

/// Reconstruction filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FilterDescription {
    /// Pixel-sized box.
    Box,
    /// Tent of the given radius (Mitsuba: 1).
    Tent {
        /// Half width in pixels.
        radius: f32,
    },
    /// Truncated Gaussian, radius 4 standard deviations.
    Gaussian {
        /// Standard deviation in pixels.
        stddev: f32,
    },
    /// Mitchell–Netravali, radius 2.
    Mitchell {
        /// Parameter B.
        b: f32,
        /// Parameter C.
        c: f32,
    },
    /// Catmull–Rom, radius 2.
    CatmullRom,
    /// Lanczos-windowed sinc.
    Lanczos {
        /// Number of lobes = radius in pixels.
        lobes: u32,
    },
}

/// Size, crop window and filter of the image.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmDescription {
    /// Width of the whole film in pixels.
    pub width: u32,
    /// Height of the whole film in pixels.
    pub height: u32,
    /// Crop window (x, y, width, height) in pixels of the whole film.
    pub crop: Option<[u32; 4]>,
    /// Reconstruction filter.
    pub filter: FilterDescription,
    /// Where.
    pub place: Place,
}

/// A number or colour that may vary over a surface.
#[derive(Clone, Debug, PartialEq)]
pub enum TextureDescription {
    /// The same everywhere, linear sRGB (a float is three equal numbers).
    Constant([f32; 3]),
    /// An image.
    Bitmap {
        /// Which image.
        image: ImageId,
        /// Interpolation.
        filter: BitmapFilter,
        /// What lies outside [0, 1]².
        wrap: BitmapWrap,
        /// Affine map applied to uv before the look-up.
        to_uv: Mat4,
        /// Where.
        place: Place,
    },
    /// Two textures in a chequered pattern, 2 × 2 fields per unit of uv.
    Checkerboard {
        /// First colour.
        color0: Box<TextureDescription>,
        /// Second colour.
        color1: Box<TextureDescription>,
        /// Affine map applied to uv before the look-up.
        to_uv: Mat4,
        /// Where.
        place: Place,
    },
}

impl TextureDescription {
    /// A constant grey.
    pub fn grey(v: f32) -> Self {
        Self::Constant([v; 3])
    }
}

/// Interpolation between texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum BitmapFilter {
    /// Between the four nearest texel centres.
    #[default]
    Bilinear,
    /// The texel that holds the point.
    Nearest,
}

/// What a bitmap is outside [0, 1]².
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum BitmapWrap {
    /// Periodic.
    #[default]
    Repeat,
    /// Periodic with every second copy mirrored.
    Mirror,
    /// The border texel.
    Clamp,
}

/// Distribution of microfacet normals.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum MicrofacetDescription {
    /// Beckmann (Mitsuba's default).
    #[default]
    Beckmann,
    /// GGX / Trowbridge–Reitz.
    Ggx,
}

/// A local model and where it is described.
#[derive(Clone, Debug, PartialEq)]
pub struct BsdfDescription {
    /// `id` of the element, if any.
    pub id: Option<String>,
    /// The model with its parameters.
    pub model: BsdfModel,
    /// Where.
    pub place: Place,
}

/// The local models with their parameters, named as Mitsuba 3 names them (its manual defines each).
#[allow(missing_docs)]
#[derive(Clone, Debug, PartialEq)]
pub enum BsdfModel {
    /// Lambert.
    Diffuse { reflectance: TextureDescription },
    /// Smooth dielectric boundary.
    Dielectric {
        int_ior: f32,
        ext_ior: f32,
        specular_reflectance: TextureDescription,
        specular_transmittance: TextureDescription,
    },
    /// Thin dielectric sheet, all internal reflections summed.
    ThinDielectric {
        int_ior: f32,
        ext_ior: f32,
        specular_reflectance: TextureDescription,
        specular_transmittance: TextureDescription,
    },
    /// Rough dielectric boundary [Walter 2007].
    RoughDielectric {
        distribution: MicrofacetDescription,
        alpha_u: TextureDescription,
        alpha_v: TextureDescription,
        int_ior: f32,
        ext_ior: f32,
        specular_reflectance: TextureDescription,
        specular_transmittance: TextureDescription,
    },
    /// Smooth conductor; eta = k = 0 is a perfect mirror (material "none": `perfect` = true).
    Conductor { perfect: bool, eta: TextureDescription, k: TextureDescription, specular_reflectance: TextureDescription },
    /// Rough conductor.
    RoughConductor {
        distribution: MicrofacetDescription,
        alpha_u: TextureDescription,
        alpha_v: TextureDescription,
        perfect: bool,
        eta: TextureDescription,
        k: TextureDescription,
        specular_reflectance: TextureDescription,
    },
    /// Smooth dielectric coat on a diffuse base.
    Plastic {
        int_ior: f32,
        ext_ior: f32,
        nonlinear: bool,
        diffuse_reflectance: TextureDescription,
        specular_reflectance: TextureDescription,
    },
    /// Rough dielectric coat on a diffuse base.
    RoughPlastic {
        distribution: MicrofacetDescription,
        alpha: f32,
        int_ior: f32,
        ext_ior: f32,
        nonlinear: bool,
        diffuse_reflectance: TextureDescription,
        specular_reflectance: TextureDescription,
    },
    /// The principled model [Burley 2012; Burley 2015]; `eta` is the index inside over that outside.
    Principled { parameters: Box<PrincipledDescription> },
    /// `front` seen from the side of the normal, `back` from the other.
    TwoSided { front: BsdfId, back: BsdfId },
    /// `inner` with probability `opacity`, else straight through.
    Mask { opacity: TextureDescription, inner: BsdfId },
    /// Straight through.
    Null,
    /// `(1 − weight)·first + weight·second`.
    Blend { weight: TextureDescription, first: BsdfId, second: BsdfId },
}

/// Parameters of the principled model.
#[allow(missing_docs)]
#[derive(Clone, Debug, PartialEq)]
pub struct PrincipledDescription {
    pub base_color: TextureDescription,
    pub roughness: TextureDescription,
    pub anisotropic: TextureDescription,
    pub metallic: TextureDescription,
    pub spec_trans: TextureDescription,
    pub spec_tint: TextureDescription,
    pub sheen: TextureDescription,
    pub sheen_tint: TextureDescription,
    pub flatness: TextureDescription,
    pub clearcoat: TextureDescription,
    pub clearcoat_gloss: TextureDescription,
    pub eta: f32,
}

impl Default for PrincipledDescription {
    /// Mitsuba's defaults.
    fn default() -> Self {
        let [half, none] = [0.5, 0.0].map(TextureDescription::grey);
        Self {
            base_color: half.clone(),
            roughness: half,
            anisotropic: none.clone(),
            metallic: none.clone(),
            spec_trans: none.clone(),
            spec_tint: none.clone(),
            sheen: none.clone(),
            sheen_tint: none.clone(),
            flatness: none.clone(),
            clearcoat: none.clone(),
            clearcoat_gloss: none,
            eta: Self::eta(0.5),
        }
    }
}

impl PrincipledDescription {
    /// All textures with their names.
    pub fn textures(&self) -> [(&'static str, &TextureDescription); 11] {
        [
            ("base_color", &self.base_color),
            ("roughness", &self.roughness),
            ("anisotropic", &self.anisotropic),
            ("metallic", &self.metallic),
            ("spec_trans", &self.spec_trans),
            ("spec_tint", &self.spec_tint),
            ("sheen", &self.sheen),
            ("sheen_tint", &self.sheen_tint),
            ("flatness", &self.flatness),
            ("clearcoat", &self.clearcoat),
            ("clearcoat_gloss", &self.clearcoat_gloss),
        ]
    }

    /// The index of a `specular` below 12.5: that whose reflection at normal incidence is 0.08 of it.
    pub fn eta(specular: f32) -> f32 {
        2.0 / (1.0 - (0.08 * specular).sqrt()) - 1.0
    }
}

/// A shape with its local model and emission.
#[derive(Clone, Debug)]
pub struct ShapeDescription {
    /// `id` of the element, if any.
    pub id: Option<String>,
    /// Geometry in its own coordinates.
    pub model: ShapeModel,
    /// Object to world.
    pub to_world: Placed<Mat4>,
    /// Normals point the other way.
    pub flip_normals: bool,
    /// Local model; `None` = Mitsuba's default: diffuse 0.5, black for a lamp.
    pub bsdf: Option<BsdfId>,
    /// Area emitter on the side of the normal.
    pub emission: Option<AreaEmission>,
    /// Where.
    pub place: Place,
}

/// Geometry of a shape.
#[derive(Clone, Debug, PartialEq)]
pub enum ShapeModel {
    /// Triangle mesh.
    Mesh {
        /// Which mesh.
        mesh: MeshId,
        /// Use face normals even where the mesh has vertex normals.
        face_normals: bool,
    },
    /// [-1, 1]² in the plane z = 0, normal +z.
    Rectangle,
    /// Unit disk in the plane z = 0, normal +z.
    Disk,
    /// [-1, 1]³.
    Cube,
    /// Sphere.
    Sphere {
        /// Centre before `to_world`.
        center: Vec3,
        /// Radius before `to_world`.
        radius: f32,
    },
    /// Open cylinder between two points.
    Cylinder {
        /// One end of the axis.
        p0: Vec3,
        /// Other end of the axis.
        p1: Vec3,
        /// Radius.
        radius: f32,
    },
    /// A copy of a shape group.
    Instance {
        /// Which group.
        group: GroupId,
    },
}

/// Emission of an area light.
#[derive(Clone, Debug, PartialEq)]
pub struct AreaEmission {
    /// Radiance, W·m⁻²·sr⁻¹, on the side of the normal.
    pub radiance: TextureDescription,
    /// `id` of the emitter element, if any.
    pub id: Option<String>,
    /// Where.
    pub place: Place,
}

/// Shapes that are instanced together.
#[derive(Clone, Debug, Default)]
pub struct GroupDescription {
    /// `id` of the element, if any.
    pub id: Option<String>,
    /// Members; emission and nested instances are not allowed here.
    pub shapes: Vec<ShapeDescription>,
    /// Where.
    pub place: Place,
}

/// An emitter that belongs to no shape.
#[derive(Clone, Debug)]
pub struct EmitterDescription {
    /// `id` of the element, if any.
    pub id: Option<String>,
    /// Which, with its parameters.
    pub model: EmitterModel,
    /// Where.
    pub place: Place,
}

/// Emitters that belong to no shape.
#[derive(Clone, Debug)]
pub enum EmitterModel {
    /// Isotropic point.
    Point {
        /// In world coordinates.
        position: Vec3,
        /// W·sr⁻¹.
        intensity: [f32; 3],
    },
    /// Point with a cone, linear falloff between `beam_width` and `cutoff_angle`.
    Spot {
        /// Looks along +z.
        to_world: Placed<Mat4>,
        /// W·sr⁻¹ on the axis.
        intensity: [f32; 3],
        /// Half angle beyond which there is nothing, degrees.
        cutoff_angle_deg: f32,
        /// Half angle of full intensity, degrees.
        beam_width_deg: f32,
        /// Projected image that multiplies the intensity.
        texture: Option<TextureDescription>,
    },
    /// Parallel light, or a sun with a disk.
    Directional {
        /// Direction in which light travels (need not be normalised).
        direction: Vec3,
        /// Irradiance on a plane facing the light, W·m⁻².
        irradiance: [f32; 3],
        /// Full angle of the disk in degrees; 0 = ideally parallel.
        angular_diameter_deg: f32,
    },
    /// The same radiance from everywhere.
    Constant {
        /// W·m⁻²·sr⁻¹.
        radiance: [f32; 3],
    },
    /// The same radiance from everywhere and through everything; no light of the rendering equation.
    Ambient {
        /// W·m⁻²·sr⁻¹.
        radiance: [f32; 3],
    },
    /// Latitude–longitude image.
    Envmap {
        /// Which image.
        image: ImageId,
        /// Factor on the image.
        scale: f32,
        /// Emitter to world.
        to_world: Placed<Mat4>,
    },
}

/// A mesh by file or by value.
#[derive(Clone, Debug)]
pub enum MeshDescription {
    /// To be read.
    File {
        /// Path as resolved against the search paths.
        path: PathBuf,
        /// Format.
        format: MeshFormat,
        /// Which shape of the file (serialized only).
        shape_index: u32,
        /// OBJ and PLY: v grows downwards in the file.
        flip_tex_coords: bool,
        /// Where the file was named.
        place: Place,
    },
    /// Decoded.
    Data(Arc<Mesh>),
}

/// Formats of mesh files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MeshFormat {
    /// Wavefront OBJ.
    Obj,
    /// Stanford PLY.
    Ply,
    /// Mitsuba's serialized format.
    Serialized,
}

/// Triangles with per-vertex attributes, in object coordinates.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Vertex normals; empty, or one per vertex.
    pub normals: Vec<Vec3>,
    /// Texture coordinates; empty, or one per vertex.
    pub uvs: Vec<Vec2>,
    /// Vertex indices of each triangle, all below `positions.len()`.
    pub triangles: Vec<[u32; 3]>,
}

/// An image by file or by value.
#[derive(Clone, Debug)]
pub enum ImageDescription {
    /// To be read.
    File {
        /// Path as resolved against the search paths.
        path: PathBuf,
        /// Numbers are used as they are (no sRGB decoding).
        raw: bool,
        /// Where the file was named.
        place: Place,
    },
    /// Decoded.
    Data(Arc<Image>),
}

/// A linear RGB(A) image, rows from the top.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Image {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// 1 (grey) or 3 (linear sRGB); alpha is dropped as Mitsuba does in its `rgb` conversion.
    pub channels: u32,
    /// `width · height · channels` numbers.
    pub data: Vec<f32>,
}
