//! Stanford PLY in its three encodings.

use glam::{Vec2, Vec3};
use nephroid::describe::Mesh;
use nephroid::io::ply::parse;

/// A value of a PLY body, with its type.
#[derive(Clone, Copy)]
pub enum Value {
    U8(u8),
    I8(i8),
    U16(u16),
    I32(i32),
    U32(u32),
    F32(f32),
    F64(f64),
}
use Value::*;

/// The bytes of a file in one of the encodings `ascii`, `binary_little_endian`, `binary_big_endian`.
pub fn file(encoding: &str, header: &str, body: &[Value]) -> Vec<u8> {
    let mut out = format!("ply\nformat {encoding} 1.0\ncomment made by a test\n{header}end_header\n").into_bytes();
    for value in body {
        if encoding == "ascii" {
            let text = match *value {
                U8(x) => x.to_string(),
                I8(x) => x.to_string(),
                U16(x) => x.to_string(),
                I32(x) => x.to_string(),
                U32(x) => x.to_string(),
                F32(x) => x.to_string(),
                F64(x) => x.to_string(),
            };
            out.extend(text.bytes().chain([b'\n']));
            continue;
        }
        let mut bytes = match *value {
            U8(x) => x.to_le_bytes().to_vec(),
            I8(x) => x.to_le_bytes().to_vec(),
            U16(x) => x.to_le_bytes().to_vec(),
            I32(x) => x.to_le_bytes().to_vec(),
            U32(x) => x.to_le_bytes().to_vec(),
            F32(x) => x.to_le_bytes().to_vec(),
            F64(x) => x.to_le_bytes().to_vec(),
        };
        if encoding == "binary_big_endian" {
            bytes.reverse();
        }
        out.extend(bytes);
    }
    out
}

pub const ENCODINGS: [&str; 3] = ["ascii", "binary_little_endian", "binary_big_endian"];
const XYZ: &str = "property float x\nproperty float y\nproperty float z\n";
const FACES: &str = "property list uchar int vertex_indices\n";

fn mesh(bytes: &[u8], flip: bool) -> Mesh {
    let decoded = parse(bytes, flip).expect("a sound file");
    assert_eq!(decoded.warnings, Vec::<String>::new());
    decoded.value
}

fn fault(bytes: &[u8]) -> String {
    let message = parse(bytes, false).expect_err("a broken file").to_string();
    assert!(!message.chars().any(char::is_control), "{message:?}");
    message
}

/// The corners of a unit square, then its faces.
fn square(faces: &[Value]) -> Vec<Value> {
    let corners = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.5, 0.0, 1.0, 0.0].map(F32);
    [&corners[..], faces].concat()
}

#[test]
fn all_encodings_and_types_give_the_same_mesh() {
    let header = "element vertex 4\nproperty uchar red\nproperty double x\nproperty float y\nproperty short z\n\
                  property float nx\nproperty float ny\nproperty float nz\nproperty list uchar float weights\nproperty float s\n\
                  property float t\nelement edge 2\nproperty int vertex1\nproperty list uchar double junk\n\
                  element face 2\nproperty uchar flag\nproperty list ushort uint vertex_index\nproperty list int8 uint8 more\n";
    let mut body = Vec::new();
    for i in 0..4_u8 {
        let (x, y) = (f32::from(i & 1), f32::from(i >> 1));
        let vertex = [U8(7), F64(f64::from(x)), F32(y), U16(0), F32(0.0), F32(0.0), F32(2.5)];
        body.extend(vertex.iter().chain(&[U8(2), F32(0.1), F32(0.2), F32(0.1 * x), F32(0.3 * y)]));
    }
    body.extend([I32(0), U8(1), F64(3.0), I32(1), U8(0)]);
    body.extend([U8(1), U16(4), U32(0), U32(1), U32(3), U32(2), I8(2), U8(1), U8(2)]);
    body.extend([U8(0), U16(3), U32(0), U32(3), U32(2), I8(0)]);
    for encoding in ENCODINGS {
        let m = mesh(&file(encoding, header, &body), true);
        assert_eq!(m.positions, [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(1.0, 1.0, 0.0)]);
        assert_eq!(m.normals, [Vec3::Z; 4]);
        let uv = |u, v: f32| Vec2::new(u, 1.0 - v);
        assert_eq!(m.uvs, [uv(0.0, 0.0), uv(0.1, 0.0), uv(0.0, 0.3), uv(0.1, 0.3)]);
        assert_eq!(m.triangles, [[0, 1, 3], [0, 3, 2], [0, 3, 2]]);
    }
}

#[test]
fn texture_coordinates_have_several_names() {
    for (u, v) in [("u", "v"), ("s", "t"), ("texture_u", "texture_v")] {
        let header = format!("element vertex 3\n{XYZ}property float {u}\nproperty float {v}\nelement face 1\n{FACES}");
        let body: Vec<Value> = [0.0, 0.0, 0.0, 0.1, 0.2, 1.0, 0.0, 0.0, 0.3, 0.4, 0.0, 1.0, 0.0, 0.5, 0.6].map(F32).to_vec();
        let body = [&body[..], &[U8(3), I32(0), I32(1), I32(2)]].concat();
        for encoding in ENCODINGS {
            let m = mesh(&file(encoding, &header, &body), false);
            assert_eq!(m.uvs, [Vec2::new(0.1, 0.2), Vec2::new(0.3, 0.4), Vec2::new(0.5, 0.6)]);
            assert!(m.normals.is_empty());
        }
    }
}

