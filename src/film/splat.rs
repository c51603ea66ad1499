//! Splats are messages: a shooting job writes `(pixel, value)` into its own list, a tile's job reads
//! those of its tile. No atomics, no locks, no film per thread.
//!
//! Lists are counting-sorted by tile in as many parts as there are threads to sort them; a tile's
//! splats are a slice of each part. In which order they are added does not matter (the film adds
//! integers), so parts need no merging.

use super::layout::Layout;
use rayon::prelude::*;

/// A contribution of a shooting walk to a pixel ([`Layout::pixel`] numbers pixels).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Splat<V = [f32; 3]> {
    /// Pixel number.
    pub pixel: u32,
    /// Where in it, as [`super::Sharing::place`] says; nothing where the filter is a box.
    pub offset: [i16; 2],
    /// Linear sRGB, or that and what else the film's owner wants to know of a contribution.
    pub value: V,
}

/// The splats of one pass, by tile. Keeps its memory from pass to pass.
#[derive(Clone, Debug, Default)]
pub struct SplatBins<V = [f32; 3]> {
    parts: Vec<Part<V>>,
}

#[derive(Clone, Debug, Default)]
struct Part<V> {
    splats: Vec<Splat<V>>,
    /// Where each tile's splats begin; one more at the end.
    starts: Vec<u32>,
}

impl<V: Copy + Default + Send + Sync> SplatBins<V> {
    /// Takes over the splats of the jobs of a pass; splats beyond the layout are left out.
    /// At most 2³² − 1 splats per list and thread.
    pub fn fill(&mut self, layout: Layout, jobs: &[Vec<Splat<V>>]) {
        let total: usize = jobs.iter().map(Vec::len).sum();
        // A part for each thread, but none so small that its table of tiles dominates.
        let parts = rayon::current_num_threads().min(total / (4 * layout.tiles()).max(1024)).max(1);
        self.parts.resize_with(parts, Part::default);
        let per_part = jobs.len().div_ceil(parts).max(1);
        let mut chunks = jobs.chunks(per_part);
        let work: Vec<_> = self.parts.iter_mut().map(|p| (p, chunks.next().unwrap_or(&[]))).collect();
        work.into_par_iter().for_each(|(part, jobs)| part.fill(layout.tiles(), jobs));
    }

    /// Forgets all splats, keeps the memory.
    pub fn clear(&mut self) {
        for part in &mut self.parts {
            part.splats.clear();
            part.starts.clear();
        }
    }

    /// The splats of a tile.
    #[inline]
    pub fn tile(&self, tile: usize) -> impl Iterator<Item = &Splat<V>> {
        self.parts.iter().flat_map(move |p| match p.starts.get(tile..tile + 2) {
            Some([from, to]) => &p.splats[*from as usize..*to as usize],
            _ => &[],
        })
    }
}

impl<V: Copy + Default> Part<V> {
    fn fill(&mut self, tiles: usize, jobs: &[Vec<Splat<V>>]) {
        let inside = |s: &&Splat<V>| Layout::tile_of(s.pixel) < tiles;
        self.starts.clear();
        self.starts.resize(tiles + 1, 0);
        for s in jobs.iter().flatten().filter(inside) {
            self.starts[Layout::tile_of(s.pixel)] += 1;
        }
        let mut sum = 0;
        for s in &mut self.starts {
            sum += *s;
            *s = sum;
        }
        // Filled from the back, each end walks down to its start.
        self.splats.clear();
        self.splats.resize(sum as usize, Splat::default());
        for s in jobs.iter().flatten().filter(inside) {
            let at = &mut self.starts[Layout::tile_of(s.pixel)];
            *at -= 1;
            self.splats[*at as usize] = *s;
        }
    }
}
