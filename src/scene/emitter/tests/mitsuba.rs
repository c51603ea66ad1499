//! Values of Mitsuba 3.9.1 (`scalar_rgb`) for the same emitters: `eval` and `sample_direction`.

use super::*;
use crate::describe::{BitmapFilter, BitmapWrap, TextureDescription};

/// Direction or position, then what Mitsuba gives there.
type Reference = ([f32; 3], [f32; 3]);

/// The environment image of the references times 1.5, in its own frame.
#[rustfmt::skip]
const ENVMAP: &[Reference] = &[
    ([0.003033931, 0.7367971, -0.6761071], [2.627805, 2.397445, 2.933737]),
    ([-0.6323985, -0.3228562, -0.7041562], [1.399676, 2.960528, 0.8996757]),
    ([0.04208769, 0.9378646, -0.3444395], [1.792328, 2.074494, 3.463808]),
    ([-0.7153654, 0.5647546, 0.4114665], [1.631618, 2.953042, 1.131618]),
    ([0.1125166, -0.9931592, -0.03122269], [3.338165, 3.278449, 2.838165]),
    ([0.4397685, -0.8501948, -0.2894348], [3.207239, 1.78459, 2.707239]),
    ([-0.6457061, -0.4379615, -0.6255025], [1.067901, 3.24964, 0.5679011]),
    ([-0.1784647, -0.9621566, 0.2059249], [2.794376, 2.366867, 2.294375]),
    ([0.06199234, -0.07392795, -0.9953349], [2.368536, 2.080062, 1.868536]),
    ([-0.9748101, -0.08776654, 0.2050421], [1.975402, 4.280836, 1.475402]),
    ([0.01000018, 0.999918, 0.008000144], [3.019463, 1.578338, 2.519463]),
    ([-0.020005, -0.9997498, 0.0100025], [3.64058, 1.384383, 3.14058]),
    ([0.0, 0.0, -1.0], [2.45, 2.2, 1.95]),
    ([0.0009999995, 0.0, -0.9999995], [2.449801, 2.199801, 1.949801]),
    ([-0.0009999995, 0.0, -0.9999995], [2.450199, 2.200199, 1.950199]),
    ([0.0, 0.0, 1.0], [3.825, 0.8249999, 3.325]),
];

/// Mirrored in x, then turned by 50° about (0.3, 1, 0.2).
#[rustfmt::skip]
const ENVMAP_TURNED: &[Reference] = &[
    ([0.003033931, 0.7367971, -0.6761071], [3.900825, 1.926173, 3.400825]),
    ([-0.6323985, -0.3228562, -0.7041562], [1.875019, 1.58947, 1.375019]),
    ([0.04208769, 0.9378646, -0.3444395], [3.620862, 1.539201, 3.120862]),
    ([-0.7153654, 0.5647546, 0.4114665], [2.464937, 3.025464, 2.782133]),
    ([0.1125166, -0.9931592, -0.03122269], [1.858482, 3.623019, 1.358482]),
    ([0.4397685, -0.8501948, -0.2894348], [3.038536, 2.586431, 2.538535]),
    ([-0.6457061, -0.4379615, -0.6255025], [2.170745, 1.394253, 1.670745]),
    ([-0.1784647, -0.9621566, 0.2059249], [1.82808, 4.244094, 1.32808]),
    ([0.06199234, -0.07392795, -0.9953349], [1.430458, 3.243412, 0.9304579]),
    ([-0.9748101, -0.08776654, 0.2050421], [2.522179, 2.324654, 2.022179]),
    ([0.01000018, 0.999918, 0.008000144], [3.649755, 1.136693, 3.149754]),
    ([-0.020005, -0.9997498, 0.0100025], [2.078578, 4.333181, 1.578578]),
    ([0.0, 0.0, -1.0], [1.605465, 3.034831, 1.105465]),
    ([0.0009999995, 0.0, -0.9999995], [1.605921, 3.036559, 1.105921]),
    ([-0.0009999995, 0.0, -0.9999995], [1.60501, 3.033102, 1.10501]),
    ([0.0, 0.0, 1.0], [3.90017, 1.723571, 3.40017]),
];

/// Points and irradiance across the light of a spot of 35° and 20°.
#[rustfmt::skip]
const SPOT: &[Reference] = &[
    ([1.278215, 1.130641, 2.591575], [0.0, 0.0, 0.0]),
    ([0.2594937, 1.536253, 2.037405], [1.775148, 1.183432, 0.591716]),
    ([-0.1703598, 1.698648, 1.951456], [1.171875, 0.78125, 0.390625]),
    ([2.349609, 1.803682, 1.677119], [0.0, 0.0, 0.0]),
    ([0.1535394, 1.217874, 1.126025], [0.6198348, 0.4132232, 0.2066116]),
    ([-0.4015371, 1.926537, 0.9311121], [0.48, 0.32, 0.16]),
    ([0.8786358, 0.9436769, 0.409739], [0.2263314, 0.1508876, 0.07544378]),
    ([1.637196, 1.984633, -0.03376752], [0.0, 0.0, 0.0]),
];

