//! Which joins can make which classes of paths in a scene, derived from lobes, lights and sensor.
//!
//! With Dirac events S (mirrors, smooth glass) and other events D, and a light L that is a Dirac one
//! (point, spot, parallel) or not, a path `E … L` is made by a *hit* if the light is not Dirac, by a
//! *next event* if its last event is D, by a *splat* if its first event is D, by a *connection* if
//! two neighbouring events are both D [Veach 1997, §8.3], by a *merge* if an S follows a D that is not the first
//! event. What none of an estimator's joins makes is missing from its image: no number of samples brings it back.
//!
//! A class ends in S, then L: a hit finds such a light only if a direction chosen at the last D happens
//! to lead there, which is rare for small lights; the table says "by luck".

use crate::local::Lobes;
use crate::scene::geometry::Ray;
use crate::scene::{EmitterId, Scene};
use crate::transport::class::Symbol;
use glam::Vec2;
use std::fmt::Write;

/// What one estimator misses.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Blind {
    /// The estimator.
    pub estimator: &'static str,
    /// A class of paths as an expression for `--paths`.
    pub paths: &'static str,
    /// The same for people.
    pub what: &'static str,
}

/// Whether a join can make a class of paths.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Can {
    /// Never.
    #[default]
    No,
    /// Where a chosen direction happens to lead to the light.
    ByLuck,
    /// Yes.
    Yes,
}

impl Can {
    /// For people.
    pub fn text(self) -> &'static str {
        match self {
            Self::No => "no",
            Self::ByLuck => "by luck",
            Self::Yes => "yes",
        }
    }
}

impl From<bool> for Can {
    fn from(yes: bool) -> Self {
        if yes { Self::Yes } else { Self::No }
    }
}

/// The joins of one class of paths.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Joins {
    /// A gathering walk arrives on the light.
    pub hit: Can,
    /// A light point is picked.
    pub next_event: Can,
    /// Two walks meet.
    pub connect: Can,
    /// The lens sees a shooting vertex.
    pub splat: Can,
    /// Vertices of both walks are merged.
    pub merge: Can,
}

impl Joins {
    /// By hits and next events.
    pub fn gather(self) -> Can {
        self.hit.max(self.next_event)
    }

    /// By splats.
    pub fn shoot(self) -> Can {
        self.splat
    }

    /// By any but merges.
    pub fn bidirectional(self) -> Can {
        self.gather().max(self.connect).max(self.splat)
    }

    /// By any.
    pub fn auto(self) -> Can {
        self.bidirectional().max(self.merge)
    }
}

/// The end of a path at the sensor, as far as it decides what can be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ends {
    /// The light is a point, a spot or ideally parallel.
    pub dirac_light: bool,
    /// The light is infinitely far away.
    pub infinite_light: bool,
    /// The sensor looks into one direction only.
    pub parallel_sensor: bool,
}

/// Which joins can make the class with these events between eye and light.
pub fn joins(events: &[Symbol], ends: Ends) -> Joins {
    let d = |s: Option<&Symbol>| s == Some(&Symbol::D);
    let (first, last) = (d(events.first()), d(events.last()));
    let hit = match (ends.dirac_light, last || events.iter().all(|e| *e == Symbol::S)) {
        (true, _) => Can::No,
        (false, true) => Can::Yes,
        (false, false) => Can::ByLuck,
    };
    // A light seen directly is projected onto the film unless it is a point, or one direction of a
    // sky that only a sensor with one direction looks into.
    let direct = events.is_empty() && !ends.dirac_light && !(ends.infinite_light && ends.parallel_sensor);
    Joins {
        hit,
        next_event: last.into(),
        connect: events.windows(2).any(|w| w == [Symbol::D, Symbol::D]).into(),
        splat: (first || direct).into(),
        merge: events.windows(3).any(|w| w[1..] == [Symbol::D, Symbol::S]).into(),
    }
}

/// Classes worth a line of the table, with what they look like.
const CLASSES: [(&str, &str); 10] = [
    ("E L", "a light seen directly"),
    ("E D L", "direct light"),
    ("E D D L", "light from a matt surface"),
    ("E S L", "a light in a mirror or through glass"),
    ("E S D L", "a lit surface in a mirror or through glass"),
    ("E D S L", "a caustic"),
    ("E D S D L", "a lit surface that a mirror shows to another"),
    ("E D D S L", "a surface lit by a caustic"),
    ("E S D D S L", "the same in a mirror or through glass"),
    ("E S D S L", "a caustic in a mirror or under glass"),
];

