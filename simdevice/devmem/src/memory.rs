//! Allocations of device memory, and every way of reading and writing them.

use crate::hints::PAGE_SIZE;
use crate::shared::{self, ImportError, Label};
use crate::{hints, host};
use bytemuck::{AnyBitPattern, NoUninit};
use memmap2::{MmapOptions, MmapRaw};
use std::any::Any;
use std::fmt;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::ptr::NonNull;
use std::sync::atomic::{AtomicU8, AtomicU16, AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The error that the host could not back an allocation.
#[derive(Debug, thiserror::Error)]
#[error("the host cannot back {size} bytes of device memory: {source}")]
pub struct AllocationError {
    /// The requested length in bytes.
    pub size: u64,
    /// The host's error.
    #[source]
    pub source: std::io::Error,
}

/// The error of an access past the end of an allocation. Nothing was read or written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{size} bytes at offset {offset} lie outside an allocation of {len} bytes")]
pub struct OutOfBounds {
    /// The byte offset of the access.
    pub offset: u64,
    /// Its length in bytes.
    pub size: u64,
    /// The allocation's length in bytes.
    pub len: u64,
}

/// A range of device memory.
///
/// The host backs its pages when they are first touched, so that only used memory costs memory.
#[derive(Debug)]
pub struct Allocation {
    start: Start,
    backing: Backing,
    len: u64,
    /// The number of packets that wrote, by which data derived from the contents tell whether they are up to date.
    generation: AtomicU64,
    host_visible: bool,
    derived: Derived,
}

/// The address of byte 0.
#[derive(Clone, Copy, Debug)]
struct Start(*mut u8);

// SAFETY: it is an address alone. What is there is accessed through an `Allocation`, by raw pointers and atomics.
unsafe impl Send for Start {}
// SAFETY: as for `Send`.
unsafe impl Sync for Start {}

/// The owner of an allocation's pages.
#[derive(Debug)]
enum Backing {
    /// A mapping of this process alone.
    Own { _map: MmapRaw },
    /// A mapping of a file that other processes may map too.
    Shared { _map: MmapRaw, file: OwnedFd },
    /// The application.
    Host,
}

/// Data derived from an allocation's contents.
pub type DerivedData = Arc<dyn Any + Send + Sync>;

/// The data derived from the contents, kept until the contents change.
#[derive(Default)]
struct Derived(Mutex<Vec<DerivedData>>);

impl Derived {
    fn lock(&self) -> MutexGuard<'_, Vec<DerivedData>> {
        // A list of pointers is consistent after any panic.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl fmt::Debug for Derived {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} things", self.lock().len())
    }
}

impl Allocation {
    /// Allocates `len` bytes of zeroed memory that the host may map.
    ///
    /// # Errors
    /// [`AllocationError`] if the host refuses, or if `len` is zero or does not fit the address space.
    pub fn new_zeroed(len: u64) -> Result<Arc<Self>, AllocationError> {
        Self::new(len, true)
    }

    /// Allocates `len` bytes of zeroed memory, mappable by the host only if `host_visible`.
    ///
    /// # Errors
    /// As [`Allocation::new_zeroed`].
    pub fn new(len: u64, host_visible: bool) -> Result<Arc<Self>, AllocationError> {
        let refuse = |source| AllocationError { size: len, source };
        let bytes = usize::try_from(len)
            .ok()
            .filter(|&bytes| bytes > 0 && bytes <= isize::MAX as usize)
            .ok_or_else(|| refuse(std::io::ErrorKind::InvalidInput.into()))?;
        if host::injection::fails() {
            return Err(refuse(std::io::ErrorKind::OutOfMemory.into()));
        }
        let map = MmapOptions::new().len(bytes).no_reserve_swap().map_anon().map_err(refuse)?;
        let map = MmapRaw::from(map);
        let start = Start(map.as_mut_ptr());
        // SAFETY: the mapping is new and belongs to this function.
        unsafe { hints::prefer_huge(start.0, bytes) };
        Ok(Self::of(start, Backing::Own { _map: map }, len, host_visible))
    }

    /// Allocates `len` bytes of zeroed memory that other processes may map by its [file](Self::file), which has a label.
    ///
    /// # Errors
    /// As [`Allocation::new_zeroed`], and if the process has no file descriptor left.
    pub fn new_shared(len: u64, label: &Label) -> Result<Arc<Self>, AllocationError> {
        let refuse = |source| AllocationError { size: len, source };
        let size = shared::mapped_size(len).filter(|_| len > 0);
        let size = size.ok_or_else(|| refuse(std::io::ErrorKind::InvalidInput.into()))?;
        if host::injection::fails() {
            return Err(refuse(std::io::ErrorKind::OutOfMemory.into()));
        }
        let file = shared::create(size, label).map_err(refuse)?;
        Self::map_file(file, len).map_err(refuse)
    }

