//! Bad scenes: each gets its message, with place and hint, and never a panic.

use nephroid::io::mitsuba::{self, LoadError, LoadOptions};
use std::path::Path;

const SENSOR: &str = r#"<sensor type="perspective"><float name="fov" value="40"/></sensor><emitter type="constant"/>"#;

fn fail_text(text: &str, options: &LoadOptions) -> LoadError {
    match mitsuba::from_str(text, Path::new("."), options) {
        Err(error) => error,
        Ok(_) => panic!("was read without errors: {text}"),
    }
}

fn fail(body: &str) -> String {
    let sensor = if body.contains("<sensor") { "" } else { SENSOR };
    fail_text(&format!("<scene version=\"3.0.0\">\n{body}\n{sensor}</scene>"), &LoadOptions::default()).to_string()
}

/// The message of a bad body contains each of these.
fn expect(body: &str, parts: &[&str]) {
    let text = fail(body);
    for part in parts {
        assert!(text.contains(part), "no `{part}` in\n{text}");
    }
    assert!(text.contains("--> scene:"), "no place in\n{text}");
}

fn shape(inner: &str) -> String {
    format!("<shape type=\"sphere\">{inner}</shape>")
}

fn bsdf(kind: &str, inner: &str) -> String {
    format!("<bsdf type=\"{kind}\">{inner}</bsdf>")
}

fn camera(inner: &str) -> String {
    format!("<sensor type=\"perspective\">{inner}</sensor>")
}

fn film(inner: &str) -> String {
    camera(&format!("<film type=\"hdrfilm\">{inner}</film>"))
}

