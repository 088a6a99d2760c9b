//! Shader accesses: relaxed atomics of 8 to 64 bits at naturally aligned offsets.
//!
//! An offset that is out of range or not aligned to the access gives `None`; the caller decides what that
//! means (robust buffer access reads zero and drops writes).

use crate::Allocation;
use std::sync::atomic::{AtomicU8, AtomicU16, AtomicU32, AtomicU64, Ordering::Relaxed};

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
                    Some(self.$at(offset)?.load(Relaxed))
                }

                #[doc = concat!("Stores a `", stringify!($int), "` at byte `offset`.")]
                pub fn $store(&self, offset: u64, value: $int) -> Option<()> {
                    self.$at(offset)?.store(value, Relaxed);
                    Some(())
                }

                #[doc = concat!("Replaces the `", stringify!($int), "` at byte `offset` by `change` of it, atomically, and returns what was there.")]
                pub fn $update(&self, offset: u64, mut change: impl FnMut($int) -> $int) -> Option<$int> {
                    let cell = self.$at(offset)?;
                    let mut old = cell.load(Relaxed);
                    loop {
                        match cell.compare_exchange_weak(old, change(old), Relaxed, Relaxed) {
                            Ok(old) => return Some(old),
                            Err(now) => old = now,
                        }
                    }
                }

                #[doc = concat!("Exchanges the `", stringify!($int), "` at byte `offset` and returns what was there.")]
                pub fn $exchange(&self, offset: u64, value: $int) -> Option<$int> {
                    Some(self.$at(offset)?.swap(value, Relaxed))
                }

                #[doc = concat!("Stores `value` at byte `offset` if the `", stringify!($int), "` there is `expected`; returns what was there.")]
                pub fn $compare_exchange(&self, offset: u64, expected: $int, value: $int) -> Option<$int> {
                    let (Ok(old) | Err(old)) = self.$at(offset)?.compare_exchange(expected, value, Relaxed, Relaxed);
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

impl Allocation {
    /// All whole words of the memory. A shader's bounds check is then an index into a slice.
    pub fn words(&self) -> &[AtomicU32] {
        let count = (self.len() / 4) as usize;
        // SAFETY: the words lie inside the mapping, which lives as long as `self` and is aligned to pages. They are
        // only ever accessed through atomics or raw pointers, so sharing them is what `AtomicU32` allows.
        unsafe { std::slice::from_raw_parts(self.host_pointer().cast::<AtomicU32>(), count) }
    }
}

#[cfg(test)]
mod tests {
    use super::Relaxed;
    use crate::Allocation;

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
        assert_eq!(memory.words()[1].load(Relaxed), 9);
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
