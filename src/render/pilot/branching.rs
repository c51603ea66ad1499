//! How faint a branch may be that is followed for sure: what chains of Dirac events to a lamp ([`transport::chain`])
//! leave to chance is noise, what they follow is work.
//!
//! A path of share s of the pixel comes with probability s/faint where s is below [`Settings::faint`], with as much
//! more of value, so its second moment is faint/s times the square of the path. The pilot follows branches down to
//! [`LEAST`] and judges all others by what it finds.
//!
//! [`transport::chain`]: crate::transport::chain
//! [`Settings::faint`]: crate::transport::settings::Settings::faint

use crate::transport::settings::{FAINT, NO_BRANCHES};

/// The faintest branches that the pilot follows for sure.
pub(super) const LEAST: f32 = 1e-4;
/// What is considered, the default first; the last stands for no branches.
const FAINTEST: [f32; 5] = [FAINT, 1e-1, 1e-3, LEAST, NO_BRANCHES];

/// What comes of a value of [`Settings::faint`](crate::transport::settings::Settings::faint).
#[derive(Clone, Copy, Debug)]
pub(super) struct Branching {
    pub(super) faint: f32,
    /// Noise of a pass.
    pub(super) noise: f64,
    /// Rays per gathering walk.
    pub(super) rays: f64,
}

/// Rays of branches for each of [`FAINTEST`], and those that the pilot followed.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BranchRays {
    of: [f64; FAINTEST.len()],
    pub(super) all: f64,
}

impl BranchRays {
    /// A ray of a branch that carries `share` of its pixel.
    pub(super) fn count(&mut self, share: f32) {
        self.all += 1.0;
        let often = |faint: f32| f64::from(share / faint).min(1.0);
        for (rays, faint) in self.of.iter_mut().zip(FAINTEST).take(FAINTEST.len() - 1) {
            *rays += often(faint) / often(LEAST);
        }
    }

    pub(super) fn join(&mut self, other: Self) {
        self.of.iter_mut().zip(other.of).for_each(|(a, b)| *a += b);
        self.all += other.all;
    }

    /// Every choice, from the squares of what chains found (relative to the picture) and their shares, and the number
    /// of walks; only the one that is given where that says no branches.
    pub(super) fn judged(&self, given: f32, chains: impl Iterator<Item = (f64, f32)> + Clone, walks: u32) -> Vec<Branching> {
        if given >= NO_BRANCHES {
            return vec![Branching { faint: given, noise: 0.0, rays: 0.0 }];
        }
        let excess = |faint: f32, share: f32| f64::from(faint / share).max(1.0);
        // What every sample finds has no noise of this kind.
        let noise = |faint| chains.clone().map(|(square, s)| square * (excess(faint, s) - 1.0) / excess(LEAST, s)).sum();
        let judge = |(&faint, rays): (&f32, f64)| Branching { faint, noise: noise(faint), rays: rays / f64::from(walks.max(1)) };
        FAINTEST.iter().zip(self.of).map(judge).collect()
    }
}
