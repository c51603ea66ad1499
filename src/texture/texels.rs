//! Texels of an image as look-ups read them.
//!
//! Walks look at textures all over, so where an image is larger than the caches, a look-up is a wait for memory. What is read is
//! kept small and together: images of eight bits have at most 256 distinct numbers, so each number is a byte that stands for it
//! (a colour takes a third of the memory, grey the same, and nothing is lost), and texels lie in squares of four by four, a line of a cache each, so that those
//! between which is interpolated mostly come at once.

use crate::describe::{Image, ImageDescription};
use crate::spectrum::Spectrum;
use std::sync::Arc;

/// Texels along each side of a square.
const SIDE: u32 = 4;

/// Texels of a square, row by row, of each the codes of its three lanes.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Square([[u8; 4]; (SIDE * SIDE) as usize]);

const _: () = assert!(size_of::<Square>() == 64);

#[derive(Clone, Debug)]
enum Store {
    Coded {
        squares: Vec<Square>,
        /// Squares in a row of squares.
        row: usize,
        /// What codes stand for.
        values: Box<[f32; 256]>,
    },
    /// As decoded, where there are too many distinct numbers.
    Plain(Arc<Image>),
}

/// An image without its texture's settings; several textures may share it.
#[derive(Clone, Debug)]
pub struct Texels {
    width: u32,
    height: u32,
    store: Store,
    mean: Spectrum,
    min: Spectrum,
    max: Spectrum,
}

impl Texels {
    /// Of a decoded image; the error says what is wrong with it.
    pub(super) fn new(image: Option<&ImageDescription>) -> Result<Self, &'static str> {
        let image = match image {
            Some(ImageDescription::Data(image)) => image,
            Some(ImageDescription::File { .. }) => return Err("the image of this texture was not loaded"),
            None => return Err("this texture names an image that does not exist"),
        };
        let &Image { width, height, channels, ref data } = &**image;
        if width == 0 || height == 0 || width > i32::MAX as u32 / 2 || height > i32::MAX as u32 / 2 {
            return Err("the image of this texture has an impossible size");
        }
        if channels != 1 && channels != 3 {
            return Err("the image of this texture has neither 1 nor 3 channels");
        }
        if Some(data.len()) != (width as usize * height as usize).checked_mul(channels as usize) {
            return Err("the image of this texture holds another number of values than its size says");
        }
        if !data.iter().all(|v| v.is_finite()) {
            return Err("the image of this texture holds values that are not finite");
        }
        let store = coded(image).unwrap_or_else(|| Store::Plain(image.clone()));
        let black = Spectrum::BLACK;
        let mut texels = Self { width, height, store, mean: black, min: black, max: black };
        texels.measure();
        Ok(texels)
    }

    fn measure(&mut self) {
        let mut sum = [0f64; 3];
        let (mut min, mut max) = (self.at(0, 0), self.at(0, 0));
        for y in 0..self.height {
            for x in 0..self.width {
                let c = self.at(x, y);
                for (s, v) in sum.iter_mut().zip(c.to_rgb()) {
                    *s += f64::from(v);
                }
                min = min.lane_min(c);
                max = max.lane_max(c);
            }
        }
        let count = self.width as usize * self.height as usize;
        let [r, g, b] = sum.map(|s| (s / count as f64) as f32);
        (self.mean, self.min, self.max) = (Spectrum::rgb(r, g, b), min, max);
    }

    /// Texels per row.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.height
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

    /// Memory held, in bytes.
    pub fn bytes(&self) -> usize {
        match &self.store {
            Store::Coded { squares, .. } => size_of_val(&squares[..]),
            Store::Plain(image) => size_of_val(&image.data[..]),
        }
    }

    /// A texel; `x` below the width and `y` below the height, rows from v = 0.
    #[inline]
    pub fn at(&self, x: u32, y: u32) -> Spectrum {
        match &self.store {
            Store::Coded { squares, row, values } => {
                let square = &squares[(y / SIDE) as usize * row + (x / SIDE) as usize];
                let [r, g, b, _] = square.0[(y % SIDE * SIDE + x % SIDE) as usize].map(|code| values[usize::from(code)]);
                Spectrum::rgb(r, g, b)
            }
            Store::Plain(image) => {
                let i = y as usize * self.width as usize + x as usize;
                if image.channels == 1 {
                    Spectrum::grey(image.data[i])
                } else {
                    let t = &image.data[3 * i..3 * i + 3];
                    Spectrum::rgb(t[0], t[1], t[2])
                }
            }
        }
    }
}

