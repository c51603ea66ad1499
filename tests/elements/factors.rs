//! Form factors [theory B9]: closed forms, order of convergence, reciprocity, closure.

use crate::support::{scene, shape, six_walls, slope};
use nephroid::elements::{Elements, Factors};
use nephroid::proof::form_factors::{ADJACENT, DISCS, OPPOSITE, cube, discs};

/// Rays from every element.
const RAYS: u32 = 65_536;

#[test]
fn b9_cube_and_discs_to_a_thousandth() {
    for elements in [12, 192] {
        let f = cube(elements, RAYS * 12 / elements as u32, 1).unwrap();
        for (i, row) in f.iter().enumerate() {
            for (j, f) in row.iter().enumerate() {
                let exact = match (i, j) {
                    _ if i == j => 0.0,
                    _ if i / 2 == j / 2 => OPPOSITE,
                    _ => ADJACENT,
                };
                assert!((f - exact).abs() < 1e-3, "{elements} elements, faces {i}, {j}: {f} not {exact}");
            }
        }
    }
    let f = discs(RAYS, 1).unwrap();
    assert!((f - DISCS).abs() < 1e-3, "{f}");
}

/// Root mean square of the error over seeds falls with the number of rays: as N^-1/2 were they random,
/// faster since they are not, and not as fast as N^-1.
#[test]
fn b9_error_falls_with_rays() {
    let error = |rays: u32| {
        let squares = (0..24).map(|seed| (discs(rays, seed).unwrap() - DISCS).powi(2));
        (squares.sum::<f64>() / 24.0).sqrt()
    };
    let points: Vec<(f64, f64)> = [64u32, 256, 1024, 4096, 16384].map(|n| (f64::from(n), error(n))).into();
    let order = slope(&points);
    assert!((-1.0..-0.5).contains(&order), "order {order}: {points:?}");
}

/// Reciprocity bit for bit, closure to rounding, also with unequal elements and few rays.
#[test]
fn b9_reciprocity_and_closure() {
    let inner = shape("sphere", false, r#"<scale value="0.2"/><translate x="0.1" y="0.15"/>"#, "0.4", "");
    let world = scene(&(six_walls(|_| ("0.5", "")) + &inner));
    let mesh = Elements::new(&world, 300).unwrap();
    let factors = Factors::cast(&world, &mesh, &vec![64; mesh.len()], 3);
    assert!(factors.closure_error[0] > 1e-2 && factors.closure_error[1] < 1e-12, "{:?}", factors.closure_error);
    for i in 0..mesh.len() {
        assert!((factors.row_sum(i) - 1.0).abs() < 1e-12, "row {i} sums to {}", factors.row_sum(i));
        for (j, x) in factors.row(i) {
            let back = factors.row(j).find(|(k, _)| *k == i).expect("the other way too").1;
            assert_eq!(x.to_bits(), back.to_bits(), "A_{i} F_{i}{j}");
        }
    }
}

/// A sphere sees as much of itself as of nothing else: F_ij = A_j / A for any two of its elements.
#[test]
fn b9_sphere_from_inside() {
    let world = scene(&shape("sphere", true, "", "0.5", ""));
    let mesh = Elements::new(&world, 64).unwrap();
    assert_eq!(mesh.len(), 64);
    let factors = Factors::cast(&world, &mesh, &vec![65_536; mesh.len()], 5);
    for i in 0..64 {
        for j in 0..64 {
            assert!((factors.get(i, j) - 1.0 / 64.0).abs() < 1.5e-3, "{i} {j}: {}", factors.get(i, j));
        }
    }
}
