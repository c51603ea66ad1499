//! Eight numbers in one AVX2 register, products fused into sums.
//!
//! The type exists only where the processor has AVX2, FMA, BMI1/2, LZCNT and POPCNT: its two entry
//! points are `unsafe` and the caller has asked the processor ([`available`]). Everything else is
//! forced inline into them, so that it is compiled with those instructions.
#![allow(unsafe_code)]

use super::Hit;
use super::lanes::Lanes;
use super::ray::Ray;
use super::traverse::traverse;
use super::tree::Tree;
use std::arch::x86_64::*;

/// Does this processor have what the functions below use?
pub(super) fn available() -> bool {
    is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("fma")
        && is_x86_feature_detected!("bmi1")
        && is_x86_feature_detected!("bmi2")
        && is_x86_feature_detected!("lzcnt")
        && is_x86_feature_detected!("popcnt")
}

/// One 256-bit register.
#[derive(Clone, Copy)]
pub(super) struct Avx2(__m256);

/// Traversal of the whole scene.
///
/// # Safety
/// [`available`] has returned true.
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
pub(super) unsafe fn traverse_scene<const ANY: bool>(tree: &Tree, root: u32, ray: &Ray) -> Hit {
    traverse::<Avx2, ANY, true>(tree, root, ray)
}

/// Traversal of the subtree of an instance.
///
/// # Safety
/// [`available`] has returned true.
#[inline(never)]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
unsafe fn traverse_group<const ANY: bool>(tree: &Tree, root: u32, ray: &Ray) -> Hit {
    traverse::<Avx2, ANY, false>(tree, root, ray)
}

// SAFETY of every block below: an `Avx2` is only made inside the two functions above, whose callers
// know that the processor has these instructions.
impl Lanes for Avx2 {
    type Mask = __m256;

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self(unsafe { _mm256_set1_ps(x) })
    }

    #[inline(always)]
    fn load(x: &[f32; 8]) -> Self {
        Self(unsafe { _mm256_loadu_ps(x.as_ptr()) })
    }

    #[inline(always)]
    fn store(self) -> [f32; 8] {
        let mut out = [0.0; 8];
        unsafe { _mm256_storeu_ps(out.as_mut_ptr(), self.0) };
        out
    }

    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Self(unsafe { _mm256_add_ps(self.0, b.0) })
    }

    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Self(unsafe { _mm256_sub_ps(self.0, b.0) })
    }

    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        Self(unsafe { _mm256_mul_ps(self.0, b.0) })
    }

    #[inline(always)]
    fn div(self, b: Self) -> Self {
        Self(unsafe { _mm256_div_ps(self.0, b.0) })
    }

    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        Self(unsafe { _mm256_fmadd_ps(self.0, b.0, c.0) })
    }

    #[inline(always)]
    fn mul_sub(self, b: Self, c: Self) -> Self {
        Self(unsafe { _mm256_fmsub_ps(self.0, b.0, c.0) })
    }

    #[inline(always)]
    fn min(self, b: Self) -> Self {
        Self(unsafe { _mm256_min_ps(self.0, b.0) })
    }

    #[inline(always)]
    fn max(self, b: Self) -> Self {
        Self(unsafe { _mm256_max_ps(self.0, b.0) })
    }

    #[inline(always)]
    fn le(self, b: Self) -> __m256 {
        unsafe { _mm256_cmp_ps::<_CMP_LE_OQ>(self.0, b.0) }
    }

    #[inline(always)]
    fn lt(self, b: Self) -> __m256 {
        unsafe { _mm256_cmp_ps::<_CMP_LT_OQ>(self.0, b.0) }
    }

    #[inline(always)]
    fn and(a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_and_ps(a, b) }
    }

    #[inline(always)]
    fn or(a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_or_ps(a, b) }
    }

    #[inline(always)]
    fn bits(m: __m256) -> u32 {
        unsafe { _mm256_movemask_ps(m) as u32 }
    }

    #[inline(always)]
    fn enter<const ANY: bool>(tree: &Tree, root: u32, ray: &Ray) -> Hit {
        unsafe { traverse_group::<ANY>(tree, root, ray) }
    }
}
