//! Renders a scene file through the library: `cargo run --release --example render -- SCENE.xml OUT.exr [ESTIMATOR] [SPP]`.

use nephroid::io::exr::ImageFile;
use nephroid::io::write::write_image;
use nephroid::render::{Budget, Control, Estimator, Options, Render};
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [scene, out, rest @ ..] = &arguments[..] else {
        return Err("usage: render SCENE.xml OUT.exr|OUT.png [gather|shoot|bidirectional] [SPP]".into());
    };
    let estimator = rest.first().map_or(Some(Estimator::default()), |n| Estimator::parse(n)).ok_or("unknown estimator")?;
    let spp = rest.get(1).map_or(Ok(16), |n| n.parse())?;

    let loaded = nephroid::load(Path::new(scene), &Default::default())?;
    eprint!("{}", loaded.warnings.render(&loaded.sources));
    let mut render = Render::new(&loaded.scene, &Options::for_scene(&loaded.scene, estimator))?;
    render.run(&Budget::passes(spp), |p| {
        eprintln!("{} passes, {:.1} s", p.passes, p.elapsed.as_secs_f64());
        Control::Continue
    });

    let (picture, statistics) = (render.picture(), render.statistics());
    let mut file = ImageFile::new(picture.width, picture.height);
    file.insert_rgb("", &picture.mean);
    file.insert_rgb("variance", &picture.variance);
    write_image(Path::new(out), &file, Default::default())?;
    let seconds = statistics.time.as_secs_f64();
    println!(
        "{:.2} samples per pixel and second, {:.2} million rays per second",
        statistics.passes as f64 / seconds,
        statistics.rays.total() as f64 / seconds * 1e-6
    );
    Ok(())
}
