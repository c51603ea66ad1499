//! Point with a cone: I(θ) = I₀ · clamp((c − θ)/(c − b), 0, 1) · t(u, v), as Mitsuba 3's `spot`.
//!
//! c is the cutoff, b the half angle of full intensity, t a projected image whose square just holds
//! the cone: u = ½ + x/(2z·tan c), v alike. Emission is sampled with a density that is linear in
//! cosθ between b and c and constant inside b: within a factor of 1.3 of the falloff for cones up
//! to 60°, invertible without a table. Small angles are computed from sines, since 1 − cosθ of a
//! narrow beam has no digits in single precision.

use crate::spectrum::Spectrum;
use crate::texture::{TextureSlot, Textures};
use glam::{Mat3, Vec2, Vec3};
use std::f64::consts::PI;

#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    pub(super) position: Vec3,
    /// Columns: axes of the emitter in the world, orthonormal, of either handedness.
    axes: Mat3,
    intensity: Spectrum,
    texture: TextureSlot,
    cutoff: f32,
    inv_width: f32,
    inv_tan_cutoff: f32,
    /// 1 − cos of both half angles.
    vers_beam: f32,
    vers_cutoff: f32,
    /// Density of sampling inside the beam, sr⁻¹.
    p_beam: f32,
    /// Probability of the beam.
    prob_beam: f32,
}

/// What a spot is made from, angles in degrees, axes orthonormal.
pub(super) struct Parameters {
    pub(super) axes: Mat3,
    pub(super) position: Vec3,
    pub(super) intensity: Spectrum,
    pub(super) cutoff_deg: f64,
    pub(super) beam_deg: f64,
    pub(super) texture: TextureSlot,
}

/// 1 − cos x without cancellation.
pub(super) fn versine(x: f64) -> f64 {
    2.0 * (0.5 * x).sin().powi(2)
}

/// 1 − cosθ of a unit vector whose cosine is its z.
#[inline]
pub(super) fn versine_of(w: Vec3) -> f32 {
    if w.z > 0.0 { w.truncate().length_squared() / (1.0 + w.z) } else { 1.0 - w.z }
}

impl Spot {
    pub(super) fn new(p: Parameters) -> Self {
        let (cutoff, beam) = (p.cutoff_deg.to_radians(), p.beam_deg.min(p.cutoff_deg).to_radians());
        let (vers_beam, vers_cutoff) = (versine(beam), versine(cutoff));
        let mass = 0.5 * (vers_beam + vers_cutoff);
        Self {
            position: p.position,
            axes: p.axes,
            intensity: p.intensity,
            texture: p.texture,
            cutoff: cutoff as f32,
            inv_width: (1.0 / (cutoff - beam)).min(f64::from(f32::MAX)) as f32,
            inv_tan_cutoff: (1.0 / cutoff.tan()) as f32,
            vers_beam: vers_beam as f32,
            vers_cutoff: vers_cutoff as f32,
            p_beam: (1.0 / (2.0 * PI * mass)) as f32,
            prob_beam: (vers_beam / mass) as f32,
        }
    }

    /// Intensity along the unit direction of travel `w`, W·sr⁻¹.
    #[inline]
    pub(super) fn intensity(&self, textures: &Textures, w: Vec3) -> Spectrum {
        let local = self.axes.transpose() * w;
        let vers = versine_of(local);
        if vers >= self.vers_cutoff {
            return Spectrum::BLACK;
        }
        let mut value = self.intensity;
        if vers > self.vers_beam {
            let theta = local.truncate().length().atan2(local.z);
            value *= ((self.cutoff - theta) * self.inv_width).clamp(0.0, 1.0);
        }
        if !self.texture.is_constant() {
            let uv = Vec2::splat(0.5) + local.truncate() * (0.5 * self.inv_tan_cutoff / local.z);
            value *= textures.eval(self.texture, uv);
        }
        value
    }

    /// Direction of travel and its density per steradian.
    #[inline]
    pub(super) fn sample(&self, u: Vec2) -> (Vec3, f32) {
        let (vers, falloff) = if u.x < self.prob_beam {
            (u.x / self.prob_beam * self.vers_beam, 1.0)
        } else {
            // Density ∝ 1 − t over the ring, t = relative position between beam and cutoff.
            let rest = ((1.0 - u.x) / (1.0 - self.prob_beam)).clamp(0.0, 1.0).sqrt();
            (self.vers_beam + (1.0 - rest) * (self.vers_cutoff - self.vers_beam), rest)
        };
        let sin = (vers * (2.0 - vers)).max(0.0).sqrt();
        let (s, c) = (2.0 * std::f32::consts::PI * u.y).sin_cos();
        (self.axes * Vec3::new(sin * c, sin * s, 1.0 - vers), self.p_beam * falloff)
    }

    /// Density per steradian of [`Self::sample`].
    #[inline]
    pub(super) fn density(&self, w: Vec3) -> f32 {
        let vers = versine_of(self.axes.transpose() * w);
        if vers <= self.vers_beam {
            self.p_beam
        } else if vers < self.vers_cutoff {
            self.p_beam * (self.vers_cutoff - vers) / (self.vers_cutoff - self.vers_beam)
        } else {
            0.0
        }
    }

    /// Middle of the cone, unit.
    pub(super) fn axis(&self) -> Vec3 {
        self.axes.z_axis
    }

    /// Half angles of full intensity and of any, radians.
    pub(super) fn half_angles(&self) -> (f64, f64) {
        let angle = |vers: f32| 2.0 * (0.5 * f64::from(vers)).sqrt().min(1.0).asin();
        (angle(self.vers_beam), f64::from(self.cutoff))
    }

    /// Density of [`Self::sample`] inside the beam, sr⁻¹: one over the solid angle, the falloff counted
    /// by half.
    pub(super) fn p_beam(&self) -> f32 {
        self.p_beam
    }

    /// ∫ I dω, W; a projected image by quadrature over the cone.
    pub(super) fn power(&self, textures: &Textures) -> Spectrum {
        const N: u32 = 64;
        let mut sum = Spectrum::BLACK;
        for i in 0..N * N {
            let u = (Vec2::new((i % N) as f32, (i / N) as f32) + 0.5) / N as f32;
            let (w, p) = self.sample(u);
            sum += self.intensity(textures, w) / p;
        }
        sum / (N * N) as f32
    }

    /// A bound of the intensity in any direction.
    pub(super) fn peak(&self, textures: &Textures) -> Spectrum {
        self.intensity * textures.max(self.texture)
    }
}
