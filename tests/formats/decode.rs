//! Whole scenes: file names replaced by contents, every problem with its place.

use nephroid::describe::*;
use nephroid::io::assets::decode;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

fn place(line: u32) -> Place {
    Place { file: 1, line, column: 1 }
}

fn mesh(path: PathBuf, line: u32) -> MeshDescription {
    MeshDescription::File { path, format: MeshFormat::Obj, shape_index: 0, flip_tex_coords: true, place: place(line) }
}

fn shape(mesh: u32, face_normals: bool) -> ShapeDescription {
    ShapeDescription {
        id: None,
        model: ShapeModel::Mesh { mesh: MeshId(mesh), face_normals },
        to_world: glam::Mat4::IDENTITY.into(),
        flip_normals: false,
        bsdf: None,
        emission: None,
        place: Place::default(),
    }
}

fn data(description: &MeshDescription) -> &Arc<Mesh> {
    match description {
        MeshDescription::Data(mesh) => mesh,
        MeshDescription::File { path, .. } => panic!("{} was not read", path.display()),
    }
}

fn scene(directory: &Path) -> SceneDescription {
    fs::write(directory.join("triangle.obj"), TRIANGLE).expect("writable");
    fs::write(directory.join("broken.obj"), "v 0 0 0\nf 1 2 3\n").expect("writable");
    fs::write(directory.join("degenerate.obj"), format!("{TRIANGLE}f 1 1 1\n")).expect("writable");
    image::RgbImage::from_pixel(1, 1, image::Rgb([255, 0, 0])).save(directory.join("red.png")).expect("writable");
    let mut scene = SceneDescription::default();
    let names = ["triangle.obj", "triangel.obj", "broken.obj", "degenerate.obj", "triangle.obj", "triangle.obj"];
    scene.meshes = (1..).zip(names).map(|(line, n)| mesh(directory.join(n), line)).collect();
    scene.shapes = vec![shape(0, false), shape(4, true)];
    scene.groups = vec![GroupDescription { shapes: vec![shape(5, false)], ..Default::default() }];
    let picture = |name: &str, line| ImageDescription::File { path: directory.join(name), raw: false, place: place(line) };
    scene.images = vec![picture("red.png", 10), picture(".", 11), picture("no/such.png", 12), picture("broken.obj", 13)];
    scene
}

#[test]
fn everything_readable_is_read_and_everything_else_is_told() {
    let directory = tempfile::tempdir().expect("a directory");
    let mut description = scene(directory.path());
    let mut problems = Problems::default();
    decode(&mut description, &mut problems);
    assert!(Arc::ptr_eq(data(&description.meshes[0]), data(&description.meshes[5])), "read once and shared");
    assert_eq!(data(&description.meshes[0]).normals, [glam::Vec3::Z; 3], "smooth normals, since the file has none");
    assert!(data(&description.meshes[4]).normals.is_empty(), "face normals were asked for");
    let ImageDescription::Data(red) = &description.images[0] else { panic!("not read") };
    assert_eq!(red.data, [1.0, 0.0, 0.0]);
    let told: Vec<(Severity, u32)> = problems.list.iter().map(|p| (p.severity, p.place.line)).collect();
    let (e, w) = (Severity::Error, Severity::Warning);
    assert_eq!(told, [(e, 2), (e, 3), (w, 4), (e, 11), (e, 12), (e, 13)]);
    for (i, part) in [
        (0, "triangel.obj`: does not exist"),
        (1, "broken.obj`: line 2: vertex index 2"),
        (2, "1 of 2 triangles are degenerate"),
        (3, "is a directory"),
        (4, "does not exist: there is no directory"),
        (5, "not an image of a known format"),
    ] {
        assert!(problems.list[i].what.contains(part), "{}", problems.list[i].what);
    }
    assert_eq!(problems.list[0].hint.as_deref(), Some("did you mean `triangle.obj`?"));
}

#[cfg(unix)]
#[test]
fn devices_and_odd_names_are_handled() {
    use std::os::unix::ffi::OsStrExt;
    let directory = tempfile::tempdir().expect("a directory");
    let odd = directory.path().join(std::ffi::OsStr::from_bytes(b"odd\xff\x1b.obj"));
    fs::write(&odd, TRIANGLE).expect("writable");
    let mut description =
        SceneDescription { meshes: vec![mesh(odd.clone(), 1), mesh("/dev/zero".into(), 2)], ..Default::default() };
    description.meshes.push(mesh(odd.join("x\x1b"), 3));
    let mut problems = Problems::default();
    decode(&mut description, &mut problems);
    data(&description.meshes[0]);
    assert!(problems.list[0].what.contains("is a device or a pipe"), "{}", problems.list[0].what);
    assert_eq!(problems.list.len(), 2);
    assert!(problems.list.iter().all(|p| !p.what.contains('\x1b')));
}
