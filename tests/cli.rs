//! The command line as a person meets it: exit codes, messages, files.

use assert_cmd::Command;
use nephroid::io::exr::ImageFile;
use nephroid::io::png::PngOptions;
use nephroid::io::write::{read_image, write_image};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
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
        std::fs::write(directory.path().join("scene.xml"), SCENE).expect("the scene is written");
        Self { directory }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    fn scene(&self) -> PathBuf {
        self.path("scene.xml")
    }

    /// A scene with one text replaced by another.
    fn changed(&self, from: &str, to: &str) -> PathBuf {
        assert!(SCENE.contains(from));
        let path = self.path("changed.xml");
        std::fs::write(&path, SCENE.replace(from, to)).expect("the scene is written");
        path
    }

    /// Names of all files.
    fn files(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.directory.path()).expect("the directory is there");
        let mut names: Vec<_> = entries.flatten().map(|e| e.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
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
    assert!(err.contains("Usage:") && err.contains("render"), "{err}");
    assert_eq!(run(nephroid().arg("--version")).0, 0);
    assert_eq!(run(nephroid().args(["render", "--help"])).0, 0);
    for wrong in [
        vec!["paint"],
        vec!["--frobnicate"],
        vec!["render", "a.xml"],
        vec!["render", "a.xml", "-o", "a.exr", "--spp", "0"],
        vec!["render", "a.xml", "-o", "a.exr", "--spp=-3"],
        vec!["render", "a.xml", "-o", "a.exr", "-D", "spp"],
        vec!["render", "a.xml", "-o", "a.exr", "--size", "12"],
        vec!["render", "a.xml", "-o", "a.exr", "--time", "soon"],
        vec!["render", "a.xml", "-o", "a.exr", "--estimator", "magic"],
        vec!["render", "a.xml", "-o", "a.exr", "--techniques", "hit,luck"],
        vec!["compare", "a.exr"],
        vec!["compare", "a.exr", "b.exr", "--tolerance", "NaN"],
    ] {
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

#[test]
fn outputs_are_refused_before_anything_is_rendered() {
    let room = Room::new();
    let render = |output: PathBuf| run(nephroid().arg("render").arg(room.scene()).arg("-o").arg(output));
    let (code, _, err) = render(room.path("a.xyz"));
    assert_eq!(code, 2);
    assert!(err.contains(".exr") && err.contains(".png"), "{err}");
    let (code, _, err) = render(room.path("nowhere/a.exr"));
    assert_eq!(code, 4);
    assert!(err.contains("nowhere"), "{err}");
    std::fs::create_dir(room.path("folder.exr")).expect("a directory");
    assert_eq!(render(room.path("folder.exr")).0, 4);
    let code = run(nephroid()
        .arg("render")
        .arg(room.scene())
        .arg("-o")
        .arg(room.path("a.exr"))
        .arg("--stats")
        .arg(room.path("no/s.json")))
    .0;
    assert_eq!(code, 4);
    for odd in [["--min-length", "5"], ["--paths", "E (D"], ["--crop", "20,0,10,10"], ["--exposure", "inf"]] {
        let (code, _, err) = run(nephroid().arg("render").arg(room.scene()).args(odd).arg("-o").arg(room.path("a.exr")));
        assert_eq!(code, 2, "{odd:?}: {err}");
    }
    assert_eq!(room.files(), ["folder.exr", "scene.xml"]);
}

#[test]
fn a_film_beyond_memory_is_refused_at_once() {
    let room = Room::new();
    let start = Instant::now();
    let mut command = nephroid();
    command.arg("render").arg(room.scene()).args(["--size", "2000000x2000000", "-o"]).arg(room.path("a.exr"));
    let (code, _, err) = run(&mut command);
    assert_eq!(code, 2);
    assert!(err.contains("--max-memory") && err.contains("PB"), "{err}");
    // A tenth of a second on a free machine.
    assert!(start.elapsed() < Duration::from_secs(3), "{:?}", start.elapsed());
    let mut command = nephroid();
    command.arg("render").arg(room.scene()).args(["--max-memory", "10k", "-o"]).arg(room.path("a.exr"));
    assert_eq!(run(&mut command).0, 2);
    let zero = room.changed("\"$size\"", "\"0\"");
    let (code, _, err) = run(nephroid().arg("render").arg(zero).arg("-o").arg(room.path("a.exr")));
    assert_eq!(code, 2);
    assert!(err.contains("changed.xml:9:"), "{err}");
    assert_eq!(room.files(), ["changed.xml", "scene.xml"]);
}

#[test]
fn renders_every_format_with_figures() {
    let room = Room::new();
    let mut command = nephroid();
    command.arg("render").arg(room.scene()).args(["--seed", "3", "-t", "2", "-D", "size=20"]);
    command.arg("-o").arg(room.path("a.exr")).arg("-o").arg(room.path("a.png")).arg("--stats").arg(room.path("s.json"));
    let (code, out, err) = run(&mut command);
    assert_eq!((code, out.as_str()), (0, ""), "{err}");
    assert!(err.contains("estimator auto") && err.contains("chosen in") && err.contains("4 samples per pixel"), "{err}");
    assert_eq!(room.files(), ["a.exr", "a.png", "s.json", "scene.xml"]);
    let image = read_image(&room.path("a.exr")).expect("an image");
    assert_eq!((image.width, image.height), (20, 18));
    let mean = image.rgb("").expect("the beauty");
    assert!(mean.iter().any(|c| c[0] > 0.0) && mean.iter().flatten().all(|v| v.is_finite()));
    assert!(image.rgb("variance").is_some() && image.rgb("blockVariance").is_some());
    let attribute = |name: &str| image.attributes.get(name).map(String::as_str);
    assert_eq!(attribute("samples"), Some("4"));
    assert_eq!((attribute("estimator"), attribute("seed")), (Some("auto"), Some("3")));
    assert!(attribute("command").is_some_and(|c| c.contains("-D size=20")));
    let figures = std::fs::read_to_string(room.path("s.json")).expect("figures");
    let figures: serde_json::Value = serde_json::from_str(&figures).expect("JSON");
    assert_eq!((figures["samples_per_pixel"].as_u64(), figures["threads"].as_u64()), (Some(4), Some(2)));
    assert_eq!(figures["gather_walks"].as_u64(), Some(4 * 20 * 18));
}

/// The same bits for any number of threads, and inside a crop window the same as without it where
/// nothing is shot.
#[test]
fn threads_leave_no_trace() {
    let room = Room::new();
    let image = |name: &str, args: &[&str]| {
        let path = room.path(name);
        let (code, _, err) = run(nephroid().arg("render").arg(room.scene()).arg("-q").args(args).arg("-o").arg(&path));
        assert_eq!((code, err.as_str()), (0, ""));
        read_image(&path).expect("an image").channels
    };
    for estimator in ["gather", "shoot", "bidirectional", "auto"] {
        let one = image("1.exr", &["-e", estimator, "-t", "1"]);
        for threads in ["2", "3", "7"] {
            assert_eq!(one, image("n.exr", &["-e", estimator, "-t", threads]), "{estimator} with {threads} threads");
        }
    }
}

#[test]
fn estimator_scene_follows_the_element() {
    let room = Room::new();
    let told = |kind: &str| {
        let scene = room.changed("integrator type=\"path\"", &format!("integrator type=\"{kind}\""));
        let mut command = nephroid();
        command.arg("render").arg(scene).args(["--spp", "1", "-e", "scene", "-o"]).arg(room.path("a.exr"));
        let (code, _, err) = run(&mut command);
        assert_eq!(code, 0, "{err}");
        err
    };
    assert!(told("path").contains("estimator gather"));
    assert!(told("ptracer").contains("estimator shoot"));
}

/// The first interrupt finishes the pass and writes the image.
#[cfg(unix)]
#[test]
fn an_interrupt_keeps_the_image() {
    use std::process::{Command, Stdio};
    let room = Room::new();
    for signal in ["-INT", "-TERM"] {
        let output = room.path("a.exr");
        let _ = std::fs::remove_file(&output);
        let mut child = Command::new(env!("CARGO_BIN_EXE_nephroid"))
            .arg("render")
            .arg(room.scene())
            .args(["--time", "10m", "-o"])
            .arg(&output)
            .stderr(Stdio::null())
            .spawn()
            .expect("the program runs");
        // The first image is written within seconds: by then signals are handled.
        let start = Instant::now();
        while !output.exists() && start.elapsed() < Duration::from_secs(60) {
            std::thread::sleep(Duration::from_millis(50));
        }
        std::fs::remove_file(&output).expect("an image was written during the render");
        Command::new("kill").args([signal, &child.id().to_string()]).status().expect("kill runs");
        assert_eq!(child.wait().expect("the program ends").code(), Some(130));
        assert!(read_image(&output).is_ok_and(|i| i.width == 24));
    }
}

/// A closed box of albedo ½ lit by itself, and a glass ball in it if asked.
const DIFFUSE: &str = r#"<scene version="3.0.0">
    <default name="ball" value="diffuse"/>
    <sensor type="perspective"><film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="18"/></film></sensor>
    <shape type="cube"><boolean name="flip_normals" value="true"/><bsdf type="diffuse"/>
        <emitter type="area"><rgb name="radiance" value="0.5"/></emitter></shape>
    <shape type="sphere"><float name="radius" value="0.3"/><point name="center" value="0, 0, 0.5"/><bsdf type="$ball"/></shape>
</scene>
"#;

#[test]
fn finite_elements_make_images_and_meshes() {
    let room = Room::new();
    std::fs::write(room.path("box.xml"), DIFFUSE).unwrap();
    let with = |more: &[&str]| {
        let mut command = nephroid();
        command.current_dir(room.directory.path()).args(["render", "box.xml", "--elements", "200", "--element-rays", "128"]);
        run(command.args(more))
    };
    let methods = ["jacobi", "gauss-seidel", "southwell", "stochastic"];
    for method in methods {
        let (code, _, talk) = with(&["-e", "iterate", "--iteration", method, "-o", "a.exr", "--residual-log", "log.csv"]);
        assert!(code == 0 && talk.contains("at most"), "{talk}");
        let log = std::fs::read_to_string(room.path("log.csv")).unwrap();
        assert!(log.lines().count() > 3, "{log}");
    }
    let (code, _, talk) = with(&["-e", "invert", "-o", "a.exr", "-o", "a.ply", "--stats", "a.json", "--element-view", "flat"]);
    assert_eq!(code, 0, "{talk}");
    let image = read_image(&room.path("a.exr")).unwrap().rgb("").unwrap();
    // The ball does not shine, the walls are near 1.
    assert!(image.iter().all(|p| p[0] > 0.3 && p[0] < 1.0), "{image:?}");
    let mesh = nephroid::io::ply::parse(&std::fs::read(room.path("a.ply")).unwrap(), false).unwrap().value;
    let stats: serde_json::Value = serde_json::from_slice(&std::fs::read(room.path("a.json")).unwrap()).unwrap();
    assert!(mesh.triangles.len() as u64 >= stats["elements"].as_u64().unwrap());
    assert!(stats["relative_error_bound"].as_f64().unwrap() < 0.2, "{stats}");
}

#[test]
fn finite_elements_refuse_what_they_cannot_do() {
    let room = Room::new();
    std::fs::write(room.path("box.xml"), DIFFUSE).unwrap();
    let with = |more: &[&str]| {
        let mut command = nephroid();
        run(command.current_dir(room.directory.path()).args(["render", "box.xml", "-e", "invert", "-o", "a.png"]).args(more))
    };
    for (arguments, words) in [
        (&["-D", "ball=dielectric"][..], &["is `dielectric`", "box.xml:6:", "diffuse models only"][..]),
        (&["--max-memory", "100MB", "--elements", "30000"], &["30000 elements need", "100 MB", "stochastic"]),
        (&["--paths", "E D L"], &["--paths is about walks"]),
    ] {
        let (code, _, talk) = with(arguments);
        assert!(code == 2 && words.iter().all(|w| talk.contains(w)), "{arguments:?}: {talk}");
        assert!(!room.path("a.png").exists());
    }
}

#[test]
fn layers_and_gallery_of_one_render() {
    let room = Room::new();
    let (image, gallery) = (room.path("a.exr"), room.path("terms.png"));
    let mut command = nephroid();
    command.arg("render").arg(room.scene()).args(["--layers=2", "-o"]).arg(&image).arg("--gallery").arg(&gallery);
    let (code, _, err) = run(&mut command);
    assert_eq!(code, 0, "{err}");
    let file = read_image(&image).expect("an image");
    let whole = file.rgb("").expect("the beauty");
    // Paths have at most 4 edges, so that n = 2 has n = 3 beyond it.
    let terms: Vec<_> = ["n0", "n1", "n2+"].iter().map(|n| file.rgb(n).expect("a term")).collect();
    for (i, p) in whole.iter().enumerate() {
        let sum: f32 = terms.iter().map(|t| t[i][1]).sum();
        assert!((sum - p[1]).abs() <= 1e-6 * p[1].max(1e-3), "pixel {i}: {sum} instead of {}", p[1]);
    }
    let sheet = image::open(&gallery).expect("a sheet").into_rgb8();
    assert!(sheet.width() > 3 * 160 && sheet.height() > 2 * 100, "{:?}", sheet.dimensions());
    assert!(sheet.pixels().any(|p| p.0.iter().all(|v| *v > 200)), "labels are bright");
    let wrong = [vec!["-o", "b.png", "--layers"], vec!["-o", "b.exr", "--layers=999"], vec!["-o", "b.exr", "--gallery", "g.exr"]];
    for wrong in wrong.into_iter().chain([vec!["-o", "b.exr", "--layers", "--estimator", "invert"]]) {
        let (code, _, err) = run(nephroid().current_dir(room.directory.path()).arg("render").arg(room.scene()).args(&wrong));
        assert_eq!(code, 2, "{wrong:?}: {err}");
    }
    let (code, _, err) = run(nephroid().current_dir(room.directory.path()).arg("render").arg(room.scene()).args([
        "-o",
        "b.exr",
        "--layers=200",
        "--max-length",
        "300",
        "--max-memory",
        "3MB",
    ]));
    assert!(code == 2 && err.contains("needs"), "{err}");
    assert!(!room.path("b.exr").exists());
}

#[test]
fn pyramid_and_light_groups_of_one_render() {
    let room = Room::new();
    let scene = room.changed("<shape type=\"sphere\">", "<shape type=\"sphere\" id=\"moon\">");
    let (image, pyramid) = (room.path("a.exr"), room.path("pyramid"));
    let mut command = nephroid();
    command.arg("render").arg(&scene).args(["-e", "bidirectional", "--light-groups", "--pyramid-length=2", "-o"]).arg(&image);
    let (code, _, err) = run(command.arg("--pyramid").arg(&pyramid));
    assert_eq!(code, 0, "{err}");
    let file = read_image(&image).expect("an image");
    assert!(file.rgb("light.moon").expect("a light") == file.rgb("").expect("the beauty"), "there is one light");
    let table = std::fs::read_to_string(pyramid.join("pyramid.json")).expect("a table");
    let table: serde_json::Value = serde_json::from_str(&table).expect("JSON");
    let entries = table.as_array().expect("a list");
    let energy: f64 = entries.iter().filter_map(|e| e["share_of_energy"].as_f64()).sum();
    assert!((energy - 1.0).abs() < 1e-5, "{energy}");
    // Lights are hit or splatted, floors lit by hits and next events; of longer paths there are all four.
    let names: Vec<String> =
        entries.iter().map(|e| format!("{} {}", e["length"], e["technique"].as_str().unwrap_or(""))).collect();
    assert_eq!(names, ["1 hit", "1 splat", "2 hit", "2 nee", "3 hit", "3 nee", "3 connect", "3 splat"]);
    let direct = read_image(&pyramid.join("k2.s1t2.exr")).expect("an image of a join");
    assert!(direct.rgb("raw").is_some() && direct.rgb("variance").is_some() && direct.rgb("rawVariance").is_some());
    for sheet in ["weighted.png", "raw.png"] {
        assert!(image::open(pyramid.join(sheet)).expect("a sheet").width() > 300);
    }
    let (code, _, err) = run(nephroid().arg("render").arg(&scene).args(["--light-groups=x=sun", "-o"]).arg(&image));
    assert!(code == 2 && err.contains("moon"), "{err}");
}

#[test]
fn local_and_recursive_say_what_they_leave_out() {
    let room = Room::new();
    let (image, rest) = (room.path("a.exr"), room.path("rest.exr"));
    for estimator in ["local", "local-unshadowed", "recursive"] {
        let mut command = nephroid();
        command.arg("render").arg(room.scene()).args(["--estimator", estimator, "--layers", "-o"]).arg(&image);
        let (code, _, err) = run(command.arg("--left-out").arg(&rest));
        assert_eq!(code, 0, "{err}");
        let (part, rest) = (read_image(&image).expect("an image"), read_image(&rest).expect("the rest"));
        let mean = |f: &ImageFile| f.rgb("").expect("colours").iter().map(|p| p[0]).sum::<f32>();
        assert!(mean(&rest) > 0.0 && mean(&rest) < mean(&part), "{estimator}: light bounces between floor and lamp");
        assert!(rest.rgb("variance").is_some());
        // A lamp and what it lights: there are no mirrors beyond.
        assert_eq!((part.rgb("n1").is_some(), part.rgb("n2").is_some()), (true, estimator == "recursive"));
    }
    for wrong in [
        vec!["--left-out", "r.exr"],
        vec!["--estimator", "local", "--techniques", "hit"],
        vec!["--estimator", "recursive", "--left-out", "r.exr", "--paths", "E D L"],
    ] {
        let mut command = nephroid();
        command.current_dir(room.directory.path()).arg("render").arg(room.scene()).args(["-o", "b.exr"]);
        let (code, _, err) = run(command.args(&wrong));
        assert_eq!(code, 2, "{wrong:?}: {err}");
    }
}

#[test]
fn the_longest_path_is_chosen_and_explained() {
    let room = Room::new();
    let (image, figures) = (room.path("a.exr"), room.path("figures.json"));
    let long = room.changed(r#"<integer name="max_depth" value="4"/>"#, "");
    let render = |scene: &Path, rest: &[&str]| {
        let mut command = nephroid();
        command.arg("render").arg(scene).arg("-o").arg(&image).arg("--stats").arg(&figures);
        run(command.args(["--max-length", "auto"]).args(rest))
    };
    let read =
        || -> serde_json::Value { serde_json::from_str(&std::fs::read_to_string(&figures).expect("figures")).expect("JSON") };
    let (code, _, err) = render(&long, &["--truncation", "0.01"]);
    assert_eq!(code, 0, "{err}");
    // The floor reflects 0.7: 0.7^13 is the first power below 0.01.
    assert!(
        err.contains("q = 0.700; 12 scatterings") && err.contains("no pixel lacks more") && err.contains("measured"),
        "{err}"
    );
    let json = read();
    assert_eq!((&json["max_length"], &json["truncation"]["a_priori"]), (&13.into(), &true.into()), "{json}");
    let glass = std::fs::read_to_string(&long)
        .expect("the scene")
        .replace("<bsdf type=\"diffuse\"/><emitter", "<bsdf type=\"dielectric\"/><emitter");
    std::fs::write(room.path("glass.xml"), glass).expect("the scene is written");
    let (code, _, err) = render(&room.path("glass.xml"), &[]);
    assert_eq!(code, 0, "{err}");
    assert!(err.contains("no a-priori bound") && err.contains("by estimate"), "{err}");
    assert_eq!(read()["truncation"]["a_priori"], false);
    for wrong in [vec!["--truncation", "0"], vec!["--estimator", "local"]] {
        let (code, _, err) = render(&long, &wrong);
        assert_eq!(code, 2, "{err}");
    }
}

#[test]
fn a_plan_is_written_once_and_read_from_then_on() {
    let room = Room::new();
    let plan = room.path("plan.json");
    let render = |image: &str, more: &[&str]| {
        let mut command = nephroid();
        command.arg("render").arg(room.scene()).args(more).arg("--plan").arg(&plan);
        run(command.arg("-o").arg(room.path(image)))
    };
    let (code, _, err) = render("a.exr", &[]);
    assert!(code == 0 && err.contains("chosen in"), "{err}");
    let written = std::fs::read_to_string(&plan).expect("a plan");
    let image = |name: &str| read_image(&room.path(name)).expect("an image");
    assert_eq!(image("a.exr").attributes.get("plan").map(String::as_str), Some(written.trim()));
    std::fs::write(&plan, r#"{"techniques": "hit", "light_paths": 0, "connections": 1, "merge_radius": 0}"#).expect("written");
    let (code, _, err) = render("b.exr", &[]);
    assert!(code == 0 && !err.contains("chosen in"), "{err}");
    assert_eq!(image("b.exr").attributes.get("techniques").map(String::as_str), Some("hit"));
    let uneven = r#"{"techniques":"hit, nee","light_paths":0,"connections":1,"merge_radius":0.0,"faint_branches":0.01,"chain_samples":1,"guided_gathering":false,"samples":["13","21"]}"#;
    std::fs::write(&plan, uneven).expect("written");
    assert_eq!(render("d.exr", &[]).0, 0);
    assert_eq!(image("d.exr").attributes.get("plan").map(String::as_str), Some(uneven));
    for (text, what) in [
        (r#"{"techniques": "hit, leap", "light_paths": 0, "connections": 1, "merge_radius": 0}"#, "unknown technique `leap`"),
        (r#"{"techniques": "hit", "light_paths": 0, "connections": 1, "merge_radius": -1}"#, "merge_radius"),
        (
            r#"{"techniques": "hit", "light_paths": 0, "connections": 1, "merge_radius": 0, "faint_branches": 2}"#,
            "faint_branches",
        ),
        (r#"{"techniques": "hit", "light_paths": 0, "connections": 1, "merge_radius": 0, "chain_samples": 0}"#, "chain_samples"),
        (
            r#"{"techniques": "hit", "light_paths": 0, "connections": 1, "merge_radius": 0, "samples": ["12", "1"]}"#,
            "rows of digits",
        ),
        (r#"{"techniques": "hit", "light_paths": 0, "connections": 1, "merge_radius": 0, "samples": ["10"]}"#, "from 1 to 9"),
        (r#"{"techniques": "hit", "light_paths": 0}"#, "missing field"),
        (r#"{"techniques": "splat", "light_paths": 4294967295, "connections": 1, "merge_radius": 0}"#, "--max-memory"),
        ("", "EOF"),
    ] {
        std::fs::write(&plan, text).expect("written");
        let (code, _, err) = render("c.exr", &[]);
        assert!(code == 2 && err.contains(what) && !room.path("c.exr").exists(), "{text}: {err}");
    }
    assert_eq!(render("c.exr", &["-e", "gather"]).0, 2);
}
