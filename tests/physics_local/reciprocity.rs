//! `reciprocity`: f(w_i → w_o)/η_o² = f(w_o → w_i)/η_i², Dirac events included.

use glam::{Vec2, Vec3};
use nephroid::local::{Equation, Sample};
use nephroid::proof::scattering::models::{Case, all_models, directions};
use nephroid::proof::scattering::reciprocity;

#[test]
fn reciprocity_with_eta_squared() {
    for (c, case) in all_models().iter().enumerate() {
        let found = reciprocity(c, case, 3000);
        assert!(found.worst <= 1.0, "{}: {found:?}", case.name);
        let smooth = case.materials().has_smooth(case.id());
        assert!(found.compared > 300 || !smooth, "{}: only {} pairs above zero", case.name, found.compared);
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
