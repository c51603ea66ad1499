//! The gathering walk: expands `L = Lᵉ + τL` from the sensor.
//!
//! With hits and next events alone this is path tracing [Kajiya 1986]; with the sums of [`super::mis`]
//! it is the eye's half of bidirectional path tracing [Veach 1997, ch. 10].

use super::branch::Branch;
use super::cache::{LightCache, LightEnd, LightVertex};
use super::chain;
use super::class::{Finished, Positions, Symbol};
use super::lamp;
use super::mis::{self, Partial};
use super::mutant::{Mutant, planted};
use super::split::{Other, Others, both_ways};
use super::vertex::{Scatter, Vertex};
use super::walk::{Arrival, Chain, Context, Join, Observe, Tally, Walk, end, sees_light, spawn};
use super::{Contribution, Record, Technique};
use crate::local::{Breadth, Equation};
use crate::math::Random;
use crate::scene::emitter::{EmitterPoint, NextEvent};
use crate::scene::geometry::Ray;
use crate::scene::sensor::SensorRay;
use crate::scene::{EmitterId, Surface};
use crate::spectrum::Spectrum;
use glam::{Vec2, Vec3};

const EQUATION: Equation = Equation::Rendering;

/// Vertices whose normals differ by more than about 25° do not lie on one surface.
const SAME_SURFACE: f32 = 0.9;

/// One sample of the pixel seen at `raster` (pixels of the whole film), `weight` the factor of its
/// reconstruction filter; `lights` are this pass's light vertices.
pub fn gather<R: Record, O: Observe>(
    cx: Context<'_>,
    raster: Vec2,
    weight: f32,
    lights: &LightCache,
    random: &mut Random,
    tally: &mut Tally<'_, R, O>,
) {
    let start = cx.scene.sensor.sample_ray(raster, random.axis2());
    follow(cx.at(raster), start, weight, lights, random, tally);
}

/// The same along a given ray: with hits and next events alone it may start anywhere, and estimates
/// `weight` times the radiance that arrives along it.
#[inline]
pub fn follow<R: Record, O: Observe>(
    cx: Context<'_>,
    start: SensorRay,
    weight: f32,
    lights: &LightCache,
    random: &mut Random,
    tally: &mut Tally<'_, R, O>,
) {
    let (scene, plan) = (cx.scene, cx.plan);
    tally.rays.gather_walks += 1;
    tally.observe.started(start.lens, None);
    let ray = Ray { o: start.o, d: start.d, t_max: start.t_max };
    // A ray that is none of the sensor's has no density by it; where such a ray may start, none is asked for.
    let p_sensor = scene.sensor.density(start.d);
    let walk = Walk {
        throughput: Spectrum::ONE * weight,
        guided: 1.0,
        k: 0.0,
        p: if p_sensor > 0.0 { p_sensor } else { 1.0 },
        delta: false,
        breadth: Breadth::Wide,
        clear: true,
        merges: None,
        merge: 0.0,
        from: start.lens,
        cos_from: 1.0,
        parallel: scene.sensor.is_orthographic(),
        length: 0,
        eta: 1.0,
        class: plan.settings.paths.eye(),
        first_delta: false,
        chain: if plan.settings.follows_chains() { Chain::Single } else { Chain::Ended },
    };
    let (mut next, mut others) = (Some((walk, ray)), Others::default());
    while let Some(way) = next {
        go_on(cx, way, (weight, lights), &mut others, random, tally);
        next = others.pop(tally.observe);
    }
}

