//! Guided gathering: where light comes from at a point, as learned from what both walkers found there.
//!
//! A gathering walk that scatters by the local model alone seldom finds the door that is ajar, or the lamp in its
//! glass. Space is halved until each cell holds about as many lessons as the others, apart for the six sides that a
//! surface can face; each cell has a density of directions that follows the light that was found to arrive in it
//! [Jensen 1995; Müller 2017], a mixture of lobes around some directions ([von Mises and Fisher's][`Lobes`]), fitted by expectation and
//! maximisation [Vorba 2014; Herholz 2016]. A walk takes half of its directions from there,
//!
//! ```text
//! p(w) = (1 − α) p_model(w) + α p_learned(x, w),     p_learned = Σ_j π_j κ_j / (2π (1 − exp(−2κ_j))) exp(κ_j (µ_j·w − 1))
//! ```
//!
//! so that nothing is lost and no contribution grows by more than 1/(1 − α). The density is a function of the point, the side and the
//! direction alone, so that the shooting walker knows it too ([`super::vertex`]): every weight sees it, and
//! the measurement stays unbiased whatever was learned.

use crate::math::warp::ONE_MINUS_EPSILON;
use crate::math::{Frame, limit};
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use std::f32::consts::{LN_2, LOG2_E, TAU};

/// Share of learned directions, α, where something was learned.
pub const LEARNED: f32 = 0.5;
/// A cell of more lessons is halved.
const CELL: usize = 1000;
/// A cell of fewer teaches nothing.
const FEWEST: usize = 32;
/// Halvings, at most.
const DEEPEST_CELL: u32 = 24;
/// Lobes of a mixture.
const LOBES: usize = 8;
/// Rounds of fitting.
const ROUNDS: u32 = 8;
/// Sharpness of a lobe before the first.
const FIRST_SHARPNESS: f32 = 4.0;
/// Sharpness is kept within these bounds, …
const SHARPNESS: std::ops::RangeInclusive<f32> = 0.05..=2000.0;
/// … and judged as if so many lessons more had come from everywhere.
const FROM_EVERYWHERE: f64 = 0.2;
/// A single lesson counts for at most this part of what a cell has learned.
const MOST: f64 = 0.02;
/// Steps towards that bound.
const CLIPPINGS: u32 = 4;
/// "No cell."
const NONE: u32 = u32::MAX;

/// Light that was found to arrive.
#[derive(Clone, Copy, Debug)]
pub struct Lesson {
    /// Where.
    pub p: Vec3,
    /// Unit normal of the side on which it arrives.
    pub n: Vec3,
    /// Unit direction that it comes from.
    pub w: Vec3,
    /// How much, for the picture.
    pub value: f32,
}

/// A part of space: halved, or a cell.
#[derive(Clone, Copy, Debug)]
enum Part {
    /// Beyond `at` along `axis`: the second of two parts.
    Halved { axis: u8, at: f32, second: u32 },
    /// Number of its lobes; [`NONE`] where nothing was learned.
    Cell(u32),
}

/// Learned densities of the directions from which light arrives.
#[derive(Clone, Debug, Default)]
pub struct Incident {
    /// A part's first half follows it. The first six: the sides.
    sides: Vec<u32>,
    parts: Vec<Part>,
    lobes: Vec<Lobes>,
}

/// A mixture of von Mises and Fisher's densities on the sphere, lobe by lobe in lanes.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub struct Lobes {
    /// Mean directions µ.
    x: [f32; LOBES],
    y: [f32; LOBES],
    z: [f32; LOBES],
    /// κ.
    sharpness: [f32; LOBES],
    /// π κ / (2π (1 − exp(−2κ))), the density of a lobe along µ.
    peak: [f32; LOBES],
    /// π of this lobe and all before.
    up_to: [f32; LOBES],
}

