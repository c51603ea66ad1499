//! Renderers that are not ours, on the same scene files, in the same tables.
//!
//! A peer is a program that speaks lines of JSON ([`process`]): it is told a scene once and a run at a time,
//! and answers with an image at every mark. A new one is a script, a file like [`mitsuba`] that starts it, and
//! a line in `PEERS`.

pub mod mitsuba;
pub mod process;

use super::Subject;
use process::Process;

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
const PEERS: [Kind; 1] =
    [Kind { name: "mitsuba", usage: "mitsuba[:variant[:integrator]]", complete: mitsuba::complete, start: mitsuba::start }];

/// What a peer has to render.
pub struct Job<'a, 's> {
    /// The scene.
    pub subject: &'a Subject<'s>,
    /// Values for `$name` in it.
    pub define: &'a [(String, String)],
    /// Threads.
    pub threads: usize,
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
    }
}
