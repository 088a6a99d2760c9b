//! Lookups that SIMD vectors lack: words from scattered indices of memory, and from a small table in registers.

use fearless_simd::{Simd, prelude::*, u32x8, u32x16};
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// The words at eight indices. An index beyond the end gives the last word; an empty slice gives zeros.
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

/// The words of a table of eight at sixteen places, modulo eight.
#[inline(always)]
pub fn look_up<S: Simd>(simd: S, table: &[u32; 8], places: u32x16<S>) -> u32x16<S> {
    #[cfg(target_arch = "x86_64")]
    if let Some(avx512) = simd.level().as_avx512() {
        // An instruction has a table of sixteen.
        let [a, b, c, d, e, f, g, h] = *table;
        let twice = u32x16::simd_from(avx512, [a, b, c, d, e, f, g, h, a, b, c, d, e, f, g, h]);
        let places = u32x16::simd_from(avx512, <[u32; 16]>::from(places));
        let found = permute_16(avx512, places.into(), twice.into());
        return u32x16::simd_from(simd, <[u32; 16]>::from(u32x16::simd_from(avx512, found)));
    } else if let Some(avx2) = simd.level().as_avx2() {
        let half = |places: u32x8<S>| {
            let places = u32x8::simd_from(avx2, <[u32; 8]>::from(places));
            let table = u32x8::simd_from(avx2, *table);
            let found = permute_8(avx2, table.into(), places.into());
            u32x8::simd_from(simd, <[u32; 8]>::from(u32x8::simd_from(avx2, found)))
        };
        let (low, high) = places.split();
        return half(low).combine(half(high));
    }
    let places: [u32; 16] = places.into();
    u32x16::simd_from(simd, places.map(|place| table[place as usize % table.len()]))
}

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{__m256i, __m512i, _mm256_permutevar8x32_epi32, _mm512_permutexvar_epi32};

#[cfg(target_arch = "x86_64")]
fearless_simd::kernel!(
    #[inline]
    fn permute_8(avx2: Avx2, table: __m256i, places: __m256i) -> __m256i {
        _mm256_permutevar8x32_epi32(table, places)
    }
);

#[cfg(target_arch = "x86_64")]
fearless_simd::kernel!(
    #[inline]
    fn permute_16(avx512: Avx512, places: __m512i, table: __m512i) -> __m512i {
        _mm512_permutexvar_epi32(places, table)
    }
);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dispatch;
    use fearless_simd::Level;

    fn gather_words(words: &[AtomicU32], places: [u32; 8]) -> [u32; 8] {
        dispatch!(Level::new(), simd => {
            gather(simd, words, u32x8::simd_from(simd, places)).into()
        })
    }

    #[test]
    fn nothing_beyond_the_end_is_read() {
        let words: Vec<AtomicU32> = (0..5).map(|word| AtomicU32::new(10 + word)).collect();
        let places = [0, 4, 5, u32::MAX, 2, 1 << 31, 3, 1];
        assert_eq!(gather_words(&words, places), [10, 14, 14, 14, 12, 14, 13, 11]);
        assert_eq!(gather_words(&words[..1], places), [10; 8]);
        assert_eq!(gather_words(&[], places), [0; 8]);
    }

    #[test]
    fn places_count_modulo_the_length() {
        let table = std::array::from_fn(|place| 10 + place as u32);
        let places = std::array::from_fn(|lane| 0xABCD_EF00 + 3 * lane as u32);
        let expected = places.map(|place: u32| table[place as usize % table.len()]);
        for level in [Level::new(), Level::baseline()] {
            let found: [u32; 16] = dispatch!(level, simd => {
                look_up(simd, &table, u32x16::simd_from(simd, places)).into()
            });
            assert_eq!(found, expected, "{level:?}");
        }
    }
}
