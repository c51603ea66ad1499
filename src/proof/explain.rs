//! Why a pixel looks as it does: its strongest paths, and what every join thinks of them.
//!
//! The pixel is sampled as a render would, and whole paths are rebuilt as they are found
//! ([`crate::transport::reference`]). For each of the strongest the density of every join that could have made
//! it is computed anew from its definition; the weights that follow stand beside the one that the walk used. All
//! paths are summed up by class and join. The pixel's measurement by gathering, shooting, both, and both with merges
//! tells whether they agree.

use crate::film::Filter;
use crate::math::Random;
use crate::math::random::Family;
use crate::render::{Measurement, Options, PixelMeasurement, Render, RenderError, order};
use crate::scene::emitter::Emission;
use crate::scene::{Scene, Surface};
use crate::spectrum::Spectrum;
use crate::transport::cache::{LightCache, LightVertex};
use crate::transport::gather::gather;
use crate::transport::reference::{JoinKey, PathVertex, Testimony, Witness, products, weights};
use crate::transport::settings::Techniques;
use crate::transport::shoot::shoot;
use crate::transport::vertex::Scatter;
use crate::transport::walk::{Context, Join, Observe, Tally};
use crate::transport::{Contribution, RayCounts, Record, Technique};
use glam::{Vec2, Vec3};
use serde::Serialize;
use std::cell::Cell;
use std::collections::BTreeMap;
use std::fmt::Write;

/// How much to sample and to show.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Samples of the pixel, each with a thousand light paths.
    pub samples: u64,
    /// Paths to show.
    pub paths: usize,
}

/// A join as it is called on the command line, with the number s of vertices that shooting makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct Name {
    /// `hit`, `nee`, `connect`, `splat`, `merge`.
    pub technique: &'static str,
    /// s.
    pub light_vertices: usize,
}

impl Name {
    fn new(technique: Technique, light_vertices: usize) -> Self {
        Self { technique: technique.name(), light_vertices }
    }
}

/// All paths of a class that one join made.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Share {
    /// As `E D S L`.
    pub class: String,
    /// The join.
    pub by: Name,
    /// What they add to the pixel, mean of the channels.
    pub value: f64,
    /// The same over the pixel.
    pub share: f64,
    /// How many were found.
    pub found: u64,
}

/// A join that could have made a path.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Possible {
    /// The join.
    #[serde(flatten)]
    pub by: Name,
    /// Paths that it makes per sample and product of areas (m⁻² for each vertex that is chosen; see docs/theory.md).
    pub density: f64,
    /// Its share of the path by the heuristic.
    pub weight: f64,
}

/// A vertex of a path.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Event {
    /// Where, world.
    pub at: [f32; 3],
    /// Number of the shape.
    pub shape: u32,
    /// `S` for a Dirac event, else `D`.
    pub event: char,
}

/// A strong path.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Strong {
    /// As `E D S L`.
    pub class: String,
    /// The join that made it.
    pub by: Name,
    /// What it adds to the pixel, linear sRGB.
    pub value: [f32; 3],
    /// Share of the pixel.
    pub share: f64,
    /// The weight that the walk used.
    pub weight: f32,
    /// The point on the lens.
    pub eye: [f32; 3],
    /// v_1 … v_{k−1}.
    pub vertices: Vec<Event>,
    /// Number of the emitter.
    pub emitter: u32,
    /// The light point; for light from infinity the direction in which it travels.
    pub light: [f32; 3],
    /// Every join that could have made it.
    pub joins: Vec<Possible>,
}

/// What there is to say of a pixel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Explanation {
    /// Column and row in the whole film.
    pub pixel: [u32; 2],
    /// Samples that were searched for paths, and taken of each measurement.
    pub samples: u64,
    /// `⟨L, Wᵉ⟩`.
    pub gather: Measurement,
    /// `⟨Lᵉ, W⟩`.
    pub shoot: Measurement,
    /// Both, weighted.
    pub bidirectional: Measurement,
    /// Both, with merges where mirrors and glass hide the light from every other join.
    pub merging: Measurement,
    /// By class and join, strongest first.
    pub shares: Vec<Share>,
    /// Strongest first.
    pub paths: Vec<Strong>,
}

