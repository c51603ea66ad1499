//! Elements and rays agree about who is who; solutions become images and meshes.

use crate::support::{scene, shape, six_walls};
use nephroid::elements::factors::ray_counts;
use nephroid::elements::iterate::{Iteration, Until, iterate};
use nephroid::elements::stochastic::{Effort, stochastic};
use nephroid::elements::{
    Elements, ElementsError, Factors, Rgb, Smooth, Sources, Subdivision, View, facets, invert::invert, refusals, subdivide, view,
};
use nephroid::io::ply;
use nephroid::math::Random;
use nephroid::math::random::Family;
use nephroid::scene::Scene;
use nephroid::scene::geometry::Ray;

/// Every kind of piece: triangles, sphere, disk, cylinder, and all of them through instances.
fn all_pieces() -> Scene {
    let two = r#"<bsdf type="twosided"><bsdf type="diffuse"/></bsdf>"#;
    scene(&format!(
        r#"<shape type="cube">{two}</shape>
  <shape type="sphere"><point name="center" value="3, 0, 0"/><float name="radius" value="0.9"/>{two}</shape>
  <shape type="disk"><transform name="to_world"><scale x="1" y="0.5"/><rotate x="1" angle="40"/><translate x="6"/></transform>{two}</shape>
  <shape type="cylinder"><point name="p0" value="9, 0, 0"/><point name="p1" value="9, 1, 0.5"/><float name="radius" value="0.4"/>{two}</shape>
  <shape type="shapegroup" id="group"><shape type="cube">{two}</shape>
    <shape type="sphere"><point name="center" value="0, 3, 0"/><float name="radius" value="0.8"/>{two}</shape>
    <shape type="disk"><transform name="to_world"><translate z="-3"/></transform>{two}</shape></shape>
  <shape type="instance"><transform name="to_world"><scale value="0.7"/><rotate y="1" angle="30"/><translate y="8"/></transform><ref id="group"/></shape>
  <shape type="instance"><transform name="to_world"><translate y="16" x="2"/></transform><ref id="group"/></shape>"#
    ))
}

/// A ray that comes back to a point of an element from either side meets that element; areas are those
/// of the shapes.
#[test]
fn rays_find_the_elements_that_points_come_from() {
    let world = all_pieces();
    let mesh = Elements::new(&world, 3000).unwrap();
    let mut random = Random::new(Family::Other, 1, 1, 1);
    let mut missed = 0;
    for i in 0..mesh.len() {
        let s = mesh.point(&world, i, random.unit2());
        let n = if mesh.is_front(i) { s.n_g } else { -s.n_g };
        let ray = Ray { o: s.p + 0.01 * n, d: -n, t_max: 0.02 };
        missed += usize::from(mesh.met(&world, &ray) != i as u32);
    }
    // A point within rounding of an edge may be its neighbour's.
    assert!(missed <= 3, "{missed} of {}", mesh.len());
    let pi = std::f64::consts::PI;
    let group = |scale: f64| scale * scale * (24.0 + 4.0 * pi * 0.64 + pi);
    let exact = 24.0 + 4.0 * pi * 0.81 + 0.5 * pi + 0.8 * pi * 1.25f64.sqrt() + group(0.7) + group(1.0);
    let area: f64 = (0..mesh.len()).map(|i| mesh.area(i)).sum();
    assert!((area / (2.0 * exact) - 1.0).abs() < 1e-5, "{area} not twice {exact}");
}

/// Textures, two sides, a sphere and few rays: L* = 1 in every pixel and at every vertex.
fn constant() -> (Scene, Elements, Sources, Vec<Rgb>) {
    let ball = shape(
        "sphere",
        false,
        r#"<scale value="0.12"/><translate x="0.2" y="-0.3" z="-0.3"/>"#,
        "0.3, 0.5, 0.7",
        "0.7, 0.5, 0.3",
    );
    let world = scene(&(six_walls(|i| [("0.25", "0.75"), ("0.6", "0.4")][i % 2]) + &ball));
    let mesh = Elements::new(&world, 300).unwrap();
    let sources = Sources::new(&world, &mesh, 1, 1);
    let factors = Factors::cast(&world, &mesh, &ray_counts(&mesh, &sources, 64), 1);
    let radiance = invert(&factors, &sources, u64::MAX).unwrap();
    (world, mesh, sources, radiance)
}

