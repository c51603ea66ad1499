//! Emitters against Mitsuba, samplers against their densities, estimates against quadrature.

mod densities;
mod estimates;
mod manners;
mod many;
mod mitsuba;

use super::*;
use crate::describe::{AreaEmission, EmitterDescription, EmitterModel, Image, ImageDescription, ImageId, Place, Problems};
use crate::math::random::{Family, Random};
use crate::scene::geometry::{Form, Geometry, ShapeInput};
use glam::Mat4;
use std::sync::Arc;

/// Geometry and lights made from few words.
struct World {
    geometry: Geometry,
    lights: Lights,
    problems: Problems,
}

/// An emitter of no shape with the image it needs.
type Other = (EmitterModel, Option<Image>);

impl World {
    /// Shapes, lit where a radiance is given, and other emitters, each with its own image.
    fn new(shapes: Vec<(ShapeInput, Option<AreaEmission>)>, others: Vec<Other>) -> Self {
        let images: Vec<_> =
            others.iter().map(|(_, image)| ImageDescription::Data(Arc::new(image.clone().unwrap_or_default()))).collect();
        let others = others.into_iter().enumerate().map(|(i, (model, _))| (numbered(model, i as u32), None)).collect();
        Self::with_images(shapes, others, &images)
    }

    fn with_images(shapes: Vec<(ShapeInput, Option<AreaEmission>)>, others: Vec<Other>, images: &[ImageDescription]) -> Self {
        let mut areas = vec![];
        let mut inputs = vec![];
        for (i, (mut shape, emission)) in shapes.into_iter().enumerate() {
            if let Some(emission) = emission {
                shape.emitter = EmitterId(areas.len() as u32);
                areas.push((i as u32, emission));
            }
            inputs.push(shape);
        }
        let geometry = Geometry::build(inputs, vec![]).unwrap_or_else(|p| panic!("{p:?}"));
        let areas: Vec<_> = areas.iter().map(|(i, e)| (*i, e)).collect();
        let describe = |(model, _): Other| EmitterDescription { id: None, model, place: Place::default() };
        let others: Vec<_> = others.into_iter().map(describe).collect();
        let mut problems = Problems::default();
        let lights = Lights::build(&areas, &others, images, &geometry, &mut problems);
        Self { geometry, lights, problems }
    }
}

fn numbered(model: EmitterModel, i: u32) -> EmitterModel {
    match model {
        EmitterModel::Envmap { scale, to_world, .. } => EmitterModel::Envmap { image: ImageId(i), scale, to_world },
        other => other,
    }
}

fn envmap(image: Image, scale: f32, to_world: Mat4) -> Other {
    (EmitterModel::Envmap { image: ImageId(0), scale, to_world: to_world.into() }, Some(image))
}

/// 5 × 4 texels of every colour.
fn small_image() -> Image {
    let mut image = Image { width: 5, height: 4, channels: 3, data: vec![] };
    for (y, x, c) in (0..4).flat_map(|y| (0..5).flat_map(move |x| (0..3).map(move |c| (y, x, c)))) {
        image.data.push(((x * 7 + y * 3 + c * 5) % 11) as f32 / 3.0 + 0.05);
    }
    image
}

/// 32 × 17 texels, a third of them black, with a sun 2 000 times as bright as the rest.
fn sunny_image() -> Image {
    let mut random = Random::new(Family::Other, 4, 0, 0);
    let mut image = Image { width: 32, height: 17, channels: 3, data: vec![] };
    for _ in 0..32 * 17 {
        let lit = if random.unit() < 0.33 { 0.0 } else { 1.0 };
        image.data.extend([0; 3].map(|_| lit * random.unit()));
    }
    let at = 3 * (5 * 32 + 20);
    image.data[at..at + 3].fill(2_000.0);
    image
}

fn emission(radiance: crate::describe::TextureDescription) -> Option<AreaEmission> {
    Some(AreaEmission { radiance, id: None, place: Place::default() })
}

fn constant([r, g, b]: [f32; 3]) -> Option<AreaEmission> {
    emission(crate::describe::TextureDescription::Constant([r, g, b]))
}

fn shape(form: Form, to_world: Mat4) -> ShapeInput {
    ShapeInput::new(form).at(to_world)
}

/// A unit sphere about (0, 0, 1) that gives the scene a size.
fn ball() -> (ShapeInput, Option<AreaEmission>) {
    (shape(Form::Sphere { center: Vec3::Z, radius: 1.0 }, Mat4::IDENTITY), None)
}
