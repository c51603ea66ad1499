//! Where a pilot's walks went, and what was found that way: lessons for [guided gathering](crate::transport::incident).
//!
//! A path that was found lights each of its vertices from the direction of the next one towards the lamp, whichever
//! walker made it. So what a path adds to the picture, relative to its pixel, is a lesson at all of them.

use crate::scene::emitter::Emission;
use crate::scene::{Scene, Surface};
use crate::transport::incident::Lesson;
use crate::transport::vertex::Scatter;
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

/// "No step."
pub(super) const NONE: u32 = u32::MAX;

/// A vertex of a walk with the direction in which its path goes on towards the lamp.
#[derive(Clone, Copy, Debug)]
struct Step {
    p: Vec3,
    n: Vec3,
    w: Vec3,
    /// The step that is on all paths this one is on.
    before: u32,
    /// Part of the light that other joins do not find more easily.
    part: f32,
}

/// Steps of many walks, one after another.
#[derive(Clone, Debug, Default)]
pub(super) struct Trail {
    steps: Vec<Step>,
}

/// What lies between a vertex of a light path and the lamp.
#[derive(Clone, Copy, Debug)]
enum Before {
    /// Nothing: the lamp, with the direction in which its light travels if that is one for all.
    Lamp(Option<Vec3>),
    /// Dirac events, and the lamp if `lamp`, which cannot be hit if `delta`.
    Dirac { delta: bool, lamp: bool },
    /// Something that gathering can be joined to.
    Other,
}

/// Follows a walk.
pub(super) struct Tracker<'a> {
    scene: &'a Scene,
    next_event: bool,
    on: bool,
    pub(super) trail: Trail,
    /// The last step of the walk.
    pub(super) last: u32,
    light: Option<Emission>,
    before: Before,
    surface: Option<Surface>,
    from: Vec3,
}

impl<'a> Tracker<'a> {
    /// `next_event`: lamps are also found by next events; `on`: someone wants to learn from it.
    pub(super) fn new(scene: &'a Scene, next_event: bool, on: bool) -> Self {
        let (trail, before) = (Trail::default(), Before::Other);
        Self { scene, next_event, on, trail, last: NONE, light: None, before, surface: None, from: Vec3::ZERO }
    }

    pub(super) fn started(&mut self, from: Vec3, light: Option<&Emission>) {
        self.last = NONE;
        self.from = from;
        self.light = light.copied();
        self.surface = None;
        self.before = Before::Lamp(light.filter(|e| e.infinite).map(|e| e.w));
    }

    pub(super) fn arrived(&mut self, surface: &Surface) {
        if !self.on {
            return;
        }
        self.surface = Some(*surface);
        let Some(light) = self.light else { return };
        let p = surface.p;
        let w = if let Before::Lamp(Some(w)) = self.before { -w } else { (self.from - p).normalize_or_zero() };
        self.from = p;
        if self.scene.materials.is_guided(surface.material) {
            self.push(surface, w, self.part(&light, surface, w));
        }
    }

    pub(super) fn scattered(&mut self, s: &Scatter) {
        let Some(surface) = self.surface else { return };
        match self.light {
            None if !s.delta && self.scene.materials.is_guided(surface.material) => self.push(&surface, s.w_next, 1.0),
            None => {}
            Some(light) => {
                self.before = match self.before {
                    _ if !s.delta => Before::Other,
                    Before::Lamp(_) => Before::Dirac { delta: light.delta, lamp: true },
                    Before::Dirac { .. } => self.before,
                    Before::Other => Before::Dirac { delta: false, lamp: false },
                }
            }
        }
    }

    /// Part of the light along `w` that gathering itself finds more easily by going there than by other joins.
    fn part(&self, light: &Emission, surface: &Surface, w: Vec3) -> f32 {
        match self.before {
            Before::Other => 1.0,
            Before::Dirac { delta, lamp } => f32::from(u8::from(!(delta && lamp))),
            Before::Lamp(_) if light.delta => 0.0,
            Before::Lamp(_) if !self.next_event => 1.0,
            Before::Lamp(_) => {
                let nu = self.scene.lights.density_next_event(&self.scene.geometry, surface.p, &light.point, w);
                let per_area = if light.infinite {
                    1.0
                } else {
                    light.point.n_g.dot(w).abs() / (light.point.y - surface.p).length_squared().max(1e-30)
                };
                // As if it were diffuse.
                let g = w.dot(surface.n_g).abs() * FRAC_1_PI * per_area;
                if g > 0.0 { g / (g + nu) } else { 0.0 }
            }
        }
    }

    fn push(&mut self, surface: &Surface, w: Vec3, part: f32) {
        let n = surface.n_g * w.dot(surface.n_g).signum();
        self.trail.steps.push(Step { p: surface.p, n, w, before: self.last, part });
        self.last = (self.trail.steps.len() - 1) as u32;
    }
}

impl Trail {
    /// Adds the steps of another trail; what to add to its numbers.
    pub(super) fn append(&mut self, other: Self) -> u32 {
        let offset = self.steps.len() as u32;
        self.steps.extend(other.steps.into_iter().map(|s| Step { before: shifted(s.before, offset), ..s }));
        offset
    }

    /// What is learned from paths, each with its last step and what it added to the picture.
    pub(super) fn lessons(&self, found: impl Iterator<Item = (u32, f64)>) -> Vec<Lesson> {
        let mut values = vec![0.0f64; self.steps.len()];
        for (step, value) in found.filter(|(step, _)| *step != NONE) {
            values[step as usize] += value;
        }
        let mut lessons = vec![];
        for (i, s) in self.steps.iter().enumerate().rev() {
            let value = values[i];
            if s.before != NONE {
                values[s.before as usize] += value;
            }
            let value = (value * f64::from(s.part)) as f32;
            if value > 0.0 {
                lessons.push(Lesson { p: s.p, n: s.n, w: s.w, value });
            }
        }
        lessons
    }
}

/// The number of a step in a trail that was appended.
pub(super) fn shifted(step: u32, offset: u32) -> u32 {
    if step == NONE { NONE } else { step + offset }
}
