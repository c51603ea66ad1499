//! The objects of the scenes, in metres, z up: what is turned on a lathe, cut, or bent.

use crate::curve::{arc, chain, line, offset, reversed, spline};
use crate::mesh::{Mesh, Run};
use glam::{DVec2, DVec3, dvec2, dvec3};

/// Segments around the axis of turned objects; normals are interpolated.
const AROUND: u32 = 128;

/// Outside of the cup up to the middle of its lip.
pub fn cup_outside() -> Mesh {
    let foot = line((0.0, 0.003), (0.022, 0.003), 1);
    let ring = spline(&[(0.022, 0.003), (0.0225, 0.0008), (0.0245, 0.0), (0.0265, 0.001), (0.0270, 0.004)], 3);
    let wall =
        spline(&[(0.0270, 0.004), (0.0335, 0.0085), (0.0412, 0.021), (0.0455, 0.038), (0.0475, 0.056), (0.0482, 0.0655)], 5);
    let lip = arc((0.0466, 0.0655), 0.0016, 0.0, 90.0, 5);
    Mesh::revolve(&[foot, ring, chain(&[wall, lip])], AROUND)
}

/// Inside of the cup. The part above the coffee is almost a cylinder: the mirror of the nephroid.
pub fn cup_inside() -> Mesh {
    let lip = arc((0.0466, 0.0655), 0.0016, 90.0, 180.0, 5);
    let wall = spline(&[(0.0450, 0.0655), (0.0447, 0.052), (0.0441, 0.036), (0.0400, 0.0195), (0.028, 0.0085)], 6);
    let floor = spline(&[(0.028, 0.0085), (0.014, 0.0062), (0.0, 0.006)], 2);
    Mesh::revolve(&[chain(&[lip, wall, floor])], 2 * AROUND)
}

/// An ear-shaped handle towards +x.
pub fn cup_handle() -> Mesh {
    let outline = [
        (0.0462, 0.0545),
        (0.0560, 0.0580),
        (0.0680, 0.0545),
        (0.0730, 0.0440),
        (0.0680, 0.0320),
        (0.0560, 0.0225),
        (0.0420, 0.0190),
    ];
    let path: Vec<DVec3> = spline(&outline, 6).iter().map(|p| dvec3(p.x, 0.0, p.y)).collect();
    Mesh::tube(&path, DVec3::Y, |t| dvec2(0.0024, 0.0042) * (1.0 + 0.5 * (2.0 * t - 1.0).powi(4)), 20)
}

/// Saucer without its ring; the cup stands in its well at height 0.0045.
pub fn saucer() -> Mesh {
    let below = spline(&[(0.0, 0.0), (0.030, 0.0), (0.046, 0.0025), (0.064, 0.0085), (0.0790, 0.0135)], 4);
    let above = [(0.0765, 0.0155), (0.062, 0.0103), (0.045, 0.0058), (0.0330, 0.0048), (0.0300, 0.0045), (0.0, 0.0045)];
    Mesh::revolve(&[below, spline(&above, 4)], AROUND)
}

/// The gilded edge of the saucer.
pub fn saucer_ring() -> Mesh {
    Mesh::revolve(&[spline(&[(0.0790, 0.0135), (0.0802, 0.0148), (0.0792, 0.0160), (0.0765, 0.0155)], 5)], AROUND)
}

/// Normal of a facet: `azimuth` and `slope` (0 = facing up, 180 = facing down) in degrees.
fn facet(azimuth: f64, slope: f64) -> DVec3 {
    let (sin_a, cos_a) = azimuth.to_radians().sin_cos();
    let (sin_s, cos_s) = slope.to_radians().sin_cos();
    dvec3(sin_s * cos_a, sin_s * sin_a, cos_s)
}

