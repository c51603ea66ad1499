//! Renderers that are not ours: what becomes of their answers, and of those that give none.

use super::Room;
use serde_json::Value;
use std::process::Command;

/// A bench of the room's scene with a `python3` that does what the shell script says.
fn with_python(room: &Room, script: &str) -> (i32, String) {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/bench/bin");
    let path = format!("{folder}:{}", std::env::var("PATH").unwrap_or_default());
    let output = Command::new(env!("CARGO_BIN_EXE_nephroid"))
        .env("PATH", path)
        .env("NEPHROID_TEST_PEER", script)
        .env_remove("NEPHROID_PYTHON")
        .arg("bench")
        .arg(room.path("ball.xml"))
        .args(["-e", "gather", "--peer", "mitsuba", "--spp", "2", "--runs", "4", "--reference-time", "1s", "-o"])
        .arg(room.path("out"))
        .output()
        .expect("the program runs");
    (output.status.code().unwrap_or(-1), String::from_utf8_lossy(&output.stderr).into_owned())
}

fn contender(report: &Value, k: usize) -> &Value {
    &report["scenes"][0]["contenders"][k]
}

#[test]
fn a_peer_that_fails_is_reported_and_the_others_go_on() {
    let room = Room::new();
    let ready = "read setup; echo '{\"ready\": true, \"version\": \"9\"}'; read job";
    for (script, reason) in [
        ("read setup; echo '{\"error\": \"no such package\"}'".to_owned(), "no such package"),
        ("exit 3".to_owned(), "ended"),
        (format!("{ready}; exit 5"), "ended"),
        (format!("{ready}; echo talk; echo '{{\"samples\": 1}}'"), "said"),
        (format!("{ready}; echo '{{\"seconds\": 1, \"samples\": 1}}'; read go"), "image"),
    ] {
        let (code, err) = with_python(&room, &script);
        assert_eq!(code, 1, "{script}: {err}");
        let report = room.report();
        let failure = contender(&report, 1)["failure"].as_str().unwrap_or_default().to_owned();
        assert!(failure.contains(reason), "{script}: {failure}");
        assert_eq!(contender(&report, 0)["runs"].as_array().map(Vec::len), Some(4), "{script}");
    }
}

/// A peer whose images are those of the scene: gets its place in all tables.
#[test]
fn answers_of_a_peer_enter_the_tables() {
    let room = Room::new();
    let image = room.path("image.raw");
    std::fs::write(&image, [0x3f80_0000u32.to_le_bytes(); 32 * 24 * 3].concat()).unwrap();
    let script = format!(
        "read setup; echo '{{\"ready\": true, \"version\": \"9\"}}'\n\
         while read job; do file=$(echo \"$job\" | sed 's/.*\"file\":\"\\([^\"]*\\)\".*/\\1/'); cp {} \"$file\"\n\
         echo '{{\"seconds\": 0.5, \"samples\": 1}}'; read go; echo '{{\"seconds\": 1, \"samples\": 2}}'; read go\n\
         echo '{{\"done\": true, \"memory\": 5000000}}'; done",
        image.display()
    );
    let (code, err) = with_python(&room, &script);
    assert_eq!(code, 0, "{err}");
    let report = room.report();
    let peer = contender(&report, 1);
    assert_eq!((peer["name"].as_str(), peer["peer"].as_bool()), (Some("mitsuba:scalar_rgb:path"), Some(true)));
    assert_eq!(peer["runs"][0]["curve"].as_array().map(Vec::len), Some(2));
    assert_eq!(peer["summary"]["memory"], 5_000_000);
    assert!(peer["remark"].as_str().unwrap().contains("Mitsuba 9"));
    // All pixels are 1, which the scene is not, and that is said.
    let verdict = report["scenes"][0]["verdict"].to_string();
    assert!(verdict.contains("do not mean the same scene"), "{verdict}");
}

/// Whether the Python that the bench starts has a package.
fn has(package: &str) -> bool {
    let python = std::env::var_os("NEPHROID_PYTHON").unwrap_or_else(|| "python3".into());
    let found = Command::new(python).args(["-c", &format!("import {package}")]).output();
    let found = found.is_ok_and(|o| o.status.success());
    if !found {
        println!("skipped: Python has no package {package}");
    }
    found
}

/// Those that need a translation of the scene, where they are installed: it is the same scene.
#[test]
fn translated_scenes_are_the_same() {
    for (package, peer) in [("pyluxcore", "luxcore:pathcpu"), ("bpy", "cycles:path")] {
        if !has(package) {
            continue;
        }
        let room = Room::new();
        let arguments = ["-e", "gather", "--peer", peer, "--spp", "16,256", "--runs", "4", "--reference-time", "4s"];
        let (code, err) = room.bench(&arguments);
        assert_eq!(code, 0, "{peer}: {err}");
        let report = room.report();
        let light = |k: usize| contender(&report, k)["summary"]["energy"]["value"].as_f64().unwrap();
        assert!((light(1) / light(0) - 1.0).abs() < 0.02, "{peer}: {} {}", light(0), light(1));
    }
}

/// The real one, where there is one: it means the same scene.
#[test]
fn mitsuba_means_the_same_scene() {
    if !has("mitsuba") {
        return;
    }
    let room = Room::new();
    let arguments = ["-e", "gather,shoot", "--peer", "mitsuba", "--peer", "mitsuba:scalar_rgb:ptracer"];
    let more = ["--spp", "8,64", "--runs", "4", "--reference-time", "4s", "--reference-error", "0.01"];
    let (code, err) = room.bench(&[&arguments[..], &more].concat());
    assert_eq!(code, 0, "{err}");
    let report = room.report();
    let light = |k: usize| contender(&report, k)["summary"]["energy"]["value"].as_f64().unwrap();
    for (ours, theirs) in [(0, 2), (1, 3)] {
        assert!((light(theirs) / light(ours) - 1.0).abs() < 0.02, "{} {}", light(ours), light(theirs));
        assert_eq!(contender(&report, theirs)["runs"].as_array().map(Vec::len), Some(4));
    }
    // The same walk has about the same error per sample, or less where its decisions are evenly spread.
    let error = |k: usize| contender(&report, k)["summary"]["errors"][1]["relmse_trimmed"]["value"].as_f64().unwrap();
    assert!((0.6..3.0).contains(&(error(2) / error(0))), "{} {}", error(0), error(2));
}
