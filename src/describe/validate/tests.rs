//! Scenes made in code get the same checks as scenes from files.

use super::*;
use glam::{Vec2, Vec3};
use std::sync::Arc;

fn scene() -> SceneDescription {
    let sensor = SensorDescription {
        id: None,
        model: SensorModel::Perspective { fov_deg: 40.0, fov_axis: FovAxis::X, principal_point_offset: Vec2::ZERO },
        to_world: Mat4::IDENTITY.into(),
        near_clip: 0.01,
        far_clip: 100.0,
        sample_count: None,
        seed: 0,
        film: FilmDescription { width: 8, height: 8, crop: None, filter: FilterDescription::Box, place: Place::default() },
        place: Place::default(),
    };
    let light = EmitterModel::Point { position: Vec3::ZERO, intensity: [1.0; 3] };
    SceneDescription {
        sensors: vec![sensor],
        emitters: vec![EmitterDescription { id: None, model: light, place: Place::default() }],
        ..Default::default()
    }
}

fn shape(model: ShapeModel) -> ShapeDescription {
    ShapeDescription {
        id: None,
        model,
        to_world: Mat4::IDENTITY.into(),
        flip_normals: false,
        bsdf: None,
        emission: None,
        place: Place::default(),
    }
}

fn bsdf(model: BsdfModel) -> BsdfDescription {
    BsdfDescription { id: None, model, place: Place::default() }
}

/// The scene after a change has exactly one problem, which says `what`.
fn expect(what: &str, change: impl FnOnce(&mut SceneDescription)) {
    let mut scene = scene();
    change(&mut scene);
    let problems = scene.validate();
    assert_eq!(problems.list.len(), 1, "{problems:?}");
    assert!(problems.list[0].what.contains(what), "{problems:?}");
}

#[test]
fn a_sound_scene_has_no_problems() {
    assert_eq!(scene().validate(), Problems::default());
}

#[test]
fn indices_lead_somewhere() {
    expect("local model 3 does not exist; there are 0", |s| {
        s.shapes.push(ShapeDescription { bsdf: Some(BsdfId(3)), ..shape(ShapeModel::Cube) });
    });
    expect("mesh 0 does not exist", |s| s.shapes.push(shape(ShapeModel::Mesh { mesh: MeshId(0), face_normals: false })));
    expect("shape group 0 does not exist", |s| s.shapes.push(shape(ShapeModel::Instance { group: GroupId(0) })));
    expect("local model 7 does not exist; there are 1", |s| {
        s.bsdfs.push(bsdf(BsdfModel::Mask { opacity: TextureDescription::grey(0.5), inner: BsdfId(7) }));
    });
    expect("image 2 does not exist", |s| {
        s.bsdfs.push(bsdf(BsdfModel::Diffuse {
            reflectance: TextureDescription::Bitmap {
                image: ImageId(2),
                filter: BitmapFilter::Bilinear,
                wrap: BitmapWrap::Repeat,
                to_uv: Mat4::IDENTITY,
                place: Place::default(),
            },
        }));
    });
}

#[test]
fn local_models_end_somewhere() {
    let both = |i: u32| BsdfModel::TwoSided { front: BsdfId(i), back: BsdfId(i) };
    let mut round = scene();
    round.bsdfs = vec![bsdf(both(1)), bsdf(both(0))];
    assert!(round.validate().list.iter().all(|p| p.what.contains("contains itself")));
    let mut deep = scene();
    deep.bsdfs = (0..100_000).map(|i| bsdf(both(i + 1))).collect();
    deep.bsdfs.push(bsdf(BsdfModel::Diffuse { reflectance: TextureDescription::grey(0.5) }));
    let problems = deep.validate();
    assert!(problems.list[0].what.contains("nested deeper than 32"));
    assert_eq!(problems.list.len(), Problems::MAX_LISTED);
    assert!(problems.unlisted > 90_000);
    assert!(problems.render(&Sources::default()).contains(&format!("and {} more problems", problems.unlisted)));
}

#[test]
fn numbers_are_finite_and_in_range() {
    expect("`intensity` is [NaN, 0.0, 0.0]", |s| {
        s.emitters[0].model = EmitterModel::Point { position: Vec3::ZERO, intensity: [f32::NAN, 0.0, 0.0] };
    });
    expect("`radiance` is inf", |s| s.emitters[0].model = EmitterModel::Constant { radiance: [f32::INFINITY; 3] });
    expect("`fov` is NaN", |s| {
        let model = SensorModel::Perspective { fov_deg: f32::NAN, fov_axis: FovAxis::X, principal_point_offset: Vec2::ZERO };
        s.sensors[0].model = model;
    });
    expect("not invertible", |s| {
        let squashed = Mat4::from_scale(Vec3::new(1.0, 0.0, 1.0));
        s.shapes.push(ShapeDescription { to_world: squashed.into(), ..shape(ShapeModel::Cube) });
    });
    expect("not finite", |s| {
        s.shapes.push(ShapeDescription { to_world: (Mat4::IDENTITY * f32::NAN).into(), ..shape(ShapeModel::Cube) });
    });
    expect("rounding in single precision", |s| {
        s.shapes.push(shape(ShapeModel::Sphere { center: Vec3::splat(1e30), radius: 1e30 }));
    });
    let tiny = Mat4::from_scale(Vec3::splat(1e-6));
    let mut small = scene();
    small.shapes.push(ShapeDescription { to_world: tiny.into(), ..shape(ShapeModel::Cube) });
    assert_eq!(small.validate(), Problems::default());
}

#[test]
fn meshes_and_images_hold_together() {
    let mesh = |positions: Vec<Vec3>, triangles: Vec<[u32; 3]>| Mesh { positions, triangles, ..Default::default() };
    let add = |mesh: Mesh| move |s: &mut SceneDescription| s.meshes.push(MeshDescription::Data(Arc::new(mesh)));
    expect("triangle 1 uses a vertex beyond the 3", add(mesh(vec![Vec3::ZERO; 3], vec![[0, 1, 2], [0, 1, 3]])));
    expect("vertex 2 is not finite", add(mesh(vec![Vec3::ZERO, Vec3::ZERO, Vec3::NAN], vec![[0, 1, 2]])));
    expect("1 normals for 3", add(Mesh { normals: vec![Vec3::Z], ..mesh(vec![Vec3::ZERO; 3], vec![[0, 1, 2]]) }));
    expect("3 numbers instead of 12", |s| {
        let image = Image { width: 2, height: 2, channels: 3, data: vec![0.0; 3] };
        s.images.push(ImageDescription::Data(Arc::new(image)));
    });
}

#[test]
fn shape_groups_hold_plain_shapes() {
    let emission = AreaEmission { radiance: TextureDescription::grey(1.0), id: None, place: Place::default() };
    let group = |shape| GroupDescription { shapes: vec![shape], ..Default::default() };
    expect("a shape in a shape group cannot emit", |s| {
        s.groups.push(group(ShapeDescription { emission: Some(emission.clone()), ..shape(ShapeModel::Cube) }));
    });
    expect("an instance cannot stand in a shape group", |s| {
        s.groups.push(group(shape(ShapeModel::Cube)));
        s.groups.push(group(shape(ShapeModel::Instance { group: GroupId(0) })));
    });
}
