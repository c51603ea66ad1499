//! Ray casting: the nearest point h(x, ω) and the visibility V(x ↔ y) of a tree of boxes.
//!
//! Single rays, nearest child first [Ylitie 2017]; any-hit queries stop at the first hit.
//!
//! No ray slips between two triangles that share an edge or a vertex [Woop 2013]: vertices are
//! sheared so that the ray becomes the z axis, alike for all triangles that share them, and the
//! signs of products of the sheared coordinates, each rounded on its own, are right or zero, and
//! zero counts as inside. Rounding moves a sheared vertex sideways by at most 8 unit roundoffs of
//! the coordinates in play; boxes must not be stricter than that. The part that belongs to the box
//! was added to it by the builder ([`Node::set`]), the part of the ray's origin is added to its
//! slabs here. That leaves one fused operation per plane, fewer than tests that widen the distances.
#![allow(unsafe_code)]

use super::lanes::Lanes;
use super::ray::{Hit, NONE, Ray};
use super::tree::{ANALYTIC, Block, INSTANCE, KIND, LEAF, Node, STACK, TRIANGLES, Tree};
use crate::math::prefetch;
use glam::Vec3;
use std::mem::MaybeUninit;

const MISS: Hit = Hit { t: 0.0, u: 0.0, v: 0.0, prim: NONE, instance: NONE };

/// Least component of a direction relative to its largest: the reciprocal stays finite, and the
/// change is far below rounding.
const FLAT: f32 = 1e-9;

/// The two axes that follow each, in turn.
static OTHER_AXES: [[usize; 2]; 3] = [[1, 2], [2, 0], [0, 1]];

/// A ray in the form that boxes and triangles are tested against.
#[derive(Clone, Copy)]
struct WideRay<L> {
    /// 1/d.
    reciprocal: [L; 3],
    /// Subtracted from near planes over d, widened by the origin's rounding.
    near: [L; 3],
    /// The same for far planes.
    far: [L; 3],
    /// Rows of [`Node::planes`] that the ray meets first.
    row: [usize; 3],
    /// Origin, by axes x, y, z of the sheared frame.
    o: [L; 3],
    /// −d_x/d_z, −d_y/d_z and 1/d_z of the sheared frame.
    shear: [L; 3],
    /// Which axes those are; z is the longest of d.
    axis: [usize; 3],
}

impl<L: Lanes> WideRay<L> {
    /// `None` where the ray is not a ray: something is not finite.
    #[inline(always)]
    fn new(o: Vec3, d: Vec3) -> Option<Self> {
        let (o_abs, d_abs) = (o.abs(), d.abs());
        if !(o_abs + d_abs).element_sum().is_finite() {
            return None;
        }
        let flat = FLAT * d_abs.max_element().max(1e-20);
        let (o, d) = (o.to_array(), d.to_array());
        let inverse = d.map(|x| 1.0 / if x.abs() < flat { flat.copysign(x) } else { x });
        let row = |axis: usize| 2 * axis + usize::from(inverse[axis].is_sign_negative());
        let slack = 4.0 * f32::EPSILON * o_abs.max_element();
        let plane = |axis: usize, sign: f32| L::splat(inverse[axis] * o[axis] + sign * inverse[axis].abs() * slack);
        let z = if d_abs.x > d_abs.y.max(d_abs.z) {
            0
        } else if d_abs.y > d_abs.z {
            1
        } else {
            2
        };
        let [x, y] = OTHER_AXES[z];
        let over_z = 1.0 / d[z];
        Some(Self {
            reciprocal: inverse.map(L::splat),
            near: [plane(0, 1.0), plane(1, 1.0), plane(2, 1.0)],
            far: [plane(0, -1.0), plane(1, -1.0), plane(2, -1.0)],
            row: [row(0), row(1), row(2)],
            o: [L::splat(o[x]), L::splat(o[y]), L::splat(o[z])],
            shear: [L::splat(-d[x] * over_z), L::splat(-d[y] * over_z), L::splat(over_z)],
            axis: [x, y, z],
        })
    }

    /// Children whose boxes the ray meets within (0, `t_far`), and where it enters them.
    #[inline(always)]
    fn boxes(&self, node: &Node, t_far: L) -> (u32, L) {
        // SAFETY: `row` is made of 0..6 by `new`, and ^ 1 swaps the two rows of an axis.
        let plane = |row: usize| L::load(unsafe { node.planes.get_unchecked(row) });
        let near = |axis: usize| plane(self.row[axis]).mul_sub(self.reciprocal[axis], self.near[axis]);
        let far = |axis: usize| plane(self.row[axis] ^ 1).mul_sub(self.reciprocal[axis], self.far[axis]);
        let enter = near(0).max(near(1)).max(near(2).max(L::splat(0.0)));
        let leave = far(0).min(far(1)).min(far(2).min(t_far));
        (L::bits(enter.le(leave)), enter)
    }

