//! Small scenes, each stressing one thing, as texts of the scene language.

use std::path::{Path, PathBuf};

/// A named scene.
pub struct TestScene {
    pub name: &'static str,
    pub xml: String,
}

const CAMERA: &str = r#"<sensor type="perspective"><float name="fov" value="40"/>
  <transform name="to_world"><lookat origin="0.1, 0.05, 4.2" target="0, 0, 0" up="0, 1, 0"/></transform>FILM</sensor>"#;

const THIN_LENS: &str = r#"<sensor type="thinlens"><float name="fov" value="40"/>
  <float name="aperture_radius" value="0.2"/><float name="focus_distance" value="3.6"/>
  <transform name="to_world"><lookat origin="0.1, 0.05, 4.2" target="0, 0, 0" up="0, 1, 0"/></transform>FILM</sensor>"#;

const ORTHOGRAPHIC: &str = r#"<sensor type="orthographic"><transform name="to_world"><scale value="1.3"/>
  <lookat origin="0.3, 0.25, 4.2" target="0, 0, 0" up="0, 1, 0"/></transform>FILM</sensor>"#;

/// The sensor is below the surface, the light above.
const UNDER_WATER: &str = r#"<sensor type="perspective"><float name="fov" value="75"/>
  <transform name="to_world"><lookat origin="0.1, -0.3, 0.9" target="0, -0.6, -0.4" up="0, 1, 0"/></transform>FILM</sensor>"#;

const WATER: &str = r#"<shape type="rectangle"><transform name="to_world"><scale x="3" y="3"/><rotate x="1" angle="-90"/><translate y="0.1"/></transform>
  <bsdf type="dielectric"><float name="int_ior" value="1.33"/><float name="ext_ior" value="1"/></bsdf></shape>"#;

const FILM: &str =
    r#"<film type="hdrfilm"><integer name="width" value="48"/><integer name="height" value="48"/><rfilter type="box"/></film>"#;

const CROP: &str = r#"<film type="hdrfilm"><integer name="width" value="96"/><integer name="height" value="80"/>
  <integer name="crop_offset_x" value="37"/><integer name="crop_offset_y" value="21"/>
  <integer name="crop_width" value="40"/><integer name="crop_height" value="32"/><rfilter type="box"/></film>"#;

const WALLS: &str = r#"
<bsdf type="twosided" id="white"><bsdf type="diffuse"><rgb name="reflectance" value="0.7, 0.7, 0.65"/></bsdf></bsdf>
<bsdf type="twosided" id="red"><bsdf type="diffuse"><rgb name="reflectance" value="0.6, 0.1, 0.1"/></bsdf></bsdf>
<bsdf type="twosided" id="green"><bsdf type="diffuse"><rgb name="reflectance" value="0.1, 0.5, 0.15"/></bsdf></bsdf>
<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="-90"/><translate y="-1"/></transform><ref id="white"/></shape>
<shape type="rectangle"><transform name="to_world"><translate z="-1"/></transform><ref id="white"/></shape>
<shape type="rectangle"><transform name="to_world"><rotate y="1" angle="90"/><translate x="-1"/></transform><ref id="red"/></shape>
<shape type="rectangle"><transform name="to_world"><rotate y="1" angle="-90"/><translate x="1"/></transform><ref id="green"/></shape>
"#;

const CEILING: &str = r#"<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="90"/><translate y="1"/></transform><ref id="white"/></shape>"#;

const AREA: &str = r#"<shape type="rectangle"><transform name="to_world"><scale value="0.45"/><rotate x="1" angle="90"/><translate y="0.98"/></transform>
<bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf><emitter type="area"><rgb name="radiance" value="9, 8, 6"/></emitter></shape>"#;

const BLOCK: &str = r#"<shape type="cube"><transform name="to_world"><scale value="0.3"/><rotate y="1" angle="25"/><translate x="-0.35" y="-0.7" z="-0.2"/></transform><ref id="white"/></shape>"#;

const GLASS_AND_MIRROR: &str = r#"
<shape type="sphere"><point name="center" value="0.4, -0.55, 0.3"/><float name="radius" value="0.42"/><bsdf type="dielectric"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/></bsdf></shape>
<shape type="sphere"><point name="center" value="-0.45, -0.5, -0.3"/><float name="radius" value="0.45"/><bsdf type="conductor"><string name="material" value="none"/></bsdf></shape>"#;

