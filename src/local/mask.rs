//! Mask: f = o·f_inner + (1 − o)·(straight through), with opacity o in [0, 1].
//!
//! A cut-out: the transparent part is the Dirac function of [`null`](super::null) [Mitsuba 3].
//! The inner model is chosen with probability o, so that the weights of both kinds of events are
//! what they would be alone.
//!
//! ```xml
//! <bsdf type="mask">
//!     <texture name="opacity" type="checkerboard"/>
//!     <bsdf type="twosided">
//!         <bsdf type="diffuse"/>
//!     </bsdf>
//! </bsdf>
//! ```

use super::composite::Part;
use crate::texture::TextureSlot;

/// The share of the inner model and of the hole; `None` where a share is zero everywhere.
pub(super) fn split(part: &Part, opacity: TextureSlot) -> [Option<Part>; 2] {
    [part.times(opacity, false), part.times(opacity, true)]
}
