//! Emitters from their descriptions: checked, classified, given power and probability.

use super::area::Area;
use super::envmap::{Envmap, MIN_SIZE};
use super::parallel::Parallel;
use super::point::Point;
use super::sky::Sky;
use super::spot::{Parameters, Spot};
use super::sun::Sun;
use super::tree::Bound;
use super::{Emitter, Lights};
use crate::describe::{
    AreaEmission, EmitterDescription, EmitterModel, Image, ImageDescription, ImageId, Place, Placed, Problems,
};
use crate::scene::EmitterId;
use crate::scene::geometry::Geometry;
use crate::scene::rigid;
use crate::spectrum::Spectrum;
use crate::texture::{TextureSlot, Textures};
use glam::{Mat4, Vec3};
use std::f32::consts::PI;
use std::sync::Arc;

/// What the command line tells about an emitter.
#[derive(Clone, Debug, PartialEq)]
pub struct EmitterInfo {
    /// As in the scene file: `area`, `point`, …
    pub kind: &'static str,
    /// `id` of the element, if any.
    pub id: Option<String>,
    /// Emitted power in W, linear sRGB; infinite emitters: what enters the scene's sphere.
    pub power: [f32; 3],
    /// Probability of being chosen for a next event; among many emitters, where it depends on the point
    /// that is lit, the part of the choice that does not.
    pub prob_next_event: f32,
    /// Probability of being chosen for emission.
    pub prob_emission: f32,
    /// Where.
    pub place: Place,
}

impl EmitterInfo {
    /// Kind and, if it has one, `id`: as people know it.
    pub fn name(&self) -> String {
        self.id.as_ref().map_or_else(|| self.kind.to_owned(), |id| format!("{} `{id}`", self.kind))
    }
}

/// Below this full angle directions in single precision have no place for a disk: parallel light.
const LEAST_DISK_DEG: f32 = 0.002;

impl Lights {
    /// Emitters with ids in order: `areas` (shape index and emission), then `others`.
    ///
    /// Black emitters and emitters without area are warned about and never chosen.
    pub fn build(
        areas: &[(u32, &AreaEmission)],
        others: &[EmitterDescription],
        images: &[ImageDescription],
        geometry: &Geometry,
        problems: &mut Problems,
    ) -> Self {
        let (center, radius) = geometry.bounding_sphere();
        // Room for rounding at the rim, and something for an empty scene.
        let radius = if radius > 0.0 { radius * (1.0 + 1e-4) } else { 1.0 };
        let mut lights = Self { center, radius, p_across: 1.0 / (PI * radius * radius), ..Self::default() };
        for (shape, emission) in areas {
            let (emitter, power) = lights.area(*shape, emission, images, geometry, problems);
            lights.push(emitter, "area", &emission.id, power, emission.place, problems);
        }
        for other in others {
            if let EmitterModel::Ambient { radiance } = &other.model {
                lights.ambient.push((EmitterId(lights.emitters.len() as u32), colour(*radiance)));
            }
            let (emitter, power) = lights.other(other, images, problems);
            lights.push(emitter, kind_of(&other.model), &other.id, power, other.place, problems);
        }
        lights.choose();
        lights
    }

    /// Appends an emitter, a dark one where it has no effect.
    fn push(
        &mut self,
        emitter: Emitter,
        kind: &'static str,
        id: &Option<String>,
        power: Spectrum,
        place: Place,
        problems: &mut Problems,
    ) {
        let mut lit = power.mean() > 0.0;
        if !power.is_finite() || power.0.min_element() < 0.0 {
            problems.error(place, format!("the {kind} emitter's power is negative or not finite")).hint("check its numbers");
            lit = false;
        } else if !lit && !matches!(emitter, Emitter::Dark) {
            problems.warning(place, format!("the {kind} emitter is black and has no effect"));
        }
        let emitter = if lit { emitter } else { Emitter::Dark };
        if matches!(emitter, Emitter::Sky(_)) {
            self.skies.push(EmitterId(self.emitters.len() as u32));
        }
        self.emitters.push(emitter);
        self.infos.push(super::EmitterInfo {
            kind,
            id: id.clone(),
            power: power.to_rgb(),
            prob_next_event: 0.0,
            prob_emission: 0.0,
            place,
        });
    }