    /// Maps the `len` bytes of memory that another allocation, perhaps of another process, has in its
    /// [file](Self::file).
    ///
    /// # Errors
    /// [`ImportError`] if it is no such file, or one for another length.
    pub fn import(file: BorrowedFd<'_>, len: u64) -> Result<Arc<Self>, ImportError> {
        shared::check(file, len)?;
        Ok(Self::map_file(file.try_clone_to_owned()?, len)?)
    }

    /// Maps a file whose size is sealed and at least `len` bytes. `len` fits the address space.
    fn map_file(file: OwnedFd, len: u64) -> std::io::Result<Arc<Self>> {
        if len == 0 {
            return Err(std::io::ErrorKind::InvalidInput.into());
        }
        let map = MmapOptions::new().len(len as usize).no_reserve_swap().map_raw(&file)?;
        let start = Start(map.as_mut_ptr());
        // SAFETY: the mapping is new and belongs to this function.
        unsafe { hints::prefer_huge(start.0, len as usize) };
        Ok(Self::of(start, Backing::Shared { _map: map, file }, len, true))
    }

    /// An allocation of the `len` bytes of the application's own memory from `start` on, which are neither copied nor
    /// freed.
    ///
    /// # Errors
    /// [`AllocationError`] if nothing is mapped in a part of the range, if `start` is not a multiple of [`PAGE_SIZE`], or if
    /// `len` is zero or does not fit the address space. Whether the range may be written to is not checked.
    ///
    /// # Safety
    /// The range may be read and written as long as the allocation exists, by any thread, and no Rust reference other than
    /// to atomics covers it.
    pub unsafe fn of_host(start: NonNull<u8>, len: u64) -> Result<Arc<Self>, AllocationError> {
        let refuse = |source| AllocationError { size: len, source };
        let bytes = usize::try_from(len).ok().filter(|&bytes| bytes > 0 && bytes <= isize::MAX as usize);
        let is_aligned = (start.addr().get() as u64).is_multiple_of(PAGE_SIZE);
        let bytes = bytes.filter(|&bytes| is_aligned && start.addr().get().checked_add(bytes).is_some());
        let bytes = bytes.ok_or_else(|| refuse(std::io::ErrorKind::InvalidInput.into()))?;
        if !hints::is_mapped(start.as_ptr(), bytes) {
            return Err(refuse(std::io::ErrorKind::NotFound.into()));
        }
        Ok(Self::of(Start(start.as_ptr()), Backing::Host, len, true))
    }

    fn of(start: Start, backing: Backing, len: u64, host_visible: bool) -> Arc<Self> {
        Arc::new(Self { start, backing, len, generation: AtomicU64::new(0), host_visible, derived: Derived::default() })
    }

