//! The shooting walk: expands `W = Wᵉ + τ'W` from the lights.
//!
//! With splats alone this is light tracing [Arvo 1986; Dutré 1993]; its vertices also feed the
//! cache that gathering walks connect to and merge with.

use super::cache::LightVertex;
use super::class::{Finished, Symbol};
use super::lamp;
use super::mis::{self, Partial};
use super::vertex::Vertex;
use super::walk::{Chain, Context, Join, Observe, Tally, Walk, end, free, spawn};
use super::{Contribution, Record, Technique};
use crate::local::{Breadth, Equation};
use crate::math::Random;
use crate::scene::EmitterId;
use crate::scene::emitter::Emission;
use crate::scene::geometry::{Ray, offset_origin};
use crate::scene::sensor::SensorConnection;
use crate::spectrum::Spectrum;
use glam::{Vec2, Vec3};

const EQUATION: Equation = Equation::Potential;

/// What decides where a light path starts; the first axes of its random numbers.
#[derive(Clone, Copy, Debug)]
pub struct Draws {
    /// Direction from the light.
    pub direction: Vec2,
    /// Place on it, or across the direction.
    pub position: Vec2,
    /// Which light.
    pub pick: f32,
}

impl Draws {
    /// The next of a light path that begins. Direction and position are the four axes that are most evenly filled.
    #[inline]
    pub fn of(random: &mut Random) -> Self {
        Self { direction: random.axis2(), position: random.axis2(), pick: random.axis() }
    }
}

/// One light path; its vertices are appended to `cache` where connections or merges want them.
pub fn shoot<R: Record, O: Observe>(
    cx: Context<'_>,
    cache: Option<&mut Vec<LightVertex>>,
    random: &mut Random,
    tally: &mut Tally<'_, R, O>,
) {
    let (scene, plan) = (cx.scene, cx.plan);
    if plan.settings.techniques.splat && plan.wants_length(1) {
        lamp::splat(cx, random, tally);
    }
    let u = Draws::of(random);
    let Some(start) = scene.lights.sample_emission(&scene.geometry, &plan.guide, u.pick, u.position, u.direction) else {
        tally.rays.shoot_walks += 1;
        return;
    };
    emit(cx, &start, cache, random, tally);
}

/// The same from a given start: with splats alone it may be anywhere, and estimates the potential of
/// its direction times its weight.
#[inline]
pub fn emit<R: Record, O: Observe>(
    cx: Context<'_>,
    start: &Emission,
    mut cache: Option<&mut Vec<LightVertex>>,
    random: &mut Random,
    tally: &mut Tally<'_, R, O>,
) {
    let (scene, plan) = (cx.scene, cx.plan);
    tally.rays.shoot_walks += 1;
    tally.observe.started(start.point.y, Some(start));
    let h = plan.settings.heuristic;
    let d = &start.density;
    let hits = plan.settings.techniques.hit && !start.delta;
    let cos_from = if start.infinite || start.delta { 1.0 } else { start.point.n_g.dot(start.w).abs() };
    let mut walk = Walk {
        throughput: start.weight,
        guided: 1.0,
        k: if hits { 1.0 / h.raise(d.p_k) } else { 0.0 },
        p: d.p_next,
        delta: false,
        breadth: Breadth::Wide,
        clear: true,
        merges: None,
        merge: 0.0,
        from: start.point.y,
        cos_from,
        parallel: start.infinite,
        length: 0,
        eta: 1.0,
        class: plan.settings.paths.light(),
        first_delta: false,
        chain: Chain::Ended,
    };
    let flux = start.weight.max_lane();
    let o = offset_origin(start.point.y, start.point.y_error, if start.infinite { Vec3::ZERO } else { start.point.n_g }, start.w);
    let mut ray = Ray { o, d: start.w, t_max: f32::INFINITY };
    loop {
        tally.rays.shoot += 1;
        let Some(hit) = scene.geometry.intersect(&ray) else { return };
        let surface = scene.geometry.surface(&ray, &hit);
        let length = walk.length + 1;
        let arrival = walk.arrive(&surface, ray.d);
        tally.observe.arrived(&surface);
        let vertex = Vertex::shooting(scene, plan.incident(), surface, -ray.d);
        let count = if walk.length == 0 {
            if plan.settings.techniques.next_event {
                scene.lights.density_next_event(&scene.geometry, surface.p, &start.point, -ray.d) / d.p_k
            } else {
                0.0
            }
        } else if walk.delta {
            0.0
        } else {
            plan.c
        };
        let sums = walk.partial(cx, arrival, count, vertex.breadth);
        let merges = (walk.breadth.is_narrow() && vertex.breadth > Breadth::Sharp).then_some(vertex.breadth.is_focused());
        if !vertex.closure.is_delta() {
            if plan.settings.techniques.splat && (length > 1 || plan.splat_direct) {
                // From here to the eye there is no other event.
                splat(cx, &walk, &vertex, sums.at(vertex.breadth.is_focused()), start, random, tally);
            }
            if let Some(cache) = cache.as_mut()
                && length + 2 <= plan.settings.max_length
                && (plan.settings.techniques.connect || merges.is_some())
            {
                cache.push(LightVertex {
                    surface,
                    w_back: vertex.w_back,
                    by_material: if vertex.breadth.is_focused() { sums.merged } else { vertex.learned_back() },
                    throughput: walk.throughput,
                    partial: sums.partial,
                    length: length as u16,
                    class: walk.class,
                    first_delta: walk.first_delta,
                    emitter: start.point.emitter,
                    merges,
                });
                if let Some(v) = cache.last() {
                    tally.observe.cached(v);
                }
            }
        }
        // The next vertex would end paths of at least length + 2 edges.
        if length + 2 > plan.settings.max_length {
            return;
        }
        let (u_lobe, u) = (random.axis(), random.axis2());
        let Some(s) = vertex.scatter(EQUATION, u_lobe, u) else { return };
        tally.observe.scattered(&s);
        walk.leave(cx, EQUATION, &vertex, sums, &s);
        // Radiance is scaled by η² across a boundary, flux is not: roulette looks at flux.
        walk.eta = 1.0;
        walk.classify(&plan.settings.paths, EQUATION, s.delta);
        if !walk.survives(plan, flux, random) {
            return;
        }
        ray = spawn(&vertex.surface, s.w_next);
    }
}