const ROUGH_GLASS: &str = r#"
<shape type="sphere"><point name="center" value="0.35, -0.5, 0.2"/><float name="radius" value="0.48"/><bsdf type="roughdielectric"><string name="distribution" value="ggx"/><float name="alpha" value="0.3"/></bsdf></shape>
<shape type="cube"><transform name="to_world"><scale value="0.28"/><rotate y="1" angle="20"/><translate x="-0.5" y="-0.7" z="0"/></transform>
  <bsdf type="roughconductor"><string name="distribution" value="ggx"/><float name="alpha_u" value="0.2"/><float name="alpha_v" value="0.5"/><rgb name="eta" value="0.2, 0.9, 1.1"/><rgb name="k" value="3.9, 2.4, 2.1"/></bsdf></shape>"#;

/// Not one Dirac event, and yet hardly another join than a merge finds the lamp in the mirror.
const NEARLY_SPECULAR: &str = r#"
<shape type="sphere"><point name="center" value="0.4, -0.5, 0.1"/><float name="radius" value="0.4"/>
  <bsdf type="roughdielectric"><float name="alpha" value="0.06"/><float name="int_ior" value="1.5"/></bsdf></shape>
<shape type="sphere"><point name="center" value="-0.45, -0.5, -0.3"/><float name="radius" value="0.45"/>
  <bsdf type="roughconductor"><string name="material" value="none"/><float name="alpha" value="0.08"/></bsdf></shape>"#;

/// Every breadth of events: a hollow ball of frosted glass, a ball of brushed metal, a polished one, and one that is as good as a mirror.
const FROSTED: &str = r#"
<bsdf type="roughdielectric" id="frosted"><float name="alpha" value="0.2"/><float name="int_ior" value="1.5"/></bsdf>
<shape type="sphere"><point name="center" value="0.4, -0.5, 0.1"/><float name="radius" value="0.42"/><ref id="frosted"/></shape>
<shape type="sphere"><point name="center" value="0.4, -0.5, 0.1"/><float name="radius" value="0.34"/><boolean name="flip_normals" value="true"/><ref id="frosted"/></shape>
<shape type="sphere"><point name="center" value="-0.45, -0.5, -0.3"/><float name="radius" value="0.4"/>
  <bsdf type="roughconductor"><string name="material" value="none"/><float name="alpha" value="0.4"/></bsdf></shape>
<shape type="sphere"><point name="center" value="-0.5, 0.2, -0.3"/><float name="radius" value="0.3"/>
  <bsdf type="roughconductor"><string name="material" value="none"/><float name="alpha" value="0.07"/></bsdf></shape>
<shape type="sphere"><point name="center" value="-0.1, -0.8, 0.5"/><float name="radius" value="0.2"/>
  <bsdf type="roughconductor"><string name="material" value="none"/><float name="alpha" value="0.02"/></bsdf></shape>"#;

const PLASTICS: &str = r#"
<shape type="sphere"><point name="center" value="0.4, -0.55, 0.2"/><float name="radius" value="0.42"/><bsdf type="plastic"><rgb name="diffuse_reflectance" value="0.1, 0.3, 0.6"/><boolean name="nonlinear" value="true"/></bsdf></shape>
<shape type="sphere"><point name="center" value="-0.45, -0.5, -0.2"/><float name="radius" value="0.45"/><bsdf type="roughplastic"><float name="alpha" value="0.2"/><rgb name="diffuse_reflectance" value="0.6, 0.3, 0.1"/></bsdf></shape>
<shape type="rectangle"><transform name="to_world"><scale value="0.4"/><translate x="0" y="0.1" z="0.5"/></transform>
  <bsdf type="mask"><float name="opacity" value="0.4"/><bsdf type="twosided"><bsdf type="diffuse"/></bsdf></bsdf></shape>
<shape type="cube"><transform name="to_world"><scale value="0.2"/><translate x="0" y="-0.8" z="0.5"/></transform>
  <bsdf type="blendbsdf"><float name="weight" value="0.5"/><bsdf type="diffuse"/><bsdf type="conductor"><string name="material" value="none"/></bsdf></bsdf></shape>"#;

/// A lacquer, frosted glass with a diffuse part, and a gilded block, all by one model.
const PRINCIPLED: &str = r#"
<shape type="sphere"><point name="center" value="0.4, -0.55, 0.2"/><float name="radius" value="0.42"/>
  <bsdf type="principled"><rgb name="base_color" value="0.9, 0.8, 0.6"/><float name="roughness" value="0.5"/><float name="spec_trans" value="0.7"/><float name="eta" value="1.5"/>
  <float name="spec_tint" value="0.4"/><float name="flatness" value="0.5"/></bsdf></shape>
<shape type="sphere"><point name="center" value="-0.45, -0.5, -0.2"/><float name="radius" value="0.45"/>
  <bsdf type="principled"><rgb name="base_color" value="0.5, 0.1, 0.1"/><float name="roughness" value="0.6"/><float name="clearcoat" value="1"/><float name="sheen" value="0.8"/></bsdf></shape>
