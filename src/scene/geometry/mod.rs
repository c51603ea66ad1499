//! Geometry of the built scene: the ray casting function h(x, ω), visibility V(x ↔ y), surface
//! points and points drawn on surfaces.
//!
//! All shapes of the scene are in one tree of boxes (`tree`); groups have trees of their own, of
//! which instances are leaves. A ray meets triangles and analytic shapes (`traverse`); what it
//! met becomes a [`Surface`] from the primitive itself, not from the rounded ray (`surface`).
//! Orientation, texture coordinates and tangents are Mitsuba 3's for each shape.

mod analytic;
mod bake;
mod binary;
mod build_tree;
mod cylinder;
mod disk;
mod extent;
mod input;
mod instance;
mod lanes;
#[cfg(target_arch = "x86_64")]
mod lanes_avx2;
mod meshes;
mod pages;
mod parallelogram;
mod pieces;
mod ray;
mod sample;
mod sphere;
mod surface;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod tests_mitsuba;
#[cfg(test)]
mod tests_robust;
mod traverse;
mod tree;
mod triangle;

pub use extent::Extent;
pub use input::{Form, ShapeInput};
pub use pieces::{Piece, Pieces};
pub use ray::{Aabb, Hit, Ray};
pub use sample::ShapePoint;
pub use surface::offset_origin;

use crate::describe::Problems;
use crate::scene::Surface;
use bake::{Baked, Sampler, Shape, Vertex};
use build_tree::{Growing, Item};
use glam::Vec3;
use instance::Instance;
use pages::Pages;
use ray::NONE;
use tree::Tree;

/// One end of a visibility query: position, its error bound and its unit geometric normal (zero
/// for a point that is not on a surface).
pub type End = (Vec3, f32, Vec3);

/// All shapes of a scene, immutable.
pub struct Geometry {
    tree: Tree,
    wide: bool,
    vertices: Pages<Vertex>,
    shapes: Vec<Shape>,
    samplers: Vec<(Sampler, f64)>,
    /// Primitives up to `ends[0]` are the scene's, up to `ends[i]` those of group i − 1.
    ends: Vec<usize>,
    /// Group of every instance.
    placed_groups: Vec<u32>,
    bounds: Aabb,
    triangles: usize,
    warnings: Problems,
}

impl Geometry {
    /// Builds the scene's tree and those of the groups.
    ///
    /// The index of a shape in `shapes` is its index in all of geometry; members of groups follow,
    /// group by group. All problems are reported at once; warnings are kept ([`Self::warnings`]).
    pub fn build(shapes: Vec<ShapeInput>, groups: Vec<Vec<ShapeInput>>) -> Result<Self, Problems> {
        let mut baked = Baked::default();
        let mut ends = vec![];
        shapes.iter().for_each(|s| baked.add(s, Some(groups.len())));
        ends.push(baked.prims.len());
        for group in &groups {
            group.iter().for_each(|s| baked.add(s, None));
            ends.push(baked.prims.len());
        }
        if baked.prims.len().max(baked.placed.len()) > tree::MAX_INDEX as usize {
            let place = shapes.first().map(|s| s.place).unwrap_or_default();
            baked.problems.error(place, format!("more than {} primitives", tree::MAX_INDEX));
        }
        if baked.problems.has_errors() {
            return Err(baked.problems);
        }
        drop((shapes, groups));
        Ok(Self::grow(baked, &ends))
    }

    /// Trees over checked shapes; `ends[0]` primitives are the scene's, up to `ends[i]` group i − 1's.
    fn grow(mut baked: Baked, ends: &[usize]) -> Self {
        let mut growing = Growing::default();
        let groups: Vec<(u32, Aabb)> = ends
            .windows(2)
            .map(|range| {
                let (items, boxes) = items(&baked, range[0]..range[1]);
                (growing.add(&items, &boxes), boxes.iter().fold(Aabb::EMPTY, |a, b| a.union(*b)))
            })
            .collect();
        let place = |(group, to_world): &(u32, glam::DAffine3)| {
            let (root, inner) = &groups[*group as usize];
            Instance::new(*root, inner, to_world)
        };
        let instances: Vec<Instance> = baked.placed.iter().map(place).collect();
        let (mut items, mut boxes) = items(&baked, 0..ends[0]);
        for (i, instance) in instances.iter().enumerate().filter(|(_, i)| !i.bounds.is_empty()) {
            items.push(Item::Instance(i as u32));
            boxes.push(instance.bounds);
        }
        let root = growing.add(&items, &boxes);
        let bounds = boxes.iter().fold(Aabb::EMPTY, |a, b| a.union(*b));
        Self {
            tree: Tree {
                nodes: Pages::new(&growing.nodes),
                blocks: Pages::new(&growing.blocks),
                analytic: std::mem::take(&mut baked.analytic),
                instances,
                prims: Pages::new(&baked.prims),
                root,
            },
            wide: wide_available(),
            triangles: baked.prims.iter().filter(|p| p.v[0] != NONE).count(),
            vertices: Pages::new(&baked.vertices),
            shapes: baked.shapes,
            samplers: baked.samplers,
            ends: ends.to_vec(),
            placed_groups: baked.placed.iter().map(|(group, _)| *group).collect(),
            bounds,
            warnings: baked.problems,
        }
    }

