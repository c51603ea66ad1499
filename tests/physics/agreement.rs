//! Every join alone agrees with every other, per path length and block, on the paths both can make.

use crate::scenes;
use crate::support::{Effort, scene, seed, series};
use nephroid::report::agreement::{Agreement, agreement};
use nephroid::scene::Scene;
use nephroid::transport::class::PathFilter;
use nephroid::transport::mis::Heuristic;
use nephroid::transport::settings::{Settings, Techniques};

/// A false alarm somewhere in a test has at most this probability.
const ALPHA: f64 = 1e-4;
const EFFORT: Effort = Effort { renders: 40, passes: 3, max_length: 5 };

/// A join, and the class of paths (k ≥ 2) that it can make.
const JOINS: [(&str, &str); 4] = [("hit", "E .+ L"), ("nee", "E .* D L"), ("splat", "E D .* L"), ("connect", "E .* D D .* L")];

fn settings(techniques: &str, paths: &str, seed: u64) -> Settings {
    Settings {
        techniques: Techniques::parse(techniques).unwrap(),
        paths: PathFilter::parse(paths).unwrap(),
        min_length: 2,
        // Roulette early, so that its factor is tested as well.
        rr_depth: 3,
        connections: 2,
        seed,
        ..Settings::default()
    }
}

/// The paths that two joins can both make, as one expression.
fn common(a: &str, b: &str) -> &'static str {
    match (a, b) {
        ("hit", "nee") => "E .* D L",
        ("hit", "splat") => "E D .* L",
        ("hit", "connect") => "E .* D D .* L",
        ("nee", "splat") => "E (D | D .* D) L",
        ("nee", "connect") => "E .* D (D | D .* D) L",
        ("splat", "connect") => "E (D | D .* D) D .* L",
        _ => unreachable!("pairs are listed in order"),
    }
}

fn lights_can_be_hit(xml: &str) -> bool {
    !["\"point\"", "\"spot\""].iter().any(|l| xml.contains(&format!("emitter type={l}")))
        && (!xml.contains("type=\"directional\"") || xml.contains("angular_diameter"))
}

fn check(name: &str, what: &str, length: usize, v: &Agreement, failures: &mut Vec<String>, tests: f64) {
    // A class without light has nothing to test.
    if v.totals == (0.0, 0.0) {
        return;
    }
    if v.p * tests < ALPHA || v.energy_tested < 0.5 {
        failures.push(format!(
            "{name}: {what}, length {length}: p = {:.2e}, totals {:.5} and {:.5}, {:.0} % of the energy tested",
            v.p,
            v.totals.0,
            v.totals.1,
            100.0 * v.energy_tested
        ));
    }
}

fn joins_agree(name: &str) {
    let dir = tempfile::tempdir().unwrap();
    let xml = scenes::named(dir.path(), name);
    let world: Scene = scene(&xml);
    let mut failures = Vec::new();
    let names: Vec<&str> = JOINS.iter().map(|j| j.0).filter(|j| *j != "hit" || lights_can_be_hit(&xml)).collect();
    let mut draw = 0;
    for (i, a) in names.iter().enumerate() {
        for b in &names[i + 1..] {
            let paths = common(a, b);
            let mut one = |t: &str| {
                draw += 1;
                series(&world, &settings(t, paths, seed() * 1000 + draw), EFFORT)
            };
            let (sa, sb) = (one(a), one(b));
            for k in 2..=EFFORT.max_length as usize {
                check(name, &format!("{a} against {b} on {paths}"), k, &agreement(&sa[k], &sb[k]), &mut failures, 24.0);
            }
        }
    }
    assert!(failures.is_empty(), "\n{}", failures.join("\n"));
}

/// All joins together agree with hits and next events on what gathering can see.
fn combination_agrees(name: &str, heuristic: Heuristic) {
    let dir = tempfile::tempdir().unwrap();
    let world = scene(&scenes::named(dir.path(), name));
    let mut failures = Vec::new();
    let of = |t: &str, paths: &str, heuristic, add: u64| {
        let s = Settings { heuristic, ..settings(t, paths, seed() * 1000 + 500 + add) };
        series(&world, &s, EFFORT)
    };
    for (i, (alone, walker)) in [("hit,nee", "visible-to:gather"), ("splat", "visible-to:shoot")].into_iter().enumerate() {
        let (a, b) =
            (of(alone, walker, heuristic, 2 * i as u64), of("hit,nee,splat,connect", walker, heuristic, 2 * i as u64 + 1));
        for k in 2..=EFFORT.max_length as usize {
            check(name, &format!("{alone} against all"), k, &agreement(&a[k], &b[k]), &mut failures, 8.0);
        }
    }
    assert!(failures.is_empty(), "\n{}", failures.join("\n"));
}

macro_rules! scenes_agree {
    ($($test:ident: $name:literal,)*) => { $(
        mod $test {
            #[test]
            fn joins() {
                super::joins_agree($name);
            }
            #[test]
            fn combination() {
                super::combination_agrees($name, super::Heuristic::Balance);
            }
        }
    )* };
}

scenes_agree! {
    diffuse_box: "diffuse box",
    glass_and_mirror: "glass and mirror",
    rough_glass: "rough glass and metal",
    plastics: "plastics, mask and blend",
    shading_normals: "shading normals",
    point_light: "point light",
    spot_light: "spot light",
    directional_light: "directional light",
    sun_disk: "sun disk",
    constant_sky: "constant sky",
    image_sky: "image sky",
    thin_lens: "thin lens",
    crop_window: "crop window",
    under_water: "under water",
    orthographic: "orthographic",
}

#[test]
fn power_heuristic_agrees() {
    combination_agrees("glass and mirror", Heuristic::Power);
    combination_agrees("sun disk", Heuristic::Power);
}

#[test]
fn roulette_does_not_matter() {
    let dir = tempfile::tempdir().unwrap();
    let world = scene(&scenes::named(dir.path(), "diffuse box"));
    let mut failures = Vec::new();
    for (i, techniques) in ["hit,nee", "splat"].into_iter().enumerate() {
        let of = |rr_depth, seed| {
            let s = Settings { rr_depth, ..settings(techniques, "", seed) };
            series(&world, &s, EFFORT)
        };
        let seeds = seed() * 1000 + 900 + 2 * i as u64;
        let (with, without) = (of(2, seeds), of(1000, seeds + 1));
        for k in 2..=EFFORT.max_length as usize {
            check(techniques, "with roulette against without", k, &agreement(&with[k], &without[k]), &mut failures, 8.0);
        }
    }
    assert!(failures.is_empty(), "\n{}", failures.join("\n"));
}
