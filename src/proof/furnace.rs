//! Pictures that closed forms say are constant: furnaces, the toy equation, the inside of a sphere.

use super::compare::Estimate;
use crate::describe::{BsdfId, Mesh, MeshDescription, MeshFormat, MeshId, Place, Problems, SceneDescription};
use crate::describe::{ShapeDescription, ShapeModel};
use crate::io::assets;
use crate::io::mitsuba::{self, LoadError};
use crate::render::{Budget, Control, Options, Picture, Render, RenderError};
use crate::report::agreement::sidak;
use crate::scene::Scene;
use glam::{Mat4, Vec3};
use statrs::function::erf::erfc;
use std::path::Path;
use std::sync::Arc;

/// How far a picture is from a constant.
#[derive(Clone, Debug, PartialEq)]
pub struct Constancy {
    /// Probability of a pixel as deviant as the most deviant one, corrected for the number of pixels and channels.
    pub p: f64,
    /// That pixel (its index, its channel), its value and its standard error.
    pub worst: (usize, usize, f64, f64),
    /// The value that is farthest from the constant.
    pub farthest: f64,
}

impl Constancy {
    /// Compares every pixel with `exact`, in all channels. Standard errors are at least 1e-5: rounding.
    pub fn of(picture: &Picture, exact: [f64; 3]) -> Self {
        let (mut p, mut worst, mut most) = (1.0f64, (0, 0, exact[0], 0.0), -1.0);
        let mut farthest = exact[0];
        for (i, (m, v)) in picture.mean.iter().zip(&picture.variance).enumerate() {
            for c in 0..3 {
                let (mean, error) = (f64::from(m[c]), f64::from(v[c]).sqrt().max(1e-5));
                let z = (mean - exact[c]).abs() / error;
                if z > most {
                    (most, worst) = (z, (i, c, mean, error));
                }
                if (mean - exact[c]).abs() > (farthest - exact[c]).abs() {
                    farthest = mean;
                }
                p = p.min(erfc(z / std::f64::consts::SQRT_2));
            }
        }
        Self { p: sidak(p, picture.mean.len() * 3), worst, farthest }
    }
}

/// Renders so many passes.
pub fn picture(scene: &Scene, options: &Options, passes: u64) -> Result<Picture, RenderError> {
    let mut render = Render::new(scene, options)?;
    render.run(&Budget::passes(passes), |_| Control::Continue);
    Ok(render.picture())
}

/// Mean of the film in its first channel, its error from the means of single passes: pixels of one pass share light paths.
pub fn film_mean(scene: &Scene, options: &Options, passes: u64) -> Result<Estimate, RenderError> {
    let mut render = Render::new(scene, options)?;
    let mut means = Vec::new();
    let mut before = 0.0;
    for pass in 0..passes.max(2) {
        render.run_passes(pass..pass + 1);
        let mean = render.film().mean();
        let sum = mean.iter().map(|m| f64::from(m[0])).sum::<f64>() / mean.len() as f64 * (pass + 1) as f64;
        means.push(sum - before);
        before = sum;
    }
    let n = means.len() as f64;
    let mean = means.iter().sum::<f64>() / n;
    let variance = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (n - 1.0);
    Ok(Estimate { mean, standard_error: (variance / n).sqrt() })
}

fn scene(side: u32, parts: &str) -> Result<Scene, LoadError> {
    crate::load_str(&xml(side, parts), ".".as_ref(), &Default::default()).map(|l| l.scene)
}

/// Parts inside the cube [−1, 1]³, seen from near one of its corners.
fn xml(side: u32, parts: &str) -> String {
    format!(
        r#"<scene version="3.0.0">
  <sensor type="perspective"><float name="fov" value="70"/>
    <transform name="to_world"><lookat origin="0.6, 0.7, 0.9" target="-0.1, -0.15, -0.3" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="{side}"/><integer name="height" value="{side}"/><rfilter type="box"/></film></sensor>
  {parts}
</scene>"#
    )
}

/// A closed box whose walls all have this reflectance and emission.
const fn walls() -> &'static str {
    r#"<shape type="cube"><boolean name="flip_normals" value="true"/>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.5, 0.4, 0.6"/></bsdf>
    <emitter type="area"><rgb name="radiance" value="0.5, 0.6, 0.4"/></emitter></shape>"#
}

/// x = 0.1 x + 1.8 as a closed box of reflectance 0.1 and emission 1.8.
pub fn toy() -> Result<Scene, LoadError> {
    scene(
        16,
        r#"<shape type="cube"><boolean name="flip_normals" value="true"/>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.1"/></bsdf>
    <emitter type="area"><rgb name="radiance" value="1.8"/></emitter></shape>"#,
    )
}

