//! Surface points of every shape against Mitsuba 3's, written by `reference.py`: t, uv, shading
//! normal and ∂p/∂u, with and without flipped normals, under rotations, scales and reflections.

use super::*;
use crate::describe::Mesh;
use glam::{Mat4, Vec2, Vec4};
use std::sync::Arc;

fn tent(name: &str) -> Form {
    let positions = vec![Vec3::new(-1., -1., 0.), Vec3::new(1., -1., 0.), Vec3::Z, Vec3::new(0., 1.5, 0.)];
    let normals = vec![Vec3::new(-0.5, -0.5, 1.), Vec3::new(0.5, -0.5, 1.), Vec3::new(0.1, 0.1, 1.), Vec3::new(0., 1., 0.2)];
    let uvs = vec![Vec2::ZERO, Vec2::new(1., 0.2), Vec2::new(0.3, 0.9), Vec2::new(0.8, 1.5)];
    let mesh = Mesh {
        positions,
        normals: if name == "faceted" { vec![] } else { normals },
        uvs: if name == "bare" { vec![] } else { uvs },
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    Form::Mesh { mesh: Arc::new(mesh), face_normals: false }
}

fn form(name: &str) -> Form {
    match name {
        "rectangle" => Form::Rectangle,
        "disk" => Form::Disk,
        "cube" => Form::Cube,
        "sphere" => Form::Sphere { center: Vec3::new(0.1, 0.2, -0.1), radius: 0.8 },
        "cylinder" => Form::Cylinder { p0: Vec3::new(0.1, -0.4, -0.5), p1: Vec3::new(0.3, 0.2, 0.7), radius: 0.6 },
        mesh => tent(mesh),
    }
}

fn check(line: &str) {
    let words: Vec<&str> = line.split(' ').collect();
    let x: Vec<f32> = words[3..].iter().map(|w| w.parse().expect("a number")).collect();
    let row = |i: usize| Vec4::from_slice(&x[4 * i..4 * i + 4]);
    let to_world = Mat4::from_cols(row(0), row(1), row(2), Vec4::W).transpose();
    let shape = ShapeInput { flip_normals: words[1] == "1", needs_tangent: true, ..ShapeInput::new(form(words[0])).at(to_world) };
    let v = |i: usize| Vec3::from_slice(&x[i..i + 3]);
    let (o, d) = (v(12), v(15));
    let (t, uv, n, dp_du) = (x[18] * d.length() / d.length(), Vec2::new(x[19], x[20]), v(21), v(24));
    let ray = Ray { o, d, t_max: f32::INFINITY };
    for through_instance in [false, true] {
        let g = if through_instance {
            // The same, with part of the transform in the instance.
            let outer = Mat4::from_translation(Vec3::new(3.0, -2.0, 1.0)) * Mat4::from_rotation_y(1.0);
            let inner = ShapeInput { to_world: outer.inverse() * to_world, ..shape.clone() };
            Geometry::build(vec![ShapeInput::new(Form::Instance { group: 0 }).at(outer)], vec![vec![inner]])
        } else {
            Geometry::build(vec![shape.clone()], vec![])
        };
        let g = g.expect("a valid shape");
        let hit = g.intersect(&ray).unwrap_or_else(|| panic!("no hit: {line}"));
        let s = g.surface(&ray, &hit);
        assert!((hit.t - t).abs() < 2e-4 * t.max(1.0), "t {} for {line}", hit.t);
        assert!((s.p - (o + d * t)).length() < 2e-3, "p {} for {line}", s.p);
        let far = (s.uv - uv).abs();
        assert!(far.x.min(1.0 - far.x) < 2e-3 && far.y.min(1.0 - far.y) < 2e-3, "uv {} for {line}", s.uv);
        assert!((s.n_s - n).length() < 2e-3, "n_s {} for {line}", s.n_s);
        assert!(s.n_s.dot(s.n_g) > 0.0 && (s.n_g.length() - 1.0).abs() < 1e-5);
        assert!((s.dp_du - dp_du).length() < 5e-3 * (1.0 + dp_du.length()), "dp_du {} for {line}", s.dp_du);
    }
}

#[test]
fn surfaces_are_those_of_mitsuba() {
    include_str!("reference.txt").lines().for_each(check);
    if let Ok(path) = std::env::var("NEPHROID_SHAPE_REFERENCE") {
        let text = std::fs::read_to_string(path).expect("a file written by reference.py");
        text.lines().for_each(check);
    }
}
