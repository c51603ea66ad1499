//! Mitsuba 3 by its Python package. (Its command line waits for ever with fewer than three threads.)

use super::Job;
use super::process::Process;
use crate::bench::size;
use serde_json::json;
use std::process::Command;

/// Reads the job, renders; speaks the lines of [`super::process`].
const SCRIPT: &str = include_str!("mitsuba.py");

/// Integrators that are compared, with the estimator of ours that sees the same paths.
const INTEGRATORS: [(&str, &str); 2] = [("path", "gather"), ("ptracer", "shoot")];

/// The slowest variant needs nothing but the package.
const VARIANT: &str = "scalar_rgb";

/// Variant and integrator.
pub fn complete(options: &[String]) -> Result<Vec<String>, String> {
    let [variant, integrator] = match options {
        [] => [VARIANT, INTEGRATORS[0].0],
        [v] => [v.as_str(), INTEGRATORS[0].0],
        [v, i] => [v.as_str(), i.as_str()],
        _ => return Err("too many options".into()),
    };
    if !INTEGRATORS.iter().any(|i| i.0 == integrator) {
        return Err(format!("unknown integrator `{integrator}` (known: {})", INTEGRATORS.map(|i| i.0).join(", ")));
    }
    let variant = if variant.is_empty() { VARIANT } else { variant };
    Ok(vec![variant.to_owned(), integrator.to_owned()])
}

/// Loads the scene and compiles what has to be compiled.
pub fn start(options: &[String], job: &Job<'_, '_>) -> Result<Process, String> {
    let [variant, integrator] = options else { return Err("a variant and an integrator are needed".into()) };
    let scene = job.subject.scene;
    let path = std::fs::canonicalize(job.subject.path).map_err(|e| e.to_string())?;
    let define: serde_json::Map<_, _> = job.define.iter().map(|(k, v)| (k.clone(), json!(v))).collect();
    let setup = json!({
        "scene": path.to_str().ok_or("the name of the scene is not UTF-8")?,
        "define": define,
        "variant": variant,
        "integrator": integrator,
        "threads": job.threads,
        "size": size(scene),
        "max_depth": scene.integrator.max_depth.map_or(-1, i64::from),
        "rr_depth": scene.integrator.rr_depth,
        "hide_emitters": scene.integrator.hide_emitters,
    });
    let mut command = Command::new("python3");
    command.arg("-c").arg(SCRIPT);
    let like = INTEGRATORS.iter().find(|i| i.0 == integrator.as_str()).map(|i| i.1);
    let mut process = Process::start(&mut command, format!("mitsuba:{variant}:{integrator}"), size(scene), &setup)?;
    process.like = like;
    let version = process.ready["version"].as_str().unwrap_or("of unknown version").to_owned();
    process.remark = format!("Mitsuba {version}, loading and compiling not counted.");
    Ok(process)
}
