//! The film: exact `Σ_p x_p` and `Σ_p x_p²` of every pixel and channel over the passes it holds.
//!
//! A job owns a tile and, for one pass, a [`TileBuffer`] in which the gathered sample and the splats
//! of each pixel are added up to `x_p`; [`Tile::commit`] then adds `x_p` and its square. The square
//! is taken of an exact integer, so the second sum is as independent of order as the first.
//!
//! Pixels of one pass are not independent of each other: a light path splats into several, and
//! connections share its vertices. A tile therefore also keeps `Σ_p (Σ_j x_jp)²` over its pixels, whence
//! the variance of its mean with all that its pixels have in common.

use super::exact::{self, Exact, Losses};
use super::layout::{Layout, Rect, TILE_PIXELS};
use super::passes::PassSet;
use rayon::prelude::*;
use std::ops::Range;

/// What decides the samples of a pass, besides its number. Films of different identity hold
/// different random variables and cannot be merged.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Identity {
    /// Hash of the scene, the sensor, the estimator with its parameters, and the seed.
    pub hash: [u8; 32],
    /// What pilot passes decided, in the estimator's own encoding, so that a resumed render can use
    /// it without repeating them.
    pub decisions: Vec<u8>,
}

/// Why there is no film.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FilmError {
    /// Zero pixels, or more than pixel numbers can address.
    #[error("a film of {0} × {1} pixels cannot be made")]
    Size(u32, u32),
    /// No memory.
    #[error("a film of {0} × {1} pixels needs {2} bytes, more than this machine gives")]
    Memory(u32, u32, u64),
}

/// Why two films cannot become one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MergeError {
    /// Different width or height.
    #[error("the films differ in size")]
    Size,
    /// Different grid.
    #[error("the films differ in their exponent")]
    Exponent,
    /// Different render.
    #[error("the films are of different renders (scene, estimator, seed or pilot decisions)")]
    Identity,
    /// A pass would count twice.
    #[error("the films have passes in common")]
    Passes,
    /// A pass is there already.
    #[error("pass {0} is in the film already")]
    Pass(u64),
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Cell {
    sum: Exact,
    squares: [u128; 3],
}

/// The sums of one tile.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tile {
    cells: [Cell; TILE_PIXELS],
    /// Σ over passes of the square of the sum over pixels.
    block_squares: [u128; 3],
    losses: Losses,
}

impl Tile {
    const EMPTY: Self = Self {
        cells: [Cell { sum: Exact::ZERO, squares: [0; 3] }; TILE_PIXELS],
        block_squares: [0; 3],
        losses: Losses { dropped: 0, cut: 0 },
    };

    /// Adds what one pass found at all pixels of the tile, and empties the buffer for the next pass.
    pub fn commit(&mut self, pass: &mut TileBuffer) {
        let mut block = Exact::ZERO;
        for (cell, x) in self.cells.iter_mut().zip(&mut pass.cells) {
            if !x.is_zero() {
                block.add(*x);
                cell.sum.add(*x);
                add_squares(&mut cell.squares, *x);
                *x = Exact::ZERO;
            }
        }
        add_squares(&mut self.block_squares, block);
        self.losses.add(std::mem::take(&mut pass.losses));
    }

    fn add(&mut self, other: &Self) {
        for (a, b) in self.cells.iter_mut().zip(&other.cells) {
            a.sum.add(b.sum);
            for (s, v) in a.squares.iter_mut().zip(b.squares) {
                *s = s.wrapping_add(v);
            }
        }
        for (s, v) in self.block_squares.iter_mut().zip(other.block_squares) {
            *s = s.wrapping_add(v);
        }
        self.losses.add(other.losses);
    }
}

#[inline]
fn add_squares(squares: &mut [u128; 3], x: Exact) {
    for (s, v) in squares.iter_mut().zip(x.0) {
        *s = s.wrapping_add(exact::square(v));
    }
}

/// What one pass has found so far at the pixels of one tile: each `x_p` while it grows.
#[derive(Clone, Debug)]
pub struct TileBuffer {
    cells: [Exact; TILE_PIXELS],
    exponent: i32,
    losses: Losses,
}

