//! The elements of a scene: every piece of surface as a tree of cells, every leaf with one element
//! for each of its sides that reflects or emits.
//!
//! A hit finds its element by the number of its primitive and by descending with its own parameters;
//! no search, no second geometry.

use super::ElementsError;
use super::cell::Cell;
use crate::local::Lobes;
use crate::math::{Frame, warp};
use crate::scene::geometry::{Hit, Piece, Pieces, Ray, offset_origin};
use crate::scene::{EmitterId, Scene, Surface};
use glam::Vec2;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// No element: what neither reflects nor emits, or nothing at all.
pub const VOID: u32 = u32::MAX;

/// A leaf of the tree of a piece.
#[derive(Clone, Copy, Debug)]
struct Leaf {
    piece: u32,
    cell: Cell,
    /// m².
    area: f64,
    /// Elements in front and behind, or [`VOID`].
    sides: [u32; 2],
}

/// One side of one leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Element {
    leaf: u32,
    front: bool,
}

/// The finite elements of a scene.
pub struct Elements {
    pieces: Pieces,
    /// Which sides of a piece have elements: front, behind.
    live: Vec<[bool; 2]>,
    /// Root of every piece. A node is either a leaf (`LEAF` and its number) or the first of four.
    roots: Vec<u32>,
    nodes: Vec<u32>,
    leaves: Vec<Leaf>,
    /// Node of every leaf.
    homes: Vec<u32>,
    elements: Vec<Element>,
}

const LEAF: u32 = 1 << 31;
const MOST: usize = 1 << 28;

/// Orders leaves by what is to be split first.
struct Candidate {
    rank: f64,
    leaf: u32,
}
impl PartialEq for Candidate {
    fn eq(&self, o: &Self) -> bool {
        self.cmp(o) == Ordering::Equal
    }
}
impl Eq for Candidate {}
impl PartialOrd for Candidate {
    fn partial_cmp(&self, o: &Self) -> Option<Ordering> {
        Some(self.cmp(o))
    }
}
impl Ord for Candidate {
    fn cmp(&self, o: &Self) -> Ordering {
        self.rank.total_cmp(&o.rank).then(o.leaf.cmp(&self.leaf))
    }
}

impl Elements {
    /// One leaf per piece, the largest split until another split would give more than `target`
    /// elements: areas then differ by a factor of four at most where pieces are not smaller anyway.
    pub fn new(scene: &Scene, target: usize) -> Result<Self, ElementsError> {
        let mut mesh = Self::coarsest(scene)?;
        mesh.split_largest(target.min(MOST));
        mesh.number()?;
        Ok(mesh)
    }

    fn coarsest(scene: &Scene) -> Result<Self, ElementsError> {
        let pieces = scene.geometry.pieces();
        let diffuse = Lobes { diffuse: true, ..Lobes::default() };
        if let Some(p) = pieces.list.iter().find(|p| scene.materials.lobes(p.material).union(diffuse) != diffuse) {
            return Err(ElementsError::NotDiffuse(p.material.0));
        }
        if let Some(p) = pieces.list.iter().find(|p| !p.even) {
            return Err(ElementsError::Stretched(p.shape));
        }
        if pieces.list.len() > MOST / 2 {
            return Err(ElementsError::TooMany(pieces.list.len()));
        }
        let live: Vec<[bool; 2]> = pieces.list.iter().map(|p| sides(scene, p)).collect();
        let leaf =
            |(i, p): (usize, &Piece)| Leaf { piece: i as u32, cell: Cell::whole(p.triangle), area: p.area, sides: [VOID; 2] };
        let leaves: Vec<Leaf> = pieces.list.iter().enumerate().map(leaf).collect();
        let roots: Vec<u32> = (0..leaves.len() as u32).collect();
        let nodes = roots.iter().map(|i| LEAF | i).collect();
        Ok(Self { live, homes: roots.clone(), roots, nodes, leaves, elements: vec![], pieces })
    }

    /// Elements of a leaf.
    fn count_of(&self, leaf: u32) -> usize {
        self.live[self.leaves[leaf as usize].piece as usize].iter().filter(|l| **l).count()
    }