    /// Corner `i` of the triangles of a block: sheared x and y, and z.
    #[inline(always)]
    fn vertex(&self, block: &Block, i: usize) -> [L; 3] {
        // SAFETY: i < 3 by the callers, axis < 3 by `new`.
        let along = |k: usize| L::load(unsafe { block.vertices.get_unchecked(3 * i + self.axis[k]) }).sub(self.o[k]);
        let z = along(2);
        [self.shear[0].mul_add(z, along(0)), self.shear[1].mul_add(z, along(1)), z]
    }
}

/// Twice the area of the origin and two sheared points; swapping them negates it exactly.
#[inline(always)]
fn area<L: Lanes>(a: [L; 3], b: [L; 3]) -> L {
    a[0].mul(b[1]).sub(a[1].mul(b[0]))
}

/// The nearest hit with t in (0, `hit.t`) in a block, if there is one, replaces `hit`.
#[inline(always)]
fn meet_block<L: Lanes>(block: &Block, ray: &WideRay<L>, t_far: L, hit: &mut Hit) {
    let (a, b, c) = (ray.vertex(block, 0), ray.vertex(block, 1), ray.vertex(block, 2));
    let (w, u, v) = (area(b, c), area(c, a), area(a, b));
    let zero = L::splat(0.0);
    let inside = L::or(zero.le(u.min(v.min(w))), u.max(v.max(w)).le(zero));
    if L::bits(inside) == 0 {
        return;
    }
    let scale = L::splat(1.0).div(u.add(v).add(w));
    // A ray in the triangle's plane gives what is not a number, or infinity: neither is ahead.
    let t = u.mul_add(b[2], v.mul_add(c[2], w.mul(a[2]))).mul(ray.shear[2]).mul(scale);
    let ahead = L::and(zero.lt(t), t.lt(t_far));
    let mut mask = L::bits(L::and(inside, ahead));
    if mask == 0 {
        return;
    }
    let (t, u, v) = (t.store(), u.mul(scale).store(), v.mul(scale).store());
    while mask != 0 {
        let k = (mask.trailing_zeros() & 7) as usize;
        mask &= mask - 1;
        if t[k] < hit.t {
            *hit = Hit { t: t[k], u: u[k], v: v[k], prim: block.prim[k], instance: NONE };
        }
    }
}

/// The nearest hit with an analytic shape or an instance within (0, `t_max`), or a miss.
#[inline(never)]
fn meet_other<L: Lanes, const ANY: bool, const TOP: bool>(tree: &Tree, code: u32, ray: &Ray, t_max: f32) -> Hit {
    let index = (code & !(LEAF | KIND)) as usize;
    match code & KIND {
        ANALYTIC => {
            if let Some((shape, prim)) = tree.analytic.get(index)
                && let Some(t) = shape.intersect(ray.o, ray.d, t_max)
            {
                return Hit { t, prim: *prim, ..MISS };
            }
        }
        INSTANCE if TOP => {
            if let Some(instance) = tree.instances.get(index) {
                let inner = L::enter::<ANY>(tree, instance.root, &instance.ray_to_group(ray, t_max));
                return Hit { instance: index as u32, ..inner };
            }
        }
        _ => {}
    }
    MISS
}

/// Room for the children that wait.
type Room = MaybeUninit<[u64; STACK]>;

/// Children waiting to be visited: entry distance (as bits, which sort like the distance) above code.
struct Stack<'a> {
    room: &'a mut Room,
    len: usize,
}

impl Stack<'_> {
    /// Place `i`, below [`STACK`].
    #[inline(always)]
    fn at(&mut self, i: usize) -> *mut u64 {
        self.room.as_mut_ptr().cast::<u64>().wrapping_add(i)
    }

    #[inline(always)]
    fn push(&mut self, item: u64) {
        debug_assert!(self.len < STACK);
        // SAFETY: the builder measured that no tree needs more than STACK places.
        unsafe { self.at(self.len).write(item) };
        self.len += 1;
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<u64> {
        self.len = self.len.checked_sub(1)?;
        // SAFETY: below `len`, hence written.
        Some(unsafe { self.at(self.len).read() })
    }

    /// Pushes so that the items from `base` on stay sorted, nearest last.
    #[inline(always)]
    fn insert(&mut self, base: usize, item: u64) {
        self.push(item);
        let mut i = self.len - 1;
        // SAFETY: base ≤ i < len.
        unsafe {
            while i > base && self.at(i - 1).read() < item {
                self.at(i).write(self.at(i - 1).read());
                i -= 1;
            }
            self.at(i).write(item);
        }
    }
}

