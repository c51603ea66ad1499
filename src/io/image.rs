//! Pictures (PNG, JPEG, BMP, TGA, Radiance HDR, OpenEXR) into linear images.
//!
//! The format is told by the first bytes of the file, not by its name (TGA has no such bytes and
//! needs its name). Integers are divided by their maximum and, unless `raw`, decoded from sRGB
//! [IEC 61966-2-1]: c ≤ 0.04045: c/12.92, else ((c + 0.055)/1.055)^2.4. HDR and EXR are linear as
//! they stand. Alpha is dropped without being multiplied in, as Mitsuba's bitmap texture does.
//!
//! Sizes are checked against [`MAX_SIDE`], [`MAX_PIXELS`] and, where the format bounds its
//! compression, against the length of the file before anything is allocated.

use super::exr;
use super::fault::{Decoded, Fault, guarded, reason};
use crate::describe::Image;
use ::image::codecs::hdr::HdrDecoder;
use ::image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader, Limits};
use std::io::Cursor;
use std::path::Path;

/// Largest width and height of an image that is read.
pub const MAX_SIDE: u32 = 1 << 15;
/// Largest number of pixels of an image that is read (3.2 GB as three f32 each).
pub const MAX_PIXELS: u64 = 1 << 28;

/// Decodes an image. `path` is looked at for its extension only.
pub fn parse(bytes: &[u8], path: &Path, raw: bool) -> Result<Decoded<Image>, Fault> {
    if bytes.is_empty() {
        return Err(Fault::new("is empty"));
    }
    if exr::is_exr(bytes) {
        return guarded(|| exr::parse_image(bytes));
    }
    let format = format_of(bytes, path)?;
    let value = to_linear(guarded(|| decode(bytes, format))?, raw);
    Ok(Decoded { value, warnings: Vec::new() })
}

/// The format by content; the name decides for TGA only.
fn format_of(bytes: &[u8], path: &Path) -> Result<ImageFormat, Fault> {
    let known = "known are PNG, JPEG, BMP, TGA, HDR and EXR";
    let is_tga = || path.extension().is_some_and(|e| e.eq_ignore_ascii_case("tga"));
    match ::image::guess_format(bytes) {
        Ok(f @ (ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::Bmp | ImageFormat::Hdr)) => Ok(f),
        Ok(other) => {
            let name = other.extensions_str().first().copied().unwrap_or("?").to_uppercase();
            Err(Fault::new(format!("is a {name} image, which is not supported")).hint(known))
        }
        Err(_) if bytes.starts_with(b"#?RGBE") => Ok(ImageFormat::Hdr),
        Err(_) if is_tga() => Ok(ImageFormat::Tga),
        Err(_) => Err(Fault::new("is not an image of a known format").hint(known)),
    }
}

fn decode(bytes: &[u8], format: ImageFormat) -> Result<DynamicImage, Fault> {
    if format == ImageFormat::Hdr {
        // The lenient form also takes the signature `#?RGBE`, which Mitsuba writes.
        let decoder = HdrDecoder::new_nonstrict(Cursor::new(bytes)).map_err(image_fault)?;
        let (width, height) = decoder.dimensions();
        check_size(u64::from(width), u64::from(height))?;
        return DynamicImage::from_decoder(decoder).map_err(image_fault);
    }
    let (width, height) = ImageReader::with_format(Cursor::new(bytes), format).into_dimensions().map_err(image_fault)?;
    check_size(u64::from(width), u64::from(height))?;
    // Deflate cannot expand more than 1032 times, and a pixel has at least one bit.
    let fewest = u64::from(width) * u64::from(height) / 8 / 1032;
    if format == ImageFormat::Png && fewest > bytes.len() as u64 {
        let what = format!("claims {width} × {height} pixels, which cannot come out of {} bytes", bytes.len());
        return Err(Fault::new(what).hint("the file is cut off or made to exhaust memory"));
    }
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(MAX_PIXELS * 16);
    reader.limits(limits);
    reader.decode().map_err(image_fault)
}

/// Refuses images without pixels and images beyond the limits.
pub(super) fn check_size(width: u64, height: u64) -> Result<(), Fault> {
    if width == 0 || height == 0 {
        return Err(Fault::new(format!("has no pixels ({width} × {height})")));
    }
    let side = u64::from(MAX_SIDE);
    if width > side || height > side || width * height > MAX_PIXELS {
        let limit = format!("the limit is {MAX_SIDE} pixels a side and {MAX_PIXELS} in all");
        return Err(Fault::new(format!("has {width} × {height} pixels, too many to read")).hint(limit));
    }
    Ok(())
}

fn image_fault(e: ImageError) -> Fault {
    let text = match &e {
        ImageError::IoError(io) => reason(io),
        other => other.to_string(),
    };
    Fault::new(format!("cannot be decoded: {}", one_line(&text)))
}

/// Other people's messages, on one line and without control characters.
pub(super) fn one_line(text: &str) -> String {
    let words: Vec<&str> = text.split(|c: char| c.is_whitespace() || c.is_control()).filter(|w| !w.is_empty()).collect();
    words.join(" ").trim_end_matches('.').to_owned()
}

/// Grey or RGB in f32, alpha dropped, integers decoded.
fn to_linear(picture: DynamicImage, raw: bool) -> Image {
    let (width, height) = (picture.width(), picture.height());
    let of8 = |v: &[u8], stride: usize, keep: usize| {
        let table: Vec<f32> = (0..256).map(|i| decoded(i as f32 / 255.0, raw)).collect();
        pick(v, stride, keep, |x| table[usize::from(x)])
    };
    let of16 = |v: &[u16], stride: usize, keep: usize| pick(v, stride, keep, |x| decoded(f32::from(x) / 65535.0, raw));
    let (channels, data) = match &picture {
        DynamicImage::ImageLuma8(p) => (1, of8(p, 1, 1)),
        DynamicImage::ImageLumaA8(p) => (1, of8(p, 2, 1)),
        DynamicImage::ImageRgb8(p) => (3, of8(p, 3, 3)),
        DynamicImage::ImageRgba8(p) => (3, of8(p, 4, 3)),
        DynamicImage::ImageLuma16(p) => (1, of16(p, 1, 1)),
        DynamicImage::ImageLumaA16(p) => (1, of16(p, 2, 1)),
        DynamicImage::ImageRgb16(p) => (3, of16(p, 3, 3)),
        DynamicImage::ImageRgba16(p) => (3, of16(p, 4, 3)),
        DynamicImage::ImageRgba32F(p) => (3, pick(p, 4, 3, |x| x)),
        // Rgb32F, and whatever the crate may add.
        other => (3, other.to_rgb32f().into_raw()),
    };
    Image { width, height, channels, data }
}

/// The first `keep` of every `stride` samples.
fn pick<T: Copy>(samples: &[T], stride: usize, keep: usize, f: impl Fn(T) -> f32) -> Vec<f32> {
    let mut out = Vec::with_capacity(samples.len() / stride * keep);
    for pixel in samples.chunks_exact(stride) {
        out.extend(pixel[..keep].iter().map(|&x| f(x)));
    }
    out
}

fn decoded(c: f32, raw: bool) -> f32 {
    if raw { c } else { srgb_to_linear(c) }
}

/// sRGB's electro-optical transfer function [IEC 61966-2-1].
pub fn srgb_to_linear(c: f32) -> f32 {
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

/// Its inverse.
pub fn linear_to_srgb(c: f32) -> f32 {
    if c <= 0.003_130_8 { c * 12.92 } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 }
}
