//! Images by formula: wood grain, floor boards, linen, the nephroid's construction, a lattice, tiles, a sky.
//!
//! Grey 8-bit PNG with few levels, so that the files stay small; scenes colour them by blending two
//! models. The sky is a Radiance HDR image in physical units.

use glam::{DVec2, dvec2};
use image::codecs::{hdr::HdrEncoder, png::PngEncoder};
use image::{ExtendedColorType, ImageEncoder, Rgb};
use std::f64::consts::{PI, TAU};

/// Encodes `f(x, y)` in [0, 1], x and y the pixel's centre in [0, 1] from the upper left corner.
fn grey_png(width: u32, height: u32, levels: f64, f: impl Fn(f64, f64) -> f64) -> Vec<u8> {
    let mut pixels = Vec::new();
    for j in 0..height {
        for i in 0..width {
            let (x, y) = ((f64::from(i) + 0.5) / f64::from(width), (f64::from(j) + 0.5) / f64::from(height));
            let step = (f(x, y).clamp(0.0, 1.0) * levels).round();
            pixels.push((step * 255.0 / levels).round() as u8);
        }
    }
    let mut bytes = Vec::new();
    let encoded = PngEncoder::new(&mut bytes).write_image(&pixels, width, height, ExtendedColorType::L8);
    encoded.expect("writing to memory does not fail");
    bytes
}