/// A class of paths that occurs in a scene, and who makes it.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Row {
    /// The class, an expression for `--paths`.
    pub paths: &'static str,
    /// What it looks like.
    pub what: &'static str,
    /// The light is a point, a spot or parallel.
    pub dirac_light: bool,
    /// Each join.
    pub joins: Joins,
    /// Best of its joins.
    pub gather: Can,
    /// Best of its joins.
    pub shoot: Can,
    /// Best of all unbiased joins.
    pub bidirectional: Can,
    /// Best of all joins.
    pub auto: Can,
}

/// What can be made in a scene, and what not.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Coverage {
    /// Classes that occur.
    pub rows: Vec<Row>,
    /// What estimators miss.
    pub blind: Vec<Blind>,
    /// Share of the film whose first surface scatters by Dirac events alone: shooting leaves it black.
    pub dark_for_shooting: f64,
}

/// Symbols between E and L of a plain class such as `E D S L`.
pub fn events(class: &str) -> Vec<Symbol> {
    class.chars().filter(|c| matches!(c, 'D' | 'S')).map(|c| Symbol::event(c == 'S')).collect()
}

/// Kinds of events that the surfaces of the scene have.
fn lobes(scene: &Scene) -> Lobes {
    scene.used_materials.iter().fold(Lobes::default(), |all, m| all.union(scene.materials.lobes(*m)))
}

/// What there is of lights: (Dirac, infinite) pairs, each once.
fn lights(scene: &Scene) -> Vec<(bool, bool)> {
    let mut kinds = Vec::new();
    for (i, info) in scene.lights.infos().iter().enumerate() {
        let id = EmitterId(i as u32);
        let kind = (scene.lights.is_delta(id), scene.lights.is_infinite(id));
        if info.power.iter().any(|p| *p > 0.0) && !kinds.contains(&kind) {
            kinds.push(kind);
        }
    }
    kinds
}

impl Coverage {
    /// Of a built scene.
    pub fn of(scene: &Scene) -> Self {
        let lobes = lobes(scene);
        let lights = lights(scene);
        let mut rows = Vec::new();
        for (paths, what) in CLASSES {
            let events = events(paths);
            let occurs = events.iter().all(|e| if *e == Symbol::S { lobes.has_delta() } else { lobes.has_smooth() });
            for dirac_light in [false, true] {
                let some = lights.iter().filter(|l| l.0 == dirac_light);
                // A light that no path can end on needs no line.
                if !occurs || (events.is_empty() && dirac_light) {
                    continue;
                }
                let ends =
                    |l: &(bool, bool)| Ends { dirac_light, infinite_light: l.1, parallel_sensor: scene.sensor.is_orthographic() };
                // Of lights that differ, the one that is seen worst.
                let worst = some.map(|l| joins(&events, ends(l))).min_by_key(|j| j.splat);
                if let Some(joins) = worst {
                    let (gather, shoot) = (joins.gather(), joins.shoot());
                    let (bidirectional, auto) = (joins.bidirectional(), joins.auto());
                    rows.push(Row { paths, what, dirac_light, joins, gather, shoot, bidirectional, auto });
                }
            }
        }
        Self { rows, blind: blind_spots(lobes, &lights, scene.sensor.is_orthographic()), dark_for_shooting: dark(scene, lobes) }
    }

    /// For people.
    pub fn to_text(&self) -> String {
        let mut out = String::new();
        let head = ["hit", "nee", "connect", "splat", "merge", "gather", "shoot", "both", "auto"];
        let _ = writeln!(out, "coverage      light     {}", head.map(|h| format!("{h:8}")).concat().trim_end());
        for r in &self.rows {
            let j = r.joins;
            let cells = [j.hit, j.next_event, j.connect, j.splat, j.merge, r.gather, r.shoot, r.bidirectional, r.auto];
            let cells = cells.map(|c| format!("{:8}", c.text())).concat();
            let light = if r.dirac_light { "Dirac" } else { "hittable" };
            let _ = writeln!(out, "  {:12}{light:10}{cells} {}", r.paths, r.what);
        }
        if self.blind.is_empty() {
            out.push_str("not seen    nothing: every estimator makes every path\n");
        }
        for b in &self.blind {
            let _ = writeln!(out, "not seen    by {}: {} (paths {})", b.estimator, b.what, b.paths);
        }
        if self.dark_for_shooting > 0.0 {
            let percent = 100.0 * self.dark_for_shooting;
            let _ = writeln!(
                out,
                "            shooting leaves {percent:.1} % of the film black: a mirror or smooth glass is first there"
            );
        }
        out
    }
}

