//! The pyramid of techniques: what every join (s, t) adds to every path length, raw and weighted.
//!
//! The *weighted* images of all joins sum to the render; the *raw* one of a join is its own estimate of
//! the whole term, without the weights that make room for others, so that raw images of one length show
//! the same light, where the join can see it, with the noise of the join alone [Veach 1997, fig. 10.3].

use super::sheet::{Cell, stops};
use crate::film::Film;
use crate::render::layers::{Join, Layers, Partition};
use crate::transport::Technique;

/// A join of one length.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Entry {
    /// Edges of its paths; at least that many in the row that holds the rest.
    pub length: u32,
    /// The row holds longer paths too.
    pub and_longer: bool,
    /// Vertices made by shooting; absent in the row that holds the rest.
    pub s: Option<u32>,
    /// Vertices made by gathering.
    pub t: Option<u32>,
    /// `hit`, `nee`, `connect`, `splat`.
    pub technique: &'static str,
    /// What it adds to the image.
    pub weighted: Figures,
    /// Its own estimate of the whole term.
    pub raw: Figures,
    /// Share of the image's energy that it adds.
    pub share_of_energy: f64,
    /// Share of the sum of all joins' variances.
    pub share_of_error: f64,
}

/// One image in two numbers, over all pixels and channels.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Figures {
    /// Mean.
    pub mean: f64,
    /// Mean variance of a pixel's mean; none before the second pass.
    pub variance: Option<f64>,
}

impl Figures {
    fn of(film: &Film) -> Self {
        let mean_of = |pixels: Vec<[f32; 3]>| {
            pixels.iter().flatten().map(|v| f64::from(*v)).sum::<f64>() / (3 * pixels.len()).max(1) as f64
        };
        let variance = (film.passes().count() > 1).then(|| mean_of(film.variance_of_mean()));
        Self { mean: mean_of(film.mean()), variance }
    }
}

/// One entry for each join of the layers, in their order; none where they are no joins.
pub fn table(layers: &Layers, whole: &Film) -> Vec<Entry> {
    let Partition::Joins(joins) = &layers.partition else { return Vec::new() };
    let energy = Figures::of(whole).mean;
    let mut entries: Vec<Entry> =
        joins.list().iter().zip(layers.films.chunks_exact(2)).map(|(j, f)| entry(j, f, energy)).collect();
    let error: f64 = entries.iter().filter_map(|e| e.weighted.variance).sum();
    for e in &mut entries {
        e.share_of_error = ratio(e.weighted.variance.unwrap_or(0.0), error);
    }
    entries
}

fn entry(join: &Join, films: &[Film], energy: f64) -> Entry {
    let [weighted, raw] = [Figures::of(&films[0]), Figures::of(&films[1])];
    Entry {
        length: join.length,
        and_longer: join.light_vertices.is_none(),
        s: join.light_vertices,
        t: join.light_vertices.map(|s| join.length + 1 - s + u32::from(join.technique == Technique::Merge)),
        technique: join.technique.name(),
        weighted,
        raw,
        share_of_energy: ratio(weighted.mean, energy),
        share_of_error: 0.0,
    }
}

fn ratio(a: f64, b: f64) -> f64 {
    if b > 0.0 { a / b } else { 0.0 }
}

/// The weighted (or raw) images in rows of one length, by s; all of a row brightened alike.
pub fn rows(layers: &Layers, entries: &[Entry], raw: bool, exposure: f32) -> Vec<Vec<Cell>> {
    let mut rows: Vec<Vec<(String, Vec<[f32; 3]>)>> = Vec::new();
    let mut last = None;
    for (e, films) in entries.iter().zip(layers.films.chunks_exact(2)) {
        if last.replace((e.length, e.and_longer)) != Some((e.length, e.and_longer)) {
            rows.push(Vec::new());
        }
        let place = e.s.map_or(format!("k>={}", e.length), |s| format!("k={} s={s}", e.length));
        let share = if raw { String::new() } else { format!(" {:.1}%", 100.0 * e.share_of_energy) };
        if let Some(row) = rows.last_mut() {
            row.push((format!("{place} {}{share}", e.technique), films[usize::from(raw)].mean()));
        }
    }
    rows.into_iter()
        .map(|row| {
            let stops = row.iter().filter_map(|(_, pixels)| stops(pixels, exposure)).min().unwrap_or(0);
            row.into_iter().map(|(label, pixels)| Cell { label, pixels, stops }).collect()
        })
        .collect()
}
