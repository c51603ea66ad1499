//! The tree of boxes: eight children per node, up to eight triangles per leaf.
//!
//! Nodes and triangles are stored lane by lane (structure of arrays), so that one instruction
//! handles one coordinate of eight children. One array of nodes holds the tree of the scene and the
//! trees of all groups; an instance is a leaf of the former and leads to a root of the latter.
//!
//! A child is one `u32`: an inner node's index, or `LEAF | kind | index`.

use super::analytic::Analytic;
use super::bake::Prim;
use super::instance::Instance;
use super::pages::Pages;
use super::ray::Aabb;

/// Set in the code of a child that is a leaf.
pub(super) const LEAF: u32 = 1 << 31;
/// Which kind of leaf.
pub(super) const KIND: u32 = 3 << 29;
/// A block of triangles.
pub(super) const TRIANGLES: u32 = 0;
/// One analytic shape.
pub(super) const ANALYTIC: u32 = 1 << 29;
/// One instance.
pub(super) const INSTANCE: u32 = 2 << 29;
/// Nothing: an unused child, or the root of an empty tree.
pub(super) const EMPTY: u32 = u32::MAX;
/// Largest index that fits a leaf's code.
pub(super) const MAX_INDEX: u32 = (1 << 29) - 1;

/// Children waiting during traversal; the builder keeps every tree's need within it.
pub(super) const STACK: usize = 256;

/// Boxes of eight children and where they lead.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// min x, max x, min y, max y, min z, max z of each child.
    pub(super) planes: [[f32; 8]; 6],
    /// Codes of the children.
    pub(super) child: [u32; 8],
    pad: [u32; 8],
}

impl Node {
    /// A node without children: inverted boxes, which no ray meets.
    pub(super) const EMPTY: Self = {
        let (lo, hi) = ([f32::INFINITY; 8], [f32::NEG_INFINITY; 8]);
        Self { planes: [lo, hi, lo, hi, lo, hi], child: [EMPTY; 8], pad: [0; 8] }
    };

    /// Sets child `k`, its box widened by the rounding that triangles of such coordinates undergo in
    /// traversal: 8 unit roundoffs, and two for this addition.
    pub(super) fn set(&mut self, k: usize, bounds: &Aabb, code: u32) {
        let slack = 5.0 * f32::EPSILON * bounds.min.abs().max(bounds.max.abs()).max_element();
        for axis in 0..3 {
            self.planes[2 * axis][k] = bounds.min[axis] - slack;
            self.planes[2 * axis + 1][k] = bounds.max[axis] + slack;
        }
        self.child[k] = code;
    }
}

/// Up to eight triangles; unused lanes repeat the last one.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Block {
    /// x, y, z of the first, second and third vertex.
    pub(super) vertices: [[f32; 8]; 9],
    /// Primitives.
    pub(super) prim: [u32; 8],
}

/// All trees and what their leaves hold.
#[derive(Default)]
pub(super) struct Tree {
    /// Inner nodes of all trees; a node's children come after it.
    pub(super) nodes: Pages<Node>,
    /// Triangles of all trees.
    pub(super) blocks: Pages<Block>,
    /// Analytic shapes and their primitives.
    pub(super) analytic: Vec<(Analytic, u32)>,
    /// Instances.
    pub(super) instances: Vec<Instance>,
    /// What the primitives are.
    pub(super) prims: Pages<Prim>,
    /// Code of the scene's root.
    pub(super) root: u32,
}
