//! Discrete distributions and tables sampled by a continuous inverse, with their densities.
//!
//! Inversion (not alias tables) keeps the stratification of low-discrepancy points.

use glam::Vec2;

/// A discrete distribution over `0..n`, proportional to given non-negative weights.
#[derive(Clone, Debug, Default)]
pub struct Discrete {
    cdf: Vec<f32>,
    total: f64,
}

impl Discrete {
    /// From non-negative, finite weights; `None` where their sum is zero or not finite.
    pub fn new(weights: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut sums = vec![0.0f64];
        let mut total = 0.0;
        for w in weights {
            total += w.max(0.0);
            sums.push(total);
        }
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let mut cdf: Vec<f32> = sums.iter().map(|s| (s / total) as f32).collect();
        // The last item of positive weight must be reachable up to u = 1.
        for (c, s) in cdf.iter_mut().zip(&sums) {
            if *s >= total {
                *c = 1.0;
            }
        }
        Some(Self { cdf, total })
    }

    /// Number of items.
    pub fn len(&self) -> usize {
        self.cdf.len().saturating_sub(1)
    }

    /// Without items.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Sum of the weights that were given.
    pub fn total(&self) -> f64 {
        self.total
    }

    /// Probability of item `i`.
    #[inline]
    pub fn prob(&self, i: usize) -> f32 {
        self.cdf[i + 1] - self.cdf[i]
    }

    /// Item, its probability, and `u` stretched to [0, 1) inside the item for reuse.
    #[inline]
    pub fn sample(&self, u: f32) -> (usize, f32, f32) {
        let i = self.cdf.partition_point(|c| *c <= u).saturating_sub(1).min(self.len() - 1);
        let (lo, hi) = (self.cdf[i], self.cdf[i + 1]);
        let prob = hi - lo;
        let rest = if prob > 0.0 { ((u - lo) / prob).clamp(0.0, super::warp::ONE_MINUS_EPSILON) } else { 0.0 };
        (i, prob, rest)
    }
}

/// A piecewise constant density on the unit square, `width × height` cells, rows from v = 0.
#[derive(Clone, Debug)]
pub struct Table2d {
    width: usize,
    height: usize,
    marginal: Discrete,
    rows: Vec<Option<Discrete>>,
}

impl Table2d {
    /// From non-negative cell weights in row-major order; `None` where all are zero.
    pub fn new(weights: &[f32], width: usize, height: usize) -> Option<Self> {
        let rows: Vec<_> = weights.chunks(width).map(|row| Discrete::new(row.iter().map(|w| f64::from(*w)))).collect();
        let marginal = Discrete::new(rows.iter().map(|r| r.as_ref().map_or(0.0, Discrete::total)))?;
        Some(Self { width, height, marginal, rows })
    }

    /// Point and density per unit area of the square.
    #[inline]
    pub fn sample(&self, u: Vec2) -> (Vec2, f32) {
        let (y, p_y, v) = self.marginal.sample(u.y);
        let Some(row) = &self.rows[y] else { return (Vec2::ZERO, 0.0) };
        let (x, p_x, w) = row.sample(u.x);
        let p = p_x * p_y * (self.width * self.height) as f32;
        (Vec2::new((x as f32 + w) / self.width as f32, (y as f32 + v) / self.height as f32), p)
    }

    /// Density per unit area at a point of the square.
    #[inline]
    pub fn density(&self, p: Vec2) -> f32 {
        let x = ((p.x * self.width as f32) as usize).min(self.width - 1);
        let y = ((p.y * self.height as f32) as usize).min(self.height - 1);
        let Some(row) = &self.rows[y] else { return 0.0 };
        self.marginal.prob(y) * row.prob(x) * (self.width * self.height) as f32
    }
}