#[test]
fn unknown_names_get_the_nearest_known() {
    expect("<bsdf type=\"difuse\"/>", &["unknown bsdf `difuse`", "did you mean `diffuse`?", "roughplastic", "scene:2:13"]);
    expect(
        &bsdf("diffuse", r#"<rgb name="reflectence" value="0.5"/>"#),
        &["unknown property `reflectence` of bsdf `diffuse`", "did you mean `reflectance`?"],
    );
    expect(
        &bsdf("roughconductor", r#"<float name="alhpa" value="0.5"/>"#),
        &["`alhpa`", "did you mean `alpha`?", "known: material"],
    );
    expect(&shape(r#"<transform name="toWorld"/>"#), &["did you mean `to_world`?"]);
    expect("<shap type=\"sphere\"/>", &["unknown element <shap>", "did you mean `shape`?"]);
    expect(&shape(r#"<float name="radius" valeu="1"/>"#), &["unknown attribute `valeu` of <float>", "did you mean `value`?"]);
    expect(
        &shape(r#"<ref id="wite"/>"#).replace("</shape>", "</shape><bsdf type=\"diffuse\" id=\"white\"/>"),
        &["nothing has the id `wite`", "did you mean `white`?"],
    );
    expect(&bsdf("dielectric", r#"<string name="int_ior" value="watr"/>"#), &["`watr`", "did you mean `water`?"]);
    expect(&bsdf("conductor", r#"<string name="material" value="Agg"/>"#), &["unknown conductor `Agg`", "did you mean `Ag`?"]);
    expect(&bsdf("roughconductor", r#"<string name="distribution" value="phong"/>"#), &["`phong`", "known: beckmann, ggx"]);
    expect("<integrator type=\"pth\"/>", &["unknown integrator `pth`", "did you mean `path`?"]);
    expect("<alias id=\"a\" as=\"b\"/>", &["no element before this alias has the id `a`"]);
}

#[test]
fn plugins_of_mitsuba_that_are_missing_are_not_called_unknown() {
    for (element, plugin) in [
        ("bsdf", "principledthin"),
        ("bsdf", "normalmap"),
        ("bsdf", "hair"),
        ("shape", "sdfgrid"),
        ("emitter", "projector"),
        ("emitter", "sunsky"),
        ("sensor", "distant"),
        ("texture", "mesh_attribute"),
        ("integrator", "prb"),
    ] {
        expect(
            &format!("<{element} type=\"{plugin}\"/>{SENSOR}"),
            &[&format!("Mitsuba's `{plugin}` ({element}) is not supported yet")],
        );
    }
    expect(&shape(r#"<medium name="interior" type="homogeneous"/>"#), &["Mitsuba's <medium> is not supported yet"]);
}

#[test]
fn wrong_types_say_what_is_expected() {
    expect(&shape(r#"<string name="radius" value="2"/>"#), &["`radius` of shape `sphere` must be a float, not a string"]);
    expect(&shape(r#"<rgb name="center" value="1,2,3"/>"#), &["must be a point or vector, not a rgb"]);
    expect(&film(r#"<float name="width" value="64"/>"#), &["`width` of film `hdrfilm` must be an integer, not a float"]);
    expect(
        &bsdf("diffuse", r#"<string name="reflectance" value="red"/>"#),
        &["must be a float, rgb, spectrum or texture, not a string"],
    );
    expect(
        &bsdf("dielectric", r#"<texture name="int_ior" type="checkerboard"/>"#),
        &["must be a float or the name of a material, not a <texture>"],
    );
    expect(&shape(r#"<float name="radius" value="two"/>"#), &["`two` is not a number"]);
    expect(&shape(r#"<float name="radius" value="nan"/>"#), &["not a finite number"]);
    expect(&shape(r#"<float name="radius" value="1e39"/>"#), &["not a finite number in single precision"]);
    expect(&shape(r#"<boolean name="flip_normals" value="1"/>"#), &["neither true nor false"]);
    expect(&shape(r#"<point name="center" value="1, 2"/>"#), &["has 2 numbers, not 1 or 3"]);
    expect(&shape(r#"<point name="center" x="1"/>"#), &["x, y and z are all needed"]);
    expect(&film(r#"<integer name="width" value="2.5"/>"#), &["`2.5` is not a whole number"]);
    expect(&bsdf("diffuse", r#"<rgb name="reflectance" value="1 2"/>"#), &["has 2 numbers"]);
    expect(&bsdf("diffuse", r##"<rgb name="reflectance" value="#12345"/>"##), &["not a colour code"]);
    expect(&bsdf("diffuse", r#"<texture type="checkerboard"/>"#), &["has no `name`", "reflectance"]);
}

#[test]
fn ids_and_references_are_checked() {
    expect(
        "<bsdf type=\"diffuse\" id=\"a\"/>\n<bsdf type=\"plastic\" id=\"a\"/>",
        &["`a` is used twice", "first used at scene:2:26", "scene:3:26"],
    );
    let cycle = r#"<bsdf type="twosided" id="a"><ref id="b"/></bsdf><bsdf type="mask" id="b"><ref id="a"/></bsdf>"#;
    expect(cycle, &["cyclic reference: a -> b -> a"]);
    expect(r#"<bsdf type="twosided" id="a"><ref id="a"/></bsdf>"#, &["cyclic reference: a -> a"]);
    let group = r#"<shape type="shapegroup" id="g"><shape type="instance"><ref id="g"/></shape></shape>"#;
    expect(group, &["cyclic reference: g -> <shape> -> g"]);
}

#[test]
fn values_given_twice_or_missing_are_errors() {
    let twice = shape("<float name=\"radius\" value=\"1\"/>\n<float name=\"radius\" value=\"2\"/>");
    expect(&twice, &["`radius` of shape `sphere` is given twice", "first given at scene:2"]);
    expect("<shape type=\"obj\"/>", &["shape `obj` needs `filename`"]);
    expect(&shape("<float name=\"radius\"/>"), &["<float> has no `value`"]);
    expect(&shape("<float value=\"1\"/>"), &["<float> has no `name`"]);
    expect("<shape/>", &["<shape> has no `type`"]);
    expect(&bsdf("twosided", ""), &["needs `bsdf`"]);
    expect(&bsdf("blendbsdf", r#"<float name="weight" value=".5"/><bsdf type="diffuse"/>"#), &["needs two nested models"]);
    expect(&bsdf("mask", "<bsdf type=\"null\"/><bsdf type=\"null\"/>"), &["takes at most 1 <bsdf>"]);
    expect(&bsdf("roughconductor", r#"<float name="alpha_u" value=".1"/>"#), &["needs both `alpha_u` and `alpha_v`"]);
    expect(
        &bsdf("principled", r#"<float name="eta" value="1.5"/><float name="specular" value="0.5"/>"#),
        &["has both `eta` and `specular`"],
    );
    expect(&bsdf("conductor", r#"<float name="eta" value="1"/>"#), &["`k` is missing"]);
    expect(
        &camera(r#"<float name="fov" value="30"/><string name="focal_length" value="50mm"/>"#),
        &["both `fov` and `focal_length`"],
    );
    expect(&camera(r#"<string name="focal_length" value="50cm"/>"#), &["positive number followed by mm"]);
}

#[test]
fn elements_stand_where_they_have_a_meaning() {
    expect("<float name=\"x\" value=\"1\"/>", &["<float> has no meaning at top level"]);
    expect("<translate x=\"1\"/>", &["<translate> has no meaning at top level"]);
    expect(&shape(r#"<translate x="1"/>"#), &["<translate> cannot stand inside <shape>"]);
    expect(
        &shape(r#"<float name="radius" value="1"><float name="a" value="1"/></float>"#),
        &["<float> cannot stand inside <float>"],
    );
    expect(&bsdf("diffuse", "<emitter type=\"area\"/>"), &["bsdf `diffuse` takes no <emitter>"]);
    expect(&shape("<emitter type=\"point\"/>"), &["cannot carry", "only an `area` emitter"]);
    expect(
        "<shape type=\"shapegroup\" id=\"g\"><shape type=\"sphere\"><emitter type=\"area\"/></shape></shape>",
        &["shape group cannot emit"],
    );
    expect("<shape type=\"instance\"><shape type=\"sphere\"/></shape>", &["copies a `shapegroup`, not a `sphere`"]);
    expect("<integrator type=\"path\"/><integrator type=\"path\"/>", &["two integrators"]);
    expect("<emitter type=\"constant\"/><emitter type=\"constant\"/>", &["two environment emitters"]);
}

#[test]
fn numbers_out_of_range_are_found_at_load() {
    let light = |value: &str| shape(&format!("<emitter type=\"area\"><rgb name=\"radiance\" value=\"{value}\"/></emitter>"));
    expect(&light("-1, 0, 0"), &["`radiance` is [-1.0, 0.0, 0.0]; it must be finite and not negative"]);
    expect(&light("nan, 0, 0"), &["`nan` is not a finite number"]);
    expect(&light("inf"), &["`inf` is not a finite number"]);
    expect(
        &bsdf("diffuse", "\n<rgb name=\"reflectance\" value=\"1.3\"/>"),
        &["`reflectance` is 1.3; it must lie in [0, 1]", "scene:3:32"],
    );
    expect(&bsdf("diffuse", r#"<rgb name="reflectance" value="0.5 0.5 -0.1"/>"#), &["must lie in [0, 1]"]);
    let board = r#"<texture name="reflectance" type="checkerboard"><float name="color1" value="2"/></texture>"#;
    expect(&bsdf("diffuse", board), &["`color1` is 2.0; it must lie in [0, 1]"]);
    expect(&bsdf("dielectric", r#"<float name="int_ior" value="-1"/>"#), &["`int_ior` is -1.0; it must be greater than 0"]);
    expect(&bsdf("dielectric", r#"<float name="ext_ior" value="0"/>"#), &["`ext_ior` is 0.0; it must be greater than 0"]);
    expect(&bsdf("roughconductor", r#"<float name="alpha" value="0"/>"#), &["`alpha_u` is 0.0; it must be greater than 0"]);
    expect(&bsdf("twosided", "<bsdf type=\"dielectric\"/>"), &["contains one that transmits light"]);
    let clear = bsdf("principled", r#"<float name="spec_trans" value="0.1"/>"#);
    expect(&bsdf("twosided", &clear), &["contains one that transmits light"]);
    expect(&bsdf("principled", r#"<float name="specular" value="13"/>"#), &["`specular` is 13, but must lie in [0, 12.5)"]);
    expect(&bsdf("principled", r#"<float name="metallic" value="1.5"/>"#), &["`metallic` is 1.5; it must lie in [0, 1]"]);
    for fov in ["0", "180", "-3"] {
        expect(&camera(&format!("<float name=\"fov\" value=\"{fov}\"/>")), &["it must lie between 0 and 180 degrees"]);
    }
    expect(&camera(r#"<float name="near_clip" value="0"/>"#), &["`near_clip` is 0.0; it must be greater than 0"]);
    expect(
        &camera(r#"<float name="near_clip" value="3"/><float name="far_clip" value="2"/>"#),
        &["`far_clip` is 2.0; it must be greater than `near_clip`"],
    );
    expect(
        &camera(r#"<sampler type="independent"><integer name="sample_count" value="0"/></sampler>"#),
        &["`sample_count` is 0; it must be at least 1"],
    );
    expect(&film(r#"<integer name="width" value="0"/><integer name="height" value="0"/>"#), &["`width` is 0", "`height` is 0"]);
    expect(&film(r#"<integer name="width" value="-3"/>"#), &["-3 is not from 0 to 4294967295"]);
    expect(
        &film(r#"<integer name="crop_width" value="1000"/>"#),
        &["crop window 1000 × 576 at (0, 0) does not lie in the film of 768 × 576"],
    );
    expect(
        &film(r#"<rfilter type="gaussian"><float name="stddev" value="-1"/></rfilter>"#),
        &["standard deviation from 0 to 16"],
    );
    expect(&shape(r#"<float name="radius" value="-1"/>"#), &["`radius` is -1.0", "flip_normals"]);
    expect(r#"<emitter type="directional"><vector name="direction" value="0"/></emitter>"#, &["finite and not zero"]);
    expect(
        r#"<emitter type="spot"><float name="beam_width" value="30"/></emitter>"#,
        &["`beam_width` is 30.0; it must lie between 0 and `cutoff_angle`"],
    );
    expect(r#"<integrator type="path"><integer name="rr_depth" value="0"/></integrator>"#, &["0 is not from 1 to"]);
    expect(r#"<integrator type="path"><integer name="max_depth" value="-2"/></integrator>"#, &["-2 is not from -1 to"]);
}

#[test]
fn transforms_without_inverse_or_meaning_are_errors() {
    let of = |steps: &str| shape(&format!("<transform name=\"to_world\">{steps}</transform>"));
    expect(&of(r#"<scale value="0"/>"#), &["not invertible", "does it scale by 0?"]);
    expect(&of(r#"<scale z="0"/>"#), &["not invertible"]);
    expect(&of(r#"<matrix value="1 2 3 2 4 6 0 0 1"/>"#), &["not invertible"]);
    expect(&of(r#"<matrix value="1 2 3"/>"#), &["16 or 9 numbers, not 3"]);
    expect(&of(r#"<matrix value="1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1"/>"#), &["last row must be 0 0 0 1"]);
    expect(&of(r#"<rotate angle="90"/>"#), &["the axis is zero"]);
    expect(&of(r#"<rotate x="1"/>"#), &["<rotate> has no `angle`"]);
    expect(&of(r#"<translate x="1" value="3"/>"#), &["not both"]);
    expect(&of(r#"<translate x="a"/>"#), &["`a` is not a number"]);
    expect(&of(r#"<lookat origin="0,0,0" target="0,0,0" up="0,1,0"/>"#), &["origin and target are the same point"]);
    expect(&of(r#"<lookat origin="0,0,0" target="0,0,1" up="0,0,2"/>"#), &["parallel to the line of sight"]);
    expect(&camera(r#"<transform name="to_world"><scale value="2"/></transform>"#), &["scales or shears"]);
}

#[test]
fn parameters_are_checked_in_both_directions() {
    expect(&shape(r#"<float name="radius" value="$rr"/>"#), &["the parameter `$rr` has no value", "-D rr=…"]);
    let late = shape(r#"<float name="radius" value="$r"/>"#) + r#"<default name="r" value="1"/>"#;
    expect(&late, &["the parameter `$r` has no value", "move it up"]);
    let options = LoadOptions { defines: vec![("sp".into(), "1".into())], sandbox: None };
    let text = format!("<scene version=\"3.0.0\"><default name=\"spp\" value=\"1\"/>{SENSOR}</scene>");
    let message = fail_text(&text, &options).to_string();
    assert!(message.contains("the scene has no parameter `sp`") && message.contains("did you mean `spp`?"), "{message}");
    let laughs: String =
        (0..40).map(|i| format!("<default name=\"l{}\" value=\"{}\"/>", i + 1, format!("$l{i}").repeat(10))).collect();
    expect(&format!("<default name=\"l0\" value=\"lol\"/>{laughs}"), &["longer than 1 MiB"]);
}

#[test]
fn versions_are_checked() {
    let version = |v: &str| fail_text(&format!("<scene{v}>{SENSOR}</scene>"), &LoadOptions::default()).to_string();
    assert!(version("").contains("has no version"));
    assert!(version(" version=\"99.0.0\"").contains("scene version 99.0.0 is not known"));
    assert!(version(" version=\"0.6.0\"").contains("files of Mitsuba 0.x"));
    assert!(version(" version=\"abc\"").contains("`abc` is not a scene version"));
    for fine in ["2.0.0", "2.1.0", "3.0.0", "3.5", "3"] {
        assert!(
            mitsuba::from_str(&format!("<scene version='{fine}'>{SENSOR}</scene>"), Path::new("."), &LoadOptions::default())
                .is_ok()
        );
    }
}

#[test]
fn malformed_files_get_one_line_with_a_place() {
    let of = |text: &str| fail_text(text, &LoadOptions::default());
    for (text, what, place) in [
        ("", "the file is empty", "scene:1:1"),
        ("hello", "not an XML file", "scene:1:1"),
        ("<scene version='3.0.0'>\n<shape", "malformed XML", "scene:2:"),
        ("<scene version='3.0.0'>\n<shape type='sphere'>\n</scene>", "malformed XML", "scene:3:1"),
        ("<scene version='3.0.0'>", "malformed XML", "scene:1:"),
        ("<shape type='sphere'/>", "root element is <shape>, not <scene>", "scene:1:1"),
        ("<!DOCTYPE s [<!ENTITY a 'b'>]><scene version='3.0.0'>&a;</scene>", "document type definition", "scene:1:1"),
        ("<scene version='3.0.0'>\n&lol9;</scene>", "malformed XML", "scene:2:1"),
    ] {
        let error = of(text);
        assert_eq!(error.problems.list.len(), 1, "{error}");
        let message = error.to_string();
        assert!(message.contains(what) && message.contains(place), "{message}");
        assert!(!error.problems.list[0].what.contains('\n'));
    }
    for depth in [300, 20_000, 2_000_000] {
        let message = of(&("<scene version='3.0.0'>".to_string() + &"<shape>".repeat(depth))).to_string();
        assert!(message.contains("nested deeper than 256"));
        assert!(message.contains("scene:1:"));
    }
}

#[test]
fn files_that_cannot_be_read_say_why() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("scene.xml");
    let load = |path: &Path| mitsuba::load(path, &LoadOptions::default()).expect_err("an error").to_string();
    assert!(load(&path).contains("not found"));
    assert!(load(dir.path()).contains("is a directory"));
    std::fs::write(&path, [0x3c, 0x73, 0x0a, 0xff, 0x00]).unwrap();
    assert!(load(&path).contains("byte 0xff at offset 3 (line 2) is not UTF-8"));
    std::fs::write(&path, [0xff, 0xfe, 0x3c, 0x00]).unwrap();
    assert!(load(&path).contains("UTF-16"));
    if Path::new("/dev/zero").exists() {
        assert!(load(Path::new("/dev/zero")).contains("not a regular file"));
    }
    std::fs::write(dir.path().join("cup.obj"), "").unwrap();
    std::fs::write(
        &path,
        r#"<scene version="3.0.0"><shape type="obj"><string name="filename" value="cupp.obj"/></shape></scene>"#,
    )
    .unwrap();
    let message = load(&path);
    for part in ["file `cupp.obj` not found", "did you mean `cup.obj`?", "searched in:", "scene.xml:1:"] {
        assert!(message.contains(part), "{message}");
    }
}

#[test]
fn includes_that_go_round_or_out_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, body: &str| {
        std::fs::write(dir.path().join(name), format!("<scene version=\"3.0.0\">{body}</scene>")).unwrap();
    };
    write("a.xml", r#"<include filename="b.xml"/>"#);
    write("b.xml", r#"<include filename="a.xml"/>"#);
    write("missing.xml", r#"<include filename="bb.xml"/>"#);
    let load = |name: &str, sandbox: Option<&Path>| {
        let options = LoadOptions { defines: Vec::new(), sandbox: sandbox.map(Path::to_path_buf) };
        mitsuba::load(&dir.path().join(name), &options).expect_err("an error").to_string()
    };
    assert!(load("a.xml", None).contains("cyclic include: a.xml -> b.xml -> a.xml"));
    assert!(load("missing.xml", None).contains("did you mean `b.xml`?"));
    std::fs::create_dir(dir.path().join("inner")).unwrap();
    write("inner/out.xml", r#"<include filename="../b.xml"/>"#);
    let inner = dir.path().join("inner");
    assert!(load("inner/out.xml", Some(&inner)).contains("outside of the sandbox"));
    for i in 0..40 {
        let next = format!("<include filename=\"c{}.xml\"/>", i + 1).repeat(2);
        write(&format!("c{i}.xml"), &next);
    }
    write("c40.xml", "");
    assert!(load("c0.xml", None).contains("more includes than"));
}

#[test]
fn all_problems_are_reported_at_once_in_order() {
    let text = fail(&(shape(r#"<float name="radus" value="1"/>"#) + &bsdf("difuse", "") + &shape(r#"<ref id="x"/>"#)));
    assert_eq!(text.matches("error:").count(), 3, "{text}");
}

#[test]
fn a_scene_without_a_sensor_is_an_error() {
    let text = fail_text("<scene version='3.0.0'/>", &LoadOptions::default()).to_string();
    assert!(text.contains("the scene has no sensor") && text.contains("no emitter: the image will be black"), "{text}");
}
