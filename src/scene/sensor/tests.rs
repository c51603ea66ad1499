//! Rays equal to Mitsuba 3.9.1's `sample_ray`, projection as their inverse, and ∫ g(y) dy = 1.

use super::*;
use crate::describe::{FovAxis, Place, Placed};
use crate::math::random::{Family, Random};
use glam::{Mat4, Vec4};

/// Mitsuba's `look_at(origin=[1,2,3], target=[-0.5,1.2,0.3], up=[0.1,1,0.2])`.
fn to_world() -> Mat4 {
    let (origin, target, up) = (Vec3::new(1.0, 2.0, 3.0), Vec3::new(-0.5, 1.2, 0.3), Vec3::new(0.1, 1.0, 0.2));
    let z = (target - origin).normalize();
    let x = up.cross(z).normalize();
    let y = z.cross(x);
    Mat4::from_cols(x.extend(0.0), y.extend(0.0), z.extend(0.0), origin.extend(1.0))
}

fn sensor_description(model: SensorModel, to_world: Mat4, size: [u32; 2], crop: Option<[u32; 4]>) -> SensorDescription {
    SensorDescription {
        id: None,
        model,
        to_world: Placed { value: to_world, place: Place::default() },
        near_clip: 0.01,
        far_clip: 10_000.0,
        sample_count: None,
        seed: 0,
        film: FilmDescription { width: size[0], height: size[1], crop, filter: FilterDescription::Box, place: Place::default() },
        place: Place::default(),
    }
}

fn perspective(fov_axis: FovAxis) -> SensorModel {
    SensorModel::Perspective { fov_deg: 50.0, fov_axis, principal_point_offset: Vec2::ZERO }
}

fn thin_lens() -> SensorModel {
    SensorModel::ThinLens {
        fov_deg: 35.0,
        fov_axis: FovAxis::X,
        principal_point_offset: Vec2::ZERO,
        aperture_radius: 0.3,
        focus_distance: 4.0,
    }
}

const CROP: Option<[u32; 4]> = Some([5, 7, 20, 11]);

/// The sensors of the reference rays.
fn described(name: &str, size: [u32; 2]) -> SensorDescription {
    let clipped = |mut s: SensorDescription| {
        (s.near_clip, s.far_clip) = (0.5, 20.0);
        s
    };
    let offset = SensorModel::Perspective { fov_deg: 50.0, fov_axis: FovAxis::X, principal_point_offset: Vec2::new(0.1, -0.2) };
    match name {
        "P x" => sensor_description(perspective(FovAxis::X), to_world(), size, None),
        "P y" => sensor_description(perspective(FovAxis::Y), to_world(), size, None),
        "P diagonal" => sensor_description(perspective(FovAxis::Diagonal), to_world(), size, None),
        "P smaller" => sensor_description(perspective(FovAxis::Smaller), to_world(), size, None),
        "P larger" => sensor_description(perspective(FovAxis::Larger), to_world(), size, None),
        "P crop off" => clipped(sensor_description(offset, to_world(), size, CROP)),
        "T crop" => clipped(sensor_description(thin_lens(), to_world(), size, CROP)),
        "O" => {
            let scaled = to_world() * Mat4::from_scale(Vec3::new(3.0, 3.0, 2.0));
            clipped(sensor_description(SensorModel::Orthographic, scaled, size, CROP))
        }
        _ => sensor_description(SensorModel::Orthographic, to_world(), size, None),
    }
}

