//! What is dark, wrong or absent.

use super::*;
use crate::math::Frame;
use glam::Quat;

fn problems_of(model: EmitterModel, image: Option<Image>) -> Problems {
    World::new(vec![ball()], vec![(model, image)]).problems
}

fn assert_refused(model: EmitterModel, image: Option<Image>, word: &str) {
    let problems = problems_of(model, image);
    assert!(problems.has_errors() && problems.list.iter().any(|p| p.what.contains(word)), "{word}: {problems:?}");
}

#[test]
fn no_light_is_no_sample() {
    let black = EmitterModel::Constant { radiance: [0.0; 3] };
    for world in [World::new(vec![], vec![]), World::new(vec![ball()], vec![(black, None)])] {
        assert!(world.lights.is_empty() && !world.lights.has_environment());
        let (g, u) = (&world.geometry, Vec2::splat(0.5));
        assert!(world.lights.sample_next_event(g, Vec3::ZERO, 0.5, u).is_none());
        assert!(world.lights.sample_emission(g, &Guide::default(), 0.5, u, u).is_none());
        assert!(world.lights.sample_point(g, 0.5, u).is_none());
        world.lights.environment(Vec3::Z, |_, _| panic!("no light, but radiance"));
        let nowhere = EmitterPoint::at_infinity(EmitterId::NONE, Vec3::Z);
        assert!(world.lights.radiance(&nowhere, Vec3::Z).is_black());
        assert_eq!(
            world.lights.density_emission(g, &Guide::default(), &nowhere, Vec3::Z, Vec3::ZERO),
            EmissionDensity::default()
        );
        assert_eq!(world.lights.density_next_event(g, Vec3::ZERO, &nowhere, Vec3::Z), 0.0);
    }
}

/// Dark emitters keep their ids, so that shapes built with them stay right.
#[test]
fn dark_emitters_are_warned_of_and_never_chosen() {
    let rectangle = |l: f32| (shape(Form::Rectangle, Mat4::IDENTITY), constant([l; 3]));
    let world = World::new(vec![rectangle(0.0), rectangle(1.0)], vec![]);
    assert_eq!(world.problems.list.len(), 1, "{:?}", world.problems);
    assert!(!world.problems.has_errors() && world.problems.list[0].what.contains("black"));
    let mut random = Random::new(Family::Other, 9, 0, 0);
    for _ in 0..1_000 {
        let e = world.lights.sample_emission(&world.geometry, &Guide::default(), random.unit(), random.unit2(), random.unit2());
        assert_eq!(e.expect("one is lit").point.emitter, EmitterId(1));
    }
    assert_eq!(world.lights.infos()[0].prob_emission, 0.0);
    assert_eq!(world.lights.infos()[1].prob_next_event, 1.0);
}

#[test]
fn emission_is_one_sided() {
    let world = World::new(vec![(shape(Form::Rectangle, Mat4::IDENTITY), constant([1.0; 3]))], vec![]);
    let point = EmitterPoint { emitter: EmitterId(0), y: Vec3::ZERO, y_error: 0.0, n_g: Vec3::Z, uv: Vec2::ZERO };
    assert_eq!(world.lights.radiance(&point, Vec3::Z), Spectrum::ONE);
    assert!(world.lights.radiance(&point, -Vec3::Z).is_black());
    let below = Vec3::new(0.1, 0.2, -1.0);
    assert!(world.lights.sample_next_event(&world.geometry, below, 0.5, Vec2::splat(0.3)).is_none());
    assert!(world.lights.sample_next_event(&world.geometry, -below, 0.5, Vec2::splat(0.3)).is_some());
}

