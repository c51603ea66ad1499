//! The choice among many emitters: probabilities that sum to one and are those of the samples, that are
//! never zero where light arrives, estimates that are right, and better ones than by power alone.

use super::densities::chi2_p_value;
use super::estimates::learned;
use super::*;
use crate::describe::Mesh;
use crate::math::warp;
use crate::scene::emitter::choice::{NextEventChoice, mixture};
use crate::scene::emitter::many::Many;
use crate::scene::geometry::ShapePoint;
use std::f32::consts::PI;

fn turned(random: &mut Random) -> Mat4 {
    Mat4::from_axis_angle(warp::sphere_uniform(random.unit2()), 2.0 * PI * random.unit())
}

/// Somewhere in a ball of radius 5, of a size between 0.02 and 0.5, turned anyhow.
fn placed(random: &mut Random) -> Mat4 {
    let at = warp::sphere_uniform(random.unit2()) * 5.0 * random.unit().cbrt();
    let size = 0.02 * 25f32.powf(random.unit());
    Mat4::from_translation(at) * turned(random) * Mat4::from_scale(Vec3::splat(size))
}

/// A bowl whose vertex normals disagree with its faces in places: either side may be the lit one there.
fn bowl(random: &mut Random) -> Mesh {
    let (mut positions, mut normals, mut triangles) = (vec![Vec3::ZERO], vec![Vec3::Z], vec![]);
    for i in 0..7u32 {
        let (s, c) = (i as f32 / 7.0 * 2.0 * PI).sin_cos();
        positions.push(Vec3::new(c, s, 0.7));
        normals.push((Vec3::new(-c, -s, 1.0) + 1.2 * warp::sphere_uniform(random.unit2())).normalize());
        triangles.push([0, 1 + i, 1 + (i + 1) % 7]);
    }
    Mesh { positions, normals, triangles, ..Mesh::default() }
}

fn shape_of_kind(kind: u32, random: &mut Random) -> ShapeInput {
    let m = placed(random);
    let unequal = m * Mat4::from_scale(Vec3::new(1.0, 0.3, 2.0));
    let sphere = Form::Sphere { center: Vec3::new(0.3, 0.0, 0.2), radius: 0.8 };
    let mut input = match kind % 9 {
        0 => shape(Form::Rectangle, m),
        1 => shape(Form::Rectangle, unequal * Mat4::from_rotation_x(0.4)),
        2 => shape(Form::Disk, unequal * Mat4::from_rotation_z(0.5)),
        3 | 4 => shape(sphere, m),
        5 => shape(Form::Cylinder { p0: Vec3::ZERO, p1: Vec3::new(0.2, 0.5, 1.5), radius: 0.3 }, m),
        6 => shape(Form::Cube, unequal),
        7 => shape(Form::Mesh { mesh: Arc::new(bowl(random)), face_normals: false }, m),
        _ => shape(Form::Mesh { mesh: Arc::new(bowl(random)), face_normals: true }, unequal),
    };
    input.flip_normals = kind == 4 || random.unit() < 0.3;
    input
}

fn other_of_kind(kind: u32, random: &mut Random) -> EmitterModel {
    let to_world = (Mat4::from_translation(placed(random).w_axis.truncate()) * turned(random)).into();
    let brightness = 10f32.powf(2.0 * random.unit() - 1.0);
    let intensity = [brightness, 2.0 * brightness, brightness];
    let spot = |cutoff_angle_deg, beam_width_deg| EmitterModel::Spot {
        to_world,
        intensity,
        cutoff_angle_deg,
        beam_width_deg,
        texture: None,
    };
    match kind % 7 {
        0 | 1 => EmitterModel::Point { position: to_world.value.w_axis.truncate(), intensity },
        2 => spot(35.0, 20.0),
        3 => spot(3.0, 3.0),
        4 => spot(170.0, 20.0),
        5 => spot(110.0, 100.0),
        _ => spot(20.0, 0.0),
    }
}

