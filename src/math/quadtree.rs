//! A density on the unit square that is fine where much happens: learned from samples, sampled by a
//! continuous inverse.
//!
//! Leaves carry the second moment of what was found in them; the density that makes the variance of
//! an estimator `f/p` least is `p ∝ √E[f²]` leaf by leaf [Pharr 2023, sec. 2.2.2; Rath 2020]. A part
//! of the uniform density can be mixed in, since a leaf that is never sampled never learns; where all that matters is small,
//! a mean over the whole square is next to nothing there, and what helps is that nodes share with their neighbours (`SHARED`).
//! Descending the tree stretches `u` (no alias tables), which keeps the stratification of
//! low-discrepancy points.

use super::warp::ONE_MINUS_EPSILON;
use glam::Vec2;

/// Deepest leaf: 2⁻¹⁴ of the side.
const DEEPEST: u32 = 14;
/// A leaf of more than this share of the mass is split …
const SPLIT_SHARE: f64 = 0.002;
/// … if so many samples found something in it.
const SPLIT_COUNT: u32 = 32;
/// This part of the probability of the smallest nodes is shared evenly among their parts, of those one level higher half as
/// much, and so on: a leaf in which nothing was found by chance lies among others where much was.
const SHARED: f64 = 0.1;
/// Levels that a search skips by a table.
const SKIPPED: u32 = 6;
/// What remains of old lessons when a round of learning ends: they belong to coarser leaves and were
/// drawn with a worse density.
pub const MEMORY: f64 = 0.1;

/// Index in the tree's leaves, or in its nodes.
#[derive(Clone, Copy, Debug)]
enum Child {
    Node(u32),
    Leaf(u32),
}

#[derive(Clone, Copy, Debug)]
struct Node {
    /// Probability of each quarter (x + 2y) given the node.
    prob: [f32; 4],
    child: [Child; 4],
}

/// A part of a tree that is being rebuilt.
#[derive(Clone, Copy)]
struct Part {
    child: Child,
    prob: f64,
    /// Levels of nodes, without those that divide a leaf only now.
    height: u32,
}

#[derive(Clone, Copy, Debug, Default)]
struct Leaf {
    /// Σ f²/p over the samples in the leaf: N times the integral of f² over it.
    moment: f64,
    /// Samples that found something.
    count: u32,
}

/// A piecewise constant density on the unit square.
#[derive(Clone, Debug)]
pub struct Quadtree {
    nodes: Vec<Node>,
    leaves: Vec<Leaf>,
    /// Of every cell of a 2⁶ × 2⁶ grid (x + 64y): the smallest node or leaf around it, and its density.
    starts: Vec<(Child, f32)>,
}

impl Default for Quadtree {
    /// The uniform density on 8 × 8 leaves.
    fn default() -> Self {
        let mut tree = Self { nodes: vec![], leaves: vec![], starts: vec![] };
        tree.grow(3);
        tree.tabulate();
        tree
    }
}

impl Quadtree {
    /// A full subtree of `levels`; its index.
    fn grow(&mut self, levels: u32) -> Child {
        if levels == 0 {
            self.leaves.push(Leaf::default());
            return Child::Leaf(self.leaves.len() as u32 - 1);
        }
        let index = self.nodes.len();
        self.nodes.push(Node { prob: [0.25; 4], child: [Child::Leaf(0); 4] });
        for quarter in 0..4 {
            self.nodes[index].child[quarter] = self.grow(levels - 1);
        }
        Child::Node(index as u32)
    }

    /// Number of leaves.
    pub fn leaves(&self) -> usize {
        self.leaves.len()
    }

