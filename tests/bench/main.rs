//! The bench as a person meets it: files, figures, exit codes; its page in a browser; its figures proved.

mod browser;
mod figures;
mod layers;
#[cfg(unix)]
mod peers;

use assert_cmd::Command;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::time::Duration;
use tempfile::TempDir;

/// A lamp and a mirror ball above a floor.
const SCENE: &str = r#"<scene version="3.0.0">
    <integrator type="path"><integer name="max_depth" value="5"/></integrator>
    <sensor type="perspective">
        <float name="fov" value="45"/>
        <transform name="to_world"><lookat origin="0, 2, 6" target="0, 1, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm">
            <integer name="width" value="32"/><integer name="height" value="24"/>
            <rfilter type="box"/>
        </film>
    </sensor>
    <shape type="rectangle">
        <transform name="to_world"><rotate x="1" angle="-90"/><scale value="4"/></transform>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.7, 0.5, 0.3"/></bsdf>
    </shape>
    <shape type="sphere">
        <point name="center" value="1, 0.7, 0"/><float name="radius" value="0.7"/><bsdf type="conductor"/>
    </shape>
    <shape type="sphere">
        <point name="center" value="-1, 2, 0"/><float name="radius" value="0.4"/>
        <bsdf type="diffuse"/><emitter type="area"><rgb name="radiance" value="5, 5, 5"/></emitter>
    </shape>
</scene>
"#;

struct Room {
    directory: TempDir,
}

