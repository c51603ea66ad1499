//! Residuals of both equations: L − (Lᵉ + τL) and W − (Wᵉ + τ'W) at random points are zero.
//!
//! No image is needed, right or wrong: at each point a walk estimates the left side, and one
//! application of the operator by its definition (a module of its own), followed by walks from
//! where it leads, the right side. L is estimated by gathering along rays that came from the
//! sensor, with any number of scatterings behind them; W by shooting along rays from lights, likewise. Both
//! sides see the same paths, those that the walker can make at all.
//!
//! Lᵉ at each point must agree to rounding. Wᵉ is a Dirac function of direction that no walk can meet:
//! τ'Wᵉ takes its place. What is scattered is drawn many times on each side and compared
//! by Welch's test, point by point, with the precautions of [`super::adjoint`]: paths
//! told apart by the event beside the light (L) or the eye (W), rare contributions not trusted, all
//! probabilities corrected for their number [Šidák 1967]. Left walks end by Russian roulette, right ones never.

use super::adjoint::ALPHA;
use super::blocks::{Kind, Top, narrow};
use super::compare::{Estimate, sides_text, worst};
use super::once;
use crate::local::Equation;
use crate::math::Random;
use crate::math::random::{Family, mix};
use crate::render::Estimator;
use crate::report::agreement::{BlockSeries, agreement};
use crate::report::coverage::{Blind, Coverage};
use crate::scene::emitter::{Emission, EmissionDensity, EmitterPoint, Guide};
use crate::scene::geometry::Ray;
use crate::scene::sensor::SensorRay;
use crate::scene::{EmitterId, Scene, Surface};
use crate::spectrum::Spectrum;
use crate::transport::cache::LightCache;
use crate::transport::settings::{Plan, Settings};
use crate::transport::vertex::{Scatter, Vertex};
use crate::transport::walk::{Context, Join, Observe, Tally, spawn};
use crate::transport::{RayCounts, gather, shoot};
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use std::fmt::Write;
use std::time::{Duration, Instant};

/// Share of the energy that a run without a number of walks wants to test.
const ENOUGH: f64 = 0.95;
/// Longest paths where neither scene nor caller says.
const LONGEST: u32 = 12;

/// How much to do.
#[derive(Clone, Debug)]
pub struct Effort {
    /// Points of each equation.
    pub points: usize,
    /// Independent draws of each side at each point.
    pub draws: usize,
    /// Walks per draw; `None` = as many as it takes, within `time`.
    pub walks: Option<u64>,
    /// Time after which no walks are added.
    pub time: Option<Duration>,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Longest path from the point in edges instead of the scene's.
    pub max_length: Option<u32>,
}

impl Default for Effort {
    fn default() -> Self {
        Self { points: 128, draws: 64, walks: None, time: Some(Duration::from_secs(60)), seed: 0, max_length: None }
    }
}

/// Paths with the same kind of event beside the light (of L) or the eye (of W).
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Class {
    /// D = into all directions, G = into few, S = a Dirac event.
    pub event: char,
    /// Sum over the points of the unknown, by a walk.
    pub left: Estimate,
    /// The same by one application of the operator.
    pub right: Estimate,
    /// Difference over its standard error.
    pub z: f64,
    /// Probability of a difference as large as the largest at any point, where both are equal.
    pub p: f64,
    /// Share of the energy that was tested.
    pub energy_tested: f64,
    /// The tests.
    pub tests: Vec<PointTest>,
}

/// A test of one point, or of several that are too faint or too skew alone.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct PointTest {
    /// Numbers of the points.
    pub points: Vec<usize>,
    /// Means of both sides.
    pub means: (f64, f64),
    /// Welch's statistic.
    pub z: f64,
    /// Two-sided probability of a larger one where both are equal.
    pub p: f64,
}

/// One of the two equations.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Residual {
    /// `L = Lᵉ + τL` or `W = Wᵉ + τ'W`.
    pub equation: &'static str,
    /// Points that were found; fewer than asked where light or view lead nowhere.
    pub points: usize,
    /// Walks per draw and side.
    pub walks: u64,
    /// Points at which a walk finds another Lᵉ than there is.
    pub emission_differs: usize,
    /// Those that carry something.
    pub classes: Vec<Class>,
    /// Share of what is scattered that was tested.
    pub energy_tested: f64,
    /// Corrected over its classes.
    pub p: f64,
}

