//! Inversion: L = (1 − ρF)⁻¹ b by elimination, one dense matrix at a time.
//!
//! Each channel has its own matrix; channels with the same reflectances share one. Elimination runs on
//! one thread per matrix, so that its rounding does not depend on threads.

use super::{ElementsError, Factors, Rgb, Sources};
use faer::Mat;
use faer::prelude::Solve;

/// Bytes that inversion takes: the matrix of one channel and its factors.
pub fn bytes(elements: usize) -> u64 {
    let n = elements as u64;
    n.saturating_mul(n).saturating_mul(2 * 8)
}

/// Radiance of every element; refused where the matrix would take more than `allowed` bytes.
pub fn invert(factors: &Factors, sources: &Sources, allowed: u64) -> Result<Vec<Rgb>, ElementsError> {
    let n = factors.len();
    let needed = bytes(n);
    if needed > allowed {
        return Err(ElementsError::Memory { elements: n, needed, allowed });
    }
    let mut radiance = vec![[0.0; 3]; n];
    let same = |a: usize, b: usize| sources.reflectance.iter().all(|r| r[a] == r[b]);
    let mut done = [false; 3];
    for first in 0..3 {
        if done[first] {
            continue;
        }
        let channels: Vec<usize> = (first..3).filter(|c| !done[*c] && same(first, *c)).collect();
        let solution = solve(factors, sources, &channels);
        for (k, c) in channels.into_iter().enumerate() {
            done[c] = true;
            (0..n).for_each(|i| radiance[i][c] = solution[(i, k)]);
        }
    }
    if radiance.iter().flatten().all(|v| v.is_finite()) { Ok(radiance) } else { Err(ElementsError::Singular) }
}

/// The columns of (1 − ρF)⁻¹ b for channels that share their reflectances.
fn solve(factors: &Factors, sources: &Sources, channels: &[usize]) -> Mat<f64> {
    let n = factors.len();
    let mut matrix = Mat::<f64>::identity(n, n);
    for i in 0..n {
        let rho = sources.reflectance[i][channels[0]] / factors.areas()[i];
        factors.row(i).for_each(|(j, x)| matrix[(i, j)] -= rho * x);
    }
    let right = Mat::from_fn(n, channels.len(), |i, k| sources.radiance[i][channels[k]]);
    let lu = matrix.partial_piv_lu();
    drop(matrix);
    lu.solve(&right)
}
