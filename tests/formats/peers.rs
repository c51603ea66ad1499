//! Our mesh readers against independent ones (tobj, ply-rs-bw) on random meshes.

use crate::ply::{ENCODINGS, Value, file};
use glam::{Vec2, Vec3};
use nephroid::describe::Mesh;
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, Property};
use proptest::prelude::*;
use std::fmt::Write;

/// Numbers that survive being written and read.
fn number() -> impl Strategy<Value = f32> {
    prop_oneof![-1e3_f32..1e3, any::<i8>().prop_map(f32::from), -1e-6_f32..1e-6]
}

fn vectors(count: usize) -> impl Strategy<Value = Vec<Vec3>> {
    prop::collection::vec((number(), number(), number()).prop_map(Vec3::from), count)
}

/// Corners as indices into pools of 8.
fn faces() -> impl Strategy<Value = Vec<Vec<[usize; 3]>>> {
    let corner = prop::array::uniform3(0..8_usize);
    prop::collection::vec(prop::collection::vec(corner, 3..6), 1..12)
}

fn obj_text(v: &[Vec3], vt: &[Vec3], vn: &[Vec3], faces: &[Vec<[usize; 3]>], back: bool) -> String {
    let mut text = String::from("o one\n");
    v.iter().for_each(|p| writeln!(text, "v {} {} {}", p.x, p.y, p.z).expect("memory"));
    vt.iter().for_each(|p| writeln!(text, "vt {} {}", p.x, p.y).expect("memory"));
    vn.iter().for_each(|p| writeln!(text, "vn {} {} {}", p.x, p.y, p.z).expect("memory"));
    for face in faces {
        text.push('f');
        for corner in face {
            let [v, t, n] = corner.map(|i| if back { i as i64 - 8 } else { i as i64 + 1 });
            write!(text, " {v}/{t}/{n}").expect("memory");
        }
        text.push('\n');
    }
    text
}

fn by_tobj(text: &str) -> Mesh {
    let options = tobj::LoadOptions { triangulate: true, single_index: true, ..Default::default() };
    let (models, _) = tobj::load_obj_buf(&mut text.as_bytes(), &options, |_| Ok(Default::default())).expect("sound");
    let mesh = &models[0].mesh;
    let three = |v: &[f32]| v.chunks_exact(3).map(Vec3::from_slice).collect::<Vec<_>>();
    Mesh {
        positions: three(&mesh.positions),
        normals: three(&mesh.normals).into_iter().map(Vec3::normalize).collect(),
        uvs: mesh.texcoords.chunks_exact(2).map(Vec2::from_slice).collect(),
        triangles: mesh.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
    }
}

/// The reader of the other crate, with polygons cut into fans as ours are.
fn by_ply_rs(bytes: &[u8]) -> Mesh {
    let ply = Parser::<DefaultElement>::new().read_ply(&mut &bytes[..]).expect("sound");
    let get = |e: &DefaultElement, name: &str| e[name].to_f32_lossy().expect("a number");
    let vertices = &ply.payload["vertex"];
    let fan = |e: &DefaultElement| match &e["vertex_indices"] {
        Property::ListInt(list) => {
            list.windows(2).skip(1).map(|w| [list[0] as u32, w[0] as u32, w[1] as u32]).collect::<Vec<_>>()
        }
        other => panic!("{other:?}"),
    };
    Mesh {
        positions: vertices.iter().map(|e| Vec3::new(get(e, "x"), get(e, "y"), get(e, "z"))).collect(),
        uvs: vertices.iter().map(|e| Vec2::new(get(e, "u"), get(e, "v"))).collect(),
        triangles: ply.payload["face"].iter().flat_map(fan).collect(),
        normals: Vec::new(),
    }
}

/// The triangles that our readers keep.
fn with_area(mut mesh: Mesh) -> Mesh {
    let p = mesh.positions.clone();
    mesh.triangles.retain(|t| {
        let [a, b, c] = t.map(|i| p[i as usize].as_dvec3());
        (b - a).cross(c - a) != glam::DVec3::ZERO
    });
    mesh
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn obj_as_tobj(v in vectors(8), vt in vectors(8), vn in vectors(8), faces in faces(), back: bool) {
        prop_assume!(vn.iter().all(|n| n.length() > 1e-3));
        let text = obj_text(&v, &vt, &vn, &faces, back);
        let expected = with_area(by_tobj(&text));
        prop_assume!(!expected.triangles.is_empty());
        prop_assert_eq!(nephroid::io::obj::parse(text.as_bytes(), false).expect("sound").value, expected);
    }

    #[test]
    fn ply_as_ply_rs(v in vectors(8), vt in vectors(8), faces in faces(), encoding in 1..3_usize) {
        let count = faces.len();
        let header = format!(
            "element vertex 8\nproperty float x\nproperty float y\nproperty float z\nproperty float u\nproperty float v\n\
             element face {count}\nproperty list uchar int vertex_indices\n"
        );
        // The other reader wants an element a line in ASCII, which `file` does not write.
        let encoding = ENCODINGS[encoding];
        let numbers = v.iter().zip(&vt).flat_map(|(p, t)| [p.x, p.y, p.z, t.x, t.y]).map(Value::F32);
        let lists = faces.iter().flat_map(|f| {
            std::iter::once(Value::U8(f.len() as u8)).chain(f.iter().map(|c| Value::I32(c[0] as i32)))
        });
        let bytes = file(encoding, &header, &numbers.chain(lists).collect::<Vec<_>>());
        let expected = with_area(by_ply_rs(&bytes));
        prop_assume!(!expected.triangles.is_empty());
        prop_assert_eq!(nephroid::io::ply::parse(&bytes, false).expect("sound").value, expected);
    }
}
