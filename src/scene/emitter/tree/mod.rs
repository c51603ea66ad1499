//! A tree over finite emitters: which of many lights is worth a next event at the point x.
//!
//! A walk from the root takes at every node one of four children with a probability proportional to
//! what it could bring to x ([`Node::weights`]), so that choosing among n emitters, and the probability
//! of a given one, cost O(log n) [Conty Estevez & Kulla 2018; Pharr 2023, sec. 12.6.3]. What differs:
//! - Only the place of x counts, not its normal: the joins of a measurement must agree on the
//!   density, and a light path that arrives at x knows no side on which x would be asked.
//! - Four children instead of two: half as many steps that wait for each other, and four bounds
//!   weigh little more than one in vector registers.
//! - Bounds are spheres and cones, in coordinates that are relative to the root.
//! - A child of emitters that shine the same way and are far, as seen from where they are, is not opened:
//!   one of them is drawn by intensity from a running sum. That spares half of the steps, those whose nodes
//!   are too many to stay in the cache.
//!
//! The probability of an emitter is zero only where none of its light can arrive, or where nothing
//! of any emitter in the same node can: there power decides, so that probabilities sum to one
//! everywhere. Occlusion is unknown here; whoever asks the tree should not ask it alone (`choice`).
//! Limits: close to a large node the bounds of its children say little; that costs variance, nothing else.

mod bound;
mod build;
mod node;

pub(super) use bound::Bound;
use glam::Vec3;
use node::{Child, Node};
use std::ops::Range;

/// Trees are never deeper: two bits per level in the trail of an emitter.
const MAX_LEVELS: u32 = 32;

/// Leads from the root to an emitter: two bits per level, those of the root lowest.
type Trail = u64;

/// A tree over emitters; without any it must not be asked.
#[derive(Clone, Debug, Default)]
pub(super) struct LightTree {
    /// The root first.
    nodes: Vec<Node>,
    /// By emitter; `None` for those that are not in the tree.
    trails: Vec<Option<Trail>>,
    /// By emitter: its rank in the order in which the leaves follow each other.
    ranks: Vec<u32>,
    /// By rank: the emitter, and the running sum of intensities before it, relative to all.
    order: Vec<u32>,
    sums: Vec<f64>,
    /// Centre of the root, and one over its radius.
    center: Vec3,
    scale: f32,
    /// Axial intensity of all emitters together, W·sr⁻¹.
    intensity: f32,
}

impl LightTree {
    /// An emitter for a next event at `x`, and the probability of its choice.
    #[inline]
    pub(super) fn sample(&self, x: Vec3, mut u: f32) -> (usize, f32) {
        let x = self.to_local(x);
        let (mut at, mut prob) = (0, 1.0);
        loop {
            let node = &self.nodes[at];
            let weights = node.weights(x);
            let (lane, rest) = weights.pick(u);
            (u, prob) = (rest, prob * weights.prob(lane));
            match node.child(lane) {
                Child::Emitter(i) => return (i, prob),
                Child::Node(_) if weights.is_far(lane) => {
                    let rank = self.pick(&node.ranks(lane), u);
                    return (self.order[rank] as usize, prob * self.share(rank, &node.ranks(lane)));
                }
                Child::Node(next) => at = next,
            }
        }
    }

    /// A rank of some by intensity.
    #[inline]
    fn pick(&self, ranks: &Range<usize>, u: f32) -> usize {
        let sums = &self.sums[ranks.start..=ranks.end];
        let at = sums[0] + f64::from(u) * (sums[ranks.len()] - sums[0]);
        ranks.start + sums.partition_point(|s| *s <= at).clamp(1, ranks.len()) - 1
    }

    /// Share of a rank in the intensity of some.
    #[inline]
    fn share(&self, rank: usize, of: &Range<usize>) -> f32 {
        ((self.sums[rank + 1] - self.sums[rank]) / (self.sums[of.end] - self.sums[of.start])) as f32
    }

    /// Probability with which [`Self::sample`] chooses the emitter, bit for bit; 0 for one that is
    /// not in the tree.
    #[inline]
    pub(super) fn prob(&self, emitter: usize, x: Vec3) -> f32 {
        let Some(&Some(mut trail)) = self.trails.get(emitter) else { return 0.0 };
        let x = self.to_local(x);
        let (mut at, mut prob) = (0, 1.0);
        loop {
            let node = &self.nodes[at];
            let lane = (trail & 3) as usize;
            trail >>= 2;
            let weights = node.weights(x);
            prob *= weights.prob(lane);
            match node.child(lane) {
                Child::Emitter(_) => return prob,
                Child::Node(_) if weights.is_far(lane) => {
                    return prob * self.share(self.ranks[emitter] as usize, &node.ranks(lane));
                }
                Child::Node(next) => at = next,
            }
        }
    }

    /// Irradiance at `x` of all emitters, W·m⁻², as the bounds of the root have it: toward the light, and
    /// with nothing in the way.
    #[inline]
    pub(super) fn irradiance(&self, x: Vec3) -> f32 {
        self.nodes[0].total(self.to_local(x)) * self.intensity * (self.scale * self.scale)
    }

    /// Is the emitter in the tree?
    #[inline]
    pub(super) fn contains(&self, emitter: usize) -> bool {
        self.trails.get(emitter).is_some_and(Option::is_some)
    }

    /// All emitters in at most so many groups, each the emitters of one node: from the root on, the heaviest
    /// node is opened while there is room. `weight` as of an emitter.
    pub(super) fn groups(&self, most: usize, weight: impl Fn(usize) -> f64) -> Vec<Vec<usize>> {
        if self.nodes.is_empty() {
            return vec![];
        }
        // Children come after their node.
        let mut sums = vec![0.0; self.nodes.len()];
        for at in (0..self.nodes.len()).rev() {
            let of = |child| match child {
                Child::Emitter(i) => weight(i),
                Child::Node(i) => sums[i],
            };
            sums[at] = self.nodes[at].children().map(of).sum();
        }
        let (mut nodes, mut groups) = (vec![0], vec![]);
        while let Some(k) = (0..nodes.len()).max_by(|a, b| sums[nodes[*a]].total_cmp(&sums[nodes[*b]])) {
            let node = &self.nodes[nodes[k]];
            if nodes.len() + groups.len() - 1 + node.children().count() > most {
                break;
            }
            nodes.swap_remove(k);
            for child in node.children() {
                match child {
                    Child::Emitter(i) => groups.push(vec![i]),
                    Child::Node(i) => nodes.push(i),
                }
            }
        }
        groups.extend(nodes.into_iter().map(|node| self.emitters_of(node)));
        groups
    }

    fn emitters_of(&self, node: usize) -> Vec<usize> {
        let (mut open, mut found) = (vec![node], vec![]);
        while let Some(node) = open.pop() {
            for child in self.nodes[node].children() {
                match child {
                    Child::Emitter(i) => found.push(i),
                    Child::Node(i) => open.push(i),
                }
            }
        }
        found
    }

    /// Memory held, in bytes.
    pub(super) fn bytes(&self) -> usize {
        let by_emitter = size_of_val(&self.trails[..]) + size_of_val(&self.ranks[..]);
        size_of_val(&self.nodes[..]) + by_emitter + size_of_val(&self.order[..]) + size_of_val(&self.sums[..])
    }

    #[inline]
    fn to_local(&self, x: Vec3) -> Vec3 {
        (x - self.center) * self.scale
    }
}
