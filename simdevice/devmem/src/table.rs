//! Words from a small table that a register holds.

use fearless_simd::{Level, Simd, prelude::*, u32x8, u32x16};

/// Places of a table.
const PLACES: usize = 8;

/// Whether processors of a level look words up by an instruction.
#[inline(always)]
pub fn can_look_up(level: Level) -> bool {
    #[cfg(target_arch = "x86_64")]
    return level.as_avx2().is_some();
    #[cfg(not(target_arch = "x86_64"))]
    {
        let _ = level;
        false
    }
}

/// The words of a table at these places, modulo its length. It is quick where [`can_look_up`] says so.
#[inline(always)]
pub fn look_up<S: Simd>(simd: S, table: &[u32; PLACES], places: u32x16<S>) -> u32x16<S> {
    let (low, high) = places.split();
    look_up_half(simd, table, low).combine(look_up_half(simd, table, high))
}

#[inline(always)]
fn look_up_half<S: Simd>(simd: S, table: &[u32; PLACES], places: u32x8<S>) -> u32x8<S> {
    let places: [u32; PLACES] = places.into();
    #[cfg(target_arch = "x86_64")]
    if let Some(avx2) = simd.level().as_avx2() {
        let table = u32x8::simd_from(avx2, *table);
        let places = u32x8::simd_from(avx2, places);
        let found = u32x8::simd_from(avx2, permute(avx2, table.into(), places.into()));
        return u32x8::simd_from(simd, <[u32; PLACES]>::from(found));
    }
    let found = places.map(|place| table[place as usize % PLACES]);
    u32x8::simd_from(simd, found)
}

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{__m256i, _mm256_permutevar8x32_epi32};

#[cfg(target_arch = "x86_64")]
fearless_simd::kernel!(
    #[inline]
    fn permute(avx2: Avx2, table: __m256i, places: __m256i) -> __m256i {
        _mm256_permutevar8x32_epi32(table, places)
    }
);

#[cfg(test)]
mod tests {
    use super::*;
    use fearless_simd::dispatch;

    #[test]
    fn places_count_modulo_the_length() {
        let table = [10, 11, 12, 13, 14, 15, 16, 17];
        let places = std::array::from_fn(|lane| 0xABCD_EF00 + 3 * lane as u32);
        let expected = places.map(|place| table[place as usize % 8]);
        for level in [Level::new(), Level::baseline()] {
            let found: [u32; 16] = dispatch!(level, simd => {
                look_up(simd, &table, u32x16::simd_from(simd, places)).into()
            });
            assert_eq!(found, expected, "{level:?}");
        }
    }
}
