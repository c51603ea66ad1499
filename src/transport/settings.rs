//! What a render is asked to do: which joins, which paths, how many of each.

use super::Technique;
use super::class::PathFilter;
use super::crowd::Crowds;
use super::first_seen::FirstSeen;
use super::incident::Incident;
use super::mis::Heuristic;
use super::mutant::{Mutant, planted};
use super::sample_map::SampleMap;
use crate::math::Random;
use crate::math::random::Family;
use crate::scene::emitter::Guide;
use glam::Vec2;
use std::sync::Arc;

/// Joins that are allowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Techniques {
    /// Gathering walks arrive on emitters.
    pub hit: bool,
    /// Light points are picked from gathering vertices.
    pub next_event: bool,
    /// Shooting vertices are seen by the lens.
    pub splat: bool,
    /// Gathering vertices are joined to shooting vertices.
    pub connect: bool,
    /// Gathering vertices that are not seen directly are merged with shooting vertices near them that narrow events
    /// ([`Breadth`](crate::local::Breadth)) lead to: biased by a radius that shrinks from pass to pass, so consistent.
    pub merge: bool,
}

impl Techniques {
    /// Hits and next events (path tracing, Kajiya 1986).
    pub const GATHER: Self = Self { hit: true, next_event: true, splat: false, connect: false, merge: false };
    /// Splats (light tracing, Arvo 1986).
    pub const SHOOT: Self = Self { hit: false, next_event: false, splat: true, connect: false, merge: false };
    /// All that are unbiased (bidirectional path tracing, Lafortune 1993, Veach 1994).
    pub const BIDIRECTIONAL: Self = Self { hit: true, next_event: true, splat: true, connect: true, merge: false };
    /// All five.
    pub const ALL: Self = Self { merge: true, ..Self::BIDIRECTIONAL };

    /// From a list such as `hit,nee,splat,connect,merge`; the unknown name is the error.
    pub fn parse(list: &str) -> Result<Self, String> {
        let mut t = Self { hit: false, next_event: false, splat: false, connect: false, merge: false };
        for name in list.split(',').map(str::trim).filter(|s| !s.is_empty()) {
            match name {
                "hit" => t.hit = true,
                "nee" | "next-event" => t.next_event = true,
                "splat" => t.splat = true,
                "connect" => t.connect = true,
                "merge" => t.merge = true,
                other => return Err(other.to_owned()),
            }
        }
        Ok(t)
    }

    /// Whether a join is among them.
    pub fn allows(self, technique: Technique) -> bool {
        match technique {
            Technique::Hit => self.hit,
            Technique::NextEvent => self.next_event,
            Technique::Connect => self.connect,
            Technique::Splat => self.splat,
            Technique::Merge => self.merge,
        }
    }

    /// As a list for people.
    pub fn names(self) -> String {
        let on = [self.hit, self.next_event, self.splat, self.connect, self.merge];
        let names: Vec<&str> = Self::NAMES.into_iter().zip(on).filter(|n| n.1).map(|n| n.0).collect();
        names.join(", ")
    }

    /// The names [`Techniques::parse`] knows.
    pub const NAMES: [&str; 5] = ["hit", "nee", "splat", "connect", "merge"];

    /// A gathering walk is needed.
    pub fn gathers(self) -> bool {
        self.hit || self.next_event || self.connect || self.merge
    }

    /// A shooting walk is needed.
    pub fn shoots(self) -> bool {
        self.splat || self.connect || self.merge
    }
}

/// How much of the coupling between surfaces is followed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Coupling {
    /// All of it.
    #[default]
    All,
    /// Ideal reflection and refraction: see [`super::recursive`].
    Specular,
    /// None: lights alone, `shadows` with visibility.
    None {
        /// Lights are seen only where nothing is between.
        shadows: bool,
    },
}

/// Default of [`Settings::faint`].
pub const FAINT: f32 = 1e-2;
/// The value with which no branches are followed.
pub const NO_BRANCHES: f32 = 1.0;

/// The value of [`Settings::faintest_split`] with which walks do not split.
pub const NO_SPLITS: f32 = 1.0;

