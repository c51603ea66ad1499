//! Latitude–longitude image as sky: L(w) = scale · bilinear(image, φ/2π, θ/π).
//!
//! Conventions are Mitsuba 3's: in the emitter's frame y is up, w = (sinφ sinθ, cosθ, −cosφ sinθ);
//! texel centres lie at φ = 2π(i + ½)/W, but at θ = πj/(H − 1), so that the first and the last row
//! are the poles.
//!
//! Directions are drawn from cells between four texel centres: row, column, then a density that is
//! bilinear over (φ, cosθ) in the cell, with the same four corners as the radiance. In those
//! coordinates solid angle is uniform, so there is no sinθ in the density and nothing special at
//! the poles; radiance (bilinear in θ) and density agree but for the curvature of cosθ within a
//! cell. A share of 1 % of each choice is uniform, so that every cell can be drawn.

use crate::describe::Image;
use crate::math::distribution::Discrete;
use crate::math::warp::ONE_MINUS_EPSILON;
use crate::spectrum::Spectrum;
use glam::{Mat3, Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, TAU};
use std::f64::consts::PI;
use std::sync::Arc;

const UNIFORM: f64 = 0.01;
/// Share of the cell's mean in each of its corners.
const LEVEL: f32 = 0.02;

#[derive(Clone, Debug)]
pub(super) struct Envmap {
    image: Arc<Image>,
    scale: f32,
    /// Columns: axes of the emitter in the world, orthonormal, of either handedness.
    axes: Mat3,
    /// Rows of cells; row j lies between the image rows j and j + 1.
    rows: Discrete,
    columns: Columns,
    /// cosθ_j − cosθ_{j+1} of every row of cells.
    heights: Vec<f32>,
    /// 1 − |cosθ_j| of every image row, from the nearer pole.
    versines: Vec<f32>,
    integral: Spectrum,
}

/// A direction in the coordinates of the cells.
#[derive(Clone, Copy)]
struct At {
    column: usize,
    row: usize,
    /// Position in the cell: along φ, along θ, along cosθ.
    s: f32,
    t_theta: f32,
    t_cos: f32,
}

/// Least size that has cells and two different rows.
pub(super) const MIN_SIZE: (u32, u32) = (2, 3);

impl Envmap {
    /// Image (at least [`MIN_SIZE`], finite, not negative), factor, and axes in the world; `None` where
    /// all is black.
    pub(super) fn new(image: Arc<Image>, scale: f32, axes: Mat3) -> Option<Self> {
        let (width, height) = (image.width as usize, image.height as usize);
        let theta = |j: usize| PI * j as f64 / (height - 1) as f64;
        let versine = |j: usize| 2.0 * (0.5 * theta(j).min(PI - theta(j))).sin().powi(2);
        let heights: Vec<f64> = (0..height - 1)
            .map(|j| {
                let middle = 0.5 * (theta(j) + theta(j + 1));
                2.0 * middle.sin() * (0.5 * (theta(j + 1) - theta(j))).sin()
            })
            .collect();
        let mut map = Self {
            image,
            scale,
            axes,
            rows: Discrete::default(),
            columns: Columns::default(),
            heights: heights.iter().map(|h| *h as f32).collect(),
            versines: (0..height).map(|j| versine(j) as f32).collect(),
            integral: Spectrum::BLACK,
        };
        let mut masses = vec![];
        let mut integral = [0.0f64; 3];
        for (j, cell_height) in heights.iter().enumerate() {
            let mut weights = Vec::with_capacity(width);
            for i in 0..width {
                let corners = map.corners(i, j);
                weights.push(0.25 * corners.iter().map(|c| f64::from(c.mean())).sum::<f64>());
                for c in corners {
                    c.to_rgb().iter().zip(&mut integral).for_each(|(c, sum)| *sum += f64::from(*c) * 0.25 * cell_height);
                }
            }
            let sum: f64 = weights.iter().sum();
            masses.push(sum * cell_height);
            let share = |w: &f64| if sum > 0.0 { (1.0 - UNIFORM) * w / sum } else { 0.0 };
            map.columns.push(weights.iter().map(|w| share(w) + UNIFORM / width as f64));
        }
        let total: f64 = masses.iter().sum();
        if total <= 0.0 {
            return None;
        }
        let share = |(m, h): (&f64, &f64)| (1.0 - UNIFORM) * m / total + UNIFORM * 0.5 * h;
        map.rows = Discrete::new(masses.iter().zip(&heights).map(share))?;
        let [r, g, b] = integral.map(|v| (v * 2.0 * PI / width as f64) as f32 * scale);
        map.integral = Spectrum::rgb(r, g, b);
        Some(map)
    }

