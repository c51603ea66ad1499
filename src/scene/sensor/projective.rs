//! Perspective sensors: pinhole and thin lens, `raster = centre − (x/z, y/z) / pixel`.
//!
//! A thin lens focuses each film point on the plane z = focus_distance: the ray from the lens point
//! runs through the point of that plane that a pinhole at the lens centre would show. A pinhole is
//! the lens of radius 0. Seen from a fixed lens point, the film is a linear image of the plane in
//! focus, hence D²/cos³θ pixels per steradian for both (θ = angle of the ray with the axis).

use super::{SensorConnection, SensorRay};
use crate::describe::{FovAxis, Problems, SensorDescription, SensorModel};
use crate::math::warp::disk_concentric;
use crate::scene::rigid;
use glam::{Mat3, Vec2, Vec3};

#[derive(Clone, Debug)]
pub(super) struct Projective {
    /// Columns: the sensor's axes in the world (orthonormal, of either handedness).
    axes: Mat3,
    origin: Vec3,
    /// Raster position of the axis.
    centre: Vec2,
    /// Size of a pixel on the plane z = 1 (square pixels: both the same).
    pixel: f32,
    inv_pixel: f32,
    near: f32,
    far: f32,
    aperture_radius: f32,
    focus_distance: f32,
}

/// A lens with its angles, as described.
struct Optics {
    fov_deg: f32,
    fov_axis: FovAxis,
    offset: Vec2,
    aperture_radius: f32,
    focus_distance: f32,
}

fn optics(model: &SensorModel) -> Option<Optics> {
    match *model {
        SensorModel::Perspective { fov_deg, fov_axis, principal_point_offset } => {
            Some(Optics { fov_deg, fov_axis, offset: principal_point_offset, aperture_radius: 0.0, focus_distance: 1.0 })
        }
        SensorModel::ThinLens { fov_deg, fov_axis, principal_point_offset, aperture_radius, focus_distance } => {
            Some(Optics { fov_deg, fov_axis, offset: principal_point_offset, aperture_radius, focus_distance })
        }
        SensorModel::Orthographic => None,
    }
}

/// tan of half the horizontal field of view.
fn tan_half_x(fov_deg: f64, axis: FovAxis, aspect: f64) -> f64 {
    let tan = (0.5 * fov_deg.to_radians()).tan();
    let along_y = tan * aspect;
    match axis {
        FovAxis::X => tan,
        FovAxis::Y => along_y,
        FovAxis::Diagonal => tan / (1.0 + 1.0 / (aspect * aspect)).sqrt(),
        FovAxis::Smaller => {
            if aspect > 1.0 {
                along_y
            } else {
                tan
            }
        }
        FovAxis::Larger => {
            if aspect > 1.0 {
                tan
            } else {
                along_y
            }
        }
    }
}

impl Projective {
    pub(super) fn build(description: &SensorDescription, problems: &mut Problems) -> Option<Self> {
        let optics = optics(&description.model)?;
        let place = description.place;
        if !(optics.fov_deg > 0.0 && optics.fov_deg < 180.0) {
            problems
                .error(place, format!("the field of view of {}° is out of range", optics.fov_deg))
                .hint("between 0 and 180 degrees, excluding both");
            return None;
        }
        if !optics.offset.is_finite() {
            problems.error(place, "the principal point offset is not finite");
            return None;
        }
        if !(optics.aperture_radius >= 0.0 && optics.aperture_radius.is_finite()) {
            problems.error(place, format!("the aperture radius {} is negative or not finite", optics.aperture_radius));
            return None;
        }
        if !(optics.focus_distance > 0.0 && optics.focus_distance.is_finite()) {
            problems.error(place, format!("the focus distance {} is not positive and finite", optics.focus_distance));
            return None;
        }
        let (axes, scale) = rigid::axes(&description.to_world, "sensor", problems)?;
        if (scale - 1.0).abs() > 1e-3 {
            let what = format!("the sensor's transform scales by {scale:.4}; the scale has no effect here");
            problems.warning(description.to_world.place, what);
        }
        let origin = description.to_world.value.w_axis.truncate();
        let size = Vec2::new(description.film.width as f32, description.film.height as f32);
        let aspect = f64::from(description.film.width) / f64::from(description.film.height);
        let pixel = 2.0 * tan_half_x(f64::from(optics.fov_deg), optics.fov_axis, aspect) / f64::from(description.film.width);
        Some(Self {
            axes,
            origin,
            centre: size * 0.5 - size * optics.offset,
            pixel: pixel as f32,
            inv_pixel: (1.0 / pixel) as f32,
            near: description.near_clip,
            far: description.far_clip,
            aperture_radius: optics.aperture_radius,
            focus_distance: optics.focus_distance,
        })
    }

