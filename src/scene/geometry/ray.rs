//! Rays, hits and boxes.

use glam::Vec3;

/// The points `o + t·d` for t in (0, `t_max`); `d` need not be unit.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Origin.
    pub o: Vec3,
    /// Direction; t counts in its lengths.
    pub d: Vec3,
    /// Upper end of t, excluded.
    pub t_max: f32,
}

/// Where a ray meets the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter.
    pub t: f32,
    /// Triangles: barycentric coordinate of the second vertex.
    pub u: f32,
    /// Triangles: barycentric coordinate of the third vertex.
    pub v: f32,
    /// Primitive, as the geometry counts them.
    pub prim: u32,
    /// Instance through which it is seen; `u32::MAX` = none.
    pub instance: u32,
}

/// "No primitive", "no instance".
pub(super) const NONE: u32 = u32::MAX;

/// An axis-parallel box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Lower corner.
    pub min: Vec3,
    /// Upper corner.
    pub max: Vec3,
}

impl Aabb {
    /// The box without points.
    pub const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// The smallest box around some points.
    pub fn around(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Self { min: b.min.min(p), max: b.max.max(p) })
    }

    /// The smallest box around both.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Without points?
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// Middle (zero where empty).
    pub fn center(&self) -> Vec3 {
        if self.is_empty() { Vec3::ZERO } else { self.min * 0.5 + self.max * 0.5 }
    }

    /// Half of the surface, in double precision.
    pub(super) fn half_area(&self) -> f64 {
        if self.is_empty() {
            return 0.0;
        }
        let d = self.max.as_dvec3() - self.min.as_dvec3();
        d.x * d.y + d.y * d.z + d.z * d.x
    }
}
