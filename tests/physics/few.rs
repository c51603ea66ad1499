//! Few lights: next events of what the picture shows see all of them.

use crate::support::{scene, seed};
use nephroid::render::{Budget, Control, Options, Render};
use nephroid::transport::class::PathFilter;
use nephroid::transport::settings::{Settings, Techniques};
use std::f64::consts::PI;

/// Lights of different power: x, y, z, intensity.
const POINTS: [[f64; 4]; 3] = [[-0.7, 0.4, 2.0, 3.0], [0.5, -0.3, 1.5, 1.0], [0.1, 0.9, 2.5, 6.0]];

/// A floor seen from above, half of it a mirror that shows the ceiling behind the sensor.
fn world() -> String {
    let point = |[x, y, z, i]: [f64; 4]| {
        format!(
            r#"<emitter type="point"><point name="position" value="{x}, {y}, {z}"/><rgb name="intensity" value="{i}"/></emitter>"#
        )
    };
    let half = |x: f64, bsdf: &str| {
        format!(
            r#"<shape type="rectangle"><transform name="to_world"><scale value="3"/><translate x="{x}"/></transform>{bsdf}</shape>"#
        )
    };
    format!(
        r#"<scene version="3.0.0"><sensor type="orthographic">
  <transform name="to_world"><scale value="2"/><lookat origin="0, 0, 3" target="0, 0, 0" up="0, 1, 0"/></transform>
  <film type="hdrfilm"><integer name="width" value="128"/><integer name="height" value="128"/><rfilter type="box"/></film></sensor>
{}{}{}<shape type="rectangle"><transform name="to_world"><scale value="9"/><rotate x="1" angle="180"/><translate z="5"/></transform>
  <bsdf type="diffuse"/></shape></scene>"#,
        POINTS.map(point).concat(),
        half(-3.0, r#"<bsdf type="diffuse"/>"#),
        half(3.0, r#"<bsdf type="conductor"><string name="material" value="none"/></bsdf>"#),
    )
}

/// Where one light alone would be picked, a pixel would show only that one: here every pixel is right in the first pass,
/// but for what the light changes across it.
#[test]
fn lamps_without_area_bring_no_noise() {
    let world = scene(&world());
    let (techniques, paths) = (Techniques::GATHER, PathFilter::parse("E S* D L").unwrap());
    let settings = Settings { techniques, paths, seed: seed() * 1000 + 811, ..Settings::default() };
    let mut render = Render::new(&world, &Options { settings, ..Options::default() }).unwrap();
    render.run(&Budget::passes(1), |_| Control::Continue);
    let picture = render.picture();
    let mut tested = [0; 2];
    for (i, value) in picture.mean.iter().enumerate() {
        let raster = glam::Vec2::new((i % 128) as f32 + 0.5, (i / 128) as f32 + 0.5);
        let at = world.sensor.sample_ray(raster, glam::Vec2::splat(0.5)).o.as_dvec3();
        if at.x.abs() < 0.05 {
            continue;
        }
        let z = if at.x < 0.0 { 0.0 } else { 5.0 };
        let irradiance = |[px, py, pz, intensity]: [f64; 4]| {
            let d = glam::DVec3::new(px - at.x, py - at.y, pz - z);
            intensity * d.z.abs() / d.length().powi(3)
        };
        let expected = 0.5 / PI * POINTS.map(irradiance).iter().sum::<f64>();
        let error = f64::from(value[1]) / expected - 1.0;
        assert!(error.abs() < 0.03, "pixel {i}: {} instead of {expected}", value[1]);
        tested[usize::from(at.x > 0.0)] += 1;
    }
    assert!(tested.iter().all(|t| *t > 7000), "{tested:?}");
}
