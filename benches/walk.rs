//! Time of what a render is made of: passes of walks, the film, the choice of lights.

#[path = "lights/tiles.rs"]
mod tiles;

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use nephroid::film::layout::TILE_PIXELS;
use nephroid::film::{Film, Layout, Splat, SplatBins, TileBuffer};
use nephroid::math::Random;
use nephroid::math::random::Family;
use nephroid::render::{Estimator, Options, Render};
use nephroid::scene::Scene;
use nephroid::scene::emitter::Guide;
use std::hint::black_box;
use std::path::Path;

/// A scene of the repository with a small film.
fn scene(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name).join("scene.xml");
    nephroid::load(&path, &Default::default()).unwrap_or_else(|e| panic!("{e}")).scene
}

/// One pass of each estimator over a window of 64 × 64 pixels, on one thread.
fn walks(c: &mut Criterion) {
    for name in ["cornell", "cup", "gems"] {
        let scene = scene(name);
        let [x, y] = [scene.film.width / 2 - 32, scene.film.height / 2 - 32];
        for estimator in [Estimator::Gather, Estimator::Shoot, Estimator::Bidirectional] {
            let options = Options { crop: Some([x, y, 64, 64]), threads: Some(1), ..Options::for_scene(&scene, estimator) };
            let mut render = Render::new(&scene, &options).expect("a scene of ours");
            let mut pass = 0;
            let mut group = c.benchmark_group("pass");
            group.throughput(Throughput::Elements(64 * 64));
            group.bench_function(BenchmarkId::new(estimator.name(), name), |b| {
                b.iter(|| {
                    render.run_passes(pass..pass + 1);
                    pass += 1;
                });
            });
        }
    }
}

/// Contributions into a tile, a pass into the film, splats into their tiles.
fn film(c: &mut Criterion) {
    let mut random = Random::new(Family::Other, 0, 0, 0);
    let values: Vec<[f32; 3]> = (0..TILE_PIXELS).map(|_| std::array::from_fn(|_| random.unit())).collect();
    let mut group = c.benchmark_group("film");
    group.throughput(Throughput::Elements(TILE_PIXELS as u64));
    group.bench_function("add a tile", |b| {
        let mut buffer = TileBuffer::new(0);
        b.iter(|| values.iter().enumerate().for_each(|(i, v)| buffer.add(black_box(i), *v)));
    });
    group.bench_function("commit a tile", |b| {
        let mut film = Film::new(16, 16, 0).expect("a small film");
        let full = || {
            let mut buffer = TileBuffer::new(0);
            values.iter().enumerate().for_each(|(i, v)| buffer.add(i, *v));
            buffer
        };
        let tile = film.each_tile_mut().next().expect("one tile");
        b.iter_batched_ref(full, |buffer| tile.commit(buffer), BatchSize::SmallInput);
    });
    let layout = Layout { width: 512, height: 384 };
    let pixel = |r: &mut Random| layout.pixel((r.unit() * 512.0) as u32 % 512, (r.unit() * 384.0) as u32 % 384);
    let splats: Vec<Splat> = (0..65_536).map(|_| Splat { pixel: pixel(&mut random), offset: [0; 2], value: [1.0; 3] }).collect();
    group.throughput(Throughput::Elements(splats.len() as u64));
    let jobs: Vec<Vec<Splat>> = splats.chunks(4096).map(<[Splat]>::to_vec).collect();
    group.bench_function("sort splats", |b| {
        let mut bins = SplatBins::default();
        b.iter(|| bins.fill(layout, black_box(&jobs)));
    });
}

/// Next events and emissions, 1024 each.
fn lights(c: &mut Criterion) {
    let mut random = Random::new(Family::Other, 1, 0, 0);
    let inputs: Vec<_> = (0..1024).map(|_| (random.unit(), random.unit2(), random.unit2())).collect();
    let guide = Guide::default();
    let mut group = c.benchmark_group("lights");
    group.throughput(Throughput::Elements(inputs.len() as u64));
    let text =
        |xml: String| nephroid::load_str(&xml, Path::new("."), &Default::default()).unwrap_or_else(|e| panic!("{e}")).scene;
    let ours = ["cornell", "lattice", "models"].map(|name| (name, scene(name)));
    for (name, scene) in ours.into_iter().chain([("10 panels", text(tiles::panels())), ("10000 tiles", text(tiles::tiles()))]) {
        let (center, radius) = scene.lights.sphere();
        group.bench_function(BenchmarkId::new("next event", name), |b| {
            b.iter(|| {
                for (u_pick, u, at) in &inputs {
                    let x = center + 0.5 * radius * Vec3::new(at.x - 0.5, u.y - 0.5, at.y - 0.5);
                    black_box(scene.lights.sample_next_event(&scene.geometry, black_box(x), *u_pick, *u));
                }
            });
        });
        group.bench_function(BenchmarkId::new("emission", name), |b| {
            b.iter(|| {
                for (u_pick, u_position, u_direction) in &inputs {
                    black_box(scene.lights.sample_emission(&scene.geometry, &guide, *u_pick, *u_position, *u_direction));
                }
            });
        });
    }
}

criterion_group! {
    name = walk;
    config = Criterion::default().sample_size(10).measurement_time(std::time::Duration::from_millis(500)).warm_up_time(std::time::Duration::from_millis(200));
    targets = walks, film, lights
}
criterion_main!(walk);
