//! Two-sided: one model on the side of the normal, another (or the same) on the inside.
//!
//! f(w_i, w_o) = f_front where both lie in front; f_back of both mirrored at the surface where both
//! lie behind. Models that only reflect are one-sided by themselves, as in [Mitsuba 3]; this makes
//! them visible from both sides. What transmits already has two sides and is refused. It costs
//! nothing at run time: the two sides of a material are separate lists of lobes anyway.
//!
//! ```xml
//! <bsdf type="twosided">
//!     <bsdf type="diffuse">
//!         <rgb name="reflectance" value="0.4"/>
//!     </bsdf>
//! </bsdf>
//! ```

use super::Lobes;
use crate::describe::BsdfId;

/// The model that stands on the asked side.
pub(super) fn side(front: BsdfId, back: BsdfId, on_front: bool) -> BsdfId {
    if on_front { front } else { back }
}

/// Why a model with these lobes cannot be nested, if it cannot.
pub(super) fn refusal(nested: Lobes) -> Option<&'static str> {
    nested.transmits().then_some("a model that transmits light cannot be nested in `twosided`")
}
