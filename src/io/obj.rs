//! Wavefront OBJ: `v`, `vt`, `vn` and `f` statements into one indexed triangle mesh.
//!
//! A vertex is a distinct triple (position, texture coordinate, normal), numbered by first use in
//! the faces, as Mitsuba does; polygons are fans around their first corner; all objects and groups
//! of the file are one mesh; materials, lines and points are passed over. Indices count from 1, or
//! backwards from the last one when negative. With `flip_tex_coords` (Mitsuba's default for OBJ)
//! v becomes 1 − v. The reader is our own because a message has to name the line, and a face that
//! lacks attributes which other faces have must not shift theirs.
//!
//! Two passes over the text: the first reads the numbers, the second the faces, which therefore
//! may refer to what stands after them and can be checked while their line is known.

use super::fault::{Decoded, Fault, escape};
use super::mesh::{RawMesh, fits};
use crate::describe::Mesh;
use glam::{Vec2, Vec3};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Display;

/// Reads an OBJ file from its bytes.
pub fn parse(bytes: &[u8], flip_tex_coords: bool) -> Result<Decoded<Mesh>, Fault> {
    let mut pools = Pools::default();
    let mut unknown: BTreeMap<Vec<u8>, (usize, usize)> = BTreeMap::new();
    for (line, text) in Statements::new(bytes) {
        let mut words = words(&text);
        match words.next() {
            Some(b"v") => pools.positions.push(Vec3::from_array(numbers(words, line, &text)?)),
            Some(b"vn") => pools.normals.push(Vec3::from_array(numbers(words, line, &text)?)),
            Some(b"vt") => pools.uvs.push(texture_coordinate(words, line, &text)?),
            Some(word) if KNOWN.contains(&word) => {}
            Some(word) if word.iter().all(u8::is_ascii_graphic) => unknown.entry(word.to_vec()).or_insert((line, 0)).1 += 1,
            Some(_) => return Err(malformed(line, &text, "is not an OBJ statement")),
            None => {}
        }
    }
    for (count, what) in
        [(pools.positions.len(), "vertices"), (pools.uvs.len(), "texture coordinates"), (pools.normals.len(), "normals")]
    {
        fits(count as u64, what)?;
    }
    let mut corners = Corners::new(&pools);
    for (line, text) in Statements::new(bytes) {
        corners.statement(line, &text)?;
    }
    let mut raw = corners.into_mesh(&pools);
    if raw.mesh.triangles.is_empty() && !unknown.is_empty() {
        let (word, (line, _)) = unknown.iter().min_by_key(|(_, (line, _))| *line).expect("not empty");
        return Err(Fault::new(format!("line {line}: `{}` is not an OBJ statement, and the file has no faces", escape(word))));
    }
    for (word, (line, count)) in unknown.iter().take(3) {
        raw.warnings.push(format!("unknown statement `{}` (first in line {line}, {count} in all) is passed over", escape(word)));
    }
    raw.finish(flip_tex_coords)
}

/// Statements that are known; those without effect on triangles are passed over.
const KNOWN: &[&[u8]] = &[
    b"v",
    b"vt",
    b"vn",
    b"f",
    b"vp",
    b"o",
    b"g",
    b"s",
    b"p",
    b"l",
    b"usemtl",
    b"mtllib",
    b"mg",
    b"lod",
    b"bevel",
    b"c_interp",
    b"d_interp",
    b"usemap",
    b"maplib",
    b"shadow_obj",
    b"trace_obj",
    b"cstype",
    b"deg",
    b"bmat",
    b"step",
    b"curv",
    b"curv2",
    b"surf",
    b"parm",
    b"trim",
    b"hole",
    b"scrv",
    b"sp",
    b"end",
    b"con",
    b"ctech",
    b"stech",
    b"call",
    b"csh",
];

/// Numbers of the file, in its own three numberings.
#[derive(Default)]
struct Pools {
    positions: Vec<Vec3>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
}

/// "Not given" among the zero-based indices.
const NONE: u32 = u32::MAX;

