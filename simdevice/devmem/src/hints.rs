//! Hints to the host and to the processor: large pages, and lines of caches. They change nothing but time.

/// Ranges from this many bytes on have huge pages, where the host has some: they are backed in fewer steps, and what is read
/// all over a large one would look up a page's address nearly each time else. Of smaller ones too much would be backed that is
/// never used.
#[cfg(target_os = "linux")]
const LEAST_HUGE: usize = 8 << 20;

/// What the host may back at once on all common processors.
#[cfg(target_os = "linux")]
const HUGE_PAGE: usize = 2 << 20;

/// Asks for huge pages in as much of a range as they fit into, if that is large. It changes nothing but time.
///
/// # Safety
/// The `len` bytes from `start` on are one allocation of the caller's.
pub(crate) unsafe fn prefer_huge(start: *mut u8, len: usize) {
    #[cfg(target_os = "linux")]
    if len >= LEAST_HUGE {
        use rustix::mm::{Advice, madvise};
        let before = start.addr().wrapping_neg() % HUGE_PAGE;
        let whole = (len - before) / HUGE_PAGE * HUGE_PAGE;
        let first = start.wrapping_add(before);
        // SAFETY: the pages are the caller's; with which size they are backed nothing depends on. A host that has no huge pages
        // says so, and all is as it was.
        let _ = unsafe { madvise(first.cast(), whole, Advice::LinuxHugepage) };
    }
    #[cfg(not(target_os = "linux"))]
    let _ = (start, len);
}

/// Bytes that caches hold together.
#[cfg(target_arch = "x86_64")]
const CACHE_LINE: usize = 64;

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
