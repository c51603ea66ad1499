//! The scene language: each feature gives the description that Mitsuba's rules say.

use glam::{Mat4, Vec2, Vec3};
use nephroid::describe::*;
use nephroid::io::mitsuba::{self, LoadOptions, Loaded};
use std::path::Path;

const SENSOR: &str = r#"<sensor type="perspective"><float name="fov" value="40"/></sensor>"#;

/// A scene with a sensor around `body`.
fn read(body: &str) -> Loaded {
    read_with(body, &[])
}

fn read_with(body: &str, defines: &[(&str, &str)]) -> Loaded {
    let sensor = if body.contains("<sensor") { "" } else { SENSOR };
    read_text(&format!("<scene version=\"3.0.0\">{sensor}{body}</scene>"), Path::new("."), defines)
}

fn read_text(text: &str, directory: &Path, defines: &[(&str, &str)]) -> Loaded {
    let defines = defines.iter().map(|(n, v)| (n.to_string(), v.to_string())).collect();
    mitsuba::from_str(text, directory, &LoadOptions { defines, sandbox: None }).unwrap_or_else(|e| panic!("{e}"))
}

fn only_shape(body: &str) -> ShapeDescription {
    read(body).scene.shapes.into_iter().next().expect("a shape")
}

fn bsdf(body: &str) -> BsdfModel {
    read(body).scene.bsdfs.into_iter().next_back().expect("a local model").model
}

fn emitter(body: &str) -> EmitterModel {
    read(body).scene.emitters.into_iter().next().expect("an emitter").model
}

fn sensor(body: &str) -> SensorDescription {
    read(body).scene.sensors.into_iter().next().expect("a sensor")
}

fn radius(body: &str, defines: &[(&str, &str)]) -> f32 {
    match read_with(body, defines).scene.shapes[0].model {
        ShapeModel::Sphere { radius, .. } => radius,
        ref other => panic!("{other:?}"),
    }
}

