//! Reconstruction filters wider than a pixel: every walk serves all pixels whose filter reaches it.
//!
//! All gathering walks of a pass stand at the same offset ξ from the centres of their pixels: the part below whole
//! pixels of an offset drawn from `|h|`. The whole part k of that offset would say which pixel's walk pixel j
//! takes. It is not drawn: given ξ its probabilities are `|h(k + ξ)| / Σ_i |h(i + ξ)|`, the walks at all
//! `c_{j+k} + ξ` exist, and pixel j takes the expectation over k of what it would have measured,
//!
//! ```text
//! x_j = Σ_k  h(k + ξ) / Σ_i |h(i + ξ)| · ∫|h| / ∫h · L(c_{j+k} + ξ).
//! ```
//!
//! The mean is that of one walk per pixel and never the variance larger [Blackwell 1947]; with independent walks and a
//! Gaussian of half a pixel it is less than a third. Where `h ≥ 0` the weights of a pass sum to one: a constant stays constant.
//! A splat is dealt out in the same way: pixel j takes `h(p − c_j) / ∫h` of it.
//!
//! Weights are integers, too, and multiply integers, so that layers and films still add up bit for bit.

use super::accumulator::TileBuffer;
use super::exact::{CONTRIBUTION_BITS, Exact, Losses, Rounded};
use super::filter::{Filter, MAX_SUPPORT};
use super::layout::{Layout, Rect, TILE};
use glam::Vec2;

/// Bits of the fraction of a weight along one axis.
const WEIGHT_BITS: i32 = 12;
/// What the walks of a pass find is held on a grid coarser by the weights of both axes, which multiply it.
const COARSER: i32 = 2 * WEIGHT_BITS;
/// Parts of a pixel in which the place of a splat is kept.
const PARTS: f32 = 1024.0;

/// Weights of a row of neighbouring pixels, in units of 2⁻¹².
#[derive(Clone, Copy, Debug)]
pub struct Weights {
    first: i32,
    count: usize,
    weights: [i32; MAX_SUPPORT],
}

impl Weights {
    /// Of values times `scale` at whole numbers from `first` on; with `keep_sum` rounding leaves their sum alone.
    pub(super) fn new(first: i32, values: &[f32], scale: f32, keep_sum: bool) -> Self {
        let mut weights = [0; MAX_SUPPORT];
        let (mut sum, mut given) = (0.0, 0);
        for (w, v) in weights.iter_mut().zip(values) {
            let exact = f64::from(v * scale) * f64::from(1 << WEIGHT_BITS);
            sum += exact;
            // What rounding took from one is given to the next.
            *w = if keep_sum { sum.round() as i32 - given } else { exact.round() as i32 };
            given += *w;
        }
        Self { first, count: values.len(), weights }
    }

    /// Place and weight of each.
    #[inline]
    fn each(&self) -> impl Iterator<Item = (i32, i128)> {
        (self.first..).zip(self.weights[..self.count].iter().map(|w| i128::from(*w)))
    }
}

/// What pixels take of the walks around them in one pass.
#[derive(Clone, Copy, Debug)]
pub struct Taps {
    /// Of all walks from the centres of their pixels, in pixels.
    pub offset: Vec2,
    columns: Weights,
    rows: Weights,
}

impl Taps {
    /// From two uniform numbers; `None` for the box, which shares nothing.
    pub fn new(filter: &Filter, u: Vec2) -> Option<Self> {
        let ((x, columns), (y, rows)) = (filter.taps(u.x)?, filter.taps(u.y)?);
        Some(Self { offset: Vec2::new(x, y), columns, rows })
    }
}

/// A rectangle of pixels of the film and of those beyond its border that its filter reaches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    x: i32,
    y: i32,
    width: i32,
    height: i32,
}

impl Window {
    /// A tile, and all within `reach` pixels of it.
    fn around(rect: Rect, reach: i32) -> Self {
        let (x, y) = (rect.x as i32 - reach, rect.y as i32 - reach);
        Self { x, y, width: rect.width as i32 + 2 * reach, height: rect.height as i32 + 2 * reach }
    }

