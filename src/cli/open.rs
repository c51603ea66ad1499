//! From a scene file to a built scene, with every problem shown at its place; and `check`.

use super::args::SceneArgs;
use super::{Exit, Failure, tell};
use crate::describe::{FilmDescription, Problems, SceneDescription, SensorDescription, Sources};
use crate::io::assets;
use crate::io::mitsuba::{self, LoadOptions};
use crate::scene::Scene;

/// A scene as described, its files not read yet, with the warnings so far.
pub struct Described {
    /// The scene.
    pub description: SceneDescription,
    /// Number of the chosen sensor.
    pub sensor: usize,
    /// Problems so far, no errors among them.
    pub problems: Problems,
}

/// `check`: reads and builds; warnings and errors to standard error.
pub fn check(args: &SceneArgs) -> Result<Exit, Failure> {
    set_threads(args.threads);
    let opened = build(describe(args)?)?;
    let warnings = opened.problems.list.len();
    tell(&opened.problems.render(&opened.description.sources));
    let remark = match warnings {
        0 => String::new(),
        1 => ", 1 warning".into(),
        n => format!(", {n} warnings"),
    };
    tell(&format!("{}: can be rendered{remark}\n", args.scene.display()));
    Ok(Exit::Done)
}

/// Reads the description.
pub fn describe(args: &SceneArgs) -> Result<Described, Failure> {
    let options = LoadOptions { defines: args.define.clone(), sandbox: args.sandbox.clone() };
    let loaded = mitsuba::load(&args.scene, &options).map_err(|e| scene_failure(&e.problems, &e.sources))?;
    let description = loaded.scene;
    let sensor = args.sensor.as_deref().map_or(Ok(0), |wanted| find_sensor(&description, wanted))?;
    Ok(Described { description, sensor, problems: loaded.warnings })
}

/// A scene ready to be walked, with the description it was built from.
pub struct Opened {
    /// What was described; meshes and images are decoded.
    pub description: SceneDescription,
    /// Number of the chosen sensor.
    pub sensor: usize,
    /// What was built.
    pub scene: Scene,
    /// Warnings.
    pub problems: Problems,
}

/// Reads meshes and images and builds the scene.
pub fn build(described: Described) -> Result<Opened, Failure> {
    let Described { mut description, sensor, mut problems } = described;
    assets::decode(&mut description, &mut problems);
    // With a mesh or an image missing, building would only repeat what is known.
    if problems.has_errors() {
        return Err(scene_failure(&problems, &description.sources));
    }
    match Scene::build(&description, sensor) {
        Ok((scene, warnings)) => {
            problems.list.extend(warnings.list);
            Ok(Opened { description, sensor, scene, problems })
        }
        Err(errors) => {
            problems.list.extend(errors.list);
            Err(scene_failure(&problems, &description.sources))
        }
    }
}

/// The same part of the picture at another size.
pub fn resize(film: &mut FilmDescription, [width, height]: [u32; 2]) {
    let scale = |v: u32, from: u32, to: u32| (u64::from(v) * u64::from(to) / u64::from(from.max(1))) as u32;
    film.crop = film.crop.map(|[x, y, w, h]| {
        let (left, top) = (scale(x, film.width, width), scale(y, film.height, height));
        let (right, bottom) = (scale(x + w, film.width, width), scale(y + h, film.height, height));
        [left, top, (right - left).max(1), (bottom - top).max(1)]
    });
    (film.width, film.height) = (width, height);
}

/// Threads for everything that follows; `None` leaves it to the machine.
pub fn set_threads(threads: Option<u32>) {
    if let Some(n) = threads {
        // Fails only where a pool exists already, as in a test that runs several commands.
        let _ = rayon::ThreadPoolBuilder::new().num_threads(n as usize).build_global();
    }
}

/// A scene error with all problems at their places.
pub fn scene_failure(problems: &Problems, sources: &Sources) -> Failure {
    Failure { exit: Exit::Usage, message: problems.render(sources) }
}

/// Number of the wanted sensor.
fn find_sensor(description: &SceneDescription, wanted: &str) -> Result<usize, Failure> {
    let by_id = description.sensors.iter().position(|s| s.id.as_deref() == Some(wanted));
    let by_number = wanted.parse().ok().filter(|i| *i < description.sensors.len());
    by_id.or(by_number).ok_or_else(|| {
        let named = |(i, s): (usize, &SensorDescription)| match &s.id {
            Some(id) => format!("{i} (`{id}`)"),
            None => i.to_string(),
        };
        let known: Vec<_> = description.sensors.iter().enumerate().map(named).collect();
        Failure::usage(format!("there is no sensor `{wanted}`; the scene has {}", known.join(", ")))
    })
}
