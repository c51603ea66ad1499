//! One number by three strategies: the measurement Φ of a pixel with its standard errors.
//! `cargo run --release --example measure`

use nephroid::describe::{
    AreaEmission, BsdfDescription, BsdfId, BsdfModel, FilmDescription, FilterDescription, FovAxis, SceneDescription,
    SensorDescription, SensorModel, ShapeDescription, ShapeModel, TextureDescription,
};
use nephroid::glam::{Mat4, Vec2, Vec3};
use nephroid::render::{Estimator, Options, PixelMeasurement};
use nephroid::scene::Scene;
use std::error::Error;

/// A sensor at `eye` looks at `target` along its z axis, y up.
fn look_at(eye: Vec3, target: Vec3) -> Mat4 {
    let z = (target - eye).normalize();
    let x = Vec3::Y.cross(z).normalize();
    Mat4::from_cols(x.extend(0.0), z.cross(x).extend(0.0), z.extend(0.0), eye.extend(1.0))
}

/// A floor under a square lamp with a glass ball between them, made in code.
fn describe() -> SceneDescription {
    let shape = |model, to_world: Mat4, bsdf, emission| ShapeDescription {
        id: None,
        model,
        to_world: to_world.into(),
        flip_normals: false,
        bsdf: Some(BsdfId(bsdf)),
        emission,
        place: Default::default(),
    };
    let bsdf = |model| BsdfDescription { id: None, model, place: Default::default() };
    let lying = Mat4::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    let lamp = Mat4::from_translation(Vec3::new(0.0, 2.0, 0.0)) * Mat4::from_scale(Vec3::splat(0.3)) * lying.inverse();
    let glow = AreaEmission { radiance: TextureDescription::grey(10.0), id: None, place: Default::default() };
    let ball = ShapeModel::Sphere { center: Vec3::new(0.0, 0.7, 0.0), radius: 0.4 };
    let film = FilmDescription { width: 64, height: 48, crop: None, filter: FilterDescription::Box, place: Default::default() };
    let eye = Vec3::new(0.0, 1.5, 4.0);
    SceneDescription {
        sensors: vec![SensorDescription {
            id: None,
            model: SensorModel::Perspective { fov_deg: 40.0, fov_axis: FovAxis::X, principal_point_offset: Vec2::ZERO },
            to_world: look_at(eye, Vec3::ZERO).into(),
            near_clip: 0.01,
            far_clip: 1e4,
            sample_count: None,
            seed: 0,
            film,
            place: Default::default(),
        }],
        bsdfs: vec![
            bsdf(BsdfModel::Diffuse { reflectance: TextureDescription::grey(0.7) }),
            bsdf(BsdfModel::Dielectric {
                int_ior: 1.5,
                ext_ior: 1.0,
                specular_reflectance: TextureDescription::grey(1.0),
                specular_transmittance: TextureDescription::grey(1.0),
            }),
        ],
        shapes: vec![
            shape(ShapeModel::Rectangle, Mat4::from_scale(Vec3::splat(3.0)) * lying, 0, None),
            shape(ShapeModel::Rectangle, lamp, 0, Some(glow)),
            shape(ball, Mat4::IDENTITY, 1, None),
        ],
        ..SceneDescription::default()
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let (scene, _warnings) = Scene::build(&describe(), 0).map_err(|p| p.render(&Default::default()))?;
    let options = Options::for_scene(&scene, Estimator::Bidirectional);
    for pixel in [(20, 40), (32, 26)] {
        let m = PixelMeasurement::new(&scene, &options, pixel, 2000)?;
        println!("pixel {pixel:?}");
        for (name, m) in [("gather", m.gather), ("shoot", m.shoot), ("both", m.bidirectional)] {
            println!("  {name:6} {:.4} ± {:.4}", m.mean[1], m.standard_error[1]);
        }
    }
    Ok(())
}
