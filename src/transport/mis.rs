//! Multiple importance sampling by a recursion of two numbers per walker.
//!
//! With g_i (s_i) the density with which the gathering (shooting) walker makes vertex v_i, the
//! balance-heuristic weight of a join is its density over the sum of the densities of all joins that
//! could have made the same path. Divided by the density of the join itself the sum splits into two
//! partial sums, one for each end,
//!
//! ```text
//! K_i = (c_i + s_{i−1} K_{i−1}) / g_i     gathering side,  K_1 = N / g_1
//! H_i = (c_i + g_{i+1} H_{i+1}) / s_i     shooting side,   H_{k−1} = (ν + g_k) / e
//! ```
//!
//! where c_i counts connections across the edge that led to v_i, N light paths per camera sample,
//! ν next events and e = s_k s_{k−1} the joint density of emission. s_{i−1} needs the direction in
//! which the path goes on from v_i, so a walker stores on arrival the two numbers of
//! `K_i = a + b·p_rev` with `a = c_i/g_i`, `b = J_{i−1} K_{i−1}/g_i`, J the factor from solid angle
//! to area at the predecessor. The same code serves both walkers. [Georgiev 2012], [van Antwerpen
//! 2011] need three numbers; one less suffices because a Dirac event carries its exact density ratio.
//!
//! A *merge* at v_i counts a shooting vertex within a radius r as the same vertex: its density is
//! η G_i S_i with η = Nπr², so 1 over its weight is 1 + (K_i + H_i)/η [Georgiev 2012; Hachisuka
//! 2012]. Merges are made only where v_{i+1} is a narrow event ([`Breadth`](crate::local::Breadth): a Dirac event, or of a material that is a mirror or
//! glass, polished or frosted), which next events are blind to or see by luck, not where v_i is as sharp as a mirror, and not at v_1, where splats
//! see it without blur; that is a property of the path, so weights remain a partition. Between two sides of frosted glass all other joins ask one
//! lobe for one direction; a merge asks it for the directions of all light paths around. The gathering walker learns at the event after v_i that the merge at v_i exists,
//! and adds its term there.
//!
//! Two vertices in a corner that light reaches by way of a caustic are badly joined by a connection, whose 1/d² nothing bounds;
//! a merge at the second is not. But a gathering walk that comes upon a caustic by chance merges all of it at once. By its density a merge would seem
//! the best of all joins there, though all that is merged shares the one chance [Grittmann 2021]: so it counts
//! for less where not all events between it and the eye are focused ([`Eta::count`]), the more so the more crowded the place
//! is ([`super::crowd`]). The shooting walker does not know that before the eye is reached, and carries the difference apart.
//!
//! The power heuristic (exponent 2) is the same recursion with every density and count squared.

use std::ops::{Add, Div, Mul};

/// Numbers the recursion runs on: f32 in the walks, f64 in the tests of its algebra.
pub trait Real: Copy + PartialOrd + Add<Output = Self> + Mul<Output = Self> + Div<Output = Self> {
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
}
impl Real for f32 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
}
impl Real for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
}

/// How densities become weights [Veach 1997, §9.2].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Heuristic {
    /// w ∝ p.
    Balance,
    /// w ∝ p².
    #[default]
    Power,
}

impl Heuristic {
    /// A density or count as it enters the sums.
    #[inline(always)]
    pub fn raise<R: Real>(self, x: R) -> R {
        match self {
            Self::Balance => x,
            Self::Power => x * x,
        }
    }
}

/// η = Nπr² of merges, whose radius is smaller where they are met by chance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eta<R> {
    /// Where all is focused between the eye and the merge.
    pub clear: R,
    /// Elsewhere.
    pub by_chance: R,
}

impl<R: Real> Eta<R> {
    /// What a merge counts for in the weights, where all is focused between the eye and it (`clear`), or where a gathering walk came by
    /// chance and finds `crowd` light vertices more than usual ([`super::crowd`]): so many and one are merged at once or not at all, and
    /// their variance is that of a single find.
    #[inline(always)]
    pub fn count(self, clear: bool, crowd: R) -> R {
        if clear { self.clear } else { self.by_chance / (R::ONE + crowd) }
    }
}

