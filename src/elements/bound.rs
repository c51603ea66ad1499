//! How far a solution is from the radiance of the scene: ‖L − L̃‖ ≤ ‖Lᵉ + τL̃ − L̃‖ / (1 − q).
//!
//! L̃ solves the finite system, L̃ = Lᵉ* + τ*L̃. With L = Lᵉ + τL,
//!
//! ```text
//! L − L̃ = τ(L − L̃) + r,   r = (Lᵉ + τL̃) − (Lᵉ* + τ*L̃) = Lᵉ + τL̃ − L̃,   ‖L − L̃‖ ≤ ‖r‖ (1 + q + q² + …)
//! ```
//!
//! which is the bound of iteration with an approximate operator, ‖τL − τ*L‖/(1 − q), with the known L̃
//! in place of the unknown L. The norm is the root mean square over all elements and channels; q, the
//! largest reflectance, bounds τ in it, since rows and columns of its kernel have sums below q.
//!
//! r is estimated at random points by rays that know nothing of form factors: cosine-distributed ones
//! and next events, joined by the balance heuristic. Each point has two independent estimates, and
//! their *product* has the mean r², which the square of one would exceed by its variance. So
//! discretisation, form factors and the solution of the system are in the bound alike.

use super::mesh::{Elements, VOID, ray_from};
use super::sources::{emission, others, reflectance, white_at};
use super::{Rgb, Sources};
use crate::math::Random;
use crate::math::random::Family;
use crate::math::warp::hemisphere_cosine_p_w;
use crate::scene::emitter::EmitterPoint;
use crate::scene::geometry::{Ray, offset_origin};
use crate::scene::{EmitterId, Scene, Surface};
use glam::Vec3;
use rayon::prelude::*;

/// An estimate of the residual of a solution, and what follows from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    /// Root mean square of the residual over the surfaces, W·m⁻²·sr⁻¹.
    pub residual: f64,
    /// The same with two standard errors of its square added.
    pub residual_at_most: f64,
    /// Root mean square of radiance over the surfaces.
    pub radiance: f64,
    /// The largest reflectance of the scene.
    pub q: f64,
}

impl Bound {
    /// Root mean square of L − L̃ at most; `None` where q ≥ 1.
    pub fn error(&self) -> Option<f64> {
        (self.q < 1.0).then(|| self.residual_at_most / (1.0 - self.q))
    }

    /// The same relative to the root mean square of radiance.
    pub fn relative(&self) -> Option<f64> {
        self.error().filter(|_| self.radiance > 0.0).map(|e| e / self.radiance)
    }
}

/// Estimates the residual of `radiance` at `points` points by 2 × `rays` pairs of rays each.
pub fn bound(scene: &Scene, mesh: &Elements, radiance: &[Rgb], points: u32, rays: u32, seed: u64) -> Bound {
    let probe = Probe::new(scene, mesh, radiance);
    let areas: Vec<f64> = (0..mesh.len()).map(|i| mesh.area(i)).collect();
    let total: f64 = areas.iter().sum();
    let picked = systematic(&areas, total, points, seed);
    let products: Vec<f64> = picked
        .par_iter()
        .enumerate()
        .map(|(k, i)| {
            let mut random = Random::new(Family::Elements, k as u64, 6, seed);
            let [a, b] = probe.transported(*i as usize, rays.max(1), &mut random);
            (0..3).map(|c| (a[c] - radiance[*i as usize][c]) * (b[c] - radiance[*i as usize][c])).sum::<f64>() / 3.0
        })
        .collect();
    let n = products.len().max(1) as f64;
    let mean = products.iter().sum::<f64>() / n;
    let variance = products.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / (n * (n - 1.0).max(1.0));
    let square = |(l, a): (&Rgb, &f64)| a * l.iter().map(|v| v * v).sum::<f64>() / 3.0;
    Bound {
        residual: mean.max(0.0).sqrt(),
        residual_at_most: (mean + 2.0 * variance.sqrt()).max(0.0).sqrt(),
        radiance: (radiance.iter().zip(&areas).map(square).sum::<f64>() / total).sqrt(),
        q: contraction(scene, mesh),
    }
}

/// The largest reflectance of any material that an element has: ‖τ‖ in the maximum norm and in flux,
/// and therefore no less than in between.
pub fn contraction(scene: &Scene, mesh: &Elements) -> f64 {
    let q = |m| f64::from(scene.materials.albedo_bound(m).max_lane());
    mesh.materials().into_iter().map(q).fold(0.0, f64::max)
}

/// `points` elements, each as often as its area says.
fn systematic(areas: &[f64], total: f64, points: u32, seed: u64) -> Vec<u32> {
    let offset = f64::from(Random::new(Family::Elements, 0, 7, seed).unit());
    let (mut picked, mut sum) = (Vec::with_capacity(points as usize), 0.0);
    for (i, a) in areas.iter().enumerate() {
        sum += a;
        let upto = ((sum / total * f64::from(points) - offset).ceil().max(0.0) as usize).min(points as usize);
        if upto > picked.len() {
            picked.resize(upto, i as u32);
        }
    }
    picked
}

/// Estimates Lᵉ + τL̃ at points, from L̃ per element.
pub(super) struct Probe<'a> {
    scene: &'a Scene,
    mesh: &'a Elements,
    radiance: &'a [Rgb],
    others: Vec<EmitterId>,
    has_lamps: bool,
}

