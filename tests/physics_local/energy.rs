//! `energy`: nothing scatters more than it receives, and what absorbs nothing scatters it all.

use glam::Vec2;
use nephroid::describe::{BsdfModel, PrincipledDescription, TextureDescription};
use nephroid::local::Equation;
use nephroid::proof::scattering::models::{Case, all_models, described, directions, grey};
use nephroid::proof::scattering::{EQUATIONS, keeps_energy, scattered};

#[test]
fn energy_is_never_gained() {
    for case in &all_models() {
        for w_back in directions() {
            for equation in EQUATIONS {
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
    let mut asked = 0;
    for case in &all_models() {
        for w_back in directions() {
            let Some(tolerance) = keeps_energy(case, w_back) else { continue };
            for equation in EQUATIONS {
                let share = scattered(case, equation, w_back);
                assert!((share - 1.0).abs() < tolerance, "{} {equation:?} {w_back}: {share}", case.name);
                asked += 1;
            }
        }
    }
    assert!(asked > 100, "only {asked} directions of lossless models");
}

/// The principled model adds a diffuse part and reflections, so pale ones scatter more than they receive; not more than is known.
#[test]
fn energy_of_pale_principled_models_is_bounded() {
    let (none, some, all) = (grey(0.0), grey(0.5), grey(1.0));
    let blue = TextureDescription::Constant([0.0, 0.0, 1.0]);
    let plain = PrincipledDescription { base_color: all.clone(), ..Default::default() };
    let rough = PrincipledDescription { roughness: all.clone(), ..plain.clone() };
    let smooth = PrincipledDescription { roughness: none.clone(), ..plain.clone() };
    let flat = PrincipledDescription { flatness: all.clone(), ..rough.clone() };
    let coated = PrincipledDescription { clearcoat: all.clone(), sheen: all.clone(), ..rough.clone() };
    let tinted = PrincipledDescription { spec_tint: all.clone(), sheen_tint: all.clone(), base_color: blue, ..coated.clone() };
    let glass = PrincipledDescription { spec_trans: some, eta: 1.8, ..tinted.clone() };
    let mut most = 0.0f64;
    for (i, parameters) in [plain, rough, smooth, flat, coated, tinted, glass].into_iter().enumerate() {
        let model = BsdfModel::Principled { parameters: Box::new(parameters) };
        let case = Case::of("principled", false, 1.0, &[described(model)]);
        let bound = f64::from(case.materials().albedo_bound(case.id()).max_lane());
        for w_back in directions() {
            for equation in EQUATIONS {
                let share = scattered(&case, equation, w_back);
                assert!(share <= bound * 1.004, "{i} {equation:?} {w_back}: {share} of at most {bound}");
                most = most.max(share);
            }
        }
    }
    assert!(most > 1.2, "{most}: energy is kept, so the manual is wrong");
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
