//! The binary tree under the eight-wide one: top-down by the surface area heuristic, then improved.
//!
//! Splits minimise area·count of both sides over 16 bins along each axis [Wald 2007], a method whose
//! time is bounded whatever the boxes are (locally ordered clustering, otherwise as good, merges one
//! pair per pass where many boxes are nested or coincide). Reinsertion [Meister 2018] then moves
//! subtrees to where they cost least. Both are independent of the number of threads.

use super::ray::Aabb;
use glam::{Vec3, Vec3A};
use obvhs::bvh2::{Bvh2, node::Bvh2Node, reinsertion::ReinsertionOptimizer};

const BINS: usize = 16;
/// Share of the nodes that reinsertion tries to move in its first pass.
const REINSERTED: f32 = 0.1;
/// Number of passes.
const PASSES: usize = 16;
/// Nodes that a ray through the scene is expected to visit, from which on reinsertion is not tried:
/// where everything overlaps, its search finds nothing and looks at everything.
const HOPELESS: f64 = 2000.0;
/// From this depth on items are halved, so that no tree is deeper than this and log₂ n.
const HALVED_FROM: u32 = 60;
/// Subtrees of more items are built side by side.
const SEQUENTIAL: usize = 1 << 14;

/// A node of the binary tree.
pub(super) struct Binary {
    pub(super) bounds: Aabb,
    pub(super) kind: BinaryKind,
}

/// What is below a node.
#[derive(Clone, Copy)]
pub(super) enum BinaryKind {
    /// One item.
    Leaf(u32),
    /// Two nodes.
    Inner([u32; 2]),
}

/// An item's box, in coordinates where all boxes fill about [-1, 1]³.
#[derive(Clone, Copy)]
struct Item {
    min: Vec3A,
    max: Vec3A,
    index: u32,
}

impl Item {
    fn center(&self) -> Vec3A {
        self.min + self.max
    }
}

/// The tree over some boxes (at least one), children after their parents.
pub(super) fn tree(bounds: &[Aabb]) -> Vec<Binary> {
    let mut items = normalised(bounds);
    let mut rough = Vec::with_capacity(2 * items.len());
    grow(&mut items, 0, &mut rough);
    let improved = reinserted(&rough, &mut items);
    finish(improved, bounds)
}

/// The tree that halves the items again and again: of depth log₂ n whatever the boxes.
pub(super) fn halved(bounds: &[Aabb]) -> Vec<Binary> {
    let mut items = normalised(bounds);
    let mut out = Vec::with_capacity(2 * items.len());
    grow(&mut items, HALVED_FROM, &mut out);
    finish(out, bounds)
}

/// Boxes scaled so that no area overflows or vanishes.
fn normalised(bounds: &[Aabb]) -> Vec<Item> {
    let all = bounds.iter().fold(Aabb::EMPTY, |a, b| a.union(*b));
    let center = all.center();
    let extent = (all.max - center).max_element();
    let scale = if extent > f32::MIN_POSITIVE { 1.0 / extent } else { 1.0 };
    let unit = |p: Vec3| ((p - center) * scale).to_vec3a();
    let item = |(i, b): (usize, &Aabb)| Item { min: unit(b.min), max: unit(b.max), index: i as u32 };
    bounds.iter().enumerate().map(item).collect()
}

/// Appends the tree over `items` to `out`.
fn grow(items: &mut [Item], depth: u32, out: &mut Vec<BinaryKind>) -> u32 {
    let at = out.len() as u32;
    out.push(BinaryKind::Leaf(items[0].index));
    if items.len() == 1 {
        return at;
    }
    let middle = if depth >= HALVED_FROM { halve(items) } else { split(items) };
    let (left, right) = items.split_at_mut(middle);
    let children = if left.len().min(right.len()) > SEQUENTIAL {
        let apart = |half: &mut [Item]| {
            let mut own = Vec::with_capacity(2 * half.len());
            grow(half, depth + 1, &mut own);
            own
        };
        let (l, r) = rayon::join(|| apart(left), || apart(right));
        [append(out, l), append(out, r)]
    } else {
        [grow(left, depth + 1, out), grow(right, depth + 1, out)]
    };
    out[at as usize] = BinaryKind::Inner(children);
    at
}

