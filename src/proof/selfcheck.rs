//! Closed forms that the program checks about itself, wherever it is installed.
//!
//! Fixed seeds and samples that are functions of their names make the result the same on every machine of the same
//! arithmetic: what passed once passes always, and a difference is a fault of the build.

use super::caustics::{self, Caustic, flux_balance, nephroid, parabolic_mirror, slab, water};
use super::compare::Estimate;
use super::furnace::{self, Constancy, Lossless, SPHERE_ALBEDO, SPHERE_EMISSION, film_mean, picture};
use super::scattering::{self, EQUATIONS, models};
use crate::elements::factors::ray_counts;
use crate::elements::iterate::{Iteration, Until, iterate};
use crate::elements::stochastic::{self, stochastic};
use crate::elements::{Elements, ElementsError, Factors, Rgb, Sources, invert::invert};
use crate::io::mitsuba::LoadError;
use crate::render::{Estimator, Options, RenderError};
use crate::report::agreement::sidak;
use crate::scene::Scene;
use crate::transport::settings::Techniques;
use rayon::prelude::*;
use std::fmt::Write;
use std::path::Path;

/// Probability of a deviation by chance below which a statistical row fails.
pub const ALPHA: f64 = 1e-4;
/// Standard errors that a mean may be off.
const ERRORS: f64 = 4.0;
const SEED: u64 = 1;

/// What a number should be.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Rule {
    /// This, but for so much.
    Equal {
        /// The closed form.
        exact: f64,
        /// Largest difference.
        within: f64,
    },
    /// This, within four standard errors.
    Mean {
        /// The closed form.
        exact: f64,
        /// Standard error of the number.
        standard_error: f64,
    },
    /// At least this.
    AtLeast(f64),
    /// At most this.
    AtMost(f64),
}

/// A line of the table.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Row {
    /// The statement of docs/theory.md.
    pub theory: &'static str,
    /// What was measured, and how.
    pub what: String,
    /// What it is.
    pub found: f64,
    /// What it should be.
    pub rule: Rule,
    /// It is.
    pub holds: bool,
}

impl Row {
    fn new(theory: &'static str, what: impl Into<String>, found: f64, rule: Rule) -> Self {
        let holds = match rule {
            Rule::Equal { exact, within } => (found - exact).abs() <= within,
            Rule::Mean { exact, standard_error } => {
                (found - exact).abs() <= ERRORS * standard_error.max(1e-6 * exact.abs()) && standard_error <= 0.1 * exact.abs()
            }
            Rule::AtLeast(least) => found >= least,
            Rule::AtMost(most) => found <= most,
        };
        Self { theory, what: what.into(), found, rule, holds }
    }

    fn mean(theory: &'static str, what: impl Into<String>, e: Estimate, exact: f64) -> Self {
        Self::new(theory, what, e.mean, Rule::Mean { exact, standard_error: e.standard_error })
    }

    fn equal(theory: &'static str, what: impl Into<String>, found: f64, exact: f64, within: f64) -> Self {
        Self::new(theory, what, found, Rule::Equal { exact, within })
    }
}

