//! Paths of length 1: lamps seen directly.
//!
//! A hit finds them where the ray of a pixel arrives on a lamp: without noise inside of one that is in focus, and hardly ever
//! on one that is smaller than a pixel or so far out of focus that most of the lens misses it. A splat begins at the
//! lens, picks a light point as a next event would, and goes to whichever pixel sees it. Weights that share
//! a path among joins ignore variance and would bring noise to the former; so each path belongs to the one of the two that makes
//! it more often, the maximum heuristic [Veach 1997, sec. 9.2.2].

use super::Record;
use super::class::Finished;
use super::mutant::{Mutant, planted};
use super::shoot::finish;
use super::walk::{Context, Observe, Tally, free};
use crate::math::Random;
use crate::scene::Scene;
use crate::scene::emitter::EmitterPoint;
use crate::scene::sensor::SensorConnection;
use crate::spectrum::Spectrum;
use glam::{Vec2, Vec3};

/// Whether splats make the path between `lens` and a light point more often than hits do; `w` is the unit direction from the
/// lens.
#[inline]
pub(super) fn is_splatted(cx: Context<'_>, lens: Vec3, point: &EmitterPoint, w: Vec3) -> bool {
    let (scene, plan) = (cx.scene, cx.plan);
    if !plan.shares_lamps || scene.sensor.is_orthographic() {
        return false;
    }
    // Steradians at the lens per m² of the light; of infinite light directions are counted themselves.
    let infinite = scene.lights.is_infinite(point.emitter);
    let per_area = if infinite { 1.0 } else { point.n_g.dot(w).abs() * scene.sensor.inv_d2(lens, point.y) };
    let nu = scene.lights.density_next_event(&scene.geometry, lens, point, w);
    splats_more(cx, nu, scene.sensor.density(w) * per_area) && !planted(Mutant::LampTwice)
}

/// Of one path: `nu` its density by a next event from the lens, `g` by a hit.
#[inline]
fn splats_more(cx: Context<'_>, nu: f32, g: f32) -> bool {
    cx.plan.n * nu > cx.plan.chain_samples() as f32 * g
}

/// The lens sees a light point.
#[inline]
pub(super) fn splat<R: Record, O: Observe>(cx: Context<'_>, random: &mut Random, tally: &mut Tally<'_, R, O>) {
    let (scene, plan) = (cx.scene, cx.plan);
    let (u_pick, u, u_lens) = (random.unit(), random.unit2(), random.unit2());
    let seen = if plan.shares_lamps { beside_hits(cx, u_pick, u, u_lens) } else { alone(cx, u_pick, u, u_lens) };
    let Some((point, c, value)) = seen else { return };
    let value = value * plan.inv_light_paths;
    if value.is_black() {
        return;
    }
    tally.rays.shadow += 1;
    let visible = if scene.lights.is_infinite(point.emitter) {
        scene.geometry.visible_infinite(free(c.end), -point.n_g)
    } else {
        scene.geometry.visible((point.y, point.y_error, point.n_g), free(c.end))
    };
    if visible {
        let path = Finished {
            from_eye: plan.settings.paths.eye(),
            from_light: plan.settings.paths.light(),
            length: 1,
            first_delta: false,
            last_delta: false,
            light_delta: false,
        };
        finish(cx, path, c, (value, 1.0, point.emitter), c.end, random, tally);
    }
}

/// A light point, where the lens sees it, and the measurement over its density.
type Seen = Option<(EmitterPoint, SensorConnection, Spectrum)>;

/// Where the lens sees a light point.
#[inline]
fn connect(scene: &Scene, point: &EmitterPoint, u_lens: Vec2) -> Option<SensorConnection> {
    if scene.lights.is_infinite(point.emitter) {
        scene.sensor.connect_infinite(point.n_g, u_lens)
    } else {
        scene.sensor.connect(point.y, u_lens)
    }
}

/// Picked from a point of the lens, unless hits find it more often.
#[inline]
fn beside_hits(cx: Context<'_>, u_pick: f32, u: Vec2, u_lens: Vec2) -> Seen {
    let scene = cx.scene;
    let lens = scene.sensor.lens_point(u_lens)?;
    let ne = scene.lights.sample_next_event(&scene.geometry, lens, u_pick, u)?;
    if ne.delta {
        return None;
    }
    let c = connect(scene, &ne.point, u_lens)?;
    splats_more(cx, ne.nu, c.g_dir * ne.g).then(|| (ne.point, c, ne.radiance * (c.g_dir * ne.g / ne.nu)))
}

/// Picked by power, where there are no hits: whatever the lens can see must be possible.
#[inline]
fn alone(cx: Context<'_>, u_pick: f32, u: Vec2, u_lens: Vec2) -> Seen {
    let scene = cx.scene;
    let (point, p_k) = scene.lights.sample_point(&scene.geometry, u_pick, u)?;
    let c = connect(scene, &point, u_lens)?;
    let cos = if scene.lights.is_infinite(point.emitter) { 1.0 } else { point.n_g.dot(c.w).abs() };
    let radiance = scene.lights.radiance(&point, c.w);
    Some((point, c, radiance * (c.g_dir * cos * c.inv_d2 / p_k)))
}