    #[inline]
    fn texel(&self, i: usize, j: usize) -> Spectrum {
        let at = j * self.image.width as usize + i;
        if self.image.channels == 1 {
            Spectrum::grey(self.image.data[at])
        } else {
            let rgb = &self.image.data[3 * at..3 * at + 3];
            Spectrum::rgb(rgb[0], rgb[1], rgb[2])
        }
    }

    /// Texels around cell (i, j): upper left, upper right, lower left, lower right.
    #[inline]
    fn corners(&self, i: usize, j: usize) -> [Spectrum; 4] {
        let next = if i + 1 == self.image.width as usize { 0 } else { i + 1 };
        [self.texel(i, j), self.texel(next, j), self.texel(i, j + 1), self.texel(next, j + 1)]
    }

    /// Weights of a cell's corners for drawing within it, and their mean.
    #[inline]
    fn weights_of(&self, corners: &[Spectrum; 4], row: usize) -> ([f32; 4], f32) {
        let mut w = corners.map(Spectrum::mean);
        // Next to a pole cosθ is quadratic in θ: a corner there that is too dark would be drawn too rarely.
        if row == 0 {
            (w[0], w[1]) = (0.5 * (w[0] + w[2]), 0.5 * (w[1] + w[3]));
        } else if row + 2 == self.image.height as usize {
            (w[2], w[3]) = (0.5 * (w[0] + w[2]), 0.5 * (w[1] + w[3]));
        }
        let mean = 0.25 * (w[0] + w[1] + w[2] + w[3]);
        if mean > 0.0 { (w.map(|w| w + LEVEL * mean), mean * (1.0 + LEVEL)) } else { ([1.0; 4], 1.0) }
    }

    /// Which cell a direction falls into, and where.
    #[inline]
    fn locate(&self, w: Vec3) -> At {
        let v = self.axes.transpose() * w;
        let width = self.image.width as f32;
        let x = v.x.atan2(-v.z) * (1.0 / TAU) * width - 0.5;
        let x = if x < 0.0 { x + width } else { x };
        let column = (x as usize).min(self.image.width as usize - 1);
        let sin2 = v.x * v.x + v.z * v.z;
        let y = sin2.sqrt().atan2(v.y) * FRAC_1_PI * (self.image.height - 1) as f32;
        let row = (y as usize).min(self.image.height as usize - 2);
        // 1 − |cosθ| from the nearer pole, without cancellation.
        let versine = sin2 / (1.0 + v.y.abs());
        let down = if 2 * (row + 1) < self.image.height as usize {
            // A cell above the equator: its rows count from the pole above.
            let versine = if v.y >= 0.0 { versine } else { 2.0 - versine };
            versine - self.versines[row]
        } else {
            let versine = if v.y <= 0.0 { versine } else { 2.0 - versine };
            self.heights[row] - (versine - self.versines[row + 1])
        };
        At {
            column,
            row,
            s: (x - column as f32).clamp(0.0, 1.0),
            t_theta: (y - row as f32).clamp(0.0, 1.0),
            t_cos: (down / self.heights[row]).clamp(0.0, 1.0),
        }
    }

    pub(super) fn radiance(&self, w: Vec3) -> Spectrum {
        let at = self.locate(w);
        self.blend(&self.corners(at.column, at.row), at.s, at.t_theta)
    }

    #[inline]
    fn blend(&self, c: &[Spectrum; 4], s: f32, t_theta: f32) -> Spectrum {
        c[0].lerp(c[1], s).lerp(c[2].lerp(c[3], s), t_theta) * self.scale
    }

    pub(super) fn density(&self, w: Vec3) -> f32 {
        let at = self.locate(w);
        let (c, mean) = self.weights_of(&self.corners(at.column, at.row), at.row);
        self.cell_p_w(at.column, at.row) * bilinear(&c, at.s, at.t_cos) / mean
    }

    /// Mean density of a cell, sr⁻¹.
    #[inline]
    fn cell_p_w(&self, column: usize, row: usize) -> f32 {
        let solid_angle = TAU / self.image.width as f32 * self.heights[row];
        self.rows.prob(row) * self.columns.prob(row, column) / solid_angle
    }

