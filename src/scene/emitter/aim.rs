//! Where learned light paths are aimed at: a sphere around the lamp, as far away as what they should meet.
//!
//! A learned direction alone, whatever point of the lamp it leaves from, meets a place as large as the lamp: where that
//! is larger than the glass, most paths miss it, and neighbours in a sequence of points do not arrive as neighbours. So what is
//! learned is the direction w₀ in which the *target* t = c + D·w₀ lies from the lamp's centre c; paths go from
//! points of the lamp to t. Seen from a point y at a distance s from t, with θ the angle between the path and w₀,
//!
//! dω₀ = dω · s² / (D² cosθ),
//!
//! and of a sphere, whose points are drawn as t sees them (uniformly in its cone of half angle γ), not by area across the
//! direction, the same density of rays is dω₀·(1 + cosγ) / (2 cosθ) for each dω. For D → ∞ both are dω.

use super::area::Area;
use glam::Vec3;

/// Least distance at which to aim, in radii of the lamp: nearer, paths that leave from its border would be far too rare or too frequent.
const NEAREST: f32 = 2.0;

#[derive(Clone, Copy, Debug)]
pub(super) struct Aim {
    center: Vec3,
    distance: f32,
    /// (1 + cosγ)/2 of a sphere that is seen from outside.
    cone: Option<f32>,
}

impl Aim {
    /// At `distance` from the lamp, or nowhere: so near or so far that directions are all there is to learn.
    #[inline]
    pub(super) fn new(area: &Area, distance: f32) -> Option<Self> {
        let reach = area.extent.radius;
        if !(distance >= NEAREST * reach && distance < f32::MAX) {
            return None;
        }
        let cos = |sin: f32| (1.0 - sin * sin).max(0.0).sqrt();
        let cone = area.sphere.then(|| 0.5 + 0.5 * cos(reach / distance));
        Some(Self { center: area.extent.bounds.center(), distance, cone })
    }

    /// The target in direction `w0` from the centre.
    #[inline]
    pub(super) fn target(&self, w0: Vec3) -> Vec3 {
        self.center + w0 * self.distance
    }

    /// w₀ of the path that leaves `y` along `w`, and the density per steradian of w for one per steradian of w₀.
    #[inline]
    pub(super) fn of(&self, y: Vec3, w: Vec3) -> (Vec3, f32) {
        let v = y - self.center;
        let along = v.dot(w);
        // Of the lamp's points none is outside the sphere.
        let to_rim = (self.distance.powi(2) - v.length_squared() + along * along).max(f32::MIN_POSITIVE).sqrt();
        let s = to_rim - along;
        let (w0, cos) = ((v + w * s) / self.distance, to_rim / self.distance);
        let stretch = self.cone.unwrap_or_else(|| (s / self.distance).powi(2));
        (w0.normalize(), stretch / cos)
    }
}
