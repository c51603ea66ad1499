//! A solution seen through the scene's sensor: L is known at every point, so an image is ⟨L, Wᵉ⟩ by
//! camera rays alone.

use super::mesh::{Elements, VOID};
use super::smooth::Smooth;
use super::sources::{emission, reflectance};
use super::{Rgb, Sources};
use crate::film::Film;
use crate::render::{RenderError, film_of};
use crate::scene::Scene;
use crate::spectrum::Spectrum;

/// How a solution is looked at.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Camera rays per pixel.
    pub passes: u64,
    /// Seed of the camera rays.
    pub seed: u64,
    /// Crop window instead of the scene's own.
    pub crop: Option<[u32; 4]>,
}

/// The film of `radiance`, one number per element, or interpolated. The sky is seen as it is.
pub fn view(
    scene: &Scene,
    mesh: &Elements,
    sources: &Sources,
    radiance: &[Rgb],
    smooth: Option<&Smooth>,
    how: &View,
) -> Result<Film, RenderError> {
    let hidden = scene.integrator.hide_emitters;
    let shown: Vec<Spectrum> = radiance
        .iter()
        .zip(&sources.emitted)
        .map(|(l, e)| std::array::from_fn(|c| l[c] - if hidden { e[c] } else { 0.0 }))
        .map(|[r, g, b]: Rgb| Spectrum::rgb(r as f32, g as f32, b as f32))
        .collect();
    film_of(scene, how.crop, how.passes, how.seed, |ray, hit| {
        let Some(hit) = hit else {
            let mut sky = Spectrum::BLACK;
            if !hidden {
                scene.lights.environment(ray.d, |_, l| sky += l);
            }
            return sky;
        };
        let surface = scene.geometry.surface(ray, hit);
        let front = surface.n_g.dot(ray.d) < 0.0;
        let (element, u) = mesh.locate(scene, hit, &surface, front);
        match (element, smooth) {
            (VOID, _) => Spectrum::BLACK,
            (i, None) => shown[i as usize],
            (i, Some(smooth)) => {
                let white = smooth.at(i as usize, u);
                let (rho, emitted) = (reflectance(scene, &surface, front), emission(scene, &surface, front));
                let [r, g, b]: [f32; 3] =
                    std::array::from_fn(|c| (if hidden { 0.0 } else { emitted[c] } + rho[c] * f64::from(white[c])) as f32);
                Spectrum::rgb(r, g, b)
            }
        }
    })
}
