//! What is written of a render beside its image: its layers, and sheets of them.

use super::args::{LayersArgs, RenderArgs};
use super::{Failure, output};
use crate::io::fault::Fault;
use crate::io::png::PngOptions;
use crate::io::write::{OutputFormat, check_writable, write_image};
use crate::render::{Layers, Partition, Render};
use crate::report::sheet::{Cell, sheet};
use crate::transport::settings::Settings;

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
    let to_exr = args.output.iter().any(|o| matches!(OutputFormat::of(o), Ok(OutputFormat::Exr)));
    if args.layers.layers.is_some() && !to_exr {
        return Err(Failure::usage("--layers writes into an .exr output: add one by -o"));
    }
    Ok(())
}

/// Whether anything is asked that only walks can give.
pub fn wanted(args: &LayersArgs) -> bool {
    args.layers.is_some() || args.gallery.is_some()
}

/// How the render is to be taken apart.
pub fn partitions(args: &LayersArgs, settings: &Settings) -> Vec<Partition> {
    let mut partitions = Vec::new();
    if args.layers.is_some() || args.gallery.is_some() {
        let last = args.layers.flatten().unwrap_or(LAST_TERM);
        let longest = settings.max_length.max(1) - 1;
        partitions.push(Partition::Scatterings { last: last.min(longest), rest: longest > last });
    }
    partitions
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
    };
    let layers = render.layers().iter().filter(wanted);
    layers.flat_map(|l| l.films.iter().enumerate().map(|(i, f)| (l.partition.name(i), f.mean()))).collect()
}

/// Writes what is beside the image files; what failed, after all have been tried.
pub fn write(args: &RenderArgs, render: &Render<'_>) -> Vec<Fault> {
    let mut faults = Vec::new();
    for layers in render.layers() {
        if let (Partition::Scatterings { .. }, Some(path)) = (&layers.partition, &args.layers.gallery) {
            let film = render.film();
            let file = sheet(&gallery(layers, args.exposure), [film.width(), film.height()], args.exposure);
            faults.extend(write_image(path, &file, PngOptions::default()).err());
        }
    }
    faults
}

/// Terms above, partial sums below.
fn gallery(layers: &Layers, exposure: f32) -> Vec<Vec<Cell>> {
    let Partition::Scatterings { last, rest } = layers.partition;
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