/// A number in [0, 1) for a lattice point.
fn hash(x: i64, y: i64, seed: u64) -> f64 {
    let mut h = (x as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ (y as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F) ^ seed;
    h = (h ^ (h >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    h = (h ^ (h >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((h ^ (h >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

/// Smooth noise in [0, 1] on a lattice that repeats after `period` cells.
fn noise(p: DVec2, period: (i64, i64), seed: u64) -> f64 {
    let cell = p.floor();
    let t = (p - cell) * (p - cell) * (DVec2::splat(3.0) - (p - cell) * 2.0);
    let at = |dx: i64, dy: i64| hash((cell.x as i64 + dx).rem_euclid(period.0), (cell.y as i64 + dy).rem_euclid(period.1), seed);
    let low = at(0, 0) * (1.0 - t.x) + at(1, 0) * t.x;
    let high = at(0, 1) * (1.0 - t.x) + at(1, 1) * t.x;
    low * (1.0 - t.y) + high * t.y
}

/// Grain along x: rings distorted by slow noise, with pores.
fn grain(x: f64, y: f64, seed: u64) -> f64 {
    let slow = noise(dvec2(2.0 * x, 6.0 * y), (2, 6), seed) + 0.5 * noise(dvec2(4.0 * x, 16.0 * y), (4, 16), seed + 1);
    let rings = 0.5 + 0.5 * (TAU * (14.0 * y + 3.0 * slow)).sin();
    let fibre = noise(dvec2(8.0 * x, 150.0 * y), (8, 150), seed + 2);
    let pores = (noise(dvec2(24.0 * x, 190.0 * y), (24, 190), seed + 3) - 0.72).max(0.0) * 2.0;
    0.30 + 0.36 * rings.powf(1.6) + 0.34 * fibre - pores
}

/// Seamless grain along x.
pub fn wood(width: u32, height: u32, seed: u64) -> Vec<u8> {
    grey_png(width, height, 24.0, |x, y| grain(x, y, seed))
}

/// Floor boards along x: six rows, staggered ends, dark joints.
pub fn boards(width: u32, height: u32) -> Vec<u8> {
    grey_png(width, height, 24.0, |x, y| {
        let row = (6.0 * y).floor();
        let shift = hash(row as i64, 7, 1);
        let along = (x + shift).fract();
        let plank = (2.0 * (x + shift)).floor() as i64 % 2;
        let tone = hash(row as i64, plank, 3);
        let joint_y = ((6.0 * y).fract() - 0.5).abs() > 0.484;
        let joint_x = ((2.0 * along).fract() - 0.5).abs() > 0.4965;
        if joint_y || joint_x { 0.02 } else { 0.25 + 0.35 * tone + 0.4 * grain(along, (y + tone).fract(), 11 + row as u64) }
    })
}

/// A plain weave, 16 × 16 threads.
pub fn linen(size: u32) -> Vec<u8> {
    grey_png(size, size, 20.0, |x, y| {
        let (u, v) = (16.0 * x, 16.0 * y);
        let over = (u.floor() as i64 + v.floor() as i64) % 2 == 0;
        let (across, along) = if over { (u.fract(), v.fract()) } else { (v.fract(), u.fract()) };
        let round = (PI * across).sin().sqrt() * (0.65 + 0.35 * (PI * along).sin());
        let thread = if over { hash(u.floor() as i64, 0, 21) } else { hash(v.floor() as i64, 1, 21) };
        0.2 + 0.6 * round + 0.2 * thread
    })
}

/// Distance from `p` to the segment `a`–`b`.
fn segment_distance(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
    p.distance(a + (b - a) * t)
}

/// The nephroid as the envelope of parallel rays reflected in a circle, drawn in ink: each ray
/// arrives along x, is reflected at angle a of the circle and leaves in the direction of angle 2a.
pub fn nephroid_drawing(size: u32) -> Vec<u8> {
    const RAYS: u32 = 56;
    const RADIUS: f64 = 0.86;
    let rays: Vec<[DVec2; 3]> = (0..RAYS)
        .map(|k| {
            let a = TAU * (f64::from(k) + 0.5) / f64::from(RAYS);
            let hit = DVec2::from_angle(a) * RADIUS;
            let start = dvec2(-hit.x.abs() * a.cos().signum(), hit.y);
            let back = -DVec2::from_angle(2.0 * a);
            // The chord leaves the circle again after 2 R |cos a|.
            let end = hit + back * (2.0 * RADIUS * a.cos().abs()) * a.cos().signum();
            [start, hit, end]
        })
        .collect();
    let pixel = 2.0 / f64::from(size);
    grey_png(size, size, 15.0, |x, y| {
        let p = dvec2(2.0 * x - 1.0, 1.0 - 2.0 * y);
        let stroke = |distance: f64, width: f64| ((width - distance) / pixel + 0.5).clamp(0.0, 1.0);
        let r = p.length();
        let mut ink = stroke((r - RADIUS).abs(), 0.007);
        ink = ink.max(stroke((r - 0.92).abs(), 0.004)).max(stroke((p.x.abs().max(p.y.abs()) - 0.975).abs(), 0.005));
        let tick = (p.to_angle() / TAU * 72.0).rem_euclid(1.0);
        if (RADIUS..0.92).contains(&r) && !(0.04..0.96).contains(&tick) {
            ink = ink.max(0.8);
        }
        if r < RADIUS {
            for [_, hit, end] in &rays {
                ink = ink.max(0.8 * stroke(segment_distance(p, *hit, *end), 0.0028));
            }
            ink = ink.max(stroke(nephroid_distance(p, RADIUS), 0.0085));
        }
        1.0 - ink
    })
}

/// Distance from `p` to the nephroid x = R/4 (3 cos t − cos 3t), y = R/4 (3 sin t − sin 3t), which
/// has its cusps on the x axis at ±R/2, by sampling its parameter.
fn nephroid_distance(p: DVec2, radius: f64) -> f64 {
    let at = |t: f64| dvec2(3.0 * t.cos() - (3.0 * t).cos(), 3.0 * t.sin() - (3.0 * t).sin()) * (radius / 4.0);
    let steps = 360;
    (0..steps)
        .map(|k| {
            let t = TAU * f64::from(k) / f64::from(steps);
            segment_distance(p, at(t), at(t + TAU / f64::from(steps)))
        })
        .fold(f64::INFINITY, f64::min)
}

/// Opacity of a carved screen: 1 = wood, 0 = open. Eight-pointed stars that touch with their tips
/// leave crosses between them; the wood follows their outline. 4 × 4 stars.
pub fn lattice(size: u32) -> Vec<u8> {
    // Half the side of the two squares that make a star, so that its tips reach the cell's edge.
    const HALF: f64 = 0.5 * std::f64::consts::FRAC_1_SQRT_2;
    grey_png(size, size, 15.0, |x, y| {
        let cell = dvec2((4.0 * x).fract() - 0.5, (4.0 * y).fract() - 0.5);
        let turned = dvec2(cell.x + cell.y, cell.x - cell.y) * std::f64::consts::FRAC_1_SQRT_2;
        let square = |p: DVec2| p.x.abs().max(p.y.abs()) - HALF;
        let outline = square(cell).min(square(turned)).abs() - 0.038;
        let frame = 0.5 - (x - 0.5).abs().max((y - 0.5).abs()) - 0.012;
        0.5 - outline.min(4.0 * frame) * f64::from(size) / 4.0
    })
}

/// Floor tiles, 4 × 4: pale octagons, dark squares set cornerwise, grout between.
pub fn tiles(size: u32) -> Vec<u8> {
    grey_png(size, size, 15.0, |x, y| {
        let cell = dvec2((4.0 * x).fract() - 0.5, (4.0 * y).fract() - 0.5).abs();
        let dot = 1.0 - cell.x - cell.y;
        let grout = (cell.max_element() > 0.487 && dot > 0.2) || (dot - 0.2).abs() < 0.014;
        if grout {
            0.35
        } else if dot < 0.2 {
            0.0
        } else {
            0.86 + 0.14 * hash((4.0 * x) as i64, (4.0 * y) as i64, 8)
        }
    })
}

/// Round holes, 8 × 4, for a mask.
pub fn dots(size: u32) -> Vec<u8> {
    grey_png(size, size, 15.0, |x, y| {
        let cell = dvec2((8.0 * x).fract() - 0.5, (4.0 * y).fract() - 0.5);
        0.5 + (cell.length() - 0.33) * f64::from(size) / 6.0
    })
}

/// A clear sky with a warm horizon over pale ground, latitude–longitude, zenith in the top row.
pub fn sky(width: u32, height: u32) -> Vec<u8> {
    let mut pixels = Vec::new();
    for j in 0..height {
        for i in 0..width {
            let elevation = PI * (0.5 - (f64::from(j) + 0.5) / f64::from(height));
            let azimuth = TAU * (f64::from(i) + 0.5) / f64::from(width);
            let up = elevation.sin();
            let haze = (-4.0 * up.max(0.0)).exp();
            let glow = (0.5 + 0.5 * azimuth.cos()).powi(3) * haze;
            let above = [0.16 + 0.55 * haze + 0.5 * glow, 0.32 + 0.45 * haze + 0.30 * glow, 0.75 + 0.15 * haze + 0.05 * glow];
            let rgb = if up >= 0.0 { above } else { [0.30, 0.26, 0.21] };
            pixels.push(Rgb(rgb.map(|c| c as f32)));
        }
    }
    let mut bytes = Vec::new();
    HdrEncoder::new(&mut bytes).encode(&pixels, width as usize, height as usize).expect("writing to memory does not fail");
    bytes
}
