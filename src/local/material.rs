//! All local models of a scene with their textures, built from the description.
//!
//! A material has two sides, and a side is nothing, one model, or a list of weighted models: trees
//! of `twosided`, `mask` and `blendbsdf` are flattened here, so that a walk never recurses.

use super::builder::Builder;
use super::closure::{Closure, Model};
use super::composite::{Composite, Entry};
use super::diffuse;
use crate::describe::{BsdfDescription, BsdfId, ImageDescription, Problems};
use crate::spectrum::Spectrum;
use crate::texture::{TextureSlot, Textures};
use glam::Vec2;

/// Into how many directions a material scatters what arrives from one, by the roughness of all its events. One answer for
/// the whole material, told in the middle of textures, so that it belongs to the path and not to the walker that asks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Breadth {
    /// Dirac events, or as good as those.
    Sharp,
    /// Polished metal, clear glass with a haze.
    Focused,
    /// Frosted glass, brushed metal: about a mirrored or a refracted direction.
    Narrow,
    /// Anywhere, or a diffuse part, or far more widely along one tangent than along the other.
    Wide,
}

/// Roughness below which a model without a diffuse part has each.
const SHARP: f32 = 0.03;
const FOCUSED: f32 = 0.1;
const NARROW: f32 = 0.6;

impl Breadth {
    fn of(model: &Model, textures: &Textures) -> Self {
        if model.lobes().diffuse || model.is_anisotropic() {
            return Self::Wide;
        }
        match model.resolve(textures, Vec2::splat(0.5)).roughness() {
            r if r < SHARP => Self::Sharp,
            r if r < FOCUSED => Self::Focused,
            r if r < NARROW => Self::Narrow,
            _ => Self::Wide,
        }
    }

    /// Focused at most: what goes on is nearly what came.
    #[inline]
    pub fn is_focused(self) -> bool {
        self <= Self::Focused
    }

    /// Narrow at most.
    #[inline]
    pub fn is_narrow(self) -> bool {
        self <= Self::Narrow
    }
}

/// Roughness from which a model scatters so widely that it matters less than where light comes from.
const WIDE: f32 = 0.3;

/// Index of a built local model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MaterialId(pub u32);

/// Which kinds of events a model has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lobes {
    /// Diffuse reflection.
    pub diffuse: bool,
    /// Rough reflection.
    pub glossy: bool,
    /// Rough refraction.
    pub glossy_refraction: bool,
    /// Dirac reflection.
    pub mirror: bool,
    /// Dirac refraction.
    pub refraction: bool,
    /// Straight through.
    pub null: bool,
}

impl Lobes {
    /// Something that can be connected to.
    pub fn has_smooth(self) -> bool {
        self.diffuse || self.glossy || self.glossy_refraction
    }

    /// Some Dirac event.
    pub fn has_delta(self) -> bool {
        self.mirror || self.refraction || self.null
    }

    /// Some event that leaves on the other side.
    pub fn transmits(self) -> bool {
        self.glossy_refraction || self.refraction || self.null
    }

    /// The kinds of either.
    pub fn union(self, o: Self) -> Self {
        Self {
            diffuse: self.diffuse || o.diffuse,
            glossy: self.glossy || o.glossy,
            glossy_refraction: self.glossy_refraction || o.glossy_refraction,
            mirror: self.mirror || o.mirror,
            refraction: self.refraction || o.refraction,
            null: self.null || o.null,
        }
    }
}

/// One side of a material.
#[derive(Clone, Debug)]
pub(super) enum Side {
    Black,
    Single(Model),
    Composite(Box<[Entry]>),
}

/// What is known of a material everywhere.
#[derive(Clone, Copy, Debug)]
struct Summary {
    lobes: Lobes,
    anisotropic: bool,
    textured: bool,
    breadth: Breadth,
    guided: bool,
    albedo_bound: Spectrum,
}

/// All local models of a scene.
#[derive(Clone, Debug)]
pub struct Materials {
    /// Front and back of every material in turn.
    sides: Vec<Side>,
    summaries: Vec<Summary>,
    textures: Textures,
}

impl Materials {
    /// Of all described models; material k is model k, and two more (see [`Self::default_id`])
    /// follow. `images` must be decoded.
    pub fn build(bsdfs: &[BsdfDescription], images: &[ImageDescription]) -> Result<Self, Problems> {
        let mut builder = Builder::new(bsdfs, images);
        let mut materials = Self { sides: Vec::new(), summaries: Vec::new(), textures: Textures::default() };
        for id in 0..bsdfs.len() as u32 {
            let [front, back] = [true, false].map(|front| builder.side(BsdfId(id), front));
            let textured = std::mem::take(&mut builder.textured);
            materials.push(front, back, textured, &builder.textures);
        }
        let grey = diffuse::Model { reflectance: TextureSlot::Constant(Spectrum::grey(0.5)) };
        materials.push(Side::Single(grey.into()), Side::Black, false, &builder.textures);
        materials.push(Side::Black, Side::Black, false, &builder.textures);
        if builder.problems.has_errors() {
            return Err(builder.problems);
        }
        materials.textures = builder.textures;
        Ok(materials)
    }

