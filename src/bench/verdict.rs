//! The figures of a scene in words: who is nearest, what combining buys, what is missing, what nobody sees.

use super::figures::{ContenderFigures, SceneReport};
use super::layers::CLASSES;
use super::ratios::{Measure, Ratio};
use super::statistics::{Interval, quotient};
use crate::render::Estimator;

/// Relative difference of means that does not matter.
const SAME: f64 = 0.005;

/// Sentences about a scene, the most important first.
pub fn verdict(scene: &SceneReport) -> Vec<String> {
    let mut out = Vec::new();
    out.extend(nearest(scene));
    out.extend(combined(scene));
    out.extend(carries(scene));
    out.extend(scene.contenders.iter().filter_map(|c| missing(scene, c)));
    out.extend(scene.contenders.iter().filter_map(|c| conventions(scene, c)));
    let both = Estimator::Bidirectional.name();
    let unseen = scene.blind.iter().filter(|b| b.estimator == both);
    out.extend(unseen.map(|b| format!("None of our walkers sees {} (paths {}).", b.what, b.paths)));
    out.extend(beyond_reference(scene));
    let failed = scene.contenders.iter().filter_map(|c| Some((c, c.failure.as_ref()?)));
    out.extend(failed.map(|(c, reason)| format!("{} stopped: {reason}.", c.name)));
    out
}

/// relMSE trimmed at the end.
fn error(c: &ContenderFigures) -> Option<f64> {
    Some(c.summary.as_ref()?.errors.last()?.relmse_trimmed?.value)
}

fn ratio(scene: &SceneReport, a: usize, b: usize) -> Option<&Ratio> {
    scene.ratios.iter().rev().find(|r| (r.a, r.b, r.measure) == (a, b, Measure::RelmseTrimmed))
}

/// `3.1 times (2.8 to 3.4)`.
fn times(r: &Interval) -> String {
    let [low, high] = r.bounds.unwrap_or([r.value; 2]);
    format!("{} times ({} to {})", digits(r.value), digits(low), digits(high))
}

/// Three digits.
fn digits(x: f64) -> String {
    match x.abs() {
        a if a >= 100.0 => format!("{x:.0}"),
        a if a >= 10.0 => format!("{x:.1}"),
        a if a >= 0.01 => format!("{x:.2}"),
        _ => format!("{x:.1e}"),
    }
}

/// Who has the least error, and by how much.
fn nearest(scene: &SceneReport) -> Option<String> {
    let mut order: Vec<usize> = (0..scene.contenders.len()).filter(|i| error(&scene.contenders[*i]).is_some()).collect();
    order.sort_by(|a, b| {
        error(&scene.contenders[*a]).partial_cmp(&error(&scene.contenders[*b])).unwrap_or(std::cmp::Ordering::Equal)
    });
    let (first, second) = (*order.first()?, *order.get(1)?);
    let name = |i: usize| &scene.contenders[i].name;
    let mark = &scene.contenders[first].summary.as_ref()?.errors.last()?.mark;
    let begin = format!("At {mark}, {} has the least relMSE without outliers", name(first));
    let r = ratio(scene, second, first)?;
    Some(match (&r.ratio, r.why_not) {
        (Some(i), _) if r.significant => format!("{begin}: that of {} is {} as large.", name(second), times(i)),
        (Some(i), _) => format!("{begin}, but no more than chance explains: that of {} is {} as large.", name(second), times(i)),
        (None, why) => format!("{begin}; by how much is not known: {}.", why.unwrap_or("no ratio")),
    })
}

/// What joining both walkers buys against the better of the two alone.
fn combined(scene: &SceneReport) -> Option<String> {
    let find = |e: Estimator| scene.contenders.iter().position(|c| c.name == e.name() && error(c).is_some());
    let both = find(Estimator::Bidirectional)?;
    let alone = [Estimator::Gather, Estimator::Shoot].into_iter().filter_map(find);
    let best = alone.min_by(|a, b| {
        error(&scene.contenders[*a]).partial_cmp(&error(&scene.contenders[*b])).unwrap_or(std::cmp::Ordering::Equal)
    })?;
    let name = &scene.contenders[best].name;
    let gain = ratio(scene, best, both)?.ratio?;
    Some(match (gain.excludes(1.0), gain.value > 1.0) {
        (true, true) => {
            format!("Joining both walkers wins over the better one alone ({name}): its error is {} as large.", times(&gain))
        }
        (true, false) => {
            format!("Joining both walkers does not pay here: the error of {name} alone is {} that of both.", times(&gain))
        }
        (false, _) => {
            format!(
                "Joining both walkers is as good as {name} alone, as far as these runs can tell: the error of {name} is {} that of both.",
                times(&gain)
            )
        }
    })
}