    /// The file by which other processes may map the memory, if it was allocated so.
    pub fn file(&self) -> Option<BorrowedFd<'_>> {
        match &self.backing {
            Backing::Shared { file, .. } => Some(file.as_fd()),
            Backing::Own { .. } | Backing::Host => None,
        }
    }

    /// The length in bytes.
    #[allow(clippy::len_without_is_empty, reason = "an allocation is never empty")]
    pub fn len(&self) -> u64 {
        self.len
    }

    /// Reports whether the host may map this memory, or another process has it, and so change it at any time without the
    /// device noticing.
    pub fn is_host_visible(&self) -> bool {
        self.host_visible
    }

    /// The number of the device's writes to this allocation (see [`Allocation::bump_generation`]).
    pub fn generation(&self) -> u64 {
        self.generation.load(Ordering::Acquire)
    }

    /// Marks the contents as changed, and drops the data derived from them.
    pub fn bump_generation(&self) {
        self.generation.fetch_add(1, Ordering::AcqRel);
        // They are freed without the lock, because that may take a while.
        drop(std::mem::take(&mut *self.derived.lock()));
    }

    /// Keeps data derived from the contents until these change or the memory is freed. The data must hold their own
    /// generation: the contents may have changed since they were read.
    pub fn keep_derived(&self, data: DerivedData) {
        self.derived.lock().push(data);
    }

    /// Drops data that [`Allocation::keep_derived`] has kept.
    pub fn drop_derived(&self, data: &DerivedData) {
        self.derived.lock().retain(|kept| !Arc::ptr_eq(kept, data));
    }

    /// The address of byte 0, for the application that maps this memory; valid as long as the allocation exists.
    pub fn host_pointer(&self) -> *mut u8 {
        self.start.0
    }

    /// Copies `out.len()` elements from byte `offset` on.
    ///
    /// # Errors
    /// [`OutOfBounds`], and `out` is untouched, if the range does not lie inside the allocation.
    #[inline]
    pub fn read<T: AnyBitPattern>(&self, offset: u64, out: &mut [T]) -> Result<(), OutOfBounds> {
        let source = self.checked(offset, size_of_val(out))?;
        // SAFETY: `checked` proved that the source range lies inside the mapping; `out` is a distinct,
        // exclusive slice of the same number of bytes, any of which make valid `T`s. The copy is by bytes, so
        // alignment does not matter. A host that writes concurrently breaks Vulkan's rules and gets
        // unspecified values, for which every bit pattern of `T` is prepared.
        unsafe {
            std::ptr::copy_nonoverlapping(source, out.as_mut_ptr().cast::<u8>(), size_of_val(out));
        }
        Ok(())
    }

    /// Prefetches `size` bytes from `offset` on into the caches, if the processor can and they lie inside the
    /// allocation. It changes only the time that accesses take.
    #[inline(always)]
    pub fn prefetch(&self, offset: u64, size: usize) {
        if let Ok(start) = self.checked(offset, size) {
            hints::prefetch_bytes(start, size);
        }
    }

    /// Copies `data` to byte `offset` on.
    ///
    /// # Errors
    /// [`OutOfBounds`], and nothing is written, if the range does not lie inside the allocation.
    #[inline]
    pub fn write<T: NoUninit>(&self, offset: u64, data: &[T]) -> Result<(), OutOfBounds> {
        let target = self.checked(offset, size_of_val(data))?;
        // SAFETY: `checked` proved that the target range lies inside the mapping, which no Rust reference
        // covers; `data` is initialised (`NoUninit`) and does not overlap it, since safe code can hold no
        // slice into the mapping.
        unsafe {
            std::ptr::copy_nonoverlapping(data.as_ptr().cast::<u8>(), target, size_of_val(data));
        }
        Ok(())
    }

    /// Copies `size` bytes from `source` at `source_offset` to `self` at `offset`; overlap is allowed.
    ///
    /// # Errors
    /// [`OutOfBounds`], and nothing is written, if either range does not lie inside its allocation.
    pub fn copy_from(&self, offset: u64, source: &Self, source_offset: u64, size: u64) -> Result<(), OutOfBounds> {
        let bytes = usize::try_from(size).unwrap_or(usize::MAX);
        let from = source.checked(source_offset, bytes)?;
        let to = self.checked(offset, bytes)?;
        // SAFETY: both ranges were proved to lie inside their mappings; `copy` allows them to overlap.
        unsafe { std::ptr::copy(from, to, bytes) };
        Ok(())
    }

    /// Sets `size` bytes from `offset` on to `value`.
    ///
    /// # Errors
    /// [`OutOfBounds`], and nothing is written, if the range does not lie inside the allocation.
    pub fn fill(&self, offset: u64, size: u64, value: u8) -> Result<(), OutOfBounds> {
        let bytes = usize::try_from(size).unwrap_or(usize::MAX);
        let target = self.checked(offset, bytes)?;
        // SAFETY: the range was proved to lie inside the mapping, which no Rust reference covers.
        unsafe { std::ptr::write_bytes(target, value, bytes) };
        Ok(())
    }

    /// All whole words of the memory. A shader's bounds check is then an index into a slice.
    pub fn words(&self) -> &[AtomicU32] {
        let count = (self.len() / 4) as usize;
        // SAFETY: the words lie inside the mapping, which lives as long as `self` and is aligned to pages. They are
        // only ever accessed through atomics or raw pointers, so sharing them is what `AtomicU32` allows.
        unsafe { std::slice::from_raw_parts(self.host_pointer().cast::<AtomicU32>(), count) }
    }

    /// The address of byte `offset`, if `size` bytes from there on lie inside the allocation.
    #[inline]
    fn checked(&self, offset: u64, size: usize) -> Result<*mut u8, OutOfBounds> {
        let out_of_bounds = OutOfBounds { offset, size: size as u64, len: self.len };
        let end = offset.checked_add(size as u64).ok_or(out_of_bounds)?;
        if end > self.len {
            return Err(out_of_bounds);
        }
        // `offset <= len <= isize::MAX`, so the conversion loses nothing and the sum stays in the mapping.
        Ok(self.host_pointer().wrapping_add(offset as usize))
    }
}

