//! Rays per second of `Geometry` beside Embree's on the same rays: `cargo bench --bench bvh`.
//!
//! One thread, single rays, robust modes, median of interleaved runs in CPU time. Ray kinds:
//! primary; diffuse bounces 1–3, closest hit; to a light, any hit; between random vertices of
//! paths, any hit. Without Embree (see `bvh/embree.rs`) only our own figures are printed.
//! Environment: NEPHROID_BENCH_ROOM=name, NEPHROID_EMBREE_QUALITY=2 (with spatial splits),
//! NEPHROID_EMBREE_FAST=1 (its mode that is not watertight), NEPHROID_BENCH_RUNS.

#![allow(unsafe_code)]

#[path = "bvh/embree.rs"]
mod embree;
#[path = "bvh/scenes.rs"]
mod scenes;

use embree::Embree;
use glam::Vec3;
use nephroid::describe::Mesh;
use nephroid::math::random::Family;
use nephroid::math::{Frame, Random, warp};
use nephroid::scene::geometry::{Form, Geometry, Ray, ShapeInput, offset_origin};
use scenes::Room;
use std::hint::black_box;
use std::sync::Arc;

const KINDS: [(&str, bool); 4] = [("prim", false), ("diff", false), ("shad", true), ("conn", true)];

fn main() {
    let library = embree::find();
    let wanted = std::env::var("NEPHROID_BENCH_ROOM").ok();
    let number = |name: &str, otherwise: u32| std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(otherwise);
    let (runs, quality) = (number("NEPHROID_BENCH_RUNS", 9), number("NEPHROID_EMBREE_QUALITY", 1));
    let robust = number("NEPHROID_EMBREE_FAST", 0) == 0;
    println!("{:8} {:>9} {:>5} {:>8} {:>8} {:>6}  differ", "room", "triangles", "rays", "ours", "Embree", "ratio");
    let mut ratios = vec![];
    for room in [scenes::tiny(), scenes::cornell(), scenes::knot(), scenes::hall()] {
        if wanted.as_ref().is_some_and(|w| w != room.name) {
            continue;
        }
        let start = cpu_seconds();
        let ours = build(&room);
        let (built, start) = (cpu_seconds() - start, cpu_seconds());
        let theirs = library.as_ref().and_then(|path| Embree::new(path, &room.positions, &room.triangles, robust, quality));
        eprintln!("{}: built in {built:.2} s, Embree {:.2} s; {} MB", room.name, cpu_seconds() - start, ours.bytes() >> 20);
        let rays = rays(&room, &ours);
        for ((kind, any), rays) in KINDS.iter().zip(&rays) {
            let line = measure(&ours, theirs.as_ref(), rays, *any, runs as usize);
            let million = |t: f64| rays.len() as f64 / t * 1e-6;
            print!("{:8} {:>9} {kind:>5} {:8.2}", room.name, room.triangles.len(), million(line.ours));
            match line.theirs {
                Some(theirs) => {
                    ratios.push(theirs / line.ours);
                    println!(" {:8.2} {:6.2}  {}", million(theirs), theirs / line.ours, line.differ);
                }
                None => println!(),
            }
        }
    }
    if !ratios.is_empty() {
        let mean = ratios.iter().map(|r| r.ln()).sum::<f64>() / ratios.len() as f64;
        println!("geometric mean {:.3}, least {:.3}", mean.exp(), ratios.iter().copied().fold(f64::INFINITY, f64::min));
    }
}

fn build(room: &Room) -> Geometry {
    let mesh = Mesh { positions: room.positions.clone(), triangles: room.triangles.clone(), ..Mesh::default() };
    let form = Form::Mesh { mesh: Arc::new(mesh), face_normals: true };
    Geometry::build(vec![ShapeInput::new(form)], vec![]).expect("a valid mesh")
}

