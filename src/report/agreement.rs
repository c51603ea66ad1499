//! Do two estimators agree? Welch's test per block of pixels, Šidák's correction over blocks.
//!
//! Each estimator renders the same measurement several times, independently; a block's value in
//! every render is one draw. Where a block's draws are dominated by a few outliers (effective number
//! of samples `(Σx)²/Σx²` below [`MIN_EFFECTIVE`]) the means are not normal enough for a test: such
//! blocks are pooled with their neighbours into 2 × 2, 4 × 4, … blocks until they are. The same where a
//! single contribution as large as the largest of the whole film would move the difference by more than
//! [`LARGEST`] standard errors: draws look calm as long as none of those has come, and are too low until
//! then. (Of contributions of c standard errors, 5/c must stay away to make a z of 5, which happens with
//! probability exp(−5/c).) What cannot be tested so even when pooled over the film is tested with an
//! allowance: only the part of a difference counts that [`UNSEEN`] contributions as large as the largest
//! could not explain, and only where those are little beside the mean ([`ALLOWED`]). The shares of energy
//! that could be tested at all, and with an allowance alone, are part of the verdict.

use statrs::distribution::{ContinuousCDF, StudentsT};

/// Effective samples that a block needs on both sides.
pub const MIN_EFFECTIVE: f64 = 30.0;

/// Standard errors that one contribution may be worth.
pub const LARGEST: f64 = 0.4;

/// Contributions as large as the largest that may be due on either side. Where values above v are as frequent
/// as 1/v, as by narrow lobes, the mean has ln 2 times the largest from every doubling of v: these are six.
pub const UNSEEN: f64 = 4.0;

/// The most that these may be worth, as a share of the mean: with a larger allowance a test would tell nothing.
pub const ALLOWED: f64 = 0.1;

/// Block values of independent renders.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BlockSeries {
    /// Blocks per row.
    pub columns: usize,
    /// Rows of blocks.
    pub rows: usize,
    /// `draws[render][block]`.
    pub draws: Vec<Vec<f64>>,
    /// The largest single contribution to any of them, 0 where that is not known.
    pub largest: f64,
    /// The contributions seem to have no variance: whatever the draws say of their error is too little.
    pub heavy: bool,
}

/// Mean, variance and number of draws of one block (or pooled blocks).
#[derive(Clone, Copy, Debug)]
struct Moments {
    mean: f64,
    variance: f64,
    n: f64,
    effective: f64,
    /// What the largest contribution of the film is worth in `mean`.
    largest: f64,
    heavy: bool,
}

/// Whether the means are normal enough for a test.
fn testable(a: Moments, b: Moments) -> bool {
    let error = (a.variance / a.n + b.variance / b.n).sqrt();
    let few = |m: Moments| m.largest <= LARGEST * error || (error == 0.0 && m.largest <= 0.01 * m.mean);
    [a, b].into_iter().all(|m| m.effective >= MIN_EFFECTIVE && !m.heavy && few(m))
}

/// What may be due on both sides; `None` where that is too much for a test.
fn allowance(a: Moments, b: Moments) -> Option<f64> {
    let due = UNSEEN * (a.largest + b.largest);
    let means_something = due <= ALLOWED * a.mean.min(b.mean);
    (means_something && [a, b].into_iter().all(|m| m.effective >= MIN_EFFECTIVE)).then_some(due)
}

/// One test.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct BlockTest {
    /// Column and row of the first block.
    pub at: (usize, usize),
    /// Blocks per side that were pooled.
    pub side: usize,
    /// Means of both estimators.
    pub means: (f64, f64),
    /// Welch's statistic, of what an allowance leaves.
    pub z: f64,
    /// Two-sided probability of a larger one where both agree.
    pub p: f64,
}

/// The verdict over all blocks.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Agreement {
    /// All tests.
    pub tests: Vec<BlockTest>,
    /// Probability of the most extreme test, corrected for the number of tests; 1 without any.
    pub p: f64,
    /// Share of the energy (mean of both estimators) inside tested blocks; 1 where there is none.
    pub energy_tested: f64,
    /// Share of the energy, of that, which was tested with an allowance alone.
    pub energy_allowed: f64,
    /// Means over all blocks.
    pub totals: (f64, f64),
}

