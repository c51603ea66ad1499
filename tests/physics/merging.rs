//! Merges: what they find is what hits find, and what nothing else finds has a closed form.

use crate::caustic_room::noise;
use crate::support::{Effort, pictures, scene, seed, series};
use crate::{mirrors, scenes};
use nephroid::render::{Options, Render};
use nephroid::report::agreement::agreement;
use nephroid::transport::class::PathFilter;
use nephroid::transport::settings::{Settings, Techniques};

fn settings(techniques: &str, paths: &str, radius: f32, add: u64) -> Settings {
    Settings {
        techniques: Techniques::parse(techniques).unwrap(),
        paths: PathFilter::parse(paths).unwrap(),
        merge_radius: Some(radius),
        rr_depth: 3,
        seed: seed() * 1000 + 700 + add,
        ..Settings::default()
    }
}

#[test]
fn merges_find_what_hits_find() {
    let dir = tempfile::tempdir().unwrap();
    let world = scene(&scenes::named(dir.path(), "glass and mirror"));
    let effort = Effort { renders: 40, passes: 6, max_length: 6 };
    let of = |techniques, add| series(&world, &settings(techniques, "E .* S D S+ L", 0.02, add), effort);
    let (merged, hit, both) = (of("merge", 0), of("hit", 1), of("hit,merge", 2));
    let mut energy = 0.0;
    for k in 4..=effort.max_length as usize {
        for (name, other) in [("hits", &hit), ("both", &both)] {
            let v = agreement(&merged[k], &other[k]);
            energy += v.totals.0;
            assert!(v.p > 1e-5, "length {k}: merges {:.4e}, {name} {:.4e}, p = {:.1e}", v.totals.0, v.totals.1, v.p);
        }
    }
    assert!(energy > 0.0);
}

#[test]
fn merges_between_events_that_are_nearly_mirrors_count_once() {
    // There no expression tells which paths can be merged: weights alone see to it that none counts twice.
    count_once("nearly specular", 5, 3);
}

#[test]
fn merges_in_frosted_glass_count_once() {
    count_once("frosted", 7, 5);
}

/// With and without merges the same, for paths of up to so many edges.
fn count_once(name: &str, max_length: u32, add: u64) {
    let dir = tempfile::tempdir().unwrap();
    let world = scene(&scenes::named(dir.path(), name));
    let effort = Effort { renders: 40, passes: 6, max_length };
    let of = |techniques, add| series(&world, &settings(techniques, "", 0.01, add), effort);
    let (hit, all) = (of("hit,nee,splat", add), of("hit,nee,splat,merge", add + 1));
    for k in 2..=max_length as usize {
        let v = agreement(&hit[k], &all[k]);
        println!("{name}, length {k}: {:.4e} without merges, {:.4e} with, p = {:.1e}", v.totals.0, v.totals.1, v.p);
        assert!(v.p > 1e-5, "length {k}: {:.4e} without merges, {:.4e} with, p = {:.1e}", v.totals.0, v.totals.1, v.p);
    }
}

#[test]
fn only_merges_find_a_mirrored_point_light_in_a_mirror_and_they_find_it_right() {
    let found = mirrors::picture("hit,nee,splat,connect,merge");
    let (worst, tested) = mirrors::deviation(&found);
    assert!(worst < 1.0 && tested >= 8, "{worst}, {tested} blocks");
    let blind = mirrors::picture("hit,nee,splat,connect");
    assert!(blind.mean.iter().all(|p| *p == [0.0; 3]));
}

#[test]
fn radius_shrinks_as_it_must() {
    let world = scene(mirrors::SCENE);
    let options = Options { settings: settings("hit,merge", "", 0.5, 0), ..Options::default() };
    let render = Render::new(&world, &options).unwrap();
    let radius = |pass| f64::from(render.plan().merge_radius(pass));
    assert!((radius(0) - 0.5).abs() < 1e-6);
    // Bias falls with r² ~ n^(−1/3), variance with 1/(n r²) ~ n^(−2/3).
    assert!((radius(63) / radius(0) - 0.5).abs() < 1e-3 && (radius(999_999) / radius(0) - 0.1).abs() < 1e-3);
}

/// Gathering walks seldom come upon the caustic, and then merge all of it at once. Connections see it from everywhere; merges must
/// leave it to them.
#[test]
fn a_caustic_that_is_met_by_chance_is_left_to_joins_that_see_it() {
    let (without, with) = (noise("hit,nee,splat,connect"), noise("hit,nee,splat,connect,merge"));
    println!("variance with merges over that without: {:.3}", with / without);
    assert!(with < 1.6 * without, "{with} with merges, {without} without");
}

#[test]
fn merges_that_are_met_by_chance_find_in_a_smaller_radius_what_splats_find() {
    let dir = tempfile::tempdir().unwrap();
    let world = scene(&scenes::named(dir.path(), "glass and mirror"));
    let of = |techniques: &str, add| {
        let light_paths = Some(if techniques == "merge" { 60_000 } else { 3000 });
        let settings = settings(techniques, "E D D S+ L", 0.12, add);
        Options { settings: Settings { light_paths, max_length: 5, ..settings }, ..Options::default() }
    };
    let part = Render::new(&world, &of("merge", 50)).unwrap().plan().by_chance;
    assert!(part < 0.5, "the radius is smaller: {part} of the area");
    let [merged, seen] =
        [("merge", 50), ("splat", 100)].map(|(techniques, add)| pictures(&world, 40, |r| of(techniques, add + r)));
    let v = agreement(&merged, &seen);
    println!("merges {:.4e}, splats {:.4e}, p = {:.1e}", v.totals.0, v.totals.1, v.p);
    assert!(v.totals.0 > 0.0 && v.p > 1e-5, "{:?}, p = {:.1e}", v.totals, v.p);
}
