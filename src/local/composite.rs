//! Several weighted lobes at one point: f = Σ wₖ fₖ, p = Σ wₖ pₖ, lobe k chosen with probability wₖ.
//!
//! Trees of `mask` and `blendbsdf` are flattened into such a list when materials are built. Only the
//! weights are resolved with the point; the lobes themselves are resolved when they are asked, so
//! that a closure stays small and a sample pays for the lobe it needs.

use super::closure::{Closure, Model};
use super::{Equation, Evaluation, Sample};
use crate::math::warp::ONE_MINUS_EPSILON;
use crate::texture::{TextureSlot, Textures};
use glam::{Vec2, Vec3};

/// Most lobes that a material can have on one side.
pub const MAX_LOBES: usize = 8;

/// A share of a material: a constant times a product of textures or their complements.
#[derive(Clone, Debug)]
pub struct Part {
    scale: f32,
    factors: Vec<(TextureSlot, bool)>,
}

impl Part {
    /// All of it.
    pub(super) const WHOLE: Self = Self { scale: 1.0, factors: Vec::new() };

    /// Is it all of it?
    pub(super) fn is_whole(&self) -> bool {
        self.scale == 1.0 && self.factors.is_empty()
    }

    /// Multiplied by a texture in [0, 1], or by one minus it; `None` where that is zero everywhere.
    pub(super) fn times(&self, slot: TextureSlot, complement: bool) -> Option<Self> {
        let mut part = self.clone();
        if slot.is_constant() {
            part.scale *= factor(&Textures::default(), slot, complement, Vec2::ZERO);
        } else {
            part.factors.push((slot, complement));
        }
        (part.scale > 0.0).then_some(part)
    }

    #[inline]
    fn at(&self, textures: &Textures, uv: Vec2) -> f32 {
        self.factors.iter().fold(self.scale, |product, (slot, complement)| product * factor(textures, *slot, *complement, uv))
    }
}

#[inline]
fn factor(textures: &Textures, slot: TextureSlot, complement: bool, uv: Vec2) -> f32 {
    let x = textures.eval1(slot, uv).clamp(0.0, 1.0);
    if complement { 1.0 - x } else { x }
}

/// A model and its share.
#[derive(Clone, Debug)]
pub struct Entry {
    pub(super) model: Model,
    pub(super) part: Part,
    /// Has non-Dirac events.
    pub(super) smooth: bool,
}

/// Weighted lobes at a point.
#[derive(Clone, Copy, Debug)]
pub struct Composite<'a> {
    entries: &'a [Entry],
    textures: &'a Textures,
    uv: Vec2,
    weights: [f32; MAX_LOBES],
}

impl<'a> Composite<'a> {
    /// Of at most [`MAX_LOBES`] entries at `uv`.
    pub(super) fn new(entries: &'a [Entry], textures: &'a Textures, uv: Vec2) -> Self {
        let mut weights = [0.0; MAX_LOBES];
        for (weight, entry) in weights.iter_mut().zip(entries) {
            *weight = entry.part.at(textures, uv);
        }
        Self { entries, textures, uv, weights }
    }

    fn lobes(&self) -> impl Iterator<Item = (&'a Entry, f32)> {
        self.entries.iter().zip(self.weights).filter(|(_, weight)| *weight > 0.0)
    }

    fn resolve(&self, entry: &'a Entry) -> Closure<'a> {
        entry.model.resolve(self.textures, self.uv)
    }

    /// Sum of the non-Dirac lobes.
    #[inline(never)]
    pub fn evaluate(&self, equation: Equation, w_back: Vec3, w_next: Vec3) -> Evaluation {
        let mut sum = Evaluation::default();
        for (entry, weight) in self.lobes().filter(|(entry, _)| entry.smooth) {
            let e = self.resolve(entry).evaluate(equation, w_back, w_next);
            sum.f += e.f * weight;
            sum.p_w += e.p_w * weight;
            sum.p_w_rev += e.p_w_rev * weight;
        }
        sum
    }

    /// Density of the non-Dirac lobes.
    #[inline(never)]
    pub fn density(&self, w_back: Vec3, w_next: Vec3) -> f32 {
        let smooth = self.lobes().filter(|(entry, _)| entry.smooth);
        smooth.map(|(entry, weight)| weight * self.resolve(entry).density(w_back, w_next)).sum()
    }

    /// An event of a lobe chosen by its weight. What is left of the weights belongs to lobes that
    /// are black on this side.
    #[inline(never)]
    pub fn sample(&self, equation: Equation, w_back: Vec3, u_lobe: f32, u: Vec2) -> Option<Sample> {
        let mut rest = u_lobe;
        let (chosen, weight) = self.lobes().find(|(_, weight)| {
            let found = rest < *weight;
            if !found {
                rest -= weight;
            }
            found
        })?;
        let inside = (rest / weight).clamp(0.0, ONE_MINUS_EPSILON);
        let sample = self.resolve(chosen).sample(equation, w_back, inside, u)?;
        if sample.delta || self.lobes().filter(|(entry, _)| entry.smooth).count() == 1 {
            return Some(Sample { p: sample.p * weight, p_rev: sample.p_rev * weight, ..sample });
        }
        let e = self.evaluate(equation, w_back, sample.w_next);
        if !(e.p_w > 0.0 && e.p_w < f32::INFINITY) {
            return None;
        }
        Some(Sample { weight: e.f * (sample.w_next.z.abs() / e.p_w), p: e.p_w, p_rev: e.p_w_rev, ..sample })
    }

    /// Every Dirac event of every lobe.
    pub fn each_dirac(&self, equation: Equation, w_back: Vec3, mut f: impl FnMut(Sample)) {
        for (entry, weight) in self.lobes() {
            let closure = self.resolve(entry);
            closure.two_dirac(equation, w_back).for_each(|s| f(Sample { p: s.p * weight, p_rev: s.p_rev * weight, ..s }));
        }
    }

    /// No lobe has anything but Dirac events.
    pub fn is_delta(&self) -> bool {
        self.lobes().all(|(entry, _)| !entry.smooth)
    }

    /// Least of its lobes.
    pub fn roughness(&self) -> f32 {
        self.lobes().fold(1.0, |least, (entry, _)| self.resolve(entry).roughness().min(least))
    }
}
