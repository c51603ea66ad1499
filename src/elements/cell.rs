//! Parts of charts: triangles or parallelograms in (s, t), each cut into four equal ones.
//!
//! All corners are dyadic, so that single precision holds them exactly and a point belongs to one
//! leaf only.

use glam::Vec2;

/// The points `origin + u·s + v·t`, for u, v ≥ 0 with u + v ≤ 1 (triangle) or u, v ≤ 1 (square).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cell {
    pub origin: Vec2,
    pub s: Vec2,
    pub t: Vec2,
    pub triangle: bool,
}

impl Cell {
    /// A whole chart.
    pub fn whole(triangle: bool) -> Self {
        Self { origin: Vec2::ZERO, s: Vec2::X, t: Vec2::Y, triangle }
    }

    /// Its four equal parts, in the order of [`Self::part_of`]. The fourth part of a triangle is the
    /// middle one, turned by 180°.
    pub fn parts(&self) -> [Self; 4] {
        let (s, t) = (0.5 * self.s, 0.5 * self.t);
        let at = |origin, s, t| Self { origin, s, t, triangle: self.triangle };
        let first = [at(self.origin, s, t), at(self.origin + s, s, t), at(self.origin + t, s, t)];
        let far = self.origin + s + t;
        let last = if self.triangle { at(far, -s, -t) } else { at(far, s, t) };
        [first[0], first[1], first[2], last]
    }

    /// Which part of any cell holds the point with local coordinates `u`, and its coordinates there.
    #[inline]
    pub fn part_of(triangle: bool, u: Vec2) -> (usize, Vec2) {
        let right = u.x >= 0.5;
        let up = u.y >= 0.5;
        match (triangle, right, up) {
            (true, false, false) if u.x + u.y > 0.5 => (3, Vec2::ONE - 2.0 * u),
            (_, false, false) => (0, 2.0 * u),
            (true, true, _) | (false, true, false) => (1, 2.0 * u - Vec2::X),
            (_, false, true) => (2, 2.0 * u - Vec2::Y),
            (false, true, true) => (3, 2.0 * u - Vec2::ONE),
        }
    }

    /// A point of the chart from two numbers in [0, 1), uniform by area.
    #[inline]
    pub fn at(&self, u: Vec2) -> Vec2 {
        let b = if self.triangle { crate::math::warp::triangle_uniform(u) } else { u };
        self.origin + self.s * b.x + self.t * b.y
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    use crate::math::random::Family;

    #[test]
    fn points_of_a_part_are_found_in_it() {
        let mut random = Random::new(Family::Other, 0, 0, 1);
        for triangle in [true, false] {
            for (k, part) in Cell::whole(triangle).parts().iter().enumerate() {
                for _ in 0..1000 {
                    let u = random.unit2();
                    let st = part.at(u);
                    let (found, inside) = Cell::part_of(triangle, st);
                    let own = Cell::whole(triangle).at(u);
                    assert!(found == k && (inside - own).length() < 1e-5, "{triangle} {k}: {st} in {found} at {inside}, {own}");
                }
            }
        }
    }
}
