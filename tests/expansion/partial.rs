//! Part of the coupling or none: local illumination and recursive ray tracing against closed forms, against
//! gathering on the same paths, and against what they leave out.

use crate::support::{ROOM, rendered, scene, tiles_agree};
use glam::Vec2;
use nephroid::film::Film;
use nephroid::math::Random;
use nephroid::math::random::Family;
use nephroid::render::{Control, Estimator, Options, left_out};
use nephroid::scene::Scene;
use nephroid::transport::class::PathFilter;
use nephroid::transport::recursive::recursive;
use nephroid::transport::settings::Plan;
use nephroid::transport::walk::{Context, Tally};
use nephroid::transport::{Contribution, RayCounts, Record};

/// What arrives at one point of the film.
struct Total(f32);
impl Record for Total {
    fn gathered(&mut self, c: Contribution) {
        self.0 += c.value.to_rgb()[1];
    }
    fn splatted(&mut self, _: Vec2, _: &mut Random, _: Contribution) {}
}

/// Radiance at the centre of a pixel by `estimator`.
fn at(world: &Scene, estimator: Estimator, x: u32, y: u32) -> f64 {
    let options = Options::for_scene(world, estimator);
    let plan = Plan::new(&options.settings, 1, 1, 0.0);
    let (mut total, mut rays) = (Total(0.0), RayCounts::default());
    let mut tally = Tally { record: &mut total, rays: &mut rays, observe: &mut () };
    let mut random = Random::new(Family::Gather, u64::from(y * 1000 + x), 0, 0);
    let cx = Context::new(world, &plan, 0);
    recursive(
        cx,
        Vec2::new(x as f32 + 0.5, y as f32 + 0.5),
        1.0,
        estimator != Estimator::LocalUnshadowed,
        &mut random,
        &mut tally,
    );
    f64::from(total.0)
}

/// A unit sphere of albedo 0.5 at the origin seen from +z, 4 away, under `lights`.
fn ball(lights: &str) -> Scene {
    scene(&format!(
        r#"<scene version="3.0.0">
  <sensor type="orthographic">
    <transform name="to_world"><scale value="1.2"/><lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="24"/><rfilter type="box"/></film></sensor>
  <shape type="sphere"><bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf></shape>{lights}</scene>"#
    ))
}

