//! `adjoint`: statements of the theory, tested on a scene; exit code 1 where one does not hold.

use super::args::{AdjointArgs, ProofArgs};
use super::open::{self, Opened};
use super::{Exit, Failure, say, tell};
use crate::cli::args::SceneArgs;
use crate::proof::adjoint::{self, Effort};
use serde::Serialize;

/// Longest side of a film that nobody asked for.
const SIDE: u32 = 96;

/// Prints both sides of every n.
pub fn adjoint(args: &AdjointArgs) -> Result<Exit, Failure> {
    let opened = opened(&args.scene, args.size)?;
    let effort = Effort {
        renders: args.effort.renders as usize,
        passes: args.effort.passes,
        time: args.effort.time,
        seed: args.effort.seed,
        max_length: args.max_length,
        paths: args.paths.clone(),
    };
    let found = adjoint::adjoint(&opened.scene, &effort).map_err(|e| Failure::usage(e.to_string()))?;
    print(&args.effort, &found, found.to_text(args.classes, args.blocks));
    Ok(verdict(found.agree))
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
