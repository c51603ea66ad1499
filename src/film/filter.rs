//! Reconstruction filters: pixel `j` measures `Φ_j = ∫ h(p − c_j) L(p) dp / ∫ h` with a separable
//! `h(x) h(y)` around its centre `c_j`, Mitsuba 3's box, tent, Gaussian, Mitchell–Netravali,
//! Catmull–Rom and Lanczos.
//!
//! A gathering walk draws its offset from `|h|` and carries `sign(h) ∫|h| / ∫h`. A splat at `p` goes
//! to one pixel `j` of those whose filter reaches it, with probability `|h(p − c_j)| / Σ_i |h(p − c_i)|`,
//! and carries `sign(h) Σ_i |h(p − c_i)| / ∫h`. Both estimate the same `Φ_j` without bias. That is all there is
//! to a pixel alone; in a film the pixels around it share what is found ([`super::reconstruct`]).
//!
//! What is tabulated is `h` itself: `h` *is* the linear interpolation of its formula between
//! [`CELLS`] knots for each stretch without change of sign (off by less than 3e-6 of the peak).
//! Both walkers use this same function, its integral and inverse are in closed form, so weights
//! are exactly constant, and the two agree exactly instead of up to a table's error.
//! Mitsuba evaluates its Gaussian by a polynomial that is off by up to 5e-4; here it is the formula.

use super::reconstruct::Weights;
use crate::describe::FilterDescription;
use glam::Vec2;
use std::f64::consts::PI;

/// Cells of the table in each stretch without change of sign.
pub const CELLS: usize = 1024;
/// Largest radius in pixels; wider filters are refused.
pub const MAX_RADIUS: f32 = 16.0;
pub(super) const MAX_SUPPORT: usize = 2 * MAX_RADIUS as usize + 1;

/// A filter ready for sampling.
#[derive(Clone, Debug)]
pub struct Filter {
    /// `None` is the box, which needs no table.
    table: Option<Table>,
}

/// One side, `x ≥ 0`, of a symmetric filter.
#[derive(Clone, Debug)]
struct Table {
    radius: f32,
    stretches: Vec<Stretch>,
    /// `∫₀ |h|` up to each knot, over all of it; stretches follow each other, `CELLS` cells each.
    cdf: Vec<f64>,
    /// For each of `cdf.len() − 1` equal parts of [0, 1): the cell where its beginning falls.
    guide: Vec<u32>,
    /// `∫|h| / ∫h` of one axis.
    ratio: f32,
    /// `1 / ∫h` of one axis.
    inverse_integral: f32,
}

/// A stretch `[from, to]` in which `h` keeps its sign.
#[derive(Clone, Debug)]
struct Stretch {
    from: f32,
    to: f32,
    cells_per_unit: f32,
    sign: f32,
    /// `|h|` at the `CELLS + 1` knots.
    knots: Vec<f32>,
}

impl Filter {
    /// From its description; `None` where a parameter has no meaning (radius not positive, not
    /// finite or beyond [`MAX_RADIUS`], or a filter whose integral is not positive).
    pub fn new(description: FilterDescription) -> Option<Self> {
        let table = match description {
            FilterDescription::Box => return Some(Self { table: None }),
            FilterDescription::Tent { radius } => {
                let r = f64::from(radius);
                Table::new(r, move |x| 1.0 - x / r)
            }
            FilterDescription::Gaussian { stddev } => {
                let s = f64::from(stddev);
                Table::new(4.0 * s, move |x| (-x * x / (2.0 * s * s)).exp() - (-8f64).exp())
            }
            FilterDescription::Mitchell { b, c } => Table::new(2.0, cubic(f64::from(b), f64::from(c))),
            FilterDescription::CatmullRom => Table::new(2.0, cubic(0.0, 0.5)),
            FilterDescription::Lanczos { lobes } => {
                let r = f64::from(lobes);
                Table::new(r, move |x| sinc(x) * sinc(x / r))
            }
        };
        table.map(|t| Self { table: Some(t) })
    }

    /// Half width in pixels: how far outside the crop window a point can still be seen by a pixel.
    pub fn radius(&self) -> f32 {
        self.table.as_ref().map_or(0.5, |t| t.radius)
    }

    /// `h(x)` of one axis.
    pub fn eval(&self, x: f32) -> f32 {
        match &self.table {
            None => f32::from((-0.5..0.5).contains(&x)),
            Some(t) => t.eval(x),
        }
    }

