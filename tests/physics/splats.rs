//! Splats and gathered samples have the same profile across sharp edges, for every filter.

use crate::support::{scene, seed};
use nephroid::render::{Budget, Control, Estimator, Options, Picture, Render};
use nephroid::report::agreement::sidak;
use statrs::distribution::{ContinuousCDF, Normal};

fn picture(filter: &str, estimator: Estimator, passes: u64) -> Picture {
    // A bright tilted square before nothing, lit by a point: black and white without half-tones.
    let world = scene(&format!(
        r#"<scene version="3.0.0">
  <integrator type="path"><integer name="max_depth" value="2"/></integrator>
  <sensor type="perspective"><float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="20"/>
      <integer name="crop_offset_x" value="3"/><integer name="crop_offset_y" value="2"/><integer name="crop_width" value="16"/><integer name="crop_height" value="16"/>
      <rfilter type="{filter}"/></film></sensor>
  <shape type="rectangle"><transform name="to_world"><scale value="0.8"/><rotate z="1" angle="20"/></transform>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.9"/></bsdf></shape>
  <emitter type="point"><point name="position" value="0, 0, 3"/><rgb name="intensity" value="20"/></emitter>
</scene>"#
    ));
    let mut options = Options::for_scene(&world, estimator);
    options.settings.seed = seed() + estimator as u64;
    options.settings.light_paths = Some(2048);
    let mut render = Render::new(&world, &options).unwrap();
    render.run(&Budget::passes(passes), |_| Control::Continue);
    render.picture()
}

fn profiles_agree(filter: &str) {
    let normal = Normal::new(0.0, 1.0).unwrap();
    let (gather, shoot) = (picture(filter, Estimator::Gather, 2000), picture(filter, Estimator::Shoot, 1500));
    let (mut smallest, mut lit) = (1.0f64, 0);
    for i in 0..gather.mean.len() {
        let (g, s) = (f64::from(gather.mean[i][0]), f64::from(shoot.mean[i][0]));
        let v = f64::from(gather.variance[i][0]) + f64::from(shoot.variance[i][0]);
        lit += usize::from(g.abs() > 0.05);
        if v > 0.0 {
            smallest = smallest.min(2.0 * normal.cdf(-((g - s) / v.sqrt()).abs()));
        } else {
            // But for parts of a light so small that their squares are nothing.
            assert!((g - s).abs() < 1e-8, "{filter}: pixel {i} is certain on both sides, {g} and {s}");
        }
    }
    assert!(lit > 40, "{filter}: the square is not in the picture");
    let p = sidak(smallest, gather.mean.len());
    assert!(p > 1e-4, "{filter}: gathered and splatted edges differ, p = {p:.2e}");
}

macro_rules! filters {
    ($($name:ident: $filter:literal,)*) => { $(
        #[test]
        fn $name() {
            profiles_agree($filter);
        }
    )* };
}

filters! {
    box_filter: "box",
    tent_filter: "tent",
    gaussian_filter: "gaussian",
    mitchell_filter: "mitchell",
    catmullrom_filter: "catmullrom",
    lanczos_filter: "lanczos",
}

/// What a lamp of two metres sheds on a wall, by the picture's filter.
fn wall(filter: &str, crop: Option<[u32; 4]>, passes: u64) -> Picture {
    let world = scene(&format!(
        r#"<scene version="3.0.0">
  <integrator type="path"><integer name="max_depth" value="2"/></integrator>
  <sensor type="perspective"><float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="40"/><integer name="height" value="36"/><rfilter type="{filter}"/></film></sensor>
  <shape type="rectangle"><transform name="to_world"><scale value="9"/></transform></shape>
  <shape type="rectangle"><transform name="to_world"><rotate x="1" angle="180"/><translate z="6"/></transform>
    <bsdf type="diffuse"/><emitter type="area"><rgb name="radiance" value="3, 2, 1"/></emitter></shape>
</scene>"#
    ));
    let mut options = Options { crop, ..Options::for_scene(&world, Estimator::Gather) };
    (options.settings.seed, options.settings.stratified) = (seed(), false);
    let mut render = Render::new(&world, &options).unwrap();
    render.run(&Budget::passes(passes), |_| Control::Continue);
    render.picture()
}

/// A pixel takes its part of the walks of all around: for a Gaussian of half a pixel the variance is 1/π of that of its
/// own walk alone, 0.318.
#[test]
fn pixels_share_walks() {
    let noise = |filter: &str| wall(filter, None, 200).variance.iter().map(|v| f64::from(v[0])).sum::<f64>();
    let ratio = noise("gaussian") / noise("box");
    assert!((0.28..0.36).contains(&ratio), "{ratio} of the variance");
}

/// A crop window shows what the whole picture shows there, its border included.
#[test]
fn a_crop_window_is_cut_from_the_picture() {
    for filter in ["box", "gaussian", "lanczos"] {
        let (whole, cut) = (wall(filter, None, 3), wall(filter, Some([0, 5, 23, 19]), 3));
        for y in 0..19 {
            for x in 0..23 {
                assert_eq!(cut.mean[y * 23 + x], whole.mean[(y + 5) * 40 + x], "{filter}, pixel {x},{y} of the window");
            }
        }
    }
}
