//! Chains of Dirac events between eye and light: all branches are followed, and none counts twice.

use crate::scenes;
use crate::support::{Effort, pictures, scene, seed, series};
use nephroid::render::{Budget, Control, Options, Render};
use nephroid::report::agreement::{BlockSeries, agreement};
use nephroid::scene::Scene;
use nephroid::transport::class::PathFilter;
use nephroid::transport::settings::{FAINT, NO_BRANCHES, Settings, Techniques};

/// A lamp of radiance 1 behind a plate of index 4.
const PLATE: &str = r#"<scene version="3.0.0">
<sensor type="orthographic"><transform name="to_world"><lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
  <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/><rfilter type="box"/></film></sensor>
<bsdf type="dielectric" id="glass"><float name="int_ior" value="4"/><float name="ext_ior" value="1"/></bsdf>
<shape type="rectangle"><transform name="to_world"><scale value="2"/><translate z="1"/></transform><ref id="glass"/></shape>
<shape type="rectangle"><transform name="to_world"><scale value="2"/><rotate x="1" angle="180"/><translate z="0.8"/></transform><ref id="glass"/></shape>
<shape type="rectangle"><transform name="to_world"><scale value="2"/></transform>
  <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf><emitter type="area"><rgb name="radiance" value="1"/></emitter></shape>
</scene>"#;

/// A small bright lamp in a globe of glass, as seen from outside.
pub const GLOBE: &str = r#"<scene version="3.0.0">
<sensor type="perspective"><float name="fov" value="28"/>
  <transform name="to_world"><lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
  <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="32"/><rfilter type="box"/></film></sensor>
<shape type="sphere"><float name="radius" value="1"/><bsdf type="dielectric"/></shape>
<shape type="sphere"><float name="radius" value="0.9"/><boolean name="flip_normals" value="true"/><bsdf type="dielectric"/></shape>
<shape type="sphere"><point name="center" value="0, 0.2, 0"/><float name="radius" value="0.06"/>
  <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf><emitter type="area"><rgb name="radiance" value="1000"/></emitter></shape>
</scene>"#;

fn settings(techniques: &str, branching: bool, add: u64) -> Settings {
    Settings {
        techniques: Techniques::parse(techniques).unwrap(),
        faint: if branching { FAINT } else { NO_BRANCHES },
        rr_depth: 4,
        seed: seed() * 1000 + 800 + add,
        ..Settings::default()
    }
}

/// Mean of all paths over the film, and its variance.
fn total(world: &Scene, settings: &Settings, effort: Effort) -> (f64, f64) {
    let all = series(world, settings, effort);
    let n = effort.renders as usize;
    let draws: Vec<f64> = (0..n).map(|d| all.iter().map(|s| s.draws[d].iter().sum::<f64>()).sum()).collect();
    let mean = draws.iter().sum::<f64>() / n as f64;
    (mean, draws.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / ((n - 1) * n) as f64)
}

/// After 2k reflections inside, (1−R)² R^{2k} comes through: in every pixel, from one sample, while that is no faint branch.
#[test]
fn a_plate_lets_the_same_through_in_every_sample() {
    let world = scene(PLATE);
    let r = (3.0f64 / 5.0).powi(2);
    for k in 0..2u32 {
        let length = 3 + 2 * k;
        let limits = Settings { min_length: length, max_length: length, ..settings("hit,nee", true, 0) };
        let mut render = Render::new(&world, &Options { settings: limits, ..Options::default() }).unwrap();
        render.run(&Budget::passes(1), |_| Control::Continue);
        let exact = (1.0 - r).powi(2) * r.powi(2 * k as i32);
        for pixel in &render.picture().mean {
            assert!((f64::from(pixel[0]) / exact - 1.0).abs() < 1e-4, "length {length}: {pixel:?}, {exact}");
        }
    }
}

