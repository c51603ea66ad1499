//! Statements of the theory by the commands that prove them: adjointness, coverage, residuals, closed
//! forms. docs/theory.md says which test holds which statement.

mod adjoint;
mod caustics;
mod cli;
mod explain;
#[path = "../physics/mirrors.rs"]
#[allow(dead_code)]
mod mirrors;
mod residual;
#[path = "../physics/scenes.rs"]
#[allow(dead_code)]
mod scenes;
#[path = "../physics/support.rs"]
#[allow(dead_code)]
mod support;
