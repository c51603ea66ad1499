//! Bitmap: an image looked up at `(u·w − ½, v·h − ½)` between its four nearest texels, or at
//! `(⌊u·w⌋, ⌊v·h⌋)` without interpolation.
//!
//! Textures of the same image share its [`Texels`]; what lies outside is decided per texel index (repeat,
//! mirror, clamp).
//!
//! ```xml
//! <texture type="bitmap" name="reflectance">
//!     <string name="filename" value="wood.png"/>
//!     <string name="filter_type" value="bilinear"/>
//!     <string name="wrap_mode" value="mirror"/>
//! </texture>
//! ```

use super::texels::Texels;
use crate::describe::{BitmapFilter, BitmapWrap};
use crate::spectrum::Spectrum;
use glam::{Affine2, Vec2, Vec4};
use std::sync::Arc;

/// An image with its interpolation, wrapping and map of uv.
#[derive(Clone, Debug)]
pub struct Bitmap {
    texels: Arc<Texels>,
    filter: BitmapFilter,
    wrap: BitmapWrap,
    to_uv: Affine2,
}

/// The same image (by identity) looked up in the same way.
impl PartialEq for Bitmap {
    fn eq(&self, o: &Self) -> bool {
        Arc::ptr_eq(&self.texels, &o.texels) && self.filter == o.filter && self.wrap == o.wrap && self.to_uv == o.to_uv
    }
}

impl Bitmap {
    /// An image, looked up in this way.
    pub fn new(texels: Arc<Texels>, filter: BitmapFilter, wrap: BitmapWrap, to_uv: Affine2) -> Self {
        Self { texels, filter, wrap, to_uv }
    }

    /// The image.
    pub fn texels(&self) -> &Texels {
        &self.texels
    }

    /// The texture at `uv`.
    #[inline]
    pub fn eval(&self, uv: Vec2) -> Spectrum {
        let texels = &*self.texels;
        let size = Vec2::new(texels.width() as f32, texels.height() as f32);
        let p = self.to_uv.transform_point2(uv) * size;
        match self.filter {
            BitmapFilter::Nearest => {
                let i = p.floor();
                texels.at(self.column(i.x as i32), self.row(i.y as i32))
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
                let row0 = mix(texels.at(x0, y0).0, texels.at(x1, y0).0, t.x);
                let row1 = mix(texels.at(x0, y1).0, texels.at(x1, y1).0, t.x);
                Spectrum(mix(row0, row1, t.y))
            }
        }
    }

    #[inline]
    fn column(&self, x: i32) -> u32 {
        wrapped(x, self.texels.width(), self.wrap)
    }

    #[inline]
    fn row(&self, y: i32) -> u32 {
        wrapped(y, self.texels.height(), self.wrap)
    }
}

#[inline]
fn mix(a: Vec4, b: Vec4, t: f32) -> Vec4 {
    a + (b - a) * t
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