impl TileBuffer {
    /// Empty, for films with this exponent.
    pub fn new(exponent: i32) -> Self {
        Self { cells: [Exact::ZERO; TILE_PIXELS], exponent, losses: Losses::default() }
    }

    /// Adds one contribution (linear sRGB) to the pixel at `local` in the tile. A contribution that
    /// is not finite is dropped and counted.
    #[inline]
    pub fn add(&mut self, local: usize, value: [f32; 3]) {
        if let Some(x) = self.losses.hold(Exact::round(value, self.exponent)) {
            self.cells[local].add(x);
        }
    }

    /// Adds what is on the grid already.
    #[inline]
    pub(super) fn add_exact(&mut self, local: usize, value: Exact) {
        self.cells[local].add(value);
    }

    /// Counts contributions that were dropped or cut elsewhere.
    pub(super) fn count(&mut self, losses: Losses) {
        self.losses.add(losses);
    }

    /// The grid's exponent.
    pub(super) fn exponent(&self) -> i32 {
        self.exponent
    }
}

/// Sums of all pixels over a set of passes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Film {
    layout: Layout,
    exponent: i32,
    passes: PassSet,
    tiles: Vec<Tile>,
    /// What else decides the samples.
    pub identity: Identity,
}

impl Film {
    /// An empty film. `2^exponent` should be near the largest usual pixel value; every render of the
    /// same scene must use the same exponent.
    pub fn new(width: u32, height: u32, exponent: i32) -> Result<Self, FilmError> {
        let layout = Layout { width, height };
        if width == 0 || height == 0 || !layout.is_addressable() {
            return Err(FilmError::Size(width, height));
        }
        let no_memory = |_| FilmError::Memory(width, height, Self::bytes(width, height));
        let mut tiles = Vec::new();
        tiles.try_reserve_exact(layout.tiles()).map_err(no_memory)?;
        tiles.resize(layout.tiles(), Tile::EMPTY);
        Ok(Self { layout, exponent, passes: PassSet::default(), tiles, identity: Identity::default() })
    }

    /// Memory that a film of this size takes, in bytes.
    pub fn bytes(width: u32, height: u32) -> u64 {
        let tiles = u64::from(width.div_ceil(super::TILE)) * u64::from(height.div_ceil(super::TILE));
        tiles.saturating_mul(size_of::<Tile>() as u64)
    }

    /// Exponent for a scene whose largest usual pixel value is about `scale`.
    pub fn exponent_for(scale: f32) -> i32 {
        if scale.is_finite() && scale > 0.0 { (scale.log2().ceil() as i32).clamp(-100, 100) } else { 0 }
    }

    /// Size and order of the pixels.
    pub fn layout(&self) -> Layout {
        self.layout
    }

    /// Pixels per row.
    pub fn width(&self) -> u32 {
        self.layout.width
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.layout.height
    }

    /// The grid's exponent.
    pub fn exponent(&self) -> i32 {
        self.exponent
    }

    /// The passes whose samples are in the sums.
    pub fn passes(&self) -> &PassSet {
        &self.passes
    }

    /// Contributions that were not finite and were left out.
    pub fn dropped(&self) -> u64 {
        self.tiles.iter().map(|t| t.losses.dropped).sum()
    }

    /// Contributions beyond the grid that were cut to its limit.
    pub fn cut(&self) -> u64 {
        self.tiles.iter().map(|t| t.losses.cut).sum()
    }

    /// Tiles with their pixels, for jobs. After all tiles have committed a pass, tell the film by
    /// [`Film::add_passes`].
    pub fn tiles_mut(&mut self) -> impl IndexedParallelIterator<Item = (usize, Rect, &mut Tile)> {
        let layout = self.layout;
        self.tiles.par_iter_mut().enumerate().map(move |(i, t)| (i, layout.tile_rect(i), t))
    }

    /// The same for one thread, in the order of tiles.
    pub fn each_tile_mut(&mut self) -> impl Iterator<Item = &mut Tile> {
        self.tiles.iter_mut()
    }