/// Follows a walk, which began with `weight`, to its end; where it splits, the other ways wait among `others`.
#[inline]
fn go_on<R: Record, O: Observe>(
    cx: Context<'_>,
    (mut walk, mut ray): (Walk, Ray),
    (weight, lights): (f32, &LightCache),
    others: &mut Others,
    random: &mut Random,
    tally: &mut Tally<'_, R, O>,
) {
    let (scene, plan) = (cx.scene, cx.plan);
    loop {
        tally.rays.gather += 1;
        // Light vertices lie all over memory: the first is asked for while the ray is on its way.
        let picked = if plan.c > 0.0 { lights.pick(random) } else { None };
        let Some(hit) = scene.geometry.intersect(&ray) else {
            hit_environment(cx, &walk, ray.d, tally);
            return;
        };
        let surface = scene.geometry.surface(&ray, &hit);
        let length = walk.length + 1;
        let arrival = walk.arrive(&surface, ray.d);
        if surface.emitter != EmitterId::NONE {
            hit_emitter(cx, &walk, &surface, ray.d, arrival, tally);
        }
        if length >= plan.settings.max_length {
            return;
        }
        tally.observe.arrived(&surface);
        let vertex = Vertex::gathering(scene, plan.incident(), surface, -ray.d);
        let count = if walk.length == 0 {
            cx.n
        } else if walk.delta {
            0.0
        } else {
            plan.c
        };
        let sums = walk.partial(cx, arrival, count, vertex.breadth);
        if !vertex.closure.is_delta() {
            let partial = sums.at(vertex.breadth.is_narrow());
            if plan.settings.techniques.next_event {
                next_event(cx, &walk, &vertex, partial, random, tally);
            }
            if let Some(picked) = picked {
                connect(cx, &walk, &vertex, partial, (lights, picked), random, tally);
            }
            if walk.length > 0 && vertex.breadth > Breadth::Sharp && cx.merges() {
                merge(cx, &walk, &vertex, partial, lights, tally);
            }
        }
        if walk.chain == Chain::Single
            && vertex.closure.roughness() == 0.0
            && chain::follow(cx, &walk, &vertex, weight, random, tally)
        {
            walk.chain = Chain::Branched;
        }
        let (u, u_lobe) = (random.axis2(), random.axis());
        let mut leaves = |walk: &mut Walk, s: &Scatter| {
            walk.leave(cx, EQUATION, &vertex, sums, s);
            walk.classify(&plan.settings.paths, EQUATION, s.delta);
            walk.survives(plan, 1.0 / plan.settings.survival, random).then(|| spawn(&vertex.surface, s.w_next))
        };
        let s = match both_ways(cx, &walk, &vertex, weight, others) {
            Some([s, event]) => {
                let mut other = walk.clone();
                if let Some(ray) = leaves(&mut other, &event) {
                    others.push(Other { walk: other, ray, surface: vertex.surface, event });
                }
                Some(s)
            }
            None => vertex.scatter(EQUATION, u_lobe, u),
        };
        let Some(s) = s else { return };
        tally.observe.scattered(&s);
        let Some(next) = leaves(&mut walk, &s) else { return };
        ray = next;
    }
}

/// Hands on a finished path if it counts.
#[inline]
fn finish<R: Record, O: Observe>(
    cx: Context<'_>,
    path: Finished,
    value: Spectrum,
    join: Join<'_>,
    light_vertices: u32,
    tally: &mut Tally<'_, R, O>,
) {
    if cx.plan.settings.paths.accepts(&path) {
        let Join { weight, length, technique, emitter, .. } = join;
        tally.record.gathered(Contribution { value, weight, length, light_vertices, technique, emitter });
        tally.observe.joined(join);
    }
}

/// The walk arrived on an area light.
#[inline]
fn hit_emitter<R: Record, O: Observe>(
    cx: Context<'_>,
    walk: &Walk,
    surface: &Surface,
    d: Vec3,
    arrival: Arrival,
    tally: &mut Tally<'_, R, O>,
) {
    if !cx.plan.settings.techniques.hit || !cx.plan.wants_length(walk.length + 1) {
        return;
    }
    let point = EmitterPoint::on_surface(surface);
    let radiance = cx.scene.lights.radiance(&point, -d);
    if !radiance.is_black() {
        hit(cx, walk, &point, d, radiance, arrival, tally);
    }
}

/// The walk left the scene.
#[inline]
fn hit_environment<R: Record, O: Observe>(cx: Context<'_>, walk: &Walk, d: Vec3, tally: &mut Tally<'_, R, O>) {
    if !cx.plan.settings.techniques.hit || !cx.plan.wants_length(walk.length + 1) {
        return;
    }
    cx.scene.lights.environment(d, |emitter, radiance| {
        let point = EmitterPoint::at_infinity(emitter, d);
        hit(cx, walk, &point, d, radiance, Arrival { inv_d2: 1.0, p_a: walk.p }, tally);
    });
}

