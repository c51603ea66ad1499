//! Sensors: the measurement Wᵉ of a pixel, as rays out of the film and points projected onto it.
//!
//! A pixel measures Φ = ∫ L(x, ω) Wᵉ(x, ω) with Wᵉ such that a sample of the film with density 1
//! per pixel area has weight 1. Seen from the scene this is the camera factor of a shooting walk,
//! `g(y) = (D²/cos³θ) · |cosθ_y| / |y − v₀|²` pixels per m² (`D` = distance at which a pixel has
//! unit area), and `g(y) = |cosθ_y| · pixels per m²` for parallel projection. Integrated over
//! whatever fills the view it is 1 per pixel.
//!
//! Geometry of the film follows Mitsuba 3: the sensor looks along its +z, +y is up in the image and
//! +x is to the *left*, raster coordinates grow to the right and downwards, in pixels of the whole
//! film (a crop window only selects some of them).

mod orthographic;
mod projective;
#[cfg(test)]
mod tests;

use crate::describe::{FilmDescription, FilterDescription, Problems, SensorDescription, SensorModel};
use glam::{Vec2, Vec3};
use orthographic::Orthographic;
use projective::Projective;

/// Start of a gathering walk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorRay {
    /// Origin, on the near plane.
    pub o: Vec3,
    /// Unit direction.
    pub d: Vec3,
    /// Distance from `o` to the far plane.
    pub t_max: f32,
    /// The point v₀ on the lens (parallel projection: the point on the plane z = 0).
    pub lens: Vec3,
}

/// A point of the scene as the sensor sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorConnection {
    /// Where it falls on the film: pixels of the whole film, x to the right, y down.
    pub raster: Vec2,
    /// Unit direction from the scene to the lens point.
    pub w: Vec3,
    /// 1/d² to the lens point, m⁻²; 1 where there is no distance (parallel projection, infinity).
    pub inv_d2: f32,
    /// End of the shadow segment, on the near plane.
    pub end: Vec3,
    /// Pixels per steradian, D²/cos³θ; parallel projection: pixels per m² across the rays.
    pub g_dir: f32,
}

/// A built sensor.
#[derive(Clone, Debug)]
pub struct Sensor {
    kind: Kind,
    /// Least and greatest raster position that can contribute to a pixel of the crop window.
    window: (Vec2, Vec2),
}

#[derive(Clone, Debug)]
enum Kind {
    Projective(Projective),
    Orthographic(Orthographic),
}

impl Sensor {
    /// From its description; errors (angles out of range, singular transforms, …) go to `problems`.
    pub fn build(description: &SensorDescription, problems: &mut Problems) -> Option<Self> {
        let film = &description.film;
        let ok = check_film(film, problems) & check_clip(description, problems);
        if !ok {
            return None;
        }
        let kind = match description.model {
            SensorModel::Orthographic => Kind::Orthographic(Orthographic::build(description, problems)?),
            SensorModel::Perspective { .. } | SensorModel::ThinLens { .. } => {
                Kind::Projective(Projective::build(description, problems)?)
            }
        };
        Some(Self { kind, window: window(film) })
    }

    /// The ray through a raster position (pixels of the whole film) and, with a finite lens, the
    /// lens point that `u_lens` in [0, 1)² selects uniformly.
    #[inline]
    pub fn sample_ray(&self, raster: Vec2, u_lens: Vec2) -> SensorRay {
        match &self.kind {
            Kind::Projective(s) => s.sample_ray(raster, u_lens),
            Kind::Orthographic(s) => s.sample_ray(raster),
        }
    }

    /// `g_dir` of the unit direction of a camera ray: D²/cos³θ pixels per steradian; parallel
    /// projection: pixels per m² across the rays. Times |cosθ₁|·[`Self::inv_d2`] it is g₁.
    #[inline]
    pub fn density(&self, d: Vec3) -> f32 {
        match &self.kind {
            Kind::Projective(s) => s.density(d),
            Kind::Orthographic(s) => s.pixels_per_area(),
        }
    }

    /// 1/d² between the lens point and `x`; 1 for parallel projection.
    #[inline]
    pub fn inv_d2(&self, lens: Vec3, x: Vec3) -> f32 {
        match &self.kind {
            Kind::Projective(_) => (x - lens).length_squared().recip().min(f32::MAX),
            Kind::Orthographic(_) => 1.0,
        }
    }

