//! Four children of a node with what bounds their light, and what each could bring to a point.
//!
//! Of a child with centre c, radius r, normals within θ_o of an axis a, emission within θ_e of a normal
//! and axial intensity I, seen from x with D = |x − c|, θ = ∠(a, x − c), θ_b = asin(r/D):
//!
//! ```text
//! weight = I cosθ' / (D² + r²/10)    θ' = max(0, θ − θ_o − θ_b), 0 where θ' ≥ θ_e
//! ```
//!
//! θ' is the least angle at which any point of the child may emit toward x [Conty Estevez & Kulla
//! 2018]. Within the sphere it is 0 and θ_b has no meaning. That a node's emitters are about D away is
//! wrong for those that are near; r²/10 left the least variance of what was tried for a thousand scattered
//! lights (1/50 to 1, added or as a bound of D²), a flat optimum.

use crate::math::warp::ONE_MINUS_EPSILON;
use glam::{Vec3, Vec4};
use std::ops::Range;

/// Children of a node, one per lane of a vector register.
pub(super) const WIDE: usize = 4;

/// Emission counts as possible up to this angle beyond θ_e: rounded angles of narrow beams are off by
/// up to 5e-4.
const SLACK: f64 = 2e-3;
/// Least cosine of what may emit: where only rounding decides, it must not be zero.
const LEAST_COS: f32 = 1e-3;
/// Part of r² that is added to D².
const NEAR: f32 = 0.1;
/// Keeps x at the very place of a point light from dividing by zero; its square is still a number.
const LEAST_D2: f32 = 1e-18;
/// Sums of weights below this leave no digits, or no reciprocal.
const LEAST_TOTAL: f32 = 1e-30;
/// Added to radii: coordinates are of the order of one, and rounded.
const ROUNDING: f32 = 1e-6;
/// A child is far at so many of its radii: 1/d² of its emitters differs by an eighth from the mean at most.
const FAR: f32 = 16.0;
/// Marks a child that is an emitter.
const EMITTER: u32 = 1 << 31;

/// Four cache lines.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
pub(super) struct Node {
    center: [Vec4; 3],
    radius: Vec4,
    axis: [Vec4; 3],
    /// Of θ_o; a cosine of −2 is below that of any direction.
    cos_normals: Vec4,
    sin_normals: Vec4,
    cos_spread: Vec4,
    /// I relative to that of all emitters; zero where there is no child.
    intensity: Vec4,
    /// D² beyond which the child is not opened.
    far: Vec4,
    child: [u32; WIDE],
    /// Ranks of the child's emitters: the first, and how many.
    first: [u32; WIDE],
    count: [u32; WIDE],
}

/// What a lane leads to.
pub(super) enum Child {
    /// By its index.
    Emitter(usize),
    /// By its index.
    Node(usize),
}

/// A child's bounds in the coordinates of the tree.
pub(super) struct Lane {
    pub(super) center: Vec3,
    pub(super) radius: f32,
    pub(super) axis: Vec3,
    /// θ_o and θ_e, radians.
    pub(super) normals: f64,
    pub(super) spread: f64,
    pub(super) intensity: f32,
    pub(super) child: Child,
    pub(super) ranks: Range<usize>,
    /// Its emitters shine the same way.
    pub(super) alike: bool,
}

impl Node {
    pub(super) fn set(&mut self, lane: usize, of: &Lane) {
        let any = of.normals > std::f64::consts::PI - SLACK;
        for k in 0..3 {
            self.center[k][lane] = of.center[k];
            self.axis[k][lane] = of.axis[k];
        }
        self.radius[lane] = of.radius + ROUNDING * (1.0 + of.radius);
        self.cos_normals[lane] = if any { -2.0 } else { of.normals.cos() as f32 };
        self.sin_normals[lane] = if any { 0.0 } else { of.normals.sin() as f32 };
        self.cos_spread[lane] = (of.spread + SLACK).min(std::f64::consts::PI).cos() as f32;
        self.intensity[lane] = of.intensity.max(f32::MIN_POSITIVE);
        // Far from a point is anywhere else.
        self.far[lane] = if of.alike { (FAR * self.radius[lane]).powi(2) } else { f32::INFINITY };
        (self.first[lane], self.count[lane]) = (of.ranks.start as u32, of.ranks.len() as u32);
        self.child[lane] = match of.child {
            Child::Emitter(i) => i as u32 | EMITTER,
            Child::Node(i) => i as u32,
        };
    }

    #[inline]
    pub(super) fn child(&self, lane: usize) -> Child {
        let child = self.child[lane];
        let index = (child & !EMITTER) as usize;
        if child & EMITTER == 0 { Child::Node(index) } else { Child::Emitter(index) }
    }

