//! Form factors F_ij by ray casting, with reciprocity and closure enforced.
//!
//! N_i rays leave element i uniformly by area and by cosine; the share that meets j estimates F_ij, with
//! variance F_ij (1 − F_ij)/N_i or, since the rays are a low-discrepancy sequence, less. Both F_ij and
//! F_ji estimate the one exchange area X_ij = A_i F_ij = A_j F_ji [Goral 1984]; weighted by the inverse
//! of their variances, which are about A_i X_ij/N_i and A_j X_ij/N_j,
//!
//! ```text
//! X_ij = (n_ij + n_ji) / (N_i/A_i + N_j/A_j)
//! ```
//!
//! which is symmetric. Half of all rays leave all elements evenly, half go where light comes from, in
//! proportion to flux: most of the picture is light that a lamp sends directly. A diagonal scaling X_ij → d_i X_ij d_j then gives every row the sum that geometry
//! demands, Σ_j X_ij = A_i less what its own rays found leaving the scene or meeting black sides. It
//! is found by Sinkhorn's iteration in the form that keeps symmetry [Knight 2014]. A closed scene thus loses and
//! gains no energy at all, however few rays there were.

use super::Sources;
use super::mesh::{Elements, VOID};
use crate::math::Random;
use crate::math::random::Family;
use crate::scene::Scene;
use rayon::prelude::*;

/// Kronecker's sequence in four dimensions with the generalised golden ratio [Roberts 2018], shifted at
/// random: the k-th point is frac(shift + k·α), αₐ = φ₄^−(a+1) with φ₄⁵ = φ₄ + 1.
pub(super) struct Sequence([f64; 4]);

const GOLDEN: f64 = 1.167_303_978_261_418_7;

impl Sequence {
    /// The sequence of element `i` for one purpose.
    pub fn new(i: usize, purpose: u64, seed: u64) -> Self {
        let mut random = Random::new(Family::Elements, i as u64, purpose, seed);
        Self(std::array::from_fn(|_| f64::from(random.unit())))
    }

    /// Its k-th point.
    #[inline]
    pub fn at(&self, k: u32) -> [f32; 4] {
        let mut step = 1.0;
        std::array::from_fn(|a| {
            step /= GOLDEN;
            let x = (self.0[a] + f64::from(k) * step).fract() as f32;
            x.min(crate::math::warp::ONE_MINUS_EPSILON)
        })
    }
}

/// The form factors between all elements: rows of (element, exchange area), sorted by element.
#[derive(Clone, Debug)]
pub struct Factors {
    area: Vec<f64>,
    starts: Vec<usize>,
    columns: Vec<u32>,
    exchange: Vec<f64>,
    /// Share of every row that met no element.
    void: Vec<f64>,
    /// Largest relative deviation of a row sum from what it should be, before and after scaling.
    pub closure_error: [f64; 2],
    rays: u64,
}

/// What the rays of an element met: elements with counts, sorted; and how many met none.
type Row = (Vec<(u32, u32)>, u32);

/// How many rays leave every element, `mean` on average: half of them evenly, half in proportion to the
/// flux of the sources.
pub fn ray_counts(mesh: &Elements, sources: &Sources, mean: u32) -> Vec<u32> {
    let flux: Vec<f64> = (0..mesh.len()).map(|i| mesh.area(i) * sources.radiance[i].iter().sum::<f64>()).collect();
    let total: f64 = flux.iter().sum();
    let mean = f64::from(mean);
    let share = |f: &f64| if total > 0.0 { 0.5 + 0.5 * flux.len() as f64 * f / total } else { 1.0 };
    flux.iter().map(|f| (mean * share(f)).round() as u32).collect()
}

/// Rounds of scaling at most, and the deviation that is small enough.
const ROUNDS: usize = 200;
const CLOSED: f64 = 1e-13;

impl Factors {
    /// By so many rays from every element (see [`ray_counts`]); at least one is cast.
    pub fn cast(scene: &Scene, mesh: &Elements, counts: &[u32], seed: u64) -> Self {
        let count = |i: usize| counts.get(i).map_or(1, |n| (*n).max(1));
        let rows: Vec<Row> = (0..mesh.len()).into_par_iter().map(|i| cast_row(scene, mesh, i, count(i), seed)).collect();
        let area: Vec<f64> = (0..mesh.len()).map(|i| mesh.area(i)).collect();
        let void = rows.iter().enumerate().map(|(i, (_, void))| f64::from(*void) / f64::from(count(i))).collect();
        let density: Vec<f64> = area.iter().enumerate().map(|(i, a)| f64::from(count(i)) / a).collect();
        let (starts, columns, exchange) = symmetric(&rows, &density);
        let rays = (0..mesh.len()).map(|i| u64::from(count(i))).sum();
        let mut factors = Self { area, starts, columns, exchange, void, closure_error: [0.0; 2], rays };
        factors.close();
        factors
    }

