//! Caustics with closed forms: what Dirac light makes after Dirac events, on a diffuse receiver.
//!
//! All are of the class `E D S+ L`: gathering finds exactly nothing, shooting must find the closed form. A
//! receiver of reflectance ρ under irradiance E has the radiance ρE/π; parallel projection
//! makes pixels equal areas of it. Refraction and Fresnel's equations are written here a second time.

use super::compare::Estimate;
use super::furnace::add_mesh;
use crate::describe::Mesh;
use crate::io::mitsuba::{self, LoadError};
use crate::render::{Budget, Control, Estimator, Options, Picture, Render};
use crate::scene::Scene;
use crate::transport::class::PathFilter;
use glam::{Vec2, Vec3};
use std::f64::consts::PI;

/// Reflectance of all receivers.
const RHO: f64 = 0.5;
/// Pixels per side of all films.
const SIDE: u32 = 64;

/// A measured number and what it should be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Known {
    /// By the closed form.
    pub exact: f64,
    /// By the walks.
    pub found: Estimate,
}

impl Known {
    /// Difference in standard errors.
    pub fn z(&self) -> f64 {
        (self.found.mean - self.exact) / self.found.standard_error.max(1e-6 * self.exact.abs())
    }
}

/// A caustic, measured.
#[derive(Clone, Debug)]
pub struct Caustic {
    /// Parts of it, by place or by path length.
    pub bins: Vec<Known>,
    /// All of it.
    pub total: Known,
    /// The largest pixel by gathering, which cannot see it.
    pub gathered: f32,
}

impl Caustic {
    /// Bins within so many standard errors.
    pub fn within(&self, errors: f64) -> usize {
        self.bins.iter().filter(|b| b.z().abs() <= errors).count()
    }

    /// The largest z of a bin or the total.
    pub fn worst(&self) -> f64 {
        self.bins.iter().chain([&self.total]).map(|b| b.z().abs()).fold(0.0, f64::max)
    }
}

/// How much to render.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Passes, each with a light path per pixel.
    pub passes: u64,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// `T(θ)` of a smooth boundary entered at `cos`, and the cosine behind it; `n` = index behind over index before.
fn transmitted(cos: f64, n: f64) -> (f64, f64) {
    let cos_t = (1.0 - (1.0 - cos * cos) / (n * n)).max(0.0).sqrt();
    let s = (cos - n * cos_t) / (cos + n * cos_t);
    let p = (n * cos - cos_t) / (n * cos + cos_t);
    (1.0 - 0.5 * (s * s + p * p), cos_t)
}

/// Integral over [a, b] by midpoints.
fn integral(a: f64, b: f64, steps: u32, f: impl Fn(f64) -> f64) -> f64 {
    let h = (b - a) / f64::from(steps);
    (0..steps).map(|i| f(a + (f64::from(i) + 0.5) * h)).sum::<f64>() * h
}

/// A scene of these parts, seen by parallel projection of ± `half` from `eye` along ±z.
fn xml(eye: [f64; 3], up: bool, half: f64, parts: &str) -> String {
    let [x, y, z] = eye;
    let target = z + if up { 1.0 } else { -1.0 };
    format!(
        r#"<scene version="3.0.0">
  <sensor type="orthographic"><transform name="to_world"><scale x="{half}" y="{half}"/>
    <lookat origin="{x}, {y}, {z}" target="{x}, {y}, {target}" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="{SIDE}"/><integer name="height" value="{SIDE}"/><rfilter type="box"/></film></sensor>
  <bsdf type="diffuse" id="receiver"><rgb name="reflectance" value="{RHO}"/></bsdf>
  {parts}
</scene>"#
    )
}

fn scene(xml: &str) -> Result<Scene, LoadError> {
    crate::load_str(xml, ".".as_ref(), &Default::default()).map(|l| l.scene)
}

/// Paths `E D S+ L` of these lengths.
fn render(scene: &Scene, estimator: Estimator, lengths: (u32, u32), effort: Effort) -> Picture {
    let mut options = Options::for_scene(scene, estimator);
    let s = &mut options.settings;
    (s.min_length, s.max_length) = lengths;
    s.paths = PathFilter::parse("E D S+ L").unwrap_or_default();
    s.seed = effort.seed;
    // Independent passes, whose variance is that of their mean.
    s.stratified = false;
    match Render::new(scene, &options) {
        Ok(mut render) => {
            render.run(&Budget::passes(effort.passes.max(2)), |_| Control::Continue);
            render.picture()
        }
        // A film of this size and filter can always be made.
        Err(_) => Picture { width: 0, height: 0, mean: Vec::new(), variance: Vec::new() },
    }
}

