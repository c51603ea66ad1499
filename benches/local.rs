//! Time of one event of the local models: resolve and sample, resolve and evaluate.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use glam::{Vec2, Vec3};
use nephroid::describe::{BsdfDescription, BsdfModel, MicrofacetDescription, Place, TextureDescription};
use nephroid::local::{Equation, MaterialId, Materials};
use nephroid::math::Random;
use nephroid::math::random::Family;
use nephroid::math::warp::hemisphere_cosine;
use std::hint::black_box;

fn grey(v: f32) -> TextureDescription {
    TextureDescription::grey(v)
}

fn models() -> Vec<(&'static str, BsdfModel)> {
    use MicrofacetDescription::{Beckmann, Ggx};
    let rough = |distribution| BsdfModel::RoughConductor {
        distribution,
        alpha_u: grey(0.2),
        alpha_v: grey(0.2),
        perfect: false,
        eta: TextureDescription::Constant([0.143, 0.375, 1.442]),
        k: TextureDescription::Constant([3.983, 2.386, 1.603]),
        specular_reflectance: grey(1.0),
    };
    vec![
        ("diffuse", BsdfModel::Diffuse { reflectance: grey(0.5) }),
        (
            "dielectric",
            BsdfModel::Dielectric {
                int_ior: 1.5,
                ext_ior: 1.0,
                specular_reflectance: grey(1.0),
                specular_transmittance: grey(1.0),
            },
        ),
        ("roughconductor ggx", rough(Ggx)),
        ("roughconductor beckmann", rough(Beckmann)),
        (
            "roughdielectric ggx",
            BsdfModel::RoughDielectric {
                distribution: Ggx,
                alpha_u: grey(0.2),
                alpha_v: grey(0.2),
                int_ior: 1.5,
                ext_ior: 1.0,
                specular_reflectance: grey(1.0),
                specular_transmittance: grey(1.0),
            },
        ),
        (
            "plastic",
            BsdfModel::Plastic {
                int_ior: 1.49,
                ext_ior: 1.0,
                nonlinear: false,
                diffuse_reflectance: grey(0.5),
                specular_reflectance: grey(1.0),
            },
        ),
        (
            "roughplastic ggx",
            BsdfModel::RoughPlastic {
                distribution: Ggx,
                alpha: 0.2,
                int_ior: 1.49,
                ext_ior: 1.0,
                nonlinear: false,
                diffuse_reflectance: grey(0.5),
                specular_reflectance: grey(1.0),
            },
        ),
    ]
}

fn events(c: &mut Criterion) {
    let (names, models): (Vec<_>, Vec<_>) = models().into_iter().unzip();
    let described: Vec<_> =
        models.into_iter().map(|model| BsdfDescription { id: None, model, place: Place::default() }).collect();
    let materials = Materials::build(&described, &[]).expect("models without mistakes");
    let mut random = Random::new(Family::Other, 0, 0, 0);
    let inputs: Vec<(Vec3, Vec3, f32, Vec2)> = (0..1024)
        .map(|_| (hemisphere_cosine(random.unit2()), hemisphere_cosine(random.unit2()), random.unit(), random.unit2()))
        .collect();
    for (i, name) in names.iter().enumerate() {
        let id = MaterialId(i as u32);
        c.bench_with_input(BenchmarkId::new("sample 1024", name), &inputs, |b, inputs| {
            b.iter(|| {
                for (w, _, u_lobe, u) in inputs {
                    let closure = materials.resolve(black_box(id), *u, w.z > 0.0);
                    black_box(closure.sample(Equation::Rendering, *w, *u_lobe, *u));
                }
            });
        });
        c.bench_with_input(BenchmarkId::new("evaluate 1024", name), &inputs, |b, inputs| {
            b.iter(|| {
                for (w_back, w_next, _, u) in inputs {
                    let closure = materials.resolve(black_box(id), *u, w_back.z > 0.0);
                    black_box(closure.evaluate(Equation::Rendering, *w_back, *w_next));
                }
            });
        });
    }
}

criterion_group! {
    name = local;
    config = Criterion::default().sample_size(20).measurement_time(std::time::Duration::from_millis(500)).warm_up_time(std::time::Duration::from_millis(200));
    targets = events
}
criterion_main!(local);
