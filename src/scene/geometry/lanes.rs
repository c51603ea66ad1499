//! Eight numbers at once: the arithmetic that traversal is written in, and its portable form.
//!
//! Traversal is one generic function over [`Lanes`]; the AVX2 form and the portable form differ in
//! nothing but this arithmetic (the portable one rounds products before adding them), so what is
//! proved of one holds for the other. The choice is made once, when a scene is built.

use super::Hit;
use super::ray::Ray;
use super::tree::Tree;

/// Eight single-precision numbers.
pub(super) trait Lanes: Copy {
    /// One truth value per lane.
    type Mask: Copy;
    /// The same number in every lane.
    fn splat(x: f32) -> Self;
    /// From memory (32-byte aligned by the types that hold such arrays).
    fn load(x: &[f32; 8]) -> Self;
    /// To memory.
    fn store(self) -> [f32; 8];
    /// a + b.
    fn add(self, b: Self) -> Self;
    /// a − b.
    fn sub(self, b: Self) -> Self;
    /// a · b.
    fn mul(self, b: Self) -> Self;
    /// a / b.
    fn div(self, b: Self) -> Self;
    /// a · b + c.
    fn mul_add(self, b: Self, c: Self) -> Self;
    /// a · b − c.
    fn mul_sub(self, b: Self, c: Self) -> Self;
    /// The smaller; b where either is not a number.
    fn min(self, b: Self) -> Self;
    /// The larger; b where either is not a number.
    fn max(self, b: Self) -> Self;
    /// a ≤ b, false for what is not a number.
    fn le(self, b: Self) -> Self::Mask;
    /// a < b, false for what is not a number.
    fn lt(self, b: Self) -> Self::Mask;
    /// Both.
    fn and(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// Either.
    fn or(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// Lane k in bit k.
    fn bits(m: Self::Mask) -> u32;
    /// Traverses the subtree of an instance, whose ray is in the coordinates of its group.
    fn enter<const ANY: bool>(tree: &Tree, root: u32, ray: &Ray) -> Hit;
}

/// Eight numbers as an array: what every processor can do.
#[derive(Clone, Copy)]
pub(super) struct Portable([f32; 8]);

impl Portable {
    #[inline(always)]
    fn zip(self, b: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|k| f(self.0[k], b.0[k])))
    }

    #[inline(always)]
    fn compare(self, b: Self, f: impl Fn(f32, f32) -> bool) -> u32 {
        let mut mask = 0;
        for k in 0..8 {
            mask |= u32::from(f(self.0[k], b.0[k])) << k;
        }
        mask
    }
}

impl Lanes for Portable {
    type Mask = u32;

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self([x; 8])
    }

    #[inline(always)]
    fn load(x: &[f32; 8]) -> Self {
        Self(*x)
    }

    #[inline(always)]
    fn store(self) -> [f32; 8] {
        self.0
    }

    #[inline(always)]
    fn add(self, b: Self) -> Self {
        self.zip(b, |a, b| a + b)
    }

    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        self.zip(b, |a, b| a - b)
    }

    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        self.zip(b, |a, b| a * b)
    }

    #[inline(always)]
    fn div(self, b: Self) -> Self {
        self.zip(b, |a, b| a / b)
    }

    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        self.mul(b).add(c)
    }

    #[inline(always)]
    fn mul_sub(self, b: Self, c: Self) -> Self {
        self.mul(b).sub(c)
    }

    #[inline(always)]
    fn min(self, b: Self) -> Self {
        self.zip(b, |a, b| if a < b { a } else { b })
    }

    #[inline(always)]
    fn max(self, b: Self) -> Self {
        self.zip(b, |a, b| if a > b { a } else { b })
    }

    #[inline(always)]
    fn le(self, b: Self) -> u32 {
        self.compare(b, |a, b| a <= b)
    }

    #[inline(always)]
    fn lt(self, b: Self) -> u32 {
        self.compare(b, |a, b| a < b)
    }

    #[inline(always)]
    fn and(a: u32, b: u32) -> u32 {
        a & b
    }

    #[inline(always)]
    fn or(a: u32, b: u32) -> u32 {
        a | b
    }

    #[inline(always)]
    fn bits(m: u32) -> u32 {
        m
    }

    fn enter<const ANY: bool>(tree: &Tree, root: u32, ray: &Ray) -> Hit {
        super::traverse::traverse::<Self, ANY, false>(tree, root, ray)
    }
}
