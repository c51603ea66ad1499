//! Values and densities of Mitsuba 3.9.1 for the same models, made by `reference.py`.

use glam::Vec3;
use nephroid::local::Equation;
use nephroid::proof::scattering::models::all_models;

/// The file to compare with: that of the repository, or a larger one made by the same script.
fn lines() -> String {
    match std::env::var("NEPHROID_BSDF_REFERENCE") {
        Ok(path) => std::fs::read_to_string(path).expect("readable"),
        Err(_) => include_str!("reference.txt").to_string(),
    }
}

#[test]
fn reference_values_of_mitsuba() {
    let models = all_models();
    let mut worst: Vec<(f32, String)> = Vec::new();
    for line in lines().lines() {
        let mut words = line.split(' ');
        let name = words.next().expect("a name");
        let v: Vec<f32> = words.map(|w| w.parse().expect("a number")).collect();
        let case = models.iter().find(|c| c.name == name).unwrap_or_else(|| panic!("{name} is not in the list"));
        let (w_back, w_next) = (Vec3::new(v[0], v[1], v[2]), Vec3::new(v[3], v[4], v[5]));
        let e = case.at(w_back).evaluate(Equation::Rendering, w_back, w_next);
        // The principled model chooses its lobes otherwise; `sampling` compares its density with its samples.
        let same_choice = !name.starts_with("principled");
        let found = e.f.to_rgb().into_iter().chain(same_choice.then_some(e.p_w));
        let off = found.zip(&v[6..]).map(|(a, b)| (a - b).abs() / b.abs().max(1e-3)).fold(0.0, f32::max);
        worst.push((off, format!("{line}\n    {:?} {}", e.f.to_rgb(), e.p_w)));
        // Mitsuba's density of visible facets holds a fit of Beckmann's masking, off by 0.35 %.
        let tolerance = if name.contains("beckmann") { 4e-3 } else { 1e-3 };
        assert!(off < tolerance, "off by {off}: {}", worst[worst.len() - 1].1);
    }
    assert!(worst.len() > 250, "{} lines", worst.len());
}