/// exp(x) for x ≤ 0, to six digits; without branches, so that lanes stay lanes.
#[inline(always)]
fn exp(x: f32) -> f32 {
    /// 1.5·2²³: what is added to it is rounded to a whole number, which then stands in its last bits.
    const ROUND: f32 = 12_582_912.0;
    let t = (x * LOG2_E).max(-120.0);
    let whole = t + ROUND;
    let g = (t - (whole - ROUND)) * LN_2;
    let series = 1.0 + g * (1.0 + g * (1.0 / 2.0 + g * (1.0 / 6.0 + g * (1.0 / 24.0 + g * (1.0 / 120.0 + g * (1.0 / 720.0))))));
    f32::from_bits(series.to_bits().wrapping_add(whole.to_bits() << 23))
}

/// κ / (2π (1 − exp(−2κ))).
fn peak(sharpness: f32) -> f32 {
    sharpness / (TAU * -(-2.0 * sharpness).exp_m1())
}

impl Lobes {
    /// π_j p_j(w) of every lobe.
    #[inline]
    fn each(&self, w: Vec3) -> [f32; LOBES] {
        std::array::from_fn(|j| {
            let cos = self.x[j] * w.x + self.y[j] * w.y + self.z[j] * w.z;
            self.peak[j] * exp(self.sharpness[j] * (cos - 1.0).min(0.0))
        })
    }

    /// Density per steradian.
    #[inline]
    pub fn density(&self, w: Vec3) -> f32 {
        let [a, b, c, d, e, f, g, h] = self.each(w);
        ((a + e) + (b + f)) + ((c + g) + (d + h))
    }

    /// A unit direction.
    #[inline]
    pub fn sample(&self, u: Vec2) -> Vec3 {
        let j = self.up_to.iter().position(|p| u.x < *p).unwrap_or(LOBES - 1);
        let before = if j > 0 { self.up_to[j - 1] } else { 0.0 };
        let part = (self.up_to[j] - before).max(f32::MIN_POSITIVE);
        let v = ((u.x - before) / part).clamp(0.0, ONE_MINUS_EPSILON);
        let k = self.sharpness[j];
        // From the pole outwards, exp(κ(cosθ − 1)) is uniform.
        let cos = (1.0 + (1.0 + v * (-2.0 * k).exp_m1()).ln() / k).clamp(-1.0, 1.0);
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let (s, c) = (TAU * u.y).sin_cos();
        Frame::around(self.mean(j)).to_world(Vec3::new(sin * c, sin * s, cos))
    }

    fn mean(&self, j: usize) -> Vec3 {
        Vec3::new(self.x[j], self.y[j], self.z[j])
    }

    /// Of lobes with their shares π, means µ and sharpness κ.
    fn new(lobes: [(f32, Vec3, f32); LOBES]) -> Self {
        let mut sum = 0.0;
        Self {
            x: lobes.map(|l| l.1.x),
            y: lobes.map(|l| l.1.y),
            z: lobes.map(|l| l.1.z),
            sharpness: lobes.map(|l| l.2),
            peak: lobes.map(|l| l.0 * peak(l.2)),
            up_to: lobes.map(|l| {
                sum += l.0;
                sum
            }),
        }
    }

    /// Fitted to directions with their values, of which the sum is positive.
    fn fitted(lessons: &[(Vec3, f64)]) -> Self {
        let total: f64 = lessons.iter().map(|l| l.1).sum();
        let mut lobes = Self::spread(lessons, total);
        // A lesson's value as a number of lessons.
        let scale = lessons.len() as f64 / total;
        for _ in 0..ROUNDS {
            let mut sums = [[0.0f64; 4]; LOBES];
            for (w, value) in lessons {
                let each = lobes.each(*w);
                let all: f32 = each.iter().sum();
                if !(all > 0.0) {
                    continue;
                }
                for (sum, p) in sums.iter_mut().zip(each) {
                    let part = value * scale * f64::from(p / all);
                    sum[0] += part;
                    sum[1] += part * f64::from(w.x);
                    sum[2] += part * f64::from(w.y);
                    sum[3] += part * f64::from(w.z);
                }
            }
            let all: f64 = sums.iter().map(|s| s[0]).sum();
            lobes = Self::new(std::array::from_fn(|j| {
                let [n, x, y, z] = sums[j];
                let length = (x * x + y * y + z * z).sqrt();
                if !(length > 0.0) {
                    return (0.0, lobes.mean(j), FIRST_SHARPNESS);
                }
                let r = length / (n + FROM_EVERYWHERE);
                // [Banerjee 2005, eq. 4.4]
                let sharpness = (r * (3.0 - r * r) / (1.0 - r * r)) as f32;
                let mean = Vec3::new((x / length) as f32, (y / length) as f32, (z / length) as f32);
                ((n / all) as f32, mean, sharpness.clamp(*SHARPNESS.start(), *SHARPNESS.end()))
            }));
        }
        lobes
    }

