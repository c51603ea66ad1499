//! Whether two images, each with its variance, have the same expectation: Welch's test per block,
//! `t = (Σ a − Σ b) / √(Σ var a + Σ var b)` over the pixels of a block and channel, Šidák over all.
//!
//! The variance of a block is that of its mean where the images carry it (connections and splats make
//! the pixels of a pass depend on each other), else the sum over pixels taken as independent.
//!
//! Blocks are 16 × 16 pixels. A mean of few effective samples, `n_eff = (Σx)²/Σx²` over all samples
//! of the block, is not near a normal distribution; such a block is pooled with the next along a
//! path that winds through the image, until the pool has enough on both sides. A rest that never
//! gets enough is not tested, and the report says which share of the energy was.

use super::Picture;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Pixels along an edge of a block.
pub const BLOCK: u32 = 16;
/// Effective samples that each side of a pool needs.
pub const EFFECTIVE: f64 = 30.0;

/// Outcome of the test.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Welch {
    /// Probability of a difference as large as this somewhere, if the expectations are equal.
    pub p: f64,
    /// Tests that were made (pools × channels).
    pub tests: usize,
    /// Pools of blocks.
    pub pools: usize,
    /// The largest |t|.
    pub largest_t: f64,
    /// Channel (0, 1, 2) of the largest |t|.
    pub channel: usize,
    /// Left upper pixel of the first block of the pool with the largest |t|.
    pub at: [u32; 2],
    /// Share of the energy of both images that lies in tested pools.
    pub energy_tested: f64,
}

/// Sums over a pool for one channel of one image.
#[derive(Clone, Copy, Default)]
struct Sums {
    mean: f64,
    variance: f64,
    /// Σ variance² of what is independent (pixels or blocks), for the degrees of freedom.
    variance_squared: f64,
    /// Σ x² of single samples, over the number of samples.
    square: f64,
}

impl Sums {
    fn add(&mut self, o: Self) {
        self.mean += o.mean;
        self.variance += o.variance;
        self.variance_squared += o.variance_squared;
        self.square += o.square;
    }

    /// `(Σx)²/Σx²` with `Σx = n · mean` per pixel.
    fn effective(&self, n: f64) -> f64 {
        if self.square > 0.0 { n * self.mean * self.mean / self.square } else { 0.0 }
    }
}

struct Pool {
    at: [u32; 2],
    sides: [[Sums; 3]; 2],
}

/// The test; `None` where an image has no variance or no number of samples (at least two), or the
/// sizes differ.
pub fn welch(a: &Picture, b: &Picture) -> Option<Welch> {
    let n = [a, b].map(|p| p.samples.filter(|n| *n >= 2).map(|n| n as f64));
    let (Some(n_a), Some(n_b), Some(_), Some(_)) = (n[0], n[1], &a.variance, &b.variance) else { return None };
    if (a.width, a.height) != (b.width, b.height) {
        return None;
    }
    let n = [n_a, n_b];
    let mut blocks = Vec::new();
    for y in 0..a.height.div_ceil(BLOCK) {
        let columns = a.width.div_ceil(BLOCK);
        for x in 0..columns {
            let x = if y % 2 == 0 { x } else { columns - 1 - x };
            let at = [x * BLOCK, y * BLOCK];
            blocks.push(Pool { at, sides: [block(a, at, n_a), block(b, at, n_b)] });
        }
    }
    let energy = |side: usize, c: usize| blocks.iter().map(|p| p.sides[side][c].mean.abs()).sum::<f64>();
    // A channel without light on both sides would keep every pool waiting.
    let channels: Vec<usize> = (0..3).filter(|c| energy(0, *c) + energy(1, *c) > 0.0).collect();
    let total: f64 = channels.iter().map(|c| energy(0, *c) + energy(1, *c)).sum();
    let enough = |p: &Pool| channels.iter().all(|c| (0..2).all(|s| p.sides[s][*c].effective(n[s]) >= EFFECTIVE));
    let (pools, rest) = pool(blocks, enough);
    let untested: f64 = rest.iter().flat_map(|p| p.sides.iter().flatten()).map(|s| s.mean.abs()).sum();
    Some(judge(&pools, &channels, n, if total > 0.0 { 1.0 - untested / total } else { 1.0 }))
}

