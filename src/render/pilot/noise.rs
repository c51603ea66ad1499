//! The noise of a pass with other joins than those that found the paths by which it is judged.
//!
//! A mixture of all joins finds paths with density Σ n_τ p_τ; with the balance heuristic each brings
//! the contribution C = f / Σ n_τ p_τ. Other numbers n'_τ of the same joins would have found it with ρ
//! times that density,
//!
//! ```text
//! ρ = Σ_τ r_τ n'_τ / n_τ,     r_τ = n_τ p_τ / Σ n_τ p_τ  (the joins' weights)
//! ```
//!
//! so that the second moment of an estimator with n' is E[Σ C² / ρ], over the same paths
//! [Grittmann 2022, eq. 9]. One mixture judges all candidates, also on paths that they would hardly ever find themselves.
//!
//! The second moment is the variance where each path is found rarely. What every gathering walk finds, as a lamp that lights all a
//! pixel sees, hardly varies at all, and less than chance would have it where the walks of a pixel share a sequence of points. So
//! some pixels have two sets of walks, as renders have them, and the difference of their sums tells what part of those moments is
//! noise ([`Pairs`]).

use super::choice::Candidate;
use super::evidence::{Evidence, Findings, SET};
use super::part_by_chance;
use crate::transport::Technique;
use crate::transport::settings::Plan;

/// Paths that a candidate finds less often than this are as good as lost to it.
pub(super) const LOST: f64 = 1e-5;
/// Part of the second moment that is noise at least: that of a few sets is not better known.
const LEAST_VARIANCE: f64 = 0.02;
/// Times the radiance of its pixel that a contribution may be to count as one of many; what is more is luck, of which sums of a few
/// say nothing.
const REGULAR: f64 = 4.0;
/// Merges have the radius of this pass on an average of some tens.
const USUAL_PASS: u64 = 10;

/// What the paths were found by that judge candidates.
pub(super) struct Mixture {
    /// Per pixel.
    light_paths: f64,
    /// Light vertices within the largest radius of merges.
    usual: f64,
    /// Part of the area in which they are merged by chance.
    by_chance: f64,
    /// Part of the area of merges that is left to a usual pass.
    pub(super) shrunk: f64,
}

impl Mixture {
    pub(super) fn of(plan: &Plan, pixels: u32) -> Self {
        let light_paths = f64::from(plan.light_paths) / f64::from(pixels);
        let shrunk = if plan.merge_radius > 0.0 { (plan.merge_radius(USUAL_PASS) / plan.merge_radius).powi(2) } else { 1.0 };
        Self { light_paths, usual: plan.crowds.usual().into(), by_chance: plan.by_chance.into(), shrunk: shrunk.into() }
    }

    /// How many times its light paths `light_paths` per pixel are.
    pub(super) fn times(&self, light_paths: f64) -> f64 {
        if self.light_paths > 0.0 { light_paths / self.light_paths } else { 0.0 }
    }

    /// How many more merges are met by chance with `n` times the light paths.
    pub(super) fn by_chance(&self, n: f64) -> f64 {
        n * part_by_chance(n * self.usual) / self.by_chance
    }
}

/// What sets of gathering walks add up, two sets in each pixel.
#[derive(Default)]
struct Pairs {
    sums: Vec<f64>,
    squares: f64,
}

impl Pairs {
    fn add(&mut self, walk: u32, value: f64) {
        let set = (walk / SET) as usize;
        // Another set may follow that found nothing.
        self.sums.resize(self.sums.len().max(set.next_multiple_of(2) + 2), 0.0);
        self.sums[set] += value;
        self.squares += value * value;
    }

    /// The variance of sums, as a part of the sum of the squares of what they are made of.
    fn part_of_noise(&self) -> f64 {
        if self.squares == 0.0 {
            return 1.0;
        }
        self.sums.chunks_exact(2).map(|pair| (pair[0] - pair[1]).powi(2)).sum::<f64>() / self.squares
    }
}

impl Candidate {
    /// Of a pass, from what the mixture of all joins found.
    pub(super) fn noise(&self, found: &Findings, mixture: &Mixture) -> f64 {
        let mut pairs = Pairs::default();
        for e in self.noisy(&found.sets) {
            let (numbers, rho) = self.numbers(e, mixture);
            let value = e.value / rho;
            if e.technique.gathers_alone() && numbers[e.technique as usize] > 0.0 && value <= REGULAR {
                pairs.add(e.walk, value);
            }
        }
        // The second moment of all, and of what gathering walks find each for itself and regularly.
        let (mut all, mut regular) = (0.0, 0.0);
        for e in self.noisy(&found.evidence) {
            let (numbers, rho) = self.numbers(e, mixture);
            all += e.square / rho;
            if e.value <= REGULAR * rho {
                let alone = Technique::ALL.into_iter().filter(|t| t.gathers_alone()).map(|t| t as usize);
                regular += e.square / rho * alone.map(|t| e.shares[t] * numbers[t]).sum::<f64>() / rho;
            }
        }
        (all - regular * (1.0 - pairs.part_of_noise())).max(LEAST_VARIANCE * all)
    }

