//! OpenEXR: textures in, rendered images with all their layers and attributes in and out.
//!
//! A texture takes R, G, B or else luminance Y of the first part that has them (also behind a
//! layer name: `beauty.R`), whatever the sample type. [`ImageFile`] keeps every channel by its full
//! name and every text or number attribute, so that what was written can be read back whole.

use super::fault::{Decoded, Fault, io_fault};
use super::image::{check_size, one_line};
use crate::describe::Image;
use ::exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Blocks, Compression, Encoding, FlatSamples, Layer, LayerAttributes, LineOrder,
    MetaData, ReadChannels, ReadLayers, SmallVec, Text, WritableImage,
};
use std::collections::BTreeMap;
use std::io::{Cursor, Write};

/// Planes of f32 by name, with text attributes: what a rendered image file holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImageFile {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width · height` numbers each, rows from the top. Named as in the file: the beauty is
    /// `R`, `G`, `B`, another layer's channels are `layer.R` and so on.
    pub channels: BTreeMap<String, Vec<f32>>,
    /// Attributes by name; numbers are given as text.
    pub attributes: BTreeMap<String, String>,
}

impl ImageFile {
    /// An image of the given size without any channel.
    pub fn new(width: u32, height: u32) -> Self {
        Self { width, height, ..Self::default() }
    }

    /// Adds a layer of three channels; the empty name is the beauty.
    pub fn insert_rgb(&mut self, layer: &str, pixels: &[[f32; 3]]) {
        for (k, c) in ["R", "G", "B"].iter().enumerate() {
            self.channels.insert(channel_name(layer, c), pixels.iter().map(|p| p[k]).collect());
        }
    }

    /// The pixels of a layer, if it has R, G and B or else is grey (Y).
    pub fn rgb(&self, layer: &str) -> Option<Vec<[f32; 3]>> {
        let plane = |c: &str| self.channels.get(&channel_name(layer, c));
        if let Some(y) = plane("Y") {
            return Some(y.iter().map(|&y| [y; 3]).collect());
        }
        let (r, g, b) = (plane("R")?, plane("G")?, plane("B")?);
        Some(r.iter().zip(g).zip(b).map(|((&r, &g), &b)| [r, g, b]).collect())
    }
}

fn channel_name(layer: &str, channel: &str) -> String {
    if layer.is_empty() { channel.to_owned() } else { format!("{layer}.{channel}") }
}

/// Whether the bytes start as an EXR file does.
pub fn is_exr(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01])
}

type Flat = ::exr::prelude::FlatImage;

/// Reads everything after looking at the sizes in the header.
fn read(bytes: &[u8]) -> Result<Flat, Fault> {
    let bad = |e: ::exr::error::Error| Fault::new(format!("is not a sound EXR file: {}", one_line(&e.to_string())));
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(bad)?;
    let mut samples = 0_u64;
    for header in &meta.headers {
        if header.deep {
            return Err(Fault::new("holds deep data, which is not supported"));
        }
        let size = header.layer_size;
        check_size(size.x() as u64, size.y() as u64)?;
        if header.channels.list.iter().any(|c| c.sampling != ::exr::math::Vec2(1, 1)) {
            return Err(Fault::new("has subsampled channels, which are not supported").hint("save it as RGB"));
        }
        samples += (size.x() * size.y() * header.channels.list.len()) as u64;
        // Every chunk takes at least its entry in the offset table and its own header.
        if header.chunk_count as u64 * 16 > bytes.len() as u64 {
            let what = format!("claims {} chunks, but has only {} bytes", header.chunk_count, bytes.len());
            return Err(Fault::new(what).hint("the file is cut off"));
        }
    }
    check_samples(samples)?;
    let reader = ::exr::prelude::read().no_deep_data().largest_resolution_level().all_channels().all_layers().all_attributes();
    reader.from_buffered(Cursor::new(bytes)).map_err(bad)
}

fn check_samples(samples: u64) -> Result<(), Fault> {
    let most = super::image::MAX_PIXELS * 4;
    if samples > most {
        return Err(Fault::new(format!("has {samples} samples in all its channels, too many to read"))
            .hint(format!("the limit is {most}")));
    }
    Ok(())
}

/// Reads a texture.
pub(super) fn parse_image(bytes: &[u8]) -> Result<Decoded<Image>, Fault> {
    let file = read(bytes)?;
    for layer in &file.layer_data {
        let list = &layer.channel_data.list;
        let Some(chosen) = colour_channels(list) else { continue };
        let (width, height) = (layer.size.x(), layer.size.y());
        let mut data = vec![0.0; width * height * chosen.len()];
        for (k, &c) in chosen.iter().enumerate() {
            let out = data.iter_mut().skip(k).step_by(chosen.len());
            out.zip(list[c].sample_data.values_as_f32()).for_each(|(o, v)| *o = v);
        }
        let value = Image { width: width as u32, height: height as u32, channels: chosen.len() as u32, data };
        return Ok(Decoded { value, warnings: Vec::new() });
    }
    let names: Vec<String> =
        file.layer_data.iter().flat_map(|l| &l.channel_data.list).take(12).map(|c| c.name.to_string()).collect();
    Err(Fault::new("has no channels R, G, B or Y").hint(format!("its channels are {}", names.join(", "))))
}

