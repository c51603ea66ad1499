//! What an element reflects and emits: ρ_i and b_i = Lᵉ_i + ρ_i S_i.
//!
//! Reflectance and emission are means over the element, by a grid of points. S_i is the radiance that
//! a white element would have from the emitters that are no surfaces, one reflection: point, spot and
//! parallel light by next events; sky and sun by next events and by cosine-distributed rays that
//! leave the scene, joined by the balance heuristic, so that neither a broad sky nor a small sun is
//! noisy.

use super::mesh::{Elements, ray_from};
use super::{Rgb, factors::Sequence};
use crate::local::Equation;
use crate::math::warp::hemisphere_cosine_p_w;
use crate::scene::emitter::EmitterPoint;
use crate::scene::geometry::End;
use crate::scene::{EmitterId, Scene, Surface};
use crate::spectrum::Spectrum;
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use std::f32::consts::{FRAC_1_PI, PI};

/// Points per side of the grid on which textures are averaged.
const GRID: u32 = 4;

/// ρ and b of every element.
#[derive(Clone, Debug)]
pub struct Sources {
    /// Mean reflectance.
    pub reflectance: Vec<Rgb>,
    /// Mean emitted radiance, W·m⁻²·sr⁻¹.
    pub emitted: Vec<Rgb>,
    /// Mean radiance without coupling of surfaces: emitted, and reflected from emitters that are no
    /// surfaces.
    pub radiance: Vec<Rgb>,
}

impl Sources {
    /// With `samples` points per element for the emitters that are no surfaces.
    pub fn new(scene: &Scene, mesh: &Elements, samples: u32, seed: u64) -> Self {
        let other = others(scene);
        let each = (0..mesh.len()).into_par_iter().map(|i| {
            let (reflectance, emitted) = means(scene, mesh, i);
            let white = if other.is_empty() { [0.0; 3] } else { white(scene, mesh, i, &other, samples.max(1), seed) };
            let radiance = std::array::from_fn(|c| emitted[c] + reflectance[c] * white[c]);
            (reflectance, (emitted, radiance))
        });
        let (reflectance, (emitted, radiance)) = each.unzip();
        Self { reflectance, emitted, radiance }
    }

    /// The largest reflectance: the contraction ratio q of the matrix, in the maximum norm and in flux.
    pub fn contraction(&self) -> f64 {
        self.reflectance.iter().flatten().fold(0.0, |q, r| q.max(*r))
    }
}

/// ρ of a surface point, seen from the side of its normal or from the other.
#[inline]
pub(super) fn reflectance(scene: &Scene, s: &Surface, front: bool) -> Rgb {
    let closure = scene.materials.resolve(s.material, s.uv, front);
    let f = closure.evaluate(Equation::Rendering, Vec3::Z, Vec3::Z).f * PI;
    f.to_rgb().map(f64::from)
}

/// Lᵉ of a surface point towards the side of its normal; black towards the other.
#[inline]
pub(super) fn emission(scene: &Scene, s: &Surface, front: bool) -> Rgb {
    if s.emitter == EmitterId::NONE || !front {
        return [0.0; 3];
    }
    scene.lights.radiance(&EmitterPoint::on_surface(s), s.n_g).to_rgb().map(f64::from)
}

fn means(scene: &Scene, mesh: &Elements, i: usize) -> (Rgb, Rgb) {
    let (mut rho, mut emitted) = ([0.0; 3], [0.0; 3]);
    let share = 1.0 / f64::from(GRID * GRID);
    for k in 0..GRID * GRID {
        let u = (Vec2::new((k % GRID) as f32, (k / GRID) as f32) + 0.5) / GRID as f32;
        let s = mesh.point(scene, i, u);
        let (r, e) = (reflectance(scene, &s, mesh.is_front(i)), emission(scene, &s, mesh.is_front(i)));
        for c in 0..3 {
            rho[c] += share * r[c];
            emitted[c] += share * e[c];
        }
    }
    (rho, emitted)
}

/// Emitters that are no surfaces.
pub(super) fn others(scene: &Scene) -> Vec<EmitterId> {
    let infos = scene.lights.infos().iter().enumerate();
    infos.filter(|(_, e)| e.kind != "area" && e.prob_next_event > 0.0).map(|(i, _)| EmitterId(i as u32)).collect()
}

fn white(scene: &Scene, mesh: &Elements, i: usize, others: &[EmitterId], samples: u32, seed: u64) -> Rgb {
    let (sequence, events) = (Sequence::new(i, 1, seed), Sequence::new(i, 2, seed));
    let mut sum = [0.0; 3];
    for k in 0..samples {
        let u = sequence.at(k);
        let s = mesh.point(scene, i, Vec2::new(u[0], u[1]));
        let n = if mesh.is_front(i) { s.n_g } else { -s.n_g };
        let v = events.at(k);
        let one = white_at(scene, &s, n, others, Vec2::new(u[2], u[3]), Vec2::new(v[0], v[1]));
        one.to_rgb().iter().zip(&mut sum).for_each(|(v, s)| *s += f64::from(*v));
    }
    sum.map(|s| s / f64::from(samples))
}

/// One sample of the radiance of a white point with unit normal `n` from emitters that are no surfaces: a
/// ray into the sky by `u`, a next event of each emitter by `v`.
pub(super) fn white_at(scene: &Scene, s: &Surface, n: Vec3, others: &[EmitterId], u: Vec2, v: Vec2) -> Spectrum {
    let mut sum = Spectrum::BLACK;
    let end: End = (s.p, s.p_error, s.n_g);
    for id in others {
        let Some(ne) = scene.lights.next_event_of(*id, &scene.geometry, s.p, v) else { continue };
        let cos = n.dot(ne.w);
        if cos <= 0.0 {
            continue;
        }
        let clear = if ne.distance.is_infinite() {
            scene.geometry.visible_infinite(end, ne.w)
        } else {
            scene.geometry.visible(end, (ne.point.y, ne.point.y_error, ne.point.n_g))
        };
        if clear {
            let other = if ne.delta { 0.0 } else { hemisphere_cosine_p_w(cos) };
            sum += ne.radiance * (ne.g * cos * FRAC_1_PI / (ne.nu + other));
        }
    }
    if scene.lights.has_environment() {
        let ray = ray_from(s, n, u);
        let p = hemisphere_cosine_p_w(n.dot(ray.d));
        if !scene.geometry.occluded(&ray) {
            scene.lights.environment(ray.d, |emitter, radiance| {
                let point = EmitterPoint::at_infinity(emitter, ray.d);
                let nu = scene.lights.density_of(&scene.geometry, s.p, &point, ray.d);
                sum += radiance * (p / (p + nu));
            });
        }
    }
    sum
}