/// The verdict.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Residuals {
    /// Both equations.
    pub equations: Vec<Residual>,
    /// Independent draws of each side.
    pub draws: usize,
    /// Classes of paths that are on neither side.
    pub left_out: Vec<Blind>,
    /// Corrected over both equations.
    pub p: f64,
    /// p is at least [`ALPHA`] and emission is what it is.
    pub zero: bool,
}

/// Both residuals at random points.
pub fn residuals(scene: &Scene, effort: &Effort) -> Residuals {
    let left_out = Coverage::of(scene).blind.into_iter().filter(|b| b.estimator != "bidirectional").collect();
    let draws = effort.draws.max(2);
    let equations: Vec<Residual> =
        [Equation::Rendering, Equation::Potential].into_iter().map(|e| residual(scene, e, effort, draws)).collect();
    let p = worst(&equations.iter().map(|e| e.p).collect::<Vec<_>>());
    let zero = p >= ALPHA && equations.iter().all(|e| e.emission_differs == 0);
    Residuals { equations, draws, left_out, p, zero }
}

fn residual(scene: &Scene, equation: Equation, effort: &Effort, draws: usize) -> Residual {
    let mut test = Test::new(scene, equation, effort, draws);
    let start = Instant::now();
    // Half of the time is for the other equation.
    let limit = effort.time.unwrap_or(Duration::from_secs(60)) / 2;
    test.grow(effort.walks.unwrap_or(8).max(1));
    let mut found = test.verdict();
    // The next round takes as long as all before it.
    while effort.walks.is_none() && found.energy_tested < ENOUGH && start.elapsed() * 2 <= limit {
        test.grow(test.walks);
        found = test.verdict();
    }
    found
}

/// A point of S × Ω: the surface that is met along a ray.
struct Point {
    ray: Ray,
    surface: Surface,
    /// The ray has no inverse square: it is one of infinitely distant light.
    parallel: bool,
}

/// Sums of one side by `[point][kind][draw]`, and the largest contributions.
struct Side(Vec<[Sums; 3]>);

#[derive(Clone, Default)]
struct Sums {
    draws: Vec<f64>,
    top: Top,
}

struct Test<'a> {
    scene: &'a Scene,
    equation: Equation,
    points: Vec<Point>,
    narrow: Vec<bool>,
    dirac_lights: Vec<EmitterId>,
    /// Left (by a walk) and right (one application, then walks).
    plans: [Plan; 2],
    sides: [Side; 2],
    walks: u64,
}

impl<'a> Test<'a> {
    fn new(scene: &'a Scene, equation: Equation, effort: &Effort, draws: usize) -> Self {
        let estimator = if equation == Equation::Rendering { Estimator::Gather } else { Estimator::Shoot };
        let max_length = effort.max_length.or(scene.integrator.max_depth).unwrap_or(LONGEST).clamp(2, 1000);
        let settings = |max_length, rr_depth| Settings {
            techniques: estimator.techniques(),
            max_length,
            min_length: if equation == Equation::Rendering && rr_depth == 2 { 2 } else { 1 },
            rr_depth,
            light_paths: Some(1),
            seed: effort.seed,
            ..Settings::default()
        };
        let film = &scene.film;
        let pixels = film.crop.map_or(film.width * film.height, |c| c[2] * c[3]);
        let plan = |s: Settings| Plan::new(&s, pixels, film.width * film.height, 1.0);
        let points: Vec<Point> = (0..effort.points as u64).filter_map(|i| point(scene, equation, i, effort.seed)).collect();
        let none = Sums { draws: vec![0.0; draws], top: Top::default() };
        let side = || Side(vec![[(); 3].map(|()| none.clone()); points.len()]);
        let emitters = (0..scene.lights.infos().len() as u32).map(EmitterId);
        Self {
            scene,
            equation,
            narrow: narrow(scene),
            dirac_lights: emitters.filter(|e| scene.lights.is_delta(*e)).collect(),
            plans: [plan(settings(max_length, 2)), plan(settings(max_length - 1, u32::MAX))],
            sides: [side(), side()],
            points,
            walks: 0,
        }
    }

