//! Where contributions go: into one film, or into one film and the films of layers.
//!
//! Chosen once per pass, so that a render without layers is compiled as if there were none.

use super::{Layers, Partition};
use crate::film::{Dealt, Film, Patch, Rect, Sharing, Taps, Tile, TileBuffer};
use crate::transport::Contribution;

/// Adds up what one pass finds in one tile.
pub(super) trait Sink: Sized {
    /// What is kept of a contribution on its way from a shooting walk to its tile.
    type Kept: Copy + Default + Send + Sync;
    /// The tile, of one film or of several.
    type Tiles<'t>: Send;
    /// What the gathering walks that belong to a tile found, for all pixels whose filters reach it.
    type Found: Send + Sync;

    /// The tiles of all films, by their number.
    fn tiles<'t>(film: &'t mut Film, layers: &'t mut [Layers]) -> Vec<Self::Tiles<'t>>;
    /// Empty, for films with this exponent.
    fn new(exponent: i32, partitions: &[Partition]) -> Self;
    /// What to keep.
    fn keep(c: &Contribution) -> Self::Kept;
    /// Adds to the pixel at `local` in the tile.
    fn add(&mut self, local: usize, kept: &Self::Kept);
    /// Nothing found yet at the pixels whose walks belong to `tile`.
    fn nothing(sharing: Sharing, tile: usize, exponent: i32) -> Self::Found;
    /// Adds what the walk of a pixel found.
    fn find(found: &mut Self::Found, pixel: (i32, i32), kept: &Self::Kept);
    /// Adds to all pixels of `tile` what they take of the walks around.
    fn reconstruct(&mut self, sharing: Sharing, tile: usize, rect: Rect, taps: &Taps, found: &[Self::Found]);
    /// Deals out a splat among the pixels of a tile.
    fn deal(&mut self, rect: Rect, dealt: &Dealt, kept: &Self::Kept);
    /// Ends a pass.
    fn commit(&mut self, tiles: &mut Self::Tiles<'_>);
}

/// One film.
pub(super) struct Whole(TileBuffer);

impl Sink for Whole {
    type Kept = [f32; 3];
    type Tiles<'t> = &'t mut Tile;
    type Found = Patch;

    fn tiles<'t>(film: &'t mut Film, _: &'t mut [Layers]) -> Vec<&'t mut Tile> {
        film.each_tile_mut().collect()
    }
    fn new(exponent: i32, _: &[Partition]) -> Self {
        Self(TileBuffer::new(exponent))
    }
    #[inline]
    fn keep(c: &Contribution) -> [f32; 3] {
        c.value.to_rgb()
    }
    #[inline]
    fn add(&mut self, local: usize, kept: &[f32; 3]) {
        self.0.add(local, *kept);
    }
    fn nothing(sharing: Sharing, tile: usize, exponent: i32) -> Patch {
        Patch::new(sharing.share(tile), exponent)
    }
    #[inline]
    fn find(found: &mut Patch, pixel: (i32, i32), kept: &[f32; 3]) {
        found.add(pixel, *kept);
    }
    fn reconstruct(&mut self, sharing: Sharing, tile: usize, rect: Rect, taps: &Taps, found: &[Patch]) {
        let mut patch = Patch::new(sharing.around(tile), found[tile].exponent());
        sharing.neighbours(tile).for_each(|t| patch.overlay(&found[t]));
        patch.reconstruct(taps, rect, &mut self.0);
        found[tile].count(&mut self.0);
    }
    #[inline]
    fn deal(&mut self, rect: Rect, dealt: &Dealt, kept: &[f32; 3]) {
        dealt.add(*kept, rect, &mut self.0);
    }
    fn commit(&mut self, tile: &mut &mut Tile) {
        tile.commit(&mut self.0);
    }
}

/// One film, and those of layers.
pub(super) struct Divided {
    exponent: i32,
    whole: TileBuffer,
    partitions: Vec<Partition>,
    /// The parts of all partitions in order, each with whether this pass found anything in it.
    parts: Vec<(TileBuffer, bool)>,
}

/// Hands a contribution to the parts of all partitions that it belongs to.
#[inline]
fn deal(partitions: &[Partition], c: &Contribution, mut add: impl FnMut(usize, [f32; 3])) {
    let mut first = 0;
    for partition in partitions {
        partition.deal(c, |part, value| add(first + part, value));
        first += partition.parts();
    }
}

impl Divided {
    #[inline]
    fn each_part(&mut self, c: &Contribution, mut add: impl FnMut(&mut TileBuffer, [f32; 3])) {
        deal(&self.partitions, c, |part, value| {
            let (buffer, touched) = &mut self.parts[part];
            add(buffer, value);
            *touched = true;
        });
    }
}

impl Sink for Divided {
    type Kept = Contribution;
    type Tiles<'t> = (&'t mut Tile, Vec<&'t mut Tile>);
    type Found = Vec<((i32, i32), Contribution)>;

