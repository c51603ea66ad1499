//! `reciprocity`: f(w_i → w_o)/η_o² = f(w_o → w_i)/η_i², Dirac events included.

use crate::models::{Case, all_models, directions};
use glam::{Vec2, Vec3};
use nephroid::local::{Equation, Sample};
use nephroid::math::Random;
use nephroid::math::random::Family;
use nephroid::math::warp::sphere_uniform;

fn index(case: &Case, w: Vec3) -> f32 {
    if w.z > 0.0 { 1.0 } else { case.eta }
}

#[test]
fn reciprocity_with_eta_squared() {
    for (c, case) in all_models().iter().enumerate() {
        let mut random = Random::new(Family::Other, c as u64, 3, 0);
        let mut compared = 0;
        for i in 0..3000 {
            let a = sphere_uniform(random.unit2());
            // Half of the pairs where the model sends something.
            let b = match case.at(a).sample(Equation::Rendering, a, random.unit(), random.unit2()) {
                Some(s) if i % 2 == 0 && !s.delta => s.w_next,
                _ => sphere_uniform(random.unit2()),
            };
            if case.at(a).roughness() < 0.01 && (a + b).length() < 0.2 {
                continue;
            }
            let light_b_to_a = case.at(a).evaluate(Equation::Rendering, a, b).f * (1.0 / index(case, a).powi(2));
            let light_a_to_b = case.at(b).evaluate(Equation::Rendering, b, a).f * (1.0 / index(case, b).powi(2));
            let potential = case.at(b).evaluate(Equation::Potential, b, a).f * (1.0 / index(case, a).powi(2));
            let tolerance = if case.at(a).roughness() < 0.01 { 0.1 } else { 2e-3 };
            for ((x, y), z) in light_b_to_a.to_rgb().into_iter().zip(light_a_to_b.to_rgb()).zip(potential.to_rgb()) {
                let bound = tolerance * x.max(y) + 1e-6;
                assert!((x - y).abs() <= bound && (x - z).abs() <= bound, "{} {a} {b}: {x} {y} {z}", case.name);
                compared += usize::from(x > 0.0);
            }
        }
        let smooth = case.materials().has_smooth(case.id());
        assert!(compared > 300 || !smooth, "{}: only {compared} pairs above zero", case.name);
    }
}

/// All Dirac events from `w_back`, found by trying many choices of lobe.
fn dirac_events(case: &Case, equation: Equation, w_back: Vec3) -> Vec<Sample> {
    let mut events: Vec<Sample> = Vec::new();
    for i in 0..4000 {
        let u_lobe = (i as f32 + 0.5) / 4000.0;
        if let Some(s) = case.at(w_back).sample(equation, w_back, u_lobe, Vec2::splat(0.5))
            && s.delta
            && events.iter().all(|e| (e.w_next - s.w_next).length() > 1e-4 || e.p != s.p)
        {
            events.push(s);
        }
    }
    events
}

#[test]
fn reciprocity_of_dirac_events() {
    for case in all_models().iter().filter(|c| c.materials().has_delta(c.id())) {
        for a in directions().into_iter().filter(|w| w.z.abs() > 0.01) {
            for s in dirac_events(case, Equation::Rendering, a) {
                if s.w_next.z.abs() < 0.01 {
                    continue;
                }
                let back = dirac_events(case, Equation::Potential, s.w_next);
                let r = back
                    .iter()
                    .filter(|r| (r.w_next - a).length() < 2e-3)
                    .min_by(|x, y| (x.p - s.p).abs().total_cmp(&(y.p - s.p).abs()))
                    .unwrap_or_else(|| panic!("{} {a}: {s:?} has no way back in {back:?}", case.name));
                let what = format!("{} {a}: {s:?} {r:?}", case.name);
                assert!((s.p_rev - r.p).abs() < 1e-3 * r.p + 1e-5 && (r.p_rev - s.p).abs() < 1e-3 * s.p + 1e-5, "{what}");
                assert!((s.eta * r.eta - 1.0).abs() < 1e-5 && (s.dirac_ratio * r.dirac_ratio - 1.0).abs() < 1e-2, "{what}");
                let etendue = (a.z / s.w_next.z).abs() / (s.eta * s.eta);
                assert!((s.dirac_ratio / etendue - 1.0).abs() < 1e-4 || s.w_next == -a, "{what}");
                for (x, y) in s.weight.to_rgb().into_iter().zip(r.weight.to_rgb()) {
                    let (x, y) = (x * s.p * s.eta * s.eta, y * r.p);
                    assert!((x - y).abs() < 2e-3 * y + 1e-5, "{what}");
                }
            }
        }
    }
}
