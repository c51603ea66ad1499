//! Mitsuba's serialized meshes: several deflated binary meshes and a table of where each starts.
//!
//! Layout (little endian): per mesh u16 0x041C, u16 version (3 or 4), then a zlib stream of
//! u32 flags, from version 4 a zero-terminated name, u64 vertices V, u64 triangles T, V × 3
//! positions, then as the flags say V × 3 normals, V × 2 texture coordinates, V × 3 colours (all
//! f32, or f64), and T × 3 u32 indices. The file ends with the offset of each mesh (u64, in
//! version 3 u32) and their number (u32). The flag "face normals" of the file is not heeded,
//! just as Mitsuba does not: the shape says what it wants. Texture coordinates stand as they are.
//!
//! Deflate expands at most 1032 times, so that counts beyond that times the length of the stream
//! are refused before anything is allocated.

use super::fault::{Decoded, Fault, escape};
use super::mesh::{RawMesh, fits};
use crate::describe::Mesh;
use flate2::read::ZlibDecoder;
use glam::{Vec2, Vec3};
use std::io::Read;

const MAGIC: u16 = 0x041C;
const HAS_NORMALS: u32 = 0x0001;
const HAS_UVS: u32 = 0x0002;
const HAS_COLORS: u32 = 0x0008;
const SINGLE: u32 = 0x1000;
const DOUBLE: u32 = 0x2000;
/// Deflate's greatest expansion: 258 bytes from 2 bits.
const MAX_EXPANSION: u64 = 1032;

/// Reads the mesh number `shape_index` (from 0) of a file.
pub fn parse(bytes: &[u8], shape_index: u32, flip_tex_coords: bool) -> Result<Decoded<Mesh>, Fault> {
    let header = bytes.get(..4).ok_or_else(|| Fault::new(format!("is only {} bytes long", bytes.len())))?;
    let version = version_of(header)?;
    let stream = slice_of(bytes, version, shape_index)?;
    let at = |f: Fault| f.within(format_args!("shape {shape_index}"));
    let version = version_of(&stream[..4]).map_err(at)?;
    read_shape(&stream[4..], version).and_then(|raw| raw.finish(flip_tex_coords)).map_err(at)
}

fn version_of(header: &[u8]) -> Result<u16, Fault> {
    if u16::from_le_bytes([header[0], header[1]]) != MAGIC {
        return Err(Fault::new(format!("is not a serialized mesh (it starts with `{}`)", escape(header))));
    }
    match u16::from_le_bytes([header[2], header[3]]) {
        v @ (3 | 4) => Ok(v),
        v => Err(Fault::new(format!("has version {v}")).hint("versions 3 and 4 are known")),
    }
}

/// The bytes of one shape, from its magic number on.
fn slice_of(bytes: &[u8], version: u16, shape_index: u32) -> Result<&[u8], Fault> {
    let cut = || Fault::new("has no table of shapes at its end").hint("the file is cut off");
    let table_end = bytes.len().checked_sub(4).ok_or_else(cut)?;
    let count = u32::from_le_bytes(bytes[table_end..].try_into().expect("four bytes"));
    let width = if version == 4 { 8 } else { 4 };
    let table_start = (count as usize).checked_mul(width).and_then(|n| table_end.checked_sub(n)).ok_or_else(cut)?;
    if count == 0 {
        return Err(cut());
    }
    if shape_index >= count {
        return Err(
            Fault::new(format!("has {count} shapes, so there is no shape {shape_index}")).hint("shape_index counts from 0")
        );
    }
    let entry = |i: u32| {
        let at = table_start + i as usize * width;
        let mut wide = [0; 8];
        wide[..width].copy_from_slice(&bytes[at..at + width]);
        u64::from_le_bytes(wide)
    };
    let start = entry(shape_index);
    let end = if shape_index + 1 < count { entry(shape_index + 1) } else { table_start as u64 };
    let range = usize::try_from(start).ok().zip(usize::try_from(end).ok());
    let slice = range.filter(|&(_, end)| end <= table_start).and_then(|(start, end)| bytes.get(start..end));
    match slice {
        Some(slice) if slice.len() >= 4 => Ok(slice),
        _ => Err(Fault::new(format!("the table says that shape {shape_index} is at bytes {start} to {end}, which cannot be"))),
    }
}

