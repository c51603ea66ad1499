//! Why a file cannot be read or written: one sentence, and what to do about it.
//!
//! The readers of this room return a [`Fault`] instead of printing; `assets::decode` gives it the
//! place where the scene names the file. Bytes of a foreign file only get into a message escaped,
//! so that no message can send control characters to a terminal.

use std::fmt;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// What is wrong with a file, in one line without a full stop, and what to do about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// What is wrong, and where in the file.
    pub what: String,
    /// What to do about it.
    pub hint: Option<String>,
}

impl Fault {
    /// A fault without a hint.
    pub fn new(what: impl Into<String>) -> Self {
        Self { what: what.into(), hint: None }
    }

    /// Adds what to do about it.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// Puts `before` in front of the sentence (a file name, as a rule).
    #[must_use]
    pub fn within(mut self, before: impl fmt::Display) -> Self {
        self.what = format!("{before}: {}", self.what);
        self
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.hint {
            Some(hint) => write!(f, "{} ({hint})", self.what),
            None => f.write_str(&self.what),
        }
    }
}

impl std::error::Error for Fault {}

/// A value read from a file, with what was odd about it but did not prevent reading.
#[derive(Clone, Debug, PartialEq)]
pub struct Decoded<T> {
    /// The value.
    pub value: T,
    /// One sentence each, without a full stop.
    pub warnings: Vec<String>,
}

/// Runs a decoder of another crate. They return errors for all damage we know of; should one panic
/// on some file all the same, that is the file's fault and not the end of the process.
pub(super) fn guarded<T>(decode: impl FnOnce() -> Result<T, Fault>) -> Result<T, Fault> {
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(decode))
        .unwrap_or_else(|_| Err(Fault::new("is damaged in a way that its decoder cannot handle")))
}

/// At most 40 bytes of a foreign file as printable text; longer ones end in `…`.
pub fn escape(bytes: &[u8]) -> String {
    let cut = &bytes[..bytes.len().min(40)];
    let mut text = String::with_capacity(cut.len());
    for chunk in cut.utf8_chunks() {
        for c in chunk.valid().chars() {
            if c.is_control() { text.extend(c.escape_default()) } else { text.push(c) }
        }
        // A character cut in two by the limit is no fault of the file.
        if chunk.invalid().len() < 4 && cut.len() < bytes.len() && cut.ends_with(chunk.invalid()) {
            continue;
        }
        text.extend(chunk.invalid().iter().map(|b| format!("\\x{b:02x}")));
    }
    if cut.len() < bytes.len() {
        text.push('…');
    }
    text
}

/// A path as printable text in back quotes.
pub fn quote(path: &Path) -> String {
    let text = path.to_string_lossy();
    let clean: String = text.chars().flat_map(|c| if c.is_control() { c.escape_default().collect() } else { vec![c] }).collect();
    format!("`{clean}`")
}

/// The whole content of an ordinary file. Devices, pipes and directories are refused: reading
/// them may never end. A missing file gets the nearest name of its directory as a hint.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>, Fault> {
    let named = |e: io::Error| {
        let fault = Fault::new(reason(&e));
        if e.kind() == io::ErrorKind::NotFound { missing(path) } else { fault }
    };
    let kind = std::fs::metadata(path).map_err(named)?;
    if kind.is_dir() {
        return Err(Fault::new("is a directory, not a file"));
    }
    if !kind.is_file() {
        return Err(Fault::new("is a device or a pipe, not an ordinary file"));
    }
    let mut bytes = Vec::new();
    let length = usize::try_from(kind.len()).map_err(|_| Fault::new("does not fit in memory"))?;
    bytes.try_reserve_exact(length).map_err(|_| Fault::new(format!("does not fit in memory ({length} bytes)")))?;
    // A file that grows while it is read would otherwise have no bound.
    File::open(path).and_then(|f| f.take(kind.len()).read_to_end(&mut bytes)).map_err(named)?;
    Ok(bytes)
}

/// An error of the operating system, as one sentence.
pub fn reason(e: &io::Error) -> String {
    let text = e.to_string().replace(['\n', '\r'], " ");
    let mut chars = text.chars();
    let lower: String = chars.next().into_iter().flat_map(char::to_lowercase).collect();
    lower + chars.as_str()
}

/// The fault of an operation of the operating system.
pub fn io_fault(e: io::Error) -> Fault {
    let fault = Fault::new(reason(&e));
    match e.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            fault.hint("free some space or choose another place with -o")
        }
        _ => fault,
    }
}

/// The fault of a file that is not there, naming the first directory that is missing or else the
/// most similar name beside it.
pub fn missing(path: &Path) -> Fault {
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !parent.is_dir() {
        let deepest = parent.ancestors().find(|a| a.as_os_str().is_empty() || a.is_dir());
        let first_missing = parent.ancestors().take_while(|a| Some(*a) != deepest).last().unwrap_or(parent);
        let fault = Fault::new(format!("does not exist: there is no directory {}", quote(first_missing)));
        return match nearest_name(first_missing) {
            Some(near) => fault.hint(format!("did you mean {}?", quote(Path::new(&near)))),
            None => fault,
        };
    }
    let fault = Fault::new("does not exist");
    match nearest_name(path) {
        Some(near) => fault.hint(format!("did you mean {}?", quote(Path::new(&near)))),
        None => fault.hint(format!("nothing in {} has a similar name", quote(parent))),
    }
}

/// The entry of the path's directory whose name is most like the path's own.
fn nearest_name(path: &Path) -> Option<String> {
    let wanted = path.file_name()?.to_string_lossy().to_lowercase();
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    // The bound keeps a directory of millions of files from delaying an error message.
    let names = std::fs::read_dir(parent).ok()?.take(10_000).flatten().map(|e| e.file_name().to_string_lossy().into_owned());
    let scored = names.map(|n| (strsim::normalized_damerau_levenshtein(&wanted, &n.to_lowercase()), n));
    let best = scored.filter(|(s, _)| *s >= 0.6).max_by(|a, b| a.0.total_cmp(&b.0).then_with(|| b.1.cmp(&a.1)))?;
    Some(best.1)
}