/// Joins blocks in their order until each pool has enough; the last, if it has not, joins the one
/// before it. Pools, and what is left where there is none to join.
fn pool(blocks: Vec<Pool>, enough: impl Fn(&Pool) -> bool) -> (Vec<Pool>, Option<Pool>) {
    let join = |into: &mut Pool, from: &Pool| {
        for (i, f) in into.sides.iter_mut().flatten().zip(from.sides.iter().flatten()) {
            i.add(*f);
        }
    };
    let mut pools: Vec<Pool> = Vec::new();
    let mut open: Option<Pool> = None;
    for block in blocks {
        let p = match open.take() {
            Some(mut p) => {
                join(&mut p, &block);
                p
            }
            None => block,
        };
        if enough(&p) {
            pools.push(p);
        } else {
            open = Some(p);
        }
    }
    if let (Some(last), Some(rest)) = (pools.last_mut(), &open) {
        join(last, rest);
        open = None;
    }
    (pools, open)
}

fn block(p: &Picture, at: [u32; 2], n: f64) -> [Sums; 3] {
    let mut out = [Sums::default(); 3];
    let Some(variances) = &p.variance else { return out };
    let size = f64::from((p.width - at[0]).min(BLOCK)) * f64::from((p.height - at[1]).min(BLOCK));
    for y in at[1]..(at[1] + BLOCK).min(p.height) {
        for x in at[0]..(at[0] + BLOCK).min(p.width) {
            let i = y as usize * p.width as usize + x as usize;
            for (c, o) in out.iter_mut().enumerate() {
                let (mean, variance) = (f64::from(p.mean[i][c]), f64::from(variances[i][c]));
                if mean.is_finite() && variance.is_finite() {
                    // The stored mean is itself rounded to a float.
                    let variance = variance.max(0.0) + (mean * f64::from(f32::EPSILON)).powi(2);
                    let square = (n - 1.0) * variance + mean * mean;
                    o.add(Sums { mean, variance, variance_squared: variance * variance, square });
                }
            }
        }
    }
    let first = at[1] as usize * p.width as usize + at[0] as usize;
    if let Some(of_block) = p.block_variance.as_ref().and_then(|b| b.get(first)) {
        for (o, v) in out.iter_mut().zip(of_block) {
            let variance = f64::from(*v) * size * size;
            if variance.is_finite() {
                let rounding = (o.mean * f64::from(f32::EPSILON)).powi(2);
                o.variance = variance + rounding;
                o.variance_squared = o.variance * o.variance;
            }
        }
    }
    out
}

