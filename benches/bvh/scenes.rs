//! Meshes made in code: 36, about 40 thousand, 70 thousand and a million triangles, each closed in a
//! room, with a square light under the ceiling and a camera.

use glam::{Mat3, Vec3};
use std::f32::consts::{PI, TAU};

/// A mesh, where its light is and where it is seen from.
#[derive(Default)]
pub struct Room {
    pub name: &'static str,
    pub positions: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
    /// Middle and half size of the light.
    pub light: (Vec3, f32),
    /// Camera, and the point it looks at.
    pub eye: (Vec3, Vec3),
}

impl Room {
    /// A grid of quadrilaterals `at(u, v)` for u, v in [0, 1].
    fn grid(&mut self, n: u32, m: u32, at: impl Fn(f32, f32) -> Vec3) {
        let base = self.positions.len() as u32;
        for i in 0..=n {
            self.positions.extend((0..=m).map(|k| at(i as f32 / n as f32, k as f32 / m as f32)));
        }
        for (i, k) in (0..n).flat_map(|i| (0..m).map(move |k| (i, k))) {
            let a = base + i * (m + 1) + k;
            let b = a + m + 1;
            self.triangles.extend([[a, b, b + 1], [a, b + 1, a + 1]]);
        }
    }

    fn sphere(&mut self, center: Vec3, n: u32, radius: impl Fn(Vec3) -> f32) {
        self.grid(n, n, |u, v| {
            let (theta, phi) = (u * PI, v * TAU);
            let d = Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            center + d * radius(d)
        });
    }

    fn walls(&mut self, half: Vec3) {
        self.block(Vec3::ZERO, Mat3::from_diagonal(half));
    }

    /// The cube [-1, 1]³ under an affine map.
    fn block(&mut self, center: Vec3, shape: Mat3) {
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                let mut turn = [Vec3::ZERO; 3];
                (0..3).for_each(|k| turn[k][(axis + k) % 3] = 1.0);
                let m = Mat3::from_cols(turn[1], turn[2], turn[0]);
                self.grid(1, 1, |u, v| center + shape * (m * Vec3::new(2.0 * u - 1.0, 2.0 * v - 1.0, side)));
            }
        }
    }
}

/// Two blocks in a box.
pub fn tiny() -> Room {
    let mut room = Room { name: "tiny", light: (Vec3::Y * 0.98, 0.25), ..Room::default() };
    room.eye = (Vec3::new(0.0, 0.0, -0.98), Vec3::new(0.0, -0.2, 1.0));
    room.walls(Vec3::ONE);
    let turned = |angle: f32, half: Vec3| Mat3::from_rotation_y(angle) * Mat3::from_diagonal(half);
    room.block(Vec3::new(-0.35, -0.4, 0.3), turned(0.3, Vec3::new(0.3, 0.6, 0.3)));
    room.block(Vec3::new(0.4, -0.7, -0.2), turned(-0.3, Vec3::splat(0.3)));
    room
}

/// Two spheres in a box.
pub fn cornell() -> Room {
    let mut room = Room { name: "cornell", light: (Vec3::Y * 0.98, 0.25), ..Room::default() };
    room.eye = (Vec3::new(0.0, 0.0, -0.98), Vec3::new(0.0, -0.2, 1.0));
    room.walls(Vec3::ONE);
    room.sphere(Vec3::new(-0.4, -0.6, 0.3), 101, |_| 0.4);
    room.sphere(Vec3::new(0.45, -0.65, -0.2), 101, |_| 0.35);
    room
}

/// A torus knot in a box.
pub fn knot() -> Room {
    let mut room = Room { name: "knot", light: (Vec3::Y * 1.9, 0.5), ..Room::default() };
    room.eye = (Vec3::new(0.5, 0.6, -1.9), Vec3::ZERO);
    room.walls(Vec3::splat(2.0));
    let curve = |t: f32| {
        let r = 0.9 + 0.35 * (3.0 * t).cos();
        Vec3::new(r * (2.0 * t).cos(), 0.45 * (3.0 * t).sin(), r * (2.0 * t).sin())
    };
    room.grid(600, 57, |u, v| {
        let t = u * TAU;
        let along = (curve(t + 1e-3) - curve(t - 1e-3)).normalize();
        let side = along.cross(Vec3::Y).normalize();
        let (sin, cos) = (v * TAU).sin_cos();
        curve(t) + (side * cos + side.cross(along) * sin) * 0.13
    });
    room
}

/// A hall with displaced spheres on rows of plinths.
pub fn hall() -> Room {
    let mut room = Room { name: "hall", light: (Vec3::Y * 5.8, 2.0), ..Room::default() };
    let half = Vec3::new(8.0, 6.0, 12.0);
    room.eye = (Vec3::new(-6.5, 1.5, -11.0), Vec3::new(0.0, -3.0, 2.0));
    room.walls(half);
    for i in 0..28u32 {
        let place = Vec3::new((i % 4) as f32 * 4.0 - 6.0, -3.5 + 0.4 * (i % 3) as f32, (i / 4) as f32 * 3.3 - 10.0);
        let f = 5.0 + (i % 7) as f32;
        room.sphere(place, 134, |d| {
            1.1 + 0.12 * (f * d.x).sin() * (f * d.y + 1.0).sin() + 0.05 * (4.0 * f * d.z).sin() * (3.0 * f * d.x).cos()
        });
        let m = Vec3::new(0.6, 1.0, 0.6);
        room.grid(8, 32, |u, v| {
            let (sin, cos) = (v * TAU).sin_cos();
            Vec3::new(place.x, -6.0 + 1.5 * u, place.z) + m * Vec3::new(cos, 0.0, sin)
        });
    }
    room
}
