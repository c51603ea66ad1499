//! Part of the coupling, or none: ideal reflections and refractions are followed, everything else is
//! lit by the lights alone.
//!
//! ```text
//! L(x, ω) ≈ Lᵉ(x, ω) + Σ_lights ∫_Ω L_light f cosθ dw_i + L_a a(x, ω) + k_r L(x_r, ω_r) + k_t L(x_t, ω_t)
//! ```
//!
//! These are the paths E S* D? L: any number of Dirac events and at most one other [Whitted 1980]. Cut off
//! after two edges they are local illumination: L replaced by the abstract light sources, with
//! visibility or without. The coupling between diffuse surfaces, caustics and bleeding colours are what
//! is left out.
//!
//! At each vertex every light is asked, not one at random, so that points, spots and parallel light bring no
//! noise, and both Dirac events are followed, not one at random. Branching doubles the work, so after
//! `BRANCHING` events one of them is chosen; that keeps the expectation and bounds memory.

use super::class::{Finished, Positions, Symbol};
use super::vertex::Vertex;
use super::walk::{Context, Observe, Tally, sees_light, spawn};
use super::{Contribution, Record, Technique};
use crate::local::Equation;
use crate::math::Random;
use crate::scene::EmitterId;
use crate::scene::emitter::EmitterPoint;
use crate::scene::geometry::Ray;
use crate::spectrum::Spectrum;
use arrayvec::ArrayVec;
use glam::{Vec2, Vec3};

const EQUATION: Equation = Equation::Rendering;
/// Dirac events of a path at which all directions are followed.
const BRANCHING: u32 = 6;
/// Directions that a vertex can have: two of each lobe.
const CHILDREN: usize = 2 * crate::local::composite::MAX_LOBES;
/// Rays that can wait while the first is followed.
const WAITING: usize = BRANCHING as usize * (CHILDREN - 1) + 1;

/// A ray that is still to be followed.
#[derive(Clone, Copy, Debug)]
struct Branch {
    ray: Ray,
    throughput: Spectrum,
    /// Edges so far.
    length: u32,
    class: Positions,
    first_delta: bool,
    last_delta: bool,
}

/// One sample of the pixel seen at `raster`, `weight` the factor of its reconstruction filter. `shadows`:
/// lights are seen only where nothing is between.
pub fn recursive<R: Record, O: Observe>(
    cx: Context<'_>,
    raster: Vec2,
    weight: f32,
    shadows: bool,
    random: &mut Random,
    tally: &mut Tally<'_, R, O>,
) {
    tally.rays.gather_walks += 1;
    let start = cx.scene.sensor.sample_ray(raster, random.unit2());
    let mut open: ArrayVec<Branch, WAITING> = ArrayVec::new();
    open.push(Branch {
        ray: Ray { o: start.o, d: start.d, t_max: start.t_max },
        throughput: Spectrum::ONE * weight,
        length: 0,
        class: cx.plan.settings.paths.eye(),
        first_delta: false,
        last_delta: false,
    });
    while let Some(branch) = open.pop() {
        Step { cx, branch, shadows }.take(&mut open, random, tally);
    }
}

/// One ray with what it finds.
struct Step<'a> {
    cx: Context<'a>,
    branch: Branch,
    shadows: bool,
}

