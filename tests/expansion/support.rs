//! Scenes from text and what tests ask of films.

use nephroid::film::{Exact, Film};
use nephroid::render::{Budget, Control, Estimator, Options, Render};
use nephroid::scene::Scene;

/// The built scene of a text.
pub fn scene(xml: &str) -> Scene {
    nephroid::load_str(xml, std::path::Path::new("."), &Default::default()).map(|l| l.scene).unwrap_or_else(|e| panic!("{e}"))
}

/// A render after so many passes.
pub fn rendered<'a>(world: &'a Scene, options: &Options, passes: u64) -> Render<'a> {
    let mut render = Render::new(world, options).unwrap_or_else(|e| panic!("{e}"));
    render.run(&Budget::passes(passes), |_| Control::Continue);
    render
}

/// The exact sums of all pixels.
pub fn sums(film: &Film) -> Vec<Exact> {
    let pixels = (0..film.height()).flat_map(|y| (0..film.width()).map(move |x| (x, y)));
    pixels.map(|(x, y)| film.sum(x, y)).collect()
}

/// The exact sums of all pixels of several films together.
pub fn sums_of<'a>(films: impl IntoIterator<Item = &'a Film>) -> Vec<Exact> {
    let mut total = Vec::new();
    for film in films {
        let sums = sums(film);
        total.resize(sums.len(), Exact::ZERO);
        total.iter_mut().zip(sums).for_each(|(a, b)| a.add(b));
    }
    total
}

/// A box of Lambert walls, a mirror, a glass ball and a lamp: every join has paths of its own.
pub const ROOM: &str = r#"<scene version="3.0.0">
  <sensor type="perspective"><float name="fov" value="100"/>
    <transform name="to_world"><lookat origin="0, 0, 0.95" target="0, 0, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="18"/><rfilter type="tent"/></film></sensor>
  <shape type="cube"><boolean name="flip_normals" value="true"/>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.7, 0.5, 0.3"/></bsdf></shape>
  <shape type="sphere"><point name="center" value="-0.4, -0.5, 0"/><float name="radius" value="0.3"/><bsdf type="dielectric"/></shape>
  <shape type="sphere"><point name="center" value="0.5, -0.6, -0.4"/><float name="radius" value="0.3"/>
    <bsdf type="conductor"><string name="material" value="none"/></bsdf></shape>
  <shape type="rectangle" id="panel"><transform name="to_world"><scale value="0.3"/><rotate x="1" angle="90"/><translate y="0.95"/></transform>
    <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>
    <emitter type="area"><rgb name="radiance" value="6, 5, 4"/></emitter></shape>
  <emitter type="point" id="bulb"><point name="position" value="0.6, 0.3, 0.3"/><rgb name="intensity" value="0.2, 0.3, 0.6"/></emitter>
</scene>"#;

/// All that walk.
pub const ESTIMATORS: [Estimator; 3] = [Estimator::Gather, Estimator::Shoot, Estimator::Bidirectional];

/// Means over tiles of two independent films, or of two parts of one render, differ by no more than 4 standard
/// errors; those must be below a share `noise` of the mean of the film.
pub fn tiles_agree(a: &Film, b: &Film, noise: f64, what: &str) {
    let (width, height) = (a.width() as usize, a.height() as usize);
    let means = |film: &Film| film.mean();
    let (ma, mb, va, vb) = (means(a), means(b), a.variance_of_tile_mean(), b.variance_of_tile_mean());
    let whole: f64 = mb.iter().map(|p| f64::from(p[0])).sum::<f64>() / mb.len() as f64;
    for y in (0..height).step_by(16) {
        for x in (0..width).step_by(16) {
            let tile: Vec<usize> =
                (y..height.min(y + 16)).flat_map(|y| (x..width.min(x + 16)).map(move |x| y * width + x)).collect();
            let mean = |m: &[[f32; 3]]| tile.iter().map(|i| f64::from(m[*i][0])).sum::<f64>() / tile.len() as f64;
            let (p, q) = (mean(&ma), mean(&mb));
            let se = f64::from(va[tile[0]][0] + vb[tile[0]][0]).sqrt();
            assert!(se < noise * whole, "{what}, tile {x}, {y}: ± {se} of {whole} is too noisy to tell");
            assert!((p - q).abs() <= 4.0 * se, "{what}, tile {x}, {y}: {p} and {q}, ± {se}");
        }
    }
}

/// A sphere seen from inside that reflects `albedo` and emits a pattern, and the mean of that over its surface.
pub fn sphere(albedo: f64) -> (Scene, f64) {
    let dir = tempfile::tempdir().unwrap();
    // Constant along each meridian, so that the mean over the sphere is that over the texels.
    let texels = [0u8, 255, 30, 0, 0, 90, 0, 200];
    image::GrayImage::from_fn(8, 1, |x, _| image::Luma([texels[x as usize]])).save(dir.path().join("lamps.png")).unwrap();
    let world = scene(&format!(
        r#"<scene version="3.0.0">
  <sensor type="perspective"><float name="fov" value="60"/>
    <transform name="to_world"><lookat origin="0.3, 0.1, 0.4" target="0, 0, -1" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="32"/><rfilter type="box"/></film></sensor>
  <shape type="sphere"><boolean name="flip_normals" value="true"/>
    <bsdf type="diffuse"><rgb name="reflectance" value="{albedo}"/></bsdf>
    <emitter type="area"><texture type="bitmap" name="radiance"><string name="filename" value="{}/lamps.png"/>
      <boolean name="raw" value="true"/><string name="filter_type" value="nearest"/></texture></emitter></shape>
</scene>"#,
        dir.path().display()
    ));
    (world, texels.iter().map(|t| f64::from(*t) / 255.0).sum::<f64>() / 8.0)
}
