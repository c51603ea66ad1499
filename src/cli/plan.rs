//! `--plan FILE`: what a pilot chose, to be looked at, changed, and used for other images of a series.

use super::Failure;
use crate::io::fault::{Fault, reason};
use crate::io::write::write_atomic;
use crate::transport::sample_map::SampleMap;
use crate::transport::settings::{FAINT, Plan, Settings, Techniques};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Arc;

/// A longer file is no plan.
const MOST_BYTES: u64 = 65_536;

/// So that a pass ends.
const MOST_CHAIN_SAMPLES: u32 = 65_536;

/// Joins and numbers of walks, as they stand in the file.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PlanFile {
    /// Such as `hit, nee, splat`.
    techniques: String,
    /// Per pass; 0 where nothing shoots.
    light_paths: u32,
    /// From each gathering vertex.
    connections: u32,
    /// In the first pass; 0 where nothing merges.
    merge_radius: f32,
    /// Share of a pixel below which a branch between eye and lamp is left to chance; 1: all are.
    #[serde(default = "faint")]
    faint_branches: f32,
    /// Of the paths between eye and lamp, per pixel and pass.
    #[serde(default = "one")]
    chain_samples: u32,
    /// Gathering walks go where a pilot found that light comes from.
    #[serde(default)]
    guided_gathering: bool,
    /// Gathering walks of pixels in a pass, a digit for each cell of a grid over the picture, in rows; none: one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    samples: Vec<String>,
}

fn faint() -> f32 {
    FAINT
}

fn one() -> u32 {
    1
}

/// Of a row of numbers.
fn digits(row: &[u8]) -> String {
    row.iter().map(|n| char::from(b'0' + n)).collect()
}

/// Of a row of digits.
fn numbers(row: &str) -> Option<Vec<u8>> {
    row.chars().map(|c| c.to_digit(10).and_then(|n| u8::try_from(n).ok())).collect()
}

/// As text, for files and for images' attributes.
pub fn text(plan: &Plan) -> String {
    let s = &plan.settings;
    let file = PlanFile {
        techniques: s.techniques.names(),
        light_paths: plan.light_paths,
        connections: s.connections,
        merge_radius: plan.merge_radius,
        faint_branches: s.faint,
        chain_samples: s.chain_samples,
        guided_gathering: plan.incident.is_some(),
        samples: s.samples.rows().map(digits).collect(),
    };
    serde_json::to_string(&file).unwrap_or_default()
}

/// Takes the plan of an existing file into `settings`; whether there was one.
pub fn read(path: &Path, settings: &mut Settings) -> Result<bool, Failure> {
    let wrong = |what: String| Failure::usage(format!("--plan {}: {what}", path.display()));
    let size = match std::fs::metadata(path) {
        Ok(m) => m.len(),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(false),
        Err(e) => return Err(wrong(reason(&e))),
    };
    if size > MOST_BYTES {
        return Err(wrong(format!("a plan is a few lines of JSON, not {size} bytes")));
    }
    let text = std::fs::read_to_string(path).map_err(|e| wrong(reason(&e)))?;
    let file: PlanFile = serde_json::from_str(&text).map_err(|e| wrong(e.to_string()))?;
    let known = Techniques::NAMES.join(", ");
    let techniques =
        Techniques::parse(&file.techniques).map_err(|name| wrong(format!("unknown technique `{name}` (known: {known})")))?;
    if !(file.merge_radius >= 0.0 && file.merge_radius.is_finite()) {
        return Err(wrong(format!("merge_radius is {}, expected a length of at least 0", file.merge_radius)));
    }
    if !(0.0..=1.0).contains(&file.faint_branches) {
        return Err(wrong(format!("faint_branches is {}, expected 0 to 1", file.faint_branches)));
    }
    if !(1..=MOST_CHAIN_SAMPLES).contains(&file.chain_samples) {
        return Err(wrong(format!("chain_samples is {}, expected 1 to {MOST_CHAIN_SAMPLES}", file.chain_samples)));
    }
    let samples = file.samples.iter().map(|row| numbers(row)).collect::<Option<Vec<_>>>();
    let Some(samples) = samples.and_then(|rows| SampleMap::from_rows(&rows)) else {
        return Err(wrong("samples are rows of digits from 1 to 9, all of the same length".into()));
    };
    settings.samples = Arc::new(samples);
    settings.techniques = techniques;
    settings.light_paths = (file.light_paths > 0).then_some(file.light_paths);
    settings.connections = file.connections;
    settings.merge_radius = Some(file.merge_radius);
    settings.faint = file.faint_branches;
    settings.chain_samples = file.chain_samples;
    settings.guided_gathering = file.guided_gathering;
    settings.automatic = false;
    Ok(true)
}

/// Writes the plan to a new file.
pub fn write(path: &Path, plan: &Plan) -> Result<(), Fault> {
    write_atomic(path, |out| {
        use std::io::Write;
        writeln!(out, "{}", text(plan)).map_err(|e| Fault::new(reason(&e)))
    })
}