#[inline]
fn hit<R: Record, O: Observe>(
    cx: Context<'_>,
    walk: &Walk,
    point: &EmitterPoint,
    d: Vec3,
    radiance: Spectrum,
    arrival: Arrival,
    tally: &mut Tally<'_, R, O>,
) {
    let (scene, plan) = (cx.scene, cx.plan);
    if walk.chain == Chain::Branched && !planted(Mutant::ChainTwice) {
        return;
    }
    let length = walk.length + 1;
    let weight = if length == 1 {
        if lamp::is_splatted(cx, walk.from, point, d) {
            return;
        }
        1.0
    } else {
        let nu = if plan.settings.techniques.next_event && !walk.delta {
            scene.lights.density_next_event(&scene.geometry, walk.from, point, d)
        } else {
            0.0
        };
        let e = if plan.two_sided {
            let e = scene.lights.density_emission(&scene.geometry, &plan.guide, point, -d, walk.from);
            e.p_k * e.p_next * walk.cos_from * arrival.inv_d2
        } else {
            0.0
        };
        // Without splats among them, hits and next events share the paths of length 2.
        let k = if length == 2 && !plan.splat_direct { 0.0 } else { walk.k };
        mis::hit(plan.settings.heuristic, arrival.p_a, nu, e, k)
    };
    let part = if walk.chain == Chain::Single { cx.chain_part } else { 1.0 };
    let value = walk.throughput * radiance * (weight * part);
    arrived_on_light(cx, (walk.class, walk.first_delta, walk.delta), length, point, (value, weight), tally);
}

/// A chain of Dirac events arrived on a light: no other join makes its path.
pub(super) fn chain_hit<R: Record, O: Observe>(
    cx: Context<'_>,
    (lens, branch): (Vec3, &Branch),
    point: &EmitterPoint,
    radiance: Spectrum,
    tally: &mut Tally<'_, R, O>,
) {
    let length = branch.length + 1;
    if radiance.is_black() || !cx.plan.wants_length(length) {
        return;
    }
    if length == 1 && lamp::is_splatted(cx, lens, point, branch.ray.d) {
        return;
    }
    let value = branch.throughput * radiance * cx.chain_part;
    arrived_on_light(cx, (branch.class, branch.first_delta, branch.last_delta), length, point, (value, 1.0), tally);
}

/// Hands on a path that ends where its last ray arrived on a light; of its events the positions they reach, and
/// whether the first and the last are Dirac events.
#[inline]
fn arrived_on_light<R: Record, O: Observe>(
    cx: Context<'_>,
    (from_eye, first_delta, last_delta): (Positions, bool, bool),
    length: u32,
    point: &EmitterPoint,
    (value, weight): (Spectrum, f32),
    tally: &mut Tally<'_, R, O>,
) {
    let from_light = cx.plan.settings.paths.light();
    let path = Finished { from_eye, from_light, length, first_delta, last_delta, light_delta: false };
    let join = Join {
        technique: Technique::Hit,
        weight,
        length,
        light: Some(point),
        emitter: point.emitter,
        light_delta: false,
        light_vertex: 0,
        lens: Vec3::ZERO,
        value,
    };
    finish(cx, path, value, join, 0, tally);
}

/// Next events of `vertex`: a point of one light that is picked. Where the picture shows the vertex, be it in a mirror or through
/// glass, the expectation over the pick instead, if lights are few: a point of each. The weights are those of the pick.
#[inline]
fn next_event<R: Record, O: Observe>(
    cx: Context<'_>,
    walk: &Walk,
    vertex: &Vertex<'_>,
    partial: Partial<f32>,
    random: &mut Random,
    tally: &mut Tally<'_, R, O>,
) {
    /// Shifts the points for one light from those for another, so that each are as even [Roberts 2018, the plastic number].
    const SHIFT: Vec2 = Vec2::new(0.754_877_7, 0.569_840_3);
    let (geometry, lights) = (&cx.scene.geometry, &cx.scene.lights);
    let (u, u_pick) = (random.axis2(), random.axis());
    if !cx.plan.wants_length(walk.length + 2) {
        return;
    }
    let x = vertex.surface.p;
    let few = if walk.clear { lights.few() } else { &[] };
    if few.is_empty()
        && let Some(ne) = lights.sample_next_event(geometry, x, u_pick, u)
    {
        see(cx, walk, vertex, partial, (ne, 1.0), tally);
    }
    for (i, picked) in few.iter().enumerate() {
        if let Some(ne) = lights.next_event_from(geometry, x, *picked, (u + i as f32 * SHIFT).fract()) {
            let part = if planted(Mutant::FewLights) { 1.0 } else { picked.1 };
            see(cx, walk, vertex, partial, (ne, part), tally);
        }
    }
}

