//! `bench`: estimators side by side on scenes, as a page, as JSON and as CSV.

use super::args::{BenchArgs, SceneArgs};
use super::open::{self, Opened};
use super::{Exit, Failure, interrupt, output, render, tell};
use crate::bench::contender::{Absent, Contender, Walker};
use crate::bench::cost::cost;
use crate::bench::page::{self, PageImage};
use crate::bench::peers::{Job, Peer};
use crate::bench::race::race;
use crate::bench::reference::reference;
use crate::bench::{Effort, Marks, Report, SceneReport, Subject, size, table};
use crate::io::fault::{Fault, reason};
use crate::io::write::write_atomic;
use crate::render::{Estimator, Options};
use std::ffi::OsString;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// End of a run where nobody says.
const TIME: Duration = Duration::from_secs(5);
/// Time for a reference, in ends of runs, where nobody says.
const REFERENCE_RUNS: u32 = 12;

/// Runs every scene, writes after each.
pub fn run(args: &BenchArgs, command: &[OsString]) -> Result<Exit, Failure> {
    let estimators = args.estimators.iter().map(|name| estimator(name)).collect::<Result<Vec<_>, _>>()?;
    let peers = args.peer.iter().map(|p| Peer::parse(p)).collect::<Result<Vec<_>, _>>().map_err(Failure::usage)?;
    if args.reference.is_some() && args.scenes.len() > 1 {
        return Err(Failure::usage("--reference is for one scene; without it references are made and kept beside their scenes"));
    }
    open::set_threads(args.threads);
    let cannot = |e: &std::io::Error| Failure::output(format!("cannot make {}: {}", args.output.display(), reason(e)));
    std::fs::create_dir_all(&args.output).map_err(|e| cannot(&e))?;
    interrupt::install(args.quiet);
    let effort = effort(args);
    let mut bench = Bench { args, effort, estimators, peers, images: Vec::new(), report: Report::default() };
    bench.report = Report {
        version: env!("CARGO_PKG_VERSION"),
        command: render::command_line(command),
        machine: machine().unwrap_or_default(),
        threads: rayon::current_num_threads(),
        marks: bench.effort.marks().into_iter().map(|m| m.text()).collect(),
        runs: args.runs,
        ..Report::default()
    };
    for (i, path) in args.scenes.iter().enumerate() {
        if interrupt::asked() {
            break;
        }
        let name = name(path, &args.scenes[..i]);
        let scene = bench.scene(&name, path).unwrap_or_else(|failure| {
            tell(&format!("{name}: {}", failure.message));
            SceneReport::failed(name.clone(), path.display().to_string(), failure.message)
        });
        bench.say(&scene.verdict.iter().map(|v| format!("  {v}\n")).collect::<String>());
        bench.report.scenes.push(scene);
        bench.report.interrupted = interrupt::asked();
        bench.write()?;
    }
    bench.report.interrupted = interrupt::asked();
    bench.write()?;
    bench.say(&format!("written to {}\n", args.output.join("index.html").display()));
    Ok(match (bench.report.interrupted, bench.report.failed()) {
        (true, _) => Exit::Interrupted,
        (false, true) => Exit::No,
        (false, false) => Exit::Done,
    })
}

/// By name; the known ones where there is none.
fn estimator(name: &str) -> Result<Estimator, Failure> {
    let known = Estimator::ALL.map(Estimator::name).join(", ");
    Estimator::parse(name).ok_or_else(|| Failure::usage(format!("unknown estimator `{name}` (known: {known})")))
}

fn effort(args: &BenchArgs) -> Effort {
    let marks = match &args.spp {
        Some(samples) => Marks::Samples(samples.clone()),
        None => Marks::Time(if args.time.is_empty() { vec![TIME] } else { args.time.clone() }),
    };
    let longest = match &marks {
        Marks::Time(t) => t.iter().max().copied().unwrap_or(TIME),
        Marks::Samples(_) => TIME,
    };
    Effort {
        marks,
        runs: args.runs,
        seed: args.seed,
        reference_error: args.reference_error,
        reference_time: args.reference_time.unwrap_or(longest * REFERENCE_RUNS),
    }
}

/// The folder of a `scene.xml`, else the name of the file; with a number where one before has it already.
fn name(path: &Path, before: &[PathBuf]) -> String {
    let plain = |path: &Path| {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let folder = path.parent().and_then(Path::file_name).map(|f| f.to_string_lossy().into_owned());
        folder.filter(|_| stem == "scene").unwrap_or(stem)
    };
    let own = plain(path);
    match before.iter().filter(|p| plain(p) == own).count() {
        0 => own,
        n => format!("{own} ({})", n + 1),
    }
}

