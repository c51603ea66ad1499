//! Samplers of directions and positions against the densities they claim: equal where both are
//! given, of integral 1, and equal to the frequencies (χ²).

use super::*;
use crate::math::Frame;
use crate::math::warp;
use crate::scene::emitter::spot::Parameters;
use crate::scene::emitter::{envmap::Envmap, sun::Sun};
use crate::texture::{TextureSlot, Textures};
use glam::Mat3;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// P-value of observed counts where `expected` ones are due; bins of less than 10 are pooled.
pub(super) fn chi2_p_value(observed: &[f64], expected: &[f64]) -> f64 {
    let (mut chi2, mut bins) = (0.0, 0);
    let mut pool = [0.0; 2];
    for (o, e) in observed.iter().zip(expected) {
        pool = [pool[0] + o, pool[1] + e];
        if pool[1] >= 10.0 {
            chi2 += (pool[0] - pool[1]).powi(2) / pool[1];
            bins += 1;
            pool = [0.0; 2];
        }
    }
    assert!(bins > 2, "too few bins");
    assert!(pool[0] <= 40.0, "{} samples where {} are due", pool[0], pool[1]);
    1.0 - ChiSquared::new(f64::from(bins - 1)).expect("degrees of freedom").cdf(chi2)
}

const RINGS: usize = 16;
const SECTORS: usize = 24;

/// Directions within 1 − cos ≤ `vers_max` of the frame's axis, by equal solid angle.
fn check(name: &str, frame: Frame, vers_max: f32, sample: impl Fn(Vec2) -> (Vec3, f32), density: impl Fn(Vec3) -> f32) {
    const FINE: usize = 48;
    const N: u32 = 100_000;
    let bin = |w: Vec3| {
        let local = frame.to_local(w);
        let ring = crate::scene::emitter::spot::versine_of(local) / vers_max * RINGS as f32;
        let turn = local.y.atan2(local.x) / std::f32::consts::TAU;
        let sector = (turn - turn.floor()) * SECTORS as f32;
        ((ring as usize) < RINGS).then(|| ring as usize * SECTORS + (sector as usize).min(SECTORS - 1))
    };
    let mut expected = vec![0.0f64; RINGS * SECTORS];
    let (m, n) = (RINGS * FINE, SECTORS * FINE);
    let solid_angle = f64::from(vers_max) * std::f64::consts::TAU / (m * n) as f64;
    for (i, j) in (0..m).flat_map(|i| (0..n).map(move |j| (i, j))) {
        let vers = (i as f32 + 0.5) / m as f32 * vers_max;
        let sin = (vers * (2.0 - vers)).sqrt();
        let (s, c) = ((j as f32 + 0.5) / n as f32 * std::f32::consts::TAU).sin_cos();
        let w = frame.to_world(Vec3::new(sin * c, sin * s, 1.0 - vers));
        expected[i / FINE * SECTORS + j / FINE] += f64::from(density(w)) * solid_angle;
    }
    let total: f64 = expected.iter().sum();
    assert!((total - 1.0).abs() < 2e-3, "{name}: ∫ p dω = {total}");
    let mut observed = vec![0.0; RINGS * SECTORS];
    let mut random = Random::new(Family::Other, 11, 0, 1);
    for _ in 0..N {
        let (w, p) = sample(random.unit2());
        assert!((w.length() - 1.0).abs() < 1e-5, "{name}: {w} is not a unit vector");
        let q = density(w);
        // In the rounding of a cell's border, the neighbour's density may be told.
        assert!((p - q).abs() <= 2e-2 * p.max(q) || random.unit() < 2e-4, "{name}: sampled with {p}, density says {q} at {w}");
        if let Some(b) = bin(w) {
            observed[b] += 1.0;
        }
    }
    let due: Vec<f64> = expected.iter().map(|e| e / total * f64::from(N)).collect();
    let p = chi2_p_value(&observed, &due);
    assert!(p > 1e-4, "{name}: χ² p-value {p}");
}

/// Axes of the frame around a direction, as columns.
fn axes_around(direction: Vec3) -> Mat3 {
    let f = Frame::around(direction);
    Mat3::from_cols(f.s, f.t, f.n)
}

fn tilted() -> Frame {
    Frame::around(Vec3::new(0.3, -0.5, 0.8).normalize())
}

#[test]
fn sun_disk() {
    for half_angle in [0.25f64, 0.004_65, 1.2] {
        let sun = Sun::new(-tilted().n, Spectrum::ONE, half_angle);
        let vers = 1.0 - half_angle.cos();
        // The last ring ends a little inside the rim, which the density's test may round either way.
        let sample = |u| {
            let (w, p_w, _) = sun.sample(u);
            (w, p_w)
        };
        check("sun", tilted(), vers as f32 * 0.999_99, sample, |w| sun.density(w));
    }
}

#[test]
fn spot_cone() {
    for (cutoff_deg, beam_deg) in [(35.0, 20.0), (20.0, 20.0), (60.0, 0.0), (0.5, 0.3), (150.0, 100.0)] {
        let spot = Spot::new(Parameters {
            axes: axes_around(tilted().n),
            position: Vec3::ZERO,
            intensity: Spectrum::ONE,
            cutoff_deg,
            beam_deg,
            texture: TextureSlot::ONE,
        });
        let vers = (1.0 - cutoff_deg.to_radians().cos()) as f32;
        check("spot", tilted(), vers * 0.999_99, |u| spot.sample(u), |w| spot.density(w));
        // Light that is never sampled would be lost to shooting.
        let mut random = Random::new(Family::Other, 3, 0, 0);
        for _ in 0..2_000 {
            let w = tilted().to_world(warp::cone_uniform(random.unit2(), (1.0 - 1.02 * vers).max(-1.0)));
            assert!(spot.intensity(&Textures::default(), w).is_black() || spot.density(w) > 0.0);
        }
    }
}

