//! Builds the tree from above: the part that costs most is split until a node has its four children.
//!
//! A split is a plane between buckets of centres, along the axis and at the place where the costs of
//! both sides are least; a box that is long in another direction pays for being split across a short
//! one [Conty Estevez & Kulla 2018]. Where all centres are one, and in a tree that grows too
//! deep, halves of equal number are taken instead. O(n log n).

use super::bound::Bound;
use super::node::{Child, Lane, Node, WIDE};
use super::{LightTree, MAX_LEVELS, Trail};
use crate::scene::geometry::Aabb;
use glam::Vec3;
use std::ops::Range;

const BUCKETS: usize = 12;
/// From this level on, parts are halved: 2³² emitters need 16 more.
const HALVED: u32 = MAX_LEVELS - 17;

/// Emitters shine the same way up to this angle.
const ALIKE: f64 = 0.1;

/// An emitter and its bounds.
pub(super) type Item = (usize, Bound);

/// A node that waits for its children: index, level, trail, first item and how many.
struct Open {
    node: usize,
    level: u32,
    trail: Trail,
    items: Range<usize>,
}

impl LightTree {
    /// Over some of `emitters` emitters.
    pub(in crate::scene::emitter) fn new(mut items: Vec<Item>, emitters: usize) -> Self {
        let mut tree = Self { trails: vec![None; emitters], ranks: vec![0; emitters], scale: 1.0, ..Self::default() };
        if items.is_empty() {
            return tree;
        }
        let root = around(&items);
        (tree.center, tree.intensity) = (root.center(), root.intensity as f32);
        if root.radius > 0.0 && (1.0 / root.radius).is_finite() {
            tree.scale = 1.0 / root.radius;
        }
        tree.nodes.push(Node::default());
        let mut open = vec![Open { node: 0, level: 0, trail: 0, items: 0..items.len() }];
        while let Some(next) = open.pop() {
            let first = next.items.start;
            let parts = parts(&mut items[next.items.clone()], next.level);
            for (lane, part) in parts.into_iter().enumerate() {
                let range = first + part.start..first + part.end;
                let trail = next.trail | (lane as Trail) << (2 * next.level);
                let child = if range.len() == 1 {
                    let emitter = items[range.start].0;
                    tree.trails[emitter] = Some(trail);
                    Child::Emitter(emitter)
                } else {
                    tree.nodes.push(Node::default());
                    let node = tree.nodes.len() - 1;
                    open.push(Open { node, level: next.level + 1, trail, items: range.clone() });
                    Child::Node(node)
                };
                let of_lane = tree.lane(&items[range.clone()], root.intensity, child, range);
                tree.nodes[next.node].set(lane, &of_lane);
            }
        }
        tree.sums.push(0.0);
        for (rank, (emitter, bound)) in items.iter().enumerate() {
            tree.ranks[*emitter] = rank as u32;
            tree.order.push(*emitter as u32);
            tree.sums.push(tree.sums[rank] + bound.intensity / root.intensity);
        }
        tree
    }

    fn lane(&self, items: &[Item], all: f64, child: Child, ranks: Range<usize>) -> Lane {
        let of = around(items);
        // No axis, no cone and no spread is far from those of all.
        let alike = |(_, b): &Item| b.normals > of.normals - ALIKE && b.spread > of.spread - ALIKE;
        Lane {
            ranks,
            alike: items.iter().all(alike),
            center: self.to_local(of.center()),
            radius: of.radius * self.scale,
            axis: of.axis.as_vec3(),
            normals: of.normals,
            spread: of.spread,
            intensity: (of.intensity / all) as f32,
            child,
        }
    }
}

/// Bounds of some emitters, at least one, with the smaller of the spheres around their box and around
/// their spheres.
fn around(items: &[Item]) -> Bound {
    let mut all = items[0].1;
    for (_, bound) in &items[1..] {
        all = all.union(bound);
    }
    if items.len() > 1 {
        let center = all.center();
        let reach = items.iter().map(|(_, b)| b.center().distance(center) + b.radius).fold(0.0, f32::max);
        all.radius = all.radius.min(reach * (1.0 + 1e-6));
    }
    all
}