    /// For a gathering walk: offset from the pixel's centre in pixels, and its weight.
    #[inline]
    pub fn sample_offset(&self, u: Vec2) -> (Vec2, f32) {
        match &self.table {
            None => (u - 0.5, 1.0),
            Some(t) => {
                let ((x, w_x), (y, w_y)) = (t.sample(u.x), t.sample(u.y));
                (Vec2::new(x, y), w_x * w_y)
            }
        }
    }

    /// How many pixels away it still takes something; 0 for the box, which takes only what falls into its own.
    pub fn reach(&self) -> i32 {
        self.table.as_ref().map_or(0, |t| (t.radius - 0.5).ceil().max(0.0) as i32)
    }

    /// For all gathering walks of a pass, along one axis: their offset from the centres of their pixels, and what a pixel
    /// takes of those around it. `None` for the box.
    pub(super) fn taps(&self, u: f32) -> Option<(f32, Weights)> {
        let t = self.table.as_ref()?;
        let (x, _) = t.sample(u);
        let offset = x - (x + 0.5).floor();
        let mut values = [0f32; MAX_SUPPORT];
        let (first, count) = t.around(offset, &mut values);
        let sum: f32 = values[..count].iter().map(|v| v.abs()).sum();
        (sum > 0.0).then(|| (offset, Weights::new(first, &values[..count], t.ratio / sum, true)))
    }

    /// For a splat, along one axis: what the pixels around take of it, pixel i the one whose centre is i + ½. `None` for
    /// the box.
    pub(super) fn dealt(&self, p: f32) -> Option<Weights> {
        let t = self.table.as_ref()?;
        let mut values = [0f32; MAX_SUPPORT];
        let (first, count) = t.around(0.5 - p, &mut values);
        Some(Weights::new(first, &values[..count], t.inverse_integral, false))
    }

    /// For a splat at raster point `p` (pixel (i, j) covers [i, i+1) × [j, j+1)): column and row of a
    /// pixel, perhaps outside the film, and the weight. `None` outside of 32-bit columns and rows.
    #[inline]
    pub fn splat_pixel(&self, p: Vec2, u: Vec2) -> Option<(i32, i32, f32)> {
        // Also refuses NaN.
        let nameable = p.x.abs() < 1e9 && p.y.abs() < 1e9;
        if !nameable {
            return None;
        }
        match &self.table {
            None => Some((p.x.floor() as i32, p.y.floor() as i32, 1.0)),
            Some(t) => {
                let ((x, w_x), (y, w_y)) = (t.choose(p.x, u.x)?, t.choose(p.y, u.y)?);
                Some((x, y, w_x * w_y))
            }
        }
    }
}

impl Table {
    fn new(radius: f64, h: impl Fn(f64) -> f64) -> Option<Self> {
        if !(radius > 0.0 && radius <= f64::from(MAX_RADIUS)) {
            return None;
        }
        let ends = sign_changes(radius, &h);
        let mut cdf = vec![0.0];
        let (mut total, mut signed) = (0.0, 0.0);
        let mut stretches = Vec::new();
        for pair in ends.windows(2) {
            let stretch = Stretch::new(pair[0], pair[1], &h);
            let step = f64::from(stretch.to - stretch.from) / CELLS as f64;
            for k in stretch.knots.windows(2) {
                let mass = 0.5 * step * f64::from(k[0] + k[1]);
                total += mass;
                signed += mass * f64::from(stretch.sign);
                cdf.push(total);
            }
            stretches.push(stretch);
        }
        if !(signed > 0.0 && total.is_finite()) {
            return None;
        }
        cdf.iter_mut().for_each(|c| *c /= total);
        let cells = cdf.len() - 1;
        let guide = (0..cells).map(|i| cdf.partition_point(|c| *c <= i as f64 / cells as f64).max(1) as u32 - 1).collect();
        let (ratio, inverse_integral) = ((total / signed) as f32, (0.5 / signed) as f32);
        Some(Self { radius: radius as f32, stretches, cdf, guide, ratio, inverse_integral })
    }

