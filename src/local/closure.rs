//! A local model at one point: plain numbers, evaluated and sampled without asking a texture again.
//!
//! A closed set of models: the macro below writes the enum of models with textures, the enum of
//! models at a point, and the delegating matches. A new model is one file and one line here (and
//! its parameters in [`material`](super::material)).

use super::composite::Composite;
use super::{
    Equation, Evaluation, Lobe, Lobes, Sample, Textured, conductor, dielectric, diffuse, null, plastic, principled,
    rough_conductor, rough_dielectric, rough_plastic, thin_dielectric,
};
use crate::math::warp::ONE_MINUS_EPSILON;
use crate::spectrum::Spectrum;
use crate::texture::Textures;
use glam::{Vec2, Vec3};

macro_rules! closed_set {
    ($life:lifetime: $($name:ident of $module:ident at a point $plain:ty;)*) => {
        /// A local model at one point, on the side of the surface it was resolved for.
        ///
        /// All directions are local (z = shading normal) and of unit length; `w_back` must lie on
        /// the side given to [`Materials::resolve`](super::Materials::resolve).
        #[derive(Clone, Copy, Debug)]
        pub enum Closure<$life> {
            /// Absorbs everything.
            Black,
            $(#[doc = concat!("See [`", stringify!($module), "`].")] $name($plain),)*
            /// Several lobes with weights.
            Composite(Composite<$life>),
        }

        /// A local model with its textures.
        #[derive(Clone, Debug)]
        pub(crate) enum Model {
            $($name($module::Model),)*
        }

        $(impl From<$module::Model> for Model {
            fn from(model: $module::Model) -> Self {
                Self::$name(model)
            }
        })*

        impl Model {
            /// Plain numbers at `uv`.
            #[inline]
            pub fn resolve<$life>(&$life self, textures: &$life Textures, uv: Vec2) -> Closure<$life> {
                match self {
                    $(Self::$name(model) => Closure::$name(model.resolve(textures, uv)),)*
                }
            }

            /// Which kinds of events it has.
            pub fn lobes(&self) -> Lobes {
                match self { $(Self::$name(model) => model.lobes(),)* }
            }

            /// Scatters on the inside too.
            pub fn both_sides(&self) -> bool {
                match self { $(Self::$name(model) => model.both_sides(),)* }
            }

            /// Depends on the direction of the tangent.
            pub fn is_anisotropic(&self) -> bool {
                match self { $(Self::$name(model) => model.is_anisotropic(),)* }
            }

            /// Upper bound of the share that is scattered.
            pub fn albedo_bound(&self, textures: &Textures) -> Spectrum {
                match self { $(Self::$name(model) => model.albedo_bound(textures),)* }
            }
        }

        impl Closure<'_> {
            /// Only Dirac lobes, or none: there is nothing to connect to.
            #[inline]
            pub fn is_delta(&self) -> bool {
                match self {
                    Self::Black => true,
                    $(Self::$name(lobe) => lobe.is_delta(),)*
                    Self::Composite(lobes) => lobes.is_delta(),
                }
            }

            /// The non-Dirac part: value, and densities of both walkers.
            #[inline]
            pub fn evaluate(&self, equation: Equation, w_back: Vec3, w_next: Vec3) -> Evaluation {
                match self {
                    Self::Black => Evaluation::default(),
                    $(Self::$name(lobe) => lobe.evaluate(equation, w_back, w_next),)*
                    Self::Composite(lobes) => lobes.evaluate(equation, w_back, w_next),
                }
            }

            /// `p_w` of the non-Dirac part alone, lobe choice included.
            #[inline]
            pub fn density(&self, w_back: Vec3, w_next: Vec3) -> f32 {
                match self {
                    Self::Black => 0.0,
                    $(Self::$name(lobe) => lobe.density(w_back, w_next),)*
                    Self::Composite(lobes) => lobes.density(w_back, w_next),
                }
            }

            /// The next event of a walk that came along `w_back`, all numbers uniform in [0, 1);
            /// `None` ends the walk.
            #[inline]
            pub fn sample(&self, equation: Equation, w_back: Vec3, u_lobe: f32, u: Vec2) -> Option<Sample> {
                match self {
                    Self::Black => None,
                    $(Self::$name(lobe) => lobe.sample(equation, w_back, u_lobe, u),)*
                    Self::Composite(lobes) => lobes.sample(equation, w_back, u_lobe, u),
                }
            }

            /// Every Dirac event; its weight times its probability is the coefficient of the Dirac function.
            pub fn each_dirac(&self, equation: Equation, w_back: Vec3, f: impl FnMut(Sample)) {
                match self {
                    Self::Composite(lobes) => lobes.each_dirac(equation, w_back, f),
                    _ => self.two_dirac(equation, w_back).for_each(f),
                }
            }

            /// The same of one model, which has at most two, at either end of the choice of lobes.
            pub(super) fn two_dirac(&self, equation: Equation, w_back: Vec3) -> impl Iterator<Item = Sample> {
                let at = |u_lobe| self.sample(equation, w_back, u_lobe, Vec2::splat(0.5)).filter(|s| s.delta);
                let (first, last) = (at(0.0), at(ONE_MINUS_EPSILON));
                last.filter(|l| first.is_none_or(|s| s.w_next != l.w_next)).into_iter().chain(first)
            }

            /// Least roughness of its lobes: 0 for Dirac, α of facets (at most 1), 1 for diffuse.
            #[inline]
            pub fn roughness(&self) -> f32 {
                match self {
                    Self::Black => 1.0,
                    $(Self::$name(lobe) => lobe.roughness(),)*
                    Self::Composite(lobes) => lobes.roughness(),
                }
            }
        }
    };
}

closed_set! { 'a:
    Diffuse of diffuse at a point diffuse::Diffuse;
    Dielectric of dielectric at a point dielectric::Dielectric;
    ThinDielectric of thin_dielectric at a point thin_dielectric::ThinDielectric;
    RoughDielectric of rough_dielectric at a point rough_dielectric::RoughDielectric;
    Conductor of conductor at a point conductor::Conductor;
    RoughConductor of rough_conductor at a point rough_conductor::RoughConductor;
    Plastic of plastic at a point plastic::Plastic;
    RoughPlastic of rough_plastic at a point rough_plastic::RoughPlastic<'a>;
    Principled of principled at a point principled::Principled;
    Null of null at a point null::Null;
}

/// Name of every model in a scene file with the source of its file, whose head is its manual.
pub const MODEL_SOURCES: [(&str, &str); 13] = [
    ("diffuse", include_str!("diffuse.rs")),
    ("dielectric", include_str!("dielectric.rs")),
    ("thindielectric", include_str!("thin_dielectric.rs")),
    ("roughdielectric", include_str!("rough_dielectric.rs")),
    ("conductor", include_str!("conductor.rs")),
    ("roughconductor", include_str!("rough_conductor.rs")),
    ("plastic", include_str!("plastic.rs")),
    ("roughplastic", include_str!("rough_plastic.rs")),
    ("principled", include_str!("principled.rs")),
    ("twosided", include_str!("two_sided.rs")),
    ("mask", include_str!("mask.rs")),
    ("null", include_str!("null.rs")),
    ("blendbsdf", include_str!("blend.rs")),
];
