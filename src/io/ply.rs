//! Stanford PLY (ASCII, little and big endian): the elements `vertex` and `face` into triangles.
//!
//! From `vertex`: x y z, nx ny nz, and texture coordinates under one of the names u v, s t,
//! texture_u texture_v; from `face`: the list vertex_indices (or vertex_index), polygons as fans
//! around their first corner. Everything else is passed over. With `flip_tex_coords` v becomes
//! 1 − v (Mitsuba's default for PLY is not to).
//!
//! The counts in the header are checked against the length of the file before anything is
//! allocated. Vertices of a binary file have a fixed stride and are read in parallel; faces are
//! read one after the other, with a short path for a lone list of three 32-bit indices.

mod body;
mod header;
mod write;

pub use write::write;

use super::fault::{Decoded, Fault, escape};
use super::mesh::{RawMesh, bad_index, fits};
use crate::describe::Mesh;
use body::{Ascii, Binary, Source};
use glam::{Vec2, Vec3};
use header::{Element, Encoding, Header, Kind, Scalar};
use rayon::prelude::*;

/// Reads a PLY file from its bytes.
pub fn parse(bytes: &[u8], flip_tex_coords: bool) -> Result<Decoded<Mesh>, Fault> {
    let header = Header::parse(bytes)?;
    check_counts(&header, bytes.len() - header.length)?;
    let raw = match header.encoding {
        Encoding::Ascii => read(&header, Ascii::new(bytes, header.length))?,
        Encoding::Little => read(&header, Binary::<false>::new(bytes, header.length))?,
        Encoding::Big => read(&header, Binary::<true>::new(bytes, header.length))?,
    };
    raw.finish(flip_tex_coords)
}

/// Refuses counts that the rest of the file cannot hold.
fn check_counts(header: &Header, rest: usize) -> Result<(), Fault> {
    let mut needed = 0_u128;
    for element in &header.elements {
        let least = u128::from(element.count) * element.least_bytes(header.encoding) as u128;
        needed += least;
        if needed > rest as u128 + 1 {
            let what = format!(
                "the header announces {} of element `{}`, which need at least {least} bytes, but {rest} bytes follow the header",
                element.count,
                escape(&element.name)
            );
            return Err(Fault::new(what).hint("the file is cut off or its header is damaged"));
        }
    }
    Ok(())
}

fn read<S: Source>(header: &Header, mut source: S) -> Result<RawMesh, Fault> {
    let mut raw = RawMesh::default();
    let vertices = header.elements.iter().find(|e| e.name == b"vertex").ok_or_else(|| Fault::new("has no element `vertex`"))?;
    fits(vertices.count, "vertices")?;
    if let Some(twice) = header.elements.iter().enumerate().find(|(i, e)| header.elements[..*i].iter().any(|f| f.name == e.name))
    {
        return Err(Fault::new(format!("the header has the element `{}` twice", escape(&twice.1.name))));
    }
    for element in &header.elements {
        match element.name.as_slice() {
            b"vertex" => read_vertices(element, &mut source, &mut raw.mesh)?,
            b"face" => read_faces(element, vertices.count as u32, &mut source, &mut raw.mesh)?,
            _ => skip(element, &mut source)?,
        }
    }
    let left = source.left();
    if left > 0 {
        raw.warnings.push(format!("{left} bytes after the last element are passed over"));
    }
    Ok(raw)
}

fn skip<S: Source>(element: &Element, source: &mut S) -> Result<(), Fault> {
    // Elements without properties take no bytes, however many there are.
    for i in 0..if element.properties.is_empty() { 0 } else { element.count } {
        for property in &element.properties {
            let at = |f: Fault| f.within(format_args!("{} {i}", escape(&element.name)));
            source.skip(property.kind).map_err(at)?;
        }
    }
    Ok(())
}

/// Where each of the eight numbers x y z nx ny nz u v stands among the properties.
fn slots(element: &Element) -> Result<[Option<usize>; 8], Fault> {
    const NAMES: [&[&[u8]]; 8] = [
        &[b"x"],
        &[b"y"],
        &[b"z"],
        &[b"nx"],
        &[b"ny"],
        &[b"nz"],
        &[b"u", b"s", b"texture_u", b"texture_s"],
        &[b"v", b"t", b"texture_v", b"texture_t"],
    ];
    let mut slots = [None; 8];
    for (slot, names) in slots.iter_mut().zip(NAMES) {
        // In the order of the names, so that a colour called `t` does not beat `v`.
        *slot = names.iter().find_map(|n| element.properties.iter().position(|p| p.name == *n && matches!(p.kind, Kind::One(_))));
    }
    for (slot, name) in slots[..3].iter().zip(["x", "y", "z"]) {
        if slot.is_none() {
            return Err(Fault::new(format!("element `vertex` has no property `{name}`")));
        }
    }
    Ok(slots)
}

