//! `render`: a scene file to images, progressively, until the budget is used up or somebody stops it.

use super::args::{EstimatorName, HeuristicName, MaxLength, RenderArgs, SamplerName, TechniqueName};
use super::open::{self, Described, Opened};
use super::output::{self, Outputs};
use super::progress::ProgressLine;
use super::units::{show_count, show_duration};
use super::{Exit, Failure, elements, interrupt, layers, plan, tell};
use crate::io::exr::ImageFile;
use crate::io::fault::{Fault, reason};
use crate::io::png::PngOptions;
use crate::io::write::{write_atomic, write_image};
use crate::render::{Budget, Control, Estimator, Options, Outcome, Progress, Render, Truncation, left_out};
use crate::report::memory;
use crate::scene::Scene;
use crate::transport::class::PathFilter;
use crate::transport::mis::Heuristic;
use crate::transport::settings::{Coupling, FAINT, NO_BRANCHES, Plan, Techniques};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::io::Write;
use std::path::Path;
use std::time::{Duration, Instant};

/// Time between images written during a render; more where writing takes long.
const SAVE_EVERY: Duration = Duration::from_secs(5);
/// Samples per pixel where neither scene nor command line says.
const DEFAULT_SPP: u64 = 64;

/// Renders and writes.
pub fn run(args: &RenderArgs, command: &[OsString]) -> Result<Exit, Failure> {
    if let Some(method) = elements::method(args) {
        if layers::wanted(&args.layers) {
            return Err(Failure::usage("finite elements have no layers: choose an estimator that walks"));
        }
        return elements::run(args, command, method);
    }
    let start = Instant::now();
    let outputs = Outputs::check(args)?;
    layers::check(args)?;
    let paths = args.transport.paths.as_deref().map(PathFilter::parse).transpose();
    let paths = paths.map_err(|e| Failure::usage(format!("--paths: {e}")))?.unwrap_or_default();
    open::set_threads(args.scene.threads);
    let mut described = open::describe(&args.scene)?;
    set_film(&mut described, args)?;
    let opened = open::build(described)?;
    if !args.quiet {
        tell(&opened.problems.render(&opened.description.sources));
    }
    let (estimator, mut options) = options(&opened, args);
    let mut new_plan = None;
    if let Some(path) = &args.transport.plan {
        if estimator != Estimator::Auto {
            return Err(Failure::usage("--plan belongs to --estimator auto"));
        }
        if !plan::read(path, &mut options.settings)? {
            new_plan = Some(path.as_path());
        }
    }
    let all = options.settings.coupling == Coupling::All;
    if args.transport.techniques.is_some() && !all {
        return Err(Failure::usage(format!("--estimator {} has no --techniques to choose from", estimator.name())));
    }
    if args.layers.left_out.is_some() && (all || !paths.accepts_all()) {
        let what = if all {
            "--left-out belongs to --estimator local, local-unshadowed or recursive"
        } else {
            "--left-out takes no --paths"
        };
        return Err(Failure::usage(what));
    }
    if all && !args.quiet && !opened.scene.lights.ambient().is_empty() {
        tell("warning: the ambient light has no effect: only --estimator local, local-unshadowed and recursive know it\n");
    }
    options.settings.paths = paths;
    let truncation = truncate(&opened.scene, &mut options, args)?;
    let (shortest, longest) = (options.settings.min_length, options.settings.max_length);
    if shortest > longest {
        return Err(Failure::usage(format!("no path is at least {shortest} and at most {longest} edges long")));
    }
    options.layers = layers::partitions(&args.layers, &options.settings, &opened.scene)?;
    let film = &opened.scene.film;
    let [_, _, width, height] = film.crop.unwrap_or([0, 0, film.width, film.height]);
    let whole = output::memory_needed(width, height, options.settings.light_paths, options.settings.techniques.shoots());
    output::check_memory(whole, args.max_memory, [width, height])?;
    layers::check_memory(&options.layers, whole, [width, height], args.max_memory)?;
    let budget = budget(&opened.scene, args);
    let mut job = Job { args, command, outputs, estimator, options, truncation, new_plan, budget, start };
    if !args.quiet {
        tell(&job.announcement());
    }
    job.run(&opened.scene)
}

