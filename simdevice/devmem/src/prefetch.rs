//! Hints for what will be read soon.

/// Has items on their way to the caches, where the processor can be told so. It changes nothing but time.
#[inline(always)]
pub fn prefetch<T>(items: &[T]) {
    #[cfg(target_arch = "x86_64")]
    for start in (0..size_of_val(items)).step_by(CACHE_LINE) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: every x86-64 processor has the instruction, which is a hint: it neither faults nor changes what a
        // program sees. The address lies inside the slice.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(items.as_ptr().cast::<i8>().add(start)) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = items;
}

/// Bytes that caches hold together.
#[cfg(target_arch = "x86_64")]
const CACHE_LINE: usize = 64;
