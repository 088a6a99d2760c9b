//! Hints to the host and to the processor, huge pages and prefetches, which change only the time that accesses take; and
//! what the host says of pages.

/// The alignment of every allocation in bytes, and the granularity at which the host backs it with pages.
pub const PAGE_SIZE: u64 = 4096;

/// The least size of a range for which huge pages are requested. With them a range is backed in fewer steps, and
/// scattered reads of it miss the TLB less often. In smaller ranges too many pages would be backed that are never used.
#[cfg(target_os = "linux")]
const LEAST_HUGE: usize = 8 << 20;

/// The size of a huge page on all common processors, in bytes.
#[cfg(target_os = "linux")]
const HUGE_PAGE: usize = 2 << 20;

/// Requests huge pages for the part of a large range that they fit into. It changes only the time that accesses take.
///
/// # Safety
/// The `len` bytes from `start` on must belong to one allocation of the caller.
pub(crate) unsafe fn prefer_huge(start: *mut u8, len: usize) {
    #[cfg(target_os = "linux")]
    if len >= LEAST_HUGE {
        use rustix::mm::{Advice, madvise};
        let before = start.addr().wrapping_neg() % HUGE_PAGE;
        let whole = (len - before) / HUGE_PAGE * HUGE_PAGE;
        let first = start.wrapping_add(before);
        // SAFETY: the pages are the caller's, and nothing depends on the size of the pages that back them. A host
        // without huge pages returns an error, which changes nothing.
        let _ = unsafe { madvise(first.cast(), whole, Advice::LinuxHugepage) };
    }
    #[cfg(not(target_os = "linux"))]
    let _ = (start, len);
}

/// Reports whether something is mapped in every page of a range, as far as the host tells.
pub(crate) fn is_mapped(start: *mut u8, len: usize) -> bool {
    #[cfg(target_os = "linux")]
    {
        use rustix::mm::{MsyncFlags, msync};
        let page = rustix::param::page_size();
        let before = start.addr() % page;
        // SAFETY: with this flag the host looks whether the pages are mapped, and changes nothing.
        unsafe { msync(start.wrapping_sub(before).cast(), len + before, MsyncFlags::ASYNC) }.is_ok()
    }
    #[cfg(not(target_os = "linux"))]
    {
        let _ = (start, len);
        true
    }
}

/// The size of a cache line in bytes.
#[cfg(target_arch = "x86_64")]
const CACHE_LINE: usize = 64;

/// Prefetches items into the caches, if the processor can. It changes only the time that accesses take.
#[inline(always)]
pub fn prefetch<T>(items: &[T]) {
    prefetch_bytes(items.as_ptr().cast(), size_of_val(items));
}

/// Prefetches `size` bytes from `start` on, as [`prefetch`] does. They need not be readable.
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
