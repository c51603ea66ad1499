//! Guided emission: which light, and where to from it, as learned from what light paths contributed.
//!
//! Most of what a lamp emits never reaches a picture; a caustic is fed by the small part that meets the
//! glass. A guide holds, for each emitter that matters, a density on the unit square
//! ([`Quadtree`]) that stands for what is free in its emission:
//!
//! | emitter | the square is | unguided density |
//! |---|---|---|
//! | area | direction of the target ([`warp::sphere_charts`], `aim`) | cosθ/π around the normal |
//! | sphere, from outside | direction of the target; the position is uniform across the direction of travel, or in the target's view | 1/4π |
//! | point, spot | direction of travel | the emitter's own |
//! | parallel, sky | place on the disk across the direction of travel | 1/πR² |
//!
//! and the probability of choosing each emitter. Where there are more than 64, a light path or
//! two from each would teach nothing but noise: emitters that are close to each other and alike (nodes of
//! the tree of next events) then learn as one, and share what falls to them as without a guide. The unguided density is always mixed in
//! ([`UNGUIDED`]), so that no path is lost and no contribution grows by more than its inverse. What the
//! guide learns is decided by the caller (a pilot); the densities it changes are those of emission
//! alone, so every weight sees the change through [`super::EmissionDensity`] and the measurement stays
//! unbiased whatever was learned. Compare [Vorba 2014], who guide both walkers.

use super::aim::Aim;
use super::area::Area;
use super::choice::Choice;
use super::{Emission, Emitter, Lights};
use crate::math::Frame;
use crate::math::distribution::Discrete;
use crate::math::quadtree::{MEMORY, Quadtree};
use crate::math::warp;
use glam::{Vec2, Vec3};
use std::f32::consts::PI;
use std::sync::Arc;

/// Share of the unguided density in every guided one.
pub const UNGUIDED: f32 = 0.2;
/// Share of the unguided probability in the choice of the emitter.
const UNGUIDED_CHOICE: f64 = 0.2;
/// Relative difference between distances that are about the same.
const SAME_DISTANCE: f32 = 0.1;
/// Up to so many emitters learn each for itself, more in so many groups; the most probable groups have a
/// square of their own.
const MOST_SQUARES: usize = 64;

/// Learned densities of emission; the default guides nothing.
#[derive(Clone, Debug, Default)]
pub struct Guide {
    groups: Arc<Groups>,
    /// By group.
    squares: Vec<Option<Quadtree>>,
    /// By group, Σ over light paths of (value)² times the probability of the group.
    moments: Vec<f64>,
    /// By group, the same sum with each path times d and d², d the length of its first edge.
    lengths: Vec<[f64; 2]>,
    /// By group, the distance from its lamps of what paths are aimed at, m; infinite: they have a direction and no target.
    distances: Vec<f32>,
    /// Among emitters.
    choice: Option<Discrete>,
}

/// Which emitters learn together.
#[derive(Debug, Default)]
struct Groups {
    /// Group of each emitter, and its share of that group's probability: the same with and without a
    /// guide. Nothing for emitters that are never chosen.
    of: Vec<Option<(u32, f32)>>,
}

impl Groups {
    /// With the number of groups and the probability of each.
    fn new(lights: &Lights) -> (Self, Vec<f64>) {
        let infos = lights.infos();
        let (mut of, mut probs) = (vec![None; infos.len()], vec![]);
        for members in lights.groups(MOST_SQUARES) {
            let prob: f64 = members.iter().map(|i| f64::from(infos[*i].prob_emission)).sum();
            for i in members {
                of[i] = Some((probs.len() as u32, (f64::from(infos[i].prob_emission) / prob) as f32));
            }
            probs.push(prob);
        }
        (Self { of }, probs)
    }
}

/// Where in the guide's squares a light path started, and how probable that was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Start {
    /// Index of the emitter.
    pub emitter: usize,
    /// Probability of its choice.
    pub prob: f32,
    /// Point of its square.
    pub at: Vec2,
    /// Density of that point per unit area of the square.
    pub p: f32,
    /// Length of its first edge, m.
    pub distance: f32,
}

/// What a guide draws.
pub(super) enum Draw<T> {
    /// Random numbers for what is drawn without a guide.
    Own(Vec2),
    /// What was learned.
    Learned(T),
}

