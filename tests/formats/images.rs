//! Pictures in: PNG, JPEG, BMP, TGA, HDR.

use image::{DynamicImage, ImageBuffer, ImageFormat, Luma, LumaA, Rgb, Rgba};
use nephroid::describe::Image;
use nephroid::io::image::{linear_to_srgb, parse, srgb_to_linear};
use std::io::Cursor;
use std::path::Path;

fn bytes(picture: impl Into<DynamicImage>, format: ImageFormat) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    picture.into().write_to(&mut out, format).expect("encodable");
    out.into_inner()
}

fn read(bytes: &[u8], raw: bool) -> Image {
    parse(bytes, Path::new("no name"), raw).expect("a sound image").value
}

fn fault(bytes: &[u8], name: &str) -> String {
    let message = parse(bytes, Path::new(name), false).expect_err("a broken image").to_string();
    assert!(!message.contains('\n') && message.len() < 300, "{message:?}");
    message
}

fn rgba() -> ImageBuffer<Rgba<u8>, Vec<u8>> {
    ImageBuffer::from_raw(2, 1, vec![10, 100, 200, 50, 255, 0, 128, 255]).expect("right size")
}

#[test]
fn srgb_is_decoded_and_alpha_dropped() {
    let file = bytes(rgba(), ImageFormat::Png);
    let raw = read(&file, true);
    assert_eq!((raw.width, raw.height, raw.channels), (2, 1, 3));
    let expected = [10.0, 100.0, 200.0, 255.0, 0.0, 128.0].map(|x: f32| x / 255.0);
    assert_eq!(raw.data, expected);
    assert_eq!(read(&file, false).data, expected.map(srgb_to_linear));
    for c in 0..=1000 {
        let c = c as f32 / 1000.0;
        approx::assert_abs_diff_eq!(linear_to_srgb(srgb_to_linear(c)), c, epsilon = 1e-5);
    }
    // The values Mitsuba 3.9.1 decodes from the same PNG.
    approx::assert_abs_diff_eq!(srgb_to_linear(10.0 / 255.0), 0.003_035_27, epsilon = 1e-7);
    approx::assert_abs_diff_eq!(srgb_to_linear(128.0 / 255.0), 0.215_860_5, epsilon = 1e-6);
}

#[test]
fn grey_stays_one_channel_and_sixteen_bits_are_kept() {
    let grey = ImageBuffer::<Luma<u8>, _>::from_raw(1, 2, vec![0_u8, 51]).expect("right size");
    let image = read(&bytes(grey, ImageFormat::Png), true);
    assert_eq!((image.width, image.height, image.channels, image.data), (1, 2, 1, vec![0.0, 0.2]));
    let grey = ImageBuffer::<LumaA<u16>, _>::from_raw(1, 1, vec![257_u16 * 10, 3]).expect("right size");
    let image = read(&bytes(grey, ImageFormat::Png), true);
    assert_eq!((image.channels, image.data), (1, vec![10.0 / 255.0]));
    let colour = ImageBuffer::<Rgb<u16>, _>::from_raw(1, 1, vec![1_u16, 2, 65535]).expect("right size");
    assert_eq!(read(&bytes(colour, ImageFormat::Png), true).data, [1.0 / 65535.0, 2.0 / 65535.0, 1.0]);
}

#[test]
fn other_formats_hold_the_same_picture() {
    let rgb = DynamicImage::from(rgba()).to_rgb8();
    let expected = read(&bytes(rgb.clone(), ImageFormat::Png), false);
    assert_eq!(read(&bytes(rgb.clone(), ImageFormat::Bmp), false), expected);
    let tga = bytes(rgb, ImageFormat::Tga);
    assert_eq!(parse(&tga, Path::new("x.TGA"), false).expect("sound").value, expected);
    let smooth = ImageBuffer::from_fn(16, 16, |x, y| Rgb([8 * x as u8, 8 * y as u8, 100]));
    let (jpeg, png) = (read(&bytes(smooth.clone(), ImageFormat::Jpeg), true), read(&bytes(smooth, ImageFormat::Png), true));
    let worst = jpeg.data.iter().zip(&png.data).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(worst < 0.05, "{worst}");
}

#[test]
fn radiance_is_linear() {
    let picture = ImageBuffer::<Rgb<f32>, _>::from_raw(2, 1, vec![0.1_f32, 1.0, 2.0, 2.5, 0.0, 1.25]).expect("right size");
    let file = bytes(picture, ImageFormat::Hdr);
    // The other signature.
    let renamed = [b"#?RGBE\n", file.strip_prefix(b"#?RADIANCE\n").expect("the signature")].concat();
    for (file, raw) in [(&file, false), (&file, true), (&renamed, false)] {
        let image = read(file, raw);
        assert_eq!((image.width, image.height, image.channels), (2, 1, 3));
        for (x, e) in image.data.iter().zip([0.1_f32, 1.0, 2.0, 2.5, 0.0, 1.25]) {
            approx::assert_abs_diff_eq!(*x, e, epsilon = 0.01);
        }
    }
}

#[test]
fn the_content_tells_the_format_not_the_name() {
    let file = bytes(rgba(), ImageFormat::Png);
    assert!(parse(&file, Path::new("x.jpg"), false).is_ok());
    assert!(fault(b"hello, I am text", "x.exr").contains("not an image of a known format"));
    assert!(fault(b"", "x.png").contains("is empty"));
    assert!(fault(b"GIF89a\0\0\0\0", "x.png").contains("is a GIF image, which is not supported"));
}

/// The header of a PNG that claims a size.
fn png_of(width: u32, height: u32) -> Vec<u8> {
    let mut ihdr = b"IHDR".to_vec();
    ihdr.extend(width.to_be_bytes());
    ihdr.extend(height.to_be_bytes());
    ihdr.extend([8, 2, 0, 0, 0]);
    let mut crc = flate2::Crc::new();
    crc.update(&ihdr);
    let mut file = b"\x89PNG\r\n\x1a\n\0\0\0\x0d".to_vec();
    file.extend(&ihdr);
    file.extend(crc.sum().to_be_bytes());
    file.extend(b"\0\0\0\0IDAT\x35\xaf\x06\x1e\0\0\0\0IEND\xae\x42\x60\x82");
    file
}

#[test]
fn bombs_are_refused_at_once() {
    assert!(fault(&png_of(60_000, 60_000), "x.png").contains("60000 × 60000 pixels, too many to read"));
    assert!(fault(&png_of(16_000, 16_000), "x.png").contains("cannot come out of"));
    assert!(fault(&png_of(4, 4), "x.png").contains("cannot be decoded"));
    fault(&png_of(0, 4), "x.png");
}

#[test]
fn damaged_files_are_one_line_faults() {
    let picture = ImageBuffer::from_fn(40, 40, |x, y| Rgb([x as u8, y as u8, (x * y) as u8]));
    for format in [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::Bmp] {
        let file = bytes(picture.clone(), format);
        fault(&file[..12], "x");
        if format != ImageFormat::Jpeg {
            fault(&file[..file.len() / 2], "x");
        }
    }
}
