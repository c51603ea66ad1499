//! The page in a real browser: opened from a file, every element driven once, nothing broken.

use super::{Room, page};
use nephroid::io::write::read_image;
use nephroid::report::Picture;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Chromium; `NEPHROID_BROWSER` names another one, and where it is set there must be one.
fn browser() -> Option<PathBuf> {
    let wanted = std::env::var_os("NEPHROID_BROWSER");
    let names = wanted.clone().map_or(vec!["chromium".into(), "chromium-browser".into(), "google-chrome".into()], |w| vec![w]);
    let found = names
        .into_iter()
        .map(PathBuf::from)
        .find(|n| Command::new(n).arg("--version").output().is_ok_and(|o| o.status.success()));
    assert!(found.is_some() || wanted.is_none(), "NEPHROID_BROWSER cannot be started");
    found
}

/// What the browser says, and its document after a while.
fn open(browser: &Path, page: &Path, more: &[&str]) -> (String, String) {
    let profile = tempfile::tempdir().expect("a directory for the browser");
    let output = Command::new(browser)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-dev-shm-usage",
            "--hide-scrollbars",
            "--enable-logging=stderr",
        ])
        .args(["--host-resolver-rules=MAP * ~NOTFOUND", "--virtual-time-budget=30000"])
        .arg(format!("--user-data-dir={}", profile.path().display()))
        .args(more)
        .arg(format!("file://{}", page.display()))
        .output()
        .expect("the browser runs");
    let text = |b: Vec<u8>| String::from_utf8_lossy(&b).into_owned();
    (text(output.stdout), text(output.stderr))
}

/// Messages of pages on the console, except remarks about speed.
fn complaints(log: &str) -> Vec<&str> {
    log.lines().filter(|l| l.contains(":CONSOLE") && !l.contains("willReadFrequently")).collect()
}

/// The page with an ear for errors before everything else and the driver after it.
fn driven(page: &str, expected: &Value) -> String {
    let ear = "<script>window.errors = []; addEventListener('error', e => errors.push(e.message)); \
               addEventListener('unhandledrejection', e => errors.push(String(e.reason)));</script>";
    let driver = format!("<script>const expected = {expected};\n{}</script></body>", include_str!("drive.js"));
    page.replacen("<head>", &format!("<head>{ear}"), 1).replacen("</body>", &driver, 1)
}

fn found(document: &str) -> Value {
    let text = document.split_once("<pre id=\"driven\" hidden=\"\">").and_then(|(_, rest)| rest.split_once("</pre>"));
    let text = text.unwrap_or_else(|| panic!("the driver did not get to its end: {document:.2000}")).0;
    serde_json::from_str(&text.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&")).expect("JSON")
}

/// What the reference is at a pixel beside the lamp, as written to its own file.
fn expected(room: &Room) -> Value {
    let reference = Picture::of_file(&read_image(&room.references()[0]).unwrap()).unwrap();
    let (x, y) = (reference.width / 3, reference.height * 3 / 4);
    let rgb = reference.mean[(y * reference.width + x) as usize];
    json!([{ "x": x, "y": y, "width": reference.width, "height": reference.height, "rgb": rgb }])
}

#[test]
fn the_page_works_in_a_browser() {
    let Some(browser) = browser() else { return println!("skipped: no chromium on the PATH") };
    let room = Room::new();
    let broken = room.path("broken.xml");
    std::fs::write(&broken, "<scene").unwrap();
    let arguments = [broken.to_str().unwrap(), "--spp", "2,8", "--runs", "2", "--reference-time", "2s", "--size", "64x48"];
    let (code, err) = room.bench(&arguments);
    assert_eq!(code, 1, "{err}");
    let page = page(&room);
    let file = room.path("driven.html");
    std::fs::write(&file, driven(&page, &expected(&room))).unwrap();
    for window in ["--window-size=1200,1000", "--window-size=390,844"] {
        let (document, log) = open(&browser, &file, &[window, "--dump-dom"]);
        let found = found(&document);
        assert_eq!(found["errors"], json!([]), "{window}");
        let checks = found["checks"].as_object().unwrap();
        let failed: Vec<_> = checks.iter().filter(|c| c.1 != true).map(|c| c.0).collect();
        assert!(failed.is_empty(), "{window}: {failed:?}");
        assert!(checks.len() > 25 && checks.keys().any(|k| k.contains("numbers of a pixel")), "{checks:?}");
        assert!(found["driven"].as_u64() > Some(80), "{found}");
        assert!(complaints(&log).is_empty(), "{:?}", complaints(&log));
    }
    // Kept for people: the page as it opens.
    let plain = room.path("out/index.html");
    let picture = Path::new(env!("CARGO_TARGET_TMPDIR")).join("bench-page.png");
    let (_, log) = open(&browser, &plain, &["--window-size=1200,2600", &format!("--screenshot={}", picture.display())]);
    assert!(complaints(&log).is_empty(), "{:?}", complaints(&log));
    let size = std::fs::metadata(&picture).expect("a screenshot").len();
    assert!(size > 50_000, "the screenshot has {size} bytes");
}

/// The driver notices a broken page.
#[test]
fn a_broken_page_is_noticed() {
    let Some(browser) = browser() else { return println!("skipped: no chromium on the PATH") };
    let room = Room::new();
    assert_eq!(room.bench(&["--spp", "2", "--runs", "2", "--reference-time", "1s", "-e", "gather"]).0, 0);
    let page = page(&room);
    for (from, to) in
        [("f: () => this.select({ mode: \"error\" })", "f: () => 0"), ("left = g;\n  }\n  return", "left = 0;\n  }\n  return")]
    {
        assert!(page.contains(from), "{from}");
        let file = room.path("driven.html");
        std::fs::write(&file, driven(&page.replacen(from, to, 1), &expected(&room))).unwrap();
        let found = found(&open(&browser, &file, &["--window-size=900,900", "--dump-dom"]).0);
        let failed = found["checks"].as_object().unwrap().values().any(|ok| ok != true);
        assert!(failed || found["errors"] != json!([]), "`{to}` is not noticed");
    }
}
