//! What the repository says about itself: citations have references, scenes can be rendered as written.

use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Files below `folder` whose name ends so.
fn files(folder: &str, extension: &str) -> Vec<PathBuf> {
    let mut open = vec![root().join(folder)];
    let mut found = Vec::new();
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(&folder).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|e| e == extension) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// Keys such as `Walter 2007` in `[Walter 2007, eq. 33]`; an author begins with a letter and the
/// key ends with a year, which array indices and links do not.
fn citations(text: &str) -> Vec<String> {
    let text = text.replace("\n//!", "").replace("\n///", "").replace("\n    ///", "");
    let inside = text.split('[').skip(1).filter_map(|rest| rest.split_once(']').map(|(key, _)| key));
    let each = inside.flat_map(|keys| keys.split(';'));
    let keys = each.map(|key| key.split(',').next().unwrap_or(key).split_whitespace().collect::<Vec<_>>().join(" "));
    let is_key = |key: &String| {
        let Some((author, year)) = key.rsplit_once(' ') else { return false };
        let digits = year.trim_end_matches(|c: char| c.is_ascii_lowercase());
        let is_year = digits.len() == 4 && matches!(digits.parse(), Ok(1600..=2100));
        is_year && author.starts_with(char::is_alphabetic) && author.chars().all(|c| c.is_alphabetic() || " .&-’'".contains(c))
    };
    keys.filter(is_key).collect()
}

#[test]
fn every_citation_has_a_reference() {
    let references = std::fs::read_to_string(root().join("docs/references.md")).unwrap();
    let sources = ["src", "tests", "benches", "examples"].into_iter().flat_map(|folder| files(folder, "rs"));
    let texts = sources.chain(files("docs", "md")).filter(|p| !p.ends_with("references.md"));
    let mut found = 0;
    for path in texts {
        for key in citations(&std::fs::read_to_string(&path).unwrap()) {
            assert!(references.contains(&format!("**[{key}]**")), "{}: no reference for [{key}]", path.display());
            found += 1;
        }
    }
    assert!(found > 20, "only {found} citations found");
}

#[test]
fn references_are_sorted() {
    let references = std::fs::read_to_string(root().join("docs/references.md")).unwrap();
    let keys = references.lines().filter_map(|l| l.strip_prefix("- **[")).map(|l| l.to_lowercase().replace('\'', ""));
    let keys: Vec<String> = keys.filter_map(|l| l.split_once(']').map(|(key, _)| key.to_owned())).collect();
    assert!(keys.is_sorted(), "docs/references.md is not sorted");
}

#[test]
fn every_scene_can_be_rendered_and_says_what_for() {
    let scenes = files("scenes", "xml");
    assert!(scenes.len() >= 7);
    for path in scenes {
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.starts_with("<!-- "), "{} begins without its purpose", path.display());
        let loaded = nephroid::load(&path, &Default::default()).unwrap_or_else(|e| panic!("{e}"));
        assert!(loaded.warnings.list.is_empty(), "{} has warnings", path.display());
    }
}

#[test]
fn pictures_in_the_readme_exist_and_are_small() {
    let readme = std::fs::read_to_string(root().join("README.md")).unwrap();
    let pictures: Vec<&str> =
        readme.split("](docs/images/").skip(1).filter_map(|rest| rest.split_once(')').map(|(name, _)| name)).collect();
    assert!(!pictures.is_empty());
    for name in pictures {
        let size = std::fs::metadata(root().join("docs/images").join(name)).unwrap_or_else(|e| panic!("{name}: {e}")).len();
        assert!(size < 150_000, "{name} has {size} bytes");
    }
}
