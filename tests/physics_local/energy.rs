//! `energy`: nothing scatters more than it receives, and what absorbs nothing scatters it all.

use crate::models::{Case, all_models, directions};
use glam::{Vec2, Vec3};
use nephroid::local::Equation;

/// Mean share scattered from `w_back`, counted in basic radiance, by a lattice in the sampler's cube.
fn scattered(case: &Case, equation: Equation, w_back: Vec3) -> f64 {
    const N: u32 = 4093;
    let mut sum = 0.0;
    for i in 0..N {
        // A rank-1 lattice with the powers of a root of x⁴ = x + 1.
        let at = |step: f64| ((0.5 + f64::from(i) * step) % 1.0) as f32;
        let (u_lobe, u) = (at(0.819_172_513_4), Vec2::new(at(0.671_043_606_7), at(0.549_700_477_9)));
        if let Some(s) = case.at(w_back).sample(equation, w_back, u_lobe.min(0.999_999_9), u.min(Vec2::splat(0.999_999_9))) {
            let basic = match equation {
                Equation::Rendering => s.eta * s.eta,
                Equation::Potential => 1.0,
            };
            sum += f64::from(s.weight.max_lane() * basic);
        }
    }
    sum / f64::from(N)
}

#[test]
fn energy_is_never_gained() {
    for case in &all_models() {
        for w_back in directions() {
            for equation in [Equation::Rendering, Equation::Potential] {
                let share = scattered(case, equation, w_back);
                let bound = f64::from(case.materials().albedo_bound(case.id()).max_lane());
                assert!(
                    share <= bound.min(1.0) * 1.004 + 1e-6,
                    "{} {equation:?} {w_back}: {share} of at most {bound}",
                    case.name
                );
            }
        }
    }
}

#[test]
fn energy_of_smooth_lossless_models_is_kept() {
    for case in all_models().iter().filter(|c| c.lossless) {
        for w_back in directions() {
            let closure = case.at(w_back);
            // One-sided models are black behind; rough facets shadow one another.
            if matches!(closure, nephroid::local::Closure::Black) || (closure.roughness() > 0.01 && closure.roughness() < 1.0) {
                continue;
            }
            if case.name.starts_with("rough") && (w_back.z.abs() < 0.5 || closure.roughness() == 1.0) {
                continue;
            }
            for equation in [Equation::Rendering, Equation::Potential] {
                let share = scattered(case, equation, w_back);
                let tolerance = if case.name.starts_with("rough") { 1e-3 } else { 1e-5 };
                assert!((share - 1.0).abs() < tolerance, "{} {equation:?} {w_back}: {share}", case.name);
            }
        }
    }
}

/// Reflection and transmission of a smooth boundary sum to one event by event: p is the share.
#[test]
fn energy_of_both_lobes_is_one() {
    for case in all_models().iter().filter(|c| c.name.contains("dielectric") && !c.name.starts_with("rough")) {
        for w_back in directions() {
            let closure = case.at(w_back);
            let first = closure.sample(Equation::Potential, w_back, 0.0, Vec2::ZERO).expect("an event");
            let last = closure.sample(Equation::Potential, w_back, 0.999_999_94, Vec2::ZERO).expect("an event");
            let sum = if first.w_next == last.w_next { first.p } else { first.p + last.p };
            assert!((sum - 1.0).abs() < 1e-6, "{} {w_back}: {sum}", case.name);
        }
    }
}
