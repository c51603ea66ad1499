//! Contenders against each other: the error of one over that of another, with an interval or not at all.

use super::effort::Mark;
use super::figures::ContenderFigures;
use super::statistics::{Interval, ratio};
use serde::Serialize;

/// What is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// Relative mean squared error.
    Relmse,
    /// The same without the worst 0.1 % of pixels.
    RelmseTrimmed,
    /// Root mean squared error.
    Rmse,
    /// Mean LDR-FLIP error.
    Flip,
    /// Variance times seconds, the inverse of the efficiency; at the end only.
    Cost,
}

impl Measure {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Relmse, Self::RelmseTrimmed, Self::Rmse, Self::Flip, Self::Cost];
}

/// Error of `a` over error of `b`.
#[derive(Clone, Debug, Serialize)]
pub struct Ratio {
    /// Number of a contender.
    pub a: usize,
    /// Number of another.
    pub b: usize,
    /// Of what.
    pub measure: Measure,
    /// At which mark.
    pub mark: String,
    /// With its interval: none without more than one run of both, or where an error is below the noise of the reference.
    pub ratio: Option<Interval>,
    /// The interval leaves out 1.
    pub significant: bool,
    /// Why there is no ratio.
    pub why_not: Option<&'static str>,
}

/// All pairs (a, b) with a ≠ b.
pub fn ratios(contenders: &[ContenderFigures], marks: &[Mark]) -> Vec<Ratio> {
    let n = contenders.len();
    let pairs = (0..n).flat_map(|a| (0..n).filter(move |b| *b != a).map(move |b| (a, b)));
    let with_marks = pairs.flat_map(|p| marks.iter().map(move |m| (p, *m)));
    let all = with_marks.flat_map(|(p, m)| Measure::ALL.map(|measure| (p, m, measure)));
    all.map(|((a, b), mark, measure)| pair(contenders, (a, b), mark, measure)).collect()
}

fn pair(contenders: &[ContenderFigures], (a, b): (usize, usize), mark: Mark, measure: Measure) -> Ratio {
    // Runs are pairs only where both have them.
    let runs = contenders[a].runs.len().min(contenders[b].runs.len());
    let errors = |i: usize| contenders[i].runs[..runs].iter().map(|r| r.error(measure, mark)).collect::<Option<Vec<f64>>>();
    let both = errors(a).zip(errors(b));
    let found = both.as_ref().and_then(|(a, b)| ratio(a, b));
    let late = [a, b].iter().any(|i| contenders[*i].runs.iter().any(|r| r.at(mark).is_none()));
    let why_not = match (runs, &both, &found) {
        (_, _, Some(_)) => None,
        (0, ..) => Some("no run"),
        (1, ..) => Some("one run: no interval, no ratio"),
        (_, None, _) if measure == Measure::Cost => Some("the variance is not known"),
        (_, None, _) if late => Some("the first pass took longer"),
        (_, None, _) => Some("below the noise of the reference"),
        _ => Some("no error on one side"),
    };
    let significant = found.is_some_and(|r| r.excludes(1.0));
    Ratio { a, b, measure, mark: mark.text(), ratio: found, significant, why_not }
}