/// Defines the accesses of shaders: relaxed atomics of 8 to 64 bits at naturally aligned offsets.
///
/// An offset that is out of range or not aligned to the access gives `None`; the caller decides what that
/// means (robust buffer access reads zero and drops writes).
macro_rules! atomics {
    ($($int:ty, $atomic:ty, $at:ident, $load:ident, $store:ident, $update:ident, $exchange:ident, $compare_exchange:ident;)*) => {
        impl Allocation {
            $(
                fn $at(&self, offset: u64) -> Option<&$atomic> {
                    let pointer = self.checked(offset, size_of::<$int>()).ok()?;
                    let pointer = pointer.cast::<$int>();
                    // SAFETY: the range lies inside the mapping, which lives as long as `self`, and the
                    // alignment is tested. No reference other than to atomics is ever formed.
                    pointer.is_aligned().then(|| unsafe { <$atomic>::from_ptr(pointer) })
                }

                #[doc = concat!("Loads a `", stringify!($int), "` from byte `offset`.")]
                pub fn $load(&self, offset: u64) -> Option<$int> {
                    Some(self.$at(offset)?.load(Ordering::Relaxed))
                }

                #[doc = concat!("Stores a `", stringify!($int), "` at byte `offset`.")]
                pub fn $store(&self, offset: u64, value: $int) -> Option<()> {
                    self.$at(offset)?.store(value, Ordering::Relaxed);
                    Some(())
                }

                #[doc = concat!("Replaces the `", stringify!($int), "` at byte `offset` by its `change`, atomically; returns the old value.")]
                pub fn $update(&self, offset: u64, mut change: impl FnMut($int) -> $int) -> Option<$int> {
                    let cell = self.$at(offset)?;
                    let mut old = cell.load(Ordering::Relaxed);
                    loop {
                        match cell.compare_exchange_weak(old, change(old), Ordering::Relaxed, Ordering::Relaxed) {
                            Ok(old) => return Some(old),
                            Err(now) => old = now,
                        }
                    }
                }

                #[doc = concat!("Exchanges the `", stringify!($int), "` at byte `offset`; returns the old value.")]
                pub fn $exchange(&self, offset: u64, value: $int) -> Option<$int> {
                    Some(self.$at(offset)?.swap(value, Ordering::Relaxed))
                }

                #[doc = concat!("Stores `value` at byte `offset` if the `", stringify!($int), "` there is `expected`; returns the old value.")]
                pub fn $compare_exchange(&self, offset: u64, expected: $int, value: $int) -> Option<$int> {
                    let (Ok(old) | Err(old)) = self.$at(offset)?.compare_exchange(expected, value, Ordering::Relaxed, Ordering::Relaxed);
                    Some(old)
                }
            )*
        }
    };
}

atomics! {
    u8, AtomicU8, atomic_u8, load_u8, store_u8, update_u8, exchange_u8, compare_exchange_u8;
    u16, AtomicU16, atomic_u16, load_u16, store_u16, update_u16, exchange_u16, compare_exchange_u16;
    u32, AtomicU32, atomic_u32, load_u32, store_u32, update_u32, exchange_u32, compare_exchange_u32;
    u64, AtomicU64, atomic_u64, load_u64, store_u64, update_u64, exchange_u64, compare_exchange_u64;
}

/// Bytes `offset..offset + size` of an allocation.
#[derive(Clone, Debug)]
pub struct BufferRange {
    /// The memory.
    pub memory: Arc<Allocation>,
    /// The first byte.
    pub offset: u64,
    /// The size in bytes.
    pub size: u64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_starts_zeroed_and_keeps_what_is_written() {
        let memory = Allocation::new_zeroed(10_000).unwrap();
        let mut out = [1u32; 4];
        memory.read(9_984, &mut out).unwrap();
        assert_eq!(out, [0; 4]);
        memory.write(3, &[0x0102_0304u32, 5]).unwrap();
        let mut bytes = [0u8; 9];
        memory.read(2, &mut bytes).unwrap();
        assert_eq!(bytes, [0, 4, 3, 2, 1, 5, 0, 0, 0]);
    }

    #[test]
    fn what_lies_outside_is_refused_whole() {
        let memory = Allocation::new_zeroed(16).unwrap();
        assert!(memory.write(8, &[1u64, 2]).is_err());
        let mut all = [1u64; 2];
        memory.read(0, &mut all).unwrap();
        assert_eq!(all, [0; 2], "a refused write leaves nothing behind");
        assert!(memory.read(u64::MAX, &mut all).is_err());
        assert!(memory.fill(15, 2, 1).is_err());
        assert!(memory.copy_from(0, &memory, 9, 8).is_err());
        assert!(memory.read::<u8>(16, &mut []).is_ok());
    }

