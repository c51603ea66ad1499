//! What is measured before a render starts: how many light vertices a light path leaves, where light
//! paths should start, and how far apart vertices may be to be merged.
//!
//! The pilot is a small bidirectional render of the same measurement: some of the pixels gather, a
//! proportional number of light paths is shot, in rounds that double, and some more while it still learns. After each round the guide of
//! emission is refined by what each light path added to the noise of the image, relative to the image
//! (as relMSE counts it): the squares of its weighted splats and connections. What the pilot decides
//! enters weights and densities and must not depend on the samples that are weighted with it; it
//! draws from its own family of random numbers and sums in a fixed order, so it is a function of
//! scene, settings and seed alone, the same for all shards of a render.

mod branching;
mod chains;
mod choice;
mod evidence;
mod footprint;
mod lessons;
mod noise;
mod picture;
mod round;
mod survey;
mod trail;

use crate::math::Random;
use crate::scene::Scene;
use crate::scene::emitter::guide::Guide;
use crate::transport::crowd::Crowds;
use crate::transport::first_seen::FirstSeen;
use crate::transport::incident::Incident;
use crate::transport::sample_map::SampleMap;
use crate::transport::settings::{Coupling, Plan, Settings, Techniques};
use choice::Chosen;
use glam::Vec2;
use lessons::Lessons;
use picture::Coarse;
use std::sync::Arc;

/// Light paths of a job.
const JOB: u32 = 1024;
/// Rounds, each of twice the paths of the one before.
const ROUNDS: u32 = 6;
/// At most so many more follow, as large as the last, as long as guided emission is still on its way.
const MORE_ROUNDS: u32 = 8;
/// Least and most light paths of the last round.
const LAST_ROUND: std::ops::RangeInclusive<u32> = 4096..=65_536;
/// A gathering walk that comes to a merge by chance finds so many light vertices, not more: by then the noise is the walk's, and each
/// costs time.
const FEW: f64 = 3.0;
/// The round before which techniques are chosen for the first time.
const CHOICE: u32 = 3;
/// Light paths that judge techniques, at most.
const JUDGES: u32 = 8192;

/// What a pilot decides.
#[derive(Clone, Debug)]
pub struct Decisions {
    /// What is asked for, with what was left to the pilot filled in.
    pub settings: Settings,
    /// Mean number of light vertices per light path; 0 where connections are off.
    pub vertices_per_path: f64,
    /// Radius of merges in the first pass; 0 where there is nothing to merge.
    pub merge_radius: f32,
    /// Merges that are met by chance have this part of the area of others.
    pub by_chance: f32,
    /// Where many light vertices are merged at once.
    pub crowds: Arc<Crowds>,
    /// Which pixels have more than one sample of chains.
    pub first_seen: Arc<FirstSeen>,
    /// Where light paths start.
    pub guide: Guide,
    /// Where gathering walks find light, if they are to go there.
    pub incident: Option<Arc<Incident>>,
}

/// Part of its area that a merge has where a gathering walk comes by chance and would find `usual` light vertices.
fn part_by_chance(usual: f64) -> f64 {
    (FEW / usual).min(1.0)
}

/// Runs the pilot of a render of the crop window `crop` (x, y, width, height).
pub fn decide(scene: &Scene, settings: &Settings, crop: [u32; 4]) -> Decisions {
    let decisions = measured(scene, settings, crop);
    if decisions.first_seen.is_unknown() && decisions.settings.chain_samples > 1 {
        let first_seen = Arc::new(FirstSeen::looked_at(scene, crop, settings.seed));
        return Decisions { first_seen, ..decisions };
    }
    decisions
}

/// The same, without a look into every pixel where the choice of techniques had none.
fn measured(scene: &Scene, settings: &Settings, crop: [u32; 4]) -> Decisions {
    let t = settings.techniques;
    let connects = t.connect && settings.connections > 0;
    let nothing = Decisions::nothing(settings);
    // Where gathering walks go is learned where it is asked for, or may be chosen.
    let mut goes =
        settings.coupling == Coupling::All && t.gathers() && (settings.guided_gathering || settings.automatic && settings.guided);
    if !(t.splat || connects || t.merge || goes) || scene.lights.is_empty() {
        return nothing;
    }
    let mut pilot = Pilot::new(scene, settings, crop);
    // The first round only counts, since without a count there are no connections to learn from.
    let merge_radius = if t.merge { settings.merge_radius.unwrap_or_else(|| pilot.merge_radius()) } else { 0.0 };
    let mut so_far = Lessons::new(scene, Decisions { merge_radius, ..nothing });
    let last = (pilot.part(&pilot.plan(&so_far.decisions)) / 2).clamp(*LAST_ROUND.start(), *LAST_ROUND.end());
    let halved = |round: u32| last >> (ROUNDS - 1).saturating_sub(round);
    for round in 0..ROUNDS + MORE_ROUNDS {
        if round >= ROUNDS && !so_far.still_learns() {
            break;
        }
        if round == CHOICE && settings.automatic {
            let paths = so_far.paths(&pilot, halved(round));
            so_far.choose(&pilot, paths, Chosen::ForRounds);
        }
        let paths = if round < CHOICE { halved(round).max(JOB) } else { so_far.paths(&pilot, halved(round)) };
        so_far.learn(&mut pilot, (round, paths), goes);
        let decides = round == CHOICE && goes && !settings.guided_gathering;
        if decides && !choice::goes(&pilot, &so_far.decisions, paths.min(JUDGES / 2)) {
            goes = false;
            so_far.decisions.incident = None;
        }
        if !goes && !so_far.shoots() {
            break;
        }
    }
    if settings.automatic {
        // Once more, knowing what light paths find by now; then a round counts for what is chosen.
        so_far.choose(&pilot, JUDGES, Chosen::ForRender);
        if settings.adaptive {
            so_far.survey(&pilot);
        }
        if so_far.shoots() {
            let paths = so_far.paths(&pilot, last / 4);
            so_far.learn(&mut pilot, (ROUNDS + MORE_ROUNDS, paths), goes);
        }
    }
    so_far.decided()
}

