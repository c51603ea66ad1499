//! Expectations: emitted flux = power, next events = irradiance by quadrature, all techniques
//! tell the same densities.

use super::*;
use crate::describe::{BitmapFilter, BitmapWrap, TextureDescription};
use crate::math::warp;
use crate::scene::geometry::Ray;

/// The first image, its texels as they are.
fn textured() -> Option<AreaEmission> {
    emission(TextureDescription::Bitmap {
        image: ImageId(0),
        filter: BitmapFilter::Nearest,
        wrap: BitmapWrap::Repeat,
        to_uv: Mat4::IDENTITY,
        place: Place::default(),
    })
}

/// One of each kind around the origin; the rectangle carries an image.
fn everything() -> World {
    let image = Image { width: 3, height: 2, channels: 1, data: vec![1.0, 0.0, 4.0, 0.5, 2.0, 0.0] };
    let down = Mat4::from_translation(Vec3::new(0.0, 0.0, 3.0)) * Mat4::from_rotation_x(std::f32::consts::PI);
    let lamp = Form::Sphere { center: Vec3::new(1.5, 0.5, 1.0), radius: 0.4 };
    let shapes = vec![
        (shape(Form::Rectangle, down), textured()),
        (shape(lamp, Mat4::IDENTITY), constant([2.0, 1.0, 0.5])),
        (shape(Form::Disk, Mat4::from_translation(Vec3::new(-2.0, 0.0, 1.0)) * Mat4::from_rotation_y(1.3)), constant([1.5; 3])),
    ];
    let spot_to_world = Mat4::from_translation(Vec3::new(0.0, 1.0, 2.0)) * Mat4::from_rotation_x(2.9);
    let spot = EmitterModel::Spot {
        to_world: spot_to_world.into(),
        intensity: [9.0, 8.0, 7.0],
        cutoff_angle_deg: 60.0,
        beam_width_deg: 10.0,
        texture: None,
    };
    let sun = |angle| EmitterModel::Directional {
        direction: Vec3::new(0.3, 0.2, -1.0),
        irradiance: [2.0, 1.0, 1.0],
        angular_diameter_deg: angle,
    };
    let others = vec![
        (EmitterModel::Point { position: Vec3::new(-1.0, 1.0, 1.5), intensity: [1.0, 2.0, 3.0] }, None),
        (spot, None),
        (sun(0.0), None),
        (sun(12.0), None),
        (EmitterModel::Constant { radiance: [0.3, 0.2, 0.1] }, None),
        (EmitterModel::Envmap { image: ImageId(1), scale: 0.3, to_world: Mat4::IDENTITY.into() }, None),
    ];
    World::with_images(shapes, others, &[image, small_image()].map(|i| ImageDescription::Data(Arc::new(i))))
}