impl BlockSeries {
    fn moments(&self, blocks: &[usize]) -> Moments {
        let n = self.draws.len() as f64;
        let sums = self.draws.iter().map(|d| blocks.iter().map(|b| d[*b]).sum::<f64>());
        let (s, s2) = sums.fold((0.0, 0.0), |(s, s2), x| (s + x, s2 + x * x));
        let mean = s / n;
        let variance = ((s2 - s * mean) / (n - 1.0)).max(0.0);
        // One contribution adds to one of n draws.
        let largest = self.largest / n;
        let effective = if s2 > 0.0 { s * s / s2 } else { 0.0 };
        Moments { mean, variance, n, effective, largest, heavy: self.heavy }
    }

    /// All blocks as one.
    pub fn pooled(&self) -> Self {
        Self { columns: 1, rows: 1, draws: self.draws.iter().map(|d| vec![d.iter().sum()]).collect(), ..*self }
    }

    fn total(&self) -> f64 {
        self.moments(&(0..self.columns * self.rows).collect::<Vec<_>>()).mean
    }
}

/// Welch's test of means that are equal but for `due`; `None` where neither side varies.
fn welch(a: Moments, b: Moments, due: f64) -> Option<(f64, f64)> {
    let (va, vb) = (a.variance / a.n, b.variance / b.n);
    let v = va + vb;
    let difference = a.mean - b.mean;
    let difference = (difference.abs() - due).max(0.0).copysign(difference);
    if v <= 0.0 {
        // Deterministic on both sides: equal up to rounding, or surely different.
        let scale = a.mean.abs().max(b.mean.abs());
        return if difference.abs() <= 1e-5 * scale { None } else { Some((f64::INFINITY, 0.0)) };
    }
    let z = difference / v.sqrt();
    let dof = v * v / (va * va / (a.n - 1.0) + vb * vb / (b.n - 1.0)).max(f64::MIN_POSITIVE);
    let t = StudentsT::new(0.0, 1.0, dof.clamp(1.0, 1e6)).ok()?;
    Some((z, 2.0 * t.cdf(-z.abs())))
}

/// Compares two series of the same blocks.
pub fn agreement(a: &BlockSeries, b: &BlockSeries) -> Agreement {
    assert_eq!((a.columns, a.rows), (b.columns, b.rows), "series of different blocks");
    let mut open: Vec<bool> = vec![true; a.columns * a.rows];
    let mut out = Agreement { p: 1.0, totals: (a.total(), b.total()), ..Agreement::default() };
    let mut energy = 0.0;
    let mut side = 1;
    while side < 2 * a.columns.max(a.rows) {
        for row in (0..a.rows).step_by(side) {
            for column in (0..a.columns).step_by(side) {
                let cells = (row..(row + side).min(a.rows))
                    .flat_map(|y| (column..(column + side).min(a.columns)).map(move |x| y * a.columns + x));
                let blocks: Vec<usize> = cells.filter(|b| open[*b]).collect();
                let (ma, mb) = (a.moments(&blocks), b.moments(&blocks));
                if blocks.is_empty() || !testable(ma, mb) {
                    continue;
                }
                if let Some((z, p)) = welch(ma, mb, 0.0) {
                    out.tests.push(BlockTest { at: (column, row), side, means: (ma.mean, mb.mean), z, p });
                }
                energy += 0.5 * (ma.mean + mb.mean);
                blocks.iter().for_each(|b| open[*b] = false);
            }
        }
        side *= 2;
    }
    let rest: Vec<usize> = (0..open.len()).filter(|b| open[*b]).collect();
    let (ma, mb) = (a.moments(&rest), b.moments(&rest));
    let due = allowance(ma, mb);
    if let Some((z, p)) = due.and_then(|due| welch(ma, mb, due)) {
        out.tests.push(BlockTest { at: (0, 0), side: a.columns.max(a.rows), means: (ma.mean, mb.mean), z, p });
    }
    let allowed = due.map_or(0.0, |_| 0.5 * (ma.mean + mb.mean));
    energy += allowed;
    let smallest = out.tests.iter().map(|t| t.p).fold(1.0, f64::min);
    out.p = sidak(smallest, out.tests.len());
    let total = 0.5 * (out.totals.0 + out.totals.1);
    out.energy_tested = if total > 0.0 { energy / total } else { 1.0 };
    out.energy_allowed = if total > 0.0 { allowed / total } else { 0.0 };
    out
}

