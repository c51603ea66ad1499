//! Gathering that is led to the light: the same expectation, less noise behind a door that is ajar.

use crate::scenes;
use crate::support::{Effort, pictures, scene, seed, series};
use nephroid::render::{Budget, Control, Estimator, Options, Picture, Render};
use nephroid::report::agreement::agreement;
use nephroid::scene::Scene;
use nephroid::transport::class::PathFilter;
use nephroid::transport::settings::{Settings, Techniques};

/// Two rooms with a wall between them that leaves a gap; the lamp is in the one that is not seen.
pub const AJAR: &str = r#"<scene version="3.0.0"><sensor type="perspective"><float name="fov" value="60"/>
  <transform name="to_world"><lookat origin="-1.9, 0, 0" target="0, 0, 0" up="0, 1, 0"/></transform>
  <film type="hdrfilm"><integer name="width" value="48"/><integer name="height" value="48"/><rfilter type="box"/></film></sensor>
<bsdf type="twosided" id="white"><bsdf type="diffuse"><rgb name="reflectance" value="0.6, 0.65, 0.7"/></bsdf></bsdf>
<shape type="cube"><transform name="to_world"><scale x="4" y="1" z="1"/><translate x="2"/></transform><ref id="white"/></shape>
<shape type="cube"><transform name="to_world"><scale x="0.02" y="1" z="0.92"/><translate x="0.4" z="0.08"/></transform><ref id="white"/></shape>
<shape type="rectangle"><transform name="to_world"><scale value="0.25"/><rotate y="1" angle="180"/><translate x="3" y="0.2" z="0.99"/></transform>
  <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf><emitter type="area"><rgb name="radiance" value="90, 80, 70"/></emitter></shape></scene>"#;

fn options(world: &Scene, led: bool, seed: u64) -> Options {
    let mut options = Options::for_scene(world, Estimator::Gather);
    options.settings = Settings { guided_gathering: led, seed, max_length: 6, survival: 4.0, ..options.settings };
    options
}

/// All joins together, led, against hits and next events that are not, per path length.
#[test]
fn led_walks_keep_every_expectation() {
    let dir = tempfile::tempdir().unwrap();
    let effort = Effort { renders: 40, passes: 3, max_length: 5 };
    for (i, name) in ["diffuse box", "plastics, mask and blend", "shading normals", "sun disk"].into_iter().enumerate() {
        let world = scene(&scenes::named(dir.path(), name));
        let of = |techniques: &str, guided_gathering, add: u64| {
            let techniques = Techniques::parse(techniques).unwrap();
            let seed = seed() * 1000 + 10 * i as u64 + add;
            let settings = Settings { techniques, guided_gathering, min_length: 2, rr_depth: 3, seed, ..Settings::default() };
            series(&world, &Settings { paths: PathFilter::parse("visible-to:gather").unwrap(), ..settings }, effort)
        };
        let (gathered, led, both) = (of("hit,nee", false, 0), of("hit,nee", true, 1), of("hit,nee,splat,connect", true, 2));
        for k in 2..=5 {
            for (what, series) in [("alone", &led), ("with light paths", &both)] {
                let v = agreement(&gathered[k], &series[k]);
                assert!(v.p * 32.0 > 1e-4, "{name}, {what}, length {k}: p = {:.1e}, {:?}", v.p, v.totals);
            }
        }
    }
}

fn picture(world: &Scene, led: bool) -> Picture {
    let mut render = Render::new(world, &options(world, led, seed())).unwrap();
    render.run(&Budget::passes(64), |_| Control::Continue);
    render.picture()
}

#[test]
fn led_walks_find_the_light_behind_a_door() {
    let world = scene(AJAR);
    let (plain, led) = (picture(&world, false), picture(&world, true));
    // Relative to the square of the picture, as it is known better.
    let lit = |(_, m): &(&[f32; 3], &[f32; 3])| m[1] > 0.0;
    let noise =
        |p: &Picture| p.variance.iter().zip(&led.mean).filter(lit).map(|(v, m)| f64::from(v[1] / (m[1] * m[1]))).sum::<f64>();
    let (plain, led) = (noise(&plain), noise(&led));
    println!("variance led over not led: {:.3}", led / plain);
    assert!(led < 0.75 * plain, "{led} of {plain}");
    let v = agreement(
        &pictures(&world, 24, |r| options(&world, false, seed() * 100 + r)),
        &pictures(&world, 24, |r| options(&world, true, seed() * 100 + 50 + r)),
    );
    assert!(v.p > 1e-4, "p = {:.1e}, {:?}", v.p, v.totals);
}

#[test]
fn gathering_is_led_where_that_pays() {
    let dir = tempfile::tempdir().unwrap();
    let led = |world: &Scene, settings: fn(Settings) -> Settings| {
        let mut options = Options::for_scene(world, Estimator::Auto);
        options.settings = settings(Settings { seed: seed(), ..options.settings });
        Render::new(world, &options).unwrap().plan().incident.is_some()
    };
    let ajar = scene(AJAR);
    assert!(led(&ajar, |s| s) && !led(&ajar, |s| Settings { guided: false, ..s }));
    assert!(!led(&scene(&scenes::named(dir.path(), "diffuse box")), |s| s));
}
