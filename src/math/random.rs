//! Random numbers as a pure function of (walker, path, sample, dimension, seed).
//!
//! A walk owns one small generator whose state is hashed from what identifies the sample, so that
//! an image does not depend on threads, tiles or the order of work. Dimensions are consumed in the
//! order in which the walk asks for them.

use glam::Vec2;
use rand::Rng;
use rand_pcg::Pcg32;

/// The stream of numbers of one walk.
#[derive(Clone, Debug)]
pub struct Random(Pcg32);

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
        Self(Pcg32::new(b, a))
    }

    /// Uniform in [0, 1), a multiple of 2⁻²⁴.
    #[inline]
    pub fn unit(&mut self) -> f32 {
        (self.0.next_u32() >> 8) as f32 * (1.0 / 16_777_216.0)
    }

    /// Uniform in [0, 1)².
    #[inline]
    pub fn unit2(&mut self) -> Vec2 {
        Vec2::new(self.unit(), self.unit())
    }

    /// Uniform integer below `n` (`n` > 0), by multiplication; bias below n/2³².
    #[inline]
    pub fn below(&mut self, n: u32) -> u32 {
        ((u64::from(self.0.next_u32()) * u64::from(n)) >> 32) as u32
    }
}