/// A sun of half a degree faces a plane with the irradiance it was given.
#[test]
fn sun_disk_keeps_the_irradiance() {
    for angle in [0.53, 5.0, 0.01] {
        let irradiance = [3.0, 2.0, 1.0];
        let direction = Vec3::new(1.0, -2.0, 0.5);
        let model = EmitterModel::Directional { direction, irradiance, angular_diameter_deg: angle };
        let world = World::new(vec![ball()], vec![(model, None)]);
        assert_eq!(world.problems, Problems::default());
        assert!(world.lights.has_environment());
        let mut random = Random::new(Family::Other, 10, 0, 0);
        let n = 4_000;
        let (mut sum, mut seen) = (0.0, 0);
        for _ in 0..n {
            let e = world.lights.sample_next_event(&world.geometry, Vec3::ZERO, 0.5, random.unit2()).expect("lit");
            sum += e.radiance.0.x * e.g / e.nu * e.w.dot(-direction.normalize()) / n as f32;
            world.lights.environment(e.w, |_, l| seen += i32::from(l == e.radiance));
        }
        // All but those in the rounding of the rim.
        let slip = 2e-6 / angle.to_radians() * n as f32;
        assert!(seen as f32 >= n as f32 - slip - 3.0, "{angle}°: of {n} light points {seen} can be hit");
        assert!((sum - 3.0).abs() < 3e-3, "{angle}°: {sum}");
        let beside = (Quat::from_axis_angle(Vec3::Y, (0.52 * angle).to_radians()) * Vec3::X).normalize();
        let to_sun = Frame::around(-direction.normalize());
        world.lights.environment(to_sun.to_world(Vec3::new(beside.z, 0.0, beside.x)), |_, _| panic!("outside the disk"));
    }
}

#[test]
fn what_cannot_be_built_is_refused() {
    let spot = |cutoff, beam, to_world: Mat4| EmitterModel::Spot {
        to_world: to_world.into(),
        intensity: [1.0; 3],
        cutoff_angle_deg: cutoff,
        beam_width_deg: beam,
        texture: None,
    };
    let sun = |direction, angle| EmitterModel::Directional { direction, irradiance: [1.0; 3], angular_diameter_deg: angle };
    let sky = |scale, to_world: Mat4| EmitterModel::Envmap { image: ImageId(0), scale, to_world: to_world.into() };
    let point = |position, intensity| EmitterModel::Point { position, intensity };
    assert_refused(point(Vec3::NAN, [1.0; 3]), None, "position");
    assert_refused(point(Vec3::ZERO, [f32::INFINITY; 3]), None, "power");
    assert_refused(point(Vec3::ZERO, [-1.0, 3.0, 3.0]), None, "power");
    assert_refused(spot(0.0, 0.0, Mat4::IDENTITY), None, "cutoff_angle");
    assert_refused(spot(20.0, 30.0, Mat4::IDENTITY), None, "beam_width");
    assert_refused(spot(20.0, 10.0, Mat4::ZERO), None, "invertible");
    assert_refused(spot(20.0, 10.0, Mat4::from_scale(Vec3::new(1.0, 2.0, 1.0))), None, "shears");
    assert_refused(sun(Vec3::ZERO, 0.0), None, "direction");
    assert_refused(sun(Vec3::X, 180.0), None, "angular_diameter");
    assert_refused(sun(Vec3::X, f32::NAN), None, "angular_diameter");
    assert_refused(sky(1.0, Mat4::IDENTITY), Some(Image::default()), "too small");
    assert_refused(sky(-1.0, Mat4::IDENTITY), Some(small_image()), "scale");
    assert_refused(sky(1.0, Mat4::ZERO), Some(small_image()), "invertible");
    let mut short = small_image();
    short.data.pop();
    assert_refused(sky(1.0, Mat4::IDENTITY), Some(short), "numbers per pixel");
    let mut broken = small_image();
    broken.data[4] = f32::NAN;
    broken.data[9] = -2.0;
    let problems = problems_of(sky(1.0, Mat4::IDENTITY), Some(broken));
    assert!(!problems.has_errors() && problems.list[0].what.contains("2 numbers"), "{problems:?}");
    let tiny = problems_of(sun(Vec3::X, 1e-3), None);
    assert!(!tiny.has_errors() && tiny.list[0].what.contains("taken for 0"), "{tiny:?}");
}
