//! Stochastic iteration: L_n = b + τ*_n L_{n−1}, where τ*_n is a random operator with mean ρF.
//!
//! [Szirmay-Kalos 1999; Neumann 1995]. No matrix is stored: M rays leave the elements, their numbers in
//! proportion to flux, and each brings an equal share of the flux to whatever it meets. The iterates
//! do not converge, they have a limit distribution whose mean is the solution; the mean over N iterates
//! has an error of N^−1/2. It starts from Σ τ*ₙ…τ*₁ b, the flux shot and shot again until none is
//! left [Bekaert 1999, ch. 6], which has the solution as its mean already, so that there is no bias to
//! wait for.

use super::factors::Sequence;
use super::mesh::{Elements, VOID};
use super::{Rgb, Sources};
use crate::math::Random;
use crate::math::random::Family;
use crate::scene::Scene;
use rayon::prelude::*;

/// Groups of iterates whose means tell the error.
const BATCHES: u32 = 16;

/// How long.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effort {
    /// Iterates, made a multiple of 16.
    pub iterations: u32,
    /// Rays of one iteration.
    pub rays: u64,
    /// Of all random numbers.
    pub seed: u64,
}

/// What is known after a sixteenth of the iterations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Batch {
    /// Iterates so far.
    pub iterations: u32,
    /// Rays so far.
    pub rays: u64,
    /// Standard error of radiance over radiance, both as root mean square over the surfaces; infinite
    /// after the first batch.
    pub error: f64,
}

/// A solution by sampling.
#[derive(Clone, Debug)]
pub struct Sampled {
    /// Mean radiance of every element.
    pub radiance: Vec<Rgb>,
    /// Its standard error, from the means of 16 batches.
    pub standard_error: Vec<Rgb>,
    /// One line per batch.
    pub log: Vec<Batch>,
}

/// Iterates; `observe` sees every batch and may stop by answering false.
pub fn stochastic(
    scene: &Scene,
    mesh: &Elements,
    sources: &Sources,
    effort: Effort,
    mut observe: impl FnMut(&Batch) -> bool,
) -> Sampled {
    let n = mesh.len();
    let areas: Vec<f64> = (0..n).map(|i| mesh.area(i)).collect();
    let mut shooter = Shooter { scene, mesh, sources, areas, seed: effort.seed, runs: 0, cast: 0 };
    let mut radiance = shooter.series(effort.rays);
    let per_batch = effort.iterations.div_ceil(BATCHES).max(1);
    let (mut sum, mut squares) = (vec![[0.0; 3]; n], vec![[0.0; 3]; n]);
    let mut log = Vec::new();
    for batch in 1..=BATCHES {
        let mut mean = vec![[0.0; 3]; n];
        for _ in 0..per_batch {
            radiance = shooter.step(&radiance, effort.rays);
            add(&mut mean, &radiance, 1.0 / f64::from(per_batch));
        }
        add(&mut sum, &mean, 1.0);
        squares.iter_mut().zip(&mean).for_each(|(s, m)| (0..3).for_each(|c| s[c] += m[c] * m[c]));
        let error = relative_error(&shooter.areas, &sum, &squares, batch);
        log.push(Batch { iterations: batch * per_batch, rays: shooter.cast, error });
        if !log.last().is_some_and(&mut observe) {
            break;
        }
    }
    let done = log.len() as u32;
    let standard_error = (0..n).map(|i| std::array::from_fn(|c| error_of(sum[i][c], squares[i][c], done))).collect();
    sum.iter_mut().flatten().for_each(|v| *v /= f64::from(done));
    Sampled { radiance: sum, standard_error, log }
}

fn add(to: &mut [Rgb], from: &[Rgb], factor: f64) {
    to.iter_mut().zip(from).for_each(|(t, f)| (0..3).for_each(|c| t[c] += factor * f[c]));
}

/// Standard error of the mean of `n` numbers from their sum and sum of squares.
fn error_of(sum: f64, squares: f64, n: u32) -> f64 {
    let n = f64::from(n);
    if n < 2.0 { f64::INFINITY } else { ((squares - sum * sum / n).max(0.0) / (n * (n - 1.0))).sqrt() }
}

