//! B3: light is linear in its sources.

use crate::support::{ESTIMATORS, ROOM, rendered, scene, sums, sums_of, tiles_agree};
use nephroid::render::layers::LightGroups;
use nephroid::render::{Estimator, Options, Partition};

/// One layer for each light, and they sum to the render.
#[test]
fn b3_lights_sum_to_the_render_bit_for_bit() {
    let world = scene(ROOM);
    for estimator in ESTIMATORS {
        let mut options = Options::for_scene(&world, estimator);
        let groups = LightGroups::each(world.lights.infos()).unwrap();
        assert_eq!(groups.names(), ["panel", "bulb"]);
        options.layers = vec![Partition::Lights(groups)];
        let render = rendered(&world, &options, 4);
        let films = &render.layers()[0].films;
        assert!(sums_of(films) == sums(render.film()), "{estimator:?}");
        assert!(films.iter().all(|f| sums(f).iter().any(|s| !s.is_zero())), "{estimator:?}: a light is dark");
    }
}

/// render(α Lᵉ₁ + β Lᵉ₂) = α render(Lᵉ₁) + β render(Lᵉ₂): with the same numbers drawn, sample by sample.
#[test]
fn b3_linearity_with_the_same_seeds() {
    let (alpha, beta) = (3.0f32, 0.25f32);
    let scaled = ROOM.replace("6, 5, 4", "18, 15, 12").replace("0.2, 0.3, 0.6", "0.05, 0.075, 0.15");
    let (one, other) = (scene(ROOM), scene(&scaled));
    let mut options = Options::for_scene(&one, Estimator::Gather);
    options.layers = vec![Partition::Lights(LightGroups::each(one.lights.infos()).unwrap())];
    let layers = rendered(&one, &options, 8);
    let whole = rendered(&other, &Options::for_scene(&other, Estimator::Gather), 8);
    let [panel, bulb] = [0, 1].map(|i| layers.layers()[0].films[i].mean());
    for (i, mean) in whole.film().mean().into_iter().enumerate() {
        for c in 0..3 {
            let sum = alpha * panel[i][c] + beta * bulb[i][c];
            assert!((sum - mean[c]).abs() <= 2e-6 * sum.abs(), "pixel {i}: {sum} instead of {}", mean[c]);
        }
    }
}

/// A layer is what its light does alone.
#[test]
fn b3_a_light_alone() {
    let at = ROOM.find("  <emitter type=\"point\"").unwrap();
    let (both, alone) = (scene(ROOM), scene(&format!("{}</scene>", &ROOM[..at])));
    for estimator in [Estimator::Shoot, Estimator::Bidirectional] {
        let mut options = Options::for_scene(&both, estimator);
        options.settings.max_length = 4;
        options.layers = vec![Partition::Lights(LightGroups::parse("lamp=pan*", both.lights.infos()).unwrap())];
        let layers = rendered(&both, &options, 64);
        options.layers.clear();
        options.settings.seed = 1;
        let single = rendered(&alone, &options, 64);
        tiles_agree(&layers.layers()[0].films[0], single.film(), 0.1, estimator.name());
    }
}

#[test]
fn groups_by_name() {
    let world = scene(ROOM);
    let infos = world.lights.infos();
    assert_eq!(LightGroups::parse("a=panel; b=bulb", infos).unwrap().names(), ["a", "b"]);
    assert_eq!(LightGroups::parse("all=*", infos).unwrap().names(), ["all"]);
    assert_eq!(LightGroups::parse("x y=bu*", infos).unwrap().names(), ["x_y", "other"]);
    let fault = LightGroups::parse("a=lamp", infos).unwrap_err();
    assert!(fault.contains("`lamp`") && fault.contains("panel, bulb"), "{fault}");
    assert!(LightGroups::parse("panel", infos).is_err() && LightGroups::parse("", infos).is_err());
}