<shape type="cube"><transform name="to_world"><scale value="0.2"/><rotate y="1" angle="30"/><translate x="0" y="-0.8" z="0.6"/></transform>
  <bsdf type="principled"><rgb name="base_color" value="0.9, 0.7, 0.3"/><float name="metallic" value="0.9"/><float name="roughness" value="0.5"/><float name="anisotropic" value="0.6"/></bsdf></shape>"#;

/// A sphere and a tube that shine.
const LAMPS: &str = r#"
<shape type="sphere"><point name="center" value="-0.6, 0.3, 0.1"/><float name="radius" value="0.1"/><bsdf type="diffuse"/><emitter type="area"><rgb name="radiance" value="4, 6, 8"/></emitter></shape>
<shape type="cylinder"><point name="p0" value="0.5, -0.95, -0.5"/><point name="p1" value="0.6, -0.2, -0.6"/><float name="radius" value="0.05"/><bsdf type="diffuse"/><emitter type="area"><rgb name="radiance" value="6, 3, 2"/></emitter></shape>"#;

/// One that shines inwards. Grazing light leaves it by an edge so short that the reference of weights, which takes
/// directions from positions, has no digits left; so it stands where other joins outweigh that.
const INWARD: &str = r#"
<shape type="sphere"><point name="center" value="0.75, 0.5, 0.3"/><float name="radius" value="0.1"/><boolean name="flip_normals" value="true"/><bsdf type="null"/><emitter type="area"><rgb name="radiance" value="3, 3, 3"/></emitter></shape>"#;

const SPOTS: &str = r#"<emitter type="spot"><rgb name="intensity" value="3, 5, 6"/><float name="cutoff_angle" value="110"/><float name="beam_width" value="60"/>
  <transform name="to_world"><lookat origin="-0.2, -0.4, 0.6" target="0.2, -1, -0.4" up="0, 0, 1"/></transform></emitter>
<emitter type="point"><point name="position" value="-0.7, -0.6, 0.6"/><rgb name="intensity" value="0.3, 0.3, 0.2"/></emitter>"#;

/// Lights that tile a square of half the side `half` below the ceiling with gaps between them, some tilted.
fn tiles(columns: u32, rows: u32, half: f32) -> String {
    let tile = |i: u32| {
        let size = [half / columns as f32, half / rows as f32];
        let at = [i % columns, i / columns].map(|k| 2.0 * k as f32 + 1.0);
        let [x, z] = [size[0] * at[0] - half, size[1] * at[1] - half];
        let (tilt, radiance) = (90.0 + 15.0 * ((i % 3) as f32 - 1.0), 4.0 + (i % 5) as f32);
        format!(
            r#"<shape type="rectangle"><transform name="to_world"><scale x="{}" y="{}"/><rotate x="1" angle="{tilt}"/><translate x="{x}" y="0.9" z="{z}"/></transform>
<bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf><emitter type="area"><rgb name="radiance" value="{radiance}, {radiance}, 6"/></emitter></shape>"#,
            0.9 * size[0],
            0.9 * size[1]
        )
    };
    (0..columns * rows).map(tile).collect()
}