/// `shapes` area emitters and `others` points and spots of all kinds, and some at infinity.
fn many(shapes: u32, others: u32, infinite: bool, seed: u64) -> World {
    let mut random = Random::new(Family::Other, 40, 0, seed);
    let area = |i| {
        let l = 10f32.powf(2.0 * random.unit());
        (shape_of_kind(i, &mut random), constant([l, 0.5 * l, l]))
    };
    let mut areas: Vec<_> = (0..shapes).map(area).collect();
    areas.push(ball());
    let mut models: Vec<Other> = (0..others).map(|i| (other_of_kind(i, &mut random), None)).collect();
    if infinite {
        let sun = |direction, angular_diameter_deg| EmitterModel::Directional {
            direction,
            irradiance: [0.2, 0.3, 0.1],
            angular_diameter_deg,
        };
        models.insert(1, (sun(Vec3::new(0.3, 0.2, -1.0), 0.0), None));
        models.push((sun(Vec3::new(0.3, -0.2, 1.0), 8.0), None));
        models.insert(5, (EmitterModel::Constant { radiance: [0.05; 3] }, None));
        // Dark ones keep their numbers and are never chosen.
        models.insert(3, (EmitterModel::Point { position: Vec3::ZERO, intensity: [0.0; 3] }, None));
    }
    World::new(areas, models)
}

/// Tiles that shine the same way, and points: parts of the tree that are not opened from far away.
fn tiled() -> World {
    let mut random = Random::new(Family::Other, 48, 0, 0);
    let tile = |i: u32| {
        let at = Vec3::new((i % 15) as f32, (i / 15) as f32, 0.0) * 0.1;
        (
            shape(Form::Rectangle, Mat4::from_translation(at) * Mat4::from_scale(Vec3::splat(0.04))),
            constant([1.0 + (i % 7) as f32; 3]),
        )
    };
    let mut point = |i: u32| {
        let position = Vec3::new(-1.0, -1.0, 1.0) + 0.5 * warp::sphere_uniform(random.unit2());
        (EmitterModel::Point { position, intensity: [0.01 * (1 + i % 5) as f32; 3] }, None)
    };
    World::new((0..225).map(tile).collect(), (0..100).map(&mut point).collect())
}

fn choice(world: &World) -> (&NextEventChoice, &Many) {
    let next_event = &world.lights.choice.as_ref().expect("lit").next_event;
    let NextEventChoice::Many(many) = next_event else { panic!("few lights") };
    (next_event, many)
}

/// Around the lights, within their bounds, at them, and far away.
fn places(world: &World, n: usize, seed: u64) -> Vec<Vec3> {
    let mut random = Random::new(Family::Other, 41, 0, seed);
    let mut places = vec![Vec3::ZERO, Vec3::splat(1e4), Vec3::new(-3e6, 1e5, 2.0), Vec3::X * 1e17, Vec3::Y * -1e25];
    for emitter in &world.lights.emitters {
        match emitter {
            Emitter::Area(a) => places.push(world.geometry.sample_area(a.shape, random.unit2()).p),
            Emitter::Point(p) => places.push(p.position),
            Emitter::Spot(s) => places.push(s.position + 1e-4 * warp::sphere_uniform(random.unit2())),
            _ => {}
        }
    }
    while places.len() < n {
        let far = 7.0 * random.unit().sqrt();
        places.push(warp::sphere_uniform(random.unit2()) * far);
    }
    places
}

#[test]
fn few_lights_are_chosen_evenly() {
    for (n, expected) in [(1, None), (7, None), (8, None), (9, Some(()))] {
        let world = many(n / 2, n - n / 2, false, 3);
        let next_event = &world.lights.choice.as_ref().expect("lit").next_event;
        assert_eq!(matches!(next_event, NextEventChoice::Many(_)).then_some(()), expected);
        if expected.is_none() {
            let even = 1.0 / n as f32;
            assert!((0..n as usize).all(|i| (next_event.prob(i, Vec3::ONE) - even).abs() < 1e-6));
        }
    }
}

#[test]
fn probabilities_sum_to_one_everywhere() {
    for world in [many(9, 0, false, 1), many(0, 9, true, 2), many(60, 40, true, 3), many(700, 300, false, 4), tiled()] {
        let (next_event, tree) = choice(&world);
        for x in places(&world, 300, 1).into_iter().take(300) {
            let sums = (0..world.lights.emitters.len()).fold((0.0f64, 0.0f64), |(all, by_tree), i| {
                let p = next_event.prob(i, x);
                assert!(p >= 0.0 && (p > 0.0) == (world.lights.infos()[i].prob_next_event > 0.0), "{p} at {x}");
                (all + f64::from(p), by_tree + f64::from(tree.prob_by_tree(i, x)))
            });
            assert!((sums.0 - 1.0).abs() < 2e-5 && (sums.1 - 1.0).abs() < 2e-5, "{sums:?} at {x}");
        }
    }
}

