//! The bound of the error [theory A15]: above the measured error, and not far above.

use crate::support::{box_with_blocks, scene, six_walls, slope};
use glam::{Mat4, Vec2, Vec3};
use nephroid::describe::{FilmDescription, FilterDescription, FovAxis, Place, Problems, SensorDescription, SensorModel};
use nephroid::elements::bound::bound;
use nephroid::elements::factors::ray_counts;
use nephroid::elements::{Elements, Factors, Rgb, Sources, Subdivision, View, invert::invert, subdivide, view};
use nephroid::glam;
use nephroid::math::random::Family;
use nephroid::math::{Frame, Random};
use nephroid::render::{Budget, Control, Estimator, Options, Render};
use nephroid::scene::Scene;
use nephroid::scene::sensor::Sensor;
use nephroid::transport::cache::LightCache;
use nephroid::transport::gather::gather;
use nephroid::transport::settings::Plan;
use nephroid::transport::walk::{Context, Tally};
use nephroid::transport::{Contribution, RayCounts, Record};

fn solve(world: &Scene, elements: usize, rays: u32) -> (Elements, Sources, Vec<Rgb>) {
    solve_on(world, Elements::new(world, elements).unwrap(), rays)
}

fn solve_on(world: &Scene, mesh: Elements, rays: u32) -> (Elements, Sources, Vec<Rgb>) {
    let sources = Sources::new(world, &mesh, 16, 1);
    let factors = Factors::cast(world, &mesh, &ray_counts(&mesh, &sources, rays), 1);
    let radiance = invert(&factors, &sources, u64::MAX).unwrap();
    (mesh, sources, radiance)
}

/// A sensor that sees nothing but the surface point `p` from a millimetre away.
fn keyhole(p: Vec3, n: Vec3) -> Sensor {
    let frame = Frame::around(-n);
    let to_world = Mat4::from_cols(frame.s.extend(0.0), frame.t.extend(0.0), frame.n.extend(0.0), (p + 1e-3 * n).extend(1.0));
    let description = SensorDescription {
        id: None,
        model: SensorModel::Perspective { fov_deg: 0.1, fov_axis: FovAxis::X, principal_point_offset: Vec2::ZERO },
        to_world: to_world.into(),
        near_clip: 1e-4,
        far_clip: 1e3,
        sample_count: None,
        seed: 0,
        film: FilmDescription { width: 1, height: 1, crop: None, filter: FilterDescription::Box, place: Place::default() },
        place: Place::default(),
    };
    let mut problems = Problems::default();
    Sensor::build(&description, &mut problems).unwrap_or_else(|| panic!("{problems:?}"))
}

#[derive(Default)]
struct Sum([f64; 3]);
impl Record for Sum {
    fn gathered(&mut self, c: Contribution) {
        self.0.iter_mut().zip(c.value.to_rgb()).for_each(|(s, v)| *s += f64::from(v));
    }
    fn splatted(&mut self, _: Vec2, _: &mut Random, _: Contribution) {}
}

/// Root mean square over the surfaces of L − L̃, L by gathering walks that start at random points of the
/// elements: two independent estimates each, whose product has no bias by noise.
fn measured_error(world: &mut Scene, mesh: &Elements, radiance: &[Rgb], points: u32, samples: u64) -> f64 {
    let total: f64 = (0..mesh.len()).map(|i| mesh.area(i)).sum();
    let settings = Options::for_scene(world, Estimator::Gather).settings;
    let plan = Plan::new(&settings, 1, 1, 0.0);
    let (mut square, mut upto, mut next) = (0.0, 0.0, 0.5);
    for (i, l) in radiance.iter().enumerate() {
        upto += mesh.area(i) / total * f64::from(points);
        while next < upto {
            next += 1.0;
            let mut random = Random::new(Family::Other, next as u64, 0, 7);
            let s = mesh.point(world, i, random.unit2());
            world.sensor = keyhole(s.p, if mesh.is_front(i) { s.n_g } else { -s.n_g });
            let cx = Context::new(world, &plan, 0);
            let [a, b] = [0, 1].map(|_| {
                let mut sum = Sum::default();
                let mut rays = RayCounts::default();
                let mut tally = Tally { record: &mut sum, rays: &mut rays, observe: &mut () };
                for _ in 0..samples {
                    gather(cx, Vec2::splat(0.5), 1.0, &LightCache::default(), &mut random, &mut tally);
                }
                sum.0.map(|v| v / samples as f64)
            });
            square += (0..3).map(|c| (a[c] - l[c]) * (b[c] - l[c])).sum::<f64>() / (3.0 * f64::from(points));
        }
    }
    square.max(0.0).sqrt()
}

