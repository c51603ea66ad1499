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
//! noise, and all Dirac events are followed ([`super::branch`]).

use super::branch::{Branch, Branches};
use super::class::{Finished, Positions, Symbol};
use super::vertex::Vertex;
use super::walk::{Context, Observe, Tally, sees_light};
use super::{Contribution, Record, Technique};
use crate::local::Equation;
use crate::math::Random;
use crate::scene::EmitterId;
use crate::scene::emitter::EmitterPoint;
use crate::spectrum::Spectrum;
use glam::Vec2;

const EQUATION: Equation = Equation::Rendering;
/// Events of a path at which all directions are followed.
const BRANCHING: u32 = 6;

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
    let mut open = Branches::new(BRANCHING);
    open.start(Branch::from_lens(&start, weight, &cx.plan.settings.paths));
    while let Some(branch) = open.take() {
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
    fn take<R: Record, O: Observe>(&self, open: &mut Branches, random: &mut Random, tally: &mut Tally<'_, R, O>) {
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
        open.split(&b, &vertex, &plan.settings.paths, random);
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
            let Some(ne) = scene.lights.next_event_of(emitter, &scene.geometry, vertex.surface.p, u) else {
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