/// A round brilliant of girdle radius 1: 57 facets and a girdle of 16, with the proportions of a
/// good diamond (crown 34.5°, pavilion 40.75°, table 53 %).
pub fn brilliant() -> Mesh {
    const GIRDLE: f64 = 0.02;
    const TABLE: f64 = 0.53;
    let height = GIRDLE + (1.0 - TABLE) * 34.5_f64.to_radians().tan();
    let half_step = 11.25_f64.to_radians().cos();
    let mut planes = vec![(DVec3::Z, height)];
    let mut through = |azimuth: f64, slope: f64, radius: f64, z: f64| {
        let n = facet(azimuth, slope);
        planes.push((n, slope.to_radians().sin() * radius + slope.to_radians().cos() * z));
    };
    for k in 0..8 {
        let azimuth = 45.0 * f64::from(k);
        through(azimuth, 34.5, 1.0, GIRDLE);
        through(azimuth + 22.5, 21.5, TABLE * 22.5_f64.to_radians().cos(), height);
        through(azimuth, 180.0 - 40.75, 1.0, -GIRDLE);
        for side in [-11.25, 11.25] {
            through(azimuth + side, 41.0, half_step, GIRDLE);
            through(azimuth + side, 180.0 - 42.3, half_step, -GIRDLE);
            through(azimuth + side, 90.0, half_step, 0.0);
        }
    }
    Mesh::convex(&planes, 2.0)
}

/// An emerald (step) cut, 2 × 1.4.
pub fn emerald() -> Mesh {
    // (slope, inset of the step's lower edge, its height)
    const STEPS: [(f64, f64, f64); 7] = [
        (90.0, 0.0, 0.0),
        (48.0, 0.0, 0.03),
        (38.0, 0.1, 0.126),
        (28.0, 0.2, 0.21),
        (180.0 - 56.0, 0.0, -0.03),
        (180.0 - 48.0, 0.14, -0.23),
        (180.0 - 41.0, 0.32, -0.43),
    ];
    let mut planes = vec![(DVec3::Z, 0.275), (-DVec3::Z, 0.66)];
    for k in 0..8 {
        let distance = [1.0, 1.02, 0.7, 1.02][k % 4];
        for (slope, inset, z) in STEPS {
            let slope_rad = slope.to_radians();
            let plane = slope_rad.sin() * (distance - inset) + slope_rad.cos() * z;
            planes.push((facet(45.0 * k as f64, slope), plane));
        }
    }
    Mesh::convex(&planes, 2.0)
}

/// A rock crystal, 1 from its axis to each of six sides: each end a pyramid of six faces, the axis 38.2° from them as in quartz.
pub fn quartz() -> Mesh {
    const END: f64 = 2.9;
    const SLOPE: f64 = 90.0 - 38.2;
    let to_end = END * SLOPE.to_radians().cos();
    let planes: Vec<_> = (0..6)
        .flat_map(|k| {
            let azimuth = 60.0 * f64::from(k);
            [(facet(azimuth, 90.0), 1.0), (facet(azimuth, SLOPE), to_end), (facet(azimuth, 180.0 - SLOPE), to_end)]
        })
        .collect();
    Mesh::convex(&planes, END)
}

/// A sheet of paper: a floor that bends up into a wall; x across, the wall at +y.
pub fn backdrop() -> Mesh {
    let profile =
        chain(&[line((-6.0, 0.0), (5.0, 0.0), 11), arc((5.0, 4.0), 4.0, -90.0, 0.0, 24), line((9.0, 4.0), (9.0, 7.0), 2)]);
    let last = profile.len() - 1;
    Mesh::surface(1, last as u32, |u, v| {
        let i = (v * last as f64).round() as usize;
        let tangent = (profile[(i + 1).min(last)] - profile[i.saturating_sub(1)]).normalize();
        (dvec3(13.0 * u - 6.5, profile[i].x, profile[i].y), dvec3(0.0, -tangent.y, tangent.x))
    })
}

/// A vessel with liquid, as three boundaries that meet in one circle and share its vertices.
struct Vessel {
    /// Glass against air: outside, rim, and inside above the liquid.
    glass: Vec<Run>,
    /// Glass against liquid, its normal towards the liquid.
    contact: Vec<Run>,
    /// Liquid against air, with a meniscus, its normal up.
    surface: Vec<Run>,
}

