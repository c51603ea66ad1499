//! Bitmap: an image looked up at `(u·w − ½, v·h − ½)` between its four nearest texels, or at
//! `(⌊u·w⌋, ⌊v·h⌋)` without interpolation.
//!
//! Texels stay in the image as decoded (f32, grey or RGB), shared with every other texture of the
//! same image; what lies outside is decided per texel index (repeat, mirror, clamp).
//!
//! ```xml
//! <texture type="bitmap" name="reflectance">
//!     <string name="filename" value="wood.png"/>
//!     <string name="filter_type" value="bilinear"/>
//!     <string name="wrap_mode" value="mirror"/>
//! </texture>
//! ```

use crate::describe::{BitmapFilter, BitmapWrap, Image, ImageDescription};
use crate::spectrum::Spectrum;
use glam::{Affine2, Vec2, Vec4};
use std::sync::Arc;

/// An image with its interpolation, wrapping and map of uv.
#[derive(Clone, Debug)]
pub struct Bitmap {
    image: Arc<Image>,
    filter: BitmapFilter,
    wrap: BitmapWrap,
    to_uv: Affine2,
    mean: Spectrum,
    min: Spectrum,
    max: Spectrum,
}

/// The same image (by identity) looked up in the same way.
impl PartialEq for Bitmap {
    fn eq(&self, o: &Self) -> bool {
        Arc::ptr_eq(&self.image, &o.image) && self.filter == o.filter && self.wrap == o.wrap && self.to_uv == o.to_uv
    }
}

impl Bitmap {
    /// From a decoded image; the error says what is wrong with it.
    pub fn new(
        image: Option<&ImageDescription>,
        filter: BitmapFilter,
        wrap: BitmapWrap,
        to_uv: Affine2,
    ) -> Result<Self, &'static str> {
        let image = match image {
            Some(ImageDescription::Data(image)) => image.clone(),
            Some(ImageDescription::File { .. }) => return Err("the image of this texture was not loaded"),
            None => return Err("this texture names an image that does not exist"),
        };
        if image.width == 0 || image.height == 0 || image.width > i32::MAX as u32 / 2 || image.height > i32::MAX as u32 / 2 {
            return Err("the image of this texture has an impossible size");
        }
        if image.channels != 1 && image.channels != 3 {
            return Err("the image of this texture has neither 1 nor 3 channels");
        }
        if Some(image.data.len()) != texel_count(&image).checked_mul(image.channels as usize) {
            return Err("the image of this texture holds another number of values than its size says");
        }
        if !image.data.iter().all(|v| v.is_finite()) {
            return Err("the image of this texture holds values that are not finite");
        }
        let mut bitmap = Self { image, filter, wrap, to_uv, mean: Spectrum::BLACK, min: Spectrum::BLACK, max: Spectrum::BLACK };
        bitmap.measure();
        Ok(bitmap)
    }

    fn measure(&mut self) {
        let mut sum = [0f64; 3];
        let (mut min, mut max) = (self.texel(0, 0), self.texel(0, 0));
        for y in 0..self.image.height {
            for x in 0..self.image.width {
                let c = self.texel(x, y);
                for (s, v) in sum.iter_mut().zip(c.to_rgb()) {
                    *s += f64::from(v);
                }
                min = min.lane_min(c);
                max = max.lane_max(c);
            }
        }
        let mean = sum.map(|s| (s / texel_count(&self.image) as f64) as f32);
        (self.mean, self.min, self.max) = (Spectrum::rgb(mean[0], mean[1], mean[2]), min, max);
    }

    /// Texels per row.
    pub fn width(&self) -> u32 {
        self.image.width
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.image.height
    }

    /// Interpolation between texels.
    pub fn filter(&self) -> BitmapFilter {
        self.filter
    }

    /// Map of uv before the look-up.
    pub fn to_uv(&self) -> Affine2 {
        self.to_uv
    }

    /// Mean of all texels.
    pub fn mean(&self) -> Spectrum {
        self.mean
    }

    /// Smallest value of every lane.
    pub fn min(&self) -> Spectrum {
        self.min
    }

    /// Largest value of every lane.
    pub fn max(&self) -> Spectrum {
        self.max
    }

    /// A texel; `x` below the width and `y` below the height, rows from v = 0.
    #[inline]
    pub fn texel(&self, x: u32, y: u32) -> Spectrum {
        let i = y as usize * self.image.width as usize + x as usize;
        if self.image.channels == 1 {
            Spectrum::grey(self.image.data[i])
        } else {
            let t = &self.image.data[3 * i..3 * i + 3];
            Spectrum::rgb(t[0], t[1], t[2])
        }
    }

    /// The texture at `uv`.
    #[inline]
    pub fn eval(&self, uv: Vec2) -> Spectrum {
        let size = Vec2::new(self.image.width as f32, self.image.height as f32);
        let p = self.to_uv.transform_point2(uv) * size;
        match self.filter {
            BitmapFilter::Nearest => {
                let i = p.floor();
                self.texel(self.column(i.x as i32), self.row(i.y as i32))
            }
            BitmapFilter::Bilinear => {
                let p = p - 0.5;
                let floor = p.floor();
                // The maximum makes 0 of the NaN that coordinates beyond the range of f32 give.
                let t = (p - floor).max(Vec2::ZERO);
                // Conversion saturates (and makes 0 of NaN), so any uv gives some texel.
                let (x, y) = (floor.x as i32, floor.y as i32);
                let (x0, x1) = (self.column(x), self.column(x.saturating_add(1)));
                let (y0, y1) = (self.row(y), self.row(y.saturating_add(1)));
                let row0 = mix(self.texel(x0, y0).0, self.texel(x1, y0).0, t.x);
                let row1 = mix(self.texel(x0, y1).0, self.texel(x1, y1).0, t.x);
                Spectrum(mix(row0, row1, t.y))
            }
        }
    }

    #[inline]
    fn column(&self, x: i32) -> u32 {
        wrapped(x, self.image.width, self.wrap)
    }

    #[inline]
    fn row(&self, y: i32) -> u32 {
        wrapped(y, self.image.height, self.wrap)
    }
}

#[inline]
fn mix(a: Vec4, b: Vec4, t: f32) -> Vec4 {
    a + (b - a) * t
}

fn texel_count(image: &Image) -> usize {
    image.width as usize * image.height as usize
}

/// The index in `0..n` that stands for any index `i`.
#[inline]
fn wrapped(i: i32, n: u32, wrap: BitmapWrap) -> u32 {
    if (i as u32) < n {
        return i as u32;
    }
    let size = n as i32;
    let inside = match wrap {
        BitmapWrap::Clamp => i.clamp(0, size - 1),
        BitmapWrap::Repeat => i.rem_euclid(size),
        BitmapWrap::Mirror => {
            let j = i.rem_euclid(2 * size);
            if j < size { j } else { 2 * size - 1 - j }
        }
    };
    inside as u32
}