/// `vertex` sees a light point, unless something stands between; `part` of that counts.
#[inline]
fn see<R: Record, O: Observe>(
    cx: Context<'_>,
    walk: &Walk,
    vertex: &Vertex<'_>,
    partial: Partial<f32>,
    (mut ne, part): (NextEvent, f32),
    tally: &mut Tally<'_, R, O>,
) {
    let (scene, plan) = (cx.scene, cx.plan);
    let (x, length) = (&vertex.surface, walk.length + 2);
    if planted(Mutant::NextEventDensity) {
        ne.nu *= 1.5;
    }
    let Some(k) = vertex.kernel(EQUATION, ne.w) else { return };
    let h = plan.settings.heuristic;
    let g = if plan.settings.techniques.hit && !ne.delta { k.p_w * ne.g } else { 0.0 };
    let e = if plan.two_sided {
        let e = scene.lights.density_emission(&scene.geometry, &plan.guide, &ne.point, -ne.w, x.p);
        e.p_k * e.p_next * k.cos_g * ne.inv_d2
    } else {
        0.0
    };
    let sum = if length == 2 && !plan.splat_direct { 0.0 } else { partial.at(h, k.p_w_rev) };
    let weight = mis::next_event(h, ne.nu, g, e, sum);
    let value = walk.throughput * k.value * ne.radiance * (part * ne.g / ne.nu * weight);
    if value.is_black() {
        return;
    }
    tally.rays.shadow += 1;
    if !sees_light(scene, x, &ne) {
        return;
    }
    let path = Finished {
        from_eye: plan.settings.paths.forward(walk.class, Symbol::D),
        from_light: plan.settings.paths.light(),
        length,
        first_delta: walk.first_delta,
        last_delta: false,
        light_delta: ne.delta,
    };
    let join = Join {
        technique: Technique::NextEvent,
        weight,
        length,
        light: Some(&ne.point),
        emitter: ne.point.emitter,
        light_delta: ne.delta,
        light_vertex: 0,
        lens: Vec3::ZERO,
        value,
    };
    finish(cx, path, value, join, 1, tally);
}

/// Joins `vertex` to light vertices picked uniformly from the cache, `picked` the first of them.
#[inline]
fn connect<R: Record, O: Observe>(
    cx: Context<'_>,
    walk: &Walk,
    vertex: &Vertex<'_>,
    partial: Partial<f32>,
    (lights, mut picked): (&LightCache, (u32, &LightVertex)),
    random: &mut Random,
    tally: &mut Tally<'_, R, O>,
) {
    let (scene, plan) = (cx.scene, cx.plan);
    // The estimator uses this pass's own number of vertices, the weights the pilot's.
    let inv_prob = lights.len() as f32 * plan.inv_light_paths / plan.settings.connections as f32;
    let h = plan.settings.heuristic;
    for i in 0..plan.settings.connections {
        if i > 0 {
            let Some(next) = lights.pick(random) else { return };
            picked = next;
        }
        let (index, y) = picked;
        let length = walk.length + 2 + u32::from(y.length);
        if !plan.wants_length(length) {
            continue;
        }
        let d = y.surface.p - vertex.surface.p;
        let d2 = d.length_squared();
        if d2 <= 0.0 {
            continue;
        }
        let w = d / d2.sqrt();
        let Some(k_eye) = vertex.kernel(EQUATION, w) else { continue };
        let light = Vertex::again(scene, y.surface, y.w_back, y.by_material);
        let Some(k_light) = light.kernel(Equation::Potential, -w) else { continue };
        let inv_d2 = 1.0 / d2;
        // The vertex on the light's side of a merge is narrow; which of the two ends that is, is known here.
        let merged = |possible: bool, p, clear| if possible && cx.merges() { h.raise(cx.merge_count(p, clear)) } else { 0.0 };
        let clear = walk.clear && vertex.breadth.is_focused();
        let at_eye =
            merged(walk.length > 0 && vertex.breadth > Breadth::Sharp && light.breadth.is_narrow(), vertex.surface.p, walk.clear);
        let at_light = merged(y.merges.is_some(), y.surface.p, clear);
        let behind = if light.breadth.is_focused() && clear { y.partial.and(y.by_material) } else { y.partial };
        let weight = mis::connect(
            h,
            plan.c,
            k_light.p_w * k_eye.cos_g * inv_d2,
            partial.at(h, k_eye.p_w_rev) + at_eye,
            k_eye.p_w * k_light.cos_g * inv_d2,
            behind.at(h, k_light.p_w_rev) + at_light,
        );
        let value = walk.throughput * k_eye.value * y.throughput * k_light.value * (inv_d2 * inv_prob * weight);
        if value.is_black() {
            continue;
        }
        tally.rays.shadow += 1;
        if !scene.geometry.visible(end(&vertex.surface), end(&y.surface)) {
            continue;
        }
        meet(cx, walk, Technique::Connect, &y.end(index), length, (value, weight), tally);
    }
}

