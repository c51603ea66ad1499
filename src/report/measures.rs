//! Distances of an image `x` from a reference `R`: `RMSE = √mean (x − R)²`,
//! `relMSE = mean (x − R)² / (R² + 0.01 mean(R)²)`, means over pixels and channels.
//!
//! Trimmed relMSE leaves out the worst 0.1 % of pixels: a few fireflies decide the plain one, and
//! both together tell noise from fireflies.
//!
//! A reference with variance `v` adds `mean v` to the squared RMSE and `mean v / (R² + …)` to relMSE, whatever
//! the image: [`Noise`], to be subtracted from them.

/// Share of pixels that the trimmed measure leaves out.
pub const TRIM: f64 = 1e-3;

/// Distances between two images.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Distances {
    /// Root of the mean squared difference.
    pub rmse: f64,
    /// Mean of the squared difference relative to the reference.
    pub relmse: f64,
    /// The same without the worst 0.1 % of pixels.
    pub relmse_trimmed: f64,
    /// Mean of the image over mean of the reference, per channel; `null` in JSON where undefined.
    pub mean_ratio: [f64; 3],
}

/// What the variance of the reference is expected to add.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Noise {
    /// To the mean squared error (the square of RMSE).
    pub mse: f64,
    /// To relMSE.
    pub relmse: f64,
    /// To relMSE trimmed: of the pixels that it keeps.
    pub relmse_trimmed: f64,
}

/// An error without what the reference added; `None` where it is mostly that.
pub fn own(error: f64, noise: f64) -> Option<f64> {
    (error > 2.0 * noise).then_some(error - noise)
}

/// Distances of `image` from `reference`, over pixels that are finite in both; the slices are of
/// equal length.
pub fn distances(image: &[[f32; 3]], reference: &[[f32; 3]]) -> Distances {
    distances_and_noise(image, reference, None).0
}

/// The same, and how much of it is the variance of the reference (none where that is not given).
pub fn distances_and_noise(image: &[[f32; 3]], reference: &[[f32; 3]], variance: Option<&[[f32; 3]]>) -> (Distances, Noise) {
    let variance_at = |i: usize| variance.map_or([0.0; 3], |v| v[i].map(|v| f64::from(v.max(0.0))));
    let pairs: Vec<_> = image
        .iter()
        .zip(reference)
        .enumerate()
        .map(|(i, (x, r))| (x.map(f64::from), r.map(f64::from), variance_at(i)))
        .filter(|(x, r, v)| x.iter().chain(r).chain(v).all(|v| v.is_finite()))
        .collect();
    let n = pairs.len().max(1) as f64;
    let mut means = [[0.0; 2]; 3];
    for (x, r, _) in &pairs {
        for (m, (x, r)) in means.iter_mut().zip(x.iter().zip(r)) {
            *m = [m[0] + x / n, m[1] + r / n];
        }
    }
    let all = means.iter().map(|m| m[1]).sum::<f64>() / 3.0;
    let floor = 0.01 * all * all;
    let (mut square, mut noise) = (0.0, Noise::default());
    // Error and expected noise of each pixel, relative.
    let mut relative: Vec<[f64; 2]> = pairs
        .iter()
        .map(|(x, r, v)| {
            let mut sums = [0.0; 2];
            for ((x, r), v) in x.iter().zip(r).zip(v) {
                let d2 = (x - r) * (x - r);
                square += d2;
                noise.mse += v / (3.0 * n);
                // Equal numbers have no error even where the reference is black everywhere.
                let relative = |d2: f64| if d2 > 0.0 { d2 / (r * r + floor) } else { 0.0 };
                sums = [sums[0] + relative(d2), sums[1] + relative(*v)];
            }
            sums.map(|s| s / 3.0)
        })
        .collect();
    relative.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
    let kept = relative.len() - (relative.len() as f64 * TRIM) as usize;
    let sum = |pixels: &[[f64; 2]], k: usize| pixels.iter().map(|p| p[k]).sum::<f64>();
    let trimmed = |k: usize| sum(&relative[..kept], k) / kept.max(1) as f64;
    noise.relmse = sum(&relative, 1) / n;
    noise.relmse_trimmed = trimmed(1);
    let distances = Distances {
        rmse: (square / (3.0 * n)).sqrt(),
        relmse: sum(&relative, 0) / n,
        relmse_trimmed: trimmed(0),
        mean_ratio: means.map(|m| m[0] / m[1]),
    };
    (distances, noise)
}

