//! Spectra → linear sRGB: `c = M · ∫ s(λ) [D65(λ)] x̄ȳz̄(λ) dλ / ∫ ȳ(λ) dλ`, λ from 360 to 830 nm.
//!
//! The same rule as Mitsuba 3's RGB mode: a list `λ:value` is linear between its points and zero
//! outside; reflectances, indices and the like are seen under D65, emission is not; negative lanes
//! become 0, and those of a list within [0, 1] at most 1. The integral is exact, where Mitsuba sums
//! at 1000 wavelengths: bands of a few nanometres differ by up to a per cent or two. Curves: CIE 1931
//! 2° observer and CIE D65 at 5 nm, linear in between [CIE 018].

use super::names;
use super::text;
use super::values;
use std::path::Path;
use std::sync::LazyLock;

/// Divisor of the tabulated D65 (100 at 560 nm), as Mitsuba 3 chose it.
const D65_SCALE: f64 = 98.997_417_518_762_55;
const FIRST: f64 = 360.0;
const STEP: f64 = 5.0;
/// XYZ → linear sRGB, D65 white [ITU-R BT.709].
const TO_RGB: [[f64; 3]; 3] =
    [[3.240_479, -1.537_150, -0.498_535], [-0.969_256, 1.875_991, 0.041_556], [0.055_648, -0.204_043, 1.057_311]];

/// Rows x̄, ȳ, z̄, D65 at 360, 365, … 830 nm.
static CURVES: LazyLock<Vec<[f64; 4]>> = LazyLock::new(|| {
    let rows = include_str!("data/cie1931_d65_5nm.csv").lines().skip(1);
    rows.map(|row| {
        let mut columns = row.split(',').skip(1).map(|c| c.parse().unwrap_or(0.0));
        std::array::from_fn(|_| columns.next().unwrap_or(0.0))
    })
    .collect()
});

/// `c` for a reflectance, `c · rgb(1, 1, 1)` of equal energy for emission, or a list `λ:value`.
pub fn parse(text: &str, emissive: bool) -> Result<[f32; 3], String> {
    if !text.contains(':') {
        let mut tokens = values::list(text);
        let (Some(token), None) = (tokens.next(), tokens.next()) else {
            return Err(format!("`{}` is neither one number nor a list wavelength:value, …", values::shown(text)));
        };
        let value = values::number(token)?;
        let rgb = if emissive { to_rgb([value; 3]) } else { [value; 3] };
        return Ok(rgb.map(|v| v as f32));
    }
    let mut points = Vec::new();
    for token in values::list(&join_colons(text)) {
        let (wavelength, value) =
            token.split_once(':').ok_or_else(|| format!("`{}` is not wavelength:value", values::shown(token)))?;
        points.push((values::number(wavelength)?, values::number(value)?));
    }
    from_points(&points, emissive)
}

/// Removes the blanks around colons.
fn join_colons(text: &str) -> String {
    text.split(':').map(str::trim).collect::<Vec<_>>().join(":")
}

/// A text file with `wavelength value` on each line; `#` starts a comment.
pub fn read_file(path: &Path, emissive: bool) -> Result<[f32; 3], String> {
    let content = text::read(path)?;
    let mut points = Vec::new();
    for (number, line) in content.lines().enumerate() {
        let line = line.split('#').next().unwrap_or("").trim();
        if line.is_empty() {
            continue;
        }
        let pair = values::list(line).map(values::number).collect::<Result<Vec<f64>, _>>();
        match pair.as_deref() {
            Ok([wavelength, value]) => points.push((*wavelength, *value)),
            _ => return Err(format!("line {} of `{}` is not `wavelength value`", number + 1, path.display())),
        }
    }
    from_points(&points, emissive)
}

fn from_points(points: &[(f64, f64)], emissive: bool) -> Result<[f32; 3], String> {
    if points.len() < 2 {
        return Err("a list of wavelengths needs at least two".into());
    }
    if let Some(pair) = points.windows(2).find(|pair| pair[1].0 <= pair[0].0) {
        return Err(format!("wavelengths must increase, but {} follows {}", pair[1].0, pair[0].0));
    }
    if let Some(point) = points.iter().find(|p| p.1 < 0.0) {
        return Err(format!("the value {} at {} nm is negative", point.1, point.0));
    }
    // A list within [0, 1] may be a reflectance: a saturated colour must not leave the range.
    let most = if !emissive && points.iter().all(|p| p.1 <= 1.0) { 1.0 } else { f64::INFINITY };
    Ok(integrate(points, emissive).map(|v| v.clamp(0.0, most) as f32))
}

/// Exact integral of the product of the piecewise linear factors: Simpson's rule on each piece.
fn integrate(points: &[(f64, f64)], emissive: bool) -> [f64; 3] {
    let curves = &*CURVES;
    let last = FIRST + STEP * (curves.len() - 1) as f64;
    let mut knots: Vec<f64> = (0..curves.len()).map(|i| FIRST + STEP * i as f64).chain(points.iter().map(|p| p.0)).collect();
    let (low, high) = (points[0].0.max(FIRST), points[points.len() - 1].0.min(last));
    knots.retain(|k| (low..=high).contains(k));
    knots.sort_by(f64::total_cmp);
    knots.dedup();
    let mut xyz = [0.0; 3];
    for pair in knots.windows(2) {
        let width = pair[1] - pair[0];
        for (at, weight) in [(pair[0], 1.0), ((pair[0] + pair[1]) / 2.0, 4.0), (pair[1], 1.0)] {
            let [x, y, z, d65] = curve_at(curves, at);
            let light = if emissive { 1.0 } else { d65 / D65_SCALE };
            let value = value_at(points, at) * light * weight * width / 6.0;
            xyz = [xyz[0] + value * x, xyz[1] + value * y, xyz[2] + value * z];
        }
    }
    let whole: f64 = curves.windows(2).map(|pair| (pair[0][1] + pair[1][1]) * STEP / 2.0).sum();
    to_rgb(xyz.map(|v| v / whole))
}

