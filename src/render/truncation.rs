//! Where to cut off the expansion L = Σ τⁿLᵉ: from a bound where there is one, else from what is measured.
//!
//! With ‖τ‖ ≤ q < 1, everything beyond D scatterings is no larger than q^(D+1) ‖L‖, in two norms:
//!
//! - no pixel lacks more than q^(D+1) sup L (in basic radiance L/n², sup over the whole scene);
//! - the scene lacks no more than q^(D+1) ‖L‖₁ of its flux, and ‖L‖₁ ≤ ‖Lᵉ‖₁/(1 − q).
//!
//! q is the largest albedo bound of the materials in use. Neither norm bounds the energy of one image by
//! that of the same image: a camera may look at just what comes late. So the share of the image that is
//! lost is measured and extrapolated, and where q = 1 (glass, ideal mirrors) that estimate is all there is.

use super::pilot;
use crate::math::Random;
use crate::math::random::Family;
use crate::scene::Scene;
use crate::transport::cache::LightCache;
use crate::transport::gather::gather;
use crate::transport::settings::Settings;
use crate::transport::shoot::shoot;
use crate::transport::walk::{Context, Tally};
use crate::transport::{Contribution, RayCounts, Record};
use glam::Vec2;
use rayon::prelude::*;

/// Longest path that is measured.
const LONGEST: u32 = 192;
/// Independent rounds, and gathering walks and light paths of each.
const ROUNDS: u64 = 32;
const WALKS: u32 = 2048;
/// A term is known where its standard error is below this share of it.
const KNOWN: f64 = 0.2;
/// Terms over which their ratio is taken.
const WINDOW: usize = 6;
/// Passes of rounds begin here, beyond those of the pilot.
const FIRST_PASS: u64 = 1 << 20;
/// Largest ratio of successive terms that is extrapolated with.
const SLOWEST: f64 = 0.999;

/// A length, and why.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Truncation {
    /// What may be lost, as a share.
    pub tolerance: f64,
    /// q: no material scatters more than this share.
    pub contraction: f64,
    /// Most scatterings, D.
    pub scatterings: u32,
    /// D follows from the bound; else from the measured tail, and is an estimate.
    pub a_priori: bool,
    /// q^(D+1), where that is below 1: bounds what pixels lack in units of sup L, and the scene in units of ‖L‖₁.
    pub bound: Option<f64>,
    /// W; the flux ‖L‖₁ is at most ‖Lᵉ‖₁/(1 − q).
    pub flux_at_most: Option<f64>,
    /// Points, spots or parallel light: radiance has no upper bound near them, the flux has.
    pub unbounded_radiance: bool,
    /// Measured share of the image beyond D, extrapolated where it is too small to be seen.
    pub measured_tail: f64,
    /// Ratio of successive terms of the image where they were last known.
    pub measured_ratio: f64,
    /// The terms of the image as shares of it, as far as they were known.
    pub terms: Vec<f64>,
}

impl Truncation {
    /// Chooses D for a render with `settings` in the crop window.
    pub fn choose(scene: &Scene, settings: &Settings, crop: [u32; 4], tolerance: f64) -> Self {
        let q = contraction(scene);
        let tail = Tail::measure(scene, settings, crop);
        let limit = settings.max_length.max(1) - 1;
        let by_bound = (q < 1.0).then(|| scatterings_by_bound(q, tolerance));
        let scatterings = by_bound.unwrap_or_else(|| tail.scatterings(tolerance)).min(limit);
        let emitters = scene.lights.infos().iter().filter(|e| e.prob_emission > 0.0);
        let flux = emitters.clone().map(|e| f64::from(e.power.iter().sum::<f32>()) / 3.0).sum::<f64>();
        let ids = (0..scene.lights.infos().len() as u32).map(crate::scene::EmitterId);
        Self {
            tolerance,
            contraction: q,
            scatterings,
            a_priori: by_bound.is_some(),
            bound: (q < 1.0).then(|| q.powi(scatterings as i32 + 1)),
            flux_at_most: (q < 1.0).then(|| flux / (1.0 - q)),
            unbounded_radiance: ids.into_iter().any(|id| scene.lights.is_delta(id)),
            measured_tail: tail.beyond(scatterings),
            measured_ratio: tail.ratio,
            terms: tail.terms,
        }
    }

