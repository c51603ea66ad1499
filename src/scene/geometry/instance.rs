//! A copy of a shape group under an affine map M: h(x, ω) = M h_group(M⁻¹x, M⁻¹ω).
//!
//! Directions are not normalised in the group's coordinates, so that t means the same there.

use super::ray::{Aabb, Ray};
use super::surface::Local;
use glam::{Affine3A, DAffine3, Vec3, Vec3A};

/// A placed group.
#[derive(Clone, Copy, Debug)]
pub(super) struct Instance {
    /// Code of the root of the group's tree.
    pub(super) root: u32,
    to_world: Affine3A,
    to_group: Affine3A,
    /// Box in the world.
    pub(super) bounds: Aabb,
}

impl Instance {
    /// The group whose tree has the box `inner` and the code `root`, under `to_world`.
    pub(super) fn new(root: u32, inner: &Aabb, to_world: &DAffine3) -> Self {
        let corners = (0..8).map(|k| {
            let pick = |axis: usize| if k >> axis & 1 == 0 { inner.min[axis] } else { inner.max[axis] };
            Vec3::new(pick(0), pick(1), pick(2))
        });
        let bounds = if inner.is_empty() {
            Aabb::EMPTY
        } else {
            Aabb::around(corners.map(|c| to_world.transform_point3(c.as_dvec3()).as_vec3()))
        };
        let mut it = Self { root, to_world: single(to_world), to_group: single(&to_world.inverse()), bounds };
        // Rays are mapped in single precision: a point at the box's side may be off by this much.
        let slack = Vec3::splat(it.error(bounds.min, 0.0).max(it.error(bounds.max, 0.0)));
        if !bounds.is_empty() {
            it.bounds = Aabb { min: bounds.min - slack, max: bounds.max + slack };
        }
        it
    }

    /// Keeps angles, as far as single precision can say.
    pub(super) fn is_similarity(&self) -> bool {
        let [x, y, z] = [self.to_world.matrix3.x_axis, self.to_world.matrix3.y_axis, self.to_world.matrix3.z_axis];
        let most = x.length_squared().max(y.length_squared()).max(z.length_squared());
        let right = |a: Vec3A, b: Vec3A| a.dot(b).abs() < 1e-4 * most;
        let equal = |a: Vec3A| most - a.length_squared() < 2e-4 * most;
        right(x, y) && right(y, z) && right(z, x) && equal(x) && equal(y) && equal(z)
    }

    /// A ray of the world in the group's coordinates, ending at `t_max`.
    #[inline]
    pub(super) fn ray_to_group(&self, ray: &Ray, t_max: f32) -> Ray {
        Ray { o: self.to_group.transform_point3(ray.o), d: self.to_group.transform_vector3(ray.d), t_max }
    }

    /// A point of the world in the group's coordinates.
    pub(super) fn point_to_group(&self, p: Vec3) -> Vec3 {
        self.to_group.transform_point3(p)
    }

    /// Bound of the rounding error, in the world, of mapping `p` into the group and of an error
    /// `inner` made there.
    fn error(&self, p: Vec3, inner: f32) -> f32 {
        const UNIT: f32 = f32::EPSILON / 2.0;
        let back = self.to_group.matrix3;
        let forth = self.to_world.matrix3;
        let abs_map = |m: &glam::Mat3A, v: Vec3A| m.x_axis.abs() * v.x + m.y_axis.abs() * v.y + m.z_axis.abs() * v.z;
        let there = abs_map(&back, Vec3A::from(p).abs()) + self.to_group.translation.abs();
        let moved = abs_map(&forth, there * (4.0 * UNIT) + Vec3A::splat(inner));
        let here = (Vec3A::from(p).abs() + self.to_world.translation.abs()) * (4.0 * UNIT);
        (moved + here).max_element()
    }

    /// A surface point of the group in the world.
    pub(super) fn point_to_world(&self, local: &Local) -> Local {
        let m = self.to_world.matrix3;
        let normal = |n: Vec3| (self.to_group.matrix3.transpose() * Vec3A::from(n)).normalize_or_zero().into();
        let p = self.to_world.transform_point3(local.p);
        Local {
            p,
            p_error: self.error(p, local.p_error),
            n_g: normal(local.n_g),
            n_s: normal(local.n_s),
            dp_du: (m * Vec3A::from(local.dp_du)).into(),
            uv: local.uv,
        }
    }
}

fn single(m: &DAffine3) -> Affine3A {
    Affine3A::from_cols(
        m.matrix3.x_axis.as_vec3().into(),
        m.matrix3.y_axis.as_vec3().into(),
        m.matrix3.z_axis.as_vec3().into(),
        m.translation.as_vec3().into(),
    )
}