/// Splits a vessel's inner wall (travelled from the rim down to the axis) at `level`.
fn fill(mut outside: Vec<Run>, inside: &Run, level: f64) -> Vessel {
    let at = inside.iter().position(|p| p.y <= level).unwrap_or(0);
    let edge = inside[at];
    outside.push(inside[..=at].to_vec());
    let meniscus = [(edge.x, edge.y), (edge.x - 0.0007, edge.y - 0.0011), (edge.x - 0.0025, edge.y - 0.0018)];
    let rest = [(edge.x - 0.006, edge.y - 0.0020), (edge.x * 0.4, edge.y - 0.0020), (0.0, edge.y - 0.0020)];
    Vessel { glass: outside, contact: vec![inside[at..].to_vec()], surface: vec![spline(&[meniscus, rest].concat(), 4)] }
}

fn wine_vessel() -> Vessel {
    let foot = chain(&[line((0.0, 0.0), (0.0335, 0.0), 2), arc((0.0335, 0.0009), 0.0009, -90.0, 70.0, 5)]);
    let wall = spline(
        &[
            (0.0335, 0.0018),
            (0.0220, 0.0042),
            (0.0085, 0.0085),
            (0.0045, 0.0180),
            (0.0038, 0.0450),
            (0.0040, 0.0780),
            (0.0080, 0.0900),
            (0.0230, 0.1000),
            (0.0365, 0.1180),
            (0.0415, 0.1420),
            (0.0398, 0.1680),
            (0.0345, 0.2000),
        ],
        6,
    );
    let bowl: Run = wall.iter().copied().filter(|p| p.y >= 0.0905).collect();
    let rim = arc((0.0339, 0.2), 0.0006, 0.0, 180.0, 6);
    let mut inside = reversed(&offset(&bowl, -0.0012));
    inside.retain(|p| p.x > 0.013);
    let bottom = inside.last().map_or(DVec2::ZERO, |p| *p);
    let bowl_floor = spline(&[(bottom.x, bottom.y), (0.007, bottom.y - 0.0026), (0.0, bottom.y - 0.0034)], 4);
    let inside = chain(&[arc((0.0339, 0.2), 0.0006, 180.0, 180.0, 1), inside, bowl_floor]);
    fill(vec![foot, wall, rim], &inside, 0.1400)
}

fn water_vessel() -> Vessel {
    let foot = chain(&[line((0.0, 0.0), (0.028, 0.0), 2), arc((0.028, 0.003), 0.003, -90.0, 0.0, 5)]);
    let wall = chain(&[foot, line((0.031, 0.003), (0.0360, 0.0930), 10)]);
    let rim = arc((0.0350, 0.0930), 0.0010, 0.0, 180.0, 8);
    let down = line((0.0340, 0.0930), (0.0296, 0.0150), 12);
    let floor = spline(&[(0.0296, 0.0150), (0.0278, 0.0112), (0.0240, 0.0098), (0.0, 0.0090)], 4);
    fill(vec![wall, rim], &chain(&[down, floor]), 0.0660)
}

/// Wine glass against air.
pub fn wine_glass() -> Mesh {
    Mesh::revolve(&wine_vessel().glass, AROUND)
}

/// Wine glass against wine.
pub fn wine_contact() -> Mesh {
    Mesh::revolve(&wine_vessel().contact, AROUND)
}

/// Wine against air.
pub fn wine_surface() -> Mesh {
    Mesh::revolve(&wine_vessel().surface, AROUND)
}

/// Tumbler against air.
pub fn tumbler() -> Mesh {
    Mesh::revolve(&water_vessel().glass, AROUND)
}

/// Tumbler against water.
pub fn water_contact() -> Mesh {
    Mesh::revolve(&water_vessel().contact, AROUND)
}

/// Water against air.
pub fn water_surface() -> Mesh {
    Mesh::revolve(&water_vessel().surface, AROUND)
}

