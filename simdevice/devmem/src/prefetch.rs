//! Hints for what will be read soon.

/// Has items on their way to the caches, where the processor can be told so. It changes nothing but time.
#[inline(always)]
pub fn prefetch<T>(items: &[T]) {
    prefetch_bytes(items.as_ptr().cast(), size_of_val(items));
}

/// As [`prefetch`], of `size` bytes from `start` on, which nobody needs to be able to read.
#[inline(always)]
pub(crate) fn prefetch_bytes(start: *const u8, size: usize) {
    #[cfg(target_arch = "x86_64")]
    for offset in (0..size).step_by(CACHE_LINE) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: every x86-64 processor has the instruction, which is a hint: it neither faults, whatever the address,
        // nor changes what a program sees.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(start.wrapping_add(offset).cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (start, size);
}

/// Bytes that caches hold together.
#[cfg(target_arch = "x86_64")]
const CACHE_LINE: usize = 64;