/// Behind all lights nothing arrives, and yet there is an answer.
#[test]
fn behind_all_lights_power_decides() {
    let tile = |i: u32| {
        let at = Vec3::new((i % 4) as f32, (i / 4) as f32, 0.0) * 0.3;
        (shape(Form::Rectangle, Mat4::from_translation(at) * Mat4::from_scale(Vec3::splat(0.1))), constant([1.0; 3]))
    };
    let world = World::new((0..16).map(tile).collect(), vec![]);
    let (next_event, _) = choice(&world);
    let behind = Vec3::new(0.4, 0.4, -2.0);
    for i in 0..16 {
        assert!((next_event.prob(i, behind) - 1.0 / 16.0).abs() < 1e-5);
    }
    let u = Vec2::splat(0.4);
    assert!((0..64).all(|k| {
        let pick = k as f32 / 64.0;
        world.lights.sample_next_event(&world.geometry, behind, pick, u).is_none()
    }));
}

/// Every u leads to an emitter, with the probability that is told for it, and as many to each as it says.
#[test]
fn samples_have_the_told_probabilities() {
    for world in [many(12, 0, false, 5), many(40, 30, true, 6), tiled()] {
        let (next_event, _) = choice(&world);
        for x in places(&world, 400, 2).into_iter().rev().take(12) {
            const N: u32 = 1 << 16;
            let mut observed = vec![0.0; world.lights.emitters.len()];
            for k in 0..N {
                let u = k as f32 / N as f32;
                let (i, p) = next_event.sample(x, u);
                assert!(p > 0.0 && p == next_event.prob(i, x), "{p} and {}", next_event.prob(i, x));
                observed[i] += 1.0 / f64::from(N);
            }
            // An emitter has at most two intervals of u, with and without the tree.
            for (i, o) in observed.iter().enumerate() {
                let p = f64::from(next_event.prob(i, x));
                assert!((o - p).abs() < 4.0 / f64::from(N), "emitter {i}: {o} of the time with probability {p} at {x}");
            }
        }
        assert_eq!(next_event.sample(Vec3::ONE, 0.0).1, next_event.prob(next_event.sample(Vec3::ONE, 0.0).0, Vec3::ONE));
        assert!(next_event.sample(Vec3::ONE, warp::ONE_MINUS_EPSILON).1 > 0.0);
    }
}

#[test]
fn frequencies_are_the_probabilities() {
    let world = many(300, 200, true, 7);
    let (next_event, _) = choice(&world);
    let mut random = Random::new(Family::Other, 42, 0, 0);
    for x in places(&world, 600, 3).into_iter().rev().take(6) {
        let n = 200_000;
        let mut observed = vec![0.0; world.lights.emitters.len()];
        (0..n).for_each(|_| observed[next_event.sample(x, random.unit()).0] += 1.0);
        let due: Vec<f64> = (0..observed.len()).map(|i| f64::from(next_event.prob(i, x)) * f64::from(n)).collect();
        let p = chi2_p_value(&observed, &due);
        assert!(p > 1e-4, "χ² p-value {p} at {x}");
    }
}

/// Unshadowed light at x from a point of an emitter: what a bound must not call impossible.
fn arrives(world: &World, emitter: EmitterId, x: Vec3, u: Vec2) -> bool {
    let event = world.lights.next_event_of(emitter, &world.geometry, x, u);
    event.is_some_and(|e| e.radiance.max_lane() * e.g > 0.0)
}

#[test]
fn the_tree_never_excludes_what_arrives() {
    let mut arrived = vec![0; 2];
    for seed in 0..6 {
        let world = many(50, 42, false, 10 + seed);
        let (_, tree) = choice(&world);
        let mut random = Random::new(Family::Other, 43, 0, seed);
        for x in places(&world, 400, seed) {
            for i in 0..world.lights.emitters.len() {
                if (0..4).any(|_| arrives(&world, EmitterId(i as u32), x, random.unit2())) {
                    assert!(tree.prob_by_tree(i, x) > 0.0, "{}: light at {x} that is never chosen", world.lights.infos()[i].kind);
                    arrived[0] += 1;
                } else {
                    arrived[1] += 1;
                }
            }
        }
    }
    assert!(arrived.iter().all(|n| *n > 50_000), "{arrived:?}");
}

