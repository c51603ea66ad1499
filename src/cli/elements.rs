//! `render --estimator invert|iterate`: a diffuse scene as a finite system of equations, then as an image.

use super::args::{ElementViewName, EstimatorName, IterationName, RenderArgs, SubdivisionName};
use super::open::{self, Opened};
use super::output::{self, Outputs};
use super::render::{command_line, set_film};
use super::units::{show_bytes, show_count, show_duration};
use super::{Exit, Failure, interrupt, tell};
use crate::elements::bound::{Bound, bound};
use crate::elements::factors::ray_counts;
use crate::elements::iterate::{Iteration, Step, Until, iterate};
use crate::elements::stochastic::{Batch, Effort, stochastic};
use crate::elements::{
    Elements, ElementsError, Factors, Rgb, Smooth, Sources, Subdivision, View, facets, invert, refusals, subdivide, view,
};
use crate::film::Film;
use crate::io::fault::{Fault, reason};
use crate::io::ply;
use crate::io::write::write_atomic;
use crate::scene::Scene;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Camera rays per pixel where the command line does not say.
const DEFAULT_SPP: u64 = 16;
/// Points per element for emitters that are no surfaces.
const SOURCE_SAMPLES: u32 = 128;
/// Iterations where the command line does not say: stochastic ones, others.
const ITERATIONS: [u32; 2] = [64, 10_000];
/// Points of the surfaces, and pairs of rays from each, for the error bound.
const BOUND: [u32; 2] = [16_384, 32];

/// How the equation of the elements is solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// By elimination.
    Invert,
    /// By iteration with a matrix.
    Iterate(Iteration),
    /// By rays.
    Stochastic,
}

impl Method {
    fn name(self) -> &'static str {
        match self {
            Self::Invert => "invert",
            Self::Iterate(Iteration::Jacobi) => "iterate jacobi",
            Self::Iterate(Iteration::GaussSeidel) => "iterate gauss-seidel",
            Self::Iterate(Iteration::Southwell) => "iterate southwell",
            Self::Stochastic => "iterate stochastic",
        }
    }
}

/// The method, if the estimator is one of finite elements.
pub fn method(args: &RenderArgs) -> Option<Method> {
    match args.estimator {
        EstimatorName::Invert => Some(Method::Invert),
        EstimatorName::Iterate => Some(match args.elements.iteration {
            IterationName::Jacobi => Method::Iterate(Iteration::Jacobi),
            IterationName::GaussSeidel => Method::Iterate(Iteration::GaussSeidel),
            IterationName::Southwell => Method::Iterate(Iteration::Southwell),
            IterationName::Stochastic => Method::Stochastic,
        }),
        _ => None,
    }
}

/// Solves and writes.
pub fn run(args: &RenderArgs, command: &[OsString], method: Method) -> Result<Exit, Failure> {
    let start = Instant::now();
    refuse_walks(args)?;
    let (meshes, images): (Vec<PathBuf>, Vec<PathBuf>) = args.output.iter().cloned().partition(|p| is_ply(p));
    let outputs = Outputs::check(&RenderArgs { output: images, ..args.clone() })?;
    for path in args.elements.residual_log.iter().chain(&meshes) {
        let cannot = |what| Failure::output(format!("cannot write {}: {what}", path.display()));
        output::check_directory(path).map_err(cannot)?;
    }
    open::set_threads(args.scene.threads);
    let mut described = open::describe(&args.scene)?;
    set_film(&mut described, args)?;
    let refused = refusals(&described.description);
    if refused.has_errors() {
        return Err(open::scene_failure(&refused, &described.description.sources));
    }
    let opened = open::build(described)?;
    let mut job = Job { args, opened: &opened, method, figures: BTreeMap::new(), log: String::new() };
    job.talk(&opened.problems.render(&opened.description.sources));
    job.talk(&job.notes());
    interrupt::install(args.quiet);
    let solved = job.solve()?;
    job.judge(&solved);
    let smooth = (args.elements.element_view == ElementViewName::Smooth).then(|| solved.smooth(&opened.scene));
    let mut faults = job.write_meshes(&meshes, &solved, smooth.as_ref());
    if !outputs.is_empty() {
        let film = job.film(&solved, smooth.as_ref())?;
        faults.extend(outputs.write(&film, &[], &job.attributes(command)));
    }
    job.figure("total_seconds", start.elapsed().as_secs_f64());
    if let Some(path) = &args.stats {
        let text = serde_json::to_string_pretty(&job.statistics(command)).unwrap_or_default() + "\n";
        faults.extend(write_text(path, &text));
    }
    if let Some(path) = &args.elements.residual_log {
        faults.extend(write_text(path, &job.log));
    }
    job.talk(&format!("done in {}, written to {}\n", show_duration(start.elapsed()), names(&args.output)));
    if faults.is_empty() {
        return Ok(if interrupt::asked() { Exit::Interrupted } else { Exit::Done });
    }
    Err(Failure { exit: Exit::Output, message: faults.iter().map(|f| format!("error: {f}\n")).collect() })
}