/// The processor's name.
fn machine() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|l| l.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

/// A bench in progress.
struct Bench<'a> {
    args: &'a BenchArgs,
    effort: Effort,
    estimators: Vec<Estimator>,
    peers: Vec<Peer>,
    images: Vec<PageImage>,
    report: Report,
}

impl Bench<'_> {
    fn say(&self, text: &str) {
        if !self.args.quiet {
            tell(text);
        }
    }

    /// Everything about one scene.
    fn scene(&mut self, name: &str, path: &Path) -> Result<SceneReport, Failure> {
        let opened = self.open(path)?;
        let subject = Subject { name: name.to_owned(), path, scene: &opened.scene };
        let [width, height] = size(&opened.scene);
        self.say(&format!("{name}, {width} × {height} pixels\n"));
        let stop = interrupt::asked;
        let reference = reference(&subject, self.args.reference.as_deref(), &self.effort, &stop).map_err(Failure::usage)?;
        let Some(reference) = reference else {
            return Ok(SceneReport::failed(
                name.to_owned(),
                path.display().to_string(),
                "interrupted before its reference was made".into(),
            ));
        };
        let error = reference.error.map_or("unknown noise".into(), |e| format!("standard error {:.2} %", 100.0 * e));
        self.say(&format!("  reference {}, {error}\n", reference.origin));
        let mut contenders = self.contenders(&subject);
        let mut progress = |line: &str| self.say(&format!("  {line}\n"));
        let entries = race(&mut contenders, &reference, &self.effort, &stop, &mut progress);
        let scene = self.report.scenes.len();
        let image =
            |name: &str, pixels: &Vec<[f32; 3]>| PageImage { scene, name: name.to_owned(), width, pixels: pixels.clone() };
        let results = entries.iter().filter(|e| !e.image.is_empty()).map(|e| image(&e.figures.name, &e.image));
        let all: Vec<PageImage> = std::iter::once(image("reference", &reference.picture.mean)).chain(results).collect();
        self.images.extend(all);
        let cost = cost(&opened.scene, &reference, &self.effort, &stop);
        Ok(SceneReport { cost, ..SceneReport::new(&subject, &reference, &self.effort, &entries) })
    }

    fn open(&self, path: &Path) -> Result<Opened, Failure> {
        let args =
            SceneArgs { scene: path.to_owned(), define: self.args.define.clone(), sensor: None, sandbox: None, threads: None };
        let mut described = open::describe(&args)?;
        let sensor = described.description.sensors.get_mut(described.sensor);
        let film = &mut sensor.ok_or_else(|| Failure::usage("the scene has no sensor"))?.film;
        if let Some(size) = self.args.size {
            open::resize(film, size);
        }
        let [_, _, width, height] = film.crop.unwrap_or([0, 0, film.width, film.height]);
        output::check_memory(output::memory_needed(width, height, None, true), None, [width, height])?;
        open::build(described)
    }

    /// All that take part, in the order of the command line.
    fn contenders<'s>(&self, subject: &Subject<'s>) -> Vec<Box<dyn Contender + 's>> {
        let walker = |(i, e): (usize, &Estimator)| {
            let twin = self.estimators[..i].iter().filter(|o| *o == e).count();
            let name = if twin == 0 { e.name().to_owned() } else { format!("{} ({})", e.name(), twin + 1) };
            let options = Options::for_scene(subject.scene, *e);
            Box::new(Walker::with(name, subject.scene, options)) as Box<dyn Contender + 's>
        };
        let job = Job { subject, define: &self.args.define, threads: rayon::current_num_threads() };
        let peer = |p: &Peer| match p.start(&job) {
            Ok(process) => Box::new(process) as Box<dyn Contender + 's>,
            Err(reason) => Box::new(Absent { name: p.name(), reason }),
        };
        self.estimators.iter().enumerate().map(walker).chain(self.peers.iter().map(peer)).collect()
    }

    /// Page, JSON and CSV of what there is.
    fn write(&self) -> Result<(), Failure> {
        let json = serde_json::to_string_pretty(&self.report).unwrap_or_default() + "\n";
        let files = [
            ("index.html", page::html(&self.report, &self.images)),
            ("report.json", json),
            ("report.csv", table::csv(&self.report)),
        ];
        for (name, text) in files {
            let path = self.args.output.join(name);
            let written = write_atomic(&path, |out| out.write_all(text.as_bytes()).map_err(|e| Fault::new(reason(&e))));
            written.map_err(|f| Failure::output(f.to_string()))?;
        }
        Ok(())
    }
}
