//! All emitters of a scene with the densities of choosing them: the four questions of transport.

use super::choice::Choice;
use super::{Emission, EmissionDensity, Emitter, EmitterInfo, EmitterPoint, NextEvent};
use crate::math::{Frame, warp};
use crate::scene::EmitterId;
use crate::scene::geometry::Geometry;
use crate::spectrum::Spectrum;
use crate::texture::Textures;
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// All emitters of a scene. Without any that could light something, every sample is `None`.
#[derive(Clone, Debug, Default)]
pub struct Lights {
    pub(super) emitters: Vec<Emitter>,
    pub(super) infos: Vec<EmitterInfo>,
    pub(super) textures: Textures,
    /// Emitters at infinity that can be hit.
    pub(super) skies: Vec<EmitterId>,
    pub(super) choice: Option<Choice>,
    /// Centre of the sphere around the scene.
    pub(super) center: Vec3,
    /// Its radius R.
    pub(super) radius: f32,
    /// 1/(πR²), m⁻².
    pub(super) p_across: f32,
}

impl Lights {
    /// A light point as seen from `x`: the emitter by `u_pick`, the point by `u`. `None` is a sample
    /// of value zero (nothing shines from there to x), not a missing sample.
    #[inline]
    pub fn sample_next_event(&self, geometry: &Geometry, x: Vec3, u_pick: f32, u: Vec2) -> Option<NextEvent> {
        let choice = self.choice.as_ref()?;
        let (i, prob, _) = choice.next_event.sample(u_pick);
        let prob_emission = choice.emission.prob(i);
        let emitter = EmitterId(i as u32);
        match &self.emitters[i] {
            Emitter::Area(area) => {
                let s = geometry.sample_toward(area.shape, x, u)?;
                let point = EmitterPoint { emitter, y: s.p, y_error: s.p_error, n_g: s.n_g, uv: s.uv };
                let (w, distance, inv_d2) = toward(x, s.p)?;
                let cos = -s.n_g.dot(w);
                let radiance = self.textures.eval(area.radiance, s.uv);
                if cos <= 0.0 || radiance.is_black() {
                    return None;
                }
                let emission = EmissionDensity { p_k: prob_emission * area.p_a, p_next: warp::hemisphere_cosine_p_w(cos) };
                let (g, nu) = (cos * inv_d2, prob * s.p_a);
                Some(NextEvent { point, w, distance, radiance, g, inv_d2, nu, delta: false, emission })
            }
            Emitter::Point(p) => self.finite_delta(emitter, x, p.position, prob, |_| (p.intensity, warp::SPHERE_UNIFORM_P_W)),
            Emitter::Spot(s) => {
                let value = |w: Vec3| (s.intensity(&self.textures, w), s.density(w));
                self.finite_delta(emitter, x, s.position, prob, value)
            }
            Emitter::Parallel(p) => {
                let emission = EmissionDensity { p_k: prob_emission, p_next: self.p_across };
                Some(self.infinite(emitter, -p.direction, p.irradiance, prob, emission, true))
            }
            Emitter::Sky(sky) => {
                let (w, p_w, radiance) = sky.sample(u);
                if p_w <= 0.0 || radiance.is_black() {
                    return None;
                }
                let emission = EmissionDensity { p_k: prob_emission * p_w, p_next: self.p_across };
                Some(self.infinite(emitter, w, radiance, prob * p_w, emission, false))
            }
            Emitter::Dark => None,
        }
    }

    /// Next event of a point or spot: `value` gives intensity and emission density of a direction.
    #[inline]
    fn finite_delta(
        &self,
        emitter: EmitterId,
        x: Vec3,
        y: Vec3,
        prob: f32,
        value: impl FnOnce(Vec3) -> (Spectrum, f32),
    ) -> Option<NextEvent> {
        let (w, distance, inv_d2) = toward(x, y)?;
        let (radiance, p_next) = value(-w);
        if radiance.is_black() {
            return None;
        }
        Some(NextEvent {
            point: EmitterPoint { emitter, y, y_error: 0.0, n_g: Vec3::ZERO, uv: Vec2::ZERO },
            w,
            distance,
            radiance,
            g: inv_d2,
            inv_d2,
            nu: prob,
            delta: true,
            emission: EmissionDensity { p_k: self.prob_emission(emitter), p_next },
        })
    }

    #[inline]
    fn infinite(
        &self,
        emitter: EmitterId,
        w: Vec3,
        radiance: Spectrum,
        nu: f32,
        emission: EmissionDensity,
        delta: bool,
    ) -> NextEvent {
        let point = EmitterPoint::at_infinity(emitter, w);
        NextEvent { point, w, distance: f32::INFINITY, radiance, g: 1.0, inv_d2: 1.0, nu, delta, emission }
    }