    fn tiles<'t>(film: &'t mut Film, layers: &'t mut [Layers]) -> Vec<Self::Tiles<'t>> {
        let mut tiles: Vec<_> = film.each_tile_mut().map(|tile| (tile, Vec::new())).collect();
        for part in layers.iter_mut().flat_map(|l| &mut l.films) {
            tiles.iter_mut().zip(part.each_tile_mut()).for_each(|((_, parts), tile)| parts.push(tile));
        }
        tiles
    }
    fn new(exponent: i32, partitions: &[Partition]) -> Self {
        let parts = partitions.iter().map(Partition::parts).sum();
        Self {
            exponent,
            whole: TileBuffer::new(exponent),
            partitions: partitions.to_vec(),
            parts: vec![(TileBuffer::new(exponent), false); parts],
        }
    }
    #[inline]
    fn keep(c: &Contribution) -> Contribution {
        *c
    }
    #[inline]
    fn add(&mut self, local: usize, c: &Contribution) {
        self.whole.add(local, c.value.to_rgb());
        self.each_part(c, |buffer, value| buffer.add(local, value));
    }
    fn nothing(_: Sharing, _: usize, _: i32) -> Self::Found {
        Vec::new()
    }
    #[inline]
    fn find(found: &mut Self::Found, pixel: (i32, i32), c: &Contribution) {
        found.push((pixel, *c));
    }
    fn reconstruct(&mut self, sharing: Sharing, tile: usize, rect: Rect, taps: &Taps, found: &[Self::Found]) {
        let (window, exponent) = (sharing.around(tile), self.exponent);
        let mut whole = Patch::new(window, exponent);
        let mut parts: Vec<Option<Patch>> = vec![None; self.parts.len()];
        // What cannot be held is counted where it was found.
        let others = sharing.neighbours(tile).filter(|t| *t != tile);
        for t in std::iter::once(tile).chain(others) {
            for (pixel, c) in &found[t] {
                whole.add(*pixel, c.value.to_rgb());
                deal(&self.partitions, c, |part, value| {
                    parts[part].get_or_insert_with(|| Patch::new(window, exponent)).add(*pixel, value);
                });
            }
            if t == tile {
                whole.count(&mut self.whole);
                parts.iter().zip(&mut self.parts).for_each(|(p, (buffer, _))| p.iter().for_each(|p| p.count(buffer)));
            }
        }
        whole.reconstruct(taps, rect, &mut self.whole);
        for (patch, (buffer, touched)) in parts.iter().zip(&mut self.parts) {
            if let Some(patch) = patch {
                patch.reconstruct(taps, rect, buffer);
                *touched = true;
            }
        }
    }
    #[inline]
    fn deal(&mut self, rect: Rect, dealt: &Dealt, c: &Contribution) {
        dealt.add(c.value.to_rgb(), rect, &mut self.whole);
        self.each_part(c, |buffer, value| dealt.add(value, rect, buffer));
    }
    fn commit(&mut self, (whole, parts): &mut Self::Tiles<'_>) {
        whole.commit(&mut self.whole);
        for ((buffer, touched), tile) in self.parts.iter_mut().zip(parts) {
            if std::mem::take(touched) {
                tile.commit(buffer);
            }
        }
    }
}
