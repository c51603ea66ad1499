//! Parallel projection: `raster` is an affine function of the point, all rays share one direction.
//!
//! The film covers [−1, 1] along x of the sensor's frame and the same scale along y; the transform
//! may scale it (Mitsuba's way of setting the size). The near plane is z = near_clip *in the
//! sensor's frame*, while the far plane lies far_clip − near_clip *world* units behind it.

use super::{SensorConnection, SensorRay};
use crate::describe::{Problems, SensorDescription};
use glam::{DMat3, DVec3, Vec2, Vec3};

#[derive(Clone, Debug)]
pub(super) struct Orthographic {
    /// World position on the near plane of raster (0, 0).
    corner: Vec3,
    /// World steps per pixel along the image's x and y.
    step_x: Vec3,
    step_y: Vec3,
    /// Unit direction of all rays.
    d: Vec3,
    /// From `corner` to the plane z = 0 along `d`, ≤ 0.
    to_lens: f32,
    length: f32,
    /// Rows that map (x − corner) to raster x, raster y and distance along `d`.
    inverse: [Vec3; 3],
    pixels_per_area: f32,
}

impl Orthographic {
    pub(super) fn build(description: &SensorDescription, problems: &mut Problems) -> Option<Self> {
        let matrix = description.to_world.value.as_dmat4();
        let film = &description.film;
        let (width, height) = (f64::from(film.width), f64::from(film.height));
        let pixel = 2.0 / width;
        let near = f64::from(description.near_clip);
        let corner = matrix.transform_point3(DVec3::new(1.0, height / width, near));
        let step_x = matrix.transform_vector3(DVec3::new(-pixel, 0.0, 0.0));
        let step_y = matrix.transform_vector3(DVec3::new(0.0, -pixel, 0.0));
        let axis = matrix.transform_vector3(DVec3::Z);
        let basis = DMat3::from_cols(step_x, step_y, axis.normalize_or_zero());
        let inverse = basis.inverse();
        let area = basis.determinant().abs();
        if !matrix.is_finite() || !inverse.is_finite() || area == 0.0 {
            problems.error(description.to_world.place, "the sensor's transform is not invertible");
            return None;
        }
        let rows = inverse.transpose();
        Some(Self {
            corner: corner.as_vec3(),
            step_x: step_x.as_vec3(),
            step_y: step_y.as_vec3(),
            d: axis.normalize().as_vec3(),
            to_lens: -(near * axis.length()) as f32,
            length: description.far_clip - description.near_clip,
            inverse: [rows.x_axis.as_vec3(), rows.y_axis.as_vec3(), rows.z_axis.as_vec3()],
            pixels_per_area: (1.0 / area) as f32,
        })
    }

    /// Pixels per m² across the rays.
    #[inline]
    pub(super) fn pixels_per_area(&self) -> f32 {
        self.pixels_per_area
    }

    #[inline]
    pub(super) fn sample_ray(&self, raster: Vec2) -> SensorRay {
        let o = self.corner + self.step_x * raster.x + self.step_y * raster.y;
        SensorRay { o, d: self.d, t_max: self.length, lens: o + self.d * self.to_lens }
    }

    #[inline]
    pub(super) fn connect(&self, x: Vec3) -> Option<SensorConnection> {
        let v = x - self.corner;
        let t = self.inverse[2].dot(v);
        if !(t > 0.0 && t < self.length) {
            return None;
        }
        let raster = Vec2::new(self.inverse[0].dot(v), self.inverse[1].dot(v));
        Some(SensorConnection { raster, w: -self.d, inv_d2: 1.0, end: x - self.d * t, g_dir: self.pixels_per_area })
    }
}