/// Mean and standard error of samples.
fn mean(samples: impl Iterator<Item = f64>) -> (f64, f64) {
    let (mut n, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for x in samples {
        n += 1.0;
        sum += x;
        squares += x * x;
    }
    let mean = sum / n;
    (mean, ((squares / n - mean * mean) / n).max(0.0).sqrt())
}

/// What a pilot might learn: some emitters, directions and places matter more than others.
pub(super) fn learned(world: &World, distance: f32) -> Guide {
    let ahead = |e: &Emission| (e.w.x + 0.3 * e.w.y - 0.4).abs() < 0.1 || (e.infinite && e.point.y.y > 0.5);
    learned_of(world, distance, |e| if ahead(e) { (1 + e.point.emitter.0) as f32 } else { 0.0 })
}

/// The same of paths whose first edge is `distance` long and whose flux is worth so much.
fn learned_of(world: &World, distance: f32, worth: impl Fn(&Emission) -> f32) -> Guide {
    let mut guide = Guide::new(&world.lights);
    let mut random = Random::new(Family::Other, 21, 0, 0);
    for _ in 0..4 {
        for _ in 0..20_000 {
            let (pick, position, direction) = (random.unit(), random.unit2(), random.unit2());
            let e = world.lights.sample_emission(&world.geometry, &guide, pick, position, direction);
            if let Some((e, start)) = e.and_then(|e| Some((e, world.lights.start(&guide, &e, distance)?))) {
                guide.learn(&start, f64::from(e.weight.mean() * worth(&e)));
            }
        }
        guide = guide.refined(&world.lights);
    }
    guide
}

#[test]
fn emitted_flux_is_power() {
    let world = everything();
    for (info, prob) in world.lights.infos().iter().zip(flux_is_power(&world, &Guide::default())) {
        assert!(prob <= f64::from(info.prob_emission) + 0.01, "{}: chosen {prob} of the time", info.kind);
    }
}

#[test]
fn emitted_flux_is_power_when_guided() {
    let world = everything();
    for distance in DISTANCES {
        flux_is_power(&world, &learned(&world, distance));
    }
}

/// Nothing to aim at; all lamps aim; only the sphere does, which is smaller than the others.
const DISTANCES: [f32; 3] = [f32::INFINITY, 3.0, 0.9];

/// A guide's densities are those of its samples, and it does send light where it was told to.
#[test]
fn guided_densities_are_told() {
    let world = everything();
    DISTANCES.into_iter().for_each(|distance| guided_densities_are_told_at(&world, distance));
}

fn guided_densities_are_told_at(world: &World, distance: f32) {
    let (unguided, guided) = (Guide::default(), learned(world, distance));
    let mut random = Random::new(Family::Other, 22, 0, 0);
    let (n, mut ahead) = (50_000, [[0.0f64; 2]; 2]);
    for _ in 0..n {
        let (pick, position, direction) = (random.unit(), random.unit2(), random.unit2());
        for (guide, ahead) in [&unguided, &guided].into_iter().zip(&mut ahead) {
            let e = world.lights.sample_emission(&world.geometry, guide, pick, position, direction);
            let Some(e) = e else { continue };
            // A point ahead, as a vertex of the walk would be.
            let x = e.point.y + e.w * 2.0;
            let d = world.lights.density_emission(&world.geometry, guide, &e.point, e.w, x);
            let same = |a: f32, b: f32| (a - b).abs() <= 2e-3 * a.max(b);
            let border = random.unit() < 1e-2;
            assert!(border || (same(d.p_k, e.density.p_k) && same(d.p_next, e.density.p_next)), "{d:?} for {:?}", e.density);
            // Areas and the point: the directions of the others are their own.
            if e.point.emitter.0 < 4 {
                ahead[usize::from((e.w.x + 0.3 * e.w.y - 0.4).abs() < 0.1)] += 1.0;
            }
        }
    }
    let [unguided, guided] = ahead.map(|[aside, ahead]| ahead / (aside + ahead));
    // Paths that are aimed do not learn directions.
    let more = if distance.is_infinite() { 2.5 } else { 1.0 };
    assert!(guided > more * unguided, "a share of {unguided} went ahead unguided, of {guided} guided");
}

/// Each lamp alone, with targets just far enough away, where the densities of aimed paths differ most from those of directions.
#[test]
fn emitted_flux_is_power_when_aimed() {
    let lamps = [
        (Form::Rectangle, 2.9),
        (Form::Disk, 2.05),
        (Form::Sphere { center: Vec3::ZERO, radius: 1.0 }, 2.05),
        (Form::Cylinder { p0: Vec3::ZERO, p1: Vec3::new(0.4, 0.3, 1.0), radius: 0.4 }, 1.6),
    ];
    for (form, distance) in lamps {
        let world = World::new(vec![(shape(form, Mat4::from_rotation_y(0.7)), constant([1.0; 3])), ball()], vec![]);
        let guide = learned_of(&world, distance, |_| 1.0);
        let mut random = Random::new(Family::Other, 24, 0, 0);
        let samples = (0..1_000_000).map(|_| {
            let (pick, position, direction) = (random.unit(), random.unit2(), random.unit2());
            let e = world.lights.sample_emission(&world.geometry, &guide, pick, position, direction);
            e.map_or(0.0, |e| f64::from(e.weight.0.x))
        });
        let ((got, error), power) = (mean(samples), f64::from(world.lights.infos()[0].power[0]));
        println!("{:.5} ± {:.5}", got / power, error / power);
        assert!((got - power).abs() < 4.0 * error + 1e-4 * power, "{got} ± {error} W for {power} W");
        assert!(error < 2e-3 * power);
    }
}

/// From lamps larger than what they should meet, paths that are aimed meet it more often than those that have learned directions.
#[test]
fn aimed_paths_meet_what_they_should() {
    let world = everything();
    let target = Vec3::new(0.5, -0.3, 0.1);
    let meets = |e: &Emission| (target - e.point.y).reject_from(e.w).length() < 0.15;
    let shares = [f32::INFINITY, 3.0].map(|distance| {
        let guide = learned_of(&world, distance, |e| f32::from(u8::from(e.point.emitter.0 < 3 && meets(e))));
        let (mut random, mut met, mut all) = (Random::new(Family::Other, 23, 0, 0), [0.0f64; 3], [0.0; 3]);
        for _ in 0..100_000 {
            let (pick, position, direction) = (random.unit(), random.unit2(), random.unit2());
            let e = world.lights.sample_emission(&world.geometry, &guide, pick, position, direction);
            if let Some(e) = e.filter(|e| e.point.emitter.0 < 3) {
                all[e.point.emitter.0 as usize] += 1.0;
                met[e.point.emitter.0 as usize] += f64::from(u8::from(meets(&e)));
            }
        }
        [0, 1, 2].map(|i| met[i] / all[i])
    });
    let [directions, targets] = shares;
    for (lamp, (by_direction, aimed)) in directions.into_iter().zip(targets).enumerate() {
        assert!(aimed > 1.5 * by_direction, "of lamp {lamp} {aimed} meet it, by directions {by_direction}");
    }
}

/// Checks every emitter; how often each was chosen and shone.
fn flux_is_power(world: &World, guide: &Guide) -> Vec<f64> {
    assert_eq!(world.problems, Problems::default());
    let mut random = Random::new(Family::Other, 1, 0, 0);
    let n = 200_000;
    let mut parts = vec![vec![]; world.lights.infos().len()];
    for _ in 0..n {
        let (pick, position, direction) = (random.unit(), random.unit2(), random.unit2());
        if let Some(e) = world.lights.sample_emission(&world.geometry, guide, pick, position, direction) {
            parts[e.point.emitter.0 as usize].push(f64::from(e.weight.mean()));
        }
    }
    for (info, part) in world.lights.infos().iter().zip(&parts) {
        let power = f64::from(info.power.iter().sum::<f32>() / 3.0);
        let (got, error) = mean(part.iter().copied().chain(std::iter::repeat_n(0.0, n - part.len())));
        assert!((got - power).abs() < 4.5 * error + 2e-3 * power, "{}: {got} ± {error} W for {power} W", info.kind);
    }
    parts.iter().map(|part| part.len() as f64 / n as f64).collect()
}

/// Closed forms: area π·L·A, constant 4π·L·πR², sun disk E·πR²·2(1−cosα)/sin²α.
#[test]
fn powers_are_the_closed_forms() {
    let world = everything();
    let powers: Vec<f64> = world.lights.infos().iter().map(|i| f64::from(i.power[0])).collect();
    let (pi, r) = (std::f64::consts::PI, f64::from(world.lights.sphere().1));
    let disk = pi * r * r;
    let alpha = 6f64.to_radians();
    let (b, c) = (10f64.to_radians(), 60f64.to_radians());
    let spot = 9.0 * 2.0 * pi * (1.0 - (c.sin() - b.sin()) / (c - b));
    let sun = 2.0 * disk * 2.0 * (1.0 - alpha.cos()) / alpha.sin().powi(2);
    let expected = [
        (0, pi * 4.0 * 7.5 / 6.0),
        (1, pi * 2.0 * 4.0 * pi * 0.16),
        (2, pi * 1.5 * pi),
        (3, 4.0 * pi),
        (4, spot),
        (5, 2.0 * disk),
        (6, sun),
        (7, 0.3 * 4.0 * pi * disk),
    ];
    for (i, power) in expected {
        assert!((powers[i] / power - 1.0).abs() < 2e-3, "{}: {} W for {power} W", world.lights.infos()[i].kind, powers[i]);
    }
}

/// Irradiance at a point facing `n` from all emitters but the delta ones, by quadrature over directions
/// (sky) and over the shapes (area), and the delta ones by formula.
fn irradiance(world: &World, x: Vec3, n: Vec3) -> f64 {
    let mut sum = 0.0f64;
    let m = 700;
    for i in 0..m * m {
        let u = (Vec2::new((i % m) as f32, (i / m) as f32) + 0.5) / m as f32;
        let w = warp::sphere_uniform(u);
        world.lights.environment(w, |_, l| {
            sum += f64::from(l.mean() * w.dot(n).max(0.0)) * 4.0 * std::f64::consts::PI / f64::from(m * m);
        });
        for shape in 0..3 {
            let s = world.geometry.sample_area(shape, u);
            let v = s.p - x;
            let w = v.normalize();
            let point = EmitterPoint { emitter: EmitterId(shape), y: s.p, y_error: 0.0, n_g: s.n_g, uv: s.uv };
            let l = world.lights.radiance(&point, -w).mean();
            let g = w.dot(n).max(0.0) * s.n_g.dot(w).abs() / v.length_squared();
            sum += f64::from(l * g * world.geometry.area(shape)) / f64::from(m * m);
        }
    }
    for (i, emitter) in world.lights.emitters.iter().enumerate() {
        let only = |e: &EmitterId| e.0 as usize == i;
        let (w, e) = match emitter {
            Emitter::Point(p) => ((p.position - x).normalize(), p.intensity / (p.position - x).length_squared()),
            Emitter::Spot(s) => {
                let v = s.position - x;
                (v.normalize(), s.intensity(&world.lights.textures, -v.normalize()) / v.length_squared())
            }
            Emitter::Parallel(p) => (-p.direction, p.irradiance),
            _ => continue,
        };
        assert!(!world.lights.skies.iter().any(only));
        sum += f64::from(e.mean() * w.dot(n).max(0.0));
    }
    sum
}

#[test]
fn next_events_give_the_irradiance() {
    let world = everything();
    let mut random = Random::new(Family::Other, 2, 0, 0);
    for (x, n) in [(Vec3::new(0.2, -0.3, 0.0), Vec3::Z), (Vec3::new(1.0, 0.9, 0.4), Vec3::new(0.3, 0.5, 0.8).normalize())] {
        let exact = irradiance(&world, x, n);
        let (got, error) = mean((0..200_000).map(|_| {
            let event = world.lights.sample_next_event(&world.geometry, x, random.unit(), random.unit2());
            event.map_or(0.0, |e| f64::from(e.radiance.mean() * e.g / e.nu * e.w.dot(n).max(0.0)))
        }));
        assert!((got - exact).abs() < 4.5 * error + 2e-3 * exact, "{got} ± {error} for {exact}");
        assert!(error < 0.02 * exact, "useless precision {error} of {exact}");
    }
}

/// What a next event says of its point is what a hit of the same point would be told.
#[test]
fn hits_and_next_events_agree_on_densities() {
    let world = everything();
    let mut random = Random::new(Family::Other, 3, 0, 0);
    let x = Vec3::new(0.1, 0.2, 0.3);
    for _ in 0..20_000 {
        let Some(e) = world.lights.sample_next_event(&world.geometry, x, random.unit(), random.unit2()) else {
            continue;
        };
        let same = |a: f32, b: f32| (a - b).abs() <= 2e-3 * a.max(b);
        // A direction at a cell's border may fall into the neighbouring cell by rounding.
        let slip = e.distance.is_infinite() && random.unit() < 1e-2;
        let nu = world.lights.density_next_event(&world.geometry, x, &e.point, e.w);
        let radiance = world.lights.radiance(&e.point, -e.w);
        if e.delta {
            assert!(nu > 0.0 && radiance.is_black() && world.lights.is_delta(e.point.emitter));
        } else {
            assert!(slip || same(nu, e.nu), "ν = {} for {nu}", e.nu);
            assert!((radiance - e.radiance).0.abs().max_element() <= 1e-3 * e.radiance.max_lane(), "Lᵉ of the same point");
        }
    }
}

/// Points for the direct view: per emitter Σ L/p_k is ∫ L over area or sphere.
#[test]
fn points_for_the_direct_view() {
    let world = everything();
    let mut random = Random::new(Family::Other, 8, 0, 0);
    let n = 100_000;
    let mut sums = vec![0.0f64; world.lights.infos().len()];
    for _ in 0..n {
        if let Some((point, p_k)) = world.lights.sample_point(&world.geometry, random.unit(), random.unit2()) {
            let w = point.n_g;
            let d = world.lights.density_emission(&world.geometry, &Guide::default(), &point, w, Vec3::ZERO);
            // Straight ahead the cosine's density is 1/π; a sphere's emission is the same product.
            let own = if point.emitter.0 < 3 { d.p_k * d.p_next * std::f32::consts::PI } else { d.p_k };
            assert!((own / p_k - 1.0).abs() < 0.02 || random.unit() < 1e-2);
            sums[point.emitter.0 as usize] += f64::from(world.lights.radiance(&point, w).mean() / p_k) / f64::from(n);
        }
    }
    let (pi, r) = (std::f64::consts::PI, f64::from(world.lights.sphere().1));
    for (i, (info, sum)) in world.lights.infos().iter().zip(&sums).enumerate() {
        let power = f64::from(info.power.iter().sum::<f32>() / 3.0);
        let expected = match i {
            0..3 => power / pi,
            3..6 => 0.0,
            _ => power / (pi * r * r),
        };
        assert!((sum - expected).abs() <= 0.03 * expected, "{}: {sum} for {expected}", info.kind);
    }
}

#[test]
fn next_events_on_a_sphere_with_an_image_have_the_radiance_that_is_seen_there() {
    let lamp = Form::Sphere { center: Vec3::new(0.3, 0.2, 2.0), radius: 0.8 };
    let image = ImageDescription::Data(Arc::new(small_image()));
    let world = World::with_images(vec![(shape(lamp, Mat4::from_rotation_y(0.4)), textured())], vec![], &[image]);
    let mut random = Random::new(Family::Other, 31, 0, 0);
    let (mut same, n) = (0, 2000);
    for _ in 0..n {
        let x = (random.unit2() - 0.5).extend(-0.5) * 3.0;
        let next = world.lights.sample_next_event(&world.geometry, x, random.unit(), random.unit2()).unwrap();
        let ray = Ray { o: x, d: next.w, t_max: f32::INFINITY };
        let s = world.geometry.surface(&ray, &world.geometry.intersect(&ray).unwrap());
        let point = EmitterPoint { emitter: EmitterId(0), y: s.p, y_error: s.p_error, n_g: s.n_g, uv: s.uv };
        same += u32::from(world.lights.radiance(&point, -next.w) == next.radiance);
    }
    // Between two texels rounding decides.
    assert!(same * 100 >= n * 99, "{same} of {n}");
}
