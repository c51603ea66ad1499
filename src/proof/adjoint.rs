//! Adjointness: `⟨τⁿLᵉ, Wᵉ⟩ = ⟨Lᵉ, τ'ⁿWᵉ⟩ = Φ_n` for every number n of scatterings.
//!
//! The left side is estimated by gathering alone (hits and next events), the right side by shooting
//! alone (splats), on the paths that both can make. The two share the scene and the local models' values,
//! but no sampling of directions, no joins and no weights, so that a mistake in one of them parts them.
//! What one of them cannot make is left out by the rule of [`crate::report::coverage`], and named.
//!
//! Each side is drawn many times independently. Blocks of 16 × 16 pixels and the whole film are compared
//! by Welch's test, corrected for their number within a length and for the number of lengths
//! [Šidák 1967]. Paths that a walker finds by luck are compared apart from those it always finds
//! ([`super::blocks`]), so that what is rarely found is not taken for what is never found. A mean of few
//! effective draws is not tested: either side gets more passes until nearly all energy can be, or the time is
//! over; the share that was is part of the verdict, and the share where a few of the largest contributions
//! had to be allowed for ([`crate::report::agreement`]). Classes of next to no energy are not tested: what
//! has not been found yet may be as large as what has. For the same
//! reason each light is tested on its own: a sky is gathered always and a small sun by luck, for shooting it
//! is the other way round, and their sum would hide both.

use super::blocks::{self, Series};
use super::compare::{Estimate, compare, sides_text, worst};
use crate::render::{Estimator, Options, RenderError};
use crate::report::agreement::{Agreement, BlockSeries, UNSEEN, agreement};
use crate::report::coverage::{Blind, Coverage};
use crate::scene::emitter::{EmitterInfo, Lights};
use crate::scene::{EmitterId, Scene};
use crate::transport::class::PathFilter;
use std::fmt::Write;
use std::time::{Duration, Instant};

/// Probability of a false alarm in one run.
pub const ALPHA: f64 = 1e-4;
/// Share of the energy that a run without a number of passes wants to test.
const ENOUGH: f64 = 0.98;
/// A length with less than this share of the energy does not hold up a run.
const FAINT: f64 = 1e-3;
/// A class with less than this share of the energy is not tested.
const NOTHING: f64 = 2e-4;
/// Passes per draw to begin with: rare paths must have had a chance.
const FIRST: u64 = 8;
/// Emitters that are tested apart, at most; the weakest together.
const GROUPS: usize = 4;
/// Longest paths where neither scene nor caller says.
const LONGEST: u32 = 16;

/// How much to do.
#[derive(Clone, Debug)]
pub struct Effort {
    /// Independent draws of each side.
    pub renders: usize,
    /// Passes per draw; `None` = as many as it takes, within `time`.
    pub passes: Option<u64>,
    /// Time after which no pass is added.
    pub time: Option<Duration>,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Longest path in edges instead of the scene's.
    pub max_length: Option<u32>,
    /// Only these paths (an expression), of those that both can make.
    pub paths: Option<String>,
}

impl Default for Effort {
    fn default() -> Self {
        Self { renders: 64, passes: None, time: Some(Duration::from_secs(60)), seed: 0, max_length: None, paths: None }
    }
}

/// Paths of one n with the same events beside eye and light.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Class {
    /// As `E D … S L`: D is an event into all directions, G into few, S a Dirac event.
    pub paths: String,
    /// `⟨τⁿLᵉ, Wᵉ⟩` by gathering.
    pub gather: Estimate,
    /// `⟨Lᵉ, τ'ⁿWᵉ⟩` by shooting.
    pub shoot: Estimate,
    /// Difference over its standard error.
    pub z: f64,
    /// Probability of a difference as large as the largest in any block, where both agree.
    pub p: f64,
    /// The tests of blocks.
    pub blocks: Agreement,
}

/// One n.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Term {
    /// Scatterings; the path has one edge more.
    pub n: u32,
    /// All classes together.
    pub gather: Estimate,
    /// All classes together.
    pub shoot: Estimate,
    /// Of all classes together.
    pub z: f64,
    /// Of its classes, corrected for their number.
    pub p: f64,
    /// Share of the energy that was tested.
    pub energy_tested: f64,
    /// Those that carry energy.
    pub classes: Vec<Class>,
}

