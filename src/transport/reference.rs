//! The MIS weights the slow way: every density of a stored path is computed anew from the samplers'
//! own `density` functions, every join's density is the product of its definition.
//!
//! ```text
//! hit  G_{k−1} g_k    next event  G_{k−1} ν    connection  c G_i S_{i+1}    splat  N S_1    merge  η G_i S_i
//! ```
//!
//! with `G_i = g_1 … g_i` and `S_i = s_i … s_k`. In f64 and quadratic in the length: the recursion of
//! [`super::mis`] is tested against it. A [`Witness`] watches walks and rebuilds their paths.

use super::mis::{self, Eta};
use super::settings::Plan;
use super::vertex::{Scatter, Vertex};
use super::walk::{Context, Join, Observe};
use super::{Technique, cache::LightVertex};
use crate::local::Breadth;
use crate::scene::emitter::{Emission, EmitterPoint};
use crate::scene::{Scene, Surface};
use crate::spectrum::Spectrum;
use glam::Vec3;
use std::sync::Arc;

/// A Dirac event in the middle of a path.
#[derive(Clone, Copy, Debug)]
pub struct DiracEvent {
    /// Probability of the lobe for the gathering walker, given that it goes by the local model.
    pub prob_gather: f64,
    /// Probability of the lobe for the shooting walker.
    pub prob_shoot: f64,
    /// `(n² cosθ)` on the eye's side over that on the light's side.
    pub ratio: f64,
}

/// A scattering vertex of a stored path.
#[derive(Clone, Copy, Debug)]
pub struct PathVertex {
    /// The point.
    pub surface: Surface,
    /// How it scattered; `None` = not a Dirac event.
    pub dirac: Option<DiracEvent>,
}

impl PathVertex {
    /// How widely it scattered.
    pub fn breadth(&self, scene: &Scene) -> Breadth {
        if self.dirac.is_some() { Breadth::Sharp } else { scene.materials.breadth(self.surface.material) }
    }
}

/// A whole path, eye to light.
#[derive(Clone, Debug)]
pub struct Path {
    /// v_0.
    pub lens: Vec3,
    /// v_1 … v_{k−1}.
    pub vertices: Vec<PathVertex>,
    /// v_k.
    pub light: EmitterPoint,
    /// The light cannot be hit.
    pub light_delta: bool,
}

/// Densities of a path: `g[i]` and `s[i]` of vertex v_i, and the density ν of the next event.
#[derive(Clone, Debug)]
pub struct Densities {
    /// Gathering, index 1 … k (0 unused).
    pub g: Vec<f64>,
    /// Shooting, index 1 … k (0 unused).
    pub s: Vec<f64>,
    /// Next event at v_k.
    pub nu: f64,
    /// Which of v_1 … v_{k−1} are Dirac events (index as in `g`).
    pub delta: Vec<bool>,
    /// How widely each scatters.
    pub breadth: Vec<Breadth>,
    /// How many more light vertices than usual a merge at each finds at once.
    pub crowd: Vec<f64>,
}

/// A join and the number of vertices that shooting made.
pub type JoinKey = (Technique, usize);

impl Path {
    fn edges(&self) -> usize {
        self.vertices.len() + 1
    }

    fn direction_to_light(&self, scene: &Scene, x: Vec3) -> Vec3 {
        if scene.lights.is_infinite(self.light.emitter) { -self.light.n_g } else { (self.light.y - x).normalize() }
    }

