//! Building whole scenes: ids, problems, identity.

use super::*;
use crate::describe::*;
use crate::spectrum::Spectrum;
use geometry::Ray;
use glam::Mat4;
use std::path::PathBuf;
use std::sync::Arc;

fn shape_of(model: ShapeModel, to_world: Mat4) -> ShapeDescription {
    ShapeDescription {
        id: None,
        model,
        to_world: to_world.into(),
        flip_normals: false,
        bsdf: None,
        emission: None,
        place: Place::default(),
    }
}

fn lamp(radiance: f32, place: Place) -> Option<AreaEmission> {
    Some(AreaEmission { radiance: TextureDescription::grey(radiance), id: Some("lamp".into()), place })
}

fn at(line: u32) -> Place {
    Place { file: 1, line, column: 1 }
}

fn triangle() -> Mesh {
    Mesh { positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y], triangles: vec![[0, 1, 2]], ..Mesh::default() }
}

/// A mesh, a textured floor, a lamp, a point, a group seen through two instances.
fn description() -> SceneDescription {
    let mut scene = SceneDescription::default();
    scene.meshes.push(MeshDescription::Data(Arc::new(triangle())));
    let image = Image { width: 1, height: 1, channels: 1, data: vec![0.25] };
    scene.images.push(ImageDescription::Data(Arc::new(image)));
    let checks = TextureDescription::Bitmap {
        image: ImageId(0),
        filter: BitmapFilter::Nearest,
        wrap: BitmapWrap::Repeat,
        to_uv: Mat4::IDENTITY,
        place: at(3),
    };
    scene.bsdfs.push(BsdfDescription { id: None, model: BsdfModel::Diffuse { reflectance: checks }, place: at(2) });
    let mut floor = shape_of(ShapeModel::Rectangle, Mat4::from_scale(Vec3::splat(5.0)));
    floor.bsdf = Some(BsdfId(0));
    let mut light = shape_of(ShapeModel::Disk, Mat4::from_translation(Vec3::Z * 4.0));
    light.flip_normals = true;
    light.emission = lamp(2.0, at(9));
    let lifted = Mat4::from_translation(Vec3::Z * 0.1);
    scene.shapes = vec![shape_of(ShapeModel::Mesh { mesh: MeshId(0), face_normals: true }, lifted), floor, light];
    let instance = |x| shape_of(ShapeModel::Instance { group: GroupId(0) }, Mat4::from_translation(Vec3::new(x, 0.0, 1.0)));
    scene.shapes.extend([instance(-2.0), instance(2.0)]);
    let ball = shape_of(ShapeModel::Sphere { center: Vec3::ZERO, radius: 0.5 }, Mat4::IDENTITY);
    scene.groups.push(GroupDescription { id: None, shapes: vec![ball], place: at(12) });
    let point = EmitterModel::Point { position: Vec3::new(1.0, 0.0, 3.0), intensity: [1.0; 3] };
    scene.emitters.push(EmitterDescription { id: None, model: point, place: at(20) });
    let film = FilmDescription { width: 8, height: 6, crop: None, filter: FilterDescription::Box, place: Place::default() };
    scene.sensors.push(SensorDescription {
        id: None,
        model: SensorModel::Orthographic,
        to_world: Mat4::from_translation(Vec3::Z * 5.0).into(),
        near_clip: 0.01,
        far_clip: 100.0,
        sample_count: Some(16),
        seed: 3,
        film,
        place: Place::default(),
    });
    scene
}

fn built(description: &SceneDescription) -> Scene {
    let (scene, warnings) = Scene::build(description, 0).unwrap_or_else(|p| panic!("{p:?}"));
    assert_eq!(warnings, Problems::default());
    scene
}

#[test]
fn ids_point_to_what_was_described() {
    let scene = built(&description());
    let down = |x: f32, y: f32, z: f32| {
        let ray = Ray { o: Vec3::new(x, y, z), d: -Vec3::Z, t_max: f32::INFINITY };
        let hit = scene.geometry.intersect(&ray).expect("a hit");
        scene.geometry.surface(&ray, &hit)
    };
    let floor = down(-3.0, 4.0, 3.0);
    assert_eq!((floor.shape, floor.material, floor.emitter), (1, MaterialId(0), EmitterId::NONE));
    let triangle = down(0.2, 0.2, 3.0);
    assert_eq!((triangle.shape, triangle.material), (0, scene.materials.default_id(false)));
    let disk = down(0.1, 0.2, 5.0);
    assert_eq!((disk.shape, disk.emitter), (2, EmitterId(0)));
    // As in Mitsuba 3, a lamp without a model reflects nothing.
    assert_eq!(disk.material, scene.materials.default_id(true));
    assert_eq!(scene.materials.albedo_bound(disk.material), Spectrum::BLACK);
    let point = emitter::EmitterPoint::on_surface(&disk);
    assert_eq!(scene.lights.radiance(&point, -Vec3::Z).to_rgb(), [2.0; 3]);
    assert!(scene.lights.radiance(&point, Vec3::Z).is_black());
    assert!((down(2.0, 0.0, 3.0).p.z - 1.5).abs() < 1e-6 && (down(-2.0, 0.0, 3.0).p.z - 1.5).abs() < 1e-6);
}

