//! A contender in a process of its own, by lines of JSON.
//!
//! It is sent a setup, and answers `{"ready": true, …}` or `{"error": "…"}`. Then for every run it is sent
//! `{"seed": …, "file": …, "marks": [{"seconds": …} or {"samples": …}, …]}`, and answers at every mark with
//! `{"seconds": …, "samples": …}` after it has written the image as raw 32 bit floats into the file, waits for a line,
//! and at the end says `{"done": true, "memory": …}`.

use crate::bench::contender::{Contender, Run, Snapshot, Stop};
use crate::bench::effort::Mark;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// Longest silence: loading and compiling large scenes takes minutes.
const PATIENCE: Duration = Duration::from_secs(600);
/// Between two looks at whether somebody wants to stop.
const TICK: Duration = Duration::from_millis(100);
/// Longest time from the end of a pipe to the end of its process.
const LAST_WORDS: Duration = Duration::from_secs(2);

/// A running peer.
pub struct Process {
    name: String,
    child: Child,
    input: ChildStdin,
    lines: Receiver<String>,
    directory: tempfile::TempDir,
    pixels: usize,
    /// What it said when it was ready.
    pub ready: Value,
    /// What has to be known of its figures.
    pub remark: String,
    /// The estimator of ours that sees the same paths.
    pub like: Option<&'static str>,
}

impl Process {
    /// Starts the program, which makes images of this size, and hands it its setup.
    pub fn start(command: &mut Command, name: String, [width, height]: [u32; 2], setup: &Value) -> Result<Self, String> {
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
        // An interrupt at the terminal is for us; the peer is ended in order.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(command, 0);
        let program = command.get_program().to_string_lossy().into_owned();
        let mut child = command.spawn().map_err(|e| format!("{program} cannot be started: {e}"))?;
        let (Some(input), Some(output)) = (child.stdin.take(), child.stdout.take()) else {
            return Err(format!("{program} cannot be spoken to"));
        };
        let (sender, lines) = channel();
        std::thread::spawn(move || {
            // Ends with the process, or when nobody listens any more.
            for line in BufReader::new(output).lines().map_while(Result::ok) {
                if sender.send(line).is_err() {
                    break;
                }
            }
        });
        let directory = tempfile::tempdir().map_err(|e| e.to_string())?;
        let mut process = Self {
            name,
            child,
            input,
            lines,
            directory,
            pixels: width as usize * height as usize,
            ready: Value::Null,
            remark: String::new(),
            like: None,
        };
        process.send(setup)?;
        process.ready = process.answer(&|| false)?.unwrap_or_default();
        Ok(process)
    }

    fn send(&mut self, message: &Value) -> Result<(), String> {
        writeln!(self.input, "{message}").and_then(|()| self.input.flush()).map_err(|_| self.gone())
    }

    /// Why nothing is heard: a process that ends closes its pipes first, so its status may be a moment away.
    fn gone(&mut self) -> String {
        let begin = Instant::now();
        while begin.elapsed() < LAST_WORDS {
            if let Ok(Some(status)) = self.child.try_wait() {
                return format!("the process ended ({status})");
            }
            std::thread::sleep(LAST_WORDS / 100);
        }
        "the process does not listen any more".into()
    }

    /// The next line; nothing where `stop` said so.
    fn answer(&mut self, stop: Stop<'_>) -> Result<Option<Value>, String> {
        let begin = Instant::now();
        loop {
            match self.lines.recv_timeout(TICK) {
                Ok(line) => {
                    // What is no JSON is talk.
                    let Ok(value) = serde_json::from_str::<Value>(&line) else { continue };
                    return match value["error"].as_str() {
                        Some(error) => Err(error.to_owned()),
                        None => Ok(Some(value)),
                    };
                }
                Err(RecvTimeoutError::Disconnected) => return Err(self.gone()),
                Err(RecvTimeoutError::Timeout) if stop() => return Ok(None),
                Err(RecvTimeoutError::Timeout) if begin.elapsed() > PATIENCE => {
                    return Err(format!("no answer for {} s", PATIENCE.as_secs()));
                }
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
    }

    fn file(&self) -> PathBuf {
        self.directory.path().join("image.raw")
    }

    /// The image that was just written.
    fn image(&self) -> Result<Vec<[f32; 3]>, String> {
        let bytes = std::fs::read(self.file()).map_err(|e| format!("the image cannot be read: {e}"))?;
        if bytes.len() != 12 * self.pixels {
            return Err(format!("the image has {} bytes instead of {}", bytes.len(), 12 * self.pixels));
        }
        let number = |b: &[u8]| b.try_into().map_or(f32::NAN, f32::from_le_bytes);
        Ok(bytes.chunks_exact(12).map(|p| [number(&p[..4]), number(&p[4..8]), number(&p[8..])]).collect())
    }
}

impl Contender for Process {
    fn name(&self) -> String {
        self.name.clone()
    }

    fn is_peer(&self) -> bool {
        true
    }

    fn like(&self) -> Option<&'static str> {
        self.like
    }

    fn remark(&self) -> Option<String> {
        Some(self.remark.clone()).filter(|r| !r.is_empty())
    }

    fn run(&mut self, seed: u64, checkpoints: &[Mark], stop: Stop<'_>) -> Result<Option<Run>, String> {
        let mark = |m: &Mark| match m {
            Mark::Time(t) => json!({ "seconds": t.as_secs_f64() }),
            Mark::Samples(n) => json!({ "samples": n }),
        };
        let marks: Vec<Value> = checkpoints.iter().map(mark).collect();
        self.send(&json!({ "seed": seed, "file": self.file(), "marks": marks }))?;
        let mut run = Run::default();
        loop {
            let Some(answer) = self.answer(stop)? else { return Ok(None) };
            if answer["done"] == true {
                run.memory = answer["memory"].as_u64();
                return Ok(Some(run));
            }
            let (seconds, samples) = (answer["seconds"].as_f64(), answer["samples"].as_u64());
            let (Some(seconds), Some(samples)) = (seconds, samples) else { return Err(format!("said `{answer}`")) };
            run.snapshots.push(Snapshot { seconds, samples, image: self.image()? });
            self.send(&json!({}))?;
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