/// The lights of a scene that are on together, and every n by their light alone.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Lit {
    /// Their kinds and names.
    pub lights: String,
    /// Passes per draw by gathering and by shooting.
    pub passes: [u64; 2],
    /// n = 0, 1, …
    pub terms: Vec<Term>,
    /// Corrected over all lengths.
    pub p: f64,
}

/// The verdict.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Adjoint {
    /// Pixels of the film (or its crop window).
    pub size: [u32; 2],
    /// Draws of each side.
    pub renders: usize,
    /// Light by light.
    pub lit: Vec<Lit>,
    /// Classes that one side cannot make.
    pub left_out: Vec<Blind>,
    /// Share of the energy of the classes both can make that was tested.
    pub energy_tested: f64,
    /// Share of the same energy that was tested, but with an allowance for large contributions that may be due.
    pub energy_allowed: f64,
    /// Corrected over all lengths and lights.
    pub p: f64,
    /// p is at least [`ALPHA`].
    pub agree: bool,
}

/// Both sides of every n, compared. The lights of the scene are put on one after another meanwhile.
pub fn adjoint(scene: &mut Scene, effort: &Effort) -> Result<Adjoint, Refused> {
    let film = &scene.film;
    let size = film.crop.map_or([film.width, film.height], |c| [c[2], c[3]]);
    let left_out = left_out(scene);
    let all = scene.lights.clone();
    let groups = all.apart(GROUPS);
    let effort =
        Effort { renders: effort.renders.max(2), time: effort.time.map(|t| t / groups.len().max(1) as u32), ..effort.clone() };
    let lit: Result<Vec<Lit>, Refused> = groups
        .iter()
        .map(|group| {
            scene.lights = all.only(group);
            lit(scene, names(&all, group), &effort)
        })
        .collect();
    scene.lights = all;
    let lit = lit?;
    let p = worst(&lit.iter().map(|l| l.p).collect::<Vec<_>>());
    let classes = || lit.iter().flat_map(|l| &l.terms).flat_map(|t| &t.classes);
    let energy_tested = share(classes(), |c| c.blocks.energy_tested).unwrap_or(1.0);
    let energy_allowed = share(classes(), |c| c.blocks.energy_allowed).unwrap_or(0.0);
    let renders = effort.renders;
    Ok(Adjoint { size, renders, left_out, energy_tested, energy_allowed, p, agree: p >= ALPHA, lit })
}

/// Emitters as people know them.
fn names(lights: &Lights, group: &[EmitterId]) -> String {
    let infos = group.iter().filter_map(|id| lights.infos().get(id.0 as usize));
    match group.len() {
        0..=3 => infos.map(EmitterInfo::name).collect::<Vec<_>>().join(", "),
        n => format!("{n} emitters"),
    }
}

/// What one of the walkers cannot make.
fn left_out(scene: &Scene) -> Vec<Blind> {
    Coverage::of(scene).blind.into_iter().filter(|b| matches!(b.estimator, "gather" | "shoot")).collect()
}

/// Both sides of every n by the lights that are on.
fn lit(scene: &Scene, lights: String, effort: &Effort) -> Result<Lit, Refused> {
    let mut s = Options::for_scene(scene, Estimator::Gather).settings;
    s.max_length = effort.max_length.or(scene.integrator.max_depth).unwrap_or(LONGEST).min(1000);
    // Parallel projection sees no sky by splats, and a splat has no class finer than its events.
    s.min_length = if left_out(scene).iter().any(|b| b.paths == "E L") { 2 } else { 1 };
    let asked = effort.paths.as_deref().map_or(String::new(), |p| format!("{p} & "));
    s.paths = PathFilter::parse(&format!("{asked}visible-to:gather,shoot")).map_err(Refused::Paths)?;
    let longest = s.max_length as usize;
    let mut sides = Vec::new();
    for (i, estimator) in [Estimator::Gather, Estimator::Shoot].into_iter().enumerate() {
        let mut settings = s.clone();
        settings.techniques = estimator.techniques();
        // Families of random numbers differ, but so that nothing hangs on that, so do the seeds.
        settings.seed = effort.seed.wrapping_mul(2).wrapping_add(i as u64);
        sides.push(Series::new(scene, &settings, effort.renders)?);
    }
    let first = s.min_length.max(1) as usize;
    draw(&mut sides, effort, first..longest + 1);
    let classes = || (first..=longest).flat_map(blocks::Class::of_length);
    let energy: f64 = classes().map(|c| sides.iter().map(|s| Estimate::of(&s.of(c)).mean).fold(0.0, f64::max)).sum();
    let terms: Vec<Term> = (first..=longest).map(|k| term(k, &sides, NOTHING * energy)).collect();
    let tests: Vec<f64> = terms.iter().flat_map(|t| &t.classes).filter(|c| c.tests() > 0).map(|c| c.p).collect();
    Ok(Lit { lights, passes: [sides[0].passes(), sides[1].passes()], terms, p: worst(&tests) })
}