/// Sorts the children of `mask` onto the stack, nearest last, and returns the nearest.
#[inline(always)]
fn order(stack: &mut Stack, node: &Node, mut mask: u32, enter: &[f32; 8]) -> u32 {
    let mut next = || {
        let k = (mask.trailing_zeros() & 7) as usize;
        mask &= mask.wrapping_sub(1);
        (u64::from(enter[k].to_bits()) << 32 | u64::from(node.child[k]), mask != 0)
    };
    let sorted = |a: u64, b: u64| if a < b { (a, b) } else { (b, a) };
    let (first, _) = next();
    let (second, more) = next();
    let (near, far) = sorted(first, second);
    if !more {
        stack.push(far);
        return near as u32;
    }
    let (third, mut more) = next();
    let (far, farthest) = sorted(far, third);
    let (near, far) = sorted(near, far);
    let base = stack.len;
    stack.push(farthest);
    stack.push(far);
    if !more {
        return near as u32;
    }
    stack.push(near);
    while more {
        let (item, rest) = next();
        stack.insert(base, item);
        more = rest;
    }
    stack.pop().unwrap_or(0) as u32
}

/// The nearest hit (or, with `ANY`, some hit) of the subtree `root`; `TOP` = instances may occur.
/// A miss has `prim` = [`NONE`].
#[inline(always)]
pub(super) fn traverse<L: Lanes, const ANY: bool, const TOP: bool>(tree: &Tree, root: u32, ray: &Ray) -> Hit {
    let Some(wide) = WideRay::<L>::new(ray.o, ray.d) else { return MISS };
    let mut hit = Hit { t: ray.t_max, ..MISS };
    let mut t_far = L::splat(ray.t_max);
    let mut room = Room::uninit();
    let mut stack = Stack { room: &mut room, len: 0 };
    let mut code = root;
    loop {
        'down: {
            while code & LEAF == 0 {
                // SAFETY: codes without LEAF are indices of `nodes`, by construction of the tree.
                let node = unsafe { tree.nodes.get_unchecked(code as usize) };
                let (mask, enter) = wide.boxes(node, t_far);
                if mask == 0 {
                    break 'down;
                }
                if mask & (mask - 1) == 0 {
                    code = node.child[(mask.trailing_zeros() & 7) as usize];
                    continue;
                }
                ask_for_children(tree, node, mask);
                code = order(&mut stack, node, mask, &enter.store());
            }
            if code & KIND == TRIANGLES {
                // SAFETY: codes of this kind hold indices of `blocks`, by construction of the tree.
                let block = unsafe { tree.blocks.get_unchecked((code & !LEAF) as usize) };
                let before = hit.prim;
                meet_block(block, &wide, t_far, &mut hit);
                // Whoever asks for the nearest hit looks at its primitive next.
                if !ANY && hit.prim != before {
                    prefetch(tree.prims.as_ptr().wrapping_add(hit.prim as usize));
                }
            } else {
                let other = meet_other::<L, ANY, TOP>(tree, code, ray, hit.t);
                if other.prim != NONE {
                    hit = other;
                }
            }
            if ANY && hit.prim != NONE {
                return hit;
            }
            t_far = L::splat(hit.t);
        }
        loop {
            let Some(item) = stack.pop() else { return hit };
            if ANY || f32::from_bits((item >> 32) as u32) <= hit.t {
                code = item as u32;
                break;
            }
        }
    }
}

/// Fetches the children of `mask` while they are being sorted.
#[inline(always)]
fn ask_for_children(tree: &Tree, node: &Node, mut mask: u32) {
    while mask != 0 {
        let code = node.child[(mask.trailing_zeros() & 7) as usize];
        mask &= mask - 1;
        if code & LEAF == 0 {
            prefetch(tree.nodes.as_ptr().wrapping_add(code as usize));
        } else {
            prefetch(tree.blocks.as_ptr().wrapping_add((code & !(LEAF | KIND)) as usize));
        }
    }
}
