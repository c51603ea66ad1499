//! Random damage: whatever is cut off or overwritten, a reader returns in little time and memory.
//!
//! That it returns at all is the test: a panic or an allocation beyond the machine would end the
//! process. What it returns must be consistent: all indices exist, all numbers are finite.

use crate::{ply, serialized};
use nephroid::describe::{Image, Mesh};
use nephroid::io::fault::{Decoded, Fault};
use nephroid::io::{exr, image, obj};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use std::path::Path;

/// Cuts a file at a random place and overwrites some bytes, preferring values that hurt.
fn damage(file: &[u8], cut: Option<u16>, edits: &[(u16, u8)]) -> Vec<u8> {
    let mut bytes = file.to_vec();
    if let Some(cut) = cut {
        bytes.truncate(usize::from(cut) % (file.len() + 1));
    }
    for &(at, value) in edits {
        let length = bytes.len().max(1);
        if let Some(byte) = bytes.get_mut(usize::from(at) % length) {
            *byte = value;
        }
    }
    bytes
}

fn edits() -> impl Strategy<Value = (Option<u16>, Vec<(u16, u8)>)> {
    let value = prop_oneof![any::<u8>(), Just(0), Just(255), Just(127), Just(b'-'), Just(b'9'), Just(b'\n'), Just(b' ')];
    (prop::option::weighted(0.3, any::<u16>()), prop::collection::vec((any::<u16>(), value), 0..6))
}

fn check_mesh(result: Result<Decoded<Mesh>, Fault>) {
    match result {
        Ok(decoded) => {
            let m = decoded.value;
            assert!(!m.triangles.is_empty() && m.triangles.iter().flatten().all(|&i| (i as usize) < m.positions.len()));
            assert!(m.positions.iter().chain(&m.normals).all(|v| v.is_finite()) && m.uvs.iter().all(|v| v.is_finite()));
            assert!(m.normals.is_empty() || m.normals.len() == m.positions.len());
            assert!(m.uvs.is_empty() || m.uvs.len() == m.positions.len());
        }
        Err(fault) => check_fault(&fault),
    }
}

fn check_image(result: Result<Decoded<Image>, Fault>) {
    match result {
        Ok(Decoded { value: i, .. }) => assert_eq!(i.data.len(), i.width as usize * i.height as usize * i.channels as usize),
        Err(fault) => check_fault(&fault),
    }
}

fn check_fault(fault: &Fault) {
    let text = fault.to_string();
    assert!(text.len() < 600 && !text.chars().any(char::is_control), "{text:?}");
}

const OBJ: &str = "# a square\no a\nv 0 0 0\nv 1 0 0\nv 1 1 0 1\nv 0 1 0\nvt 0 0\nvt 1 1\nvn 0 0 1\n\
                   f 1/1/1 2/2/1 3/1/1\nf -4//1 -2//-1 -1//1 \\\n 2//1\nusemtl x\nf 1 2 3 4\n";

fn ply_file(encoding: &str) -> Vec<u8> {
    use ply::Value::*;
    let header = "element vertex 4\nproperty float x\nproperty float y\nproperty double z\nproperty float u\nproperty float v\n\
                  element face 2\nproperty list uchar int vertex_indices\nelement edge 1\nproperty list uint uchar e\n";
    let vertices = (0..4).flat_map(|i| [F32((i & 1) as f32), F32((i >> 1) as f32), F64(0.5), F32(0.1), F32(0.2)]);
    let faces = [U8(3), I32(0), I32(1), I32(2), U8(4), I32(3), I32(2), I32(1), I32(0), U32(1), U8(9)];
    ply::file(encoding, header, &vertices.chain(faces).collect::<Vec<_>>())
}

/// The same gradient in every format that is read.
fn pictures() -> Vec<Vec<u8>> {
    use ::image::{DynamicImage, ImageFormat, Rgb, Rgb32FImage, RgbImage, RgbaImage};
    let small = DynamicImage::from(RgbImage::from_fn(9, 7, |x, y| Rgb([(20 * x) as u8, (30 * y) as u8, 77])));
    let float = DynamicImage::from(Rgb32FImage::from_fn(9, 7, |x, y| Rgb([x as f32, y as f32, 0.5])));
    let alpha = DynamicImage::from(RgbaImage::from_pixel(5, 5, ::image::Rgba([1, 2, 3, 4])));
    let encode = |p: &DynamicImage, format| {
        let mut out = std::io::Cursor::new(Vec::new());
        p.write_to(&mut out, format).expect("encodable");
        out.into_inner()
    };
    let formats = [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::Bmp, ImageFormat::Tga];
    let mut all: Vec<Vec<u8>> = formats.iter().map(|&f| encode(&small, f)).collect();
    all.extend([encode(&alpha, ImageFormat::Png), encode(&alpha, ImageFormat::Tga), encode(&float, ImageFormat::Hdr)]);
    all.extend(exr_files());
    all
}

/// The gradient in the compressions of EXR, in rows and in tiles.
fn exr_files() -> Vec<Vec<u8>> {
    use ::exr::prelude::*;
    let plane = |n: &str, s: f32| AnyChannel::new(n, FlatSamples::F32((0..63).map(|i| s * i as f32).collect()));
    let compressions = [Compression::Uncompressed, Compression::RLE, Compression::ZIP16, Compression::PIZ, Compression::PXR24];
    let blocks = [Blocks::ScanLines, Blocks::Tiles(Vec2(4, 4))];
    let all = compressions.iter().flat_map(|c| blocks.iter().map(move |b| (*c, *b)));
    all.map(|(compression, blocks)| {
        let channels = AnyChannels::sort([plane("R", 1.0), plane("G", 0.5), plane("B", -1.0)].into_iter().collect());
        let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
        let image = Image::from_layer(Layer::new((9, 7), LayerAttributes::named("a"), encoding, channels));
        let mut out = std::io::Cursor::new(Vec::new());
        image.write().to_buffered(&mut out).expect("encodable");
        out.into_inner()
    })
    .collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn obj_survives(e in edits(), flip: bool) {
        check_mesh(obj::parse(&damage(OBJ.as_bytes(), e.0, &e.1), flip));
    }

    #[test]
    fn ply_survives(e in edits(), encoding in 0..3_usize, flip: bool) {
        check_mesh(nephroid::io::ply::parse(&damage(&ply_file(ply::ENCODINGS[encoding]), e.0, &e.1), flip));
    }

    #[test]
    fn serialized_survives(e in edits(), double: bool, shape in 0..3_u32) {
        let content = serialized::Content { double, normals: true, uvs: true, shapes: 2, ..serialized::PLAIN };
        check_mesh(nephroid::io::serialized::parse(&damage(&serialized::file(content), e.0, &e.1), shape, false));
    }

    #[test]
    fn bytes_without_meaning_survive(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        check_mesh(obj::parse(&bytes, false));
        check_mesh(nephroid::io::ply::parse(&bytes, false));
        check_mesh(nephroid::io::serialized::parse(&bytes, 0, false));
        check_image(image::parse(&bytes, Path::new("x.tga"), false));
    }
}

#[test]
fn pictures_survive() {
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    for file in pictures() {
        check_image(image::parse(&file, Path::new("x.tga"), false));
        for _ in 0..600 {
            let e = edits().new_tree(&mut runner).expect("a sample").current();
            let bytes = damage(&file, e.0, &e.1);
            check_image(image::parse(&bytes, Path::new("x.tga"), false));
            if exr::is_exr(&bytes)
                && let Err(fault) = exr::parse_file(&bytes)
            {
                check_fault(&fault);
            }
        }
    }
}