    /// Adds `walks` walks to every draw of both sides.
    fn grow(&mut self, walks: u64) {
        for side in 0..2 {
            let mut points = std::mem::take(&mut self.sides[side].0);
            points.par_iter_mut().enumerate().for_each(|(point, kinds)| {
                let draws = kinds[0].draws.len() as u64;
                let first = self.walks * draws;
                for walk in first..first + draws * walks {
                    let draw = ((walk - first) / walks) as usize;
                    self.walk(side, point, walk, |kind: Kind, value| {
                        let sums = &mut kinds[kind as usize];
                        sums.draws[draw] += value;
                        sums.top.add(value.abs() as f32);
                    });
                }
                kinds.iter_mut().for_each(|k| k.top.join(&Top::default()));
            });
            self.sides[side].0 = points;
        }
        self.walks += walks;
    }

    /// One estimate of a side at a point.
    fn walk(&self, side: usize, index: usize, walk: u64, found: impl FnMut(Kind, f64)) {
        let (scene, point, plan) = (self.scene, &self.points[index], &self.plans[side]);
        // Neither the walkers' own numbers nor those of the other side or equation.
        let stream = 2 * (self.equation as u64) + side as u64;
        let mut random = Random::new(Family::Other, index as u64, walk, mix(plan.settings.seed ^ mix(stream + 1)));
        let random = &mut random;
        let mut beside = Beside { scene, narrow: &self.narrow, last: None, factor: Spectrum::ONE, lamps: true, found };
        if side == 0 {
            self.follow(plan, point.ray, point.parallel, random, &mut beside);
            return;
        }
        let vertex = Vertex::new(scene, point.surface, -point.ray.d);
        let kind = if self.narrow[point.surface.material.0 as usize] { Kind::Narrow } else { Kind::Wide };
        // Lamps by their area, unless few of its points are in a lobe.
        let by_area = self.equation == Equation::Rendering && kind == Kind::Wide;
        let at_once = match self.equation {
            Equation::Rendering => once::dirac_lights(scene, &self.dirac_lights, &vertex, random),
            Equation::Potential => once::lens(scene, &vertex, random),
        };
        beside.add(kind, at_once);
        if by_area {
            beside.add(kind, once::lamps(scene, &vertex, random));
        }
        if let Some(step) = once::step(scene, self.equation, &vertex, random) {
            beside.last = Some(if step.delta { Kind::Dirac } else { kind });
            beside.factor = step.factor;
            beside.lamps = step.delta || !by_area;
            self.follow(plan, spawn(&point.surface, step.w), false, random, &mut beside);
        }
    }

    /// The walk of the equation along a ray.
    fn follow(&self, plan: &Plan, ray: Ray, parallel: bool, random: &mut Random, beside: &mut impl Observe) {
        let cx = Context::new(self.scene, plan, 0);
        let mut rays = RayCounts::default();
        let mut tally = Tally { record: &mut (), rays: &mut rays, observe: beside };
        match self.equation {
            Equation::Rendering => {
                let start = SensorRay { o: ray.o, d: ray.d, t_max: ray.t_max, lens: ray.o };
                gather::follow(cx, start, 1.0, &LightCache::default(), random, &mut tally);
            }
            Equation::Potential => {
                let density = EmissionDensity { p_k: 1.0, p_next: 1.0 };
                let point = EmitterPoint::delta(EmitterId::NONE, ray.o);
                let start = Emission { point, w: ray.d, weight: Spectrum::ONE, density, delta: true, infinite: parallel };
                shoot::emit(cx, &start, None, random, &mut tally);
            }
        }
    }

    /// Draws of the sum over some points.
    fn series(&self, side: usize, kind: usize, points: &[usize]) -> BlockSeries {
        let scale = 1.0 / (self.walks.max(1) as f64);
        let sums = || points.iter().map(|p| &self.sides[side].0[*p][kind]);
        let draws = self.sides[side].0.first().map_or(0, |kinds| kinds[kind].draws.len());
        BlockSeries {
            columns: 1,
            rows: 1,
            draws: (0..draws).map(|d| vec![sums().map(|s| s.draws[d]).sum::<f64>() * scale]).collect(),
            largest: sums().map(|s| s.top.largest()).fold(0.0, f64::max) * scale,
            heavy: sums().any(|s| s.top.heavy()),
        }
    }