/// Radiance 1 everywhere: Lᵉ = 1 − a on diffuse walls, a dim mirror and a diffuse ball, 0 on lossless glass; without Dirac
/// events where `diffuse`, so that shooting sees all of it.
pub fn furnace(diffuse: bool) -> Result<Scene, LoadError> {
    let ball = r#"<shape type="sphere"><point name="center" value="-0.4, -0.5, -0.2"/><float name="radius" value="0.4"/>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.7"/></bsdf><emitter type="area"><rgb name="radiance" value="0.3"/></emitter></shape>"#;
    let dirac = r#"<shape type="sphere"><point name="center" value="0.5, -0.5, -0.2"/><float name="radius" value="0.3"/>
    <bsdf type="conductor"><string name="material" value="none"/><rgb name="specular_reflectance" value="0.8"/></bsdf>
    <emitter type="area"><rgb name="radiance" value="0.2"/></emitter></shape>
  <shape type="sphere"><point name="center" value="-0.2, 0.45, -0.3"/><float name="radius" value="0.25"/>
    <bsdf type="dielectric"/></shape>"#;
    scene(24, &format!("{}{ball}{}", walls(), if diffuse { "" } else { dirac }))
}

/// What any mesh may be made of and leave radiance constant: it scatters all that it receives, on both sides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lossless {
    /// Diffuse and white.
    White,
    /// A perfect mirror.
    Mirror,
}

/// The furnace of a mesh file, whatever its shape: scaled into a closed box in which radiance is 1. Normals are those
/// of its faces.
pub fn furnace_of(path: &Path, made_of: Lossless) -> Result<Scene, LoadError> {
    let inner = match made_of {
        Lossless::White => r#"<bsdf type="diffuse"><rgb name="reflectance" value="1"/></bsdf>"#,
        Lossless::Mirror => r#"<bsdf type="conductor"><string name="material" value="none"/></bsdf>"#,
    };
    let parts = format!(r#"{}<bsdf type="twosided" id="lossless">{inner}</bsdf>"#, walls());
    let mut read = mitsuba::from_str(&xml(32, &parts), ".".as_ref(), &Default::default())?;
    let format = match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
        Some("ply") => MeshFormat::Ply,
        Some("serialized") => MeshFormat::Serialized,
        _ => MeshFormat::Obj,
    };
    let (path, place) = (path.to_owned(), Place::default());
    read.scene.meshes.push(MeshDescription::File { path, format, shape_index: 0, flip_tex_coords: false, place });
    let mut problems = Problems::default();
    assets::decode(&mut read.scene, &mut problems);
    if problems.has_errors() {
        return Err(LoadError { problems, sources: read.scene.sources });
    }
    let mesh = MeshId(read.scene.meshes.len() as u32 - 1);
    let to_world = match read.scene.meshes.last() {
        Some(MeshDescription::Data(mesh)) => into_box(mesh),
        _ => Mat4::IDENTITY,
    };
    add(&mut read.scene, mesh, to_world, "lossless");
    crate::finish(read).map(|l| l.scene)
}

/// Into [−0.55, 0.55]³.
fn into_box(mesh: &Mesh) -> Mat4 {
    let infinite = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let (low, high) = mesh.positions.iter().fold(infinite, |(a, b), p| (a.min(*p), b.max(*p)));
    let scale = 1.1 / (high - low).max_element();
    if scale.is_finite() && scale > 0.0 {
        Mat4::from_scale(Vec3::splat(scale)) * Mat4::from_translation(-0.5 * (low + high))
    } else {
        Mat4::IDENTITY
    }
}

/// Adds a mesh by value with the local model of this id.
pub(super) fn add_mesh(scene: &mut SceneDescription, mesh: Mesh, bsdf: &str) {
    scene.meshes.push(MeshDescription::Data(Arc::new(mesh)));
    add(scene, MeshId(scene.meshes.len() as u32 - 1), Mat4::IDENTITY, bsdf);
}

fn add(scene: &mut SceneDescription, mesh: MeshId, to_world: Mat4, bsdf: &str) {
    let bsdf = scene.bsdfs.iter().position(|b| b.id.as_deref() == Some(bsdf)).map(|i| BsdfId(i as u32));
    scene.shapes.push(ShapeDescription {
        id: None,
        model: ShapeModel::Mesh { mesh, face_normals: true },
        to_world: to_world.into(),
        flip_normals: false,
        bsdf,
        emission: None,
        place: Place::default(),
    });
}

/// Reflectance of the sphere.
pub const SPHERE_ALBEDO: f64 = 0.6;
/// Mean emission over the sphere.
pub const SPHERE_EMISSION: f64 = 0.75;

/// The inside of a sphere with squares of light of two kinds (0.25 and 1.25, evenly many in every latitude): n scatterings
/// add aⁿ avg(Lᵉ) everywhere, whatever the pattern of emission.
pub fn sphere() -> Result<Scene, LoadError> {
    scene(
        12,
        &format!(
            r#"<shape type="sphere"><float name="radius" value="1.5"/><boolean name="flip_normals" value="true"/>
    <bsdf type="diffuse"><rgb name="reflectance" value="{SPHERE_ALBEDO}"/></bsdf>
    <emitter type="area"><texture type="checkerboard" name="radiance">
      <rgb name="color0" value="0.25"/><rgb name="color1" value="1.25"/>
      <transform name="to_uv"><scale x="3" y="2"/></transform></texture></emitter></shape>"#
        ),
    )
}
