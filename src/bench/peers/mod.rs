//! Renderers that are not ours, on the same scene files, in the same tables.
//!
//! A peer is a program that speaks lines of JSON ([`process`]): it is told a scene once and a run at a time,
//! and answers with an image at every mark. A new one is a script, a file like [`mitsuba`] that starts it, and
//! a line in `PEERS`. All scripts begin with `common.py`; those that do not read Mitsuba's scenes get theirs from
//! `translate.py`, which refuses what it does not know.

pub mod cycles;
pub mod luxcore;
pub mod mitsuba;
pub mod process;

use super::{Subject, size};
use process::Process;
use serde_json::json;
use std::process::Command;

/// What all scripts begin with.
const COMMON: &str = include_str!("common.py");

/// Names the Python that has the peers' packages, where `python3` has not.
const PYTHON: &str = "NEPHROID_PYTHON";

/// A peer with its options, as on the command line: `mitsuba:llvm_ad_rgb:path`.
#[derive(Clone, Debug, PartialEq)]
pub struct Peer {
    /// Number in [`PEERS`].
    kind: usize,
    options: Vec<String>,
}

/// What starts a peer.
pub struct Kind {
    /// On the command line.
    name: &'static str,
    /// What may follow the name.
    usage: &'static str,
    /// Fills in the options that are missing; the sentence says what is wrong with one.
    complete: fn(&[String]) -> Result<Vec<String>, String>,
    start: fn(&[String], &Job<'_, '_>) -> Result<Process, String>,
}

/// All of them.
const PEERS: [Kind; 3] = [
    Kind { name: "mitsuba", usage: "mitsuba[:variant[:integrator]]", complete: mitsuba::complete, start: mitsuba::start },
    Kind { name: "luxcore", usage: "luxcore[:engine]", complete: luxcore::complete, start: luxcore::start },
    Kind { name: "cycles", usage: "cycles[:integrator]", complete: cycles::complete, start: cycles::start },
];

/// What a peer has to render.
pub struct Job<'a, 's> {
    /// The scene.
    pub subject: &'a Subject<'s>,
    /// Values for `$name` in it.
    pub define: &'a [(String, String)],
    /// Threads.
    pub threads: usize,
}

impl Job<'_, '_> {
    /// Starts a script by Python with the setup that all have in common and its own `options`. `program` is how its remark
    /// begins, with the version and what it says it renders only nearly.
    fn start(&self, name: String, program: &str, script: &[&str], options: &[(&str, &str)]) -> Result<Process, String> {
        let scene = self.subject.scene;
        let path = std::fs::canonicalize(self.subject.path).map_err(|e| e.to_string())?;
        let define: serde_json::Map<_, _> = self.define.iter().map(|(k, v)| (k.clone(), json!(v))).collect();
        let mut setup = json!({
            "scene": path.to_str().ok_or("the name of the scene is not UTF-8")?,
            "define": define,
            "threads": self.threads,
            "size": size(scene),
            "max_depth": scene.integrator.max_depth.map_or(-1, i64::from),
            "rr_depth": scene.integrator.rr_depth,
            "hide_emitters": scene.integrator.hide_emitters,
        });
        for (key, value) in options {
            setup[*key] = json!(value);
        }
        let mut command = Command::new(std::env::var_os(PYTHON).unwrap_or_else(|| "python3".into()));
        command.arg("-c").arg([&[COMMON], script].concat().join("\n"));
        let mut process = Process::start(&mut command, name, size(scene), &setup)?;
        let version = process.ready["version"].as_str().unwrap_or("of unknown version");
        let nearly = process.ready["approximations"].as_array().into_iter().flatten().filter_map(|a| a.as_str());
        let nearly = nearly.collect::<Vec<_>>().join("; ");
        let nearly = if nearly.is_empty() { nearly } else { format!(" (only similar: {nearly})") };
        process.remark = format!("{program} {version}{nearly}");
        Ok(process)
    }
}

/// Whether a peer knows an option; the sentence has those that it knows.
fn one_of(what: &str, name: &str, known: &[&str]) -> Result<(), String> {
    if known.contains(&name) { Ok(()) } else { Err(format!("unknown {what} `{name}` (known: {})", known.join(", "))) }
}

impl Peer {
    /// From the command line; the sentence has the known ones.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut parts = text.split(':').map(str::to_owned);
        let name = parts.next().unwrap_or_default();
        let known = || PEERS.map(|p| p.usage).join(", ");
        let kind =
            PEERS.iter().position(|p| p.name == name).ok_or_else(|| format!("unknown peer `{name}` (known: {})", known()))?;
        let options: Vec<String> = parts.collect();
        let options =
            (PEERS[kind].complete)(&options).map_err(|e| format!("peer `{text}`: {e}; expected {}", PEERS[kind].usage))?;
        Ok(Self { kind, options })
    }

    /// With all options.
    pub fn name(&self) -> String {
        std::iter::once(PEERS[self.kind].name).chain(self.options.iter().map(String::as_str)).collect::<Vec<_>>().join(":")
    }

    /// Loads the scene; the sentence says why it cannot.
    pub fn start(&self, job: &Job<'_, '_>) -> Result<Process, String> {
        (PEERS[self.kind].start)(&self.options, job)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peers_by_name() {
        assert_eq!(Peer::parse("mitsuba").unwrap().name(), "mitsuba:scalar_rgb:path");
        assert_eq!(Peer::parse("mitsuba:llvm_ad_rgb:ptracer").unwrap().name(), "mitsuba:llvm_ad_rgb:ptracer");
        assert!(Peer::parse("mitsuba:scalar_rgb:bdpt").unwrap_err().contains("ptracer"));
        assert!(Peer::parse("mitsuba:a:path:c").is_err());
        assert!(Peer::parse("povray").unwrap_err().contains("mitsuba[:variant"));
        assert_eq!(Peer::parse("luxcore").unwrap().name(), "luxcore:BIDIRCPU");
        assert_eq!(Peer::parse("luxcore:pathcpu").unwrap().name(), "luxcore:PATHCPU");
        assert_eq!(Peer::parse("cycles").unwrap().name(), "cycles:path");
        assert!(Peer::parse("cycles:manifold").unwrap_err().contains("mnee"));
    }
}
