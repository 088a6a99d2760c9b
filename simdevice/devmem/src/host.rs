//! Host memory for data whose size an application decides: sorted sets, bins, tile lists, copies of descriptors.
//!
//! The standard library's vectors abort the process if the host has no memory left. These functions unwind instead,
//! with [`OutOfMemory`] as the payload and without the panic hook, to the nearest boundary that can report it to the
//! application: a packet, which loses the device with a message, or an entry point, which returns
//! `VK_ERROR_OUT_OF_HOST_MEMORY`. Both call [`catch`]. Unwinding drops partly built objects.
//!
//! [`injection`] can make every allocation here, and every allocation of device memory, fail.

use crate::hints;
use bytemuck::Zeroable;
use std::alloc::{Layout, alloc_zeroed};
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

/// The error that the host has no memory left.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the host has no {bytes} bytes of memory left")]
pub struct OutOfMemory {
    /// The number of bytes requested.
    pub bytes: u64,
}

impl OutOfMemory {
    /// Unwinds to the nearest [`catch`].
    fn unwind(self) -> ! {
        resume_unwind(Box::new(self))
    }

    /// The error that a panic's payload holds, if it is one of these.
    pub fn of_panic(payload: &(dyn Any + Send)) -> Option<Self> {
        payload.downcast_ref().copied()
    }
}

/// Calls `body` and returns its result. Other panics are resumed.
///
/// # Errors
/// Returns [`OutOfMemory`] if an allocation in `body` failed.
pub fn catch<R>(body: impl FnOnce() -> R) -> Result<R, OutOfMemory> {
    catch_unwind(AssertUnwindSafe(body))
        .map_err(|payload| OutOfMemory::of_panic(payload.as_ref()).unwrap_or_else(|| resume_unwind(payload)))
}

fn refused<T>(count: usize) -> OutOfMemory {
    OutOfMemory { bytes: (count as u64).saturating_mul(size_of::<T>() as u64) }
}

/// Reserves memory in `items` for `additional` more.
#[inline]
pub fn reserve<T>(items: &mut Vec<T>, additional: usize) {
    if items.capacity() - items.len() < additional {
        grow(items, additional);
    }
}

#[cold]
fn grow<T>(items: &mut Vec<T>, additional: usize) {
    // An empty vector is rarely grown again.
    let reserved = if items.is_empty() { items.try_reserve_exact(additional) } else { items.try_reserve(additional) };
    if injection::fails() || reserved.is_err() {
        refused::<T>(additional).unwind();
    }
    // SAFETY: the vector's capacity is its own.
    unsafe { hints::prefer_huge(items.as_mut_ptr().cast(), items.capacity() * size_of::<T>()) };
}

/// Appends an item.
#[inline]
pub fn push<T>(items: &mut Vec<T>, item: T) {
    if items.len() == items.capacity() {
        grow(items, items.len().max(4));
    }
    items.push(item);
}

/// Appends copies of all items of a slice.
#[inline]
pub fn extend<T: Clone>(items: &mut Vec<T>, more: &[T]) {
    reserve(items, more.len());
    items.extend_from_slice(more);
}

/// Resizes `items` to `len`, with copies of `value` if it grows.
pub fn resize<T: Clone>(items: &mut Vec<T>, len: usize, value: T) {
    reserve(items, len.saturating_sub(items.len()));
    items.resize(len, value);
}

/// An empty vector with memory for `count` items.
pub fn with_capacity<T>(count: usize) -> Vec<T> {
    let mut items = Vec::new();
    reserve(&mut items, count);
    items
}

/// A vector of `count` copies of a value.
pub fn filled<T: Clone>(value: T, count: usize) -> Vec<T> {
    let mut items = with_capacity(count);
    items.resize(count, value);
    items
}

/// A copy of a slice, as a vector.
pub fn copied<T: Clone>(items: &[T]) -> Vec<T> {
    let mut copy = with_capacity(items.len());
    copy.extend_from_slice(items);
    copy
}

/// A copy of a slice, as a boxed slice.
pub fn boxed<T: Clone>(items: &[T]) -> Box<[T]> {
    // The capacity is exact, so that nothing is allocated again.
    copied(items).into_boxed_slice()
}

/// A vector of all items of an iterator, with memory reserved for the least number that it announces.
pub fn collect<T>(items: impl Iterator<Item = T>) -> Vec<T> {
    let mut all = with_capacity(items.size_hint().0);
    for item in items {
        push(&mut all, item);
    }
    all
}

/// A vector of `count` zeros. The pages of a large one are backed only when they are touched.
pub fn zeroed<T: Zeroable>(count: usize) -> Vec<T> {
    let layout = match Layout::array::<T>(count) {
        Ok(layout) if !injection::fails() => layout,
        _ => refused::<T>(count).unwind(),
    };
    if layout.size() == 0 {
        let mut nothing = Vec::new();
        nothing.resize_with(count, T::zeroed);
        return nothing;
    }
    // SAFETY: the layout's size is not zero.
    let memory = unsafe { alloc_zeroed(layout) }.cast::<T>();
    if memory.is_null() {
        refused::<T>(count).unwind();
    }
    // SAFETY: this range was just allocated.
    unsafe { hints::prefer_huge(memory.cast(), layout.size()) };
    // SAFETY: the global allocator gave this memory for the layout of `count` values, and zeros are values of `T`
    // (`Zeroable`).
    unsafe { Vec::from_raw_parts(memory, count, count) }
}

/// Injected failures of allocations, for tests.
pub mod injection {
    use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

    /// The number of allocations until one fails, plus 1; 0 if none is to fail.
    static LEFT: AtomicU64 = AtomicU64::new(0);

    /// Fails the `n`-th allocation from now on, of any thread, counted from 0, and none after it. [`stop`] tells
    /// whether that happened.
    pub fn fail(n: u64) {
        LEFT.store(n.saturating_add(2), Relaxed);
    }

    /// Ends the injection. Returns the number of allocations that would still have succeeded; None if one has failed.
    pub fn stop() -> Option<u64> {
        LEFT.swap(0, Relaxed).checked_sub(2)
    }

    /// Reports whether this allocation fails.
    #[inline]
    pub(crate) fn fails() -> bool {
        // Without an injection, this load is the whole cost.
        LEFT.load(Relaxed) > 1 && count()
    }

    #[cold]
    fn count() -> bool {
        let down = |left: u64| (left > 1).then(|| left - 1);
        LEFT.fetch_update(Relaxed, Relaxed, down) == Ok(2)
    }
}
