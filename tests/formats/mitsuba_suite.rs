//! Scenes of others, where they lie on this machine: every one is read, or says what is not supported yet.

use nephroid::io::mitsuba::{self, LoadOptions};
use std::path::{Path, PathBuf};

/// All scene files under a folder; parts that are only included are left out.
fn scenes(folder: &Path, found: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for path in entries.flatten().map(|e| e.path()) {
        let name = path.file_name().and_then(|n| n.to_str()).unwrap_or("");
        if path.is_dir() && name != "fragments" && name != "include" {
            scenes(&path, found);
        } else if path.extension().is_some_and(|e| e == "xml") {
            found.push(path);
        }
    }
}

#[test]
fn scenes_of_the_mitsuba_suite_are_read() {
    let Some(folder) = std::env::var_os("NEPHROID_MITSUBA_DATA") else {
        println!("skipped: NEPHROID_MITSUBA_DATA is not set");
        return;
    };
    let mut found = Vec::new();
    scenes(Path::new(&folder), &mut found);
    assert!(!found.is_empty(), "no scenes in {folder:?}");
    let mut refused = Vec::new();
    for path in &found {
        match mitsuba::load(path, &LoadOptions::default()) {
            Ok(loaded) => {
                println!("read {}", path.display());
                print!("{}", loaded.warnings.render(&loaded.scene.sources));
            }
            Err(error) if error.problems.list.iter().any(|p| p.what.contains("not supported yet")) => {
                println!("not supported yet: {}", path.display());
            }
            Err(error) if error.problems.list.iter().any(|p| p.what.starts_with("file `")) => {
                println!("incomplete, a file is missing: {}", path.display());
            }
            Err(error) => refused.push(format!("{}:\n{error}", path.display())),
        }
    }
    assert!(refused.is_empty(), "{}", refused.join("\n"));
}