/// Why there is no verdict.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Refused {
    /// The path expression makes no sense.
    #[error("--paths: {0}")]
    Paths(String),
    /// The scene cannot be rendered.
    #[error(transparent)]
    Render(#[from] RenderError),
}

/// Adds passes until there are enough.
fn draw(sides: &mut [Series<'_>], effort: &Effort, lengths: std::ops::Range<usize>) {
    let start = Instant::now();
    if let Some(passes) = effort.passes {
        sides.iter_mut().for_each(|s| s.grow(passes.max(1)));
        return;
    }
    sides.iter_mut().for_each(|s| s.grow(FIRST));
    loop {
        // The next round takes as long as all before it.
        let wanted = lacking(sides, lengths.clone());
        let limit = effort.time.unwrap_or(Duration::from_secs(60));
        if wanted == [false; 2] || start.elapsed() * 2 > limit {
            return;
        }
        for (side, wanted) in sides.iter_mut().zip(wanted) {
            if wanted {
                side.grow(side.passes());
            }
        }
    }
}

/// Which side has too much of the energy (as the side that finds more of it tells) in blocks whose
/// draws are too few or too skew.
fn lacking(sides: &[Series<'_>], lengths: std::ops::Range<usize>) -> [bool; 2] {
    let classes: Vec<(f64, [f64; 2])> = lengths
        .flat_map(blocks::Class::of_length)
        .map(|class| {
            let with_itself = [0, 1].map(|i| {
                let s = sides[i].of(class);
                agreement(&s, &s)
            });
            let energy = with_itself.iter().map(|a| a.totals.0).fold(0.0, f64::max);
            (energy, with_itself.map(|a| if a.totals.0 > 0.0 { a.energy_tested - a.energy_allowed } else { 0.0 }))
        })
        .collect();
    let total: f64 = classes.iter().map(|(energy, _)| energy).sum();
    [0, 1].map(|i| {
        let tested: f64 = classes.iter().map(|(energy, tested)| energy * tested[i]).sum();
        tested < ENOUGH * total || classes.iter().any(|(energy, tested)| *energy > FAINT * total && tested[i] < 0.5)
    })
}

/// Share of the energy of all classes that is this part of each, `None` where there is no energy.
fn share<'a>(classes: impl Iterator<Item = &'a Class>, part: impl Fn(&Class) -> f64) -> Option<f64> {
    let (mut all, mut tested) = (0.0, 0.0);
    for c in classes {
        let energy = c.gather.mean.max(c.shoot.mean);
        all += energy;
        tested += energy * part(c);
    }
    (all > 0.0).then(|| tested / all)
}

/// Tested if it has at least the energy `least`.
fn class(paths: String, a: &BlockSeries, b: &BlockSeries, least: f64) -> Class {
    let (gather, shoot) = (Estimate::of(a), Estimate::of(b));
    let untested = || (Agreement { p: 1.0, totals: (gather.mean, shoot.mean), ..Agreement::default() }, 1.0);
    let (blocks, p) = if gather.mean.max(shoot.mean) < least { untested() } else { compare(a, b) };
    Class { paths, gather, shoot, z: gather.z(shoot), p, blocks }
}

fn term(length: usize, sides: &[Series<'_>], least: f64) -> Term {
    let (gather, shoot) = (Estimate::of(&all(&sides[0], length)), Estimate::of(&all(&sides[1], length)));
    let classes: Vec<Class> = blocks::Class::of_length(length)
        .into_iter()
        .map(|c| class(c.name(), &sides[0].of(c), &sides[1].of(c), least))
        .filter(|c| c.gather.mean > 0.0 || c.shoot.mean > 0.0)
        .collect();
    let tested: Vec<f64> = classes.iter().filter(|c| c.tests() > 0).map(|c| c.p).collect();
    let p = worst(&tested);
    let energy_tested = share(classes.iter(), |c| c.blocks.energy_tested).unwrap_or(1.0);
    Term { n: length as u32 - 1, gather, shoot, z: gather.z(shoot), p, energy_tested, classes }
}

/// Draws of all classes of a length together.
fn all(side: &Series<'_>, length: usize) -> BlockSeries {
    let mut classes = blocks::Class::of_length(length).into_iter().map(|c| side.of(c));
    let mut all = classes.next().unwrap_or_default();
    for other in classes {
        for (a, b) in all.draws.iter_mut().flatten().zip(other.draws.iter().flatten()) {
            *a += b;
        }
    }
    all
}

impl Class {
    fn tests(&self) -> usize {
        self.blocks.tests.len()
    }

    fn to_text(&self, all: bool) -> String {
        let mut out = String::new();
        let _ = writeln!(
            out,
            "   {:12}{}  {:6}  {:5.1} %",
            self.paths,
            sides_text(self.gather, self.shoot, self.p),
            self.tests(),
            100.0 * self.blocks.energy_tested
        );
        let worst = self.blocks.tests.iter().max_by(|a, b| a.z.abs().total_cmp(&b.z.abs()));
        for b in self.blocks.tests.iter().filter(|b| all || (self.p < ALPHA && Some(*b) == worst)) {
            let ((x, y), side) = (b.at, b.side);
            let _ = writeln!(
                out,
                "      blocks {x}…{}, {y}…{}: {:.4e} and {:.4e}, z = {:+.2}, p = {:.1e}",
                x + side - 1,
                y + side - 1,
                b.means.0,
                b.means.1,
                b.z,
                b.p
            );
        }
        out
    }
}

impl Lit {
    fn to_text(&self, classes: bool, blocks: bool) -> String {
        let [g, s] = self.passes;
        let mut out = format!("light from {}: {g} passes by gathering and {s} by shooting\n", self.lights);
        out.push_str("  n             gather ± SE              shoot ± SE                  z        p   tests  energy tested\n");
        for t in &self.terms {
            let tests: usize = t.classes.iter().map(Class::tests).sum();
            let sides = sides_text(t.gather, t.shoot, t.p);
            let _ = writeln!(out, "{:3}            {sides}  {tests:6}  {:5.1} %", t.n, 100.0 * t.energy_tested);
            if classes || blocks || t.p < ALPHA {
                t.classes.iter().for_each(|c| out.push_str(&c.to_text(blocks)));
            }
        }
        out
    }
}

impl Adjoint {
    /// For people; with every class where `classes`, with every block's test where `blocks`.
    pub fn to_text(&self, classes: bool, blocks: bool) -> String {
        let mut out = String::new();
        let [w, h] = self.size;
        let _ = writeln!(out, "{w} × {h} pixels, {} draws of each side, mean radiance of the film", self.renders);
        for b in &self.left_out {
            let _ = writeln!(out, "left out: {} ({} cannot make it: {})", b.paths, b.estimator, b.what);
        }
        self.lit.iter().for_each(|l| out.push_str(&l.to_text(classes, blocks)));
        let verdict = if self.agree { "both walkers agree" } else { "THE WALKERS DISAGREE" };
        let _ = writeln!(
            out,
            "{verdict}: p = {:.2e} over all lengths and lights, {:.1} % of the energy that both can make tested",
            self.p,
            100.0 * self.energy_tested
        );
        if self.energy_allowed > 0.0 {
            let _ = writeln!(
                out,
                "({:.1} % of it with an allowance: {} more contributions as large as the largest would not count)",
                100.0 * self.energy_allowed,
                UNSEEN
            );
        }
        out
    }
}
