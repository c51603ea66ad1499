//! The command `explain`: what is found sums to the pixel, weights are those of the walks.

use crate::scenes;
use crate::support::{scene, seed};
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
        let found = explain(&world, &options, pixel, Effort { samples: 64, paths: 12 }).unwrap();
        let mean = |m: [f32; 3]| m.iter().map(|v| f64::from(*v)).sum::<f64>() / 3.0;
        // The same random numbers as the measurement's: the same sum, up to the rounding of its film.
        let (sum, pixel) = (found.shares.iter().map(|s| s.value).sum::<f64>(), mean(found.bidirectional.mean));
        assert!(pixel > 0.0 && (sum / pixel - 1.0).abs() < 1e-4, "{name}: {sum} of {pixel}");
        assert_eq!(found.paths.len(), 12, "{name}");
        assert!(found.paths.is_sorted_by(|a, b| a.share >= b.share));
        for p in &found.paths {
            let all: f64 = p.joins.iter().map(|j| j.weight).sum();
            assert!((all - 1.0).abs() < 1e-6, "{name}: weights sum to {all}: {p:?}");
            let own = p.joins.iter().find(|j| j.by == p.by).unwrap_or_else(|| panic!("{name}: {p:?}"));
            assert!((own.weight - f64::from(p.weight)).abs() < 2e-3, "{name}: {} not {}: {p:?}", own.weight, p.weight);
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