    /// Lobes around directions of which each stands for as much.
    fn spread(lessons: &[(Vec3, f64)], total: f64) -> Self {
        let (mut at, mut sum) = (0, 0.0);
        Self::new(std::array::from_fn(|j| {
            let wanted = total * (j as f64 + 0.5) / LOBES as f64;
            while at + 1 < lessons.len() && sum + lessons[at].1 < wanted {
                sum += lessons[at].1;
                at += 1;
            }
            (1.0 / LOBES as f32, lessons[at].0, FIRST_SHARPNESS)
        }))
    }
}

/// Which of six sides a normal is nearest to.
#[inline]
fn side(n: Vec3) -> usize {
    let axis = n.abs().max_position();
    2 * axis + usize::from(n[axis] < 0.0)
}

impl Incident {
    /// From all that was found.
    pub fn learned(lessons: &[Lesson]) -> Self {
        let mut incident = Self::default();
        let mut by_side: [Vec<Lesson>; 6] = Default::default();
        for lesson in lessons {
            if lesson.value > 0.0 && lesson.value.is_finite() {
                by_side[side(lesson.n)].push(*lesson);
            }
        }
        let mut cells = vec![];
        for lessons in &mut by_side {
            incident.sides.push(incident.parts.len() as u32);
            incident.halve(lessons, 0, &mut cells);
        }
        incident.lobes = cells.into_par_iter().map(fit).collect();
        incident
    }

    /// Cells in which something was learned.
    pub fn cells(&self) -> usize {
        self.lobes.len()
    }

    /// Memory held, in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.parts[..]) + size_of_val(&self.lobes[..])
    }

    /// What was learned at `p` on the side of `n`.
    #[inline]
    pub fn at(&self, p: Vec3, n: Vec3) -> Option<&Lobes> {
        let mut at = *self.sides.get(side(n))? as usize;
        loop {
            match self.parts[at] {
                Part::Halved { axis, at: middle, second } => {
                    at = if p[usize::from(axis)] < middle { at + 1 } else { second as usize };
                }
                Part::Cell(NONE) => return None,
                Part::Cell(cell) => return self.lobes.get(cell as usize),
            }
        }
    }

    fn halve<'l>(&mut self, lessons: &'l mut [Lesson], depth: u32, cells: &mut Vec<&'l [Lesson]>) {
        let low = lessons.iter().fold(Vec3::INFINITY, |m, l| m.min(l.p));
        let high = lessons.iter().fold(Vec3::NEG_INFINITY, |m, l| m.max(l.p));
        let extent = high - low;
        if lessons.len() > CELL && depth < DEEPEST_CELL && extent.max_element() > 0.0 {
            let axis = extent.max_position();
            let half = lessons.len() / 2;
            let middle = lessons.select_nth_unstable_by(half, |a, b| a.p[axis].total_cmp(&b.p[axis])).1.p[axis];
            // All that is alike goes to one half.
            let first = partition(lessons, |l| l.p[axis] < middle);
            if first > 0 {
                let here = self.parts.len();
                self.parts.push(Part::Halved { axis: axis as u8, at: middle, second: 0 });
                let (first, second) = lessons.split_at_mut(first);
                self.halve(first, depth + 1, cells);
                let after = self.parts.len() as u32;
                self.parts[here] = Part::Halved { axis: axis as u8, at: middle, second: after };
                self.halve(second, depth + 1, cells);
                return;
            }
        }
        let cell = if lessons.len() < FEWEST {
            NONE
        } else {
            cells.push(lessons);
            (cells.len() - 1) as u32
        };
        self.parts.push(Part::Cell(cell));
    }
}

