//! The figures as CSV: one line per scene, contender, run and checkpoint.

use super::figures::Report;
use std::fmt::Write;

/// The columns.
const HEAD: &str = "scene,contender,run,seed,seconds,samples,rmse,relmse,relmse_trimmed,flip,reference_mse,reference_relmse,\
reference_relmse_trimmed,gather_rays,shoot_rays,shadow_rays,memory_bytes,variance,efficiency,slope,energy\n";

/// All points of all runs; figures of a whole run stand in the line of its last point.
pub fn csv(report: &Report) -> String {
    let mut out = HEAD.to_owned();
    for scene in &report.scenes {
        for c in &scene.contenders {
            for (i, run) in c.runs.iter().enumerate() {
                for (k, p) in run.curve.iter().enumerate() {
                    let names = format!("{},{}", quoted(&scene.name), quoted(&c.name));
                    let errors =
                        [p.rmse, p.relmse, p.relmse_trimmed, p.flip, p.noise.mse, p.noise.relmse, p.noise.relmse_trimmed];
                    let errors = errors.map(|e| e.to_string()).join(",");
                    let _ = write!(out, "{names},{},{},{},{},{errors}", i + 1, run.seed, p.seconds, p.samples);
                    let last = k + 1 == run.curve.len();
                    let rays = run.rays.filter(|_| last);
                    let number = |v: Option<f64>| v.filter(|_| last).map_or(String::new(), |v| v.to_string());
                    let cells = [
                        rays.map(|r| r.gather as f64),
                        rays.map(|r| r.shoot as f64),
                        rays.map(|r| r.shadow as f64),
                        run.memory.map(|m| m as f64),
                        run.variance,
                        run.variance.map(|v| 1.0 / (v * run.seconds)),
                        run.slope,
                        Some(run.energy),
                    ];
                    let _ = writeln!(out, ",{}", cells.map(number).join(","));
                }
            }
        }
    }
    out
}

/// In quotes where needed.
fn quoted(text: &str) -> String {
    if text.contains(['"', ',', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}
