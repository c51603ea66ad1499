//! How many gathering walks each pixel has in a pass.
//!
//! The error of a picture is the sum over pixels of σ²/n, so where walks vary more there should be more of them: n ∝ σ/√cost
//! [Neyman 1934; Mitchell 1987]. A pixel may have any number as long as that is no function of its samples, so a pilot decides
//! ([`crate::render`]). Walks of the same pass share its light vertices; each counts one by their number, and in the weights
//! there are as many fewer light paths for each of them.

use glam::Vec2;

/// Most walks of a pixel in a pass: what a digit can say.
pub const MOST_SAMPLES: u8 = 9;

/// Numbers of walks on a grid of cells over a crop window; by default, one everywhere.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SampleMap {
    /// x, y, width, height in the film.
    crop: [u32; 4],
    /// Cells per row, rows.
    cells: [u32; 2],
    samples: Vec<u8>,
}

impl SampleMap {
    /// Of rows of cells of the same length, numbers from 1 to [`MOST_SAMPLES`]; over no picture yet. `None` where they are not such.
    pub fn from_rows(rows: &[Vec<u8>]) -> Option<Self> {
        let columns = rows.first().map_or(0, Vec::len);
        let fit = rows.iter().all(|r| r.len() == columns && r.iter().all(|n| (1..=MOST_SAMPLES).contains(n)));
        let cells = [u32::try_from(columns).ok()?, u32::try_from(rows.len()).ok()?];
        (fit && (columns > 0 || rows.is_empty())).then(|| Self { crop: [0; 4], cells, samples: rows.concat() })
    }

    /// The same over the crop window (x, y, width, height) of a film.
    pub fn over(self, crop: [u32; 4]) -> Self {
        Self { crop, ..self }
    }

    /// One walk everywhere.
    pub fn is_even(&self) -> bool {
        self.samples.is_empty()
    }

    /// Numbers by rows of cells.
    pub fn rows(&self) -> impl Iterator<Item = &[u8]> {
        self.samples.chunks(self.cells[0].max(1) as usize)
    }

    /// Walks of the pixel (x, y) of the crop window; of one beyond, those of the nearest in it.
    #[inline]
    pub fn at(&self, (x, y): (i32, i32)) -> u32 {
        if self.samples.is_empty() { 1 } else { self.samples[cell(self.crop, self.cells, (x, y))].into() }
    }

    /// Walks of the pixel at a point of the film.
    #[inline]
    pub fn at_raster(&self, raster: Vec2) -> u32 {
        if self.samples.is_empty() {
            return 1;
        }
        let at = |p: f32, corner: u32| (p - corner as f32).floor() as i32;
        self.at((at(raster.x, self.crop[0]), at(raster.y, self.crop[1])))
    }
}

/// Number of the cell of pixel (x, y) of a crop window that is divided into so many columns and rows, or the nearest.
#[inline]
pub fn cell(crop: [u32; 4], cells: [u32; 2], (x, y): (i32, i32)) -> usize {
    let axis = |at: i32, size: u32, cells: u32| {
        let inside = u64::from(at.clamp(0, size.max(1) as i32 - 1).unsigned_abs());
        (inside * u64::from(cells) / u64::from(size.max(1))) as usize
    };
    axis(y, crop[3], cells[1]) * cells[0] as usize + axis(x, crop[2], cells[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_cover_a_crop_window_and_what_is_around_it() {
        let map = SampleMap::from_rows(&[vec![1, 2, 3], vec![4, 5, 6]]).map(|m| m.over([10, 20, 30, 8])).unwrap_or_default();
        assert_eq!([(0, 0), (9, 3), (10, 3), (29, 4)].map(|p| map.at(p)), [1, 1, 2, 6]);
        assert_eq!([(-3, -1), (33, -9), (-1, 100), (1000, 1000)].map(|p| map.at(p)), [1, 3, 4, 6]);
        let at = |x, y| map.at_raster(Vec2::new(x, y));
        assert_eq!([at(10.5, 20.5), at(20.0, 23.9), at(9.9, 19.0), at(39.99, 27.99)], [1, 2, 1, 6]);
        assert_eq!([at(f32::NAN, 1e30), at(-1e30, f32::INFINITY)], [4, 4]);
        assert!(map.rows().eq([&[1, 2, 3][..], &[4, 5, 6]]) && !map.is_even());
    }

    #[test]
    fn what_is_no_map_is_none() {
        for rows in [&[vec![1, 0]][..], &[vec![MOST_SAMPLES + 1]], &[vec![1], vec![1, 1]], &[vec![], vec![]]] {
            assert_eq!(SampleMap::from_rows(rows), None);
        }
        let even = SampleMap::from_rows(&[]).unwrap_or_default();
        assert!(even.is_even() && even == SampleMap::default() && even.at((5, -5)) == 1 && even.rows().next().is_none());
    }
}