    /// What bounds the light of a finite emitter of so much power.
    pub(super) fn bound(&self, i: usize, power: f64) -> Option<Bound> {
        match &self.emitters[i] {
            Emitter::Area(area) => Some(Bound::area(&area.extent, power)),
            Emitter::Point(point) => Some(Bound::point(point, power)),
            Emitter::Spot(spot) => Some(Bound::spot(spot, power)),
            Emitter::Parallel(_) | Emitter::Sky(_) | Emitter::Dark => None,
        }
    }

    fn area(
        &mut self,
        shape: u32,
        emission: &AreaEmission,
        images: &[ImageDescription],
        geometry: &Geometry,
        problems: &mut Problems,
    ) -> (Emitter, Spectrum) {
        let radiance = self.textures.add(&emission.radiance, images, problems);
        if !finite_texture(&self.textures, radiance) {
            problems.error(emission.place, "the radiance of the area emitter is negative or not finite");
            return (Emitter::Dark, Spectrum::BLACK);
        }
        let area = geometry.area(shape);
        let extent = geometry.extent(shape).filter(|_| area > 0.0 && (1.0 / area).is_finite());
        let Some(extent) = extent else {
            problems.warning(emission.place, "the shape of this area emitter has no area, it has no effect");
            return (Emitter::Dark, Spectrum::BLACK);
        };
        let area = Area { shape, radiance, p_a: 1.0 / area, extent, sphere: geometry.is_outward_sphere(shape) };
        let power = area.power(geometry, &self.textures);
        (Emitter::Area(area), power)
    }

    fn other(
        &mut self,
        described: &EmitterDescription,
        images: &[ImageDescription],
        problems: &mut Problems,
    ) -> (Emitter, Spectrum) {
        let place = described.place;
        let built = match &described.model {
            EmitterModel::Point { position, intensity } => point(*position, colour(*intensity), place, problems),
            EmitterModel::Spot { .. } => self.spot(&described.model, images, place, problems),
            EmitterModel::Directional { direction, irradiance, angular_diameter_deg } => {
                self.directional(*direction, colour(*irradiance), *angular_diameter_deg, place, problems)
            }
            // No light of the two equations.
            EmitterModel::Ambient { .. } => None,
            EmitterModel::Constant { radiance } => Some(self.sky(Sky::Constant(colour(*radiance)))),
            EmitterModel::Envmap { image, scale, to_world } => {
                envmap(*image, *scale, to_world, images, place, problems).map(|sky| self.sky(sky))
            }
        };
        built.unwrap_or((Emitter::Dark, Spectrum::BLACK))
    }

    /// With the power that enters the scene's sphere.
    fn sky(&self, sky: Sky) -> (Emitter, Spectrum) {
        let power = sky.integral() / self.p_across;
        (Emitter::Sky(sky), power)
    }

    fn spot(
        &mut self,
        model: &EmitterModel,
        images: &[ImageDescription],
        place: Place,
        problems: &mut Problems,
    ) -> Option<(Emitter, Spectrum)> {
        let EmitterModel::Spot { to_world, intensity, cutoff_angle_deg: cutoff, beam_width_deg: beam, texture } = model else {
            return None;
        };
        if !(*cutoff > 0.0 && *cutoff <= 180.0 && *beam >= 0.0 && beam <= cutoff) {
            problems
                .error(place, format!("a spot cannot have cutoff_angle {cutoff}° and beam_width {beam}°"))
                .hint("0 < cutoff_angle ≤ 180 and 0 ≤ beam_width ≤ cutoff_angle");
            return None;
        }
        let texture = match texture {
            Some(_) if *cutoff >= 90.0 => {
                problems.error(place, format!("an image cannot be projected with a cutoff_angle of {cutoff}°")).hint("below 90°");
                return None;
            }
            Some(t) => self.textures.add(t, images, problems),
            None => TextureSlot::ONE,
        };
        // A constant texture is part of the intensity.
        let (intensity, texture) = match texture {
            TextureSlot::Constant(c) => (colour(*intensity) * c, TextureSlot::ONE),
            varying => (colour(*intensity), varying),
        };
        if !finite_texture(&self.textures, texture) {
            problems.error(place, "the projected image is negative or not finite");
            return None;
        }
        let (axes, _) = rigid::axes(to_world, "emitter", problems)?;
        let position = to_world.value.w_axis.truncate();
        let (cutoff_deg, beam_deg) = (f64::from(*cutoff), f64::from(*beam));
        let spot = Spot::new(Parameters { axes, position, intensity, cutoff_deg, beam_deg, texture });
        let power = spot.power(&self.textures);
        let floor = spot.peak(&self.textures) * 1e-6;
        Some((Emitter::Spot(spot), power.lane_max(floor)))
    }