/// The lens sees `vertex`.
#[inline]
fn splat<R: Record, O: Observe>(
    cx: Context<'_>,
    walk: &Walk,
    vertex: &Vertex<'_>,
    partial: Partial<f32>,
    start: &Emission,
    random: &mut Random,
    tally: &mut Tally<'_, R, O>,
) {
    let (scene, plan) = (cx.scene, cx.plan);
    let u_lens = random.unit2();
    let length = walk.length + 2;
    if !plan.wants_length(length) {
        return;
    }
    let Some(c) = scene.sensor.connect(vertex.surface.p, u_lens) else { return };
    let Some(k) = vertex.kernel(EQUATION, c.w) else { return };
    let h = plan.settings.heuristic;
    let g1 = c.g_dir * k.cos_g * c.inv_d2;
    let weight = mis::splat(h, plan.n_at(c.raster), g1, partial.at(h, k.p_w_rev));
    let value = walk.throughput * k.value * (c.inv_d2 * c.g_dir * plan.inv_light_paths * weight);
    if value.is_black() {
        return;
    }
    tally.rays.shadow += 1;
    if !scene.geometry.visible(end(&vertex.surface), free(c.end)) {
        return;
    }
    let path = Finished {
        from_eye: plan.settings.paths.eye(),
        from_light: plan.settings.paths.backward(walk.class, Symbol::D),
        length,
        first_delta: false,
        last_delta: walk.first_delta,
        light_delta: start.delta,
    };
    let lens = vertex.surface.p + c.w / c.inv_d2.sqrt();
    finish(cx, path, c, (value, weight, start.point.emitter), lens, random, tally);
}

/// Hands on a finished path if it counts.
#[inline]
pub(super) fn finish<R: Record, O: Observe>(
    cx: Context<'_>,
    path: Finished,
    c: SensorConnection,
    (value, weight, emitter): (Spectrum, f32, EmitterId),
    lens: Vec3,
    random: &mut Random,
    tally: &mut Tally<'_, R, O>,
) {
    if cx.plan.settings.paths.accepts(&path) {
        let (technique, length) = (Technique::Splat, path.length);
        // The lens is the one vertex that shooting did not make.
        let contribution = Contribution { value, weight, length, light_vertices: length, technique, emitter };
        tally.record.splatted(c.raster, random, contribution);
        tally.observe.joined(Join {
            technique,
            weight,
            length,
            light: None,
            emitter,
            light_delta: path.light_delta,
            light_vertex: 0,
            lens,
            value,
        });
    }
}