    /// The nearest hit with t in (0, `ray.t_max`).
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let hit = self.traverse::<false>(ray);
        (hit.prim != NONE).then_some(hit)
    }

    /// Is there any hit with t in (0, `ray.t_max`)? Stops at the first it finds.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.traverse::<true>(ray).prim != NONE
    }

    #[cfg(target_arch = "x86_64")]
    #[inline]
    #[allow(unsafe_code)]
    fn traverse<const ANY: bool>(&self, ray: &Ray) -> Hit {
        if self.wide {
            // SAFETY: `wide` is what `available` said.
            unsafe { lanes_avx2::traverse_scene::<ANY>(&self.tree, self.tree.root, ray) }
        } else {
            traverse::traverse::<lanes::Portable, ANY, true>(&self.tree, self.tree.root, ray)
        }
    }

    #[cfg(not(target_arch = "x86_64"))]
    #[inline]
    fn traverse<const ANY: bool>(&self, ray: &Ray) -> Hit {
        traverse::traverse::<lanes::Portable, ANY, true>(&self.tree, self.tree.root, ray)
    }

    /// The surface point that `ray` met at `hit`.
    #[inline]
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        let prim = &self.tree.prims[hit.prim as usize];
        let shape = &self.shapes[prim.shape as usize];
        if prim.v[0] != NONE && hit.instance == NONE {
            triangle::surface(prim.v.map(|i| &self.vertices[i as usize]), shape, hit.u, hit.v).on(prim.shape, shape)
        } else {
            self.rare_surface(ray, hit)
        }
    }

    /// The same for analytic shapes and for all that is seen through an instance.
    #[inline(never)]
    fn rare_surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        let prim = &self.tree.prims[hit.prim as usize];
        let shape = &self.shapes[prim.shape as usize];
        let instance = if hit.instance == NONE { None } else { Some(&self.tree.instances[hit.instance as usize]) };
        let local = if prim.v[0] != NONE {
            triangle::surface(prim.v.map(|i| &self.vertices[i as usize]), shape, hit.u, hit.v)
        } else {
            let ray = instance.map_or(*ray, |i| i.ray_to_group(ray, ray.t_max));
            self.tree.analytic[prim.v[1] as usize].0.surface(&ray, hit.t, shape)
        };
        instance.map_or(local, |i| i.point_to_world(&local)).on(prim.shape, shape)
    }

    /// Do `a` and `b` see each other? Both ends are moved off their surfaces towards each other and
    /// the segment between is shortened by 1e-4 of its length.
    #[inline]
    pub fn visible(&self, a: End, b: End) -> bool {
        let d = b.0 - a.0;
        let from = offset_origin(a.0, a.1, a.2, d);
        let to = offset_origin(b.0, b.1, b.2, -d);
        !self.occluded(&Ray { o: from, d: to - from, t_max: 1.0 - 1e-4 })
    }

    /// Does `a` see infinitely far along `direction`?
    #[inline]
    pub fn visible_infinite(&self, a: End, direction: Vec3) -> bool {
        let o = offset_origin(a.0, a.1, a.2, direction);
        !self.occluded(&Ray { o, d: direction, t_max: f32::INFINITY })
    }

    /// Box around everything (empty for an empty scene).
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Centre and radius of a sphere around everything.
    pub fn bounding_sphere(&self) -> (Vec3, f32) {
        let center = self.bounds.center();
        let reach = if self.bounds.is_empty() { Vec3::ZERO } else { (self.bounds.max - center).max(center - self.bounds.min) };
        (center, reach.as_dvec3().length() as f32 * (1.0 + 1e-6))
    }

    /// Number of shapes, members of groups included.
    pub fn shape_count(&self) -> usize {
        self.shapes.len()
    }

    /// Number of triangles, each group's counted once.
    pub fn triangle_count(&self) -> usize {
        self.triangles
    }

    /// Number of instances.
    pub fn instance_count(&self) -> usize {
        self.tree.instances.len()
    }

    /// Memory held, in bytes.
    pub fn bytes(&self) -> usize {
        let cdf = |s: &(Sampler, f64)| if let Sampler::Triangles { cdf, .. } = &s.0 { size_of_val(&cdf[..]) } else { 0 };
        size_of_val(&self.tree.nodes[..])
            + size_of_val(&self.tree.blocks[..])
            + size_of_val(&self.tree.analytic[..])
            + size_of_val(&self.tree.instances[..])
            + size_of_val(&self.tree.prims[..])
            + size_of_val(&self.vertices[..])
            + size_of_val(&self.shapes[..])
            + self.samplers.iter().map(cdf).sum::<usize>()
    }

    /// What was odd about the shapes without being wrong.
    pub fn warnings(&self) -> &Problems {
        &self.warnings
    }
}

#[cfg(target_arch = "x86_64")]
fn wide_available() -> bool {
    lanes_avx2::available()
}

#[cfg(not(target_arch = "x86_64"))]
fn wide_available() -> bool {
    false
}

/// What the tree over a range of primitives is built from.
fn items(baked: &Baked, range: std::ops::Range<usize>) -> (Vec<Item>, Vec<Aabb>) {
    let item = |i: usize| {
        let prim = &baked.prims[i];
        if prim.v[0] == NONE {
            (Item::Analytic(prim.v[1]), baked.analytic[prim.v[1] as usize].0.bounds())
        } else {
            let corners = prim.v.map(|v| baked.vertices[v as usize].p);
            (Item::Triangle(i as u32, corners), Aabb::around(corners))
        }
    };
    range.map(item).unzip()
}