    /// A direction, its density per steradian and its radiance.
    pub(super) fn sample(&self, u: Vec2) -> (Vec3, f32, Spectrum) {
        let (row, _, u_t) = self.rows.sample(u.y);
        let (column, u_s) = self.columns.sample(row, u.x);
        let colours = self.corners(column, row);
        let (c, mean) = self.weights_of(&colours, row);
        let t = linear_sample(u_t, c[0] + c[1], c[2] + c[3]);
        let s = linear_sample(u_s, c[0] + (c[2] - c[0]) * t, c[1] + (c[3] - c[1]) * t);
        let (cos, sin) = self.cos_sin(row, t);
        let (sin_phi, cos_phi) = ((column as f32 + 0.5 + s) * (TAU / self.image.width as f32)).sin_cos();
        let w = self.axes * Vec3::new(sin_phi * sin, cos, -cos_phi * sin);
        let t_theta = sin.atan2(cos) * FRAC_1_PI * (self.image.height - 1) as f32 - row as f32;
        let radiance = self.blend(&colours, s, t_theta.clamp(0.0, 1.0));
        (w, self.cell_p_w(column, row) * bilinear(&c, s, t) / mean, radiance)
    }

    /// cosθ and sinθ at the relative height `t` (in cosθ) of a row of cells.
    #[inline]
    fn cos_sin(&self, row: usize, t: f32) -> (f32, f32) {
        let upper = 2 * (row + 1) < self.image.height as usize;
        let versine = if upper {
            self.versines[row] + t * self.heights[row]
        } else {
            self.versines[row + 1] + (1.0 - t) * self.heights[row]
        };
        let cos = 1.0 - versine;
        let sin = (versine * (2.0 - versine)).max(0.0).sqrt();
        (if upper { cos } else { -cos }, sin)
    }

    /// ∫ L dω.
    pub(super) fn integral(&self) -> Spectrum {
        self.integral
    }

    /// Bytes of the tables (not of the image).
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.columns.cdf[..]) + size_of_val(&self.columns.guide[..])
    }

    /// Bytes of the image.
    pub(super) fn image_bytes(&self) -> usize {
        size_of_val(&self.image.data[..])
    }
}

#[inline]
fn bilinear(c: &[f32; 4], s: f32, t: f32) -> f32 {
    let upper = c[0] + (c[1] - c[0]) * s;
    let lower = c[2] + (c[3] - c[2]) * s;
    upper + (lower - upper) * t
}

/// Inverse of the distribution function of the density ∝ a + (b − a)x on [0, 1], a, b > 0.
#[inline]
fn linear_sample(u: f32, a: f32, b: f32) -> f32 {
    (u * (a + b) / (a + (a * a + u * (b * b - a * a)).max(0.0).sqrt())).clamp(0.0, 1.0)
}

/// Cells per entry of the guide.
const GUIDE: usize = 8;

/// The distribution of columns in every row, with a guide to the neighbourhood of the answer: two
/// or three cache lines of a big table are touched, where bisection would touch one per step.
#[derive(Clone, Debug, Default)]
struct Columns {
    width: usize,
    /// `width + 1` sums per row, from 0 to 1.
    cdf: Vec<f32>,
    /// For every k the last column whose sum is not above k / (guide entries per row − 1).
    guide: Vec<u32>,
}

impl Columns {
    fn guides(&self) -> usize {
        self.width.div_ceil(GUIDE) + 1
    }

    /// Appends a row of probabilities.
    fn push(&mut self, prob: impl ExactSizeIterator<Item = f64>) {
        self.width = prob.len();
        let first = self.cdf.len();
        let mut sum = 0.0;
        self.cdf.push(0.0);
        for p in prob {
            sum += p;
            self.cdf.push(sum.min(1.0) as f32);
        }
        let last = self.cdf.len() - 1;
        self.cdf[last] = 1.0;
        let row = &self.cdf[first..];
        let n = self.guides();
        let mut column = 0;
        for k in 0..n {
            let u = k as f32 / (n - 1) as f32;
            while column + 1 < self.width && row[column + 1] <= u {
                column += 1;
            }
            self.guide.push(column as u32);
        }
    }

    #[inline]
    fn prob(&self, row: usize, column: usize) -> f32 {
        let at = row * (self.width + 1) + column;
        self.cdf[at + 1] - self.cdf[at]
    }

    /// A column of a row, and `u` stretched to [0, 1) within it.
    #[inline]
    fn sample(&self, row: usize, u: f32) -> (usize, f32) {
        let cdf = &self.cdf[row * (self.width + 1)..][..=self.width];
        let n = self.guides();
        // The product may round up to the next entry: begin one earlier and end one later.
        let k = ((u * (n - 1) as f32) as usize).min(n - 2);
        let guide = &self.guide[row * n..][..n];
        let (from, to) = (guide[k.saturating_sub(1)] as usize, guide[(k + 2).min(n - 1)] as usize + 1);
        let column = from + cdf[from + 1..=to].partition_point(|c| *c <= u).min(to - 1 - from);
        let (low, high) = (cdf[column], cdf[column + 1]);
        (column, ((u - low) / (high - low)).clamp(0.0, ONE_MINUS_EPSILON))
    }
}
