//! What is written of a render beside its image: its layers, and sheets of them.

use super::args::{LayersArgs, RenderArgs};
use super::{Failure, output};
use crate::film::Film;
use crate::io::exr::ImageFile;
use crate::io::fault::{Fault, io_fault};
use crate::io::png::PngOptions;
use crate::io::write::{OutputFormat, check_writable, write_atomic, write_image};
use crate::render::layers::{Joins, LightGroups};
use crate::render::{Layers, Partition, Render};
use crate::report::pyramid;
use crate::report::sheet::{Cell, sheet};
use crate::scene::Scene;
use crate::transport::settings::Settings;
use std::io::Write;
use std::path::Path;

/// Last term of the Neumann series that a gallery shows apart where nobody says.
const LAST_TERM: u32 = 8;
/// Bytes per pixel of a layer on its way to a file.
const WRITE_BYTES: u64 = 36;

/// Refuses what could not be written at the end.
pub fn check(args: &RenderArgs) -> Result<(), Failure> {
    if let Some(path) = &args.layers.gallery {
        let format = OutputFormat::of(path).map_err(|f| Failure::usage(f.to_string()))?;
        if format != OutputFormat::Png {
            return Err(Failure::usage("--gallery makes a .png; --layers writes the terms into .exr outputs"));
        }
        check_writable(path).map_err(|f| Failure::output(f.to_string()))?;
    }
    if let Some(path) = &args.layers.left_out {
        OutputFormat::of(path).map_err(|f| Failure::usage(f.to_string()))?;
        check_writable(path).map_err(|f| Failure::output(f.to_string()))?;
    }
    if let Some(directory) = &args.layers.pyramid {
        let made = std::fs::create_dir_all(directory).map_err(|e| crate::io::fault::reason(&e));
        let made = made.and_then(|()| output::check_directory(&directory.join("pyramid.json")));
        made.map_err(|what| Failure::output(format!("cannot write into {}: {what}", directory.display())))?;
    }
    let to_exr = args.output.iter().any(|o| matches!(OutputFormat::of(o), Ok(OutputFormat::Exr)));
    let asked = [(args.layers.layers.is_some(), "--layers"), (args.layers.light_groups.is_some(), "--light-groups")];
    if let (Some((_, name)), false) = (asked.iter().find(|a| a.0), to_exr) {
        return Err(Failure::usage(format!("{name} writes into an .exr output: add one by -o")));
    }
    Ok(())
}

/// Whether anything is asked that only walks can give.
pub fn wanted(args: &LayersArgs) -> bool {
    args.layers.is_some()
        || args.gallery.is_some()
        || args.pyramid.is_some()
        || args.light_groups.is_some()
        || args.left_out.is_some()
}

/// How the render is to be taken apart.
pub fn partitions(args: &LayersArgs, settings: &Settings, scene: &Scene) -> Result<Vec<Partition>, Failure> {
    let mut partitions = Vec::new();
    if args.layers.is_some() || args.gallery.is_some() {
        let last = args.layers.flatten().unwrap_or(LAST_TERM);
        let longest = settings.longest().max(1) - 1;
        partitions.push(Partition::Scatterings { last: last.min(longest), rest: longest > last });
    }
    if args.pyramid.is_some() {
        partitions.push(Partition::Joins(Joins::new(settings.techniques, args.pyramid_length, settings.longest())));
    }
    if let Some(groups) = &args.light_groups {
        let emitters = scene.lights.infos();
        let groups = groups.as_deref().map_or_else(|| LightGroups::each(emitters), |text| LightGroups::parse(text, emitters));
        partitions.push(Partition::Lights(groups.map_err(|e| Failure::usage(format!("--light-groups: {e}")))?));
    }
    Ok(partitions)
}

/// Refuses what has no room beside a render that needs `whole` bytes.
pub fn check_memory(partitions: &[Partition], whole: u64, size: [u32; 2], limit: Option<u64>) -> Result<(), Failure> {
    let pixels = u64::from(size[0]) * u64::from(size[1]);
    let of = |p: &Partition| Layers::bytes(p, size[0], size[1]).saturating_add(pixels * WRITE_BYTES * p.parts() as u64);
    let needed = partitions.iter().map(of).fold(whole, u64::saturating_add);
    output::check_memory(needed, limit, size)
}