    fn directional(
        &mut self,
        direction: Vec3,
        irradiance: Spectrum,
        diameter_deg: f32,
        place: Place,
        problems: &mut Problems,
    ) -> Option<(Emitter, Spectrum)> {
        let direction = direction.as_dvec3();
        let length = direction.length();
        if !(length > 0.0 && length.is_finite()) {
            problems.error(place, "the direction of the directional emitter is zero or not finite");
            return None;
        }
        if !(0.0..180.0).contains(&diameter_deg) {
            problems
                .error(place, format!("an angular_diameter of {diameter_deg}° is out of range"))
                .hint("at least 0 and less than 180 degrees");
            return None;
        }
        let direction = (direction / length).as_vec3();
        if diameter_deg < LEAST_DISK_DEG {
            if diameter_deg > 0.0 {
                problems.warning(place, format!("an angular_diameter below {LEAST_DISK_DEG}° is taken for 0"));
            }
            return Some((Emitter::Parallel(Parallel { direction, irradiance }), irradiance / self.p_across));
        }
        let half_angle = 0.5 * f64::from(diameter_deg).to_radians();
        Some(self.sky(Sky::Sun(Sun::new(direction, irradiance, half_angle))))
    }
}

fn kind_of(model: &EmitterModel) -> &'static str {
    match model {
        EmitterModel::Point { .. } => "point",
        EmitterModel::Spot { .. } => "spot",
        EmitterModel::Directional { .. } => "directional",
        EmitterModel::Ambient { .. } => "ambient",
        EmitterModel::Constant { .. } => "constant",
        EmitterModel::Envmap { .. } => "envmap",
    }
}

fn colour([r, g, b]: [f32; 3]) -> Spectrum {
    Spectrum::rgb(r, g, b)
}

fn point(position: Vec3, intensity: Spectrum, place: Place, problems: &mut Problems) -> Option<(Emitter, Spectrum)> {
    if !position.is_finite() {
        problems.error(place, "the position of the point emitter is not finite");
        return None;
    }
    Some((Emitter::Point(Point { position, intensity }), intensity * (4.0 * PI)))
}

fn envmap(
    image: ImageId,
    scale: f32,
    to_world: &Placed<Mat4>,
    images: &[ImageDescription],
    place: Place,
    problems: &mut Problems,
) -> Option<Sky> {
    let Some(ImageDescription::Data(image)) = images.get(image.0 as usize) else {
        problems.error(place, "the image of the envmap emitter was not loaded");
        return None;
    };
    let (width, height) = MIN_SIZE;
    if image.width < width || image.height < height {
        problems
            .error(place, format!("an environment image of {} × {} pixels is too small", image.width, image.height))
            .hint(format!("at least {width} × {height} pixels"));
        return None;
    }
    if !(image.channels == 1 || image.channels == 3) || image.data.len() as u64 != pixels(image) {
        problems.error(place, "the environment image has not one or three numbers per pixel");
        return None;
    }
    if !(scale >= 0.0 && scale.is_finite()) {
        problems.error(place, format!("the envmap emitter's scale of {scale} is negative or not finite"));
        return None;
    }
    let (axes, _) = rigid::axes(to_world, "emitter", problems)?;
    let image = sanitised(image, place, problems);
    Some(Envmap::new(image, scale, axes).map_or(Sky::Constant(Spectrum::BLACK), |map| Sky::Envmap(Box::new(map))))
}

fn pixels(image: &Image) -> u64 {
    u64::from(image.width) * u64::from(image.height) * u64::from(image.channels)
}

/// The image itself, or a copy in which numbers that are no radiance are zero.
fn sanitised(image: &Arc<Image>, place: Place, problems: &mut Problems) -> Arc<Image> {
    let sound = |v: &f32| *v >= 0.0 && v.is_finite();
    let wrong = image.data.iter().filter(|v| !sound(v)).count();
    if wrong == 0 {
        return image.clone();
    }
    problems.warning(place, format!("{wrong} numbers of the environment image are negative or not finite and count as 0"));
    let mut copy = Image::clone(image);
    copy.data.iter_mut().filter(|v| !sound(v)).for_each(|v| *v = 0.0);
    Arc::new(copy)
}

fn finite_texture(textures: &Textures, slot: TextureSlot) -> bool {
    let (max, min) = (textures.max(slot), textures.min(slot));
    max.is_finite() && min.is_finite() && min.0.min_element() >= 0.0
}
