//! Same scene, seed and passes: the same bits, for any number of threads and any division of work.

use crate::scenes;
use crate::support::scene;
use nephroid::film::Film;
use nephroid::render::{Estimator, Options, Render};
use nephroid::scene::Scene;
use std::ops::Range;

fn film(world: &Scene, estimator: Estimator, threads: usize, passes: impl IntoIterator<Item = Range<u64>>) -> Film {
    let mut options = Options::for_scene(world, estimator);
    options.threads = Some(threads);
    let mut render = Render::new(world, &options).unwrap();
    for p in passes {
        render.run_passes(p);
    }
    render.into_film()
}

#[test]
fn threads_leave_no_trace() {
    let dir = tempfile::tempdir().unwrap();
    let world = scene(&scenes::named(dir.path(), "glass and mirror"));
    for estimator in [Estimator::Gather, Estimator::Shoot, Estimator::Bidirectional] {
        let one = film(&world, estimator, 1, std::iter::once(0..3));
        for threads in [2, 3, 7] {
            assert!(
                film(&world, estimator, threads, std::iter::once(0..3)) == one,
                "{estimator:?} with {threads} threads differs"
            );
        }
    }
}

#[test]
fn shards_merge_and_renders_resume_bit_for_bit() {
    let dir = tempfile::tempdir().unwrap();
    let world = scene(&scenes::named(dir.path(), "glass and mirror"));
    let whole = film(&world, Estimator::Bidirectional, 2, std::iter::once(0..6));
    let mut a = film(&world, Estimator::Bidirectional, 2, [4..6, 0..1]);
    let b = film(&world, Estimator::Bidirectional, 1, std::iter::once(1..4));
    assert!(a != whole);
    a.merge(&b).unwrap();
    assert!(a == whole);
    assert!(a.merge(&b).is_err(), "passes must not count twice");
    let other = film(&scene(&scenes::named(dir.path(), "diffuse box")), Estimator::Bidirectional, 1, std::iter::once(9..10));
    assert!(a.merge(&other).is_err(), "another scene is another render");
}