impl From<Eta<f32>> for Eta<f64> {
    fn from(eta: Eta<f32>) -> Self {
        Self { clear: eta.clear.into(), by_chance: eta.by_chance.into() }
    }
}

/// Partial sum of a subpath on arrival at a vertex: `a + b·raise(p_rev)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Partial<R> {
    /// What is known.
    pub a: R,
    /// Factor of the reverse density that is not known yet.
    pub b: R,
}

impl<R: Real> Partial<R> {
    /// Arrival at a vertex made with area density `p`; `count` joins could have made the edge that
    /// led here, `j` converts solid angle to area at the predecessor, whose own sum is `k_prev`.
    #[inline(always)]
    pub fn arrive(h: Heuristic, count: R, p: R, j: R, k_prev: R) -> Self {
        let inv_p = R::ONE / h.raise(p);
        Self { a: h.raise(count) * inv_p, b: h.raise(j) * k_prev * inv_p }
    }

    /// The sum once the density per steradian of sampling the direction to the predecessor is known.
    #[inline(always)]
    pub fn at(self, h: Heuristic, p_rev: R) -> R {
        self.a + self.b * h.raise(p_rev)
    }

    /// With so much more in `b`.
    #[inline(always)]
    pub fn and(self, b: R) -> Self {
        Self { a: self.a, b: self.b + b }
    }

    /// The sum after a Dirac event: no join can end there, and the reverse density is the
    /// probability of the lobe times the ratio of the Dirac functions.
    #[inline(always)]
    pub fn at_delta(self, h: Heuristic, prob_rev: R, dirac_ratio: R) -> R {
        self.b * h.raise(prob_rev * dirac_ratio)
    }
}

/// What [`Partial::b`] is more by where a merge adds `sum` to the sum of the vertex before (its raised count, if it is
/// there); `p` and `j` as in [`Partial::arrive`].
#[inline(always)]
pub fn merge_before<R: Real>(h: Heuristic, sum: R, p: R, j: R) -> R {
    sum * h.raise(j) / h.raise(p)
}

#[inline(always)]
fn share<R: Real>(own: R, others: R) -> R {
    if own > R::ZERO { own / (own + others) } else { R::ZERO }
}

/// Weight of a hit: `g` density of the light point by gathering, `nu` by next events, `e` joint
/// emission density, `k_prev` the gathering sum of the vertex before.
#[inline(always)]
pub fn hit<R: Real>(h: Heuristic, g: R, nu: R, e: R, k_prev: R) -> R {
    share(h.raise(g), h.raise(nu) + h.raise(e) * k_prev)
}

/// Weight of a next event; arguments as in [`hit`] with `k` the sum of the vertex it starts from.
#[inline(always)]
pub fn next_event<R: Real>(h: Heuristic, nu: R, g: R, e: R, k: R) -> R {
    share(h.raise(nu), h.raise(g) + h.raise(e) * k)
}

/// Weight of a splat: `n` light paths per camera sample, `g1` density of the vertex by the camera,
/// `sum` the shooting sum of the vertex.
#[inline(always)]
pub fn splat<R: Real>(h: Heuristic, n: R, g1: R, sum: R) -> R {
    share(h.raise(n), h.raise(g1) * sum)
}

/// Weight of a connection between a gathering vertex (sum `k`) and a shooting vertex (sum `l`);
/// `s` and `g` are the area densities with which shooting would make the former and gathering the
/// latter, `c` the number of connections per camera sample and light vertex.
#[inline(always)]
pub fn connect<R: Real>(h: Heuristic, c: R, s: R, k: R, g: R, l: R) -> R {
    share(h.raise(c), h.raise(s) * k + h.raise(g) * l)
}

/// Weight of a merge of the vertex of a gathering walk (sum `k`) with one of a shooting walk (sum `l`);
/// `count` is what it counts for.
#[inline(always)]
pub fn merge<R: Real>(h: Heuristic, count: R, k: R, l: R) -> R {
    share(h.raise(count), k + l)
}
