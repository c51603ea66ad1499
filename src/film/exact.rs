//! Numbers on a fixed grid: `q(v) = round(v · 2^(64−e))` as a 128-bit integer, `e` = film exponent.
//!
//! With `2^e` near the largest usual pixel value, a contribution 2⁴⁰ times smaller than that is
//! still held to every bit of its f32, and one 2³¹ times larger still fits. Rounding a float to the
//! grid scales it in f64, where the 24 bits of an f32 stay exact; additions are modular, hence associative even where an
//! intermediate sum would leave the range. 2³² contributions at the upper limit still fit.

/// Fraction bits below `2^e`.
pub const FRACTION_BITS: i32 = 64;
/// A single contribution is below `2^CONTRIBUTION_BITS` grid steps, or is cut to that.
pub const CONTRIBUTION_BITS: i32 = 95;
/// Fraction bits below `2^(2e)` of the grid for squares.
pub const SQUARE_FRACTION_BITS: i32 = 48;
/// A single square is below `2^SQUARE_BITS` of its grid steps, or is cut to that.
pub const SQUARE_BITS: i32 = 100;

/// Three channels on the grid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Exact(pub [i128; 3]);

/// What became of a float on its way to the grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rounded {
    /// On the grid.
    Held(Exact),
    /// Some channel was beyond the grid and was cut to its limit.
    Cut(Exact),
    /// NaN or infinite in some channel.
    Refused,
}

/// How many contributions were not held as they were.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Losses {
    /// Not finite, and left out.
    pub dropped: u64,
    /// Beyond the grid, and cut to its limit.
    pub cut: u64,
}

impl Losses {
    /// What is left of a contribution.
    #[inline]
    pub fn hold(&mut self, rounded: Rounded) -> Option<Exact> {
        match rounded {
            Rounded::Held(x) => Some(x),
            Rounded::Cut(x) => {
                self.cut += 1;
                Some(x)
            }
            Rounded::Refused => {
                self.dropped += 1;
                None
            }
        }
    }

    /// Those of both.
    pub fn add(&mut self, other: Self) {
        self.dropped += other.dropped;
        self.cut += other.cut;
    }
}

impl Exact {
    /// Nothing.
    pub const ZERO: Self = Self([0; 3]);

    /// Rounds a contribution to the grid of films with this exponent; nearest, ties away from zero.
    #[inline]
    pub fn round(value: [f32; 3], exponent: i32) -> Rounded {
        Self::round_below(value, exponent, CONTRIBUTION_BITS)
    }

    /// The same, cut to `2^limit − 1` steps.
    #[inline]
    pub fn round_below(value: [f32; 3], exponent: i32, limit: i32) -> Rounded {
        let (scale, bound) = (power_of_two(FRACTION_BITS - exponent), power_of_two(limit));
        let steps = value.map(|v| f64::from(v) * scale);
        if steps.iter().all(|x| x.abs() < bound) {
            return Rounded::Held(Self(steps.map(nearest)));
        }
        if !value.iter().all(|v| v.is_finite()) {
            return Rounded::Refused;
        }
        let most = (1i128 << limit) - 1;
        let cut = |x: f64| if x.abs() < bound { nearest(x) } else { most * x.signum() as i128 };
        Rounded::Cut(Self(steps.map(cut)))
    }

    /// Adds, modulo 2¹²⁸.
    #[inline]
    pub fn add(&mut self, other: Self) {
        for (a, b) in self.0.iter_mut().zip(other.0) {
            *a = a.wrapping_add(b);
        }
    }

    /// Times a whole number, modulo 2¹²⁸.
    #[inline]
    pub fn times(self, factor: i128) -> Self {
        Self(self.0.map(|x| x.wrapping_mul(factor)))
    }

    /// Nothing in any channel.
    #[inline]
    pub fn is_zero(&self) -> bool {
        self.0 == [0; 3]
    }

    /// As numbers, correctly rounded.
    pub fn to_f64(self, exponent: i32) -> [f64; 3] {
        self.0.map(|x| x as f64 * power_of_two(exponent - FRACTION_BITS))
    }
}

/// The whole number nearest to `x`, ties away from zero, which holds 24 bits and is below 2¹⁰⁸.
#[inline]
fn nearest(x: f64) -> i128 {
    /// Two halves of this many bits: each fits an i64.
    const HALF: i32 = 48;
    let high = (x * const { 1.0 / (1u64 << HALF) as f64 }) as i64;
    // Exact, and so is the sum where a half more or less decides.
    let rest = x - high as f64 * const { (1u64 << HALF) as f64 };
    (i128::from(high) << HALF) + i128::from((rest + 0.5f64.copysign(rest)) as i64)
}

