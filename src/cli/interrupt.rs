//! Ctrl-C and TERM: the first asks the render to end after its pass, the second ends the process.

use std::sync::atomic::{AtomicBool, Ordering};

static ASKED: AtomicBool = AtomicBool::new(false);

/// From here on signals are handled. Without handler (a platform that has none, or a second call)
/// a signal ends the process as usual.
pub fn install(quiet: bool) {
    let handler = move || {
        if ASKED.swap(true, Ordering::SeqCst) {
            std::process::exit(i32::from(super::Exit::Interrupted as u8));
        }
        if !quiet {
            eprintln!("\nstopping after this pass; once more to quit at once");
        }
    };
    let _ = ctrlc::set_handler(handler);
}

/// Somebody wants the render to end.
pub fn asked() -> bool {
    ASKED.load(Ordering::SeqCst)
}
