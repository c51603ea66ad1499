//! Merges: what they find is what hits find, and what nothing else finds has a closed form.

use crate::scenes;
use crate::support::{Effort, scene, seed, series};
use nephroid::render::{Budget, Control, Options, Render};
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
    let paths = "E .* S D S+ L";
    let of = |techniques, add| series(&world, &settings(techniques, paths, 0.02, add), effort);
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

/// Two walls that are mirrors; the floor is lit by both and seen in one.
const MIRRORS: &str = r#"<scene version="3.0.0">
<sensor type="perspective"><float name="fov" value="16"/>
  <transform name="to_world"><lookat origin="0, 1, 0" target="1, 0.3, 0" up="0, 1, 0"/></transform>
  <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="32"/><rfilter type="box"/></film></sensor>
<emitter type="point"><point name="position" value="-0.5, 1.5, 0"/><rgb name="intensity" value="3"/></emitter>
<bsdf type="conductor" id="mirror"><string name="material" value="none"/></bsdf>
<shape type="rectangle"><transform name="to_world"><scale value="20"/><rotate x="1" angle="-90"/></transform>
  <bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf></shape>
<shape type="rectangle"><transform name="to_world"><scale value="20"/><rotate y="1" angle="90"/><translate x="-1"/></transform><ref id="mirror"/></shape>
<shape type="rectangle"><transform name="to_world"><scale value="20"/><rotate y="1" angle="-90"/><translate x="1"/></transform><ref id="mirror"/></shape>
</scene>"#;

/// Radiance of E S D S L through pixel positions of a 32 × 32 film, by mirror images.
fn mirrored(x: f64, y: f64) -> f64 {
    let half = (8.0f64.to_radians()).tan();
    let forward = glam::DVec3::new(1.0, -0.7, 0.0).normalize();
    let left = glam::DVec3::Y.cross(forward).normalize();
    let up = forward.cross(left);
    let d = (forward + left * half * (1.0 - x / 16.0) + up * half * (1.0 - y / 16.0)).normalize();
    // The eye's image behind the mirror at x = 1 looks the other way.
    let (eye, d) = (glam::DVec3::new(2.0, 1.0, 0.0), glam::DVec3::new(-d.x, d.y, d.z));
    let p = eye - d * (eye.y / d.y);
    // The light's images behind both mirrors.
    let irradiance = |x| {
        let to_light = glam::DVec3::new(x, 1.5, 0.0) - p;
        3.0 * to_light.normalize().y / to_light.length_squared()
    };
    0.5 / std::f64::consts::PI * (irradiance(-1.5) + irradiance(2.5))
}

#[test]
fn only_merges_find_a_mirrored_point_light_in_a_mirror_and_they_find_it_right() {
    let world = scene(MIRRORS);
    let of = |techniques| {
        let settings = Settings { light_paths: Some(65_536), ..settings(techniques, "E S D S L", 0.05, 9) };
        let options = Options { settings, ..Options::default() };
        let mut render = Render::new(&world, &options).unwrap();
        render.run(&Budget::passes(24), |_| Control::Continue);
        render.picture()
    };
    let picture = of("hit,nee,splat,connect,merge");
    let (mut worst, mut tested) = (0.0f64, 0);
    for by in 0..4u32 {
        for bx in 0..4u32 {
            let pixels = || (0..64).map(|i| (8 * bx + i % 8, 8 * by + i / 8));
            let at = |x: u32, y: u32| (y * 32 + x) as usize;
            let mean = pixels().map(|(x, y)| f64::from(picture.mean[at(x, y)][0])).sum::<f64>() / 64.0;
            let expected = pixels().map(|(x, y)| mirrored(f64::from(x) + 0.5, f64::from(y) + 0.5)).sum::<f64>() / 64.0;
            let variance = pixels().map(|(x, y)| f64::from(picture.variance[at(x, y)][0])).sum::<f64>() / 64.0 / 64.0;
            // Pixels share light vertices: a radius of 0.05 spans about a pixel or two.
            let error = (16.0 * variance).sqrt();
            // Few light paths come to what is far away.
            if error > 0.03 * expected {
                continue;
            }
            worst = worst.max((mean - expected).abs() / (4.0 * error + 0.003 * expected));
            tested += 1;
        }
    }
    assert!(worst < 1.0 && tested >= 8, "{worst}, {tested} blocks");
    let blind = of("hit,nee,splat,connect");
    assert!(blind.mean.iter().all(|p| *p == [0.0; 3]));
}

#[test]
fn radius_shrinks_as_it_must() {
    let world = scene(MIRRORS);
    let options = Options { settings: settings("hit,merge", "", 0.5, 0), ..Options::default() };
    let render = Render::new(&world, &options).unwrap();
    let radius = |pass| f64::from(render.plan().merge_radius(pass));
    assert!((radius(0) - 0.5).abs() < 1e-6);
    // Bias falls with r² ~ n^(−1/3), variance with 1/(n r²) ~ n^(−2/3).
    assert!((radius(63) / radius(0) - 0.5).abs() < 1e-3 && (radius(999_999) / radius(0) - 0.1).abs() < 1e-3);
}
