//! Four children of a node with what bounds their light, and what each could bring to a point.
//!
//! Of a child with centre c, radius r, normals within θ_o of an axis a, emission within θ_e of a normal
//! and axial intensity I, seen from x with D = |x − c|, θ = ∠(a, x − c), θ_b = asin(r/D):
//!
//! ```text
//! weight = I cosθ' / (D² + r²/10)    θ' = max(0, θ − θ_o − θ_b), 0 where θ' ≥ θ_e
//! ```
//!
//! θ' is the least angle at which any point of the child may emit toward x [Conty Estevez & Kulla 2018,
//! eq. 3]. Within the sphere it is 0 and θ_b has no meaning. That a node's emitters are about D away is
//! wrong for those that are near; r²/10 left the least variance of what was tried for a thousand scattered
//! lights (1/50 to 1, added or as a bound of D²), a flat optimum.

use glam::Vec3;

/// One number of each child.
pub(super) type Lanes = [f32; WIDE];

/// Children of a node.
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
    center: [Lanes; 3],
    radius: Lanes,
    axis: [Lanes; 3],
    /// Of θ_o; a cosine of −2 is below that of any direction.
    cos_normals: Lanes,
    sin_normals: Lanes,
    cos_spread: Lanes,
    /// I relative to that of all emitters; zero where there is no child.
    intensity: Lanes,
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

    /// Probabilities of the children at `x`, in the coordinates of the tree.
    #[inline]
    pub(super) fn probs(&self, x: Vec3) -> Lanes {
        let (weights, total) = self.weights(x);
        // Also no for NaN, and for what is too small to be divided by.
        if total > LEAST_TOTAL && total < f32::INFINITY {
            let inv = 1.0 / total;
            weights.map(|w| w * inv)
        } else {
            self.shares()
        }
    }

    /// What each child could bring to `x`, and the sum.
    #[inline]
    pub(super) fn weights(&self, x: Vec3) -> (Lanes, f32) {
        let weights: Lanes = std::array::from_fn(|i| self.weight(i, x));
        (weights, (weights[0] + weights[1]) + (weights[2] + weights[3]))
    }

    /// Probabilities where no light arrives, or so little that it has no number.
    #[cold]
    fn shares(&self) -> Lanes {
        let total: f32 = self.intensity.iter().sum();
        self.intensity.map(|i| i / total)
    }

    /// What the child could bring to `x`. Without branches, so that four are computed as one.
    #[inline(always)]
    fn weight(&self, i: usize, x: Vec3) -> f32 {
        let v = [x.x - self.center[0][i], x.y - self.center[1][i], x.z - self.center[2][i]];
        let d2 = larger(v[0] * v[0] + v[1] * v[1] + v[2] * v[2], LEAST_D2);
        let inv_d = 1.0 / d2.sqrt();
        let cos = (v[0] * self.axis[0][i] + v[1] * self.axis[1][i] + v[2] * self.axis[2][i]) * inv_d;
        let sin = larger(1.0 - cos * cos, 0.0).sqrt();
        let (cos_o, sin_o) = (self.cos_normals[i], self.sin_normals[i]);
        let outside = cos < cos_o;
        // θ − θ_o.
        let cos_1 = if outside { cos * cos_o + sin * sin_o } else { 1.0 };
        let sin_1 = if outside { sin * cos_o - cos * sin_o } else { 0.0 };
        let sin_b = self.radius[i] * inv_d;
        let seen = larger(1.0 - sin_b * sin_b, 0.0).sqrt();
        // From within the sphere every direction is possible.
        let cos_b = if sin_b < 1.0 { seen } else { -2.0 };
        let cos_2 = if cos_1 < cos_b { cos_1 * cos_b + sin_1 * sin_b } else { 1.0 };
        let facing = if cos_2 > self.cos_spread[i] { larger(cos_2, LEAST_COS) } else { 0.0 };
        facing * self.intensity[i] / (d2 + NEAR * self.radius[i] * self.radius[i])
    }
}

/// One instruction, where `max` must also order NaN; NaN becomes `b`.
#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