/// The indices of R, G, B or of Y, without a layer name if possible, else of the first layer that
/// has them, else of the only channel.
fn colour_channels(list: &[AnyChannel<FlatSamples>]) -> Option<Vec<usize>> {
    let names: Vec<String> = list.iter().map(|c| c.name.to_string()).collect();
    let find = |name: &str| names.iter().position(|n| n.eq_ignore_ascii_case(name));
    let mut prefixes = vec![""];
    prefixes.extend(names.iter().filter_map(|n| n.rfind('.').map(|dot| &n[..=dot])));
    for p in prefixes {
        let rgb: Option<Vec<usize>> = ["R", "G", "B"].iter().map(|c| find(&format!("{p}{c}"))).collect();
        if let Some(found) = rgb.or_else(|| find(&format!("{p}Y")).map(|y| vec![y])) {
            return Some(found);
        }
    }
    (list.len() == 1).then(|| vec![0])
}

/// Reads every channel and attribute. Channels of a named part are prefixed with its name unless
/// they carry it already; all parts must have the same size.
pub fn parse_file(bytes: &[u8]) -> Result<ImageFile, Fault> {
    let file = read(bytes)?;
    let first = file.layer_data.first().ok_or_else(|| Fault::new("has no layers"))?;
    let mut out = ImageFile::new(first.size.x() as u32, first.size.y() as u32);
    let parts = file.layer_data.len();
    out.attributes.extend(file.attributes.other.iter().filter_map(attribute));
    for layer in &file.layer_data {
        if layer.size != first.size {
            return Err(Fault::new("has parts of different sizes, which is not supported"));
        }
        let part = layer.attributes.layer_name.as_ref().map(ToString::to_string).filter(|_| parts > 1);
        for channel in &layer.channel_data.list {
            let name = channel.name.to_string();
            let full = match &part {
                Some(part) if !name.starts_with(&format!("{part}.")) => channel_name(part, &name),
                _ => name,
            };
            out.channels.insert(full, channel.sample_data.values_as_f32().collect());
        }
        out.attributes.extend(layer.attributes.other.iter().filter_map(attribute));
        let standard = [("comments", &layer.attributes.comments), ("software", &layer.attributes.software_name)];
        out.attributes.extend(standard.iter().filter_map(|(k, v)| Some(((*k).to_owned(), utf8(v.as_ref()?)))));
    }
    Ok(out)
}

fn attribute((name, value): (&Text, &AttributeValue)) -> Option<(String, String)> {
    let text = match value {
        AttributeValue::Text(t) => utf8(t),
        AttributeValue::F32(x) => x.to_string(),
        AttributeValue::F64(x) => x.to_string(),
        AttributeValue::I32(x) => x.to_string(),
        _ => return None,
    };
    Some((name.to_string(), text))
}

/// EXR texts are bytes; ours are UTF-8.
fn utf8(text: &Text) -> String {
    String::from_utf8_lossy(text.as_slice()).into_owned()
}

fn text(s: &str) -> Text {
    Text::from_bytes_unchecked(SmallVec::from_slice(s.as_bytes()))
}

/// Writes all channels as f32 (lossless, deflated blocks of 16 rows) and all attributes as text.
/// The attributes stand in the order of their names, so that equal images are equal files.
pub(super) fn write(mut out: impl Write, file: &ImageFile) -> Result<(), Fault> {
    let size = (file.width as usize, file.height as usize);
    let mut list: SmallVec<[AnyChannel<FlatSamples>; 4]> = SmallVec::new();
    for (name, plane) in &file.channels {
        if plane.len() != size.0 * size.1 || name.is_empty() || name.len() > 255 {
            return Err(Fault::new(format!("channel `{name}` does not have {} × {} samples and a short name", size.0, size.1)));
        }
        list.push(AnyChannel::new(text(name), FlatSamples::F32(plane.clone())));
    }
    if list.is_empty() || size.0 * size.1 == 0 {
        return Err(Fault::new("there are no pixels to write"));
    }
    let mut attributes = LayerAttributes { software_name: None, ..LayerAttributes::default() };
    for (name, value) in &file.attributes {
        match name.as_str() {
            "comments" => attributes.comments = Some(text(value)),
            "software" => attributes.software_name = Some(text(value)),
            _ => drop(attributes.other.insert(text(name), AttributeValue::Text(text(value)))),
        }
    }
    let encoding = Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let image = ::exr::prelude::Image::from_layer(Layer::new(size, attributes, encoding, AnyChannels::sort(list)));
    let mut bytes = Cursor::new(Vec::new());
    image.write().to_buffered(&mut bytes).map_err(|e| Fault::new(one_line(&e.to_string())))?;
    let mut bytes = bytes.into_inner();
    sort_attributes(&mut bytes);
    out.write_all(&bytes).map_err(io_fault)
}

/// Sorts the attributes of the header of a file of one part by name. The encoder writes them in
/// the order of a hash map with a random seed; what follows the header does not depend on it.
fn sort_attributes(file: &mut [u8]) {
    let mut found: Vec<&[u8]> = Vec::new();
    let mut rest = &file[8..];
    while rest.first().is_some_and(|&b| b != 0) {
        // name, 0, type, 0, size in 4 bytes, value
        let names: usize = rest.split(|&b| b == 0).take(2).map(|s| s.len() + 1).sum();
        let Some(size) = rest.get(names..names + 4) else { return };
        let length = names + 4 + u32::from_le_bytes([size[0], size[1], size[2], size[3]]) as usize;
        let Some((attribute, after)) = rest.split_at_checked(length) else { return };
        found.push(attribute);
        rest = after;
    }
    found.sort_by_key(|attribute| attribute.split(|&b| b == 0).next());
    let sorted = found.concat();
    file[8..8 + sorted.len()].copy_from_slice(&sorted);
}
