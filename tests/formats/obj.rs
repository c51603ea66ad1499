//! Wavefront OBJ. The expected vertices and normals are what Mitsuba 3.9.1 makes of the same text.

use glam::{Vec2, Vec3};
use nephroid::describe::{Mesh, smooth_normals};
use nephroid::io::obj::parse;

fn mesh(text: &str) -> Mesh {
    let decoded = parse(text.as_bytes(), true).expect("a sound file");
    assert_eq!(decoded.warnings, Vec::<String>::new());
    decoded.value
}

fn fault(text: &str) -> String {
    parse(text.as_bytes(), true).expect_err("a broken file").to_string()
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn vertices_are_distinct_triples_in_order_of_use() {
    let m = mesh(&format!("{SQUARE}v 9 9 9\nvn 0 0 2\nvn 0 1 1\nf 1//1 2//1 3//2\nf 1//1 3//1 4//2\n"));
    assert_eq!(m.positions, [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::new(1.0, 1.0, 0.0), Vec3::Y]);
    assert_eq!(m.triangles, [[0, 1, 2], [0, 3, 4]]);
    assert_eq!(m.normals[0], Vec3::Z);
    assert_eq!(m.normals[2], Vec3::new(0.0, 1.0, 1.0).normalize());
    assert!(m.uvs.is_empty());
}

#[test]
fn flipped_texture_coordinates_count_v_from_the_top() {
    let text = format!("{SQUARE}vt 0.1 0.25\nvt 0.5\nf 1/1 2/1 3/2\n");
    assert_eq!(mesh(&text).uvs, [Vec2::new(0.1, 0.75), Vec2::new(0.1, 0.75), Vec2::new(0.5, 1.0)]);
    assert_eq!(parse(text.as_bytes(), false).expect("sound").value.uvs[0], Vec2::new(0.1, 0.25));
}

#[test]
fn polygons_are_fans_and_objects_are_joined() {
    let text = "# five\r\nmtllib none.mtl\r\no a\r\ng x\r\nusemtl q\r\nv 0 0 0 2.0\r\nv 1 0 0 0.5 0.5 0.5\r\nv 2 1 0\r\nv 1 2 0\r\n\
                v 0 1 0\r\ns off\r\nf 1 2 3 4 5 # inline\r\no b\r\nv 5 5 5\r\nv 6 5 5\r\nv 5 6 5\r\nf 6 \\\r\n 7 8\r\nl 1 2\r\n";
    let m = mesh(text);
    assert_eq!(m.triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4], [5, 6, 7]]);
    assert_eq!(m.positions.len(), 8);
}

#[test]
fn negative_indices_count_back_and_forward_references_work() {
    let expected = mesh(&format!("{SQUARE}f 1 2 3\nf 1 3 4\n"));
    assert_eq!(mesh(&format!("{SQUARE}f -4 -3 -2\nv 7 7 7\nf -5 -3 -2\n")), expected);
    assert_eq!(mesh(&format!("f 1 2 3\nf 1 3 4\n{SQUARE}")), expected);
}

#[test]
fn smooth_normals_weigh_faces_by_their_angle() {
    let m = mesh("v 0 0 0\nv 3 0 0\nv 1 1 0.5\nv 0 1 1\nv 0.2 0 5\nf 1 2 3\nf 1 3 4\nf 1 4 5\n");
    assert!(m.normals.is_empty());
    let expected = [
        [0.567_808_87, -0.471_033_54, 0.675_070_7],
        [0.0, -0.447_213_6, 0.894_427_2],
        [0.130_647_18, -0.544_807_73, 0.828_321_04],
        [0.922_171_4, -0.273_495_64, 0.273_495_64],
        [0.998_403_9, 0.039_936_155, -0.039_936_155],
    ];
    for (n, e) in smooth_normals(&m.positions, &m.triangles).into_iter().zip(expected) {
        assert!(n.abs_diff_eq(Vec3::from_array(e), 1e-6), "{n} is not {e:?}");
    }
}