fn judge(pools: &[Pool], channels: &[usize], n: [f64; 2], energy_tested: f64) -> Welch {
    let tests = pools.len() * channels.len();
    let mut out = Welch { p: 1.0, tests, pools: pools.len(), largest_t: 0.0, channel: 0, at: [0, 0], energy_tested };
    let mut smallest = 1.0;
    for p in pools {
        for &channel in channels {
            let [a, b] = [0, 1].map(|s| p.sides[s][channel]);
            let variance = a.variance + b.variance;
            let t = if variance > 0.0 { ((a.mean - b.mean) / variance.sqrt()).abs() } else { 0.0 };
            let below = a.variance_squared / (n[0] - 1.0) + b.variance_squared / (n[1] - 1.0);
            let freedom = if below > 0.0 { variance * variance / below } else { f64::INFINITY };
            // Beyond this the distribution is normal to every digit.
            let tail = StudentsT::new(0.0, 1.0, freedom.clamp(1.0, 1e7)).map_or(1.0, |d| 2.0 * d.sf(t));
            if t > out.largest_t {
                (out.largest_t, out.channel, out.at) = (t, channel, p.at);
            }
            smallest = tail.min(smallest);
        }
    }
    out.p = -f64::exp_m1(tests as f64 * f64::ln_1p(-smallest.min(1.0 - 1e-16)));
    if tests == 0 {
        out.p = 1.0;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    use crate::math::random::Family;

    /// A picture of `n` samples per pixel, each exponentially distributed around `mean(x)`.
    fn picture(seed: u64, n: u64, mean: impl Fn(u32, u32) -> f64) -> Picture {
        let (width, height) = (70, 50);
        let mut p = Picture { width, height, samples: Some(n), ..Picture::default() };
        let mut variance = Vec::new();
        for i in 0..width * height {
            let mut r = Random::new(Family::Other, u64::from(i), 0, seed);
            let m = mean(i % width, i / width);
            let mut sums = [[0.0; 2]; 3];
            for _ in 0..n {
                for s in &mut sums {
                    let x = -m * (1.0 - f64::from(r.unit())).ln();
                    *s = [s[0] + x, s[1] + x * x];
                }
            }
            let n = n as f64;
            p.mean.push(sums.map(|s| (s[0] / n) as f32));
            variance.push(sums.map(|s| ((s[1] - s[0] * s[0] / n) / (n * (n - 1.0))) as f32));
        }
        p.variance = Some(variance);
        p
    }

    #[test]
    fn equal_expectations_pass_and_unequal_ones_do_not() {
        let ramp = |x: u32, y: u32| 0.1 + f64::from(x) * f64::from(y);
        let mut ps = Vec::new();
        for seed in 0..20 {
            let w = welch(&picture(2 * seed, 24, ramp), &picture(2 * seed + 1, 24, ramp)).unwrap();
            assert_eq!((w.tests, w.energy_tested), (60, 1.0));
            ps.push(w.p);
        }
        // p is uniform: 20 of them do not all fall above 0.3 or below 0.7.
        assert!(ps.iter().all(|p| *p > 1e-4) && ps.iter().any(|p| *p < 0.5) && ps.iter().any(|p| *p > 0.5), "{ps:?}");
        let off = |x: u32, y: u32| ramp(x, y) * if (32..48).contains(&x) && (16..32).contains(&y) { 1.15 } else { 1.0 };
        let w = welch(&picture(1, 24, ramp), &picture(2, 24, off)).unwrap();
        assert!(w.p < 1e-6 && w.at == [32, 16], "{w:?}");
    }

    /// Where nearly all samples are zero, blocks are pooled until the test is meaningful.
    #[test]
    fn thin_blocks_are_pooled() {
        let dark = |x: u32, _| if x < 40 { 0.0 } else { 1.0 };
        let w = welch(&picture(1, 16, dark), &picture(2, 16, dark)).unwrap();
        assert!(w.pools < 20 && w.energy_tested == 1.0 && w.p > 1e-4, "{w:?}");
        let black = picture(3, 4, |_, _| 0.0);
        let w = welch(&black, &black).unwrap();
        assert_eq!((w.p, w.tests), (1.0, 0));
        // One side black everywhere: nothing can be tested, and the report says so.
        let w = welch(&black, &picture(2, 16, dark)).unwrap();
        assert_eq!((w.tests, w.energy_tested), (0, 0.0));
    }

    /// Pixels that move together make a block vary more than their own variances tell.
    #[test]
    fn the_variance_of_blocks_is_believed() {
        let a = Picture {
            width: 16,
            height: 16,
            mean: vec![[1.0; 3]; 256],
            variance: Some(vec![[0.01; 3]; 256]),
            block_variance: None,
            samples: Some(100),
        };
        let b = Picture { mean: vec![[1.1; 3]; 256], ..a.clone() };
        assert!(welch(&a, &b).unwrap().p < 1e-9);
        let together = |p: &Picture| Picture { block_variance: p.variance.clone(), ..p.clone() };
        let w = welch(&together(&a), &together(&b)).unwrap();
        assert!((w.largest_t - 0.1 / 0.02f64.sqrt()).abs() < 1e-4 && w.p > 0.5, "{w:?}");
    }

    #[test]
    fn without_variance_there_is_no_test() {
        let a = picture(1, 4, |_, _| 1.0);
        assert!(welch(&a, &Picture { variance: None, ..a.clone() }).is_none());
        assert!(welch(&a, &Picture { samples: Some(1), ..a.clone() }).is_none());
    }
}