/// Everything that decides what is estimated and by which joins.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Joins that are allowed.
    pub techniques: Techniques,
    /// What is followed between surfaces.
    pub coupling: Coupling,
    /// From densities to weights.
    pub heuristic: Heuristic,
    /// Shortest path in edges.
    pub min_length: u32,
    /// Longest path in edges.
    pub max_length: u32,
    /// Path length from which Russian roulette may end a walk.
    pub rr_depth: u32,
    /// Roulette lets a gathering walk go on with so many times the share that it still carries, at most 0.95. With 1 those that
    /// go on carry as much as at their start, and what they find late is noise.
    pub survival: f32,
    /// Leave out paths of length 1.
    pub hide_emitters: bool,
    /// Light paths per pass; `None` = one per pixel.
    pub light_paths: Option<u32>,
    /// Connections per gathering vertex.
    pub connections: u32,
    /// Radius of merges in the first pass; `None` = about two pixels of what is merged.
    pub merge_radius: Option<f32>,
    /// A pilot chooses which of the allowed joins are used, and how many light paths.
    pub automatic: bool,
    /// Light paths start where a pilot found that they matter.
    pub guided: bool,
    /// Gathering walks go where a pilot found that light comes from; where techniques are chosen, the pilot may decide so.
    pub guided_gathering: bool,
    /// Branches of a chain of Dirac events from the eye to a light ([`super::chain`]) that carry less than this
    /// share of the pixel are followed with a probability only; [`NO_BRANCHES`]: a walk takes one way at random.
    pub faint: f32,
    /// Samples of chains of Dirac events between eye and light (E S* L) per pixel and pass, where branches are followed:
    /// nothing but a hit finds them, so a reflection of a lamp that is smaller than a pixel needs many. Of pixels that show no
    /// lamp, glass or mirror first, one.
    pub chain_samples: u32,
    /// Where branches are followed and a gathering walk that came by Dirac events alone has two ways on, it takes both if the
    /// fainter carries at least this share of the pixel ([`super::split`]); [`NO_SPLITS`]: one at random.
    pub faintest_split: f32,
    /// Where techniques are chosen, the pilot may give pixels where walks vary more of them.
    pub adaptive: bool,
    /// Gathering walks of each pixel in a pass.
    pub samples: Arc<SampleMap>,
    /// Classes of paths that count.
    pub paths: PathFilter,
    /// Walks fill the space of their first decisions evenly.
    pub stratified: bool,
    /// Seed of all random numbers.
    pub seed: u64,
}

impl Settings {
    /// All branches of chains are followed, not one at random.
    pub fn follows_chains(&self) -> bool {
        self.faint < NO_BRANCHES && self.techniques.hit && self.coupling == Coupling::All
    }

    /// Longest path in edges that is walked.
    pub fn longest(&self) -> u32 {
        self.max_length.min(match self.coupling {
            Coupling::All | Coupling::Specular => LONGEST_PATH,
            Coupling::None { .. } => 2,
        })
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            techniques: Techniques::BIDIRECTIONAL,
            coupling: Coupling::All,
            heuristic: Heuristic::default(),
            min_length: 1,
            max_length: u32::MAX,
            rr_depth: 5,
            survival: 1.0,
            hide_emitters: false,
            light_paths: None,
            connections: 1,
            merge_radius: None,
            automatic: false,
            guided: true,
            guided_gathering: false,
            faint: FAINT,
            chain_samples: 1,
            faintest_split: NO_SPLITS,
            adaptive: true,
            samples: Arc::default(),
            paths: PathFilter::default(),
            stratified: true,
            seed: 0,
        }
    }
}

/// Settings with all counts fixed, as the walks use them; immutable during a render.
#[derive(Clone, Debug)]
pub struct Plan {
    /// What is asked for.
    pub settings: Settings,
    /// Light paths of a pass; 0 where nothing shoots.
    pub light_paths: u32,
    /// N of the weights: light paths per camera sample where pixels have one in a pass ([`Plan::n_at`]), 0 where splats are off.
    pub n: f32,
    /// c of the weights: connections per camera sample and light vertex, with the mean number of
    /// light vertices of the pilot (not this pass's own, which depends on its light paths).
    pub c: f32,
    /// Radius of merges in the first pass; 0 where nothing is merged.
    pub merge_radius: f32,
    /// Merges that are met by chance have this part of the area of others.
    pub by_chance: f32,
    /// Where many light vertices are merged at once.
    pub crowds: Arc<Crowds>,
    /// Reverse densities matter: both walkers take part in the weights.
    pub two_sided: bool,
    /// Hits and splats both make paths of length 1, each where it makes more of them.
    pub shares_lamps: bool,
    /// Splats take part in paths of length 2. Not where next events do: those see all such paths, often
    /// without any noise (delta lights), which no weight that ignores variance would honour.
    pub splat_direct: bool,
    /// Factor on splats from normalisation, 1/N.
    pub inv_light_paths: f32,
    /// Which pixels have more than one sample of chains.
    pub first_seen: Arc<FirstSeen>,
    /// Learned densities of emission.
    pub guide: Guide,
    /// Learned densities of gathering.
    pub incident: Option<Arc<Incident>>,
}

