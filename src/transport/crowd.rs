//! How many more light vertices than usual a merge finds at once, by place.
//!
//! All that a gathering vertex merges shares the chance that the walk came there. Where a caustic is bright, a merge is one
//! find and not the many that its density counts ([`super::mis`]), so weights must know how crowded a place is. They may
//! know it from anything but the samples that they weigh: from what a pilot shot.
//!
//! With M light vertices in the disk around a gathering vertex, on average and given where it is, the second moment of their
//! number is M + M². But what is found wherever walks go is no noise: with M̄ the mean of M over gathering vertices, the
//! variance E[M + M²] − M̄² = E[M·(1 + M − M̄)] is that of finds of which 1 + M − M̄ count as one.

use crate::math::random::mix;
use glam::{IVec3, Vec3};

/// Sides of cells, in radii of the first pass: several times what is merged, and less than most caustics.
const SIDE: f32 = 4.0;
/// Buckets for each point, so that cells seldom share one. Where two do, both seem more crowded: weights may be any function of
/// the place.
const BUCKETS: usize = 4;

/// Mean number M of light vertices within the radius of the first pass, as a function of the place that is constant in cells.
#[derive(Clone, Debug, Default)]
pub struct Crowds {
    inv_side: f32,
    /// By the hash of a cell.
    crowds: Vec<f32>,
    /// M̄.
    usual: f32,
}

impl Crowds {
    /// From the points of a part of a pass, which `share` of its light paths left; `radius` > 0 is that of the first pass.
    pub fn new(points: impl ExactSizeIterator<Item = Vec3>, radius: f32, share: f32) -> Self {
        let buckets = (BUCKETS * points.len()).next_power_of_two();
        let mut found = Self { inv_side: 1.0 / (SIDE * radius), crowds: vec![0.0; buckets], usual: 0.0 };
        // A surface fills a cell with about the square of its side.
        let each = std::f32::consts::PI / (SIDE * SIDE * share);
        for p in points {
            let bucket = found.bucket(p);
            found.crowds[bucket] += each;
        }
        found
    }

    #[inline]
    fn bucket(&self, p: Vec3) -> usize {
        let IVec3 { x, y, z } = (p * self.inv_side).floor().as_ivec3();
        let plane = u64::from(x as u32) << 32 | u64::from(y as u32);
        mix(plane ^ u64::from(z as u32).wrapping_mul(0x9e37_79b9_7f4a_7c15)) as usize & (self.crowds.len() - 1)
    }

    /// The same where gathering vertices find so many on average.
    pub fn with_usual(self, usual: f32) -> Self {
        Self { usual, ..self }
    }

    /// M̄.
    pub fn usual(&self) -> f32 {
        self.usual
    }

    /// M − M̄ at `p`, or 0 where there are fewer or nothing is known.
    #[inline]
    pub fn at(&self, p: Vec3) -> f32 {
        if self.crowds.is_empty() { 0.0 } else { (self.crowds[self.bucket(p)] - self.usual).max(0.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Random, random::Family};

    #[test]
    fn crowds_are_counts_in_disks() {
        // A square of side 2 with four times as many points on its right half, a tenth of all that a pass has.
        let mut random = Random::new(Family::Other, 1, 0, 5);
        let mut point = |i: u32| {
            let (x, y) = (random.unit(), 2.0 * random.unit() - 1.0);
            Vec3::new(if i.is_multiple_of(5) { -x } else { x }, 0.3, y)
        };
        let points: Vec<Vec3> = (0..20_000).map(&mut point).collect();
        let (radius, share) = (0.025, 0.1);
        let crowds = Crowds::new(points.into_iter(), radius, share);
        let disk = std::f32::consts::PI * radius * radius;
        let mean = |x: f32| (0..18).map(|i| crowds.at(Vec3::new(x, 0.3, 0.1 * i as f32 - 0.85))).sum::<f32>() / 18.0;
        for (x, per_area) in [(-0.45, 20_000.0), (0.45, 80_000.0)] {
            let expected = per_area * disk;
            assert!((mean(x) / expected - 1.0).abs() < 0.2, "{} instead of {expected}", mean(x));
        }
        let few = mean(-0.45);
        let crowds = crowds.with_usual(2.0 * few);
        assert_eq!(crowds.at(Vec3::new(-0.45, 0.3, 0.05)), 0.0);
        assert!(crowds.at(Vec3::new(0.45, 0.3, 0.05)) > few);
        assert_eq!(Crowds::default().at(Vec3::ONE), 0.0);
        let far = Crowds::new([Vec3::splat(f32::NAN), Vec3::splat(1e30)].into_iter(), 1e-20, 1.0);
        assert!(far.at(Vec3::splat(1e30)) > 0.0);
    }
}
