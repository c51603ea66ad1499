//! What the pixels of a picture see first, as far as it decides how many samples of chains they have.
//!
//! Only pixels that show a lamp, glass or a mirror need more than one ([`Settings::chain_samples`]). A pixel may have any
//! number as long as that is no function of its samples: one look into each pixel, with random numbers of its own, and what its
//! neighbours see besides. Where a look missed what is there, the pixel has one sample and the right expectation.
//!
//! [`Settings::chain_samples`]: super::settings::Settings::chain_samples

use crate::math::Random;
use crate::math::random::Family;
use crate::scene::geometry::Ray;
use crate::scene::{EmitterId, Scene};
use glam::Vec2;
use rayon::prelude::*;

/// Which pixels of a crop window may show something that shines, or scatters by Dirac events; by default, all.
#[derive(Clone, Debug, Default)]
pub struct FirstSeen {
    /// x, y, width, height in the film.
    crop: [u32; 4],
    seen: Vec<bool>,
}

impl FirstSeen {
    /// Looks once into every pixel of the crop window `crop` (x, y, width, height).
    pub fn looked_at(scene: &Scene, crop: [u32; 4], seed: u64) -> Self {
        let film = [scene.film.width, scene.film.height];
        // Neighbours beyond the window count as well, so that its pixels have as many samples as in the whole picture.
        let [(left, right), (top, bottom)] =
            [0, 1].map(|i| (crop[i].saturating_sub(1), (crop[i] + crop[i + 2] + 1).min(film[i])));
        let row = |y: u32| (left..right).map(move |x| look(scene, [x, y], seed));
        let looks: Vec<bool> = (top..bottom).into_par_iter().flat_map_iter(row).collect();
        let looked = |x: u32, y: u32| looks[(y - top) as usize * (right - left) as usize + (x - left) as usize];
        let near = |at: u32, end: u32| at.saturating_sub(1)..(at + 2).min(end);
        let around = |x: u32, y: u32| near(y, bottom).any(|y| near(x, right).any(|x| looked(x, y)));
        let row = |y: u32| (crop[0]..crop[0] + crop[2]).map(|x| around(x, y)).collect::<Vec<_>>();
        Self { crop, seen: (crop[1]..crop[1] + crop[3]).into_par_iter().flat_map_iter(row).collect() }
    }

    /// Pixel (x, y) of the crop window may, or nobody looked.
    #[inline]
    pub fn at(&self, x: u32, y: u32) -> bool {
        self.seen.is_empty() || self.seen[y as usize * self.crop[2] as usize + x as usize]
    }

    /// Nobody looked.
    pub fn is_unknown(&self) -> bool {
        self.seen.is_empty()
    }

    /// Corners in the film of those that may, row by row.
    pub fn pixels(&self) -> impl Iterator<Item = Vec2> {
        let [left, top, width, _] = self.crop;
        let corner = move |i: usize| Vec2::new((left + i as u32 % width) as f32, (top + i as u32 / width) as f32);
        (0..self.seen.len()).filter(|i| self.seen[*i]).map(corner)
    }
}

/// Whether one ray through a pixel of the film meets such.
fn look(scene: &Scene, [x, y]: [u32; 2], seed: u64) -> bool {
    let id = u64::from(y) * u64::from(scene.film.width) + u64::from(x);
    let mut random = Random::new(Family::Pilot, id | 1 << 37, 0, seed);
    let start = scene.sensor.sample_ray(Vec2::new(x as f32, y as f32) + random.unit2(), random.unit2());
    let ray = Ray { o: start.o, d: start.d, t_max: start.t_max };
    scene.geometry.intersect(&ray).map_or(scene.lights.has_environment(), |hit| {
        let surface = scene.geometry.surface(&ray, &hit);
        surface.emitter != EmitterId::NONE || scene.materials.has_delta(surface.material)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mirror_and_a_lamp_and_their_borders() {
        let square = |x: f32, inside: &str| {
            format!(
                "<shape type=\"rectangle\"><transform name=\"to_world\"><scale value=\"0.25\"/><translate x=\"{x}\"/></transform>\
                 {inside}</shape>"
            )
        };
        let text = format!(
            "<scene version=\"3.0.0\"><sensor type=\"orthographic\"><transform name=\"to_world\">\
             <lookat origin=\"0, 0, 3\" target=\"0, 0, 0\" up=\"0, 1, 0\"/></transform>\
             <film type=\"hdrfilm\"><integer name=\"width\" value=\"32\"/><integer name=\"height\" value=\"32\"/></film></sensor>\
             {}{}</scene>",
            square(0.5, "<bsdf type=\"conductor\"/>"),
            square(-0.5, "<emitter type=\"area\"/>"),
        );
        let scene = crate::load_str(&text, "".as_ref(), &Default::default()).map(|l| l.scene).unwrap_or_else(|e| panic!("{e}"));
        // A crop window that cuts one of the squares off.
        for (crop, expected) in [([0, 0, 32, 32], 200), ([0, 0, 16, 32], 100)] {
            let seen = FirstSeen::looked_at(&scene, crop, 1);
            let at = |(x, y): &(u32, u32)| seen.at(*x, *y);
            let all = (0..32).flat_map(|y| (0..crop[2]).map(move |x| (x, y))).filter(at).count();
            // Eight pixels on a side, and one around.
            assert_eq!((all, seen.pixels().count()), (expected, expected));
            let whole = FirstSeen::looked_at(&scene, [0, 0, 32, 32], 1);
            assert!(whole.pixels().filter(|p| p.x < crop[2] as f32).eq(seen.pixels()));
        }
        assert!(FirstSeen::default().at(5, 5) && FirstSeen::default().is_unknown());
    }
}
