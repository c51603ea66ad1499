//! One application of τ or τ', written by its definition instead of by the walks.
//!
//! ```text
//! (τL)(x, w_o)  = ∫ L(h(x, w_i), −w_i) f(w_i, w_o) |w_i·n_s| dw_i        + what Dirac lights add
//! (τ'W)(y, ω)   = ∫ W(z, w_o) f(−ω, w_o) |w_o·n| dw_o,  z = h(y, ω)      + what the lens sees of z
//! ```
//!
//! As little as possible is shared with the walk that it tests. The direction is uniform over the sphere
//! in half of the cases. The kernel is evaluated as the *other* walker has it, its coefficient at a Dirac
//! event is the one that the other walker finds on its way back, with the factor n² that parts radiance
//! from flux. Lamps are sampled by their area, evenly, Dirac lights are enumerated; the density of a pixel
//! comes from the ray through it.

use crate::local::Equation;
use crate::math::Random;
use crate::math::warp;
use crate::scene::{EmitterId, Scene, Surface};
use crate::spectrum::Spectrum;
use crate::transport::vertex::{Scatter, Vertex};
use crate::transport::walk::{end, free, sees_light};
use glam::Vec3;

/// A direction into which the integral goes on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    /// Unit direction, world.
    pub w: Vec3,
    /// Kernel over density: the factor on what is found along `w`.
    pub factor: Spectrum,
    /// A Dirac event.
    pub delta: bool,
}

/// Share of directions that are uniform over the sphere.
const UNIFORM: f32 = 0.5;

/// One sample of the integral at `vertex`, reached by the walker of `equation`; `None` = zero.
pub(super) fn step(scene: &Scene, equation: Equation, vertex: &Vertex<'_>, random: &mut Random) -> Option<Step> {
    let (u_choice, u_lobe, u) = (random.unit(), random.unit(), random.unit2());
    let share = if vertex.closure.is_delta() { 0.0 } else { UNIFORM };
    let w = if u_choice < share {
        warp::sphere_uniform(u)
    } else {
        let s = vertex.scatter(equation, u_lobe, u)?;
        if s.delta {
            let factor = dirac(scene, equation, vertex, &s)? * (1.0 / (s.p * (1.0 - share)));
            return Some(Step { w: s.w_next, factor, delta: true });
        }
        s.w_next
    };
    let p_w = vertex.closure.density(vertex.back, vertex.frame.to_local(w));
    let density = share * warp::SPHERE_UNIFORM_P_W + (1.0 - share) * p_w;
    Some(Step { w, factor: kernel(scene, equation, vertex, w)? * (1.0 / density), delta: false })
}

/// The same vertex as the other walker reaches it, along `w`.
fn seen_from<'a>(scene: &'a Scene, vertex: &Vertex<'_>, w: Vec3) -> Vertex<'a> {
    Vertex::new(scene, vertex.surface, w)
}

const fn other(equation: Equation) -> Equation {
    match equation {
        Equation::Rendering => Equation::Potential,
        Equation::Potential => Equation::Rendering,
    }
}

/// `f |w_next·n|` without Dirac events, from the other walker's kernel `f |w_back·n|`: the two differ by the
/// geometric cosines of both directions.
pub(super) fn kernel(scene: &Scene, equation: Equation, vertex: &Vertex<'_>, w: Vec3) -> Option<Spectrum> {
    let k = seen_from(scene, vertex, w).kernel(other(equation), vertex.w_back)?;
    Some(k.value * (w.dot(vertex.surface.n_g) / vertex.cos_g_back).abs())
}

