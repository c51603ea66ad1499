//! Pixels in tiles of 16 × 16, tile after tile: the pixel number is `tile · 256 + y · 16 + x`.
//!
//! A tile is the piece of the film that one job owns. Numbering pixels tile by tile makes the tile
//! of a splat a shift, and keeps what a job touches together in memory.

/// Width and height of a tile in pixels.
pub const TILE: u32 = 16;
/// Pixels in a tile.
pub const TILE_PIXELS: usize = (TILE * TILE) as usize;

/// Size of an image and the order of its pixels in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rect {
    /// Left column.
    pub x: u32,
    /// Upper row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Rect {
    /// Every (x, y, local index in the tile) of a tile's rectangle, row by row.
    #[inline]
    pub fn pixels(self) -> impl Iterator<Item = (u32, u32, usize)> {
        (0..self.height).flat_map(move |y| (0..self.width).map(move |x| (self.x + x, self.y + y, (y * TILE + x) as usize)))
    }
}

impl Layout {
    /// Tiles per row of tiles.
    #[inline]
    pub fn tiles_x(self) -> u32 {
        self.width.div_ceil(TILE)
    }

    /// Tiles in all.
    #[inline]
    pub fn tiles(self) -> usize {
        self.tiles_x() as usize * self.height.div_ceil(TILE) as usize
    }

    /// Pixel numbers fit 32 bits.
    pub fn is_addressable(self) -> bool {
        self.tiles() <= (u32::MAX as usize + 1) / TILE_PIXELS
    }

    /// Pixels of a tile, cut at the border of the image.
    #[inline]
    pub fn tile_rect(self, tile: usize) -> Rect {
        let tiles_x = self.tiles_x() as usize;
        let (x, y) = ((tile % tiles_x) as u32 * TILE, (tile / tiles_x) as u32 * TILE);
        Rect { x, y, width: TILE.min(self.width - x), height: TILE.min(self.height - y) }
    }

    /// Number of the pixel at column `x`, row `y`.
    #[inline]
    pub fn pixel(self, x: u32, y: u32) -> u32 {
        debug_assert!(x < self.width && y < self.height);
        let tile = (y / TILE) * self.tiles_x() + x / TILE;
        tile * TILE_PIXELS as u32 + (y % TILE) * TILE + x % TILE
    }

    /// Tile of a pixel number.
    #[inline]
    pub fn tile_of(pixel: u32) -> usize {
        pixel as usize / TILE_PIXELS
    }

    /// Place of a pixel number inside its tile.
    #[inline]
    pub fn local_of(pixel: u32) -> usize {
        pixel as usize % TILE_PIXELS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_is_in_one_tile() {
        for (width, height) in [(1, 1), (16, 16), (17, 5), (50, 33)] {
            let layout = Layout { width, height };
            let mut seen = vec![false; (width * height) as usize];
            for t in 0..layout.tiles() {
                for (x, y, local) in layout.tile_rect(t).pixels() {
                    let p = layout.pixel(x, y);
                    assert_eq!((Layout::tile_of(p), Layout::local_of(p)), (t, local));
                    assert!(!std::mem::replace(&mut seen[(y * width + x) as usize], true));
                }
            }
            assert!(seen.into_iter().all(|s| s));
        }
    }
}
