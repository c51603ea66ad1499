//! The choice of techniques: what each join is worth for this picture, against what it costs.
//!
//! The noise that a pass of a candidate would have ([`super::noise`]), relative to the picture and summed over it as relMSE counts it,
//! times the cost of a pass is the error at equal time. Costs are counts of operations times fixed weights ([`Costs`]), so that the
//! choice is a function of scene, settings and seed alone.

use super::branching::LEAST;
use super::chains::{ChainNoise, SAMPLES};
use super::evidence::{Evidence, Findings};
use super::noise::{LOST, Mixture};
use super::{Decisions, Pilot};
use crate::transport::first_seen::FirstSeen;
use crate::transport::mis::Heuristic;
use crate::transport::settings::{Plan, Settings, Techniques};
use std::sync::Arc;

/// Light paths per pixel that are considered.
const LIGHT_PATHS: [f64; 6] = [0.0, 0.25, 0.5, 1.0, 2.0, 4.0];
/// Merging blurs, so it must win by this factor.
const MERGE_MUST_WIN: f64 = 1.1;
/// Everything is on unless doing without wins by this factor: the estimate has noise itself.
const LESS_MUST_WIN: f64 = 1.02;
/// Without light paths a pilot learns nothing more, so that must win by this factor while there is something to learn.
const NO_LESSONS_MUST_WIN: f64 = 2.0;
/// Guided gathering must win by this factor.
const GUIDE_MUST_WIN: f64 = 1.1;
/// Cost of operations, in units of a step of a gathering walk: user time of passes of five scenes with and
/// without each join, divided by its counts. Only ratios matter, and only as far as they change the order of candidates.
pub(super) struct Costs {
    pub(super) gather_walk: f64,
    pub(super) gather_step: f64,
    pub(super) next_event: f64,
    connect: f64,
    merge: f64,
    shoot_walk: f64,
    shoot_step: f64,
    splat: f64,
    keep: f64,
    branch: f64,
    /// A ray from the eye that only chains ask for.
    look: f64,
    /// Learned directions of a vertex, for either walker.
    directions: f64,
}
pub(super) const COSTS: Costs = Costs {
    gather_walk: 1.7,
    gather_step: 1.0,
    next_event: 1.1,
    connect: 2.6,
    merge: 1.0,
    shoot_walk: 2.8,
    shoot_step: 1.0,
    splat: 0.8,
    keep: 0.4,
    branch: 1.2,
    look: 0.7,
    directions: 1.0,
};

/// What techniques are chosen for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Chosen {
    /// Rounds that go on learning: what light paths could be worth is not known yet.
    ForRounds,
    ForRender,
}

/// Numbers of joins that could be used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Candidate {
    /// Per pixel.
    pub(super) light_paths: f64,
    pub(super) next_event: bool,
    pub(super) connect: bool,
    pub(super) merge: bool,
}

impl Candidate {
    fn all(settings: &Settings, pixels: u32, chosen: Chosen) -> Vec<Self> {
        let allowed = settings.techniques;
        let given = settings.light_paths.map(|n| vec![f64::from(n) / f64::from(pixels)]);
        let either = |allowed: bool| if allowed { &[true, false][..] } else { &[false][..] };
        let mut all = vec![];
        for light_paths in given.unwrap_or_else(|| LIGHT_PATHS.to_vec()) {
            for &next_event in either(allowed.next_event) {
                for &connect in either(allowed.connect && light_paths > 0.0) {
                    let merges = match chosen {
                        _ if !allowed.merge || light_paths == 0.0 => &[false][..],
                        Chosen::ForRounds => &[true],
                        Chosen::ForRender => &[true, false],
                    };
                    all.extend(merges.iter().map(|&merge| Self { light_paths, next_event, connect, merge }));
                }
            }
        }
        all
    }

    /// What a plan does, for so many pixels.
    fn of(plan: &Plan, pixels: u32) -> Self {
        let t = plan.settings.techniques;
        let light_paths = f64::from(plan.light_paths) / f64::from(pixels);
        Self { light_paths, next_event: t.next_event, connect: t.connect, merge: t.merge }
    }

    /// Of gathering and of shooting, per pixel.
    fn costs(&self, found: &Findings, mixture: &Mixture) -> [f64; 2] {
        let n = mixture.times(self.light_paths);
        let merges = mixture.shrunk * (n * found.merges.clear + mixture.by_chance(n) * found.merges.by_chance);
        let (eye, light) = (&found.eye, &found.light);
        let c = COSTS;
        let on = |b: bool, cost: f64| if b { cost } else { 0.0 };
        let joins = on(self.next_event, c.next_event * eye.next_events) + on(self.connect, c.connect * eye.ends);
        let at_light = c.splat + on(self.connect, c.keep);
        let gathering = c.gather_walk + c.gather_step * eye.steps + joins + on(self.merge, c.merge * merges);
        [gathering, self.light_paths * (c.shoot_walk + c.shoot_step * light.steps + at_light * light.ends)]
    }