    /// Offset along one axis and weight, by the continuous inverse.
    #[inline]
    fn sample(&self, u: f32) -> (f32, f32) {
        let side = 2.0 * f64::from(u) - 1.0;
        let v = side.abs();
        let cells = self.guide.len();
        // u = 0 gives v = 1: the very end.
        let mut cell = self.guide[((v * cells as f64) as usize).min(cells - 1)] as usize;
        while cell + 1 < cells && self.cdf[cell + 1] <= v {
            cell += 1;
        }
        let (lo, hi) = (self.cdf[cell], self.cdf[cell + 1]);
        let rest = if hi > lo { ((v - lo) / (hi - lo)).min(1.0) as f32 } else { 0.0 };
        let stretch = &self.stretches[cell / CELLS];
        let i = cell % CELLS;
        let (a, b) = (stretch.knots[i], stretch.knots[i + 1]);
        // a t + (b − a) t²/2 = rest (a + b)/2, solved without cancellation.
        let below = a + (a * a + rest * (b * b - a * a)).max(0.0).sqrt();
        let t = if below > 0.0 { (rest * (a + b) / below).min(1.0) } else { 0.0 };
        let x = stretch.from + (i as f32 + t) / stretch.cells_per_unit;
        (x.copysign(side as f32), stretch.sign * self.ratio)
    }

    #[inline]
    fn eval(&self, x: f32) -> f32 {
        let x = x.abs();
        for s in &self.stretches {
            if x < s.to {
                let f = (x - s.from).max(0.0) * s.cells_per_unit;
                let i = (f as usize).min(CELLS - 1);
                let t = f - i as f32;
                return s.sign * (s.knots[i] + (s.knots[i + 1] - s.knots[i]) * t);
            }
        }
        0.0
    }

    /// `h` at all `k + offset` within its radius, k whole: the first k and how many.
    #[inline]
    fn around(&self, offset: f32, values: &mut [f32; MAX_SUPPORT]) -> (i32, usize) {
        let first = (-offset - self.radius).ceil() as i32;
        let mut count = 0;
        while count < MAX_SUPPORT {
            let distance = (first + count as i32) as f32 + offset;
            if distance >= self.radius {
                break;
            }
            values[count] = self.eval(distance);
            count += 1;
        }
        (first, count)
    }

    /// Pixel along one axis and weight.
    #[inline]
    fn choose(&self, p: f32, u: f32) -> Option<(i32, f32)> {
        let mut values = [0f32; MAX_SUPPORT];
        let (first, count) = self.around(0.5 - p, &mut values);
        let sum: f32 = values[..count].iter().map(|v| v.abs()).sum();
        let mut left = u * sum;
        let mut chosen = None;
        for (i, v) in values[..count].iter().enumerate() {
            if *v != 0.0 {
                chosen = Some((first + i as i32, sum.copysign(*v) * self.inverse_integral));
                left -= v.abs();
                if left < 0.0 {
                    break;
                }
            }
        }
        chosen
    }
}

impl Stretch {
    fn new(from: f64, to: f64, h: &impl Fn(f64) -> f64) -> Self {
        let middle = h(0.5 * (from + to));
        let at = |i: usize| from + (to - from) * i as f64 / CELLS as f64;
        // Within a stretch a value of the other sign is rounding at one of its ends.
        let knots = (0..=CELLS).map(|i| (h(at(i)) * middle.signum()).max(0.0) as f32).collect();
        let cells_per_unit = (CELLS as f64 / (to - from)) as f32;
        Self { from: from as f32, to: to as f32, cells_per_unit, sign: middle.signum() as f32, knots }
    }
}

/// 0, the points of (0, radius) where `h` changes its sign or its formula (whole numbers), radius.
fn sign_changes(radius: f64, h: &impl Fn(f64) -> f64) -> Vec<f64> {
    const SCAN: usize = 1000;
    let mut ends = vec![0.0];
    let step = radius / SCAN as f64;
    // Midpoints, so that a zero at a whole number lies inside an interval of the scan.
    for i in 0..SCAN - 1 {
        let (mut lo, mut hi) = ((i as f64 + 0.5) * step, (i as f64 + 1.5) * step);
        let positive = h(lo) > 0.0;
        if positive != (h(hi) > 0.0) {
            for _ in 0..60 {
                let mid = 0.5 * (lo + hi);
                *(if (h(mid) > 0.0) == positive { &mut lo } else { &mut hi }) = mid;
            }
            ends.push(0.5 * (lo + hi));
        }
    }
    for whole in 1..radius.ceil() as usize {
        if ends.iter().all(|e| (e - whole as f64).abs() > 1e-6) {
            ends.push(whole as f64);
        }
    }
    ends.push(radius);
    ends.sort_by(f64::total_cmp);
    ends
}