    /// Tests of the points that can be tested alone, of the others together, of all together.
    fn class(&self, kind: Kind) -> Class {
        let sides = |points: &[usize]| [0, 1].map(|side| self.series(side, kind as usize, points));
        let all: Vec<usize> = (0..self.points.len()).collect();
        let [a, b] = sides(&all);
        let (left, right) = (Estimate::of(&a), Estimate::of(&b));
        let whole = agreement(&a, &b);
        let mut tests = Vec::new();
        let (mut tested, mut rest) = (0.0, Vec::new());
        let mut add = |points: &[usize]| {
            let [a, b] = sides(points);
            let found = agreement(&a, &b);
            let energy = 0.5 * (found.totals.0 + found.totals.1);
            tested += energy * found.energy_tested;
            tests.extend(found.tests.iter().map(|t| PointTest { points: points.to_vec(), means: t.means, z: t.z, p: t.p }));
            found.energy_tested > 0.0
        };
        for point in all {
            if !add(&[point]) {
                rest.push(point);
            }
        }
        // Those whose draws may have no variance must not spoil the others.
        let (calm, wild): (Vec<usize>, Vec<usize>) = rest.into_iter().partition(|p| sides(&[*p]).iter().all(|s| !s.heavy));
        for rest in [calm, wild].iter().filter(|r| !r.is_empty()) {
            add(rest);
        }
        let ps: Vec<f64> = tests.iter().map(|t| t.p).chain(whole.tests.iter().map(|t| t.p)).collect();
        let energy = 0.5 * (left.mean + right.mean);
        Class {
            event: kind.letter(),
            left,
            right,
            z: left.z(right),
            p: worst(&ps),
            energy_tested: if energy > 0.0 { tested / energy } else { 1.0 },
            tests,
        }
    }

    fn verdict(&self) -> Residual {
        let all = [Kind::Wide, Kind::Narrow, Kind::Dirac].map(|kind| self.class(kind)).into_iter();
        let classes: Vec<Class> = all.filter(|c| c.left.mean > 0.0 || c.right.mean > 0.0).collect();
        let energy = |c: &Class| c.left.mean.max(c.right.mean);
        let all: f64 = classes.iter().map(energy).sum();
        let tested: f64 = classes.iter().map(|c| energy(c) * c.energy_tested).sum();
        let ps: Vec<f64> = classes.iter().filter(|c| !c.tests.is_empty()).map(|c| c.p).collect();
        Residual {
            equation: if self.equation == Equation::Rendering { "L = Lᵉ + τL" } else { "W = Wᵉ + τ'W" },
            points: self.points.len(),
            walks: self.walks,
            emission_differs: self.points.iter().filter(|p| !self.emission_is_found(p)).count(),
            energy_tested: if all > 0.0 { tested / all } else { 1.0 },
            p: worst(&ps),
            classes,
        }
    }

    /// A walk of one edge along the ray of a point finds Lᵉ.
    fn emission_is_found(&self, point: &Point) -> bool {
        if self.equation == Equation::Potential {
            return true;
        }
        let mut plan = self.plans[1].clone();
        plan.settings.max_length = 1;
        let mut sum = 0.0;
        let found = |_, value| sum += value;
        let (scene, narrow, last) = (self.scene, &self.narrow, Some(Kind::Wide));
        let mut beside = Beside { scene, narrow, last, factor: Spectrum::ONE, lamps: true, found };
        let mut random = Random::new(Family::Other, 0, 0, plan.settings.seed);
        self.follow(&plan, point.ray, false, &mut random, &mut beside);
        let emitted = self.scene.lights.radiance(&EmitterPoint::on_surface(&point.surface), -point.ray.d);
        (sum - f64::from(emitted.mean())).abs() <= 1e-6 * f64::from(emitted.mean())
    }
}

/// Watches which event comes last before a path is finished.
struct Beside<'a, F> {
    scene: &'a Scene,
    narrow: &'a [bool],
    last: Option<Kind>,
    /// Factor on what the walk finds.
    factor: Spectrum,
    /// Whether lamps count that are met by the first edge.
    lamps: bool,
    found: F,
}

impl<F: FnMut(Kind, f64)> Beside<'_, F> {
    fn add(&mut self, kind: Kind, value: Spectrum) {
        let value = f64::from(value.mean());
        if value.is_finite() && value != 0.0 {
            (self.found)(kind, value);
        }
    }
}

impl<F: FnMut(Kind, f64)> Observe for Beside<'_, F> {
    fn arrived(&mut self, surface: &Surface) {
        self.last = Some(if self.narrow[surface.material.0 as usize] { Kind::Narrow } else { Kind::Wide });
    }
    fn scattered(&mut self, s: &Scatter) {
        if s.delta {
            self.last = Some(Kind::Dirac);
        }
    }
    fn joined(&mut self, join: Join<'_>) {
        let lamp = |join: &Join<'_>| join.length == 1 && join.light.is_some_and(|l| !self.scene.lights.is_infinite(l.emitter));
        if let (Some(kind), true) = (self.last, self.lamps || !lamp(&join)) {
            self.add(kind, join.value * self.factor);
        }
    }
}

