//! Where a value stands: file, line and column.

use std::path::PathBuf;
use std::sync::Arc;

/// A place in one of the scene's source texts; the default means "made in code".
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Place {
    /// Index into [`Sources`] plus one; 0 = no file.
    pub file: u32,
    /// From 1.
    pub line: u32,
    /// From 1, in characters.
    pub column: u32,
}

/// A value with its place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Placed<T> {
    /// The value.
    pub value: T,
    /// Where it stands.
    pub place: Place,
}

impl<T> From<T> for Placed<T> {
    fn from(value: T) -> Self {
        Self { value, place: Place::default() }
    }
}

/// A text that was read.
#[derive(Clone, Debug)]
pub struct SourceFile {
    /// As given or found.
    pub path: PathBuf,
    /// Its whole text.
    pub text: Arc<str>,
}

/// All texts of a scene.
#[derive(Clone, Debug, Default)]
pub struct Sources {
    /// In order of reading.
    pub files: Vec<SourceFile>,
}

impl Sources {
    /// The text a place points into.
    pub fn file(&self, place: Place) -> Option<&SourceFile> {
        self.files.get((place.file as usize).checked_sub(1)?)
    }

    /// `path:line:column`, or nothing for a value made in code.
    pub fn locate(&self, place: Place) -> Option<String> {
        self.file(place).map(|f| format!("{}:{}:{}", f.path.display(), place.line, place.column))
    }
}
