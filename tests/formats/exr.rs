//! OpenEXR out and in again, and as textures.

use exr::prelude::*;
use nephroid::io::exr::{ImageFile, parse_file};
use nephroid::io::write::{read_image, write_image};
use std::io::Cursor;
use std::path::Path;

fn sample() -> ImageFile {
    let mut file = ImageFile::new(5, 3);
    let pixels: Vec<[f32; 3]> = (0..15).map(|i| [i as f32, -0.1 * i as f32, 1e-30 * i as f32]).collect();
    file.insert_rgb("", &pixels);
    file.insert_rgb("variance", &pixels.iter().map(|p| p.map(|x| x * x)).collect::<Vec<_>>());
    file.channels.insert("samples.Y".into(), vec![7.5; 15]);
    for (k, v) in
        [("scene", "blake3:12ab"), ("estimator", "bidirectional"), ("command", "nephroid render Größe.xml"), ("empty", "")]
    {
        file.attributes.insert(format!("nephroid.{k}"), v.into());
    }
    file.attributes.insert("comments".into(), "a comment".into());
    file.attributes.insert("software".into(), "nephroid".into());
    file.attributes.insert("nephroid.long".into(), "x".repeat(5000));
    file
}

#[test]
fn all_layers_and_attributes_come_back_bit_for_bit() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("out.exr");
    let file = sample();
    write_image(&path, &file, Default::default()).expect("written");
    let back = read_image(&path).expect("read");
    assert_eq!(back, file);
    assert_eq!(back.rgb("variance").expect("a layer")[2], [4.0, 0.2_f32 * 0.2, (2e-30_f32) * (2e-30_f32)]);
    assert_eq!(back.rgb("samples").expect("grey")[0], [7.5; 3]);
    assert!(back.rgb("albedo").is_none());
    // The same image gives the same bytes.
    let first = std::fs::read(&path).expect("readable");
    write_image(&path, &file, Default::default()).expect("written");
    assert!(std::fs::read(&path).expect("readable") == first);
}

#[test]
fn not_a_number_and_infinity_survive() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("out.exr");
    let mut file = ImageFile::new(1, 1);
    file.insert_rgb("", &[[f32::NAN, f32::INFINITY, -0.0]]);
    write_image(&path, &file, Default::default()).expect("written");
    let [r, g, b] = read_image(&path).expect("read").rgb("").expect("beauty")[0];
    assert!(r.is_nan() && g == f32::INFINITY && b.to_bits() == (-0.0_f32).to_bits());
}

fn encoded(channels: Vec<(&str, FlatSamples)>, compression: Compression, blocks: Blocks) -> Vec<u8> {
    let list = channels.into_iter().map(|(n, s)| AnyChannel::new(n, s)).collect();
    let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
    let image = Image::from_layer(Layer::new((2, 2), LayerAttributes::default(), encoding, AnyChannels::sort(list)));
    let mut out = Cursor::new(Vec::new());
    image.write().to_buffered(&mut out).expect("encodable");
    out.into_inner()
}

fn texture(bytes: &[u8]) -> nephroid::describe::Image {
    nephroid::io::image::parse(bytes, Path::new("x.png"), false).expect("a texture").value
}

#[test]
fn textures_take_colour_or_luminance_of_any_sample_type() {
    let f32s = |o: f32| FlatSamples::F32((0..4).map(|i| i as f32 + o).collect());
    let f16s = |o: f32| FlatSamples::F16((0..4).map(|i| f16::from_f32(i as f32 + o)).collect());
    let u32s = |o: u32| FlatSamples::U32((0..4).map(|i| i + o).collect());
    let blocks = [Blocks::ScanLines, Blocks::Tiles(Vec2(1, 1))];
    let compressions = [Compression::Uncompressed, Compression::RLE, Compression::ZIP1, Compression::ZIP16, Compression::PIZ];
    for (compression, block) in compressions.iter().flat_map(|c| blocks.iter().map(move |b| (*c, *b))) {
        let list = vec![("R", f32s(0.0)), ("G", f16s(10.0)), ("B", u32s(20)), ("A", f32s(99.0)), ("depth.Z", f32s(50.0))];
        let image = texture(&encoded(list, compression, block));
        assert_eq!((image.width, image.height, image.channels), (2, 2, 3));
        assert_eq!(image.data, [0.0, 10.0, 20.0, 1.0, 11.0, 21.0, 2.0, 12.0, 22.0, 3.0, 13.0, 23.0]);
    }
    let plain = |list| texture(&encoded(list, Compression::ZIP16, Blocks::ScanLines));
    assert_eq!(plain(vec![("Y", f16s(0.5)), ("A", f16s(1.0))]).data, [0.5, 1.5, 2.5, 3.5]);
    assert_eq!(plain(vec![("mask", f32s(3.0))]).data, [3.0, 4.0, 5.0, 6.0]);
    let named = plain(vec![("beauty.R", f32s(0.0)), ("beauty.G", f32s(0.0)), ("beauty.B", f32s(0.0)), ("n.X", f32s(9.0))]);
    assert_eq!((named.channels, named.data[3]), (3, 1.0));
}

#[test]
fn a_texture_without_colours_lists_its_channels() {
    let f32s = || FlatSamples::F32(vec![0.0; 4]);
    let bytes = encoded(vec![("N.X", f32s()), ("N.Z", f32s())], Compression::ZIP16, Blocks::ScanLines);
    let message = nephroid::io::image::parse(&bytes, Path::new("x"), false).expect_err("no colours").to_string();
    assert!(message.contains("no channels R, G, B or Y") && message.contains("N.X, N.Z"), "{message}");
}

#[test]
fn damage_is_a_one_line_fault() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("out.exr");
    write_image(&path, &sample(), Default::default()).expect("written");
    let bytes = std::fs::read(&path).expect("readable");
    for length in [4, 5, 100, 400, bytes.len() - 1] {
        let message = parse_file(&bytes[..length]).expect_err("cut off").to_string();
        assert!(!message.contains('\n') && message.len() < 300, "{message:?}");
    }
    let mut text = b"\x76\x2f\x31\x01".to_vec();
    text.extend(b"this is no exr file at all, but a text that pretends to be one");
    let message = parse_file(&text).expect_err("text").to_string();
    assert!(!message.contains('\n') && message.contains("is not a sound EXR file"), "{message:?}");
}
