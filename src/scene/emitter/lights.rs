//! All emitters of a scene with the densities of choosing them: the four questions of transport.

use super::area::Area;
use super::choice::Choice;
use super::guide::Draw;
use super::{Emission, EmissionDensity, Emitter, EmitterInfo, EmitterPoint, Guide, NextEvent};
use crate::math::{Frame, warp};
use crate::scene::EmitterId;
use crate::scene::geometry::{Geometry, ShapePoint};
use crate::spectrum::Spectrum;
use crate::texture::Textures;
use glam::{Vec2, Vec3};

/// Number of an emitter and the probability of picking it.
pub type Picked = (usize, f32);

/// All emitters of a scene. Without any that could light something, every sample is `None`.
#[derive(Clone, Debug, Default)]
pub struct Lights {
    pub(super) emitters: Vec<Emitter>,
    pub(super) infos: Vec<EmitterInfo>,
    pub(super) textures: Textures,
    /// Emitters at infinity that can be hit.
    pub(super) skies: Vec<EmitterId>,
    /// Ambient terms of local illumination.
    pub(super) ambient: Vec<(EmitterId, Spectrum)>,
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
        let (i, prob) = choice.next_event.sample(x, u_pick);
        self.next_event_from(geometry, x, (i, prob), u)
    }

    /// Every emitter that may be picked for a next event, where there are few, else none: then the pick may give way to its
    /// expectation, the sum over all of [`Self::next_event_from`] times the probability of the pick.
    #[inline]
    pub fn few(&self) -> &[Picked] {
        self.choice.as_ref().map_or(&[], Choice::few)
    }

    /// The same from one emitter, of which ν is then the density without any choice.
    pub fn next_event_of(&self, emitter: EmitterId, geometry: &Geometry, x: Vec3, u: Vec2) -> Option<NextEvent> {
        let (_, i) = self.chosen(emitter)?;
        self.next_event_from(geometry, x, (i, 1.0), u)
    }

    /// A light point of emitter `i`, which was picked with probability `prob`.
    #[inline]
    pub fn next_event_from(&self, geometry: &Geometry, x: Vec3, (i, prob): Picked, u: Vec2) -> Option<NextEvent> {
        let emitter = EmitterId(i as u32);
        match &self.emitters[i] {
            Emitter::Area(area) => {
                let s = geometry.sample_toward(area.shape, x, u, !area.radiance.is_constant())?;
                let point = EmitterPoint { emitter, y: s.p, y_error: s.p_error, n_g: s.n_g, uv: s.uv };
                let (w, distance, inv_d2) = toward(x, s.p)?;
                let cos = -s.n_g.dot(w);
                let radiance = self.textures.eval(area.radiance, s.uv);
                if cos <= 0.0 || radiance.is_black() {
                    return None;
                }
                let (g, nu) = (cos * inv_d2, prob * s.p_a);
                Some(NextEvent { point, w, distance, radiance, g, inv_d2, nu, delta: false })
            }
            Emitter::Point(p) => {
                let point = EmitterPoint::delta(emitter, p.position);
                finite_delta(point, x, prob, |_| p.intensity)
            }
            Emitter::Spot(s) => {
                let point = EmitterPoint::delta(emitter, s.position);
                finite_delta(point, x, prob, |w| s.intensity(&self.textures, w))
            }
            Emitter::Parallel(p) => {
                let point = EmitterPoint::at_infinity(emitter, -p.direction);
                Some(infinite(point, p.irradiance, prob, true))
            }
            Emitter::Sky(sky) => {
                let (w, p_w, radiance) = sky.sample(u);
                if p_w <= 0.0 || radiance.is_black() {
                    return None;
                }
                let point = EmitterPoint::at_infinity(emitter, w);
                Some(infinite(point, radiance, prob * p_w, false))
            }
            Emitter::Dark => None,
        }
    }

    /// ν of a light point as seen from `x` along the unit direction `w` (from x outwards): per m² of an
    /// area, per steradian of a sky, discrete for what cannot be hit.
    #[inline]
    pub fn density_next_event(&self, geometry: &Geometry, x: Vec3, point: &EmitterPoint, w: Vec3) -> f32 {
        let Some((choice, i)) = self.chosen(point.emitter) else { return 0.0 };
        choice.next_event.prob(i, x) * self.density_of(geometry, x, point, w)
    }

    /// The same without the choice of the emitter, as of [`Self::next_event_of`].
    #[inline]
    pub fn density_of(&self, geometry: &Geometry, x: Vec3, point: &EmitterPoint, w: Vec3) -> f32 {
        match self.emitters.get(point.emitter.0 as usize) {
            Some(Emitter::Area(area)) => geometry.density_toward(area.shape, x, point.y, point.n_g),
            Some(Emitter::Sky(sky)) => sky.density(w),
            Some(Emitter::Point(_) | Emitter::Spot(_) | Emitter::Parallel(_)) => 1.0,
            Some(Emitter::Dark) | None => 0.0,
        }
    }

    /// A light point and a direction of travel from it, with the flux they stand for.
    #[inline]
    pub fn sample_emission(
        &self,
        geometry: &Geometry,
        guide: &Guide,
        u_pick: f32,
        u_position: Vec2,
        u_direction: Vec2,
    ) -> Option<Emission> {
        let choice = guide.choice(&self.choice.as_ref()?.emission);
        let (i, prob, _) = choice.sample(u_pick);
        let emitter = EmitterId(i as u32);
        match &self.emitters[i] {
            Emitter::Area(area) => {
                let (s, w) = self.emit_from_area(geometry, guide, area, (i, u_position, u_direction))?;
                let cos = s.n_g.dot(w);
                let radiance = self.textures.eval(area.radiance, s.uv);
                if cos <= 0.0 || radiance.is_black() {
                    return None;
                }
                let point = EmitterPoint { emitter, y: s.p, y_error: s.p_error, n_g: s.n_g, uv: s.uv };
                let p_k = prob * geometry.density_across(area.shape, point.n_g, w).unwrap_or(area.p_a);
                let density = EmissionDensity { p_k, p_next: self.density_direction(guide, i, &point, w) };
                emitted(point, w, radiance * cos, density, false, false)
            }
            Emitter::Point(p) => {
                let w = match guide.direction(i, u_direction) {
                    Draw::Own(u) => warp::sphere_uniform(u),
                    Draw::Learned(w) => w,
                };
                let point = EmitterPoint::delta(emitter, p.position);
                let density = EmissionDensity { p_k: prob, p_next: self.density_direction(guide, i, &point, w) };
                emitted(point, w, p.intensity, density, true, false)
            }
            Emitter::Spot(s) => {
                let w = match guide.direction(i, u_direction) {
                    Draw::Own(u) => s.sample(u).0,
                    Draw::Learned(w) => w,
                };
                let point = EmitterPoint::delta(emitter, s.position);
                let density = EmissionDensity { p_k: prob, p_next: self.density_direction(guide, i, &point, w) };
                emitted(point, w, s.intensity(&self.textures, w), density, true, false)
            }
            Emitter::Parallel(p) => self.emit_from_infinity(
                guide,
                EmitterPoint::at_infinity(emitter, -p.direction),
                p.irradiance,
                prob,
                u_position,
                true,
            ),
            Emitter::Sky(sky) => {
                let (w, p_w, radiance) = sky.sample(u_direction);
                self.emit_from_infinity(guide, EmitterPoint::at_infinity(emitter, w), radiance, prob * p_w, u_position, false)
            }
            Emitter::Dark => None,
        }
    }

    /// A point of an area light and a direction from it.
    #[inline]
    fn emit_from_area(
        &self,
        geometry: &Geometry,
        guide: &Guide,
        area: &Area,
        (emitter, u_position, u_direction): (usize, Vec2, Vec2),
    ) -> Option<(ShapePoint, Vec3)> {
        let shape = area.shape;
        let anywhere = || geometry.sample_area(shape, u_position);
        let from_across = |w| Some((geometry.sample_across(shape, w, u_position)?, w));
        match guide.direction(emitter, u_direction) {
            Draw::Own(u) if area.sphere => from_across(warp::sphere_uniform(u)),
            Draw::Own(u) => {
                let s = anywhere();
                Some((s, Frame::around(s.n_g).to_world(warp::hemisphere_cosine(u))))
            }
            Draw::Learned(w0) => match guide.aim(emitter, area) {
                None if area.sphere => from_across(w0),
                None => Some((anywhere(), w0)),
                Some(aim) => {
                    let target = aim.target(w0);
                    let seen = || geometry.sample_toward(shape, target, u_position, !area.radiance.is_constant());
                    let s = if area.sphere { seen()? } else { anywhere() };
                    Some((s, (target - s.p).normalize()))
                }
            },
        }
    }

    /// Starts on the disk behind the scene's sphere, across the direction of travel.
    #[inline]
    fn emit_from_infinity(
        &self,
        guide: &Guide,
        point: EmitterPoint,
        radiance: Spectrum,
        p_k: f32,
        u_position: Vec2,
        delta: bool,
    ) -> Option<Emission> {
        let w = point.n_g;
        let disk = guide.place(point.emitter.0 as usize, u_position);
        let (at, frame) = (disk * self.radius, Frame::around(w));
        let y = self.center + frame.s * at.x + frame.t * at.y - w * self.radius;
        let p_next = self.p_across * guide.place_density(point.emitter.0 as usize, disk);
        emitted(EmitterPoint { y, ..point }, w, radiance, EmissionDensity { p_k, p_next }, delta, true)
    }

    /// Densities with which [`Self::sample_emission`] makes `point` and what follows: the direction of
    /// travel and, for infinite emitters, the place across it, which `x` (a point ahead) tells.
    #[inline]
    pub fn density_emission(
        &self,
        geometry: &Geometry,
        guide: &Guide,
        point: &EmitterPoint,
        w_travel: Vec3,
        x: Vec3,
    ) -> EmissionDensity {
        let Some((choice, i)) = self.chosen(point.emitter) else { return EmissionDensity::default() };
        let prob = guide.choice(&choice.emission).prob(i);
        let p_k = match &self.emitters[i] {
            Emitter::Area(area) => prob * geometry.density_across(area.shape, point.n_g, w_travel).unwrap_or(area.p_a),
            Emitter::Point(_) | Emitter::Spot(_) | Emitter::Parallel(_) => prob,
            Emitter::Sky(sky) => prob * sky.density(-w_travel),
            Emitter::Dark => return EmissionDensity::default(),
        };
        let p_next = match &self.emitters[i] {
            Emitter::Parallel(_) | Emitter::Sky(_) => self.p_across * guide.place_density(i, self.disk(w_travel, x)),
            _ => self.density_direction(guide, i, point, w_travel),
        };
        EmissionDensity { p_k, p_next }
    }

    /// Density per steradian of the direction of travel from a finite emitter.
    #[inline]
    fn density_direction(&self, guide: &Guide, i: usize, point: &EmitterPoint, w: Vec3) -> f32 {
        let own = match &self.emitters[i] {
            Emitter::Area(area) => {
                let own = if area.sphere { warp::SPHERE_UNIFORM_P_W } else { warp::hemisphere_cosine_p_w(point.n_g.dot(w)) };
                return guide.direction_density(i, own, || guide.aimed(i, area, point.y, w));
            }
            Emitter::Point(_) => warp::SPHERE_UNIFORM_P_W,
            Emitter::Spot(s) => s.density(w),
            _ => return 0.0,
        };
        guide.direction_density(i, own, || (w, 1.0))
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

    /// Ambient radiance: an abstraction that only local illumination and recursive ray tracing know.
    #[inline]
    pub fn ambient(&self) -> &[(EmitterId, Spectrum)] {
        &self.ambient
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
        let choice = self.choice.as_ref().map_or(0, Choice::bytes);
        self.emitters.iter().map(tables).sum::<usize>() + std::mem::size_of_val(&self.emitters[..]) + choice
    }

    /// Bytes of the images of emitters.
    pub fn image_bytes(&self) -> usize {
        let sky = |e: &Emitter| if let Emitter::Sky(sky) = e { sky.image_bytes() } else { 0 };
        self.textures.bytes() + self.emitters.iter().map(sky).sum::<usize>()
    }

    #[inline]
    fn chosen(&self, emitter: EmitterId) -> Option<(&Choice, usize)> {
        let i = emitter.0 as usize;
        if i < self.emitters.len() { Some((self.choice.as_ref()?, i)) } else { None }
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

/// A start of flux `value / (p_k·p_next)`, value = Lᵉ·cosθ; `None` where that is nothing.
#[inline]
fn emitted(
    point: EmitterPoint,
    w: Vec3,
    value: Spectrum,
    density: EmissionDensity,
    delta: bool,
    infinite: bool,
) -> Option<Emission> {
    let p = density.p_k * density.p_next;
    if p <= 0.0 || value.is_black() {
        return None;
    }
    Some(Emission { point, w, weight: value * (1.0 / p), density, delta, infinite })
}

/// Next event of a point or spot, `intensity` as a function of the direction of travel.
#[inline]
fn finite_delta(point: EmitterPoint, x: Vec3, prob: f32, intensity: impl FnOnce(Vec3) -> Spectrum) -> Option<NextEvent> {
    let (w, distance, inv_d2) = toward(x, point.y)?;
    let radiance = intensity(-w);
    if radiance.is_black() {
        return None;
    }
    Some(NextEvent { point, w, distance, radiance, g: inv_d2, inv_d2, nu: prob, delta: true })
}

#[inline]
fn infinite(point: EmitterPoint, radiance: Spectrum, nu: f32, delta: bool) -> NextEvent {
    NextEvent { point, w: -point.n_g, distance: f32::INFINITY, radiance, g: 1.0, inv_d2: 1.0, nu, delta }
}
