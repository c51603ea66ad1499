//! A path vertex and the one kernel of both equations.
//!
//! ```text
//! kernel(w_i, w_o) = f(w_i, w_o) · |w_i·n_s| / |w_i·n_g|
//! ```
//!
//! projected with the geometric cosine of the side that is sampled. Gathering (w_i is the next
//! direction) this is the plain `f |w_next·n_s|`; shooting (w_i is the direction back) it is the
//! adjoint correction of shading normals [Veach 1997, p. 155]. A pair of directions on which shading
//! and geometric normal disagree about the side scatters nothing, for both walkers alike.

use super::incident::{Incident, LEARNED, Lobes};
use super::mutant::{Mutant, planted};
use crate::local::{Breadth, Closure, Equation, Sample};
use crate::math::Frame;
use crate::math::warp::ONE_MINUS_EPSILON;
use crate::scene::{Scene, Surface};
use crate::spectrum::Spectrum;
use glam::Vec3;

/// A surface point with its local model resolved for the direction it was reached from.
pub struct Vertex<'a> {
    /// The point.
    pub surface: Surface,
    /// Local coordinates around n_s.
    pub frame: Frame,
    /// The local model as numbers.
    pub closure: Closure<'a>,
    /// Unit direction to the predecessor, world.
    pub w_back: Vec3,
    /// The same in local coordinates.
    pub back: Vec3,
    /// `w_back · n_g`, signed.
    pub cos_g_back: f32,
    /// Of all its events.
    pub breadth: Breadth,
    /// Where the gathering walker has learned that light comes from.
    learned: Learned<'a>,
}

/// What is learned of the directions at a vertex, as far as a walker must know it.
#[derive(Clone, Copy, Debug)]
enum Learned<'a> {
    Nothing,
    /// All, for the gathering walker.
    Directions(&'a Lobes),
    /// The density of `w_back`, for the shooting walker.
    Back(f32),
}

/// The kernel towards one direction, with what the weights need.
#[derive(Clone, Copy, Debug)]
pub struct Kernel {
    /// `f · |w_i·n_s|/|w_i·n_g| · |w_next·n_g|`.
    pub value: Spectrum,
    /// Density per steradian of sampling `w_next`.
    pub p_w: f32,
    /// Density per steradian of the other walker sampling `w_back`.
    pub p_w_rev: f32,
    /// `|w_next · n_g|`.
    pub cos_g: f32,
}

/// A sampled direction, kernel and cosines included.
#[derive(Clone, Copy, Debug)]
pub struct Scatter {
    /// Unit direction, world.
    pub w_next: Vec3,
    /// Factor on the throughput.
    pub weight: Spectrum,
    /// Density per steradian, or probability of the lobe of a Dirac event.
    pub p: f32,
    /// The same for the other walker.
    pub p_rev: f32,
    /// `|w_next · n_g|`.
    pub cos_g: f32,
    /// A Dirac event.
    pub delta: bool,
    /// That of the material, or sharp for a Dirac event.
    pub breadth: Breadth,
    /// Part of the directions here that gathering takes by the local model.
    pub by_model: f32,
    /// Density of the event relative to that by the local model alone: not 1 where gathering goes where light comes from.
    pub guided: f32,
    /// Ratio of the Dirac functions, see [`crate::local::Sample::dirac_ratio`].
    pub dirac_ratio: f32,
    /// Refractive index on the side of `w_next` over that on the side of `w_back`.
    pub eta: f32,
}

/// What `incident` knows of a point, if the material is one for which it matters.
#[inline]
fn directions<'i>(scene: &Scene, incident: Option<&'i Incident>, surface: &Surface, cos_g_back: f32) -> Option<&'i Lobes> {
    let incident = incident.filter(|_| scene.materials.is_guided(surface.material))?;
    incident.at(surface.p, surface.n_g * cos_g_back.signum())
}

impl<'a> Vertex<'a> {
    /// Resolves the local model at `surface` for the unit direction `w_back`.
    #[inline]
    pub fn new(scene: &'a Scene, surface: Surface, w_back: Vec3) -> Self {
        Self::with(scene, surface, w_back, |_| Learned::Nothing)
    }