    /// A tile, and what lies beyond it within `reach` pixels where it is at the border of the film: tiles share all
    /// pixels from which the film takes something among them.
    fn share_of(layout: Layout, rect: Rect, reach: i32) -> Self {
        let beyond = |at_border: bool| if at_border { reach } else { 0 };
        let (left, upper) = (beyond(rect.x == 0), beyond(rect.y == 0));
        let right = beyond(rect.x + rect.width == layout.width);
        let lower = beyond(rect.y + rect.height == layout.height);
        Self {
            x: rect.x as i32 - left,
            y: rect.y as i32 - upper,
            width: left + rect.width as i32 + right,
            height: upper + rect.height as i32 + lower,
        }
    }

    /// Every pixel, row by row.
    pub fn pixels(self) -> impl Iterator<Item = (i32, i32)> {
        (0..self.height).flat_map(move |y| (0..self.width).map(move |x| (self.x + x, self.y + y)))
    }

    #[inline]
    fn index(self, x: i32, y: i32) -> Option<usize> {
        let (x, y) = (x - self.x, y - self.y);
        ((0..self.width).contains(&x) && (0..self.height).contains(&y)).then_some((y * self.width + x) as usize)
    }
}

/// Tiles and how far filters reach across their borders.
#[derive(Clone, Copy, Debug)]
pub struct Sharing {
    layout: Layout,
    reach: i32,
}

impl Sharing {
    /// Of a film and its filter.
    pub fn new(layout: Layout, filter: &Filter) -> Self {
        Self { layout, reach: filter.reach() }
    }

    /// How many tiles there are.
    pub fn tiles(self) -> usize {
        self.layout.tiles()
    }

    /// The pixels whose walks belong to a tile.
    pub fn share(self, tile: usize) -> Window {
        Window::share_of(self.layout, self.layout.tile_rect(tile), self.reach)
    }

    /// The pixels whose walks a tile takes something of.
    pub fn around(self, tile: usize) -> Window {
        Window::around(self.layout.tile_rect(tile), self.reach)
    }

    /// The tiles whose walks and splats a tile takes something of, itself among them.
    pub fn neighbours(self, tile: usize) -> impl Iterator<Item = usize> {
        let window = self.around(tile);
        let tiles = |from: i32, length: i32, size: u32| {
            let last = (size as i32 - 1).max(0);
            let tile_of = |at: i32| (at.clamp(0, last) / TILE as i32) as usize;
            tile_of(from)..=tile_of(from + length - 1)
        };
        let columns = tiles(window.x, window.width, self.layout.width);
        let tiles_x = self.layout.tiles_x() as usize;
        tiles(window.y, window.height, self.layout.height).flat_map(move |y| columns.clone().map(move |x| y * tiles_x + x))
    }

    /// Pixel and place in it of a splat at raster point `p` of the film; `None` where no pixel takes anything of it.
    #[inline]
    pub fn place(self, p: Vec2) -> Option<(u32, [i16; 2])> {
        // Also refuses NaN.
        let nameable = p.x.abs() < 1e9 && p.y.abs() < 1e9;
        if !nameable {
            return None;
        }
        let axis = |p: f32, size: u32| {
            let at = p.floor() as i32;
            let pixel = at.clamp(0, size as i32 - 1);
            let offset = ((p - pixel as f32 - 0.5) * PARTS).round();
            ((at - pixel).abs() <= self.reach).then_some((pixel as u32, offset as i16))
        };
        let ((x, dx), (y, dy)) = (axis(p.x, self.layout.width)?, axis(p.y, self.layout.height)?);
        Some((self.layout.pixel(x, y), [dx, dy]))
    }