#[test]
fn info_counts() {
    let scene = built(&description());
    let info = scene.info();
    assert_eq!((info.shapes, info.triangles, info.instances, info.materials), (6, 3, 2, 3));
    assert_eq!(info.emitters.iter().map(|e| e.kind).collect::<Vec<_>>(), ["area", "point"]);
    assert_eq!(info.emitters[0].id.as_deref(), Some("lamp"));
    let pi = std::f32::consts::PI;
    assert!((info.emitters[0].power[1] - 2.0 * pi * pi).abs() < 1e-4);
    assert!((info.emitters[1].power[2] - 4.0 * pi).abs() < 1e-5);
    let (min, max) = info.bounds.expect("shapes");
    assert!((min + Vec3::new(5.0, 5.0, 0.0)).length() < 1e-5 && (max - Vec3::new(5.0, 5.0, 4.0)).length() < 1e-5);
    // A texel is kept in a square of sixteen.
    assert!(info.geometry_bytes > 0 && info.image_bytes == 64);
    assert_eq!((scene.sample_count, scene.seed, scene.film.width), (Some(16), 3, 8));
}

#[test]
fn nothing_is_a_scene_too() {
    let mut empty = SceneDescription::default();
    assert!(Scene::build(&empty, 0).is_err_and(|p| p.list[0].what.contains("no sensor")));
    empty.sensors = description().sensors;
    let scene = built(&empty);
    assert!(scene.lights.is_empty() && scene.info().bounds.is_none());
    assert!(Scene::build(&empty, 1).is_err_and(|p| p.list[0].what.contains("counted from 0")));
}

#[test]
fn problems_of_all_parts_come_at_once() {
    let mut scene = description();
    scene.groups[0].shapes[0].emission = lamp(1.0, at(13));
    scene.shapes[3].emission = lamp(1.0, at(14));
    scene.shapes[0].bsdf = Some(BsdfId(7));
    scene.shapes[1].to_world = Mat4::from_scale(Vec3::new(1.0, 0.0, 1.0)).into();
    scene.sensors[0].film.height = 0;
    let bad = EmitterModel::Point { position: Vec3::NAN, intensity: [1.0; 3] };
    scene.emitters.push(EmitterDescription { id: None, model: bad, place: at(21) });
    let file = MeshDescription::File {
        path: PathBuf::from("a.ply"),
        format: MeshFormat::Ply,
        shape_index: 0,
        flip_tex_coords: false,
        place: at(30),
    };
    scene.meshes.push(file);
    scene.shapes.push(shape_of(ShapeModel::Mesh { mesh: MeshId(1), face_normals: false }, Mat4::IDENTITY));
    scene.shapes.push(shape_of(ShapeModel::Mesh { mesh: MeshId(9), face_normals: false }, Mat4::IDENTITY));
    let Err(problems) = Scene::build(&scene, 0) else { panic!("built") };
    for (word, place) in [("inside a group", Some(at(13))), ("an instance cannot", Some(at(14))), ("position", Some(at(21)))]
        .into_iter()
        .chain(["bsdf 7", "invertible", "no pixels", "a.ply was not loaded", "mesh 9"].map(|word| (word, None)))
    {
        let found = problems.list.iter().find(|p| p.what.contains(word));
        assert!(found.is_some_and(|p| place.is_none_or(|at| p.place == at)), "{word}: {problems:?}");
    }
}

#[test]
fn warnings_come_with_the_scene() {
    let mut scene = description();
    scene.shapes[2].emission = lamp(0.0, at(9));
    let (built, warnings) = Scene::build(&scene, 0).unwrap_or_else(|p| panic!("{p:?}"));
    assert!(warnings.list.len() == 1 && warnings.list[0].place == at(9), "{warnings:?}");
    assert_eq!(built.lights.infos()[1].prob_emission, 1.0);
}

/// The identity ignores names, places, samples and seed, and nothing else.
#[test]
fn hash_is_of_the_content() {
    let original = built(&description()).hash();
    let hash_with = |change: &dyn Fn(&mut SceneDescription)| {
        let mut changed = description();
        change(&mut changed);
        built(&changed).hash()
    };
    let same: [&dyn Fn(&mut SceneDescription); 6] = [
        &|_| (),
        &|s| s.bsdfs[0].place = at(99),
        &|s| s.shapes[2].id = Some("other".into()),
        &|s| s.sensors[0].sample_count = None,
        &|s| s.sensors[0].seed = 9,
        &|s| s.sensors.push(s.sensors[0].clone()),
    ];
    for (i, change) in same.iter().enumerate() {
        assert_eq!(hash_with(*change), original, "change {i} is none of the content");
    }
    let other: [&dyn Fn(&mut SceneDescription); 10] = [
        &|s| s.shapes[2].emission = lamp(2.0000002, at(9)),
        &|s| s.shapes[0].flip_normals = true,
        &|s| s.shapes[4].to_world.value.w_axis.x = 2.5,
        &|s| s.sensors[0].film.width = 9,
        &|s| s.sensors[0].film.filter = FilterDescription::CatmullRom,
        &|s| s.integrator.max_depth = Some(7),
        &|s| s.images[0] = ImageDescription::Data(Arc::new(Image { width: 1, height: 1, channels: 1, data: vec![0.5] })),
        &|s| s.meshes[0] = MeshDescription::Data(Arc::new(Mesh { uvs: vec![Vec2::ZERO; 3], ..triangle() })),
        &|s| s.groups[0].shapes.clear(),
        &|s| s.emitters[0].model = EmitterModel::Constant { radiance: [1.0; 3] },
    ];
    let mut hashes: Vec<_> = other.iter().map(|change| hash_with(*change)).chain([original]).collect();
    hashes.sort_unstable();
    hashes.dedup();
    assert_eq!(hashes.len(), other.len() + 1, "two different scenes with one hash");
    assert_eq!(built(&description()).hash_hex().len(), 64);
}
