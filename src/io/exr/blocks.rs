//! The pixels of an EXR file: chosen channels as planes of f32.
//!
//! The chunks are fetched in batches and inflated in parallel; every position a chunk claims is
//! checked before its samples are placed. (The crate's own image reader trusts these positions
//! and panics on files that are damaged in the right place.)

use super::super::fault::Fault;
use super::super::image::{MAX_PIXELS, check_size, one_line};
use ::exr::block::UncompressedBlock;
use ::exr::block::chunk::{Chunk, CompressedBlock};
use ::exr::block::reader::Reader;
use ::exr::math::Vec2;
use ::exr::meta::MetaData;
use ::exr::meta::header::Header;
use ::exr::prelude::{SampleType, f16};
use rayon::prelude::*;
use std::collections::HashMap;
use std::io::Cursor;

/// Chunks that are inflated at a time: enough for many threads, little in memory.
const BATCH: usize = 64;

/// A channel of a part of the file, by their indices.
pub type Wanted = (usize, usize);

fn unsound(e: &::exr::error::Error) -> Fault {
    Fault::new(format!("is not a sound EXR file: {}", one_line(&e.to_string())))
}

/// The file after its header was read and found acceptable.
pub struct Blocks<'a> {
    reader: Reader<Cursor<&'a [u8]>>,
}

impl<'a> Blocks<'a> {
    /// Reads the header and checks what it claims against the limits and the length of the file.
    pub fn open(bytes: &'a [u8]) -> Result<Self, Fault> {
        let reader = ::exr::block::read(Cursor::new(bytes), false).map_err(|e| unsound(&e))?;
        let mut samples = 0_u64;
        for header in reader.headers() {
            if header.deep {
                return Err(Fault::new("holds deep data, which is not supported"));
            }
            let (width, height) = (header.layer_size.x() as u64, header.layer_size.y() as u64);
            check_size(width, height)?;
            if header.channels.list.iter().any(|c| c.sampling != Vec2(1, 1)) {
                return Err(Fault::new("has subsampled channels, which are not supported").hint("save it as RGB"));
            }
            samples = samples.saturating_add((width * height).saturating_mul(header.channels.list.len() as u64));
            // Every chunk takes at least its entry in the offset table and its own header.
            if (header.chunk_count as u64).saturating_mul(16) > bytes.len() as u64 {
                let what = format!("claims {} chunks, but has only {} bytes", header.chunk_count, bytes.len());
                return Err(Fault::new(what).hint("the file is cut off"));
            }
        }
        if samples > 4 * MAX_PIXELS {
            let hint = format!("the limit is {}", 4 * MAX_PIXELS);
            return Err(Fault::new(format!("has {samples} samples in all its channels, too many to read")).hint(hint));
        }
        Ok(Self { reader })
    }

    /// The parts of the file.
    pub fn headers(&self) -> &[Header] {
        self.reader.headers()
    }

    /// The planes of the wanted channels at full resolution, in the order asked for.
    pub fn planes(self, wanted: &[Wanted]) -> Result<Vec<Vec<f32>>, Fault> {
        let area = |part: usize| self.headers()[part].layer_size.area();
        let mut planes: Vec<Vec<f32>> = wanted.iter().map(|w| vec![0.0; area(w.0)]).collect();
        let mut parts: HashMap<usize, usize> = wanted.iter().map(|w| (w.0, area(w.0))).collect();
        let asked = |_: &MetaData, tile: ::exr::block::chunk::TileCoordinates, block: ::exr::block::BlockIndex| {
            tile.level_index == Vec2(0, 0) && parts.contains_key(&block.layer)
        };
        let mut chunks = self.reader.filter_chunks(false, asked).map_err(|e| unsound(&e))?;
        loop {
            let batch: Vec<Chunk> = chunks.by_ref().take(BATCH).collect::<Result<_, _>>().map_err(|e| unsound(&e))?;
            if batch.is_empty() {
                break;
            }
            let meta = ::exr::block::reader::ChunksReader::meta_data(&chunks);
            let blocks: Vec<_> = batch.into_par_iter().map(|chunk| inflate(chunk, meta)).collect::<Result<_, _>>()?;
            for block in &blocks {
                place(block, &meta.headers[block.index.layer], wanted, &mut planes)?;
                if let Some(missing) = parts.get_mut(&block.index.layer) {
                    *missing = missing.saturating_sub(block.index.pixel_size.area());
                }
            }
        }
        match parts.values().sum::<usize>() {
            0 => Ok(planes),
            missing => Err(Fault::new(format!("lacks {missing} of its pixels")).hint("the file was not written to its end")),
        }
    }
}