fn curve_at(curves: &[[f64; 4]], wavelength: f64) -> [f64; 4] {
    let at = ((wavelength - FIRST) / STEP).clamp(0.0, (curves.len() - 1) as f64);
    let i = (at as usize).min(curves.len() - 2);
    std::array::from_fn(|k| curves[i][k] + (curves[i + 1][k] - curves[i][k]) * (at - i as f64))
}

fn value_at(points: &[(f64, f64)], wavelength: f64) -> f64 {
    let i = points.partition_point(|p| p.0 <= wavelength).clamp(1, points.len() - 1);
    let ((a, va), (b, vb)) = (points[i - 1], points[i]);
    va + (vb - va) * ((wavelength - a) / (b - a))
}

fn to_rgb(xyz: [f64; 3]) -> [f64; 3] {
    TO_RGB.map(|row| row[0] * xyz[0] + row[1] * xyz[1] + row[2] * xyz[2])
}

/// Index of refraction of a named dielectric.
pub fn dielectric(name: &str) -> Result<f32, String> {
    let rows = include_str!("data/dielectrics.csv").lines().skip(1).filter_map(|row| row.split_once(','));
    let wanted = name.trim().to_ascii_lowercase();
    if let Some((_, value)) = rows.clone().find(|(n, _)| *n == wanted) {
        return values::float(value);
    }
    Err(format!("`{}` is neither a number nor a material; {}", values::shown(name), names::hint(name, rows.map(|(n, _)| n))))
}

/// Complex index of refraction `(eta, k)` of a named conductor in linear sRGB.
pub fn conductor(name: &str) -> Result<([f32; 3], [f32; 3]), String> {
    let rows = include_str!("data/conductors.csv").lines().skip(1).filter_map(|row| row.split_once(','));
    if let Some((_, numbers)) = rows.clone().find(|(n, _)| *n == name.trim()) {
        let n: Vec<f32> = numbers.split(',').filter_map(|v| v.trim().parse().ok()).collect();
        if let [a, b, c, d, e, f] = n[..] {
            return Ok(([a, b, c], [d, e, f]));
        }
    }
    let known = rows.map(|(n, _)| n).chain(["none"]);
    Err(format!("unknown conductor `{}`; {}", values::shown(name), names::hint(name, known)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: [f32; 3], b: [f32; 3], tolerance: f32) {
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() <= tolerance * b.abs(), "{a} against {b}");
        }
    }

    #[test]
    fn wavelength_lists_give_the_colours_of_mitsuba() {
        close(parse("400:0, 500:8, 600:15.6, 700:18.4", true).unwrap(), [20.7108, 10.8546, 2.77115], 1e-3);
        close(parse("400:0.78, 500:0.78, 600:0.78, 700:0.78", false).unwrap(), [0.776367, 0.77981, 0.776029], 1e-3);
        close(parse("300:1 , 900 : 1", false).unwrap(), [0.998985, 0.998874, 0.998802], 1e-3);
        close(parse("590:0, 600:1, 830:1", false).unwrap(), [0.948911, 0.0, 0.0], 1e-3);
        assert_eq!(parse("400:1, 490:1, 500:0, 501:0", false).unwrap(), [0.0, 0.0, 1.0]);
        let narrow = parse("500:8, 520:3", true).unwrap();
        assert_eq!(narrow[0], 0.0);
        close(narrow, [0.0, 0.926883, 0.0955245], 1.2e-2);
    }

    #[test]
    fn one_number_is_grey_and_equal_energy_for_emission() {
        assert_eq!(parse("0.3", false).unwrap(), [0.3; 3]);
        close(parse("3", true).unwrap(), [3.61438, 2.84487, 2.72675], 2e-4);
    }

    #[test]
    fn bad_lists_say_why() {
        assert!(parse("500:1, 400:1", false).unwrap_err().contains("400 follows 500"));
        assert!(parse("500:1", false).unwrap_err().contains("at least two"));
        assert!(parse("1 2 3", false).unwrap_err().contains("neither one number"));
        assert!(parse("400:1, 500:x", false).unwrap_err().contains("`x` is not a number"));
        assert!(parse("400:-1, 500:1", true).unwrap_err().contains("negative"));
    }

    #[test]
    fn materials_are_found_by_name() {
        assert_eq!(dielectric("bk7").unwrap(), 1.5046);
        assert_eq!(dielectric("water ice").unwrap(), 1.31);
        assert!(dielectric("bk8").unwrap_err().contains("did you mean `bk7`?"));
        assert_eq!(conductor("Ag").unwrap().0, [0.155276, 0.116728, 0.138388]);
        assert!(conductor("Gold").is_err());
    }
}