    /// Longest path in edges.
    pub fn max_length(&self) -> u32 {
        self.scatterings + 1
    }
}

/// q: the largest share that any material in use scatters, in the lane that loses least. Of basic radiance and
/// of flux alike, since both are the same kernel; never below 0.
pub fn contraction(scene: &Scene) -> f64 {
    scene.used_materials.iter().map(|m| f64::from(scene.materials.albedo_bound(*m).max_lane())).fold(0.0, f64::max)
}

/// Smallest D with q^(D+1) ≤ tolerance.
fn scatterings_by_bound(q: f64, tolerance: f64) -> u32 {
    if q <= 0.0 || tolerance >= 1.0 {
        return 0;
    }
    // A little above, so that rounding of the logarithms adds no term where the bound is met exactly.
    ((tolerance.ln() / q.ln() - 1e-9).ceil().max(1.0) as u32).saturating_sub(1)
}

/// The terms of an image as far as they are known, and how they go on.
struct Tail {
    /// Shares of the image.
    terms: Vec<f64>,
    /// Of a term to the one before, beyond the last.
    ratio: f64,
}

impl Tail {
    fn measure(scene: &Scene, settings: &Settings, crop: [u32; 4]) -> Self {
        let max_length = settings.max_length.min(LONGEST);
        let settings = Settings { light_paths: Some(WALKS), min_length: 1, max_length, automatic: false, ..settings.clone() };
        let plan = pilot::decide(scene, &settings, crop).plan(scene, crop);
        let cx = Context::new(scene, &plan, 0);
        let rounds: Vec<Vec<f64>> = (0..ROUNDS).into_par_iter().map(|r| round(cx, crop, FIRST_PASS + r)).collect();
        let n = ROUNDS as f64;
        let of = |k: usize| {
            let mean = rounds.iter().map(|r| r[k]).sum::<f64>() / n;
            (mean, (rounds.iter().map(|r| (r[k] - mean).powi(2)).sum::<f64>() / (n * (n - 1.0))).sqrt())
        };
        Self::of((1..=max_length as usize).map(of).collect())
    }

    /// From terms with their standard errors.
    fn of(all: Vec<(f64, f64)>) -> Self {
        // A term that nothing reaches (a lamp out of sight) is known as well as any.
        let known = all.iter().rposition(|(mean, se)| *mean > 0.0 && *se < KNOWN * mean).map_or(0, |last| last + 1);
        let known = known.min(all.iter().skip(2).position(|(mean, se)| *se > KNOWN * mean).map_or(all.len(), |i| i + 2));
        let terms: Vec<f64> = all.iter().take(known).map(|t| t.0).collect();
        // The first two differ from all that follows: lights themselves, and what they light.
        let window = WINDOW.min(known.saturating_sub(2));
        let ratio = if window > 0 && terms[known - 1 - window] > 0.0 {
            (terms[known - 1] / terms[known - 1 - window]).powf(1.0 / window as f64).min(SLOWEST)
        } else {
            // Too noisy to tell them apart: of geometric terms the sums have the same ratio.
            let from = |n: usize| all.iter().skip(n).map(|t| t.0).sum::<f64>();
            if from(2) > 0.0 { (from(3) / from(2)).min(SLOWEST) } else { 0.0 }
        };
        let last = terms.last().copied().unwrap_or(0.0);
        let total = terms.iter().sum::<f64>() + last * ratio / (1.0 - ratio);
        let share = |t: f64| if total > 0.0 { t / total } else { 0.0 };
        Self { terms: terms.into_iter().map(share).collect(), ratio }
    }

    /// Share of the image beyond D scatterings.
    fn beyond(&self, d: u32) -> f64 {
        let (d, known) = (d as usize, self.terms.len());
        let Some(last) = self.terms.last() else { return 0.0 };
        let rest = last * self.ratio / (1.0 - self.ratio);
        if d < known { self.terms[d + 1..].iter().sum::<f64>() + rest } else { rest * self.ratio.powi((d + 1 - known) as i32) }
    }