/// Hands on a path of two walks: the gathering one, and that which ends at light vertex `y`.
#[inline]
fn meet<R: Record, O: Observe>(
    cx: Context<'_>,
    walk: &Walk,
    technique: Technique,
    y: &LightEnd,
    length: u32,
    (value, weight): (Spectrum, f32),
    tally: &mut Tally<'_, R, O>,
) {
    let paths = &cx.plan.settings.paths;
    // A merged vertex is an event of the gathering walk already.
    let from_light = if technique == Technique::Merge { y.class } else { paths.backward(y.class, Symbol::D) };
    let light_delta = cx.scene.lights.is_delta(y.emitter);
    let path = Finished {
        from_eye: paths.forward(walk.class, Symbol::D),
        from_light,
        length,
        first_delta: walk.first_delta,
        last_delta: y.first_delta,
        light_delta,
    };
    let join = Join {
        technique,
        weight,
        length,
        light: None,
        emitter: y.emitter,
        light_delta,
        light_vertex: y.index as usize,
        lens: Vec3::ZERO,
        value,
    };
    finish(cx, path, value, join, u32::from(y.length) + 1, tally);
}

/// Merges `vertex` with the light vertices around it that narrow events led to.
fn merge<R: Record, O: Observe>(
    cx: Context<'_>,
    walk: &Walk,
    vertex: &Vertex<'_>,
    partial: Partial<f32>,
    lights: &LightCache,
    tally: &mut Tally<'_, R, O>,
) {
    let plan = cx.plan;
    let h = plan.settings.heuristic;
    // Of η, the area of the disk and the number of light paths.
    let factor = plan.light_paths as f32 * plan.inv_light_paths / cx.eta.count(walk.clear, 0.0);
    let mut count = None;
    lights.around(vertex.surface.p, cx.merge_radius2(walk.clear), |y| {
        let length = walk.length + 1 + u32::from(y.end.length);
        if !plan.wants_length(length) || y.cos_to(vertex.surface.n_g) < SAME_SURFACE {
            return;
        }
        let Some(k) = vertex.kernel(EQUATION, y.w_back) else { return };
        let count = *count.get_or_insert_with(|| cx.merge_count(vertex.surface.p, walk.clear));
        let weight = mis::merge(h, count, partial.at(h, k.p_w_rev), y.partial(walk.clear).at(h, k.p_w));
        // Flux per area is irradiance: the kernel's cosine is already in it.
        let cos_g = if planted(Mutant::MergeCosine) { 1.0 } else { k.cos_g };
        let value = walk.throughput * y.throughput() * k.value * (factor * weight / cos_g);
        if value.is_black() {
            return;
        }
        meet(cx, walk, Technique::Merge, &y.end, length, (value, weight), tally);
    });
}
