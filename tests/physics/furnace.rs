//! Constant radiance [theory A16]: with Lᵉ = (1 − a) L* on every surface of a closed scene, L = L*
//! everywhere, whatever the geometry. Any energy that is lost or gained shows.

use crate::support::{scene, seed};
use nephroid::proof::furnace::{self as known, Constancy, picture};
use nephroid::render::{Estimator, Options};
use nephroid::scene::Scene;
use std::path::Path;

/// A bumpy sphere of 2 · 80 · 64 triangles without normals, as OBJ with texture coordinates.
fn bumpy_mesh(path: &Path) {
    use std::fmt::Write;
    let (columns, rows) = (80, 64);
    let mut obj = String::new();
    for j in 0..=rows {
        for i in 0..=columns {
            let (u, v) = (f64::from(i) / f64::from(columns), f64::from(j) / f64::from(rows));
            let (theta, phi) = (std::f64::consts::PI * v, std::f64::consts::TAU * u);
            let r = 0.5 + 0.06 * (7.0 * phi).sin() * (5.0 * theta).sin();
            let p = [r * theta.sin() * phi.cos(), r * theta.cos(), r * theta.sin() * phi.sin()];
            let _ = writeln!(obj, "v {} {} {}\nvt {u} {v}", p[0], p[1], p[2]);
        }
    }
    for j in 0..rows {
        for i in 0..columns {
            let at = |i: i32, j: i32| j * (columns + 1) + i + 1;
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            let _ = writeln!(obj, "f {a}/{a} {b}/{b} {c}/{c}\nf {a}/{a} {c}/{c} {d}/{d}");
        }
    }
    std::fs::write(path, obj).unwrap();
}

/// A grey image and its complement, so that emission is 1 − albedo texel by texel.
fn complementary_textures(dir: &Path) {
    let albedo = image::GrayImage::from_fn(16, 16, |x, y| image::Luma([(30 + 12 * x + 3 * (y % 5)) as u8]));
    let emission = image::GrayImage::from_fn(16, 16, |x, y| image::Luma([255 - albedo.get_pixel(x, y).0[0]]));
    albedo.save(dir.join("albedo.png")).unwrap();
    emission.save(dir.join("emission.png")).unwrap();
}

/// Lambert box with a textured bumpy mesh, a dim mirror and lossless glass, all at L* = 1.
fn furnace(dir: &Path) -> Scene {
    bumpy_mesh(&dir.join("bumpy.obj"));
    complementary_textures(dir);
    let d = dir.display();
    scene(&format!(
        r#"<scene version="3.0.0">
  <sensor type="perspective"><float name="fov" value="70"/>
    <transform name="to_world"><lookat origin="0.1, 0.2, 0.9" target="0, 0, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="32"/><rfilter type="box"/></film></sensor>
  <shape type="cube"><boolean name="flip_normals" value="true"/>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.5, 0.4, 0.6"/></bsdf>
    <emitter type="area"><rgb name="radiance" value="0.5, 0.6, 0.4"/></emitter></shape>
  <shape type="obj"><string name="filename" value="{d}/bumpy.obj"/><boolean name="face_normals" value="true"/>
    <transform name="to_world"><scale value="0.7"/><translate x="-0.4" y="-0.4" z="-0.3"/></transform>
    <bsdf type="diffuse"><texture type="bitmap" name="reflectance"><string name="filename" value="{d}/albedo.png"/><boolean name="raw" value="true"/></texture></bsdf>
    <emitter type="area"><texture type="bitmap" name="radiance"><string name="filename" value="{d}/emission.png"/><boolean name="raw" value="true"/></texture></emitter></shape>
  <shape type="sphere"><point name="center" value="0.5, -0.5, -0.2"/><float name="radius" value="0.3"/>
    <bsdf type="conductor"><string name="material" value="none"/><rgb name="specular_reflectance" value="0.8"/></bsdf>
    <emitter type="area"><rgb name="radiance" value="0.2"/></emitter></shape>
  <shape type="sphere"><point name="center" value="0.35, 0.45, -0.3"/><float name="radius" value="0.25"/>
    <bsdf type="dielectric"/></shape>
</scene>"#
    ))
}

fn radiance_is_constant(world: &Scene, estimator: Estimator, passes: u64) {
    for s in 0..3 {
        let mut options = Options::for_scene(world, estimator);
        options.settings.seed = seed() + s;
        // Late roulette: its rare survivors would make the distribution of a pixel too skew for z.
        options.settings.rr_depth = 20;
        let picture = picture(world, &options, passes).unwrap();
        let found = Constancy::of(&picture, [1.0; 3]);
        assert!(found.p > 1e-4, "{estimator:?}, seed {s}: {found:?}");
        blocks_are_constant(&picture, estimator);
    }
}

/// Means of 16 × 16 blocks within 3 standard errors wherever those are at most 0.5 %. Of the 12 block
/// channels of a picture one may be beyond (0.27 % each).
fn blocks_are_constant(picture: &nephroid::render::Picture, estimator: Estimator) {
    let (w, h, side) = (picture.width as usize, picture.height as usize, 16);
    let (mut tested, mut beyond, mut worst) = (0, 0, 0.0f64);
    for by in (0..h).step_by(side) {
        for bx in (0..w).step_by(side) {
            for c in 0..3 {
                let (rows, columns) = (by..(by + side).min(h), bx..(bx + side).min(w));
                let n = (rows.len() * columns.len()) as f64;
                let pixels = rows.flat_map(|y| columns.clone().map(move |x| y * w + x));
                let (m, v) = pixels.fold((0.0, 0.0), |(m, v), i| {
                    (m + f64::from(picture.mean[i][c]) / n, v + f64::from(picture.variance[i][c]) / (n * n))
                });
                if v.sqrt() <= 0.005 {
                    tested += 1;
                    let z = ((m - 1.0) / v.sqrt().max(1e-6)).abs();
                    beyond += usize::from(z > 3.0);
                    worst = worst.max(z);
                }
            }
        }
    }
    assert!(tested > 0, "{estimator:?}: no block is precise enough to be tested");
    assert!(beyond <= 1 && worst < 4.5, "{estimator:?}: {beyond} of {tested} blocks beyond 3 SE, worst {worst:.1}");
}

#[test]
fn constant_radiance_by_gathering() {
    let dir = tempfile::tempdir().unwrap();
    radiance_is_constant(&furnace(dir.path()), Estimator::Gather, 384);
}

#[test]
fn constant_radiance_by_both_walkers() {
    let dir = tempfile::tempdir().unwrap();
    radiance_is_constant(&furnace(dir.path()), Estimator::Bidirectional, 384);
}

/// A shooting walk sees no glass and no mirror directly, and those pixels would stay dark: all is diffuse here.
#[test]
fn constant_radiance_by_shooting() {
    radiance_is_constant(&known::furnace(true).unwrap(), Estimator::Shoot, 1024);
}
