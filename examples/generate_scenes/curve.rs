//! Plane curves for profiles: Catmull–Rom splines, arcs and polylines as runs of points.

use crate::mesh::Run;
use glam::DVec2;

/// A centripetal-free (uniform) Catmull–Rom spline through the points, `steps` pieces per span.
pub fn spline(points: &[(f64, f64)], steps: u32) -> Run {
    let at = |i: isize| {
        let (x, y) = points[i.clamp(0, points.len() as isize - 1) as usize];
        DVec2::new(x, y)
    };
    let mut run = vec![at(0)];
    for i in 0..points.len() as isize - 1 {
        let [a, b, c, d] = [at(i - 1), at(i), at(i + 1), at(i + 2)];
        for k in 1..=steps {
            let t = f64::from(k) / f64::from(steps);
            let cubic = (b * 3.0 - a - c * 3.0 + d) * t + (a * 2.0 - b * 5.0 + c * 4.0 - d);
            run.push((cubic * t + (c - a)) * (t * 0.5) + b);
        }
    }
    run
}

/// Part of a circle from angle `from` to `to` in degrees, counted counter-clockwise from +x.
pub fn arc(centre: (f64, f64), radius: f64, from: f64, to: f64, steps: u32) -> Run {
    (0..=steps)
        .map(|k| {
            let (sin, cos) = (from + (to - from) * f64::from(k) / f64::from(steps)).to_radians().sin_cos();
            DVec2::new(centre.0 + radius * cos, centre.1 + radius * sin)
        })
        .collect()
}

/// Straight pieces joined smoothly where the caller knows that they are tangent.
pub fn chain(runs: &[Run]) -> Run {
    let mut joined: Run = Vec::new();
    for p in runs.iter().flatten() {
        if joined.last().is_none_or(|last| last.distance(*p) > 1e-9) {
            joined.push(*p);
        }
    }
    joined
}

/// Straight from point to point, as one run.
pub fn line(from: (f64, f64), to: (f64, f64), steps: u32) -> Run {
    let (a, b) = (DVec2::new(from.0, from.1), DVec2::new(to.0, to.1));
    (0..=steps).map(|k| a.lerp(b, f64::from(k) / f64::from(steps))).collect()
}

/// The run shifted sideways by `distance` to its right (outwards for a rising outer wall).
pub fn offset(run: &Run, distance: f64) -> Run {
    (0..run.len())
        .map(|i| {
            let t = (run[(i + 1).min(run.len() - 1)] - run[i.saturating_sub(1)]).normalize();
            let p = run[i] + DVec2::new(t.y, -t.x) * distance;
            DVec2::new(p.x.max(0.0), p.y)
        })
        .collect()
}

/// The run travelled the other way.
pub fn reversed(run: &Run) -> Run {
    run.iter().rev().copied().collect()
}