impl<'a> Probe<'a> {
    pub fn new(scene: &'a Scene, mesh: &'a Elements, radiance: &'a [Rgb]) -> Self {
        let has_lamps = scene.lights.infos().iter().any(|e| e.kind == "area" && e.prob_next_event > 0.0);
        Self { scene, mesh, radiance, others: others(scene), has_lamps }
    }

    /// Two independent estimates of Lᵉ + τL̃ at one random point of element `i`.
    pub fn transported(&self, i: usize, rays: u32, random: &mut Random) -> [Rgb; 2] {
        let s = self.mesh.point(self.scene, i, random.unit2());
        let front = self.mesh.is_front(i);
        let n = if front { s.n_g } else { -s.n_g };
        let (rho, emitted) = (reflectance(self.scene, &s, front), emission(self.scene, &s, front));
        [0, 1].map(|_| {
            let mut sum = [0.0; 3];
            for _ in 0..rays {
                let one = self.white(&s, n, random);
                (0..3).for_each(|c| sum[c] += one[c]);
            }
            std::array::from_fn(|c| emitted[c] + rho[c] * sum[c] / f64::from(rays))
        })
    }

    /// One estimate of the radiance of a white point: ∫ L̃ cosθ/π dω and what comes from no surface.
    fn white(&self, s: &Surface, n: Vec3, random: &mut Random) -> Rgb {
        let ray = ray_from(s, n, random.unit2());
        let mut sum = self.along(s, n, &ray, None);
        if self.has_lamps {
            let (u_pick, u) = (random.unit(), random.unit2());
            let ne = self.scene.lights.sample_next_event(&self.scene.geometry, s.p, u_pick, u);
            if let Some(ne) = ne.filter(|ne| !ne.delta && ne.distance.is_finite() && n.dot(ne.w) > 0.0) {
                let ray = Ray { o: offset_origin(s.p, s.p_error, s.n_g, n), d: ne.w, t_max: f32::INFINITY };
                let more = self.along(s, n, &ray, Some(ne.point.emitter));
                (0..3).for_each(|c| sum[c] += more[c]);
            }
        }
        if !self.others.is_empty() {
            let sky = white_at(self.scene, s, n, &self.others, random.unit2(), random.unit2()).to_rgb();
            (0..3).for_each(|c| sum[c] += f64::from(sky[c]));
        }
        sum
    }

    /// What a ray brings: L̃ of the element it meets, times the cosine density over the sum of the
    /// densities of all that could have cast it. A next event counts where it meets the emitter meant.
    fn along(&self, s: &Surface, n: Vec3, ray: &Ray, meant: Option<EmitterId>) -> Rgb {
        let geometry = &self.scene.geometry;
        let Some(hit) = geometry.intersect(ray) else { return [0.0; 3] };
        let y = geometry.surface(ray, &hit);
        let cos_y = -y.n_g.dot(ray.d);
        let j = self.mesh.at(self.scene, &hit, &y, cos_y > 0.0);
        if j == VOID || meant.is_some_and(|e| e != y.emitter) {
            return [0.0; 3];
        }
        let p = hemisphere_cosine_p_w(n.dot(ray.d));
        let point = EmitterPoint::on_surface(&y);
        // Next events skip points that do not shine.
        let shines = y.emitter != EmitterId::NONE && cos_y > 0.0 && !self.scene.lights.radiance(&point, -ray.d).is_black();
        if meant.is_some() && !shines {
            return [0.0; 3];
        }
        let p_lamp = if shines {
            let nu = self.scene.lights.density_next_event(geometry, s.p, &point, ray.d);
            nu * (y.p - s.p).length_squared() / cos_y
        } else {
            0.0
        };
        let weight = f64::from(p / (p + p_lamp));
        if weight.is_finite() { self.radiance[j as usize].map(|l| l * weight) } else { [0.0; 3] }
    }
}

/// Mean square of the variation of Lᵉ + τL̃ within every element, times its area: what is to be gained by
/// splitting it. From `points` points, unbiased by the noise of the rays; may be negative by chance.
pub(super) fn variation(
    scene: &Scene,
    mesh: &Elements,
    sources: &Sources,
    radiance: &[Rgb],
    [points, rays]: [u32; 2],
    seed: u64,
) -> Vec<f64> {
    let probe = Probe::new(scene, mesh, radiance);
    let dark = |i: usize| sources.reflectance[i] == [0.0; 3] && sources.emitted[i] == [0.0; 3];
    let of = |i: usize| {
        if dark(i) {
            return 0.0;
        }
        let mut random = Random::new(Family::Elements, i as u64, 8, seed);
        let n = f64::from(points);
        let (mut sums, mut squares) = ([[0.0; 3]; 2], 0.0);
        for _ in 0..points {
            let [a, b] = probe.transported(i, rays, &mut random);
            for c in 0..3 {
                sums[0][c] += a[c];
                sums[1][c] += b[c];
                squares += a[c] * b[c];
            }
        }
        let product: f64 = (0..3).map(|c| sums[0][c] * sums[1][c]).sum();
        mesh.area(i) * (squares - product / n) / (n - 1.0)
    };
    (0..mesh.len()).into_par_iter().map(of).collect()
}