/// Coefficient of the Dirac event `s`, from the other walker's on its way back.
fn dirac(scene: &Scene, equation: Equation, vertex: &Vertex<'_>, s: &Scatter) -> Option<Spectrum> {
    /// Numbers tried to find the lobe that leads back; rarer lobes count with their own coefficient.
    const TRIED: u32 = 256;
    let from_there = seen_from(scene, vertex, s.w_next);
    let back = (0..TRIED).find_map(|i| {
        let u_lobe = (i as f32 + 0.5) / TRIED as f32;
        let back = from_there.scatter(other(equation), u_lobe, glam::Vec2::splat(0.5))?;
        (back.delta && back.w_next.dot(vertex.w_back) > 1.0 - 1e-4).then_some(back)
    });
    let Some(back) = back else { return Some(s.weight * s.p) };
    let coefficient = back.weight * back.p;
    if s.w_next == -vertex.w_back {
        return Some(coefficient);
    }
    // |w_i·n_s|/|w_i·n_g| · |w_o·n_g|/|w_o·n_s|, which flux has and radiance has not.
    let (n_g, n_s) = (vertex.surface.n_g, vertex.surface.n_s);
    let ratio = |w: Vec3| (w.dot(n_s) / w.dot(n_g)).abs();
    let (w_i, w_o) = equation.orient(vertex.w_back, s.w_next);
    let shading = ratio(w_i) / ratio(w_o);
    Some(match equation {
        Equation::Rendering => coefficient * (1.0 / (shading * s.eta * s.eta)),
        Equation::Potential => coefficient * (shading * back.eta * back.eta),
    })
}

/// What Dirac lights add to τLᵉ at `vertex`: they have no area that a direction could meet.
pub(super) fn dirac_lights(scene: &Scene, lights: &[EmitterId], vertex: &Vertex<'_>, random: &mut Random) -> Spectrum {
    /// So many are all asked; of more, so many by chance.
    const ASKED: usize = 8;
    let mut sum = Spectrum::BLACK;
    for i in 0..lights.len().min(ASKED) {
        let all = lights.len() <= ASKED;
        let id = if all { lights[i] } else { lights[random.below(lights.len() as u32) as usize] };
        let x = &vertex.surface;
        let next = scene.lights.next_event_of(id, &scene.geometry, x.p, random.unit2());
        let Some((ne, f)) = next.and_then(|ne| Some((ne, kernel(scene, Equation::Rendering, vertex, ne.w)?))) else { continue };
        if sees_light(scene, x, &ne) {
            sum += f * ne.radiance * (ne.g / ne.nu);
        }
    }
    sum * (lights.len().max(1) as f32 / lights.len().clamp(1, ASKED) as f32)
}

/// What lamps add to τLᵉ at `vertex`, as an integral over their area: `∫ Lᵉ f |cosθ_x| |cosθ_y| / d² V dy`.
pub(super) fn lamps(scene: &Scene, vertex: &Vertex<'_>, random: &mut Random) -> Spectrum {
    let x = &vertex.surface;
    let Some((y, p)) = scene.lights.sample_point(&scene.geometry, random.unit(), random.unit2()) else { return Spectrum::BLACK };
    let d = y.y - x.p;
    let w = d.normalize_or_zero();
    let radiance = scene.lights.radiance(&y, -w);
    if scene.lights.is_infinite(y.emitter) || radiance.is_black() {
        return Spectrum::BLACK;
    }
    let Some(f) = kernel(scene, Equation::Rendering, vertex, w) else { return Spectrum::BLACK };
    if !scene.geometry.visible(end(x), (y.y, y.y_error, y.n_g)) {
        return Spectrum::BLACK;
    }
    f * radiance * (y.n_g.dot(w).abs() / (d.length_squared() * p))
}

/// `∫ Wᵉ(z, w_o) f(−ω, w_o) |w_o·n| dw_o` of the whole film (widened by its filter).
pub(super) fn lens(scene: &Scene, vertex: &Vertex<'_>, random: &mut Random) -> Spectrum {
    let z: &Surface = &vertex.surface;
    let u_lens = random.unit2();
    let seen = scene.sensor.connect(z.p, u_lens).and_then(|c| Some((c, kernel(scene, Equation::Potential, vertex, c.w)?)));
    let Some((c, f)) = seen else { return Spectrum::BLACK };
    let ray = scene.sensor.sample_ray(c.raster, u_lens);
    if !scene.geometry.visible(end(z), free(ray.o)) {
        return Spectrum::BLACK;
    }
    f * (scene.sensor.density(ray.d) * scene.sensor.inv_d2(ray.lens, z.p))
}