fn is_ply(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ply"))
}

fn names(paths: &[PathBuf]) -> String {
    paths.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(", ")
}

fn write_text(path: &Path, text: &str) -> Option<Fault> {
    write_atomic(path, |out| out.write_all(text.as_bytes()).map_err(|e| Fault::new(reason(&e)))).err()
}

/// Options that choose among walks have no meaning here.
fn refuse_walks(args: &RenderArgs) -> Result<(), Failure> {
    let t = &args.transport;
    let given = [
        ("--techniques", t.techniques.is_some()),
        ("--min-length", t.min_length != 1),
        ("--max-length", t.max_length.is_some()),
        ("--paths", t.paths.is_some()),
        ("--light-paths", t.light_paths.is_some()),
        ("--connections", t.connections != 1),
        ("--time", args.time.is_some()),
    ];
    match given.iter().find(|g| g.1) {
        Some((name, _)) => Err(Failure::usage(format!("{name} is about walks; finite elements have none"))),
        None => Ok(()),
    }
}

/// What a solution consists of.
struct Solved {
    mesh: Elements,
    sources: Sources,
    radiance: Vec<Rgb>,
}

impl Solved {
    fn smooth(&self, scene: &Scene) -> Smooth {
        Smooth::new(scene, &self.mesh, &self.sources, &self.radiance)
    }
}

struct Job<'a> {
    args: &'a RenderArgs,
    opened: &'a Opened,
    method: Method,
    figures: BTreeMap<&'static str, serde_json::Value>,
    log: String,
}

