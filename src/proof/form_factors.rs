//! Form factors with closed forms.

use super::selfcheck::Refused;
use crate::elements::{Elements, Factors};
use crate::io::mitsuba::LoadError;
use crate::scene::Scene;

/// Opposite faces of a cube [Howell 2010, C-11].
pub const OPPOSITE: f64 = 0.199_824_895_7;
/// Adjacent faces of a cube [Howell 2010, C-14].
pub const ADJACENT: f64 = 0.200_043_776_1;
/// Coaxial discs, r = r' = h = 1: (3 − √5)/2 [Howell 2010, C-41].
pub const DISCS: f64 = 0.381_966_011_3;

fn scene(parts: &str) -> Result<Scene, LoadError> {
    let sensor = r#"<sensor type="perspective"/>"#;
    let text = format!(r#"<scene version="3.0.0">{sensor}{parts}</scene>"#);
    crate::load_str(&text, ".".as_ref(), &Default::default()).map(|l| l.scene)
}

fn shape(kind: &str, flip: bool, transform: &str) -> String {
    format!(
        r#"<shape type="{kind}"><boolean name="flip_normals" value="{flip}"/><transform name="to_world">{transform}</transform>
    <bsdf type="diffuse"/></shape>"#
    )
}

/// What turns the square [−1, 1]² into each face of the cube [−1, 1]³, normals inwards: −z, +z, −y, +y, −x, +x.
pub const CUBE_FACES: [&str; 6] = [
    r#"<translate z="-1"/>"#,
    r#"<rotate y="1" angle="180"/><translate z="1"/>"#,
    r#"<rotate x="1" angle="-90"/><translate y="-1"/>"#,
    r#"<rotate x="1" angle="90"/><translate y="1"/>"#,
    r#"<rotate y="1" angle="90"/><translate x="-1"/>"#,
    r#"<rotate y="1" angle="-90"/><translate x="1"/>"#,
];

/// Form factors between the six faces of a cube, opposite ones at 2i and 2i + 1, from so many elements with so many
/// rays each.
pub fn cube(elements: usize, rays: u32, seed: u64) -> Result<Vec<Vec<f64>>, Refused> {
    let world = scene(&CUBE_FACES.map(|turn| shape("rectangle", false, turn)).concat())?;
    let mesh = Elements::new(&world, elements)?;
    let factors = Factors::cast(&world, &mesh, &vec![rays; mesh.len()], seed);
    let (mut sums, mut areas) = (vec![vec![0.0; 6]; 6], [0.0; 6]);
    for i in 0..mesh.len() {
        let a = mesh.shape(i) as usize;
        areas[a] += mesh.area(i);
        factors.row(i).for_each(|(j, x)| sums[a][mesh.shape(j) as usize] += x);
    }
    Ok(sums.into_iter().zip(areas).map(|(row, area)| row.into_iter().map(|x| x / area).collect()).collect())
}

/// The form factor of two coaxial discs, one element each.
pub fn discs(rays: u32, seed: u64) -> Result<f64, Refused> {
    let world = scene(&(shape("disk", false, "") + &shape("disk", true, r#"<translate z="1"/>"#)))?;
    let mesh = Elements::new(&world, 2)?;
    Ok(Factors::cast(&world, &mesh, &vec![rays; mesh.len()], seed).get(0, 1))
}