/// Size, crop window and memory of the film of the chosen sensor.
pub(super) fn set_film(described: &mut Described, args: &RenderArgs) -> Result<(), Failure> {
    let Some(sensor) = described.description.sensors.get_mut(described.sensor) else {
        return Err(Failure::usage("the scene has no sensor"));
    };
    let film = &mut sensor.film;
    if let Some(size) = args.size {
        open::resize(film, size);
    }
    if let Some([x, y, w, h]) = args.crop {
        let inside = |from: u32, size: u32, all: u32| from.checked_add(size).is_some_and(|end| end <= all);
        if !inside(x, w, film.width) || !inside(y, h, film.height) {
            let (width, height) = (film.width, film.height);
            return Err(Failure::usage(format!("--crop {x},{y},{w},{h} reaches beyond the film of {width} × {height} pixels")));
        }
        film.crop = Some([x, y, w, h]);
    }
    let [_, _, width, height] = film.crop.unwrap_or([0, 0, film.width, film.height]);
    let shoots = matches!(
        args.estimator,
        EstimatorName::Shoot | EstimatorName::Bidirectional | EstimatorName::Auto | EstimatorName::Scene
    );
    let needed = output::memory_needed(width, height, args.transport.light_paths, shoots);
    output::check_memory(needed, args.max_memory, [width, height])
}

/// The estimator and all that it is told.
fn options(opened: &Opened, args: &RenderArgs) -> (Estimator, Options) {
    let estimator = match args.estimator {
        // Those of finite elements have no walks and do not come here.
        EstimatorName::Gather | EstimatorName::Invert | EstimatorName::Iterate => Estimator::Gather,
        EstimatorName::Shoot => Estimator::Shoot,
        EstimatorName::Local => Estimator::Local,
        EstimatorName::LocalUnshadowed => Estimator::LocalUnshadowed,
        EstimatorName::Recursive => Estimator::Recursive,
        EstimatorName::Bidirectional => Estimator::Bidirectional,
        EstimatorName::Auto => Estimator::Auto,
        EstimatorName::Scene => Estimator::of_integrator(&opened.description.integrator.name),
    };
    let mut options = Options::for_scene(&opened.scene, estimator);
    let (s, t) = (&mut options.settings, &args.transport);
    if let Some(names) = &t.techniques {
        let has = |name| names.contains(&name);
        s.techniques = Techniques {
            hit: has(TechniqueName::Hit),
            next_event: has(TechniqueName::Nee),
            splat: has(TechniqueName::Splat),
            connect: has(TechniqueName::Connect),
            merge: has(TechniqueName::Merge),
        };
    }
    if let Some(name) = t.heuristic {
        s.heuristic = match name {
            HeuristicName::Balance => Heuristic::Balance,
            HeuristicName::Power => Heuristic::Power,
        };
    }
    s.min_length = t.min_length;
    if let Some(MaxLength::Edges(n)) = t.max_length {
        s.max_length = n;
    }
    s.light_paths = t.light_paths;
    s.connections = t.connections;
    s.guided = !t.no_guide;
    s.guided_gathering = t.guide_gathering;
    s.adaptive = !t.no_adaptive;
    s.faint = if t.no_branching { NO_BRANCHES } else { FAINT };
    s.stratified = t.sampler == SamplerName::Stratified;
    s.seed = args.seed.unwrap_or(opened.scene.seed);
    (estimator, options)
}

/// Chooses the longest path where that is asked for, and says why.
fn truncate(scene: &Scene, options: &mut Options, args: &RenderArgs) -> Result<Option<Truncation>, Failure> {
    if args.transport.max_length != Some(MaxLength::Auto) {
        return Ok(None);
    }
    if options.settings.coupling != Coupling::All {
        return Err(Failure::usage("--max-length auto is for estimators that resolve the whole coupling"));
    }
    let film = &scene.film;
    let crop = film.crop.unwrap_or([0, 0, film.width, film.height]);
    let chosen = Truncation::choose(scene, &options.settings, crop, args.transport.truncation);
    options.settings.max_length = chosen.max_length();
    if !args.quiet {
        tell(&explain(&chosen));
    }
    Ok(Some(chosen))
}

