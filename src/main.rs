//! The program `nephroid`; see [`nephroid::cli`].

use std::process::ExitCode;

fn main() -> ExitCode {
    nephroid::cli::run(std::env::args_os())
}
