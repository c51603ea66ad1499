//! LuxCore by its Python package `pyluxcore`, on a translation of the scene.

use super::process::Process;
use super::{Job, one_of};

const SCRIPT: &[&str] = &[include_str!("translate.py"), include_str!("luxcore.py")];

/// Render engines that are compared, with the estimator of ours that sees the same paths. The first is run without roulette:
/// with it, its images are too bright.
const ENGINES: [(&str, &str); 2] = [("BIDIRCPU", "bidirectional"), ("PATHCPU", "gather")];

/// The engine.
pub fn complete(options: &[String]) -> Result<Vec<String>, String> {
    let engine = match options {
        [] => ENGINES[0].0.to_owned(),
        [engine] => engine.to_uppercase(),
        _ => return Err("too many options".into()),
    };
    one_of("engine", &engine, &ENGINES.map(|e| e.0))?;
    Ok(vec![engine])
}

/// Translates and loads the scene.
pub fn start(options: &[String], job: &Job<'_, '_>) -> Result<Process, String> {
    let [engine] = options else { return Err("an engine is needed".into()) };
    let mut process = job.start(format!("luxcore:{engine}"), "LuxCore", SCRIPT, &[("engine", engine)])?;
    process.like = ENGINES.iter().find(|e| e.0 == engine.as_str()).map(|e| e.1);
    process.remark += ", loading not counted.";
    Ok(process)
}
