//! Planted mistakes: each must be caught by the physics test that is named beside it.
//! Run with `cargo test --features mutants --test mutants`. A binary of its own, because a mistake
//! is planted for the whole process.
#![cfg(feature = "mutants")]

#[path = "physics/caustic_room.rs"]
mod caustic_room;
#[path = "physics/lights.rs"]
mod lights;
#[path = "physics/mirrors.rs"]
mod mirrors;
#[path = "physics/scenes.rs"]
#[allow(dead_code)]
mod scenes;
#[path = "physics/support.rs"]
#[allow(dead_code)]
mod support;
#[path = "physics/uneven.rs"]
mod uneven;

use nephroid::proof::adjoint::{ALPHA, Effort as Draws, adjoint};
use nephroid::proof::residual;
use nephroid::render::{Estimator, Options};
use nephroid::report::agreement::agreement;
use nephroid::transport::class::PathFilter;
use nephroid::transport::mutant::{Mutant, plant};
use nephroid::transport::settings::{FAINT, NO_BRANCHES, NO_SPLITS, Settings, Techniques};
use std::sync::Arc;
use support::{Effort, pictures, scene, seed, series};

/// A mistake is planted for the whole process.
static ONE_AT_A_TIME: std::sync::Mutex<()> = std::sync::Mutex::new(());