    /// The same where something may have been learned; made in place, since it is large.
    #[inline(always)]
    fn with(scene: &'a Scene, surface: Surface, w_back: Vec3, learned: impl FnOnce(f32) -> Learned<'a>) -> Self {
        let frame = if scene.materials.needs_tangent(surface.material) {
            Frame::with_tangent(surface.n_s, surface.dp_du)
        } else {
            Frame::around(surface.n_s)
        };
        let back = frame.to_local(w_back);
        let closure = scene.materials.resolve(surface.material, surface.uv, back.z > 0.0);
        let breadth = scene.materials.breadth(surface.material);
        let cos_g_back = w_back.dot(surface.n_g);
        Self { surface, frame, closure, w_back, back, cos_g_back, breadth, learned: learned(cos_g_back) }
    }

    /// The same for a gathering walk, which goes where light comes from as far as `incident` knows.
    #[inline]
    pub fn gathering(scene: &'a Scene, incident: Option<&'a Incident>, surface: Surface, w_back: Vec3) -> Self {
        Self::with(scene, surface, w_back, |cos_g_back| {
            directions(scene, incident, &surface, cos_g_back).map_or(Learned::Nothing, Learned::Directions)
        })
    }

    /// The same for a shooting walk, which must know how a gathering walk would go.
    #[inline]
    pub fn shooting(scene: &'a Scene, incident: Option<&Incident>, surface: Surface, w_back: Vec3) -> Self {
        Self::with(scene, surface, w_back, |cos_g_back| {
            let directions = directions(scene, incident, &surface, cos_g_back);
            directions.map_or(Learned::Nothing, |d| Learned::Back(d.density(w_back)))
        })
    }

    /// The density with which `w_back` would be taken as a learned direction; negative where nothing was learned.
    #[inline]
    pub fn learned_back(&self) -> f32 {
        if let Learned::Back(density) = self.learned { density } else { -1.0 }
    }

    /// The vertex of a shooting walk once more; where not all events are focused, with what [`Self::learned_back`] told.
    #[inline]
    pub fn again(scene: &'a Scene, surface: Surface, w_back: Vec3, learned_back: f32) -> Self {
        let mut vertex = Self::new(scene, surface, w_back);
        if learned_back >= 0.0 && !vertex.breadth.is_focused() {
            vertex.learned = Learned::Back(learned_back);
        }
        vertex
    }

    /// Part of the directions that gathering takes by the local model.
    #[inline]
    pub fn by_model(&self) -> f32 {
        if matches!(self.learned, Learned::Nothing) { 1.0 } else { 1.0 - LEARNED }
    }

    /// Density per steradian with which gathering takes a direction that the local model takes with density `p`:
    /// `w_next` of a gathering walk, `w_back` of a shooting one.
    #[inline]
    fn gathers(&self, p: f32, w_next: Vec3) -> f32 {
        let learned = match self.learned {
            Learned::Nothing => return p,
            Learned::Directions(d) => d.density(w_next),
            Learned::Back(_) if planted(Mutant::LearnedDensity) => return p,
            Learned::Back(density) => density,
        };
        (1.0 - LEARNED) * p + LEARNED * learned
    }

    /// Density per steradian of [`Self::scatter`] choosing the unit direction `w_next`, Dirac events apart.
    #[inline]
    pub fn density(&self, w_next: Vec3) -> f32 {
        let p = self.closure.density(self.back, self.frame.to_local(w_next));
        if matches!(self.learned, Learned::Back(_)) { p } else { self.gathers(p, w_next) }
    }

    /// Whether shading and geometric normal agree about the sides of both directions.
    #[inline]
    fn sides_agree(&self, next: Vec3, cos_g_next: f32) -> bool {
        self.back.z * self.cos_g_back > 0.0 && next.z * cos_g_next > 0.0
    }

    /// `|w_i·n_s|/|w_i·n_g| · |w_next·n_g|`, what multiplies f.
    #[inline]
    fn projection(&self, equation: Equation, next: Vec3, cos_g_next: f32) -> f32 {
        match equation {
            Equation::Rendering => next.z.abs(),
            Equation::Potential if planted(Mutant::AdjointShadingNormal) => next.z.abs(),
            Equation::Potential => (self.back.z * cos_g_next / self.cos_g_back).abs(),
        }
    }