    /// All densities, from the positions alone.
    pub fn densities(&self, cx: Context<'_>) -> Densities {
        let (scene, plan) = (cx.scene, cx.plan);
        let k = self.edges();
        let m = self.vertices.len();
        let no = vec![false; k + 1];
        let none = vec![0.0; k + 1];
        let mut d =
            Densities { g: none.clone(), s: none.clone(), nu: 0.0, delta: no, breadth: vec![Breadth::Wide; k + 1], crowd: none };
        let to_light = self.direction_to_light(scene, self.vertices[m - 1].surface.p);
        let first = self.vertices[0].surface;
        let w = (first.p - self.lens).normalize();
        // A parallel sensor looks along its one direction; the lens point lies exactly behind.
        let cos_1 = f64::from(w.dot(first.n_g).abs());
        d.g[1] = f64::from(scene.sensor.density(w)) * cos_1 * f64::from(scene.sensor.inv_d2(self.lens, first.p));
        for (i, v) in self.vertices.iter().enumerate() {
            let p = v.surface.p;
            let w_eye = if i == 0 { -w } else { (self.vertices[i - 1].surface.p - p).normalize() };
            let w_light = if i + 1 == m { to_light } else { (self.vertices[i + 1].surface.p - p).normalize() };
            let from_eye = Vertex::gathering(scene, plan.incident(), v.surface, w_eye);
            let (p_gather, p_shoot) = match v.dirac {
                Some(e) => (e.prob_gather * f64::from(from_eye.by_model()), e.prob_shoot * e.ratio),
                None => {
                    let from_light = Vertex::new(scene, v.surface, w_light);
                    (f64::from(from_eye.density(w_light)), f64::from(from_light.density(w_eye)))
                }
            };
            d.delta[i + 1] = v.dirac.is_some();
            d.crowd[i + 1] = f64::from(cx.crowd(p));
            d.breadth[i + 1] = v.breadth(scene);
            if i + 1 < m {
                d.g[i + 2] = p_gather * jacobian(p, &self.vertices[i + 1].surface);
            } else if !self.light_delta {
                d.g[k] = p_gather * self.light_jacobian(scene, p, to_light);
            }
            if i > 0 {
                d.s[i] = p_shoot * jacobian(p, &self.vertices[i - 1].surface);
            }
        }
        let last = self.vertices[m - 1].surface;
        let e = scene.lights.density_emission(&scene.geometry, &plan.guide, &self.light, -to_light, last.p);
        let infinite = scene.lights.is_infinite(self.light.emitter);
        let inv_d2 = if infinite { 1.0 } else { 1.0 / f64::from((self.light.y - last.p).length_squared()) };
        d.s[k] = f64::from(e.p_k);
        d.s[k - 1] = f64::from(e.p_next) * f64::from(to_light.dot(last.n_g).abs()) * inv_d2;
        if !d.delta[k - 1] && plan.settings.techniques.next_event {
            d.nu = f64::from(scene.lights.density_next_event(&scene.geometry, last.p, &self.light, to_light));
        }
        d
    }

    fn light_jacobian(&self, scene: &Scene, x: Vec3, to_light: Vec3) -> f64 {
        if scene.lights.is_infinite(self.light.emitter) {
            1.0
        } else {
            f64::from(self.light.n_g.dot(to_light).abs()) / f64::from((self.light.y - x).length_squared())
        }
    }

    /// Weight of every join that could have made this path (k ≥ 2).
    pub fn weights(&self, cx: Context<'_>) -> Vec<(JoinKey, f64)> {
        weights(&self.densities(cx), cx.plan, cx.eta.into())
    }
}

/// Solid angle at `from` to area at `to`.
fn jacobian(from: Vec3, to: &Surface) -> f64 {
    let d = to.p - from;
    f64::from((d.normalize()).dot(to.n_g).abs()) / f64::from(d.length_squared())
}

/// The density of every join: how many such paths it makes per sample and product of areas; `eta` as in [`Context`].
pub fn products(d: &Densities, plan: &Plan, eta: Eta<f64>) -> Vec<(JoinKey, f64)> {
    let k = d.g.len() - 1;
    let t = plan.settings.techniques;
    let gathered = |i: usize| d.g[1..=i].iter().product::<f64>();
    let shot = |i: usize| d.s[i..=k].iter().product::<f64>();
    let mut joins: Vec<(JoinKey, f64)> = Vec::new();
    if t.hit {
        joins.push(((Technique::Hit, 0), gathered(k)));
    }
    if t.next_event && !d.delta[k - 1] {
        joins.push(((Technique::NextEvent, 1), gathered(k - 1) * d.nu));
    }
    if plan.c > 0.0 {
        for i in 1..k.saturating_sub(1) {
            if !d.delta[i] && !d.delta[i + 1] {
                joins.push(((Technique::Connect, k - i), f64::from(plan.c) * gathered(i) * shot(i + 1)));
            }
        }
    }
    if plan.n > 0.0 && !d.delta[1] && (k > 2 || plan.splat_direct) {
        joins.push(((Technique::Splat, k), f64::from(plan.n) * shot(1)));
    }
    for (i, count) in (2..k - 1).map(|i| (i, merged_at(d, i, eta))).filter(|m| m.1 > 0.0) {
        joins.push(((Technique::Merge, k - i + 1), count * gathered(i) * shot(i)));
    }
    joins
}

/// Weights from the products of densities; `eta` as in [`Context`].
pub fn weights(d: &Densities, plan: &Plan, eta: Eta<f64>) -> Vec<(JoinKey, f64)> {
    let h = plan.settings.heuristic;
    let mut joins = products(d, plan, eta);
    let total: f64 = joins.iter().map(|j| h.raise(j.1)).sum();
    for j in &mut joins {
        j.1 = if total > 0.0 { h.raise(j.1) / total } else { 0.0 };
    }
    joins
}