    /// Smallest D beyond which there is no more than the tolerance.
    fn scatterings(&self, tolerance: f64) -> u32 {
        (0..u32::from(u16::MAX)).find(|d| self.beyond(*d) <= tolerance).unwrap_or(u32::from(u16::MAX))
    }
}

/// Mean radiance over the crop window by path length, from a part of its pixels and as many light paths.
fn round(cx: Context<'_>, crop: [u32; 4], pass: u64) -> Vec<f64> {
    let plan = cx.plan;
    let mut sums = Sums { crop, scale: 0.0, sums: vec![0.0; plan.settings.max_length as usize + 1] };
    let pixels = f64::from(crop[2]) * f64::from(crop[3]);
    let (mut rays, mut vertices) = (RayCounts::default(), Vec::new());
    sums.scale = 1.0 / pixels;
    for index in 0..plan.light_paths {
        let mut random = Random::new(Family::Pilot, u64::from(index), pass, plan.settings.seed);
        let mut tally = Tally { record: &mut sums, rays: &mut rays, observe: &mut () };
        shoot(cx, plan.keeps_vertices().then_some(&mut vertices), &mut random, &mut tally);
    }
    let cache = LightCache::new(vec![vertices], plan.merge_radius(0));
    let walks = if plan.settings.techniques.gathers() { WALKS } else { 0 };
    sums.scale = 1.0 / f64::from(WALKS);
    for index in 0..walks {
        // A walk's number beyond those of all light paths: the two never share a stream.
        let mut random = Random::new(Family::Pilot, u64::from(index) | 1 << 32, pass, plan.settings.seed);
        let at = random.unit2() * Vec2::new(crop[2] as f32, crop[3] as f32);
        let mut tally = Tally { record: &mut sums, rays: &mut rays, observe: &mut () };
        gather(cx, Vec2::new(crop[0] as f32, crop[1] as f32) + at, 1.0, &cache, &mut random, &mut tally);
    }
    sums.sums
}

/// Sums by length.
struct Sums {
    crop: [u32; 4],
    scale: f64,
    sums: Vec<f64>,
}

impl Sums {
    fn add(&mut self, c: &Contribution) {
        let value = f64::from(c.value.mean());
        if let (Some(sum), true) = (self.sums.get_mut(c.length as usize), value.is_finite()) {
            *sum += value * self.scale;
        }
    }
}

impl Record for Sums {
    fn gathered(&mut self, c: Contribution) {
        self.add(&c);
    }
    fn splatted(&mut self, raster: Vec2, _: &mut Random, c: Contribution) {
        let at = raster - Vec2::new(self.crop[0] as f32, self.crop[1] as f32);
        if at.x >= 0.0 && at.y >= 0.0 && at.x < self.crop[2] as f32 && at.y < self.crop[3] as f32 {
            self.add(&c);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bound_is_met_with_no_term_to_spare() {
        for (q, tolerance, d) in
            [(0.1, 1e-3, 2), (0.1, 1.1e-3, 2), (0.1, 0.9e-3, 3), (0.5, 0.25, 1), (0.9, 1.0, 0), (0.0, 1e-9, 0)]
        {
            assert_eq!(scatterings_by_bound(q, tolerance), d, "{q}, {tolerance}");
        }
    }

    #[test]
    fn a_geometric_tail_is_extrapolated_exactly() {
        let r: f64 = 0.8;
        let all: Vec<_> = (0..60).map(|n| (r.powi(n), if n < 12 { 0.01 * r.powi(n) } else { 1.0 })).collect();
        let tail = Tail::of(all);
        assert_eq!(tail.terms.len(), 12);
        for d in [0, 3, 11, 12, 30] {
            assert!((tail.beyond(d) / r.powi(d as i32 + 1) - 1.0).abs() < 1e-9, "{d}: {}", tail.beyond(d));
        }
        assert_eq!(tail.scatterings(r.powi(20) * 1.001), 19);
    }

    #[test]
    fn nothing_to_see_has_no_tail() {
        let tail = Tail::of(vec![(0.0, 0.0); 8]);
        assert_eq!((tail.scatterings(1e-3), tail.beyond(0)), (0, 0.0));
        assert_eq!(Tail::of(vec![]).scatterings(1e-3), 0);
    }
}