impl Job<'_> {
    fn seed(&self) -> u64 {
        self.args.seed.unwrap_or(self.opened.scene.seed)
    }

    fn talk(&self, text: &str) {
        if !self.args.quiet {
            tell(text);
        }
    }

    fn figure(&mut self, name: &'static str, value: impl Into<serde_json::Value>) {
        self.figures.insert(name, value.into());
    }

    /// What of the scene is not taken as it stands.
    fn notes(&self) -> String {
        match self.opened.scene.integrator.max_depth {
            Some(depth) => format!("note: the matrix equation has all path lengths; max_depth {depth} is left aside\n"),
            None => String::new(),
        }
    }

    fn failure(&self, error: &ElementsError) -> Failure {
        let ElementsError::Memory { elements, needed, allowed } = error else { return Failure::usage(error.to_string()) };
        let (needed, allowed) = (show_bytes(*needed), show_bytes(*allowed));
        let of = if self.args.max_memory.is_some() { "--max-memory is" } else { "the machine has free" };
        let other = "take fewer by --elements, raise --max-memory, or --iteration stochastic, which stores no matrix";
        let message = format!("error: {elements} elements need {needed}; {of} {allowed}\n  help: {other}\n");
        Failure { exit: Exit::Usage, message }
    }

    fn solve(&mut self) -> Result<Solved, Failure> {
        let scene = &self.opened.scene;
        let before = Instant::now();
        self.check_memory(self.args.elements.count as usize)?;
        let mesh = self.mesh()?;
        let n = mesh.len();
        self.check_memory(n)?;
        self.check_interrupt()?;
        self.figure("elements", n);
        self.talk(&format!("estimator {}: {n} elements in {}\n", self.method.name(), show_duration(before.elapsed())));
        let smooth = mesh.smooth_shapes().len();
        if smooth > 0 {
            let shapes = if smooth == 1 { "1 shape has".to_owned() } else { format!("{smooth} shapes have") };
            self.talk(&format!("warning: {shapes} interpolated normals, which are ignored: light falls on flat facets\n"));
        }
        let sources = Sources::new(scene, &mesh, SOURCE_SAMPLES, self.seed());
        let radiance = match self.method {
            Method::Stochastic => self.stochastic(&mesh, &sources),
            _ => self.with_matrix(&mesh, &sources)?,
        };
        Ok(Solved { mesh, sources, radiance })
    }

    /// Refuses a matrix beyond the limit, before and after it is known how many elements there are.
    fn check_memory(&self, elements: usize) -> Result<(), Failure> {
        let matrix = match self.method {
            Method::Stochastic => return Ok(()),
            Method::Invert => invert::bytes(elements),
            Method::Iterate(_) => 0,
        };
        let needed = Factors::bytes(elements, self.args.elements.element_rays).saturating_add(matrix);
        let allowed = output::allowed_memory(self.args.max_memory);
        if needed > allowed {
            return Err(self.failure(&ElementsError::Memory { elements, needed, allowed }));
        }
        Ok(())
    }

    /// Refuses to go on where somebody asked to stop and there is no solution yet.
    fn check_interrupt(&self) -> Result<(), Failure> {
        if interrupt::asked() {
            return Err(Failure { exit: Exit::Interrupted, message: "interrupted before there was a solution\n".into() });
        }
        Ok(())
    }

    fn mesh(&self) -> Result<Elements, Failure> {
        let (scene, options) = (&self.opened.scene, &self.args.elements);
        let elements = options.count as usize;
        let mesh = match options.subdivision {
            SubdivisionName::Uniform => Elements::new(scene, elements),
            SubdivisionName::Adaptive => {
                let (error, seed) = (options.element_error, self.seed());
                subdivide(scene, &Subdivision { elements, error, source_samples: SOURCE_SAMPLES, seed })
            }
        };
        mesh.map_err(|e| self.failure(&e))
    }

    fn with_matrix(&mut self, mesh: &Elements, sources: &Sources) -> Result<Vec<Rgb>, Failure> {
        let rays = self.args.elements.element_rays;
        let before = Instant::now();
        let factors = Factors::cast(&self.opened.scene, mesh, &ray_counts(mesh, sources, rays), self.seed());
        self.check_interrupt()?;
        let [open, closed] = factors.closure_error;
        self.talk(&format!(
            "{} form factors by {} rays in {}; closure off by {:.2} % at most, after scaling by {closed:.1e}\n",
            factors.entries(),
            factors.rays(),
            show_duration(before.elapsed()),
            100.0 * open
        ));
        self.figure("form_factors", factors.entries());
        self.figure("form_factor_rays", factors.rays());
        self.figure("form_factor_seconds", before.elapsed().as_secs_f64());
        self.figure("closure_error", closed);
        let before = Instant::now();
        let radiance = match self.method {
            Method::Iterate(how) => self.iterate(&factors, sources, how),
            _ => {
                let allowed = output::allowed_memory(self.args.max_memory);
                invert::invert(&factors, sources, allowed).map_err(|e| self.failure(&e))?
            }
        };
        self.figure("solve_seconds", before.elapsed().as_secs_f64());
        self.talk(&format!("solved in {}\n", show_duration(before.elapsed())));
        Ok(radiance)
    }

    fn iterate(&mut self, factors: &Factors, sources: &Sources, how: Iteration) -> Vec<Rgb> {
        let options = &self.args.elements;
        let until = Until { residual: options.residual, sweeps: options.iterations.unwrap_or(ITERATIONS[1]) };
        let solution = iterate(factors, sources, how, until, |_: &Step| !interrupt::asked());
        self.log = "sweep,transfers,residual_flux,residual_max\n".into();
        for s in &solution.log {
            self.log += &format!("{},{},{:e},{:e}\n", s.sweep, s.transfers, s.flux, s.largest);
        }
        if let Some(last) = solution.log.last() {
            self.talk(&format!(
                "{} sweeps, {} rows or columns; residual {:.1e} of the sources in flux, {:.1e} at most\n",
                last.sweep, last.transfers, last.flux, last.largest
            ));
            self.figure("sweeps", last.sweep);
            self.figure("residual_flux", last.flux);
        }
        if !solution.converged {
            self.talk("warning: the residual did not become as small as asked by --residual\n");
        }
        solution.radiance
    }

    fn stochastic(&mut self, mesh: &Elements, sources: &Sources) -> Vec<Rgb> {
        let options = &self.args.elements;
        let iterations = options.iterations.unwrap_or(ITERATIONS[0]);
        let rays = (u64::from(options.element_rays) * mesh.len() as u64 / u64::from(iterations)).max(1);
        let before = Instant::now();
        let effort = Effort { iterations, rays, seed: self.seed() };
        let solution = stochastic(&self.opened.scene, mesh, sources, effort, |_: &Batch| !interrupt::asked());
        self.log = "iterations,rays,relative_standard_error\n".into();
        for b in &solution.log {
            self.log += &format!("{},{},{:e}\n", b.iterations, b.rays, b.error);
        }
        if let Some(last) = solution.log.last() {
            let seconds = before.elapsed().as_secs_f64();
            self.talk(&format!(
                "{} iterations, {} rays in {} ({}rays/s); standard error {:.2} % of radiance\n",
                last.iterations,
                last.rays,
                show_duration(before.elapsed()),
                show_count(last.rays as f64 / seconds.max(1e-9)),
                100.0 * last.error
            ));
            self.figure("iterations", last.iterations);
            self.figure("rays", last.rays);
            self.figure("solve_seconds", seconds);
            self.figure("relative_standard_error", last.error);
        }
        solution.radiance
    }

    /// Says how far from the truth the solution may be.
    fn judge(&mut self, solved: &Solved) {
        let [points, rays] = BOUND;
        let Bound { residual, residual_at_most, radiance, q } =
            bound(&self.opened.scene, &solved.mesh, &solved.radiance, points, rays, self.seed());
        let known = Bound { residual, residual_at_most, radiance, q };
        self.figure("residual_rms", residual);
        self.figure("residual_rms_at_most", residual_at_most);
        self.figure("radiance_rms", radiance);
        self.figure("contraction", q);
        let is = format!("root mean square of Lᵉ + τL − L {residual:.3e}, of L {radiance:.3e}; q = {q:.3}");
        match (known.error(), known.relative()) {
            (Some(error), Some(relative)) => {
                self.figure("error_bound", error);
                self.figure("relative_error_bound", relative);
                self.talk(&format!("{is}: error {error:.3e} at most, {:.1} % of L\n", 100.0 * relative));
            }
            _ => self.talk(&format!("{is}: no bound of the error\n")),
        }
    }

    /// The solution seen through the sensor.
    fn film(&self, solved: &Solved, smooth: Option<&Smooth>) -> Result<Film, Failure> {
        let how = View { passes: self.args.spp.unwrap_or(DEFAULT_SPP), seed: self.seed(), crop: None };
        let film = view(&self.opened.scene, &solved.mesh, &solved.sources, &solved.radiance, smooth, &how);
        film.map_err(|e| Failure::usage(e.to_string()))
    }

    fn write_meshes(&self, paths: &[PathBuf], solved: &Solved, smooth: Option<&Smooth>) -> Vec<Fault> {
        if paths.is_empty() {
            return vec![];
        }
        let f = facets(&self.opened.scene, &solved.mesh, &solved.sources, &solved.radiance, smooth);
        let exposure = self.args.exposure;
        let write =
            |path: &PathBuf| write_atomic(path, |out| ply::write(out, &f.positions, &f.radiance, &f.triangles, exposure)).err();
        paths.iter().filter_map(write).collect()
    }

    /// What the image file says about itself.
    fn attributes(&self, command: &[OsString]) -> BTreeMap<String, String> {
        let mut entries = vec![
            ("software", format!("nephroid {}", env!("CARGO_PKG_VERSION"))),
            ("sceneHash", self.opened.scene.hash_hex()),
            ("estimator", self.method.name().to_owned()),
            ("seed", self.seed().to_string()),
            ("command", command_line(command)),
        ];
        for (name, figure) in [("elements", "elements"), ("errorBound", "error_bound")] {
            entries.extend(self.figures.get(figure).map(|v| (name, v.to_string())));
        }
        entries.into_iter().map(|(k, v)| (k.to_owned(), v)).collect()
    }

    fn statistics(&self, command: &[OsString]) -> serde_json::Value {
        let mut all = serde_json::json!({
            "version": env!("CARGO_PKG_VERSION"),
            "command": command_line(command),
            "scene": self.args.scene.scene.to_string_lossy(),
            "scene_hash": self.opened.scene.hash_hex(),
            "estimator": self.method.name(),
            "seed": self.seed(),
            "element_rays": self.args.elements.element_rays,
            "threads": rayon::current_num_threads(),
        });
        if let Some(map) = all.as_object_mut() {
            self.figures.iter().for_each(|(k, v)| drop(map.insert((*k).to_owned(), v.clone())));
        }
        all
    }
}
