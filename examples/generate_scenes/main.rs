//! Writes every mesh and image that the scenes of this repository use: `scenes/<name>/…`.
//!
//! `cargo run --release --example generate_scenes [FOLDER]`. Each file is a pure function of the
//! numbers below, computed in f64 and rounded once, so that a second run writes the same bytes.

mod curve;
mod mesh;
mod objects;
mod texture;

use std::error::Error;
use std::path::Path;

/// A file to be written: its path below the folder of the scenes, and how to make its bytes.
type Entry = (&'static str, fn() -> Vec<u8>);

/// All generated files.
const FILES: &[Entry] = &[
    ("cup/outside.ply", || objects::cup_outside().to_ply()),
    ("cup/inside.ply", || objects::cup_inside().to_ply()),
    ("cup/handle.ply", || objects::cup_handle().to_ply()),
    ("cup/saucer.ply", || objects::saucer().to_ply()),
    ("cup/saucer-ring.ply", || objects::saucer_ring().to_ply()),
    ("cup/grain.png", || texture::wood(384, 384, 5)),
    ("gems/brilliant.ply", || objects::brilliant().to_ply()),
    ("gems/emerald.ply", || objects::emerald().to_ply()),
    ("gems/backdrop.ply", || objects::backdrop().to_ply()),
    ("crystal/quartz.ply", || objects::quartz().to_ply()),
    ("wine/glass.ply", || objects::wine_glass().to_ply()),
    ("wine/contact.ply", || objects::wine_contact().to_ply()),
    ("wine/surface.ply", || objects::wine_surface().to_ply()),
    ("wine/tumbler.ply", || objects::tumbler().to_ply()),
    ("wine/water-contact.ply", || objects::water_contact().to_ply()),
    ("wine/water-surface.ply", || objects::water_surface().to_ply()),
    ("wine/linen.png", || texture::linen(128)),
    ("door/leaf.ply", || objects::door_leaf().to_ply()),
    ("door/frame.ply", || objects::door_frame().to_ply()),
    ("door/knob.ply", || objects::door_knob().to_ply()),
    ("door/vase.ply", || objects::vase().to_ply()),
    ("door/boards.png", || texture::boards(384, 384)),
    ("lens/lens.ply", || objects::lens().to_ply()),
    ("lens/rim.ply", || objects::lens_rim().to_ply()),
    ("lens/handle.ply", || objects::lens_handle().to_ply()),
    ("lens/drawing.png", || texture::nephroid_drawing(768)),
    ("lattice/leaf.ply", || objects::agave_leaf().to_ply()),
    ("lattice/pot.ply", || objects::pot().to_ply()),
    ("lattice/lattice.png", || texture::lattice(512)),
    ("lattice/tiles.png", || texture::tiles(256)),
    ("lattice/sky.hdr", || texture::sky(64, 32)),
    ("models/figure.ply", || objects::figure().to_ply()),
    ("models/shade.ply", || objects::shade().to_ply()),
    ("models/dots.png", || texture::dots(128)),
];

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args_os().nth(1).unwrap_or_else(|| "scenes".into());
    for (name, make) in FILES {
        let path = Path::new(&folder).join(name);
        std::fs::create_dir_all(path.parent().unwrap_or(Path::new(".")))?;
        let bytes = make();
        std::fs::write(&path, &bytes)?;
        println!("{:>9} {}", bytes.len(), path.display());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The files in the repository are those that the generator makes now.
    #[test]
    fn regenerating_gives_the_same_bytes() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
        for (name, make) in FILES {
            let stored = std::fs::read(folder.join(name)).unwrap_or_default();
            assert!(stored == make(), "scenes/{name} differs: run the example generate_scenes");
        }
    }
}
