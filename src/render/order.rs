//! The order in which a pass shoots its light paths: those that start alike one after another.
//!
//! Points of a sequence that follow each other lie as far apart as they can, so light paths in their order go
//! everywhere at once, and each finds the tree, the vertices and the textures of where it goes gone from the caches.
//! Sorted by where they start they go together, at least to where they scatter widely. What a path finds depends on
//! its number alone, and sums on films know no order.

use super::light_path_random;
use crate::scene::{EmitterId, Scene};
use crate::transport::settings::Plan;
use crate::transport::shoot::Draws;
use glam::Vec2;
use rayon::prelude::*;

/// Bits of each axis that are sorted by: a few paths to each cell.
const BITS: u32 = 6;

/// The numbers of the light paths of a pass, sorted by emitter and by where they go: by direction, or from a light at
/// infinity by place.
pub fn order(scene: &Scene, plan: &Plan, pass: u64) -> Vec<u32> {
    let infos = scene.lights.infos().iter().zip(0..);
    let infinite: f32 = infos.filter(|(_, i)| scene.lights.is_infinite(EmitterId(*i))).map(|(info, _)| info.prob_emission).sum();
    let several = scene.lights.infos().len() > 1;
    let key = |index: u32| {
        let draws = Draws::of(&mut light_path_random(plan, index, pass));
        let at = if infinite > 0.5 { draws.position } else { draws.direction };
        let which = if several { cell(draws.pick) } else { 0 };
        which << (2 * BITS) | interleaved(at)
    };
    let mut paths: Vec<(u32, u32)> = (0..plan.light_paths).into_par_iter().map(|index| (key(index), index)).collect();
    paths.par_sort_unstable();
    paths.into_iter().map(|(_, index)| index).collect()
}

/// Cell of a point of the unit interval.
fn cell(x: f32) -> u32 {
    ((x * (1 << BITS) as f32) as u32).min((1 << BITS) - 1)
}

/// Number of a cell of the unit square along a Z-order curve.
fn interleaved(p: Vec2) -> u32 {
    let (x, y) = (cell(p.x), cell(p.y));
    (0..BITS).fold(0, |sum, b| sum | (x >> b & 1) << (2 * b) | (y >> b & 1) << (2 * b + 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::settings::Settings;

    fn scene(emitters: &str) -> Scene {
        let text = format!("<scene version=\"3.0.0\"><sensor type=\"perspective\"/><shape type=\"sphere\"/>{emitters}</scene>");
        crate::load_str(&text, "".as_ref(), &Default::default()).map(|l| l.scene).unwrap_or_else(|e| panic!("{e}"))
    }

    #[test]
    fn all_paths_and_each_close_to_the_one_before() {
        let lamp = "<emitter type=\"point\"><point name=\"position\" value=\"3, 0, 0\"/></emitter>";
        let sun = "<emitter type=\"directional\"/>";
        let settings = Settings { light_paths: Some(20_000), ..Settings::default() };
        let plan = Plan::new(&settings, 100, 100, 3.0);
        let draws = |index: u32| Draws::of(&mut light_path_random(&plan, index, 3));
        type Axis = fn(&Draws) -> Vec2;
        let cases: [(String, Axis); 3] =
            [(lamp.into(), |d| d.direction), (sun.into(), |d| d.position), (lamp.repeat(2), |d| Vec2::splat(d.pick))];
        for (emitters, axis) in cases {
            let paths = order(&scene(&emitters), &plan, 3);
            let mut sorted = paths.clone();
            sorted.sort_unstable();
            assert!(sorted.into_iter().eq(0..plan.light_paths));
            let steps = |paths: &[u32]| paths.windows(2).map(|w| axis(&draws(w[0])).distance(axis(&draws(w[1])))).sum::<f32>();
            let unsorted: Vec<u32> = (0..plan.light_paths).collect();
            let (now, before) = (steps(&paths), steps(&unsorted));
            assert!(now < 0.1 * before, "{now} of {before}: {emitters}");
        }
    }
}