#[test]
fn environment_image() {
    let grey = Image { width: 2, height: 3, channels: 1, data: vec![0.0, 1.0, 3.0, 0.5, 0.0, 0.0] };
    let axes = Mat3::from_axis_angle(Vec3::new(1.0, 2.0, -1.0).normalize(), 2.0);
    for (name, image) in [("small", small_image()), ("sunny", sunny_image()), ("least", grey)] {
        let map = Envmap::new(Arc::new(image), 1.0, axes).expect("not black");
        // In the image's own frame cells and bins are both ranges of φ and cosθ.
        let y_up = Frame { s: axes * Vec3::Z, t: axes * Vec3::X, n: axes * Vec3::Y };
        let sample = |u| {
            let (w, p_w, radiance) = map.sample(u);
            let (seen, most) = (map.radiance(w), 1e-3 * map.integral().max_lane());
            assert!((seen - radiance).0.abs().max_element() <= most + 0.02 * seen.max_lane(), "{name}: radiance at {w}");
            (w, p_w)
        };
        check(name, y_up, 2.0, sample, |w| map.density(w));
    }
}

/// Radiance over density is what a next event is worth: bounded, and nearly constant in fine images.
#[test]
fn environment_density_follows_radiance() {
    for (image, bound) in [(small_image(), 3.0), (sunny_image(), 3.0)] {
        let map = Envmap::new(Arc::new(image), 1.0, Mat3::IDENTITY).expect("not black");
        let mut random = Random::new(Family::Other, 5, 0, 0);
        let power = map.integral().mean();
        let mut worst = 0.0f32;
        for _ in 0..50_000 {
            let w = warp::sphere_uniform(random.unit2());
            let l = map.radiance(w).mean();
            assert!(l == 0.0 || map.density(w) > 0.0, "light that is never sampled at {w}");
            worst = worst.max(l / (map.density(w) * power));
        }
        assert!(worst < bound, "a sample may count {worst} times the mean");
    }
}

/// Position and direction of an area light's emission, on a textured sphere and on a rectangle.
#[test]
fn area_emission() {
    let to_world = Mat4::from_rotation_x(0.7) * Mat4::from_scale(Vec3::new(2.0, 0.5, 1.0));
    let world = World::new(vec![(shape(Form::Rectangle, to_world), constant([1.0; 3]))], vec![]);
    let (n, bins) = (100_000, 8);
    let mut observed = [vec![0.0; bins * bins], vec![0.0; bins * bins]];
    let mut random = Random::new(Family::Other, 6, 0, 0);
    let inverse = to_world.inverse();
    for _ in 0..n {
        let e = world
            .lights
            .sample_emission(&world.geometry, &Guide::default(), random.unit(), random.unit2(), random.unit2())
            .expect("lit");
        let p = inverse.transform_point3(e.point.y) * 0.5 + 0.5;
        let at = |a: f32, b: f32| ((a * bins as f32) as usize).min(bins - 1) * bins + ((b * bins as f32) as usize).min(bins - 1);
        observed[0][at(p.x, p.y)] += 1.0;
        let local = Frame::around(e.point.n_g).to_local(e.w);
        // cos² is uniform where the density is cosθ/π.
        observed[1][at(local.z * local.z, local.y.atan2(local.x) / std::f32::consts::TAU + 0.5)] += 1.0;
        let d = world.lights.density_emission(&world.geometry, &Guide::default(), &e.point, e.w, e.point.y);
        assert!((d.p_k / e.density.p_k - 1.0).abs() < 1e-5 && (d.p_next / e.density.p_next - 1.0).abs() < 1e-4);
        assert!((e.density.p_k * 4.0 - 1.0).abs() < 1e-5, "the rectangle's area is 4, p_k = {}", e.density.p_k);
    }
    let due = vec![n as f64 / (bins * bins) as f64; bins * bins];
    assert!(chi2_p_value(&observed[0], &due) > 1e-4, "positions");
    assert!(chi2_p_value(&observed[1], &due) > 1e-4, "directions");
}

/// Origins of infinite emission: uniform on the disk, across the direction, outside the scene.
#[test]
fn infinite_emission_starts_on_the_disk() {
    let world = World::new(vec![ball()], vec![envmap(small_image(), 1.0, Mat4::IDENTITY)]);
    let (center, radius) = world.lights.sphere();
    let mut observed = vec![0.0; 32];
    let mut random = Random::new(Family::Other, 7, 0, 0);
    let n = 50_000;
    for _ in 0..n {
        let e = world
            .lights
            .sample_emission(&world.geometry, &Guide::default(), random.unit(), random.unit2(), random.unit2())
            .expect("lit");
        let v = e.point.y - center;
        assert!((v.dot(e.w) + radius).abs() < 1e-4 * radius && e.infinite && !e.delta);
        let across = v + e.w * radius;
        observed[((across.length_squared() / radius.powi(2) * 32.0) as usize).min(31)] += 1.0;
        let d = world.lights.density_emission(&world.geometry, &Guide::default(), &e.point, e.w, e.point.y);
        assert!((d.p_k / e.density.p_k - 1.0).abs() < 0.02 || random.unit() < 1e-3);
        assert_eq!(d.p_next, e.density.p_next);
    }
    assert!(chi2_p_value(&observed, &[n as f64 / 32.0; 32]) > 1e-4);
}
