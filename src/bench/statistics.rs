//! Means, ratios and slopes from a few runs, with 95 % intervals of Student's distribution.
//!
//! Ratios are taken of logarithms, run by run, so that a ratio and its inverse say the same.

use statrs::distribution::{ContinuousCDF, StudentsT};

/// A number with its 95 % interval, where there was more than one run.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Interval {
    /// The best guess.
    pub value: f64,
    /// Bounds.
    pub bounds: Option<[f64; 2]>,
}

impl Interval {
    /// Half the width of the interval.
    pub fn half(&self) -> Option<f64> {
        self.bounds.map(|[low, high]| 0.5 * (high - low))
    }

    /// The bounds leave out `value`; never without bounds.
    pub fn excludes(&self, value: f64) -> bool {
        self.bounds.is_some_and(|[low, high]| value < low || value > high)
    }

    /// Through a function that grows.
    fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Self { value: f(self.value), bounds: self.bounds.map(|b| b.map(&f)) }
    }
}

/// Mean of draws; `None` of none, or where one is not finite.
pub fn mean(draws: &[f64]) -> Option<Interval> {
    if draws.is_empty() || draws.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let n = draws.len() as f64;
    let value = draws.iter().sum::<f64>() / n;
    let variance = draws.iter().map(|x| (x - value).powi(2)).sum::<f64>() / (n - 1.0);
    let half = quantile(draws.len()).map(|t| t * (variance / n).sqrt());
    Some(Interval { value, bounds: half.map(|h| [value - h, value + h]) })
}

/// Mean of positive draws by their logarithms; `None` where one is not positive.
pub fn geometric_mean(draws: &[f64]) -> Option<Interval> {
    let logarithms: Vec<f64> = draws.iter().map(|x| x.ln()).collect();
    mean(&logarithms).map(|i| i.map(f64::exp))
}

/// `a / b` of pairs of runs; `None` where a number is not positive or there is only one run.
pub fn ratio(a: &[f64], b: &[f64]) -> Option<Interval> {
    let quotients: Vec<f64> = a.iter().zip(b).map(|(a, b)| a / b).collect();
    geometric_mean(&quotients).filter(|r| r.bounds.is_some())
}

/// `mean a / mean b` of runs that are not pairs, by the deviations of both; `None` with one run.
pub fn quotient(a: &[f64], b: &[f64]) -> Option<Interval> {
    let (a_mean, b_mean) = (mean(a)?, mean(b)?);
    let value = a_mean.value / b_mean.value;
    let half = value.abs() * (a_mean.half()? / a_mean.value).hypot(b_mean.half()? / b_mean.value);
    Some(Interval { value, bounds: Some([value - half, value + half]) }).filter(|i| i.value.is_finite())
}

/// 97.5 % quantile of Student's distribution for the mean of `n` draws.
fn quantile(n: usize) -> Option<f64> {
    let freedom = n.checked_sub(1).filter(|f| *f > 0)? as f64;
    StudentsT::new(0.0, 1.0, freedom).ok().map(|d| d.inverse_cdf(0.975))
}

/// Exponent `s` of `y ∝ x^s` by least squares of the logarithms; `None` with less than three points.
pub fn slope(points: &[(f64, f64)]) -> Option<f64> {
    let logarithms: Vec<_> = points.iter().filter(|(x, y)| *x > 0.0 && *y > 0.0).map(|(x, y)| (x.ln(), y.ln())).collect();
    if logarithms.len() < 3 {
        return None;
    }
    let n = logarithms.len() as f64;
    let mean = logarithms.iter().fold((0.0, 0.0), |m, p| (m.0 + p.0 / n, m.1 + p.1 / n));
    let (covariance, variance) = logarithms.iter().fold((0.0, 0.0), |s, p| {
        let d = (p.0 - mean.0, p.1 - mean.1);
        (s.0 + d.0 * d.1, s.1 + d.0 * d.0)
    });
    Some(covariance / variance).filter(|s| s.is_finite())
}

/// Mean and variance of images, pixel by pixel.
#[derive(Clone, Debug, Default)]
pub struct Images {
    n: u64,
    mean: Vec<[f32; 3]>,
    squares: Vec<[f32; 3]>,
}

impl Images {
    /// One more.
    pub fn add(&mut self, image: &[[f32; 3]]) {
        if self.n == 0 {
            self.mean = vec![[0.0; 3]; image.len()];
            self.squares = self.mean.clone();
        }
        self.n += 1;
        let n = self.n as f32;
        for ((m, s), x) in self.mean.iter_mut().flatten().zip(self.squares.iter_mut().flatten()).zip(image.iter().flatten()) {
            let d = x - *m;
            *m += d / n;
            *s += d * (x - *m);
        }
    }

    /// Variance of a single image; `None` with less than two.
    pub fn variance(&self) -> Option<Vec<[f32; 3]>> {
        let n = self.n.checked_sub(1).filter(|n| *n > 0)? as f32;
        Some(self.squares.iter().map(|s| s.map(|s| s / n)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    use crate::math::random::Family;

    #[test]
    fn known_numbers() {
        let m = mean(&[1.0, 2.0, 3.0]).unwrap();
        // t(0.975, 2) = 4.302653 and the standard error 1/√3.
        assert!((m.value - 2.0).abs() < 1e-12 && (m.half().unwrap() - 4.302_652_7 / 3f64.sqrt()).abs() < 1e-6);
        let r = ratio(&[2.0, 8.0], &[1.0, 1.0]).unwrap();
        assert!((r.value - 4.0).abs() < 1e-12);
        assert!((r.bounds.unwrap()[0] * r.bounds.unwrap()[1] - 16.0).abs() < 1e-9, "symmetric in the logarithm");
        assert_eq!(ratio(&[2.0], &[1.0]), None, "one run, no ratio");
        assert_eq!(ratio(&[2.0, 0.0], &[1.0, 1.0]), None);
        assert_eq!(mean(&[1.0, f64::NAN]), None);
        assert!((slope(&[(1.0, 8.0), (2.0, 4.0), (4.0, 2.0), (8.0, 1.0)]).unwrap() + 1.0).abs() < 1e-12);
        assert_eq!(slope(&[(1.0, 1.0), (2.0, 0.5)]), None);
    }

    /// 95 of 100 intervals hold the truth: binomial bounds of 10,000 at alpha 1e-4 are ± 3.9 · √(0.05 · 0.95 · 10,000).
    #[test]
    fn intervals_hold_the_truth_as_often_as_they_say() {
        for runs in [2, 3, 5] {
            let missed = (0..10_000u64)
                .filter(|i| {
                    let mut random = Random::new(Family::Other, *i, runs as u64, 7);
                    let mut normal = || {
                        let r = random.unit2();
                        f64::from((-2.0 * (1.0 - r.x).ln()).sqrt() * (std::f32::consts::TAU * r.y).cos())
                    };
                    let draws: Vec<f64> = (0..runs).map(|_| 3.0 + normal()).collect();
                    mean(&draws).unwrap().excludes(3.0)
                })
                .count();
            assert!((missed as f64 - 500.0).abs() < 86.0, "{missed} of 10,000 with {runs} runs");
        }
    }

    #[test]
    fn images_have_the_variance_of_their_draws() {
        let mut images = Images::default();
        assert_eq!(images.variance(), None);
        for x in [1.0, 2.0, 4.0] {
            images.add(&[[x, 1.0, -x]]);
        }
        let v = images.variance().unwrap()[0];
        assert!((v[0] - 7.0 / 3.0).abs() < 1e-6 && v[1] == 0.0 && (v[2] - v[0]).abs() < 1e-6);
    }
}