/// Which join carries which share of what joining both walkers finds.
fn carries(scene: &SceneReport) -> Option<String> {
    let both = scene.contenders.iter().find(|c| c.name == Estimator::Bidirectional.name())?;
    let layers = both.layers.as_ref()?;
    let sums: Vec<(&str, f64, f64)> = layers
        .techniques
        .iter()
        .map(|(name, shares)| (name.as_str(), shares.iter().map(|s| s.energy).sum(), shares.iter().map(|s| s.noise).sum()))
        .collect();
    let (energy, noise) = sums.iter().fold((0.0, 0.0), |t, s| (t.0 + s.1, t.1 + s.2));
    if !(energy > 0.0 && noise > 0.0) {
        return None;
    }
    let share = |s: &(&str, f64, f64)| {
        format!("{} carries {:.0} % of the light and {:.0} % of the noise", s.0, 100.0 * s.1 / energy, 100.0 * s.2 / noise)
    };
    let all: Vec<String> = sums.iter().map(share).collect();
    let loudest = layers.classes.iter().zip(CLASSES).max_by(|a, b| a.0.noise.total_cmp(&b.0.noise))?;
    Some(format!("Of what {} finds, {}; most noise is in {} (paths {}).", both.name, all.join(", "), loudest.1.1, loudest.1.0))
}

/// Whether a peer means the same by the scene: its light against that of the estimator that sees the same.
fn conventions(scene: &SceneReport, peer: &ContenderFigures) -> Option<String> {
    let like = scene.contenders.iter().find(|c| Some(c.name.as_str()) == peer.like)?;
    let light = |c: &ContenderFigures| c.runs.iter().map(|r| r.energy).collect::<Vec<_>>();
    let quotient = quotient(&light(peer), &light(like))?;
    let [low, high] = quotient.bounds?;
    let amount = format!(
        "{} has {:.2} % ({:.2} to {:.2}) of the light of {}",
        peer.name,
        100.0 * quotient.value,
        100.0 * low,
        100.0 * high,
        like.name
    );
    let near = (quotient.value - 1.0).abs() < SAME;
    Some(match (near, quotient.excludes(1.0)) {
        (true, _) => format!("{amount}: both mean the same scene."),
        (false, false) => format!("{amount}: no more than chance explains."),
        (false, true) => format!(
            "{amount}: they do not mean the same scene, or one has not found some light yet; its errors cannot be compared."
        ),
    })
}

/// Light that an image has too little or too much of.
fn missing(scene: &SceneReport, c: &ContenderFigures) -> Option<String> {
    let energy = c.summary.as_ref()?.energy.filter(|e| e.excludes(1.0))?;
    let [low, high] = energy.bounds?;
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let name = &c.name;
    if energy.value > 1.0 {
        return Some(format!(
            "{name} has {} more light than the reference ({} to {}).",
            percent(energy.value - 1.0),
            percent(low - 1.0),
            percent(high - 1.0)
        ));
    }
    let amount =
        format!("{name} misses {} of the light ({} to {})", percent(1.0 - energy.value), percent(1.0 - high), percent(1.0 - low));
    let what: Vec<&str> = scene.blind.iter().filter(|b| b.estimator == *name).map(|b| b.what).collect();
    Some(match (c.peer, what.is_empty()) {
        (true, _) => format!("{amount}: it cannot see it, or has other conventions, or has not found it yet."),
        (false, true) => format!("{amount}: it has not found it yet."),
        (false, false) => format!("{amount}: it cannot see {}.", what.join(", nor ")),
    })
}

/// Errors that say more of the reference than of the image.
fn beyond_reference(scene: &SceneReport) -> Option<String> {
    let below = |c: &&ContenderFigures| c.summary.as_ref().is_some_and(|s| s.errors.last().is_some_and(|e| e.below_reference));
    let names: Vec<&str> = scene.contenders.iter().filter(below).map(|c| c.name.as_str()).collect();
    let error = scene.reference.as_ref()?.error?;
    (!names.is_empty()).then(|| {
        format!(
            "The relMSE of {} is below the noise of the reference (its standard error is {:.1} %): a better reference is needed to tell it.",
            names.join(" and "),
            100.0 * error
        )
    })
}