/// A panelled door leaf, hinged at the z axis and closed along +x: 0.9 × 0.04 × 2.04.
pub fn door_leaf() -> Mesh {
    let board =
        |x: [f64; 2], z: [f64; 2], half: f64| Mesh::bevelled_box(dvec3(x[0], -half, z[0]), dvec3(x[1], half, z[1]), 0.006);
    let stiles = board([0.0, 0.12], [0.01, 2.04], 0.02).join(board([0.78, 0.90], [0.01, 2.04], 0.02));
    let rails = [[0.01, 0.24], [0.86, 1.02], [1.90, 2.04]];
    let frame = rails.into_iter().fold(stiles, |mesh, z| mesh.join(board([0.115, 0.785], z, 0.0199)));
    [[0.235, 0.865], [1.015, 1.905]].into_iter().fold(frame, |mesh, z| {
        let raised = board([0.17, 0.73], [z[0] + 0.055, z[1] - 0.055], 0.015);
        mesh.join(board([0.115, 0.785], z, 0.008)).join(raised)
    })
}

/// The casing around a door opening of 0.9 × 2.05 in the plane y = 0, on the side of −y.
pub fn door_frame() -> Mesh {
    let piece =
        |low: [f64; 2], high: [f64; 2]| Mesh::bevelled_box(dvec3(low[0], -0.025, low[1]), dvec3(high[0], 0.005, high[1]), 0.008);
    piece([-0.10, 0.0], [-0.002, 2.15]).join(piece([0.905, 0.0], [1.0, 2.15])).join(piece([-0.004, 2.05], [0.907, 2.15]))
}

/// A door knob along the z axis.
pub fn door_knob() -> Mesh {
    let profile = [
        (0.024, 0.0),
        (0.023, 0.005),
        (0.011, 0.009),
        (0.009, 0.024),
        (0.017, 0.033),
        (0.0265, 0.045),
        (0.021, 0.059),
        (0.0, 0.064),
    ];
    Mesh::revolve(&[spline(&profile, 5)], 64)
}

/// A slender vase, 0.3 high.
pub fn vase() -> Mesh {
    let outside = spline(
        &[
            (0.0, 0.0),
            (0.045, 0.0),
            (0.055, 0.010),
            (0.085, 0.080),
            (0.078, 0.150),
            (0.040, 0.215),
            (0.026, 0.255),
            (0.036, 0.296),
            (0.040, 0.300),
        ],
        6,
    );
    let inside = spline(&[(0.040, 0.300), (0.0345, 0.297), (0.023, 0.255), (0.030, 0.220), (0.0, 0.180)], 4);
    Mesh::revolve(&[chain(&[outside, inside])], 96)
}

/// A biconvex lens of diameter 80 mm about the z axis; radius of curvature 110 mm, so f = 0.1 m.
pub fn lens() -> Mesh {
    const APERTURE: f64 = 0.040;
    const CURVATURE: f64 = 0.110;
    const EDGE: f64 = 0.0015;
    let sag = CURVATURE - (CURVATURE * CURVATURE - APERTURE * APERTURE).sqrt();
    let half_angle = (APERTURE / CURVATURE).asin().to_degrees();
    let centre = CURVATURE - sag - EDGE;
    let back = arc((0.0, centre), CURVATURE, -90.0, -90.0 + half_angle, 24);
    let front = arc((0.0, -centre), CURVATURE, 90.0 - half_angle, 90.0, 24);
    Mesh::revolve(&[back, line((APERTURE, -EDGE), (APERTURE, EDGE), 1), front], AROUND)
}

/// The lens's mount: a rounded ring.
pub fn lens_rim() -> Mesh {
    let section = [
        (0.0398, -0.003),
        (0.0400, -0.0045),
        (0.0420, -0.0052),
        (0.0440, -0.0035),
        (0.0446, 0.0),
        (0.0440, 0.0035),
        (0.0420, 0.0052),
        (0.0400, 0.0045),
        (0.0398, 0.003),
        (0.0398, -0.003),
    ];
    Mesh::revolve(&[spline(&section, 3)], AROUND)
}

