//! Known radiance as an image: Φ = ⟨L, Wᵉ⟩ by camera rays alone, where L is given at every point.
//!
//! The film is the same as that of a walk, with the same filter and the same exact sums, so that all
//! that can be done with an image can be done with this one.

use super::{RenderError, estimator};
use crate::film::{Film, Filter, TileBuffer};
use crate::math::Random;
use crate::math::random::Family;
use crate::scene::Scene;
use crate::scene::geometry::{Hit, Ray};
use crate::spectrum::Spectrum;
use glam::Vec2;
use rayon::prelude::*;

/// The film of `passes` camera rays per pixel; `radiance` says what comes back along a ray that met
/// `hit`, or nothing.
pub fn film_of(
    scene: &Scene,
    crop: Option<[u32; 4]>,
    passes: u64,
    seed: u64,
    radiance: impl Fn(&Ray, Option<&Hit>) -> Spectrum + Sync,
) -> Result<Film, RenderError> {
    let whole = &scene.film;
    let crop = crop.or(whole.crop).unwrap_or([0, 0, whole.width, whole.height]);
    let filter = Filter::new(whole.filter).ok_or(RenderError::Filter)?;
    let mut film = Film::new(crop[2], crop[3], Film::exponent_for(estimator::radiance_scale(scene)))?;
    let exponent = film.exponent();
    film.tiles_mut().for_each(|(_, rect, tile)| {
        let mut buffer = TileBuffer::new(exponent);
        for pass in 0..passes {
            for (x, y, local) in rect.pixels() {
                let (px, py) = (crop[0] + x, crop[1] + y);
                let id = u64::from(py) * u64::from(whole.width) + u64::from(px);
                let mut random = Random::new(Family::Gather, id, pass, seed);
                let (offset, weight) = filter.sample_offset(random.unit2());
                let raster = Vec2::new(px as f32 + 0.5, py as f32 + 0.5) + offset;
                let start = scene.sensor.sample_ray(raster, random.unit2());
                let ray = Ray { o: start.o, d: start.d, t_max: start.t_max };
                let value = radiance(&ray, scene.geometry.intersect(&ray).as_ref());
                buffer.add(local, (value * weight).to_rgb());
            }
            tile.commit(&mut buffer);
        }
    });
    let added = film.add_passes(0..passes);
    debug_assert!(added.is_ok());
    Ok(film)
}
