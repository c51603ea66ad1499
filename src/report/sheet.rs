//! Contact sheets: pictures in rows, each with a label that says what it is and how much it was brightened.
//!
//! Pictures of one sheet have one size. Large ones are reduced by averaging whole blocks of pixels, small
//! ones enlarged by repeating pixels, so that nothing is invented and labels find room.

use crate::io::exr::ImageFile;
use embedded_graphics::Drawable;
use embedded_graphics::draw_target::DrawTarget;
use embedded_graphics::geometry::{OriginDimensions, Point, Size};
use embedded_graphics::mono_font::{MonoTextStyle, ascii::FONT_6X13};
use embedded_graphics::pixelcolor::BinaryColor;
use embedded_graphics::text::{Baseline, Text};

/// Wanted width of a picture in pixels: no smaller, and no larger by more than half.
const WIDTH: u32 = 160;
/// Height of a line of text.
const LINE: u32 = 17;
/// Between pictures.
const GAP: u32 = 6;
/// Linear radiance of the ground and of text.
const GROUND: [f32; 3] = [0.012; 3];
const INK: [f32; 3] = [0.8; 3];
/// Most stops by which a picture is brightened.
const MOST_STOPS: i32 = 24;

/// A picture of a sheet.
#[derive(Clone, Debug)]
pub struct Cell {
    /// What it is; ASCII.
    pub label: String,
    /// Linear sRGB, row by row; nothing where the cell only has a label.
    pub pixels: Vec<[f32; 3]>,
    /// Whole stops by which it is brightened.
    pub stops: i32,
}

impl Cell {
    /// Shown as it is.
    pub fn plain(label: impl Into<String>, pixels: Vec<[f32; 3]>) -> Self {
        Self { label: label.into(), pixels, stops: 0 }
    }

    /// Brightened (never darkened) by whole stops until the brightest hundredth of its pixels is about
    /// white at `exposure`; the label says by how many.
    pub fn brightened(label: impl Into<String>, pixels: Vec<[f32; 3]>, exposure: f32) -> Self {
        let stops = stops(&pixels, exposure).unwrap_or(0);
        Self { label: label.into(), pixels, stops }
    }

    fn text(&self) -> String {
        if self.stops > 0 { format!("{} +{} EV", self.label, self.stops) } else { self.label.clone() }
    }
}

/// Whole stops, at least 0, that make the brightest hundredth of the pixels about white at `exposure`; none
/// where all are black.
pub fn stops(pixels: &[[f32; 3]], exposure: f32) -> Option<i32> {
    let mut values: Vec<f32> = pixels.iter().map(|p| p[0].max(p[1]).max(p[2])).filter(|v| v.is_finite()).collect();
    let at = values.len() * 99 / 100;
    let bright = if values.is_empty() { 0.0 } else { *values.select_nth_unstable_by(at, f32::total_cmp).1 };
    (bright > 0.0).then(|| (-(bright.log2() + exposure).ceil() as i32).clamp(0, MOST_STOPS))
}

/// The sheet of rows of pictures of `width` × `height` pixels, ready to be written without any more exposure.
pub fn sheet(rows: &[Vec<Cell>], [width, height]: [u32; 2], exposure: f32) -> ImageFile {
    let scale = Scale::new(width);
    let (w, h) = (scale.of(width), scale.of(height));
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0) as u32;
    let size = [GAP + columns * (w + GAP), GAP + rows.len() as u32 * (h + LINE + GAP)];
    let mut canvas = Canvas { size, pixels: vec![GROUND; size[0] as usize * size[1] as usize] };
    for (j, row) in rows.iter().enumerate() {
        for (i, cell) in row.iter().enumerate() {
            let at = [GAP + i as u32 * (w + GAP), GAP + j as u32 * (h + LINE + GAP)];
            canvas.text(&cell.text(), at, w);
            if cell.pixels.len() == width as usize * height as usize {
                let factor = (exposure + cell.stops as f32).exp2();
                for (x, y) in (0..h).flat_map(|y| (0..w).map(move |x| (x, y))) {
                    let value = scale.pixel(&cell.pixels, [width, height], [x, y]).map(|v| v * factor);
                    canvas.set([at[0] + x, at[1] + LINE + y], value);
                }
            }
        }
    }
    let mut file = ImageFile::new(size[0], size[1]);
    file.insert_rgb("", &canvas.pixels);
    file
}

/// Pixels of a picture per pixel of the sheet, or the other way round.
#[derive(Clone, Copy)]
enum Scale {
    Reduce(u32),
    Enlarge(u32),
}