/// Just inside the cone of every spot and just above the plane of every flat light.
#[test]
fn the_tree_never_excludes_what_barely_arrives() {
    let world = many(60, 70, false, 20);
    let (_, tree) = choice(&world);
    let mut random = Random::new(Family::Other, 44, 0, 0);
    let mut arrived = 0;
    for (i, emitter) in world.lights.emitters.iter().enumerate() {
        for _ in 0..300 {
            let distance = 10f32.powf(4.0 * random.unit() - 2.0);
            let x = match emitter {
                Emitter::Area(a) => {
                    let ShapePoint { p, n_g, .. } = world.geometry.sample_area(a.shape, random.unit2());
                    let along = n_g.cross(warp::sphere_uniform(random.unit2())).normalize();
                    p + (along + n_g * 10f32.powf(-6.0 * random.unit())) * distance
                }
                Emitter::Spot(s) => {
                    let (_, cutoff) = s.half_angles();
                    let angle = cutoff as f32 * (1.0 - 10f32.powf(-6.0 * random.unit()));
                    let aside = s.axis().cross(warp::sphere_uniform(random.unit2())).normalize();
                    s.position + (s.axis() * angle.cos() + aside * angle.sin()) * distance
                }
                _ => continue,
            };
            if (0..4).any(|_| arrives(&world, EmitterId(i as u32), x, random.unit2())) {
                assert!(tree.prob_by_tree(i, x) > 0.0, "{}: light at {x} that is never chosen", world.lights.infos()[i].kind);
                arrived += 1;
            }
        }
    }
    assert!(arrived > 10_000, "{arrived}");
}

/// Mean and mean square of samples.
fn moments(n: u32, mut sample: impl FnMut() -> f64) -> (f64, f64) {
    let (mut sum, mut squares) = (0.0, 0.0);
    for _ in 0..n {
        let value = sample();
        sum += value;
        squares += value * value;
    }
    (sum / f64::from(n), squares / f64::from(n))
}

/// A thousand lamps of about the same power over a large floor, half of them points, the others small
/// spheres and panels.
fn scattered() -> World {
    let mut random = Random::new(Family::Other, 46, 0, 0);
    let mut at = || Vec3::new(20.0 * random.unit(), 20.0 * random.unit(), 2.0 + random.unit());
    let down = Mat4::from_scale(Vec3::splat(0.05)) * Mat4::from_rotation_x(PI);
    let mut areas: Vec<_> =
        (0..250).map(|_| (shape(Form::Rectangle, Mat4::from_translation(at()) * down), constant([400.0; 3]))).collect();
    areas.extend((0..250).map(|_| (shape(Form::Sphere { center: at(), radius: 0.05 }, Mat4::IDENTITY), constant([120.0; 3]))));
    let points = (0..500).map(|i| (EmitterModel::Point { position: at(), intensity: [0.5 + i as f32 * 1e-3; 3] }, None));
    World::new(areas, points.collect())
}

/// Irradiance at `x` facing `n` of a next event.
fn irradiance(e: NextEvent, n: Vec3) -> f64 {
    f64::from(e.radiance.mean() * e.g / e.nu * e.w.dot(n).max(0.0))
}

/// The same of all emitters, one by one on a grid of samples, and the square of its standard error.
fn one_by_one(world: &World, x: Vec3, n: Vec3, random: &mut Random) -> (f64, f64) {
    const M: u32 = 24;
    let (mut exact, mut error) = (0.0, 0.0);
    for i in 0..world.lights.emitters.len() as u32 {
        let mut k = 0;
        let (mean, square) = moments(M * M, || {
            let u = (Vec2::new((k % M) as f32, (k / M) as f32) + random.unit2()) / M as f32;
            k += 1;
            let event = world.lights.next_event_of(EmitterId(i), &world.geometry, x, u);
            event.map_or(0.0, |e| irradiance(e, n))
        });
        exact += mean;
        error += (square - mean * mean).max(0.0) / f64::from(M * M);
    }
    (exact, error)
}

/// Variance of next events by the choice of the scene, after a test of their mean.
fn tested_variance(world: &World, x: Vec3, n: Vec3, random: &mut Random) -> f64 {
    let (exact, error) = one_by_one(world, x, n, random);
    let samples = 100_000;
    let (mean, square) = moments(samples, || {
        let event = world.lights.sample_next_event(&world.geometry, x, random.unit(), random.unit2());
        event.map_or(0.0, |e| irradiance(e, n))
    });
    let variance = square - mean * mean;
    let tolerance = 4.0 * (error + variance / f64::from(samples)).sqrt() + 1e-4 * exact;
    assert!((mean - exact).abs() <= tolerance, "{mean} for {exact} ± {tolerance} at {x}");
    variance
}