    pub(super) fn aperture_radius(&self) -> f32 {
        self.aperture_radius
    }

    /// Lens point in the sensor's frame.
    #[inline]
    fn lens(&self, u: Vec2) -> Vec3 {
        if self.aperture_radius == 0.0 { Vec3::ZERO } else { (self.aperture_radius * disk_concentric(u)).extend(0.0) }
    }

    #[inline]
    pub(super) fn lens_point(&self, u_lens: Vec2) -> Vec3 {
        self.origin + self.axes * self.lens(u_lens)
    }

    #[inline]
    pub(super) fn sample_ray(&self, raster: Vec2, u_lens: Vec2) -> SensorRay {
        let at_one = ((self.centre - raster) * self.pixel).extend(1.0);
        let lens = self.lens(u_lens);
        let local = if self.aperture_radius == 0.0 { at_one } else { at_one * self.focus_distance - lens };
        let d = local.normalize();
        let inv_cos = 1.0 / d.z;
        let d_world = self.axes * d;
        let lens = self.origin + self.axes * lens;
        SensorRay { o: lens + d_world * (self.near * inv_cos), d: d_world, t_max: (self.far - self.near) * inv_cos, lens }
    }

    #[inline]
    pub(super) fn density(&self, d: Vec3) -> f32 {
        let cos = self.axes.z_axis.dot(d);
        self.g_dir(cos)
    }

    #[inline]
    fn g_dir(&self, cos: f32) -> f32 {
        if cos > 0.0 { (self.inv_pixel * self.inv_pixel / (cos * cos * cos)).min(f32::MAX) } else { 0.0 }
    }

    /// Raster position of the ray from `lens` along `q` (both in the sensor's frame, q.z > 0).
    #[inline]
    fn raster(&self, lens: Vec3, q: Vec3) -> Vec2 {
        let slope = q.truncate() / q.z;
        let at_one = if self.aperture_radius == 0.0 { slope } else { slope + lens.truncate() / self.focus_distance };
        self.centre - at_one * self.inv_pixel
    }

    #[inline]
    pub(super) fn connect(&self, x: Vec3, u_lens: Vec2) -> Option<SensorConnection> {
        let v = x - self.origin;
        let z = self.axes.z_axis.dot(v);
        if !(z > self.near && z < self.far) {
            return None;
        }
        let lens = self.lens(u_lens);
        let q = Vec3::new(self.axes.x_axis.dot(v), self.axes.y_axis.dot(v), z) - lens;
        let d2 = q.length_squared();
        let inv_d = 1.0 / d2.sqrt();
        let lens_world = self.origin + self.axes * lens;
        let to_x = x - lens_world;
        Some(SensorConnection {
            raster: self.raster(lens, q),
            w: to_x * -inv_d,
            inv_d2: inv_d * inv_d,
            end: lens_world + to_x * (self.near / z),
            g_dir: self.g_dir(z * inv_d),
        })
    }

    #[inline]
    pub(super) fn connect_infinite(&self, w_travel: Vec3, u_lens: Vec2) -> Option<SensorConnection> {
        let d = -w_travel;
        let cos = self.axes.z_axis.dot(d);
        if cos <= 1e-6 {
            return None;
        }
        let lens = self.lens(u_lens);
        let q = Vec3::new(self.axes.x_axis.dot(d), self.axes.y_axis.dot(d), cos);
        let end = self.origin + self.axes * lens + d * (self.near / cos);
        Some(SensorConnection { raster: self.raster(lens, q), w: w_travel, inv_d2: 1.0, end, g_dir: self.g_dir(cos) })
    }
}
