//! PNG out: display-referred, 8 or 16 bits, sRGB.
//!
//! value = round(max · OETF(clamp(2^exposure · L, 0, 1))) with sRGB's transfer function
//! [IEC 61966-2-1] and no other tone curve: what is brighter than white is white, and colours do
//! not shift. Not-a-number is black.

use super::exr::ImageFile;
use super::fault::{Fault, io_fault};
use super::image::{linear_to_srgb, one_line};
use ::image::codecs::png::{CompressionType, FilterType, PngEncoder};
use ::image::{ExtendedColorType, ImageEncoder};
use std::io::Write;

/// How linear radiance becomes the numbers of a PNG.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PngOptions {
    /// Stops: radiance is multiplied by 2^exposure.
    pub exposure: f32,
    /// 16 bits per channel instead of 8.
    pub sixteen_bits: bool,
}

impl Default for PngOptions {
    fn default() -> Self {
        Self { exposure: 0.0, sixteen_bits: false }
    }
}

/// The PNG value, of 0 … `max`, of a linear value already multiplied by the exposure.
pub fn quantize(linear: f32, max: f32) -> f32 {
    // NaN fails the comparison, and so is black.
    let shown = if linear > 0.0 { linear.min(1.0) } else { 0.0 };
    (linear_to_srgb(shown) * max).round()
}

/// Writes the beauty layer.
pub(super) fn write(mut out: impl Write, file: &ImageFile, options: PngOptions) -> Result<(), Fault> {
    let pixels = file.rgb("").ok_or_else(|| Fault::new("the image has no channels R, G, B to write as PNG"))?;
    if pixels.len() != file.width as usize * file.height as usize {
        return Err(Fault::new(format!("the channels do not have {} × {} samples", file.width, file.height)));
    }
    let factor = options.exposure.exp2();
    let values = pixels.iter().flatten().map(|&x| x * factor);
    let (bytes, kind): (Vec<u8>, _) = if options.sixteen_bits {
        // The encoder takes 16-bit samples in the byte order of the machine.
        (values.flat_map(|x| (quantize(x, 65535.0) as u16).to_ne_bytes()).collect(), ExtendedColorType::Rgb16)
    } else {
        (values.map(|x| quantize(x, 255.0) as u8).collect(), ExtendedColorType::Rgb8)
    };
    let mut encoded = Vec::new();
    let encoder = PngEncoder::new_with_quality(&mut encoded, CompressionType::Default, FilterType::Adaptive);
    encoder.write_image(&bytes, file.width, file.height, kind).map_err(|e| Fault::new(one_line(&e.to_string())))?;
    out.write_all(&encoded).map_err(io_fault)
}