/// The largest pixel that gathering finds of the same paths.
fn gathered(scene: &Scene, lengths: (u32, u32), seed: u64) -> f32 {
    let picture = render(scene, Estimator::Gather, lengths, Effort { passes: 16, seed });
    picture.mean.iter().flatten().fold(0.0, |a, b| a.max(*b))
}

/// Where the receiver at height z is seen at a place of the film.
fn place(scene: &Scene, raster: Vec2, z: f64) -> [f64; 2] {
    let r = scene.sensor.sample_ray(raster, Vec2::splat(0.5));
    let t = (z - f64::from(r.o.z)) / f64::from(r.d.z);
    [f64::from(r.o.x) + t * f64::from(r.d.x), f64::from(r.o.y) + t * f64::from(r.d.y)]
}

/// Sum over some pixels.
fn sum(picture: &Picture, pixels: impl Iterator<Item = (u32, u32)>) -> Estimate {
    let (mut mean, mut variance) = (0.0, 0.0);
    for (x, y) in pixels {
        let i = (y * SIDE + x) as usize;
        mean += picture.mean.get(i).map_or(0.0, |m| f64::from(m[0]));
        variance += picture.variance.get(i).map_or(0.0, |v| f64::from(v[0]));
    }
    Estimate { mean, standard_error: variance.sqrt() }
}

fn pixels() -> impl Iterator<Item = (u32, u32)> {
    (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y)))
}

/// Bins of pixels, `bin` of a pixel and `radiance` at a place of the receiver at height z.
fn bins(
    scene: &Scene,
    picture: &Picture,
    (count, z): (usize, f64),
    bin: impl Fn([f64; 2]) -> Option<usize>,
    radiance: impl Fn([f64; 2]) -> f64,
) -> Vec<Known> {
    const POINTS: u32 = 6;
    let mut members: Vec<Vec<(u32, u32)>> = vec![Vec::new(); count];
    for (x, y) in pixels() {
        let centre = place(scene, Vec2::new(x as f32 + 0.5, y as f32 + 0.5), z);
        if let Some(b) = bin(centre).and_then(|b| members.get_mut(b)) {
            b.push((x, y));
        }
    }
    let mean_of = |(x, y): &(u32, u32)| {
        let points = (0..POINTS * POINTS).map(|i| {
            let at = Vec2::new((i % POINTS) as f32 + 0.5, (i / POINTS) as f32 + 0.5) / POINTS as f32;
            radiance(place(scene, Vec2::new(*x as f32, *y as f32) + at, z))
        });
        points.sum::<f64>() / f64::from(POINTS * POINTS)
    };
    let known = |members: &Vec<(u32, u32)>| Known {
        exact: members.iter().map(mean_of).sum(),
        found: sum(picture, members.iter().copied()),
    };
    members.iter().filter(|m| !m.is_empty()).map(known).collect()
}

fn total(bins: &[Known]) -> Known {
    let (mut exact, mut mean, mut variance) = (0.0, 0.0, 0.0);
    for b in bins {
        exact += b.exact;
        mean += b.found.mean;
        variance += b.found.standard_error.powi(2);
    }
    Known { exact, found: Estimate { mean, standard_error: f64::sqrt(variance) } }
}

/// C1: a point light I at height h above flat water of depth d, the ground seen from below the surface. Light
/// that leaves at θ arrives at r = h tanθ + d tanθ_t, so that E(r) = I T(θ) sinθ dθ / (r dr).
/// 60 rings around the light's foot.
pub fn water(effort: Effort) -> Result<Caustic, LoadError> {
    const N: f64 = 1.33;
    let (h, d, intensity, half, rings) = (1.0, 0.8, 10.0, 1.2, 60usize);
    let parts = format!(
        r#"<shape type="rectangle"><transform name="to_world"><scale value="30"/></transform>
    <bsdf type="dielectric"><float name="int_ior" value="{N}"/><float name="ext_ior" value="1"/></bsdf></shape>
  <shape type="rectangle"><transform name="to_world"><scale value="30"/><translate z="{}"/></transform><ref id="receiver"/></shape>
  <emitter type="point"><point name="position" value="0, 0, {h}"/><rgb name="intensity" value="{intensity}"/></emitter>"#,
        -d
    );
    let world = scene(&xml([0.0, 0.0, -0.1], false, half, &parts))?;
    let picture = render(&world, Estimator::Shoot, (3, 3), effort);
    let arrives = |theta: f64| {
        let (t, cos_t) = transmitted(theta.cos(), N);
        (h * theta.tan() + d * theta.sin() / (N * cos_t), t, cos_t)
    };
    let irradiance = |p: [f64; 2]| {
        let r = p[0].hypot(p[1]);
        let (mut low, mut high) = (0.0, 0.5 * PI);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if arrives(middle).0 < r { low = middle } else { high = middle }
        }
        let (r, t, cos_t) = arrives(low);
        let dr = h / low.cos().powi(2) + d * low.cos() / (N * cos_t.powi(3));
        intensity * t * low.sin() / (r * dr)
    };
    let ring = |p: [f64; 2]| Some((p[0].hypot(p[1]) / half * rings as f64) as usize);
    let bins = bins(&world, &picture, (rings, -d), ring, |p| RHO / PI * irradiance(p));
    Ok(Caustic { total: total(&bins), bins, gathered: gathered(&world, (3, 3), effort.seed) })
}