/// Name, film size, (raster x, y, lens u, v), then origin, direction and length of Mitsuba's ray.
type Reference = (&'static str, [u32; 2], [f32; 4], [f32; 3], [f32; 3], f32);

#[rustfmt::skip]
const REFERENCE: &[Reference] = &[
    ("P x", [40, 30], [12.25, 9.5, 0.3, 0.8], [0.9935535, 1.998715, 2.992145], [-0.6293844, -0.1254252, -0.7669053], 10242.52),
    ("P x", [40, 30], [22.0, 16.75, 0.9, 0.1], [0.9957592, 1.997102, 2.991397], [-0.4232699, -0.2891966, -0.8586081], 10019.17),
    ("P x", [30, 40], [12.25, 9.5, 0.3, 0.8], [0.9941247, 2.000643, 2.991256], [-0.5566918, 0.06097573, -0.8284781], 10553.93),
    ("P x", [30, 40], [22.0, 16.75, 0.9, 0.1], [0.9970656, 1.998493, 2.99026], [-0.2853417, -0.1465335, -0.9471578], 10283.77),
    ("P y", [40, 30], [12.25, 9.5, 0.3, 0.8], [0.9929718, 1.999123, 2.992347], [-0.6740233, -0.08411692, -0.7339052], 10427.26),
    ("P y", [40, 30], [22.0, 16.75, 0.9, 0.1], [0.9959127, 1.996972, 2.991351], [-0.4073446, -0.3017284, -0.861992], 10034.06),
    ("P y", [30, 40], [12.25, 9.5, 0.3, 0.8], [0.9944182, 1.999856, 2.991327], [-0.5411202, -0.01397816, -0.840829], 10315.24),
    ("P y", [30, 40], [22.0, 16.75, 0.9, 0.1], [0.9966239, 1.998243, 2.990579], [-0.3322753, -0.1729256, -0.9271946], 10160.59),
    ("P diagonal", [40, 30], [12.25, 9.5, 0.3, 0.8], [0.9939026, 1.998471, 2.992023], [-0.6003858, -0.1505736, -0.7854072], 10155.88),
    ("P diagonal", [40, 30], [22.0, 16.75, 0.9, 0.1], [0.9956671, 1.99718, 2.991426], [-0.4327598, -0.2816023, -0.8563989], 10012.27),
    ("P diagonal", [30, 40], [12.25, 9.5, 0.3, 0.8], [0.9945943, 1.999383, 2.991369], [-0.52982, -0.06045564, -0.8459525], 10202.87),
    ("P diagonal", [30, 40], [22.0, 16.75, 0.9, 0.1], [0.9963589, 1.998093, 2.990771], [-0.3604002, -0.1887636, -0.9134987], 10103.07),
    ("P smaller", [40, 30], [12.25, 9.5, 0.3, 0.8], [0.9929718, 1.999123, 2.992347], [-0.6740233, -0.08411692, -0.7339052], 10427.26),
    ("P smaller", [40, 30], [22.0, 16.75, 0.9, 0.1], [0.9959127, 1.996972, 2.991351], [-0.4073446, -0.3017284, -0.861992], 10034.06),
    ("P smaller", [30, 40], [12.25, 9.5, 0.3, 0.8], [0.9941247, 2.000643, 2.991256], [-0.5566918, 0.06097573, -0.8284781], 10553.93),
    ("P smaller", [30, 40], [22.0, 16.75, 0.9, 0.1], [0.9970656, 1.998493, 2.99026], [-0.2853417, -0.1465335, -0.9471578], 10283.77),
    ("P larger", [40, 30], [12.25, 9.5, 0.3, 0.8], [0.9935535, 1.998715, 2.992145], [-0.6293844, -0.1254252, -0.7669053], 10242.52),
    ("P larger", [40, 30], [22.0, 16.75, 0.9, 0.1], [0.9957592, 1.997102, 2.991397], [-0.4232699, -0.2891966, -0.8586081], 10019.17),
    ("P larger", [30, 40], [12.25, 9.5, 0.3, 0.8], [0.9944182, 1.999856, 2.991327], [-0.5411202, -0.01397816, -0.840829], 10315.24),
    ("P larger", [30, 40], [22.0, 16.75, 0.9, 0.1], [0.9966239, 1.998243, 2.990579], [-0.3322753, -0.1729256, -0.9271946], 10160.59),
    ("P crop off", [40, 30], [12.25, 9.5, 0.3, 0.8], [0.7092075, 2.003955, 2.569525], [-0.5597504, 0.007613113, -0.8286262], 20.26065),
    ("P crop off", [40, 30], [22.0, 16.75, 0.9, 0.1], [0.8194912, 1.923313, 2.532151], [-0.3558268, -0.1511687, -0.9222447], 19.78447),
    ("T crop", [40, 30], [12.25, 9.5, 0.3, 0.8], [0.7567897, 2.048815, 2.529799], [-0.5957882, -0.2036685, -0.7768883], 19.72501),
    ("T crop", [40, 30], [22.0, 16.75, 0.9, 0.1], [0.6703603, 1.71617, 2.676377], [-0.4063698, -0.2349428, -0.8829865], 19.5554),
    ("O", [40, 30], [12.25, 9.5, 0.3, 0.8], [-0.5929047, 2.535881, 2.54446], [-0.4701294, -0.2507356, -0.846233], 19.5),
    ("O", [40, 30], [22.0, 16.75, 0.9, 0.1], [0.8261196, 1.498257, 2.063557], [-0.4701294, -0.2507356, -0.846233], 19.5),
    ("O2", [30, 40], [12.25, 9.5, 0.3, 0.8], [0.7435343, 2.673203, 2.931196], [-0.4701294, -0.2507356, -0.846233], 9999.99),
    ("O2", [30, 40], [22.0, 16.75, 0.9, 0.1], [1.374212, 2.212037, 2.717462], [-0.4701294, -0.2507356, -0.846233], 9999.99),
];

fn built(description: &SensorDescription) -> Sensor {
    let mut problems = Problems::default();
    let sensor = Sensor::build(description, &mut problems);
    assert_eq!(problems, Problems::default());
    sensor.expect("a valid sensor")
}

/// One of each kind, all with a crop.
fn kinds() -> Vec<(&'static str, Sensor)> {
    ["P crop off", "T crop", "O"].map(|name| (name, built(&described(name, [40, 30])))).to_vec()
}

#[test]
fn rays_equal_mitsubas() {
    for (name, size, [x, y, u, v], o, d, t_max) in REFERENCE {
        let ray = built(&described(name, *size)).sample_ray(Vec2::new(*x, *y), Vec2::new(*u, *v));
        assert!((ray.o - Vec3::from(*o)).abs().max_element() < 2e-6, "{name} {size:?}: origin {} for {o:?}", ray.o);
        assert!((ray.d - Vec3::from(*d)).abs().max_element() < 1e-6, "{name} {size:?}: direction {} for {d:?}", ray.d);
        assert!((ray.t_max / t_max - 1.0).abs() < 1e-5, "{name} {size:?}: length {} for {t_max}", ray.t_max);
    }
}

#[test]
fn projection_inverts_rays() {
    let mut random = Random::new(Family::Other, 1, 0, 0);
    for (name, sensor) in kinds() {
        for _ in 0..2_000 {
            let raster = Vec2::new(5.0 + 20.0 * random.unit(), 7.0 + 11.0 * random.unit());
            let u = random.unit2();
            let ray = sensor.sample_ray(raster, u);
            let t = ray.t_max * random.unit().clamp(1e-4, 0.999);
            let x = ray.o + ray.d * t;
            let back = sensor.connect(x, u).expect("a point of a camera ray is visible");
            let margin = (raster - back.raster).abs().max_element();
            assert!(margin < 1e-3, "{name}: {raster} came back as {}", back.raster);
            assert!((back.end - ray.o).length() < 2e-5 * (1.0 + t), "{name}: the shadow segment ends at {}", back.end);
            assert!((back.w + ray.d).length() < 1e-5, "{name}: direction {} for {}", back.w, -ray.d);
            assert!((back.g_dir / sensor.density(ray.d) - 1.0).abs() < 1e-4, "{name}: both walkers must see one density");
            assert!((back.inv_d2 / sensor.inv_d2(ray.lens, x) - 1.0).abs() < 1e-4, "{name}: both must see one distance");
            if let Some(far) = sensor.connect_infinite(-ray.d, u) {
                assert!((raster - far.raster).abs().max_element() < 1e-3, "{name}: {raster} at infinity is {}", far.raster);
                assert!((far.end - ray.o).length() < 2e-5);
                assert!(!sensor.is_orthographic());
            }
        }
    }
}

#[test]
fn planes_and_window_bound_what_is_seen() {
    let u = Vec2::new(0.3, 0.6);
    for (name, sensor) in kinds() {
        let ray = sensor.sample_ray(Vec2::new(12.0, 9.0), u);
        let visible = |t: f32| sensor.connect(ray.o + ray.d * t, u).is_some();
        assert!(!visible(-1e-3) && visible(1e-3), "{name}: near plane");
        assert!(visible(ray.t_max * 0.9999) && !visible(ray.t_max * 1.0001), "{name}: far plane");
        for (raster, inside) in [(Vec2::new(4.9, 9.0), false), (Vec2::new(5.1, 9.0), true), (Vec2::new(12.0, 18.1), false)] {
            let ray = sensor.sample_ray(raster, u);
            assert_eq!(sensor.connect(ray.o + ray.d, u).is_some(), inside, "{name}: {raster} against the crop window");
        }
        let behind = sensor.sample_ray(Vec2::new(12.0, 9.0), u);
        assert!(sensor.connect(behind.o - behind.d * 3.0, u).is_none(), "{name}: nothing behind is seen");
    }
    let mut wide = described("P x", [40, 30]);
    wide.film.filter = FilterDescription::Gaussian { stddev: 0.5 };
    let ray = built(&wide).sample_ray(Vec2::new(-1.4, 9.0), u);
    assert!(built(&wide).connect(ray.o + ray.d, u).is_some(), "a filter of radius 2 reaches 1.5 pixels beyond the film");
}

/// ∫ g(y) dy over a plane that fills the view is 1 per pixel (the number of pixels of the window),
/// averaged over lens points.
#[test]
fn camera_factor_integrates_to_the_number_of_pixels() {
    for (name, sensor) in kinds() {
        let middle = sensor.sample_ray(Vec2::new(15.0, 12.5), Vec2::splat(0.5));
        let centre = middle.o + middle.d * 6.0;
        // A tilted plane, so that the cosine at y matters.
        let n = (middle.d + Vec3::new(0.3, -0.2, 0.1)).normalize();
        let frame = crate::math::Frame::around(n);
        let half = 14.0;
        let cells = 700;
        let mut sum = 0.0f64;
        for i in 0..cells * cells {
            let (a, b) = ((i % cells) as f32, (i / cells) as f32);
            let st = (Vec2::new(a, b) + 0.5) * (2.0 * half / cells as f32) - half;
            let y = centre + frame.s * st.x + frame.t * st.y;
            let lens = Vec2::new((i * 7 % 16) as f32 + 0.5, (i * 13 / cells % 16) as f32 + 0.5) / 16.0;
            if let Some(c) = sensor.connect(y, lens) {
                sum += f64::from(c.g_dir * c.w.dot(n).abs() * c.inv_d2);
            }
        }
        let total = sum * f64::from(2.0 * half / cells as f32).powi(2);
        assert!((total / 220.0 - 1.0).abs() < 0.01, "{name}: ∫ g = {total} for 220 pixels");
    }
}

/// The other measure: ∫ D²/cos³θ dω over the film's directions is the number of pixels.
#[test]
fn direction_density_integrates_to_the_number_of_pixels() {
    for (name, sensor) in kinds().into_iter().take(2) {
        let frame = crate::math::Frame::around(sensor.sample_ray(Vec2::new(20.0, 15.0), Vec2::splat(0.5)).d);
        let (n, u) = (1_200, Vec2::new(0.2, 0.7));
        let mut sum = 0.0f64;
        for i in 0..n * n {
            let p = Vec2::new((i % n) as f32 + 0.5, (i / n) as f32 + 0.5) / n as f32;
            let w = frame.to_world(crate::math::warp::cone_uniform(p, 0.6));
            if let Some(c) = sensor.connect_infinite(-w, u) {
                sum += f64::from(c.g_dir);
            }
        }
        let total = sum / f64::from(n * n) / f64::from(crate::math::warp::cone_uniform_p_w(0.6));
        assert!((total / 220.0 - 1.0).abs() < 0.01, "{name}: {total} for 220 pixels");
    }
}

#[test]
fn what_cannot_be_built_is_refused() {
    let refuse = |change: &dyn Fn(&mut SensorDescription), word: &str| {
        let mut description = described("P x", [40, 30]);
        change(&mut description);
        let mut problems = Problems::default();
        assert!(Sensor::build(&description, &mut problems).is_none(), "{word}");
        assert!(problems.list.iter().any(|p| p.what.contains(word)), "{problems:?} says nothing of {word}");
    };
    refuse(&|s| s.model = perspective_of(180.0), "field of view");
    refuse(&|s| s.model = perspective_of(f32::NAN), "field of view");
    refuse(&|s| s.to_world.value = Mat4::ZERO, "invertible");
    refuse(&|s| s.to_world.value.w_axis = Vec4::new(f32::NAN, 0.0, 0.0, 1.0), "invertible");
    refuse(&|s| s.to_world.value = Mat4::from_scale(Vec3::new(1.0, 2.0, 1.0)), "shears");
    refuse(&|s| s.near_clip = 0.0, "clip");
    refuse(&|s| s.far_clip = f32::INFINITY, "clip");
    refuse(&|s| s.film.width = 0, "no pixels");
    refuse(&|s| s.film.crop = Some([30, 0, 11, 3]), "crop");
    refuse(&|s| s.film.crop = Some([u32::MAX, 0, 2, 3]), "crop");
}

fn perspective_of(fov_deg: f32) -> SensorModel {
    SensorModel::Perspective { fov_deg, fov_axis: FovAxis::X, principal_point_offset: Vec2::ZERO }
}