/// A comparison of two estimates of the same thing.
struct Check {
    mutant: Mutant,
    /// The test of the physics suite that makes the same comparison.
    named: &'static str,
    scene: &'static str,
    paths: &'static str,
    a: (&'static str, u32),
    b: (&'static str, u32),
    /// Gathering of the second is led to the light.
    led: bool,
}

const CHECKS: [Check; 9] = [
    Check {
        mutant: Mutant::AdjointShadingNormal,
        named: "agreement::shading_normals::joins",
        scene: "shading normals",
        paths: "E (D | D .* D) L",
        a: ("nee", 3),
        b: ("splat", 3),
        led: false,
    },
    Check {
        mutant: Mutant::RefractionEtaSquared,
        named: "agreement::under_water::joins",
        scene: "under water",
        paths: "E D .* L",
        a: ("hit", 3),
        b: ("splat", 3),
        led: false,
    },
    Check {
        mutant: Mutant::SplatCropNormalisation,
        named: "agreement::crop_window::joins",
        scene: "crop window",
        paths: "E (D | D .* D) L",
        a: ("nee", 3),
        b: ("splat", 3),
        led: false,
    },
    Check {
        mutant: Mutant::NextEventDensity,
        named: "agreement::diffuse_box::joins",
        scene: "diffuse box",
        paths: "E .* D L",
        a: ("hit", 3),
        b: ("nee", 3),
        led: false,
    },
    Check {
        mutant: Mutant::RouletteFactor,
        named: "agreement::roulette_does_not_matter",
        scene: "diffuse box",
        paths: "E .* D L",
        a: ("nee", 2),
        b: ("nee", 100),
        led: false,
    },
    Check {
        mutant: Mutant::AreaCosine,
        named: "agreement::diffuse_box::combination",
        scene: "diffuse box",
        paths: "visible-to:gather",
        a: ("nee", 3),
        b: ("hit,nee,splat,connect", 3),
        led: false,
    },
    Check {
        mutant: Mutant::FewLights,
        named: "agreement::few_lamps::joins",
        scene: "few lamps",
        paths: "E .* D L",
        a: ("hit", 3),
        b: ("nee", 3),
        led: false,
    },
    Check {
        mutant: Mutant::MergeWeight,
        named: "merging::merges_find_what_hits_find",
        scene: "glass and mirror",
        paths: "E .* S D S+ L",
        a: ("hit", 3),
        b: ("hit,merge", 3),
        led: false,
    },
    Check {
        mutant: Mutant::LearnedDensity,
        named: "led::led_walks_keep_every_expectation",
        scene: "diffuse box",
        paths: "visible-to:gather",
        a: ("nee", 3),
        b: ("hit,nee,splat,connect", 3),
        led: true,
    },
];

/// Smallest corrected p over path lengths 2 … 5.
fn p_of(check: &Check) -> f64 {
    let dir = tempfile::tempdir().unwrap();
    let world = scene(&scenes::named(dir.path(), check.scene));
    let effort = Effort { renders: 64, passes: 10, max_length: 5 };
    let run = |(techniques, rr_depth): (&str, u32), guided_gathering, seed: u64| {
        let settings = Settings {
            techniques: Techniques::parse(techniques).unwrap(),
            paths: PathFilter::parse(check.paths).unwrap(),
            min_length: 2,
            rr_depth,
            connections: 2,
            merge_radius: Some(0.02),
            guided_gathering,
            seed,
            ..Settings::default()
        };
        series(&world, &settings, effort)
    };
    let (a, b) = (run(check.a, false, seed() * 77 + 1), run(check.b, check.led, seed() * 77 + 2));
    (2..=5).map(|k| agreement(&a[k], &b[k]).p).fold(1.0, f64::min)
}

#[test]
fn planted_mistakes_are_caught() {
    let _alone = ONE_AT_A_TIME.lock().unwrap();
    for check in &CHECKS {
        plant(None);
        let sound = p_of(check);
        plant(Some(check.mutant));
        let mistaken = p_of(check);
        plant(None);
        println!("{:?}: p = {sound:.2e} without, {mistaken:.2e} with the mistake ({})", check.mutant, check.named);
        assert!(sound > 1e-5, "{:?}: the sound estimators disagree, p = {sound:.2e}", check.mutant);
        assert!(mistaken < 1e-5, "{:?}: {} does not notice, p = {mistaken:.2e}", check.mutant, check.named);
    }
}

/// `merging::only_merges_find_a_mirrored_point_light_in_a_mirror_and_they_find_it_right` notices a mistake in a merge.
#[test]
fn planted_mistakes_spoil_merges() {
    let _alone = ONE_AT_A_TIME.lock().unwrap();
    let [sound, mistaken] = [None, Some(Mutant::MergeCosine)].map(|m| {
        plant(m);
        let (worst, tested) = mirrors::deviation(&mirrors::picture("merge"));
        plant(None);
        assert!(tested >= 8, "{tested} blocks");
        worst
    });
    println!("MergeCosine: {sound:.2} without, {mistaken:.2} with the mistake");
    assert!(sound < 1.0 && mistaken > 1.0, "{sound} {mistaken}");
}

/// `chains::branches_find_what_walks_find` notices light that is found twice.
#[test]
fn planted_mistakes_double_chains() {
    let _alone = ONE_AT_A_TIME.lock().unwrap();
    let dir = tempfile::tempdir().unwrap();
    let world = scene(&scenes::named(dir.path(), "glass and mirror"));
    let chains = |branching, seed| {
        let techniques = Techniques::parse("hit").unwrap();
        let paths = PathFilter::parse("E S+ L").unwrap();
        let settings =
            Settings { techniques, paths, faint: if branching { FAINT } else { NO_BRANCHES }, seed, ..Settings::default() };
        series(&world, &settings, Effort { renders: 64, passes: 10, max_length: 5 })
    };
    let by_chance = chains(false, seed() * 77 + 1);
    let [sound, mistaken] = [None, Some(Mutant::ChainTwice)].map(|m| {
        plant(m);
        let branched = chains(true, seed() * 77 + 2);
        plant(None);
        (2..=5).map(|k| agreement(&by_chance[k], &branched[k]).p).fold(1.0, f64::min)
    });
    println!("ChainTwice: p = {sound:.2e} without, {mistaken:.2e} with the mistake");
    assert!(sound > 1e-5 && mistaken < 1e-5, "{sound} {mistaken}");
}

/// `chains::more_samples_of_chains_find_the_same_with_less_noise` notices samples that are not shared.
#[test]
fn planted_mistakes_multiply_chains() {
    let _alone = ONE_AT_A_TIME.lock().unwrap();
    let dir = tempfile::tempdir().unwrap();
    let world = scene(&scenes::named(dir.path(), "glass and mirror"));
    let of = |chain_samples: u32, first: u64| {
        let settings = Settings { techniques: Techniques::GATHER, guided: false, chain_samples, ..Settings::default() };
        pictures(&world, 40, |r| Options {
            settings: Settings { seed: seed() * 1000 + first + r, ..settings.clone() },
            ..Options::default()
        })
    };
    let one = of(1, 0);
    let [sound, mistaken] = [None, Some(Mutant::ChainPart)].map(|m| {
        plant(m);
        let many = of(4, 100);
        plant(None);
        agreement(&one, &many).p
    });
    println!("ChainPart: p = {sound:.2e} without, {mistaken:.2e} with the mistake");
    assert!(sound > 1e-5 && mistaken < 1e-5, "{sound} {mistaken}");
}

/// `splits::walks_that_split_keep_every_expectation` notices ways that count in full.
#[test]
fn planted_mistakes_split_in_full() {
    let _alone = ONE_AT_A_TIME.lock().unwrap();
    let dir = tempfile::tempdir().unwrap();
    let world = scene(&scenes::named(dir.path(), "glass and mirror"));
    let gathered = |faintest_split: f32, first: u64| {
        let (techniques, seed) = (Techniques::GATHER, seed() * 1000 + first);
        let settings = Settings { techniques, min_length: 2, rr_depth: 3, faintest_split, seed, ..Settings::default() };
        series(&world, &settings, Effort { renders: 40, passes: 3, max_length: 6 })
    };
    let chosen = gathered(NO_SPLITS, 0);
    let [sound, mistaken] = [None, Some(Mutant::SplitInFull)].map(|m| {
        plant(m);
        let split = gathered(1e-4, 50);
        plant(None);
        (2..=6).map(|k| agreement(&chosen[k], &split[k]).p).fold(1.0, f64::min)
    });
    println!("SplitInFull: p = {sound:.2e} without, {mistaken:.2e} with the mistake");
    assert!(sound > 1e-5 && mistaken < 1e-5, "{sound} {mistaken}");
}

/// `merging::a_caustic_that_is_met_by_chance_is_left_to_joins_that_see_it` notices merges that count in full.
#[test]
fn planted_mistakes_bring_noise_where_light_crowds() {
    let _alone = ONE_AT_A_TIME.lock().unwrap();
    let without = caustic_room::noise("hit,nee,splat,connect");
    let [sound, mistaken] = [None, Some(Mutant::Crowd)].map(|m| {
        plant(m);
        let with = caustic_room::noise("hit,nee,splat,connect,merge");
        plant(None);
        with / without
    });
    println!("Crowd: variance {sound:.2} without, {mistaken:.2} with the mistake");
    assert!(sound < 1.6 && mistaken > 1.6, "{sound} {mistaken}");
}

/// `lamps::lamps_are_divided_between_hits_and_splats` notices one that both find.
#[test]
fn planted_mistakes_double_lamps() {
    let _alone = ONE_AT_A_TIME.lock().unwrap();
    let world = lights::lights(true);
    let hits = lights::of(&world, Estimator::Gather, 1, 0);
    let [sound, mistaken] = [None, Some(Mutant::LampTwice)].map(|m| {
        plant(m);
        let both = lights::of(&world, Estimator::Bidirectional, 1, 200);
        plant(None);
        agreement(&hits, &both).p
    });
    println!("LampTwice: p = {sound:.2e} without, {mistaken:.2e} with the mistake");
    assert!(sound > 1e-5 && mistaken < 1e-5, "{sound} {mistaken}");
}

/// `samples::more_walks_keep_every_expectation` notices walks that do not know how many they are.
#[test]
fn planted_mistakes_weigh_walks_of_a_pixel_as_one() {
    let _alone = ONE_AT_A_TIME.lock().unwrap();
    let dir = tempfile::tempdir().unwrap();
    let world = scene(&scenes::named(dir.path(), "diffuse box"));
    let even = uneven::drawn(&world, "splat,hit", &Arc::default(), 0);
    let [sound, mistaken] = [None, Some(Mutant::SampleMap)].map(|m| {
        plant(m);
        let uneven = uneven::drawn(&world, "splat,hit", &uneven::checkered(), 50);
        plant(None);
        agreement(&even, &uneven).p
    });
    println!("SampleMap: p = {sound:.2e} without, {mistaken:.2e} with the mistake");
    assert!(sound > 1e-5 && mistaken < 1e-5, "{sound} {mistaken}");
}

/// The command `adjoint` notices a mistake in either walker.
#[test]
fn planted_mistakes_part_the_walkers() {
    let _alone = ONE_AT_A_TIME.lock().unwrap();
    let dir = tempfile::tempdir().unwrap();
    for (mutant, name, passes) in [
        (Mutant::AdjointShadingNormal, "shading normals", 6),
        (Mutant::RefractionEtaSquared, "under water", 6),
        (Mutant::SplatCropNormalisation, "crop window", 2),
        (Mutant::NextEventDensity, "diffuse box", 2),
        (Mutant::RouletteFactor, "diffuse box", 24),
        (Mutant::AreaCosine, "diffuse box", 2),
    ] {
        let mut world = scene(&scenes::named(dir.path(), name));
        let max_length = Some(if mutant == Mutant::RouletteFactor { 9 } else { 5 });
        let draws = Draws { passes: Some(passes), seed: seed(), max_length, ..Draws::default() };
        let [sound, mistaken] = [None, Some(mutant)].map(|m| {
            plant(m);
            let found = adjoint(&mut world, &draws).unwrap();
            plant(None);
            found
        });
        println!("{mutant:?}: p = {:.2e} without, {:.2e} with the mistake", sound.p, mistaken.p);
        assert!(sound.agree && sound.p >= ALPHA, "{mutant:?}:\n{}", sound.to_text(true, false));
        assert!(!mistaken.agree, "{mutant:?}:\n{}", mistaken.to_text(true, false));
    }
}

/// The command `residual` notices a mistake in either walker without a second walker. (A wrong number of light paths is
/// left to `adjoint`: it scales one side until nothing on it can be tested.)
#[test]
fn planted_mistakes_leave_a_residual() {
    let _alone = ONE_AT_A_TIME.lock().unwrap();
    let dir = tempfile::tempdir().unwrap();
    for (mutant, name, walks) in [
        (Mutant::AdjointShadingNormal, "shading normals", 32),
        (Mutant::RefractionEtaSquared, "under water", 32),
        (Mutant::NextEventDensity, "diffuse box", 16),
        (Mutant::RouletteFactor, "diffuse box", 16),
        (Mutant::AreaCosine, "diffuse box", 128),
    ] {
        let world = scene(&scenes::named(dir.path(), name));
        let effort = residual::Effort { walks: Some(walks), seed: seed(), max_length: Some(6), ..Default::default() };
        let [sound, mistaken] = [None, Some(mutant)].map(|m| {
            plant(m);
            let found = residual::residuals(&world, &effort);
            plant(None);
            found
        });
        println!("{mutant:?}: p = {:.2e} without, {:.2e} with the mistake", sound.p, mistaken.p);
        assert!(sound.zero, "{mutant:?}:\n{}", sound.to_text(false));
        assert!(!mistaken.zero, "{mutant:?}:\n{}", mistaken.to_text(false));
    }
}
