//! MIS weights: the recursion against the definition, on random numbers and on the walks' own paths.

use crate::scenes;
use crate::support::{scene, seed, with_lessons};
use glam::{Vec2, Vec3};
use nephroid::local::Breadth;
use nephroid::math::Random;
use nephroid::math::random::Family;
use nephroid::transport::cache::LightCache;
use nephroid::transport::crowd::Crowds;
use nephroid::transport::gather::gather;
use nephroid::transport::mis::{Eta, Heuristic};
use nephroid::transport::reference::{Densities, Testimony, Witness, weights, weights_by_recursion};
use nephroid::transport::settings::{Plan, Settings, Techniques};
use nephroid::transport::shoot::shoot;
use nephroid::transport::walk::{Context, Tally};
use nephroid::transport::{RayCounts, Technique};
use std::sync::Arc;

/// Random densities of a random path, as a brute-force oracle for the algebra.
fn random_path(random: &mut Random) -> (Densities, Plan) {
    let k = 2 + random.below(11) as usize;
    let mut density = || (f64::from(random.unit()) * 8.0 - 4.0).exp();
    let mut g: Vec<f64> = (0..=k).map(|_| density()).collect();
    let s: Vec<f64> = (0..=k).map(|_| density()).collect();
    let nu = density();
    let delta: Vec<bool> = (0..=k).map(|i| i > 0 && i < k && random.unit() < 0.35).collect();
    let mut breadth = || match random.unit() {
        u if u < 0.1 => Breadth::Sharp,
        u if u < 0.3 => Breadth::Focused,
        u if u < 0.5 => Breadth::Narrow,
        _ => Breadth::Wide,
    };
    let breadth = (0..=k)
        .map(|i| match i {
            _ if delta[i] => Breadth::Sharp,
            _ if i == 0 || i == k => Breadth::Wide,
            _ => breadth(),
        })
        .collect();
    let crowd = (0..=k).map(|_| f64::from(random.unit() * 10.0 - 4.0).exp()).collect();
    if random.unit() < 0.3 {
        g[k] = 0.0;
    }
    let techniques = Techniques {
        hit: random.unit() < 0.8,
        next_event: random.unit() < 0.8,
        splat: random.unit() < 0.8,
        connect: random.unit() < 0.8,
        merge: random.unit() < 0.8,
    };
    let heuristic = if random.unit() < 0.5 { Heuristic::Balance } else { Heuristic::Power };
    let connections = random.below(5);
    let merge_radius = Some((random.unit() * 4.0 - 4.0).exp());
    let settings = Settings { techniques, heuristic, connections, merge_radius, ..Settings::default() };
    let vertices = 0.5 + 3.0 * f64::from(random.unit());
    (Densities { g, s, nu, delta, breadth, crowd }, Plan::new(&settings, 1 + random.below(10_000), 10_000, vertices))
}

#[test]
fn recursion_is_the_definition_for_100_000_random_paths() {
    let mut random = Random::new(Family::Other, 7, 0, seed());
    let mut tested = 0;
    while tested < 100_000 {
        let (d, plan) = random_path(&mut random);
        let clear = f64::from(plan.light_paths) * std::f64::consts::PI * f64::from(plan.merge_radius(0)).powi(2);
        let eta = Eta { clear, by_chance: clear * f64::from(random.unit()) };
        let defined = weights(&d, &plan, eta);
        let total: f64 = defined.iter().map(|w| w.1).sum();
        if total == 0.0 {
            continue;
        }
        let recursive = weights_by_recursion(&d, &plan, eta);
        assert_eq!(defined.len(), recursive.len());
        for ((key, a), (other, b)) in defined.iter().zip(&recursive) {
            assert_eq!(key, other);
            assert!((a - b).abs() < 1e-9, "{key:?}: {a} against {b} for {d:?}");
        }
        let sum: f64 = recursive.iter().map(|w| w.1).sum();
        assert!((sum - 1.0).abs() < 1e-9, "weights sum to {sum}");
        tested += 1;
    }
}

/// All joins that a few walks through a scene made, with their whole paths.
fn testimonies(xml: &str, settings: &Settings, wanted: usize) -> (nephroid::scene::Scene, Plan, Vec<Testimony>) {
    testimonies_of_passes(xml, settings, wanted, 64)
}