    /// ν of a light point as seen from `x` along the unit direction `w` (from x outwards): per m² of an
    /// area, per steradian of a sky, discrete for what cannot be hit.
    #[inline]
    pub fn density_next_event(&self, geometry: &Geometry, x: Vec3, point: &EmitterPoint, w: Vec3) -> f32 {
        let Some((choice, i)) = self.chosen(point.emitter) else { return 0.0 };
        let p = match &self.emitters[i] {
            Emitter::Area(area) => geometry.density_toward(area.shape, x, point.y, point.n_g),
            Emitter::Sky(sky) => sky.density(w),
            Emitter::Point(_) | Emitter::Spot(_) | Emitter::Parallel(_) => 1.0,
            Emitter::Dark => return 0.0,
        };
        choice.next_event.prob(i) * p
    }

    /// A light point and a direction of travel from it, with the flux they stand for.
    #[inline]
    pub fn sample_emission(&self, geometry: &Geometry, u_pick: f32, u_position: Vec2, u_direction: Vec2) -> Option<Emission> {
        let choice = self.choice.as_ref()?;
        let (i, prob, _) = choice.emission.sample(u_pick);
        let emitter = EmitterId(i as u32);
        match &self.emitters[i] {
            Emitter::Area(area) => {
                let s = geometry.sample_area(area.shape, u_position);
                let local = warp::hemisphere_cosine(u_direction);
                let w = Frame::around(s.n_g).to_world(local);
                let density = EmissionDensity { p_k: prob * area.p_a, p_next: warp::hemisphere_cosine_p_w(local.z) };
                // Lᵉ·cosθ / (p_k·p_next), in which the cosine cancels.
                let weight = self.textures.eval(area.radiance, s.uv) * (PI / density.p_k);
                if local.z <= 0.0 || weight.is_black() {
                    return None;
                }
                let point = EmitterPoint { emitter, y: s.p, y_error: s.p_error, n_g: s.n_g, uv: s.uv };
                Some(Emission { point, w, weight, density, delta: false, infinite: false })
            }
            Emitter::Point(p) => {
                let w = warp::sphere_uniform(u_direction);
                emit_from_point(emitter, p.position, w, p.intensity, warp::SPHERE_UNIFORM_P_W, prob)
            }
            Emitter::Spot(s) => {
                let (w, p_w) = s.sample(u_direction);
                emit_from_point(emitter, s.position, w, s.intensity(&self.textures, w), p_w, prob)
            }
            Emitter::Parallel(p) => self.emit_from_infinity(emitter, p.direction, p.irradiance, prob, u_position, true),
            Emitter::Sky(sky) => {
                let (w, p_w, radiance) = sky.sample(u_direction);
                self.emit_from_infinity(emitter, -w, radiance, prob * p_w, u_position, false)
            }
            Emitter::Dark => None,
        }
    }

    /// Starts on the disk behind the scene's sphere, across the direction of travel `w`.
    #[inline]
    fn emit_from_infinity(
        &self,
        emitter: EmitterId,
        w: Vec3,
        radiance: Spectrum,
        p_k: f32,
        u_position: Vec2,
        delta: bool,
    ) -> Option<Emission> {
        if p_k <= 0.0 || radiance.is_black() {
            return None;
        }
        let at = warp::disk_concentric(u_position) * self.radius;
        let frame = Frame::around(w);
        let y = self.center + frame.s * at.x + frame.t * at.y - w * self.radius;
        Some(Emission {
            point: EmitterPoint { emitter, y, y_error: 0.0, n_g: w, uv: Vec2::ZERO },
            w,
            weight: radiance * (1.0 / (p_k * self.p_across)),
            density: EmissionDensity { p_k, p_next: self.p_across },
            delta,
            infinite: true,
        })
    }

    /// Densities with which [`Self::sample_emission`] makes `point` and the direction of travel.
    #[inline]
    pub fn density_emission(&self, point: &EmitterPoint, w_travel: Vec3) -> EmissionDensity {
        let Some((choice, i)) = self.chosen(point.emitter) else { return EmissionDensity::default() };
        let prob = choice.emission.prob(i);
        match &self.emitters[i] {
            Emitter::Area(area) => {
                EmissionDensity { p_k: prob * area.p_a, p_next: warp::hemisphere_cosine_p_w(point.n_g.dot(w_travel)) }
            }
            Emitter::Point(_) => EmissionDensity { p_k: prob, p_next: warp::SPHERE_UNIFORM_P_W },
            Emitter::Spot(s) => EmissionDensity { p_k: prob, p_next: s.density(w_travel) },
            Emitter::Parallel(_) => EmissionDensity { p_k: prob, p_next: self.p_across },
            Emitter::Sky(sky) => EmissionDensity { p_k: prob * sky.density(-w_travel), p_next: self.p_across },
            Emitter::Dark => EmissionDensity::default(),
        }
    }