/// A turned handle along the z axis, its ferrule at 0.
pub fn lens_handle() -> Mesh {
    let profile = [
        (0.0042, 0.0),
        (0.0045, 0.010),
        (0.0070, 0.014),
        (0.0072, 0.018),
        (0.0052, 0.023),
        (0.0075, 0.045),
        (0.0092, 0.075),
        (0.0080, 0.100),
        (0.0060, 0.108),
        (0.0, 0.111),
    ];
    Mesh::revolve(&[spline(&profile, 6)], 48)
}

/// One leaf of an agave: rises along +x and bends over, hollow along its middle.
pub fn agave_leaf() -> Mesh {
    let point = |u: f64, v: f64| {
        let across = 2.0 * u - 1.0;
        let width = 0.052 * (0.55 + 2.4 * v).min(1.45) * (1.0 - v).powf(0.72) + 0.0006;
        let lean = 0.35 + 1.1 * v;
        let spine = dvec3(0.42 * (v - 0.12 * v * v) * (0.55 + 0.3 * v), 0.0, 0.42 * v * (1.05 - 0.52 * v));
        let hollow = 0.45 * width * across * across * (1.0 - 0.6 * v);
        spine + dvec3(-lean.sin() * 0.0 - 0.7 * hollow, across * width, 0.7 * hollow)
    };
    Mesh::surface(8, 28, |u, v| {
        const STEP: f64 = 1e-4;
        let du = point((u + STEP).min(1.0), v) - point((u - STEP).max(0.0), v);
        let dv = point(u, (v + STEP).min(1.0)) - point(u, (v - STEP).max(0.0));
        (point(u, v), du.cross(dv).normalize())
    })
}

/// A terracotta pot, 0.24 high, filled with earth up to 0.21 by another shape.
pub fn pot() -> Mesh {
    let body = line((0.105, 0.0), (0.143, 0.178), 6);
    let band = chain(&[
        arc((0.152, 0.184), 0.006, -90.0, 0.0, 3),
        line((0.158, 0.184), (0.162, 0.230), 2),
        arc((0.156, 0.230), 0.006, 0.0, 90.0, 4),
    ]);
    let inside = line((0.150, 0.236), (0.128, 0.100), 3);
    Mesh::revolve(
        &[
            line((0.0, 0.0), (0.105, 0.0), 1),
            body,
            line((0.143, 0.178), (0.152, 0.178), 1),
            band,
            line((0.156, 0.236), (0.150, 0.236), 1),
            inside,
        ],
        96,
    )
}

/// A chess pawn, 1.0 high: flat, concave, convex and sharp parts in one closed body.
pub fn figure() -> Mesh {
    let base = spline(&[(0.33, 0.0), (0.345, 0.03), (0.335, 0.075), (0.29, 0.11), (0.275, 0.145)], 4);
    let stem = spline(&[(0.275, 0.145), (0.19, 0.20), (0.125, 0.34), (0.105, 0.50), (0.125, 0.575)], 5);
    let collar = spline(&[(0.125, 0.575), (0.205, 0.595), (0.215, 0.615), (0.195, 0.635), (0.115, 0.645)], 4);
    let head = arc((0.0, 0.80), 0.195, -53.0, 90.0, 24);
    let neck = line((0.115, 0.645), (head[0].x, head[0].y), 1);
    Mesh::revolve(&[line((0.0, 0.0), (0.33, 0.0), 1), base, stem, collar, neck, head], 72)
}

/// An open shade over the figure's place, a sheet without thickness, with uv around and up.
pub fn shade() -> Mesh {
    Mesh::surface(72, 8, |u, v| {
        let (sin, cos) = (std::f64::consts::TAU * u).sin_cos();
        let radius = 0.36 - 0.16 * v;
        (dvec3(radius * cos, radius * sin, 0.9 * v), dvec3(0.9 * cos, 0.9 * sin, 0.16).normalize())
    })
}