/// The same from passes of so many walks of either kind.
fn testimonies_of_passes(
    xml: &str,
    settings: &Settings,
    wanted: usize,
    walks: u32,
) -> (nephroid::scene::Scene, Plan, Vec<Testimony>) {
    let world = scene(xml);
    let film = world.film.clone();
    let plan = with_lessons(&world, settings, Plan::new(settings, walks, film.width * film.height, 2.0));
    // Some places are crowded, as if a pilot had been there.
    let mut shot = Vec::new();
    for i in 0..256 {
        let mut tally = Tally { record: &mut (), rays: &mut RayCounts::default(), observe: &mut () };
        shoot(Context::new(&world, &plan, 0), Some(&mut shot), &mut Random::new(Family::Other, i, 0, seed()), &mut tally);
    }
    let points: Vec<Vec3> = shot.iter().map(|v| v.surface.p).collect();
    let plan = Plan { by_chance: 0.4, crowds: Arc::new(Crowds::new(points.into_iter(), 0.1, 0.05)), ..plan };
    // One pass for all, so that one η belongs to all weights.
    let cx = Context::new(&world, &plan, 0);
    let (mut witness, mut rays) = (Witness::default(), RayCounts::default());
    let crop = film.crop.unwrap_or([0, 0, film.width, film.height]);
    for pass in 0.. {
        witness.next_pass();
        let mut tally = Tally { record: &mut (), rays: &mut rays, observe: &mut witness };
        let mut vertices = Vec::new();
        tally.observe.expect_shooting(true);
        for i in 0..walks.into() {
            let mut random = Random::new(Family::Shoot, i, pass, seed());
            shoot(cx, Some(&mut vertices), &mut random, &mut tally);
        }
        let cache = LightCache::new(vec![vertices], plan.merge_radius(0));
        tally.observe.expect_shooting(false);
        for i in 0..walks.into() {
            let mut random = Random::new(Family::Gather, i, pass, seed());
            let at = Vec2::new(crop[0] as f32, crop[1] as f32);
            let raster = at + random.unit2() * Vec2::new(crop[2] as f32, crop[3] as f32);
            gather(cx, raster, 1.0, &cache, &mut random, &mut tally);
        }
        if witness.seen.len() >= wanted || pass > 4000 {
            break;
        }
    }
    (world, plan, witness.seen)
}

/// Rays start off their surfaces by so many times the rounding of the point.
const OFFSET: f32 = 32.0;

/// How far the defined weight of a path moves when its vertices move as far as rays start off them: directions taken
/// from positions are no better known than that, which matters on short or grazing edges, beside small lamps, and
/// where a learned density steps.
fn conditioning(cx: Context<'_>, t: &Testimony, w: f64) -> f64 {
    let mut random = Random::new(Family::Other, 8, 0, seed());
    let mut moved = |p: Vec3, error: f32| {
        let mut off = || 2.0 * random.unit() - 1.0;
        p + Vec3::new(off(), off(), off()) * (OFFSET * error)
    };
    let deviation = |_| {
        let mut path = t.path.clone();
        for v in &mut path.vertices {
            v.surface.p = moved(v.surface.p, v.surface.p_error);
        }
        path.light.y = moved(path.light.y, path.light.y_error);
        let weights = path.weights(cx);
        weights.iter().find(|w| w.0 == t.key).map_or(0.0, |other| (other.1 - w).abs())
    };
    (0..32).map(deviation).fold(0.0, f64::max)
}

/// What is wrong with the weights of walks: those that are more than 1e-3 from their definition, and further than
/// rounding explains.
fn differing(world: &nephroid::scene::Scene, plan: &Plan, seen: &[Testimony]) -> Vec<String> {
    let mut bad = Vec::new();
    for t in seen {
        let all = t.path.weights(Context::new(world, plan, 0));
        let sum: f64 = all.iter().map(|w| w.1).sum();
        assert!((sum - 1.0).abs() < 1e-9, "weights sum to {sum}");
        let Some((_, w)) = all.iter().find(|w| w.0 == t.key) else {
            bad.push(format!("{:?} is no join of its path {all:?}", t.key));
            continue;
        };
        assert!(t.weight.is_finite());
        let tolerance = 1e-3 * w.max(1e-6);
        let error = (f64::from(t.weight) - w).abs();
        if *w > 1e-6 && error > tolerance && error > 2.0 * conditioning(Context::new(world, plan, 0), t, *w) {
            bad.push(format!("{:?} k = {}: {} instead of {w}; all {all:?}", t.key, t.path.vertices.len() + 1, t.weight));
        }
    }
    bad
}

/// At most one weight in `rare` may differ by more than 1e-3.
fn walks_use_the_defined_weights(settings: &Settings, per_scene: usize, rare: usize) -> usize {
    let dir = tempfile::tempdir().unwrap();
    let mut tested = 0;
    for s in scenes::all(dir.path()) {
        let (world, plan, seen) = testimonies(&s.xml, settings, per_scene);
        let bad = differing(&world, &plan, &seen);
        tested += seen.len();
        // The reference takes directions from f32 positions, which lose digits on short or grazing edges.
        assert!(
            bad.len() * rare <= seen.len(),
            "{}: {} of {} weights differ, e.g.\n{}",
            s.name,
            bad.len(),
            seen.len(),
            bad[..bad.len().min(5)].join("\n")
        );
    }
    tested
}