    /// Lᵉ of a light point that was hit, along the direction of travel: black from behind and for
    /// what cannot be hit.
    #[inline]
    pub fn radiance(&self, point: &EmitterPoint, w_travel: Vec3) -> Spectrum {
        match self.emitters.get(point.emitter.0 as usize) {
            Some(Emitter::Area(area)) if point.n_g.dot(w_travel) > 0.0 => self.textures.eval(area.radiance, point.uv),
            Some(Emitter::Sky(sky)) => sky.radiance(-w_travel),
            _ => Spectrum::BLACK,
        }
    }

    /// Radiance from every infinite emitter that can be hit and is not black along `w` (from the scene
    /// outwards). Each is a technique of its own.
    #[inline]
    pub fn environment(&self, w: Vec3, mut f: impl FnMut(EmitterId, Spectrum)) {
        for id in &self.skies {
            if let Emitter::Sky(sky) = &self.emitters[id.0 as usize] {
                let radiance = sky.radiance(w);
                if !radiance.is_black() {
                    f(*id, radiance);
                }
            }
        }
    }

    /// A light point that a sensor could see, with p_k (as in [`EmissionDensity`]); `None` where the
    /// choice falls on what cannot be seen.
    #[inline]
    pub fn sample_point(&self, geometry: &Geometry, u_pick: f32, u: Vec2) -> Option<(EmitterPoint, f32)> {
        let choice = self.choice.as_ref()?;
        let (i, prob, _) = choice.emission.sample(u_pick);
        let emitter = EmitterId(i as u32);
        match &self.emitters[i] {
            Emitter::Area(area) => {
                let s = geometry.sample_area(area.shape, u);
                let point = EmitterPoint { emitter, y: s.p, y_error: s.p_error, n_g: s.n_g, uv: s.uv };
                Some((point, prob * area.p_a))
            }
            Emitter::Sky(sky) => {
                let (w, p_w, _) = sky.sample(u);
                (p_w > 0.0).then(|| (EmitterPoint::at_infinity(emitter, w), prob * p_w))
            }
            _ => None,
        }
    }

    /// Nothing shines.
    pub fn is_empty(&self) -> bool {
        self.choice.is_none()
    }

    /// There are infinite emitters that can be hit.
    pub fn has_environment(&self) -> bool {
        !self.skies.is_empty()
    }

    /// Its light comes from infinitely far away.
    #[inline]
    pub fn is_infinite(&self, emitter: EmitterId) -> bool {
        matches!(self.emitters.get(emitter.0 as usize), Some(Emitter::Parallel(_) | Emitter::Sky(_)))
    }

    /// The emitter is a point, a spot or parallel light: no walk can hit it.
    pub fn is_delta(&self, emitter: EmitterId) -> bool {
        matches!(self.emitters.get(emitter.0 as usize), Some(Emitter::Point(_) | Emitter::Spot(_) | Emitter::Parallel(_)))
    }

    /// What there is, in the order of [`EmitterId`].
    pub fn infos(&self) -> &[EmitterInfo] {
        &self.infos
    }

    /// The disk from which infinite emitters shoot: centre and radius of the scene's sphere.
    pub fn sphere(&self) -> (Vec3, f32) {
        (self.center, self.radius)
    }

    /// Bytes of tables.
    pub fn bytes(&self) -> usize {
        let tables = |e: &Emitter| if let Emitter::Sky(sky) = e { sky.bytes() } else { 0 };
        self.emitters.iter().map(tables).sum::<usize>() + std::mem::size_of_val(&self.emitters[..])
    }

    #[inline]
    fn chosen(&self, emitter: EmitterId) -> Option<(&Choice, usize)> {
        let i = emitter.0 as usize;
        if i < self.emitters.len() { Some((self.choice.as_ref()?, i)) } else { None }
    }

    #[inline]
    fn prob_emission(&self, emitter: EmitterId) -> f32 {
        self.chosen(emitter).map_or(0.0, |(choice, i)| choice.emission.prob(i))
    }
}

/// Unit direction, distance and 1/d² from `x` to `y`; `None` where they are too near to have any.
#[inline]
fn toward(x: Vec3, y: Vec3) -> Option<(Vec3, f32, f32)> {
    let v = y - x;
    let d2 = v.length_squared();
    if !(d2 > 1e-30 && d2 < 1e36) {
        return None;
    }
    let d = d2.sqrt();
    Some((v / d, d, 1.0 / d2))
}

#[inline]
fn emit_from_point(emitter: EmitterId, y: Vec3, w: Vec3, intensity: Spectrum, p_w: f32, prob: f32) -> Option<Emission> {
    if p_w <= 0.0 || intensity.is_black() {
        return None;
    }
    Some(Emission {
        point: EmitterPoint { emitter, y, y_error: 0.0, n_g: Vec3::ZERO, uv: Vec2::ZERO },
        w,
        weight: intensity * (1.0 / (prob * p_w)),
        density: EmissionDensity { p_k: prob, p_next: p_w },
        delta: true,
        infinite: false,
    })
}
