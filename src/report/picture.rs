//! An image with what is known of its error: from a film, to and from a file.

use crate::film::Film;
use crate::io::exr::ImageFile;

/// An image with what is known of its error.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Linear sRGB, row by row from the top.
    pub mean: Vec<[f32; 3]>,
    /// Variance of each number of `mean`.
    pub variance: Option<Vec<[f32; 3]>>,
    /// At every pixel, the variance of the mean over its block of 16 × 16 pixels, counted from the left
    /// upper corner; with what the pixels of a block have in common.
    pub block_variance: Option<Vec<[f32; 3]>>,
    /// Independent samples that each number of `mean` is the mean of.
    pub samples: Option<u64>,
}

impl Picture {
    /// What a film holds so far; no variance with less than two passes.
    pub fn of_film(film: &Film) -> Self {
        let samples = film.passes().count();
        let some = |v: fn(&Film) -> Vec<[f32; 3]>| (samples >= 2).then(|| v(film));
        Self {
            width: film.width(),
            height: film.height(),
            mean: film.mean(),
            variance: some(Film::variance_of_mean),
            block_variance: some(Film::variance_of_tile_mean),
            samples: Some(samples),
        }
    }

    /// The mean of two films a and b of one scene that have no random numbers in common, each of at least one pass.
    ///
    /// Its variance is (a − b)²/4: one degree of freedom for each number, so only means over many pixels say something, but these are
    /// without bias however fast errors fall with passes. What films report of themselves is a bound where their samples fill space
    /// evenly; so is the variance of blocks here, which is theirs.
    pub fn of_halves(a: &Film, b: &Film) -> Self {
        let halves = [a, b];
        let join = |[a, b]: &[Vec<[f32; 3]>; 2], f: &dyn Fn(f32, f32) -> f32| -> Vec<[f32; 3]> {
            a.iter().zip(b).map(|(a, b)| std::array::from_fn(|c| f(a[c], b[c]))).collect()
        };
        let (means, of_blocks) = (halves.map(Film::mean), halves.map(Film::variance_of_tile_mean));
        Self {
            width: a.width(),
            height: a.height(),
            mean: join(&means, &|a, b| (a + b) / 2.0),
            variance: Some(join(&means, &|a, b| (a - b) * (a - b) / 4.0)),
            block_variance: Some(join(&of_blocks, &|a, b| (a + b) / 4.0)),
            samples: Some(halves.iter().map(|film| film.passes().count()).sum()),
        }
    }

    /// From a file with its variance layers and its number of samples, where it has them; `None` without
    /// channels R, G, B or Y.
    pub fn of_file(file: &ImageFile) -> Option<Self> {
        Some(Self {
            width: file.width,
            height: file.height,
            mean: file.rgb("")?,
            variance: file.rgb("variance"),
            block_variance: file.rgb("blockVariance"),
            samples: file.attributes.get("samples").and_then(|s| s.parse().ok()),
        })
    }

    /// As layers of a file.
    pub fn to_file(&self) -> ImageFile {
        let mut file = ImageFile::new(self.width, self.height);
        file.insert_rgb("", &self.mean);
        for (name, layer) in [("variance", &self.variance), ("blockVariance", &self.block_variance)] {
            if let Some(pixels) = layer {
                file.insert_rgb(name, pixels);
            }
        }
        if let Some(samples) = self.samples {
            file.attributes.insert("samples".into(), samples.to_string());
        }
        file
    }
}
