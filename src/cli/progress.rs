//! The progress line: share done, samples per second and time left, only on a terminal.

use super::units::{show_count, show_duration};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::time::Duration;

/// A line on standard error that is rewritten after each pass.
pub struct ProgressLine {
    bar: Option<ProgressBar>,
    passes: Option<u64>,
    time: Option<Duration>,
    pixels: u64,
}

impl ProgressLine {
    /// For a budget of passes and time over so many pixels; nothing is shown when quiet, nor where
    /// standard error is not a terminal.
    pub fn new(quiet: bool, passes: Option<u64>, time: Option<Duration>, pixels: u64) -> Self {
        let bar = (!quiet && std::io::stderr().is_terminal()).then(|| {
            let bar = ProgressBar::with_draw_target(Some(1000), ProgressDrawTarget::stderr_with_hz(10));
            let style = ProgressStyle::with_template("{bar:30} {msg}").unwrap_or_else(|_| ProgressStyle::default_bar());
            bar.with_style(style)
        });
        Self { bar, passes, time, pixels }
    }

    /// After `passes` passes and `elapsed` time.
    pub fn update(&self, passes: u64, elapsed: Duration) {
        let Some(bar) = &self.bar else { return };
        let share = self.share(passes, elapsed);
        bar.set_position((share * 1000.0) as u64);
        bar.set_message(self.message(passes, elapsed, share));
    }

    /// Removes the line.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }

    /// Share of the budget that is used up, of passes or of time, whichever is further.
    fn share(&self, passes: u64, elapsed: Duration) -> f64 {
        let of = |done: f64, all: f64| if all > 0.0 { done / all } else { 0.0 };
        let by_passes = self.passes.map_or(0.0, |n| of(passes as f64, n as f64));
        let by_time = self.time.map_or(0.0, |t| of(elapsed.as_secs_f64(), t.as_secs_f64()));
        by_passes.max(by_time).min(1.0)
    }

    fn message(&self, passes: u64, elapsed: Duration, share: f64) -> String {
        let seconds = elapsed.as_secs_f64().max(1e-9);
        let rate = show_count(passes as f64 * self.pixels as f64 / seconds);
        let of = self.passes.map_or(String::new(), |n| format!("/{n}"));
        let left = if share > 0.0 {
            let left = Duration::try_from_secs_f64(seconds * (1.0 - share) / share).unwrap_or(Duration::MAX);
            format!(", {} left", show_duration(left))
        } else {
            String::new()
        };
        format!("{passes}{of} passes, {rate}samples/s{left}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn share_rate_and_rest() {
        let second = Duration::from_secs(1);
        let line = ProgressLine { bar: None, passes: Some(64), time: Some(20 * second), pixels: 1_000_000 };
        assert_eq!(line.share(16, 4 * second), 0.25);
        assert_eq!(line.share(16, 10 * second), 0.5);
        assert_eq!(line.message(16, 8 * second, 0.25), "16/64 passes, 2.00 Msamples/s, 24.0 s left");
    }
}
