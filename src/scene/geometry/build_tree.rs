//! From boxes to the eight-wide tree.
//!
//! The binary tree over the items ([`super::binary`]) is collapsed by dynamic programming to the
//! eight-wide tree of least expected cost [Ylitie 2017, sec. 3.1]: for each binary node the least cost
//! of its subtree as a leaf, as a wide node, or spread over up to seven children of the wide node
//! above.

use super::binary::{self, Binary, BinaryKind};
use super::ray::Aabb;
use super::tree::{ANALYTIC, Block, EMPTY, INSTANCE, LEAF, Node, STACK, TRIANGLES};
use glam::Vec3;

/// Cost of testing the eight boxes of a node, in arbitrary units.
const NODE_COST: f64 = 1.0;
/// Cost of testing a block of triangles.
const BLOCK_COST: f64 = 0.8;
/// Cost of an analytic shape.
const ANALYTIC_COST: f64 = 1.5;
/// Cost of entering an instance.
const INSTANCE_COST: f64 = 8.0;

/// What a tree is built over.
#[derive(Clone, Copy, Debug)]
pub(super) enum Item {
    /// A triangle: primitive and corners.
    Triangle(u32, [Vec3; 3]),
    /// An analytic shape: its index.
    Analytic(u32),
    /// An instance: its index.
    Instance(u32),
}

/// Nodes and blocks of all trees while they are being built.
#[derive(Default)]
pub(super) struct Growing {
    pub(super) nodes: Vec<Node>,
    pub(super) blocks: Vec<Block>,
}

impl Growing {
    /// Adds a tree over `items` and returns the code of its root.
    pub(super) fn add(&mut self, items: &[Item], bounds: &[Aabb]) -> u32 {
        if items.is_empty() {
            return EMPTY;
        }
        let (nodes, blocks) = (self.nodes.len(), self.blocks.len());
        let root = self.collapse(items, &binary::tree(bounds));
        // One place more for the child that is visited next, while its siblings are being sorted.
        if self.need(root) < STACK {
            return root;
        }
        // A very lopsided tree (geometric progressions, many coincident boxes): halve instead.
        self.nodes.truncate(nodes);
        self.blocks.truncate(blocks);
        self.collapse(items, &binary::halved(bounds))
    }

    /// Most children that can wait at once below `code`.
    pub(super) fn need(&self, code: u32) -> usize {
        if code & LEAF != 0 {
            return 0;
        }
        // Children are stored after their parents: one sweep from the end, relative to the root.
        let first = code as usize;
        let mut need = vec![0usize; self.nodes.len() - first];
        for i in (first..self.nodes.len()).rev() {
            let used = self.nodes[i].child.iter().filter(|c| **c != EMPTY);
            let below = used.clone().filter(|c| **c & LEAF == 0).map(|c| need[*c as usize - first]).max();
            need[i - first] = used.count() - 1 + below.unwrap_or(0);
        }
        need[0]
    }

    pub(super) fn collapse(&mut self, items: &[Item], binary: &[Binary]) -> u32 {
        let plan = Plan::new(items, binary);
        if plan.is_leaf(0) {
            return self.leaf(items, binary, 0);
        }
        let root = self.nodes.len() as u32;
        self.nodes.push(Node::EMPTY);
        let mut waiting = vec![(0u32, root)];
        let mut children = Vec::with_capacity(8);
        while let Some((at, wide)) = waiting.pop() {
            children.clear();
            plan.children(binary, at, &mut children);
            for (k, &child) in children.iter().enumerate() {
                let code = if plan.is_leaf(child) {
                    self.leaf(items, binary, child)
                } else {
                    self.nodes.push(Node::EMPTY);
                    let code = self.nodes.len() as u32 - 1;
                    waiting.push((child, code));
                    code
                };
                self.nodes[wide as usize].set(k, &binary[child as usize].bounds, code);
            }
        }
        root
    }