#[test]
fn estimates_are_right() {
    for (seed, world) in [many(600, 400, true, 30), many(600, 400, false, 31), tiled()].into_iter().enumerate() {
        let mut random = Random::new(Family::Other, 45, 0, seed as u64);
        for x in places(&world, 1100, 5).into_iter().rev().take(8) {
            let n = warp::sphere_uniform(random.unit2());
            tested_variance(&world, x, n, &mut random);
        }
    }
}

#[test]
fn variance_is_a_part_of_that_by_power() {
    let world = scattered();
    let powers: Vec<f64> = world.lights.infos().iter().map(|i| f64::from(i.power[0])).collect();
    let by_power = mixture(&powers, 0.5).expect("lit");
    let mut random = Random::new(Family::Other, 47, 0, 0);
    let mut ratios: Vec<f64> = (0..16)
        .map(|_| {
            let x = Vec3::new(20.0 * random.unit(), 20.0 * random.unit(), 0.0);
            let variance = tested_variance(&world, x, Vec3::Z, &mut random);
            let (mean, square) = moments(100_000, || {
                let (i, prob, _) = by_power.sample(random.unit());
                let i = EmitterId(i as u32);
                let event = world.lights.next_event_of(i, &world.geometry, x, random.unit2());
                event.map_or(0.0, |e| irradiance(e, Vec3::Z) / f64::from(prob))
            });
            (square - mean * mean) / variance
        })
        .collect();
    ratios.sort_by(f64::total_cmp);
    println!("variance by power over variance by the tree: {ratios:.1?}");
    assert!(ratios[0] > 4.0 && ratios[8] > 8.0, "{ratios:.1?}");
}

/// Groups of neighbours learn together: they hold every emitter once, and few enough are left.
#[test]
fn groups_hold_all_emitters() {
    let world = many(700, 500, true, 50);
    let lights = &world.lights;
    let (_, many) = choice(&world);
    for most in [1, 4, 7, 64, 2000] {
        let groups = many.tree().groups(most, |i| f64::from(lights.infos()[i].prob_emission));
        assert!(groups.len() <= most, "{} groups for {most}", groups.len());
        assert!(groups.len() + 3 > most.min(1200), "{} groups for {most}", groups.len());
        let mut all = groups.concat();
        all.sort_unstable();
        let tree: Vec<usize> = (0..lights.emitters.len()).filter(|i| many.tree().contains(*i)).collect();
        assert_eq!((all, tree.len()), (tree, 1200));
    }
}

/// What groups have learned changes where light starts, not how much of it there is.
#[test]
fn guided_flux_of_many_is_power() {
    let world = many(80, 60, true, 51);
    let guide = learned(&world, 5.0);
    let mut random = Random::new(Family::Other, 53, 0, 0);
    let power: f64 = world.lights.infos().iter().map(|i| f64::from(i.power.iter().sum::<f32>() / 3.0)).sum();
    let n = 400_000;
    let (mean, square) = moments(n, || {
        let (pick, position, direction) = (random.unit(), random.unit2(), random.unit2());
        let e = world.lights.sample_emission(&world.geometry, &guide, pick, position, direction);
        e.map_or(0.0, |e| f64::from(e.weight.mean()))
    });
    let error = ((square - mean * mean) / f64::from(n)).sqrt();
    assert!((mean - power).abs() < 4.0 * error + 2e-3 * power, "{mean} ± {error} W for {power} W");
    assert!(error < 0.02 * power, "{error}");
    // As told at every later vertex.
    let mut random = Random::new(Family::Other, 52, 0, 0);
    let mut odd = 0;
    for _ in 0..20_000 {
        let (pick, position, direction) = (random.unit(), random.unit2(), random.unit2());
        let Some(e) = world.lights.sample_emission(&world.geometry, &guide, pick, position, direction) else { continue };
        let d = world.lights.density_emission(&world.geometry, &guide, &e.point, e.w, e.point.y + e.w * 2.0);
        let same = |a: f32, b: f32| (a - b).abs() <= 2e-3 * a.max(b);
        odd += i32::from(!(same(d.p_k, e.density.p_k) && same(d.p_next, e.density.p_next)));
    }
    assert!(odd < 200, "{odd} densities differ");
}
