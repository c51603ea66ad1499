//! Asking for memory before it is needed.
#![allow(unsafe_code)]

/// Asks for all cache lines of what `x` points at, to be read soon. A hint: nothing else happens, wherever it points.
#[inline(always)]
pub fn prefetch<T>(x: *const T) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        let (last, start) = (size_of::<T>().saturating_sub(1), x.cast::<i8>());
        for at in (0..size_of::<T>()).step_by(64) {
            // SAFETY: a prefetch reads nothing and faults nowhere.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(start.wrapping_add(at)) };
        }
        // Where it may begin so late in its first line that it ends in one more.
        if last % 64 >= align_of::<T>() {
            // SAFETY: as above.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(start.wrapping_add(last)) };
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = x;
}
