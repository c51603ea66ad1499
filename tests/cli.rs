//! The command line as a person meets it: exit codes, messages, files.

use assert_cmd::Command;
use nephroid::io::exr::ImageFile;
use nephroid::io::png::PngOptions;
use nephroid::io::write::write_image;
use std::path::{Path, PathBuf};
use std::time::Duration;
use tempfile::TempDir;

fn nephroid() -> Command {
    Command::new(env!("CARGO_BIN_EXE_nephroid"))
}

/// Exit code, standard output and standard error.
fn run(command: &mut Command) -> (i32, String, String) {
    let output = command.timeout(Duration::from_secs(120)).output().expect("the program runs");
    let text = |b: Vec<u8>| String::from_utf8_lossy(&b).into_owned();
    (output.status.code().unwrap_or(-1), text(output.stdout), text(output.stderr))
}

/// A lamp above a floor, 24 × 18 pixels, 4 samples; `$size` enlarges the film.
const SCENE: &str = r#"<scene version="3.0.0">
    <default name="size" value="24"/>
    <integrator type="path"><integer name="max_depth" value="4"/></integrator>
    <sensor type="perspective">
        <float name="fov" value="45"/>
        <transform name="to_world"><lookat origin="0, 2, 6" target="0, 1, 0" up="0, 1, 0"/></transform>
        <sampler type="independent"><integer name="sample_count" value="4"/></sampler>
        <film type="hdrfilm">
            <integer name="width" value="$size"/><integer name="height" value="18"/>
            <rfilter type="box"/>
        </film>
    </sensor>
    <shape type="rectangle">
        <transform name="to_world"><rotate x="1" angle="-90"/><scale value="4"/></transform>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.7, 0.5, 0.3"/></bsdf>
    </shape>
    <shape type="sphere">
        <point name="center" value="0, 2.5, 0"/><float name="radius" value="0.5"/>
        <emitter type="area"><rgb name="radiance" value="5, 5, 5"/></emitter>
    </shape>
</scene>
"#;

struct Room {
    directory: TempDir,
}

impl Room {
    fn new() -> Self {
        let directory = tempfile::tempdir().expect("a directory for the test");
        std::fs::write(directory.path().join("scene.xml"), SCENE).expect("the scene is written");
        Self { directory }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    fn scene(&self) -> PathBuf {
        self.path("scene.xml")
    }
}

fn grey(path: &Path, value: f32, variance: Option<f32>) {
    let mut file = ImageFile::new(32, 32);
    file.insert_rgb("", &vec![[value; 3]; 1024]);
    if let Some(v) = variance {
        file.insert_rgb("variance", &vec![[v; 3]; 1024]);
        file.attributes.insert("samples".into(), "64".into());
    }
    write_image(path, &file, PngOptions::default()).expect("the image is written");
}

#[test]
fn usage_errors_are_two_and_help_is_zero() {
    let (code, out, err) = run(&mut nephroid());
    assert_eq!((code, out.as_str()), (2, ""));
    assert!(err.contains("Usage:") && err.contains("compare"), "{err}");
    assert_eq!(run(nephroid().arg("--version")).0, 0);
    for wrong in
        [vec!["paint"], vec!["--frobnicate"], vec!["compare", "a.exr"], vec!["compare", "a.exr", "b.exr", "--tolerance", "NaN"]]
    {
        let (code, out, err) = run(nephroid().args(&wrong));
        assert_eq!((code, out.as_str()), (2, ""), "{wrong:?}: {err}");
        assert!(err.starts_with("error:"), "{wrong:?}: {err}");
    }
}

#[test]
fn check_reports_every_problem_at_its_place() {
    let room = Room::new();
    let (code, out, err) = run(nephroid().arg("check").arg(room.scene()));
    assert_eq!((code, out.as_str()), (0, ""), "{err}");
    let wrong =
        SCENE.replace("\"reflectance\"", "\"reflectence\"").replace("\"radius\" value=\"0.5\"", "\"radius\" value=\"-1\"");
    std::fs::write(room.path("wrong.xml"), wrong).expect("the scene is written");
    let (code, _, err) = run(nephroid().arg("check").arg(room.path("wrong.xml")));
    assert_eq!(code, 2);
    assert!(err.contains("wrong.xml:15:") && err.contains("did you mean") && err.contains("reflectance"), "{err}");
    assert!(err.contains("wrong.xml:18:") && err.contains('^'), "{err}");
    let (code, _, err) = run(nephroid().arg("check").arg(room.path("absent.xml")));
    assert_eq!(code, 2);
    assert!(err.contains("absent.xml"), "{err}");
    let (code, _, err) = run(nephroid().arg("check").arg(room.scene()).args(["--sensor", "7"]));
    assert_eq!(code, 2);
    assert!(err.contains("no sensor `7`"), "{err}");
}

#[test]
fn info_is_data() {
    let room = Room::new();
    let (code, out, err) = run(nephroid().arg("info").arg(room.scene()));
    assert_eq!((code, err.as_str()), (0, ""));
    assert!(out.contains("1 rectangle, 1 sphere") && out.contains("area"), "{out}");
    let (code, out, _) = run(nephroid().arg("info").arg(room.scene()).args(["--json", "-D", "size=30"]));
    let value: serde_json::Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!((code, value["width"].as_u64(), value["emitters"][0]["kind"].as_str()), (0, Some(30), Some("area")));
    // π · 4π r² · L
    let power = value["emitters"][0]["power_w"][0].as_f64().expect("a number");
    assert!((power - 49.348).abs() < 0.01, "{power}");
}

#[test]
fn compare_answers_by_exit_code() {
    let room = Room::new();
    let (a, b, small) = (room.path("a.exr"), room.path("b.exr"), room.path("small.png"));
    grey(&a, 1.1, Some(1e-4));
    grey(&b, 1.0, Some(1e-4));
    let mut file = ImageFile::new(2, 2);
    file.insert_rgb("", &[[0.5; 3]; 4]);
    write_image(&small, &file, PngOptions::default()).expect("the image is written");
    let (code, out, err) = run(nephroid().arg("compare").args([&a, &b]));
    assert_eq!((code, err.as_str()), (0, ""));
    assert!(out.contains("RMSE            1.0000") && out.contains("Welch           p = 0.000e0"), "{out}");
    let (code, out, _) = run(nephroid().arg("compare").args([&a, &b]).arg("--json"));
    let value: serde_json::Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!(code, 0);
    assert!((value["mean_ratio"][2].as_f64().expect("a number") - 1.1).abs() < 1e-6);
    let judged = |x: &Path, args: &[&str]| run(nephroid().arg("compare").arg(x).arg(&b).args(args)).0;
    assert_eq!(judged(&a, &["--tolerance", "0.02"]), 0);
    assert_eq!(judged(&a, &["--tolerance", "0.001"]), 1);
    assert_eq!(judged(&a, &["--tolerance", "0.01", "--metric", "welch"]), 1);
    assert_eq!(judged(&b, &["--tolerance", "0.01", "--metric", "welch"]), 0);
    assert_eq!(judged(&small, &[]), 2);
    assert_eq!(judged(&room.scene(), &[]), 2);
    assert_eq!(judged(&room.path("absent.exr"), &[]), 2);
}
