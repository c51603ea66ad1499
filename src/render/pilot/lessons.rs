//! What the rounds of a pilot have taught so far, and what was decided on the strength of it.

use super::choice::{self, Chosen};
use super::survey::Beside;
use super::{CHOICE, Decisions, JOB, JUDGES, Pilot, part_by_chance};
use crate::scene::Scene;
use crate::scene::emitter::guide::Guide;
use crate::transport::incident::{Incident, Lesson};
use crate::transport::settings::Settings;
use std::sync::Arc;

pub(super) struct Lessons<'a> {
    scene: &'a Scene,
    asked: Settings,
    pub(super) decisions: Decisions,
    guide: Guide,
    /// Where light was found to arrive.
    incident: Vec<Lesson>,
    /// Part of the light paths that were of use, by round.
    of_use: Vec<f64>,
    /// What light paths bring and take in what was chosen.
    beside: Beside,
}

impl<'a> Lessons<'a> {
    /// Of no round, with what is decided without any.
    pub(super) fn new(scene: &'a Scene, decisions: Decisions) -> Self {
        let asked = decisions.settings.clone();
        Self {
            scene,
            asked,
            decisions,
            guide: Guide::new(&scene.lights),
            incident: vec![],
            of_use: vec![],
            beside: Beside::default(),
        }
    }

    pub(super) fn shoots(&self) -> bool {
        self.decisions.settings.techniques.shoots()
    }

    pub(super) fn still_learns(&self) -> bool {
        still_learns(&self.of_use)
    }

    /// Light paths of a round that should have `wanted`: where they are few, gathering walks are many, and half of a pass is enough.
    pub(super) fn paths(&self, pilot: &Pilot<'_>, wanted: u32) -> u32 {
        let pass = pilot.part(&pilot.plan(&self.decisions));
        wanted.min(pass / 2).max(JOB)
    }

    /// Chooses among all that was asked for, by what is known; `paths` light paths judge, or fewer.
    pub(super) fn choose(&mut self, pilot: &Pilot<'_>, paths: u32, chosen: Chosen) {
        let all = Decisions { settings: self.asked.clone(), ..self.decisions.clone() };
        let best = choice::choose(pilot, &all, paths.min(JUDGES), chosen);
        self.decisions = Decisions { settings: best.settings, first_seen: best.first_seen, ..all };
        self.beside = Beside { noise: best.noise_of_splats, cost: best.costs[1] / best.costs[0] };
    }

    /// Gives more walks to pixels where they vary more.
    pub(super) fn survey(&mut self, pilot: &Pilot<'_>) {
        self.decisions.settings.samples = Arc::new(pilot.survey(&self.decisions, self.beside));
    }

    /// What is decided in the end: nothing about light paths where none are shot.
    pub(super) fn decided(self) -> Decisions {
        let mut decided = if self.shoots() {
            self.decisions
        } else {
            let Decisions { settings, first_seen, incident, .. } = self.decisions;
            Decisions { settings, first_seen, incident, ..Decisions::nothing(&self.asked) }
        };
        decided.settings.guided_gathering = decided.incident.is_some();
        decided
    }

    /// Runs a round and learns from it: where light paths should start, and where gathering walks go if they are to go anywhere.
    pub(super) fn learn(&mut self, pilot: &mut Pilot<'_>, (round, paths): (u32, u32), goes: bool) {
        let found = pilot.round(&self.decisions, (round, paths), goes);
        let t = self.decisions.settings.techniques;
        if t.connect {
            self.decisions.vertices_per_path = found.vertices as f64 / f64::from(paths);
        }
        if t.merge {
            self.decisions.by_chance = part_by_chance(found.crowds.usual().into()) as f32;
            self.decisions.crowds = Arc::new(found.crowds);
        }
        if self.asked.guided && t.shoots() {
            self.of_use.push(found.starts.len() as f64 / f64::from(paths));
            found.starts.iter().for_each(|(start, value)| self.guide.learn(start, *value));
            self.guide = self.guide.refined(&self.scene.lights);
            self.decisions.guide = self.guide.clone();
        }
        if goes {
            self.incident.extend(found.incident);
            if round >= CHOICE {
                self.decisions.incident = Some(Arc::new(Incident::learned(&self.incident)));
            }
        }
    }
}

/// Is guided emission still on its way, by the parts of light paths that were of use in the rounds so far? Where few find what is
/// seen, as of a small sun over a pool, it gets on slowly and not in every round, and more is to be gained than where many do.
fn still_learns(of_use: &[f64]) -> bool {
    let Some(now) = of_use.last() else { return false };
    let (growth, rounds) = if *now < 0.25 { (1.1, 2) } else { (1.4, 1) };
    of_use.windows(2).rev().take(rounds).any(|w| w[1] > growth * w[0])
}

#[cfg(test)]
mod tests {
    use super::still_learns;

    #[test]
    fn learning_ends_when_it_gets_nowhere() {
        assert!(!still_learns(&[]) && !still_learns(&[0.1]));
        // A pool: one slow round is not the end, two are.
        assert!(still_learns(&[0.04, 0.05]) && still_learns(&[0.04, 0.10, 0.10]) && !still_learns(&[0.04, 0.10, 0.10, 0.10]));
        // Where many light paths are of use, a little more of them is not worth a round.
        assert!(still_learns(&[0.2, 0.4]) && !still_learns(&[0.2, 0.4, 0.5]) && !still_learns(&[0.95, 0.99]));
    }
}
