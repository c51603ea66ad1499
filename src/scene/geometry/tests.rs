//! Ray casting against a brute-force reference, any hit against closest hit, portable against AVX2.

use super::*;
use crate::math::Random;
use crate::math::random::Family;
use crate::math::warp::sphere_uniform;
use glam::{DVec3, Mat4, Quat, Vec2};
use std::sync::Arc;

pub(super) fn random(seed: u64) -> Random {
    Random::new(Family::Other, 0, 0, seed)
}

pub(super) fn vec3(r: &mut Random) -> Vec3 {
    Vec3::new(r.unit(), r.unit(), r.unit()) * 2.0 - 1.0
}

pub(super) fn mesh(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> ShapeInput {
    let mesh = crate::describe::Mesh { positions, triangles, ..Default::default() };
    ShapeInput::new(Form::Mesh { mesh: Arc::new(mesh), face_normals: false })
}

/// `n` triangles of the given size in [-1, 1]³.
pub(super) fn soup(n: u32, size: f32, r: &mut Random) -> ShapeInput {
    let mut points = vec![];
    for _ in 0..n {
        let center = vec3(r);
        points.extend((0..3).map(|_| center + vec3(r) * size));
    }
    mesh(points, (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
}

pub(super) fn build(shapes: Vec<ShapeInput>) -> Geometry {
    Geometry::build(shapes, vec![]).expect("valid shapes")
}

/// Similar transforms (rotation, scale, translation, possibly a reflection).
pub(super) fn placed(r: &mut Random, reach: f32) -> Mat4 {
    let q = Quat::from_axis_angle(sphere_uniform(r.unit2()), r.unit() * 6.0);
    let flip = if r.unit() < 0.5 { Vec3::new(-1.0, 1.0, 1.0) } else { Vec3::ONE };
    Mat4::from_scale_rotation_translation(flip * (0.05 + 0.4 * r.unit()), q, vec3(r) * reach)
}

/// Nearest hit of all triangles and analytic shapes by testing each in double precision; the margin
/// says how far (u, v or t, relatively) the hit is from being none.
fn reference(g: &Geometry, prims: std::ops::Range<usize>, ray: &Ray) -> Option<(f64, usize)> {
    let mut best: Option<(f64, usize)> = None;
    for i in prims {
        let prim = g.tree.prims[i];
        let t = if prim.v[0] == NONE {
            g.tree.analytic[prim.v[1] as usize].0.intersect(ray.o, ray.d, ray.t_max).map(f64::from)
        } else {
            let [a, b, c] = prim.v.map(|v| g.vertices[v as usize].p.as_dvec3());
            moeller(ray.o.as_dvec3(), ray.d.as_dvec3(), [a, b, c])
        };
        if let Some(t) = t.filter(|t| *t > 0.0 && *t < f64::from(ray.t_max))
            && best.is_none_or(|b| t < b.0)
        {
            best = Some((t, i));
        }
    }
    best
}

fn moeller(o: DVec3, d: DVec3, [a, b, c]: [DVec3; 3]) -> Option<f64> {
    let (e1, e2) = (b - a, c - a);
    let p = d.cross(e2);
    let det = e1.dot(p);
    let s = o - a;
    let u = s.dot(p) / det;
    let q = s.cross(e1);
    let v = d.dot(q) / det;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then(|| e2.dot(q) / det)
}

fn sample_ray(r: &mut Random) -> Ray {
    let o = vec3(r) * 1.5;
    let d = if r.unit() < 0.2 {
        // Along an axis or a diagonal plane.
        let axis = [Vec3::X, Vec3::NEG_Y, Vec3::Z, Vec3::new(0.0, 1.0, -1.0)][(r.unit() * 4.0) as usize];
        axis * (0.5 + r.unit())
    } else {
        sphere_uniform(r.unit2()) * (0.1 + 3.0 * r.unit())
    };
    Ray { o, d, t_max: if r.unit() < 0.5 { f32::INFINITY } else { 2.0 * r.unit() } }
}

/// Rays whose outcome is not the reference's; a few graze an edge, where rounding may decide.
fn disagreements(g: &Geometry, instances: &[(usize, Mat4)], rays: usize, seed: u64) -> usize {
    let mut r = random(seed);
    let top = g.tree.prims.len() - instances.len().min(1) * instances.first().map_or(0, |i| g.tree.prims.len() - i.0);
    let mut bad = 0;
    for _ in 0..rays {
        let ray = sample_ray(&mut r);
        let mut want = reference(g, 0..top, &ray).map(|(t, _)| t);
        for (first, to_world) in instances {
            let inverse = to_world.inverse();
            let inner = Ray { o: inverse.transform_point3(ray.o), d: inverse.transform_vector3(ray.d), t_max: ray.t_max };
            let t = reference(g, *first..g.tree.prims.len(), &inner).map(|(t, _)| t);
            want = [want, t].into_iter().flatten().reduce(f64::min);
        }
        let got = g.intersect(&ray);
        assert_eq!(got.is_some(), g.occluded(&ray), "any hit and closest hit");
        let same = match (got, want) {
            (Some(hit), Some(t)) => (f64::from(hit.t) - t).abs() < 1e-4 * t.max(0.1),
            (None, None) => true,
            _ => false,
        };
        bad += usize::from(!same);
    }
    bad
}

#[test]
fn triangles_agree_with_brute_force() {
    for (n, size) in [(1, 0.8), (7, 0.8), (9, 0.5), (40, 0.5), (2000, 0.1)] {
        let g = build(vec![soup(n, size, &mut random(u64::from(n)))]);
        let bad = disagreements(&g, &[], 4000, 7);
        assert!(bad <= 2, "{n} triangles: {bad} of 4000 rays");
    }
}

fn mixed(r: &mut Random) -> (Vec<ShapeInput>, Vec<ShapeInput>, Vec<Mat4>) {
    let sphere = Form::Sphere { center: Vec3::new(0.1, 0.2, 0.3), radius: 0.7 };
    let cylinder = Form::Cylinder { p0: Vec3::new(0.0, 0.1, -0.5), p1: Vec3::new(0.3, -0.2, 0.6), radius: 0.4 };
    let forms = [sphere, cylinder, Form::Disk, Form::Rectangle, Form::Cube];
    let some = |r: &mut Random| -> Vec<ShapeInput> {
        (0..15).map(|i| ShapeInput::new(forms[i % 5].clone()).at(placed(r, 1.0))).collect()
    };
    let mut top = some(r);
    top.push(soup(60, 0.1, r));
    let group = some(r);
    let stretch = Mat4::from_scale(Vec3::new(0.6, 1.2, 0.8));
    let places: Vec<Mat4> = (0..4).map(|_| placed(r, 1.0) * stretch).collect();
    (top, group, places)
}

#[test]
fn all_shapes_and_instances_agree_with_brute_force() {
    let (mut top, group, places) = mixed(&mut random(3));
    top.extend(places.iter().map(|m| ShapeInput::new(Form::Instance { group: 0 }).at(*m)));
    let g = Geometry::build(top, vec![group]).expect("valid shapes");
    let first = g.tree.prims.iter().position(|p| p.shape as usize >= 20).expect("members of the group");
    let instances: Vec<_> = places.iter().map(|m| (first, *m)).collect();
    let bad = disagreements(&g, &instances, 6000, 9);
    assert!(bad <= 3, "{bad} of 6000 rays");
}

#[test]
fn portable_and_simd_agree() {
    let (mut top, group, places) = mixed(&mut random(5));
    top.extend(places.iter().map(|m| ShapeInput::new(Form::Instance { group: 0 }).at(*m)));
    top.push(soup(3000, 0.05, &mut random(6)));
    let mut g = Geometry::build(top, vec![group]).expect("valid shapes");
    let mut r = random(8);
    let rays: Vec<Ray> = (0..20_000).map(|_| sample_ray(&mut r)).collect();
    let fast: Vec<_> = rays.iter().map(|ray| (g.intersect(ray), g.occluded(ray))).collect();
    g.wide = false;
    let mut differ = 0;
    for (ray, (hit, occluded)) in rays.iter().zip(fast) {
        let plain = g.intersect(ray);
        assert_eq!(plain.is_some(), g.occluded(ray));
        let same = match (plain, hit) {
            (Some(a), Some(b)) => a.prim == b.prim && a.instance == b.instance && (a.t - b.t).abs() <= 1e-5 * a.t.max(0.1),
            (None, None) => true,
            _ => false,
        };
        differ += usize::from(!same || plain.is_some() != occluded);
    }
    assert!(differ <= 4, "{differ} of 20000 rays");
}

#[test]
fn building_twice_gives_the_same_tree() {
    let make = || build(vec![soup(5000, 0.05, &mut random(11))]);
    let (a, b) = (make(), make());
    assert!(a.tree.nodes.iter().zip(&b.tree.nodes[..]).all(|(a, b)| a.child == b.child && a.planes == b.planes));
    assert!(a.tree.blocks.iter().zip(&b.tree.blocks[..]).all(|(a, b)| a.prim == b.prim));
    assert_eq!(a.tree.nodes.len(), b.tree.nodes.len());
}

#[test]
fn a_tree_that_only_halves_finds_the_same() {
    let mut g = build(vec![soup(3000, 0.1, &mut random(12))]);
    let mut r = random(13);
    let rays: Vec<Ray> = (0..3000).map(|_| sample_ray(&mut r)).collect();
    let before: Vec<_> = rays.iter().map(|ray| g.intersect(ray)).collect();
    let corners = |i: usize| g.tree.prims[i].v.map(|v| g.vertices[v as usize].p);
    let items: Vec<Item> = (0..3000).map(|i| Item::Triangle(i as u32, corners(i))).collect();
    let boxes: Vec<Aabb> = (0..3000).map(|i| Aabb::around(corners(i))).collect();
    let mut growing = Growing::default();
    g.tree.root = growing.collapse(&items, &super::binary::halved(&boxes));
    assert!(growing.need(g.tree.root) < tree::STACK);
    g.tree.nodes = Pages::new(&growing.nodes);
    g.tree.blocks = Pages::new(&growing.blocks);
    for (ray, hit) in rays.iter().zip(before) {
        let t = |h: Option<Hit>| h.map(|h| h.t);
        assert_eq!(t(g.intersect(ray)), t(hit));
    }
}

#[test]
fn odd_input_neither_panics_nor_hits() {
    let empty = build(vec![]);
    let ray = Ray { o: Vec3::ZERO, d: Vec3::Z, t_max: f32::INFINITY };
    assert!(empty.intersect(&ray).is_none() && !empty.occluded(&ray) && empty.bounds().is_empty());
    assert_eq!(empty.bounding_sphere(), (Vec3::ZERO, 0.0));
    let g = build(vec![soup(100, 0.5, &mut random(1))]);
    for d in [Vec3::ZERO, Vec3::NAN, Vec3::new(f32::INFINITY, 0.0, 0.0)] {
        assert!(g.intersect(&Ray { d, ..ray }).is_none());
        assert!(g.intersect(&Ray { o: d, d: Vec3::Z, t_max: f32::NAN }).is_none());
    }
    // All in one place, on one line, and progressions that make lopsided trees.
    let line = |f: &dyn Fn(i32) -> f32| {
        let points = (0..300).flat_map(|i| [Vec3::new(f(i), 0.0, 0.0), Vec3::new(f(i), 1.0, 0.0), Vec3::new(f(i), 0.0, 1.0)]);
        build(vec![mesh(points.collect(), (0..300).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())])
    };
    // Nested and coinciding boxes by the thousand, over which some builders never end.
    let nested = |grow: f32| {
        let points = (0..20_000).flat_map(|i| [Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| p * (1.0 + grow * i as f32)));
        let g = build(vec![mesh(points.collect(), (0..20_000).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())]);
        g.intersect(&Ray { o: Vec3::new(0.2, 0.2, -1.0), d: Vec3::Z, t_max: 2.0 })
    };
    assert!(nested(0.0).is_some() && nested(1e-3).is_some());
    for g in [line(&|_| 1.0), line(&|i| i as f32), line(&|i| 1.2f32.powi(i)), line(&|i| 0.8f32.powi(i))] {
        let ray = Ray { o: Vec3::new(-1.0, 0.2, 0.2), d: Vec3::X, t_max: f32::INFINITY };
        assert!(g.intersect(&ray).is_some() && g.occluded(&ray));
    }
}

#[test]
fn wrong_shapes_are_refused_all_at_once() {
    let stretched = Mat4::from_scale(Vec3::new(1.0, 2.0, 1.0));
    let shapes = vec![
        ShapeInput::new(Form::Sphere { center: Vec3::ZERO, radius: 1.0 }).at(stretched),
        ShapeInput::new(Form::Sphere { center: Vec3::ZERO, radius: 0.0 }),
        ShapeInput::new(Form::Cylinder { p0: Vec3::ZERO, p1: Vec3::Z, radius: 1.0 }).at(stretched),
        ShapeInput::new(Form::Cylinder { p0: Vec3::ONE, p1: Vec3::ONE, radius: 1.0 }),
        ShapeInput::new(Form::Cube).at(Mat4::from_scale(Vec3::ZERO)),
        ShapeInput::new(Form::Disk).at(Mat4::from_scale(Vec3::new(f32::NAN, 1.0, 1.0))),
        mesh(vec![Vec3::NAN; 3], vec![[0, 1, 2]]),
        mesh(vec![Vec3::ONE; 3], vec![[0, 1, 3]]),
        ShapeInput::new(Form::Instance { group: 1 }),
    ];
    let group = vec![ShapeInput::new(Form::Instance { group: 0 })];
    let Err(problems) = Geometry::build(shapes, vec![group]) else { panic!("accepted") };
    assert_eq!(problems.list.len(), 10, "{problems:?}");
}

#[test]
fn degenerate_triangles_are_left_out() {
    let points = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::X * 2.0];
    let g = build(vec![mesh(points, vec![[0, 1, 2], [0, 1, 3], [1, 1, 2], [0, 2, 1]])]);
    assert_eq!(g.triangle_count(), 2);
    assert_eq!(g.warnings().list.len(), 1);
    assert!((g.area(0) - 1.0).abs() < 1e-6);
}

#[test]
fn areas_are_those_of_the_formulas() {
    use std::f32::consts::PI;
    let m = Mat4::from_rotation_x(0.7) * Mat4::from_scale(Vec3::new(2.0, 3.0, 0.5));
    let similar = Mat4::from_rotation_y(0.3) * Mat4::from_scale(Vec3::splat(-1.5));
    let sphere = Form::Sphere { center: Vec3::ONE, radius: 0.4 };
    let cylinder = Form::Cylinder { p0: Vec3::ZERO, p1: Vec3::new(0.0, 3.0, 4.0), radius: 0.2 };
    let shapes = [(Form::Rectangle, m), (Form::Disk, m), (Form::Cube, m), (sphere, similar), (cylinder, similar)];
    let g = build(shapes.map(|(form, m)| ShapeInput::new(form).at(m)).to_vec());
    let want = [24.0, 6.0 * PI, 8.0 * (6.0 + 1.5 + 1.0), 4.0 * PI * 0.36, 2.0 * PI * 0.3 * 7.5];
    for (i, want) in want.into_iter().enumerate() {
        assert!((g.area(i as u32) / want - 1.0).abs() < 1e-5, "shape {i}: {} {want}", g.area(i as u32));
    }
}

#[test]
fn sampled_points_lie_on_the_shape_and_are_uniform() {
    let mut r = random(21);
    let (shapes, _, _) = mixed(&mut r);
    let g = build(shapes);
    for shape in 0..g.shape_count() as u32 {
        let area = g.area(shape);
        // The area by density, and the centroid twice: by two disjoint strata of the numbers.
        let mut halves = [Vec3::ZERO; 2];
        let n = 4000;
        for i in 0..n {
            let s = g.sample_area(shape, r.unit2());
            assert!((s.p_a * area - 1.0).abs() < 1e-4);
            halves[i % 2] += s.p / (n / 2) as f32;
            // A ray against the normal meets the same shape there, on the front.
            let ray = Ray { o: s.p + s.n_g * 1e-3, d: -s.n_g, t_max: 2e-3 };
            let Some(hit) = g.intersect(&ray) else { continue };
            let at = g.surface(&ray, &hit);
            if at.shape == shape && (at.p - s.p).length() < 1e-5 {
                assert!(at.n_g.dot(s.n_g) > 0.99, "shape {shape}: {at:?} {s:?}");
                let wraps = (at.uv - s.uv).abs().max_element() > 0.5;
                assert!(wraps || (at.uv - s.uv).length() < 2e-2, "shape {shape}: {at:?} {s:?}");
            }
        }
        let size = area.sqrt();
        assert!((halves[0] - halves[1]).length() < 0.1 * size + 0.1);
    }
}

#[test]
fn spheres_are_sampled_uniformly_in_the_cone() {
    let mut r = random(4);
    for (center, radius, x) in [
        (Vec3::ZERO, 1.0, Vec3::new(0.0, 3.0, 1.0)),
        (Vec3::new(40.0, -30.0, 41.0), 0.6, Vec3::ZERO),
        (Vec3::new(0.0, 100.0, 0.0), 1e-3, Vec3::new(1.0, 0.0, 0.0)),
        (Vec3::ZERO, 1.0, Vec3::new(0.0, 1.01, 0.0)),
        (Vec3::ZERO, 1.0, Vec3::new(0.3, 0.2, 0.0)),
    ] {
        let g = build(vec![ShapeInput::new(Form::Sphere { center, radius })]);
        let (mut solid_angle, mut area) = (0.0f64, 0.0f64);
        let n = 20_000;
        for i in 0..n {
            let u = Vec2::new((i as f32 + r.unit()) / n as f32, r.unit());
            let Some(s) = g.sample_toward(0, x, u, true) else { continue };
            assert_eq!(s.p_a, g.density_toward(0, x, s.p, s.n_g));
            let d = (x - s.p).as_dvec3();
            let cos = s.n_g.as_dvec3().dot(d).abs() / d.length();
            solid_angle += cos / d.length_squared() / f64::from(s.p_a) / f64::from(n);
            assert!(g.visible((x, 0.0, Vec3::ZERO), (s.p, s.p_error, s.n_g)), "{center} {x} {s:?}");
            // ∫ p_a over the sphere is one: uniform points tell.
            let y = g.sample_area(0, r.unit2());
            area += f64::from(g.density_toward(0, x, y.p, y.n_g) / y.p_a) / f64::from(n);
        }
        let distance = (x - center).as_dvec3().length();
        let sin2 = (f64::from(radius) / distance).powi(2);
        let cone = sin2 / (1.0 + (1.0 - sin2).max(0.0).sqrt()) * 2.0 * std::f64::consts::PI;
        let want = if distance > f64::from(radius) { cone } else { 4.0 * std::f64::consts::PI };
        assert!((solid_angle / want - 1.0).abs() < 3e-2, "{solid_angle} {want} at {x}");
        // Close to the sphere the density is too peaked for this estimate.
        let close = (distance / f64::from(radius) - 1.0).abs() < 0.1;
        assert!(close || (area - 1.0).abs() < 0.05, "{area} at {x}");
    }
}
