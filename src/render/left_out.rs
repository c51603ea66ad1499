//! What an estimator that follows only part of the coupling leaves out, as an image of its own.
//!
//! The full solution is a sum over all paths, recursive ray tracing one over E S* D? L up to its longest
//! path, local illumination one over all paths of at most two edges. What is left is a sum over the rest, which the
//! bidirectional estimator renders by itself: no difference of two noisy images.

use super::{Budget, Control, Options, Picture, Progress, Render, RenderError};
use crate::scene::Scene;
use crate::transport::class::PathFilter;
use crate::transport::settings::{Coupling, Settings, Techniques};

/// Image of the paths up to the scene's own limit that a render with `options` leaves out.
pub fn left_out(
    scene: &Scene,
    options: &Options,
    passes: u64,
    mut progress: impl FnMut(&Progress) -> Control + Send,
) -> Result<Picture, RenderError> {
    let longest = scene.integrator.max_depth.unwrap_or(u32::MAX);
    let followed = options.settings.longest();
    let full = Settings {
        techniques: Techniques::BIDIRECTIONAL,
        coupling: Coupling::All,
        max_length: longest,
        ..options.settings.clone()
    };
    let mut parts = Vec::new();
    let beyond = |n: u32| Settings { min_length: n.saturating_add(1).max(full.min_length), ..full.clone() };
    match options.settings.coupling {
        Coupling::All => {}
        Coupling::None { .. } => parts.push(beyond(followed)),
        Coupling::Specular => {
            parts.push(Settings { paths: class("E S* D .+ L"), ..full.clone() });
            parts.push(Settings { paths: class("E S* D? L"), ..beyond(followed) });
        }
    }
    let mut sum: Option<Picture> = None;
    for settings in parts.into_iter().filter(|s| s.min_length <= s.max_length) {
        let options = Options { settings, threads: options.threads, crop: options.crop, layers: Vec::new() };
        let mut render = Render::new(scene, &options)?;
        render.run(&Budget::passes(passes), &mut progress);
        let picture = render.picture();
        sum = Some(match sum {
            None => picture,
            Some(so_far) => added(so_far, &picture),
        });
    }
    match sum {
        Some(picture) => Ok(picture),
        // Nothing is left out.
        None => Ok(Render::new(scene, options)?.picture()),
    }
}

/// These expressions are ours, and are sound.
fn class(expression: &str) -> PathFilter {
    PathFilter::parse(expression).unwrap_or_default()
}

/// The sum of independent estimates.
fn added(mut a: Picture, b: &Picture) -> Picture {
    let each = |a: &mut Vec<[f32; 3]>, b: &[[f32; 3]]| a.iter_mut().zip(b).for_each(|(a, b)| (0..3).for_each(|c| a[c] += b[c]));
    each(&mut a.mean, &b.mean);
    each(&mut a.variance, &b.variance);
    a
}