/// The family of cubics of [Mitchell 1988, eq. 8].
fn cubic(b: f64, c: f64) -> impl Fn(f64) -> f64 {
    move |x| {
        let (x2, x3) = (x * x, x * x * x);
        let p = if x < 1.0 {
            (12.0 - 9.0 * b - 6.0 * c) * x3 + (-18.0 + 12.0 * b + 6.0 * c) * x2 + (6.0 - 2.0 * b)
        } else if x < 2.0 {
            (-b - 6.0 * c) * x3 + (6.0 * b + 30.0 * c) * x2 + (-12.0 * b - 48.0 * c) * x + (8.0 * b + 24.0 * c)
        } else {
            0.0
        };
        p / 6.0
    }
}

fn sinc(x: f64) -> f64 {
    if x.abs() < 1e-8 { 1.0 } else { (PI * x).sin() / (PI * x) }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub(in crate::film) fn all() -> Vec<FilterDescription> {
        use FilterDescription::*;
        let third = 1.0 / 3.0;
        vec![
            Box,
            Tent { radius: 1.0 },
            Gaussian { stddev: 0.5 },
            Mitchell { b: third, c: third },
            CatmullRom,
            Lanczos { lobes: 3 },
            Tent { radius: 1.5 },
            Lanczos { lobes: 2 },
        ]
    }

    /// Values printed by Mitsuba 3.9.1's filters at these points.
    #[test]
    fn equal_to_mitsuba() {
        let x = [0.0, 0.2, 0.37, 0.75, 0.99, 1.2, 1.6, 1.9, 2.5];
        let values: [[f32; 9]; 8] = [
            [1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            [1.0, 0.8, 0.63, 0.25, 0.01, 0.0, 0.0, 0.0, 0.0],
            [0.999_247, 0.922_666, 0.760_367, 0.324_243, 0.140_450, 0.055_808, 0.005_630, 0.000_388, 0.0],
            [0.888_889, 0.818_222, 0.674_184, 0.256_076, 0.060_704, -0.014_222, -0.028_444, -0.002_944, 0.0],
            [1.0, 0.912, 0.733_730, 0.226_563, 0.005_198, -0.064, -0.048, -0.0045, 0.0],
            [1.0, 0.928_665, 0.769_934, 0.270_190, 0.008_385, -0.118_001, -0.112_306, -0.023_770, 0.024_317],
            [1.0, 0.866_667, 0.753_333, 0.5, 0.34, 0.2, 0.0, 0.0, 0.0],
            [1.0, 0.920_177, 0.745_837, 0.235_347, 0.006_494, -0.078_667, -0.044_250, -0.002_714, 0.0],
        ];
        for (d, row) in all().into_iter().zip(values) {
            let f = Filter::new(d).unwrap();
            // Mitsuba's polynomial for the Gaussian is itself off by this much.
            let tolerance = if matches!(d, FilterDescription::Gaussian { .. }) { 6e-4 } else { 6e-6 };
            for (x, v) in x.into_iter().zip(row) {
                assert!((f.eval(x) - v).abs() < tolerance, "{d:?} at {x}: {} instead of {v}", f.eval(x));
                assert_eq!(f.eval(x), if x == 0.5 { f.eval(x) } else { f.eval(-x) });
            }
        }
    }

    /// `∫_{edge}^{∞} h / ∫h`, what a pixel at 0 sees of a half plane, by the midpoint rule.
    pub(in crate::film) fn footprint(f: &Filter, edge: f64) -> f64 {
        const N: usize = 400_000;
        let r = f64::from(f.radius());
        let (mut all, mut part) = (0.0, 0.0);
        for i in 0..N {
            let x = r * (2.0 * (i as f64 + 0.5) / N as f64 - 1.0);
            let h = f64::from(f.eval(x as f32));
            all += h;
            part += if x > edge { h } else { 0.0 };
        }
        part / all
    }

    /// Gathering and splatting see the same exact profile across a sharp edge, for every filter.
    #[test]
    fn both_walkers_see_the_exact_profile_of_an_edge() {
        const N: usize = 100_000;
        for d in all() {
            let f = Filter::new(d).unwrap();
            for edge in [-1.7f32, -0.6, -0.31, 0.0, 0.12, 0.5, 0.93, 1.4] {
                let exact = footprint(&f, f64::from(edge));
                let mut gathered = 0.0;
                for i in 0..N {
                    let u = (i as f32 + 0.5) / N as f32;
                    let (o, w) = f.sample_offset(Vec2::new(u, 0.5));
                    // The weight of the other axis at its centre, where h > 0, is divided out.
                    let (_, w0) = f.sample_offset(Vec2::splat(0.5));
                    gathered += if o.x > edge { f64::from(w / w0.sqrt()) } else { 0.0 };
                }
                assert!((gathered / N as f64 - exact).abs() < 2e-4, "{d:?} gathers {} not {exact}", gathered / N as f64);
                let splatted = splatted_profile(&f, edge);
                assert!((splatted - exact).abs() < 2e-5, "{d:?} splats {splatted} not {exact}");
            }
        }
    }

    /// What the pixel with centre 0.5 receives along one axis from unit light at x − 0.5 > edge:
    /// midpoint rule over the points; the measure of the numbers that choose this pixel is found by
    /// bisection, since the chosen pixel grows with the number.
    fn splatted_profile(f: &Filter, edge: f32) -> f64 {
        const N: usize = 3000;
        let edge = edge.max(-f.radius());
        let step = (f.radius() - edge) / N as f32;
        let mut sum = 0.0;
        for i in 0..N {
            let p = 0.5 + edge + (i as f32 + 0.5) * step;
            let choose = |u: f32| match &f.table {
                Some(t) => t.choose(p, u).unwrap(),
                None => f.splat_pixel(Vec2::new(p, 0.5), Vec2::ZERO).map(|(j, _, w)| (j, w)).unwrap(),
            };
            let first_above = |limit: i32| {
                let (mut lo, mut hi) = (0.0, 1.0);
                for _ in 0..24 {
                    let mid = 0.5 * (lo + hi);
                    *(if choose(mid).0 > limit { &mut hi } else { &mut lo }) = mid;
                }
                hi
            };
            let (from, to) = (first_above(-1), first_above(0));
            sum += if to > from { f64::from(to - from) * f64::from(choose(0.5 * (from + to)).1) } else { 0.0 };
        }
        sum * f64::from(step)
    }

    /// A constant image stays constant: weights are exactly one where h has no negative lobe, and
    /// their mean is one everywhere, for both walkers.
    #[test]
    fn constant_stays_constant() {
        const N: usize = 4096;
        for d in all() {
            let f = Filter::new(d).unwrap();
            let positive = f.table.as_ref().is_none_or(|t| t.stretches.iter().all(|s| s.sign > 0.0));
            let mut mean = 0.0;
            for i in 0..N {
                let (_, w) = f.sample_offset(Vec2::new((i as f32 + 0.5) / N as f32, 0.5));
                let (_, w0) = f.sample_offset(Vec2::splat(0.5));
                assert!(!positive || w == 1.0);
                mean += f64::from(w / w0.sqrt());
            }
            assert!((mean / N as f64 - 1.0).abs() < 2e-3, "{d:?}: {}", mean / N as f64);
        }
    }

    #[test]
    fn splats_stay_near_and_far_points_are_refused() {
        for d in all() {
            let f = Filter::new(d).unwrap();
            for i in 0..1000 {
                let p = Vec2::new(i as f32 * 0.0173 - 3.0, 7.0 + i as f32 * 0.011);
                let u = Vec2::new((i as f32 * 0.618).fract(), (i as f32 * 0.755).fract());
                let (x, y, w) = f.splat_pixel(p, u).unwrap();
                let distance = (Vec2::new(x as f32, y as f32) + 0.5 - p).abs().max_element();
                assert!(distance <= f.radius() + 1e-4 && w.is_finite() && w != 0.0, "{d:?}: {p} to ({x}, {y}), weight {w}");
            }
            assert!(f.splat_pixel(Vec2::new(f32::NAN, 0.0), Vec2::ZERO).is_none());
            assert!(f.splat_pixel(Vec2::new(0.0, 1e20), Vec2::ZERO).is_none());
        }
    }

    #[test]
    fn meaningless_parameters_are_refused() {
        use FilterDescription::*;
        for d in [
            Tent { radius: 0.0 },
            Tent { radius: f32::NAN },
            Gaussian { stddev: 1e9 },
            Lanczos { lobes: 0 },
            Lanczos { lobes: 17 },
        ] {
            assert!(Filter::new(d).is_none(), "{d:?}");
        }
    }
}
