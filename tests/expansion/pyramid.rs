//! The pyramid of techniques: every join of every length, weighted and raw.

use crate::support::{ESTIMATORS, ROOM, rendered, scene, sphere, sums, sums_of, tiles_agree};
use nephroid::render::layers::Joins;
use nephroid::render::{Options, Partition};
use nephroid::report::pyramid::{rows, table};
use nephroid::transport::Technique;

/// Weighted images sum to the render, those of a row to its term, integer by integer.
#[test]
fn pyramid_sums_to_the_render_bit_for_bit() {
    let world = scene(ROOM);
    for estimator in ESTIMATORS {
        let mut options = Options::for_scene(&world, estimator);
        let joins = Joins::new(options.settings.techniques, 4, options.settings.max_length);
        options.layers = vec![Partition::Scatterings { last: 4, rest: true }, Partition::Joins(joins.clone())];
        let render = rendered(&world, &options, 4);
        let [terms, pyramid] = render.layers() else { panic!("two partitions") };
        let weighted = || joins.list().iter().zip(pyramid.films.iter().step_by(2));
        assert!(sums_of(weighted().map(|(_, f)| f)) == sums(render.film()), "{estimator:?}");
        for (n, term) in terms.films.iter().enumerate() {
            let row = weighted().filter(|(j, _)| j.length as usize == n + 1).map(|(_, f)| f);
            assert!(sums_of(row) == sums(term), "{estimator:?}, n = {n}");
        }
        assert!(weighted().all(|(j, f)| j.length < 3 || sums(f).iter().any(|s| !s.is_zero())), "{estimator:?}: a join is empty");
        let entries = table(pyramid, render.film());
        let energy: f64 = entries.iter().map(|e| e.share_of_energy).sum();
        let error: f64 = entries.iter().map(|e| e.share_of_error).sum();
        assert!((energy - 1.0).abs() < 1e-5 && (error - 1.0).abs() < 1e-9, "{estimator:?}: {energy}, {error}");
        let shown: usize = rows(pyramid, &entries, false, 0.0).iter().map(Vec::len).sum();
        assert_eq!(shown, entries.len());
    }
}

/// Without the weights every join estimates the whole term by itself, where it sees all of its paths.
#[test]
fn raw_images_of_a_row_show_the_same_light() {
    // Seen from inside a sphere no two points of a wall are whose joins have no finite variance.
    let (world, _) = sphere(0.6);
    let mut options = Options::for_scene(&world, nephroid::render::Estimator::Bidirectional);
    options.settings.rr_depth = 20;
    options.settings.max_length = 4;
    let joins = Joins::new(options.settings.techniques, 4, 4);
    options.layers = vec![Partition::Scatterings { last: 3, rest: false }, Partition::Joins(joins.clone())];
    let render = rendered(&world, &options, 256);
    let [terms, pyramid] = render.layers() else { panic!("two partitions") };
    let mut tested = 0;
    for (join, films) in joins.list().iter().zip(pyramid.films.chunks_exact(2)).filter(|(j, _)| j.length > 2) {
        tiles_agree(&films[1], &terms.films[join.length as usize - 1], 0.1, &join.name());
        tested += 1;
    }
    assert_eq!(tested, 4 + 5);
    assert!(joins.list().iter().any(|j| j.technique == Technique::Connect));
}