impl Room {
    fn new() -> Self {
        let directory = tempfile::tempdir().expect("a directory for the test");
        std::fs::write(directory.path().join("ball.xml"), SCENE).expect("the scene is written");
        Self { directory }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    /// Exit code and standard error of a bench of the scene and more.
    fn bench(&self, more: &[&str]) -> (i32, String) {
        let mut command = Command::new(env!("CARGO_BIN_EXE_nephroid"));
        command.arg("bench").arg(self.path("ball.xml")).args(["-o"]).arg(self.path("out")).args(more);
        let output = command.timeout(Duration::from_secs(120)).output().expect("the program runs");
        (output.status.code().unwrap_or(-1), String::from_utf8_lossy(&output.stderr).into_owned())
    }

    fn report(&self) -> Value {
        let text = std::fs::read_to_string(self.path("out/report.json")).expect("there is a report");
        serde_json::from_str(&text).expect("it is JSON")
    }

    fn references(&self) -> Vec<PathBuf> {
        let entries = std::fs::read_dir(self.directory.path()).expect("the directory is there").flatten();
        entries.map(|e| e.path()).filter(|p| p.to_string_lossy().contains(".reference-")).collect()
    }
}

fn page(room: &Room) -> String {
    std::fs::read_to_string(room.path("out/index.html")).expect("there is a page")
}

#[test]
fn a_bench_leaves_figures_a_page_and_a_reference() {
    let room = Room::new();
    let arguments = ["--spp", "4,1024", "--runs", "3", "--reference-error", "0.05", "--reference-time", "20s"];
    let (code, err) = room.bench(&arguments);
    assert_eq!(code, 0, "{err}");
    let report = room.report();
    let scene = &report["scenes"][0];
    assert_eq!(report["marks"], serde_json::json!(["4 spp", "1024 spp"]));
    assert!(scene["reference"]["error"].as_f64().unwrap() <= 0.05, "{}", scene["reference"]);
    let contenders = scene["contenders"].as_array().unwrap();
    assert_eq!(contenders.iter().map(|c| c["name"].as_str().unwrap()).collect::<Vec<_>>(), ["gather", "shoot", "bidirectional"]);
    for c in contenders {
        let runs = c["runs"].as_array().unwrap();
        assert_eq!(runs.len(), 3);
        let seeds: std::collections::HashSet<_> = runs.iter().map(|r| r["seed"].as_u64()).collect();
        assert_eq!(seeds.len(), 3);
        for r in runs {
            let samples: Vec<_> = r["curve"].as_array().unwrap().iter().map(|p| p["samples"].as_u64().unwrap()).collect();
            assert_eq!(samples, (2..=10).map(|i| 1 << i).collect::<Vec<u64>>());
            let rays = |k: &str| r["rays"][k].as_u64().unwrap();
            assert_eq!((rays("gather") > 0, rays("shoot") > 0), (c["name"] != "shoot", c["name"] != "gather"));
        }
    }
    // The mirror is black by shooting (2.7 % of the light), and all that is missing is said.
    let energy = |i: usize| contenders[i]["summary"]["energy"]["value"].as_f64().unwrap();
    assert!((0.96..0.985).contains(&energy(1)) && (energy(2) - 1.0).abs() < 0.05, "{} {}", energy(1), energy(2));
    let verdict = scene["verdict"].to_string();
    assert!(verdict.contains("shoot misses") && verdict.contains("1024 spp"), "{verdict}");
    for r in scene["ratios"].as_array().unwrap() {
        let bounds = &r["ratio"]["bounds"];
        assert!(r["ratio"].is_null() != bounds.is_array(), "a ratio has bounds: {r}");
    }
    // The more of the coupling is followed, the less is missing.
    let missing: Vec<f64> = (0..3).map(|k| scene["cost"][k]["missing"]["value"].as_f64().unwrap()).collect();
    assert!(missing[0] > missing[1] && missing[1] > missing[2] + 0.002, "{missing:?}");
    assert_eq!(std::fs::read_to_string(room.path("out/report.csv")).unwrap().lines().count(), 1 + 3 * 3 * 9);
    assert!(page(&room).contains("class=\"pixels\""));
    // The reference is used again, and stays what it is.
    let references = room.references();
    assert_eq!(references.len(), 1);
    let before = std::fs::read(&references[0]).unwrap();
    assert_eq!(room.bench(&arguments).0, 0);
    assert!(room.report()["scenes"][0]["reference"]["origin"].as_str().unwrap().starts_with("kept"));
    assert_eq!(std::fs::read(&references[0]).unwrap(), before);
}

#[test]
fn only_halves_tell_the_noise_of_a_reference() {
    let room = Room::new();
    let once = ["--spp", "2", "--runs", "1", "-e", "gather"];
    let error = |more: &[&str]| {
        let (code, err) = room.bench(&[&once, more].concat());
        assert_eq!(code, 0, "{err}");
        room.report()["scenes"][0]["reference"]["error"].as_f64()
    };
    let made = error(&["--reference-time", "1s"]);
    assert!(made.is_some_and(|e| e > 0.0));
    assert_eq!(error(&["--reference", room.references()[0].to_str().unwrap()]), made);
    // A film has a variance, too, but it may be a bound.
    let film = room.path("film.exr");
    let mut render = Command::new(env!("CARGO_BIN_EXE_nephroid"));
    render.arg("render").arg(room.path("ball.xml")).args(["--spp", "4", "--quiet", "-o"]).arg(&film).assert().success();
    assert_eq!(error(&["--reference", film.to_str().unwrap()]), None);
}

#[test]
fn one_run_has_no_ratio() {
    let room = Room::new();
    let arguments = ["--spp", "2", "--runs", "1", "--reference-time", "1s", "-e", "gather,gather"];
    let (code, err) = room.bench(&arguments);
    assert_eq!(code, 0, "{err}");
    let report = room.report();
    let ratios = report["scenes"][0]["ratios"].as_array().unwrap();
    assert!(
        !ratios.is_empty() && ratios.iter().all(|r| r["ratio"].is_null() && r["why_not"].as_str().unwrap().contains("one run"))
    );
}

#[test]
fn what_fails_is_said_and_the_others_go_on() {
    let room = Room::new();
    let broken = room.path("broken.xml");
    std::fs::write(&broken, SCENE.replace("type=\"conductor\"", "type=\"unobtainium\"")).unwrap();
    let (code, err) = room.bench(&[broken.to_str().unwrap(), "--spp", "2", "--runs", "2", "--reference-time", "1s"]);
    assert_eq!(code, 1, "{err}");
    let report = room.report();
    assert!(report["scenes"][0]["failure"].is_null() && report["scenes"][1]["failure"].as_str().unwrap().contains("unobtainium"));
    assert!(page(&room).contains("unobtainium"));
}

#[test]
fn wrong_words_are_usage_errors() {
    let room = Room::new();
    let (code, err) = room.bench(&["-e", "gather,magic"]);
    assert_eq!(code, 2);
    assert!(err.contains("magic") && err.contains("bidirectional"), "{err}");
    let given = |more: &[&str]| room.bench(more).0;
    assert_eq!(given(&["--time", "1s", "--spp", "3"]), 2);
    assert_eq!(given(&["--runs", "0"]), 2);
    assert!(!Path::new(&room.path("out")).exists(), "nothing is made before the words are understood");
}

#[cfg(unix)]
#[test]
fn an_interrupt_keeps_what_was_done() {
    let room = Room::new();
    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_nephroid"))
        .arg("bench")
        .arg(room.path("ball.xml"))
        .args(["-e", "gather,shoot", "--spp", "4", "--runs", "1000", "--reference-time", "1s", "-o"])
        .arg(room.path("out"))
        .stderr(std::process::Stdio::piped())
        .spawn()
        .expect("the program runs");
    let mut lines = std::io::BufRead::lines(std::io::BufReader::new(child.stderr.take().unwrap()));
    assert!(lines.by_ref().map_while(Result::ok).any(|l| l.contains("run 2 of 1000, shoot")), "a second run ends");
    let sent = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
    lines.for_each(drop);
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let report = room.report();
    assert_eq!(report["interrupted"], true);
    assert!(report["scenes"][0]["contenders"][1]["runs"].as_array().unwrap().len() >= 2);
    assert!(page(&room).contains("Interrupted"));
}