impl Scale {
    fn new(width: u32) -> Self {
        if width > WIDTH { Self::Reduce((width / WIDTH).max(1)) } else { Self::Enlarge(WIDTH.div_ceil(width.max(1))) }
    }

    fn of(self, length: u32) -> u32 {
        match self {
            Self::Reduce(n) => (length / n).max(1),
            Self::Enlarge(n) => length * n,
        }
    }

    fn pixel(self, pixels: &[[f32; 3]], [width, height]: [u32; 2], [x, y]: [u32; 2]) -> [f32; 3] {
        let at = |x: u32, y: u32| pixels[y.min(height - 1) as usize * width as usize + x.min(width - 1) as usize];
        match self {
            Self::Enlarge(n) => at(x / n, y / n),
            Self::Reduce(n) => {
                let mut sum = [0.0; 3];
                for p in (0..n * n).map(|i| at(x * n + i % n, y * n + i / n)) {
                    (0..3).for_each(|c| sum[c] += p[c] / (n * n) as f32);
                }
                sum
            }
        }
    }
}

struct Canvas {
    size: [u32; 2],
    pixels: Vec<[f32; 3]>,
}

impl Canvas {
    fn set(&mut self, [x, y]: [u32; 2], value: [f32; 3]) {
        if x < self.size[0] && y < self.size[1] {
            self.pixels[y as usize * self.size[0] as usize + x as usize] = value;
        }
    }

    /// As much of a text as has room.
    fn text(&mut self, text: &str, [x, y]: [u32; 2], room: u32) {
        let fits = (room / FONT_6X13.character_size.width) as usize;
        let shown: String = text.chars().take(fits).collect();
        let style = MonoTextStyle::new(&FONT_6X13, BinaryColor::On);
        // Drawing cannot fail: the error type of the canvas has no values.
        let _ = Text::with_baseline(&shown, Point::new(x as i32, y as i32), style, Baseline::Top).draw(self);
    }
}

impl OriginDimensions for Canvas {
    fn size(&self) -> Size {
        Size::new(self.size[0], self.size[1])
    }
}

impl DrawTarget for Canvas {
    type Color = BinaryColor;
    type Error = std::convert::Infallible;

    fn draw_iter<I: IntoIterator<Item = embedded_graphics::Pixel<BinaryColor>>>(&mut self, pixels: I) -> Result<(), Self::Error> {
        for embedded_graphics::Pixel(at, _) in pixels {
            if let (Ok(x), Ok(y)) = (u32::try_from(at.x), u32::try_from(at.y)) {
                self.set([x, y], INK);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_keep_their_mean_and_labels_are_drawn() {
        for size in [[400, 200], [40, 30], [160, 90]] {
            let pixels: Vec<[f32; 3]> = (0..size[0] * size[1]).map(|i| [0.25 + 0.5 * (i % 2) as f32; 3]).collect();
            let cells = vec![vec![Cell::plain("n = 0", pixels.clone()), Cell::plain("", pixels)]];
            let file = sheet(&cells, size, 0.0);
            let rgb = file.rgb("").unwrap();
            let (w, y) = (file.width, GAP + LINE + 3);
            let picture = (w - 3 * GAP) / 2;
            assert!((WIDTH..=2 * WIDTH).contains(&picture), "{picture}");
            let row = &rgb[(y * w + GAP) as usize..][..picture as usize];
            let mean = row.iter().map(|p| p[0]).sum::<f32>() / row.len() as f32;
            assert!((mean - 0.5).abs() < 0.01, "{mean}");
            let inked = |from: u32| {
                (0..LINE)
                    .flat_map(|y| (0..picture).map(move |x| (x, y)))
                    .filter(|(x, y)| rgb[((GAP + y) * w + from + x) as usize] == INK)
                    .count()
            };
            assert!(inked(GAP) > 20 && inked(2 * GAP + picture) == 0);
        }
    }

    #[test]
    fn dark_pictures_are_brightened_and_say_so() {
        let cell = Cell::brightened("n = 3", vec![[0.1; 3]; 100], 0.0);
        assert_eq!((cell.stops, cell.text().as_str()), (3, "n = 3 +3 EV"));
        assert_eq!(Cell::brightened("n = 0", vec![[7.0; 3]; 100], 0.0).stops, 0);
        assert_eq!(Cell::brightened("black", vec![[0.0; 3]; 100], 0.0).text(), "black");
    }
}
