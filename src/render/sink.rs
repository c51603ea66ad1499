//! Where contributions go: into one film, or into one film and the films of layers.
//!
//! Chosen once per pass, so that a render without layers is compiled as if there were none.

use super::{Layers, Partition};
use crate::film::{Film, Tile, TileBuffer};
use crate::transport::Contribution;

/// Adds up what one pass finds in one tile.
pub(super) trait Sink: Sized {
    /// What is kept of a contribution on its way from a shooting walk to its tile.
    type Kept: Copy + Default + Send + Sync;
    /// The tile, of one film or of several.
    type Tiles<'t>: Send;

    /// The tiles of all films, by their number.
    fn tiles<'t>(film: &'t mut Film, layers: &'t mut [Layers]) -> Vec<Self::Tiles<'t>>;
    /// Empty, for films with this exponent.
    fn new(exponent: i32, partitions: &[Partition]) -> Self;
    /// What to keep.
    fn keep(c: &Contribution) -> Self::Kept;
    /// Adds to the pixel at `local` in the tile.
    fn add(&mut self, local: usize, kept: &Self::Kept);
    /// Ends a pass.
    fn commit(&mut self, tiles: &mut Self::Tiles<'_>);
}

/// One film.
pub(super) struct Whole(TileBuffer);

impl Sink for Whole {
    type Kept = [f32; 3];
    type Tiles<'t> = &'t mut Tile;

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
    fn commit(&mut self, tile: &mut &mut Tile) {
        tile.commit(&mut self.0);
    }
}

/// One film, and those of layers.
pub(super) struct Divided {
    whole: TileBuffer,
    partitions: Vec<Partition>,
    /// The parts of all partitions in order, each with whether this pass found anything in it.
    parts: Vec<(TileBuffer, bool)>,
}

impl Sink for Divided {
    type Kept = Contribution;
    type Tiles<'t> = (&'t mut Tile, Vec<&'t mut Tile>);

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
        let mut first = 0;
        for partition in &self.partitions {
            partition.deal(c, |part, value| {
                let (buffer, touched) = &mut self.parts[first + part];
                buffer.add(local, value);
                *touched = true;
            });
            first += partition.parts();
        }
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
