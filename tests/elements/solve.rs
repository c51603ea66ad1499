//! The matrix equation solved in every way: closed forms, and the same numbers.

use crate::support::{scene, shape, six_walls};
use nephroid::elements::factors::ray_counts;
use nephroid::elements::iterate::{Iteration, Until, iterate};
use nephroid::elements::stochastic::{Effort, stochastic};
use nephroid::elements::{Elements, Factors, Rgb, Sources, invert::invert};
use nephroid::scene::Scene;

const NO_LIMIT: u64 = u64::MAX;

/// Everything about a scene but the way of solving.
pub struct System {
    pub world: Scene,
    pub mesh: Elements,
    pub sources: Sources,
    pub factors: Factors,
}

pub fn system(parts: &str, elements: usize, rays: u32) -> System {
    let world = scene(parts);
    let mesh = Elements::new(&world, elements).unwrap();
    let sources = Sources::new(&world, &mesh, 64, 1);
    let factors = Factors::cast(&world, &mesh, &ray_counts(&mesh, &sources, rays), 1);
    System { world, mesh, sources, factors }
}

/// x = 0.1 x + 1.8 as a box.
pub fn toy() -> System {
    system(&shape("cube", true, "", "0.1", "1.8"), 200, 128)
}

fn farthest(radiance: &[Rgb], exact: f64) -> f64 {
    radiance.iter().flatten().map(|l| (l - exact).abs()).fold(0.0, f64::max)
}

#[test]
fn a8_b10_inversion_of_the_toy_equation() {
    let s = toy();
    let l = invert(&s.factors, &s.sources, NO_LIMIT).unwrap();
    assert!(farthest(&l, 2.0) < 1e-6, "{}", farthest(&l, 2.0));
}

