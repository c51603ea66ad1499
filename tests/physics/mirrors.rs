//! A point light seen by way of two mirrors: E S D S L, which only merges find, in closed form.

use crate::support::{scene, seed};
use nephroid::render::{Budget, Control, Options, Picture, Render};
use nephroid::transport::class::PathFilter;
use nephroid::transport::settings::{Settings, Techniques};

/// Two walls that are mirrors; the floor is lit by both and seen in one.
pub const SCENE: &str = r#"<scene version="3.0.0">
<sensor type="perspective"><float name="fov" value="16"/>
  <transform name="to_world"><lookat origin="0, 1, 0" target="1, 0.3, 0" up="0, 1, 0"/></transform>
  <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="32"/><rfilter type="box"/></film></sensor>
<emitter type="point"><point name="position" value="-0.5, 1.5, 0"/><rgb name="intensity" value="3"/></emitter>
<bsdf type="conductor" id="mirror"><string name="material" value="none"/></bsdf>
<shape type="rectangle"><transform name="to_world"><scale value="20"/><rotate x="1" angle="-90"/></transform>
  <bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf></shape>
<shape type="rectangle"><transform name="to_world"><scale value="20"/><rotate y="1" angle="90"/><translate x="-1"/></transform><ref id="mirror"/></shape>
<shape type="rectangle"><transform name="to_world"><scale value="20"/><rotate y="1" angle="-90"/><translate x="1"/></transform><ref id="mirror"/></shape>
</scene>"#;

/// Radiance of E S D S L through pixel positions of a 32 × 32 film, by mirror images.
fn mirrored(x: f64, y: f64) -> f64 {
    let half = (8.0f64.to_radians()).tan();
    let forward = glam::DVec3::new(1.0, -0.7, 0.0).normalize();
    let left = glam::DVec3::Y.cross(forward).normalize();
    let up = forward.cross(left);
    let d = (forward + left * half * (1.0 - x / 16.0) + up * half * (1.0 - y / 16.0)).normalize();
    // The eye's image behind the mirror at x = 1 looks the other way.
    let (eye, d) = (glam::DVec3::new(2.0, 1.0, 0.0), glam::DVec3::new(-d.x, d.y, d.z));
    let p = eye - d * (eye.y / d.y);
    // The light's images behind both mirrors.
    let irradiance = |x| {
        let to_light = glam::DVec3::new(x, 1.5, 0.0) - p;
        3.0 * to_light.normalize().y / to_light.length_squared()
    };
    0.5 / std::f64::consts::PI * (irradiance(-1.5) + irradiance(2.5))
}

/// The paths E S D S L by these joins, merged within about two pixels.
pub fn picture(techniques: &str) -> Picture {
    let world = scene(SCENE);
    let settings = Settings {
        techniques: Techniques::parse(techniques).unwrap(),
        paths: PathFilter::parse("E S D S L").unwrap(),
        merge_radius: Some(0.05),
        light_paths: Some(65_536),
        rr_depth: 3,
        seed: seed() * 1000 + 709,
        ..Settings::default()
    };
    let mut render = Render::new(&world, &Options { settings, ..Options::default() }).unwrap();
    render.run(&Budget::passes(24), |_| Control::Continue);
    render.picture()
}

/// Largest difference of 8 × 8 blocks from the closed form, over what chance and blur allow, and how many blocks
/// could be tested.
pub fn deviation(picture: &Picture) -> (f64, usize) {
    let (mut worst, mut tested) = (0.0f64, 0);
    for by in 0..4u32 {
        for bx in 0..4u32 {
            let pixels = || (0..64).map(|i| (8 * bx + i % 8, 8 * by + i / 8));
            let at = |x: u32, y: u32| (y * 32 + x) as usize;
            let mean = pixels().map(|(x, y)| f64::from(picture.mean[at(x, y)][0])).sum::<f64>() / 64.0;
            let expected = pixels().map(|(x, y)| mirrored(f64::from(x) + 0.5, f64::from(y) + 0.5)).sum::<f64>() / 64.0;
            let variance = pixels().map(|(x, y)| f64::from(picture.variance[at(x, y)][0])).sum::<f64>() / 64.0 / 64.0;
            // Pixels share light vertices: a radius of 0.05 spans about a pixel or two.
            let error = (16.0 * variance).sqrt();
            // Few light paths come to what is far away.
            if error > 0.03 * expected {
                continue;
            }
            worst = worst.max((mean - expected).abs() / (4.0 * error + 0.003 * expected));
            tested += 1;
        }
    }
    (worst, tested)
}