fn xml(sensor: &str, film: &str, parts: &[&str]) -> String {
    format!(r#"<scene version="3.0.0">{}{WALLS}{}</scene>"#, sensor.replace("FILM", film), parts.concat())
}

/// A sphere of 7 × 4 facets with smooth normals, written where the test can name it.
fn coarse_sphere(dir: &Path) -> PathBuf {
    use std::fmt::Write;
    let (columns, rows) = (7, 4);
    let mut obj = String::new();
    for j in 0..=rows {
        for i in 0..columns {
            let (theta, phi) = (
                std::f64::consts::PI * f64::from(j) / f64::from(rows),
                std::f64::consts::TAU * f64::from(i) / f64::from(columns),
            );
            let n = [theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()];
            let _ = writeln!(obj, "v {} {} {}\nvn {} {} {}", n[0], n[1], n[2], n[0], n[1], n[2]);
        }
    }
    for j in 0..rows {
        for i in 0..columns {
            let at = |i: i32, j: i32| j * columns + i % columns + 1;
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            if j > 0 {
                let _ = writeln!(obj, "f {a}//{a} {b}//{b} {c}//{c}");
            }
            if j + 1 < rows {
                let _ = writeln!(obj, "f {a}//{a} {c}//{c} {d}//{d}");
            }
        }
    }
    let path = dir.join("coarse.obj");
    std::fs::write(&path, obj).expect("temporary file");
    path
}

/// A sky with a gradient and a bright patch.
fn sky(dir: &Path) -> PathBuf {
    let image = image::RgbImage::from_fn(32, 16, |x, y| {
        let v = (200 - 8 * y) as u8;
        if (20..23).contains(&x) && (3..5).contains(&y) { image::Rgb([255; 3]) } else { image::Rgb([v / 3, v / 2, v]) }
    });
    let path = dir.join("sky.png");
    image.save(&path).expect("temporary file");
    path
}

/// All of them; meshes and images go to `dir`.
pub fn all(dir: &Path) -> Vec<TestScene> {
    let scene = |name, sensor, film, parts: &[&str]| TestScene { name, xml: xml(sensor, film, parts) };
    let coarse = format!(
        r#"<shape type="obj"><string name="filename" value="{}"/><transform name="to_world"><scale value="0.6"/><translate x="0.1" y="-0.35" z="0"/></transform><ref id="white"/></shape>"#,
        coarse_sphere(dir).display()
    );
    let sky = format!(
        r#"<emitter type="envmap"><string name="filename" value="{}"/><float name="scale" value="2"/></emitter>"#,
        sky(dir).display()
    );
    let point = r#"<emitter type="point"><point name="position" value="0.3, 0.7, 0.4"/><rgb name="intensity" value="3, 2.7, 2"/></emitter>"#;
    let spot = r#"<emitter type="spot"><rgb name="intensity" value="9, 8, 6"/><float name="cutoff_angle" value="35"/><float name="beam_width" value="20"/>
      <transform name="to_world"><lookat origin="0.2, 0.9, 0.5" target="0, -1, -0.2" up="0, 0, 1"/></transform></emitter>"#;
    let directional = r#"<emitter type="directional"><vector name="direction" value="0.4, -1, -0.6"/><rgb name="irradiance" value="3, 2.7, 2"/></emitter>"#;
    let sun = r#"<emitter type="directional"><vector name="direction" value="0.4, -1, -0.6"/><rgb name="irradiance" value="3, 2.7, 2"/><float name="angular_diameter" value="30"/></emitter>"#;
    let constant = r#"<emitter type="constant"><rgb name="radiance" value="0.5, 0.6, 0.8"/></emitter>"#;
    let lamps = format!("{}{LAMPS}{INWARD}{point}{spot}{SPOTS}{constant}", tiles(4, 3, 0.45));
    vec![
        scene("diffuse box", CAMERA, FILM, &[CEILING, AREA, BLOCK]),
        scene("glass and mirror", CAMERA, FILM, &[CEILING, AREA, GLASS_AND_MIRROR]),
        scene("rough glass and metal", CAMERA, FILM, &[CEILING, AREA, ROUGH_GLASS]),
        scene("nearly specular", CAMERA, FILM, &[CEILING, AREA, NEARLY_SPECULAR]),
        scene("frosted", CAMERA, FILM, &[CEILING, AREA, FROSTED]),
        scene("plastics, mask and blend", CAMERA, FILM, &[CEILING, AREA, PLASTICS]),
        scene("principled", CAMERA, FILM, &[CEILING, AREA, PRINCIPLED]),
        scene("shading normals", CAMERA, FILM, &[CEILING, AREA, &coarse]),
        scene("point light", CAMERA, FILM, &[CEILING, point, GLASS_AND_MIRROR]),
        scene("spot light", CAMERA, FILM, &[CEILING, spot, BLOCK]),
        scene("directional light", CAMERA, FILM, &[directional, BLOCK]),
        scene("sun disk", CAMERA, FILM, &[sun, GLASS_AND_MIRROR]),
        scene("constant sky", CAMERA, FILM, &[constant, BLOCK]),
        scene("image sky", CAMERA, FILM, &[&sky, GLASS_AND_MIRROR]),
        scene("thin lens", THIN_LENS, FILM, &[CEILING, AREA, BLOCK]),
        scene("crop window", CAMERA, CROP, &[CEILING, AREA, BLOCK]),
        scene("under water", UNDER_WATER, FILM, &[CEILING, AREA, WATER]),
        scene("orthographic", ORTHOGRAPHIC, FILM, &[CEILING, AREA, BLOCK]),
        // So few that next events see all of them.
        scene("few lamps", CAMERA, FILM, &[CEILING, AREA, LAMPS, constant, GLASS_AND_MIRROR]),
        // More lights than are asked evenly: a tree chooses among them.
        scene("many lamps", CAMERA, FILM, &[&lamps, BLOCK]),
        scene("tiles and sky", CAMERA, FILM, &[&tiles(4, 4, 0.6), LAMPS, constant, GLASS_AND_MIRROR]),
    ]
}

/// One of them.
pub fn named(dir: &Path, name: &str) -> String {
    all(dir).into_iter().find(|s| s.name == name).unwrap_or_else(|| panic!("no scene {name}")).xml
}
