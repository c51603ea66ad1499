//! A model is not finished without its formula's source, an example, and a line in the list of tests.

use nephroid::io::mitsuba::{self, LoadOptions};
use nephroid::local::{MODEL_SOURCES, Materials};
use nephroid::proof::scattering::models::all_models;
use std::path::Path;

fn head(source: &str) -> String {
    source.lines().map_while(|l| l.strip_prefix("//!")).map(|l| format!("{}\n", l.strip_prefix(' ').unwrap_or(l))).collect()
}

/// Keys like `[Walter 2007, eq. 33]`, without what follows the comma. What is linked is no key.
fn citations(text: &str) -> Vec<String> {
    let inside = text.split('[').skip(1).filter_map(|rest| rest.split_once(']').map(|(key, _)| key));
    let keys = inside.filter(|key| !key.starts_with('`')).map(|key| key.split(',').next().unwrap_or(key).replace('\n', " "));
    keys.filter(|key| key.contains(' ') && key.ends_with(|c: char| c.is_ascii_digit())).collect()
}

#[test]
fn every_model_has_formula_source_and_example() {
    let references = include_str!("../../docs/references.md");
    for (name, source) in MODEL_SOURCES {
        let head = head(source);
        let formula = ["f = ", "f is", "f(w", "F(", " F "].iter().any(|sign| head.contains(sign));
        assert!(formula, "{name}: no formula");
        assert!(head.contains("```xml\n") && head.contains(&format!("type=\"{name}\"")), "{name}: no example");
        let keys = citations(&head);
        assert!(!keys.is_empty(), "{name}: no citation");
        for key in keys {
            assert!(references.contains(&format!("**[{key}]**")), "{name}: {key} is not in docs/references.md");
        }
    }
}

#[test]
fn every_model_is_in_the_list_of_tests() {
    let cases = all_models();
    for (name, _) in MODEL_SOURCES {
        let tested = cases.iter().any(|c| c.name == name || c.name.starts_with(&format!("{name}_")));
        assert!(tested, "{name} has no line in models.rs");
    }
}

/// The examples are scenes: read and built without a single warning.
#[test]
fn every_example_is_read_and_built() {
    for (name, source) in MODEL_SOURCES {
        let head = head(source);
        let example = head.split("```xml\n").nth(1).and_then(|rest| rest.split("```").next()).expect("an example");
        let shape = format!("<shape type=\"sphere\">{example}</shape>");
        let rest = "<sensor type=\"perspective\"><film type=\"hdrfilm\"/></sensor><emitter type=\"constant\"/>";
        let text = format!("<scene version=\"3.0.0\"><integrator type=\"path\"/>{rest}{shape}</scene>");
        let loaded = mitsuba::from_str(&text, Path::new("."), &LoadOptions::default()).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(loaded.warnings.list, vec![], "{name}");
        let materials = Materials::build(&loaded.scene.bsdfs, &loaded.scene.images);
        assert!(materials.is_ok_and(|m| m.len() > 1), "{name}");
    }
}