/// C2: a glass plate of index `n` across parallel light. After 2k reflections inside, (1−R)² R^{2k} of it
/// is left: one closed form for each path length 4 + 2k, here for k < `orders`; (1−R)/(1+R) in all.
pub fn slab(n: f64, orders: u32, effort: Effort) -> Result<Caustic, LoadError> {
    let glass = format!(
        r#"<bsdf type="dielectric" id="glass"><float name="int_ior" value="{n}"/><float name="ext_ior" value="1"/></bsdf>
  <shape type="rectangle"><transform name="to_world"><scale value="1.1"/><translate z="1"/></transform><ref id="glass"/></shape>
  <shape type="rectangle"><transform name="to_world"><scale value="1.1"/><rotate x="1" angle="180"/><translate z="0.8"/></transform><ref id="glass"/></shape>
  <shape type="rectangle"><ref id="receiver"/></shape>
  <emitter type="directional"><vector name="direction" value="0, 0, -1"/><rgb name="irradiance" value="1"/></emitter>"#
    );
    let world = scene(&xml([0.0, 0.0, 0.5], false, 0.9, &glass))?;
    let r = ((n - 1.0) / (n + 1.0)).powi(2);
    let measure = |lengths, exact: f64| {
        let all = sum(&render(&world, Estimator::Shoot, lengths, effort), pixels());
        let scale = PI / RHO / f64::from(SIDE * SIDE);
        Known { exact, found: Estimate { mean: all.mean * scale, standard_error: all.standard_error * scale } }
    };
    let order = |k: u32| measure((4 + 2 * k, 4 + 2 * k), (1.0 - r).powi(2) * r.powi(2 * k as i32));
    let bins = (0..orders).map(order).collect();
    let total = measure((4, 100), (1.0 - r) / (1.0 + r));
    Ok(Caustic { bins, total, gathered: gathered(&world, (4, 100), effort.seed) })
}

/// C3: a parabolic mirror of reflectance 0.8 in parallel light along its axis sends all of it to its focus: the
/// flux on a disc there is E₀ · 0.8 · A, A the area of the aperture without the disc's own shadow. The mirror
/// consists of flat facets, its aperture is a polygon.
pub fn parabolic_mirror(effort: Effort) -> Result<Caustic, LoadError> {
    const RINGS: u32 = 48;
    const SECTORS: u32 = 160;
    let (radius, half) = (0.12, 0.13);
    let parts = format!(
        r#"<bsdf type="conductor" id="mirror"><string name="material" value="none"/><rgb name="specular_reflectance" value="0.8"/></bsdf>
  <shape type="disk"><boolean name="flip_normals" value="true"/>
    <transform name="to_world"><scale value="{radius}"/><translate z="1"/></transform><ref id="receiver"/></shape>
  <emitter type="directional"><vector name="direction" value="0, 0, -1"/><rgb name="irradiance" value="1"/></emitter>"#
    );
    let text = xml([0.0, 0.0, 0.8], true, half, &parts);
    let mut read = mitsuba::from_str(&text, ".".as_ref(), &Default::default())?;
    add_mesh(&mut read.scene, paraboloid(RINGS, SECTORS), "mirror");
    let world = crate::finish(read)?.scene;
    let picture = render(&world, Estimator::Shoot, (3, 3), effort);
    let all = sum(&picture, pixels());
    let scale = PI / RHO * (2.0 * half / f64::from(SIDE)).powi(2);
    let sectors = f64::from(SECTORS);
    let aperture = 0.5 * sectors * (2.0 * PI / sectors).sin();
    let total = Known {
        exact: 0.8 * (aperture - PI * radius * radius),
        found: Estimate { mean: all.mean * scale, standard_error: all.standard_error * scale },
    };
    Ok(Caustic { bins: vec![total], total, gathered: gathered(&world, (3, 3), effort.seed) })
}

