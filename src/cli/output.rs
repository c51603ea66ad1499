//! Where a render goes: image files, checked before and written during and after it.

use super::args::RenderArgs;
use super::units::show_bytes;
use super::{Exit, Failure};
use crate::film::Film;
use crate::io::fault::Fault;
use crate::io::png::PngOptions;
use crate::io::write::{OutputFormat, check_writable, write_image};
use crate::report::Picture;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Bytes per pixel of the buffers between film and file: mean, two variances and their planes.
const WRITE_BYTES: u64 = 72;
/// Bytes of a light path of a pass: its splats and kept vertices, about four of each.
const LIGHT_PATH_BYTES: u64 = 4 * (2 * 16 + 96);

/// The files to write.
pub struct Outputs {
    paths: Vec<PathBuf>,
    png: PngOptions,
}

impl Outputs {
    /// Refuses what could not be written at the end: an unknown extension is wrong usage, a place
    /// where no file can be made is an output error.
    pub fn check(args: &RenderArgs) -> Result<Self, Failure> {
        for path in &args.output {
            OutputFormat::of(path).map_err(|f| Failure::usage(f.to_string()))?;
            check_writable(path).map_err(|f| Failure::output(f.to_string()))?;
        }
        if let Some(path) = &args.stats {
            check_directory(path).map_err(|what| Failure::output(format!("cannot write {}: {what}", path.display())))?;
        }
        if !args.exposure.is_finite() {
            return Err(Failure::usage("--exposure must be a finite number of stops"));
        }
        Ok(Self { paths: args.output.clone(), png: PngOptions { exposure: args.exposure, ..PngOptions::default() } })
    }

    /// Writes all files, with layers by name beside the image; what failed, after all have been tried.
    pub fn write(&self, film: &Film, layers: &[(String, Vec<[f32; 3]>)], attributes: &BTreeMap<String, String>) -> Vec<Fault> {
        let mut file = Picture::of_film(film).to_file();
        file.attributes.extend(attributes.clone());
        layers.iter().for_each(|(name, pixels)| file.insert_rgb(name, pixels));
        self.paths.iter().filter_map(|path| write_image(path, &file, self.png).err()).collect()
    }

    /// There are none.
    pub fn is_empty(&self) -> bool {
        self.paths.is_empty()
    }

    /// The files' names, for people.
    pub fn names(&self) -> String {
        self.paths.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(", ")
    }
}

/// Memory that a render of this size takes beside the scene, in bytes.
pub fn memory_needed(width: u32, height: u32, light_paths: Option<u32>, shoots: bool) -> u64 {
    let pixels = u64::from(width) * u64::from(height);
    // A pilot may choose several light paths per pixel.
    let light = if shoots { light_paths.map_or(pixels.saturating_mul(MOST_LIGHT_PATHS), u64::from) } else { 0 };
    Film::bytes(width, height)
        .saturating_add(pixels.saturating_mul(WRITE_BYTES))
        .saturating_add(light.saturating_mul(LIGHT_PATH_BYTES))
}

/// Light paths per pixel at most.
const MOST_LIGHT_PATHS: u64 = 4;

/// Refuses a film beyond the limit, or beyond what the machine has free where no limit is given.
pub fn check_memory(needed: u64, limit: Option<u64>, [width, height]: [u32; 2]) -> Result<(), Failure> {
    let allowed = allowed_memory(limit);
    if needed <= allowed {
        return Ok(());
    }
    let of = if limit.is_some() { "--max-memory is" } else { "the machine has free" };
    Err(Failure {
        exit: Exit::Usage,
        message: format!(
            "error: rendering {width} × {height} pixels needs {}; {of} {}\n  help: render a part by --crop, a smaller image by --size, or raise --max-memory\n",
            show_bytes(needed),
            show_bytes(allowed)
        ),
    })
}

/// The limit if there is one, else what the machine has free.
pub fn allowed_memory(limit: Option<u64>) -> u64 {
    limit.or_else(free_memory).unwrap_or(16_000_000_000)
}

/// Free memory in bytes, where the system tells it: the smaller of the machine's and the control
/// group's.
fn free_memory() -> Option<u64> {
    let number = |path: &str| std::fs::read_to_string(path).ok()?.trim().parse::<u64>().ok();
    let of_group =
        number("/sys/fs/cgroup/memory.max").map(|max| max.saturating_sub(number("/sys/fs/cgroup/memory.current").unwrap_or(0)));
    let text = std::fs::read_to_string("/proc/meminfo").ok();
    let of_machine = text.and_then(|t| {
        let line = t.lines().find(|l| l.starts_with("MemAvailable:"))?;
        line.split_whitespace().nth(1)?.parse::<u64>().ok().map(|kb| kb * 1024)
    });
    of_group.into_iter().chain(of_machine).min()
}

/// A file can be made beside `path`, which is not a directory.
pub(super) fn check_directory(path: &Path) -> Result<(), String> {
    if path.is_dir() {
        return Err("is a directory".into());
    }
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    tempfile::tempfile_in(parent).map(drop).map_err(|e| e.to_string())
}