/// Mean over pixels and channels of a variance relative to the reference, as relMSE has it; over numbers
/// that are finite.
pub fn relative_variance(variance: &[[f32; 3]], reference: &[[f32; 3]]) -> f64 {
    let all: Vec<_> = reference.iter().flatten().map(|r| f64::from(*r)).collect();
    let mean = all.iter().filter(|r| r.is_finite()).sum::<f64>() / all.len().max(1) as f64;
    let floor = 0.01 * mean * mean;
    let each = variance.iter().flatten().zip(all).filter(|(v, r)| v.is_finite() && r.is_finite());
    let sum = |(s, n): (f64, u64), (v, r): (&f32, f64)| (s + f64::from(*v) / (r * r + floor).max(f64::MIN_POSITIVE), n + 1);
    let (sum, n) = each.fold((0.0, 0), sum);
    sum / n.max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_known_pair() {
        let reference = vec![[1.0; 3]; 2000];
        let mut image = vec![[1.1, 1.0, 1.0]; 2000];
        image[7] = [101.0, 1.0, 1.0];
        let d = distances(&image, &reference);
        let ordinary = 0.01 / 1.01 / 3.0;
        let firefly = 1e4 / 1.01 / 3.0;
        assert!((d.relmse - (1999.0 * ordinary + firefly) / 2000.0).abs() < 1e-7);
        assert!((d.relmse_trimmed - ordinary).abs() < 1e-7);
        assert!((d.rmse - ((1999.0 * 0.01 + 1e4) / 6000.0f64).sqrt()).abs() < 1e-6);
        assert!((d.mean_ratio[0] - (1.1 * 1999.0 + 101.0) / 2000.0).abs() < 1e-6 && d.mean_ratio[1] == 1.0);
    }

    /// An image without error is as far from a noisy reference as the noise says.
    #[test]
    fn the_noise_of_the_reference_is_expected() {
        let n = 4000;
        let value = |i: usize| 0.5 + (i % 7) as f32;
        let deviation = |i: usize| 0.02 * value(i) * if i.is_multiple_of(2) { 1.0 } else { -1.0 };
        let truth: Vec<_> = (0..n).map(|i| [value(i); 3]).collect();
        let reference: Vec<_> = (0..n).map(|i| [value(i) + deviation(i); 3]).collect();
        let variance: Vec<_> = (0..n).map(|i| [deviation(i).powi(2); 3]).collect();
        let (d, noise) = distances_and_noise(&truth, &reference, Some(&variance));
        assert!((d.rmse.powi(2) / noise.mse - 1.0).abs() < 1e-4, "{d:?} {noise:?}");
        assert!((d.relmse / noise.relmse - 1.0).abs() < 1e-4 && (d.relmse_trimmed / noise.relmse_trimmed - 1.0).abs() < 1e-4);
        assert!((relative_variance(&variance, &reference) / noise.relmse - 1.0).abs() < 1e-6);
        assert_eq!(distances_and_noise(&truth, &reference, None).1, Noise::default());
    }

    #[test]
    fn equal_images_have_no_distance() {
        let black = vec![[0.0; 3]; 10];
        let d = distances(&black, &black);
        assert_eq!((d.rmse, d.relmse, d.relmse_trimmed), (0.0, 0.0, 0.0));
        assert_eq!(distances(&[[f32::NAN; 3]], &[[1.0; 3]]).rmse, 0.0);
    }
}
