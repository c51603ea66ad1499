//! Checkerboard: field 0 where the fractional parts of u and v lie in the same half, else field 1.
//!
//! A fractional part of exactly ½ belongs to the lower half, as in Mitsuba 3. The two colours may be
//! textures themselves; they see the coordinates before `to_uv`.
//!
//! ```xml
//! <texture type="checkerboard" name="reflectance">
//!     <rgb name="color0" value="0.8 0.7 0.6"/>
//!     <float name="color1" value="0.1"/>
//!     <transform name="to_uv"><scale x="4" y="4"/></transform>
//! </texture>
//! ```

use super::TextureSlot;
use glam::{Affine2, Vec2};

/// Two textures in a chequered pattern, two by two fields per unit of mapped uv.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Checkerboard {
    /// Textures of the two fields.
    pub colors: [TextureSlot; 2],
    /// Applied to uv before the pattern.
    pub to_uv: Affine2,
}

impl Checkerboard {
    /// Which of the two colours lies at `uv`: 0 or 1.
    #[inline]
    pub fn field(&self, uv: Vec2) -> usize {
        let p = self.to_uv.transform_point2(uv);
        let upper = (p - p.floor()).cmpgt(Vec2::splat(0.5));
        usize::from(upper.x != upper.y)
    }
}
