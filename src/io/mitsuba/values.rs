//! Text → numbers, vectors, colours and transforms, as Mitsuba 3 writes them.
//!
//! Every function says in one phrase what it expected; the caller knows the property and its place.

use glam::{DMat4, DVec3, Vec3};

/// A list separated by commas and blanks.
pub fn list(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| c == ',' || c.is_ascii_whitespace()).filter(|t| !t.is_empty())
}

/// A finite number in double precision.
pub fn number(text: &str) -> Result<f64, String> {
    let value: f64 = text.trim().parse().map_err(|_| format!("`{}` is not a number", shown(text)))?;
    if !value.is_finite() || !(value as f32).is_finite() {
        return Err(format!("`{}` is not a finite number in single precision", shown(text)));
    }
    Ok(value)
}

/// A finite number in single precision.
pub fn float(text: &str) -> Result<f32, String> {
    number(text).map(|v| v as f32)
}

/// A whole number.
pub fn integer(text: &str) -> Result<i64, String> {
    text.trim().parse().map_err(|_| format!("`{}` is not a whole number", shown(text)))
}

/// `true` or `false`.
pub fn boolean(text: &str) -> Result<bool, String> {
    match text.trim() {
        t if t.eq_ignore_ascii_case("true") => Ok(true),
        t if t.eq_ignore_ascii_case("false") => Ok(false),
        _ => Err(format!("`{}` is neither true nor false", shown(text))),
    }
}

/// Exactly three numbers, or one for all three.
pub fn triple(text: &str) -> Result<DVec3, String> {
    let numbers = list(text).map(number).collect::<Result<Vec<f64>, _>>()?;
    match numbers[..] {
        [v] => Ok(DVec3::splat(v)),
        [x, y, z] => Ok(DVec3::new(x, y, z)),
        _ => Err(format!("`{}` has {} numbers, not 1 or 3", shown(text), numbers.len())),
    }
}

/// A colour in linear sRGB: one number, three numbers, or `#rrggbb` (sRGB code values, decoded).
pub fn rgb(text: &str) -> Result<[f32; 3], String> {
    if let Some(code) = text.trim().strip_prefix('#') {
        let value = u32::from_str_radix(code, 16).ok().filter(|_| code.len() == 6 && code.is_ascii());
        let value = value.ok_or_else(|| format!("`{}` is not a colour code #rrggbb", shown(text)))?;
        return Ok([value >> 16, value >> 8 & 255, value & 255].map(|v| decode_srgb(v as f32 / 255.0)));
    }
    triple(text).map(|v| v.as_vec3().to_array())
}

/// The transfer function of sRGB, code value → linear [IEC 61966-2-1].
fn decode_srgb(v: f32) -> f32 {
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// A row-major matrix of 16 numbers, or 9 for its linear part.
pub fn matrix(text: &str) -> Result<DMat4, String> {
    let n = list(text).map(number).collect::<Result<Vec<f64>, _>>()?;
    let rows: [f64; 16] = match n.len() {
        16 => std::array::from_fn(|i| n[i]),
        9 => std::array::from_fn(|i| match (i / 4, i % 4) {
            (3, 3) => 1.0,
            (3, _) | (_, 3) => 0.0,
            (row, column) => n[3 * row + column],
        }),
        other => return Err(format!("a matrix has 16 or 9 numbers, not {other}")),
    };
    Ok(DMat4::from_cols_array(&rows).transpose())
}

/// Mitsuba's camera frame: +z towards the target, +y up, +x to the left; `None` if undefined.
pub fn look_at(origin: DVec3, target: DVec3, up: Option<DVec3>) -> Option<DMat4> {
    let forward = (target - origin).try_normalize()?;
    let left = match up {
        Some(up) => up.try_normalize()?.cross(forward),
        None => any_orthogonal(forward),
    };
    if left.length() < 1e-6 {
        return None;
    }
    let left = left.normalize();
    let up = forward.cross(left);
    Some(DMat4::from_cols(left.extend(0.0), up.extend(0.0), forward.extend(0.0), origin.extend(1.0)))
}

fn any_orthogonal(v: DVec3) -> DVec3 {
    v.any_orthonormal_vector()
}

/// The last row of an affine map is 0 0 0 1.
pub fn is_affine(m: DMat4) -> bool {
    m.row(3).abs_diff_eq(glam::DVec4::W, 1e-9)
}

/// To single precision.
pub fn point(v: DVec3) -> Vec3 {
    v.as_vec3()
}

/// A text short and safe enough for a message.
pub fn shown(text: &str) -> String {
    const LONGEST: usize = 200;
    let text = text.trim();
    let mut out = String::new();
    for c in text.chars().take(LONGEST) {
        if c.is_control() { out.extend(c.escape_default()) } else { out.push(c) }
    }
    if text.chars().nth(LONGEST).is_some() {
        out.push('…');
    }
    out
}
