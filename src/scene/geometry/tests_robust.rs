//! Rounding: no ray escapes a closed mesh, no ray meets the surface it leaves, nothing near is
//! skipped, whatever the scale and the place of the scene.

use super::tests::{build, mesh, random, soup, vec3};
use super::*;
use crate::math::Random;
use crate::math::warp::sphere_uniform;
use glam::{Mat4, Quat, Vec2};

/// A rotation, then a scale, then a translation by `shift` in units of the scale.
fn placing(scale: f32, shift: f32, r: &mut Random) -> Mat4 {
    let q = Quat::from_axis_angle(sphere_uniform(r.unit2()), r.unit() * 6.0);
    Mat4::from_scale_rotation_translation(Vec3::splat(scale), q, vec3(r) * scale * shift)
}

/// A closed sphere of 2·n·m − 2m triangles, its vertices moved at random by up to `bump`.
fn ball(n: u32, m: u32, bump: f32, r: &mut Random) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let mut points = vec![Vec3::Z, -Vec3::Z];
    for i in 1..n {
        for k in 0..m {
            let (theta, phi) = (i as f32 * std::f32::consts::PI / n as f32, k as f32 * std::f32::consts::TAU / m as f32);
            points.push(Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()) * (1.0 + bump * r.unit()));
        }
    }
    let at = |i: u32, k: u32| {
        if i == 0 {
            0
        } else if i == n {
            1
        } else {
            2 + (i - 1) * m + k % m
        }
    };
    let quads = (0..n).flat_map(|i| (0..m).map(move |k| (i, k)));
    let halves =
        quads.flat_map(|(i, k)| [[at(i, k), at(i + 1, k), at(i + 1, k + 1)], [at(i, k), at(i + 1, k + 1), at(i, k + 1)]]);
    (points, halves.filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]).collect())
}

/// Rays from inside at points of edges and at vertices that find nothing.
fn escapes(g: &Geometry, inside: impl Fn(&mut Random) -> Vec3, to_tree: Mat4, rays: usize, r: &mut Random) -> usize {
    let mut lost = 0;
    for _ in 0..rays {
        let prim = g.tree.prims[r.below(g.tree.prims.len() as u32) as usize];
        let [a, b, _] = prim.v.map(|v| to_tree.transform_point3(g.vertices[v as usize].p));
        let u = [0.0, 1.0, 0.5, r.unit()][r.below(4) as usize];
        let o = inside(r);
        let ray = Ray { o, d: a + (b - a) * u - o, t_max: f32::INFINITY };
        lost += usize::from(g.intersect(&ray).is_none()) + usize::from(!g.occluded(&ray));
    }
    lost
}

#[test]
fn no_ray_escapes_a_closed_mesh() {
    let mut r = random(31);
    for (scale, shift) in [(1.0, 0.0), (1.0, 1.0), (1e-3, 10.0), (1e4, 1.0), (7.0, 1e3)] {
        let m = placing(scale, shift, &mut r);
        let inside = |r: &mut Random| m.transform_point3(vec3(r) * 0.5);
        let boxed = ShapeInput::new(Form::Cube);
        let (points, faces) = ball(12, 24, 0.3, &mut r);
        for shape in [boxed, mesh(points, faces)] {
            let mut g = build(vec![shape.clone().at(m)]);
            assert_eq!(escapes(&g, inside, Mat4::IDENTITY, 15_000, &mut r), 0, "scale {scale} shift {shift}");
            g.wide = false;
            assert_eq!(escapes(&g, inside, Mat4::IDENTITY, 3000, &mut r), 0, "portable, scale {scale} shift {shift}");
            let instance = ShapeInput::new(Form::Instance { group: 0 }).at(m);
            let g = Geometry::build(vec![instance], vec![vec![shape]]).expect("valid");
            assert_eq!(escapes(&g, inside, m, 3000, &mut r), 0, "instance, scale {scale} shift {shift}");
        }
    }
}

/// A direction on the side of `n` (given with its sign), every decade of grazing angle alike.
fn leaving(n: Vec3, r: &mut Random) -> Vec3 {
    let side = n.any_orthonormal_vector();
    let along = Quat::from_axis_angle(n, r.unit() * 6.3) * side;
    let cos = 10f32.powf(-6.0 * r.unit());
    along * (1.0 - cos * cos).max(0.0).sqrt() + n * cos
}

