//! Points of an Owen-scrambled Sobol sequence, four axes at a time: those of `sobol_burley` bit for bit.
//!
//! The library shuffles the index of the point anew for every four axes, and then adds up one direction vector
//! for each bit of it, in a loop whose length nobody can predict. Here the index is shuffled once for a point, and
//! sums of four vectors each lie ready in tables of four kilobytes.

use sobol_burley::parts::{Int4, hash, hash_int4, owen_scramble_int4_rev, owen_scramble_rev, sobol_rev};
use std::sync::LazyLock;

/// Axes that a point has at most, in fours.
pub const FOURS: u32 = 4;

/// Sums of direction vectors: by four axes, by four bits of the index (from the top), by their value.
type Tables = [[[[u32; 4]; 16]; 4]; FOURS as usize];

static TABLES: LazyLock<Tables> = LazyLock::new(|| {
    let entry = |four: usize, place: usize, bits: usize| {
        [0, 1, 2, 3].map(|axis| sobol_rev((bits as u32) << (28 - 4 * place), 4 * four as u32 + axis))
    };
    let rows = |four: usize| [0, 1, 2, 3].map(|place| std::array::from_fn(|bits| entry(four, place, bits)));
    std::array::from_fn(rows)
});

/// A point of the sequence that belongs to a seed.
#[derive(Clone, Copy, Debug, Default)]
pub struct Point {
    /// Index, shuffled, its bits in reverse.
    index: u32,
    seed: u32,
}

impl Point {
    /// Point `index` < 2¹⁶.
    #[inline]
    pub fn new(index: u32, seed: u32) -> Self {
        Self { index: owen_scramble_rev(index.reverse_bits(), hash(seed ^ 0x79c6_8e4a)), seed }
    }

    /// Axes 4·`four` … 4·`four` + 3, uniform in [0, 1); `four` < [`FOURS`].
    #[inline]
    pub fn axes(&self, four: u32) -> [f32; 4] {
        let rows = &TABLES[four as usize];
        let sum = |place: usize| Int4::from(rows[place][(self.index >> (28 - 4 * place) & 15) as usize]);
        let sobol = (sum(0) ^ sum(1)) ^ (sum(2) ^ sum(3));
        let scramble = Int4::from([self.seed.wrapping_mul(0x9c8f_2d3b) ^ four; 4])
            ^ [0x912f_69ba, 0x174f_18ab, 0x691e_72ca, 0xb40c_c1b8].into();
        owen_scramble_int4_rev(sobol, hash_int4(scramble)).reverse_bits().to_f32_norm()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::mix;

    #[test]
    fn points_are_those_of_the_library() {
        for i in 0..10_000u64 {
            let (index, seed) = ((mix(i) & 0xffff) as u32, mix(!i) as u32);
            let point = Point::new(index, seed);
            for four in 0..FOURS {
                assert_eq!(point.axes(four), sobol_burley::sample_4d(index, four, seed));
            }
        }
    }
}
