//! Lookups that SIMD vectors lack: words from scattered indices of memory, and from a small table in registers.

use crate::runs::{load_2x2, load_4};
use fearless_simd::{Simd, prelude::*, u32x4, u32x8, u32x16};
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

/// The two words from each of eight indices on, as [`gather`] finds them.
#[inline(always)]
pub fn gather_2<S: Simd>(simd: S, words: &[AtomicU32], places: u32x8<S>) -> [u32x8<S>; 2] {
    let Some(places) = inside(simd, words, places, 2) else {
        let [first, second] = gather_each(words, &places.into());
        return [u32x8::simd_from(simd, first), u32x8::simd_from(simd, second)];
    };
    let mut pairs = [u32x4::splat(simd, 0); 4];
    for (pair, places) in pairs.iter_mut().zip(places.as_chunks::<2>().0) {
        // SAFETY: two words from each place on are inside.
        *pair = unsafe { load_2x2(simd, words, *places) };
    }
    let (first, second) = pairs[0].deinterleave(pairs[1]);
    let (third, fourth) = pairs[2].deinterleave(pairs[3]);
    [first.combine(third), second.combine(fourth)]
}

/// The four words from each of eight indices on, as [`gather`] finds them.
#[inline(always)]
pub fn gather_4<S: Simd>(simd: S, words: &[AtomicU32], places: u32x8<S>) -> [u32x8<S>; 4] {
    let Some(places) = inside(simd, words, places, 4) else {
        let [a, b, c, d] = gather_each(words, &places.into());
        return [
            u32x8::simd_from(simd, a),
            u32x8::simd_from(simd, b),
            u32x8::simd_from(simd, c),
            u32x8::simd_from(simd, d),
        ];
    };
    let mut halves = [[u32x4::splat(simd, 0); 4]; 2];
    for (half, places) in halves.iter_mut().zip(places.as_chunks::<4>().0) {
        for (four, place) in half.iter_mut().zip(places) {
            // SAFETY: four words from each place on are inside.
            *four = load_4(simd, unsafe { &*words.as_ptr().add(*place as usize).cast() });
        }
        // The rows become columns.
        let (low, high) = half[0].interleave(half[2]);
        let (other_low, other_high) = half[1].interleave(half[3]);
        let (first, second) = low.interleave(other_low);
        let (third, fourth) = high.interleave(other_high);
        *half = [first, second, third, fourth];
    }
    let [low, high] = halves;
    [low[0].combine(high[0]), low[1].combine(high[1]), low[2].combine(high[2]), low[3].combine(high[3])]
}

/// The places, if `count` words from each of them on are inside.
#[inline(always)]
fn inside<S: Simd>(simd: S, words: &[AtomicU32], places: u32x8<S>, count: usize) -> Option<[u32; 8]> {
    let last = u32::try_from(words.len().checked_sub(count)?).unwrap_or(u32::MAX);
    let are_inside = places.simd_le(u32x8::splat(simd, last)).all_true();
    are_inside.then(|| places.into())
}

/// The words from each of eight indices on, one by one.
#[cold]
#[inline(never)]
pub fn gather_each<const COUNT: usize>(words: &[AtomicU32], places: &[u32; 8]) -> [[u32; 8]; COUNT] {
    let mut found = [[0; 8]; COUNT];
    for (next, found) in (0..).zip(&mut found) {
        for (found, place) in found.iter_mut().zip(places) {
            let place = place.saturating_add(next) as usize;
            *found = words.get(place).or(words.last()).map_or(0, |word| word.load(Relaxed));
        }
    }
    found
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

/// The words of a table of sixteen at sixteen places, modulo sixteen.
#[inline(always)]
pub fn look_up_16<S: Simd>(simd: S, table: u32x16<S>, places: u32x16<S>) -> u32x16<S> {
    #[cfg(target_arch = "x86_64")]
    if let Some(avx512) = simd.level().as_avx512() {
        let table = u32x16::simd_from(avx512, <[u32; 16]>::from(table));
        let places = u32x16::simd_from(avx512, <[u32; 16]>::from(places));
        let found = permute_16(avx512, places.into(), table.into());
        return u32x16::simd_from(simd, <[u32; 16]>::from(u32x16::simd_from(avx512, found)));
    } else if simd.level().as_avx2().is_some() {
        let (low, high): ([u32; 8], [u32; 8]) = (table.split().0.into(), table.split().1.into());
        let is_high = (places & 8).simd_eq(8);
        return is_high.select(look_up(simd, &high, places), look_up(simd, &low, places));
    }
    let (table, places): ([u32; 16], [u32; 16]) = (table.into(), places.into());
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
    fn several_words_are_those_found_one_by_one() {
        let all: Vec<AtomicU32> = (0..40).map(|word| AtomicU32::new(100 + word)).collect();
        let within = [0, 3, 36, 17, 36, 1, 30, 9];
        let beyond = [0, 37, 38, 39, 40, u32::MAX, 1 << 31, 9];
        for level in [Level::new(), Level::baseline()] {
            for (length, places) in [(40, within), (40, beyond), (4, [0; 8]), (3, [0; 8]), (1, within), (0, within)] {
                let words = &all[..length];
                let (two, four): ([[u32; 8]; 2], [[u32; 8]; 4]) = dispatch!(level, simd => {
                    let places = u32x8::simd_from(simd, places);
                    (gather_2(simd, words, places).map(Into::into), gather_4(simd, words, places).map(Into::into))
                });
                let expected: [[u32; 8]; 4] =
                    [0, 1, 2, 3].map(|next| gather_words(words, places.map(|place| place.saturating_add(next))));
                assert_eq!((two, four), ([expected[0], expected[1]], expected), "{level:?}");
                assert_eq!(gather_each(words, &places), expected);
            }
        }
    }

    #[test]
    fn places_in_a_table_of_sixteen_count_modulo_the_length() {
        let table: [u32; 16] = std::array::from_fn(|place| 10 + place as u32);
        let places: [u32; 16] = std::array::from_fn(|lane| 0xABCD_EF00 + 7 * lane as u32);
        let expected = places.map(|place| table[place as usize % table.len()]);
        for level in [Level::new(), Level::baseline()] {
            let found: [u32; 16] = dispatch!(level, simd => {
                look_up_16(simd, u32x16::simd_from(simd, table), u32x16::simd_from(simd, places)).into()
            });
            assert_eq!(found, expected, "{level:?}");
        }
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
