//! A11: what is lost by cutting off the expansion, in both norms, and the choice of a length.

use crate::support::{ROOM, rendered, scene};
use nephroid::math::Random;
use nephroid::math::random::Family;
use nephroid::render::truncation::{Truncation, contraction};
use nephroid::render::{Estimator, Options, Partition};
use nephroid::scene::Scene;
use nephroid::scene::emitter::Emission;
use nephroid::spectrum::Spectrum;
use nephroid::transport::RayCounts;
use nephroid::transport::settings::Plan;
use nephroid::transport::shoot::shoot;
use nephroid::transport::vertex::Scatter;
use nephroid::transport::walk::{Context, Observe, Tally};

const TOY: &str = r#"<scene version="3.0.0">
  <sensor type="perspective"><float name="fov" value="80"/>
    <transform name="to_world"><lookat origin="0.3, 0.2, 0.5" target="-0.2, 0, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/><rfilter type="box"/></film></sensor>
  <shape type="cube"><boolean name="flip_normals" value="true"/>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.1"/></bsdf>
    <emitter type="area"><rgb name="radiance" value="1.8"/></emitter></shape>
</scene>"#;

fn choose(world: &Scene, estimator: Estimator, tolerance: f64) -> Truncation {
    let settings = Options::for_scene(world, estimator).settings;
    Truncation::choose(world, &settings, [0, 0, world.film.width, world.film.height], tolerance)
}

/// In a closed box of one albedo the bound is the error: 2 · 0.1^(D+1) of a radiance of 2.
#[test]
fn a11_the_bound_is_tight_on_the_toy_scene() {
    let world = scene(TOY);
    for (tolerance, d) in [(0.5, 0), (0.011, 1), (1.1e-3, 2), (1.1e-4, 3)] {
        let t = choose(&world, Estimator::Gather, tolerance);
        assert!(t.a_priori && t.scatterings == d && t.max_length() == d + 1, "{t:?}");
        let bound = t.bound.unwrap();
        assert!((bound - 0.1f64.powi(d as i32 + 1)).abs() < 1e-7);
        let mut options = Options::for_scene(&world, Estimator::Gather);
        options.settings.techniques.next_event = false;
        options.settings.max_length = t.max_length();
        for m in rendered(&world, &options, 2).film().mean() {
            assert!((2.0 - f64::from(m[0]) - bound * 2.0).abs() < 1e-6, "D = {d}: {}", m[0]);
        }
        assert!((t.measured_tail / bound - 1.0).abs() < 0.2, "{t:?}");
        // ‖L‖₁ = π · 2 · 24 m², and the bound of it has nothing to spare either.
        assert!((t.flux_at_most.unwrap() / (48.0 * std::f64::consts::PI) - 1.0).abs() < 1e-4, "{t:?}");
    }
}

/// Flux after each scattering along light paths: ‖τⁿLᵉ‖₁.
struct Fluxes {
    weight: Spectrum,
    n: usize,
    sums: Vec<f64>,
}

impl Observe for Fluxes {
    fn started(&mut self, _: glam::Vec3, light: Option<&Emission>) {
        self.weight = light.map_or(Spectrum::BLACK, |e| e.weight);
        self.n = 0;
        self.sums[0] += f64::from(self.weight.mean());
    }
    fn scattered(&mut self, s: &Scatter) {
        self.weight *= s.weight;
        self.n += 1;
        self.sums[self.n] += f64::from(self.weight.mean());
    }
}

