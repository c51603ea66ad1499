//! What a pilot chooses: joins that find nothing go, what only one join finds keeps it, and the choice
//! changes no expectation.

use crate::support::{pictures, scene, seed};
use crate::{chains, scenes};
use nephroid::render::{Estimator, Options, Render};
use nephroid::report::agreement::agreement;
use nephroid::scene::Scene;
use nephroid::transport::settings::{FAINT, NO_BRANCHES, Plan, Settings, Techniques};

fn automatic(world: &Scene, seed: u64) -> Options {
    let mut options = Options::for_scene(world, Estimator::Auto);
    options.settings = Settings { seed, max_length: 6, ..options.settings };
    options
}

fn chosen(xml: &str) -> Plan {
    let world = scene(xml);
    Render::new(&world, &automatic(&world, seed())).unwrap().plan().clone()
}

fn room(things: &str) -> String {
    format!(
        r#"<scene version="3.0.0"><sensor type="perspective"><float name="fov" value="60"/>
  <transform name="to_world"><lookat origin="0, 1, 1.9" target="0, 0.6, 0" up="0, 1, 0"/></transform>
  <film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="64"/><rfilter type="box"/></film></sensor>
<shape type="cube"><boolean name="flip_normals" value="true"/><transform name="to_world"><scale x="2" y="1" z="2"/><translate y="1"/></transform>
  <bsdf type="diffuse"><rgb name="reflectance" value="0.6"/></bsdf></shape>{things}</scene>"#
    )
}

const BULB: &str = r#"<shape type="sphere"><point name="center" value="0, 0.6, 0"/><float name="radius" value="0.05"/>
  <emitter type="area"><rgb name="radiance" value="50"/></emitter></shape>"#;

/// A shell of glass around the bulb.
const SHELL: &str = r#"<shape type="sphere"><point name="center" value="0, 0.6, 0"/><float name="radius" value="0.3"/>
  <bsdf type="dielectric"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/></bsdf></shape>"#;

/// Water over the floor, under a point light.
fn wet() -> String {
    room(
        r#"<emitter type="point"><point name="position" value="0.3, 1.8, 0.2"/><rgb name="intensity" value="3"/></emitter>
<shape type="rectangle"><transform name="to_world"><scale value="2"/><rotate x="1" angle="-90"/><translate y="0.3"/></transform>
  <bsdf type="dielectric"><float name="int_ior" value="1.33"/><float name="ext_ior" value="1"/></bsdf></shape>"#,
    )
}

#[test]
fn shadow_rays_end_where_glass_is_around_every_light() {
    assert!(chosen(&room(BULB)).settings.techniques.next_event);
    let plan = chosen(&room(&format!("{BULB}{SHELL}")));
    assert!(!plan.settings.techniques.next_event && plan.settings.techniques.splat, "{:?}", plan.settings.techniques);
}

#[test]
fn matt_rooms_are_gathered() {
    let dir = tempfile::tempdir().unwrap();
    let plan = chosen(&scenes::named(dir.path(), "diffuse box"));
    let t = plan.settings.techniques;
    assert!(t.next_event && !t.merge && plan.light_paths <= 48 * 48, "{t:?}, {} light paths", plan.light_paths);
}

#[test]
fn merges_stay_where_nothing_else_sees() {
    let dir = tempfile::tempdir().unwrap();
    let wet = chosen(&wet());
    assert!(wet.settings.techniques.merge && wet.merge_radius > 0.0);
    let dry = chosen(&scenes::named(dir.path(), "diffuse box"));
    assert!(!dry.settings.techniques.merge);
}

/// Under water all is bright and smooth that next events find, and says nothing against light paths.
#[test]
fn the_choice_does_not_hang_on_luck() {
    let world = scene(&wet());
    for i in 0..6 {
        let plan = Render::new(&world, &automatic(&world, seed() * 10 + i)).unwrap().plan().clone();
        let t = plan.settings.techniques;
        println!("{t:?}, {} light paths", plan.light_paths);
        assert!(t.next_event && t.splat && t.merge, "{t:?}");
        assert!((8192..=16_384).contains(&plan.light_paths), "{} light paths", plan.light_paths);
    }
}

#[test]
fn fainter_branches_are_followed_where_a_lamp_is_bright() {
    // Reflections of a thousand times the room's radiance, none at all, and none wanted.
    assert!(chosen(chains::GLOBE).settings.faint < FAINT);
    assert_eq!(chosen(&room(BULB)).settings.faint, FAINT);
    let world = scene(chains::GLOBE);
    let mut options = automatic(&world, seed());
    options.settings.faint = NO_BRANCHES;
    let plan = Render::new(&world, &options).unwrap().plan().clone();
    assert_eq!((plan.settings.faint, plan.chain_samples()), (NO_BRANCHES, 1));
}

#[test]
fn chains_have_more_samples_where_images_of_a_lamp_are_small() {
    assert!(chosen(chains::GLOBE).chain_samples() > 1);
    let away = room(BULB).replace(r#"target="0, 0.6, 0""#, r#"target="0, 0.6, 2""#);
    assert_eq!(chosen(&away).chain_samples(), 1);
}

/// Each render has its own pilot, choice and guide; merges, which are biased, are not among the joins.
#[test]
fn whatever_is_chosen_the_mean_is_that_of_all_joins() {
    let dir = tempfile::tempdir().unwrap();
    for (i, name) in ["diffuse box", "glass and mirror", "sun disk"].into_iter().enumerate() {
        let world = scene(&scenes::named(dir.path(), name));
        let first = seed() * 100_000 + 1000 * i as u64;
        let chosen = pictures(&world, 40, |r| {
            let mut options = automatic(&world, first + r);
            options.settings.techniques = Techniques::BIDIRECTIONAL;
            options
        });
        let all = pictures(&world, 40, |r| {
            let mut options = automatic(&world, first + 500 + r);
            options.settings = Settings {
                techniques: Techniques::BIDIRECTIONAL,
                automatic: false,
                guided: false,
                stratified: false,
                ..options.settings
            };
            options
        });
        let v = agreement(&chosen, &all);
        println!("{name}: totals {:?}, p = {:.2e}, {:.0} % tested", v.totals, v.p, 100.0 * v.energy_tested);
        assert!(v.p > 1e-4 / 3.0 && v.energy_tested > 0.6, "{name}: {:?}, p = {:.1e}", v.totals, v.p);
    }
}
