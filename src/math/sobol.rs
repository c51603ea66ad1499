//! Points of Owen-scrambled Sobol sequences, four axes at a time.
//!
//! The scrambling of points and of their order is that of [Burley 2020] as `sobol_burley` has it, bit for bit. That library
//! ends after 2¹⁶ points, enough for the samples of a pixel; the light paths of a render are one sequence of up to 2³².
//! It adds up a direction vector for each bit of the index, in a loop whose length nobody can predict; here sums of four
//! vectors each lie ready in tables.

use sobol_burley::parts::{Int4, hash, hash_int4, owen_scramble_int4_rev, owen_scramble_rev};
use std::sync::LazyLock;

/// Axes that a point has at most, in fours.
pub const FOURS: u32 = 4;

/// Of each axis but the first: coefficients of a primitive polynomial, and first direction numbers, as many as its degree
/// [Joe & Kuo 2008, `new-joe-kuo-6`].
const POLYNOMIALS: [(u32, &[u32]); 4 * FOURS as usize - 1] = [
    (0, &[1]),
    (1, &[1, 3]),
    (1, &[1, 3, 1]),
    (2, &[1, 1, 1]),
    (1, &[1, 1, 3, 3]),
    (4, &[1, 3, 5, 13]),
    (2, &[1, 1, 5, 5, 17]),
    (4, &[1, 1, 5, 5, 5]),
    (7, &[1, 1, 7, 11, 19]),
    (11, &[1, 1, 5, 1, 1]),
    (13, &[1, 1, 1, 3, 11]),
    (14, &[1, 3, 5, 5, 31]),
    (1, &[1, 3, 3, 9, 7, 49]),
    (13, &[1, 1, 1, 15, 21, 21]),
    (16, &[1, 3, 1, 13, 27, 49]),
];

/// Sums of direction vectors, bits in reverse: by four axes, by four bits of the index (from the lowest), by their value.
type Tables = [[[[u32; 4]; 16]; 8]; FOURS as usize];

static TABLES: LazyLock<Tables> = LazyLock::new(|| {
    let vectors: [[u32; 32]; 4 * FOURS as usize] = std::array::from_fn(direction_vectors);
    let entry = |four: usize, place: usize, bits: usize| {
        [0, 1, 2, 3].map(|axis| {
            let set = (0..4).filter(|b| bits >> b & 1 == 1);
            set.fold(0, |sum, b| sum ^ vectors[4 * four + axis][4 * place + b].reverse_bits())
        })
    };
    let rows = |four: usize| std::array::from_fn(|place| std::array::from_fn(|bits| entry(four, place, bits)));
    std::array::from_fn(rows)
});

/// What each bit of an index, from the lowest, adds to an axis [Joe & Kuo 2008, eq. 2].
fn direction_vectors(axis: usize) -> [u32; 32] {
    if axis == 0 {
        return std::array::from_fn(|i| 1 << (31 - i));
    }
    let (coefficients, first) = POLYNOMIALS[axis - 1];
    let degree = first.len();
    let mut v = [0u32; 32];
    for i in 0..32 {
        v[i] = match first.get(i) {
            Some(m) => m << (31 - i),
            None => (1..degree)
                .filter(|k| coefficients >> (degree - 1 - k) & 1 == 1)
                .fold(v[i - degree] ^ v[i - degree] >> degree, |sum, k| sum ^ v[i - k]),
        };
    }
    v
}

/// A point of the sequence that belongs to a seed.
#[derive(Clone, Copy, Debug, Default)]
pub struct Point {
    /// Index, shuffled.
    index: u32,
    seed: u32,
}

impl Point {
    /// Point `index`. All aligned powers of two of consecutive points are evenly spread.
    #[inline]
    pub fn new(index: u32, seed: u32) -> Self {
        Self { index: owen_scramble_rev(index.reverse_bits(), hash(seed ^ 0x79c6_8e4a)).reverse_bits(), seed }
    }

    /// Axes 4·`four` … 4·`four` + 3, uniform in [0, 1); `four` < [`FOURS`].
    #[inline]
    pub fn axes(&self, four: u32) -> [f32; 4] {
        let rows = &TABLES[four as usize];
        let sum = |place: usize| Int4::from(rows[place][(self.index >> (4 * place) & 15) as usize]);
        let sobol = ((sum(0) ^ sum(1)) ^ (sum(2) ^ sum(3))) ^ ((sum(4) ^ sum(5)) ^ (sum(6) ^ sum(7)));
        let scramble = Int4::from([self.seed.wrapping_mul(0x9c8f_2d3b) ^ four; 4])
            ^ [0x912f_69ba, 0x174f_18ab, 0x691e_72ca, 0xb40c_c1b8].into();
        owen_scramble_int4_rev(sobol, hash_int4(scramble)).reverse_bits().to_f32_norm()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sobol_burley::parts::sobol_rev;

    #[test]
    fn direction_vectors_go_on_where_the_library_ends() {
        for axis in 0..4 * FOURS {
            for (i, v) in direction_vectors(axis as usize).iter().enumerate() {
                assert!(v >> (31 - i) & 1 == 1 && v.trailing_zeros() as usize >= 31 - i, "axis {axis}, vector {i}: {v:#x}");
                if i < 16 {
                    assert_eq!(*v, sobol_rev(1 << (31 - i), axis).reverse_bits(), "axis {axis}, vector {i}");
                }
            }
        }
    }

    #[test]
    fn short_sequences_are_spread_like_the_librarys() {
        // Not the same points: an index below 2¹⁶ has a fixed upper half once it is shuffled.
        for seed in 0..20 {
            for axis in 0..4 * FOURS {
                let cells = |x: &dyn Fn(u32) -> f32| {
                    let mut seen: Vec<u32> = (0..256).map(|i| (x(i) * 256.0) as u32).collect();
                    seen.sort_unstable();
                    seen
                };
                let of_library = cells(&|i| sobol_burley::sample(i, axis, seed));
                let ours = cells(&|i| Point::new(i, seed).axes(axis / 4)[axis as usize % 4]);
                assert_eq!(ours, of_library);
                assert!(ours.into_iter().eq(0..256));
            }
        }
    }

    #[test]
    fn long_sequences_fill_every_interval_once() {
        // 2²⁰ points from the middle of a sequence: the first two axes, which direction takes, and the next two.
        const BITS: u32 = 20;
        for first in [0, 5 << BITS, 0xabc << BITS] {
            let points: Vec<[f32; 4]> = (0..1 << BITS).map(|i| Point::new(first + i, 9).axes(0)).collect();
            for (x, y, slack) in [(0, 1, 0), (2, 3, 2)] {
                for x_bits in (0..=BITS).step_by(5) {
                    let y_bits = BITS - x_bits;
                    let shift = slack * u32::from(x_bits > 0 && y_bits > 0);
                    let (x_bits, y_bits) = (x_bits - shift.min(x_bits), y_bits);
                    let mut seen = vec![0u32; 1 << (x_bits + y_bits)];
                    for p in &points {
                        let cell = |v: f32, bits: u32| (v * (1u64 << bits) as f32) as usize;
                        seen[cell(p[x], x_bits) << y_bits | cell(p[y], y_bits)] += 1;
                    }
                    assert!(seen.iter().all(|n| *n == 1 << shift), "axes {x} and {y}, 2^-{x_bits} by 2^-{y_bits}, from {first}");
                }
            }
        }
    }
}