    /// The kernel towards unit `w_next`, `None` where it is zero. Non-Dirac part.
    #[inline]
    pub fn kernel(&self, equation: Equation, w_next: Vec3) -> Option<Kernel> {
        let mut k = self.kernel_by_model(equation, w_next)?;
        let of_gathering = match equation {
            Equation::Rendering => &mut k.p_w,
            Equation::Potential => &mut k.p_w_rev,
        };
        *of_gathering = self.gathers(*of_gathering, w_next);
        Some(k)
    }

    /// The same with the densities of the local model alone.
    #[inline]
    fn kernel_by_model(&self, equation: Equation, w_next: Vec3) -> Option<Kernel> {
        let next = self.frame.to_local(w_next);
        let cos_g = w_next.dot(self.surface.n_g);
        if !self.sides_agree(next, cos_g) {
            return None;
        }
        let e = self.closure.evaluate(equation, self.back, next);
        if e.f.is_black() {
            return None;
        }
        let value = e.f * self.projection(equation, next, cos_g);
        Some(Kernel { value, p_w: e.p_w, p_w_rev: e.p_w_rev, cos_g: cos_g.abs() })
    }

    /// Samples the next direction.
    #[inline]
    pub fn scatter(&self, equation: Equation, mut u_lobe: f32, u: glam::Vec2) -> Option<Scatter> {
        if let Learned::Directions(directions) = self.learned {
            if u_lobe < LEARNED {
                return self.scatter_learned(directions.sample(u));
            }
            u_lobe = ((u_lobe - LEARNED) / (1.0 - LEARNED)).min(ONE_MINUS_EPSILON);
        }
        let mut s = self.scattered(equation, self.closure.sample(equation, self.back, u_lobe, u)?)?;
        let of_gathering = match equation {
            Equation::Rendering => &mut s.p,
            Equation::Potential => &mut s.p_rev,
        };
        let p = *of_gathering;
        s.by_model = self.by_model();
        *of_gathering = if s.delta { self.by_model() * p } else { self.gathers(p, s.w_next) };
        if equation == Equation::Rendering && s.p != p {
            s.guided = s.p / p;
            s.weight /= s.guided;
        }
        Some(s)
    }

    /// A gathering walk goes on along a learned direction.
    #[inline]
    fn scatter_learned(&self, w_next: Vec3) -> Option<Scatter> {
        let k = self.kernel_by_model(Equation::Rendering, w_next)?;
        let p = self.gathers(k.p_w, w_next);
        Some(Scatter {
            w_next,
            weight: k.value / p,
            p,
            p_rev: k.p_w_rev,
            cos_g: k.cos_g,
            delta: false,
            breadth: self.breadth,
            by_model: self.by_model(),
            guided: if k.p_w > 0.0 { p / k.p_w } else { 1.0 },
            dirac_ratio: 1.0,
            eta: 1.0,
        })
    }

    /// Every Dirac event, lobes that share a direction apart: its weight times its probability is its coefficient.
    #[inline]
    pub fn each_dirac(&self, equation: Equation, mut f: impl FnMut(Scatter)) {
        self.closure.each_dirac(equation, self.back, |s| {
            if let Some(s) = self.scattered(equation, s) {
                f(s);
            }
        });
    }

    #[inline]
    fn scattered(&self, equation: Equation, s: Sample) -> Option<Scatter> {
        // Straight through: the direction must not pick up rounding, nor be subject to sides.
        let straight = s.delta && s.w_next == -self.back;
        let w_next = if straight { -self.w_back } else { self.frame.to_world(s.w_next) };
        let cos_g = w_next.dot(self.surface.n_g);
        if !straight && !self.sides_agree(s.w_next, cos_g) {
            return None;
        }
        let mut weight = s.weight;
        if equation == Equation::Potential && !straight {
            let next_z = s.w_next.z.abs();
            weight *= self.projection(equation, s.w_next, cos_g) / next_z;
        }
        if planted(Mutant::RefractionEtaSquared) && s.delta && equation == Equation::Rendering {
            weight *= s.eta * s.eta;
        }
        Some(Scatter {
            w_next,
            weight,
            p: s.p,
            p_rev: s.p_rev,
            cos_g: cos_g.abs(),
            delta: s.delta,
            breadth: if s.delta { Breadth::Sharp } else { self.breadth },
            by_model: 1.0,
            guided: 1.0,
            dirac_ratio: s.dirac_ratio,
            eta: s.eta,
        })
    }
}