#[test]
fn walks_use_the_defined_weights_on_100_000_paths_of_real_scenes() {
    let settings = Settings { heuristic: Heuristic::Balance, connections: 2, max_length: 8, ..Settings::default() };
    assert!(walks_use_the_defined_weights(&settings, 8000, 2000) >= 100_000);
}

#[test]
fn walks_use_the_defined_weights_with_the_power_heuristic_and_without_some_joins() {
    for techniques in ["hit,nee,splat", "nee,splat,connect", "hit,splat", "nee,connect", "hit,connect"] {
        let settings = Settings {
            techniques: Techniques::parse(techniques).unwrap(),
            heuristic: Heuristic::Power,
            max_length: 7,
            guided: false,
            ..Settings::default()
        };
        walks_use_the_defined_weights(&settings, 1000, 200);
    }
}

/// The shooting walker and the reference know how a gathering walker goes that is led to the light.
#[test]
fn walks_use_the_defined_weights_where_gathering_is_led() {
    let settings = Settings { heuristic: Heuristic::Balance, guided_gathering: true, max_length: 7, ..Settings::default() };
    walks_use_the_defined_weights(&settings, 1500, 150);
}

/// A connection between nearly specular vertices shares its path with a merge at either end.
#[test]
fn connections_know_the_merges_at_their_ends() {
    let dir = tempfile::tempdir().unwrap();
    let settings = Settings {
        techniques: Techniques::parse("connect,merge").unwrap(),
        merge_radius: Some(0.2),
        max_length: 6,
        guided: false,
        ..Settings::default()
    };
    let (world, plan, mut seen) = testimonies(&scenes::named(dir.path(), "nearly specular"), &settings, 40_000);
    let merged = |t: &Testimony| t.path.weights(Context::new(&world, &plan, 0)).iter().any(|w| w.0.0 == Technique::Merge);
    seen.retain(|t| t.key.0 == Technique::Connect && merged(t));
    let bad = differing(&world, &plan, &seen);
    assert!(seen.len() > 100, "{} connections", seen.len());
    assert!(bad.len() * 50 <= seen.len(), "{} of {}: {}", bad.len(), seen.len(), bad[..bad.len().min(5)].join("\n"));
}

/// A room of polished metal: all events of all paths are focused, and a path can be merged at each of its vertices but the first and
/// those at the lamp.
const POLISHED: &str = r#"<scene version="3.0.0"><sensor type="perspective"><float name="fov" value="70"/>
  <transform name="to_world"><lookat origin="0.1, 0.05, 0.9" target="0, 0.1, 0" up="0, 1, 0"/></transform>
  <film type="hdrfilm"><integer name="width" value="48"/><integer name="height" value="48"/><rfilter type="box"/></film></sensor>
<shape type="cube"><boolean name="flip_normals" value="true"/>
  <bsdf type="roughconductor"><string name="material" value="none"/><float name="alpha" value="0.08"/></bsdf></shape>
<shape type="rectangle"><transform name="to_world"><scale value="0.5"/><rotate x="1" angle="90"/><translate y="0.97"/></transform>
  <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf><emitter type="area"><rgb name="radiance" value="9, 8, 6"/></emitter></shape>
</scene>"#;

/// Where a path could be merged nearer to the eye is part of the weight of a merge, more so where all is focused up to there. The radius
/// makes weights uncertain by a part of a lobe's width; what is forgotten is far more.
#[test]
fn merges_know_the_merges_nearer_to_the_eye() {
    let techniques = Techniques::parse("merge").unwrap();
    let settings = Settings { techniques, merge_radius: Some(3e-3), max_length: 6, guided: false, ..Settings::default() };
    let (world, plan, seen) = testimonies_of_passes(POLISHED, &settings, 8000, 4096);
    let (mut tested, mut far) = (0, vec![]);
    for t in seen {
        let all = t.path.weights(Context::new(&world, &plan, 0));
        let defined = all.iter().find(|w| w.0 == t.key).map_or(0.0, |w| w.1);
        if all.iter().filter(|w| w.1 > 0.05).count() > 1 {
            tested += 1;
            far.extend(
                ((f64::from(t.weight) - defined).abs() > 0.05).then(|| format!("{} instead of {defined} of {all:?}", t.weight)),
            );
        }
    }
    println!("{} of {tested} far off", far.len());
    assert!(tested > 100 && far.len() * 4 <= tested, "{} of {tested}: {}", far.len(), far[..far.len().min(5)].join("\n"));
}

/// The two vertices of a merge are some distance apart, so the walks know densities at one of them and
/// the reference takes both from the other: equal to the order of radius over distance.
#[test]
fn walks_use_the_defined_weights_with_merges() {
    for heuristic in [Heuristic::Balance, Heuristic::Power] {
        let settings =
            Settings { techniques: Techniques::ALL, heuristic, merge_radius: Some(1e-2), max_length: 8, ..Settings::default() };
        walks_use_the_defined_weights(&settings, 3000, 200);
    }
}