    /// Where that is, from the corner of `tile`.
    #[inline]
    pub fn from_corner(self, tile: usize, pixel: u32, offset: [i16; 2]) -> Vec2 {
        let (of, corner) = (self.layout.tile_rect(Layout::tile_of(pixel)), self.layout.tile_rect(tile));
        let local = Layout::local_of(pixel) as u32;
        let axis =
            |base: u32, at: u32, corner: u32, offset: i16| (base + at) as f32 - corner as f32 + 0.5 + f32::from(offset) / PARTS;
        Vec2::new(axis(of.x, local % TILE, corner.x, offset[0]), axis(of.y, local / TILE, corner.y, offset[1]))
    }
}

/// What the walks of one pass found at the pixels of a window.
#[derive(Clone, Debug)]
pub struct Patch {
    window: Window,
    cells: Vec<Exact>,
    exponent: i32,
    losses: Losses,
}

/// A contribution on the coarser grid of films with this exponent.
#[inline]
fn coarse(value: [f32; 3], exponent: i32) -> Rounded {
    Exact::round_below(value, exponent + COARSER, CONTRIBUTION_BITS - COARSER)
}

impl Patch {
    /// Empty, for films with this exponent.
    pub fn new(window: Window, exponent: i32) -> Self {
        Self { window, cells: vec![Exact::ZERO; (window.width * window.height) as usize], exponent, losses: Losses::default() }
    }

    /// Adds one contribution (linear sRGB) of the walk of a pixel, if that is in the window.
    #[inline]
    pub fn add(&mut self, (x, y): (i32, i32), value: [f32; 3]) {
        if let Some(i) = self.window.index(x, y)
            && let Some(v) = self.losses.hold(coarse(value, self.exponent))
        {
            self.cells[i].add(v);
        }
    }

    /// Takes over what another patch holds of this window.
    pub fn overlay(&mut self, other: &Self) {
        let (to, from) = (self.window, other.window);
        let (left, right) = (to.x.max(from.x), (to.x + to.width).min(from.x + from.width));
        for y in to.y.max(from.y)..(to.y + to.height).min(from.y + from.height) {
            if let (Some(a), Some(b)) = (to.index(left, y), from.index(left, y)) {
                let length = (right - left).max(0) as usize;
                let cells = self.cells[a..a + length].iter_mut().zip(&other.cells[b..b + length]);
                cells.for_each(|(a, b)| a.add(*b));
            }
        }
    }

    /// Tells `buffer` how many contributions were dropped or cut so far.
    pub fn count(&self, buffer: &mut TileBuffer) {
        buffer.count(self.losses);
    }

    /// The grid's exponent.
    pub fn exponent(&self) -> i32 {
        self.exponent
    }

    /// Adds to the pixels of a tile what they take of this patch, which is all around it.
    pub fn reconstruct(&self, taps: &Taps, rect: Rect, buffer: &mut TileBuffer) {
        let width = rect.width as usize;
        let mut rows = vec![[Exact::ZERO; TILE as usize]; self.window.height as usize];
        for (row, cells) in rows.iter_mut().zip(self.cells.chunks_exact(self.window.width as usize)) {
            for (k, w) in taps.columns.each() {
                let from = (rect.x as i32 + k - self.window.x) as usize;
                row.iter_mut().zip(&cells[from..from + width]).for_each(|(sum, cell)| sum.add(cell.times(w)));
            }
        }
        for (k, w) in taps.rows.each() {
            let from = (rect.y as i32 + k - self.window.y) as usize;
            for (y, row) in rows[from..from + rect.height as usize].iter().enumerate() {
                let locals = y * TILE as usize..;
                locals.zip(&row[..width]).for_each(|(local, part)| buffer.add_exact(local, part.times(w)));
            }
        }
    }
}

/// How the pixels of a tile share a splat.
#[derive(Clone, Copy, Debug)]
pub struct Dealt {
    columns: Weights,
    rows: Weights,
    /// The splat lies in this tile: what cannot be held of it is counted here.
    counts: bool,
}

