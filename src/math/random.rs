//! Random numbers as a pure function of (walker, path, sample, dimension, seed).
//!
//! A walk owns one small generator whose state is hashed from what identifies the sample, so that
//! an image does not depend on threads, tiles or the order of work. Dimensions are consumed in the
//! order in which the walk asks for them.
//!
//! The first dimensions of a walk can be those of a point of an Owen-scrambled Sobol sequence
//! [Burley 2020]: many walks together then fill the space of their first decisions evenly, each of
//! them still being uniformly distributed. Code that decides something in the same order in all walks
//! asks for an axis; code that may or may not run, for a free number.

use super::sobol::{FOURS, Point};
use glam::Vec2;
use rand::Rng;
use rand_pcg::Pcg32;

/// The stream of numbers of one walk.
#[derive(Clone, Debug)]
pub struct Random {
    free: Pcg32,
    point: Axes,
}

/// How far the axes of a point of a sequence are used up.
#[derive(Clone, Debug, Default)]
struct Axes {
    of: Point,
    /// Dimensions given out, and how many there are (a multiple of four).
    next: u32,
    end: u32,
    four: [f32; 4],
}

/// Which family of samples a stream belongs to; families never share numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Family {
    /// Gathering walks, indexed by pixel.
    Gather = 1,
    /// Shooting walks, indexed by light path.
    Shoot = 2,
    /// Pilot passes that decide parameters of the estimator.
    Pilot = 3,
    /// Anything else (tests, tools).
    Other = 4,
    /// Rays of finite elements, indexed by element or ray.
    Elements = 5,
    /// Samples of chains of Dirac events alone, indexed by pixel.
    Chain = 6,
    /// What all pixels of a pass have in common.
    Film = 7,
}

/// Mixes 64 bits so that every input bit reaches every output bit (finaliser of SplitMix64).
#[inline]
pub fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

impl Random {
    /// The stream of sample `sample` of path or pixel `index` in `family` under `seed`.
    #[inline]
    pub fn new(family: Family, index: u64, sample: u64, seed: u64) -> Self {
        let a = mix(seed ^ mix(((family as u64) << 56) ^ index.wrapping_mul(0x9e37_79b9_7f4a_7c15)));
        let b = mix(a ^ sample.wrapping_mul(0xd1b5_4a32_d192_ed03));
        Self { free: Pcg32::new(b, a), point: Axes::default() }
    }

    /// The same stream, its first `axes` axes (a multiple of four, at most sixteen) those of point `point` of the sequence
    /// that belongs to `index` of `family`.
    #[inline]
    pub fn with_point(mut self, family: Family, index: u64, point: u64, seed: u64, axes: u32) -> Self {
        // A sequence has 2³² points; more come from another one.
        let sequence = index ^ (point >> 32).rotate_right(16);
        let seed = mix(seed ^ mix(!((family as u64) << 56) ^ sequence.wrapping_mul(0x9e37_79b9_7f4a_7c15)));
        let of = Point::new(point as u32, seed as u32);
        self.point = Axes { of, next: 0, end: axes.min(4 * FOURS), four: [0.0; 4] };
        self
    }

    /// Uniform in [0, 1): the next axis of the walk's point, a free number after the last.
    #[inline]
    pub fn axis(&mut self) -> f32 {
        let p = &mut self.point;
        if p.next == p.end {
            return self.unit();
        }
        if p.next.is_multiple_of(4) {
            p.four = p.of.axes(p.next / 4);
        }
        p.next += 1;
        p.four[(p.next as usize - 1) % 4]
    }

    /// Uniform in [0, 1)², two axes.
    #[inline]
    pub fn axis2(&mut self) -> Vec2 {
        let x = self.axis();
        Vec2::new(x, self.axis())
    }

    /// Uniform in [0, 1), a multiple of 2⁻²⁴.
    #[inline]
    pub fn unit(&mut self) -> f32 {
        (self.free.next_u32() >> 8) as f32 * (1.0 / 16_777_216.0)
    }

    /// Uniform in [0, 1)².
    #[inline]
    pub fn unit2(&mut self) -> Vec2 {
        Vec2::new(self.unit(), self.unit())
    }

    /// Uniform integer below `n` (`n` > 0), by multiplication; bias below n/2³².
    #[inline]
    pub fn below(&mut self, n: u32) -> u32 {
        ((u64::from(self.free.next_u32()) * u64::from(n)) >> 32) as u32
    }
}