impl Step<'_> {
    #[inline]
    fn take<R: Record, O: Observe>(
        &self,
        open: &mut ArrayVec<Branch, WAITING>,
        random: &mut Random,
        tally: &mut Tally<'_, R, O>,
    ) {
        let (scene, plan, b) = (self.cx.scene, self.cx.plan, self.branch);
        tally.rays.gather += 1;
        let Some(hit) = scene.geometry.intersect(&b.ray) else {
            scene.lights.environment(b.ray.d, |emitter, radiance| self.see(emitter, radiance, tally));
            return;
        };
        let surface = scene.geometry.surface(&b.ray, &hit);
        if surface.emitter != EmitterId::NONE {
            let radiance = scene.lights.radiance(&EmitterPoint::on_surface(&surface), -b.ray.d);
            self.see(surface.emitter, radiance, tally);
        }
        if b.length + 1 >= plan.settings.max_length {
            return;
        }
        let vertex = Vertex::new(scene, surface, -b.ray.d);
        if !vertex.closure.is_delta() && plan.wants_length(b.length + 2) {
            self.light(&vertex, random, tally);
            self.ambient(&vertex, random, tally);
        }
        self.follow(&vertex, open, random);
    }

    /// Follows all Dirac events, or one of them, chosen by what it scatters.
    fn follow(&self, vertex: &Vertex<'_>, open: &mut ArrayVec<Branch, WAITING>, random: &mut Random) {
        let b = self.branch;
        let mut events: ArrayVec<(Vec3, Spectrum), CHILDREN> = ArrayVec::new();
        vertex.each_dirac(EQUATION, |w_next, coefficient| {
            if coefficient.max_lane() > 0.0 {
                // There is room for two of each lobe.
                let _ = events.try_push((w_next, coefficient));
            }
        });
        let child = |(w_next, factor): (Vec3, Spectrum)| Branch {
            ray: spawn(&vertex.surface, w_next),
            throughput: b.throughput * factor,
            length: b.length + 1,
            class: self.cx.plan.settings.paths.forward(b.class, Symbol::S),
            first_delta: b.first_delta || b.length == 0,
            last_delta: true,
        };
        if b.length < BRANCHING || events.len() < 2 {
            // And room for all that branches so often.
            for event in events {
                let _ = open.try_push(child(event));
            }
            return;
        }
        let total: f32 = events.iter().map(|(_, c)| c.max_lane()).sum();
        let mut rest = random.unit() * total;
        let found = events.iter().find(|(_, c)| {
            rest -= c.max_lane();
            rest < 0.0
        });
        if let Some((w_next, c)) = found.or(events.last()) {
            let _ = open.try_push(child((*w_next, *c * (total / c.max_lane()))));
        }
    }

    /// The ray arrives on a light.
    #[inline]
    fn see<R: Record, O: Observe>(&self, emitter: EmitterId, radiance: Spectrum, tally: &mut Tally<'_, R, O>) {
        let b = self.branch;
        if radiance.is_black() || !self.cx.plan.wants_length(b.length + 1) {
            return;
        }
        let found = Found { technique: Technique::Hit, class: b.class, light_delta: false, last_delta: b.last_delta };
        self.finish(b.length + 1, b.throughput * radiance, emitter, found, tally);
    }

    /// Every light shines on the vertex.
    #[inline]
    fn light<R: Record, O: Observe>(&self, vertex: &Vertex<'_>, random: &mut Random, tally: &mut Tally<'_, R, O>) {
        let (scene, plan, b) = (self.cx.scene, self.cx.plan, self.branch);
        let class = plan.settings.paths.forward(b.class, Symbol::D);
        for i in 0..scene.lights.infos().len() as u32 {
            let emitter = EmitterId(i);
            let u = random.unit2();
            let Some(ne) = scene.lights.next_event_of(emitter, &scene.geometry, &plan.guide, vertex.surface.p, u) else {
                continue;
            };
            let Some(k) = vertex.kernel(EQUATION, ne.w) else { continue };
            let value = b.throughput * k.value * ne.radiance * (ne.g / ne.nu);
            if value.is_black() {
                continue;
            }
            if self.shadows {
                tally.rays.shadow += 1;
                if !sees_light(scene, &vertex.surface, &ne) {
                    continue;
                }
            }
            let found = Found { technique: Technique::NextEvent, class, light_delta: ne.delta, last_delta: false };
            self.finish(b.length + 2, value, emitter, found, tally);
        }
    }

    /// L_a a(x, ω): the same radiance from everywhere, nothing in its way. Mirrors see the scene instead.
    #[inline]
    fn ambient<R: Record, O: Observe>(&self, vertex: &Vertex<'_>, random: &mut Random, tally: &mut Tally<'_, R, O>) {
        let (scene, plan, b) = (self.cx.scene, self.cx.plan, self.branch);
        for (emitter, radiance) in scene.lights.ambient() {
            // The weight of a sampled direction has the albedo as its mean, and is it where surfaces are diffuse.
            let (u_lobe, u) = (random.unit(), random.unit2());
            let Some(s) = vertex.scatter(EQUATION, u_lobe, u).filter(|s| !s.delta) else { continue };
            let class = plan.settings.paths.forward(b.class, Symbol::D);
            let found = Found { technique: Technique::NextEvent, class, light_delta: true, last_delta: false };
            self.finish(b.length + 2, b.throughput * s.weight * *radiance, *emitter, found, tally);
        }
    }

    #[inline]
    fn finish<R: Record, O: Observe>(
        &self,
        length: u32,
        value: Spectrum,
        emitter: EmitterId,
        found: Found,
        tally: &mut Tally<'_, R, O>,
    ) {
        let path = Finished {
            from_eye: found.class,
            from_light: self.cx.plan.settings.paths.light(),
            length,
            first_delta: self.branch.first_delta,
            last_delta: found.last_delta,
            light_delta: found.light_delta,
        };
        if self.cx.plan.settings.paths.accepts(&path) {
            let light_vertices = u32::from(found.technique == Technique::NextEvent);
            let technique = found.technique;
            tally.record.gathered(Contribution { value, weight: 1.0, length, light_vertices, technique, emitter });
        }
    }
}

/// How a path ended.
struct Found {
    technique: Technique,
    class: Positions,
    light_delta: bool,
    last_delta: bool,
}
