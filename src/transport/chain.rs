//! Chains of Dirac events between eye and light, the paths E S+ L, with all their branches.
//!
//! Nothing but a hit makes these paths. A walk that follows one event at random finds the rare ones, a lamp
//! mirrored twice in the glass around it, once in ten thousand samples, at its full radiance. So where such a
//! walk comes to the first vertex at which it would have to choose, all chains from there are followed here
//! instead, and the walk itself finds no light until a wider event.
//!
//! What is smaller than a pixel, a lamp mirrored in a handle, is still found by few samples, in the same full radiance.
//! Chains are cheap, so a pixel can have more samples of them than walks ([`sample`]).

use super::Record;
use super::branch::{Branch, Branches};
use super::gather::chain_hit;
use super::vertex::Vertex;
use super::walk::{Context, Observe, Tally, Walk};
use crate::math::Random;
use crate::scene::EmitterId;
use crate::scene::emitter::EmitterPoint;
use crate::scene::geometry::Ray;
use glam::{Vec2, Vec3};

/// After so many events, where mirrors could go on for ever, branches are followed with a probability only,
const LONG: u32 = 16;
/// with this one.
const GOES_ON: f32 = 0.9;

/// Follows the chains of Dirac events that go on from `vertex`, at which `walk` has arrived by such events
/// alone; false (and nothing is followed) where there is no more than one way on. `weight` is what the walk
/// began with.
pub fn follow<R: Record, O: Observe>(
    cx: Context<'_>,
    walk: &Walk,
    vertex: &Vertex<'_>,
    weight: f32,
    random: &mut Random,
    tally: &mut Tally<'_, R, O>,
) -> bool {
    let filter = &cx.plan.settings.paths;
    let mut open = Branches::new(u32::MAX);
    let here = Branch {
        ray: Ray { o: vertex.surface.p, d: vertex.w_back, t_max: 0.0 },
        throughput: walk.throughput,
        eta: walk.eta,
        length: walk.length,
        class: walk.class,
        first_delta: walk.first_delta,
        last_delta: walk.delta,
        event: None,
    };
    let ways = open.split(&here, vertex, filter, random);
    if ways == 0 || (ways == 1 && vertex.closure.is_delta()) {
        return false;
    }
    explore(cx, &mut open, (walk.from, weight), random, tally);
    tally.observe.returned(walk.length as usize);
    tally.observe.arrived(&vertex.surface);
    true
}

/// One sample of all paths E S* L of the pixel seen at `raster`, `weight` the factor of its reconstruction filter.
pub fn sample<R: Record, O: Observe>(
    cx: Context<'_>,
    raster: Vec2,
    weight: f32,
    random: &mut Random,
    tally: &mut Tally<'_, R, O>,
) {
    let start = cx.scene.sensor.sample_ray(raster, random.axis2());
    tally.observe.started(start.lens, None);
    let mut open = Branches::new(u32::MAX);
    open.start(Branch::from_lens(&start, weight, &cx.plan.settings.paths));
    explore(cx, &mut open, (start.lens, weight), random, tally);
}

/// Follows all that is open, and what becomes of it.
fn explore<R: Record, O: Observe>(
    cx: Context<'_>,
    open: &mut Branches,
    (lens, weight): (Vec3, f32),
    random: &mut Random,
    tally: &mut Tally<'_, R, O>,
) {
    let (scene, plan) = (cx.scene, cx.plan);
    while let Some(mut branch) = open.take() {
        // Radiance is scaled by η² inside glass, what it carries is not.
        let share = branch.throughput.max_lane() * branch.eta * branch.eta / weight;
        let faint = plan.settings.faint;
        if share < faint {
            // Not so for NaN, which ends here.
            if !(random.unit() * faint < share) {
                continue;
            }
            branch.throughput *= faint / share;
        }
        if branch.length > LONG {
            if random.unit() >= GOES_ON {
                continue;
            }
            branch.throughput /= GOES_ON;
        }
        if let Some((surface, event)) = &branch.event {
            tally.observe.returned(branch.length as usize - 1);
            tally.observe.arrived(surface);
            tally.observe.scattered(event);
        }
        tally.observe.followed(share);
        tally.rays.gather += 1;
        let Some(hit) = scene.geometry.intersect(&branch.ray) else {
            scene.lights.environment(branch.ray.d, |emitter, radiance| {
                chain_hit(cx, (lens, &branch), &EmitterPoint::at_infinity(emitter, branch.ray.d), radiance, tally);
            });
            continue;
        };
        let surface = scene.geometry.surface(&branch.ray, &hit);
        if surface.emitter != EmitterId::NONE {
            let point = EmitterPoint::on_surface(&surface);
            chain_hit(cx, (lens, &branch), &point, scene.lights.radiance(&point, -branch.ray.d), tally);
        }
        if branch.length + 1 < plan.settings.max_length && scene.materials.has_delta(surface.material) {
            tally.observe.arrived(&surface);
            open.split(&branch, &Vertex::new(scene, surface, -branch.ray.d), &plan.settings.paths, random);
        }
    }
}
