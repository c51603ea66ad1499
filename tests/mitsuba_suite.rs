//! Mitsuba 3's own render tests: its scenes, its references, its z-test, our estimators.
//!
//! The data is a clone of Mitsuba's data repository (or a part of it) in the folder that the variable
//! `NEPHROID_MITSUBA_DATA` names; without it every test says "skipped". As there: 2·10⁶ samples per
//! scene, z = |mean − reference|·√(spp / variance) per pixel and channel in XYZ with the reference's
//! variance of one sample (at least 10⁻⁴), significance 0.01 with Šidák's correction over pixels, and
//! at least 99.75 % of the pixel channels must accept.

use nephroid::io::write::read_image;
use nephroid::render::{Budget, Control, Estimator, Options, Render};
use statrs::function::erf::erfc;
use std::path::{Path, PathBuf};

const SAMPLES: u64 = 2_000_000;
const TO_XYZ: [[f32; 3]; 3] =
    [[0.412_453, 0.357_580, 0.180_423], [0.212_671, 0.715_160, 0.072_169], [0.019_334, 0.119_193, 0.950_227]];

fn data() -> Option<PathBuf> {
    std::env::var_os("NEPHROID_MITSUBA_DATA").map(PathBuf::from)
}

fn xyz(rgb: [f32; 3]) -> [f32; 3] {
    TO_XYZ.map(|row| row[0] * rgb[0] + row[1] * rgb[1] + row[2] * rgb[2])
}

fn read(path: &Path) -> Vec<[f32; 3]> {
    let image = read_image(path).unwrap_or_else(|e| panic!("{e}"));
    image.rgb("").unwrap_or_else(|| panic!("{} has no RGB channels", path.display()))
}

/// Share of pixel channels that accept.
fn accepted(image: &[[f32; 3]], reference: &[[f32; 3]], variance: &[[f32; 3]], spp: u64) -> f64 {
    let n = image.len() as f64;
    let alpha = 1.0 - (1.0f64 - 0.01).powf(1.0 / n);
    let mut ok = 0usize;
    for ((a, r), v) in image.iter().zip(reference).zip(variance) {
        let (a, r, v) = (xyz(*a), xyz(*r), xyz(*v));
        for c in 0..3 {
            let z = f64::from((a[c] - r[c]).abs()) * (spp as f64 / f64::from(v[c].max(1e-4))).sqrt();
            ok += usize::from(erfc(z / std::f64::consts::SQRT_2) > alpha);
        }
    }
    ok as f64 / (3.0 * n)
}

/// `group/name` of the scene without its integrator suffix, which is `integrator`.
fn passes(group: &str, name: &str, integrator: &str, estimators: &[Estimator]) {
    let Some(root) = data() else {
        println!("skipped: NEPHROID_MITSUBA_DATA is not set");
        return;
    };
    let folder = root.join("tests/scenes").join(group);
    let reference = read(&folder.join(format!("refs/{name}_ref_rgb.exr")));
    let variance = read(&folder.join(format!("refs/{name}_ref_rgb_var.exr")));
    let loaded =
        nephroid::load(&folder.join(format!("{name}_{integrator}.xml")), &Default::default()).unwrap_or_else(|e| panic!("{e}"));
    let scene = loaded.scene;
    let film = &scene.film;
    let spp = SAMPLES / (u64::from(film.width) * u64::from(film.height));
    for estimator in estimators {
        let mut render = Render::new(&scene, &Options::for_scene(&scene, *estimator)).unwrap();
        render.run(&Budget::passes(spp), |_| Control::Continue);
        let share = accepted(&render.picture().mean, &reference, &variance, spp);
        println!("{name} by {estimator:?}: {:.3} % accept", 100.0 * share);
        assert!(share >= 0.9975, "{name} by {estimator:?}: only {:.3} % of the pixel channels accept", 100.0 * share);
    }
}

const BOTH: [Estimator; 2] = [Estimator::Gather, Estimator::Bidirectional];

macro_rules! suite {
    ($($test:ident: $group:literal $name:literal $integrator:literal $estimators:expr;)*) => { $(
        #[test]
        fn $test() {
            passes($group, $name, $integrator, $estimators);
        }
    )* };
}

suite! {
    texture_interp: "texture_interp" "test_texture_interp" "direct" &BOTH;
    spot_light: "spot_light" "test_spot" "direct" &BOTH;
    floating_sphere: "floating_sphere" "test_directional" "direct" &BOTH;
    orthographic_sensor: "orthographic_sensor" "test_orthographic" "path" &BOTH;
    instancing: "instancing" "test_instancing" "path" &BOTH;
    textured_diffuse: "bsdf_spheres" "test_textured_diffuse" "path" &BOTH;
    roughdielectric: "bsdf_spheres" "test_roughdielectric" "path" &BOTH;
    roughplastic_nonlinear: "bsdf_spheres" "test_roughplastic_nonlinear" "path" &BOTH;
    constant: "bsdf_spheres" "test_constant" "path" &BOTH;
    arealight: "bsdf_spheres" "test_arealight" "path" &BOTH;
    infinite_mirrors: "infinite_mirrors" "scene" "path" &BOTH;
}
