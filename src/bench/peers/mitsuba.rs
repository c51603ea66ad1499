//! Mitsuba 3 by its Python package. (Its command line waits for ever with fewer than three threads.)

use super::process::Process;
use super::{Job, one_of};

/// Reads the job, renders; speaks the lines of [`super::process`].
const SCRIPT: &[&str] = &[include_str!("mitsuba.py")];

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
    one_of("integrator", integrator, &INTEGRATORS.map(|i| i.0))?;
    let variant = if variant.is_empty() { VARIANT } else { variant };
    Ok(vec![variant.to_owned(), integrator.to_owned()])
}

/// Loads the scene and compiles what has to be compiled.
pub fn start(options: &[String], job: &Job<'_, '_>) -> Result<Process, String> {
    let [variant, integrator] = options else { return Err("a variant and an integrator are needed".into()) };
    let name = format!("mitsuba:{variant}:{integrator}");
    let mut process = job.start(name, "Mitsuba", SCRIPT, &[("variant", variant), ("integrator", integrator)])?;
    process.like = INTEGRATORS.iter().find(|i| i.0 == integrator.as_str()).map(|i| i.1);
    process.remark += ", loading and compiling not counted.";
    Ok(process)
}