    /// Those there are.
    pub(super) fn children(&self) -> impl Iterator<Item = Child> {
        (0..WIDE).filter(|lane| self.intensity[*lane] > 0.0).map(|lane| self.child(lane))
    }

    /// Ranks of the emitters of a child.
    #[inline]
    pub(super) fn ranks(&self, lane: usize) -> Range<usize> {
        let first = self.first[lane] as usize;
        first..first + self.count[lane] as usize
    }

    /// What each child could bring to `x`, in the coordinates of the tree.
    #[inline]
    pub(super) fn weights(&self, x: Vec3) -> Weights {
        let (each, far) = self.bounds_at(x);
        let weights = Weights::new(each, far);
        // Also no for NaN, and for what is too small to be divided by.
        if weights.total > LEAST_TOTAL && weights.total < f32::INFINITY { weights } else { self.shares(far) }
    }

    /// Weights where no light arrives, or so little that it has no number.
    #[cold]
    fn shares(&self, far: u32) -> Weights {
        Weights::new(self.intensity, far)
    }

    /// The sum of all weights at `x`, 0 or infinite where they have no number.
    #[inline]
    pub(super) fn total(&self, x: Vec3) -> f32 {
        larger(Weights::new(self.bounds_at(x).0, 0).total, 0.0)
    }

    /// The formula above times D⁴ in numerator and denominator: roots that do not wait for each other, one
    /// division, no branches, all four children at once. A walk down the tree is one chain of these. Also which
    /// children are far, as bits.
    #[inline]
    fn bounds_at(&self, x: Vec3) -> (Vec4, u32) {
        let v = [x.x, x.y, x.z].map(Vec4::splat);
        let v = [v[0] - self.center[0], v[1] - self.center[1], v[2] - self.center[2]];
        let r2 = self.radius * self.radius;
        let d2 = dot(v, v).max(Vec4::splat(LEAST_D2));
        let scale = self.intensity / (d2 * (d2 + r2 * NEAR));
        // D cosθ, D sinθ and D cosθ_b.
        let cos = dot(v, self.axis);
        let sin = (d2 - cos * cos).max(Vec4::ZERO).sqrt();
        let cos_b = (d2 - r2).max(Vec4::ZERO).sqrt();
        let d = d2.sqrt();
        // D times those of θ − θ_o.
        let outside = cos.cmplt(self.cos_normals * d);
        let cos_1 = Vec4::select(outside, cos * self.cos_normals + sin * self.sin_normals, d);
        let sin_1 = Vec4::select(outside, sin * self.cos_normals - cos * self.sin_normals, Vec4::ZERO);
        // From within the sphere every direction is possible.
        let beyond = cos_1.cmplt(cos_b) & r2.cmplt(d2);
        let cos_2 = Vec4::select(beyond, cos_1 * cos_b + sin_1 * self.radius, d2);
        let lit = cos_2.cmpgt(self.cos_spread * d2);
        (Vec4::select(lit, cos_2.max(d2 * LEAST_COS) * scale, Vec4::ZERO), d2.cmpgt(self.far).bitmask())
    }
}

/// Weights of four children.
pub(super) struct Weights {
    each: [f32; WIDE],
    /// Sum of those before.
    before: [f32; WIDE],
    total: f32,
    far: u32,
}

impl Weights {
    #[inline(always)]
    fn new(each: Vec4, far: u32) -> Self {
        let each = each.to_array();
        let two = each[0] + each[1];
        // Rounding keeps order: the total is not below the last of `before`.
        Self { each, before: [0.0, each[0], two, two + each[2]], total: two + (each[2] + each[3]), far }
    }

    /// Need the child not be opened?
    #[inline]
    pub(super) fn is_far(&self, lane: usize) -> bool {
        self.far >> lane & 1 == 1
    }

    /// Probability of a lane.
    #[inline]
    pub(super) fn prob(&self, lane: usize) -> f32 {
        self.each[lane] / self.total
    }

    /// A lane by its probability, and `u` stretched to [0, 1) inside it.
    #[inline]
    pub(super) fn pick(&self, u: f32) -> (usize, f32) {
        let at = u * self.total;
        let mut lane = self.before[1..].iter().filter(|before| at >= **before).count();
        while self.each[lane] <= 0.0 && lane > 0 {
            // Rounding has left a little beyond the last one.
            lane -= 1;
        }
        (lane, ((at - self.before[lane]) / self.each[lane]).clamp(0.0, ONE_MINUS_EPSILON))
    }
}

#[inline(always)]
fn dot(a: [Vec4; 3], b: [Vec4; 3]) -> Vec4 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// NaN becomes `b`.
#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
