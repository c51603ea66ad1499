//! What every scene must fulfil, read from a file or made in code: ranges, indices, invertible maps.
//!
//! All problems are collected. A reader gives the place of each property, so that a message points
//! at the number and not only at its element.

mod models;
#[cfg(test)]
mod tests;

use super::*;
use glam::Mat4;

/// Beyond this, single precision no longer resolves a thousandth of a unit by far.
const FAR: f32 = 1e10;

/// `(element, property)` → where the property stands.
type Locate<'a> = &'a dyn Fn(Place, &'static str) -> Place;

impl SceneDescription {
    /// All that is wrong with the scene as far as it can be told before files are read.
    pub fn validate(&self) -> Problems {
        let mut problems = Problems::default();
        self.validate_located(&|place, _| place, &mut problems);
        problems
    }

    /// As [`SceneDescription::validate`], with a better place for each property.
    pub fn validate_located(&self, locate: Locate, problems: &mut Problems) {
        let mut check = Check { scene: self, locate, problems };
        check.integrator();
        self.sensors.iter().for_each(|sensor| check.sensor(sensor));
        if self.sensors.is_empty() {
            check
                .problems
                .error(Place::default(), "the scene has no sensor")
                .hint("add a <sensor>: nothing can be measured without");
        }
        check.bsdfs();
        self.shapes.iter().for_each(|shape| check.shape(shape, false));
        for shape in self.groups.iter().flat_map(|group| &group.shapes) {
            check.shape(shape, true);
        }
        self.emitters.iter().for_each(|emitter| check.emitter(emitter));
        check.whole();
        self.meshes.iter().enumerate().for_each(|(i, mesh)| check.mesh(i, mesh));
        self.images.iter().enumerate().for_each(|(i, image)| check.image(i, image));
    }
}

struct Check<'a> {
    scene: &'a SceneDescription,
    locate: Locate<'a>,
    problems: &'a mut Problems,
}

