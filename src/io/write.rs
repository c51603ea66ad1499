//! Images out, atomically: the old file stays until the new one is complete on the disk.
//!
//! An image goes into a temporary file in the directory of its target, is flushed to the disk
//! and then renamed over the target. Whatever goes wrong before the rename (no space, no
//! permission, a crash) leaves the target as it was. [`check_writable`] tries this before a render
//! starts, because finding out afterwards would lose the render.

use super::exr::{self, ImageFile};
use super::fault::{Fault, io_fault, missing, quote, read_bytes};
use super::image;
use super::png::{self, PngOptions};
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// Formats that can be written, chosen by the extension of the path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutputFormat {
    /// Linear, all layers, all attributes.
    Exr,
    /// Display-referred beauty.
    Png,
}

impl OutputFormat {
    /// The format of an output path; an unknown extension is a fault that lists the known ones.
    pub fn of(path: &Path) -> Result<Self, Fault> {
        let hint = "the known extensions are .exr (linear, with all layers) and .png (sRGB)";
        let Some(extension) = path.extension().filter(|_| path.file_name().is_some()) else {
            return Err(Fault::new("has no extension to tell its format").hint(hint).within(quote(path)));
        };
        match extension.to_string_lossy().to_ascii_lowercase().as_str() {
            "exr" => Ok(Self::Exr),
            "png" => Ok(Self::Png),
            other => {
                let name = quote(Path::new(&format!(".{other}")));
                Err(Fault::new(format!("cannot write files with the extension {name}")).hint(hint).within(quote(path)))
            }
        }
    }
}

/// Whether an image can be written to `path`: known extension, existing directory in which a file
/// can be made, target not a directory and not write-protected. Leaves nothing behind.
pub fn check_writable(path: &Path) -> Result<OutputFormat, Fault> {
    let format = OutputFormat::of(path)?;
    let target = resolve(path).map_err(|f| f.within(quote(path)))?;
    temporary(&target).map_err(|f| f.within(quote(path)))?;
    Ok(format)
}

/// Writes an image in the format of the extension. On a fault the file at `path`, if any, is
/// what it was.
pub fn write_image(path: &Path, file: &ImageFile, options: PngOptions) -> Result<(), Fault> {
    let format = OutputFormat::of(path)?;
    write_atomic(path, |out| match format {
        OutputFormat::Exr => exr::write(out, file),
        OutputFormat::Png => png::write(out, file, options),
    })
}

/// Writes any file atomically: `fill` gets the temporary file.
pub fn write_atomic(path: &Path, fill: impl FnOnce(&mut BufWriter<&File>) -> Result<(), Fault>) -> Result<(), Fault> {
    let attempt = || {
        let target = resolve(path)?;
        let temporary = temporary(&target)?;
        let mut out = BufWriter::with_capacity(1 << 16, temporary.as_file());
        fill(&mut out)?;
        out.flush().and_then(|()| temporary.as_file().sync_all()).map_err(io_fault)?;
        drop(out);
        temporary.persist(&target).map_err(|e| io_fault(e.error))?;
        // The rename itself survives a crash only when the directory is flushed too; some file
        // systems cannot do that, and the image is complete either way.
        if let Ok(directory) = File::open(parent(&target)) {
            let _ = directory.sync_all();
        }
        Ok(())
    };
    attempt().map_err(|f: Fault| {
        let kept = if path.exists() { "; the file there was left as it was" } else { "" };
        Fault { what: format!("cannot write {}: {}{kept}", quote(path), f.what), hint: f.hint }
    })
}

/// Reads an image for comparison: every channel of an EXR file, or R, G, B (linear) of another.
pub fn read_image(path: &Path) -> Result<ImageFile, Fault> {
    let read = || {
        let bytes = read_bytes(path)?;
        if exr::is_exr(&bytes) {
            return exr::parse_file(&bytes);
        }
        let picture = image::parse(&bytes, path, false)?.value;
        let mut file = ImageFile::new(picture.width, picture.height);
        let names: &[&str] = if picture.channels == 1 { &["Y"] } else { &["R", "G", "B"] };
        for (k, name) in names.iter().enumerate() {
            let plane = picture.data.iter().skip(k).step_by(names.len()).copied().collect();
            file.channels.insert((*name).to_owned(), plane);
        }
        Ok(file)
    };
    read().map_err(|f: Fault| f.within(quote(path)))
}

fn parent(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// The file that a rename has to replace: behind symbolic links, whose place it must not take.
fn resolve(path: &Path) -> Result<PathBuf, Fault> {
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let directory = parent(&target);
    if !directory.exists() {
        // `missing` looks at the directory of the path it is given, which is what is not there.
        let fault = missing(path);
        return Err(Fault { what: fault.what.replacen("does not exist: there", "cannot be made: there", 1), hint: fault.hint });
    }
    if !directory.is_dir() {
        return Err(Fault::new(format!("{} is not a directory", quote(directory))));
    }
    match fs::metadata(&target) {
        Ok(kind) if kind.is_dir() => Err(Fault::new("is a directory")),
        Ok(kind) if !kind.is_file() => Err(Fault::new("is a device or a pipe, not an ordinary file")),
        Ok(kind) if kind.permissions().readonly() => Err(Fault::new("exists and is write-protected")),
        _ => Ok(target),
    }
}

/// A new file beside the target that vanishes unless renamed, with the permissions of the file
/// it will replace, or those any new file gets.
fn temporary(target: &Path) -> Result<NamedTempFile, Fault> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".nephroid-").suffix(".tmp");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    let file = builder.tempfile_in(parent(target)).map_err(|e| {
        let fault = io_fault(io::Error::from(e.kind()));
        Fault { what: format!("no file can be made in {}: {}", quote(parent(target)), fault.what), hint: fault.hint }
    })?;
    if let Ok(old) = fs::metadata(target) {
        fs::set_permissions(file.path(), old.permissions()).map_err(io_fault)?;
    }
    Ok(file)
}