    /// Memory held, in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.leaves[..]) + size_of_val(&self.starts[..])
    }

    /// A point and its density per unit area.
    #[inline]
    pub fn sample(&self, mut u: Vec2) -> (Vec2, f32) {
        let (mut corner, mut side, mut p) = (Vec2::ZERO, 1.0f32, 1.0f32);
        let mut at = 0;
        loop {
            let node = &self.nodes[at];
            let [a, b, c, d] = node.prob;
            let (right, x) = halve(u.x, a + c);
            let (low, high) = if right { (b, d) } else { (a, c) };
            let (top, y) = halve(u.y, low / (low + high));
            u = Vec2::new(x, y);
            side *= 0.5;
            corner += Vec2::new(f32::from(u8::from(right)), f32::from(u8::from(top))) * side;
            let quarter = usize::from(right) + 2 * usize::from(top);
            p *= 4.0 * node.prob[quarter];
            match node.child[quarter] {
                Child::Node(next) => at = next as usize,
                Child::Leaf(_) => {
                    // Rounding must not move the point into the next leaf.
                    let end = corner + side;
                    return ((corner + u * side).min(Vec2::new(end.x.next_down(), end.y.next_down())), p);
                }
            }
        }
    }

    /// Density per unit area at a point of the square.
    #[inline]
    pub fn density(&self, at: Vec2) -> f32 {
        self.find(at).1
    }

    /// The leaf around a point, and the density there.
    #[inline]
    fn find(&self, at: Vec2) -> (u32, f32) {
        let at = at.clamp(Vec2::ZERO, Vec2::splat(ONE_MINUS_EPSILON)) * (1 << SKIPPED) as f32;
        let (x, y) = (at.x as u32, at.y as u32);
        let (start, mut p) = self.starts[(x + (y << SKIPPED)) as usize];
        let mut node = match start {
            Child::Leaf(leaf) => return (leaf, p),
            Child::Node(node) => &self.nodes[node as usize],
        };
        let mut rest = at - Vec2::new(x as f32, y as f32);
        loop {
            rest *= 2.0;
            let (right, top) = (rest.x >= 1.0, rest.y >= 1.0);
            rest -= Vec2::new(f32::from(u8::from(right)), f32::from(u8::from(top)));
            let quarter = usize::from(right) + 2 * usize::from(top);
            p *= 4.0 * node.prob[quarter];
            match node.child[quarter] {
                Child::Node(next) => node = &self.nodes[next as usize],
                Child::Leaf(leaf) => return (leaf, p),
            }
        }
    }

    /// Fills the table of starts.
    fn tabulate(&mut self) {
        let mut starts = vec![(Child::Node(0), 1.0); 1 << (2 * SKIPPED)];
        for (i, (child, p)) in starts.iter_mut().enumerate() {
            let (x, y) = (i & ((1 << SKIPPED) - 1), i >> SKIPPED);
            for level in (0..SKIPPED).rev() {
                let Child::Node(node) = *child else { break };
                let (node, quarter) = (&self.nodes[node as usize], (x >> level & 1) + 2 * (y >> level & 1));
                (*child, *p) = (node.child[quarter], *p * (4.0 * node.prob[quarter]));
            }
        }
        self.starts = starts;
    }

    /// Notes a sample at `at` that found something: `moment` is f²/p with the density p with which it
    /// was drawn.
    pub fn learn(&mut self, at: Vec2, moment: f64) {
        let (leaf, _) = self.find(at);
        let leaf = &mut self.leaves[leaf as usize];
        leaf.moment += moment;
        leaf.count += 1;
    }

    /// `∫ √(E[f²])` up to the common factor √N: how much this square matters beside others that learnt
    /// from the same number of samples.
    pub fn mass(&self) -> f64 {
        self.mass_below(Child::Node(0), 1.0)
    }

    /// √(mean of f²) times the area.
    fn mass_of(leaf: &Leaf, area: f64) -> f64 {
        (leaf.moment * area).sqrt()
    }

    fn mass_below(&self, child: Child, area: f64) -> f64 {
        match child {
            Child::Leaf(leaf) => Self::mass_of(&self.leaves[leaf as usize], area),
            Child::Node(node) => self.nodes[node as usize].child.iter().map(|c| self.mass_below(*c, area / 4.0)).sum(),
        }
    }

    /// Turns what was learnt into the density, `uniform` of it (0 to 1) uniform, and splits the leaves
    /// that hold much. Without anything learnt the density is uniform.
    #[must_use]
    pub fn refined(&self, uniform: f64) -> Self {
        let total = self.mass();
        let mut next = Self { nodes: vec![], leaves: vec![], starts: vec![] };
        if total > 0.0 && total.is_finite() {
            self.rebuild(&mut next, Child::Node(0), (1.0, 0), (total, uniform));
            next.tabulate();
            next
        } else {
            Self::default()
        }
    }

    /// Rebuilds `child` of this area and depth in `next`.
    fn rebuild(&self, next: &mut Self, child: Child, (area, depth): (f64, u32), mix: (f64, f64)) -> Part {
        let (total, uniform) = mix;
        let leaf = match child {
            Child::Node(node) => {
                let children = self.nodes[node as usize].child;
                return next.inner(|next, q| self.rebuild(next, children[q], (area / 4.0, depth + 1), mix));
            }
            Child::Leaf(leaf) => self.leaves[leaf as usize],
        };
        let share = Self::mass_of(&leaf, area) / total;
        let prob = (1.0 - uniform) * share + uniform * area;
        if share > SPLIT_SHARE && leaf.count >= SPLIT_COUNT && depth < DEEPEST {
            let quarter = Leaf { moment: MEMORY * leaf.moment / 4.0, count: 0 };
            return Part { height: 0, ..next.inner(|next, _| Part { child: next.leaf(quarter), prob: prob / 4.0, height: 0 }) };
        }
        Part { child: next.leaf(Leaf { moment: MEMORY * leaf.moment, count: 0 }), prob, height: 0 }
    }

    fn leaf(&mut self, leaf: Leaf) -> Child {
        self.leaves.push(leaf);
        Child::Leaf(self.leaves.len() as u32 - 1)
    }

    /// An inner node of four parts.
    fn inner(&mut self, mut part: impl FnMut(&mut Self, usize) -> Part) -> Part {
        let index = self.nodes.len();
        self.nodes.push(Node { prob: [0.25; 4], child: [Child::Leaf(0); 4] });
        let parts: [Part; 4] = std::array::from_fn(|quarter| part(self, quarter));
        let sum: f64 = parts.iter().map(|p| p.prob).sum();
        let height = parts.iter().map(|p| p.height).max().unwrap_or(0);
        let shared = SHARED * 0.5f64.powi(height as i32);
        let prob = |p: Part| ((1.0 - shared) * p.prob / sum + 0.25 * shared) as f32;
        let prob = if sum > 0.0 { parts.map(prob) } else { [0.25; 4] };
        self.nodes[index] = Node { prob, child: parts.map(|p| p.child) };
        Part { child: Child::Node(index as u32), prob: sum, height: height + 1 }
    }
}

