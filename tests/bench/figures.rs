//! The figures are right: known variance, slope −1, and intervals that are wrong as often as they say.

use nephroid::bench::contender::{Contender, Walker};
use nephroid::bench::figures::SceneReport;
use nephroid::bench::race::race;
use nephroid::bench::ratios::{Measure, Ratio};
use nephroid::bench::reference::Reference;
use nephroid::bench::{Effort, Marks, Subject};
use nephroid::render::{Budget, Control, Estimator, Options, Render};
use nephroid::report::Picture;
use nephroid::report::measures::{distances, relative_variance};
use nephroid::scene::Scene;
use std::path::Path;
use std::time::Duration;

/// A plane that shines 2 or 0 in fine stripes, whole periods of them in each of 32 × 32 pixels.
const STRIPES: &str = r#"<scene version="3.0.0">
    <integrator type="path"/>
    <sensor type="orthographic">
        <transform name="to_world"><lookat origin="0, 0, 1" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="32"/><rfilter type="box"/></film>
    </sensor>
    <shape type="rectangle">
        <emitter type="area"><texture type="checkerboard" name="radiance">
            <rgb name="color0" value="2"/><rgb name="color1" value="0"/>
            <transform name="to_uv"><scale x="64" y="64"/></transform>
        </texture></emitter>
    </shape>
</scene>"#;

fn scene(text: &str) -> Scene {
    nephroid::load_str(text, Path::new("."), &Default::default()).unwrap_or_else(|e| panic!("{e}")).scene
}

fn effort(samples: u64, runs: u32, seed: u64) -> Effort {
    let time = Duration::from_secs(1);
    Effort { marks: Marks::Samples(vec![samples]), runs, seed, reference_error: 0.01, reference_time: time }
}

fn report(scene: &Scene, reference: &Reference, effort: &Effort, estimators: &[Estimator]) -> SceneReport {
    let walker = |e: &Estimator| {
        let mut options = Options::for_scene(scene, *e);
        // What is known is the variance of independent samples.
        options.settings.stratified = false;
        Box::new(Walker::with(e.name().into(), scene, options)) as Box<dyn Contender + '_>
    };
    let mut contenders: Vec<_> = estimators.iter().map(walker).collect();
    let entries = race(&mut contenders, reference, effort, &|| false, &mut |_| {});
    let subject = Subject { name: "test".into(), path: Path::new("test.xml"), scene };
    SceneReport::new(&subject, reference, effort, &entries)
}

fn exact(picture: Picture) -> Reference {
    Reference { picture, origin: "known".into(), error: Some(0.0), warning: None }
}

/// Samples that fill a pixel evenly err less than their variance says; two halves know by how much.
#[test]
fn halves_of_a_reference_tell_its_noise() {
    let scene = scene(STRIPES);
    let half = |seed, passes| {
        let mut options = Options::for_scene(&scene, Estimator::Gather);
        options.settings.seed = seed;
        let mut render = Render::new(&scene, &options).unwrap();
        render.run(&Budget::passes(passes), |_| Control::Continue);
        render.into_film()
    };
    // No powers of two: those would leave no error at all.
    let (a, b) = (half(1, 13), half(2, 39));
    let (known, picture) = (vec![[1.0; 3]; 1024], Picture::of_halves(&a, &b));
    assert_eq!(picture.samples, Some(52));
    let error = distances(&picture.mean, &known).relmse;
    let told = relative_variance(&picture.variance.unwrap(), &known);
    assert!((told / error - 1.0).abs() < 0.2, "{told} for {error}");
    let bound = relative_variance(&b.variance_of_mean(), &known);
    assert!(bound > 2.0 * distances(&b.mean(), &known).relmse, "{bound}");
}

