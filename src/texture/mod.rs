//! Textures: numbers that vary over a surface, `t(u, v)`, looked up at texture coordinates.
//!
//! A [`TextureSlot`] is what a model or an emitter keeps: a constant by value, anything else by
//! index, so that the usual case needs no memory access. [`Textures`] owns the rest, is built once
//! and is only read afterwards. Texture coordinates follow Mitsuba 3: v = 0 is the *first* row of
//! an image, texel centres lie at half-integers over the resolution.

mod bitmap;
mod checkerboard;
mod texels;

pub use checkerboard::Checkerboard;

use crate::describe::{ImageDescription, ImageId, Place, Problems, TextureDescription};
use crate::spectrum::Spectrum;
use bitmap::Bitmap;
use glam::{Affine2, Mat2, Mat4, Vec2};
use std::collections::HashMap;
use std::sync::Arc;
use texels::Texels;

/// A texture as its user keeps it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TextureSlot {
    /// The same everywhere.
    Constant(Spectrum),
    /// Index of a bitmap in [`Textures`].
    Image(u32),
    /// Index of a checkerboard in [`Textures`].
    Checker(u32),
}

impl TextureSlot {
    /// One everywhere.
    pub const ONE: Self = Self::Constant(Spectrum::ONE);

    /// Does not vary.
    #[inline]
    pub fn is_constant(self) -> bool {
        matches!(self, Self::Constant(_))
    }
}

/// All textures of a scene that are not constant.
#[derive(Clone, Debug, Default)]
pub struct Textures {
    bitmaps: Vec<Bitmap>,
    checkers: Vec<Checkerboard>,
    /// Of the images of bitmaps, each made once.
    images: HashMap<ImageId, Arc<Texels>>,
}

impl Textures {
    /// Adds a described texture and returns its slot; `images` are the scene's, already decoded.
    /// What is wrong goes to `problems` and a black constant is returned in its place.
    pub fn add(&mut self, description: &TextureDescription, images: &[ImageDescription], problems: &mut Problems) -> TextureSlot {
        const BLACK: TextureSlot = TextureSlot::Constant(Spectrum::BLACK);
        match description {
            TextureDescription::Constant([r, g, b]) => TextureSlot::Constant(Spectrum::rgb(*r, *g, *b)),
            TextureDescription::Bitmap { image, filter, wrap, to_uv, place } => {
                let Some(to_uv) = affine(to_uv, *place, problems) else { return BLACK };
                match self.texels(*image, images) {
                    Ok(texels) => TextureSlot::Image(intern(&mut self.bitmaps, Bitmap::new(texels, *filter, *wrap, to_uv))),
                    Err(what) => {
                        problems.error(*place, what);
                        BLACK
                    }
                }
            }
            TextureDescription::Checkerboard { color0, color1, to_uv, place } => {
                let Some(to_uv) = affine(to_uv, *place, problems) else { return BLACK };
                let colors = [self.add(color0, images, problems), self.add(color1, images, problems)];
                TextureSlot::Checker(intern(&mut self.checkers, Checkerboard { colors, to_uv }))
            }
        }
    }