fn append(out: &mut Vec<BinaryKind>, tree: Vec<BinaryKind>) -> u32 {
    let base = out.len() as u32;
    out.extend(tree.into_iter().map(|kind| match kind {
        BinaryKind::Leaf(item) => BinaryKind::Leaf(item),
        BinaryKind::Inner(children) => BinaryKind::Inner(children.map(|c| c + base)),
    }));
    base
}

/// Bounds of the items' centres (doubled, as [`Item::center`] has them).
fn centers(items: &[Item]) -> (Vec3A, Vec3A) {
    let start = (Vec3A::INFINITY, Vec3A::NEG_INFINITY);
    items.iter().fold(start, |(lo, hi), i| (lo.min(i.center()), hi.max(i.center())))
}

/// Orders the items along the widest axis about the one in the middle.
fn halve(items: &mut [Item]) -> usize {
    let (lo, hi) = centers(items);
    let axis = (hi - lo).max_position();
    let middle = items.len() / 2;
    let key = |i: &Item| i.center()[axis];
    items.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)).then(a.index.cmp(&b.index)));
    middle
}

#[derive(Clone, Copy)]
struct Bin {
    min: Vec3A,
    max: Vec3A,
    count: u32,
}

impl Bin {
    const EMPTY: Self = Self { min: Vec3A::INFINITY, max: Vec3A::NEG_INFINITY, count: 0 };

    fn join(&mut self, other: &Self) {
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
        self.count += other.count;
    }

    /// Half area times count.
    fn cost(&self) -> f32 {
        let d = self.max - self.min;
        if self.count == 0 { 0.0 } else { (d.x * (d.y + d.z) + d.y * d.z) * self.count as f32 }
    }
}

/// Orders the items into two sides of least cost and returns where the second begins.
fn split(items: &mut [Item]) -> usize {
    let (lo, hi) = centers(items);
    let scale = (hi - lo).map(|d| if d > 0.0 { BINS as f32 * (1.0 - 1e-6) / d } else { 0.0 });
    let bin = |i: &Item| (i.center() - lo) * scale;
    let mut bins = [[Bin::EMPTY; BINS]; 3];
    for item in items.iter() {
        let own = Bin { min: item.min, max: item.max, count: 1 };
        let at = bin(item);
        (0..3).for_each(|axis| bins[axis][(at[axis] as usize).min(BINS - 1)].join(&own));
    }
    let mut best = (f32::INFINITY, 0, 0);
    for (axis, bins) in bins.iter().enumerate() {
        let mut above = [0.0f32; BINS];
        let mut side = Bin::EMPTY;
        for k in (1..BINS).rev() {
            side.join(&bins[k]);
            above[k] = if side.count == 0 { f32::INFINITY } else { side.cost() };
        }
        let mut side = Bin::EMPTY;
        for k in 1..BINS {
            side.join(&bins[k - 1]);
            if side.count > 0 && side.cost() + above[k] < best.0 {
                best = (side.cost() + above[k], axis, k);
            }
        }
    }
    let (cost, axis, first_above) = best;
    if !cost.is_finite() {
        return halve(items);
    }
    let mut middle = 0;
    for i in 0..items.len() {
        if (bin(&items[i])[axis] as usize) < first_above {
            items.swap(i, middle);
            middle += 1;
        }
    }
    // Both sides have items by the bins; rounding cannot differ between the two passes.
    middle.clamp(1, items.len() - 1)
}