    /// Notes that these passes are complete in every tile.
    pub fn add_passes(&mut self, range: Range<u64>) -> Result<(), MergeError> {
        let first = range.start;
        if self.passes.insert(range) { Ok(()) } else { Err(MergeError::Pass(first)) }
    }

    /// Adds the passes of another film of the same render. Nothing is changed on error.
    pub fn merge(&mut self, other: &Self) -> Result<(), MergeError> {
        if self.layout != other.layout {
            return Err(MergeError::Size);
        }
        if self.exponent != other.exponent {
            return Err(MergeError::Exponent);
        }
        if self.identity != other.identity {
            return Err(MergeError::Identity);
        }
        if !self.passes.merge(&other.passes) {
            return Err(MergeError::Passes);
        }
        self.tiles.par_iter_mut().zip(&other.tiles).for_each(|(a, b)| a.add(b));
        Ok(())
    }

    /// Mean over passes, linear sRGB, row by row; zero before the first pass.
    pub fn mean(&self) -> Vec<[f32; 3]> {
        let n = self.passes.count().max(1) as f64;
        self.map_pixels(|cell| cell.sum.to_f64(self.exponent).map(|s| (s / n) as f32))
    }

    /// Variance of [`Film::mean`] per pixel and channel, from the sample variance over passes;
    /// infinite with less than two passes.
    pub fn variance_of_mean(&self) -> Vec<[f32; 3]> {
        self.map_pixels(|cell| self.variance(cell.sum, cell.squares, 1))
    }

    /// For every pixel, row by row, the variance of the mean over the pixels of its tile: what the
    /// pixels of a tile have in common included. Infinite with less than two passes.
    pub fn variance_of_tile_mean(&self) -> Vec<[f32; 3]> {
        let of_tile = |(i, tile): (usize, &Tile)| {
            let mut sum = Exact::ZERO;
            tile.cells.iter().for_each(|c| sum.add(c.sum));
            let rect = self.layout.tile_rect(i);
            self.variance(sum, tile.block_squares, rect.width * rect.height)
        };
        let tiles: Vec<_> = self.tiles.par_iter().enumerate().map(of_tile).collect();
        self.map_numbers(|p| tiles[Layout::tile_of(p)])
    }

    /// Variance of `Σ x / (n · parts)` from Σ x and Σ x² over the n passes.
    fn variance(&self, sum: Exact, squares: [u128; 3], parts: u32) -> [f32; 3] {
        let n = self.passes.count() as f64;
        if n < 2.0 {
            return [f32::INFINITY; 3];
        }
        // In units of 2^e, so that no square leaves the range of f64.
        let sum = sum.to_f64(0);
        let unit = exact::power_of_two(self.exponent) / f64::from(parts);
        std::array::from_fn(|c| {
            let squares = squares[c] as f64 * exact::power_of_two(-exact::SQUARE_FRACTION_BITS);
            let spread = (squares - sum[c] * sum[c] / n).max(0.0);
            (spread / (n * (n - 1.0)) * unit * unit) as f32
        })
    }

    /// The exact sum of a pixel.
    pub fn sum(&self, x: u32, y: u32) -> Exact {
        let p = self.layout.pixel(x, y);
        self.tiles[Layout::tile_of(p)].cells[Layout::local_of(p)].sum
    }

    fn map_pixels(&self, f: impl Fn(&Cell) -> [f32; 3] + Sync) -> Vec<[f32; 3]> {
        self.map_numbers(|p| f(&self.tiles[Layout::tile_of(p)].cells[Layout::local_of(p)]))
    }

    /// A function of pixel numbers, row by row.
    fn map_numbers(&self, f: impl Fn(u32) -> [f32; 3] + Sync) -> Vec<[f32; 3]> {
        let width = self.layout.width as usize;
        let mut out = vec![[0.0; 3]; width * self.layout.height as usize];
        out.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
            for (x, o) in row.iter_mut().enumerate() {
                *o = f(self.layout.pixel(x as u32, y as u32));
            }
        });
        out
    }
}

#[cfg(test)]
mod tests {
    use super::super::splat::{Splat, SplatBins};
    use super::*;
    use crate::math::Random;
    use crate::math::random::Family;

    const W: u32 = 37;
    const H: u32 = 21;

