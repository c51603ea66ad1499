//! The report as one HTML file that needs nothing else: figures as JSON, images as compressed halves, a
//! script that draws both.
//!
//! Pixels are stored as numbers, not as a picture, so that exposure and differences are real: three half
//! floats each, G against its left neighbour and R and B against G, high and low bytes apart, deflated, in
//! base64. Where all of them together would be too much for a page, they are averaged to half the size.

use super::figures::Report;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use half::f16;
use std::fmt::Write as _;
use std::io::Write as _;

const HTML: &str = include_str!("page.html");
const STYLE: &str = include_str!("style.css");
const SCRIPTS: [&str; 5] = [
    include_str!("data.js"),
    include_str!("tables.js"),
    include_str!("plot.js"),
    include_str!("viewer.js"),
    include_str!("main.js"),
];

/// Bytes of all images of a page together, at most.
const MOST_BYTES: usize = 26_000_000;

/// An image for the viewer.
#[derive(Clone, Debug)]
pub struct PageImage {
    /// Number of the scene in the report.
    pub scene: usize,
    /// Who made it.
    pub name: String,
    /// Pixels per row.
    pub width: u32,
    /// Linear sRGB, rows from the top.
    pub pixels: Vec<[f32; 3]>,
}

/// The page.
pub fn html(report: &Report, images: &[PageImage]) -> String {
    let json = serde_json::to_string(report).unwrap_or_default().replace('<', "\\u003c");
    let parts = [
        ("<!--STYLE-->", format!("<style>\n{STYLE}</style>")),
        ("<!--DATA-->", format!("<script type=\"application/json\" id=\"report\">{json}</script>\n{}", scripts(images))),
        ("<!--SCRIPT-->", format!("<script>\n\"use strict\";\n{}</script>", SCRIPTS.concat())),
    ];
    parts.iter().fold(HTML.to_owned(), |html, (place, text)| html.replacen(place, text, 1))
}

/// All images as elements that the browser leaves alone.
fn scripts(images: &[PageImage]) -> String {
    let mut images = images.to_vec();
    loop {
        let mut out = String::new();
        for image in &images {
            let height = image.pixels.len() / image.width.max(1) as usize;
            let PageImage { scene, name, width, .. } = image;
            let name = name.replace('&', "&amp;").replace('"', "&quot;").replace('<', "&lt;");
            let text = STANDARD.encode(compressed(&image.pixels, *width as usize));
            let _ = writeln!(
                out,
                "<script type=\"text/plain\" class=\"pixels\" data-scene=\"{scene}\" data-name=\"{name}\" data-width=\"{width}\" data-height=\"{height}\">{text}</script>"
            );
        }
        if out.len() <= MOST_BYTES || images.iter().all(|i| i.width < 2) {
            return out;
        }
        images = images.iter().map(halved).collect();
    }
}

/// Means of 2 × 2 pixels.
fn halved(image: &PageImage) -> PageImage {
    let (w, h) = (image.width as usize, image.pixels.len() / image.width.max(1) as usize);
    let (columns, rows) = (w.div_ceil(2), h.div_ceil(2));
    let pixel = |x: usize, y: usize| {
        let at = |dx: usize, dy: usize| image.pixels[(2 * y + dy).min(h - 1) * w + (2 * x + dx).min(w - 1)];
        let four = [at(0, 0), at(1, 0), at(0, 1), at(1, 1)];
        std::array::from_fn(|c| four.iter().map(|p| p[c]).sum::<f32>() / 4.0)
    };
    let pixels = (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y))).map(|(x, y)| pixel(x, y)).collect();
    PageImage { width: columns as u32, pixels, ..image.clone() }
}

/// Halves of an image as deflated bytes; `data.js` has the inverse.
fn compressed(pixels: &[[f32; 3]], width: usize) -> Vec<u8> {
    // Beyond the largest half there is only infinity, which is no radiance.
    let half = |v: f32| f16::from_f32(v.clamp(-65504.0, 65504.0)).to_bits();
    let mut planes: [Vec<u16>; 3] = Default::default();
    let mut left = 0u16;
    for (i, p) in pixels.iter().enumerate() {
        let [r, g, b] = p.map(half);
        if i % width.max(1) == 0 {
            left = 0;
        }
        planes[0].push(g.wrapping_sub(left));
        planes[1].push(r.wrapping_sub(g));
        planes[2].push(b.wrapping_sub(g));
        left = g;
    }
    let mut out = ZlibEncoder::new(Vec::new(), Compression::new(9));
    let bytes: Vec<u8> = planes.iter().flat_map(|p| p.iter().map(|v| (v >> 8) as u8).chain(p.iter().map(|v| *v as u8))).collect();
    // Writing to memory does not fail.
    let _ = out.write_all(&bytes);
    out.finish().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    #[test]
    fn pixels_come_back_as_halves() {
        let pixels: Vec<[f32; 3]> = (0..35).map(|i| [i as f32 * 0.37, 1e-3 * i as f32, 7e4 * (i % 2) as f32]).collect();
        let mut bytes = Vec::new();
        flate2::read::ZlibDecoder::new(compressed(&pixels, 7).as_slice()).read_to_end(&mut bytes).unwrap();
        let n = pixels.len();
        let plane = |k: usize, i: usize| u16::from(bytes[2 * k * n + i]) << 8 | u16::from(bytes[(2 * k + 1) * n + i]);
        let mut left = 0;
        for (i, p) in pixels.iter().enumerate() {
            let g = plane(0, i).wrapping_add(if i % 7 == 0 { 0 } else { left });
            let found = [plane(1, i).wrapping_add(g), g, plane(2, i).wrapping_add(g)].map(|b| f16::from_bits(b).to_f32());
            left = g;
            for (f, p) in found.iter().zip(p) {
                assert!((f - p.min(65504.0)).abs() <= p.abs() / 2048.0 + 1e-7, "{found:?} {p:?}");
            }
        }
    }

    #[test]
    fn a_page_is_one_file_and_keeps_its_text_apart() {
        let report = Report { command: "</script><b>&".into(), ..Report::default() };
        let image = PageImage { scene: 0, name: "a\"<b>".into(), width: 3, pixels: vec![[1.0; 3]; 6] };
        let page = html(&report, std::slice::from_ref(&image));
        assert!(!page.contains("</script><b>") && page.contains("a&quot;&lt;b>") && page.contains("data-height=\"2\""));
        assert!(!page.contains("<!--") && !page.contains("src=") && !page.contains("@import"));
        let half = halved(&image);
        assert_eq!((half.width, half.pixels.len()), (2, 2));
    }
}
