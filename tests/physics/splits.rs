//! Gathering walks that go both ways where they see glass: the same expectation, fewer sparks.

use crate::scenes;
use crate::support::{Effort, scene, seed, series};
use nephroid::render::{Budget, Control, Estimator, Options, Render};
use nephroid::report::agreement::{BlockSeries, agreement};
use nephroid::scene::Scene;
use nephroid::transport::settings::{NO_SPLITS, Settings, Techniques};

/// Splits, three levels deep, or chooses.
fn settings(splits: bool) -> Settings {
    Settings { rr_depth: 3, faintest_split: if splits { 1e-4 } else { NO_SPLITS }, ..Settings::default() }
}

/// Hits and next events per path length.
fn gathered(world: &Scene, splits: bool, first: u64) -> Vec<BlockSeries> {
    let effort = Effort { renders: 40, passes: 3, max_length: 6 };
    let seed = seed() * 1000 + first;
    series(world, &Settings { techniques: Techniques::GATHER, min_length: 2, seed, ..settings(splits) }, effort)
}

#[test]
fn walks_that_split_keep_every_expectation() {
    let dir = tempfile::tempdir().unwrap();
    for (i, name) in ["glass and mirror", "sun disk", "under water"].into_iter().enumerate() {
        let world = scene(&scenes::named(dir.path(), name));
        let effort = Effort { renders: 40, passes: 3, max_length: 6 };
        let [chosen, split] = [false, true].map(|splits| gathered(&world, splits, 10 * i as u64 + u64::from(splits)));
        let of = |splits, add: u64| {
            let techniques = Techniques::parse("hit,nee,splat,connect,merge").unwrap();
            let seed = seed() * 1000 + 500 + 10 * i as u64 + add;
            let settings = Settings { techniques, merge_radius: Some(0.1), guided: false, seed, ..settings(splits) };
            series(&world, &Settings { min_length: 2, ..settings }, effort)
        };
        let [all, all_split] = [of(false, 0), of(true, 1)];
        for k in 2..=6 {
            for (what, a, b) in [("alone", &chosen, &split), ("with all joins", &all, &all_split)] {
                let v = agreement(&a[k], &b[k]);
                assert!(v.p * 30.0 > 1e-4, "{name}, {what}, length {k}: p = {:.1e}, {:?}", v.p, v.totals);
            }
        }
    }
}

/// A lit room seen in a pane: half of what is left to chance is which way a walk goes.
#[test]
fn walks_that_split_see_what_glass_mirrors_with_less_noise() {
    let xml = r#"<scene version="3.0.0"><sensor type="perspective"><float name="fov" value="40"/>
      <transform name="to_world"><lookat origin="0, 0, 3" target="0, 0, 0" up="0, 1, 0"/></transform>
      <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="24"/><rfilter type="box"/></film></sensor>
    <shape type="cube"><transform name="to_world"><scale x="3" y="3" z="0.1"/></transform><bsdf type="dielectric"/></shape>
    <shape type="rectangle"><transform name="to_world"><scale value="9"/><translate z="-2"/></transform>
      <bsdf type="diffuse"><rgb name="reflectance" value="0.02"/></bsdf></shape>
    <shape type="rectangle"><transform name="to_world"><scale value="9"/><rotate y="1" angle="180"/><translate z="4"/></transform>
      <bsdf type="diffuse"><rgb name="reflectance" value="0.9"/></bsdf></shape>
    <emitter type="point"><point name="position" value="0, 2, 3.5"/><rgb name="intensity" value="9"/></emitter></scene>"#;
    let world = scene(xml);
    let noise = |splits: bool| {
        let mut options = Options::for_scene(&world, Estimator::Gather);
        options.settings = Settings { seed: seed(), max_length: 6, ..settings(splits) };
        options.settings.techniques = Techniques::GATHER;
        options.settings.stratified = false;
        let mut render = Render::new(&world, &options).unwrap();
        render.run(&Budget::passes(64), |_| Control::Continue);
        render.picture().variance.iter().map(|v| f64::from(v[1])).sum::<f64>()
    };
    let (chosen, split) = (noise(false), noise(true));
    println!("variance of split walks over that of walks that choose: {:.4}", split / chosen);
    assert!(split < 0.6 * chosen, "{split} of {chosen}");
}