    /// A gathered sample of a pixel in a pass: mostly ordinary, sometimes huge or tiny.
    fn gathered(pass: u64, pixel: u32) -> [f32; 3] {
        let mut r = Random::new(Family::Other, u64::from(pixel), pass, 7);
        let scale = (40.0 * (r.unit() - 0.5)).exp2();
        [r.unit() * scale, r.unit() * scale, -r.unit()]
    }

    /// The splats of a pass, in jobs of a size of the caller's choice.
    fn splats(layout: Layout, pass: u64, job: usize) -> Vec<Vec<Splat>> {
        let mut r = Random::new(Family::Other, 1 << 40, pass, 8);
        let all: Vec<_> = (0..3000)
            .map(|_| {
                let pixel = layout.pixel(r.below(W), r.below(H));
                Splat { pixel, offset: [0; 2], value: [r.unit() * 3.0, (20.0 * r.unit()).exp2(), r.unit() * 1e-7] }
            })
            .collect();
        all.chunks(job).map(<[Splat]>::to_vec).collect()
    }

    /// A film of some passes, with jobs of some size, all by one layer or each technique by its own
    /// order of additions.
    fn film(passes: Range<u64>, job: usize, splats_first: bool) -> Film {
        let mut film = Film::new(W, H, 3).unwrap();
        let layout = film.layout();
        let mut bins = SplatBins::default();
        for pass in passes.clone() {
            bins.fill(layout, &splats(layout, pass, job));
            film.tiles_mut().for_each(|(t, rect, tile)| {
                let mut buffer = TileBuffer::new(3);
                let splat = |b: &mut TileBuffer| bins.tile(t).for_each(|s| b.add(Layout::local_of(s.pixel), s.value));
                if splats_first {
                    splat(&mut buffer);
                }
                for (x, y, local) in rect.pixels() {
                    buffer.add(local, gathered(pass, y * W + x));
                }
                if !splats_first {
                    splat(&mut buffer);
                }
                tile.commit(&mut buffer);
            });
        }
        film.add_passes(passes).unwrap();
        film
    }