/// Counts rays that leave a surface point and meet the triangle they left, on `n` random points.
fn self_hits(g: &Geometry, n: usize, r: &mut Random) -> usize {
    let ball = g.bounding_sphere();
    let mut bad = 0;
    for _ in 0..n {
        // Aimed at some triangle, so that small ones beside huge ones get their share.
        let (target, o) = (g.tree.prims[r.below(g.tree.prims.len() as u32) as usize], ball.0 + vec3(r) * ball.1);
        let to = if target.v[0] == NONE { ball.0 } else { g.vertices[target.v[0] as usize].p };
        let ray = Ray { o, d: to - o + vec3(r) * (to - o).length() * 1e-3, t_max: f32::INFINITY };
        let Some(hit) = g.intersect(&ray) else { continue };
        let s = g.surface(&ray, &hit);
        for _ in 0..4 {
            let d = leaving(if r.unit() < 0.5 { s.n_g } else { -s.n_g }, r);
            let next = Ray { o: offset_origin(s.p, s.p_error, s.n_g, d), d, t_max: f32::INFINITY };
            let again = g.intersect(&next).is_some_and(|h| h.prim == hit.prim && h.instance == hit.instance);
            bad += usize::from(again);
        }
    }
    bad
}

#[test]
fn no_ray_meets_the_triangle_it_leaves() {
    let mut r = random(32);
    for (scale, shift) in [(1.0, 0.0), (1.0, 1e4), (1e-3, 0.0), (1e-3, 1e4), (1e4, 0.0), (1e4, 1.0), (1e-3, 1e2)] {
        let m = placing(scale, shift, &mut r);
        let (points, faces) = ball(20, 40, 0.3, &mut r);
        let teapot = mesh(points, faces);
        let stadium = ShapeInput::new(Form::Rectangle).at(m * Mat4::from_scale(Vec3::splat(1e4)));
        let slivers = soup(300, 1.0, &mut r).at(m * Mat4::from_scale(Vec3::new(1.0, 1e-3, 1.0)));
        for shapes in [vec![teapot.clone().at(m), stadium], vec![soup(300, 0.5, &mut r).at(m)], vec![slivers]] {
            let bad = self_hits(&build(shapes), 4000, &mut r);
            assert_eq!(bad, 0, "scale {scale} shift {shift}");
        }
        let instance = ShapeInput::new(Form::Instance { group: 0 }).at(m * Mat4::from_scale(Vec3::new(1.0, 3.0, 0.2)));
        let g = Geometry::build(vec![instance], vec![vec![teapot]]).expect("valid");
        assert_eq!(self_hits(&g, 4000, &mut r), 0, "instance, scale {scale} shift {shift}");
    }
}

#[test]
fn rays_leaving_a_convex_surface_meet_nothing() {
    let mut r = random(33);
    for (scale, shift) in [(1.0, 0.0), (1e-3, 0.0), (1e4, 0.0), (1.0, 100.0), (1e-3, 1e4)] {
        let m = placing(scale, shift, &mut r);
        let sphere = ShapeInput::new(Form::Sphere { center: Vec3::ZERO, radius: 0.6 }).at(m);
        let (points, faces) = ball(20, 40, 0.0, &mut r);
        // The facets' own edges are only as convex as rounding leaves them where the mesh is far.
        let rounded = if shift > 0.0 { Form::Cube } else { mesh(points, faces).form };
        for g in [build(vec![sphere]), build(vec![ShapeInput::new(rounded).at(m)])] {
            let mut left = 0;
            for _ in 0..20_000 {
                let s = g.sample_area(0, r.unit2());
                let d = leaving(s.n_g, &mut r);
                if d.dot(s.n_g) < 1e-4 && shift > 0.0 {
                    continue;
                }
                left += 1;
                assert!(g.visible_infinite((s.p, s.p_error, s.n_g), d), "scale {scale} shift {shift} {s:?} {d}");
            }
            assert!(left > 10_000);
        }
    }
}