/// Centre of a pixel of [`ball`] on the sphere, a little inside its rim.
fn on_ball(x: u32, y: u32) -> Option<[f64; 3]> {
    let along = |i: u32| 1.2 * ((f64::from(i) + 0.5) / 12.0 - 1.0);
    // The film's x grows to the right, which is +x for a sensor that looks along −z.
    let (px, py) = (along(x), -along(y));
    let z2 = 1.0 - px * px - py * py;
    (z2 > 0.02).then(|| [px, py, z2.sqrt()])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn every_pixel(world: &Scene, estimator: Estimator, exact: impl Fn([f64; 3]) -> f64, bound: f64) {
    let mut tested = 0;
    for (x, y) in (0..24).flat_map(|y| (0..24).map(move |x| (x, y))) {
        let Some(p) = on_ball(x, y) else { continue };
        let (is, should) = (at(world, estimator, x, y), exact(p));
        assert!((is - should).abs() < bound * should.max(0.1), "{estimator:?}, pixel {x}, {y}: {is} instead of {should}");
        tested += 1;
    }
    assert!(tested > 250, "{tested}");
}

const ALL: [Estimator; 3] = [Estimator::Local, Estimator::LocalUnshadowed, Estimator::Recursive];
const RHO_OVER_PI: f64 = 0.5 * std::f64::consts::FRAC_1_PI;

/// L = E f cosθ, without noise.
#[test]
fn a6_directional_light() {
    let world = ball(
        r#"<emitter type="directional"><vector name="direction" value="-1, -2, -2"/><rgb name="irradiance" value="3"/></emitter>"#,
    );
    for estimator in ALL {
        every_pixel(&world, estimator, |n| 3.0 * RHO_OVER_PI * dot(n, [1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0]).max(0.0), 1e-5);
    }
}

/// L = (I/r²) f cosθ, without noise; a quarter at twice the distance.
#[test]
fn a6_positional_light() {
    let light = |p: [f64; 3]| {
        let [x, y, z] = p;
        ball(&format!(
            r#"<emitter type="point"><point name="position" value="{x}, {y}, {z}"/><rgb name="intensity" value="20"/></emitter>"#
        ))
    };
    let exact = |light: [f64; 3]| {
        move |n: [f64; 3]| {
            let d = [light[0] - n[0], light[1] - n[1], light[2] - n[2]];
            20.0 * RHO_OVER_PI * dot(n, d).max(0.0) / dot(d, d).powf(1.5)
        }
    };
    for estimator in ALL {
        every_pixel(&light([2.0, 3.0, 2.0]), estimator, exact([2.0, 3.0, 2.0]), 1e-5);
    }
    // Seen from the pole, lights above it at distances 2 and 4.
    let (near, far) = (light([0.0, 0.0, 3.0]), light([0.0, 0.0, 5.0]));
    let pole = |world: &Scene| {
        [(11, 11), (12, 12), (11, 12), (12, 11)].iter().map(|(x, y)| at(world, Estimator::Local, *x, *y)).sum::<f64>()
    };
    let ratio = pole(&near) / pole(&far);
    assert!((ratio - 4.0).abs() < 0.02, "{ratio}");
}

/// L = L_a k_a at every point, whatever is in the way; nothing to estimators that solve the equations.
#[test]
fn a6_ambient_light() {
    let world = ball(
        r#"<emitter type="ambient"><rgb name="radiance" value="0.4"/></emitter><shape type="cube"><transform name="to_world"><scale value="8"/></transform><bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf></shape>"#,
    );
    for estimator in ALL {
        every_pixel(&world, estimator, |_| 0.4 * 0.5, 1e-5);
    }
    let full = rendered(&world, &Options::for_scene(&world, Estimator::Bidirectional), 1);
    assert!(full.film().mean().iter().all(|p| p[0] == 0.0));
}

/// L = L_sky a on a convex Lambert body: one sample of the sky has noise, all together have that mean.
#[test]
fn a6_sky() {
    let world = ball(r#"<emitter type="constant"><rgb name="radiance" value="0.8"/></emitter>"#);
    let render = rendered(&world, &Options::for_scene(&world, Estimator::Local), 256);
    let (mean, variance) = (render.film().mean(), render.film().variance_of_mean());
    let (mut worst, mut tested) = (0.0f64, 0);
    for (x, y) in (0..24u32).flat_map(|y| (0..24).map(move |x| (x, y))) {
        // Pixels with nothing but the sphere in them.
        if on_ball(x, y).is_some_and(|p| p[2] > 0.45) {
            let i = (y * 24 + x) as usize;
            worst = worst.max((f64::from(mean[i][0]) - 0.4).abs() / f64::from(variance[i][0]).sqrt());
            tested += 1;
        }
    }
    assert!(tested > 200 && worst < 4.5, "{tested} pixels, the worst is {worst} standard errors off");
}

/// Local illumination is the first two terms of gathering.
#[test]
fn a5_local_is_two_terms_of_gathering() {
    let world = scene(ROOM);
    let local = rendered(&world, &Options::for_scene(&world, Estimator::Local), 64);
    let mut options = Options::for_scene(&world, Estimator::Gather);
    options.settings.max_length = 2;
    options.settings.seed = 1;
    let gather = rendered(&world, &options, 256);
    tiles_agree(local.film(), gather.film(), 0.1, "two terms");
}

/// Without visibility no pixel is darker, sample by sample, and on one convex body none is brighter.
#[test]
fn a5_shadows_only_darken() {
    let both = |world: &Scene| {
        [Estimator::Local, Estimator::LocalUnshadowed].map(|e| rendered(world, &Options::for_scene(world, e), 16).film().mean())
    };
    let [with, without] = both(&scene(ROOM));
    assert!(with.iter().flatten().zip(without.iter().flatten()).all(|(a, b)| a <= b));
    assert!(with.iter().flatten().zip(without.iter().flatten()).any(|(a, b)| 1.01 * a < *b), "nothing has a shadow");
    let [with, without] =
        both(&ball(r#"<emitter type="point"><point name="position" value="2, 3, 2"/></emitter><emitter type="constant"/>"#));
    assert!(with == without);
}

fn of_class(world: &Scene, class: &str, max_length: u32, passes: u64) -> Film {
    let mut options = Options::for_scene(world, Estimator::Gather);
    options.settings.paths = PathFilter::parse(class).unwrap();
    options.settings.max_length = max_length;
    options.settings.seed = 1;
    rendered(world, &options, passes).into_film()
}

/// Recursive ray tracing is gathering of the paths E S* D? L, with branches followed or, far from the eye, chosen.
#[test]
fn a7_recursive_is_its_class_of_paths() {
    let world = scene(ROOM);
    for max_length in [3, 12] {
        let mut options = Options::for_scene(&world, Estimator::Recursive);
        options.settings.max_length = max_length;
        let recursive = rendered(&world, &options, 64);
        tiles_agree(recursive.film(), &of_class(&world, "E S* D? L", max_length, 512), 0.1, "its class");
    }
}

/// A closed box of mirrors of reflectance r that emit Lᵉ: Lᵉ Σ r^k over the depth, in every pixel and without noise.
#[test]
fn a7_box_of_mirrors() {
    let world = scene(
        r#"<scene version="3.0.0">
  <sensor type="perspective"><float name="fov" value="70"/>
    <transform name="to_world"><lookat origin="0.1, 0.2, 0.9" target="0, 0, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="12"/><integer name="height" value="12"/><rfilter type="box"/></film></sensor>
  <shape type="cube"><boolean name="flip_normals" value="true"/>
    <bsdf type="conductor"><string name="material" value="none"/><rgb name="specular_reflectance" value="0.8"/></bsdf>
    <emitter type="area"><rgb name="radiance" value="0.5"/></emitter></shape>
</scene>"#,
    );
    for edges in [1, 2, 5, 11] {
        let mut options = Options::for_scene(&world, Estimator::Recursive);
        options.settings.max_length = edges;
        let exact = 0.5 * (1.0 - 0.8f32.powi(edges as i32)) / 0.2;
        for p in rendered(&world, &options, 2).film().mean() {
            assert!((p[0] - exact).abs() < 1e-5 * exact, "{edges} edges: {} instead of {exact}", p[0]);
        }
    }
}

/// What is followed and what is left out are the full solution, over independent renders.
#[test]
fn a7_what_is_left_out_is_all_the_rest() {
    const RENDERS: u64 = 16;
    let limit = r#"<integrator type="path"><integer name="max_depth" value="8"/></integrator><sensor"#;
    let world = scene(&ROOM.replace("<sensor", limit));
    let mean = |p: &[[f32; 3]]| p.iter().flatten().map(|v| f64::from(*v)).sum::<f64>() / (3 * p.len()) as f64;
    for (estimator, max_length) in [(Estimator::Local, 2), (Estimator::Recursive, 4)] {
        let (mut differences, mut shares) = (Vec::new(), Vec::new());
        for seed in 0..RENDERS {
            let mut options = Options::for_scene(&world, estimator);
            options.settings.max_length = max_length;
            options.settings.seed = seed;
            let part = mean(&rendered(&world, &options, 16).picture().mean);
            let rest = mean(&left_out(&world, &options, 16, |_| Control::Continue).unwrap().mean);
            let mut full = Options::for_scene(&world, Estimator::Bidirectional);
            full.settings.seed = seed + 1000;
            let full = mean(&rendered(&world, &full, 32).picture().mean);
            differences.push((part + rest) / full - 1.0);
            shares.push(rest / full);
        }
        let n = RENDERS as f64;
        let average = differences.iter().sum::<f64>() / n;
        let se = (differences.iter().map(|d| (d - average).powi(2)).sum::<f64>() / (n * (n - 1.0))).sqrt();
        assert!(se < 0.01, "{estimator:?} to {max_length}: ± {se} is too noisy to tell");
        assert!(average.abs() < 4.0 * se, "{estimator:?} to {max_length}: {average} ± {se} is missing");
        assert!(shares.iter().all(|s| *s > 0.1), "{estimator:?} to {max_length}: too little is left out");
    }
}