/// What a merge at v_i counts for: 0 where there is none, since it is seen directly, is sharp itself, or lit by what is not narrow.
fn merged_at(d: &Densities, i: usize, eta: Eta<f64>) -> f64 {
    let possible = i > 1 && d.breadth[i] > Breadth::Sharp && d.breadth[i + 1].is_narrow();
    if possible { eta.count(d.is_clear(i), d.crowd[i]) } else { 0.0 }
}

impl Densities {
    /// All events between the eye and v_i are focused.
    pub fn is_clear(&self, i: usize) -> bool {
        self.breadth[1..i].iter().all(|b| b.is_focused())
    }
}

/// The same weights by the recursion of [`mis`], on numbers instead of walks.
pub fn weights_by_recursion(d: &Densities, plan: &Plan, eta: Eta<f64>) -> Vec<(JoinKey, f64)> {
    let k = d.g.len() - 1;
    let t = plan.settings.techniques;
    let h = plan.settings.heuristic;
    let n = if k > 2 || plan.splat_direct { f64::from(plan.n) } else { 0.0 };
    let c = f64::from(plan.c);
    let nu = if t.next_event && !d.delta[k - 1] { d.nu } else { 0.0 };
    let hit = if t.hit { d.g[k] } else { 0.0 };
    // Gathering sums K_i from the eye, shooting sums H_i from the light; the reverse density of a
    // vertex is the density with which the other walker makes its predecessor.
    let resolve = |partial: mis::Partial<f64>, i: usize, rev: f64| {
        if d.delta[i] { partial.at_delta(h, rev, 1.0) } else { partial.at(h, rev) }
    };
    let mut gather = vec![mis::Partial { a: 0.0, b: 0.0 }; k];
    let mut shoot = gather.clone();
    let mut sum = 0.0;
    for (i, arrived) in gather.iter_mut().enumerate().skip(1) {
        let count = if i == 1 {
            n
        } else if d.delta[i - 1] {
            0.0
        } else {
            c
        };
        *arrived = mis::Partial::arrive(h, count, d.g[i], 1.0, sum);
        if i > 2 {
            *arrived = arrived.and(mis::merge_before(h, h.raise(merged_at(d, i - 1, eta)), d.g[i], 1.0));
        }
        sum = resolve(*arrived, i, if i > 1 { d.s[i - 1] } else { 0.0 });
    }
    let e = d.s[k] * d.s[k - 1];
    sum = if hit > 0.0 { 1.0 / h.raise(d.s[k]) } else { 0.0 };
    for i in (1..k).rev() {
        let count = if i == k - 1 {
            nu / d.s[k]
        } else if d.delta[i + 1] {
            0.0
        } else {
            c
        };
        shoot[i] = mis::Partial::arrive(h, count, d.s[i], 1.0, sum);
        if i + 2 < k {
            shoot[i] = shoot[i].and(mis::merge_before(h, h.raise(merged_at(d, i + 1, eta)), d.s[i], 1.0));
        }
        sum = resolve(shoot[i], i, d.g[i + 1]);
    }
    let k_at = |i: usize| resolve(gather[i], i, if i > 1 { d.s[i - 1] } else { 0.0 });
    let h_at = |i: usize| resolve(shoot[i], i, if i + 1 < k { d.g[i + 1] } else { hit });
    let mut joins = Vec::new();
    if t.hit {
        joins.push(((Technique::Hit, 0), mis::hit(h, hit, nu, e, k_at(k - 1))));
    }
    if t.next_event && !d.delta[k - 1] {
        joins.push(((Technique::NextEvent, 1), mis::next_event(h, nu, hit, e, k_at(k - 1))));
    }
    if plan.c > 0.0 {
        for i in 1..k.saturating_sub(1) {
            if !d.delta[i] && !d.delta[i + 1] {
                let merged = |i: usize| h.raise(merged_at(d, i, eta));
                let (k_i, h_next) = (k_at(i) + merged(i), h_at(i + 1) + merged(i + 1));
                let w = mis::connect(h, c, d.s[i], k_i, d.g[i + 1], h_next);
                joins.push(((Technique::Connect, k - i), w));
            }
        }
    }
    if plan.n > 0.0 && !d.delta[1] && (k > 2 || plan.splat_direct) {
        joins.push(((Technique::Splat, k), mis::splat(h, n, d.g[1], h_at(1))));
    }
    for (i, count) in (2..k - 1).map(|i| (i, merged_at(d, i, eta))).filter(|m| m.1 > 0.0) {
        joins.push(((Technique::Merge, k - i + 1), mis::merge(h, count, k_at(i), h_at(i))));
    }
    joins
}

