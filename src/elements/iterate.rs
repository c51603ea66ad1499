//! Iteration: L_n = b + ρ F L_{n−1} and its relatives, until the residual b + ρFL − L is small.
//!
//! - Jacobi gathers: every element collects what all others had in the sweep before. From L_0 = 0 its
//!   n-th iterate is the Neumann series up to n − 1 scatterings.
//! - Gauss–Seidel gathers what the others have by now.
//! - Southwell shoots: the element with the most unshot flux sends it to all others, which is progressive
//!   refinement [Cohen 1988; Gortler 1994]. Its unshot radiance *is* the residual.
//!
//! Gathering takes a row of F, shooting a column: the finite twins of the two walkers. The residual of
//! Jacobi shrinks by q or faster in every sweep, in flux and in the maximum norm; in a closed
//! scene of one albedo, in flux, exactly by that.

use super::{Factors, Rgb, Sources};
use rayon::prelude::*;

/// Which iteration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Iteration {
    /// All elements at once, from the last sweep.
    Jacobi,
    /// One element after another, from what is known by then.
    GaussSeidel,
    /// The element with the most unshot flux shoots.
    Southwell,
}

/// When to end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Until {
    /// Residual in flux over the flux of the sources.
    pub residual: f64,
    /// Sweeps at most.
    pub sweeps: u32,
}

/// The state after a sweep; of Southwell's method, after as many shots as there are elements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Sweeps so far; 0 = L is 0.
    pub sweep: u32,
    /// Rows gathered or columns shot so far.
    pub transfers: u64,
    /// Flux of the residual over the flux of the sources: Σ A_i |r_i| / Σ A_i b_i, channels added.
    pub flux: f64,
    /// Largest residual over the largest source.
    pub largest: f64,
}

/// A solution by iteration.
#[derive(Clone, Debug)]
pub struct Iterated {
    /// Radiance of every element.
    pub radiance: Vec<Rgb>,
    /// The residual after every sweep, from the beginning.
    pub log: Vec<Step>,
    /// The residual became as small as was asked.
    pub converged: bool,
}

/// Iterates from L = 0; `observe` sees every step and may stop by answering false.
pub fn iterate(
    factors: &Factors,
    sources: &Sources,
    how: Iteration,
    until: Until,
    mut observe: impl FnMut(&Step) -> bool,
) -> Iterated {
    let mut state = State::new(factors, sources);
    let mut log = vec![state.step(0, 0)];
    let mut transfers = 0;
    let mut converged = state.is_done(&log[0], until);
    for sweep in 1..=until.sweeps {
        if converged || !log.last().is_some_and(|s| s.flux.is_finite() && observe(s)) {
            break;
        }
        transfers += match how {
            Iteration::Jacobi => state.jacobi(),
            Iteration::GaussSeidel => state.gauss_seidel(),
            Iteration::Southwell => state.southwell(until),
        };
        let step = state.step(sweep, transfers);
        converged = state.is_done(&step, until);
        log.push(step);
    }
    if let Some(last) = log.last() {
        observe(last);
    }
    Iterated { radiance: state.radiance, log, converged }
}

/// L, and its residual.
struct State<'a> {
    factors: &'a Factors,
    sources: &'a Sources,
    radiance: Vec<Rgb>,
    residual: Vec<Rgb>,
    /// Unshot flux, for shooting.
    unshot: Option<Tournament>,
    /// Flux and largest value of the sources.
    scale: (f64, f64),
}

impl<'a> State<'a> {
    fn new(factors: &'a Factors, sources: &'a Sources) -> Self {
        let scale = norms(factors.areas(), &sources.radiance);
        let radiance = vec![[0.0; 3]; factors.len()];
        Self { factors, sources, radiance, residual: sources.radiance.clone(), unshot: None, scale }
    }

    fn step(&self, sweep: u32, transfers: u64) -> Step {
        let (flux, largest) = norms(self.factors.areas(), &self.residual);
        let of = |r: f64, b: f64| if b > 0.0 { r / b } else { r };
        Step { sweep, transfers, flux: of(flux, self.scale.0), largest: of(largest, self.scale.1) }
    }

    fn is_done(&self, step: &Step, until: Until) -> bool {
        step.flux <= until.residual
    }

    /// ρ_i Σ_j F_ij L_j, without the element itself if asked.
    fn gathered(&self, i: usize, itself: bool) -> Rgb {
        let mut sum = [0.0; 3];
        for (j, x) in self.factors.row(i).filter(|(j, _)| itself || *j != i) {
            (0..3).for_each(|c| sum[c] += x * self.radiance[j][c]);
        }
        let rho = &self.sources.reflectance[i];
        std::array::from_fn(|c| rho[c] * sum[c] / self.factors.areas()[i])
    }