/// Probability that the smallest of `n` independent p-values is at most `p`.
pub fn sidak(p: f64, n: usize) -> f64 {
    if n == 0 { 1.0 } else { -((n as f64) * (-p.min(1.0)).ln_1p()).exp_m1() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    use crate::math::random::Family;

    fn series(seed: u64, means: &[f64], columns: usize) -> BlockSeries {
        let mut random = Random::new(Family::Other, seed, 0, 0);
        let mut draw = |m: f64| m * (0..12).map(|_| f64::from(random.unit())).sum::<f64>() / 6.0;
        let draws = (0..64).map(|_| means.iter().map(|m| draw(*m)).collect()).collect();
        BlockSeries { columns, rows: means.len() / columns, draws, largest: 0.0, heavy: false }
    }

    #[test]
    fn equal_means_agree_and_different_means_do_not() {
        let means: Vec<f64> = (0..64).map(|i| 1.0 + f64::from(i % 5)).collect();
        let mut smallest: f64 = 1.0;
        for seed in 0..20 {
            let v = agreement(&series(seed, &means, 8), &series(100 + seed, &means, 8));
            assert!((v.energy_tested - 1.0).abs() < 1e-12);
            smallest = smallest.min(v.p);
        }
        // The smallest of 20 uniform numbers is below this with probability 1e-4.
        assert!(smallest > 5e-6, "{smallest}");
        let mut other = means.clone();
        other[11] *= 1.4;
        assert!(agreement(&series(1, &means, 8), &series(2, &other, 8)).p < 1e-4);
    }

    #[test]
    fn outliers_are_pooled_or_left_out() {
        let mut a = series(1, &[1.0; 16], 4);
        a.draws.iter_mut().enumerate().for_each(|(i, d)| d[5] = if i == 0 { 64.0 } else { 0.0 });
        let v = agreement(&a, &series(2, &[1.0; 16], 4));
        assert!(v.tests.iter().all(|t| t.side > 1 || t.at != (1, 1)));
        assert!(v.energy_tested > 0.9);
        assert!(v.p > 1e-4, "{}", v.p);
    }

    /// Draws that miss all of the rare large contributions agree with each other and with nothing else.
    #[test]
    fn blocks_that_wait_for_a_large_contribution_are_not_tested() {
        let (mut low, full) = (series(1, &[0.5; 16], 4), series(2, &[1.0; 16], 4));
        assert!(agreement(&low, &full).p < 1e-6);
        // 64 draws of √(1/3)/2 · 0.5 and twice that: the error of the difference is 0.04, of four blocks 0.08.
        low.largest = 64.0 * 0.02;
        let v = agreement(&low, &full);
        assert!(!v.tests.is_empty() && v.tests.iter().all(|t| t.side > 1));
        low.largest = 64.0;
        let v = agreement(&low, &full);
        assert!(v.tests.is_empty() && v.energy_tested == 0.0 && v.p == 1.0);
    }

    /// Draws of heavy tails are tested as one block, up to what their largest could explain.
    #[test]
    fn heavy_tails_are_tested_with_an_allowance() {
        let (mut a, b) = (series(1, &[1.0; 16], 4), series(2, &[1.06; 16], 4));
        assert!(agreement(&a.pooled(), &b.pooled()).p < 1e-6);
        // 16 means 1 and 1.06 differ by 0.96 ± 0.12; four contributions of 0.3 explain that, of 0.03 do not.
        (a.heavy, a.largest) = (true, 64.0 * 0.3);
        let v = agreement(&a, &b);
        assert!(v.tests.len() == 1 && v.p == 1.0 && v.energy_tested == 1.0 && v.energy_allowed == 1.0);
        a.largest = 64.0 * 0.03;
        let v = agreement(&a, &b);
        assert!(v.tests.len() == 1 && v.p < 1e-4 && v.energy_allowed == 1.0, "{}", v.p);
        // Of 0.5 they would be more than a tenth of the mean.
        a.largest = 64.0 * 0.5;
        assert!(agreement(&a, &b).tests.is_empty());
    }
}