impl Check<'_> {
    /// `name` of the element at `place` must fulfil something.
    fn need(&mut self, fulfilled: bool, place: Place, name: &'static str, value: impl std::fmt::Debug, must: &str) {
        if !fulfilled {
            self.problems.error((self.locate)(place, name), format!("`{name}` is {value:?}; it must {must}"));
        }
    }

    fn positive(&mut self, value: f32, place: Place, name: &'static str) {
        self.need(value.is_finite() && value > 0.0, place, name, value, "be greater than 0");
    }

    fn integrator(&mut self) {
        let integrator = &self.scene.integrator;
        self.need(integrator.rr_depth > 0, integrator.place, "rr_depth", integrator.rr_depth, "be at least 1");
    }

    fn sensor(&mut self, sensor: &SensorDescription) {
        let place = sensor.place;
        let ordered = sensor.near_clip < sensor.far_clip;
        self.positive(sensor.near_clip, place, "near_clip");
        self.need(ordered && !sensor.far_clip.is_nan(), place, "far_clip", sensor.far_clip, "be greater than `near_clip`");
        self.transform(&sensor.to_world, "the sensor's `to_world`");
        match sensor.model {
            SensorModel::Perspective { fov_deg, principal_point_offset, .. } => {
                self.lens(sensor, fov_deg, principal_point_offset);
            }
            SensorModel::ThinLens { fov_deg, principal_point_offset, aperture_radius, focus_distance, .. } => {
                self.lens(sensor, fov_deg, principal_point_offset);
                self.positive(aperture_radius, place, "aperture_radius");
                self.positive(focus_distance, place, "focus_distance");
            }
            SensorModel::Orthographic => {}
        }
        self.need(sensor.sample_count != Some(0), place, "sample_count", 0, "be at least 1");
        self.film(&sensor.film);
    }

    fn lens(&mut self, sensor: &SensorDescription, fov: f32, offset: glam::Vec2) {
        self.need(fov > 0.0 && fov < 180.0, sensor.place, "fov", fov, "lie between 0 and 180 degrees");
        self.need(offset.is_finite(), sensor.place, "principal_point_offset_x", offset, "be finite");
        let linear = glam::Mat3::from_mat4(sensor.to_world.value);
        let gram = linear.transpose() * linear;
        if linear.is_finite() && linear.determinant() != 0.0 && !gram.abs_diff_eq(glam::Mat3::IDENTITY, 1e-3) {
            self.problems
                .error(sensor.to_world.place, "the sensor's `to_world` scales or shears")
                .hint("a camera is only moved and turned; use `fov` for the size of the picture");
        }
    }

    fn film(&mut self, film: &FilmDescription) {
        let place = film.place;
        self.need(film.width > 0, place, "width", film.width, "be at least 1");
        self.need(film.height > 0, place, "height", film.height, "be at least 1");
        if let Some([x, y, width, height]) = film.crop {
            let inside = |from: u32, size: u32, whole: u32| size > 0 && u64::from(from) + u64::from(size) <= u64::from(whole);
            if !inside(x, width, film.width) || !inside(y, height, film.height) {
                let what = format!(
                    "the crop window {width} × {height} at ({x}, {y}) does not lie in the film of {} × {} pixels",
                    film.width, film.height
                );
                self.problems.error((self.locate)(place, "crop"), what);
            }
        }
        let fine = |v: f32| v.is_finite() && v > 0.0 && v <= 64.0;
        let (ok, must) = match film.filter {
            FilterDescription::Box | FilterDescription::CatmullRom => (true, ""),
            FilterDescription::Tent { radius } => (fine(radius), "have a radius from 0 to 64 pixels"),
            FilterDescription::Gaussian { stddev } => (fine(4.0 * stddev), "have a standard deviation from 0 to 16 pixels"),
            FilterDescription::Mitchell { b, c } => (b.is_finite() && c.is_finite(), "have finite parameters"),
            FilterDescription::Lanczos { lobes } => ((1..=32).contains(&lobes), "have from 1 to 32 lobes"),
        };
        self.need(ok, place, "rfilter", film.filter, must);
    }

    fn transform(&mut self, transform: &Placed<Mat4>, name: &str) {
        let m = transform.value;
        if !m.is_finite() {
            self.problems.error(transform.place, format!("{name} is not finite"));
        } else if !m.row(3).abs_diff_eq(glam::Vec4::W, 1e-5) {
            self.problems.error(transform.place, format!("{name} is not affine: its last row must be 0 0 0 1"));
        } else if singular(m) {
            self.problems.error(transform.place, format!("{name} is not invertible")).hint("does it scale by 0?");
        }
    }

    fn index(&mut self, index: u32, count: usize, place: Place, what: &str) {
        if index as usize >= count {
            self.problems.error(place, format!("{what} {index} does not exist; there are {count}"));
        }
    }

    fn shape(&mut self, shape: &ShapeDescription, in_group: bool) {
        let place = shape.place;
        self.transform(&shape.to_world, "the shape's `to_world`");
        if let Some(bsdf) = shape.bsdf {
            self.index(bsdf.0, self.scene.bsdfs.len(), place, "local model");
        }
        let mut farthest = shape.to_world.value.w_axis.truncate().abs().max_element();
        match shape.model {
            ShapeModel::Mesh { mesh, .. } => self.index(mesh.0, self.scene.meshes.len(), place, "mesh"),
            ShapeModel::Sphere { center, radius } => {
                self.need(center.is_finite(), place, "center", center, "be finite");
                self.radius(radius, place);
                farthest = farthest.max(center.abs().max_element()).max(radius);
            }
            ShapeModel::Cylinder { p0, p1, radius } => {
                self.need(p0.is_finite(), place, "p0", p0, "be finite");
                self.need(p1.is_finite() && p0 != p1, place, "p1", p1, "be finite and not the same as `p0`");
                self.radius(radius, place);
                farthest = farthest.max(p0.abs().max(p1.abs()).max_element()).max(radius);
            }
            ShapeModel::Instance { group } => {
                self.index(group.0, self.scene.groups.len(), place, "shape group");
                if in_group {
                    self.problems.error(place, "an instance cannot stand in a shape group");
                }
                if shape.emission.is_some() {
                    self.problems.error(place, "an instance cannot emit").hint("emitters are shapes of their own");
                }
            }
            ShapeModel::Rectangle | ShapeModel::Disk | ShapeModel::Cube => {}
        }
        if farthest.is_finite() && farthest > FAR {
            self.problems
                .warning(place, format!("the shape reaches to {farthest:e}: rounding in single precision will be visible"));
        }
        if let Some(emission) = &shape.emission {
            self.not_negative(&emission.radiance, emission.place, "radiance");
            if in_group {
                self.problems
                    .error(emission.place, "a shape in a shape group cannot emit")
                    .hint("emitters are shapes of their own");
            }
        }
    }

    fn radius(&mut self, radius: f32, place: Place) {
        self.need(
            radius.is_finite() && radius > 0.0,
            place,
            "radius",
            radius,
            "be greater than 0 (`flip_normals` turns a shape inside out)",
        );
    }

    fn emitter(&mut self, emitter: &EmitterDescription) {
        let place = emitter.place;
        match &emitter.model {
            EmitterModel::Point { position, intensity } => {
                self.need(position.is_finite(), place, "position", position, "be finite");
                self.light(*intensity, place, "intensity");
            }
            EmitterModel::Spot { to_world, intensity, cutoff_angle_deg: cutoff, beam_width_deg: beam, texture } => {
                self.transform(to_world, "the emitter's `to_world`");
                self.light(*intensity, place, "intensity");
                let most = if texture.is_some() { 89.9 } else { 180.0 };
                let must = if texture.is_some() { "lie between 0 and 90 with a texture" } else { "lie between 0 and 180" };
                self.need(*cutoff > 0.0 && *cutoff <= most, place, "cutoff_angle", cutoff, must);
                self.need(*beam >= 0.0 && beam <= cutoff, place, "beam_width", beam, "lie between 0 and `cutoff_angle`");
                if let Some(texture) = texture {
                    self.not_negative(texture, place, "texture");
                }
            }
            EmitterModel::Directional { direction, irradiance, angular_diameter_deg: angle } => {
                let fine = direction.try_normalize().is_some();
                self.need(fine, place, "direction", direction, "be finite and not zero");
                self.light(*irradiance, place, "irradiance");
                self.need((0.0..180.0).contains(angle), place, "angular_diameter", angle, "lie between 0 and 180 degrees");
            }
            EmitterModel::Constant { radiance } | EmitterModel::Ambient { radiance } => self.light(*radiance, place, "radiance"),
            EmitterModel::Envmap { image, scale, to_world } => {
                self.index(image.0, self.scene.images.len(), place, "image");
                self.need(scale.is_finite() && *scale >= 0.0, place, "scale", scale, "be finite and not negative");
                self.transform(to_world, "the emitter's `to_world`");
            }
        }
    }

    fn light(&mut self, rgb: [f32; 3], place: Place, name: &'static str) {
        self.not_negative(&TextureDescription::Constant(rgb), place, name);
    }

    fn whole(&mut self) {
        let scene = self.scene;
        let environments: Vec<Place> = scene
            .emitters
            .iter()
            .filter(|e| matches!(e.model, EmitterModel::Constant { .. } | EmitterModel::Envmap { .. }))
            .map(|e| e.place)
            .collect();
        if let [first, second, ..] = environments[..] {
            let problem = self.problems.error(second, "the scene has two environment emitters");
            if let Some(first) = scene.sources.locate(first) {
                problem.hint(format!("the first is at {first}"));
            }
        }
        if scene.emitters.is_empty() && scene.shapes.iter().all(|s| s.emission.is_none()) {
            self.problems.warning(Place::default(), "no emitter: the image will be black");
        }
    }

    fn mesh(&mut self, number: usize, mesh: &MeshDescription) {
        let MeshDescription::Data(mesh) = mesh else { return };
        let count = mesh.positions.len();
        let mut wrong = |what: String| {
            self.problems.error(Place::default(), format!("mesh {number}: {what}"));
        };
        if let Some(i) = mesh.triangles.iter().position(|t| t.iter().any(|v| *v as usize >= count)) {
            wrong(format!("triangle {i} uses a vertex beyond the {count} that exist"));
        }
        if let Some(i) = mesh.positions.iter().position(|p| !p.is_finite()) {
            wrong(format!("vertex {i} is not finite"));
        }
        if !mesh.normals.is_empty() && mesh.normals.len() != count {
            wrong(format!("{} normals for {count} vertices", mesh.normals.len()));
        }
        if !mesh.uvs.is_empty() && mesh.uvs.len() != count {
            wrong(format!("{} texture coordinates for {count} vertices", mesh.uvs.len()));
        }
    }

    fn image(&mut self, number: usize, image: &ImageDescription) {
        let ImageDescription::Data(image) = image else { return };
        let expected = u64::from(image.width) * u64::from(image.height) * u64::from(image.channels);
        let mut wrong = |what: String| {
            self.problems.error(Place::default(), format!("image {number}: {what}"));
        };
        if image.width == 0 || image.height == 0 || !matches!(image.channels, 1 | 3) {
            wrong(format!("{} × {} pixels of {} channels", image.width, image.height, image.channels));
        }
        if expected != image.data.len() as u64 {
            wrong(format!("{} numbers instead of {expected}", image.data.len()));
        }
    }
}

/// The linear part has no inverse that single precision could hold.
fn singular(m: Mat4) -> bool {
    let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis].map(|axis| axis.truncate().as_dvec3());
    let volume = x.dot(y.cross(z)).abs();
    volume.is_nan() || volume <= 1e-12 * x.length() * y.length() * z.length()
}
