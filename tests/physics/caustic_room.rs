//! A room with a small bright caustic that is not in the picture.

use crate::support::{scene, seed};
use nephroid::render::{Budget, Control, Estimator, Options, Render};
use nephroid::transport::mis::Heuristic;
use nephroid::transport::settings::{Settings, Techniques};

/// Variance of the picture by these joins.
pub fn noise(techniques: &str) -> f64 {
    let wall = |transform: &str| {
        format!(
            r#"<shape type="rectangle"><transform name="to_world"><scale value="2"/>{transform}</transform>
          <bsdf type="diffuse"><rgb name="reflectance" value="0.6"/></bsdf></shape>"#
        )
    };
    let walls = [
        wall(r#"<rotate x="1" angle="-90"/>"#),
        wall(r#"<rotate x="1" angle="90"/><translate y="4"/>"#),
        wall(r#"<translate z="-2" y="2"/>"#),
        wall(r#"<rotate y="1" angle="180"/><translate z="2" y="2"/>"#),
        wall(r#"<rotate y="1" angle="90"/><translate x="-2" y="2"/>"#),
        wall(r#"<rotate y="1" angle="-90"/><translate x="2" y="2"/>"#),
    ];
    let xml = format!(
        r#"<scene version="3.0.0"><sensor type="perspective"><float name="fov" value="35"/>
      <transform name="to_world"><lookat origin="0, 2.4, 1.8" target="0, 2.6, 0" up="0, 1, 0"/></transform>
      <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="16"/><rfilter type="box"/></film></sensor>
    {}<shape type="sphere"><point name="center" value="1.2, 0.5, 1"/><float name="radius" value="0.3"/><bsdf type="dielectric"/></shape>
    <emitter type="spot"><transform name="to_world"><lookat origin="1.2, 3, 1" target="1.2, 0, 1.01" up="0, 0, 1"/></transform>
      <rgb name="intensity" value="20"/><float name="cutoff_angle" value="5"/></emitter></scene>"#,
        walls.concat()
    );
    let world = scene(&xml);
    let mut options = Options::for_scene(&world, Estimator::Bidirectional);
    options.settings = Settings {
        techniques: Techniques::parse(techniques).unwrap(),
        heuristic: Heuristic::Balance,
        merge_radius: Some(0.05),
        light_paths: Some(20_000),
        max_length: 6,
        seed: seed(),
        ..Settings::default()
    };
    let mut render = Render::new(&world, &options).unwrap();
    render.run(&Budget::passes(400), |_| Control::Continue);
    render.picture().variance.iter().map(|v| f64::from(v[1])).sum::<f64>()
}