    fn measure(&mut self) {
        let of = |i: usize| {
            let g = self.gathered(i, true);
            std::array::from_fn(|c| self.sources.radiance[i][c] + g[c] - self.radiance[i][c])
        };
        self.residual = (0..self.radiance.len()).into_par_iter().map(of).collect();
    }

    /// L + r = b + ρFL.
    fn jacobi(&mut self) -> u64 {
        self.radiance.iter_mut().zip(&self.residual).for_each(|(l, r)| (0..3).for_each(|c| l[c] += r[c]));
        self.measure();
        self.radiance.len() as u64
    }

    fn gauss_seidel(&mut self) -> u64 {
        for i in 0..self.radiance.len() {
            let (g, own) = (self.gathered(i, false), self.factors.get(i, i));
            let (b, rho) = (&self.sources.radiance[i], &self.sources.reflectance[i]);
            self.radiance[i] = std::array::from_fn(|c| (b[c] + g[c]) / (1.0 - rho[c] * own));
        }
        self.measure();
        self.radiance.len() as u64
    }

    /// As many shots as there are elements, or fewer if little is left.
    fn southwell(&mut self, until: Until) -> u64 {
        let flux = |r: &Rgb, area: f64| area * r.iter().map(|v| v.abs()).sum::<f64>();
        let areas = self.factors.areas();
        let mut tree =
            self.unshot.take().unwrap_or_else(|| Tournament::new(self.residual.iter().zip(areas).map(|(r, a)| flux(r, *a))));
        let mut shots = 0;
        let enough = until.residual * self.scale.0 / self.radiance.len() as f64;
        while shots < self.radiance.len() as u64 {
            let (i, most) = tree.first();
            if most <= 0.5 * enough {
                break;
            }
            let shot = std::mem::take(&mut self.residual[i]);
            (0..3).for_each(|c| self.radiance[i][c] += shot[c]);
            tree.set(i, 0.0);
            for (j, x) in self.factors.row(i) {
                let rho = &self.sources.reflectance[j];
                (0..3).for_each(|c| self.residual[j][c] += rho[c] * x / areas[j] * shot[c]);
                tree.set(j, flux(&self.residual[j], areas[j]));
            }
            shots += 1;
        }
        self.unshot = Some(tree);
        shots
    }
}

/// Σ A_i |v_i| over all channels, and the largest |v_i|.
fn norms(areas: &[f64], values: &[Rgb]) -> (f64, f64) {
    let flux = values.iter().zip(areas).map(|(v, a)| a * v.iter().map(|v| v.abs()).sum::<f64>()).sum();
    let largest = values.iter().flatten().fold(0.0, |m: f64, v| if v.is_nan() { *v } else { m.max(v.abs()) });
    (flux, largest)
}

/// The largest of many numbers that change one by one: every inner node holds the index of the larger
/// of its two halves.
struct Tournament {
    values: Vec<f64>,
    winners: Vec<u32>,
    leaves: usize,
}

impl Tournament {
    fn new(values: impl Iterator<Item = f64>) -> Self {
        let values: Vec<f64> = values.collect();
        let leaves = values.len().next_power_of_two().max(2);
        let mut tree = Self { winners: vec![0; leaves], values, leaves };
        (1..leaves).rev().for_each(|node| tree.play(node));
        tree
    }

    /// Index that won in a child of a node; beyond the last value it is the last one.
    fn winner(&self, node: usize) -> usize {
        if node < self.leaves { self.winners[node] as usize } else { (node - self.leaves).min(self.values.len() - 1) }
    }

    fn play(&mut self, node: usize) {
        let (a, b) = (self.winner(2 * node), self.winner(2 * node + 1));
        self.winners[node] = if self.values[b] > self.values[a] { b as u32 } else { a as u32 };
    }

    fn set(&mut self, i: usize, value: f64) {
        self.values[i] = value;
        let mut node = (self.leaves + i) / 2;
        while node >= 1 {
            self.play(node);
            node /= 2;
        }
    }

    fn first(&self) -> (usize, f64) {
        let i = self.winner(1);
        (i, self.values[i])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    use crate::math::random::Family;

    #[test]
    fn a_tournament_has_the_first_of_the_largest() {
        for n in [1, 2, 3, 7, 64, 100] {
            let mut random = Random::new(Family::Other, n as u64, 0, 1);
            let mut values: Vec<f64> = (0..n).map(|_| f64::from(random.unit())).collect();
            let mut tree = Tournament::new(values.iter().copied());
            for _ in 0..300 {
                let i = random.below(n as u32) as usize;
                values[i] = f64::from(random.below(20));
                tree.set(i, values[i]);
                let most = values.iter().fold(f64::MIN, |m, v| m.max(*v));
                assert_eq!(tree.first().1, most);
                assert_eq!(values[tree.first().0], most);
            }
        }
    }
}