/// The same tree after reinsertion.
fn reinserted(tree: &[BinaryKind], items: &mut [Item]) -> Vec<BinaryKind> {
    items.sort_unstable_by_key(|i| i.index);
    // Level by level: pairs of siblings side by side, as the optimiser expects them.
    let mut flat = Bvh2 { primitive_indices: (0..items.len() as u32).collect(), ..Bvh2::default() };
    let mut level = vec![0u32];
    let blank = obvhs::aabb::Aabb::empty();
    flat.nodes.push(Bvh2Node::new(blank, 0, 0));
    let mut next = 0;
    while next < level.len() {
        match tree[level[next] as usize] {
            BinaryKind::Leaf(item) => {
                let i = &items[item as usize];
                flat.nodes[next] = Bvh2Node::new(obvhs::aabb::Aabb::new(i.min, i.max), 1, item);
            }
            BinaryKind::Inner(children) => {
                flat.nodes[next].first_index = level.len() as u32;
                level.extend(children);
                flat.nodes.extend([Bvh2Node::new(blank, 0, 0); 2]);
            }
        }
        next += 1;
    }
    for i in (0..flat.nodes.len()).rev() {
        if !flat.nodes[i].is_leaf() {
            let first = flat.nodes[i].first_index as usize;
            let both = flat.nodes[first].aabb().union(flat.nodes[first + 1].aabb());
            flat.nodes[i].set_aabb(both);
        }
    }
    let area = |n: &Bvh2Node| f64::from(n.aabb().half_area());
    let visited = flat.nodes.iter().map(area).sum::<f64>() / area(&flat.nodes[0]).max(f64::MIN_POSITIVE);
    if items.len() > 2 && visited < HOPELESS {
        improve(&mut flat);
    }
    unflatten(&flat)
}

/// Passes of reinsertion over the nodes with the largest boxes, fewer and fewer.
fn improve(flat: &mut Bvh2) {
    let mut optimizer = ReinsertionOptimizer::default();
    for pass in 0..PASSES {
        let share = REINSERTED / (2 * pass + 1) as f32;
        let count = ((flat.nodes.len() as f32 * share) as usize).clamp(1, flat.nodes.len() - 1);
        let area: Vec<f32> = flat.nodes.iter().map(|n| n.aabb().half_area()).collect();
        // The root cannot move.
        let mut nodes: Vec<u32> = (1..flat.nodes.len() as u32).collect();
        let larger = |a: &u32, b: &u32| area[*b as usize].total_cmp(&area[*a as usize]).then(a.cmp(b));
        if count < nodes.len() {
            nodes.select_nth_unstable_by(count, larger);
            nodes.truncate(count);
        }
        nodes.sort_unstable_by(larger);
        optimizer.run_with_candidates(flat, &nodes, 1);
    }
}

/// Back to nodes with children after their parents, boxes still empty.
fn unflatten(flat: &Bvh2) -> Vec<BinaryKind> {
    let mut out: Vec<BinaryKind> = Vec::with_capacity(flat.nodes.len());
    let mut waiting = vec![(0u32, None)];
    while let Some((i, parent)) = waiting.pop() {
        let node = &flat.nodes[i as usize];
        let at = out.len() as u32;
        if let Some((parent, side)) = parent
            && let BinaryKind::Inner(children) = &mut out[parent as usize]
        {
            children[side] = at;
        }
        if node.is_leaf() {
            out.push(BinaryKind::Leaf(flat.primitive_indices[node.first_index as usize]));
        } else {
            out.push(BinaryKind::Inner([0; 2]));
            waiting.extend([(node.first_index + 1, Some((at, 1usize))), (node.first_index, Some((at, 0)))]);
        }
    }
    out
}

/// Adds the boxes, from the leaves up.
fn finish(kinds: Vec<BinaryKind>, bounds: &[Aabb]) -> Vec<Binary> {
    let mut tree: Vec<Binary> = kinds.into_iter().map(|kind| Binary { bounds: Aabb::EMPTY, kind }).collect();
    for i in (0..tree.len()).rev() {
        tree[i].bounds = match tree[i].kind {
            BinaryKind::Leaf(item) => bounds[item as usize],
            BinaryKind::Inner([l, r]) => tree[l as usize].bounds.union(tree[r as usize].bounds),
        };
    }
    tree
}