fn read_shape(stream: &[u8], version: u16) -> Result<RawMesh, Fault> {
    let mut input = Input { decoder: ZlibDecoder::new(stream), read: 0 };
    let flags = input.u32("flags")?;
    if version == 4 {
        input.skip_name()?;
    }
    let double = match flags & (SINGLE | DOUBLE) {
        DOUBLE => true,
        SINGLE => false,
        _ => return Err(Fault::new(format!("flags {flags:#x} do not say whether numbers are single or double"))),
    };
    let (vertices, triangles) = (input.u64("number of vertices")?, input.u64("number of triangles")?);
    fits(vertices, "vertices")?;
    fits(triangles, "triangles")?;
    let has = |flag| u64::from(flags & flag != 0);
    let per_vertex = (3 + 3 * has(HAS_NORMALS) + 2 * has(HAS_UVS) + 3 * has(HAS_COLORS)) * if double { 8 } else { 4 };
    let needed = vertices * per_vertex + triangles * 12;
    if needed > stream.len() as u64 * MAX_EXPANSION {
        let what = format!(
            "{vertices} vertices and {triangles} triangles need {needed} bytes, which cannot come out of {}",
            stream.len()
        );
        return Err(Fault::new(what).hint("the file is cut off or damaged"));
    }
    let (vertices, triangles) = (vertices as usize, triangles as usize);
    let mut raw = RawMesh::default();
    raw.mesh.positions = input.vectors(vertices, double, "positions", Vec3::from_array)?;
    if flags & HAS_NORMALS != 0 {
        raw.mesh.normals = input.vectors(vertices, double, "normals", Vec3::from_array)?;
    }
    if flags & HAS_UVS != 0 {
        raw.mesh.uvs = input.vectors(vertices, double, "texture coordinates", Vec2::from_array)?;
    }
    if flags & HAS_COLORS != 0 {
        input.vectors(vertices, double, "colours", |_: [f32; 3]| ())?;
    }
    let bytes = input.bytes(triangles * 12, "indices")?;
    let index = |b: &[u8]| u32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    raw.mesh.triangles = bytes.chunks_exact(12).map(|t| [index(t), index(&t[4..]), index(&t[8..])]).collect();
    Ok(raw)
}

/// The inflated stream with a count of what was read of it.
struct Input<'a> {
    decoder: ZlibDecoder<&'a [u8]>,
    read: u64,
}

impl Input<'_> {
    fn bytes(&mut self, count: usize, what: &str) -> Result<Vec<u8>, Fault> {
        let mut out = Vec::new();
        out.try_reserve_exact(count).map_err(|_| Fault::new(format!("no memory for {count} bytes of {what}")))?;
        let error = (&mut self.decoder).take(count as u64).read_to_end(&mut out).err();
        let got = out.len();
        if let Some(e) = error {
            let at = self.read + got as u64;
            return Err(Fault::new(format!(
                "the {what} cannot be inflated (byte {at} of the inflated stream): {}",
                super::fault::reason(&e)
            )));
        }
        if got < count {
            let what =
                format!("the stream ends in the {what}: {got} of {count} bytes (byte {} of the inflated stream)", self.read);
            return Err(Fault::new(what).hint("the file is cut off"));
        }
        self.read += count as u64;
        Ok(out)
    }

    fn u32(&mut self, what: &str) -> Result<u32, Fault> {
        Ok(u32::from_le_bytes(self.bytes(4, what)?.try_into().expect("four bytes")))
    }

    fn u64(&mut self, what: &str) -> Result<u64, Fault> {
        Ok(u64::from_le_bytes(self.bytes(8, what)?.try_into().expect("eight bytes")))
    }

    fn skip_name(&mut self) -> Result<(), Fault> {
        for _ in 0..65_536 {
            if self.bytes(1, "name")? == [0] {
                return Ok(());
            }
        }
        Err(Fault::new("the name of the shape is longer than 65536 bytes"))
    }

    /// `count` vectors of `N` numbers.
    fn vectors<const N: usize, V>(
        &mut self,
        count: usize,
        double: bool,
        what: &str,
        make: impl Fn([f32; N]) -> V,
    ) -> Result<Vec<V>, Fault> {
        let size = if double { 8 } else { 4 };
        let bytes = self.bytes(count * N * size, what)?;
        let number = |b: &[u8]| match double {
            true => f64::from_le_bytes(b.try_into().expect("eight bytes")) as f32,
            false => f32::from_le_bytes(b.try_into().expect("four bytes")),
        };
        Ok(bytes.chunks_exact(N * size).map(|v| make(std::array::from_fn(|k| number(&v[k * size..(k + 1) * size])))).collect())
    }
}
