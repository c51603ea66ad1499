//! The command `residual`: both equations hold at random points, on scenes of every kind.

use crate::scenes;
use crate::support::{scene, seed};
use nephroid::proof::residual::{Effort, Residuals, residuals};

fn run(xml: &str, walks: u64) -> Residuals {
    let effort = Effort { points: 48, walks: Some(walks), seed: seed(), max_length: Some(6), ..Effort::default() };
    residuals(&scene(xml), &effort)
}

/// Theory A1 and A2, where the equations themselves are asked, not an image.
#[test]
fn a1_a2_residuals_of_both_equations_are_zero() {
    let dir = tempfile::tempdir().unwrap();
    let mut failed = Vec::new();
    for (name, walks, share) in [
        ("diffuse box", 16, 0.8),
        ("glass and mirror", 32, 0.7),
        ("rough glass and metal", 32, 0.4),
        ("plastics, mask and blend", 32, 0.6),
        ("shading normals", 16, 0.7),
        ("point light", 16, 0.45),
        ("image sky", 16, 0.6),
        ("thin lens", 16, 0.7),
        ("crop window", 16, 0.7),
        ("under water", 32, 0.5),
        ("orthographic", 16, 0.7),
    ] {
        let found = run(&scenes::named(dir.path(), name), walks);
        println!("{name}:\n{}", found.to_text(false));
        assert!(found.zero, "{name}:\n{}", found.to_text(true));
        for equation in &found.equations {
            let tests: usize = equation.classes.iter().map(|c| c.tests.len()).sum();
            if equation.energy_tested < share || equation.points < 40 || tests < 5 {
                failed.push(format!("{name}, {}: {} of the energy, {tests} tests", equation.equation, equation.energy_tested));
            }
        }
    }
    assert!(failed.is_empty(), "too little was tested: {failed:#?}");
}