/// Explains pixel (x, y) of the whole film.
pub fn explain(scene: &Scene, options: &Options, (x, y): (u32, u32), effort: Effort) -> Result<Explanation, RenderError> {
    let samples = effort.samples.max(2);
    let mut options = options.clone();
    // Independent samples: the search and the measurement draw the same ones.
    options.settings.stratified = false;
    let measured = PixelMeasurement::new(scene, &options, (x, y), samples)?;
    options.crop = Some([x, y, 1, 1]);
    options.settings.techniques = Techniques::ALL;
    options.settings.light_paths.get_or_insert(1024);
    let render = Render::new(scene, &options)?;
    let filter = Filter::new(scene.film.filter).ok_or(RenderError::Filter)?;
    let mut found =
        Found { keep: effort.paths, strongest: Vec::new(), pass: 0, shares: BTreeMap::new(), samples: samples as f64 };
    for pass in 0..samples {
        found.pass = pass;
        search(Context::new(scene, render.plan(), pass), &filter, (x, y), pass, &mut found);
    }
    found.trim();
    let pixel = measured.merging.mean.iter().map(|v| f64::from(*v)).sum::<f64>() / 3.0;
    let per = |value: f64| if pixel > 0.0 { value / pixel } else { 0.0 };
    let of = |(value, t, pass): &(Spectrum, Testimony, u64)| {
        strong(Context::new(scene, render.plan(), *pass), *value * (1.0 / samples as f32), t, per)
    };
    let paths = found.strongest.iter().map(of).collect();
    let share =
        |((class, by), (value, found)): ((String, Name), (f64, u64))| Share { class, by, value, share: per(value), found };
    let mut shares: Vec<Share> = found.shares.into_iter().map(share).collect();
    shares.sort_by(|a, b| b.value.total_cmp(&a.value));
    let PixelMeasurement { gather, shoot, bidirectional, merging } = measured;
    Ok(Explanation { pixel: [x, y], samples, gather, shoot, bidirectional, merging, shares, paths })
}

/// One sample of the pixel with its light paths.
fn search(cx: Context<'_>, filter: &Filter, pixel: (u32, u32), pass: u64, found: &mut Found) {
    let (plan, film) = (cx.plan, &cx.scene.film);
    let seen = Cell::new(None);
    let mut rays = RayCounts::default();
    let mut record = InPixel { filter, pixel, seen: &seen };
    let mut watch = Watch { witness: Witness::default(), seen: &seen, found };
    watch.witness.expect_shooting(true);
    let mut tally = Tally { record: &mut record, rays: &mut rays, observe: &mut watch };
    let mut vertices: Vec<LightVertex> = Vec::new();
    for index in order(cx.scene, plan, pass) {
        let mut random = Random::new(Family::Shoot, u64::from(index), pass, plan.settings.seed);
        shoot(cx, plan.keeps_vertices().then_some(&mut vertices), &mut random, &mut tally);
    }
    tally.observe.witness.expect_shooting(false);
    let cache = LightCache::new(vec![vertices], plan.merge_radius(pass));
    let id = u64::from(pixel.1) * u64::from(film.width) + u64::from(pixel.0);
    let mut random = Random::new(Family::Gather, id, pass, plan.settings.seed);
    let (offset, weight) = filter.sample_offset(random.unit2());
    gather(cx, Vec2::new(pixel.0 as f32 + 0.5, pixel.1 as f32 + 0.5) + offset, weight, &cache, &mut random, &mut tally);
}

/// Tells whether a contribution belongs to the pixel, and the factor of its filter.
struct InPixel<'a> {
    filter: &'a Filter,
    pixel: (u32, u32),
    seen: &'a Cell<Option<f32>>,
}

impl Record for InPixel<'_> {
    fn gathered(&mut self, _: Contribution) {
        self.seen.set(Some(1.0));
    }
    fn splatted(&mut self, raster: Vec2, random: &mut Random, _: Contribution) {
        let at = self.filter.splat_pixel(raster, random.unit2());
        let here = |(x, y, _): &_| (i64::from(*x), i64::from(*y)) == (i64::from(self.pixel.0), i64::from(self.pixel.1));
        self.seen.set(at.filter(here).map(|(_, _, weight)| weight));
    }
}

/// Lets a witness see the walks, but only those joins that belong to the pixel.
struct Watch<'a> {
    witness: Witness,
    seen: &'a Cell<Option<f32>>,
    found: &'a mut Found,
}

impl Observe for Watch<'_> {
    fn started(&mut self, from: Vec3, light: Option<&Emission>) {
        self.witness.started(from, light);
    }
    fn arrived(&mut self, surface: &Surface) {
        self.witness.arrived(surface);
    }
    fn cached(&mut self, vertex: &LightVertex) {
        self.witness.cached(vertex);
    }
    fn scattered(&mut self, s: &Scatter) {
        self.witness.scattered(s);
    }
    fn returned(&mut self, vertices: usize) {
        self.witness.returned(vertices);
    }
    fn joined(&mut self, join: Join<'_>) {
        let Some(weight) = self.seen.take() else { return };
        let value = join.value * weight;
        if !value.is_finite() {
            return;
        }
        if join.length < 2 {
            let s = if join.technique == Technique::Splat { 1 } else { 0 };
            self.found.add("E L".into(), Name::new(join.technique, s), value);
            return;
        }
        self.witness.joined(join);
        while let Some(testimony) = self.witness.seen.pop() {
            self.found.path(value, testimony);
        }
    }
}

