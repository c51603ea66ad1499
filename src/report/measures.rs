//! Distances of an image `x` from a reference `R`: `RMSE = √mean (x − R)²`,
//! `relMSE = mean (x − R)² / (R² + 0.01 mean(R)²)`, means over pixels and channels.
//!
//! Trimmed relMSE leaves out the worst 0.1 % of pixels: a few fireflies decide the plain one, and
//! both together tell noise from fireflies.

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

/// Distances of `image` from `reference`, over pixels that are finite in both; the slices are of
/// equal length.
pub fn distances(image: &[[f32; 3]], reference: &[[f32; 3]]) -> Distances {
    let pairs: Vec<_> = image
        .iter()
        .zip(reference)
        .map(|(x, r)| (x.map(f64::from), r.map(f64::from)))
        .filter(|(x, r)| x.iter().chain(r).all(|v| v.is_finite()))
        .collect();
    let n = pairs.len().max(1) as f64;
    let mut means = [[0.0; 2]; 3];
    for (x, r) in &pairs {
        for (m, (x, r)) in means.iter_mut().zip(x.iter().zip(r)) {
            *m = [m[0] + x / n, m[1] + r / n];
        }
    }
    let all = means.iter().map(|m| m[1]).sum::<f64>() / 3.0;
    let floor = 0.01 * all * all;
    let mut square = 0.0;
    let mut relative: Vec<f64> = pairs
        .iter()
        .map(|(x, r)| {
            let mut sum = 0.0;
            for (x, r) in x.iter().zip(r) {
                let d2 = (x - r) * (x - r);
                square += d2;
                // Equal numbers have no error even where the reference is black everywhere.
                sum += if d2 > 0.0 { d2 / (r * r + floor) } else { 0.0 };
            }
            sum / 3.0
        })
        .collect();
    relative.sort_unstable_by(f64::total_cmp);
    let kept = relative.len() - (relative.len() as f64 * TRIM) as usize;
    Distances {
        rmse: (square / (3.0 * n)).sqrt(),
        relmse: relative.iter().sum::<f64>() / n,
        relmse_trimmed: relative[..kept].iter().sum::<f64>() / kept.max(1) as f64,
        mean_ratio: means.map(|m| m[0] / m[1]),
    }
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

    #[test]
    fn equal_images_have_no_distance() {
        let black = vec![[0.0; 3]; 10];
        let d = distances(&black, &black);
        assert_eq!((d.rmse, d.relmse, d.relmse_trimmed), (0.0, 0.0, 0.0));
        assert_eq!(distances(&[[f32::NAN; 3]], &[[1.0; 3]]).rmse, 0.0);
    }
}
