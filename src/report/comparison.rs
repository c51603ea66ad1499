//! All measures of a pair of images at once, as text for people and as JSON for programs.

use super::Picture;
use super::flip::{Range, flip};
use super::measures::{Distances, distances};
use super::welch::{Welch, welch};
use std::fmt::Write;

/// How an image differs from a reference.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Comparison {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// RMSE, relMSE and ratios of means.
    #[serde(flatten)]
    pub distances: Distances,
    /// Mean LDR-FLIP error of the images clipped to [0, 1].
    pub flip: f64,
    /// Mean HDR-FLIP error.
    pub flip_hdr: f64,
    /// Pixels that are not finite: image, reference. They are left out of the distances.
    pub not_finite: [usize; 2],
    /// Welch's test; absent where an image carries no variance.
    pub welch: Option<Welch>,
}

/// Why there is nothing to compare.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the images differ in size: {} × {} and {} × {}", .0[0], .0[1], .1[0], .1[1])]
pub struct SizeMismatch(pub [u32; 2], pub [u32; 2]);

/// A number by which a comparison is judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum Metric {
    /// Root mean squared error.
    Rmse,
    /// Relative mean squared error.
    #[default]
    Relmse,
    /// Relative mean squared error without the worst 0.1 % of pixels.
    Trimmed,
    /// Mean LDR-FLIP error.
    Flip,
    /// Mean HDR-FLIP error.
    FlipHdr,
    /// Welch's test: "beyond" means a probability smaller than the tolerance.
    Welch,
}

/// Compares `image` with `reference`.
pub fn compare(image: &Picture, reference: &Picture) -> Result<Comparison, SizeMismatch> {
    let sizes = [image, reference].map(|p| [p.width, p.height]);
    if sizes[0] != sizes[1] || image.mean.len() != reference.mean.len() {
        return Err(SizeMismatch(sizes[0], sizes[1]));
    }
    let mean_flip = |range| {
        let map = flip(&image.mean, &reference.mean, image.width as usize, range);
        map.iter().map(|e| f64::from(*e)).sum::<f64>() / map.len().max(1) as f64
    };
    let not_finite = |p: &Picture| p.mean.iter().filter(|c| c.iter().any(|v| !v.is_finite())).count();
    Ok(Comparison {
        width: image.width,
        height: image.height,
        distances: distances(&image.mean, &reference.mean),
        flip: mean_flip(Range::Ldr),
        flip_hdr: mean_flip(Range::Hdr),
        not_finite: [not_finite(image), not_finite(reference)],
        welch: welch(image, reference),
    })
}

impl Comparison {
    /// Within the tolerance: no pixel that is not finite, and the metric not beyond `tolerance`.
    /// `None` where the metric is Welch's test and there is none.
    pub fn within(&self, metric: Metric, tolerance: f64) -> Option<bool> {
        let d = &self.distances;
        let small = |v: f64| Some(v <= tolerance);
        let ok = match metric {
            Metric::Rmse => small(d.rmse),
            Metric::Relmse => small(d.relmse),
            Metric::Trimmed => small(d.relmse_trimmed),
            Metric::Flip => small(self.flip),
            Metric::FlipHdr => small(self.flip_hdr),
            Metric::Welch => self.welch.as_ref().map(|w| w.p >= tolerance),
        };
        ok.map(|ok| ok && self.not_finite == [0, 0])
    }

    /// For people: one measure per line.
    pub fn to_text(&self) -> String {
        let d = &self.distances;
        let mut out = String::new();
        let _ = writeln!(out, "RMSE            {:.6e}", d.rmse);
        let _ = writeln!(out, "relMSE          {:.6e}", d.relmse);
        let _ = writeln!(out, "relMSE trimmed  {:.6e}  (without the worst 0.1 % of pixels)", d.relmse_trimmed);
        let [r, g, b] = d.mean_ratio;
        let _ = writeln!(out, "mean ratio      {r:.6} {g:.6} {b:.6}");
        let _ = writeln!(out, "FLIP            {:.6}  (HDR {:.6})", self.flip, self.flip_hdr);
        match &self.welch {
            Some(w) => {
                let channel = ["red", "green", "blue"][w.channel];
                let _ = writeln!(
                    out,
                    "Welch           p = {:.3e} over {} pools of 16 × 16 blocks; largest |t| = {:.2} at ({}, {}) in {channel}; {:.1} % of the energy tested",
                    w.p,
                    w.pools,
                    w.largest_t,
                    w.at[0],
                    w.at[1],
                    100.0 * w.energy_tested
                );
            }
            None => out.push_str("Welch           not made: both images must carry variance and a number of samples\n"),
        }
        if self.not_finite != [0, 0] {
            let _ = writeln!(out, "not finite      {} and {} pixels, left out", self.not_finite[0], self.not_finite[1]);
        }
        out
    }

    /// For programs. Numbers that JSON cannot hold become `null`.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(v: f32) -> Picture {
        Picture { width: 4, height: 3, mean: vec![[v; 3]; 12], ..Picture::default() }
    }

    #[test]
    fn judged_by_tolerance() {
        let c = compare(&grey(1.1), &grey(1.0)).unwrap();
        assert_eq!(c.within(Metric::Rmse, 0.11), Some(true));
        assert_eq!(c.within(Metric::Rmse, 0.09), Some(false));
        assert_eq!(c.within(Metric::Welch, 0.01), None);
        let mut broken = grey(1.0);
        broken.mean[3][1] = f32::NAN;
        assert_eq!(compare(&broken, &grey(1.0)).unwrap().within(Metric::Rmse, 1.0), Some(false));
        assert!(compare(&grey(1.0), &Picture { width: 3, height: 4, ..grey(1.0) }).is_err());
    }

    #[test]
    fn json_is_json() {
        let c = compare(&grey(0.0), &grey(0.0)).unwrap();
        let v: serde_json::Value = serde_json::from_str(&c.to_json()).unwrap();
        assert_eq!(v["relmse"], 0.0);
        assert!(v["mean_ratio"][0].is_null() && v["welch"].is_null());
        assert!(c.to_text().contains("relMSE"));
    }
}
