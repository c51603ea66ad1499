//! Theory C1–C5: caustics with closed forms, by shooting; gathering finds exactly nothing.

use crate::support::seed;
use nephroid::proof::caustics::{Caustic, Effort, Known, flux_balance, nephroid, parabolic_mirror, slab, water};

fn effort(passes: u64) -> Effort {
    Effort { passes, seed: seed() }
}

/// At least `bins` bins within 4 standard errors, the total too, all precise enough to mean something.
fn agrees(name: &str, caustic: &Caustic, bins: usize, precision: f64) {
    let relative = |k: &Known| k.found.standard_error / k.exact;
    let loosest = caustic.bins.iter().map(relative).fold(0.0, f64::max);
    println!(
        "{name}: {} of {} bins within 4 SE, worst {:.2}, total {:.6e} ± {:.1e} not {:.6e}, errors up to {:.1} %",
        caustic.within(4.0),
        caustic.bins.len(),
        caustic.worst(),
        caustic.total.found.mean,
        caustic.total.found.standard_error,
        caustic.total.exact,
        100.0 * loosest
    );
    assert_eq!(caustic.gathered, 0.0, "{name}: gathering cannot see it");
    assert!(caustic.bins.len() >= bins && caustic.within(4.0) == caustic.bins.len(), "{name}: {caustic:?}");
    assert!(caustic.total.z().abs() < 4.0, "{name}: {:?}", caustic.total);
    assert!(loosest < precision && relative(&caustic.total) < 0.01, "{name}: {loosest}");
}

#[test]
fn c1_water_seen_from_below() {
    agrees("water", &water(effort(200)).unwrap(), 50, 0.05);
}

#[test]
fn c2_slab_for_every_path_length() {
    agrees("glass", &slab(1.5, 2, effort(300)).unwrap(), 2, 0.1);
    agrees("germanium", &slab(4.0, 4, effort(150)).unwrap(), 4, 0.25);
}

#[test]
fn c3_parabolic_mirror_sends_all_to_its_focus() {
    agrees("parabolic mirror", &parabolic_mirror(effort(60)).unwrap(), 1, 0.01);
}

#[test]
fn c4_nephroid_and_its_cusp() {
    let n = nephroid(effort(600)).unwrap();
    agrees("nephroid", &n.caustic, 50, 0.2);
    println!("cusp at {} ± {}", n.cusp.mean, n.cusp.standard_error);
    // The strip along the axis has a width, which moves the zero by 0.0015.
    assert!(n.cusp.standard_error < 0.005 && (n.cusp.mean - 0.5015).abs() < 4.0 * n.cusp.standard_error, "{:?}", n.cusp);
}

#[test]
fn c5_flux_of_a_caustic_is_what_enters() {
    agrees("ripples", &flux_balance(effort(60)).unwrap(), 1, 0.01);
}
