//! FLIP: what an eye sees when two images are flipped in place, `ΔE = ΔE_c^(1 − ΔE_f)` per pixel,
//! 0 (the same) to 1 [Andersson 2020].
//!
//! `ΔE_c` is the colour difference after the eye's contrast sensitivity has blurred both images,
//! `ΔE_f` the difference of edges and points. HDR-FLIP [Andersson 2021] takes the worst over a range
//! of exposures chosen from the reference, through the ACES curve; LDR-FLIP looks at the images as
//! shown, clipped to [0, 1]. All filters are separable or sums of two separable ones.

use rayon::prelude::*;

/// Pixels per degree of a 0.7 m wide screen of 3840 pixels seen from 0.7 m.
pub const PIXELS_PER_DEGREE: f32 = 67.020_645;

/// Which error map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Range {
    /// The images as shown without tone curve, clipped to [0, 1].
    Ldr,
    /// All exposures at which the reference shows something.
    Hdr,
}

/// FLIP error of every pixel. `image` and `reference` are linear sRGB, `width` pixels per row and of
/// equal length; numbers that are not finite count as black.
pub fn flip(image: &[[f32; 3]], reference: &[[f32; 3]], width: usize, range: Range) -> Vec<f32> {
    match range {
        Range::Ldr => ldr(image, reference, width, clipped),
        Range::Hdr => {
            let mut worst = vec![0f32; reference.len()];
            for exposure in exposures(reference) {
                let scale = exposure.exp2();
                let map = ldr(image, reference, width, |c| c.map(|v| aces(if v.is_finite() { v * scale } else { 0.0 })));
                worst.iter_mut().zip(map).for_each(|(w, e)| *w = w.max(e));
            }
            worst
        }
    }
}

fn ldr(image: &[[f32; 3]], reference: &[[f32; 3]], width: usize, shown: impl Fn([f32; 3]) -> [f32; 3] + Sync) -> Vec<f32> {
    let see = |picture: &[[f32; 3]]| {
        let opponent: Vec<_> = picture.par_iter().map(|c| to_opponent(to_xyz(shown(*c)))).collect();
        (perceived(&opponent, width), features(&opponent, width))
    };
    let ((image, image_features), (reference, reference_features)) = (see(image), see(reference));
    let colours = image.par_iter().zip(&reference);
    let features = image_features.par_iter().zip(&reference_features);
    let largest = hyab(hunt(to_lab(to_xyz([0.0, 1.0, 0.0]))), hunt(to_lab(to_xyz([0.0, 0.0, 1.0])))).powf(COLOUR_POWER);
    colours
        .zip(features)
        .map(|((a, b), (fa, fb))| {
            let colour = compress(hyab(*a, *b).powf(COLOUR_POWER), largest);
            let feature = (fa[0] - fb[0]).abs().max((fa[1] - fb[1]).abs());
            let feature = (feature * std::f32::consts::FRAC_1_SQRT_2).sqrt().min(1.0);
            colour.powf(1.0 - feature)
        })
        .collect()
}

const COLOUR_POWER: f32 = 0.7;

/// Maps [0, largest] to [0, 1], most of it spent on the smaller differences [Andersson 2020, sect. 4.1.4].
fn compress(difference: f32, largest: f32) -> f32 {
    let knee = 0.4 * largest;
    if difference < knee { 0.95 / knee * difference } else { 0.95 + (difference - knee) / (largest - knee) * 0.05 }
}

fn clipped(c: [f32; 3]) -> [f32; 3] {
    c.map(|v| if v.is_finite() { v.clamp(0.0, 1.0) } else { 0.0 })
}

const ACES: [f32; 6] = [0.6 * 0.6 * 2.51, 0.6 * 0.03, 0.0, 0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14];

