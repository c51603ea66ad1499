//! Scenes from text and what tests ask of films.

use nephroid::film::{Exact, Film};
use nephroid::render::{Budget, Control, Options, Render};
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
