//! Layers are what renders of them alone would be.

use nephroid::bench::layers::{CLASSES, layers};
use nephroid::bench::reference::Reference;
use nephroid::render::{Budget, Control, Estimator, Options, Render};
use nephroid::report::Picture;
use nephroid::report::measures::relative_variance;
use nephroid::scene::Scene;
use nephroid::transport::class::PathFilter;
use std::path::Path;

/// Without colours, so that variances of channels are those of their mean.
fn scene() -> Scene {
    let mirror = "<bsdf type=\"conductor\"><string name=\"material\" value=\"none\"/></bsdf>";
    let text = super::SCENE.replace("<bsdf type=\"conductor\"/>", mirror).replace("0.7, 0.5, 0.3", "0.5");
    nephroid::load_str(&text, Path::new("."), &Default::default()).unwrap_or_else(|e| panic!("{e}")).scene
}

const PASSES: u64 = 256;

fn picture(scene: &Scene, options: &Options) -> Picture {
    let mut render = Render::new(scene, options).unwrap();
    render.run(&Budget::passes(PASSES), |_| Control::Continue);
    Picture::of_film(render.film())
}

fn light(p: &Picture) -> f64 {
    p.mean.iter().flatten().map(|v| f64::from(*v)).sum()
}

/// Standard error of the light of an image whose blocks of pixels are independent of each other.
fn uncertainty(p: &Picture) -> f64 {
    let blocks = p.block_variance.as_ref().unwrap();
    let of_block = |(x, y): (u32, u32)| {
        let pixels = f64::from((p.width - x).min(16) * (p.height - y).min(16));
        3.0 * pixels * f64::from(blocks[(y * p.width + x) as usize][0]).sqrt()
    };
    let corners = (0..p.height).step_by(16).flat_map(|y| (0..p.width).step_by(16).map(move |x| (x, y)));
    corners.map(|c| of_block(c).powi(2)).sum::<f64>().sqrt()
}

/// The same random numbers make the same gathering walks, whether what they find is told apart or filtered: equal but
/// for rounding. Shooting walks draw more where something is seen, and agree as far as chance allows.
#[test]
fn layers_are_the_parts_of_the_image() {
    let scene = scene();
    for estimator in [Estimator::Gather, Estimator::Shoot, Estimator::Bidirectional] {
        let mut options = Options::for_scene(&scene, estimator);
        // The guide would learn something else for every class.
        options.settings.guided = false;
        let whole = picture(&scene, &options);
        let all = light(&whole);
        let reference = Reference { picture: whole.clone(), origin: String::new(), error: None, warning: None };
        let found = layers(&scene, &options, &reference, &Budget::passes(PASSES), &|| false).unwrap();
        assert_eq!(found.passes, PASSES);
        let by_join: f64 = found.techniques.iter().flat_map(|t| &t.1).map(|s| s.energy).sum();
        let by_class: f64 = found.classes.iter().map(|s| s.energy).sum();
        assert!((by_join - 1.0).abs() < 1e-4 && (by_class - 1.0).abs() < 1e-4, "{} {by_join} {by_class}", estimator.name());
        let mut occur = 0;
        for ((paths, _), share) in CLASSES.iter().zip(&found.classes) {
            let mut options = options.clone();
            options.settings.paths = PathFilter::parse(paths).unwrap();
            let alone = picture(&scene, &options);
            let energy = light(&alone) / all;
            let noise = relative_variance(alone.variance.as_ref().unwrap(), &whole.mean) * PASSES as f64;
            let exact = estimator == Estimator::Gather;
            // 24 comparisons at alpha 1e-4 in all.
            let by_chance = if exact { 0.0 } else { 4.6 * 2f64.sqrt() * uncertainty(&alone) / all };
            let (off, noisy) = ((energy - share.energy).abs(), (noise - share.noise).abs());
            assert!(off < 1e-4 * energy + 1e-7 + by_chance, "{} {paths}: {energy} {share:?}", estimator.name());
            let tolerance = if exact { 0.01 } else { 0.3 };
            assert!(noisy < tolerance * noise + 1e-6, "{} {paths}: noise {noise} {share:?}", estimator.name());
            occur += u32::from(energy > 0.0);
        }
        assert!(occur >= if estimator == Estimator::Shoot { 4 } else { 7 }, "{} has {occur} classes", estimator.name());
        let lengths = |name: &str| found.techniques.iter().find(|t| t.0 == name).map(|t| &t.1);
        assert_eq!(lengths("connect").is_some(), estimator == Estimator::Bidirectional);
        if let Some(direct) = lengths("next event") {
            assert!(direct[0].energy == 0.0 && direct[1].energy > 0.0 && direct[5].energy == 0.0);
        }
    }
}