/// The same with a projected image.
#[rustfmt::skip]
const SPOT_TEXTURED: &[Reference] = &[
    ([1.278215, 1.130641, 2.591575], [0.0, 0.0, 0.0]),
    ([0.2594937, 1.536253, 2.037405], [2.041092, 0.7837267, 0.6066807]),
    ([-0.1703598, 1.698648, 1.951456], [1.246142, 0.7003804, 0.3620152]),
    ([2.349609, 1.803682, 1.677119], [0.0, 0.0, 0.0]),
    ([0.1535394, 1.217874, 1.126025], [0.3926443, 0.2923779, 0.276719]),
    ([-0.4015371, 1.926537, 0.9311121], [0.3073646, 0.2300148, 0.2010341]),
    ([0.8786358, 0.9436769, 0.409739], [0.09994816, 0.1597834, 0.07129168]),
    ([1.637196, 1.984633, -0.03376752], [0.0, 0.0, 0.0]),
];

fn close(a: [f32; 3], b: [f32; 3], tolerance: f32) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance * (1.0 + b.abs()))
}

#[test]
fn environment_agrees() {
    let turn = Mat4::from_axis_angle(Vec3::new(0.3, 1.0, 0.2).normalize(), 50f32.to_radians());
    let mirrored = turn * Mat4::from_scale(Vec3::new(-1.0, 1.0, 1.0));
    for (to_world, reference) in [(Mat4::IDENTITY, ENVMAP), (mirrored, ENVMAP_TURNED)] {
        let world = World::new(vec![], vec![envmap(small_image(), 1.5, to_world)]);
        for (w, expected) in reference {
            let mut sum = Spectrum::BLACK;
            world.lights.environment(Vec3::from(*w).normalize(), |_, l| sum += l);
            assert!(close(sum.to_rgb(), *expected, 5e-4), "{w:?}: {:?} for {expected:?}", sum.to_rgb());
        }
    }
}

/// `look_at(origin=[1,2,3], target=[-0.5,1.2,0.3], up=[0.1,1,0.2])`.
fn spot(texture: Option<TextureDescription>) -> EmitterModel {
    let (origin, target, up) = (Vec3::new(1.0, 2.0, 3.0), Vec3::new(-0.5, 1.2, 0.3), Vec3::new(0.1, 1.0, 0.2));
    let z = (target - origin).normalize();
    let x = up.cross(z).normalize();
    let to_world = Mat4::from_cols(x.extend(0.0), z.cross(x).extend(0.0), z.extend(0.0), origin.extend(1.0));
    EmitterModel::Spot {
        to_world: to_world.into(),
        intensity: [3.0, 2.0, 1.0],
        cutoff_angle_deg: 35.0,
        beam_width_deg: 20.0,
        texture,
    }
}

#[test]
fn spot_agrees() {
    let mut slide = Image { width: 4, height: 3, channels: 3, data: vec![] };
    for (y, x, c) in (0..3).flat_map(|y| (0..4).flat_map(move |x| (0..3).map(move |c| (y, x, c)))) {
        slide.data.push(((x * 5 + y * 2 + c * 3) % 7) as f32 / 4.0 + 0.1);
    }
    let bitmap = TextureDescription::Bitmap {
        image: ImageId(0),
        filter: BitmapFilter::Bilinear,
        wrap: BitmapWrap::Repeat,
        to_uv: Mat4::IDENTITY,
        place: Place::default(),
    };
    let images = [ImageDescription::Data(Arc::new(slide))];
    for (texture, reference) in [(None, SPOT), (Some(bitmap), SPOT_TEXTURED)] {
        let world = World::with_images(vec![], vec![(spot(texture), None)], &images);
        for (x, expected) in reference {
            let event = world.lights.sample_next_event(&world.geometry, Vec3::from(*x), 0.5, Vec2::splat(0.5));
            let got = event.map_or(Spectrum::BLACK, |e| e.radiance * (e.g / e.nu));
            assert!(close(got.to_rgb(), *expected, 1e-4), "{x:?}: {:?} for {expected:?}", got.to_rgb());
        }
    }
}

#[test]
fn point_and_directional_agree() {
    let at = |model: EmitterModel| {
        let world = World::new(vec![], vec![(model, None)]);
        world.lights.sample_next_event(&world.geometry, Vec3::new(0.1, 0.2, 0.3), 0.5, Vec2::splat(0.5)).expect("lit")
    };
    let intensity = [3.0, 2.0, 1.0];
    let point = at(EmitterModel::Point { position: Vec3::new(1.0, 2.0, 3.0), intensity });
    assert!((point.w - Vec3::new(0.2672612, 0.5345225, 0.8017837)).length() < 1e-6);
    assert!((point.distance - 3.3674917).abs() < 1e-6);
    assert!(close((point.radiance * point.g).to_rgb(), [0.2645503, 0.1763668, 0.08818342], 1e-6));
    let direction = Vec3::new(1.0, -2.0, 0.5);
    let sun = at(EmitterModel::Directional { direction, irradiance: intensity, angular_diameter_deg: 0.0 });
    assert!((sun.w - Vec3::new(-0.4364358, 0.8728716, -0.2182179)).length() < 1e-6);
    assert!(sun.distance.is_infinite() && sun.g == 1.0 && sun.delta);
    assert!(close(sun.radiance.to_rgb(), intensity, 0.0));
}