/// A pixel is 2 or 0 with probability ½: relative variance 1 / 1.01 per sample, exactly.
#[test]
fn figures_of_a_known_variance() {
    let scene = scene(STRIPES);
    let known = Picture { width: 32, height: 32, mean: vec![[1.0; 3]; 1024], ..Picture::default() };
    let (samples, runs) = (64, 12);
    let report = report(&scene, &exact(known), &effort(samples, runs, 5), &[Estimator::Gather]);
    let c = &report.contenders[0];
    let summary = c.summary.as_ref().unwrap();
    let expected = 1.0 / 1.01 / samples as f64;
    // Of N = pixels · runs draws: the sample variance of n coins has relative variance (2/n − …) ≈ 2/n², the square of a mean 2.
    let n = 1024.0 * f64::from(runs);
    let near = |found: f64, relative_variance: f64, what: &str| {
        let z = (found / expected - 1.0) / (relative_variance / n).sqrt();
        assert!(z.abs() < 3.9, "{what}: {found} for {expected}, {z} standard errors");
    };
    near(summary.variance.unwrap().value, 2.0 / (samples * samples) as f64 + 1e-4, "variance");
    near(summary.errors[0].relmse.unwrap().value, 2.0, "relMSE");
    near(c.variance_between_runs.unwrap(), 2.0 * f64::from(runs) / f64::from(runs - 1), "variance between runs");
    for r in &c.runs {
        let efficiency = 1.0 / (r.variance.unwrap() * r.seconds);
        let between = 1.0 / (c.variance_between_runs.unwrap() * r.seconds);
        assert!((efficiency / between - 1.0).abs() < 0.08, "{efficiency} {between}");
    }
    let slope = summary.slope.unwrap();
    assert!((slope.value + 1.0).abs() < 0.05 && !slope.excludes(slope.value), "{slope:?}");
    // The mean light has standard error √(1 / (64 · 1024 · 12)).
    let energy = summary.energy.unwrap();
    assert!((energy.value - 1.0).abs() < 3.9 * (1.0 / (samples as f64 * n)).sqrt(), "{energy:?}");
    assert!(report.ratios.is_empty() && !summary.errors[0].below_reference);
}

/// Two identical configurations differ by chance alone, at 5 % in 10 ± 3 of 200 comparisons.
#[test]
fn identical_configurations_are_told_apart_as_rarely_as_they_should() {
    let scene = scene(&super::SCENE.replace("\"32\"", "\"16\"").replace("\"24\"", "\"12\""));
    let options = Options::for_scene(&scene, Estimator::Bidirectional);
    let mut render = Render::new(&scene, &options).unwrap();
    render.run(&Budget::passes(2000), |_| Control::Continue);
    let reference = exact(Picture::of_film(render.film()));
    let same = (0..200).filter(|i| {
        let report = report(&scene, &reference, &effort(4, 3, 1000 + i), &[Estimator::Gather; 2]);
        let of_first = |r: &&Ratio| r.a == 0 && r.measure == Measure::RelmseTrimmed;
        let ratio = report.ratios.iter().find(of_first).unwrap();
        assert!(ratio.ratio.unwrap().bounds.is_some());
        !ratio.significant
    });
    let same = same.count();
    assert!((180..=198).contains(&same), "{same} of 200 comparisons not significant");
}

/// An estimator that does half of the work for each sample's worth is told apart, by the factor that it has.
#[test]
fn a_known_ratio_is_found() {
    let scene = scene(STRIPES);
    let known = Picture { width: 32, height: 32, mean: vec![[1.0; 3]; 1024], ..Picture::default() };
    // The same estimator against itself, at a mark with a quarter of the samples.
    let effort = Effort { marks: Marks::Samples(vec![16, 64]), ..effort(64, 6, 9) };
    let report = report(&scene, &exact(known), &effort, &[Estimator::Gather; 2]);
    let errors = |k: usize| {
        report.contenders[k].summary.as_ref().unwrap().errors.iter().map(|e| e.relmse.unwrap().value).collect::<Vec<_>>()
    };
    for k in 0..2 {
        let e = errors(k);
        assert!((e[0] / e[1] / 4.0 - 1.0).abs() < 0.15, "{e:?}");
    }
}
