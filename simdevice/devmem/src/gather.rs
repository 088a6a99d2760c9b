//! Words from many places at once.

use fearless_simd::{Simd, prelude::*, u32x8};
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// The words at these places; the last one stands for those beyond the end, and zero if there are none.
#[inline(always)]
pub fn gather<S: Simd>(simd: S, words: &[AtomicU32], places: u32x8<S>) -> u32x8<S> {
    let Some(last) = words.len().checked_sub(1) else {
        return u32x8::splat(simd, 0);
    };
    let last = u32::try_from(last).unwrap_or(u32::MAX);
    let places: [u32; 8] = places.min(u32x8::splat(simd, last)).into();
    let mut found = [0; 8];
    for lane in 0..8 {
        // SAFETY: the least of a place and the last is at most the last.
        found[lane] = unsafe { words.get_unchecked(places[lane] as usize) }.load(Relaxed);
    }
    u32x8::simd_from(simd, found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dispatch;
    use fearless_simd::Level;

    fn at(words: &[AtomicU32], places: [u32; 8]) -> [u32; 8] {
        dispatch!(Level::new(), simd => {
            gather(simd, words, u32x8::simd_from(simd, places)).into()
        })
    }

    #[test]
    fn nothing_beyond_the_end_is_read() {
        let words: Vec<AtomicU32> = (0..5).map(|word| AtomicU32::new(10 + word)).collect();
        let places = [0, 4, 5, u32::MAX, 2, 1 << 31, 3, 1];
        assert_eq!(at(&words, places), [10, 14, 14, 14, 12, 14, 13, 11]);
        assert_eq!(at(&words[..1], places), [10; 8]);
        assert_eq!(at(&[], places), [0; 8]);
    }
}