    /// Bytes that form factors of so many elements may take while they are made, with so many rays from
    /// each on average.
    pub fn bytes(elements: usize, rays: u32) -> u64 {
        // There are at most as many entries as rays and as pairs; symmetry may double that.
        let entries = (elements as u64).saturating_mul(u64::from(rays).min(elements as u64));
        entries.saturating_mul(8 + 8 + 2 * 12).saturating_add(elements as u64 * 64)
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        self.area.len()
    }

    /// Without elements.
    pub fn is_empty(&self) -> bool {
        self.area.is_empty()
    }

    /// Rays cast in all.
    pub fn rays(&self) -> u64 {
        self.rays
    }

    /// Entries other than zero.
    pub fn entries(&self) -> usize {
        self.columns.len()
    }

    /// Areas of the elements, m².
    pub fn areas(&self) -> &[f64] {
        &self.area
    }

    /// The elements that element `i` exchanges light with, and their exchange areas A_i F_ij in m².
    #[inline]
    pub fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.starts[i]..self.starts[i + 1];
        self.columns[range.clone()].iter().zip(&self.exchange[range]).map(|(j, x)| (*j as usize, *x))
    }

    /// F_ij.
    pub fn get(&self, i: usize, j: usize) -> f64 {
        let range = self.starts[i]..self.starts[i + 1];
        let found = self.columns[range.clone()].binary_search(&(j as u32));
        found.map_or(0.0, |at| self.exchange[range.start + at] / self.area[i])
    }

    /// Σ_j F_ij, which is 1 in a closed scene.
    pub fn row_sum(&self, i: usize) -> f64 {
        self.row(i).map(|(_, x)| x).sum::<f64>() / self.area[i]
    }

    /// Scales rows and columns alike until every row has its sum.
    fn close(&mut self) {
        let target: Vec<f64> = self.area.iter().zip(&self.void).map(|(a, void)| a * (1.0 - void)).collect();
        let mut scale = vec![1.0f64; self.len()];
        for round in 0..=ROUNDS {
            let sums: Vec<f64> =
                (0..self.len()).into_par_iter().map(|i| scale[i] * self.row(i).map(|(j, x)| x * scale[j]).sum::<f64>()).collect();
            let ratio = |i: usize| if target[i] > 0.0 && sums[i] > 0.0 { target[i] / sums[i] } else { 1.0 };
            let error = (0..self.len()).map(|i| (1.0 - 1.0 / ratio(i)).abs()).fold(0.0, f64::max);
            self.closure_error[usize::from(round > 0)] = error;
            if round == 0 {
                self.closure_error[1] = error;
            }
            if error < CLOSED || round == ROUNDS {
                break;
            }
            for (i, d) in scale.iter_mut().enumerate() {
                *d *= ratio(i).sqrt();
            }
        }
        for i in 0..self.len() {
            for at in self.starts[i]..self.starts[i + 1] {
                // The product of the two factors first: the same for (i, j) and (j, i), bit for bit.
                self.exchange[at] *= scale[i] * scale[self.columns[at] as usize];
            }
        }
    }
}

fn cast_row(scene: &Scene, mesh: &Elements, i: usize, rays: u32, seed: u64) -> Row {
    let sequence = Sequence::new(i, 0, seed);
    let mut met: Vec<u32> = (0..rays).map(|k| mesh.met(scene, &mesh.ray(scene, i, sequence.at(k)))).collect();
    met.sort_unstable();
    let void = met.len() - met.partition_point(|m| *m != VOID);
    met.truncate(met.len() - void);
    let row = met.chunk_by(|a, b| a == b).map(|run| (run[0], run.len() as u32)).collect();
    (row, void as u32)
}

/// Both estimates of every exchange area joined: starts of rows, columns, values. `density` is N_i/A_i.
fn symmetric(rows: &[Row], density: &[f64]) -> (Vec<usize>, Vec<u32>, Vec<f64>) {
    // The rows of the transposed matrix come out sorted, since rows are visited in order.
    let mut turned: Vec<Vec<(u32, u32)>> = vec![Vec::new(); rows.len()];
    for (i, (row, _)) in rows.iter().enumerate() {
        row.iter().for_each(|(j, n)| turned[*j as usize].push((i as u32, *n)));
    }
    let (mut starts, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
    for (i, (row, _)) in rows.iter().enumerate() {
        let (mut a, mut b) = (row.iter().peekable(), turned[i].iter().peekable());
        loop {
            let (ja, jb) = (a.peek().map_or(VOID, |x| x.0), b.peek().map_or(VOID, |x| x.0));
            let j = ja.min(jb);
            if j == VOID {
                break;
            }
            let mut count = 0;
            if ja == j {
                count += a.next().map_or(0, |x| x.1);
            }
            if jb == j {
                count += b.next().map_or(0, |x| x.1);
            }
            columns.push(j);
            values.push(f64::from(count) / (density[i] + density[j as usize]));
        }
        starts.push(columns.len());
    }
    (starts, columns, values)
}