/// The rays of paths from the camera, by kind.
fn rays(room: &Room, g: &Geometry) -> [Vec<Ray>; 4] {
    let mut out: [Vec<Ray>; 4] = Default::default();
    let mut vertices = vec![];
    let side = 256u32;
    let (eye, target) = room.eye;
    let view = Frame::with_tangent((target - eye).normalize(), Vec3::Y);
    for pixel in 0..side * side {
        let mut r = Random::new(Family::Other, u64::from(pixel), 0, 1);
        let film = Vec3::new((pixel / side) as f32 + r.unit(), (pixel % side) as f32 + r.unit(), 0.0) / side as f32 * 2.0 - 1.0;
        let d = view.to_world(Vec3::new(-film.x, film.y, 1.3).normalize());
        let mut ray = Ray { o: eye, d, t_max: f32::INFINITY };
        for bounce in 0..4 {
            out[usize::from(bounce > 0)].push(ray);
            let Some(hit) = g.intersect(&ray) else { break };
            let s = g.surface(&ray, &hit);
            let n = s.n_g * -1f32.copysign(s.n_g.dot(ray.d));
            let at = |d: Vec3| offset_origin(s.p, s.p_error, s.n_g, d);
            let u = r.unit2() * 2.0 - 1.0;
            let to = room.light.0 + Vec3::new(u.x, 0.0, u.y) * room.light.1;
            if (to - s.p).dot(n) > 0.0 {
                out[2].push(Ray { o: at(n), d: to - at(n), t_max: 1.0 - 1e-4 });
            }
            vertices.push(at(n));
            let d = Frame::around(n).to_world(warp::hemisphere_cosine(r.unit2()));
            ray = Ray { o: at(d), d, t_max: f32::INFINITY };
        }
    }
    let mut r = Random::new(Family::Other, 1, 1, 2);
    for from in &vertices {
        let to = vertices[r.below(vertices.len() as u32) as usize];
        out[3].push(Ray { o: *from, d: to - *from, t_max: 1.0 - 1e-4 });
    }
    out
}

struct Line {
    ours: f64,
    theirs: Option<f64>,
    differ: usize,
}

fn measure(ours: &Geometry, theirs: Option<&Embree>, rays: &[Ray], any: bool, runs: usize) -> Line {
    let (mut a, mut b) = (vec![], vec![]);
    for _ in 0..runs {
        a.push(time(rays, |ray| if any { ours.occluded(ray) } else { ours.intersect(ray).is_some() }));
        if let Some(embree) = theirs {
            b.push(time(rays, |ray| if any { embree.occluded(ray) } else { embree.intersect(ray).is_some() }));
        }
    }
    let same = |ray: &&Ray, embree: &Embree| match any {
        true => ours.occluded(ray) == embree.occluded(ray),
        false => match (ours.intersect(ray), embree.intersect(ray)) {
            (Some(a), Some(b)) => (a.t - b).abs() < 1e-4 * a.t.max(b) + 1e-5,
            (a, b) => a.is_some() == b.is_some(),
        },
    };
    let differ = theirs.map_or(0, |e| rays.iter().filter(|ray| !same(ray, e)).count());
    Line { ours: median(&mut a).unwrap_or(0.0), theirs: median(&mut b), differ }
}

fn time(rays: &[Ray], mut cast: impl FnMut(&Ray) -> bool) -> f64 {
    let start = cpu_seconds();
    let hits = rays.iter().filter(|ray| cast(black_box(ray))).count();
    black_box(hits);
    cpu_seconds() - start
}

fn median(times: &mut [f64]) -> Option<f64> {
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied()
}

/// CPU time of this thread, which other programs on the machine disturb less than the clock.
#[cfg(target_os = "linux")]
fn cpu_seconds() -> f64 {
    unsafe extern "C" {
        fn clock_gettime(clock: i32, at: *mut [i64; 2]) -> i32;
    }
    const THREAD_CPU: i32 = 3;
    let mut at = [0i64; 2];
    // SAFETY: writes one timespec (two 64-bit numbers on 64-bit Linux).
    unsafe { clock_gettime(THREAD_CPU, &mut at) };
    at[0] as f64 + at[1] as f64 * 1e-9
}

#[cfg(not(target_os = "linux"))]
fn cpu_seconds() -> f64 {
    static START: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
    START.get_or_init(std::time::Instant::now).elapsed().as_secs_f64()
}