/// Square of a grid number on the grid of squares: `round(x² · 2^(48−2e))`.
#[inline]
pub fn square(x: i128) -> u128 {
    if x == 0 {
        return 0;
    }
    let f = x as f64;
    let bits = (f * f).to_bits();
    let biased = (bits >> 52) as i32;
    let m = (bits & ((1 << 52) - 1)) | (1 << 52);
    shift_round(m, biased - 1075 - 2 * FRACTION_BITS + SQUARE_FRACTION_BITS, SQUARE_BITS).0
}

/// `m · 2^shift`, rounded to nearest with ties away from zero, and whether it was cut to `2^limit − 1`.
#[inline]
fn shift_round(m: u64, shift: i32, limit: i32) -> (u128, bool) {
    if m == 0 {
        (0, false)
    } else if shift >= 0 {
        let width = 64 - m.leading_zeros() as i32;
        if width + shift > limit { ((1 << limit) - 1, true) } else { (u128::from(m) << shift, false) }
    } else if shift >= -63 {
        // m has at most 53 bits, so the half added cannot carry out of 64.
        (u128::from((m + (1 << (-shift - 1))) >> -shift), false)
    } else {
        (0, false)
    }
}

/// `2^k`, exact, for |k| < 1023.
#[inline]
pub fn power_of_two(k: i32) -> f64 {
    f64::from_bits(((1023 + k.clamp(-1022, 1023)) as u64) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The same rounding by exact rational arithmetic on the f64 that holds an f32 without loss:
    /// long division by repeated doubling of a remainder, no bit tricks.
    fn by_rationals(v: f32, exponent: i32) -> i128 {
        let mut x = f64::from(v.abs());
        let k = FRACTION_BITS - exponent;
        // Exact: an f32 times a power of two stays within f64's normal range for |k| < 800.
        x *= power_of_two(k);
        let limit = power_of_two(CONTRIBUTION_BITS);
        let q = if x >= limit {
            (1i128 << CONTRIBUTION_BITS) - 1
        } else {
            let whole = x.floor();
            let rest = x - whole;
            let mut out = 0i128;
            let mut r = whole;
            for b in (0..=CONTRIBUTION_BITS).rev() {
                let p = power_of_two(b);
                if r >= p {
                    r -= p;
                    out += 1i128 << b;
                }
            }
            out + i128::from(rest >= 0.5)
        };
        if v.is_sign_negative() { -q } else { q }
    }

    proptest! {
        #[test]
        fn rounds_like_rational_arithmetic(bits in any::<u32>(), exponent in -60i32..60) {
            let v = f32::from_bits(bits);
            match Exact::round([v, 0.0, -v], exponent) {
                Rounded::Refused => prop_assert!(!v.is_finite()),
                Rounded::Held(x) => {
                    prop_assert_eq!(x.0, [by_rationals(v, exponent), 0, -by_rationals(v, exponent)]);
                }
                Rounded::Cut(x) => {
                    prop_assert!(f64::from(v.abs()) >= power_of_two(exponent + CONTRIBUTION_BITS - FRACTION_BITS));
                    prop_assert_eq!(x.0[0], by_rationals(v, exponent));
                }
            }
        }

        #[test]
        fn usual_values_are_held_without_loss(v in 1e-10f32..1e6, e in -4i32..8) {
            let Rounded::Held(x) = Exact::round([v; 3], e) else { panic!("must be held") };
            prop_assert_eq!(x.to_f64(e), [f64::from(v); 3]);
        }

        #[test]
        fn squares_are_close(v in -1e6f32..1e6) {
            let Rounded::Held(x) = Exact::round([v; 3], 0) else { panic!("must be held") };
            let s = square(x.0[0]) as f64 * power_of_two(-SQUARE_FRACTION_BITS);
            let exact = f64::from(v) * f64::from(v);
            prop_assert!((s - exact).abs() <= power_of_two(-SQUARE_FRACTION_BITS - 1) + exact * 1e-15);
        }
    }

    #[test]
    fn ties_and_limits() {
        let step = power_of_two(-64) as f32;
        let round = |v: f32| Exact::round([v, 0.0, 0.0], 0);
        assert_eq!(round(0.5 * step), Rounded::Held(Exact([1, 0, 0])));
        assert_eq!(round(0.499_999_97 * step), Rounded::Held(Exact::ZERO));
        assert_eq!(round(-1.5 * step), Rounded::Held(Exact([-2, 0, 0])));
        assert_eq!(round(f32::from_bits(1)), Rounded::Held(Exact::ZERO));
        assert_eq!(round(f32::MAX), Rounded::Cut(Exact([(1 << 95) - 1, 0, 0])));
        assert_eq!(round(f32::NAN), Rounded::Refused);
        assert_eq!(round(f32::NEG_INFINITY), Rounded::Refused);
        assert_eq!(square(i128::MAX), (1 << SQUARE_BITS) - 1);
    }
}
