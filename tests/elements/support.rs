//! Small diffuse scenes.

use nephroid::proof::form_factors::CUBE_FACES;
use nephroid::scene::Scene;

/// The built scene of a text.
pub fn scene(parts: &str) -> Scene {
    let xml = format!(
        r#"<scene version="3.0.0">
  <sensor type="perspective"><float name="fov" value="80"/>
    <transform name="to_world"><lookat origin="0.1, 0.05, 0.45" target="-0.1, -0.1, -0.5" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/><rfilter type="box"/></film></sensor>
  {parts}
</scene>"#
    );
    let loaded = nephroid::load_str(&xml, std::path::Path::new("."), &Default::default());
    loaded.map(|l| l.scene).unwrap_or_else(|e| panic!("{e}"))
}

/// A diffuse shape with a transform, normals turned if asked.
pub fn shape(kind: &str, flip: bool, transform: &str, reflectance: &str, radiance: &str) -> String {
    let emitter = if radiance.is_empty() {
        String::new()
    } else {
        format!(r#"<emitter type="area"><rgb name="radiance" value="{radiance}"/></emitter>"#)
    };
    format!(
        r#"<shape type="{kind}"><boolean name="flip_normals" value="{flip}"/><transform name="to_world">{transform}</transform>
        <bsdf type="diffuse"><rgb name="reflectance" value="{reflectance}"/></bsdf>{emitter}</shape>"#
    )
}

/// Six rectangles around the unit cube, shape by shape: −z, +z, −y, +y, −x, +x.
pub fn six_walls(look: impl Fn(usize) -> (&'static str, &'static str)) -> String {
    let wall = |(i, turn): (usize, &&str)| {
        let (reflectance, radiance) = look(i);
        shape("rectangle", false, &format!(r#"{turn}<scale value="0.5"/>"#), reflectance, radiance)
    };
    CUBE_FACES.iter().enumerate().map(wall).collect()
}

/// Slope of the least-squares line through (ln x, ln y).
pub fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let (mx, my) = points.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + x.ln() / n, b + y.ln() / n));
    let cross: f64 = points.iter().map(|(x, y)| (x.ln() - mx) * (y.ln() - my)).sum();
    let square: f64 = points.iter().map(|(x, _)| (x.ln() - mx).powi(2)).sum();
    cross / square
}

/// A Cornell box of diffuse walls [Goral 1984], open in front, with two blocks.
pub fn box_with_blocks() -> String {
    let walls = [
        (r#"<rotate x="1" angle="-90"/><translate y="-1"/>"#, "0.73"),
        (r#"<rotate x="1" angle="90"/><translate y="1"/>"#, "0.73"),
        (r#"<translate z="-1"/>"#, "0.73"),
        (r#"<rotate y="1" angle="90"/><translate x="-1"/>"#, "0.63, 0.065, 0.05"),
        (r#"<rotate y="1" angle="-90"/><translate x="1"/>"#, "0.14, 0.45, 0.09"),
    ];
    let tall = r#"<scale x="0.3" y="0.6" z="0.3"/><rotate y="1" angle="18"/><translate x="-0.33" y="-0.4" z="-0.3"/>"#;
    let short = r#"<scale value="0.3"/><rotate y="1" angle="-17"/><translate x="0.35" y="-0.7" z="0.3"/>"#;
    let lamp = r#"<scale x="0.24" y="0.2"/><rotate x="1" angle="90"/><translate y="0.99"/>"#;
    let mut parts: String = walls.iter().map(|(turn, rho)| shape("rectangle", false, turn, rho, "")).collect();
    parts += &shape("cube", false, tall, "0.73", "");
    parts += &shape("cube", false, short, "0.73", "");
    parts + &shape("rectangle", false, lamp, "0", "18.4, 15.6, 8")
}