/// What branches is what chance would have found, for every length; glass, mirror, and plastic whose coat is Dirac.
#[test]
fn branches_find_what_walks_find() {
    let dir = tempfile::tempdir().unwrap();
    let plastic = r#"<bsdf type="plastic"><rgb name="diffuse_reflectance" value="0.5"/></bsdf>"#;
    let coated = scenes::named(dir.path(), "glass and mirror")
        .replace(r#"<bsdf type="conductor"><string name="material" value="none"/></bsdf>"#, plastic);
    assert!(coated.contains("plastic"));
    for (i, xml) in [scenes::named(dir.path(), "glass and mirror"), coated].iter().enumerate() {
        let world = scene(xml);
        let effort = Effort { renders: 40, passes: 6, max_length: 7 };
        for (j, techniques) in ["hit", "hit,nee,splat,connect"].iter().enumerate() {
            let add = 10 * i as u64 + 2 * j as u64;
            let on = series(&world, &settings(techniques, true, add), effort);
            let off = series(&world, &settings(techniques, false, add + 1), effort);
            for k in 1..=effort.max_length as usize {
                let v = agreement(&on[k], &off[k]);
                let (a, b) = v.totals;
                assert!(v.p > 1e-5, "{techniques}, length {k}: {a:.4e} by branches, {b:.4e} by chance, p = {:.1e}", v.p);
            }
        }
    }
}

/// The lamp mirrored in its globe: one sample in hundreds by chance, every sample by branches.
#[test]
fn reflections_of_a_lamp_in_its_globe_are_calm() {
    let world = scene(GLOBE);
    let effort = Effort { renders: 40, passes: 4, max_length: 9 };
    let of = |branching| {
        let paths = PathFilter::parse("E S S S S+ L").unwrap();
        total(&world, &Settings { paths, ..settings("hit", branching, 50 + u64::from(!branching)) }, effort)
    };
    let (on, off) = (of(true), of(false));
    let z = (on.0 - off.0) / (on.1 + off.1).sqrt();
    assert!(z.abs() < 4.0 && on.0 > 0.0, "{on:?} by branches, {off:?} by chance");
    assert!(on.1 < 0.2 * off.1, "{on:?} by branches, {off:?} by chance");
}

/// Glass in a room of mirrors, without a longest path: chains that could go on for ever end, and nothing is lost.
#[test]
fn chains_end_in_a_room_of_mirrors() {
    let mirrors = GLOBE.replace(
        "</scene>",
        r#"<bsdf type="conductor" id="mirror"><string name="material" value="none"/><rgb name="specular_reflectance" value="0.8"/></bsdf>
<shape type="cube"><transform name="to_world"><scale value="6"/></transform><boolean name="flip_normals" value="true"/><ref id="mirror"/></shape></scene>"#,
    );
    let world = scene(&mirrors);
    let effort = Effort { renders: 40, passes: 2, max_length: 40 };
    let of = |branching| {
        let limits = Settings { rr_depth: 40, ..settings("hit", branching, 60 + u64::from(!branching)) };
        total(&world, &limits, effort)
    };
    let (on, off) = (of(true), of(false));
    let z = (on.0 - off.0) / (on.1 + off.1).sqrt();
    assert!(z.abs() < 4.0 && on.0 > 0.0, "{on:?} by branches, {off:?} by chance");
    let mut render = Render::new(&world, &Options { settings: settings("hit", true, 62), ..Options::default() }).unwrap();
    render.run(&Budget::passes(1), |_| Control::Continue);
    assert!(render.picture().mean.iter().all(|p| p[0].is_finite()));
}

/// Pictures of chains with several samples beside each walk are those of walks alone: lamps seen directly, by mirrors, and
/// through glass, and where pixels share walks; and what is smaller than a pixel has less noise.
#[test]
fn more_samples_of_chains_find_the_same_with_less_noise() {
    let dir = tempfile::tempdir().unwrap();
    let mirrors = scenes::named(dir.path(), "glass and mirror");
    let shared = mirrors.replace(r#"<rfilter type="box"/>"#, r#"<rfilter type="gaussian"/>"#);
    assert!(shared != mirrors);
    let cases = [(&*mirrors, "E S* L"), (&mirrors, "E .* L"), (GLOBE, "E S S S S+ L"), (&shared, "E .* L")];
    for (i, (xml, paths)) in cases.into_iter().enumerate() {
        let world = scene(xml);
        let of = |chain_samples: u32| {
            let first = 10_000 * i as u64 + 1000 * u64::from(chain_samples);
            pictures(&world, 40, |r| Options {
                settings: Settings {
                    paths: PathFilter::parse(paths).unwrap(),
                    chain_samples,
                    max_length: 9,
                    guided: false,
                    ..settings("hit,nee", true, first + r)
                },
                ..Options::default()
            })
        };
        let (one, eight) = (of(1), of(8));
        let v = agreement(&one, &eight);
        assert!(v.p > 1e-5 && v.energy_tested > 0.9, "{paths}: {:?}, p = {:.1e}", v.totals, v.p);
        let variance = |s: &BlockSeries| {
            let of_block = |b: usize| {
                let mean = s.draws.iter().map(|d| d[b]).sum::<f64>() / s.draws.len() as f64;
                s.draws.iter().map(|d| (d[b] - mean).powi(2)).sum::<f64>()
            };
            (0..s.columns * s.rows).map(of_block).sum::<f64>()
        };
        println!("{paths}: variance {:.3e}, {:.3e} with eight samples, p = {:.2e}", variance(&one), variance(&eight), v.p);
        if paths != "E .* L" {
            assert!(variance(&eight) < 0.4 * variance(&one), "{paths}: {} {}", variance(&one), variance(&eight));
        }
    }
}

/// A lamp that covers a fiftieth of a pixel: hardly a look into its pixel meets it, and it is seen in full all the same.
#[test]
fn a_lamp_that_a_look_missed_is_seen_in_full() {
    let xml = r#"<scene version="3.0.0">
<sensor type="orthographic"><transform name="to_world"><lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
  <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/><rfilter type="FILTER"/></film></sensor>
<shape type="sphere"><point name="center" value="0.1, 0.1, 0"/><float name="radius" value="0.02"/>
  <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf><emitter type="area"><rgb name="radiance" value="1"/></emitter></shape>
</scene>"#;
    for filter in ["box", "gaussian"] {
        let world = scene(&xml.replace("FILTER", filter));
        let total = |chain_samples: u32| {
            let draw = |s: u64| {
                let settings = Settings { chain_samples, ..settings("hit", true, 300 + s) };
                let mut render = Render::new(&world, &Options { settings, ..Options::default() }).unwrap();
                render.run(&Budget::passes(64), |_| Control::Continue);
                render.picture().mean.iter().map(|p| f64::from(p[1])).sum::<f64>()
            };
            let draws: Vec<f64> = (0..60).map(draw).collect();
            let n = draws.len() as f64;
            let mean = draws.iter().sum::<f64>() / n;
            (mean, draws.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n * (n - 1.0)))
        };
        let (one, eight) = (total(1), total(8));
        let z = (one.0 - eight.0) / (one.1 + eight.1).sqrt();
        println!("{filter}: {one:?} by one sample, {eight:?} by eight where a look met it, z = {z:.1}");
        assert!(one.0 > 0.0 && z.abs() < 4.0, "{filter}: {one:?}, {eight:?}");
    }
}
