//! A hash grid over points, searched for all points near another one: the photon map of merges.
//!
//! Cells have twice the radius as side, so a ball meets at most eight of them. Points are sorted by
//! the bucket of their cell (counting sort, in the order given within a bucket, so the order of visits
//! is a function of the points alone); a bucket may hold points of several cells, which the
//! comparison of distances tells apart, and is read once even where two of the eight cells share it.
//!
//! Blocks of 4 × 2 × 2 cells are hashed, their cells are buckets that follow each other: what a ball
//! meets lies in two or three lines of memory, which are asked for together, not in eight one after another.

use crate::math::prefetch;
use glam::{IVec3, Vec3};
use rayon::prelude::*;

/// Points with a number each.
#[derive(Clone, Debug, Default)]
pub struct PointGrid {
    /// Start of each bucket in `points`, one more than there are buckets; empty without points.
    starts: Vec<u32>,
    points: Vec<(Vec3, u32)>,
    inv_side: f32,
}

impl PointGrid {
    /// A grid to be searched within at most `radius` > 0.
    pub fn new(points: Vec<(Vec3, u32)>, radius: f32) -> Self {
        if points.is_empty() {
            return Self::default();
        }
        let buckets = points.len().next_power_of_two().max(16);
        let mut grid = Self { starts: vec![0; buckets + 1], points: vec![(Vec3::ZERO, 0); points.len()], inv_side: 0.5 / radius };
        for (p, _) in &points {
            let bucket = grid.bucket(grid.cell(*p));
            grid.starts[bucket] += 1;
        }
        let mut sum = 0;
        for start in &mut grid.starts {
            sum += *start;
            *start = sum;
        }
        // Filled from the end, each start moves down to where its bucket begins.
        for point in points.into_iter().rev() {
            let bucket = grid.bucket(grid.cell(point.0));
            grid.starts[bucket] -= 1;
            grid.points[grid.starts[bucket] as usize] = point;
        }
        grid
    }

    #[inline]
    fn cell(&self, p: Vec3) -> IVec3 {
        // Far away casts saturate: such points share cells, distances still tell them apart.
        (p * self.inv_side).floor().as_ivec3()
    }

    #[inline]
    fn bucket(&self, cell: IVec3) -> usize {
        let mix = |h: u64, x: i32| (h ^ u64::from(x as u32)).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29);
        let block = mix(mix(mix(0, cell.x >> 2), cell.y >> 1), cell.z >> 1) as usize;
        let local = (cell.x & 3 | (cell.y & 1) << 2 | (cell.z & 1) << 3) as usize;
        (block << 4 | local) & (self.starts.len() - 2)
    }

    /// The numbers of the points in the order of the grid.
    pub fn numbers(&self) -> impl IndexedParallelIterator<Item = u32> {
        self.points.par_iter().map(|(_, number)| *number)
    }

    /// Calls `visit` with the place in [`Self::numbers`] of every point whose squared distance from `p` is below `radius2`.
    #[inline]
    pub fn around(&self, p: Vec3, radius2: f32, mut visit: impl FnMut(u32)) {
        if self.points.is_empty() {
            return;
        }
        let half = self.cell(p - Vec3::splat(0.5 / self.inv_side));
        let mut buckets = [0usize; 8];
        for (i, bucket) in buckets.iter_mut().enumerate() {
            let i = i as i32;
            *bucket = self.bucket(half.wrapping_add(IVec3::new(i & 1, (i >> 1) & 1, i >> 2)));
        }
        buckets.iter().for_each(|b| prefetch(&raw const self.starts[*b]));
        buckets.iter().for_each(|b| prefetch(self.points.as_ptr().wrapping_add(self.starts[*b] as usize)));
        for (i, bucket) in buckets.iter().enumerate() {
            if buckets[..i].contains(bucket) {
                continue;
            }
            let places = self.starts[*bucket]..self.starts[bucket + 1];
            let points = &self.points[places.start as usize..places.end as usize];
            for (place, (q, _)) in places.zip(points) {
                if (*q - p).length_squared() < radius2 {
                    visit(place);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Random, random::Family};

    #[test]
    fn finds_what_a_search_of_all_finds() {
        let mut random = Random::new(Family::Other, 0, 0, 9);
        let mut point = || {
            let mut x = || 20.0 * random.unit() - 10.0;
            Vec3::new(x(), x(), 0.1 * x())
        };
        let points: Vec<(Vec3, u32)> = (0..5000).map(|i| (point(), i)).collect();
        let (radius, mut found_any) = (0.7f32, 0);
        let grid = PointGrid::new(points.clone(), radius);
        let numbers: Vec<u32> = grid.numbers().collect();
        for _ in 0..500 {
            let p = point();
            for r in [radius, 0.4] {
                let mut found = vec![];
                grid.around(p, r * r, |i| found.push(numbers[i as usize]));
                found.sort_unstable();
                let all: Vec<u32> = points.iter().filter(|(q, _)| (*q - p).length_squared() < r * r).map(|(_, i)| *i).collect();
                assert_eq!(found, all);
                found_any += usize::from(!all.is_empty());
            }
        }
        assert!(found_any > 500);
    }

    #[test]
    fn nothing_is_near_nothing_and_far_points_do_no_harm() {
        PointGrid::default().around(Vec3::ZERO, 1.0, |_| panic!("there is no point"));
        let far = Vec3::new(1e30, -1e30, f32::NAN);
        let grid = PointGrid::new(vec![(far, 0), (Vec3::ONE, 1)], 1e-6);
        let mut found = 0;
        let numbers: Vec<u32> = grid.numbers().collect();
        grid.around(Vec3::ONE, 1e-12, |i| found += numbers[i as usize]);
        grid.around(far, 1e-12, |_| found = 100);
        assert_eq!(found, 1);
    }
}
