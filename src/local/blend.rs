//! Blend: f = (1 − w)·f_first + w·f_second, with a weight w in [0, 1].
//!
//! A linear combination of two models [Mitsuba 3]; each is chosen with its share, and densities are
//! combined likewise, so that a non-Dirac sample of one is weighed against the other too.
//!
//! ```xml
//! <bsdf type="blendbsdf">
//!     <float name="weight" value="0.3"/>
//!     <bsdf type="conductor"/>
//!     <bsdf type="diffuse"/>
//! </bsdf>
//! ```

use super::composite::Part;
use crate::texture::TextureSlot;

/// The shares of the first and the second model; `None` where a share is zero everywhere.
pub(super) fn split(part: &Part, weight: TextureSlot) -> [Option<Part>; 2] {
    [part.times(weight, true), part.times(weight, false)]
}
