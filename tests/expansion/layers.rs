//! Terms of the Neumann series as layers of one render.

use crate::support::{ESTIMATORS, ROOM, rendered, scene, sphere, sums, sums_of};
use nephroid::render::{Estimator, Options, Partition};
use nephroid::scene::Scene;

fn options(world: &Scene, estimator: Estimator, last: u32) -> Options {
    let mut options = Options::for_scene(world, estimator);
    options.layers = vec![Partition::Scatterings { last, rest: true }];
    options
}

/// Σ τⁿLᵉ: the films of the terms sum to the film of the image, integer by integer, and asking for them does not
/// change the image.
#[test]
fn a10_layers_sum_to_the_image_bit_for_bit() {
    let world = scene(ROOM);
    for estimator in ESTIMATORS {
        let render = rendered(&world, &options(&world, estimator, 4), 6);
        let films = &render.layers()[0].films;
        assert_eq!(films.len(), 5);
        assert!(films.iter().all(|f| sums(f).iter().any(|s| !s.is_zero())), "{estimator:?}: a term is empty");
        assert!(sums_of(films) == sums(render.film()), "{estimator:?}: terms do not sum to the image");
        let plain = rendered(&world, &Options::for_scene(&world, estimator), 6);
        assert!(plain.film() == render.film(), "{estimator:?}: layers changed the image");
        // In files each number is rounded once more.
        let ulp = |v: f32| f64::from(v.next_up()) - f64::from(v);
        let means: Vec<_> = films.iter().map(|f| f.mean()).collect();
        for (i, whole) in render.film().mean().into_iter().enumerate() {
            for c in 0..3 {
                let sum: f64 = means.iter().map(|m| f64::from(m[i][c])).sum();
                let bound: f64 = ulp(whole[c]) + means.iter().map(|m| ulp(m[i][c])).sum::<f64>();
                assert!((sum - f64::from(whole[c])).abs() <= bound, "{estimator:?}, pixel {i}: {sum} instead of {whole:?}");
            }
        }
    }
}

/// Gathering draws the same numbers whatever lengths count: a term is the image of its paths alone.
#[test]
fn a10_a_layer_is_the_image_of_its_length() {
    let world = scene(ROOM);
    let render = rendered(&world, &options(&world, Estimator::Gather, 9), 4);
    for n in 0..4u32 {
        let mut alone = Options::for_scene(&world, Estimator::Gather);
        (alone.settings.min_length, alone.settings.max_length) = (n + 1, n + 1);
        let alone = rendered(&world, &alone, 4);
        assert!(sums(alone.film()) == sums(&render.layers()[0].films[n as usize]), "n = {n}");
    }
}

/// x = 0.1 x + 1.8 as a scene: every path of n scatterings returns the same number, so that hits alone have no
/// variance: terms 1.8 · 0.1ⁿ, and 2 (1 − 0.1^(D+1)) with D scatterings.
#[test]
fn a8_toy_scene_term_by_term() {
    let world = scene(
        r#"<scene version="3.0.0">
  <sensor type="perspective"><float name="fov" value="80"/>
    <transform name="to_world"><lookat origin="0.3, 0.2, 0.5" target="-0.2, 0, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/><rfilter type="box"/></film></sensor>
  <shape type="cube"><boolean name="flip_normals" value="true"/>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.1"/></bsdf>
    <emitter type="area"><rgb name="radiance" value="1.8"/></emitter></shape>
</scene>"#,
    );
    for d in 0..6u32 {
        let mut options = options(&world, Estimator::Gather, d);
        options.settings.techniques.next_event = false;
        options.settings.rr_depth = 1000;
        options.settings.max_length = d + 1;
        let render = rendered(&world, &options, 4);
        let exact = 2.0 * (1.0 - 0.1f64.powi(d as i32 + 1));
        for m in render.film().mean() {
            assert!((f64::from(m[0]) - exact).abs() < 1e-6, "{d} scatterings: {} instead of {exact}", m[0]);
        }
        for (n, film) in render.layers()[0].films.iter().enumerate() {
            let exact = 1.8 * 0.1f64.powi(n as i32);
            assert!(film.mean().iter().all(|m| (f64::from(m[0]) - exact).abs() < 1e-6), "term {n} of {d}");
        }
    }
}

/// A sphere seen from inside, albedo a, that emits any pattern: after the first scattering every term is the
/// same everywhere, aⁿ · avg(Lᵉ).
#[test]
fn a17_layers_of_a_sphere_with_any_emission() {
    let albedo = 0.6;
    let (world, average) = sphere(albedo);
    for estimator in ESTIMATORS {
        let mut options = options(&world, estimator, 6);
        options.settings.max_length = 7;
        options.settings.rr_depth = 20;
        let render = rendered(&world, &options, if estimator == Estimator::Gather { 64 } else { 512 });
        for (n, film) in render.layers()[0].films.iter().enumerate().skip(1) {
            let exact = f64::powi(albedo, n as i32) * average;
            let (mean, variance) = (film.mean(), film.variance_of_tile_mean());
            for corner in [0, 16, 32 * 16, 32 * 16 + 16] {
                let pixels = (0..256).map(|i| f64::from(mean[corner + i / 16 * 32 + i % 16][0]));
                let (block, se) = (pixels.sum::<f64>() / 256.0, f64::from(variance[corner][0]).sqrt());
                assert!(se < 0.05 * exact, "{estimator:?}, n = {n}: {se} is too noisy to tell");
                assert!((block - exact).abs() < 4.0 * se, "{estimator:?}, n = {n}: {block} ± {se} instead of {exact}");
            }
        }
    }
}