#[test]
fn rays_inside_a_sphere_cross_it() {
    let mut r = random(34);
    for (scale, shift) in [(1.0, 0.0), (1e-3, 1e3), (1e4, 1.0), (0.6, 100.0)] {
        let m = placing(scale, shift, &mut r);
        let g = build(vec![ShapeInput::new(Form::Sphere { center: Vec3::ZERO, radius: 1.0 }).at(m)]);
        for _ in 0..10_000 {
            let s = g.sample_area(0, r.unit2());
            let d = leaving(-s.n_g, &mut r);
            if d.dot(-s.n_g) < 1e-2 {
                continue;
            }
            let ray = Ray { o: offset_origin(s.p, s.p_error, s.n_g, d), d, t_max: f32::INFINITY };
            let hit = g.intersect(&ray).expect("the other side");
            let chord = 2.0 * scale * d.dot(-s.n_g);
            assert!((hit.t - chord).abs() < 0.02 * chord + 40.0 * s.p_error / d.dot(-s.n_g), "{} {chord}", hit.t);
        }
    }
}

#[test]
fn tiny_far_spheres_are_round() {
    let mut r = random(36);
    for (center, radius) in [(Vec3::new(40.0, -30.0, 41.0), 0.6), (Vec3::new(0.0, 100.0, 0.0), 1e-3)] {
        let g = build(vec![ShapeInput::new(Form::Sphere { center, radius })]);
        for _ in 0..2000 {
            let aim = center + vec3(&mut r) * radius;
            let ray = Ray { o: Vec3::ZERO, d: aim, t_max: f32::INFINITY };
            // |o + t·d − c| in double precision.
            let (d, c) = (ray.d.as_dvec3(), center.as_dvec3());
            let nearest = d * (c.dot(d) / d.length_squared()) - c;
            let inside = f64::from(radius).powi(2) - nearest.length_squared();
            let hit = g.intersect(&ray);
            assert_eq!(hit.is_some(), inside >= 0.0);
            assert_eq!(g.occluded(&ray), inside >= 0.0);
            let Some(hit) = hit else { continue };
            let out = (nearest - d.normalize() * inside.sqrt()).normalize();
            let s = g.surface(&ray, &hit);
            assert!((s.n_g.as_dvec3() - out).length() < 1e-6, "{s:?} {out}");
            assert!((s.p.as_dvec3() - (c + out * f64::from(radius))).abs().max_element() <= f64::from(s.p_error));
        }
    }
}

#[test]
fn surfaces_close_by_are_not_skipped() {
    let mut r = random(35);
    for (scale, shift) in [(1.0, 0.0), (1e-3, 0.0), (1e4, 0.0), (1.0, 10.0)] {
        let m = placing(scale, shift, &mut r);
        let above = m * Mat4::from_translation(Vec3::Z * 1e-4);
        for form in [Form::Rectangle, Form::Disk] {
            let g = build(vec![ShapeInput::new(form.clone()).at(m), ShapeInput::new(form).at(above)]);
            for _ in 0..2000 {
                let s = g.sample_area(0, Vec2::new(0.3, 0.3) + r.unit2() * 0.4);
                let d = (s.n_g + vec3(&mut r) * 0.3).normalize();
                let ray = Ray { o: offset_origin(s.p, s.p_error, s.n_g, d), d, t_max: f32::INFINITY };
                let hit = g.intersect(&ray).expect("the sheet above");
                assert_eq!(g.surface(&ray, &hit).shape, 1, "scale {scale} shift {shift}");
                // And the two sheets see each other, though each other's shadows are this near.
                let at = g.surface(&ray, &hit);
                assert!(g.visible((s.p, s.p_error, s.n_g), (at.p, at.p_error, at.n_g)));
            }
        }
    }
}

#[test]
fn points_without_normal_are_not_moved() {
    assert_eq!(offset_origin(Vec3::ONE, 0.0, Vec3::ZERO, Vec3::X), Vec3::ONE);
    let g = build(vec![ShapeInput::new(Form::Rectangle)]);
    let end = |z: f32| (Vec3::new(0.1, 0.2, z), 0.0, Vec3::ZERO);
    assert!(!g.visible(end(1.0), end(-1.0)) && g.visible(end(1.0), end(0.5)) && g.visible(end(1.0), end(1.0)));
    assert!(g.visible_infinite(end(1.0), Vec3::Z) && !g.visible_infinite(end(1.0), -Vec3::Z));
}
