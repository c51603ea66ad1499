//! `density`: samplers follow their densities, and all ways of asking for one number agree.

use glam::Vec3;
use nephroid::local::Equation;
use nephroid::math::Random;
use nephroid::math::random::Family;
use nephroid::proof::scattering::models::{Case, all_models, directions};
use nephroid::proof::scattering::{EQUATIONS, densities, draw, least_smooth_roughness, windows};

const SAMPLES: usize = 40_000;

#[test]
fn density_chi2_and_integral() {
    let cases = all_models();
    let results: Vec<_> = cases.iter().enumerate().flat_map(|(c, case)| densities(c, case, SAMPLES)).collect();
    assert!(results.len() > 200, "{} configurations", results.len());
    let least = 1e-4 / results.len() as f64;
    let failed: Vec<_> = results.iter().filter(|t| !(t.p >= least && t.integral < 1.0 + 5e-3)).collect();
    assert!(failed.is_empty(), "{failed:#?}");
}

/// E[weight] = ∫ f |cosθ_next| in both equations.
#[test]
fn importance_identity() {
    for (c, case) in all_models().iter().enumerate() {
        for (d, w_back) in directions().into_iter().enumerate() {
            // Both equations where they differ, else one of them in turn.
            let both = case.materials().lobes(case.id()).transmits();
            for (e, equation) in EQUATIONS.into_iter().enumerate().filter(|(e, _)| both || (c + d) % 2 == *e) {
                let samples = draw(case, equation, w_back, (1000 * e + 100 * c + d) as u64, SAMPLES / 4);
                let closure = case.at(w_back);
                for window in windows(case, w_back, &samples) {
                    let value = |w: Vec3| f64::from(closure.evaluate(equation, w_back, w).f.mean() * w.z.abs());
                    let exact: f64 = window.integrate(value).iter().sum();
                    let weights = samples.iter().map(|s| match s {
                        Some(s) if !s.delta && window.find(s.w_next).is_some() => f64::from(s.weight.mean()),
                        _ => 0.0,
                    });
                    let (mut sum, mut sum2, n) = (0.0, 0.0, samples.len() as f64);
                    for w in weights {
                        sum += w;
                        sum2 += w * w;
                    }
                    let mean = sum / n;
                    let error = ((sum2 / n - mean * mean).max(0.0) / n).sqrt();
                    let tolerance = 5.0 * error + 4e-3 * exact + 1e-5;
                    assert!(
                        (mean - exact).abs() < tolerance,
                        "{} {equation:?} {w_back}: {mean} ± {error}, ∫ = {exact}",
                        case.name
                    );
                }
            }
        }
    }
}

/// Relative rounding that a density of roughness α can have: a direction is known to 1e-7, a facet
/// normal to that over the sum of the two directions.
fn rounding(case: &Case, w_back: Vec3, w_next: Vec3) -> f32 {
    let alpha = least_smooth_roughness(case, w_back);
    let sum = (w_back + w_next).length().min((w_back + w_next * case.eta).length()).min((w_back * case.eta + w_next).length());
    1e-3 + 4e-6 / (alpha * sum.max(1e-3))
}

fn close(a: f32, b: f32, relative: f32) -> bool {
    (a - b).abs() <= relative * a.abs().max(b.abs()) + 1e-6
}

#[test]
fn sample_agrees_with_evaluate() {
    for (c, case) in all_models().iter().enumerate() {
        for (d, w_back) in directions().into_iter().enumerate() {
            for equation in EQUATIONS {
                for s in draw(case, equation, w_back, (31 * c + d) as u64, 300).into_iter().flatten() {
                    assert!((s.w_next.length() - 1.0).abs() < 1e-4, "{}: not a unit vector", case.name);
                    if s.delta {
                        continue;
                    }
                    let e = case.at(w_back).evaluate(equation, w_back, s.w_next);
                    let r = rounding(case, w_back, s.w_next);
                    let what = format!("{} {equation:?} {w_back} {}: {s:?} {e:?}", case.name, s.w_next);
                    assert!(close(s.p, e.p_w, r), "p: {what}");
                    assert!(close(s.p_rev, e.p_w_rev, r), "p_rev: {what}");
                    let value = e.f * s.w_next.z.abs();
                    for (weight, value) in s.weight.to_rgb().into_iter().zip(value.to_rgb()) {
                        assert!(close(weight * s.p, value, 2.0 * r), "weight: {what}");
                    }
                }
            }
        }
    }
}

#[test]
fn densities_of_both_walkers_agree() {
    for (c, case) in all_models().iter().enumerate() {
        for (d, w_back) in directions().into_iter().enumerate() {
            let mut random = Random::new(Family::Other, (31 * c + d) as u64, 1, 0);
            let sampled = draw(case, Equation::Potential, w_back, 5, 50).into_iter().flatten().map(|s| s.w_next);
            let anywhere: Vec<_> = (0..50).map(|_| nephroid::math::warp::sphere_uniform(random.unit2())).collect();
            for w_next in sampled.chain(anywhere) {
                let [e, potential] = EQUATIONS.map(|equation| case.at(w_back).evaluate(equation, w_back, w_next));
                let swapped = case.at(w_next).evaluate(Equation::Rendering, w_next, w_back);
                let r = rounding(case, w_back, w_next);
                let what = format!("{} {w_back} {w_next}: {e:?} {swapped:?}", case.name);
                assert!(close(e.p_w_rev, swapped.p_w, r) && close(e.p_w, swapped.p_w_rev, r), "{what}");
                assert_eq!((e.p_w, e.p_w_rev), (potential.p_w, potential.p_w_rev), "{what}");
                assert!(close(case.at(w_back).density(w_back, w_next), e.p_w, 1e-5), "{what}");
                assert!(close(case.at(w_back).density(w_next, w_back), e.p_w_rev, r), "{what}");
            }
        }
    }
}