#[test]
fn a15_cornell_box_within_the_bound() {
    let mut world = scene(&box_with_blocks());
    let (mesh, sources, radiance) = solve(&world, 1200, 512);
    let known = bound(&world, &mesh, &radiance, 4096, 32, 1);
    let error = known.error().expect("albedos below 1");
    let film = view(&world, &mesh, &sources, &radiance, None, &View { passes: 64, seed: 0, crop: None }).unwrap();
    let mut render = Render::new(&world, &Options::for_scene(&world, Estimator::Gather)).unwrap();
    render.run(&Budget::passes(1024), |_| Control::Continue);
    // In the picture, whose every pixel averages over a part of the surfaces.
    let (seen, gathered) = (film.mean(), render.picture().mean);
    let squares = seen.iter().zip(&gathered).flat_map(|(a, b)| (0..3).map(move |c| f64::from(a[c] - b[c]).powi(2)));
    let in_picture = (squares.sum::<f64>() / (3 * seen.len()) as f64).sqrt();
    drop(render);
    let measured = measured_error(&mut world, &mesh, &radiance, 2000, 128);
    println!("measured {measured:.4}, in the picture {in_picture:.4}, residual {:.4}, bound {error:.4}", known.residual);
    assert!(measured > 0.0 && measured <= error && error <= 20.0 * measured, "{measured} {error}");
    assert!(in_picture <= error, "{in_picture} {error}");
}

/// A sphere with a chequered lamp for a wall: L = Lᵉ + a avg(Lᵉ)/(1 − a) exactly; coarse elements average
/// over the edges of the pattern, and their error falls with their size (as h^½, since it lives on
/// lines).
#[test]
fn a15_a17_sphere_within_the_bound() {
    let world = scene(
        r#"<shape type="sphere"><boolean name="flip_normals" value="true"/><bsdf type="diffuse"><rgb name="reflectance" value="0.6"/></bsdf>
        <emitter type="area"><texture type="checkerboard" name="radiance"><rgb name="color0" value="1, 2, 3"/><rgb name="color1" value="0"/>
        <transform name="to_uv"><scale x="3" y="2"/></transform></texture></emitter></shape>"#,
    );
    let mut errors = vec![];
    for elements in [64usize, 256, 1024] {
        let (mesh, _, radiance) = solve(&world, elements, 4096);
        let known = bound(&world, &mesh, &radiance, 4096, 64, 1);
        let mut random = Random::new(Family::Other, 0, 0, 1);
        let (mut square, per) = (0.0, 65_536 / elements);
        for (i, l) in radiance.iter().enumerate() {
            for _ in 0..per {
                let s = mesh.point(&world, i, random.unit2());
                let point = nephroid::scene::emitter::EmitterPoint::on_surface(&s);
                let emitted = world.lights.radiance(&point, s.n_g).to_rgb();
                for c in 0..3 {
                    let exact = f64::from(emitted[c]) + 0.6 * 0.5 * (c as f64 + 1.0) / 0.4;
                    square += (exact - l[c]).powi(2) / (3 * per * mesh.len()) as f64;
                }
            }
        }
        let (measured, error) = (square.sqrt(), known.error().unwrap());
        println!("{elements} elements: measured {measured:.4}, residual {:.4}, bound {error:.4}", known.residual);
        assert!(measured <= error && error <= 20.0 * measured, "{elements}: {measured} {error}");
        errors.push((elements as f64, measured));
    }
    let order = slope(&errors);
    assert!((-0.35..-0.15).contains(&order), "order {order} in the number of elements: {errors:?}");
}

/// One glowing wall of a cube, radiance smooth on the others but for its gradient, which is logarithmic at
/// the edges of that wall: the error of constant elements falls as their diameter h times √ln(1/h), a
/// little more slowly than n^-1/2 in their number.
#[test]
fn a15_error_falls_with_the_diameter_of_elements() {
    let world = scene(&six_walls(|i| if i == 0 { ("0.5", "1") } else { ("0.5", "") }));
    let errors: Vec<(f64, f64)> = [48usize, 192, 768]
        .map(|n| {
            let (mesh, _, radiance) = solve(&world, n, 4096);
            (n as f64, bound(&world, &mesh, &radiance, 8192, 32, 1).residual)
        })
        .into();
    let order = slope(&errors);
    println!("order {order}: {errors:?}");
    assert!((-0.55..-0.4).contains(&order), "order {order} in the number of elements: {errors:?}");
}

/// Elements put where radiance varies do better than as many of one size.
#[test]
fn a15_adaptive_elements_are_better() {
    let world = scene(&box_with_blocks());
    let (mesh, _, radiance) = solve(&world, 1200, 2048);
    let uniform = bound(&world, &mesh, &radiance, 4096, 32, 1).residual;
    let how = Subdivision { elements: 1200, error: None, source_samples: 1, seed: 1 };
    let (mesh, _, radiance) = solve_on(&world, subdivide(&world, &how).unwrap(), 2048);
    let adaptive = bound(&world, &mesh, &radiance, 4096, 32, 1).residual;
    println!("uniform {uniform:.4}, adaptive {adaptive:.4}");
    assert!(mesh.len() <= 1200 && adaptive < 0.9 * uniform, "{} elements: {adaptive}, uniform {uniform}", mesh.len());
    let coarse = subdivide(&world, &Subdivision { error: Some(0.2), ..how }).unwrap();
    assert!(coarse.len() < mesh.len(), "{} elements for a fifth", coarse.len());
}