    #[test]
    fn any_grouping_gives_the_same_bits() {
        let whole = film(0..12, 1000, false);
        assert_eq!(whole, film(0..12, 1, true));
        assert_eq!(whole, film(0..12, 77, false));
        for threads in [1, 2, 3, 7] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            assert_eq!(whole, pool.install(|| film(0..12, 100, true)));
        }
        let mut parts = film(7..9, 10, true);
        parts.merge(&film(0..7, 300, false)).unwrap();
        parts.merge(&film(9..12, 5, true)).unwrap();
        assert_eq!(whole, parts);
        assert_eq!(parts.passes().count(), 12);
    }

    /// The sums of films that hold one technique each add up to the film of both.
    #[test]
    fn layers_add_up_to_the_whole() {
        let add = |film: &mut Film, gather: bool, shoot: bool| {
            let layout = film.layout();
            let mut bins = SplatBins::default();
            bins.fill(layout, &splats(layout, 5, 100));
            film.tiles_mut().for_each(|(t, rect, tile)| {
                let mut buffer = TileBuffer::new(3);
                for (x, y, local) in rect.pixels().filter(|_| gather) {
                    buffer.add(local, gathered(5, y * W + x));
                }
                for s in bins.tile(t).filter(|_| shoot) {
                    buffer.add(Layout::local_of(s.pixel), s.value);
                }
                tile.commit(&mut buffer);
            });
        };
        let mut films = [0; 3].map(|_| Film::new(W, H, 3).unwrap());
        for (film, (gather, shoot)) in films.iter_mut().zip([(true, false), (false, true), (true, true)]) {
            add(film, gather, shoot);
        }
        for (x, y) in [(0, 0), (36, 20), (16, 15), (3, 18)] {
            let mut sum = films[0].sum(x, y);
            sum.add(films[1].sum(x, y));
            assert_eq!(sum, films[2].sum(x, y));
        }
    }

    #[test]
    fn mean_and_variance_are_those_of_the_passes() {
        let n = 20;
        let mut film = Film::new(1, 1, 0).unwrap();
        let mut values = Vec::new();
        for p in 0..n {
            let v = [p as f32 * 0.25, 0.1 + 1e-3 * (p as f32).sin(), 7.0];
            film.tiles_mut().for_each(|(_, _, tile)| {
                let mut buffer = TileBuffer::new(0);
                buffer.add(0, v);
                tile.commit(&mut buffer);
            });
            values.push(v.map(f64::from));
        }
        film.add_passes(0..n).unwrap();
        for c in 0..3 {
            let mean = values.iter().map(|v| v[c]).sum::<f64>() / n as f64;
            let spread = values.iter().map(|v| (v[c] - mean).powi(2)).sum::<f64>();
            let variance = spread / (n * (n - 1)) as f64;
            assert_eq!(film.mean()[0][c], mean as f32);
            assert!((f64::from(film.variance_of_mean()[0][c]) - variance).abs() <= 1e-9 * variance + 1e-15);
        }
    }

    /// Pixels that always move together: the variance of a tile's mean is that of one pixel, not a
    /// 256th of it.
    #[test]
    fn what_pixels_have_in_common_counts() {
        let n = 40;
        let mut film = Film::new(20, 16, 1).unwrap();
        for p in 0..n {
            let mut r = Random::new(Family::Other, 0, p, 3);
            let together = r.unit();
            film.tiles_mut().for_each(|(t, rect, tile)| {
                let mut buffer = TileBuffer::new(1);
                for (x, y, local) in rect.pixels() {
                    let own = Random::new(Family::Other, u64::from(1 + y * 20 + x), p, 3).unit();
                    buffer.add(local, [together, own, if t == 0 { 1.0 } else { 0.0 }]);
                }
                tile.commit(&mut buffer);
            });
        }
        film.add_passes(0..n).unwrap();
        let (of_pixel, of_tile) = (film.variance_of_mean()[5], film.variance_of_tile_mean()[5]);
        assert!((of_tile[0] / of_pixel[0] - 1.0).abs() < 1e-5);
        assert!((256.0 * of_tile[1] / of_pixel[1] - 1.0).abs() < 0.7);
        assert_eq!(of_tile[2], 0.0);
        // The other tile is narrower.
        let narrow = film.variance_of_tile_mean()[18];
        assert!((narrow[0] / of_pixel[0] - 1.0).abs() < 1e-5);
    }

    #[test]
    fn what_is_not_finite_is_dropped_and_counted() {
        let mut film = Film::new(3, 2, 0).unwrap();
        film.tiles_mut().for_each(|(_, _, tile)| {
            let mut buffer = TileBuffer::new(0);
            buffer.add(1, [1.0, f32::NAN, 1.0]);
            buffer.add(1, [f32::INFINITY, 0.0, 0.0]);
            buffer.add(1, [f32::MAX, 0.0, 0.0]);
            buffer.add(1, [0.5; 3]);
            tile.commit(&mut buffer);
        });
        film.add_passes(0..1).unwrap();
        assert_eq!((film.dropped(), film.cut()), (2, 1));
        assert_eq!(film.mean()[1][1], 0.5);
    }

    #[test]
    fn what_does_not_belong_together_is_refused() {
        let mut a = Film::new(4, 4, 0).unwrap();
        a.add_passes(0..2).unwrap();
        assert_eq!(a.add_passes(1..3), Err(MergeError::Pass(1)));
        assert_eq!(a.clone().merge(&a), Err(MergeError::Passes));
        assert_eq!(a.merge(&Film::new(4, 5, 0).unwrap()), Err(MergeError::Size));
        assert_eq!(a.merge(&Film::new(4, 4, 1).unwrap()), Err(MergeError::Exponent));
        let mut other = Film::new(4, 4, 0).unwrap();
        other.identity.hash[3] = 1;
        assert_eq!(a.merge(&other), Err(MergeError::Identity));
        assert_eq!(Film::new(0, 4, 0).unwrap_err(), FilmError::Size(0, 4));
        assert_eq!(Film::new(2_000_000, 2_000_000, 0).unwrap_err(), FilmError::Size(2_000_000, 2_000_000));
        assert!(Film::bytes(60_000, 60_000) > 300_000_000_000);
    }
}