/// One weight as a walk computed it, with the path it belongs to.
#[derive(Clone, Debug)]
pub struct Testimony {
    /// The path.
    pub path: Path,
    /// The join that made it.
    pub key: JoinKey,
    /// The weight that the walk used.
    pub weight: f32,
    /// What the join added to the measurement.
    pub value: Spectrum,
}

/// A light subpath: vertices from the light end, the light point, whether that cannot be hit.
pub type Subpath = (Vec<PathVertex>, EmitterPoint, bool);

/// Watches walks and rebuilds the paths of length ≥ 2 that they finish.
#[derive(Debug, Default)]
pub struct Witness {
    /// What was seen.
    pub seen: Vec<Testimony>,
    /// Light subpaths of the cache's vertices, light end first.
    subpaths: Arc<Vec<Subpath>>,
    lens: Vec3,
    light: Option<(EmitterPoint, bool)>,
    vertices: Vec<PathVertex>,
    shooting: bool,
}

impl Witness {
    /// Watching a shooting walk next (or a gathering one).
    pub fn expect_shooting(&mut self, shooting: bool) {
        self.shooting = shooting;
    }

    /// Watches gathering walks that join these light subpaths, one for each vertex of the cache.
    pub fn with_subpaths(subpaths: Arc<Vec<Subpath>>) -> Self {
        Self { subpaths, ..Self::default() }
    }

    /// The light subpaths of the vertices that went into the cache.
    pub fn into_subpaths(self) -> Vec<Subpath> {
        Arc::unwrap_or_clone(self.subpaths)
    }

    /// Forgets the light vertices of the pass before.
    pub fn next_pass(&mut self) {
        self.subpaths = Arc::default();
    }

    /// The whole path of a join and the number of vertices that shooting made.
    fn whole(&self, join: &Join<'_>) -> Option<(Path, usize)> {
        let k = join.length as usize;
        let path = match join.technique {
            Technique::Hit | Technique::NextEvent => {
                let light = *join.light?;
                Path { lens: self.lens, vertices: self.vertices.clone(), light, light_delta: join.light_delta }
            }
            Technique::Connect | Technique::Merge => {
                let (sub, light, light_delta) = self.subpaths.get(join.light_vertex)?;
                let mut vertices = self.vertices.clone();
                // The merged vertex is in both.
                let merged = usize::from(join.technique == Technique::Merge);
                vertices.extend(sub.iter().rev().skip(merged).copied());
                Path { lens: self.lens, vertices, light: *light, light_delta: *light_delta }
            }
            Technique::Splat => {
                let (light, light_delta) = self.light?;
                let vertices = self.vertices.iter().rev().copied().collect();
                Path { lens: join.lens, vertices, light, light_delta }
            }
        };
        let s = match join.technique {
            Technique::Hit => 0,
            Technique::NextEvent => 1,
            Technique::Connect | Technique::Merge => self.subpaths.get(join.light_vertex)?.0.len() + 1,
            Technique::Splat => k,
        };
        Some((path, s))
    }
}

impl Observe for Witness {
    fn started(&mut self, from: Vec3, light: Option<&Emission>) {
        self.vertices.clear();
        self.lens = from;
        self.light = light.map(|e| (e.point, e.delta));
    }

    fn arrived(&mut self, surface: &Surface) {
        self.vertices.push(PathVertex { surface: *surface, dirac: None });
    }

    fn returned(&mut self, vertices: usize) {
        self.vertices.truncate(vertices);
    }

    fn cached(&mut self, _vertex: &LightVertex) {
        let (light, delta) = self.light.expect("only shooting walks fill the cache");
        Arc::make_mut(&mut self.subpaths).push((self.vertices.clone(), light, delta));
    }

    fn scattered(&mut self, s: &Scatter) {
        if let (true, Some(v)) = (s.delta, self.vertices.last_mut()) {
            let (p, rev, ratio) = (f64::from(s.p), f64::from(s.p_rev), f64::from(s.dirac_ratio));
            let by_model = f64::from(s.by_model);
            v.dirac = Some(if self.shooting {
                DiracEvent { prob_gather: rev / by_model, prob_shoot: p, ratio: 1.0 / ratio }
            } else {
                DiracEvent { prob_gather: p / by_model, prob_shoot: rev, ratio }
            });
        }
    }

    fn joined(&mut self, join: Join<'_>) {
        if join.length < 2 {
            return;
        }
        if let Some((path, s)) = self.whole(&join) {
            self.seen.push(Testimony { path, key: (join.technique, s), weight: join.weight, value: join.value });
        }
    }
}
