//! Estimators by the equation they expand, and what a scene asks of them.

use super::Partition;
use crate::scene::Scene;
use crate::transport::mis::Heuristic;
use crate::transport::settings::{Coupling, NO_SPLITS, Settings, Techniques};

/// Longest path of recursive ray tracing, unless somebody says.
const RECURSION: u32 = 16;
/// [`Settings::faintest_split`] of `auto`: three and ten times less make little difference.
const FAINTEST_SPLIT: f32 = 0.01;
/// [`Settings::survival`] of `auto`: on ten scenes up to a third less error than with 1, mostly for at most a tenth more time.
const SURVIVAL: f32 = 4.0;

/// How the measurement is estimated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Estimator {
    /// `⟨L, Wᵉ⟩`: path tracing [Kajiya 1986].
    Gather,
    /// `⟨Lᵉ, W⟩`: light tracing [Arvo 1986].
    Shoot,
    /// Both, weighted: bidirectional path tracing [Veach 1997].
    Bidirectional,
    /// Whatever joins and numbers of walks a pilot finds best for the scene, merges included.
    #[default]
    Auto,
    /// No coupling: lights alone, seen where nothing is between.
    Local,
    /// No coupling, no visibility.
    LocalUnshadowed,
    /// Ideal reflections and refractions followed [Whitted 1980].
    Recursive,
}

impl Estimator {
    /// All.
    pub const ALL: [Self; 7] =
        [Self::Gather, Self::Shoot, Self::Bidirectional, Self::Auto, Self::Local, Self::LocalUnshadowed, Self::Recursive];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gather => "gather",
            Self::Shoot => "shoot",
            Self::Bidirectional => "bidirectional",
            Self::Auto => "auto",
            Self::Local => "local",
            Self::LocalUnshadowed => "local-unshadowed",
            Self::Recursive => "recursive",
        }
    }

    /// By name.
    pub fn parse(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|e| e.name() == name)
    }

    /// What an integrator element of a scene file means by its name.
    pub fn of_integrator(name: &str) -> Self {
        match name {
            "ptracer" => Self::Shoot,
            "bdpt" => Self::Bidirectional,
            _ => Self::Gather,
        }
    }

    /// What it follows between surfaces.
    pub fn coupling(self) -> Coupling {
        match self {
            Self::Gather | Self::Shoot | Self::Bidirectional | Self::Auto => Coupling::All,
            Self::Recursive => Coupling::Specular,
            Self::Local => Coupling::None { shadows: true },
            Self::LocalUnshadowed => Coupling::None { shadows: false },
        }
    }

    /// Longest path where the scene does not say: recursion doubles its work with each edge.
    fn longest(self) -> u32 {
        match self.coupling() {
            Coupling::All => u32::MAX,
            Coupling::Specular => RECURSION,
            Coupling::None { .. } => 2,
        }
    }

    /// The joins it may use.
    pub fn techniques(self) -> Techniques {
        match self {
            Self::Gather | Self::Local | Self::LocalUnshadowed | Self::Recursive => Techniques::GATHER,
            Self::Shoot => Techniques::SHOOT,
            Self::Bidirectional => Techniques::BIDIRECTIONAL,
            Self::Auto => Techniques::ALL,
        }
    }
}

/// Everything a render is asked.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Transport.
    pub settings: Settings,
    /// Threads; `None` = as many as the machine has.
    pub threads: Option<usize>,
    /// Crop window (x, y, width, height) instead of the scene's own.
    pub crop: Option<[u32; 4]>,
    /// How to take the image apart, besides.
    pub layers: Vec<Partition>,
}

impl Options {
    /// What `estimator` does with the scene's own limits (`max_depth`, `rr_depth`, `hide_emitters`).
    pub fn for_scene(scene: &Scene, estimator: Estimator) -> Self {
        let i = &scene.integrator;
        let settings = Settings {
            techniques: estimator.techniques(),
            coupling: estimator.coupling(),
            max_length: i.max_depth.unwrap_or(u32::MAX).min(estimator.longest()),
            automatic: estimator == Estimator::Auto,
            heuristic: if estimator == Estimator::Auto { Heuristic::Balance } else { Heuristic::default() },
            rr_depth: i.rr_depth,
            survival: if estimator == Estimator::Auto { SURVIVAL } else { 1.0 },
            faintest_split: if estimator == Estimator::Auto { FAINTEST_SPLIT } else { NO_SPLITS },
            hide_emitters: i.hide_emitters,
            ..Settings::default()
        };
        Self { settings, ..Self::default() }
    }

    /// Hash of all that decides the value of a sample.
    pub(super) fn identity(&self, scene: &Scene) -> [u8; 32] {
        let s = &self.settings;
        let t = s.techniques;
        let mut h = blake3::Hasher::new();
        h.update(&scene.hash());
        h.update(&[t.hit, t.next_event, t.splat, t.connect, t.merge].map(u8::from));
        let switches =
            [s.heuristic == Heuristic::Power, s.hide_emitters, s.guided, s.guided_gathering, s.automatic, s.stratified];
        h.update(&switches.map(u8::from));
        h.update(format!("{:?}", s.coupling).as_bytes());
        for n in [s.min_length, s.max_length, s.rr_depth, s.connections] {
            h.update(&n.to_le_bytes());
        }
        h.update(&s.survival.to_le_bytes());
        h.update(&s.faintest_split.to_le_bytes());
        h.update(&s.faint.to_le_bytes());
        h.update(&s.chain_samples.to_le_bytes());
        h.update(&s.merge_radius.map_or(u32::MAX, f32::to_bits).to_le_bytes());
        h.update(&s.light_paths.map_or(u64::MAX, u64::from).to_le_bytes());
        h.update(&s.seed.to_le_bytes());
        h.update(s.paths.text().as_bytes());
        h.update(env!("CARGO_PKG_VERSION").as_bytes());
        h.finalize().into()
    }
}

/// About the mean radiance of the scene: its power spread over the sphere around it. Only the grid
/// of the film depends on it.
pub(super) fn radiance_scale(scene: &Scene) -> f32 {
    let power: f32 = scene.lights.infos().iter().map(|e| e.power.iter().sum::<f32>() / 3.0).sum();
    let radius = scene.lights.sphere().1;
    power / (4.0 * std::f32::consts::PI * std::f32::consts::PI * radius * radius)
}
