//! The command line: words into calls of the library, its answers into text and exit codes.
//!
//! Thin on purpose: nothing here computes. Standard output carries data (`info`, `compare`),
//! standard error everything said to a person.
//!
//! - [`args`], [`units`]: what can be written.
//! - [`open`]: a scene file into a built scene.
//! - [`render`], [`output`], [`progress`], [`interrupt`]: rendering.
//! - [`layers`]: what is written beside the image.
//! - [`elements`]: rendering by finite elements.
//! - [`mod@bench`]: estimators side by side, as a page.
//! - [`info`], [`compare`], [`proof`]: the other subcommands.

pub mod args;
pub mod bench;
pub mod compare;
pub mod elements;
pub mod info;
pub mod interrupt;
pub mod layers;
pub mod open;
pub mod output;
pub mod plan;
pub mod progress;
pub mod proof;
pub mod render;
pub mod units;

use args::{Cli, Command};
use clap::Parser;
use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

/// How the program ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// Done.
    Done = 0,
    /// The answer is no.
    No = 1,
    /// Wrong usage, or a scene with errors.
    Usage = 2,
    /// A result could not be written.
    Output = 4,
    /// Interrupted; what there was is written.
    Interrupted = 130,
}

/// Why a command ended without its result.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// How the program ends.
    pub exit: Exit,
    /// What to tell.
    pub message: String,
}

impl Failure {
    /// Usage or scene error, as one sentence.
    pub fn usage(message: impl Into<String>) -> Self {
        Self { exit: Exit::Usage, message: format!("error: {}\n", message.into()) }
    }

    /// Output error, as one sentence.
    pub fn output(message: impl Into<String>) -> Self {
        Self { exit: Exit::Output, message: format!("error: {}\n", message.into()) }
    }
}

/// Runs the program with these arguments (the first is its own name).
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let cli = match Cli::try_parse_from(&arguments) {
        Ok(cli) => cli,
        Err(e) => {
            // Help asked for goes to standard output, errors to standard error; where the stream is
            // closed there is nobody to tell.
            let _ = e.print();
            return ExitCode::from(u8::try_from(e.exit_code()).unwrap_or(Exit::Usage as u8));
        }
    };
    let outcome = match &cli.command {
        Command::Render(args) => render::run(args, &arguments),
        Command::Check(args) => open::check(args),
        Command::Info(args) => info::run(args),
        Command::Compare(args) => compare::run(args),
        Command::Bench(args) => bench::run(args, &arguments),
        Command::Adjoint(args) => proof::adjoint(args),
        Command::Residual(args) => proof::residual(args),
        Command::Selfcheck(args) => proof::selfcheck(args),
        Command::Explain(args) => proof::explain(args),
    };
    ExitCode::from(match outcome {
        Ok(exit) => exit as u8,
        Err(failure) => {
            tell(&failure.message);
            failure.exit as u8
        }
    })
}

/// Data, to standard output. A closed pipe is the reader's choice, no error.
fn say(text: &str) {
    let _ = std::io::stdout().write_all(text.as_bytes());
}

/// Talk, to standard error, without control characters that a scene may have put into it.
fn tell(text: &str) {
    let control = |c: char| c.is_control() && c != '\n' && c != '\t';
    let clean: String = text.chars().map(|c| if control(c) { '\u{fffd}' } else { c }).collect();
    let _ = std::io::stderr().write_all(clean.as_bytes());
}