    /// The lens point that `u_lens` selects; `None` for parallel projection, where it depends on what is seen.
    #[inline]
    pub fn lens_point(&self, u_lens: Vec2) -> Option<Vec3> {
        match &self.kind {
            Kind::Projective(s) => Some(s.lens_point(u_lens)),
            Kind::Orthographic(_) => None,
        }
    }

    /// The point `x` seen through the lens point that `u_lens` selects; `None` where no pixel of the
    /// crop window can see it: outside the window widened by the filter, nearer than the near plane
    /// or beyond the far plane.
    #[inline]
    pub fn connect(&self, x: Vec3, u_lens: Vec2) -> Option<SensorConnection> {
        let c = match &self.kind {
            Kind::Projective(s) => s.connect(x, u_lens),
            Kind::Orthographic(s) => s.connect(x),
        }?;
        self.in_window(c.raster).then_some(c)
    }

    /// The infinitely far point from which light travels along `w_travel`; `None` outside the film
    /// and for parallel projection (which sees a single direction: no density).
    #[inline]
    pub fn connect_infinite(&self, w_travel: Vec3, u_lens: Vec2) -> Option<SensorConnection> {
        let c = match &self.kind {
            Kind::Projective(s) => s.connect_infinite(w_travel, u_lens),
            Kind::Orthographic(_) => None,
        }?;
        self.in_window(c.raster).then_some(c)
    }

    /// The lens (or the near plane of a parallel projection) is no single point, so that `u_lens`
    /// matters.
    pub fn has_lens(&self) -> bool {
        matches!(&self.kind, Kind::Projective(s) if s.aperture_radius() > 0.0)
    }

    /// Parallel projection.
    pub fn is_orthographic(&self) -> bool {
        matches!(self.kind, Kind::Orthographic(_))
    }

    #[inline]
    fn in_window(&self, raster: Vec2) -> bool {
        raster.cmpge(self.window.0).all() && raster.cmplt(self.window.1).all()
    }
}

/// Half width in pixels beyond which a reconstruction filter is zero.
pub fn filter_radius(filter: &FilterDescription) -> f32 {
    match *filter {
        FilterDescription::Box => 0.5,
        FilterDescription::Tent { radius } => radius,
        FilterDescription::Gaussian { stddev } => 4.0 * stddev,
        FilterDescription::Mitchell { .. } | FilterDescription::CatmullRom => 2.0,
        FilterDescription::Lanczos { lobes } => lobes as f32,
    }
}

/// A position p contributes to pixel j where |p − centre_j| < radius: the hull of that over the crop.
fn window(film: &FilmDescription) -> (Vec2, Vec2) {
    let [x, y, w, h] = film.crop.unwrap_or([0, 0, film.width, film.height]).map(|v| v as f32);
    let margin = Vec2::splat(filter_radius(&film.filter) - 0.5);
    (Vec2::new(x, y) - margin, Vec2::new(x + w, y + h) + margin)
}

fn check_film(film: &FilmDescription, problems: &mut Problems) -> bool {
    if film.width == 0 || film.height == 0 {
        problems.error(film.place, format!("the film has no pixels ({} × {})", film.width, film.height));
        return false;
    }
    if let Some([x, y, w, h]) = film.crop {
        let inside = |from: u32, size: u32, whole: u32| from.checked_add(size).is_some_and(|end| end <= whole);
        if w == 0 || h == 0 || !inside(x, w, film.width) || !inside(y, h, film.height) {
            problems
                .error(film.place, format!("the crop window {x},{y} {w} × {h} is empty or leaves the film"))
                .hint(format!("the film has {} × {} pixels", film.width, film.height));
            return false;
        }
    }
    let radius = filter_radius(&film.filter);
    if !(radius.is_finite() && radius > 0.0) {
        problems.error(film.place, "the reconstruction filter has no positive finite radius");
        return false;
    }
    true
}

fn check_clip(description: &SensorDescription, problems: &mut Problems) -> bool {
    let (near, far) = (description.near_clip, description.far_clip);
    let ok = near > 0.0 && near < far && far.is_finite();
    if !ok {
        problems
            .error(description.place, format!("the clip distances {near} and {far} are no interval of visible distances"))
            .hint("0 < near_clip < far_clip");
    }
    ok
}
