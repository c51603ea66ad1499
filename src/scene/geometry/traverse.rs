//! Ray casting: the nearest point h(x, ω) and the visibility V(x ↔ y) of a tree of boxes.
//!
//! Single rays, nearest child first [Ylitie 2017]. Boxes are tested conservatively by widening the
//! far distance by four ulps [Ize 2013]; triangles by the signs of Plücker products, whose edges
//! are computed alike from both sides, so that no ray slips through an edge or vertex shared by two
//! triangles [Davidovič 2012]. Any-hit queries stop at the first hit.
#![allow(unsafe_code)]

use super::lanes::Lanes;
use super::ray::{Hit, NONE, Ray};
use super::tree::{ANALYTIC, Block, INSTANCE, KIND, LEAF, Node, STACK, TRIANGLES, Tree};
use glam::Vec3;
use std::mem::MaybeUninit;

const MISS: Hit = Hit { t: 0.0, u: 0.0, v: 0.0, prim: NONE, instance: NONE };

/// Least |component| of a direction whose reciprocal is taken: keeps 0·∞ out of the box test.
const FLAT: f32 = 1e-18;

/// A ray in the form that boxes and triangles are tested against.
#[derive(Clone, Copy)]
struct WideRay<L> {
    o: [L; 3],
    d: [L; 3],
    reciprocal: [L; 3],
    /// Rows of [`Node::planes`] that the ray meets first.
    near: [usize; 3],
}

impl<L: Lanes> WideRay<L> {
    #[inline(always)]
    fn new(o: Vec3, d: Vec3) -> Self {
        let inverse = d.to_array().map(|x| 1.0 / if x.abs() < FLAT { FLAT.copysign(x) } else { x });
        let row = |axis: usize| 2 * axis + usize::from(inverse[axis].is_sign_negative());
        Self {
            o: o.to_array().map(L::splat),
            d: d.to_array().map(L::splat),
            reciprocal: inverse.map(L::splat),
            near: [row(0), row(1), row(2)],
        }
    }

    /// Children whose boxes the ray meets within (0, `t_far`), and where it enters them.
    #[inline(always)]
    fn boxes(&self, node: &Node, t_far: L) -> (u32, L) {
        // SAFETY: `near` is made of 0..6 by `new`, and ^ 1 swaps the two rows of an axis.
        let plane = |row: usize| L::load(unsafe { node.planes.get_unchecked(row) });
        let t = |row: usize, axis: usize| plane(row).sub(self.o[axis]).mul(self.reciprocal[axis]);
        let [x, y, z] = self.near;
        let enter = t(x, 0).max(t(y, 1)).max(t(z, 2).max(L::splat(0.0)));
        let leave = t(x ^ 1, 0).min(t(y ^ 1, 1)).min(t(z ^ 1, 2).min(t_far));
        let widened = leave.mul(L::splat(1.0 + 4.0 * f32::EPSILON));
        (L::bits(enter.le(widened)), enter)
    }
}

#[inline(always)]
fn cross<L: Lanes>(a: [L; 3], b: [L; 3]) -> [L; 3] {
    [a[1].mul_sub(b[2], a[2].mul(b[1])), a[2].mul_sub(b[0], a[0].mul(b[2])), a[0].mul_sub(b[1], a[1].mul(b[0]))]
}

#[inline(always)]
fn dot<L: Lanes>(a: [L; 3], b: [L; 3]) -> L {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2].mul(b[2])))
}

#[inline(always)]
fn zip<L: Lanes>(a: [L; 3], b: [L; 3], f: impl Fn(L, L) -> L) -> [L; 3] {
    [f(a[0], b[0]), f(a[1], b[1]), f(a[2], b[2])]
}

