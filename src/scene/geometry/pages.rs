//! An immutable array, on huge pages where the system grants them.
//!
//! Rays visit nodes all over memory; with 4 KiB pages most visits to a large tree also miss the
//! table of pages. Arrays of 2 MiB and more are aligned to 2 MiB and recommended for huge pages
//! (Linux); the advice may be refused without harm.
#![allow(unsafe_code)]

use std::alloc::{Layout, alloc, dealloc, handle_alloc_error};
use std::ops::Deref;
use std::ptr::NonNull;

const HUGE: usize = 2 << 20;

/// An immutable array of plain values.
pub(super) struct Pages<T: Copy> {
    start: NonNull<T>,
    len: usize,
    layout: Layout,
}

// SAFETY: an owned, immutable array of plain values.
unsafe impl<T: Copy + Send> Send for Pages<T> {}
// SAFETY: as above.
unsafe impl<T: Copy + Sync> Sync for Pages<T> {}

impl<T: Copy> Pages<T> {
    /// A copy of `items`.
    pub(super) fn new(items: &[T]) -> Self {
        let bytes = size_of_val(items);
        let small = Layout::for_value(items);
        let (size, align) = if bytes >= HUGE { (bytes.next_multiple_of(HUGE), HUGE) } else { (bytes, small.align().max(64)) };
        let layout = Layout::from_size_align(size, align).unwrap_or(small);
        if bytes == 0 {
            return Self { start: NonNull::dangling(), len: 0, layout };
        }
        // SAFETY: the size is not zero (above); the memory is filled before it is read.
        let start = unsafe { alloc(layout) };
        let Some(start) = NonNull::new(start) else { handle_alloc_error(layout) };
        advise(start.as_ptr(), layout.size());
        let start = start.cast::<T>();
        // SAFETY: the layout holds at least `bytes`, the areas do not overlap, T is plain.
        unsafe { std::ptr::copy_nonoverlapping(items.as_ptr(), start.as_ptr(), items.len()) };
        Self { start, len: items.len(), layout }
    }
}

#[cfg(target_os = "linux")]
fn advise(start: *mut u8, bytes: usize) {
    unsafe extern "C" {
        fn madvise(addr: *mut u8, length: usize, advice: i32) -> i32;
    }
    const MADV_HUGEPAGE: i32 = 14;
    if bytes >= HUGE {
        // SAFETY: an own, page-aligned range; the advice changes no content. Refusal is harmless.
        unsafe { madvise(start, bytes, MADV_HUGEPAGE) };
    }
}

#[cfg(not(target_os = "linux"))]
fn advise(_: *mut u8, _: usize) {}

impl<T: Copy> Drop for Pages<T> {
    fn drop(&mut self) {
        if self.len * size_of::<T>() > 0 {
            // SAFETY: allocated in `new` with this layout.
            unsafe { dealloc(self.start.as_ptr().cast(), self.layout) };
        }
    }
}

impl<T: Copy> Deref for Pages<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        // SAFETY: `len` values were written in `new`.
        unsafe { std::slice::from_raw_parts(self.start.as_ptr(), self.len) }
    }
}

impl<T: Copy> Default for Pages<T> {
    fn default() -> Self {
        Self::new(&[])
    }
}
