//! How much is rendered: to marks of time or of samples, with errors taken on the way.

use crate::render::Budget;
use std::time::Duration;

/// Where errors are compared; the last is where a run ends.
#[derive(Clone, Debug, PartialEq)]
pub enum Marks {
    /// Equal time.
    Time(Vec<Duration>),
    /// Equal samples per pixel.
    Samples(Vec<u64>),
}

/// How much is rendered.
#[derive(Clone, Debug)]
pub struct Effort {
    /// Ends of runs, at least one.
    pub marks: Marks,
    /// Runs of each contender.
    pub runs: u32,
    /// Of all random numbers.
    pub seed: u64,
    /// Relative standard error wanted of a reference that has to be made.
    pub reference_error: f64,
    /// Time after which a reference is taken as it is.
    pub reference_time: Duration,
}

/// Halvings between a run's end and the first error taken.
const HALVINGS: u32 = 7;

/// How far a run is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mark {
    /// After so much time.
    Time(Duration),
    /// After so many samples per pixel.
    Samples(u64),
}

impl Effort {
    /// When errors are taken: at the marks, and at the last one halved again and again.
    pub fn checkpoints(&self) -> Vec<Mark> {
        fn all<T: Copy + Ord>(marks: &[T], halved: impl Fn(T, u32) -> T) -> Vec<T> {
            let Some(last) = marks.iter().max().copied() else { return Vec::new() };
            let mut all: Vec<T> = (0..=HALVINGS).map(|k| halved(last, k)).chain(marks.iter().copied()).collect();
            all.sort_unstable();
            all.dedup();
            all
        }
        match &self.marks {
            Marks::Time(t) => all(t, |t, k| t / (1 << k)).into_iter().map(Mark::Time).collect(),
            Marks::Samples(n) => all(n, |n, k| (n >> k).max(1)).into_iter().map(Mark::Samples).collect(),
        }
    }

    /// For telling layers apart: half of a run.
    pub fn of_layers(&self) -> Budget {
        match &self.marks {
            Marks::Time(t) => Budget { passes: None, time: t.iter().max().map(|t| *t / 2) },
            Marks::Samples(n) => Budget { passes: n.iter().max().map(|n| n / 2), time: None },
        }
    }

    /// The marks in ascending order.
    pub fn marks(&self) -> Vec<Mark> {
        let mut marks = match &self.marks {
            Marks::Time(t) => t.iter().map(|t| Mark::Time(*t)).collect::<Vec<_>>(),
            Marks::Samples(n) => n.iter().map(|n| Mark::Samples(*n)).collect(),
        };
        marks.sort_unstable_by(|a, b| a.amount().total_cmp(&b.amount()));
        marks.dedup();
        marks
    }
}

impl Mark {
    /// Seconds or samples.
    pub fn amount(self) -> f64 {
        match self {
            Self::Time(t) => t.as_secs_f64(),
            Self::Samples(n) => n as f64,
        }
    }

    /// For people.
    pub fn text(self) -> String {
        match self {
            Self::Time(t) => format!("{} s", t.as_secs_f64()),
            Self::Samples(n) => format!("{n} spp"),
        }
    }

    /// Seconds or samples of a run that has come so far.
    pub fn of(self, seconds: f64, samples: u64) -> f64 {
        match self {
            Self::Time(_) => seconds,
            Self::Samples(_) => samples as f64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checkpoints_are_halved_and_hold_the_marks() {
        let effort = |marks| Effort { marks, runs: 3, seed: 0, reference_error: 0.01, reference_time: Duration::ZERO };
        let points = effort(Marks::Samples(vec![100, 3, 7])).checkpoints();
        let amounts: Vec<f64> = points.iter().map(|m| m.amount()).collect();
        assert_eq!(amounts, [1.0, 3.0, 6.0, 7.0, 12.0, 25.0, 50.0, 100.0]);
        let second = Duration::from_secs(1);
        let points = effort(Marks::Time(vec![second, 64 * second])).checkpoints();
        assert_eq!(points.first(), Some(&Mark::Time(second / 2)));
        assert_eq!(points.last(), Some(&Mark::Time(64 * second)));
        assert_eq!(effort(Marks::Time(vec![4 * second, second])).marks()[0].text(), "1 s");
    }
}
