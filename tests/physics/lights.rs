//! Lamps seen directly, through a lens or a hole.

use crate::support::{pictures, scene, seed};
use nephroid::render::{Estimator, Options};
use nephroid::report::agreement::BlockSeries;
use nephroid::scene::Scene;

/// A large lamp in focus, small ones out of it, a sun and a dim sky.
const LIGHTS: &str = r#"<scene version="3.0.0">
<integrator type="path"><integer name="max_depth" value="1"/></integrator>
<sensor type="{sensor}"><float name="fov" value="40"/>{lens}
  <transform name="to_world"><lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
  <film type="hdrfilm"><integer name="width" value="48"/><integer name="height" value="48"/><rfilter type="gaussian"/></film></sensor>
<shape type="disk"><transform name="to_world"><scale value="0.5"/><translate x="-0.6" y="-0.5"/></transform>
  <emitter type="area"><rgb name="radiance" value="2, 1, 1"/></emitter></shape>
<shape type="sphere"><point name="center" value="1.5, 1, -6"/><float name="radius" value="0.08"/>
  <emitter type="area"><rgb name="radiance" value="90, 70, 30"/></emitter></shape>
<shape type="sphere"><point name="center" value="0.3, 0.2, 2.2"/><float name="radius" value="0.01"/>
  <emitter type="area"><rgb name="radiance" value="90, 30, 70"/></emitter></shape>
<shape type="rectangle"><transform name="to_world"><scale value="0.05"/><translate x="-1.5" y="1" z="-3"/></transform>
  <emitter type="area"><rgb name="radiance" value="30, 70, 90"/></emitter></shape>
<shape type="sphere"><point name="center" value="0.9, -0.9, 0"/><float name="radius" value="0.3"/></shape>
<emitter type="directional"><vector name="direction" x="0.12" y="0.2" z="1"/><float name="angular_diameter" value="0.6"/>
  <rgb name="irradiance" value="0.1"/></emitter>
<emitter type="constant"><rgb name="radiance" value="0.1"/></emitter>
</scene>"#;

/// Through a lens, or a hole.
pub fn lights(aperture: bool) -> Scene {
    let lens = r#"<float name="aperture_radius" value="0.12"/><float name="focus_distance" value="4"/>"#;
    let (sensor, lens) = if aperture { ("thinlens", lens) } else { ("perspective", "") };
    scene(&LIGHTS.replace("{sensor}", sensor).replace("{lens}", lens))
}

/// Thirty-two pictures of four passes.
pub fn of(world: &Scene, estimator: Estimator, chain_samples: u32, first: u64) -> BlockSeries {
    let series = pictures(world, 32, |r| {
        let mut options = Options::for_scene(world, estimator);
        options.settings.seed = seed() * 1000 + first + r;
        (options.settings.chain_samples, options.settings.guided) = (chain_samples, false);
        options
    });
    // Of one hit, in three channels, as one of four passes: blocks that wait for it look calm.
    BlockSeries { largest: 190.0 / 4.0, ..series }
}
