//! Transforms that keep angles: orthonormal axes and one scale, for what has directions but no shape.

use crate::describe::{Placed, Problems};
use glam::{DMat3, Mat3, Mat4};

/// Axes (columns, orthonormal, of either handedness) and scale of `to_world`; everything that is
/// singular or bends right angles is an error that names `what`.
pub(super) fn axes(to_world: &Placed<Mat4>, what: &str, problems: &mut Problems) -> Option<(Mat3, f64)> {
    let linear = DMat3::from_mat4(to_world.value.as_dmat4());
    let scale = linear.determinant().abs().cbrt();
    if !to_world.value.is_finite() || scale == 0.0 {
        problems.error(to_world.place, format!("the {what}'s transform is not invertible"));
        return None;
    }
    let m = linear * (1.0 / scale);
    if (m.transpose() * m - DMat3::IDENTITY).to_cols_array().iter().any(|e| e.abs() > 1e-3) {
        problems
            .error(to_world.place, format!("the {what}'s transform scales its axes differently or shears them"))
            .hint("rotations, reflections, translations and uniform scales keep angles");
        return None;
    }
    // Gram–Schmidt from z, the viewing direction, so that rounding in the file does not matter.
    let z = m.z_axis.normalize();
    let y = (m.y_axis - z * z.dot(m.y_axis)).normalize();
    let x = (m.x_axis - z * z.dot(m.x_axis) - y * y.dot(m.x_axis)).normalize();
    Some((DMat3::from_cols(x, y, z).as_mat3(), scale))
}