    fn push(&mut self, front: Side, back: Side, textured: bool, textures: &Textures) {
        let models = || front.models().chain(back.models());
        self.summaries.push(Summary {
            lobes: models().fold(Lobes::default(), |all, m| all.union(m.lobes())),
            anisotropic: models().any(Model::is_anisotropic),
            textured,
            breadth: models().map(|m| Breadth::of(m, textures)).max().unwrap_or(Breadth::Sharp),
            guided: models().any(|m| is_wide(m, textures)) && !models().any(|m| m.lobes().glossy_refraction),
            albedo_bound: models().fold(Spectrum::BLACK, |most, m| most.lane_max(m.albedo_bound(textures))),
        });
        self.sides.extend([front, back]);
    }

    /// Bytes of the images of textures.
    pub fn image_bytes(&self) -> usize {
        self.textures.bytes()
    }

    /// Number of materials, the default ones included.
    pub fn len(&self) -> usize {
        self.summaries.len()
    }

    /// Never: there are always the default ones.
    pub fn is_empty(&self) -> bool {
        self.summaries.is_empty()
    }

    /// The material of shapes without one: diffuse, 0.5, one-sided; of lamps, which in Mitsuba 3 reflect nothing then, black.
    pub fn default_id(&self, is_lamp: bool) -> MaterialId {
        MaterialId(self.summaries.len() as u32 - if is_lamp { 1 } else { 2 })
    }

    /// The model at texture coordinates `uv`, for events that come from `w_back` on the side of the
    /// shading normal (`front`) or on the other.
    #[inline]
    pub fn resolve(&self, id: MaterialId, uv: Vec2, front: bool) -> Closure<'_> {
        match &self.sides[2 * id.0 as usize + usize::from(!front)] {
            Side::Black => Closure::Black,
            Side::Single(model) => model.resolve(&self.textures, uv),
            Side::Composite(entries) => Closure::Composite(Composite::new(entries, &self.textures, uv)),
        }
    }

    /// The model depends on the direction of the tangent: its frame must follow `dp_du`.
    #[inline]
    pub fn needs_tangent(&self, id: MaterialId) -> bool {
        self.summaries[id.0 as usize].anisotropic
    }

    /// Something of it is a texture: [`Self::resolve`] looks at texture coordinates.
    #[inline]
    pub fn needs_uv(&self, id: MaterialId) -> bool {
        self.summaries[id.0 as usize].textured
    }

    /// Into how many directions it scatters at most.
    #[inline]
    pub fn breadth(&self, id: MaterialId) -> Breadth {
        self.summaries[id.0 as usize].breadth
    }

    /// Scatters widely, and on the side that light comes from: gathering walks may go where light is known to come from. One
    /// answer for the whole material, like [`Self::breadth`].
    #[inline]
    pub fn is_guided(&self, id: MaterialId) -> bool {
        self.summaries[id.0 as usize].guided
    }

    /// Kinds of events on either side.
    pub fn lobes(&self, id: MaterialId) -> Lobes {
        self.summaries[id.0 as usize].lobes
    }

    /// Has events that can be connected to.
    pub fn has_smooth(&self, id: MaterialId) -> bool {
        self.lobes(id).has_smooth()
    }

    /// Has Dirac events.
    pub fn has_delta(&self, id: MaterialId) -> bool {
        self.lobes(id).has_delta()
    }

    /// No direction is scattered into more than this share of what arrives, counted in basic
    /// radiance, in every lane.
    pub fn albedo_bound(&self, id: MaterialId) -> Spectrum {
        self.summaries[id.0 as usize].albedo_bound
    }
}

/// Told in the middle of textures.
fn is_wide(model: &Model, textures: &Textures) -> bool {
    let lobes = model.lobes();
    lobes.diffuse || (lobes.glossy && model.resolve(textures, Vec2::splat(0.5)).roughness() >= WIDE)
}

impl Side {
    fn models(&self) -> impl Iterator<Item = &Model> {
        let (single, entries): (Option<&Model>, &[Entry]) = match self {
            Self::Black => (None, &[]),
            Self::Single(model) => (Some(model), &[]),
            Self::Composite(entries) => (None, entries),
        };
        single.into_iter().chain(entries.iter().map(|e| &e.model))
    }
}