/// z = r²/4 up to r = 1 as flat triangles, normals up.
fn paraboloid(rings: u32, sectors: u32) -> Mesh {
    let mut positions = vec![Vec3::ZERO];
    for i in 1..=rings {
        for j in 0..sectors {
            let (r, phi) = (f64::from(i) / f64::from(rings), 2.0 * PI * f64::from(j) / f64::from(sectors));
            positions.push(Vec3::new((r * phi.cos()) as f32, (r * phi.sin()) as f32, (0.25 * r * r) as f32));
        }
    }
    let at = |i: u32, j: u32| 1 + (i - 1) * sectors + j % sectors;
    let mut triangles = Vec::new();
    for j in 0..sectors {
        triangles.push([0, at(1, j), at(1, j + 1)]);
        for i in 1..rings {
            triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    Mesh { positions, triangles, ..Mesh::default() }
}

/// The nephroid in a cup, measured.
#[derive(Clone, Debug)]
pub struct Nephroid {
    /// Along the axis, one bin for each column of pixels.
    pub caustic: Caustic,
    /// Distance of the cusp from the axis of the cylinder, in radii: beyond it one ray arrives at each place of the axis, and
    /// 1/E falls linearly to zero at the cusp.
    pub cusp: Estimate,
}

/// C4: a cylindrical mirror in parallel light that falls in at 45°. In plan the light that meets the wall at
/// angle φ leaves along its mirror image and has the brightness E cosφ / |cosφ − 2s| after a path of
/// length s: infinite at s = cosφ/2, the nephroid, whose cusp is half a radius from the axis. The flux of a bin
/// is the integral over φ of cosφ times the length of the ray inside the bin.
pub fn nephroid(effort: Effort) -> Result<Nephroid, LoadError> {
    let (height, half, centre) = (1.2f64, 0.35, 0.55);
    let parts = format!(
        r#"<shape type="cylinder"><point name="p0" value="0, 0, 0"/><point name="p1" value="0, 0, {height}"/>
    <boolean name="flip_normals" value="true"/><bsdf type="conductor"><string name="material" value="none"/></bsdf></shape>
  <shape type="disk"><ref id="receiver"/></shape>
  <emitter type="directional"><vector name="direction" value="1, 0, -1"/><rgb name="irradiance" value="1"/></emitter>"#
    );
    let world = scene(&xml([centre, 0.0, 1.0], false, half, &parts))?;
    let picture = render(&world, Estimator::Shoot, (3, 3), effort);
    // A strip of two pixels around the axis; the world's x runs along rows, one way or the other.
    let rows = SIDE / 2 - 1..SIDE / 2 + 1;
    let corner = |x: u32, y: u32| place(&world, Vec2::new(x as f32, y as f32), 0.0);
    let column = |x: u32| {
        let (a, b) = (corner(x, rows.start), corner(x + 1, rows.end));
        let area = ((a[0] - b[0]) * (a[1] - b[1])).abs();
        let flux = integral(-0.5 * PI, 0.5 * PI, 20_000, |phi| {
            let cos = phi.cos();
            // The rim on the near side shades what lies low; at 45° height and way are the same.
            let lit = ((height - 2.0 * cos).max(0.0), height.min(2.0 * cos));
            let (start, way) = ([cos, phi.sin()], [-(2.0 * phi).cos(), -(2.0 * phi).sin()]);
            cos * inside(start, way, lit, a, b)
        });
        let pixels = f64::from(rows.end - rows.start);
        let exact = RHO / PI * 0.5f64.sqrt() * flux / area * pixels;
        Known { exact, found: sum(&picture, rows.clone().map(|y| (x, y))) }
    };
    let bins: Vec<Known> = (0..SIDE).map(column).collect();
    let middle = |x: u32| 0.5 * (corner(x, 0)[0] + corner(x + 1, 0)[0]);
    let beyond: Vec<(f64, Estimate)> =
        (0..SIDE).map(|x| (middle(x), bins[x as usize].found)).filter(|(x, e)| *x < 0.45 && e.mean > 0.0).collect();
    let gathered = gathered(&world, (3, 3), effort.seed);
    Ok(Nephroid { caustic: Caustic { total: total(&bins), bins, gathered }, cusp: zero_of_inverse(&beyond) })
}

/// Where the line through the inverse values, weighted by their errors, is zero.
fn zero_of_inverse(points: &[(f64, Estimate)]) -> Estimate {
    let inverse: Vec<f64> = points.iter().map(|(_, e)| 1.0 / e.mean).collect();
    let error = |i: usize| points[i].1.standard_error / points[i].1.mean.powi(2);
    let zero = |values: &[f64]| {
        let (mut w, mut x, mut y, mut xx, mut xy) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (i, (at, v)) in points.iter().map(|p| p.0).zip(values).enumerate() {
            let weight = error(i).max(1e-300).powi(-2);
            (w, x, y) = (w + weight, x + weight * at, y + weight * v);
            (xx, xy) = (xx + weight * at * at, xy + weight * at * v);
        }
        let slope = (w * xy - x * y) / (w * xx - x * x);
        (x - y / slope) / w
    };
    let mean = zero(&inverse);
    let change = |i: usize| {
        let mut other = inverse.clone();
        other[i] += error(i);
        zero(&other) - mean
    };
    Estimate { mean, standard_error: (0..points.len()).map(|i| change(i).powi(2)).sum::<f64>().sqrt() }
}

/// Length of the ray `start + s way`, s in the range, inside the rectangle with opposite corners a and b.
fn inside(start: [f64; 2], way: [f64; 2], (mut from, mut to): (f64, f64), a: [f64; 2], b: [f64; 2]) -> f64 {
    for i in 0..2 {
        let (p, q) = ((a[i] - start[i]) / way[i], (b[i] - start[i]) / way[i]);
        from = f64::max(from, p.min(q));
        to = f64::min(to, p.max(q));
    }
    (to - from).max(0.0)
}

/// C5: whatever the shape of a caustic, its flux is what enters times Fresnel's factors. Parallel light falls
/// through rippled water, of which facet i takes A_i cosθ_i T(θ_i); the receiver is so wide that all arrives.
pub fn flux_balance(effort: Effort) -> Result<Caustic, LoadError> {
    const N: f64 = 1.33;
    let half = 1.6;
    let parts = format!(
        r#"<bsdf type="dielectric" id="water"><float name="int_ior" value="{N}"/><float name="ext_ior" value="1"/></bsdf>
  <shape type="rectangle"><transform name="to_world"><scale value="2"/><translate z="-1"/></transform><ref id="receiver"/></shape>
  <emitter type="directional"><vector name="direction" value="0, 0, -1"/><rgb name="irradiance" value="1"/></emitter>"#
    );
    let mut read = mitsuba::from_str(&xml([0.0, 0.0, -0.5], false, half, &parts), ".".as_ref(), &Default::default())?;
    let mesh = ripples(40);
    let exact = mesh.triangles.iter().map(|t| {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize].as_dvec3());
        let normal = (b - a).cross(c - a);
        0.5 * normal.z * transmitted(normal.z / normal.length(), N).0
    });
    let exact = exact.sum();
    add_mesh(&mut read.scene, mesh, "water");
    let world = crate::finish(read)?.scene;
    let picture = render(&world, Estimator::Shoot, (3, 3), effort);
    let all = sum(&picture, pixels());
    let scale = PI / RHO * (2.0 * half / f64::from(SIDE)).powi(2);
    let total = Known { exact, found: Estimate { mean: all.mean * scale, standard_error: all.standard_error * scale } };
    Ok(Caustic { bins: vec![total], total, gathered: gathered(&world, (3, 3), effort.seed) })
}

/// Waves over [−1, 1]² with slopes up to about 1, too flat for light from above to meet them twice.
fn ripples(cells: u32) -> Mesh {
    let at = |i: u32| 2.0 * f64::from(i) / f64::from(cells) - 1.0;
    let height = |x: f64, y: f64| 0.06 * (9.0 * x + 2.0 * y).sin() + 0.05 * (8.0 * y - 3.0 * x).cos();
    let corners = (0..=cells).flat_map(|j| (0..=cells).map(move |i| (i, j)));
    let positions = corners.map(|(i, j)| Vec3::new(at(i) as f32, at(j) as f32, height(at(i), at(j)) as f32)).collect();
    let triangle = |i: u32, j: u32| {
        let (a, b) = (j * (cells + 1) + i, (j + 1) * (cells + 1) + i);
        [[a, a + 1, b + 1], [a, b + 1, b]]
    };
    let triangles = (0..cells).flat_map(|j| (0..cells).flat_map(move |i| triangle(i, j))).collect();
    Mesh { positions, triangles, ..Mesh::default() }
}