/// What the estimators miss; empty where each sees everything.
fn blind_spots(lobes: Lobes, lights: &[(bool, bool)], parallel_sensor: bool) -> Vec<Blind> {
    let specular = lobes.has_delta();
    let dirac_light = lights.iter().any(|l| l.0);
    let mut blind = Vec::new();
    if specular {
        let what = "what is first seen in a mirror or through smooth glass";
        blind.push(Blind { estimator: "shoot", paths: "E S .* L", what });
    }
    if parallel_sensor && lights.iter().any(|l| !l.0 && l.1) {
        blind.push(Blind { estimator: "shoot", paths: "E L", what: "sky seen directly by parallel projection" });
    }
    if specular && dirac_light {
        let what = "light of point, spot and parallel lights that arrives by a mirror or smooth glass";
        blind.push(Blind { estimator: "gather", paths: "E .* S L", what });
        let what = "such light seen by a mirror or smooth glass, without two matt surfaces in succession on its way";
        blind.push(Blind { estimator: "bidirectional", paths: "E S+ (D S+)* L", what });
        let what = "the image of such a light in mirrors or through smooth glass alone";
        blind.push(Blind { estimator: "auto", paths: "E S+ L", what });
    }
    blind
}

/// Share of the film where a ray first meets a surface without any event but Dirac ones; on a grid
/// of at most 128 × 128 points of the crop window.
fn dark(scene: &Scene, lobes: Lobes) -> f64 {
    if !lobes.has_delta() {
        return 0.0;
    }
    let film = &scene.film;
    let [x, y, w, h] = film.crop.unwrap_or([0, 0, film.width, film.height]);
    let (columns, rows) = (w.min(128), h.min(128));
    let mut dark = 0u32;
    for j in 0..rows {
        for i in 0..columns {
            let at = |i: u32, n: u32, from: u32, size: u32| from as f32 + (i as f32 + 0.5) / n as f32 * size as f32;
            let ray = scene.sensor.sample_ray(Vec2::new(at(i, columns, x, w), at(j, rows, y, h)), Vec2::splat(0.5));
            let ray = Ray { o: ray.o, d: ray.d, t_max: ray.t_max };
            let Some(hit) = scene.geometry.intersect(&ray) else { continue };
            let surface = scene.geometry.surface(&ray, &hit);
            let of = scene.materials.lobes(surface.material);
            dark += u32::from(of.has_delta() && !of.has_smooth() && surface.emitter == EmitterId::NONE);
        }
    }
    f64::from(dark) / f64::from((columns * rows).max(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    const AREA: Ends = Ends { dirac_light: false, infinite_light: false, parallel_sensor: false };
    const POINT: Ends = Ends { dirac_light: true, ..AREA };

    #[test]
    fn coverage_follows_the_table_of_the_theory() {
        use Can::{ByLuck, No, Yes};
        // class, hit (light, Dirac light), next event, connection, splat; merge
        let table = [
            ("E L", [Yes, No, No, No, Yes, No]),
            ("E D L", [Yes, No, Yes, No, Yes, No]),
            ("E D D L", [Yes, No, Yes, Yes, Yes, No]),
            ("E S D L", [Yes, No, Yes, No, No, No]),
            ("E D S L", [ByLuck, No, No, No, Yes, No]),
            ("E D S D L", [Yes, No, Yes, No, Yes, No]),
            ("E D D S L", [ByLuck, No, No, Yes, Yes, Yes]),
            ("E S D D S L", [ByLuck, No, No, Yes, No, Yes]),
            ("E S D S L", [ByLuck, No, No, No, No, Yes]),
            ("E S S L", [Yes, No, No, No, No, No]),
        ];
        for (class, [hit, hit_dirac, next_event, connect, splat, merge]) in table {
            let events = events(class);
            assert_eq!(joins(&events, AREA), Joins { hit, next_event, connect, splat, merge }, "{class}");
            let splat = if events.is_empty() { No } else { splat };
            assert_eq!(
                joins(&events, POINT),
                Joins { hit: hit_dirac, next_event, connect, splat, merge },
                "{class}, Dirac light"
            );
        }
        let sky = Ends { infinite_light: true, parallel_sensor: true, ..AREA };
        assert_eq!(joins(&[], sky), Joins { hit: Yes, ..Joins::default() });
    }

    #[test]
    fn blind_where_mirrors_and_points_are() {
        let (matt, glass) = (Lobes { diffuse: true, ..Lobes::default() }, Lobes { refraction: true, ..Lobes::default() });
        let names = |l, lights: &[_]| blind_spots(l, lights, false).iter().map(|b| b.estimator).collect::<Vec<_>>();
        assert!(names(matt, &[(true, false), (false, false)]).is_empty());
        assert_eq!(names(glass, &[(false, false)]), ["shoot"]);
        assert_eq!(names(glass, &[(true, false)]), ["shoot", "gather", "bidirectional", "auto"]);
        assert_eq!(blind_spots(matt, &[(false, true)], true)[0].paths, "E L");
    }
}
