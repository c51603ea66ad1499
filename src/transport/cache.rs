//! Light vertices kept for connections and merges.

use super::class::Positions;
use super::merge::PointGrid;
use super::mis::Partial;
use crate::math::{Random, prefetch};
use crate::scene::{EmitterId, Surface};
use crate::spectrum::Spectrum;
use glam::Vec3;
use rayon::prelude::*;

/// A vertex of a shooting walk at which a gathering walk can end.
#[derive(Clone, Debug)]
pub struct LightVertex {
    /// The point.
    pub surface: Surface,
    /// Unit direction to its predecessor (towards the light).
    pub w_back: Vec3,
    /// What only some materials need. Where all events are focused: what [`Self::partial`] is more by in `b` where
    /// all is focused between it and the eye, see [`Sums::merged`](super::walk::Sums::merged). Elsewhere: the density with
    /// which gathering would take `w_back` as a learned direction; negative where nothing was learned.
    pub by_material: f32,
    /// Flux arriving per light path, over its density.
    pub throughput: Spectrum,
    /// MIS sum on arrival.
    pub partial: Partial<f32>,
    /// Edges from the light point.
    pub length: u16,
    /// Positions of the path expression from which the light is reached, this vertex excluded.
    pub class: Positions,
    /// The vertex next to the light scattered by a Dirac event.
    pub first_delta: bool,
    /// Where the light comes from.
    pub emitter: EmitterId,
    /// Reached by a narrow event from the light, and not sharp itself: merges may end here. Whether its events are focused.
    pub merges: Option<bool>,
}

/// Two lines of a cache.
const _: () = assert!(size_of::<LightVertex>() == 128);

/// A light path up to a vertex of the cache, as a gathering walk goes on along it.
#[derive(Clone, Copy, Debug)]
pub struct LightEnd {
    /// Which vertex of the cache.
    pub index: u32,
    /// As of the vertex.
    pub emitter: EmitterId,
    /// As of the vertex.
    pub class: Positions,
    /// As of the vertex.
    pub length: u16,
    /// As of the vertex.
    pub first_delta: bool,
}

impl LightVertex {
    /// The light path that it ends, as vertex `index` of the cache.
    #[inline]
    pub fn end(&self, index: u32) -> LightEnd {
        let &Self { emitter, class, length, first_delta, .. } = self;
        LightEnd { index, emitter, class, length, first_delta }
    }
}

/// What a merge needs to know of a light vertex: one line of a cache.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub struct MergeVertex {
    /// As of the vertex.
    throughput: Vec3,
    /// What `b` of [`Self::partial`] is more by where all events between it and the eye are focused.
    merged: f32,
    /// The light path that it ends.
    pub end: LightEnd,
    /// As of the vertex.
    pub w_back: Vec3,
    /// As of the vertex.
    partial: Partial<f32>,
    /// Geometric normal, in units of 1/127.
    n_g: [i8; 3],
}

const _: () = assert!(size_of::<MergeVertex>() == 64);

impl MergeVertex {
    /// Of vertex `index` of the cache.
    fn new(index: u32, v: &LightVertex) -> Self {
        let n_g = (v.surface.n_g * 127.0).round().to_array().map(|x| x as i8);
        let merged = if v.merges == Some(true) { v.by_material } else { 0.0 };
        Self { throughput: v.throughput.to_rgb().into(), merged, end: v.end(index), w_back: v.w_back, partial: v.partial, n_g }
    }

    /// As of the vertex.
    #[inline]
    pub fn throughput(&self) -> Spectrum {
        let Vec3 { x, y, z } = self.throughput;
        Spectrum::rgb(x, y, z)
    }

    /// MIS sum on arrival, where all events between it and the eye are focused (`clear`) or not.
    #[inline]
    pub fn partial(&self, clear: bool) -> Partial<f32> {
        if clear { self.partial.and(self.merged) } else { self.partial }
    }

    /// Cosine between its geometric normal and `n`, either way, to about a hundredth.
    #[inline]
    pub fn cos_to(&self, n: Vec3) -> f32 {
        (Vec3::from_array(self.n_g.map(f32::from)).dot(n) * (1.0 / 127.0)).abs()
    }
}

/// All light vertices of one pass, in the order of their light paths; as many pieces as jobs made
/// them, so that nothing is copied together.
#[derive(Clone, Debug, Default)]
pub struct LightCache {
    pieces: Vec<Vec<LightVertex>>,
    /// Index of the first vertex of each piece; the total at the end.
    starts: Vec<u32>,
    /// Places of those that merges may end at,
    grid: PointGrid,
    /// and what merges need of them, in the order of the grid: what is found together lies together.
    merging: Vec<MergeVertex>,
}

impl LightCache {
    /// From what each job found, to be searched within `merge_radius` (0: not at all). At most 2³² − 1
    /// vertices are used.
    pub fn new(pieces: Vec<Vec<LightVertex>>, merge_radius: f32) -> Self {
        let mut starts = vec![0u32];
        let mut total = 0u32;
        for p in &pieces {
            total = total.saturating_add(u32::try_from(p.len()).unwrap_or(u32::MAX));
            starts.push(total);
        }
        let mut cache = Self { pieces, starts, ..Self::default() };
        if merge_radius > 0.0 {
            let all = (0..total).zip(cache.pieces.iter().flatten());
            let points = all.filter(|(_, v)| v.merges.is_some()).map(|(i, v)| (v.surface.p, i)).collect();
            cache.grid = PointGrid::new(points, merge_radius);
            cache.merging = cache.grid.numbers().map(|i| MergeVertex::new(i, cache.get(i))).collect();
        }
        cache
    }

    /// Number of vertices.
    #[inline]
    pub fn len(&self) -> u32 {
        self.starts.last().copied().unwrap_or(0)
    }

    /// Without vertices.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Vertex `i` of all, `i < len()`.
    #[inline]
    pub fn get(&self, i: u32) -> &LightVertex {
        let piece = self.starts.partition_point(|s| *s <= i) - 1;
        &self.pieces[piece][(i - self.starts[piece]) as usize]
    }

    /// One of the vertices with its index, all alike; it is asked for, to be there when it is looked at.
    #[inline]
    pub fn pick(&self, random: &mut Random) -> Option<(u32, &LightVertex)> {
        let i = random.below(self.len());
        let vertex = (!self.is_empty()).then(|| self.get(i))?;
        prefetch(vertex);
        Some((i, vertex))
    }

    /// Calls `visit` with every vertex for merges whose squared distance from `p` is below `radius2`, at most the square
    /// of the radius given to [`Self::new`].
    #[inline]
    pub fn around(&self, p: Vec3, radius2: f32, mut visit: impl FnMut(&MergeVertex)) {
        // Some are asked for at a time, then looked at.
        let mut some: [Option<&MergeVertex>; 16] = [None; 16];
        let mut n = 0;
        self.grid.around(p, radius2, |at| {
            let vertex = &self.merging[at as usize];
            prefetch(vertex);
            some[n] = Some(vertex);
            n += 1;
            if n == some.len() {
                some.iter().flatten().for_each(|v| visit(v));
                n = 0;
            }
        });
        some[..n].iter().flatten().for_each(|v| visit(v));
    }
}