/// What was found so far.
struct Found {
    keep: usize,
    /// With the pass that found them, whose radius of merges its weights have.
    strongest: Vec<(Spectrum, Testimony, u64)>,
    pass: u64,
    shares: BTreeMap<(String, Name), (f64, u64)>,
    samples: f64,
}

impl Found {
    fn add(&mut self, class: String, by: Name, value: Spectrum) {
        let sum = self.shares.entry((class, by)).or_default();
        sum.0 += f64::from(value.mean()) / self.samples;
        sum.1 += 1;
    }

    fn path(&mut self, value: Spectrum, testimony: Testimony) {
        self.add(class(&testimony), Name::new(testimony.key.0, testimony.key.1), value);
        self.strongest.push((value, testimony, self.pass));
        if self.strongest.len() >= 2 * self.keep + 64 {
            self.trim();
        }
    }

    fn trim(&mut self) {
        self.strongest.sort_by(|a, b| b.0.mean().total_cmp(&a.0.mean()));
        self.strongest.truncate(self.keep);
    }
}

fn class(t: &Testimony) -> String {
    let events: String = t.path.vertices.iter().map(|v| if v.dirac.is_some() { " S" } else { " D" }).collect();
    format!("E{events} L")
}

fn strong(cx: Context<'_>, value: Spectrum, t: &Testimony, per: impl Fn(f64) -> f64) -> Strong {
    let (densities, eta) = (t.path.densities(cx), cx.eta.into());
    let joins = products(&densities, cx.plan, eta).into_iter().zip(weights(&densities, cx.plan, eta));
    let possible = |((key, density), (_, weight)): ((JoinKey, f64), (JoinKey, f64))| Possible {
        by: Name::new(key.0, key.1),
        density,
        weight,
    };
    let light = &t.path.light;
    let infinite = cx.scene.lights.is_infinite(light.emitter);
    let event = |v: &PathVertex| Event {
        at: v.surface.p.to_array(),
        shape: v.surface.shape,
        event: if v.dirac.is_some() { 'S' } else { 'D' },
    };
    Strong {
        class: class(t),
        by: Name::new(t.key.0, t.key.1),
        value: value.to_rgb(),
        share: per(f64::from(value.mean())),
        weight: t.weight,
        eye: t.path.lens.to_array(),
        vertices: t.path.vertices.iter().map(event).collect(),
        emitter: light.emitter.0,
        light: if infinite { light.n_g } else { light.y }.to_array(),
        joins: joins.map(possible).collect(),
    }
}

fn measurement(m: &Measurement) -> String {
    let [r, g, b] = m.mean;
    let [er, eg, eb] = m.standard_error;
    format!("{r:.5e} ± {er:.1e}   {g:.5e} ± {eg:.1e}   {b:.5e} ± {eb:.1e}")
}

impl Explanation {
    /// For people; `shape` and `emitter` name what has a name.
    pub fn to_text(&self, shape: impl Fn(u32) -> String, emitter: impl Fn(u32) -> String) -> String {
        let mut out = String::new();
        let [x, y] = self.pixel;
        let _ = writeln!(out, "pixel {x},{y}, {} samples each: red, green, blue ± standard error", self.samples);
        let measurements = [
            ("gather", &self.gather),
            ("shoot", &self.shoot),
            ("bidirectional", &self.bidirectional),
            ("with merges", &self.merging),
        ];
        for (name, m) in measurements {
            let _ = writeln!(out, "  {name:13} {}", measurement(m));
        }
        out.push_str("by class and join\n");
        for s in &self.shares {
            let _ = writeln!(
                out,
                "  {:16} {:7} s = {:<2}  {:6.2} %  {} found",
                s.class,
                s.by.technique,
                s.by.light_vertices,
                100.0 * s.share,
                s.found
            );
        }
        for (i, p) in self.paths.iter().enumerate() {
            let _ = writeln!(
                out,
                "path {}: {} by {} s = {}, {:.2} % of the pixel, weight {:.4}",
                i + 1,
                p.class,
                p.by.technique,
                p.by.light_vertices,
                100.0 * p.share,
                p.weight
            );
            let place = |at: &[f32; 3]| format!("({:.4}, {:.4}, {:.4})", at[0], at[1], at[2]);
            let _ = writeln!(out, "  E {}", place(&p.eye));
            for v in &p.vertices {
                let _ = writeln!(out, "  {} {} on {}", v.event, place(&v.at), shape(v.shape));
            }
            let _ = writeln!(out, "  L {} of {}", place(&p.light), emitter(p.emitter));
            for j in &p.joins {
                let Name { technique, light_vertices } = j.by;
                let _ =
                    writeln!(out, "    {technique:7} s = {light_vertices:<2}  density {:.3e}  weight {:.4}", j.density, j.weight);
            }
        }
        out
    }
}