/// Layers that go into image files, by name.
pub fn of_image(args: &LayersArgs, render: &Render<'_>) -> Vec<(String, Vec<[f32; 3]>)> {
    let wanted = |l: &&Layers| match l.partition {
        Partition::Scatterings { .. } => args.layers.is_some(),
        Partition::Joins(_) => false,
        Partition::Lights(_) => true,
    };
    let layers = render.layers().iter().filter(wanted);
    layers.flat_map(|l| l.films.iter().enumerate().map(|(i, f)| (l.partition.name(i), f.mean()))).collect()
}

/// Writes what is beside the image files; what failed, after all have been tried.
pub fn write(args: &RenderArgs, render: &Render<'_>) -> Vec<Fault> {
    let mut faults = Vec::new();
    for layers in render.layers() {
        match (&layers.partition, &args.layers.gallery, &args.layers.pyramid) {
            (Partition::Scatterings { .. }, Some(path), _) => {
                faults.extend(write_sheet(path, &gallery(layers, args.exposure), render.film(), args.exposure).err());
            }
            (Partition::Joins(joins), _, Some(directory)) => {
                faults.extend(write_pyramid(directory, joins, layers, render.film(), args.exposure));
            }
            _ => {}
        }
    }
    faults
}

fn write_sheet(path: &Path, rows: &[Vec<Cell>], film: &Film, exposure: f32) -> Result<(), Fault> {
    write_image(path, &sheet(rows, [film.width(), film.height()], exposure), PngOptions::default())
}

/// An image of every join, a table and two sheets.
fn write_pyramid(directory: &Path, joins: &Joins, layers: &Layers, whole: &Film, exposure: f32) -> Vec<Fault> {
    let mut faults = Vec::new();
    for (join, films) in joins.list().iter().zip(layers.films.chunks_exact(2)) {
        let mut file = ImageFile::new(whole.width(), whole.height());
        for (film, [mean, variance]) in films.iter().zip([["", "variance"], ["raw", "rawVariance"]]) {
            file.insert_rgb(mean, &film.mean());
            if film.passes().count() >= 2 {
                file.insert_rgb(variance, &film.variance_of_mean());
            }
        }
        faults.extend(write_image(&directory.join(join.name() + ".exr"), &file, PngOptions::default()).err());
    }
    let table = pyramid::table(layers, whole);
    for (name, raw) in [("weighted.png", false), ("raw.png", true)] {
        let rows = pyramid::rows(layers, &table, raw, exposure);
        faults.extend(write_sheet(&directory.join(name), &rows, whole, exposure).err());
    }
    let text = serde_json::to_string_pretty(&table).unwrap_or_default() + "\n";
    let written = write_atomic(&directory.join("pyramid.json"), |out| out.write_all(text.as_bytes()).map_err(io_fault));
    faults.extend(written.err());
    faults
}

/// Terms above, partial sums below.
fn gallery(layers: &Layers, exposure: f32) -> Vec<Vec<Cell>> {
    let Partition::Scatterings { last, rest } = layers.partition else { return Vec::new() };
    let (mut terms, mut sums) = (Vec::new(), Vec::new());
    let mut sum: Vec<[f64; 3]> = Vec::new();
    for (n, film) in layers.films.iter().enumerate() {
        let term = film.mean();
        sum.resize(term.len(), [0.0; 3]);
        sum.iter_mut().zip(&term).for_each(|(s, t)| (0..3).for_each(|c| s[c] += f64::from(t[c])));
        let beyond = rest && n == last as usize;
        terms.push(Cell::brightened(format!("n {} {n}", if beyond { ">=" } else { "=" }), term, exposure));
        let label = if beyond { "all n".to_owned() } else { format!("n <= {n}") };
        sums.push(Cell::plain(label, sum.iter().map(|s| s.map(|v| v as f32)).collect()));
    }
    vec![terms, sums]
}
