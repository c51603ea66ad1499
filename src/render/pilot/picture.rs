//! The picture that a pilot has seen so far, coarse: what contributions are relative to.

use glam::Vec2;
use std::ops::Range;

/// Cells on each side of one that are taken together with it.
const BLUR: u32 = 2;
/// Cells of the coarse image along its longer side, at most.
const CELLS: u32 = 64;

/// Index of a cell of the coarse image.
pub(super) type Cell = u32;

/// The cells, of `size` along an axis, that are no farther from `at` than so many.
pub(super) fn near(at: u32, size: u32, cells: u32) -> Range<u32> {
    at.saturating_sub(cells)..(at + cells + 1).min(size)
}

/// Sums of estimates of a crop window, by cells of some pixels.
pub(super) struct Coarse {
    crop: [u32; 4],
    /// Pixels per cell, along each axis.
    step: u32,
    /// Cells per row, rows.
    cells: [u32; 2],
    /// Sum over rounds of estimates (weighted by light paths), and their weight.
    image: Vec<f64>,
    weight: f64,
}

impl Coarse {
    /// Black, of the crop window (x, y, width, height).
    pub(super) fn new(crop: [u32; 4]) -> Self {
        let step = crop[2].max(crop[3]).div_ceil(CELLS).max(1);
        let cells = [crop[2].div_ceil(step), crop[3].div_ceil(step)];
        let count = cells[0] as usize * cells[1] as usize;
        Self { crop, step, cells, image: vec![0.0; count], weight: 0.0 }
    }

    /// An estimate of so much weight follows.
    pub(super) fn expect(&mut self, weight: f64) {
        self.weight += weight;
    }

    /// Adds what was seen in a cell, times the weight of its estimate.
    pub(super) fn add(&mut self, cell: Cell, value: f64) {
        self.image[cell as usize] += value;
    }

    /// Cell around a point of the film, if it is in the crop window.
    pub(super) fn cell(&self, raster: Vec2) -> Option<Cell> {
        let at = raster - Vec2::new(self.crop[0] as f32, self.crop[1] as f32);
        let (x, y) = (at.x.floor() as i64, at.y.floor() as i64);
        if x < 0 || y < 0 || x >= i64::from(self.crop[2]) || y >= i64::from(self.crop[3]) {
            return None;
        }
        Some(y as u32 / self.step * self.cells[0] + x as u32 / self.step)
    }

    /// Pixels of a cell.
    fn cell_pixels(&self, cell: u32) -> f64 {
        let (x, y) = (cell % self.cells[0] * self.step, cell / self.cells[0] * self.step);
        f64::from((self.crop[2] - x).min(self.step) * (self.crop[3] - y).min(self.step))
    }

    /// Square of the picture per pixel, and a little more, so that black parts do not outweigh all.
    /// A cell has seen few walks, so it is taken together with those around it: where it was missed by
    /// chance, the first contribution would seem enormous.
    pub(super) fn squares(&self) -> Vec<f64> {
        self.squares_around(BLUR)
    }

    /// The same with so many cells on each side, or none.
    pub(super) fn squares_around(&self, blur: u32) -> Vec<f64> {
        self.each_cell(|at| {
            let add = |(s, p): (f64, f64), c: u32| (s + self.image[c as usize], p + self.cell_pixels(c));
            let (sum, pixels) = self.around(at, blur).fold((0.0, 0.0), add);
            sum / (self.weight * pixels)
        })
    }

    /// The cells around one, itself included.
    fn around(&self, (x, y): (u32, u32), blur: u32) -> impl Iterator<Item = u32> {
        let [columns, rows] = self.cells;
        let row = near(x, columns, blur);
        near(y, rows, blur).flat_map(move |y| row.clone().map(move |x| y * columns + x))
    }

    /// Squares of a radiance of each cell, and a little more.
    fn each_cell(&self, radiance: impl Fn((u32, u32)) -> f64) -> Vec<f64> {
        let [columns, rows] = self.cells;
        let mean = self.image.iter().sum::<f64>() / (self.weight * f64::from(self.crop[2]) * f64::from(self.crop[3]));
        let all = (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y)));
        all.map(|at| radiance(at).powi(2) + 0.01 * mean * mean).collect()
    }

    /// The same from the median of the cells around: beside something far brighter, what the dark ones have.
    pub(super) fn dark_squares(&self) -> Vec<f64> {
        self.each_cell(|at| {
            let radiance = |c: u32| self.image[c as usize] / (self.weight * self.cell_pixels(c));
            let mut all: Vec<f64> = self.around(at, BLUR).map(radiance).collect();
            let middle = all.len() / 2;
            *all.select_nth_unstable_by(middle, f64::total_cmp).1
        })
    }
}
