//! Huge pages: hints for large ranges.

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
