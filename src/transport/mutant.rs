//! Planted mistakes: with the feature `mutants` a test can switch one on and must see it caught.
//!
//! Without the feature [`planted`] is the constant `false` and costs nothing.

/// A mistake that the physics tests must notice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Mutant {
    /// The adjoint factor of shading normals is left out of shooting.
    AdjointShadingNormal = 1,
    /// The factor η² is left out of smooth refraction when gathering.
    RefractionEtaSquared = 2,
    /// Splats are normalised by the pixels of the crop window instead of the light paths.
    SplatCropNormalisation = 3,
    /// The density of next events forgets the choice of the emitter.
    NextEventDensity = 4,
    /// Russian roulette does not divide by its probability.
    RouletteFactor = 5,
    /// The geometric cosine is dropped where a solid angle becomes an area.
    AreaCosine = 6,
    /// A merge takes the cosine twice: in the kernel and in the flux per area.
    MergeCosine = 7,
    /// A walk forgets that a merge was possible at the vertex before.
    MergeWeight = 8,
    /// A walk whose chain was followed in all branches finds the light at its end once more.
    ChainTwice = 9,
    /// A walk counts its chain in full beside the samples of chains of its pixel.
    ChainPart = 10,
    /// A hit counts a lamp that a splat counts as well.
    LampTwice = 11,
    /// The shooting walker does not know that gathering goes where light comes from.
    LearnedDensity = 12,
    /// Where a walk splits, both ways count in full.
    SplitInFull = 13,
    /// A merge that is met by chance counts in full however many it finds at once.
    Crowd = 14,
    /// Gathering walks do not know that their pixel has several in a pass.
    SampleMap = 15,
    /// Where next events see all of few lights, each counts as if it alone had been picked.
    FewLights = 16,
}

#[cfg(feature = "mutants")]
static PLANTED: std::sync::atomic::AtomicU8 = std::sync::atomic::AtomicU8::new(0);

/// Switches one mistake on (or all off).
#[cfg(feature = "mutants")]
pub fn plant(mutant: Option<Mutant>) {
    PLANTED.store(mutant.map_or(0, |m| m as u8), std::sync::atomic::Ordering::SeqCst);
}

/// Whether the mistake is on.
#[cfg(feature = "mutants")]
#[inline]
pub fn planted(mutant: Mutant) -> bool {
    PLANTED.load(std::sync::atomic::Ordering::Relaxed) == mutant as u8
}

/// Whether the mistake is on: never, in a build without the feature.
#[cfg(not(feature = "mutants"))]
#[inline(always)]
pub const fn planted(_: Mutant) -> bool {
    false
}