impl Decisions {
    fn nothing(settings: &Settings) -> Self {
        Self {
            settings: settings.clone(),
            vertices_per_path: 0.0,
            merge_radius: 0.0,
            by_chance: 1.0,
            crowds: Arc::default(),
            first_seen: Arc::default(),
            guide: Guide::default(),
            incident: None,
        }
    }

    /// The counts that follow for a render of the crop window `crop`.
    pub fn plan(&self, scene: &Scene, crop: [u32; 4]) -> Plan {
        let pixels = crop[2].saturating_mul(crop[3]);
        let film = scene.film.width.saturating_mul(scene.film.height);
        let samples = Arc::new(SampleMap::clone(&self.settings.samples).over(crop));
        let settings = Settings { merge_radius: Some(self.merge_radius), samples, ..self.settings.clone() };
        let incident = self.incident.clone();
        Plan {
            guide: self.guide.clone(),
            incident,
            by_chance: self.by_chance,
            crowds: self.crowds.clone(),
            first_seen: self.first_seen.clone(),
            ..Plan::new(&settings, pixels, film, self.vertices_per_path)
        }
    }

    /// For the identity of a film: all that enters densities and weights and is not the scene's or the
    /// settings'.
    pub fn bytes(&self) -> Vec<u8> {
        let Techniques { hit, next_event, splat, connect, merge } = self.settings.techniques;
        let mut bytes = [hit, next_event, splat, connect, merge].map(u8::from).to_vec();
        bytes.extend(self.settings.light_paths.unwrap_or(0).to_le_bytes());
        bytes.extend(self.vertices_per_path.to_bits().to_le_bytes());
        bytes.extend(self.merge_radius.to_bits().to_le_bytes());
        bytes.extend(self.by_chance.to_bits().to_le_bytes());
        bytes.extend(self.settings.faint.to_bits().to_le_bytes());
        bytes.extend(self.settings.chain_samples.to_le_bytes());
        bytes.push(u8::from(self.settings.guided_gathering));
        for row in self.settings.samples.rows() {
            // No number of walks is 0, so a row ends with one.
            bytes.extend(row.iter().chain(&[0]));
        }
        bytes
    }
}

struct Pilot<'a> {
    scene: &'a Scene,
    settings: &'a Settings,
    crop: [u32; 4],
    picture: Coarse,
}

impl<'a> Pilot<'a> {
    fn new(scene: &'a Scene, settings: &'a Settings, crop: [u32; 4]) -> Self {
        Self { scene, settings, crop, picture: Coarse::new(crop) }
    }

    fn plan(&self, decisions: &Decisions) -> Plan {
        decisions.plan(self.scene, self.crop)
    }

    /// A point of the `index`-th of `walks` pixels that are evenly spread in the order of rows.
    fn raster(&self, index: u32, walks: u32, random: &mut Random) -> Vec2 {
        self.pixel(index, walks, random) + random.unit2()
    }

    /// The corner of that pixel.
    fn pixel(&self, index: u32, walks: u32, random: &mut Random) -> Vec2 {
        let pixels = f64::from(self.crop[2]) * f64::from(self.crop[3]);
        let pixel = ((f64::from(index) + f64::from(random.unit())) / f64::from(walks) * pixels) as u32;
        let (x, y) = (pixel % self.crop[2], (pixel / self.crop[2]).min(self.crop[3] - 1));
        Vec2::new((self.crop[0] + x) as f32, (self.crop[1] + y) as f32)
    }

    fn pixels(&self) -> u32 {
        self.crop[2].saturating_mul(self.crop[3])
    }

    /// Walks of either kind in a whole pass, of which a round has a part.
    fn part(&self, plan: &Plan) -> u32 {
        if plan.light_paths > 0 { plan.light_paths } else { self.pixels() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn films_of_other_numbers_of_walks_are_others() {
        let of = |rows: &[Vec<u8>]| {
            let samples = Arc::new(SampleMap::from_rows(rows).unwrap_or_default());
            Decisions::nothing(&Settings { samples, ..Settings::default() }).bytes()
        };
        let all = [of(&[]), of(&[vec![1, 2, 3, 4]]), of(&[vec![1, 2], vec![3, 4]]), of(&[vec![1, 2], vec![4, 3]])];
        assert!((0..all.len()).all(|i| !all[..i].contains(&all[i])));
    }
}
