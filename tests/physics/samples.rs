//! Pixels that have several gathering walks in a pass: the same expectation, less error for the same walks.

use crate::scenes;
use crate::support::{scene, seed};
use crate::uneven::{checkered, drawn};
use nephroid::film::Film;
use nephroid::render::{Budget, Control, Estimator, Options, Picture, Render};
use nephroid::report::agreement::agreement;
use nephroid::scene::Scene;
use nephroid::transport::settings::{Settings, Techniques};
use std::sync::Arc;

#[test]
fn more_walks_keep_every_expectation() {
    let dir = tempfile::tempdir().unwrap();
    let (even, uneven) = (Arc::default(), checkered());
    // Splats, and filters narrow and wide, which share walks across the borders of cells.
    let wide = scenes::named(dir.path(), "diffuse box").replace(r#"<rfilter type="box"/>"#, r#"<rfilter type="gaussian"/>"#);
    assert!(wide.contains("gaussian"));
    let boxes = [scenes::named(dir.path(), "diffuse box"), wide, scenes::named(dir.path(), "glass and mirror")];
    for (i, xml) in boxes.iter().enumerate() {
        let world = scene(xml);
        let joins = if i == 2 { "hit,nee,splat,connect,merge" } else { "hit,nee,splat,connect" };
        for (j, techniques) in ["hit,nee", "splat,hit", joins].into_iter().enumerate() {
            let first = 300 * i as u64 + 100 * j as u64;
            let v = agreement(&drawn(&world, techniques, &even, first), &drawn(&world, techniques, &uneven, first + 50));
            assert!(v.p * 9.0 > 1e-4, "scene {i}, {techniques}: p = {:.1e}, {:?}", v.p, v.totals);
        }
    }
}

/// A floor, most of it before a lamp; a strip on the right lies behind a wall, lit by what a higher wall reflects.
const A_STRIP_IN_THE_DARK: &str = r#"<scene version="3.0.0"><sensor type="orthographic">
  <transform name="to_world"><scale value="2"/><lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/></transform>
  <film type="hdrfilm"><integer name="width" value="80"/><integer name="height" value="72"/><rfilter type="box"/></film></sensor>
<bsdf type="twosided" id="grey"><bsdf type="diffuse"/></bsdf>
<shape type="rectangle"><transform name="to_world"><scale value="3"/></transform><ref id="grey"/></shape>
<shape type="rectangle"><transform name="to_world"><rotate y="1" angle="90"/><scale y="3" z="0.25"/><translate x="1.2" z="0.25"/></transform>
  <ref id="grey"/></shape>
<shape type="rectangle"><transform name="to_world"><rotate y="1" angle="90"/><scale y="3" z="1.5"/><translate x="2.05" z="1.5"/></transform>
  <ref id="grey"/></shape>
<shape type="sphere"><point name="center" x="-6" y="0" z="3"/><float name="radius" value="0.3"/>
  <emitter type="area"><rgb name="radiance" value="900, 900, 900"/></emitter></shape></scene>"#;

fn options(world: &Scene, adaptive: bool) -> Options {
    let mut options = Options::for_scene(world, Estimator::Auto);
    let (techniques, seed) = (Techniques::GATHER, seed());
    options.settings = Settings { techniques, adaptive, seed, stratified: false, max_length: 5, ..options.settings };
    options
}

#[test]
fn walks_go_where_they_vary() {
    let world = scene(A_STRIP_IN_THE_DARK);
    let rendered = |adaptive: bool| {
        let mut render = Render::new(&world, &options(&world, adaptive)).unwrap();
        assert_eq!(render.plan().settings.samples.is_even(), !adaptive);
        render.run(&Budget::passes(if adaptive { 24 } else { 48 }), |_| Control::Continue);
        (render.picture(), render.statistics().rays.total() as f64)
    };
    let ((even, even_rays), (adaptive, rays)) = (rendered(false), rendered(true));
    let mean = even.mean.iter().map(|m| f64::from(m[1])).sum::<f64>() / even.mean.len() as f64;
    let noise = |p: &Picture| {
        let of = |(v, m): (&[f32; 3], &[f32; 3])| f64::from(v[1]) / (f64::from(m[1]).powi(2) + 0.01 * mean * mean);
        p.variance.iter().zip(&even.mean).map(of).sum::<f64>()
    };
    let ratio = noise(&adaptive) * rays / (noise(&even) * even_rays);
    println!("noise times rays, adaptive over even: {ratio:.3}");
    assert!(ratio < 0.9, "{ratio}");
}

#[test]
fn threads_leave_no_trace_of_a_survey() {
    let world = scene(A_STRIP_IN_THE_DARK);
    let film = |threads: usize| -> Film {
        let mut render = Render::new(&world, &Options { threads: Some(threads), ..options(&world, true) }).unwrap();
        render.run_passes(0..2);
        render.into_film()
    };
    assert!(film(1) == film(3));
}