/// Inflates a chunk after checking what the crate takes for granted: its part and its level.
fn inflate(chunk: Chunk, meta: &MetaData) -> Result<UncompressedBlock, Fault> {
    let misplaced = || Fault::new("is not a sound EXR file: a chunk belongs elsewhere than the offset table says");
    let header = meta.headers.get(chunk.layer_index).ok_or_else(misplaced)?;
    match &chunk.compressed_block {
        CompressedBlock::Tile(tile) if tile.coordinates.level_index == Vec2(0, 0) => {}
        CompressedBlock::ScanLine(_) => {}
        _ => return Err(misplaced()),
    }
    let tile = header.get_block_data_indices(&chunk.compressed_block).map_err(|e| unsound(&e))?;
    let block = header.max_block_pixel_size();
    let within =
        |k: fn(Vec2<usize>) -> usize| k(tile.tile_index).checked_mul(k(block)).is_some_and(|start| start < k(header.layer_size));
    if !within(Vec2::x) || !within(Vec2::y) {
        return Err(misplaced());
    }
    UncompressedBlock::decompress_chunk(chunk, meta, false).map_err(|e| unsound(&e))
}

/// Copies the wanted samples of a block: for each row, the row of each channel, in native bytes.
fn place(block: &UncompressedBlock, header: &Header, wanted: &[Wanted], planes: &mut [Vec<f32>]) -> Result<(), Fault> {
    let (position, size, full) = (block.index.pixel_position, block.index.pixel_size, header.layer_size);
    let row_bytes = size.x() * header.channels.bytes_per_pixel;
    let fits = position.x() + size.x() <= full.x() && position.y() + size.y() <= full.y();
    if !fits || block.data.len() != row_bytes * size.y() {
        return Err(Fault::new("is not a sound EXR file: a chunk does not have the size of its place"));
    }
    let channels = &header.channels.list;
    for (plane, &(_, channel)) in planes.iter_mut().zip(wanted).filter(|(_, w)| w.0 == block.index.layer) {
        let before: usize = channels[..channel].iter().map(|c| c.sample_type.bytes_per_sample()).sum();
        let kind = channels[channel].sample_type;
        for (y, row) in block.data.chunks_exact(row_bytes).enumerate() {
            let start = (position.y() + y) * full.x() + position.x();
            let bytes = &row[before * size.x()..][..kind.bytes_per_sample() * size.x()];
            convert(bytes, kind, &mut plane[start..start + size.x()]);
        }
    }
    Ok(())
}

fn convert(bytes: &[u8], kind: SampleType, out: &mut [f32]) {
    let four = |b: &[u8]| [b[0], b[1], b[2], b[3]];
    match kind {
        SampleType::F16 => {
            out.iter_mut().zip(bytes.chunks_exact(2)).for_each(|(o, b)| *o = f16::from_ne_bytes([b[0], b[1]]).to_f32());
        }
        SampleType::F32 => out.iter_mut().zip(bytes.chunks_exact(4)).for_each(|(o, b)| *o = f32::from_ne_bytes(four(b))),
        SampleType::U32 => out.iter_mut().zip(bytes.chunks_exact(4)).for_each(|(o, b)| *o = u32::from_ne_bytes(four(b)) as f32),
    }
}
