//! `adjoint`, `residual`, `selfcheck`, `explain`: statements of the theory, tested on a scene or against closed forms; exit code 1 where one does not hold.

use super::args::{AdjointArgs, ExplainArgs, ProofArgs, ResidualArgs, SelfcheckArgs};
use super::open::{self, Opened};
use super::units::show_duration;
use super::{Exit, Failure, say, tell};
use crate::cli::args::SceneArgs;
use crate::proof::adjoint::{self, Effort};
use crate::proof::{explain, residual, selfcheck};
use crate::render::{Estimator, Options};
use serde::Serialize;
use std::time::Instant;

/// Longest side of a film that nobody asked for.
const SIDE: u32 = 96;

/// Prints both sides of every n.
pub fn adjoint(args: &AdjointArgs) -> Result<Exit, Failure> {
    let mut opened = opened(&args.scene, args.size)?;
    let effort = Effort {
        renders: args.effort.renders as usize,
        passes: args.effort.passes,
        time: args.effort.time,
        seed: args.effort.seed,
        max_length: args.max_length,
        paths: args.paths.clone(),
    };
    let found = adjoint::adjoint(&mut opened.scene, &effort).map_err(|e| Failure::usage(e.to_string()))?;
    print(&args.effort, &found, found.to_text(args.classes, args.blocks));
    Ok(verdict(found.agree))
}

/// Prints both sides of both equations.
pub fn residual(args: &ResidualArgs) -> Result<Exit, Failure> {
    let opened = opened(&args.scene, None)?;
    let effort = residual::Effort {
        points: args.points as usize,
        draws: args.effort.renders as usize,
        walks: args.effort.passes,
        time: args.effort.time,
        seed: args.effort.seed,
        max_length: args.max_length,
    };
    let found = residual::residuals(&opened.scene, &effort);
    print(&args.effort, &found, found.to_text(args.each));
    Ok(verdict(found.zero))
}

/// Prints the table, group by group as they are done.
pub fn selfcheck(args: &SelfcheckArgs) -> Result<Exit, Failure> {
    open::set_threads(args.threads);
    let start = Instant::now();
    let mut rows = Vec::new();
    let mut add = |found: Result<Vec<selfcheck::Row>, selfcheck::Refused>| {
        let found = found.map_err(|e| Failure::usage(e.to_string()))?;
        if !args.json {
            found.iter().for_each(|row| say(&(row.to_text() + "\n")));
        }
        rows.extend(found);
        Ok::<(), Failure>(())
    };
    match &args.mesh {
        Some(path) => add(selfcheck::mesh(path))?,
        None => selfcheck::CHECKS.iter().try_for_each(|check| add(check.run()))?,
    }
    let holding = rows.iter().filter(|r| r.holds).count();
    if args.json {
        say(&(serde_json::to_string_pretty(&rows).unwrap_or_default() + "\n"));
    } else {
        say(&format!("{holding} of {} hold, in {}\n", rows.len(), show_duration(start.elapsed())));
    }
    Ok(verdict(holding == rows.len()))
}

/// Prints what makes a pixel.
pub fn explain(args: &ExplainArgs) -> Result<Exit, Failure> {
    open::set_threads(args.scene.threads);
    let mut described = open::describe(&args.scene)?;
    if let (Some(size), Some(sensor)) = (args.size, described.description.sensors.get_mut(described.sensor)) {
        open::resize(&mut sensor.film, size);
    }
    let opened = open::build(described)?;
    tell(&opened.problems.render(&opened.description.sources));
    let mut options = Options::for_scene(&opened.scene, Estimator::Bidirectional);
    options.settings.seed = args.seed;
    let effort = explain::Effort { samples: args.spp, paths: args.show as usize };
    let found = explain::explain(&opened.scene, &options, args.pixel, effort).map_err(|e| Failure::usage(e.to_string()))?;
    if args.json {
        say(&(serde_json::to_string_pretty(&found).unwrap_or_default() + "\n"));
        return Ok(Exit::Done);
    }
    let shapes = &opened.description.shapes;
    let shape = |i: u32| match shapes.get(i as usize).and_then(|s| s.id.as_deref()) {
        Some(id) => format!("`{id}`"),
        None => format!("shape {i}"),
    };
    let emitters = opened.scene.lights.infos();
    let emitter = |i: u32| match emitters.get(i as usize) {
        Some(e) => e.name(),
        None => format!("emitter {i}"),
    };
    say(&found.to_text(shape, emitter));
    Ok(Exit::Done)
}

/// The scene with a small film: these tests need many walks, not many pixels.
fn opened(args: &SceneArgs, size: Option<[u32; 2]>) -> Result<Opened, Failure> {
    open::set_threads(args.threads);
    let mut described = open::describe(args)?;
    let Some(sensor) = described.description.sensors.get_mut(described.sensor) else {
        return Err(Failure::usage("the scene has no sensor"));
    };
    let film = &mut sensor.film;
    let longest = film.width.max(film.height);
    let small = |v: u32| (u64::from(v) * u64::from(SIDE) / u64::from(longest)).max(1) as u32;
    match size {
        Some(size) => open::resize(film, size),
        None if longest > SIDE => open::resize(film, [small(film.width), small(film.height)]),
        None => {}
    }
    let opened = open::build(described)?;
    tell(&opened.problems.render(&opened.description.sources));
    Ok(opened)
}

fn print(args: &ProofArgs, found: &impl Serialize, text: String) {
    say(&if args.json { serde_json::to_string_pretty(found).unwrap_or_default() + "\n" } else { text });
}

fn verdict(holds: bool) -> Exit {
    if holds { Exit::Done } else { Exit::No }
}
