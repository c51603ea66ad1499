//! Cycles by Blender's Python package `bpy`, on a translation of the scene.

use super::process::Process;
use super::{Job, one_of};

const SCRIPT: &[&str] = &[include_str!("translate.py"), include_str!("cycles.py")];

/// Path tracing, and the same with manifold next event estimation. The second leaves light out where manifolds do not
/// lead to a lamp, so it sees the paths of no estimator of ours.
const INTEGRATORS: [(&str, Option<&str>); 2] = [("path", Some("gather")), ("mnee", None)];

/// The integrator.
pub fn complete(options: &[String]) -> Result<Vec<String>, String> {
    let integrator = match options {
        [] => INTEGRATORS[0].0,
        [integrator] => integrator,
        _ => return Err("too many options".into()),
    };
    one_of("integrator", integrator, &INTEGRATORS.map(|i| i.0))?;
    Ok(vec![integrator.to_owned()])
}

/// Translates and loads the scene.
pub fn start(options: &[String], job: &Job<'_, '_>) -> Result<Process, String> {
    let [integrator] = options else { return Err("an integrator is needed".into()) };
    let mut process = job.start(format!("cycles:{integrator}"), "Cycles of Blender", SCRIPT, &[("integrator", integrator)])?;
    process.like = INTEGRATORS.iter().find(|i| i.0 == integrator.as_str()).and_then(|i| i.1);
    process.remark += ", loading and synchronisation not counted.";
    Ok(process)
}