/// The nearest hit with t in (0, `hit.t`) in a block, if there is one, replaces `hit`.
///
/// Relative to the ray's origin, (v_i − v_j) × (v_i + v_j) · d is twice the signed volume of the
/// ray and the edge; three equal signs mean inside. Swapping an edge's ends negates it exactly.
#[inline(always)]
fn meet_block<L: Lanes>(block: &Block, ray: &WideRay<L>, t_far: L, hit: &mut Hit) {
    let vertex = |i: usize| {
        let [x, y, z] = [&block.vertices[3 * i], &block.vertices[3 * i + 1], &block.vertices[3 * i + 2]];
        zip([L::load(x), L::load(y), L::load(z)], ray.o, L::sub)
    };
    let (a, b, c) = (vertex(0), vertex(1), vertex(2));
    let (ca, ab, bc) = (zip(c, a, L::sub), zip(a, b, L::sub), zip(b, c, L::sub));
    let u = dot(cross(ca, zip(c, a, L::add)), ray.d);
    let v = dot(cross(ab, zip(a, b, L::add)), ray.d);
    let w = dot(cross(bc, zip(b, c, L::add)), ray.d);
    let sum = u.add(v).add(w);
    let slack = sum.abs().mul(L::splat(f32::EPSILON));
    let least = u.min(v.min(w));
    let most = u.max(v.max(w));
    let inside = L::or(L::splat(0.0).sub(slack).le(least), most.le(slack));
    if L::bits(inside) == 0 {
        return;
    }
    let normal = cross(ca, ab);
    // A ray in the triangle's plane gives 0/0 or x/0, which both comparisons refuse.
    let t = dot(a, normal).div(dot(normal, ray.d));
    let ahead = L::and(L::splat(0.0).lt(t), t.lt(t_far));
    let mut mask = L::bits(L::and(inside, ahead));
    if mask == 0 {
        return;
    }
    let scale = L::splat(1.0).div(sum);
    let (t, u, v) = (t.store(), u.mul(scale).store(), v.mul(scale).store());
    while mask != 0 {
        let k = (mask.trailing_zeros() & 7) as usize;
        mask &= mask - 1;
        if t[k] < hit.t {
            *hit = Hit { t: t[k], u: u[k], v: v[k], prim: block.prim[k], instance: NONE };
        }
    }
}

/// The nearest hit with an analytic shape or an instance, if within (0, `hit.t`), replaces `hit`.
#[inline(always)]
fn meet_other<L: Lanes, const ANY: bool, const TOP: bool>(tree: &Tree, code: u32, ray: &Ray, hit: &mut Hit) {
    let index = (code & !(LEAF | KIND)) as usize;
    match code & KIND {
        ANALYTIC => {
            if let Some((shape, prim)) = tree.analytic.get(index)
                && let Some(t) = shape.intersect(ray.o, ray.d, hit.t)
            {
                *hit = Hit { t, u: 0.0, v: 0.0, prim: *prim, instance: NONE };
            }
        }
        INSTANCE if TOP => {
            if let Some(instance) = tree.instances.get(index) {
                let inner = L::enter::<ANY>(tree, instance.root, &instance.ray_to_group(ray, hit.t));
                if inner.prim != NONE {
                    *hit = Hit { instance: index as u32, ..inner };
                }
            }
        }
        _ => {}
    }
}

/// Children waiting to be visited: entry distance (as bits, which sort like the distance) above code.
struct Stack {
    items: [MaybeUninit<u64>; STACK],
    len: usize,
}

impl Stack {
    #[inline(always)]
    fn push(&mut self, item: u64) {
        debug_assert!(self.len < STACK);
        // SAFETY: the builder measured that no tree needs more than STACK places.
        unsafe { self.items.get_unchecked_mut(self.len).write(item) };
        self.len += 1;
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<u64> {
        self.len = self.len.checked_sub(1)?;
        // SAFETY: below `len`, hence written.
        Some(unsafe { self.items.get_unchecked(self.len).assume_init() })
    }

    /// Pushes so that the items from `base` on stay sorted, nearest last.
    #[inline(always)]
    fn insert(&mut self, base: usize, item: u64) {
        self.push(item);
        let mut at = self.len - 1;
        // SAFETY: base ≤ at < len.
        unsafe {
            while at > base && self.items.get_unchecked(at - 1).assume_init() < item {
                *self.items.get_unchecked_mut(at) = *self.items.get_unchecked(at - 1);
                at -= 1;
            }
            self.items.get_unchecked_mut(at).write(item);
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
    let wide = WideRay::<L>::new(ray.o, ray.d);
    let mut hit = Hit { t: ray.t_max, ..MISS };
    let mut t_far = L::splat(ray.t_max);
    let mut stack = Stack { items: [MaybeUninit::uninit(); STACK], len: 0 };
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
                ask_for_children::<L>(tree, node, mask);
                code = order(&mut stack, node, mask, &enter.store());
            }
            if code & KIND == TRIANGLES {
                // SAFETY: codes of this kind hold indices of `blocks`, by construction of the tree.
                let block = unsafe { tree.blocks.get_unchecked((code & !LEAF) as usize) };
                meet_block(block, &wide, t_far, &mut hit);
            } else {
                meet_other::<L, ANY, TOP>(tree, code, ray, &mut hit);
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
fn ask_for_children<L: Lanes>(tree: &Tree, node: &Node, mut mask: u32) {
    while mask != 0 {
        let code = node.child[(mask.trailing_zeros() & 7) as usize];
        mask &= mask - 1;
        if code & LEAF == 0 {
            L::prefetch::<4, _>(tree.nodes.as_ptr().wrapping_add(code as usize));
        } else {
            L::prefetch::<5, _>(tree.blocks.as_ptr().wrapping_add((code & !(LEAF | KIND)) as usize));
        }
    }
}