#[test]
fn faces_may_come_first_and_line_ends_may_be_of_any_system() {
    let text = "ply\r\nformat ascii 1.0\r\nelement face 1\r\nproperty list uchar int vertex_indices\r\nelement vertex 3\r\n\
                property float x\r\nproperty float y\r\nproperty float z\r\nend_header\r\n3 0 1 2\r\n0 0 0\r\n1 0 0\r\n0 1 0\r\n";
    assert_eq!(mesh(text.as_bytes(), false).triangles, [[0, 1, 2]]);
}

#[test]
fn broken_headers_are_told_with_their_line() {
    let long = "x".repeat(1000);
    for (text, part) in [
        ("", "is empty"),
        ("plx\n", "is not a PLY file (it starts with `plx\\n`)"),
        ("ply\nformat ascii 1.0\n", "the header has no `end_header`"),
        ("ply\nformat ascii 2.0\n", "line 2: `format ascii 2.0` is not a PLY header line"),
        ("ply\nformat middle_endian 1.0\n", "line 2"),
        ("ply\nelement vertex -1\n", "line 2: `element vertex -1` is not"),
        ("ply\nelement vertex 99999999999999999999\n", "does not fit in 64 bits"),
        ("ply\nproperty float x\n", "line 2"),
        ("ply\nelement vertex 1\nproperty quad x\n", "line 3"),
        ("ply\nelement vertex 1\nproperty list uchar vertex_indices\n", "line 3"),
        ("ply\n\u{1b}[2J\n", "line 2: `\\u{1b}[2J` is not"),
        (&format!("ply\n{long}\n"), "…` is not a PLY header line"),
        ("ply\nend_header\n", "has no `format` line"),
        ("ply\nformat ascii 1.0\nend_header\n", "has no element `vertex`"),
        ("ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nend_header\n", "has no property `y`"),
        ("ply\nformat ascii 1.0\nelement vertex 0\nelement vertex 0\nend_header\n", "has the element `vertex` twice"),
    ] {
        let message = fault(text.as_bytes());
        assert!(message.contains(part), "{text:?} gives\n{message}\nnot\n{part}");
    }
}

#[test]
fn counts_beyond_the_file_are_refused_before_allocating() {
    for count in ["4000000000", "4294967295", "18446744073709551615"] {
        for encoding in ENCODINGS {
            let header = format!("element vertex {count}\n{XYZ}element face 1\n{FACES}");
            let message = fault(&file(encoding, &header, &[F32(0.0); 12]));
            assert!(message.contains(&format!("announces {count} of element `vertex`, which need at least")), "{message}");
            let header = format!("element vertex 4\n{XYZ}element face {count}\n{FACES}");
            let message = fault(&file(encoding, &header, &square(&[])));
            assert!(message.contains("of element `face`"), "{message}");
        }
    }
    // Elements without properties take no bytes, and so no time either.
    let header = format!("element nothing 18446744073709551615\nelement vertex 3\n{XYZ}element face 1\n{FACES}");
    let body = [&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].map(F32)[..], &[U8(3), I32(0), I32(1), I32(2)]].concat();
    assert_eq!(mesh(&file(ENCODINGS[1], &header, &body), false).triangles.len(), 1);
    // More vertices than 32 bits can number, in a header that the file length cannot contradict.
    let header = format!("element vertex 4294967296\nelement face 1\n{FACES}");
    assert!(fault(&file(ENCODINGS[1], &header, &body)).contains("4294967296 vertices are more than"));
}

#[test]
fn broken_bodies_are_told_with_face_vertex_and_place() {
    let header = format!("element vertex 4\n{XYZ}element face 2\n{FACES}");
    let triangle = [U8(3), I32(0), I32(1), I32(2)];
    let cases: [(&[Value], &str); 4] = [
        (&[U8(3), I32(0), I32(2), I32(4)], "vertex index 4 is not below the number of vertices 4"),
        (&[U8(3), I32(0), I32(-1), I32(1)], "vertex index -1 is negative"),
        (&[U8(2), I32(0), I32(1)], "face 1 has 2 corners"),
        (&[U8(3), I32(0), I32(1)], "ends"),
    ];
    for encoding in ENCODINGS {
        for (face, part) in cases {
            let message = fault(&file(encoding, &header, &square(&[&triangle[..], face].concat())));
            assert!(message.contains(part) && message.contains("face 1"), "{encoding}: {message}");
            let place = if encoding == "ascii" { "(line " } else { "byte " };
            assert!(message.contains(place), "{encoding}: {message}");
        }
        let mut body = square(&[triangle, triangle].concat());
        body[4] = F32(f32::NAN);
        let message = fault(&file(encoding, &header, &body));
        assert!(message.contains("the position of vertex 1 (counted from 0) is not finite"), "{message}");
        let none = format!("element vertex 4\n{XYZ}element face 0\n{FACES}");
        assert!(fault(&file(encoding, &none, &square(&[]))).contains("no triangles"));
        let cloud = format!("element vertex 4\n{XYZ}");
        assert!(fault(&file(encoding, &cloud, &square(&[]))).contains("no triangles"));
    }
    let text =
        b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 abc 0\n";
    let message = fault(text);
    assert!(message.contains("vertex 0, property `y`: `abc` is not a number of the announced type (line 8)"), "{message}");
}

#[test]
fn what_follows_the_last_element_is_warned_of() {
    let header = format!("element vertex 4\n{XYZ}element face 1\n{FACES}");
    let mut bytes = file("binary_little_endian", &header, &square(&[U8(3), I32(0), I32(1), I32(2)]));
    bytes.extend([1, 2, 3]);
    let decoded = parse(&bytes, false).expect("readable");
    assert_eq!(decoded.warnings, ["3 bytes after the last element are passed over"]);
}