/// Why there is no table.
#[derive(Debug, thiserror::Error)]
pub enum Refused {
    /// A scene cannot be read: the user's mesh.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// It cannot be rendered.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// It has no elements.
    #[error(transparent)]
    Elements(#[from] ElementsError),
}

type Rows = Result<Vec<Row>, Refused>;

/// A group of checks.
#[derive(Clone, Copy)]
pub struct Check {
    /// What it is about.
    pub about: &'static str,
    run: fn() -> Rows,
}

impl Check {
    /// Does it.
    pub fn run(&self) -> Rows {
        (self.run)()
    }
}

/// All checks.
pub const CHECKS: [Check; 8] = [
    Check { about: "toy equation by walks", run: toy_by_walks },
    Check { about: "toy equation by elements", run: toy_by_elements },
    Check { about: "constant radiance", run: constant_radiance },
    Check { about: "constant reflected radiance", run: constant_reflected_radiance },
    Check { about: "caustics", run: known_caustics },
    Check { about: "form factors", run: form_factors },
    Check { about: "densities of local models", run: local_densities },
    Check { about: "energy and reciprocity of local models", run: local_energy },
];

const ESTIMATORS: [Estimator; 3] = [Estimator::Gather, Estimator::Shoot, Estimator::Bidirectional];

/// Paths of `lengths` edges. Late roulette, whose rare survivors would make the distribution of a pixel skew; independent
/// passes, so that their variance is that of their mean.
fn options(scene: &Scene, estimator: Estimator, lengths: (u32, u32)) -> Options {
    let mut options = Options::for_scene(scene, estimator);
    (options.settings.min_length, options.settings.max_length) = lengths;
    options.settings.rr_depth = 40;
    options.settings.stratified = false;
    options.settings.seed = SEED;
    options
}

/// 2 (1 − 0.1^(D+1)) after D scatterings, by hits alone without any noise; 2 in all by every estimator.
fn toy_by_walks() -> Rows {
    let world = furnace::toy()?;
    let mut rows = Vec::new();
    for d in 0..5u32 {
        let mut o = options(&world, Estimator::Gather, (1, d + 1));
        o.settings.techniques = Techniques { hit: true, next_event: false, splat: false, connect: false, merge: false };
        o.settings.rr_depth = u32::MAX;
        let exact = 2.0 * (1.0 - 0.1f64.powi(d as i32 + 1));
        let farthest = Constancy::of(&picture(&world, &o, 4)?, [exact; 3]).farthest;
        let what = match d {
            0 => "x = 0.1x + 1.8 without coupling".to_owned(),
            1 => "x = 0.1x + 1.8, coupling once".to_owned(),
            _ => format!("x = 0.1x + 1.8, expansion to n = {d}"),
        };
        rows.push(Row::equal("A8", what, farthest, exact, 1e-6));
    }
    for estimator in ESTIMATORS {
        let mean = film_mean(&world, &options(&world, estimator, (1, u32::MAX)), 64)?;
        rows.push(Row::mean("A8", format!("x = 0.1x + 1.8 by {}", estimator.name()), mean, 2.0));
    }
    Ok(rows)
}

fn farthest(radiance: &[Rgb], exact: f64) -> f64 {
    let far = |a: f64, b: f64| if (b - exact).abs() > (a - exact).abs() { b } else { a };
    radiance.iter().flatten().copied().fold(exact, far)
}

/// Inversion, the three deterministic iterations, the stochastic one.
fn toy_by_elements() -> Rows {
    let world = furnace::toy()?;
    let mesh = Elements::new(&world, 200)?;
    let sources = Sources::new(&world, &mesh, 64, SEED);
    let factors = Factors::cast(&world, &mesh, &ray_counts(&mesh, &sources, 128), SEED);
    let inverted = invert(&factors, &sources, u64::MAX)?;
    let mut rows = vec![Row::equal("A9", "x = 0.1x + 1.8 by inversion", farthest(&inverted, 2.0), 2.0, 1e-6)];
    let ways = [(Iteration::Jacobi, "Jacobi"), (Iteration::GaussSeidel, "Gauss–Seidel"), (Iteration::Southwell, "Southwell")];
    for (how, name) in ways {
        let until = Until { residual: 1e-11, sweeps: 500 };
        let radiance = iterate(&factors, &sources, how, until, |_| true).radiance;
        rows.push(Row::equal("A8", format!("x = 0.1x + 1.8 by {name} iteration"), farthest(&radiance, 2.0), 2.0, 1e-6));
    }
    let (mut sum, mut squares, runs) = (0.0, 0.0, 32u64);
    for seed in 0..runs {
        let effort = stochastic::Effort { iterations: 16, rays: 1024, seed };
        let l = stochastic(&world, &mesh, &sources, effort, |_| true).radiance;
        let areas: f64 = (0..mesh.len()).map(|i| mesh.area(i)).sum();
        let mean = l.iter().enumerate().map(|(i, l)| l[0] * mesh.area(i)).sum::<f64>() / areas;
        sum += mean;
        squares += mean * mean;
    }
    let n = runs as f64;
    let standard_error = ((squares - sum * sum / n).max(0.0) / (n - 1.0) / n).sqrt();
    let sampled = Estimate { mean: sum / n, standard_error };
    rows.push(Row::mean("A8", "x = 0.1x + 1.8 by stochastic iteration", sampled, 2.0));
    Ok(rows)
}

/// L = 1 wherever Lᵉ = 1 − a.
fn constant_radiance() -> Rows {
    let mixed = furnace::furnace(false)?;
    let diffuse = furnace::furnace(true)?;
    let mut rows = Vec::new();
    for (world, estimator, what) in [
        (&mixed, Estimator::Gather, "diffuse, mirror and glass"),
        (&mixed, Estimator::Bidirectional, "diffuse, mirror and glass"),
        (&diffuse, Estimator::Shoot, "diffuse"),
    ] {
        let what = format!("radiance 1 everywhere ({what})");
        rows.push(constant("A16", what, world, estimator, (1, u32::MAX), 1.0, passes(estimator))?);
    }
    Ok(rows)
}

/// Passes after which the mean of a pixel is nearly normal: few splats fall on it in one, and a pixel that the bright ones of them
/// have missed so far looks calm and is too dark.
const fn passes(estimator: Estimator) -> u64 {
    if matches!(estimator, Estimator::Shoot) { 1024 } else { 256 }
}

/// All pixels together: the probability of the most deviant one.
fn constant(
    theory: &'static str,
    what: String,
    world: &Scene,
    estimator: Estimator,
    lengths: (u32, u32),
    exact: f64,
    passes: u64,
) -> Result<Row, Refused> {
    let picture = picture(world, &options(world, estimator, lengths), passes)?;
    let p = Constancy::of(&picture, [exact; 3]).p;
    Ok(Row::new(theory, format!("{what} by {}: p of all pixels", estimator.name()), p, Rule::AtLeast(ALPHA)))
}

/// n scatterings add aⁿ avg(Lᵉ) everywhere inside a sphere, whatever the pattern of its lamps.
fn constant_reflected_radiance() -> Rows {
    let world = furnace::sphere()?;
    let mut rows = Vec::new();
    for n in 1..=5u32 {
        let exact = SPHERE_ALBEDO.powi(n as i32) * SPHERE_EMISSION;
        for estimator in ESTIMATORS {
            let o = options(&world, estimator, (n + 1, n + 1));
            let what = format!("sphere with lamps, n = {n} by {}", estimator.name());
            rows.push(Row::mean("A17", what, film_mean(&world, &o, 64)?, exact));
        }
    }
    // Few splats fall on a pixel in a pass.
    for (estimator, passes) in [(Estimator::Gather, 256), (Estimator::Shoot, 8192), (Estimator::Bidirectional, 256)] {
        let exact = SPHERE_ALBEDO * SPHERE_EMISSION;
        rows.push(constant("A17", "sphere with lamps, n = 1".into(), &world, estimator, (2, 2), exact, passes)?);
    }
    Ok(rows)
}

fn profile(theory: &'static str, what: &str, c: &Caustic) -> Row {
    Row::new(theory, format!("{what}: largest z of {}", c.bins.len()), c.worst(), Rule::AtMost(ERRORS))
}

/// Caustics of Dirac lights: the closed form by shooting, nothing by gathering.
fn known_caustics() -> Rows {
    let effort = |passes| caustics::Effort { passes, seed: SEED };
    let sea = water(effort(100))?;
    let mut rows = vec![profile("C1", "point light over water, from below, rings", &sea)];
    rows.push(Row::mean("C1", "  all rings together", sea.total.found, sea.total.exact));
    let glass = slab(1.5, 1, effort(100))?;
    rows.push(Row::mean("C2", "glass plate, all orders", glass.total.found, glass.total.exact));
    let dense = slab(4.0, 3, effort(100))?;
    for (k, order) in dense.bins.iter().enumerate() {
        rows.push(Row::mean("C2", format!("plate of index 4, order {k}"), order.found, order.exact));
    }
    let mirror = parabolic_mirror(effort(60))?;
    rows.push(Row::mean("C3", "parabolic mirror, flux on its focus", mirror.total.found, mirror.total.exact));
    let cup = nephroid(effort(200))?;
    rows.push(profile("C4", "nephroid, columns along the axis", &cup.caustic));
    rows.push(Row::equal("C4", "  cusp, distance from the axis in radii", cup.cusp.mean, 0.5, 0.01));
    let ripples = flux_balance(effort(60))?;
    rows.push(Row::mean("C5", "flux behind rippled water", ripples.total.found, ripples.total.exact));
    let seen = [&sea, &glass, &dense, &mirror, &cup.caustic, &ripples].map(|c| f64::from(c.gathered));
    rows.push(Row::equal("C1–C5", "the same by gathering: the largest pixel", seen.into_iter().fold(0.0, f64::max), 0.0, 0.0));
    Ok(rows)
}

/// Cube and discs.
fn form_factors() -> Rows {
    let mut rows = Vec::new();
    let cube = super::form_factors::cube(12, 65_536, SEED)?;
    let worst = |pairs: &dyn Fn(usize, usize) -> bool, exact: f64| {
        let all = (0..6).flat_map(|i| (0..6).map(move |j| (i, j))).filter(|(i, j)| i != j && pairs(*i, *j));
        all.map(|(i, j)| cube[i][j]).fold(exact, |a, b| if (b - exact).abs() > (a - exact).abs() { b } else { a })
    };
    let (opposite, adjacent) = (super::form_factors::OPPOSITE, super::form_factors::ADJACENT);
    rows.push(Row::equal("B9", "form factor of opposite faces", worst(&|i, j| i / 2 == j / 2, opposite), opposite, 1e-3));
    rows.push(Row::equal("B9", "form factor of adjacent faces", worst(&|i, j| i / 2 != j / 2, adjacent), adjacent, 1e-3));
    let discs = super::form_factors::discs(65_536, SEED)?;
    rows.push(Row::equal("B9", "form factor of coaxial discs", discs, super::form_factors::DISCS, 1e-3));
    Ok(rows)
}

/// χ² of every sampler against its density.
fn local_densities() -> Rows {
    let cases = models::all_models();
    let tests: Vec<_> = cases.par_iter().enumerate().flat_map(|(c, case)| scattering::densities(c, case, 20_000)).collect();
    let least = tests.iter().min_by(|a, b| a.p.total_cmp(&b.p));
    let p = least.map_or(1.0, |t| sidak(t.p, tests.len()));
    let largest = tests.iter().map(|t| t.integral).fold(0.0, f64::max);
    let what = format!("χ² of {} local models, {} windows: p", cases.len(), tests.len());
    Ok(vec![
        Row::new("A14", what, p, Rule::AtLeast(ALPHA)),
        Row::new("A14", "  largest integral of a density", largest, Rule::AtMost(1.005)),
    ])
}

/// No local model gains energy, lossless ones keep it, f obeys reciprocity with η².
fn local_energy() -> Rows {
    let cases = models::all_models();
    let (mut most, mut kept, mut reciprocity) = (0.0f64, 0.0f64, 0.0f64);
    for (c, case) in cases.iter().enumerate() {
        for w_back in models::directions() {
            for equation in EQUATIONS {
                let share = scattering::scattered(case, equation, w_back);
                let bound = f64::from(case.materials().albedo_bound(case.id()).max_lane()).min(1.0);
                most = most.max(share - bound);
                if let Some(tolerance) = scattering::keeps_energy(case, w_back) {
                    kept = kept.max((share - 1.0).abs() / tolerance);
                }
            }
        }
        reciprocity = reciprocity.max(f64::from(scattering::reciprocity(c, case, 3000).worst));
    }
    Ok(vec![
        Row::new("A11", "largest energy gained by a local model", most, Rule::AtMost(0.005)),
        Row::new("A11", "energy lost by lossless ones (of what rounding allows)", kept, Rule::AtMost(1.0)),
        Row::new("A3", "reciprocity with η² (of what rounding allows)", reciprocity, Rule::AtMost(1.0)),
    ])
}

/// The furnace of the user's own mesh.
pub fn mesh(path: &Path) -> Rows {
    let white = furnace::furnace_of(path, Lossless::White)?;
    let mirror = furnace::furnace_of(path, Lossless::Mirror)?;
    let mut rows = Vec::new();
    for (world, estimator, what) in [
        (&white, Estimator::Gather, "white"),
        (&white, Estimator::Shoot, "white"),
        (&white, Estimator::Bidirectional, "white"),
        (&mirror, Estimator::Gather, "a mirror"),
        (&mirror, Estimator::Bidirectional, "a mirror"),
    ] {
        let what = format!("radiance 1 around the mesh, {what},");
        rows.push(constant("A16", what, world, estimator, (1, u32::MAX), 1.0, passes(estimator))?);
    }
    Ok(rows)
}

impl Row {
    /// A line for people.
    pub fn to_text(&self) -> String {
        let mut out = String::new();
        let rule = match self.rule {
            Rule::Equal { exact, within: 0.0 } => format!("= {exact}"),
            Rule::Equal { exact, within } => format!("= {} ± {within:.1e}", short(exact)),
            Rule::Mean { exact, standard_error } => {
                let z = (self.found - exact) / standard_error.max(1e-6 * exact.abs());
                format!("= {} (z = {z:+.2}, SE {standard_error:.1e})", short(exact))
            }
            Rule::AtLeast(least) => format!("≥ {least:.0e}"),
            Rule::AtMost(most) => format!("≤ {most}"),
        };
        let verdict = if self.holds { "ok" } else { "FAILED" };
        let _ = write!(out, "{:6} {:62} {:>12}  {rule:44} {verdict}", self.theory, self.what, short(self.found));
        out
    }
}

fn short(x: f64) -> String {
    if x != 0.0 && !(1e-3..1e5).contains(&x.abs()) { format!("{x:.3e}") } else { format!("{x:.7}") }
}
