//! The command `adjoint` on scenes of every kind, and the table of coverage against renders.

use crate::scenes;
use crate::support::{scene, seed};
use nephroid::proof::adjoint::{Adjoint, Effort, adjoint};
use nephroid::render::{Budget, Control, Estimator, Options, Render};
use nephroid::report::coverage::{Can, Coverage};
use nephroid::transport::class::PathFilter;
use nephroid::transport::settings::Techniques;

fn run(xml: &str, passes: u64) -> Adjoint {
    let effort = Effort { renders: 64, passes: Some(passes), seed: seed(), max_length: Some(6), ..Effort::default() };
    adjoint(&mut scene(xml), &effort).unwrap()
}

/// Theory A3: gathering and shooting measure the same for every n, in every block.
#[test]
fn a3_adjointness_for_every_number_of_scatterings() {
    let dir = tempfile::tempdir().unwrap();
    for (name, passes, share) in [
        ("diffuse box", 3, 0.97),
        ("glass and mirror", 8, 0.9),
        ("point light", 6, 0.9),
        ("image sky", 6, 0.8),
        ("crop window", 3, 0.95),
        ("under water", 6, 0.9),
        ("orthographic", 3, 0.95),
    ] {
        let found = run(&scenes::named(dir.path(), name), passes);
        println!("{name}:\n{}", found.to_text(true, false));
        assert!(found.agree, "{name}:\n{}", found.to_text(true, true));
        assert!(found.energy_tested > share, "{name}: {}", found.energy_tested);
        let terms = &found.lit[0].terms;
        assert!(terms.len() >= 5 && terms.iter().any(|t| t.n >= 3 && t.gather.mean > 0.0));
    }
}

/// What an estimator cannot make is exactly zero, what the table says it can make is not.
#[test]
fn coverage_is_what_renders_show() {
    let dir = tempfile::tempdir().unwrap();
    for name in ["glass and mirror", "point light", "orthographic", "image sky"] {
        let world = scene(&scenes::named(dir.path(), name));
        let coverage = Coverage::of(&world);
        for row in &coverage.rows {
            let joins = [
                ("hit", row.joins.hit),
                ("nee", row.joins.next_event),
                ("connect", row.joins.connect),
                ("splat", row.joins.splat),
            ];
            for (techniques, can) in joins {
                let mut options = Options::for_scene(&world, Estimator::Bidirectional);
                options.settings.techniques = Techniques::parse(techniques).unwrap();
                options.settings.paths = PathFilter::parse(row.paths).unwrap();
                options.settings.max_length = 6;
                let mut render = Render::new(&world, &options).unwrap();
                render.run(&Budget::passes(64), |_| Control::Continue);
                let energy: f32 = render.picture().mean.iter().flatten().sum();
                match can {
                    Can::No => assert_eq!(energy, 0.0, "{name}: {techniques} makes {}", row.paths),
                    // Two kinds of light may share a row, or a class may have no geometry to show it.
                    Can::Yes | Can::ByLuck => assert!(
                        energy > 0.0 || matches!(row.paths, "E S S L" | "E L"),
                        "{name}: {techniques} does not make {} ({can:?})",
                        row.paths
                    ),
                }
            }
        }
    }
}
