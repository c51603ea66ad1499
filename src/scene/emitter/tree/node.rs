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

use glam::{Vec3, Vec4};

/// Children of a node, one per lane of a vector register.
pub(super) const WIDE: usize = 4;

/// Emission counts as possible up to this angle beyond θ_e: rounded angles of narrow beams are off by
/// up to 5e-4.
const SLACK: f64 = 2e-3;
/// Least cosine of what may emit: where only rounding decides, it must not be zero.
const LEAST_COS: f32 = 1e-3;
/// Part of r² that is added to D².
const NEAR: f32 = 0.1;
/// Keeps x at the very place of a point light from dividing by zero.
const LEAST_D2: f32 = 1e-30;
/// Sums of weights below this leave no digits, or no reciprocal.
const LEAST_TOTAL: f32 = 1e-30;
/// Added to radii: coordinates are of the order of one, and rounded.
const ROUNDING: f32 = 1e-6;
/// Marks a child that is an emitter.
const EMITTER: u32 = 1 << 31;

/// Three cache lines.
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
    child: [u32; WIDE],
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

    /// Probabilities of the children at `x`, in the coordinates of the tree.
    #[inline]
    pub(super) fn probs(&self, x: Vec3) -> [f32; WIDE] {
        let (weights, total) = self.weights(x);
        // Also no for NaN, and for what is too small to be divided by.
        if total > LEAST_TOTAL && total < f32::INFINITY { (weights / Vec4::splat(total)).to_array() } else { self.shares() }
    }

    /// Probabilities where no light arrives, or so little that it has no number.
    #[cold]
    fn shares(&self) -> [f32; WIDE] {
        (self.intensity / self.intensity.element_sum()).to_array()
    }

    /// What each child could bring to `x`, and the sum. Without branches, all four at once.
    #[inline]
    pub(super) fn weights(&self, x: Vec3) -> (Vec4, f32) {
        let v = [x.x, x.y, x.z].map(Vec4::splat);
        let v = [v[0] - self.center[0], v[1] - self.center[1], v[2] - self.center[2]];
        let d2 = dot(v, v).max(Vec4::splat(LEAST_D2));
        let inv_d = Vec4::ONE / d2.sqrt();
        let cos = dot(v, self.axis) * inv_d;
        let sin = (Vec4::ONE - cos * cos).max(Vec4::ZERO).sqrt();
        let (cos_o, sin_o) = (self.cos_normals, self.sin_normals);
        // θ − θ_o.
        let outside = cos.cmplt(cos_o);
        let cos_1 = Vec4::select(outside, cos * cos_o + sin * sin_o, Vec4::ONE);
        let sin_1 = Vec4::select(outside, sin * cos_o - cos * sin_o, Vec4::ZERO);
        let sin_b = self.radius * inv_d;
        let cos_b = (Vec4::ONE - sin_b * sin_b).max(Vec4::ZERO).sqrt();
        // From within the sphere every direction is possible.
        let beyond = cos_1.cmplt(cos_b) & sin_b.cmplt(Vec4::ONE);
        let cos_2 = Vec4::select(beyond, cos_1 * cos_b + sin_1 * sin_b, Vec4::ONE);
        let lit = cos_2.cmpgt(self.cos_spread);
        let facing = Vec4::select(lit, cos_2.max(Vec4::splat(LEAST_COS)), Vec4::ZERO);
        let weights = facing * self.intensity / (d2 + self.radius * self.radius * NEAR);
        (weights, weights.element_sum())
    }
}

#[inline(always)]
fn dot(a: [Vec4; 3], b: [Vec4; 3]) -> Vec4 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