    fn split_largest(&mut self, target: usize) {
        let mut count: usize = (0..self.leaves.len() as u32).map(|l| self.count_of(l)).sum();
        let candidate = |mesh: &Self, leaf: u32| Candidate { rank: mesh.leaves[leaf as usize].area, leaf };
        let live: Vec<u32> = (0..self.leaves.len() as u32).filter(|l| self.count_of(*l) > 0).collect();
        let mut heap: BinaryHeap<Candidate> = live.into_iter().map(|l| candidate(self, l)).collect();
        while let Some(next) = heap.pop() {
            let more = 3 * self.count_of(next.leaf);
            if count + more > target {
                break;
            }
            count += more;
            heap.extend(self.split(next.leaf).map(|l| candidate(self, l)));
        }
    }

    /// Splits the leaves with the most to gain until there are `target` elements or no gains are left;
    /// `gains` has one number per element. A quarter of a leaf is expected to gain a sixteenth of it, as
    /// the mean square of a linear function times area does. Elements are numbered anew.
    pub fn refine(&mut self, gains: &[f64], target: usize) -> Result<(), ElementsError> {
        let mut count = self.elements.len();
        let gain = |l: &Leaf| l.sides.iter().filter_map(|s| gains.get(*s as usize)).sum::<f64>();
        let all = self.leaves.iter().enumerate().map(|(i, l)| Candidate { rank: gain(l), leaf: i as u32 });
        let mut heap: BinaryHeap<Candidate> = all.filter(|c| c.rank > 0.0).collect();
        while let Some(next) = heap.pop() {
            let more = 3 * self.count_of(next.leaf);
            if count + more > target.min(MOST) {
                break;
            }
            count += more;
            heap.extend(self.split(next.leaf).map(|leaf| Candidate { rank: next.rank / 16.0, leaf }));
        }
        self.number()
    }

    /// Splits a leaf into four; the first keeps its number.
    fn split(&mut self, leaf: u32) -> [u32; 4] {
        let old = self.leaves[leaf as usize];
        let first = self.nodes.len() as u32;
        self.nodes[self.homes[leaf as usize] as usize] = first;
        let next = self.leaves.len() as u32;
        let numbers = [leaf, next, next + 1, next + 2];
        for ((k, number), cell) in (0..).zip(numbers).zip(old.cell.parts()) {
            let part = Leaf { cell, area: 0.25 * old.area, ..old };
            self.nodes.push(LEAF | number);
            if number == leaf {
                self.leaves[leaf as usize] = part;
                self.homes[leaf as usize] = first + k;
            } else {
                self.leaves.push(part);
                self.homes.push(first + k);
            }
        }
        numbers
    }

    /// Numbers the elements, leaf by leaf in the order of the pieces.
    fn number(&mut self) -> Result<(), ElementsError> {
        self.elements.clear();
        let mut order: Vec<u32> = (0..self.leaves.len() as u32).collect();
        order.sort_by_key(|l| (self.leaves[*l as usize].piece, *l));
        for l in order {
            let leaf = &mut self.leaves[l as usize];
            for (k, front) in [true, false].into_iter().enumerate() {
                let lives = self.live[leaf.piece as usize][k] && leaf.area > 0.0;
                leaf.sides[k] = if lives { self.elements.len() as u32 } else { VOID };
                if lives {
                    self.elements.push(Element { leaf: l, front });
                }
            }
        }
        match self.elements.len() {
            0 => Err(ElementsError::Empty),
            n if n > MOST => Err(ElementsError::TooMany(n)),
            _ => Ok(()),
        }
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        self.elements.len()
    }

    /// Never: a scene without elements is an error.
    pub fn is_empty(&self) -> bool {
        self.elements.is_empty()
    }

    fn leaf(&self, element: usize) -> &Leaf {
        &self.leaves[self.elements[element].leaf as usize]
    }

    fn piece(&self, element: usize) -> &Piece {
        &self.pieces.list[self.leaf(element).piece as usize]
    }

    /// Area of an element, m².
    pub fn area(&self, element: usize) -> f64 {
        self.leaf(element).area
    }

    /// Shape of an element, as the geometry counts them.
    pub fn shape(&self, element: usize) -> u32 {
        self.piece(element).shape
    }

    /// The element lies on the side of the normal.
    pub fn is_front(&self, element: usize) -> bool {
        self.elements[element].front
    }

