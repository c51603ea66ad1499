//! No NaN, no infinity, nothing negative, for any direction, and every wrong parameter a problem.

use glam::{Vec2, Vec3};
use nephroid::describe::{BsdfDescription, BsdfId, BsdfModel, ImageId, MicrofacetDescription, Place, TextureDescription};
use nephroid::local::{Equation, Evaluation, Materials};
use nephroid::proof::scattering::models::{all_models, described, grey, images};
use proptest::prelude::*;

/// Heights from grazing to normal, both exact.
fn height() -> impl Strategy<Value = f32> {
    prop_oneof![
        Just(0.0f32),
        Just(1.0),
        Just(1e-30),
        Just(1e-7),
        Just(1.745e-3),
        0.0f32..1.0,
        (-20.0f32..0.0).prop_map(f32::exp2)
    ]
}

fn direction() -> impl Strategy<Value = Vec3> {
    (height(), any::<bool>(), 0.0f32..6.4).prop_map(|(z, up, phi)| {
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(r * phi.cos(), r * phi.sin(), if up { z } else { -z })
    })
}

fn unit() -> impl Strategy<Value = f32> {
    prop_oneof![Just(0.0f32), Just(0.999_999_94), 0.0f32..1.0]
}

fn sound(e: Evaluation) -> bool {
    let values = e.f.to_rgb().into_iter().chain([e.p_w, e.p_w_rev]);
    values.into_iter().all(|v| v.is_finite() && v >= 0.0)
}

#[test]
fn no_number_is_ever_wrong() {
    let models = all_models();
    let mut runner =
        proptest::test_runner::TestRunner::new(ProptestConfig { cases: 3000, failure_persistence: None, ..Default::default() });
    let strategy = (direction(), direction(), unit(), unit(), unit());
    runner
        .run(&strategy, |(a, b, u_lobe, ux, uy)| {
            for case in &models {
                for equation in [Equation::Rendering, Equation::Potential] {
                    let closure = case.at(a);
                    // Directions that meet at a mirror or pass straight through, too.
                    for b in [b, Vec3::new(-a.x, -a.y, a.z), -a, a] {
                        let e = closure.evaluate(equation, a, b);
                        prop_assert!(sound(e), "{} {a} {b}: {e:?}", case.name);
                        let p = closure.density(a, b);
                        prop_assert!(p.is_finite() && p >= 0.0, "{} {a} {b}: {p}", case.name);
                    }
                    if let Some(s) = closure.sample(equation, a, u_lobe, Vec2::new(ux, uy)) {
                        let numbers = s.weight.to_rgb().into_iter().chain([s.p, s.p_rev, s.dirac_ratio, s.eta]);
                        let fine = numbers.into_iter().all(|v| v.is_finite() && v >= 0.0) && s.p > 0.0;
                        prop_assert!(fine && (s.w_next.length() - 1.0).abs() < 1e-3, "{} {a}: {s:?}", case.name);
                        prop_assert!(s.weight.max_lane() < 10.0, "{} {a}: {s:?}", case.name);
                    }
                }
            }
            Ok(())
        })
        .unwrap_or_else(|e| panic!("{e}"));
}

fn problems(models: Vec<BsdfModel>) -> Vec<String> {
    let models: Vec<BsdfDescription> = models.into_iter().map(described).collect();
    Materials::build(&models, &images()).err().map_or(vec![], |p| p.list.into_iter().map(|p| p.what).collect())
}

#[test]
fn wrong_parameters_are_problems() {
    let diffuse = |v| BsdfModel::Diffuse { reflectance: grey(v) };
    let glass = |int_ior, ext_ior| BsdfModel::Dielectric {
        int_ior,
        ext_ior,
        specular_reflectance: grey(1.0),
        specular_transmittance: grey(1.0),
    };
    let rough = |int_ior| BsdfModel::RoughDielectric {
        distribution: MicrofacetDescription::Ggx,
        alpha_u: grey(0.1),
        alpha_v: grey(0.1),
        int_ior,
        ext_ior: 1.5,
        specular_reflectance: grey(1.0),
        specular_transmittance: grey(1.0),
    };
    let blend = |first, second| BsdfModel::Blend { weight: grey(0.5), first: BsdfId(first), second: BsdfId(second) };
    let missing = TextureDescription::Bitmap {
        image: ImageId(9),
        filter: Default::default(),
        wrap: Default::default(),
        to_uv: Default::default(),
        place: Place::default(),
    };
    let cases: Vec<(Vec<BsdfModel>, &str)> = vec![
        (vec![diffuse(f32::NAN)], "not finite"),
        (vec![diffuse(f32::INFINITY)], "not finite"),
        (vec![diffuse(-0.1)], "negative"),
        (vec![BsdfModel::Diffuse { reflectance: missing }], "does not exist"),
        (vec![glass(0.0, 1.0)], "positive"),
        (vec![glass(1.5, -1.0)], "positive"),
        (vec![glass(f32::NAN, 1.0)], "positive"),
        (vec![rough(1.5)], "must differ"),
        (vec![glass(1.5, 1.0), BsdfModel::TwoSided { front: BsdfId(0), back: BsdfId(0) }], "transmits"),
        (vec![BsdfModel::Null, BsdfModel::TwoSided { front: BsdfId(0), back: BsdfId(0) }], "transmits"),
        (vec![BsdfModel::Mask { opacity: grey(0.5), inner: BsdfId(7) }], "does not exist"),
        (vec![BsdfModel::TwoSided { front: BsdfId(0), back: BsdfId(0) }], "contains itself"),
        (vec![blend(1, 1), blend(0, 0)], "contains itself"),
        ((0..40).map(|i| blend(i + 1, i + 1)).chain([diffuse(0.5)]).collect(), "more than 8"),
    ];
    for (models, expected) in cases {
        let shown = format!("{:?}", models[0]);
        let found = problems(models);
        assert!(found.iter().any(|what| what.contains(expected)), "{shown}: {found:?}, not {expected}");
    }
    assert!(problems(vec![diffuse(0.5), glass(1.5, 1.5)]).is_empty());
}

#[test]
fn a_model_costs_few_bytes() {
    assert!(size_of::<nephroid::local::Closure<'static>>() <= 96, "{}", size_of::<nephroid::local::Closure<'static>>());
}