fn read_vertices<S: Source>(element: &Element, source: &mut S, mesh: &mut Mesh) -> Result<(), Fault> {
    let slots = slots(element)?;
    let count = element.count as usize;
    let all = |range: std::ops::Range<usize>| slots[range].iter().all(Option::is_some);
    let (has_normals, has_uvs) = (all(3..6), all(6..8));
    mesh.positions = vec![Vec3::ZERO; count];
    mesh.normals = vec![Vec3::ZERO; if has_normals { count } else { 0 }];
    mesh.uvs = vec![Vec2::ZERO; if has_uvs { count } else { 0 }];
    if let Some(stride) = element.stride()
        && let Some(block) = source.block(stride * count)
    {
        // Only binary sources have blocks: byte offset and type of each slot, then all in parallel.
        let place = |slot: Option<usize>| slot.map(|s| element.offset(s));
        let at: [Option<(usize, Scalar)>; 8] = std::array::from_fn(|k| place(slots[k]));
        let number = |row: &[u8], k: usize| at[k].map_or(0.0, |(offset, scalar)| S::decode(&row[offset..], scalar) as f32);
        let vector = |row: &[u8], k: usize| Vec3::new(number(row, k), number(row, k + 1), number(row, k + 2));
        let rows = || block.par_chunks_exact(stride).with_min_len(4096);
        mesh.positions.par_iter_mut().zip(rows()).for_each(|(p, row)| *p = vector(row, 0));
        mesh.normals.par_iter_mut().zip(rows()).for_each(|(n, row)| *n = vector(row, 3));
        mesh.uvs.par_iter_mut().zip(rows()).for_each(|(uv, row)| *uv = Vec2::new(number(row, 6), number(row, 7)));
        return Ok(());
    }
    let mut values = vec![0.0_f32; element.properties.len()];
    for i in 0..count {
        for (value, property) in values.iter_mut().zip(&element.properties) {
            let read = match property.kind {
                Kind::One(scalar) => source.number(scalar).map(|x| *value = x),
                list => source.skip(list),
            };
            read.map_err(|f| f.within(format_args!("vertex {i}, property `{}`", escape(&property.name))))?;
        }
        let get = |k: usize| slots[k].map_or(0.0, |s| values[s]);
        mesh.positions[i] = Vec3::new(get(0), get(1), get(2));
        if has_normals {
            mesh.normals[i] = Vec3::new(get(3), get(4), get(5));
        }
        if has_uvs {
            mesh.uvs[i] = Vec2::new(get(6), get(7));
        }
    }
    Ok(())
}

fn read_faces<S: Source>(element: &Element, vertices: u32, source: &mut S, mesh: &mut Mesh) -> Result<(), Fault> {
    let is_indices = |name: &[u8]| name == b"vertex_indices" || name == b"vertex_index";
    let list = element.properties.iter().position(|p| is_indices(&p.name));
    let Some((list, Kind::List(length, item))) = list.map(|l| (l, element.properties[l].kind)) else {
        return Err(Fault::new("element `face` has no list property `vertex_indices`"));
    };
    if item.is_float() || length.is_float() {
        return Err(Fault::new("the list `vertex_indices` must consist of integers"));
    }
    mesh.triangles.reserve_exact(element.count as usize);
    let alone = element.properties.len() == 1;
    for face in 0..element.count {
        if alone && let Some(triangle) = source.short_triangle(length, item, vertices) {
            mesh.triangles.push(triangle);
            continue;
        }
        let at = |f: Fault| f.within(format_args!("face {face}"));
        for (k, property) in element.properties.iter().enumerate() {
            if k != list {
                source.skip(property.kind).map_err(at)?;
                continue;
            }
            let corners = source.integer(length).map_err(at)?;
            if corners < 3 {
                return Err(Fault::new(format!("face {face} has {corners} corners{}", source.position())));
            }
            let (mut first, mut previous) = (0, 0);
            for c in 0..corners {
                let index = source.integer(item).map_err(at)?;
                let Some(index) = u32::try_from(index).ok().filter(|&i| i < vertices) else {
                    return Err(bad_index(format_args!("face {face}{}", source.position()), index, u64::from(vertices)));
                };
                match c {
                    0 => first = index,
                    1 => {}
                    _ => mesh.triangles.push([first, previous, index]),
                }
                previous = index;
            }
        }
    }
    Ok(())
}