/// No pixel lacks more than q^(D+1) sup L, the scene no more than q^(D+1) ‖L‖₁, for every D.
#[test]
fn a11_both_norms_hold() {
    let dull =
        |bsdf: &str| ROOM.replace(bsdf, r#"<bsdf type="roughconductor"><rgb name="specular_reflectance" value="0.6"/></bsdf>"#);
    let world = scene(&dull(r#"<bsdf type="dielectric"/>"#).replace(
        r#"<bsdf type="conductor"><string name="material" value="none"/></bsdf>"#,
        r#"<bsdf type="plastic"><rgb name="specular_reflectance" value="0.5"/></bsdf>"#,
    ));
    let q = contraction(&world);
    assert!(q > 0.5 && q < 0.95, "{q}");
    const LAST: usize = 24;
    let mut options = Options::for_scene(&world, Estimator::Shoot);
    (options.settings.rr_depth, options.settings.max_length, options.settings.guided) = (1000, LAST as u32 + 2, false);
    let plan = Plan::new(&options.settings, 1, 1, 0.0);
    let mut fluxes = Fluxes { weight: Spectrum::BLACK, n: 0, sums: vec![0.0; LAST + 3] };
    for i in 0..40_000 {
        let mut tally = Tally { record: &mut (), rays: &mut RayCounts::default(), observe: &mut fluxes };
        shoot(Context::new(&world, &plan, 0), None, &mut Random::new(Family::Other, i, 0, 0), &mut tally);
    }
    let total: f64 = fluxes.sums.iter().sum();
    // With only the panel shining radiance has a bound: its own over 1 − q.
    let at = ROOM.find("  <emitter type=\"point\"").unwrap();
    let lit = scene(
        &format!("{}</scene>", &ROOM[..at])
            .replace(r#"<bsdf type="dielectric"/>"#, "")
            .replace(r#"<bsdf type="conductor"><string name="material" value="none"/></bsdf>"#, ""),
    );
    let sup = 6.0 / (1.0 - contraction(&lit));
    let mut gather = Options::for_scene(&lit, Estimator::Gather);
    gather.layers = vec![Partition::Scatterings { last: LAST as u32, rest: true }];
    (gather.settings.rr_depth, gather.settings.max_length) = (1000, LAST as u32 + 12);
    let render = rendered(&lit, &gather, 64);
    let terms: Vec<_> = render.layers()[0].films.iter().map(|f| f.mean()).collect();
    for d in 0..LAST {
        let tail: f64 = fluxes.sums[d + 1..].iter().sum();
        let bound = q.powi(d as i32 + 1) * total;
        assert!(tail <= bound && tail > 0.0, "flux beyond {d}: {tail}, bound {bound}");
        let bound = contraction(&lit).powi(d as i32 + 1) * sup;
        let worst =
            (0..terms[0].len()).map(|i| terms[d + 1..].iter().map(|t| f64::from(t[i][0])).sum::<f64>()).fold(0.0, f64::max);
        assert!(worst <= bound && worst > 0.0, "radiance beyond {d}: {worst}, bound {bound}");
    }
}

/// Glass and mirrors have q = 1: the length is an estimate, and what it loses is about what was asked.
#[test]
fn a11_without_a_bound_the_tail_is_extrapolated() {
    let world = scene(ROOM);
    let t = choose(&world, Estimator::Bidirectional, 0.02);
    assert!(!t.a_priori && t.bound.is_none() && t.flux_at_most.is_none() && t.contraction >= 1.0, "{t:?}");
    assert!(t.unbounded_radiance && t.measured_tail <= 0.02 && t.scatterings > 1, "{t:?}");
    let mut options = Options::for_scene(&world, Estimator::Bidirectional);
    options.layers = vec![Partition::Scatterings { last: t.scatterings + 1, rest: true }];
    let render = rendered(&world, &options, 512);
    let mean = |m: Vec<[f32; 3]>| m.iter().flatten().map(|v| f64::from(*v)).sum::<f64>();
    let films = &render.layers()[0].films;
    let beyond = mean(films[films.len() - 1].mean()) / mean(render.film().mean());
    assert!((beyond / t.measured_tail - 1.0).abs() < 0.5, "{beyond} is beyond, {} was expected", t.measured_tail);
    // A tighter tolerance never shortens paths, and the choice is the same each time.
    assert!(choose(&world, Estimator::Bidirectional, 1e-4).scatterings > t.scatterings);
    assert_eq!(choose(&world, Estimator::Bidirectional, 0.02), t);
}