    #[test]
    fn empty_and_impossible_allocations_are_errors() {
        assert!(Allocation::new_zeroed(0).is_err());
        assert!(Allocation::new_zeroed(u64::MAX).is_err());
        assert!(Allocation::new_zeroed(1 << 62).is_err());
    }

    #[test]
    fn memory_of_the_application_stays_its_own() {
        let mut map = MmapOptions::new().len(8192).map_anon().unwrap();
        let start = NonNull::new(map.as_mut_ptr()).unwrap();
        // SAFETY: the range is the mapping, of which there is no reference meanwhile.
        unsafe {
            let memory = Allocation::of_host(start, 8192).unwrap();
            memory.write(8190, &[3u8, 4]).unwrap();
            assert!(memory.write(8191, &[3u8, 4]).is_err());
            assert!(memory.is_host_visible());
            assert!(memory.file().is_none());
            drop(memory);
            assert!(Allocation::of_host(start, 0).is_err());
            assert!(Allocation::of_host(start.add(64), 64).is_err());
            assert!(Allocation::of_host(start, u64::MAX).is_err());
        }
        assert_eq!(map[8190..], [3, 4]);
        drop(map);
        let page = NonNull::<u8>::dangling().with_addr(std::num::NonZero::new(4096).unwrap());
        // SAFETY: the range is looked at alone.
        assert!(unsafe { Allocation::of_host(page, 4096) }.is_err(), "nothing is mapped at the start");
    }

    #[test]
    fn what_is_derived_goes_with_the_contents() {
        let memory = Allocation::new(16, false).unwrap();
        let [a, b] = [Arc::new(1), Arc::new(2)];
        memory.keep_derived(a.clone());
        memory.keep_derived(b.clone());
        memory.drop_derived(&(a.clone() as DerivedData));
        assert_eq!([Arc::strong_count(&a), Arc::strong_count(&b)], [1, 2]);
        memory.bump_generation();
        assert_eq!(Arc::strong_count(&b), 1, "what changed has nothing derived");
        memory.keep_derived(b.clone());
        drop(memory);
        assert_eq!(Arc::strong_count(&b), 1, "freed with the memory");
    }

    #[test]
    fn overlapping_copies_move_bytes() {
        let memory = Allocation::new_zeroed(16).unwrap();
        memory.write(0, &[1u8, 2, 3, 4]).unwrap();
        memory.copy_from(2, &memory, 0, 4).unwrap();
        let mut out = [0u8; 6];
        memory.read(0, &mut out).unwrap();
        assert_eq!(out, [1, 2, 1, 2, 3, 4]);
    }

    #[test]
    fn atomics_act_at_their_offset_alone() {
        let memory = Allocation::new_zeroed(16).unwrap();
        assert_eq!(memory.store_u32(4, 7), Some(()));
        assert_eq!(memory.update_u32(4, |v| v + 1), Some(7));
        assert_eq!(memory.exchange_u32(4, 20), Some(8));
        assert_eq!(memory.compare_exchange_u32(4, 19, 1), Some(20));
        assert_eq!(memory.compare_exchange_u32(4, 20, 1), Some(20));
        assert_eq!(memory.load_u64(0), Some(1 << 32));
        assert_eq!(memory.load_u8(4), Some(1));
    }

    #[test]
    fn words_are_the_memory() {
        let memory = Allocation::new_zeroed(10).unwrap();
        memory.store_u32(4, 9).unwrap();
        assert_eq!(memory.words().len(), 2);
        assert_eq!(memory.words()[1].load(Ordering::Relaxed), 9);
    }

    #[test]
    fn misaligned_and_outlying_offsets_give_none() {
        let memory = Allocation::new_zeroed(16).unwrap();
        assert_eq!(memory.load_u32(2), None);
        assert_eq!(memory.load_u32(16), None);
        assert_eq!(memory.store_u64(12, 1), None);
        assert_eq!(memory.load_u16(u64::MAX), None);
        assert_eq!(memory.load_u64(0), Some(0));
    }

    #[test]
    fn racing_updates_lose_nothing() {
        let memory = Allocation::new_zeroed(64).unwrap();
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for _ in 0..10_000 {
                        memory.update_u32(8, |v| v + 1).unwrap();
                    }
                });
            }
        });
        assert_eq!(memory.load_u32(8), Some(40_000));
    }
}