/// The choice in words.
fn explain(t: &Truncation) -> String {
    let d = t.scatterings;
    let mut text = match (t.bound, t.flux_at_most) {
        (Some(bound), Some(flux)) => {
            let mut text = format!(
                "max length auto: materials scatter at most q = {:.3}; {d} scatterings, bound q^{} = {bound:.2e}\n",
                t.contraction,
                d + 1
            );
            text += &format!("  no pixel lacks more than {bound:.2e} of the largest radiance of the scene");
            text += if t.unbounded_radiance { " (which has no bound near points, spots and parallel light)\n" } else { "\n" };
            text + &format!("  the scene lacks no more than {bound:.2e} of its flux, which is at most {flux:.3} W\n")
        }
        _ => format!(
            "max length auto: materials scatter up to q = 1 (glass, ideal mirrors): there is no a-priori bound; {d} scatterings by estimate\n"
        ),
    };
    let (tail, ratio) = (t.measured_tail, t.measured_ratio);
    text += &format!(
        "  measured and extrapolated: {tail:.1e} of the image is beyond, terms fall by {ratio:.2} each (an estimate, no bound)\n"
    );
    text
}

/// Passes and time: the command line's, else the scene's passes.
fn budget(scene: &Scene, args: &RenderArgs) -> Budget {
    let of_scene = || scene.sample_count.map_or(DEFAULT_SPP, u64::from);
    let passes = if args.time.is_some() { args.spp } else { Some(args.spp.unwrap_or_else(of_scene)) };
    Budget { passes, time: args.time }
}

/// A command as it could be typed again.
pub(super) fn command_line(command: &[OsString]) -> String {
    let quoted = command.iter().map(|a| {
        let a = a.to_string_lossy();
        let plain = |c: char| c.is_alphanumeric() || "-_./=,:+@%".contains(c);
        if !a.is_empty() && a.chars().all(plain) { a.into_owned() } else { format!("'{}'", a.replace('\'', r"'\''")) }
    });
    quoted.collect::<Vec<_>>().join(" ")
}

/// Everything that stays the same while a render runs.
struct Job<'a> {
    args: &'a RenderArgs,
    command: &'a [OsString],
    outputs: Outputs,
    estimator: Estimator,
    options: Options,
    truncation: Option<Truncation>,
    /// Where to write what the pilot chose.
    new_plan: Option<&'a Path>,
    budget: Budget,
    start: Instant,
}