impl Dealt {
    /// A splat at `p` from the corner of a tile of pixels, if its filter reaches it. `own` if it lies in the tile.
    #[inline]
    pub fn new(filter: &Filter, p: Vec2, own: bool) -> Option<Self> {
        let reach = filter.reach() as f32;
        let near = |x: f32| (-reach..TILE as f32 + reach).contains(&x);
        if !(own || near(p.x) && near(p.y)) {
            return None;
        }
        Some(Self { columns: filter.dealt(p.x)?, rows: filter.dealt(p.y)?, counts: own })
    }

    /// Adds its parts to the pixels of the tile.
    #[inline]
    pub fn add(&self, value: [f32; 3], rect: Rect, buffer: &mut TileBuffer) {
        let mut losses = Losses::default();
        let value = losses.hold(coarse(value, buffer.exponent()));
        if self.counts {
            buffer.count(losses);
        }
        let Some(value) = value else { return };
        for (y, w_y) in self.rows.each().filter(|(y, _)| (0..rect.height as i32).contains(y)) {
            let row = value.times(w_y);
            for (x, w_x) in self.columns.each().filter(|(x, _)| (0..rect.width as i32).contains(x)) {
                buffer.add_exact((y * TILE as i32 + x) as usize, row.times(w_x));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::describe::FilterDescription::{self, Box, Gaussian, Tent};
    use crate::film::filter::tests::{all, footprint};

    fn wide() -> Vec<FilterDescription> {
        all().into_iter().filter(|d| *d != Box).chain([Gaussian { stddev: 1.7 }]).collect()
    }

    const ONE: f64 = (1 << WEIGHT_BITS) as f64;

    /// Walks that pixels share and splats that are dealt out see the profile of an edge that the filter has.
    #[test]
    fn both_walkers_see_the_exact_profile_of_an_edge() {
        const N: u32 = 20_000;
        for d in wide() {
            let f = Filter::new(d).unwrap();
            for edge in [-1.7f32, -0.6, -0.31, 0.0, 0.12, 0.5, 0.93, 1.4] {
                let exact = footprint(&f, f64::from(edge));
                let (mut gathered, mut splatted) = (0.0, 0.0);
                for i in 0..N {
                    let u = (i as f32 + 0.5) / N as f32;
                    let (offset, taps) = f.taps(u).unwrap();
                    let beyond = taps.each().filter(|(k, _)| *k as f32 + offset > edge);
                    gathered += beyond.map(|(_, w)| w as f64 / ONE).sum::<f64>() / f64::from(N);
                    // The pixel with centre ½ takes light from everywhere beyond the edge.
                    let width = f.radius() - edge.max(-f.radius());
                    let dealt = f.dealt(0.5 + f.radius() - width * u).unwrap();
                    let own = dealt.each().filter(|(k, _)| *k == 0).map(|(_, w)| w as f64 / ONE).sum::<f64>();
                    splatted += own * f64::from(width) / f64::from(N);
                }
                assert!((gathered - exact).abs() < 2e-4, "{d:?} at {edge} gathers {gathered} not {exact}");
                assert!((splatted - exact).abs() < 5e-5, "{d:?} at {edge} splats {splatted} not {exact}");
            }
        }
    }

    #[test]
    fn a_constant_stays_constant() {
        for d in wide() {
            let f = Filter::new(d).unwrap();
            let positive = matches!(d, Tent { .. } | Gaussian { .. });
            let mut mean = 0.0;
            for i in 0..1000 {
                let (offset, taps) = f.taps((i as f32 + 0.5) / 1000.0).unwrap();
                let sum: i128 = taps.each().map(|(_, w)| w).sum();
                assert!(!positive || sum == 1 << WEIGHT_BITS, "{d:?}: {sum}");
                assert!((-0.5..=0.5).contains(&offset) && taps.each().all(|(k, _)| k.abs() <= f.reach()), "{d:?}: {taps:?}");
                mean += sum as f64 / ONE / 1000.0;
            }
            assert!((mean - 1.0).abs() < 2e-4, "{d:?}: {mean}");
        }
    }

    #[test]
    fn every_pixel_that_is_reached_belongs_to_one_tile_and_is_found_by_its_neighbours() {
        for (width, height) in [(1, 1), (16, 16), (17, 5), (50, 33)] {
            for d in wide() {
                let filter = Filter::new(d).unwrap();
                let sharing = Sharing::new(Layout { width, height }, &filter);
                let reach = filter.reach();
                let owner = |p: (i32, i32)| {
                    let owners: Vec<usize> =
                        (0..sharing.tiles()).filter(|t| sharing.share(*t).index(p.0, p.1).is_some()).collect();
                    assert_eq!(owners.len(), 1, "{p:?} of {width} × {height}");
                    owners[0]
                };
                let all: usize = (0..sharing.tiles()).map(|t| sharing.share(t).pixels().count()).sum();
                assert_eq!(all as i32, (width as i32 + 2 * reach) * (height as i32 + 2 * reach));
                for tile in 0..sharing.tiles() {
                    let neighbours: Vec<usize> = sharing.neighbours(tile).collect();
                    assert!(sharing.around(tile).pixels().all(|p| neighbours.contains(&owner(p))));
                }
            }
        }
    }

    /// A splat is found where it was put, by every tile, and lost beyond the reach of the filter.
    #[test]
    fn splats_keep_their_place() {
        let filter = Filter::new(Gaussian { stddev: 0.5 }).unwrap();
        let layout = Layout { width: 50, height: 33 };
        let sharing = Sharing::new(layout, &filter);
        for p in [Vec2::new(0.25, 0.75), Vec2::new(-1.5, 32.5), Vec2::new(51.75, 34.0), Vec2::new(16.0, 15.999)] {
            let (pixel, offset) = sharing.place(p).unwrap();
            for tile in 0..sharing.tiles() {
                let rect = layout.tile_rect(tile);
                let from = sharing.from_corner(tile, pixel, offset) + Vec2::new(rect.x as f32, rect.y as f32);
                assert!((from - p).abs().max_element() < 1.0 / PARTS, "{p} is {from} from tile {tile}");
            }
        }
        for p in [Vec2::new(-2.01, 4.0), Vec2::new(4.0, 35.01), Vec2::new(f32::NAN, 1.0), Vec2::new(1e30, 1.0)] {
            assert_eq!(sharing.place(p), None, "{p}");
        }
    }

    /// A tile beside others takes what they found, and what cannot be held is counted once.
    #[test]
    fn walks_are_shared_across_tiles() {
        let filter = Filter::new(Gaussian { stddev: 0.5 }).unwrap();
        let layout = Layout { width: 32, height: 16 };
        let sharing = Sharing::new(layout, &filter);
        let mut patches: Vec<Patch> = (0..2).map(|t| Patch::new(sharing.share(t), 0)).collect();
        for (tile, patch) in patches.iter_mut().enumerate() {
            for pixel in sharing.share(tile).pixels() {
                patch.add(pixel, [1.0, 0.5, if pixel == (16, 3) { f32::NAN } else { 0.0 }]);
            }
        }
        let taps = Taps::new(&filter, Vec2::new(0.3, 0.8)).unwrap();
        for tile in 0..2 {
            let mut around = Patch::new(sharing.around(tile), 0);
            sharing.neighbours(tile).for_each(|t| around.overlay(&patches[t]));
            let mut buffer = TileBuffer::new(0);
            around.reconstruct(&taps, layout.tile_rect(tile), &mut buffer);
            patches[tile].count(&mut buffer);
            let mut film = super::super::Film::new(16, 16, 0).unwrap();
            film.each_tile_mut().for_each(|t| t.commit(&mut buffer));
            film.add_passes(0..1).unwrap();
            assert_eq!(film.dropped(), tile as u64);
            // The walk that was dropped is missing in its neighbourhood, in all channels.
            let far = film.mean()[16 * 12 + 8];
            assert_eq!(far, [1.0, 0.5, 0.0]);
            let near = film.mean()[16 * 3 + if tile == 0 { 15 } else { 0 }];
            assert!(near[0] < 0.999 && near[0] > 0.1, "{near:?}");
        }
    }
}
