//! A χ² test of a sampler against its density, on cells of any map of the unit square.

use crate::math::Frame;
use crate::math::warp::disk_concentric;
use glam::{Vec2, Vec3};
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f32::consts::PI;

/// Cells per axis and points per axis of a cell.
const CELLS: usize = 24;
const POINTS: usize = 8;

/// Directions as points of the unit square.
#[derive(Clone, Copy)]
pub enum Window {
    /// One side of the surface (the sign of z), by the equal-area map of the concentric disk.
    Side(f32),
    /// Those around an axis: orthogonal projection within a square of half width `radius`.
    Around(Frame, f32),
    /// Mirror images of a direction at facets whose slopes lie within a square of half width
    /// `radius`: resolves narrow lobes and grazing ones.
    Facets(Vec3, f32),
}

impl Window {
    /// Around an axis.
    pub fn around(axis: Vec3, radius: f32) -> Self {
        Self::Around(Frame::around(axis), radius)
    }

    /// Where a direction lies, if inside.
    pub fn find(&self, w: Vec3) -> Option<Vec2> {
        let p = match self {
            Self::Side(sign) => {
                if w.z * sign <= 0.0 {
                    return None;
                }
                let r = (1.0 - w.z.abs()).sqrt();
                0.5 + 0.5 * square_of_disk(r, w.y.atan2(w.x))
            }
            Self::Around(frame, radius) => {
                let v = frame.to_local(w);
                if v.z <= 0.0 {
                    return None;
                }
                0.5 + 0.5 * v.truncate() / *radius
            }
            Self::Facets(from, radius) => {
                if w.z * from.z <= 0.0 {
                    return None;
                }
                let m = w + *from;
                0.5 + 0.5 * m.truncate() / m.z / *radius
            }
        };
        (p.min_element() >= 0.0 && p.max_element() <= 1.0).then_some(p)
    }

    /// A direction and steradians per unit area of the square.
    fn direction(&self, p: Vec2) -> Option<(Vec3, f32)> {
        match self {
            Self::Side(sign) => {
                let d = disk_concentric(p);
                let z = 1.0 - d.length_squared();
                let r = (2.0 - d.length_squared()).max(0.0).sqrt();
                Some(((d * r).extend(z * sign), 2.0 * PI))
            }
            Self::Around(frame, radius) => {
                let v = (2.0 * p - 1.0) * *radius;
                let z2 = 1.0 - v.length_squared();
                (z2 > 1e-6).then(|| (frame.to_world(v.extend(z2.sqrt())), 4.0 * radius * radius / z2.sqrt()))
            }
            Self::Facets(from, radius) => {
                let slope = (2.0 * p - 1.0) * *radius;
                let m = slope.extend(1.0).normalize();
                let cos = m.dot(*from);
                let w = 2.0 * cos * m - *from;
                // dω_w = 4 |w·m| dω_m and dω_m = m_z³ d²slope.
                let area = 4.0 * cos.abs() * m.z.powi(3) * 4.0 * radius * radius;
                (w.z * from.z > 0.0).then_some((w, area))
            }
        }
    }

    /// Integral of any function of direction over every cell, by the midpoints of small squares.
    pub fn integrate(&self, function: impl Fn(Vec3) -> f64) -> Vec<f64> {
        let side = (CELLS * POINTS) as f32;
        let mut cells = vec![0.0; CELLS * CELLS];
        for y in 0..CELLS * POINTS {
            for x in 0..CELLS * POINTS {
                let p = Vec2::new((x as f32 + 0.5) / side, (y as f32 + 0.5) / side);
                if let Some((w, area)) = self.direction(p) {
                    cells[y / POINTS * CELLS + x / POINTS] += function(w) * f64::from(area) / f64::from(side * side);
                }
            }
        }
        cells
    }

    /// Counts of directions in the cells, and of those in none.
    pub fn count(&self, directions: impl Iterator<Item = Option<Vec3>>) -> (Vec<u64>, u64) {
        let (mut cells, mut rest) = (vec![0; CELLS * CELLS], 0);
        for w in directions {
            match w.and_then(|w| self.find(w)) {
                None => rest += 1,
                Some(p) => {
                    let [x, y] = [p.x, p.y].map(|v| ((v * CELLS as f32) as usize).min(CELLS - 1));
                    cells[y * CELLS + x] += 1;
                }
            }
        }
        (cells, rest)
    }
}

/// Inverse of the concentric map: polar coordinates to the square [−1, 1]².
fn square_of_disk(r: f32, phi: f32) -> Vec2 {
    let turn = (phi / (PI / 4.0) + 1.0).rem_euclid(8.0) - 1.0;
    match turn {
        t if t < 1.0 => Vec2::new(r, r * t),
        t if t < 3.0 => Vec2::new(r * (2.0 - t), r),
        t if t < 5.0 => Vec2::new(-r, r * (4.0 - t)),
        t => Vec2::new(r * (t - 6.0), -r),
    }
}

/// Probability of a χ² as large as that of `observed` (cells and the rest) where `expected` shares
/// are right; cells that expect fewer than five are pooled.
pub fn p_value(expected: &[f64], (observed, rest): &(Vec<u64>, u64)) -> f64 {
    let n = (observed.iter().sum::<u64>() + rest) as f64;
    let share: f64 = expected.iter().sum();
    let all = expected.iter().zip(observed).map(|(e, o)| (e * n, *o as f64));
    let all = all.chain([((1.0 - share).max(0.0) * n, *rest as f64)]);
    let (mut chi2, mut cells, mut pool) = (0.0, 0usize, (0.0, 0.0));
    for (e, o) in all {
        if e < 5.0 {
            pool = (pool.0 + e, pool.1 + o);
        } else {
            chi2 += (o - e) * (o - e) / e;
            cells += 1;
        }
    }
    if pool.0 >= 5.0 {
        chi2 += (pool.1 - pool.0) * (pool.1 - pool.0) / pool.0;
        cells += 1;
    } else if pool.1 > 40.0 {
        return 0.0;
    }
    if cells < 2 {
        return 1.0;
    }
    1.0 - ChiSquared::new((cells - 1) as f64).expect("positive").cdf(chi2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_find_their_own_directions() {
        let axis = Vec3::new(0.6, 0.0, 0.8);
        for window in [Window::Side(1.0), Window::Side(-1.0), Window::around(axis, 0.4), Window::Facets(axis, 0.5)] {
            for i in 0..100 {
                let p = Vec2::new(0.01 + 0.098 * (i % 11) as f32, 0.01 + 0.098 * (i / 11) as f32);
                if let Some((w, _)) = window.direction(p) {
                    let found = window.find(w).expect("inside");
                    assert!((found - p).length() < 1e-4, "{p} {found}");
                }
            }
        }
        let whole: f64 = Window::Side(1.0).integrate(|w| f64::from(w.z)).iter().sum();
        assert!((whole - std::f64::consts::PI).abs() < 1e-3);
    }

    #[test]
    fn a_wrong_density_is_found() {
        let window = Window::Side(1.0);
        let mut random = crate::math::Random::new(crate::math::random::Family::Other, 1, 0, 0);
        let counts = window.count((0..100_000).map(|_| Some(crate::math::warp::hemisphere_cosine(random.unit2()))));
        let right = window.integrate(|w| f64::from(w.z.max(0.0) / PI));
        let wrong = window.integrate(|w| f64::from(if w.z > 0.0 { 0.03 + 0.94 * w.z / PI } else { 0.0 }));
        assert!(p_value(&right, &counts) > 1e-4);
        assert!(p_value(&wrong, &counts) < 1e-12);
    }
}
