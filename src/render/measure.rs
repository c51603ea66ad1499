//! The single pixel measurement: one number Φ, estimated by each strategy with its standard error.

use super::{Budget, Control, Estimator, Options, Render, RenderError};
use crate::scene::Scene;
use crate::transport::settings::Techniques;

/// Light paths per sample of a single pixel, unless the settings say otherwise.
const LIGHT_PATHS: u32 = 1024;

/// An estimate of Φ, linear sRGB.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Measurement {
    /// Mean over samples.
    pub mean: [f32; 3],
    /// Standard error of the mean.
    pub standard_error: [f32; 3],
    /// Samples (camera samples, each with its share of light paths where something shoots).
    pub samples: u64,
}

/// The same Φ by each strategy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelMeasurement {
    /// `⟨L, Wᵉ⟩`.
    pub gather: Measurement,
    /// `⟨Lᵉ, W⟩`.
    pub shoot: Measurement,
    /// Both, weighted.
    pub bidirectional: Measurement,
    /// Both, with merges where mirrors and glass hide the light from every other join: consistent.
    pub merging: Measurement,
}

impl PixelMeasurement {
    /// Measures pixel (x, y) of the whole film with `samples` samples per strategy. What a walker
    /// cannot see is missing from its measurement, as it is from its image.
    pub fn new(scene: &Scene, options: &Options, (x, y): (u32, u32), samples: u64) -> Result<Self, RenderError> {
        let by = |t: Techniques| measure_by(scene, options, t, (x, y), samples);
        Ok(Self {
            gather: by(Techniques::GATHER)?,
            shoot: by(Techniques::SHOOT)?,
            bidirectional: by(Techniques::BIDIRECTIONAL)?,
            merging: by(Techniques::ALL)?,
        })
    }
}

/// Φ of pixel (x, y) by one estimator.
pub fn measure(
    scene: &Scene,
    options: &Options,
    estimator: Estimator,
    pixel: (u32, u32),
    samples: u64,
) -> Result<Measurement, RenderError> {
    measure_by(scene, options, estimator.techniques(), pixel, samples)
}

fn measure_by(
    scene: &Scene,
    options: &Options,
    techniques: Techniques,
    (x, y): (u32, u32),
    samples: u64,
) -> Result<Measurement, RenderError> {
    let (width, height) = (scene.film.width, scene.film.height);
    if x >= width || y >= height {
        return Err(RenderError::Pixel(x, y, width, height));
    }
    let mut options = options.clone();
    options.crop = Some([x, y, 1, 1]);
    options.settings.techniques = techniques;
    options.settings.light_paths.get_or_insert(LIGHT_PATHS);
    let mut render = Render::new(scene, &options)?;
    render.run(&Budget::passes(samples.max(2)), |_| Control::Continue);
    let picture = render.picture();
    Ok(Measurement {
        mean: picture.mean[0],
        standard_error: picture.variance[0].map(f32::sqrt),
        samples: render.statistics().passes,
    })
}
