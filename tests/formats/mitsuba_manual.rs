//! docs/scene-format.md says what the reader does, and its examples are scenes.

use nephroid::io::mitsuba::{self, LoadOptions};

const MANUAL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/scene-format.md");

#[test]
fn the_manual_is_what_the_tables_say() {
    let written = std::fs::read_to_string(MANUAL).unwrap_or_default();
    assert!(
        written == mitsuba::scene_format_markdown(),
        "docs/scene-format.md is stale: cargo test --test formats -- --ignored bless"
    );
}

#[test]
#[ignore = "writes docs/scene-format.md"]
fn bless() {
    std::fs::write(MANUAL, mitsuba::scene_format_markdown()).unwrap();
}

#[test]
fn every_example_of_the_manual_is_read() {
    for example in mitsuba::examples() {
        let dir = tempfile::tempdir().unwrap();
        for file in &example.files {
            std::fs::write(dir.path().join(file), "").unwrap();
        }
        if let Err(error) = mitsuba::from_str(&example.scene, dir.path(), &LoadOptions::default()) {
            panic!("example of {} `{}`:\n{error}", example.element, example.plugin);
        }
        assert!(example.scene.contains(&format!("type=\"{}\"", example.plugin)));
    }
}