#[test]
fn a16_constant_radiance_in_images_and_meshes() {
    let (world, mesh, sources, radiance) = constant();
    let smooth = Smooth::new(&world, &mesh, &sources, &radiance);
    for smooth in [None, Some(&smooth)] {
        let film = view(&world, &mesh, &sources, &radiance, smooth, &View { passes: 4, seed: 0, crop: None }).unwrap();
        assert!(film.mean().iter().flatten().all(|v| (v - 1.0).abs() < 1e-4), "{:?}", film.mean());
        let f = facets(&world, &mesh, &sources, &radiance, smooth);
        assert!(f.radiance.iter().flatten().all(|v| (v - 1.0).abs() < 1e-4));
        let mut bytes = vec![];
        ply::write(&mut bytes, &f.positions, &f.radiance, &f.triangles, 0.0).unwrap();
        let read = ply::parse(&bytes, false).unwrap().value;
        assert_eq!((read.positions, read.triangles), (f.positions, f.triangles));
    }
}

/// The triangles of a closed scene face inwards: their solid angles about a point inside are 4π, the
/// ball's, seen from outside, add nothing.
#[test]
fn facets_face_the_side_that_shines() {
    let (world, mesh, sources, radiance) = constant();
    let f = facets(&world, &mesh, &sources, &radiance, None);
    let eye = nephroid::glam::DVec3::new(-0.1, 0.2, 0.1);
    let solid = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|k| f.positions[k as usize].as_dvec3() - eye);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        -2.0 * a.dot(b.cross(c)).atan2(below)
    };
    let sum: f64 = f.triangles.iter().map(solid).sum();
    assert!((sum - 4.0 * std::f64::consts::PI).abs() < 1e-2, "{sum}");
}

/// The same bits with one thread and with three, by every method and by adaptive subdivision.
#[test]
fn threads_leave_no_trace() {
    let ball = shape("sphere", false, r#"<scale value="0.2"/>"#, "0.5", "");
    let sky = r#"<emitter type="constant"><rgb name="radiance" value="0.3, 0.4, 0.5"/></emitter>"#;
    let floor = shape("rectangle", false, r#"<translate z="-0.5"/>"#, "0.7", "");
    let world = scene(&(floor + &ball + sky));
    let solve = || {
        let how = Subdivision { elements: 160, error: None, source_samples: 8, seed: 3 };
        let mesh = subdivide(&world, &how).unwrap();
        let sources = Sources::new(&world, &mesh, 8, 3);
        let factors = Factors::cast(&world, &mesh, &ray_counts(&mesh, &sources, 64), 3);
        let until = Until { residual: 1e-8, sweeps: 100 };
        let sampled = stochastic(&world, &mesh, &sources, Effort { iterations: 16, rays: 2000, seed: 3 }, |_| true);
        let iterated = iterate(&factors, &sources, Iteration::Jacobi, until, |_| true);
        (invert(&factors, &sources, u64::MAX).unwrap(), sampled.radiance, iterated.radiance)
    };
    let with = |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap().install(solve);
    assert!(with(1) == with(3));
}

/// A floor under a sky of radiance L has ρL; under light of irradiance E, ρE/π.
#[test]
fn a6_skies_and_far_lights_are_sources() {
    let sky = r#"<emitter type="constant"><rgb name="radiance" value="1, 2, 3"/></emitter>"#;
    let sun =
        r#"<emitter type="directional"><vector name="direction" value="0, 1, -1"/><rgb name="irradiance" value="2"/></emitter>"#;
    let lamp =
        r#"<emitter type="point"><point name="position" value="0, 0, 100"/><rgb name="intensity" value="30000"/></emitter>"#;
    let pi = std::f64::consts::PI;
    for (light, exact) in [(sky, [0.5, 1.0, 1.5]), (sun, [0.5 * 2.0 / 2f64.sqrt() / pi; 3]), (lamp, [0.5 * 3.0 / pi; 3])] {
        let world = scene(&(shape("rectangle", false, "", "0.5", "") + light));
        let mesh = Elements::new(&world, 32).unwrap();
        let sources = Sources::new(&world, &mesh, 1024, 1);
        for l in &sources.radiance {
            (0..3).for_each(|c| assert!((l[c] / exact[c] - 1.0).abs() < 0.02, "{l:?} not {exact:?}"));
        }
    }
}

#[test]
fn other_models_are_refused_by_name_and_place() {
    let glass = r#"<bsdf type="dielectric" id="glass"/><shape type="sphere"><ref id="glass"/></shape>"#;
    let text = format!(r#"<scene version="3.0.0"><sensor type="perspective"/>{glass}</scene>"#);
    let read = nephroid::io::mitsuba::from_str(&text, ".".as_ref(), &Default::default()).unwrap();
    let problems = refusals(&read.scene);
    let told = problems.render(&read.scene.sources);
    assert!(problems.has_errors() && told.contains("`glass` is `dielectric`") && told.contains(":1:"), "{told}");
    assert!(matches!(Elements::new(&scene(glass), 10).err(), Some(ElementsError::NotDiffuse(_))));
    let black = r#"<shape type="sphere"><bsdf type="diffuse"/></shape>"#;
    assert!(Elements::new(&scene(black), 10).is_ok());
}