#[test]
fn smooth_normals_do_not_depend_on_size() {
    let m = mesh("v 0 0 0\nv 3 0 0\nv 1 1 0.5\nv 0 1 1\nf 1 2 3\nf 1 3 4\n");
    let expected = smooth_normals(&m.positions, &m.triangles);
    for scale in [1e-15, 1e15] {
        let scaled: Vec<Vec3> = m.positions.iter().map(|&p| p * scale).collect();
        for (n, e) in smooth_normals(&scaled, &m.triangles).into_iter().zip(&expected) {
            assert!(n.abs_diff_eq(*e, 1e-5), "{n} is not {e} at scale {scale}");
        }
    }
}

#[test]
fn oddities_are_warned_of_once() {
    let text = format!("{SQUARE}vt 0 0\nvn 0 0 1\nfoo 1\nfoo 2\nf 1/1/1 2/1/1 3/1/1\nf 1 1 2\nf 1 3 4\nf 1 1 1\n");
    let decoded = parse(text.as_bytes(), false).expect("readable");
    assert_eq!(decoded.value.triangles.len(), 2);
    assert_eq!(decoded.value.uvs.len(), decoded.value.positions.len());
    let used = decoded.value.triangles.iter().flatten();
    assert!(used.map(|&i| decoded.value.normals[i as usize]).all(|n| n.abs_diff_eq(Vec3::Z, 1e-6)));
    let all = decoded.warnings.join("\n");
    for part in [
        "4 vertices have no texture coordinates",
        "`foo` (first in line 7, 2 in all)",
        "2 of 4 triangles",
        "4 vertices without a normal",
    ] {
        assert!(all.contains(part), "{part:?} is not in\n{all}");
    }
    assert_eq!(decoded.warnings.len(), 4);
}

#[test]
fn faults_name_the_line() {
    for (text, part) in [
        ("v 0 0\n", "line 1: `v 0 0` has too few numbers"),
        ("v 0 0 0\nv x y z\n", "line 2: `v x y z` has `x` where a number should be"),
        ("v 0 0 nan\n", "line 1: `v 0 0 nan` has the number `nan`, which is not finite"),
        ("v 0 0 1e39\n", "not finite"),
        ("v 0 0 0\nf 1 1\n", "line 2: `f 1 1` is a face of only 2 corners"),
        ("v 0 0 0\n\nf 1 1 2\n", "line 3: vertex index 2 in a face, but the file has only 1"),
        ("v 0 0 0\nf 1 1 0\n", "line 2: vertex index 0 in a face, but indices count from 1"),
        ("v 0 0 0\nf 1 1 -2\n", "line 2: vertex index -2 in a face reaches back beyond the 1 given before it"),
        ("v 0 0 0\nf 1 1 -9223372036854775808\n", "reaches back beyond"),
        ("v 0 0 0\nf 1/1 1/1 1/1\n", "line 2: texture coordinate index 1 in a face, but the file has only 0"),
        ("v 0 0 0\nf 1//1 1 1\n", "line 2: normal index 1"),
        ("v 0 0 0\nf 1 1 1/2/3/4\n", "line 2: `1/2/3/4` is not a corner"),
        ("v 0 0 0\nf 1 1 /1\n", "line 2: `/1` is not a corner"),
        ("v 0 0 0\nf 1 1 a\n", "line 2: `a` is not a vertex index"),
        ("v 0 0 0\nf 1 1 1\n", "all 1 triangles of the mesh are degenerate"),
        ("v 0 0 0\n", "the mesh has no triangles"),
        ("", "the mesh has no triangles"),
        ("hello world\n", "line 1: `hello` is not an OBJ statement"),
        ("\u{1b}[31m\n", "line 1: `\\u{1b}[31m` is not an OBJ statement"),
    ] {
        let message = fault(text);
        assert!(message.contains(part), "{text:?} gives\n{message}\nnot\n{part}");
        assert!(!message.chars().any(char::is_control));
    }
}