/// With codes, if there are enough of them.
fn coded(image: &Image) -> Option<Store> {
    let row = image.width.div_ceil(SIDE) as usize;
    let side = SIDE as usize;
    let mut squares = vec![];
    let mut codes = Codes::default();
    let channels = image.channels as usize;
    let rows = image.data.chunks_exact(image.width as usize * channels);
    for (y, texels) in rows.enumerate() {
        // One row of squares at a time: most images with too many numbers show it in the first.
        squares.resize((y / side + 1) * row, Square([[0; 4]; (SIDE * SIDE) as usize]));
        for (x, texel) in texels.chunks_exact(channels).enumerate() {
            let place = &mut squares[y / side * row + x / side].0[y % side * side + x % side];
            for (lane, code) in place[..3].iter_mut().enumerate() {
                *code = codes.of(texel[lane.min(channels - 1)])?;
            }
        }
    }
    Some(Store::Coded { squares, row, values: Box::new(codes.values) })
}

/// Numbers in the order in which they were met. A picture asks for millions: the table is small and asks once or twice.
struct Codes {
    values: [f32; 256],
    count: usize,
    /// Codes + 1 by their numbers' bits, each at the first free slot from its own; 0 where there is none.
    slots: [u16; 1024],
}

impl Default for Codes {
    fn default() -> Self {
        Self { values: [0.0; 256], count: 0, slots: [0; 1024] }
    }
}

impl Codes {
    /// The code of a number, which it has from now on; `None` where no code is left.
    fn of(&mut self, x: f32) -> Option<u8> {
        // Multiplicative hashing: the upper ten bits.
        let mut at = (x.to_bits().wrapping_mul(0x9e37_79b1) >> 22) as usize;
        while let Some(code) = self.slots[at].checked_sub(1) {
            if self.values[usize::from(code)].to_bits() == x.to_bits() {
                return Some(code as u8);
            }
            at = (at + 1) % self.slots.len();
        }
        *self.values.get_mut(self.count)? = x;
        self.slots[at] = self.count as u16 + 1;
        self.count += 1;
        Some((self.count - 1) as u8)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn texels(image: &Arc<Image>) -> Texels {
        Texels::new(Some(&ImageDescription::Data(image.clone()))).expect("a sound image")
    }

    proptest! {
        /// With codes or without, a texel is what was decoded, bit for bit.
        #[test]
        fn texels_are_those_of_the_image(
            width in 1..40u32,
            height in 1..20u32,
            rgb in any::<bool>(),
            distinct in prop_oneof![1..250u32, 300..1000u32],
            start in any::<u32>(),
        ) {
            let channels = if rgb { 3 } else { 1 };
            let number = |i: u32| (i.wrapping_mul(2_654_435_761).wrapping_add(start) % distinct) as f32 / 7.0 - 3.0;
            let data: Vec<f32> = (0..width * height * channels).map(number).collect();
            let image = Arc::new(Image { width, height, channels, data });
            let texels = texels(&image);
            for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
                let i = ((y * width + x) * channels) as usize;
                let expected = if rgb { [0, 1, 2].map(|l| image.data[i + l]) } else { [image.data[i]; 3] };
                prop_assert_eq!(texels.at(x, y).to_rgb().map(f32::to_bits), expected.map(f32::to_bits));
            }
        }
    }

    #[test]
    fn eight_bits_are_kept_in_bytes() {
        let of = |distinct: u32| {
            let data = (0..64 * 64 * 3).map(|i| (i % distinct) as f32).collect();
            texels(&Arc::new(Image { width: 64, height: 64, channels: 3, data })).bytes()
        };
        assert_eq!(of(256), 64 * 64 * 4);
        assert_eq!(of(257), 64 * 64 * 12);
    }
}