    /// Shapes whose interpolated normals are ignored.
    pub fn smooth_shapes(&self) -> Vec<u32> {
        let mut shapes: Vec<u32> = self.pieces.list.iter().filter(|p| p.smooth).map(|p| p.shape).collect();
        shapes.dedup();
        shapes
    }

    /// Local models of all pieces that have elements, each once.
    pub fn materials(&self) -> Vec<crate::scene::MaterialId> {
        let pieces = self.pieces.list.iter().zip(&self.live).filter(|(_, live)| live[0] || live[1]);
        let mut ids: Vec<u32> = pieces.map(|(p, _)| p.material.0).collect();
        ids.sort_unstable();
        ids.dedup();
        ids.into_iter().map(crate::scene::MaterialId).collect()
    }

    /// The cell of an element is a triangle, not a square.
    pub fn is_triangle(&self, element: usize) -> bool {
        self.leaf(element).cell.triangle
    }

    /// The corners of an element: at local coordinates (0, 0), (1, 0), (0, 1) and, of a square, (1, 1).
    pub fn corners(&self, scene: &Scene, element: usize) -> Vec<Surface> {
        let cell = &self.leaf(element).cell;
        let at = [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE].map(|u| cell.origin + cell.s * u.x + cell.t * u.y);
        let count = if cell.triangle { 3 } else { 4 };
        at[..count].iter().map(|st| scene.geometry.piece_point(self.piece(element), *st)).collect()
    }

    /// A point of an element from two numbers in [0, 1), uniform by area; `n_g` is the shape's own.
    pub fn point(&self, scene: &Scene, element: usize, u: Vec2) -> Surface {
        scene.geometry.piece_point(self.piece(element), self.leaf(element).cell.at(u))
    }

    /// A ray of an element from four numbers in [0, 1): origin uniform by area, direction by cosine.
    #[inline]
    pub fn ray(&self, scene: &Scene, element: usize, u: [f32; 4]) -> Ray {
        let s = self.point(scene, element, Vec2::new(u[0], u[1]));
        let n = if self.elements[element].front { s.n_g } else { -s.n_g };
        ray_from(&s, n, Vec2::new(u[2], u[3]))
    }

    /// The element that a ray meets, or [`VOID`].
    #[inline]
    pub fn met(&self, scene: &Scene, ray: &Ray) -> u32 {
        let Some(hit) = scene.geometry.intersect(ray) else { return VOID };
        let surface = scene.geometry.surface(ray, &hit);
        self.at(scene, &hit, &surface, surface.n_g.dot(ray.d) < 0.0)
    }

    /// The element of a hit, seen from the side of the normal or from the other; or [`VOID`].
    #[inline]
    pub fn at(&self, scene: &Scene, hit: &Hit, surface: &Surface, front: bool) -> u32 {
        self.locate(scene, hit, surface, front).0
    }

    /// The same, with the coordinates of the point in its cell.
    #[inline]
    pub fn locate(&self, scene: &Scene, hit: &Hit, surface: &Surface, front: bool) -> (u32, Vec2) {
        let piece = self.pieces.index_of(hit);
        let (mut node, mut u) = (self.roots[piece], scene.geometry.chart(hit, surface));
        let triangle = self.pieces.list[piece].triangle;
        loop {
            let next = self.nodes[node as usize];
            if next & LEAF != 0 {
                return (self.leaves[(next & !LEAF) as usize].sides[usize::from(!front)], u);
            }
            let (part, inside) = Cell::part_of(triangle, u);
            (node, u) = (next + part as u32, inside);
        }
    }
}

/// The ray that leaves a surface point on the side of unit `n`, distributed by cosine.
#[inline]
pub(super) fn ray_from(s: &Surface, n: glam::Vec3, u: Vec2) -> Ray {
    let d = Frame::around(n).to_world(warp::hemisphere_cosine(u));
    Ray { o: offset_origin(s.p, s.p_error, s.n_g, n), d, t_max: f32::INFINITY }
}

/// Which sides of a piece reflect or emit. Emission is on the side of the normal.
fn sides(scene: &Scene, piece: &Piece) -> [bool; 2] {
    let reflects =
        |front| !matches!(scene.materials.resolve(piece.material, Vec2::splat(0.5), front), crate::local::Closure::Black);
    [reflects(true) || piece.emitter != EmitterId::NONE, reflects(false)]
}