fn aces(x: f32) -> f32 {
    let x = x.max(0.0);
    let [a, b, c, d, e, f] = ACES;
    // Beyond this the curve is flat, and x² would overflow.
    let x = x.min(1e9);
    ((a * x * x + b * x + c) / (d * x * x + e * x + f)).clamp(0.0, 1.0)
}

/// Exposures (powers of two) from where the brightest pixel nearly saturates to where the median
/// does [Andersson 2021, sect. 3].
fn exposures(reference: &[[f32; 3]]) -> Vec<f32> {
    let finite = reference.iter().filter(|c| c.iter().all(|v| v.is_finite()));
    let mut luminances: Vec<_> = finite.map(|c| 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]).collect();
    luminances.sort_unstable_by(f32::total_cmp);
    let n = luminances.len();
    let brightest = luminances.last().copied().unwrap_or(0.0);
    if brightest <= 0.0 {
        return vec![0.0];
    }
    let median = luminances[n / 2].max(brightest * 1e-6);
    // Where the tone curve reaches 0.85: larger root of a quadratic.
    let [a, b, c, d, e, f] = ACES;
    let (qa, qb, qc) = (a - 0.85 * d, b - 0.85 * e, c - 0.85 * f);
    let knee = (-qb + (qb * qb - 4.0 * qa * qc).sqrt()) / (2.0 * qa);
    let (start, stop) = ((knee / brightest).log2(), (knee / median).log2());
    let count = ((stop - start).ceil() as usize).max(2);
    (0..count).map(|i| start + (stop - start) * i as f32 / (count - 1) as f32).collect()
}

const WHITE: [f32; 3] = [0.950_428_55, 1.0, 1.088_900_4];

fn to_xyz([r, g, b]: [f32; 3]) -> [f32; 3] {
    [
        0.412_386_56 * r + 0.357_591_49 * g + 0.180_450_49 * b,
        0.212_636_82 * r + 0.715_182_98 * g + 0.072_180_2 * b,
        0.019_330_62 * r + 0.119_197_17 * g + 0.950_372_6 * b,
    ]
}

fn from_xyz([x, y, z]: [f32; 3]) -> [f32; 3] {
    [
        3.241_003_3 * x - 1.537_398_9 * y - 0.498_615_9 * z,
        -0.969_224_3 * x + 1.875_930_1 * y + 0.041_554_226 * z,
        0.055_639_42 * x - 0.204_011_21 * y + 1.057_149 * z,
    ]
}

