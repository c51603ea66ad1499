//! From a name in a scene file to a file: search directories, sandbox, and what was meant if nothing is found.

use super::names;
use super::values::shown;
use std::path::{Path, PathBuf};

/// Most directories that a scene may name.
pub const MAX_DIRECTORIES: usize = 256;

/// Directories in which named files are looked for.
#[derive(Clone, Debug, Default)]
pub struct Search {
    /// In the order they are tried after the directory of the naming file.
    pub directories: Vec<PathBuf>,
    /// No file outside this directory is touched, if given (canonical).
    pub sandbox: Option<PathBuf>,
}

/// Why a name leads to no file: what and hint.
pub type NotFound = (String, Option<String>);

impl Search {
    /// Adds a directory unless it is there already; `false` if there are too many.
    pub fn add(&mut self, directory: PathBuf) -> bool {
        if self.directories.contains(&directory) {
            return true;
        }
        let fits = self.directories.len() < MAX_DIRECTORIES;
        if fits {
            self.directories.push(directory);
        }
        fits
    }

    /// The existing regular file that `name` means in a file standing in `beside`.
    pub fn resolve(&self, name: &str, beside: &Path) -> Result<PathBuf, NotFound> {
        if name.trim().is_empty() {
            return Err(("an empty file name".into(), None));
        }
        let mut directories: Vec<&Path> = vec![beside];
        if !Path::new(name).is_absolute() {
            directories.extend(self.directories.iter().map(PathBuf::as_path).filter(|d| *d != beside));
        }
        let mut forbidden = None;
        for directory in &directories {
            let candidate = directory.join(name);
            let Ok(metadata) = std::fs::metadata(&candidate) else { continue };
            if !self.allows(&candidate) {
                forbidden = Some(format!("file `{}` lies outside of the sandbox directory", shown(name)));
                continue;
            }
            if metadata.is_dir() {
                return Err((format!("`{}` is a directory, not a file", shown(name)), None));
            }
            if !metadata.is_file() {
                return Err((format!("`{}` is not a regular file", shown(name)), None));
            }
            return Ok(candidate);
        }
        match forbidden {
            Some(what) => Err((what, self.sandbox.as_ref().map(|s| format!("allowed is what lies in {}", s.display())))),
            None => Err((format!("file `{}` not found", shown(name)), Some(self.hint(name, &directories)))),
        }
    }

    /// Whether the sandbox contains the file (links resolved).
    pub fn allows(&self, path: &Path) -> bool {
        match &self.sandbox {
            None => true,
            Some(sandbox) => path.canonicalize().is_ok_and(|real| real.starts_with(sandbox)),
        }
    }

    /// The nearest existing name beside a candidate, and the directories that were searched.
    fn hint(&self, name: &str, directories: &[&Path]) -> String {
        let wanted = Path::new(name);
        let mut near = None;
        if let Some(file) = wanted.file_name().and_then(|f| f.to_str()) {
            for folder in directories.iter().filter_map(|d| d.join(wanted).parent().map(Path::to_path_buf)) {
                if !self.allows(&folder) {
                    continue;
                }
                let Ok(entries) = std::fs::read_dir(&folder) else { continue };
                let found: Vec<String> = entries.take(4096).flatten().filter_map(|e| e.file_name().into_string().ok()).collect();
                if let Some(best) = names::nearest(file, found.iter().map(String::as_str)) {
                    near = Some(wanted.with_file_name(best));
                    break;
                }
            }
        }
        let meant = near.map(|n| format!("did you mean `{}`? ", n.display())).unwrap_or_default();
        if wanted.is_absolute() {
            return if meant.is_empty() {
                "the path is absolute: nothing else was searched".into()
            } else {
                meant.trim_end().into()
            };
        }
        let searched: Vec<String> =
            directories.iter().map(|d| if d.as_os_str().is_empty() { ".".into() } else { d.display().to_string() }).collect();
        format!("{meant}searched in: {}", searched.join(", "))
    }
}