impl Job<'_> {
    /// One line that says what runs.
    fn announcement(&self) -> String {
        let passes = self.budget.passes.map(|n| format!("{n} samples per pixel"));
        let time = self.budget.time.map(|t| format!("about {}", show_duration(t)));
        let until: Vec<String> = passes.into_iter().chain(time).collect();
        let name = self.estimator.name();
        let joins = self.options.settings.techniques.names();
        format!("estimator {name} ({joins}), {}, seed {}\n", until.join(" or "), self.options.settings.seed)
    }

    /// What a pilot chose.
    fn choice(&self, plan: &Plan, pilot: Duration) -> String {
        let joins = plan.settings.techniques.names();
        let led = if plan.incident.is_some() { "; gathering is led to the light" } else { "" };
        let paths = show_count(f64::from(plan.light_paths));
        let most = plan.settings.samples.rows().flatten().max();
        let walks = most.map_or(String::new(), |n| format!(", up to {n} walks per pixel"));
        format!("chosen in {}: {joins}; {paths} light paths per pass{walks}{led}\n", show_duration(pilot))
    }

    fn run(&mut self, scene: &Scene) -> Result<Exit, Failure> {
        let began = Instant::now();
        let mut render = Render::new(scene, &self.options).map_err(|e| Failure::usage(e.to_string()))?;
        if self.options.settings.automatic && !self.args.quiet {
            tell(&self.choice(render.plan(), began.elapsed()));
        }
        if let Some(path) = self.new_plan {
            plan::write(path, render.plan()).map_err(|f| Failure { exit: Exit::Output, message: format!("error: {f}\n") })?;
        }
        let pixels = u64::from(render.film().width()) * u64::from(render.film().height());
        let line = ProgressLine::new(self.args.quiet, self.budget.passes, self.budget.time, pixels);
        interrupt::install(self.args.quiet);
        let mut save_after = SAVE_EVERY;
        let mut warned = false;
        loop {
            let until = began.elapsed() + save_after;
            let rest = Budget { time: self.budget.time.map(|t| t.saturating_sub(began.elapsed())), ..self.budget };
            let outcome = render.run(&rest, |p| {
                line.update(p.passes, began.elapsed());
                if interrupt::asked() || began.elapsed() >= until { Control::Stop } else { Control::Continue }
            });
            if outcome == Outcome::Finished || interrupt::asked() {
                break;
            }
            let before = Instant::now();
            let faults = self.write(&render, scene);
            // Writing shall not take more than a tenth of the time.
            save_after = SAVE_EVERY.max(before.elapsed() * 10);
            if let (Some(fault), false) = (faults.first(), warned) {
                line.finish();
                tell(&format!("warning: {fault}; going on, the image is tried again later\n"));
                warned = true;
            }
        }
        line.finish();
        self.finish(&render, scene)
    }

    /// Writes the images.
    fn write(&self, render: &Render, scene: &Scene) -> Vec<Fault> {
        let layers = layers::of_image(&self.args.layers, render);
        self.outputs.write(render.film(), &layers, &self.attributes(render, scene))
    }

    /// Writes what there is, and says what was done.
    fn finish(&self, render: &Render, scene: &Scene) -> Result<Exit, Failure> {
        let mut faults = self.write(render, scene);
        faults.extend(layers::write(self.args, render));
        if let Some(path) = &self.args.layers.left_out {
            faults.extend(self.write_left_out(path, scene)?.err());
        }
        if let Some(path) = &self.args.stats {
            let text = serde_json::to_string_pretty(&self.figures(render, scene)).unwrap_or_default() + "\n";
            let written = write_atomic(path, |out| out.write_all(text.as_bytes()).map_err(|e| Fault::new(reason(&e))));
            faults.extend(written.err());
        }
        if !self.args.quiet {
            tell(&self.summary(render));
        }
        if !faults.is_empty() {
            let message = faults.iter().map(|f| format!("error: {f}\n")).collect();
            return Err(Failure { exit: Exit::Output, message });
        }
        Ok(if interrupt::asked() { Exit::Interrupted } else { Exit::Done })
    }

    /// Renders and writes the paths that recursion leaves out, with as many passes.
    fn write_left_out(&self, path: &Path, scene: &Scene) -> Result<Result<(), Fault>, Failure> {
        let passes = self.budget.passes.unwrap_or(DEFAULT_SPP);
        let stop = |_: &Progress| if interrupt::asked() { Control::Stop } else { Control::Continue };
        let rest = left_out(scene, &self.options, passes, stop).map_err(|e| Failure::usage(e.to_string()))?;
        let mut file = ImageFile::new(rest.width, rest.height);
        file.insert_rgb("", &rest.mean);
        file.insert_rgb("variance", &rest.variance);
        Ok(write_image(path, &file, PngOptions { exposure: self.args.exposure, ..PngOptions::default() }))
    }

    fn summary(&self, render: &Render) -> String {
        let s = render.statistics();
        let pixels = f64::from(render.film().width()) * f64::from(render.film().height());
        let samples = (s.passes as f64 * pixels).max(s.rays.gather_walks as f64);
        let rate = samples / s.time.as_secs_f64().max(1e-9);
        let mut text = String::new();
        for (n, what) in [(s.dropped, "not finite and were dropped"), (s.cut, "beyond the film's range and were cut")] {
            if n > 0 {
                text += &format!("warning: {n} contributions were {what}\n");
            }
        }
        text + &format!(
            "{} sample{} per pixel in {}, {}samples/s, written to {}\n",
            s.passes,
            if s.passes == 1 { "" } else { "s" },
            show_duration(self.start.elapsed()),
            show_count(rate),
            self.outputs.names()
        )
    }

    /// What the image file says about itself.
    fn attributes(&self, render: &Render, scene: &Scene) -> BTreeMap<String, String> {
        let s = render.statistics();
        let set = &self.options.settings;
        let entries = [
            ("software", format!("nephroid {}", env!("CARGO_PKG_VERSION"))),
            ("sceneHash", scene.hash_hex()),
            ("estimator", self.estimator.name().to_owned()),
            ("techniques", render.plan().settings.techniques.names()),
            ("plan", plan::text(render.plan())),
            ("seed", set.seed.to_string()),
            ("samples", s.passes.to_string()),
            ("renderTime", format!("{:.3}", s.time.as_secs_f64())),
            ("command", self.command_line()),
        ];
        entries.into_iter().map(|(k, v)| (k.to_owned(), v)).collect()
    }

    fn command_line(&self) -> String {
        command_line(self.command)
    }

    fn figures(&self, render: &Render, scene: &Scene) -> serde_json::Value {
        let s = render.statistics();
        let film = render.film();
        let set = &render.plan().settings;
        let seconds = s.time.as_secs_f64();
        let threads = rayon::current_num_threads();
        let of_all_pixels = s.passes as f64 * f64::from(film.width()) * f64::from(film.height());
        let samples = of_all_pixels.max(s.rays.gather_walks as f64);
        serde_json::json!({
            "version": env!("CARGO_PKG_VERSION"),
            "command": self.command_line(),
            "scene": self.args.scene.scene.to_string_lossy(),
            "scene_hash": scene.hash_hex(),
            "estimator": self.estimator.name(),
            "techniques": render.plan().settings.techniques.names(),
            "heuristic": if set.heuristic == Heuristic::Power { "power" } else { "balance" },
            "paths": set.paths.text(),
            "min_length": set.min_length,
            "max_length": set.max_length,
            "truncation": self.truncation,
            "connections": set.connections,
            "merge_radius": render.plan().merge_radius,
            "guided": set.guided,
            "guided_gathering": render.plan().incident.is_some(),
            "survival": set.survival,
            "faintest_split": set.faintest_split,
            "faint_branches": set.faint,
            "chain_samples": render.plan().chain_samples(),
            "stratified": set.stratified,
            "seed": set.seed,
            "width": film.width(),
            "height": film.height(),
            "threads": threads,
            "samples_per_pixel": s.passes,
            "walks_per_pixel": s.rays.gather_walks as f64 / of_all_pixels.max(1.0),
            "light_paths_per_pass": render.plan().light_paths,
            "render_seconds": seconds,
            "shoot_seconds": s.shoot_time.as_secs_f64(),
            "total_seconds": self.start.elapsed().as_secs_f64(),
            "samples_per_second": samples / seconds.max(1e-9),
            "rays": {
                "gather": s.rays.gather,
                "shoot": s.rays.shoot,
                "shadow": s.rays.shadow,
                "per_second": s.rays.total() as f64 / seconds.max(1e-9),
                "million_per_second_and_thread": s.rays.total() as f64 * 1e-6 / seconds.max(1e-9) / threads as f64,
            },
            "gather_walks": s.rays.gather_walks,
            "shoot_walks": s.rays.shoot_walks,
            "light_vertices_of_last_pass": s.light_vertices,
            "contributions_dropped": s.dropped,
            "contributions_cut": s.cut,
            "peak_memory_bytes": memory::peak(),
            "film_bytes": crate::film::Film::bytes(film.width(), film.height()),
            "interrupted": interrupt::asked(),
        })
    }
}
