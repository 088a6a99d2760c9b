//! Lookups that SIMD vectors lack: words from scattered indices of memory, and from a small table in registers.

use fearless_simd::{Level, Simd, prelude::*, u32x8, u32x16};
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

/// The greatest length of a table in which a processor of a level can look words up by one instruction, in words. None
/// if it can't.
#[inline(always)]
pub fn places(level: Level) -> Option<usize> {
    #[cfg(target_arch = "x86_64")]
    return match level.as_avx512() {
        Some(_) => Some(32),
        None => level.as_avx2().map(|_| 8),
    };
    #[cfg(not(target_arch = "x86_64"))]
    {
        let _ = level;
        None
    }
}

/// The words of a table at sixteen indices, modulo its length. It is fast if the length is that of [`places`].
#[inline(always)]
pub fn look_up<S: Simd, const PLACES: usize>(simd: S, table: &[u32; PLACES], places: u32x16<S>) -> u32x16<S> {
    #[cfg(target_arch = "x86_64")]
    match (table.as_chunks::<16>().0, table.as_chunks::<8>().0) {
        ([low, high], _) => {
            if let Some(avx512) = simd.level().as_avx512() {
                let vector = |words: [u32; 16]| u32x16::simd_from(avx512, words);
                let of = vector(places.into());
                let found = permute_32(avx512, vector(*low).into(), of.into(), vector(*high).into());
                return u32x16::simd_from(simd, <[u32; 16]>::from(u32x16::simd_from(avx512, found)));
            }
        }
        (_, [words]) => {
            if let Some(avx2) = simd.level().as_avx2() {
                let half = |places: u32x8<S>| {
                    let places = u32x8::simd_from(avx2, <[u32; 8]>::from(places));
                    let table = u32x8::simd_from(avx2, *words);
                    let found = permute_8(avx2, table.into(), places.into());
                    u32x8::simd_from(simd, <[u32; 8]>::from(u32x8::simd_from(avx2, found)))
                };
                let (low, high) = places.split();
                return half(low).combine(half(high));
            }
        }
        _ => {}
    }
    let places: [u32; 16] = places.into();
    u32x16::simd_from(simd, places.map(|place| table[place as usize % PLACES]))
}

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{__m256i, __m512i, _mm256_permutevar8x32_epi32, _mm512_permutex2var_epi32};

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
    fn permute_32(avx512: Avx512, low: __m512i, places: __m512i, high: __m512i) -> __m512i {
        _mm512_permutex2var_epi32(low, places, high)
    }
);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dispatch;

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
        agrees(std::array::from_fn::<u32, 8, _>(|place| 10 + place as u32));
        agrees(std::array::from_fn::<u32, 32, _>(|place| 7 * place as u32));
        agrees([1, 2, 3]);
    }

    fn agrees<const PLACES: usize>(table: [u32; PLACES]) {
        let places = std::array::from_fn(|lane| 0xABCD_EF00 + 3 * lane as u32);
        let expected = places.map(|place| table[place as usize % PLACES]);
        for level in [Level::new(), Level::baseline()] {
            let found: [u32; 16] = dispatch!(level, simd => {
                look_up(simd, &table, u32x16::simd_from(simd, places)).into()
            });
            assert_eq!(found, expected, "{PLACES} words, {level:?}");
        }
    }
}
