//! Direct light: sums over lights, areas and directions against each other and against Lambert's formula.

use crate::support::{rendered, scene, sphere};
use glam::Vec2;
use nephroid::math::Random;
use nephroid::math::random::Family;
use nephroid::render::{Estimator, Options, Partition};
use nephroid::scene::Scene;
use nephroid::transport::recursive::recursive;
use nephroid::transport::settings::{Plan, Techniques};
use nephroid::transport::walk::{Context, Tally};
use nephroid::transport::{Contribution, RayCounts, Record};
use std::f64::consts::PI;

/// A wide floor of albedo 0.6 seen from above along −z, one pixel around the origin, 1 mm wide.
fn floor(lights: &str) -> Scene {
    scene(&format!(
        r#"<scene version="3.0.0">
  <sensor type="orthographic"><transform name="to_world"><scale value="0.0005"/><lookat origin="0, 0, 0.5" target="0, 0, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="1"/><integer name="height" value="1"/><rfilter type="box"/></film></sensor>
  <shape type="rectangle"><transform name="to_world"><scale value="5"/></transform>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.6"/></bsdf></shape>{lights}</scene>"#
    ))
}

/// The lamp: a rectangle across [0.2, 1] × [−0.3, 0.7] at z = 1 that shines down with radiance 4.
const CORNERS: [[f64; 3]; 4] = [[0.2, -0.3, 1.0], [1.0, -0.3, 1.0], [1.0, 0.7, 1.0], [0.2, 0.7, 1.0]];
const RADIANCE: f64 = 4.0;
const LAMP: &str = r#"<shape type="rectangle">
    <transform name="to_world"><scale x="0.4" y="0.5"/><rotate x="1" angle="180"/><translate x="0.6" y="0.2" z="1"/></transform>
    <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>
    <emitter type="area"><rgb name="radiance" value="4"/></emitter></shape>"#;

/// Radiance of the floor at the origin by Lambert's formula: E = (Lᵉ/2) Σ γ_i Γ_i·n over the edges, γ the angle that
/// an edge subtends and Γ the normal of its plane with the origin.
fn by_lambert() -> f64 {
    let unit = |v: [f64; 3]| {
        let l = v.iter().map(|x| x * x).sum::<f64>().sqrt();
        v.map(|x| x / l)
    };
    let edge = |i: usize| {
        let (a, b) = (unit(CORNERS[i]), unit(CORNERS[(i + 1) % 4]));
        let cross = unit([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]);
        a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>().acos() * cross[2]
    };
    let irradiance = 0.5 * RADIANCE * (0..4).map(edge).sum::<f64>();
    0.6 / PI * irradiance
}

struct Total(f64);
impl Record for Total {
    fn gathered(&mut self, c: Contribution) {
        self.0 += f64::from(c.value.to_rgb()[0]);
    }
    fn splatted(&mut self, _: Vec2, _: &mut Random, _: Contribution) {}
}

/// Points of light in the middles of n × n parts of the lamp, each with the flux of its part towards the origin: their
/// noise-free sum goes to the integral over the area as n⁻², so that extrapolation gains two more orders.
#[test]
fn b1_sums_over_lights_converge_to_the_integral() {
    let radiance = |n: u32| {
        let mut lights = String::new();
        for (i, j) in (0..n).flat_map(|j| (0..n).map(move |i| (i, j))) {
            let middle = |i: u32| (f64::from(i) + 0.5) / f64::from(n);
            let p = [0.2 + 0.8 * middle(i), -0.3 + middle(j), 1.0];
            // I = Lᵉ dA cosθ_y, with cosθ_y = 1/r.
            let intensity = RADIANCE * 0.8 / f64::from(n * n) / p.iter().map(|x| x * x).sum::<f64>().sqrt();
            lights += &format!(
                r#"<emitter type="point"><point name="position" value="{}, {}, {}"/><rgb name="intensity" value="{intensity}"/></emitter>"#,
                p[0], p[1], p[2]
            );
        }
        let world = floor(&lights);
        let plan = Plan::new(&Options::for_scene(&world, Estimator::Local).settings, 1, 1, 0.0);
        let (mut total, mut rays) = (Total(0.0), RayCounts::default());
        let mut tally = Tally { record: &mut total, rays: &mut rays, observe: &mut () };
        let mut random = Random::new(Family::Gather, 0, 0, 0);
        recursive(Context::new(&world, &plan, 0), Vec2::splat(0.5), 1.0, true, &mut random, &mut tally);
        total.0
    };
    let exact = by_lambert();
    let [two, four, eight] = [2, 4, 8].map(radiance);
    let order = ((two - exact) / (four - exact)).log2();
    assert!((order - 2.0).abs() < 0.1, "order {order}: {two}, {four}, {exact}");
    let extrapolated = (4.0 * eight - four) / 3.0;
    assert!((eight / exact - 1.0).abs() < 2e-3 && (extrapolated / exact - 1.0).abs() < 2e-5, "{eight}, {extrapolated}, {exact}");
}

/// dω = cosθ dA / r²: directions over the hemisphere and points of the lamp give one integral, and it is Lambert's.
#[test]
fn b7_hemisphere_and_area_are_one_integral() {
    let world = floor(LAMP);
    let exact = by_lambert();
    for list in ["hit", "nee", "hit,nee"] {
        let mut options = Options::for_scene(&world, Estimator::Gather);
        options.settings.techniques = Techniques::parse(list).unwrap();
        options.settings.min_length = 2;
        options.settings.max_length = 2;
        let picture = rendered(&world, &options, 20_000).picture();
        let (mean, se) = (f64::from(picture.mean[0][0]), f64::from(picture.variance[0][0]).sqrt());
        assert!(se < 0.1 * exact, "{list}: ± {se} is too noisy to tell");
        assert!((mean - exact).abs() < 4.0 * se + 2e-4 * exact, "{list}: {mean} ± {se} instead of {exact}");
    }
}

/// The error of independent samples falls with the root of their number, by every estimator; that of stratified
/// ones no slower.
#[test]
fn a14_errors_fall_with_the_root_of_the_number() {
    let (world, average) = sphere(0.6);
    let counts = [2u64, 8, 32, 128];
    let cases = [Estimator::Gather, Estimator::Shoot, Estimator::Bidirectional].map(|e| [(e, false), (e, true)]);
    for (estimator, stratified) in cases.into_iter().flatten() {
        let mut options = Options::for_scene(&world, estimator);
        (options.settings.max_length, options.settings.stratified) = (3, stratified);
        options.layers = vec![Partition::Scatterings { last: 2, rest: false }];
        let points = counts.map(|m| {
            let render = rendered(&world, &options, m);
            let mean = render.layers()[0].films[2].mean();
            let square = mean.iter().map(|p| (f64::from(p[0]) - 0.36 * average).powi(2)).sum::<f64>() / mean.len() as f64;
            ((m as f64).ln(), 0.5 * square.ln())
        });
        // Least squares.
        let middle = |f: fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / points.len() as f64;
        let (x, y) = (middle(|p| p.0), middle(|p| p.1));
        let slope =
            points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>() / points.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>();
        let least = if stratified { -1.0 } else { -0.6 };
        assert!(slope > least && slope < -0.4, "{estimator:?}, stratified {stratified}: slope {slope}");
    }
}