fn to_world(steps: &str) -> Mat4 {
    only_shape(&format!(r#"<shape type="cube"><transform name="to_world">{steps}</transform></shape>"#)).to_world.value
}

fn close(a: [f32; 3], b: [f32; 3]) {
    for (x, y) in a.iter().zip(b) {
        assert!((x - y).abs() <= 1e-3 * y.abs().max(1e-3), "{a:?} against {b:?}");
    }
}

#[test]
fn steps_of_a_transform_apply_one_after_the_other() {
    let at = |steps: &str, p: [f32; 3]| to_world(steps).transform_point3(Vec3::from(p)).to_array();
    close(at(r#"<translate x="1"/><scale value="2"/>"#, [0.0; 3]), [2.0, 0.0, 0.0]);
    close(at(r#"<scale value="2"/><translate x="1"/>"#, [0.0; 3]), [1.0, 0.0, 0.0]);
    close(at(r#"<scale x="2"/>"#, [1.0; 3]), [2.0, 1.0, 1.0]);
    close(at(r#"<scale value="1 2, 3"/>"#, [1.0; 3]), [1.0, 2.0, 3.0]);
    close(at(r#"<rotate x="1" angle="90"/>"#, [0.0, 1.0, 0.0]), [0.0, 0.0, 1.0]);
    close(at(r#"<rotate value="0, 0, 2" angle="90"/>"#, [1.0, 0.0, 0.0]), [0.0, 1.0, 0.0]);
    close(at(r#"<translate value="1"/>"#, [0.0; 3]), [1.0; 3]);
    close(at(r#"<matrix value="1 2 3 4 5 6 7 8 10"/>"#, [1.0, 0.0, 0.0]), [1.0, 4.0, 7.0]);
    close(at(r#"<matrix value="1 0 0 5 0 1 0 6 0 0 1 7 0 0 0 1"/>"#, [0.0; 3]), [5.0, 6.0, 7.0]);
}

#[test]
fn lookat_is_the_left_up_forward_frame_of_mitsuba() {
    let m = to_world(r#"<lookat origin="1, 2, 3" target="1, 2, 8" up="0, 2, 0"/>"#);
    assert_eq!(m, Mat4::from_translation(Vec3::new(1.0, 2.0, 3.0)));
    let m = to_world(r#"<lookat origin="0, -5, 1" target="0, 0, .5" up="0, 0, 1"/>"#);
    close(m.x_axis.truncate().to_array(), [-1.0, 0.0, 0.0]);
    close(m.z_axis.truncate().to_array(), [0.0, 0.995037, -0.0995037]);
}

#[test]
fn parameters_are_replaced_in_every_attribute() {
    let sphere = r#"<shape type="sphere"><float name="radius" value="$r"/></shape>"#;
    assert_eq!(radius(&format!(r#"<default name="r" value="3"/>{sphere}"#), &[]), 3.0);
    assert_eq!(radius(&format!(r#"<default name="r" value="3"/>{sphere}"#), &[("r", "5")]), 5.0);
    assert_eq!(radius(sphere, &[("r", "7")]), 7.0);
    assert_eq!(radius(&format!(r#"<default name="r" value="3"/><default name="r" value="4"/>{sphere}"#), &[]), 3.0);
    let longer = r#"<default name="r" value="1"/><default name="r2" value="6"/>
        <shape type="sphere"><float name="radius" value="$r2"/></shape>"#;
    assert_eq!(radius(longer, &[]), 6.0);
    let inside = r#"<default name="r" value="1"/><default name="k" value="sphere"/><default name="s" value="$r.2"/>
        <shape type="$k"><float name="radius" value="$s"/></shape>"#;
    assert_eq!(radius(inside, &[]), 1.2);
    let prefix = r#"<default name="r" value="1"/><shape type="sphere"><float name="radius" value="$r2"/></shape>"#;
    assert_eq!(radius(prefix, &[]), 12.0);
}

#[test]
fn references_lead_forward_and_backward_and_through_aliases() {
    let body = r#"<shape type="sphere"><ref id="b"/></shape><bsdf type="plastic" id="b"/><alias id="b" as="c"/>
        <shape type="cube"><ref id="c"/></shape><shape type="disk"/>"#;
    let scene = read(body).scene;
    assert_eq!(scene.bsdfs.len(), 1);
    assert_eq!(scene.shapes[0].bsdf, Some(BsdfId(0)));
    assert_eq!(scene.shapes[1].bsdf, Some(BsdfId(0)));
    assert_eq!(scene.shapes[2].bsdf, None);
}

#[test]
fn a_referenced_texture_is_for_the_named_property() {
    let body = r#"<texture type="checkerboard" id="t"/><bsdf type="diffuse"><ref name="reflectance" id="t"/></bsdf>"#;
    let BsdfModel::Diffuse { reflectance: TextureDescription::Checkerboard { color0, color1, .. } } = bsdf(body) else {
        panic!()
    };
    assert_eq!((*color0, *color1), (TextureDescription::grey(0.4), TextureDescription::grey(0.2)));
}

#[test]
fn includes_share_parameters_and_find_files_beside_themselves() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::create_dir_all(dir.path().join("sub/meshes")).unwrap();
    std::fs::create_dir_all(dir.path().join("more")).unwrap();
    let write = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).unwrap();
    write("sub/meshes/a.obj", "");
    write("more/b.ply", "");
    write("more/far.xml", r#"<scene version="3.0.0"><shape type="ply"><string name="filename" value="b.ply"/></shape></scene>"#);
    write(
        "sub/part.xml",
        r#"<scene version="2.1.0"><default name="r" value="3"/><include filename="far.xml"/>
        <shape type="obj"><string name="filename" value="meshes/a.obj"/></shape><bsdf type="diffuse" id="m"/></scene>"#,
    );
    write(
        "scene.xml",
        r#"<scene version="3.0.0"><sensor type="orthographic"/><emitter type="constant"/><path value="more"/>
        <include filename="sub/part.xml"/><shape type="sphere"><float name="radius" value="$r"/><ref id="m"/></shape></scene>"#,
    );
    let loaded = mitsuba::load(&dir.path().join("scene.xml"), &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    let scene = loaded.scene;
    assert_eq!(scene.shapes.len(), 3);
    assert_eq!(scene.sources.files.len(), 3);
    let formats: Vec<MeshFormat> = scene
        .meshes
        .iter()
        .map(|m| match m {
            MeshDescription::File { path, format, .. } => {
                assert!(path.is_file());
                *format
            }
            MeshDescription::Data(_) => panic!(),
        })
        .collect();
    assert_eq!(formats, [MeshFormat::Ply, MeshFormat::Obj]);
    assert!(matches!(scene.shapes[2].model, ShapeModel::Sphere { radius: 3.0, .. }));
    assert_eq!(scene.sources.locate(scene.shapes[0].place).unwrap().rsplit('/').next(), Some("far.xml:1:24"));
}

#[test]
fn meshes_and_images_are_named_once() {
    let dir = tempfile::tempdir().unwrap();
    for name in ["a.obj", "a.ply", "a.serialized", "t.png"] {
        std::fs::write(dir.path().join(name), "").unwrap();
    }
    let shape =
        |kind: &str, extra: &str| format!(r#"<shape type="{kind}"><string name="filename" value="a.{kind}"/>{extra}</shape>"#);
    let bitmap = |extra: &str| {
        format!(
            r#"<bsdf type="diffuse"><texture name="reflectance" type="bitmap"><string name="filename" value="t.png"/>{extra}</texture></bsdf>"#
        )
    };
    let body = [
        SENSOR.to_string(),
        shape("obj", ""),
        shape("obj", r#"<boolean name="face_normals" value="true"/>"#),
        shape("obj", r#"<boolean name="flip_tex_coords" value="false"/>"#),
        shape("ply", ""),
        shape("serialized", r#"<integer name="shape_index" value="2"/>"#),
        shape("serialized", r#"<integer name="shape_index" value="2"/>"#),
        bitmap(""),
        bitmap(r#"<string name="wrap_mode" value="clamp"/><string name="filter_type" value="nearest"/>"#),
        bitmap(r#"<boolean name="raw" value="true"/>"#),
    ];
    let text = format!("<scene version='3.0.0'>{}</scene>", body.concat());
    let scene = read_text(&text, dir.path(), &[]).scene;
    let flips: Vec<(bool, u32)> = scene
        .meshes
        .iter()
        .map(|m| match m {
            MeshDescription::File { flip_tex_coords, shape_index, .. } => (*flip_tex_coords, *shape_index),
            MeshDescription::Data(_) => panic!(),
        })
        .collect();
    assert_eq!(flips, [(true, 0), (false, 0), (false, 0), (false, 2)]);
    assert_eq!(scene.shapes[1].model, ShapeModel::Mesh { mesh: MeshId(0), face_normals: true });
    assert_eq!(scene.images.len(), 2);
    let BsdfModel::Diffuse { reflectance: TextureDescription::Bitmap { image, filter, wrap, .. } } = &scene.bsdfs[1].model else {
        panic!()
    };
    assert_eq!((*image, *filter, *wrap), (ImageId(0), BitmapFilter::Nearest, BitmapWrap::Clamp));
}

#[test]
fn defaults_are_those_of_mitsuba() {
    let Ok(BsdfModel::Dielectric { int_ior, ext_ior, .. }) = Ok::<_, ()>(bsdf(r#"<bsdf type="dielectric"/>"#)) else { panic!() };
    assert_eq!((int_ior, ext_ior), (1.5046, 1.000277));
    let BsdfModel::Plastic { int_ior, nonlinear, diffuse_reflectance, .. } = bsdf(r#"<bsdf type="plastic"/>"#) else { panic!() };
    assert_eq!((int_ior, nonlinear, diffuse_reflectance), (1.49, false, TextureDescription::grey(0.5)));
    let BsdfModel::RoughConductor { distribution, alpha_u, alpha_v, perfect, .. } = bsdf(r#"<bsdf type="roughconductor"/>"#)
    else {
        panic!()
    };
    assert_eq!(distribution, MicrofacetDescription::Beckmann);
    assert_eq!((alpha_u, alpha_v, perfect), (TextureDescription::grey(0.1), TextureDescription::grey(0.1), true));
    let BsdfModel::Mask { opacity, .. } = bsdf(r#"<bsdf type="mask"><bsdf type="null"/></bsdf>"#) else { panic!() };
    assert_eq!(opacity, TextureDescription::grey(0.5));
    let EmitterModel::Spot { cutoff_angle_deg, beam_width_deg, intensity, .. } = emitter(r#"<emitter type="spot"/>"#) else {
        panic!()
    };
    assert_eq!((cutoff_angle_deg, beam_width_deg, intensity), (20.0, 15.0, [1.0; 3]));
    let EmitterModel::Directional { direction, angular_diameter_deg, .. } = emitter(r#"<emitter type="directional"/>"#) else {
        panic!()
    };
    assert_eq!((direction, angular_diameter_deg), (Vec3::Z, 0.0));
    let sensor = sensor(r#"<sensor type="perspective"/>"#);
    let SensorModel::Perspective { fov_deg, fov_axis, principal_point_offset } = sensor.model else { panic!() };
    assert!((fov_deg - 46.79).abs() < 0.01);
    assert_eq!((fov_axis, principal_point_offset), (FovAxis::Diagonal, Vec2::ZERO));
    assert_eq!((sensor.near_clip, sensor.far_clip, sensor.sample_count), (0.01, 10000.0, None));
    let film = &sensor.film;
    assert_eq!((film.width, film.height, film.crop), (768, 576, None));
    assert_eq!(film.filter, FilterDescription::Gaussian { stddev: 0.5 });
    assert_eq!(read("").scene.integrator, IntegratorDescription::default());
}

#[test]
fn sensors_take_their_film_filter_and_sampler() {
    let body = r#"<sensor type="thinlens" id="cam"><float name="fov" value="30"/><string name="fov_axis" value="smaller"/>
        <float name="aperture_radius" value="0.1"/><float name="far_clip" value="50"/>
        <sampler type="multijitter"><integer name="sample_count" value="16"/><integer name="seed" value="9"/></sampler>
        <film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="32"/>
        <integer name="crop_offset_x" value="4"/><integer name="crop_width" value="60"/>
        <string name="pixel_format" value="rgb"/><rfilter type="mitchell"><float name="B" value="0.2"/></rfilter></film></sensor>"#;
    let sensor = sensor(body);
    let SensorModel::ThinLens { fov_axis, aperture_radius, focus_distance, .. } = sensor.model else { panic!() };
    assert_eq!((fov_axis, aperture_radius, focus_distance), (FovAxis::Smaller, 0.1, 50.0));
    assert_eq!((sensor.sample_count, sensor.seed, sensor.id.as_deref()), (Some(16), 9, Some("cam")));
    assert_eq!(sensor.film.crop, Some([4, 0, 60, 32]));
    let FilterDescription::Mitchell { b, c } = sensor.film.filter else { panic!() };
    assert!((b - 0.2).abs() < 1e-6 && (c - 1.0 / 3.0).abs() < 1e-6);
}

#[test]
fn integrators_say_which_paths_count() {
    let of = |body: &str| read(body).scene.integrator;
    let wrapped = of(r#"<integrator type="moment"><integrator type="ptracer"><integer name="max_depth" value="7"/>
        <integer name="samples_per_pass" value="3"/></integrator></integrator>"#);
    assert_eq!((wrapped.name.as_str(), wrapped.max_depth, wrapped.rr_depth), ("ptracer", Some(7), 5));
    let direct = of(r#"<integrator type="direct"><boolean name="hide_emitters" value="true"/></integrator>"#);
    assert_eq!((direct.name.as_str(), direct.max_depth, direct.hide_emitters), ("direct", Some(2), true));
    assert_eq!(of(r#"<integrator type="path"><integer name="max_depth" value="-1"/></integrator>"#).max_depth, None);
    assert_eq!(of(r#"<integrator type="path"><integer name="max_depth" value="0"/></integrator>"#).max_depth, Some(0));
}

#[test]
fn colours_follow_their_context() {
    let emission = |value: &str| {
        let body = format!(r#"<shape type="disk"><emitter type="area">{value}</emitter></shape>"#);
        match only_shape(&body).emission.expect("emission").radiance {
            TextureDescription::Constant(rgb) => rgb,
            other => panic!("{other:?}"),
        }
    };
    let reflectance = |value: &str| match bsdf(&format!(r#"<bsdf type="diffuse">{value}</bsdf>"#)) {
        BsdfModel::Diffuse { reflectance: TextureDescription::Constant(rgb) } => rgb,
        other => panic!("{other:?}"),
    };
    close(emission(r#"<spectrum name="radiance" value="3"/>"#), [3.61438, 2.84487, 2.72675]);
    close(emission(r#"<rgb name="radiance" value="3"/>"#), [3.0; 3]);
    close(emission(r#"<float name="radiance" value="3"/>"#), [3.0; 3]);
    close(emission(""), [1.0; 3]);
    close(emission(r#"<spectrum name="radiance" value="400:0, 500:8, 600:15.6, 700:18.4"/>"#), [20.7108, 10.8546, 2.77115]);
    close(emission(r#"<spectrum name="radiance" type="d65"><float name="scale" value="2"/></spectrum>"#), [2.0; 3]);
    close(reflectance(r#"<spectrum name="reflectance" value="0.3"/>"#), [0.3; 3]);
    close(reflectance(r#"<rgb name="reflectance" value="0.2 0.5 0.3"/>"#), [0.2, 0.5, 0.3]);
    close(reflectance(r##"<rgb name="reflectance" value="#ff8000"/>"##), [1.0, 0.2158605, 0.0]);
    close(
        reflectance(r#"<spectrum name="reflectance" value="400:0.78, 500:0.78, 600:0.78, 700:0.78"/>"#),
        [0.776367, 0.77981, 0.776029],
    );
}

#[test]
fn spectra_are_read_from_files() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("flat.spd"), "# flat\n300 0.5\n\n900 0.5 # end\n").unwrap();
    let text = format!(
        r#"<scene version="3.0.0">{SENSOR}<bsdf type="diffuse"><spectrum name="reflectance" filename="flat.spd"/></bsdf></scene>"#
    );
    let scene = read_text(&text, dir.path(), &[]).scene;
    let BsdfModel::Diffuse { reflectance: TextureDescription::Constant(rgb) } = scene.bsdfs[0].model else { panic!() };
    close(rgb, [0.49949, 0.49944, 0.49940]);
}

#[test]
fn metals_are_given_by_name_or_by_numbers() {
    let BsdfModel::Conductor { perfect, eta: TextureDescription::Constant(eta), .. } =
        bsdf(r#"<bsdf type="conductor"><string name="material" value="Au"/></bsdf>"#)
    else {
        panic!()
    };
    assert!(!perfect && eta != [0.0; 3]);
    let by_numbers = r#"<bsdf type="conductor"><spectrum name="eta" value="0.789"/><spectrum name="k" value="6.15"/></bsdf>"#;
    let BsdfModel::Conductor { perfect, eta, k, .. } = bsdf(by_numbers) else { panic!() };
    assert_eq!((perfect, eta, k), (false, TextureDescription::grey(0.789), TextureDescription::grey(6.15)));
    assert!(matches!(
        bsdf(r#"<bsdf type="conductor"><string name="material" value="none"/></bsdf>"#),
        BsdfModel::Conductor { perfect: true, .. }
    ));
    let BsdfModel::Dielectric { int_ior, .. } =
        bsdf(r#"<bsdf type="dielectric"><string name="int_ior" value="Water Ice"/></bsdf>"#)
    else {
        panic!()
    };
    assert_eq!(int_ior, 1.31);
}

#[test]
fn nested_models_go_by_position() {
    let body = r#"<bsdf type="blendbsdf" id="mix"><float name="weight" value="0.3"/><bsdf type="null"/><ref id="d"/></bsdf>
        <bsdf type="diffuse" id="d"/><bsdf type="twosided"><ref id="d"/></bsdf>"#;
    let scene = read(body).scene;
    let mix = scene.bsdfs.iter().find(|b| b.id.as_deref() == Some("mix")).unwrap();
    let BsdfModel::Blend { first, second, .. } = mix.model else { panic!() };
    assert_eq!(scene.bsdfs[first.0 as usize].model, BsdfModel::Null);
    assert_eq!(scene.bsdfs[second.0 as usize].id.as_deref(), Some("d"));
    let BsdfModel::TwoSided { front, back } = scene.bsdfs.last().unwrap().model else { panic!() };
    assert_eq!((front, back), (second, second));
}

#[test]
fn shape_groups_are_instanced() {
    let body = r#"<shape type="instance"><ref id="g"/><transform name="to_world"><translate z="2"/></transform></shape>
        <shape type="shapegroup" id="g"><shape type="sphere"/><shape type="cube"/></shape>
        <shape type="instance"><ref id="g"/></shape>"#;
    let scene = read(body).scene;
    assert_eq!((scene.groups.len(), scene.groups[0].shapes.len(), scene.shapes.len()), (1, 2, 2));
    assert_eq!(scene.shapes[1].model, ShapeModel::Instance { group: GroupId(0) });
    assert_eq!(scene.shapes[0].to_world.value, Mat4::from_translation(Vec3::new(0.0, 0.0, 2.0)));
}

#[test]
fn emitters_take_place_and_direction_from_either_property() {
    let EmitterModel::Point { position, .. } =
        emitter(r#"<emitter type="point"><transform name="to_world"><translate z="10"/></transform></emitter>"#)
    else {
        panic!()
    };
    assert_eq!(position, Vec3::new(0.0, 0.0, 10.0));
    let EmitterModel::Point { position, .. } =
        emitter(r#"<emitter type="point"><point name="position" x="-5" y="-6.0" z="+1"/></emitter>"#)
    else {
        panic!()
    };
    assert_eq!(position, Vec3::new(-5.0, -6.0, 1.0));
    let sun = r#"<emitter type="directional"><vector name="direction" value="0,0,-1"/><float name="angular_diameter" value="0.53"/></emitter>"#;
    let EmitterModel::Directional { direction, angular_diameter_deg, .. } = emitter(sun) else { panic!() };
    assert_eq!((direction, angular_diameter_deg), (Vec3::NEG_Z, 0.53));
    let turned = r#"<emitter type="directional"><transform name="to_world"><rotate x="1" angle="90"/></transform></emitter>"#;
    let EmitterModel::Directional { direction, .. } = emitter(turned) else { panic!() };
    assert!((direction - Vec3::NEG_Y).length() < 1e-6);
}

#[test]
fn everything_knows_its_place() {
    let text = "<scene version=\"3.0.0\">\n  <sensor type=\"orthographic\"/>\n  <shape type=\"sphere\">\n    <transform name=\"to_world\"/>\n  </shape>\n</scene>";
    let scene = read_text(text, Path::new("."), &[]).scene;
    assert_eq!(scene.sensors[0].place, Place { file: 1, line: 2, column: 3 });
    assert_eq!(scene.shapes[0].place, Place { file: 1, line: 3, column: 3 });
    assert_eq!(scene.shapes[0].to_world.place, Place { file: 1, line: 4, column: 5 });
}

#[test]
fn warnings_do_not_stop_a_scene() {
    let loaded = read(r#"stray <emitter type="area" id="e"/>"#);
    let text = loaded.warnings.render(&loaded.scene.sources);
    assert!(text.contains("text between elements"), "{text}");
    assert!(text.contains("belongs to no shape"), "{text}");
    assert!(text.contains("no emitter: the image will be black"), "{text}");
    assert!(read(r#"<emitter type="constant"/>"#).warnings.list.is_empty());
}
