//! What a colour is: four lanes that are added and multiplied lane by lane.
//!
//! Transport never asks what a lane means. Only `film` and `io` know that the first three are
//! linear sRGB and that the fourth is unused (zero) today; four lanes are one SIMD register.

use glam::Vec4;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Sub};

/// Radiance, throughput or reflectance in every lane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(transparent)]
pub struct Spectrum(pub Vec4);

impl Spectrum {
    /// Nothing in any lane.
    pub const BLACK: Self = Self(Vec4::ZERO);
    /// One in each of the three lanes in use.
    pub const ONE: Self = Self(Vec4::new(1.0, 1.0, 1.0, 0.0));

    /// From linear sRGB.
    #[inline]
    pub const fn rgb(r: f32, g: f32, b: f32) -> Self {
        Self(Vec4::new(r, g, b, 0.0))
    }

    /// The same value in every lane.
    #[inline]
    pub const fn grey(v: f32) -> Self {
        Self::rgb(v, v, v)
    }

    /// As linear sRGB.
    #[inline]
    pub fn to_rgb(self) -> [f32; 3] {
        [self.0.x, self.0.y, self.0.z]
    }

    /// The largest lane.
    #[inline]
    pub fn max_lane(self) -> f32 {
        self.0.max_element()
    }

    /// Mean of the lanes in use.
    #[inline]
    pub fn mean(self) -> f32 {
        (self.0.x + self.0.y + self.0.z) * (1.0 / 3.0)
    }

    /// Luminance Y of linear sRGB.
    #[inline]
    pub fn luminance(self) -> f32 {
        self.0.dot(Vec4::new(0.212_671, 0.715_16, 0.072_169, 0.0))
    }

    /// Zero in every lane.
    #[inline]
    pub fn is_black(self) -> bool {
        self.0 == Vec4::ZERO
    }

    /// No NaN and no infinity in any lane.
    #[inline]
    pub fn is_finite(self) -> bool {
        self.0.is_finite()
    }

    /// `exp` lane by lane, for absorption.
    #[inline]
    pub fn exp(self) -> Self {
        Self::rgb(self.0.x.exp(), self.0.y.exp(), self.0.z.exp())
    }

    /// Square root lane by lane (negative lanes become 0).
    #[inline]
    pub fn sqrt(self) -> Self {
        let v = self.0.max(Vec4::ZERO);
        Self::rgb(v.x.sqrt(), v.y.sqrt(), v.z.sqrt())
    }

    /// Lane by lane function.
    #[inline]
    pub fn map(self, f: impl Fn(f32) -> f32) -> Self {
        Self::rgb(f(self.0.x), f(self.0.y), f(self.0.z))
    }

    /// The larger of the two in every lane.
    #[inline]
    pub fn lane_max(self, other: Self) -> Self {
        Self(self.0.max(other.0))
    }

    /// The smaller of the two in every lane.
    #[inline]
    pub fn lane_min(self, other: Self) -> Self {
        Self(self.0.min(other.0))
    }

    /// Linear blend: `self` at 0, `other` at 1.
    #[inline]
    pub fn lerp(self, other: Self, t: f32) -> Self {
        Self(self.0 * (1.0 - t) + other.0 * t)
    }
}

impl Add for Spectrum {
    type Output = Self;
    #[inline]
    fn add(self, o: Self) -> Self {
        Self(self.0 + o.0)
    }
}
impl Sub for Spectrum {
    type Output = Self;
    #[inline]
    fn sub(self, o: Self) -> Self {
        Self(self.0 - o.0)
    }
}
impl Mul for Spectrum {
    type Output = Self;
    #[inline]
    fn mul(self, o: Self) -> Self {
        Self(self.0 * o.0)
    }
}
/// Lane by lane; the unused lane (0/0) stays zero.
impl Div for Spectrum {
    type Output = Self;
    #[inline]
    fn div(self, o: Self) -> Self {
        Self::rgb(self.0.x / o.0.x, self.0.y / o.0.y, self.0.z / o.0.z)
    }
}
impl Mul<f32> for Spectrum {
    type Output = Self;
    #[inline]
    fn mul(self, s: f32) -> Self {
        Self(self.0 * s)
    }
}
impl Mul<Spectrum> for f32 {
    type Output = Spectrum;
    #[inline]
    fn mul(self, s: Spectrum) -> Spectrum {
        s * self
    }
}
impl Div<f32> for Spectrum {
    type Output = Self;
    #[inline]
    fn div(self, s: f32) -> Self {
        Self(self.0 * (1.0 / s))
    }
}
impl AddAssign for Spectrum {
    #[inline]
    fn add_assign(&mut self, o: Self) {
        self.0 += o.0;
    }
}
impl MulAssign for Spectrum {
    #[inline]
    fn mul_assign(&mut self, o: Self) {
        self.0 *= o.0;
    }
}
impl MulAssign<f32> for Spectrum {
    #[inline]
    fn mul_assign(&mut self, s: f32) {
        self.0 *= s;
    }
}
impl DivAssign<f32> for Spectrum {
    #[inline]
    fn div_assign(&mut self, s: f32) {
        self.0 *= 1.0 / s;
    }
}
