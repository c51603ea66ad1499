//! `compare`: how an image differs from a reference.

use super::args::CompareArgs;
use super::{Exit, Failure, say};
use crate::io::write::read_image;
use crate::report::{Picture, compare};
use std::path::Path;

/// Prints the comparison; "no" where a tolerance is given and exceeded.
pub fn run(args: &CompareArgs) -> Result<Exit, Failure> {
    let (image, reference) = (picture(&args.image)?, picture(&args.reference)?);
    let comparison = compare(&image, &reference).map_err(|e| Failure::usage(e.to_string()))?;
    say(&if args.json { comparison.to_json() + "\n" } else { comparison.to_text() });
    let Some(tolerance) = args.tolerance else { return Ok(Exit::Done) };
    match comparison.within(args.metric, tolerance) {
        Some(true) => Ok(Exit::Done),
        Some(false) => Ok(Exit::No),
        None => Err(Failure::usage("Welch's test needs variance and a number of samples in both images")),
    }
}

/// An image file with its variance layers and its number of samples, where it has them.
pub fn picture(path: &Path) -> Result<Picture, Failure> {
    let file = read_image(path).map_err(|f| Failure::usage(f.to_string()))?;
    Picture::of_file(&file).ok_or_else(|| Failure::usage(format!("{}: no channels R, G, B or Y", path.display())))
}
