//! A disk in the sky: uniform radiance L = E/(π sin²α) inside the half angle α.
//!
//! E is the irradiance on a plane that faces the middle of the disk, ∫ L cosθ dω = L·π·sin²α. Light
//! points are uniform in solid angle. The disk is tested by the chord |w − axis|, whose rounding
//! error is some 1e-7 absolute, where a cosine would leave three digits of a sun of half a degree.

use super::spot::versine;
use crate::math::Frame;
use crate::spectrum::Spectrum;
use glam::{Vec2, Vec3};
use std::f64::consts::PI;

#[derive(Clone, Copy, Debug)]
pub(super) struct Sun {
    /// z towards the middle of the disk.
    frame: Frame,
    radiance: Spectrum,
    /// 1 − cos α.
    vers: f32,
    /// 1/(2π(1 − cos α)), sr⁻¹.
    p_w: f32,
}

impl Sun {
    /// Light travels along the unit `direction`; `half_angle` in radians, below π/2.
    pub(super) fn new(direction: Vec3, irradiance: Spectrum, half_angle: f64) -> Self {
        let vers = versine(half_angle);
        Self {
            frame: Frame::around(-direction),
            radiance: irradiance * (1.0 / (PI * half_angle.sin().powi(2))) as f32,
            vers: vers as f32,
            p_w: (1.0 / (2.0 * PI * vers)) as f32,
        }
    }

    #[inline]
    fn covers(&self, w: Vec3) -> bool {
        // |w − axis|² = 2(1 − cosθ).
        (w - self.frame.n).length_squared() <= 2.0 * self.vers
    }

    #[inline]
    pub(super) fn radiance(&self, w: Vec3) -> Spectrum {
        if self.covers(w) { self.radiance } else { Spectrum::BLACK }
    }

    #[inline]
    pub(super) fn density(&self, w: Vec3) -> f32 {
        if self.covers(w) { self.p_w } else { 0.0 }
    }

    #[inline]
    pub(super) fn sample(&self, u: Vec2) -> (Vec3, f32, Spectrum) {
        let vers = u.x * self.vers;
        let sin = (vers * (2.0 - vers)).max(0.0).sqrt();
        let (s, c) = (2.0 * std::f32::consts::PI * u.y).sin_cos();
        (self.frame.to_world(Vec3::new(sin * c, sin * s, 1.0 - vers)), self.p_w, self.radiance)
    }

    /// ∫ L dω.
    pub(super) fn integral(&self) -> Spectrum {
        self.radiance / self.p_w
    }
}
