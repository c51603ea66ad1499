//! Mitsuba's serialized meshes, versions 3 and 4.

use flate2::{Compression, write::ZlibEncoder};
use glam::{Vec2, Vec3};
use nephroid::describe::Mesh;
use nephroid::io::serialized::parse;
use std::io::Write;

/// What goes into a test file.
#[derive(Clone, Copy)]
pub struct Content {
    pub version: u16,
    pub double: bool,
    pub normals: bool,
    pub uvs: bool,
    pub colors: bool,
    pub shapes: u32,
}

pub const PLAIN: Content = Content { version: 4, double: false, normals: false, uvs: false, colors: false, shapes: 1 };

fn deflate(body: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(body).expect("memory");
    encoder.finish().expect("memory")
}

/// The inflated stream of shape number `s`: a square moved by s along every axis.
fn stream(c: Content, s: u32) -> Vec<u8> {
    let flag = |on: bool, bit: u32| if on { bit } else { 0 };
    let flags = flag(c.normals, 1) | flag(c.uvs, 2) | flag(c.colors, 8) | if c.double { 0x2000 } else { 0x1000 };
    let mut body = flags.to_le_bytes().to_vec();
    if c.version == 4 {
        body.extend(b"a name\0");
    }
    body.extend(4_u64.to_le_bytes());
    body.extend(2_u64.to_le_bytes());
    let mut number = |x: f64| match c.double {
        true => body.extend(x.to_le_bytes()),
        false => body.extend((x as f32).to_le_bytes()),
    };
    [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0].iter().for_each(|&x| number(f64::from(x + s)));
    if c.normals {
        (0..4).for_each(|_| [0.0, 0.0, 3.0].into_iter().for_each(&mut number));
    }
    if c.uvs {
        (0..8).for_each(|i| number(f64::from(i) / 8.0));
    }
    if c.colors {
        (0..12).for_each(|_| number(f64::NAN));
    }
    [0_u32, 1, 2, 0, 2, 3].iter().for_each(|i| body.extend(i.to_le_bytes()));
    body
}

fn assemble(version: u16, streams: &[Vec<u8>]) -> Vec<u8> {
    let (mut out, mut table) = (Vec::new(), Vec::new());
    for stream in streams {
        match version {
            4 => table.extend((out.len() as u64).to_le_bytes()),
            _ => table.extend((out.len() as u32).to_le_bytes()),
        }
        out.extend(0x041C_u16.to_le_bytes());
        out.extend(version.to_le_bytes());
        out.extend(deflate(stream));
    }
    out.extend(table);
    out.extend((streams.len() as u32).to_le_bytes());
    out
}

pub fn file(c: Content) -> Vec<u8> {
    assemble(c.version, &(0..c.shapes).map(|s| stream(c, s)).collect::<Vec<_>>())
}

fn mesh(bytes: &[u8], shape: u32) -> Mesh {
    let decoded = parse(bytes, shape, false).expect("a sound file");
    assert_eq!(decoded.warnings, Vec::<String>::new());
    decoded.value
}

fn fault(bytes: &[u8], shape: u32) -> String {
    parse(bytes, shape, false).expect_err("a broken file").to_string()
}

#[test]
fn all_versions_precisions_and_attributes() {
    for bits in 0..32_u32 {
        let on = |k: u32| bits >> k & 1 == 1;
        let version = if on(4) { 3 } else { 4 };
        let c = Content { version, double: on(0), normals: on(1), uvs: on(2), colors: on(3), shapes: 3 };
        for shape in [0, 2] {
            let m = mesh(&file(c), shape);
            let corner = Vec3::splat(shape as f32);
            assert_eq!(m.positions, [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y].map(|p| p + corner));
            assert_eq!(m.triangles, [[0, 1, 2], [0, 2, 3]]);
            assert_eq!(m.normals, vec![Vec3::Z; if c.normals { 4 } else { 0 }]);
            assert_eq!(m.uvs.get(1).copied(), c.uvs.then_some(Vec2::new(0.25, 0.375)));
        }
    }
}

#[test]
fn broken_files_are_told() {
    let good = file(Content { shapes: 2, ..PLAIN });
    let with = |at: usize, bytes: &[u8]| {
        let mut file = good.clone();
        file[at..at + bytes.len()].copy_from_slice(bytes);
        file
    };
    let end = good.len();
    for (bytes, shape, part) in [
        (vec![], 0, "is only 0 bytes long"),
        (b"\x1b]0;x\x07 hello".to_vec(), 0, "is not a serialized mesh (it starts with `\\u{1b}]0;`)"),
        (with(2, &[9, 0]), 0, "has version 9"),
        (good.clone(), 2, "has 2 shapes, so there is no shape 2"),
        (with(end - 4, &[0; 4]), 0, "has no table of shapes"),
        (with(end - 4, &[255; 4]), 0, "has no table of shapes"),
        (with(end - 20, &[255; 8]), 0, "cannot be"),
        (with(end - 12, &[2, 0, 0, 0, 0, 0, 0, 0]), 0, "cannot be"),
        (with(6, &[0xff; 8]), 0, "cannot be inflated"),
        (good[..end - 21].to_vec(), 0, "table"),
    ] {
        let message = fault(&bytes, shape);
        assert!(message.contains(part), "{message}\nnot\n{part}");
    }
}

#[test]
fn broken_streams_are_told() {
    let good = stream(PLAIN, 0);
    let with = |at: usize, bytes: &[u8]| {
        let mut stream = good.clone();
        stream[at..at + bytes.len()].copy_from_slice(bytes);
        assemble(4, &[stream])
    };
    let (vertices, triangles, positions, indices) = (11, 19, 27, 27 + 48);
    for (bytes, part) in [
        (with(vertices, &4_000_000_000_u64.to_le_bytes()), "cannot come out of"),
        (with(vertices, &u64::MAX.to_le_bytes()), "vertices are more than"),
        (with(triangles, &u64::MAX.to_le_bytes()), "triangles are more than"),
        (with(triangles, &100_u64.to_le_bytes()), "the stream ends in the indices: 24 of 1200 bytes"),
        (with(triangles, &0_u64.to_le_bytes()), "has no triangles"),
        (with(0, &0_u32.to_le_bytes()), "do not say whether numbers are single or double"),
        (with(positions + 12, &f32::NAN.to_le_bytes()), "the position of vertex 1"),
        (with(indices + 12, &7_u32.to_le_bytes()), "face 1: vertex index 7 is not below the number of vertices 4"),
    ] {
        let message = fault(&bytes, 0);
        assert!(message.starts_with("shape 0: ") && message.contains(part), "{message}\nnot\n{part}");
    }
}

#[test]
fn a_small_stream_that_inflates_to_much_is_read_only_as_far_as_its_counts_say() {
    let mut bomb = stream(PLAIN, 0);
    bomb.extend(vec![0; 50_000_000]);
    assert_eq!(mesh(&assemble(4, &[bomb]), 0).triangles.len(), 2);
    // A name without an end is not followed for ever.
    let mut name = 0x1000_u32.to_le_bytes().to_vec();
    name.extend(vec![b'x'; 10_000_000]);
    assert!(fault(&assemble(4, &[name]), 0).contains("name of the shape is longer"));
}
