//! Physics of the local models: densities, energy, reciprocity.
//!
//! - [`models`]: those under test.
//! - [`chi2`]: a sampler against its density.

pub mod chi2;
pub mod models;

use crate::local::{Closure, Equation, Sample};
use crate::math::Random;
use crate::math::random::Family;
use crate::math::warp::{ONE_MINUS_EPSILON, sphere_uniform};
use chi2::{Window, p_value};
use glam::{Vec2, Vec3};
use models::{Case, directions};

/// Both equations.
pub const EQUATIONS: [Equation; 2] = [Equation::Rendering, Equation::Potential];

/// `n` events for a walk that came along `w_back`.
pub fn draw(case: &Case, equation: Equation, w_back: Vec3, seed: u64, n: usize) -> Vec<Option<Sample>> {
    let closure = case.at(w_back);
    let mut random = Random::new(Family::Other, seed, 0, 7);
    (0..n).map(|_| closure.sample(equation, w_back, random.unit(), random.unit2())).collect()
}

/// Windows that resolve the model: both sides of the surface for wide lobes; the facets that mirror
/// where lobes are narrow or grazing; the surroundings of the refracted direction.
pub fn windows(case: &Case, w_back: Vec3, samples: &[Option<Sample>]) -> Vec<Window> {
    let closure = case.at(w_back);
    let alpha = least_smooth_roughness(case, w_back);
    if closure.is_delta() {
        return vec![];
    }
    let through = samples.iter().flatten().filter(|s| !s.delta && s.w_next.z * w_back.z < 0.0);
    let axis: Vec3 = through.map(|s| s.w_next).sum();
    let reflected = if alpha >= 0.15 && w_back.z.abs() > 0.05 {
        Window::Side(w_back.z.signum())
    } else {
        Window::Facets(w_back, 6.0 * alpha)
    };
    let refracted = match axis.length() > 0.01 * samples.len() as f32 {
        false => None,
        true if alpha >= 0.15 => Some(Window::Side(-w_back.z.signum())),
        true => Some(Window::around(axis.normalize(), (6.0 * alpha).min(0.9))),
    };
    [reflected].into_iter().chain(refracted).collect()
}

/// As `roughness`, which is 0 where a smooth coat covers something rough.
pub fn least_smooth_roughness(case: &Case, w_back: Vec3) -> f32 {
    let alpha = case.at(w_back).roughness();
    if alpha > 0.0 { alpha } else { 1.0 }
}

/// A sampler compared with its density over one window of directions.
#[derive(Clone, Copy, Debug)]
pub struct DensityTest {
    /// Probability of a χ² as large as this.
    pub p: f64,
    /// Integral of the density over the window, at most 1.
    pub integral: f64,
    /// The model.
    pub model: &'static str,
    /// The direction from which events are drawn.
    pub w_back: Vec3,
}

/// Every window of every fixed direction of model number `c`, by `samples` events each.
pub fn densities(c: usize, case: &Case, samples: usize) -> Vec<DensityTest> {
    let mut tests = Vec::new();
    for (d, w_back) in directions().into_iter().enumerate() {
        let drawn = draw(case, EQUATIONS[(c + d) % 2], w_back, (100 * c + d) as u64, samples);
        let closure = case.at(w_back);
        for window in windows(case, w_back, &drawn) {
            let expected = window.integrate(|w| f64::from(closure.density(w_back, w)));
            let counts = window.count(drawn.iter().map(|s| s.filter(|s| !s.delta).map(|s| s.w_next)));
            let integral = expected.iter().sum();
            tests.push(DensityTest { p: p_value(&expected, &counts), integral, model: case.name, w_back });
        }
    }
    tests
}

/// Mean share scattered from `w_back`, counted in basic radiance, by a lattice in the sampler's cube.
pub fn scattered(case: &Case, equation: Equation, w_back: Vec3) -> f64 {
    const N: u32 = 4093;
    let mut sum = 0.0;
    for i in 0..N {
        // A rank-1 lattice with the powers of a root of x⁴ = x + 1.
        let at = |step: f64| (((0.5 + f64::from(i) * step) % 1.0) as f32).min(ONE_MINUS_EPSILON);
        let (u_lobe, u) = (at(0.819_172_513_4), Vec2::new(at(0.671_043_606_7), at(0.549_700_477_9)));
        if let Some(s) = case.at(w_back).sample(equation, w_back, u_lobe, u) {
            let basic = match equation {
                Equation::Rendering => s.eta * s.eta,
                Equation::Potential => 1.0,
            };
            sum += f64::from(s.weight.max_lane() * basic);
        }
    }
    sum / f64::from(N)
}

/// Whether a smooth or very rough lossless model must scatter all that it receives from `w_back`, and how nearly:
/// one-sided models are black behind, rough facets shadow one another.
pub fn keeps_energy(case: &Case, w_back: Vec3) -> Option<f64> {
    let closure = case.at(w_back);
    let rough = case.name.starts_with("rough");
    let shadowed = closure.roughness() > 0.01 && closure.roughness() < 1.0;
    let grazing = rough && (w_back.z.abs() < 0.5 || closure.roughness() == 1.0);
    let exempt = !case.lossless || matches!(closure, Closure::Black) || shadowed || grazing;
    (!exempt).then_some(if rough { 1e-3 } else { 1e-5 })
}

/// What f is in both directions of light.
#[derive(Clone, Copy, Debug)]
pub struct Reciprocity {
    /// Pairs of directions between which something is scattered.
    pub compared: usize,
    /// Largest deviation of f(w_i → w_o)/η_o² from f(w_o → w_i)/η_i², in units of what rounding allows.
    pub worst: f32,
    /// Between these directions.
    pub between: (Vec3, Vec3),
}

/// Reciprocity of model number `c` between `pairs` pairs of directions.
pub fn reciprocity(c: usize, case: &Case, pairs: usize) -> Reciprocity {
    let index = |w: Vec3| if w.z > 0.0 { 1.0 } else { case.eta };
    let basic = |w: Vec3| 1.0 / (index(w) * index(w));
    let mut random = Random::new(Family::Other, c as u64, 3, 0);
    let mut found = Reciprocity { compared: 0, worst: 0.0, between: (Vec3::Z, Vec3::Z) };
    for i in 0..pairs {
        let a = sphere_uniform(random.unit2());
        // Half of the pairs where the model sends something.
        let b = match case.at(a).sample(Equation::Rendering, a, random.unit(), random.unit2()) {
            Some(s) if i % 2 == 0 && !s.delta => s.w_next,
            _ => sphere_uniform(random.unit2()),
        };
        if case.at(a).roughness() < 0.01 && (a + b).length() < 0.2 {
            continue;
        }
        let light_b_to_a = case.at(a).evaluate(Equation::Rendering, a, b).f * basic(a);
        let light_a_to_b = case.at(b).evaluate(Equation::Rendering, b, a).f * basic(b);
        let potential = case.at(b).evaluate(Equation::Potential, b, a).f * basic(a);
        let tolerance = if case.at(a).roughness() < 0.01 { 0.1 } else { 2e-3 };
        for ((x, y), z) in light_b_to_a.to_rgb().into_iter().zip(light_a_to_b.to_rgb()).zip(potential.to_rgb()) {
            let off = (x - y).abs().max((x - z).abs()) / (tolerance * x.max(y) + 1e-6);
            if !(off <= found.worst) {
                (found.worst, found.between) = (off, (a, b));
            }
            found.compared += usize::from(x > 0.0);
        }
    }
    found
}
