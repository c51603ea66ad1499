//! Two series of draws of the same numbers, compared.

use crate::report::agreement::{Agreement, BlockSeries, agreement, sidak};

/// A mean and its standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Estimate {
    /// Mean over draws.
    pub mean: f64,
    /// Standard error of the mean.
    pub standard_error: f64,
}

impl Estimate {
    /// Of the sum over all blocks.
    pub(super) fn of(s: &BlockSeries) -> Self {
        let totals = s.draws.iter().map(|d| d.iter().sum::<f64>());
        let n = s.draws.len() as f64;
        let mean = totals.clone().sum::<f64>() / n;
        let variance = totals.map(|t| (t - mean).powi(2)).sum::<f64>() / (n - 1.0);
        Self { mean, standard_error: (variance / n).sqrt() }
    }

    /// Difference over its standard error.
    pub(super) fn z(self, other: Self) -> f64 {
        let error = self.standard_error.hypot(other.standard_error);
        if error > 0.0 { (self.mean - other.mean) / error } else { 0.0 }
    }
}

/// Tests of every block, and of all blocks as one: for small differences that all of them share. The second
/// value is the probability of the most extreme, corrected for their number.
pub(super) fn compare(a: &BlockSeries, b: &BlockSeries) -> (Agreement, f64) {
    let blocks = agreement(a, b);
    let whole = agreement(&a.pooled(), &b.pooled());
    let smallest = blocks.tests.iter().chain(&whole.tests).map(|t| t.p).fold(1.0, f64::min);
    let p = sidak(smallest, blocks.tests.len() + whole.tests.len());
    (blocks, p)
}

/// The probability of the most extreme of several independent p, corrected for their number.
pub(super) fn worst(tests: &[f64]) -> f64 {
    sidak(tests.iter().copied().fold(1.0, f64::min), tests.len())
}

/// Both sides with their errors, z and p, as columns of a table.
pub(super) fn sides_text(a: Estimate, b: Estimate, p: f64) -> String {
    format!("{:.6e} ± {:.1e}   {:.6e} ± {:.1e}  {:+6.2}  {p:7.1e}", a.mean, a.standard_error, b.mean, b.standard_error, a.z(b))
}