/// Longest path that is ever walked: roulette ends walks long before, except where it is off.
pub const LONGEST_PATH: u32 = 65_535;

impl Plan {
    /// Counts for a crop window of `pixels` pixels in a film of `film_pixels`, where a light path
    /// leaves `vertices_per_path` light vertices on average (from a pilot; only connections need it).
    pub fn new(settings: &Settings, pixels: u32, film_pixels: u32, vertices_per_path: f64) -> Self {
        let t = settings.techniques;
        let light_paths = if t.shoots() { settings.light_paths.unwrap_or(pixels).max(1) } else { 0 };
        let mean_vertices = vertices_per_path * f64::from(light_paths);
        let c = if t.connect && settings.connections > 0 && mean_vertices > 0.0 {
            (f64::from(settings.connections) * f64::from(light_paths) / mean_vertices) as f32
        } else {
            0.0
        };
        let n = if t.splat { light_paths as f32 } else { 0.0 };
        let normaliser = if planted(Mutant::SplatCropNormalisation) { film_pixels } else { light_paths };
        let mut settings = settings.clone();
        settings.max_length = settings.longest();
        Self {
            light_paths,
            n,
            c,
            merge_radius: if t.merge { settings.merge_radius.unwrap_or(0.0) } else { 0.0 },
            by_chance: 1.0,
            crowds: Arc::default(),
            first_seen: Arc::default(),
            two_sided: light_paths > 0 && t.gathers(),
            shares_lamps: t.splat && t.hit,
            splat_direct: t.splat && !t.next_event,
            inv_light_paths: if light_paths > 0 { 1.0 / normaliser as f32 } else { 0.0 },
            guide: Guide::default(),
            incident: None,
            settings,
        }
    }

    /// The random numbers of a walk of `family` (index, sample); its first `axes` axes are those of a point (sequence, number)
    /// where walks fill space evenly.
    #[inline]
    pub fn random(&self, family: Family, walk: (u64, u64), point: (u64, u64), axes: u32) -> Random {
        let seed = self.settings.seed;
        let random = Random::new(family, walk.0, walk.1, seed);
        if self.settings.stratified { random.with_point(family, point.0, point.1, seed, axes) } else { random }
    }

    /// N of the weights where a path meets the film.
    #[inline]
    pub fn n_at(&self, raster: Vec2) -> f32 {
        self.n / self.settings.samples.at_raster(raster) as f32
    }

    /// Learned densities of gathering.
    #[inline]
    pub fn incident(&self) -> Option<&Incident> {
        self.incident.as_deref()
    }

    /// Radius in which pass `pass` merges: its square falls with the cube root of the number of the pass,
    /// so that bias and variance of the mean both vanish [Knaus & Zwicker 2011, eq. 15].
    pub fn merge_radius(&self, pass: u64) -> f32 {
        self.merge_radius * ((pass + 1) as f32).powf(-1.0 / 6.0)
    }

    /// Samples of chains per pixel that needs more than one.
    pub fn chain_samples(&self) -> u32 {
        let s = &self.settings;
        if s.follows_chains() { s.chain_samples.max(1) } else { 1 }
    }

    /// Shooting walks leave vertices for gathering walks.
    pub fn keeps_vertices(&self) -> bool {
        self.c > 0.0 || self.merge_radius > 0.0
    }

    /// Whether a finished path counts.
    #[inline]
    pub fn wants_length(&self, length: u32) -> bool {
        length >= self.settings.min_length && length <= self.settings.max_length && !(length == 1 && self.settings.hide_emitters)
    }
}
