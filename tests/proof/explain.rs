//! The command `explain`: what is found sums to the pixel, weights are those of the walks.

use crate::support::{scene, seed};
use crate::{mirrors, scenes};
use nephroid::proof::explain::{Effort, explain};
use nephroid::render::{Estimator, Options, RenderError};

#[test]
fn paths_sum_to_the_pixel_with_the_weights_of_the_walks() {
    let dir = tempfile::tempdir().unwrap();
    for (name, pixel) in
        [("glass and mirror", (30, 38)), ("diffuse box", (20, 10)), ("point light", (24, 40)), ("image sky", (40, 40))]
    {
        let world = scene(&scenes::named(dir.path(), name));
        let mut options = Options::for_scene(&world, Estimator::Bidirectional);
        options.settings.seed = seed();
        options.settings.max_length = 6;
        options.settings.light_paths = Some(256);
        options.settings.merge_radius = Some(0.02);
        let found = explain(&world, &options, pixel, Effort { samples: 64, paths: 12 }).unwrap();
        let mean = |m: [f32; 3]| m.iter().map(|v| f64::from(*v)).sum::<f64>() / 3.0;
        // The same random numbers as the measurement's: the same sum, up to the rounding of its film.
        let (sum, pixel) = (found.shares.iter().map(|s| s.value).sum::<f64>(), mean(found.merging.mean));
        assert!(pixel > 0.0 && (sum / pixel - 1.0).abs() < 1e-4, "{name}: {sum} of {pixel}");
        assert_eq!(found.paths.len(), 12, "{name}");
        assert!(found.paths.is_sorted_by(|a, b| a.share >= b.share));
        for p in &found.paths {
            let all: f64 = p.joins.iter().map(|j| j.weight).sum();
            assert!((all - 1.0).abs() < 1e-6, "{name}: weights sum to {all}: {p:?}");
            let own = p.joins.iter().find(|j| j.by == p.by).unwrap_or_else(|| panic!("{name}: {p:?}"));
            // The walks that are merged know the densities at two points, not at one.
            let near = if p.by.technique == "merge" { 1e-2 } else { 2e-3 };
            assert!((own.weight - f64::from(p.weight)).abs() < near, "{name}: {} not {}: {p:?}", own.weight, p.weight);
            assert!(own.density > 0.0 && p.vertices.len() + 2 == p.class.split(' ').count(), "{name}: {p:?}");
        }
    }
}

#[test]
fn a_pixel_outside_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let world = scene(&scenes::named(dir.path(), "diffuse box"));
    let options = Options::for_scene(&world, Estimator::Bidirectional);
    let refused = explain(&world, &options, (48, 0), Effort { samples: 2, paths: 1 }).unwrap_err();
    assert_eq!(refused, RenderError::Pixel(48, 0, 48, 48));
}

#[test]
fn what_only_merges_find_is_explained() {
    let world = scene(mirrors::SCENE);
    let mut options = Options::for_scene(&world, Estimator::Bidirectional);
    options.settings.seed = seed();
    options.settings.max_length = 4;
    options.settings.light_paths = Some(16_384);
    let found = explain(&world, &options, (16, 16), Effort { samples: 16, paths: 64 }).unwrap();
    let of = |class: &str, by: &str| {
        let shares = found.shares.iter().filter(|s| s.class == class && s.by.technique == by);
        shares.map(|s| s.share).sum::<f64>()
    };
    assert!(of("E S D L", "nee") > 0.1 && of("E S D S L", "merge") > 0.1, "{:?}", found.shares);
    assert!(found.merging.mean[1] > 1.1 * found.bidirectional.mean[1], "{found:?}");
    let merged = found.paths.iter().find(|p| p.by.technique == "merge").expect("a strong path");
    assert_eq!((merged.class.as_str(), merged.by.light_vertices), ("E S D S L", 3));
    let others = merged.joins.iter().filter(|j| j.by != merged.by);
    assert!(others.map(|j| j.weight).sum::<f64>() == 0.0, "{merged:?}");
}