/// Is `u` beyond the first part of probability `first`, and where in its own part?
#[inline]
fn halve(u: f32, first: f32) -> (bool, f32) {
    if u < first {
        (false, (u / first).min(ONE_MINUS_EPSILON))
    } else {
        (true, ((u - first) / (1.0 - first)).clamp(0.0, ONE_MINUS_EPSILON))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Random, random::Family};

    /// A ridge that is a hundredth of the square wide.
    fn ridge(p: Vec2) -> f64 {
        if (p.x - 0.3 - 0.2 * p.y).abs() < 0.005 { 1.0 } else { 0.0 }
    }

    fn learnt() -> Quadtree {
        let mut tree = Quadtree::default();
        let mut random = Random::new(Family::Other, 0, 0, 5);
        for round in 0..5 {
            for _ in 0..(8_000 << round) {
                let (at, p) = tree.sample(random.unit2());
                let f = ridge(at);
                if f > 0.0 {
                    tree.learn(at, f * f / f64::from(p));
                }
            }
            tree = tree.refined(0.1);
        }
        tree
    }

    #[test]
    fn density_is_that_of_the_samples_and_of_integral_one() {
        let tree = learnt();
        let mut random = Random::new(Family::Other, 1, 0, 5);
        let (n, mut inverse) = (200_000, 0.0);
        for _ in 0..n {
            let (at, p) = tree.sample(random.unit2());
            assert!((tree.density(at) / p - 1.0).abs() < 1e-4, "{at}");
            inverse += 1.0 / f64::from(p);
        }
        // E[1/p] is the area, 1, with a variance below that of the defensive part: 1/0.1.
        assert!((inverse / f64::from(n) - 1.0).abs() < 4.0 * (10.0 / f64::from(n)).sqrt(), "{}", inverse / f64::from(n));
    }

    #[test]
    fn samples_go_where_something_is() {
        let tree = learnt();
        let mut random = Random::new(Family::Other, 2, 0, 5);
        let hits = (0..10_000).filter(|_| ridge(tree.sample(random.unit2()).0) > 0.0).count();
        assert!(hits > 2_000, "{hits} of 10000 samples hit a ridge of a hundredth of the square");
    }

    #[test]
    fn a_gap_among_what_is_found_stays_open() {
        // A place as small as a pool seen from its sun, in which a corner has found nothing for some rounds.
        let (corner, side) = (Vec2::new(0.3125, 0.625), 0.015_625);
        let inside = |at: Vec2, from: Vec2, side: f32| (at - from).min_element() >= 0.0 && (at - from).max_element() < side;
        let gap = |at| inside(at, corner, side / 8.0);
        let mut tree = Quadtree::default();
        let mut random = Random::new(Family::Other, 3, 0, 5);
        for round in 0..14 {
            for _ in 0..20_000 {
                let at = corner + side * random.unit2();
                if round < 6 || !gap(at) {
                    tree.learn(at, 1.0 / f64::from(tree.density(at)));
                }
            }
            tree = tree.refined(0.0);
        }
        let mean = |from: Vec2, side: f32| {
            (0..256)
                .map(|i| f64::from(tree.density(from + side * (Vec2::new((i % 16) as f32, (i / 16) as f32) + 0.5) / 16.0)))
                .sum::<f64>()
                / 256.0
        };
        let (gap, all) = (mean(corner, side / 8.0), mean(corner, side));
        assert!(gap > 0.01 * all, "{gap} in the gap, {all} around it");
        // What is shared stays near: most of the density is still inside.
        let within = all * f64::from(side * side);
        assert!(within > 0.95, "{within}");
    }

    #[test]
    fn nothing_learnt_is_uniform() {
        let tree = Quadtree::default().refined(0.1);
        let (at, p) = tree.sample(Vec2::new(0.37, 0.81));
        assert!((at - Vec2::new(0.37, 0.81)).length() < 1e-6 && (p - 1.0).abs() < 1e-6);
    }
}
