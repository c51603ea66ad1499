//! Images out: the right numbers, and never half a file.

use nephroid::io::exr::ImageFile;
use nephroid::io::fault::Fault;
use nephroid::io::image::linear_to_srgb;
use nephroid::io::png::PngOptions;
use nephroid::io::write::{OutputFormat, check_writable, read_image, write_atomic, write_image};
use std::fs;
use std::io::Write;
use std::path::Path;

fn image(values: &[[f32; 3]]) -> ImageFile {
    let mut file = ImageFile::new(values.len() as u32, 1);
    file.insert_rgb("", values);
    file
}

fn names(directory: &Path) -> Vec<String> {
    fs::read_dir(directory).expect("readable").map(|e| e.expect("entry").file_name().into_string().expect("text")).collect()
}

#[test]
fn png_is_exposed_clamped_and_srgb_encoded() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("out.PNG");
    let values = [[0.0, 0.001, 0.1], [0.25, 0.5, 1.0], [7.0, -1.0, f32::NAN]];
    for (exposure, sixteen_bits) in [(0.0, false), (1.5, false), (-2.0, true)] {
        write_image(&path, &image(&values), PngOptions { exposure, sixteen_bits }).expect("written");
        let max = if sixteen_bits { 65535.0_f32 } else { 255.0 };
        let back = image::open(&path).expect("a PNG").to_rgb16().into_raw();
        for (got, value) in back.iter().zip(values.iter().flatten()) {
            let shown = if value.is_nan() { 0.0 } else { (value * exposure.exp2()).clamp(0.0, 1.0) };
            let expected = (linear_to_srgb(shown) * max).round() * (65535.0 / max);
            assert_eq!(f32::from(*got), expected, "{value} at {exposure}");
        }
    }
    assert_eq!(names(directory.path()), ["out.PNG"]);
}

#[test]
fn a_failure_leaves_the_old_file_and_nothing_else() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("out.exr");
    fs::write(&path, "old").expect("writable");
    let broken = write_atomic(&path, |out| {
        out.write_all(&[0; 100_000]).expect("space");
        Err(Fault::new("no space left"))
    });
    let message = broken.expect_err("refused").to_string();
    assert!(message.contains("cannot write") && message.contains("out.exr") && message.contains("left as it was"), "{message}");
    assert_eq!(fs::read(&path).expect("there"), b"old");
    assert_eq!(names(directory.path()), ["out.exr"]);
    let mut wrong = image(&[[1.0; 3]]);
    wrong.width = 2;
    assert!(write_image(&path, &wrong, PngOptions::default()).is_err());
    assert!(write_image(&path.with_extension("png"), &wrong, PngOptions::default()).is_err());
    assert!(write_image(&path, &ImageFile::new(0, 0), PngOptions::default()).is_err());
    assert_eq!(fs::read(&path).expect("there"), b"old");
    write_image(&path, &image(&[[1.0; 3]]), PngOptions::default()).expect("written");
    assert_eq!(read_image(&path).expect("an image").rgb(""), Some(vec![[1.0; 3]]));
    assert_eq!(names(directory.path()), ["out.exr"]);
}

#[test]
fn outputs_are_checked_before_rendering() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = |name: &str| directory.path().join(name);
    assert_eq!(check_writable(&at("a.exr")), Ok(OutputFormat::Exr));
    assert_eq!(check_writable(&at("b.Png")), Ok(OutputFormat::Png));
    assert_eq!(check_writable(Path::new("here.png")), Ok(OutputFormat::Png));
    assert!(names(directory.path()).is_empty(), "nothing is left behind");
    fs::create_dir(at("folder.exr")).expect("made");
    fs::write(at("file"), "").expect("made");
    for (name, part) in [
        ("a.xyz", "the known extensions are .exr"),
        ("a", "has no extension"),
        (".exr", "has no extension"),
        ("folder.exr", "is a directory"),
        ("foldr.exr/a.exr", "there is no directory"),
        ("file/a.exr", "director"),
    ] {
        let message = check_writable(&at(name)).expect_err(name).to_string();
        assert!(message.contains(part), "{name}: {message}");
    }
    let hint = check_writable(&at("foldr.exr/a.exr")).expect_err("missing").hint;
    assert_eq!(hint.as_deref(), Some("did you mean `folder.exr`?"));
}

#[cfg(unix)]
#[test]
fn links_and_permissions_are_respected() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let directory = tempfile::tempdir().expect("a directory");
    let at = |name: &str| directory.path().join(name);
    let mode = |name: &str| fs::metadata(at(name)).expect("there").permissions().mode() & 0o777;
    let write = |name: &str| write_image(&at(name), &image(&[[1.0; 3]]), PngOptions::default());
    fs::write(at("plain"), "").expect("made");
    write("new.exr").expect("written");
    assert_eq!(mode("new.exr"), mode("plain"), "an image has the permissions of any new file");
    fs::set_permissions(at("new.exr"), fs::Permissions::from_mode(0o640)).expect("set");
    symlink(at("new.exr"), at("link.exr")).expect("linked");
    write("link.exr").expect("written through the link");
    assert!(fs::symlink_metadata(at("link.exr")).expect("there").is_symlink());
    assert_eq!(mode("new.exr"), 0o640);
    fs::set_permissions(at("new.exr"), fs::Permissions::from_mode(0o440)).expect("set");
    assert!(check_writable(&at("new.exr")).expect_err("protected").to_string().contains("write-protected"));
}
