//! Orthonormal frames: local coordinates in which a normal is the z axis.

use glam::Vec3;

/// A right-handed orthonormal basis; `n` is the z axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// x axis.
    pub s: Vec3,
    /// y axis.
    pub t: Vec3,
    /// z axis.
    pub n: Vec3,
}

impl Frame {
    /// Any frame around the unit vector `n`, continuous but for one seam [Duff 2017].
    #[inline]
    pub fn around(n: Vec3) -> Self {
        let sign = 1f32.copysign(n.z);
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        Self { s: Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), t: Vec3::new(b, sign + n.y * n.y * a, -n.y), n }
    }

    /// The frame around unit `n` whose `s` is `tangent` made orthogonal to `n`; any frame where the
    /// tangent is (nearly) parallel to `n` or zero.
    #[inline]
    pub fn with_tangent(n: Vec3, tangent: Vec3) -> Self {
        let s = tangent - n * n.dot(tangent);
        let len2 = s.length_squared();
        if len2 > 1e-12 * tangent.length_squared() && len2 > 0.0 {
            let s = s / len2.sqrt();
            Self { s, t: n.cross(s), n }
        } else {
            Self::around(n)
        }
    }

    /// World to local.
    #[inline]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.s), v.dot(self.t), v.dot(self.n))
    }

    /// Local to world.
    #[inline]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.s * v.x + self.t * v.y + self.n * v.z
    }
}
