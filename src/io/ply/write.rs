//! PLY out: triangles with the radiance of their corners.
//!
//! Binary, little endian. Each vertex has x y z, the properties red green blue that programs show (sRGB,
//! 8 bits, under an exposure), and its linear radiance as radiance_r, radiance_g, radiance_b.

use crate::io::fault::{Fault, io_fault};
use crate::io::png::quantize;
use glam::Vec3;
use std::io::Write;

/// Writes triangles over `positions`, each with linear sRGB `radiance`, shown at `exposure` stops.
pub fn write(
    mut out: impl Write,
    positions: &[Vec3],
    radiance: &[[f32; 3]],
    triangles: &[[u32; 3]],
    exposure: f32,
) -> Result<(), Fault> {
    let mut body = Vec::with_capacity(positions.len() * 27 + triangles.len() * 13 + 400);
    let header = format!(
        "ply\nformat binary_little_endian 1.0\ncomment nephroid\nelement vertex {}\n\
         property float x\nproperty float y\nproperty float z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\n\
         property float radiance_r\nproperty float radiance_g\nproperty float radiance_b\n\
         element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        positions.len(),
        triangles.len()
    );
    body.extend_from_slice(header.as_bytes());
    let factor = exposure.exp2();
    for (p, l) in positions.iter().zip(radiance) {
        p.to_array().iter().for_each(|v| body.extend_from_slice(&v.to_le_bytes()));
        body.extend(l.map(|v| quantize(v * factor, 255.0) as u8));
        l.iter().for_each(|v| body.extend_from_slice(&v.to_le_bytes()));
    }
    for t in triangles {
        body.push(3);
        t.iter().for_each(|v| body.extend_from_slice(&v.to_le_bytes()));
    }
    out.write_all(&body).map_err(io_fault)
}