impl Guide {
    /// A guide that has learned nothing yet and can learn of the emitters of `lights`.
    pub fn new(lights: &Lights) -> Self {
        let (groups, probs) = Groups::new(lights);
        let mut order: Vec<usize> = (0..probs.len()).collect();
        order.sort_by(|a, b| probs[*b].total_cmp(&probs[*a]).then(a.cmp(b)));
        let mut squares = vec![None; probs.len()];
        order.into_iter().take(MOST_SQUARES).for_each(|group| squares[group] = Some(Quadtree::default()));
        let n = probs.len();
        let (moments, lengths, distances) = (vec![0.0; n], vec![[0.0; 2]; n], vec![f32::INFINITY; n]);
        Self { groups: Arc::new(groups), squares, moments, lengths, distances, choice: None }
    }

    /// A light path that started at `start` contributed `value` (any measure of what it adds to the
    /// noise, non-negative).
    pub fn learn(&mut self, start: &Start, value: f64) {
        let Some((group, share)) = self.group(start.emitter) else { return };
        let square = value * value * f64::from(start.prob / share);
        if !(square > 0.0 && square.is_finite()) {
            return;
        }
        self.moments[group] += square;
        let d = f64::from(start.distance);
        self.lengths[group][0] += square * d;
        self.lengths[group][1] += square * d * d;
        if let Some(tree) = &mut self.squares[group] {
            tree.learn(start.at, square * f64::from(start.p));
        }
    }

    /// The guide that follows from what was learned.
    #[must_use]
    pub fn refined(&self, lights: &Lights) -> Self {
        let total: f64 = self.moments.iter().map(|m| m.sqrt()).sum();
        let choice = if total > 0.0 && total.is_finite() {
            let prob = |(i, info): (usize, &super::EmitterInfo)| {
                let learned = self.group(i).map_or(0.0, |(group, share)| self.moments[group].sqrt() / total * f64::from(share));
                (1.0 - UNGUIDED_CHOICE) * learned + UNGUIDED_CHOICE * f64::from(info.prob_emission)
            };
            Discrete::new(lights.infos().iter().enumerate().map(prob))
        } else {
            None
        };
        let squares = self.squares.iter().map(|s| s.as_ref().map(|tree| tree.refined(0.0))).collect();
        let moments = self.moments.iter().map(|m| MEMORY * m).collect();
        let lengths = self.lengths.iter().map(|sums| sums.map(|m| MEMORY * m)).collect();
        let distances = (0..self.distances.len()).map(|group| self.distance(group)).collect();
        Self { groups: self.groups.clone(), squares, moments, lengths, distances, choice }
    }

    /// Distance at which to aim by what was learned: the one so far if that is about right, since squares know targets at that distance.
    ///
    /// Paths to one target from points a length r apart are r·|1 − d/D| apart at a distance d. The mean square of that is least for
    /// D = Σd²/Σd.
    fn distance(&self, group: usize) -> f32 {
        let [first, second] = self.lengths[group];
        let (now, learned) = (self.distances[group], (second / first) as f32);
        let right = learned.is_nan() || (learned / now - 1.0).abs() < SAME_DISTANCE;
        if right { now } else { learned }
    }

    /// Memory held, in bytes.
    pub fn bytes(&self) -> usize {
        let squares = self.squares.iter().flatten().map(Quadtree::bytes).sum::<usize>();
        squares + size_of_val(&self.squares[..]) + size_of_val(&self.groups.of[..])
    }

    /// The learned choice of the emitter, if there is one.
    #[inline]
    pub(super) fn choice<'a>(&'a self, unguided: &'a Discrete) -> &'a Discrete {
        self.choice.as_ref().unwrap_or(unguided)
    }

    #[inline]
    fn square(&self, emitter: usize) -> Option<&Quadtree> {
        // Without a choice nothing was learned: the squares are uniform, which no emitter is.
        self.choice.as_ref()?;
        self.squares[self.group(emitter)?.0].as_ref()
    }

    /// Group of the emitter and its share of it.
    #[inline]
    fn group(&self, emitter: usize) -> Option<(usize, f32)> {
        let (group, share) = (*self.groups.of.get(emitter)?)?;
        Some((group as usize, share))
    }

    /// A point of the emitter's square, or what to draw from the emitter's own density with.
    #[inline]
    fn draw(&self, emitter: usize, u: Vec2) -> Draw<Vec2> {
        match (self.square(emitter), split(u)) {
            (None, _) => Draw::Own(u),
            (Some(_), (true, u)) => Draw::Own(u),
            (Some(tree), (false, u)) => Draw::Learned(tree.sample(u).0),
        }
    }

    /// A direction in which to go from `emitter`, or to aim.
    #[inline]
    pub(super) fn direction(&self, emitter: usize, u: Vec2) -> Draw<Vec3> {
        match self.draw(emitter, u) {
            Draw::Own(u) => Draw::Own(u),
            Draw::Learned(at) => Draw::Learned(warp::sphere_charts(at)),
        }
    }