/// Distinct corners and the triangles between them.
struct Corners<'a> {
    pools: &'a Pools,
    /// How many of each pool were seen before the present line, for negative indices.
    seen: [u32; 3],
    /// Position, texture coordinate and normal of each vertex.
    keys: Vec<[u32; 3]>,
    /// Per position the vertex made last from it, and per vertex the one made before it: chains
    /// instead of a hash map, since few vertices share a position.
    last: Vec<u32>,
    before: Vec<u32>,
    triangles: Vec<[u32; 3]>,
}

impl<'a> Corners<'a> {
    fn new(pools: &'a Pools) -> Self {
        let last = vec![NONE; pools.positions.len()];
        Self { pools, seen: [0; 3], keys: Vec::new(), last, before: Vec::new(), triangles: Vec::new() }
    }

    fn statement(&mut self, line: usize, text: &[u8]) -> Result<(), Fault> {
        let mut words = words(text);
        match words.next() {
            Some(b"v") => self.seen[0] += 1,
            Some(b"vt") => self.seen[1] += 1,
            Some(b"vn") => self.seen[2] += 1,
            Some(b"f") => {
                let (mut first, mut previous, mut n) = (NONE, NONE, 0);
                for word in words {
                    let corner = self.corner(word, line)?;
                    match n {
                        0 => first = corner,
                        1 => {}
                        _ => self.triangles.push([first, previous, corner]),
                    }
                    (previous, n) = (corner, n + 1);
                }
                if n < 3 {
                    return Err(malformed(line, text, format_args!("is a face of only {n} corners")));
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// The vertex of `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    fn corner(&mut self, word: &[u8], line: usize) -> Result<u32, Fault> {
        let totals = [self.pools.positions.len(), self.pools.uvs.len(), self.pools.normals.len()];
        let mut key = [NONE; 3];
        let parts = || word.split(|&b| b == b'/');
        if parts().count() > 3 || word.starts_with(b"/") {
            return Err(malformed(line, word, "is not a corner of a face (v, v/vt, v//vn or v/vt/vn)"));
        }
        for (k, part) in parts().enumerate().filter(|(_, part)| !part.is_empty()) {
            key[k] = resolve(part, k, self.seen[k], totals[k]).map_err(|e| e.within(format_args!("line {line}")))?;
        }
        let mut candidate = self.last[key[0] as usize];
        while candidate != NONE {
            if self.keys[candidate as usize] == key {
                return Ok(candidate);
            }
            candidate = self.before[candidate as usize];
        }
        let vertex = self.keys.len() as u32;
        fits(u64::from(vertex) + 1, "vertices")?;
        self.before.push(std::mem::replace(&mut self.last[key[0] as usize], vertex));
        self.keys.push(key);
        Ok(vertex)
    }

    fn into_mesh(self, pools: &Pools) -> RawMesh {
        let mut raw = RawMesh::default();
        raw.mesh.positions = self.keys.iter().map(|k| pools.positions[k[0] as usize]).collect();
        let without_uv = self.keys.iter().filter(|k| k[1] == NONE).count();
        if without_uv < self.keys.len() {
            let uv = |k: &[u32; 3]| pools.uvs.get(k[1] as usize).copied();
            raw.mesh.uvs = self.keys.iter().map(|k| uv(k).unwrap_or_default()).collect();
            if without_uv > 0 {
                raw.warnings.push(format!("{without_uv} vertices have no texture coordinates though others do; they get (0, 0)"));
            }
        }
        if self.keys.iter().any(|k| k[2] != NONE) {
            // Zero asks `finish` for the smooth normal.
            raw.mesh.normals = self.keys.iter().map(|k| pools.normals.get(k[2] as usize).copied().unwrap_or_default()).collect();
        }
        raw.mesh.triangles = self.triangles;
        raw
    }
}

/// The zero-based index that an OBJ index stands for.
fn resolve(part: &[u8], pool: usize, seen: u32, total: usize) -> Result<u32, Fault> {
    let name = ["vertex", "texture coordinate", "normal"][pool];
    let text = std::str::from_utf8(part).ok();
    let Some(index) = text.and_then(|t| t.parse::<i64>().ok()) else {
        return Err(Fault::new(format!("`{}` is not a {name} index", escape(part))));
    };
    let zero_based = if index < 0 { i64::from(seen).checked_add(index) } else { index.checked_sub(1) };
    match zero_based.and_then(|i| u32::try_from(i).ok()) {
        Some(i) if (i as usize) < total => Ok(i),
        _ if index == 0 => Err(Fault::new(format!("{name} index 0 in a face, but indices count from 1"))),
        _ if index < 0 => {
            Err(Fault::new(format!("{name} index {index} in a face reaches back beyond the {seen} given before it")))
        }
        _ => Err(Fault::new(format!("{name} index {index} in a face, but the file has only {total}"))),
    }
}

/// Three finite numbers; more (w, colours) are passed over.
fn numbers<'t>(mut words: impl Iterator<Item = &'t [u8]>, line: usize, text: &[u8]) -> Result<[f32; 3], Fault> {
    let mut out = [0.0; 3];
    for x in &mut out {
        *x = number(words.next(), line, text)?;
    }
    Ok(out)
}

/// u and v; a missing v (one-dimensional textures) is 0.
fn texture_coordinate<'t>(mut words: impl Iterator<Item = &'t [u8]>, line: usize, text: &[u8]) -> Result<Vec2, Fault> {
    let u = number(words.next(), line, text)?;
    let v = words.next().map_or(Ok(0.0), |w| number(Some(w), line, text))?;
    Ok(Vec2::new(u, v))
}

fn number(word: Option<&[u8]>, line: usize, text: &[u8]) -> Result<f32, Fault> {
    let Some(word) = word else { return Err(malformed(line, text, "has too few numbers")) };
    let value = std::str::from_utf8(word).ok().and_then(|w| w.parse::<f32>().ok());
    match value {
        Some(x) if x.is_finite() => Ok(x),
        Some(_) => Err(malformed(line, text, format_args!("has the number `{}`, which is not finite", escape(word)))),
        None => Err(malformed(line, text, format_args!("has `{}` where a number should be", escape(word)))),
    }
}

fn malformed(line: usize, text: &[u8], what: impl Display) -> Fault {
    Fault::new(format!("line {line}: `{}` {what}", escape(text.trim_ascii())))
}

fn words(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    text.split(|b| b.is_ascii_whitespace()).filter(|w| !w.is_empty())
}

/// The statements of a file with the number of their first line (from 1): comments are cut off,
/// lines that end in a backslash are joined with the next.
struct Statements<'a> {
    rest: Option<&'a [u8]>,
    lines: usize,
}

impl<'a> Statements<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        Self { rest: Some(bytes), lines: 0 }
    }

    fn line(&mut self) -> Option<&'a [u8]> {
        let rest = self.rest?;
        self.lines += 1;
        match rest.iter().position(|&b| b == b'\n') {
            Some(end) => {
                self.rest = Some(&rest[end + 1..]);
                Some(&rest[..end])
            }
            None => self.rest.take(),
        }
    }
}

impl<'a> Iterator for Statements<'a> {
    type Item = (usize, Cow<'a, [u8]>);

    fn next(&mut self) -> Option<Self::Item> {
        let (line, mut more) = content(self.line()?);
        let (number, mut text) = (self.lines, Cow::Borrowed(line));
        while more {
            let Some(line) = self.line() else { break };
            let (line, again) = content(line);
            text.to_mut().push(b' ');
            text.to_mut().extend_from_slice(line);
            more = again;
        }
        Some((number, text))
    }
}

/// A line without its comment and end, and whether it continues on the next.
fn content(line: &[u8]) -> (&[u8], bool) {
    let line = line.split(|&b| b == b'#').next().unwrap_or_default().trim_ascii_end();
    match line.strip_suffix(b"\\") {
        Some(rest) => (rest, true),
        None => (line, false),
    }
}