/// A random point: a ray of the walker, after any number of scatterings.
fn point(scene: &Scene, equation: Equation, index: u64, seed: u64) -> Option<Point> {
    const TRIES: u64 = 64;
    const MOST: u32 = 8;
    (0..TRIES).find_map(|attempt| {
        let stream = mix(seed ^ mix(16 + equation as u64));
        let mut random = Random::new(Family::Other, index, attempt, stream);
        let (mut ray, mut parallel) = first_ray(scene, equation, &mut random)?;
        let mut found = None;
        for _ in 0..MOST {
            let Some(hit) = scene.geometry.intersect(&ray) else { break };
            let surface = scene.geometry.surface(&ray, &hit);
            found = Some(Point { ray, surface, parallel });
            if random.unit() < 0.5 {
                break;
            }
            let vertex = Vertex::new(scene, surface, -ray.d);
            let Some(s) = vertex.scatter(equation, random.unit(), random.unit2()) else { break };
            (ray, parallel) = (spawn(&surface, s.w_next), false);
        }
        found
    })
}

/// Where a walk of the equation starts, and whether light comes from infinity along it.
fn first_ray(scene: &Scene, equation: Equation, random: &mut Random) -> Option<(Ray, bool)> {
    match equation {
        Equation::Rendering => {
            let film = &scene.film;
            let [x, y, w, h] = film.crop.unwrap_or([0, 0, film.width, film.height]).map(|v| v as f32);
            let raster = Vec2::new(x, y) + random.unit2() * Vec2::new(w, h);
            let r = scene.sensor.sample_ray(raster, random.unit2());
            Some((Ray { o: r.o, d: r.d, t_max: r.t_max }, false))
        }
        Equation::Potential => {
            let (u, a, b) = (random.unit(), random.unit2(), random.unit2());
            let e = scene.lights.sample_emission(&scene.geometry, &Guide::default(), u, a, b)?;
            let n_g = if e.infinite { Vec3::ZERO } else { e.point.n_g };
            let o = crate::scene::geometry::offset_origin(e.point.y, e.point.y_error, n_g, e.w);
            Some((Ray { o, d: e.w, t_max: f32::INFINITY }, e.infinite))
        }
    }
}

impl Residuals {
    /// For people; with every point where `points`.
    pub fn to_text(&self, points: bool) -> String {
        let mut out = String::new();
        for b in &self.left_out {
            let _ = writeln!(out, "on neither side of {}: {} ({})", b.estimator, b.paths, b.what);
        }
        out.push_str("equation       unknown ± SE             right side ± SE              z        p   tests  energy tested\n");
        for e in &self.equations {
            let (n, draws, walks) = (e.points, self.draws, e.walks);
            let _ = writeln!(out, "{}   at {n} points, {draws} draws of {walks} walks on each side", e.equation);
            if e.emission_differs > 0 {
                let _ = writeln!(out, "   Lᵉ DIFFERS at {} points", e.emission_differs);
            }
            let beside = if e.equation.starts_with('L') { "light" } else { "eye" };
            for c in &e.classes {
                let sides = sides_text(c.left, c.right, c.p);
                let (tests, share) = (c.tests.len(), 100.0 * c.energy_tested);
                let _ = writeln!(out, "   {} by {beside:5} {sides}  {tests:6}  {share:5.1} %", c.event);
                let extreme = c.tests.iter().max_by(|a, b| a.z.abs().total_cmp(&b.z.abs()));
                for t in c.tests.iter().filter(|t| points || (c.p < ALPHA && Some(*t) == extreme)) {
                    let (a, b) = t.means;
                    let _ = writeln!(out, "      points {:?}: {a:.4e} and {b:.4e}, z = {:+.2}, p = {:.1e}", t.points, t.z, t.p);
                }
            }
            let _ = writeln!(out, "   p = {:.2e}, {:.1} % of what is scattered tested", e.p, 100.0 * e.energy_tested);
        }
        let verdict = if self.zero { "both residuals are zero" } else { "A RESIDUAL IS NOT ZERO" };
        let _ = writeln!(out, "{verdict}: p = {:.2e}", self.p);
        out
    }
}