    /// The texels of an image, made when they are first asked for.
    fn texels(&mut self, id: ImageId, images: &[ImageDescription]) -> Result<Arc<Texels>, &'static str> {
        if let Some(texels) = self.images.get(&id) {
            return Ok(texels.clone());
        }
        let texels = Arc::new(Texels::new(images.get(id.0 as usize))?);
        self.images.insert(id, texels.clone());
        Ok(texels)
    }

    /// Memory of the images, in bytes.
    pub fn bytes(&self) -> usize {
        self.images.values().map(|t| t.bytes()).sum()
    }

    /// The texture at texture coordinates `uv`.
    #[inline]
    pub fn eval(&self, slot: TextureSlot, uv: Vec2) -> Spectrum {
        match slot {
            TextureSlot::Constant(c) => c,
            _ => self.eval_varying(slot, uv),
        }
    }

    /// The texture as one number: grey as it is, colour by its luminance.
    ///
    /// A checkerboard used as a number has its two fields exchanged with respect to [`Self::eval`],
    /// as in Mitsuba 3.
    #[inline]
    pub fn eval1(&self, slot: TextureSlot, uv: Vec2) -> f32 {
        match slot {
            TextureSlot::Constant(c) => grey(c),
            _ => self.eval1_varying(slot, uv),
        }
    }

    #[inline(never)]
    fn eval_varying(&self, slot: TextureSlot, uv: Vec2) -> Spectrum {
        match slot {
            TextureSlot::Constant(c) => c,
            TextureSlot::Image(i) => self.bitmaps[i as usize].eval(uv),
            TextureSlot::Checker(i) => {
                let checker = &self.checkers[i as usize];
                self.eval(checker.colors[checker.field(uv)], uv)
            }
        }
    }

    #[inline(never)]
    fn eval1_varying(&self, slot: TextureSlot, uv: Vec2) -> f32 {
        match slot {
            TextureSlot::Constant(c) => grey(c),
            TextureSlot::Image(i) => grey(self.bitmaps[i as usize].eval(uv)),
            TextureSlot::Checker(i) => {
                let checker = &self.checkers[i as usize];
                self.eval1(checker.colors[1 - checker.field(uv)], uv)
            }
        }
    }

    /// Mean over the unit square of the texture (before `to_uv`) in every lane.
    pub fn mean_spectrum(&self, slot: TextureSlot) -> Spectrum {
        match slot {
            TextureSlot::Constant(c) => c,
            TextureSlot::Image(i) => self.bitmaps[i as usize].texels().mean(),
            TextureSlot::Checker(i) => {
                let [a, b] = self.checkers[i as usize].colors;
                0.5 * (self.mean_spectrum(a) + self.mean_spectrum(b))
            }
        }
    }

    /// Mean as one number, as Mitsuba 3 weighs lobes with it: the mean lane of a constant, the mean
    /// luminance of an image.
    pub fn mean(&self, slot: TextureSlot) -> f32 {
        match slot {
            TextureSlot::Constant(c) => c.mean(),
            TextureSlot::Image(i) => grey(self.bitmaps[i as usize].texels().mean()),
            TextureSlot::Checker(i) => {
                let [a, b] = self.checkers[i as usize].colors;
                0.5 * (self.mean(a) + self.mean(b))
            }
        }
    }

    /// The largest value of every lane.
    pub fn max(&self, slot: TextureSlot) -> Spectrum {
        self.extreme(slot, Spectrum::lane_max, Texels::max)
    }

    /// The smallest value of every lane.
    pub fn min(&self, slot: TextureSlot) -> Spectrum {
        self.extreme(slot, Spectrum::lane_min, Texels::min)
    }

    fn extreme(&self, slot: TextureSlot, join: fn(Spectrum, Spectrum) -> Spectrum, of: fn(&Texels) -> Spectrum) -> Spectrum {
        match slot {
            TextureSlot::Constant(c) => c,
            TextureSlot::Image(i) => of(self.bitmaps[i as usize].texels()),
            TextureSlot::Checker(i) => {
                let [a, b] = self.checkers[i as usize].colors;
                join(self.extreme(a, join, of), self.extreme(b, join, of))
            }
        }
    }
}

/// Grey stays exactly itself (an opacity of 1 must not become 0.99999994), colour gives luminance.
#[inline]
fn grey(c: Spectrum) -> f32 {
    if c.0.x == c.0.y && c.0.y == c.0.z { c.0.x } else { c.luminance() }
}

/// Index of an equal element, or of `item` appended.
fn intern<T: PartialEq>(list: &mut Vec<T>, item: T) -> u32 {
    let index = list.iter().position(|x| *x == item).unwrap_or_else(|| {
        list.push(item);
        list.len() - 1
    });
    index as u32
}

/// The map of (u, v) inside a 4×4 matrix: x and y of its linear part and of its translation.
fn affine(m: &Mat4, place: Place, problems: &mut Problems) -> Option<Affine2> {
    if !m.is_finite() {
        problems.error(place, "`to_uv` is not finite");
        return None;
    }
    let linear = Mat2::from_cols(m.x_axis.truncate().truncate(), m.y_axis.truncate().truncate());
    Some(Affine2 { matrix2: linear, translation: m.w_axis.truncate().truncate() })
}

#[cfg(test)]
mod tests;