    fn leaf(&mut self, items: &[Item], binary: &[Binary], at: u32) -> u32 {
        let mut block = Block { vertices: [[0.0; 8]; 9], prim: [0; 8] };
        let mut used = 0;
        let mut waiting = vec![at];
        while let Some(i) = waiting.pop() {
            match binary[i as usize].kind {
                BinaryKind::Inner([l, r]) => waiting.extend([r, l]),
                BinaryKind::Leaf(item) => match items[item as usize] {
                    Item::Analytic(index) => return LEAF | ANALYTIC | index,
                    Item::Instance(index) => return LEAF | INSTANCE | index,
                    Item::Triangle(prim, corners) => {
                        // Unused lanes repeat the last triangle.
                        for lane in used..8 {
                            for (i, p) in corners.iter().enumerate() {
                                (0..3).for_each(|axis| block.vertices[3 * i + axis][lane] = p[axis]);
                            }
                            block.prim[lane] = prim;
                        }
                        used += 1;
                    }
                },
            }
        }
        self.blocks.push(block);
        LEAF | TRIANGLES | (self.blocks.len() as u32 - 1)
    }
}

/// For each binary node: least cost as at most k + 1 children of a wide node, and how.
struct Plan {
    choice: Vec<[Choice; 7]>,
    /// How a node that becomes wide shares eight children between left and right.
    split: Vec<u8>,
}

#[derive(Clone, Copy, PartialEq)]
enum Choice {
    /// One leaf.
    Leaf,
    /// One wide node.
    Wide,
    /// This many children for the left side, the rest for the right.
    Share(u8),
    /// Not all are used: as with one child less.
    Fewer,
}

impl Plan {
    fn new(items: &[Item], binary: &[Binary]) -> Self {
        let mut plan = Self { choice: vec![[Choice::Fewer; 7]; binary.len()], split: vec![0; binary.len()] };
        let mut cost = vec![[0.0f64; 7]; binary.len()];
        let mut triangles = vec![0u32; binary.len()];
        let unit = 1.0 / binary[0].bounds.half_area().max(f64::MIN_POSITIVE);
        // Children are stored after their parents.
        for i in (0..binary.len()).rev() {
            let area = binary[i].bounds.half_area() * unit;
            let [l, r] = match binary[i].kind {
                BinaryKind::Leaf(item) => {
                    let (count, each) = match items[item as usize] {
                        Item::Triangle(..) => (1, BLOCK_COST),
                        Item::Analytic(_) => (9, ANALYTIC_COST),
                        Item::Instance(_) => (9, INSTANCE_COST),
                    };
                    triangles[i] = count;
                    cost[i] = [area * each; 7];
                    plan.choice[i][0] = Choice::Leaf;
                    continue;
                }
                BinaryKind::Inner(children) => children.map(|c| c as usize),
            };
            // More than eight: no leaf, also where something is not a triangle.
            triangles[i] = (triangles[l] + triangles[r]).min(9);
            let share = |k: usize| {
                let costs = (1..k).map(|left| (cost[l][left.min(7) - 1] + cost[r][(k - left).min(7) - 1], left as u8));
                costs.fold((f64::INFINITY, 1), |best, c| if c.0 < best.0 { c } else { best })
            };
            let (below, split) = share(8);
            plan.split[i] = split;
            let wide = below + area * NODE_COST;
            let leaf = if triangles[i] <= 8 { area * BLOCK_COST } else { f64::INFINITY };
            let mut best = [leaf.min(wide); 7];
            plan.choice[i][0] = if leaf <= wide { Choice::Leaf } else { Choice::Wide };
            for k in 2..=7 {
                let (shared, left) = share(k);
                best[k - 1] = shared.min(best[k - 2]);
                if shared < best[k - 2] {
                    plan.choice[i][k - 1] = Choice::Share(left);
                }
            }
            cost[i] = best;
        }
        plan
    }

    fn is_leaf(&self, at: u32) -> bool {
        self.choice[at as usize][0] == Choice::Leaf
    }

    /// Binary nodes that are the children of wide node `at`.
    fn children(&self, binary: &[Binary], at: u32, out: &mut Vec<u32>) {
        let BinaryKind::Inner([l, r]) = binary[at as usize].kind else { return };
        let left = self.split[at as usize];
        self.spread(binary, l, left, out);
        self.spread(binary, r, 8 - left, out);
    }

    /// Binary nodes that stand for `at` where `k` children are allowed.
    fn spread(&self, binary: &[Binary], at: u32, k: u8, out: &mut Vec<u32>) {
        let mut k = k.min(7);
        while k > 1 && self.choice[at as usize][k as usize - 1] == Choice::Fewer {
            k -= 1;
        }
        match (self.choice[at as usize][k as usize - 1], &binary[at as usize].kind) {
            (Choice::Share(left), BinaryKind::Inner([l, r])) => {
                self.spread(binary, *l, left, out);
                self.spread(binary, *r, k - left, out);
            }
            _ => out.push(at),
        }
    }
}
