//! What is wrong with a scene: collected, never printed or thrown one by one.

use super::{Place, Sources};
use std::collections::HashMap;
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

    /// There are errors, and more problems than are listed: looking further helps nobody.
    pub fn is_flooded(&self) -> bool {
        self.unlisted > 0 && self.has_errors()
    }

    /// At least one error.
    pub fn has_errors(&self) -> bool {
        self.list.iter().any(|p| p.severity == Severity::Error)
    }

    /// All problems with place, source line and caret, as text for people.
    pub fn render(&self, sources: &Sources) -> String {
        let mut out = String::new();
        let mut lines = HashMap::new();
        for p in &self.list {
            let kind = if p.severity == Severity::Error { "error" } else { "warning" };
            let _ = writeln!(out, "{kind}: {}", p.what);
            if let (Some(at), Some(file)) = (sources.locate(p.place), sources.file(p.place)) {
                let _ = writeln!(out, "  --> {at}");
                let starts = lines.entry(p.place.file).or_insert_with(|| line_starts(&file.text));
                if let Some(line) = starts.get((p.place.line as usize).wrapping_sub(1)).map(|start| &file.text[*start..]) {
                    write_excerpt(&mut out, line, p.place);
                }
            }
            if let Some(hint) = &p.hint {
                let _ = writeln!(out, "  help: {hint}");
            }
        }
        if self.unlisted > 0 {
            let more = if self.has_errors() { "; what comes after was not looked at" } else { "" };
            let _ = writeln!(out, "and {} more problems{more}", self.unlisted);
        }
        out
    }
}

fn line_starts(text: &str) -> Vec<usize> {
    std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect()
}

/// The source line with a caret, cut to a window around the column; control characters become blanks.
fn write_excerpt(out: &mut String, line: &str, place: Place) {
    const WIDTH: usize = 120;
    const FARTHEST: usize = 10_000;
    let column = (place.column as usize).saturating_sub(1);
    if column > FARTHEST {
        return;
    }
    let skipped = if column < WIDTH - 20 { 0 } else { column - WIDTH / 2 };
    let end = |c: &char| *c != '\n' && *c != '\r';
    let shown: String =
        line.chars().take_while(end).skip(skipped).take(WIDTH).map(|c| if c.is_control() { ' ' } else { c }).collect();
    let number = place.line.to_string();
    let gutter = " ".repeat(number.len());
    let caret = " ".repeat(column - skipped);
    let _ = writeln!(out, " {gutter} |\n {number} | {}\n {gutter} | {caret}^", shown.trim_end());
}

impl Problem {
    /// Adds what to do about it.
    pub fn hint(&mut self, hint: impl Into<String>) -> &mut Self {
        self.hint = Some(hint.into());
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::describe::SourceFile;

    fn rendered(text: &str, line: u32, column: u32) -> String {
        let sources = Sources { files: vec![SourceFile { path: "a.xml".into(), text: text.into() }] };
        let mut problems = Problems::default();
        problems.error(Place { file: 1, line, column }, "wrong").hint("do otherwise");
        problems.render(&sources)
    }

    #[test]
    fn a_problem_shows_its_line_and_column() {
        let expected = "error: wrong\n  --> a.xml:2:3\n   |\n 2 |  é<x\n   |   ^\n  help: do otherwise\n";
        assert_eq!(rendered("first\n\té<x\r\nlast", 2, 3), expected);
        assert!(rendered("one", 9, 1).contains("a.xml:9:1\n  help"));
    }

    #[test]
    fn long_lines_are_cut_around_the_column() {
        let text = format!("{}<x{}", "é".repeat(500), "y".repeat(100_000));
        let out = rendered(&text, 1, 501);
        assert!(out.len() < 600);
        let lines: Vec<&str> = out.lines().collect();
        let at = lines[4].chars().position(|c| c == '^').unwrap();
        assert_eq!(lines[3].chars().nth(at), Some('<'));
        assert!(!rendered(&text, 1, 20_000).contains('^'));
    }
}