fn relative_error(areas: &[f64], sum: &[Rgb], squares: &[Rgb], n: u32) -> f64 {
    let (mut error, mut all) = (0.0, 0.0);
    for (i, a) in areas.iter().enumerate() {
        for c in 0..3 {
            error += a * error_of(sum[i][c], squares[i][c], n).powi(2);
            all += a * (sum[i][c] / f64::from(n)).powi(2);
        }
    }
    if all > 0.0 { (error / all).sqrt() } else { 0.0 }
}

/// Random transport.
struct Shooter<'a> {
    scene: &'a Scene,
    mesh: &'a Elements,
    sources: &'a Sources,
    areas: Vec<f64>,
    seed: u64,
    /// Operators drawn so far.
    runs: u64,
    /// Rays cast so far.
    cast: u64,
}

impl Shooter<'_> {
    /// b + τ*L.
    fn step(&mut self, radiance: &[Rgb], rays: u64) -> Vec<Rgb> {
        let mut next = self.reflected(radiance, rays);
        add(&mut next, &self.sources.radiance, 1.0);
        next
    }

    /// Σ τ*ₙ…τ*₁ b, rays in proportion to what is left, down to one that survives by chance.
    fn series(&mut self, rays: u64) -> Vec<Rgb> {
        let mut total = self.sources.radiance.clone();
        let mut unshot = total.clone();
        let all = self.flux(&unshot);
        loop {
            let wanted = if all > 0.0 { rays as f64 * self.flux(&unshot) / all } else { 0.0 };
            let chance = Random::new(Family::Elements, self.runs, 4, self.seed).unit();
            // A last ray is cast with probability `wanted` and stands for 1/wanted of itself.
            if wanted < 1.0 && f64::from(chance) >= wanted || !wanted.is_finite() {
                break;
            }
            let factor = if wanted < 1.0 { 1.0 / wanted } else { 1.0 };
            unshot = self.reflected(&unshot, (wanted.round() as u64).max(1));
            unshot.iter_mut().flatten().for_each(|v| *v *= factor);
            add(&mut total, &unshot, 1.0);
        }
        total
    }

    fn flux(&self, radiance: &[Rgb]) -> f64 {
        radiance.iter().zip(&self.areas).map(|(l, a)| a * l.iter().sum::<f64>()).sum()
    }

    /// τ*L by so many rays: the k-th of them stands at (k + u)/M of the running sum of flux.
    fn reflected(&mut self, radiance: &[Rgb], rays: u64) -> Vec<Rgb> {
        let mut received = vec![[0.0; 3]; radiance.len()];
        let all = self.flux(radiance);
        self.runs += 1;
        if !(all > 0.0 && all.is_finite()) || rays == 0 {
            return received;
        }
        let offset = f64::from(Random::new(Family::Elements, self.runs, 3, self.seed).unit());
        let rays = rays.min(u64::from(u32::MAX));
        let share = all / rays as f64;
        let mut from: Vec<u32> = Vec::with_capacity(rays as usize);
        let mut sum = 0.0;
        for (i, (l, a)) in radiance.iter().zip(&self.areas).enumerate() {
            sum += a * l.iter().sum::<f64>();
            let upto = ((sum / share - offset).ceil().max(0.0) as u64).min(rays) as usize;
            if upto > from.len() {
                from.resize(upto, i as u32);
            }
        }
        let sequence = Sequence::new(self.runs as usize, 5, self.seed);
        let (scene, mesh) = (self.scene, self.mesh);
        let met: Vec<u32> = from
            .par_iter()
            .enumerate()
            .map(|(k, i)| mesh.met(scene, &mesh.ray(scene, *i as usize, sequence.at(k as u32))))
            .collect();
        self.cast += from.len() as u64;
        // In the order of the rays, whoever cast them.
        for (i, j) in from.iter().zip(&met).filter(|(_, j)| **j != VOID) {
            let (l, j) = (&radiance[*i as usize], *j as usize);
            let part = share / (l.iter().sum::<f64>() * self.areas[j]);
            let rho = &self.sources.reflectance[j];
            (0..3).for_each(|c| received[j][c] += rho[c] * l[c] * part);
        }
        received
    }
}
