//! What is wrong with a scene: collected, never printed or thrown one by one.

use super::{Place, Sources};
use std::fmt::Write;

/// How bad a problem is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// The scene renders all the same.
    Warning,
    /// Nothing is rendered.
    Error,
}

/// One thing that is wrong.
#[derive(Clone, Debug, PartialEq)]
pub struct Problem {
    /// How bad.
    pub severity: Severity,
    /// Where, if it has a place.
    pub place: Place,
    /// What, in one sentence without a full stop.
    pub what: String,
    /// What to do about it (nearest known name, expected range, …).
    pub hint: Option<String>,
}

/// A growing list of problems.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Problems {
    /// In order of discovery, at most [`Problems::MAX_LISTED`].
    pub list: Vec<Problem>,
    /// How many more there were.
    pub unlisted: usize,
    /// The latest of those, so that its hint has a place to go.
    last_unlisted: Option<Problem>,
}

impl Problems {
    /// Problems that are kept: nobody reads more, and hostile input must not fill the memory.
    pub const MAX_LISTED: usize = 1000;

    /// Adds an error.
    pub fn error(&mut self, place: Place, what: impl Into<String>) -> &mut Problem {
        self.push(Severity::Error, place, what.into())
    }

    /// Adds a warning.
    pub fn warning(&mut self, place: Place, what: impl Into<String>) -> &mut Problem {
        self.push(Severity::Warning, place, what.into())
    }

    fn push(&mut self, severity: Severity, place: Place, what: String) -> &mut Problem {
        let problem = Problem { severity, place, what, hint: None };
        if self.list.len() < Self::MAX_LISTED {
            self.list.push(problem);
            return self.list.last_mut().expect("just pushed");
        }
        self.unlisted += 1;
        if severity == Severity::Error && !self.has_errors() {
            let last = self.list.last_mut().expect("full");
            *last = problem;
            return last;
        }
        self.last_unlisted.insert(problem)
    }

    /// At least one error.
    pub fn has_errors(&self) -> bool {
        self.list.iter().any(|p| p.severity == Severity::Error)
    }

    /// All problems with place, source line and caret, as text for people.
    pub fn render(&self, sources: &Sources) -> String {
        let mut out = String::new();
        for p in &self.list {
            let kind = if p.severity == Severity::Error { "error" } else { "warning" };
            let _ = writeln!(out, "{kind}: {}", p.what);
            if let Some(at) = sources.locate(p.place) {
                let _ = writeln!(out, "  --> {at}");
                let line = sources.file(p.place).and_then(|f| f.text.lines().nth(p.place.line.saturating_sub(1) as usize));
                if let Some(line) = line {
                    let number = p.place.line.to_string();
                    let gutter = " ".repeat(number.len());
                    let caret = " ".repeat(p.place.column.saturating_sub(1) as usize);
                    let _ = writeln!(out, " {gutter} |\n {number} | {line}\n {gutter} | {caret}^");
                }
            }
            if let Some(hint) = &p.hint {
                let _ = writeln!(out, "  help: {hint}");
            }
        }
        if self.unlisted > 0 {
            let _ = writeln!(out, "and {} more problems", self.unlisted);
        }
        out
    }
}

impl Problem {
    /// Adds what to do about it.
    pub fn hint(&mut self, hint: impl Into<String>) -> &mut Self {
        self.hint = Some(hint.into());
        self
    }
}