/// YCxCz: like Lab without the cube root, so that blurring is linear in light.
fn to_opponent(xyz: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = std::array::from_fn(|i| xyz[i] / WHITE[i]);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn from_opponent([y, cx, cz]: [f32; 3]) -> [f32; 3] {
    let y = (y + 16.0) / 116.0;
    [(y + cx / 500.0) * WHITE[0], y * WHITE[1], (y - cz / 200.0) * WHITE[2]]
}

fn to_lab(xyz: [f32; 3]) -> [f32; 3] {
    const DELTA: f32 = 6.0 / 29.0;
    let [x, y, z] = std::array::from_fn(|i| {
        let t = xyz[i] / WHITE[i];
        if t > DELTA * DELTA * DELTA { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    });
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// Colours look paler in the dark.
fn hunt([l, a, b]: [f32; 3]) -> [f32; 3] {
    [l, 0.01 * l * a, 0.01 * l * b]
}

/// City block in lightness, Euclid in colour.
fn hyab(p: [f32; 3], q: [f32; 3]) -> f32 {
    (p[0] - q[0]).abs() + (p[1] - q[1]).hypot(p[2] - q[2])
}

/// Blurs by the contrast sensitivity of each channel and goes to Lab with the Hunt effect.
fn perceived(opponent: &[[f32; 3]], width: usize) -> Vec<[f32; 3]> {
    // (a1, b1, a2, b2) of achromatic, red–green, blue–yellow [Andersson 2020, table 1].
    const SENSITIVITY: [[f32; 4]; 3] = [[1.0, 0.0047, 0.0, 1e-5], [1.0, 0.0053, 0.0, 1e-5], [34.1, 0.04, 13.5, 0.025]];
    let pi = std::f32::consts::PI;
    let radius = (3.0 * (0.04 / (2.0 * pi * pi)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32;
    let blurred: [Vec<f32>; 3] = std::array::from_fn(|c| {
        let plane: Vec<f32> = opponent.iter().map(|p| p[c]).collect();
        let [a1, b1, a2, b2] = SENSITIVITY[c];
        let gaussian = |b: f32| -> Vec<f32> {
            (-radius..=radius).map(|i| (-(pi * i as f32 / PIXELS_PER_DEGREE).powi(2) / b).exp()).collect()
        };
        let (g1, g2) = (gaussian(b1), gaussian(b2));
        let (s1, s2) = (g1.iter().sum::<f32>(), g2.iter().sum::<f32>());
        let (m1, m2) = (a1 * (pi / b1).sqrt(), a2 * (pi / b2).sqrt());
        let total = m1 * s1 * s1 + m2 * s2 * s2;
        let mut out = convolve(&plane, width, &g1, &g1, m1 / total);
        if a2 != 0.0 {
            let second = convolve(&plane, width, &g2, &g2, m2 / total);
            out.iter_mut().zip(second).for_each(|(o, s)| *o += s);
        }
        out
    });
    let shown = |i: usize| clipped(from_xyz(from_opponent([blurred[0][i], blurred[1][i], blurred[2][i]])));
    (0..opponent.len()).into_par_iter().map(|i| hunt(to_lab(to_xyz(shown(i))))).collect()
}

/// Strength of edges and of points in the luminance of every pixel.
fn features(opponent: &[[f32; 3]], width: usize) -> Vec<[f32; 2]> {
    let luminance: Vec<f32> = opponent.iter().map(|p| (p[0] + 16.0) / 116.0).collect();
    let sigma = 0.5 * 0.082 * PIXELS_PER_DEGREE;
    let radius = (3.0 * sigma).ceil() as i32;
    let kernel = |f: &dyn Fn(f32, f32) -> f32| -> Vec<f32> {
        (-radius..=radius).map(|i| f(i as f32, (-((i * i) as f32) / (2.0 * sigma * sigma)).exp())).collect()
    };
    // Positive parts sum to 1, negative ones to −1, so that a constant gives nothing.
    let balanced = |mut k: Vec<f32>| {
        let positive: f32 = k.iter().filter(|v| **v > 0.0).sum();
        let negative: f32 = -k.iter().filter(|v| **v < 0.0).sum::<f32>();
        k.iter_mut().for_each(|v| *v /= if *v > 0.0 { positive } else { negative });
        k
    };
    let mut blur = kernel(&|_, g| g);
    let sum: f32 = blur.iter().sum();
    blur.iter_mut().for_each(|v| *v /= sum);
    let edge = balanced(kernel(&|x, g| -x * g));
    let point = balanced(kernel(&|x, g| (x * x / (sigma * sigma) - 1.0) * g));
    let [ex, ey] = [(&edge, &blur), (&blur, &edge)].map(|(h, v)| convolve(&luminance, width, h, v, 1.0));
    let [px, py] = [(&point, &blur), (&blur, &point)].map(|(h, v)| convolve(&luminance, width, h, v, 1.0));
    (0..luminance.len()).map(|i| [ex[i].hypot(ey[i]), px[i].hypot(py[i])]).collect()
}

/// `scale ·` plane convolved with a row and a column kernel; the border repeats outwards.
fn convolve(plane: &[f32], width: usize, row: &[f32], column: &[f32], scale: f32) -> Vec<f32> {
    let height = plane.len() / width.max(1);
    let radius = row.len() / 2;
    let mut rows = vec![0f32; plane.len()];
    rows.par_chunks_mut(width).zip(plane.par_chunks(width)).for_each(|(out, line)| {
        for (x, o) in out.iter_mut().enumerate() {
            let at = |i: usize| line[(x + i).saturating_sub(radius).min(width - 1)];
            *o = row.iter().enumerate().map(|(i, k)| k * at(i)).sum();
        }
    });
    let mut out = vec![0f32; plane.len()];
    out.par_chunks_mut(width).enumerate().for_each(|(y, line)| {
        for (i, k) in column.iter().enumerate() {
            let from = (y + i).saturating_sub(radius).min(height - 1) * width;
            for (o, r) in line.iter_mut().zip(&rows[from..from + width]) {
                *o += scale * k * r;
            }
        }
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    const W: u32 = 64;
    const H: u32 = 48;

    /// Encoded values of a pattern with gradients and steps, and of the same with a shifted block
    /// and inverted specks.
    fn pattern(changed: bool) -> Vec<[f32; 3]> {
        let value = |x: u32, y: u32, c: u32| {
            let mut v = (x * 4 + y * 2 * c + (x / 8 + y / 6) % 2 * 60) % 256;
            if changed && (20..44).contains(&x) && (10..30).contains(&y) {
                v = (v + 40 + c * 17) % 256;
            }
            if changed && (x * 31 + y * 17).is_multiple_of(53) {
                v = 255 - v;
            }
            v as f32 / 255.0
        };
        (0..H).flat_map(|y| (0..W).map(move |x| std::array::from_fn(|c| value(x, y, c as u32)))).collect()
    }

    fn mean(map: &[f32]) -> f64 {
        map.iter().map(|e| f64::from(*e)).sum::<f64>() / map.len() as f64
    }

    fn decode(c: [f32; 3]) -> [f32; 3] {
        c.map(|v| if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) })
    }

    /// Numbers of the authors' evaluator, version 1.7, on the same patterns.
    #[test]
    fn equal_to_the_authors_evaluator() {
        let decoded = |changed| pattern(changed).into_iter().map(decode).collect::<Vec<_>>();
        let map = flip(&decoded(true), &decoded(false), W as usize, Range::Ldr);
        assert!((mean(&map) - 0.245_424_9).abs() < 2e-5, "{}", mean(&map));
        for (x, y, e) in [(22, 12, 0.785_162_03), (60, 40, 0.069_457_74), (0, 0, 0.989_028_45), (30, 25, 0.972_832_7)] {
            let ours = map[y * W as usize + x];
            assert!((ours - e).abs() < 1e-4, "at ({x}, {y}): {ours} instead of {e}");
        }
        let map = flip(&pattern(true), &pattern(false), W as usize, Range::Ldr);
        assert!((mean(&map) - 0.221_787_5).abs() < 2e-5, "{}", mean(&map));
        let bright = |changed| pattern(changed).into_iter().map(|c| c.map(|v| v * v * 8.0)).collect::<Vec<_>>();
        let map = flip(&bright(true), &bright(false), W as usize, Range::Hdr);
        assert!((mean(&map) - 0.247_707_1).abs() < 2e-5, "{}", mean(&map));
    }

    #[test]
    fn exposures_of_the_authors_evaluator() {
        let e = exposures(&pattern(false).into_iter().map(|c| c.map(|v| v * v * 8.0)).collect::<Vec<_>>());
        assert_eq!(e.len(), 2);
        assert!((e[0] + 1.856_346_4).abs() < 1e-4 && (e[1] - 0.043_304_026).abs() < 1e-4, "{e:?}");
    }

    #[test]
    fn equal_images_and_odd_numbers() {
        let a = pattern(false);
        assert!(flip(&a, &a, W as usize, Range::Hdr).iter().all(|e| *e == 0.0));
        let odd = vec![[f32::NAN, f32::INFINITY, -1.0]; 12];
        assert!(flip(&odd, &[[0.0; 3]; 12], 4, Range::Hdr).iter().all(|e| *e == 0.0));
    }
}