/// The lobes of a cell.
fn fit(lessons: &[Lesson]) -> Lobes {
    let most = limit(lessons.iter().map(|l| f64::from(l.value)), MOST, CLIPPINGS);
    let directions: Vec<(Vec3, f64)> = lessons.iter().map(|l| (l.w, f64::from(l.value).min(most))).collect();
    Lobes::fitted(&directions)
}

/// Brings those that are `first` to the front; how many they are.
fn partition<T>(all: &mut [T], first: impl Fn(&T) -> bool) -> usize {
    let mut n = 0;
    for i in 0..all.len() {
        if first(&all[i]) {
            all.swap(i, n);
            n += 1;
        }
    }
    n
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Family;
    use crate::math::{Random, warp};

    /// Light from two directions, one for each half of a floor, and a little from everywhere.
    fn lessons() -> Vec<Lesson> {
        let mut random = Random::new(Family::Other, 0, 0, 3);
        let lesson = |_| {
            let p = Vec3::new(2.0 * random.unit() - 1.0, 0.0, random.unit());
            let from = Vec3::new(p.x.signum(), 1.0, 0.0).normalize();
            let off = 0.3 * warp::sphere_charts(random.unit2());
            let w = if random.unit() < 0.8 { (from + off).normalize() } else { warp::sphere_charts(random.unit2()) };
            Lesson { p, n: Vec3::Y, w, value: random.unit() }
        };
        (0..20_000).map(lesson).collect()
    }

    #[test]
    fn directions_are_drawn_with_their_density() {
        let incident = Incident::learned(&lessons());
        let mut random = Random::new(Family::Other, 1, 0, 3);
        for x in [-0.7f32, 0.4] {
            let lobes = incident.at(Vec3::new(x, 0.0, 0.3), Vec3::Y).expect("something was learned");
            let n = 200_000;
            // ∫ p dw = 1 by uniform directions; E[cos] by directions drawn and by uniform ones.
            let (mut integral, mut by_density, mut drawn) = (0.0, Vec3::ZERO, Vec3::ZERO);
            for _ in 0..n {
                let w = warp::sphere_charts(random.unit2());
                let p = lobes.density(w) / warp::SPHERE_UNIFORM_P_W / n as f32;
                integral += p;
                by_density += p * w;
                let w = lobes.sample(random.unit2());
                assert!((w.length() - 1.0).abs() < 1e-5 && lobes.density(w) > 0.0, "{w}");
                drawn += w / n as f32;
            }
            assert!((integral - 1.0).abs() < 0.05, "{integral}");
            assert!((by_density - drawn).length() < 0.05, "{by_density} {drawn}");
            assert!(drawn.dot(Vec3::new(x.signum(), 1.0, 0.0).normalize()) > 0.7, "{drawn}");
        }
    }

    #[test]
    fn sides_and_places_without_lessons_know_nothing() {
        let incident = Incident::learned(&lessons());
        assert!(incident.cells() > 10 && incident.bytes() > 0);
        assert!(incident.at(Vec3::ZERO, -Vec3::Y).is_none() && incident.at(Vec3::ZERO, Vec3::X).is_none());
        assert!(
            Incident::learned(&[]).at(Vec3::ZERO, Vec3::Y).is_none() && Incident::default().at(Vec3::ZERO, Vec3::Y).is_none()
        );
        // All in one place, from one direction, or of no value: no more than a cell.
        let same = Lesson { p: Vec3::ONE, n: Vec3::Y, w: Vec3::Y, value: 1.0 };
        let incident = Incident::learned(&vec![same; 5000]);
        let density = incident.at(Vec3::ZERO, Vec3::Y).map(|l| l.density(Vec3::Y));
        assert!(incident.cells() == 1 && density.is_some_and(|p| p.is_finite() && p > 10.0), "{density:?}");
        assert_eq!(Incident::learned(&vec![Lesson { value: f32::NAN, ..same }; 5000]).cells(), 0);
    }

    #[test]
    fn exponentials_are_right_to_six_digits() {
        for i in 0..4000 {
            let x = -0.01 * i as f32;
            let right = f64::from(x).exp();
            assert!((f64::from(exp(x)) / right - 1.0).abs() < 3e-6, "{x}: {}", exp(x));
        }
        assert!(exp(-1e9) < 1e-30 && exp(f32::NEG_INFINITY) < 1e-30);
    }
}
