//! The proof commands as a user runs them.

use assert_cmd::Command;

fn nephroid(args: &[&str]) -> (i32, String) {
    let out = Command::cargo_bin("nephroid").unwrap().args(args).output().unwrap();
    (out.status.code().unwrap_or(-1), String::from_utf8_lossy(&out.stdout).into_owned())
}

#[test]
fn residual_prints_both_equations() {
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell/scene.xml");
    let few = ["residual", scene, "--points", "8", "--renders", "32", "--passes", "4", "--max-length", "4"];
    let (code, text) = nephroid(&few);
    assert_eq!(code, 0, "{text}");
    assert!(text.contains("L = Lᵉ + τL") && text.contains("W = Wᵉ + τ'W") && text.contains("both residuals are zero"), "{text}");
    let (code, json) = nephroid(&[&few[..], &["--json"]].concat());
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!((code, json["equations"].as_array().map(Vec::len)), (0, Some(2)));
    assert_eq!(nephroid(&["residual", "no-such-file.xml"]).0, 2);
}

/// All rows hold; the mesh is the user's own.
#[test]
fn selfcheck_prints_one_table() {
    let (code, text) = nephroid(&["selfcheck"]);
    println!("{text}");
    assert_eq!(code, 0, "{text}");
    for theory in ["A8", "A9", "A11", "A14", "A16", "A17", "B9", "C1", "C2", "C3", "C4", "C5"] {
        assert!(
            text.lines().any(|l| l.split("  ").next().is_some_and(|key| key.contains(theory))),
            "no row of {theory} in\n{text}"
        );
    }
    assert!(!text.contains("FAILED"), "{text}");
}

#[test]
fn selfcheck_takes_any_mesh() {
    let dir = tempfile::tempdir().unwrap();
    let mesh = dir.path().join("open \"fan\" & <knot>.obj");
    // Neither closed nor oriented.
    std::fs::write(&mesh, "v 0 0 0\nv 3 0 0\nv 2 2 1\nv 0 3 0\nv -2 1 1\nf 1 2 3\nf 1 4 3\nf 1 4 5\nf 2 4 5\n").unwrap();
    let (code, json) = nephroid(&["selfcheck", "--json", "--mesh", mesh.to_str().unwrap()]);
    let rows: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!((code, rows.as_array().map(Vec::len)), (0, Some(5)), "{json}");
    assert_eq!(nephroid(&["selfcheck", "--mesh", "no-such-mesh.obj"]).0, 2);
}

#[test]
fn explain_as_text_and_json() {
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/kajiya/scene.xml");
    let few = ["explain", scene, "--size", "64x48", "--pixel", "32,36", "--spp", "16", "--show", "3"];
    let (code, text) = nephroid(&few);
    assert_eq!(code, 0, "{text}");
    for part in ["gather", "shoot", "bidirectional", "by class and join", "path 3:", "density"] {
        assert!(text.contains(part), "no `{part}` in\n{text}");
    }
    let (code, json) = nephroid(&[&few[..], &["--json"]].concat());
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!((code, json["paths"].as_array().map(Vec::len)), (0, Some(3)));
    assert_eq!(nephroid(&["explain", scene, "--pixel", "99999,0"]).0, 2);
}