/// Reorders the items into up to four parts, each in one piece.
fn parts(items: &mut [Item], level: u32) -> Vec<Range<usize>> {
    let mut parts = vec![(0..items.len(), f64::INFINITY)];
    while parts.len() < WIDE {
        let splittable = parts.iter().enumerate().filter(|(_, (range, _))| range.len() > 1);
        // In a deep tree the largest part, so that all end soon.
        let worth = |(range, cost): &(Range<usize>, f64)| if level < HALVED { *cost } else { range.len() as f64 };
        let Some((k, _)) = splittable.max_by(|a, b| worth(a.1).total_cmp(&worth(b.1))) else { break };
        let (range, _) = parts.swap_remove(k);
        let middle = range.start + split(&mut items[range.clone()], level);
        for side in [range.start..middle, middle..range.end] {
            let cost = around(&items[side.clone()]).cost();
            parts.push((side, cost));
        }
    }
    parts.into_iter().map(|(range, _)| range).collect()
}

/// Reorders at least two items into two sides, neither empty; how many are on the first.
fn split(items: &mut [Item], level: u32) -> usize {
    let half = items.len() / 2;
    let centers = Aabb::around(items.iter().map(|(_, b)| b.center()));
    let size = centers.max - centers.min;
    let Some((axis, plane)) = best_plane(items, &centers).filter(|_| level < HALVED) else {
        let axis = if size.x >= size.y.max(size.z) { 0 } else { 1 + usize::from(size.z > size.y) };
        items.select_nth_unstable_by(half, |a, b| a.1.center()[axis].total_cmp(&b.1.center()[axis]).then(a.0.cmp(&b.0)));
        return half;
    };
    // Stable, so that the tree is a function of the scene.
    items.sort_by_key(|(_, b)| bucket(b.center(), &centers, axis) > plane);
    items.partition_point(|(_, b)| bucket(b.center(), &centers, axis) <= plane)
}

fn bucket(center: Vec3, centers: &Aabb, axis: usize) -> usize {
    let along = (center[axis] - centers.min[axis]) / (centers.max[axis] - centers.min[axis]);
    ((along * BUCKETS as f32) as usize).min(BUCKETS - 1)
}

/// Axis and last bucket of the first side of the cheapest plane; `None` where centres do not differ.
fn best_plane(items: &[Item], centers: &Aabb) -> Option<(usize, usize)> {
    let size = centers.max - centers.min;
    let mut best: Option<(f64, (usize, usize))> = None;
    for axis in (0..3).filter(|axis| size[*axis] > 0.0 && size[*axis].is_finite()) {
        let mut buckets: [Option<Bound>; BUCKETS] = [None; BUCKETS];
        for (_, bound) in items {
            let b = &mut buckets[bucket(bound.center(), centers, axis)];
            *b = join(*b, Some(*bound));
        }
        let mut above = [None; BUCKETS];
        for plane in (0..BUCKETS - 1).rev() {
            above[plane] = join(above[plane + 1], buckets[plane + 1]);
        }
        let across = f64::from(size.max_element() / size[axis]);
        let mut below = None;
        for plane in 0..BUCKETS - 1 {
            below = join(below, buckets[plane]);
            if let (Some(a), Some(b)) = (below, above[plane]) {
                let cost = across * (a.cost() + b.cost());
                if best.is_none_or(|(least, _)| cost < least) {
                    best = Some((cost, (axis, plane)));
                }
            }
        }
    }
    best.map(|(_, plane)| plane)
}

fn join(a: Option<Bound>, b: Option<Bound>) -> Option<Bound> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.union(&b)),
        (a, b) => a.or(b),
    }
}