/// Lᵉ = (1 − ρ) L* on every element of a closed scene, reflectances all different: L = L*, whatever
/// the geometry.
#[test]
fn a16_constant_radiance_by_inversion() {
    const LOOKS: [(&str, &str); 6] =
        [("0.1", "1.8"), ("0.3", "1.4"), ("0.5, 0.6, 0.7", "1, 0.8, 0.6"), ("0.9", "0.2"), ("0", "2"), ("0.75", "0.5")];
    let inner = shape("sphere", false, r#"<scale value="0.2"/><translate x="0.1" y="0.15"/>"#, "0.4", "1.2");
    let s = system(&(six_walls(|i| LOOKS[i]) + &inner), 400, 64);
    let l = invert(&s.factors, &s.sources, NO_LIMIT).unwrap();
    assert!(farthest(&l, 2.0) < 1e-6, "{}", farthest(&l, 2.0));
}

/// Constant reflected radiance: a sphere of albedo a lit by any part of itself reflects
/// a avg(Lᵉ)/(1 − a) everywhere.
#[test]
fn a9_a17_sphere_with_a_lamp_of_its_own() {
    let world = scene(&shape("sphere", true, "", "0.6", ""));
    let mesh = Elements::new(&world, 256).unwrap();
    let mut sources = Sources::new(&world, &mesh, 1, 1);
    let lit = |i: usize| i.is_multiple_of(5);
    let mut mean = 0.0;
    for i in (0..mesh.len()).filter(|i| lit(*i)) {
        sources.radiance[i] = [1.0, 0.5, 3.0];
        mean += mesh.area(i) / (4.0 * std::f64::consts::PI);
    }
    let factors = Factors::cast(&world, &mesh, &vec![4096; mesh.len()], 2);
    let l = invert(&factors, &sources, NO_LIMIT).unwrap();
    for (i, l) in l.iter().enumerate() {
        for (c, e) in [1.0, 0.5, 3.0].iter().enumerate() {
            let reflected = l[c] - if lit(i) { *e } else { 0.0 };
            let exact = 0.6 * mean * e / 0.4;
            assert!((reflected / exact - 1.0).abs() < 0.02, "{i}: {reflected} not {exact}");
        }
    }
}

const ALL: [Iteration; 3] = [Iteration::Jacobi, Iteration::GaussSeidel, Iteration::Southwell];
const TO_ROUNDING: Until = Until { residual: 1e-11, sweeps: 500 };

/// A room of several colours with a lamp and a block: no closed form, but one matrix.
fn room() -> System {
    const LOOKS: [(&str, &str); 6] =
        [("0.7", ""), ("0.6, 0.7, 0.8", ""), ("0.5", ""), ("0.75", ""), ("0.63, 0.07, 0.05", ""), ("0.14, 0.45, 0.09", "")];
    let lamp =
        shape("rectangle", false, r#"<scale value="0.12"/><rotate x="1" angle="90"/><translate y="0.49"/>"#, "0", "9, 8, 6");
    let block = shape("cube", false, r#"<scale value="0.15"/><translate x="0.1" y="-0.34"/>"#, "0.7", "");
    system(&(six_walls(|i| LOOKS[i]) + &lamp + &block), 500, 256)
}

/// max |b + ρFL − L| / max b, written out.
fn residual(s: &System, l: &[Rgb]) -> f64 {
    let (mut worst, mut most) = (0.0f64, 0.0f64);
    for i in 0..l.len() {
        for c in 0..3 {
            let gathered: f64 = (0..l.len()).map(|j| s.factors.get(i, j) * l[j][c]).sum();
            worst = worst.max((s.sources.radiance[i][c] + s.sources.reflectance[i][c] * gathered - l[i][c]).abs());
            most = most.max(s.sources.radiance[i][c]);
        }
    }
    worst / most
}

#[test]
fn a8_iterations_of_the_toy_equation() {
    let s = toy();
    for how in ALL {
        let solution = iterate(&s.factors, &s.sources, how, TO_ROUNDING, |_| true);
        assert!(solution.converged && farthest(&solution.radiance, 2.0) < 1e-6, "{how:?}: {}", farthest(&solution.radiance, 2.0));
    }
    // 0, 1.8, 1.98, 1.998, 1.9998.
    for n in 0..5u32 {
        let until = Until { residual: 0.0, sweeps: n };
        let l = iterate(&s.factors, &s.sources, Iteration::Jacobi, until, |_| true).radiance;
        let exact = 2.0 * (1.0 - 0.1f64.powi(n as i32));
        assert!(farthest(&l, exact) < 1e-6, "sweep {n}: {} from {exact}", farthest(&l, exact));
    }
}

#[test]
fn a8_stochastic_iteration_of_the_toy_equation() {
    let s = toy();
    let effort = Effort { iterations: 64, rays: 4096, seed: 1 };
    let sampled = stochastic(&s.world, &s.mesh, &s.sources, effort, |_| true);
    within_errors(&sampled.radiance, &sampled.standard_error, &vec![[2.0; 3]; s.mesh.len()]);
}

/// Mean square of z near 1, the mean of all within 4 standard errors, and no single one far out
/// (Student's t of 15 degrees of freedom: beyond 8 with probability 1e-6).
fn within_errors(l: &[Rgb], errors: &[Rgb], exact: &[Rgb]) {
    let z: Vec<f64> = (0..l.len())
        .flat_map(|i| (0..3).map(move |c| (i, c)))
        .filter(|(i, c)| errors[*i][*c] > 1e-9)
        .map(|(i, c)| (l[i][c] - exact[i][c]) / errors[i][c])
        .collect();
    let n = z.len() as f64;
    let (mean, square) = (z.iter().sum::<f64>() / n, z.iter().map(|z| z * z).sum::<f64>() / n);
    let most = z.iter().fold(0.0f64, |m, z| m.max(z.abs()));
    let beyond = z.iter().filter(|z| z.abs() > 4.0).count() as f64 / n;
    assert!(n > 50.0 && square < 1.8 && mean.abs() < 0.5 && most < 8.0 && beyond < 0.01, "{mean} {square} {most} {beyond}");
}

/// Residuals shrink by the largest albedo or faster; where there is but one, by exactly that in flux.
#[test]
fn a15_contraction_is_the_albedo() {
    let s = toy();
    let log = iterate(&s.factors, &s.sources, Iteration::Jacobi, TO_ROUNDING, |_| true).log;
    for pair in log.windows(2).take(6) {
        assert!((pair[1].flux / pair[0].flux - 0.1).abs() < 1e-6, "{pair:?}");
    }
    let s = room();
    let q = s.sources.contraction();
    assert!((q - 0.8).abs() < 1e-6, "{q}");
    let log = iterate(&s.factors, &s.sources, Iteration::Jacobi, TO_ROUNDING, |_| true).log;
    for pair in log.windows(2) {
        assert!(pair[1].flux <= q * pair[0].flux * (1.0 + 1e-9), "{pair:?}");
        assert!(pair[1].largest <= q * pair[0].largest * (1.0 + 1e-9), "{pair:?}");
    }
}

#[test]
fn b10_one_solution_by_all_methods() {
    let s = room();
    let inverted = invert(&s.factors, &s.sources, NO_LIMIT).unwrap();
    assert!(residual(&s, &inverted) < 1e-10, "inversion leaves {}", residual(&s, &inverted));
    for how in ALL {
        let solution = iterate(&s.factors, &s.sources, how, TO_ROUNDING, |_| true);
        let left = residual(&s, &solution.radiance);
        assert!(solution.converged && left < 1e-10, "{how:?} leaves {left}");
        let apart = solution.radiance.iter().zip(&inverted).flat_map(|(a, b)| (0..3).map(move |c| (a[c] - b[c]).abs()));
        let apart = apart.fold(0.0, f64::max);
        assert!(apart < 1e-9, "{how:?} is {apart} from inversion");
    }
}

/// The matrix has errors of its own (its rays), the same in every solution: many rays make them small
/// against those of few stochastic iterations.
#[test]
fn b10_stochastic_iteration_has_the_same_mean() {
    let world = room().world;
    let mesh = Elements::new(&world, 120).unwrap();
    let sources = Sources::new(&world, &mesh, 1, 1);
    let factors = Factors::cast(&world, &mesh, &ray_counts(&mesh, &sources, 16_384), 1);
    let inverted = invert(&factors, &sources, NO_LIMIT).unwrap();
    let sampled = stochastic(&world, &mesh, &sources, Effort { iterations: 64, rays: 1500, seed: 2 }, |_| true);
    within_errors(&sampled.radiance, &sampled.standard_error, &inverted);
}

#[test]
fn memory_is_refused_with_the_figure() {
    let s = toy();
    let n = s.mesh.len();
    let refused = invert(&s.factors, &s.sources, 1000).unwrap_err();
    let needed = 16 * (n as u64).pow(2);
    assert_eq!(refused, nephroid::elements::ElementsError::Memory { elements: n, needed, allowed: 1000 });
}
