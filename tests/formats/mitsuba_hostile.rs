//! Scenes that nobody wrote: no text makes the reader panic, hang, or fill the memory.

use nephroid::io::mitsuba::{self, LoadError, LoadOptions};
use proptest::prelude::*;
use std::path::Path;

const SENSOR: &str = "<sensor type=\"orthographic\"/><emitter type=\"constant\"/>";

fn fail(body: &str) -> LoadError {
    let text = format!("<scene version=\"3.0.0\">{SENSOR}{body}</scene>");
    match mitsuba::from_str(&text, Path::new("/nonexistent"), &LoadOptions::default()) {
        Err(error) => error,
        Ok(_) => panic!("was read without errors"),
    }
}

fn expect(body: &str, part: &str) {
    let text = fail(body).to_string();
    assert!(text.contains(part), "no `{part}` in\n{text}");
}

#[test]
fn a_flood_of_problems_is_cut() {
    for body in [
        "<shap/>".repeat(20_000),
        "<shape type=\"spher\"/>".repeat(20_000),
        "<shape type=\"sphere\"><float name=\"radus\" value=\"1\"/></shape>".repeat(20_000),
        (0..20_000).map(|i| format!("<shape type=\"cube\" id=\"s{i}\"><ref id=\"t{i}\"/></shape>")).collect(),
        (0..20_000).map(|i| format!("<shape type=\"$p{i}\"/>")).collect(),
    ] {
        let error = fail(&body);
        let text = error.to_string();
        assert!(error.problems.list.len() <= 1000 && text.len() < 10_000_000);
        assert!(text.contains("more problems; what comes after was not looked at"));
    }
}

#[test]
fn overlong_names_are_cut_in_messages() {
    let long = "x".repeat(1 << 20);
    for body in [
        format!("<{long}/>"),
        format!("<shape {long}=\"1\" type=\"cube\"/>"),
        format!("<shape type=\"{long}\"/>"),
        format!("<shape type=\"cube\"><ref id=\"{long}\"/></shape><bsdf type=\"diffuse\" id=\"{long}y\"/>"),
        format!("<shape type=\"obj\"><string name=\"filename\" value=\"{long}\"/></shape>"),
        format!("<shape type=\"${long}\"/>"),
        format!("<shape type=\"sphere\"><float name=\"radius\" value=\"{long}\"/></shape>"),
    ] {
        let text = fail(&body).to_string();
        assert!(text.len() < 20_000, "{} bytes", text.len());
    }
}

#[test]
fn references_cannot_unfold_without_bound() {
    let doubling: String = (0..40)
        .map(|i| {
            let inner = ["color0", "color1"].map(|c| format!("<ref name=\"{c}\" id=\"t{i}\"/>")).concat();
            format!("<texture type=\"checkerboard\" id=\"t{}\">{inner}</texture>", i + 1)
        })
        .collect();
    expect(&format!("<texture type=\"checkerboard\" id=\"t0\"/>{doubling}"), "references unfold");
    let chain: String = (0..3000).map(|i| format!("<bsdf type=\"mask\" id=\"m{i}\"><ref id=\"m{}\"/></bsdf>", i + 1)).collect();
    expect(&format!("{chain}<bsdf type=\"diffuse\" id=\"m3000\"/>"), "references unfold");
}

const VALID: &str = r##"<scene version="3.0.0">
    <default name="spp" value="64"/><path value="."/>
    <integrator type="moment"><integrator type="path"><integer name="max_depth" value="12"/></integrator></integrator>
    <sensor type="thinlens"><string name="fov_axis" value="x"/><float name="fov" value="42"/>
        <float name="aperture_radius" value="0.1"/>
        <transform name="to_world"><lookat origin="0.5, 3, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
        <sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>
        <film type="hdrfilm"><integer name="width" value="32"/><rfilter type="lanczos"/></film>
    </sensor>
    <texture type="checkerboard" id="t"><rgb name="color0" value="#ff8000"/></texture><alias id="t" as="u"/>
    <bsdf type="twosided" id="b"><bsdf type="diffuse"><ref name="reflectance" id="u"/></bsdf></bsdf>
    <bsdf type="roughconductor"><string name="material" value="Au"/><float name="alpha" value="0.2"/></bsdf>
    <shape type="shapegroup" id="g"><shape type="sphere"><point name="center" x="1" y="2" z="3"/><ref id="b"/></shape></shape>
    <shape type="instance"><ref id="g"/><transform name="to_world"><rotate y="1" angle="45"/><scale value="1.5"/>
        <matrix value="1 0 0 0 1 0 0 0 1"/></transform></shape>
    <shape type="disk"><emitter type="area"><spectrum name="radiance" value="400:0, 500:8, 600:15.6"/></emitter></shape>
</scene>"##;

/// One change of a text: remove, insert, repeat or replace.
fn mutate(text: &mut String, change: (u8, u16, u16, u8)) {
    let chars: Vec<char> = text.chars().collect();
    let place = |v: u16| v as usize * chars.len() / 65536;
    let (a, b) = (place(change.1).min(place(change.2)), place(change.1).max(place(change.2)));
    let b = b.min(a + 60);
    let pieces =
        ["<", ">", "\"", "$", "/", "&", "é", "\0", "-", ":", "1e99", "<include filename=\"x\"/>", "<!--", "]]>", "<shape>"];
    let piece: Vec<char> = pieces[change.3 as usize % pieces.len()].chars().collect();
    let middle = match change.0 % 4 {
        0 => Vec::new(),
        1 => [&piece[..], &chars[a..b]].concat(),
        2 => [&chars[a..b], &chars[a..b]].concat(),
        _ => piece,
    };
    *text = chars[..a].iter().chain(&middle).chain(&chars[b..]).collect();
}

#[test]
fn the_valid_scene_is_valid() {
    let loaded = mitsuba::from_str(VALID, Path::new("."), &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    assert!(loaded.warnings.list.is_empty());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_text_makes_the_reader_panic(changes in prop::collection::vec(any::<(u8, u16, u16, u8)>(), 1..6)) {
        let mut text = VALID.to_string();
        for change in changes {
            mutate(&mut text, change);
        }
        if let Err(error) = mitsuba::from_str(&text, Path::new("/nonexistent"), &LoadOptions::default()) {
            prop_assert!(error.problems.has_errors());
            prop_assert!(!error.to_string().is_empty());
        }
    }

    #[test]
    fn no_bytes_make_the_reader_panic(text in "[<>/\"'=a-c $:&!\\-\\[\\]?\n0-9]{0,200}") {
        let _ = mitsuba::from_str(&text, Path::new("/nonexistent"), &LoadOptions::default());
    }
}