    /// Density per steradian of directions of travel, `own` that of the emitter's own sampling; `learned` is the direction that was
    /// learned with the density for one per steradian of it.
    #[inline]
    pub(super) fn direction_density(&self, emitter: usize, own: f32, learned: impl FnOnce() -> (Vec3, f32)) -> f32 {
        match self.square(emitter) {
            None => own,
            Some(tree) => {
                let (w, stretch) = learned();
                let learned = tree.density(warp::sphere_charts_inverse(w)) * warp::SPHERE_UNIFORM_P_W * stretch;
                UNGUIDED * own + (1.0 - UNGUIDED) * learned
            }
        }
    }

    /// Where to aim from a lamp, if there is more to it than a direction.
    #[inline]
    pub(super) fn aim(&self, emitter: usize, area: &Area) -> Option<Aim> {
        let (group, _) = self.group(emitter)?;
        Aim::new(area, self.distances[group])
    }

    /// The direction that was learned of a path from `y` on a lamp along `w`, and the density per steradian of w for one of it.
    #[inline]
    pub(super) fn aimed(&self, emitter: usize, area: &Area, y: Vec3, w: Vec3) -> (Vec3, f32) {
        self.aim(emitter, area).map_or((w, 1.0), |aim| aim.of(y, w))
    }

    /// A place on the unit disk across the direction of travel.
    #[inline]
    pub(super) fn place(&self, emitter: usize, u: Vec2) -> Vec2 {
        match self.draw(emitter, u) {
            Draw::Own(at) | Draw::Learned(at) => warp::disk_concentric(at),
        }
    }

    /// Density of [`Self::place`] relative to the uniform one.
    #[inline]
    pub(super) fn place_density(&self, emitter: usize, disk: Vec2) -> f32 {
        match self.square(emitter) {
            None => 1.0,
            Some(tree) => UNGUIDED + (1.0 - UNGUIDED) * tree.density(warp::disk_concentric_inverse(disk)),
        }
    }
}

impl Lights {
    /// All emitters that emit, each alone if there are at most so many, else the finite ones in groups of
    /// neighbours.
    fn groups(&self, most: usize) -> Vec<Vec<usize>> {
        let lit = (0..self.infos.len()).filter(|i| self.infos[*i].prob_emission > 0.0);
        let mut alone: Vec<Vec<usize>> = lit.map(|i| vec![i]).collect();
        let Some(tree) = self.choice.as_ref().filter(|_| alone.len() > most).and_then(Choice::tree) else { return alone };
        alone.retain(|group| !tree.contains(group[0]));
        let left = most.saturating_sub(alone.len()).max(1);
        alone.extend(tree.groups(left, |i| f64::from(self.infos[i].prob_emission)));
        alone
    }

    /// Where a light path started, as the guide sees it, whose first edge is `distance` long; `None` for what it cannot learn.
    pub fn start(&self, guide: &Guide, e: &Emission, distance: f32) -> Option<Start> {
        let emitter = e.point.emitter.0 as usize;
        let prob = guide.choice(&self.choice.as_ref()?.emission).prob(emitter);
        let (at, p) = match &self.emitters[emitter] {
            Emitter::Area(area) => {
                let (w, stretch) = guide.aimed(emitter, area, e.point.y, e.w);
                (warp::sphere_charts_inverse(w), e.density.p_next * (4.0 * PI) / stretch)
            }
            Emitter::Point(_) | Emitter::Spot(_) => (warp::sphere_charts_inverse(e.w), e.density.p_next * (4.0 * PI)),
            Emitter::Parallel(_) | Emitter::Sky(_) => {
                (warp::disk_concentric_inverse(self.disk(e.w, e.point.y)), e.density.p_next / self.p_across)
            }
            Emitter::Dark => return None,
        };
        Some(Start { emitter, prob, at, p, distance })
    }

    /// Place of `x` on the unit disk across the direction of travel `w`.
    #[inline]
    pub(super) fn disk(&self, w: Vec3, x: Vec3) -> Vec2 {
        let frame = Frame::around(w);
        let v = (x - self.center) * (1.0 / self.radius);
        Vec2::new(v.dot(frame.s), v.dot(frame.t))
    }
}

/// Does `u` fall to the unguided part, and where in its part?
#[inline]
fn split(u: Vec2) -> (bool, Vec2) {
    if u.x < UNGUIDED {
        (true, Vec2::new((u.x / UNGUIDED).min(warp::ONE_MINUS_EPSILON), u.y))
    } else {
        (false, Vec2::new(((u.x - UNGUIDED) / (1.0 - UNGUIDED)).min(warp::ONE_MINUS_EPSILON), u.y))
    }
}