    /// That of splats among it.
    pub(super) fn noise_of_splats(&self, found: &Findings, mixture: &Mixture) -> f64 {
        let of = |e: &Evidence| {
            let (numbers, rho) = self.numbers(e, mixture);
            let splats = Technique::Splat as usize;
            e.square / rho * e.shares[splats] * numbers[splats] / rho
        };
        self.noisy(&found.evidence).map(of).sum()
    }

    /// How often each join finds a path for one of the mixture's, and all of them together.
    fn numbers(&self, e: &Evidence, mixture: &Mixture) -> ([f64; Technique::ALL.len()], f64) {
        let on = |b: bool| if b { 1.0 } else { 0.0 };
        let n = mixture.times(self.light_paths);
        // Where merges find a crowd at once, more light paths make it larger, not more often found.
        let chance = mixture.by_chance(n);
        let by_chance = chance * (1.0 + e.crowd) / (1.0 + chance * e.crowd);
        let merges = on(self.merge) * mixture.shrunk * (n * (1.0 - e.by_chance) + by_chance * e.by_chance);
        let numbers = Technique::ALL.map(|technique| match technique {
            Technique::Hit => 1.0,
            Technique::NextEvent => on(self.next_event),
            Technique::Connect => on(self.connect),
            Technique::Splat => n,
            Technique::Merge => merges,
        });
        let rho = e.shares.iter().zip(numbers).map(|(r, n)| r * n).sum::<f64>();
        (numbers, rho.max(LOST))
    }

    /// What brings noise: not delta lights seen by next events; what chains vary is measured apart.
    pub(super) fn noisy<'e>(&self, evidence: &'e [Evidence]) -> impl Iterator<Item = &'e Evidence> {
        let next_event = self.next_event;
        evidence.iter().filter(move |e| e.chain.is_none() && !(e.steady && next_event))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    use crate::math::random::Family;

    #[test]
    fn moments_of_what_never_varies_do_not_count() {
        let mixture = Mixture { light_paths: 1.0, usual: 1.0, by_chance: 1.0, shrunk: 0.5 };
        let of = |light_paths, next_event, merge| Candidate { light_paths, next_event, connect: false, merge };
        let many =
            |n, technique, square, value| (0..n).map(move |walk| Evidence { value, walk, ..Evidence::of(technique, square) });
        // 1000 shadow rays that find all the same, and 500 of luck.
        let steady = |value| many(1000, Technique::NextEvent, 1.0, value).chain(many(100, Technique::Splat, 5.0, 5.0)).collect();
        let sets = |value| many(20 * SET, Technique::NextEvent, 1.0, value).collect();
        let findings = Findings::of(steady(1.0), sets(1.0));
        let noise = |c: Candidate| c.noise(&findings, &mixture);
        assert!((noise(of(1.0, true, false)) - 500.0).abs() < 1e-6 && (noise(of(2.0, true, false)) - 250.0).abs() < 1e-6);
        assert!(noise(of(1.0, false, false)) > 1e6, "without shadow rays nothing finds it");
        // What is many times brighter than its pixel is luck, whatever the sums of a few sets are.
        let bright = Findings::of(steady(2.0 * REGULAR), sets(2.0 * REGULAR));
        assert!((of(1.0, true, false).noise(&bright, &mixture) - 1500.0).abs() < 1e-6);
        // Merges of a usual pass are fewer than those of the first.
        let merged = Findings::of(many(100, Technique::Merge, 1.0, 1.0).collect(), vec![]);
        let noise = |c: Candidate| c.noise(&merged, &mixture);
        assert!((noise(of(1.0, true, true)) - 200.0).abs() < 1e-6 && (noise(of(4.0, true, true)) - 50.0).abs() < 1e-6);
    }

    #[test]
    fn what_every_set_finds_is_no_noise_and_what_luck_finds_is() {
        let of = |value: &mut dyn FnMut() -> f64| {
            let mut pairs = Pairs::default();
            (0..2000 * SET).for_each(|walk| pairs.add(walk, value()));
            pairs.part_of_noise()
        };
        assert_eq!(Pairs::default().part_of_noise(), 1.0);
        assert!(of(&mut || 0.7) < 1e-12);
        let mut random = Random::new(Family::Other, 0, 0, 4);
        let rare = of(&mut || if random.unit() < 0.01 { 1.0 } else { 0.0 });
        assert!((rare - 1.0).abs() < 0.2, "{rare}");
        // Uniform in [0, 1): variance 1/12 of a second moment of 1/3.
        let uniform = of(&mut || random.unit().into());
        assert!((uniform - 0.25).abs() < 0.05, "{uniform}");
        // The second set of a pixel found nothing, nor did the first of another.
        let mut pairs = Pairs::default();
        pairs.add(0, 1.0);
        pairs.add(3 * SET, 1.0);
        assert!((pairs.part_of_noise() - 1.0).abs() < 1e-12);
    }
}