    fn settings(&self, settings: &Settings, pixels: u32) -> Settings {
        let shoots = self.light_paths > 0.0;
        let techniques = Techniques {
            hit: settings.techniques.hit,
            next_event: self.next_event,
            splat: settings.techniques.splat && shoots,
            connect: self.connect,
            merge: self.merge,
        };
        let light_paths = shoots.then(|| ((f64::from(pixels) * self.light_paths).round() as u32).max(1));
        Settings { techniques, light_paths, ..settings.clone() }
    }
}

/// What was chosen.
pub(super) struct Best {
    pub(super) settings: Settings,
    /// What pixels see first.
    pub(super) first_seen: Arc<FirstSeen>,
    /// Of a pass, the mean over pixels.
    pub(super) noise_of_splats: f64,
    /// Of gathering and of shooting, per pixel.
    pub(super) costs: [f64; 2],
}

/// Whether gathering walks should go where light was found to come from, by at most so many walks of either kind that do.
pub(super) fn goes(pilot: &Pilot<'_>, decisions: &Decisions, most: u32) -> bool {
    let mut plan = pilot.plan(decisions);
    plan.settings.heuristic = Heuristic::Balance;
    let (candidate, mixture) = (Candidate::of(&plan, pilot.pixels()), Mixture::of(&plan, pilot.pixels()));
    // Gathering walks are more than light paths where those are few.
    let part = if plan.light_paths > 0 { candidate.light_paths.clamp(0.125, 1.0) } else { 1.0 };
    let paths = (f64::from(most) * part) as u32;
    let found = Findings::collected(pilot, plan, &pilot.picture.dark_squares(), (paths, false));
    let noise = |unguided: bool| {
        let one = |e: &Evidence| e.square / if unguided { e.unguided.max(LOST) } else { 1.0 };
        candidate.noisy(&found.evidence).map(one).sum::<f64>()
    };
    let cost: f64 = candidate.costs(&found, &mixture).iter().sum();
    let more = COSTS.directions * (found.eye.ends + candidate.light_paths * found.light.ends);
    noise(false) * (cost + more) * GUIDE_MUST_WIN < noise(true) * cost
}

/// The best candidate, judged on `paths` light paths and as large a part of the pixels.
pub(super) fn choose(pilot: &Pilot<'_>, decisions: &Decisions, paths: u32, chosen: Chosen) -> Best {
    let mut plan = pilot.plan(decisions);
    plan.settings.heuristic = Heuristic::Balance;
    let dark_squares = pilot.picture.dark_squares();
    let mixture = Mixture::of(&plan, pilot.pixels());
    let follows = pilot.settings.follows_chains();
    // No round has samples of chains alone, so none needs to know where they would be.
    let looks = follows && chosen == Chosen::ForRender;
    let first_seen =
        if looks { FirstSeen::looked_at(pilot.scene, pilot.crop, pilot.settings.seed) } else { FirstSeen::default() };
    let chains = if looks { ChainNoise::measured(pilot, &plan, &first_seen, &dark_squares) } else { ChainNoise::default() };
    if follows {
        plan.settings.faint = LEAST;
    }
    let found = Findings::collected(pilot, plan, &dark_squares, (paths, true));
    let branchings = found.branchings(pilot.settings.faint);
    let ways: Vec<_> = branchings.iter().flat_map(|b| SAMPLES.map(|samples| (b, samples))).collect();
    let pixels = pilot.pixels();
    let candidates = Candidate::all(pilot.settings, pixels, chosen);
    let judged = candidates.iter().flat_map(|c| {
        let blurs = if c.merge { MERGE_MUST_WIN } else { 1.0 };
        let early = if chosen == Chosen::ForRounds && c.light_paths == 0.0 { NO_LESSONS_MUST_WIN } else { 1.0 };
        let lacks = if c.next_event && c.connect { 1.0 } else { LESS_MUST_WIN };
        let (noise, cost) = (c.noise(&found, &mixture), c.costs(&found, &mixture).iter().sum::<f64>());
        ways.iter().map(move |(b, samples)| {
            let noise = noise + chains.noise(b, *samples);
            let cost = cost + COSTS.branch * b.rays + chains.cost(*samples, COSTS.look, COSTS.branch);
            (noise * cost * blurs * lacks * early, c, (b.faint, *samples))
        })
    });
    let first_seen = Arc::new(first_seen);
    match judged.min_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((_, best, (faint, chain_samples))) => Best {
            settings: Settings { faint, chain_samples, ..best.settings(pilot.settings, pixels) },
            first_seen,
            noise_of_splats: best.noise_of_splats(&found, &mixture) / f64::from(pixels),
            costs: best.costs(&found, &mixture),
        },
        None => Best { settings: pilot.settings.clone(), first_seen, noise_of_splats: 0.0, costs: [1.0, 0.0] },
    }
}
