//! Binary16 numbers as binary32 numbers. All levels compute the same bits: a NaN keeps its payload and is quiet.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, u32x8};

/// The low and the high halves of words as binary16 numbers.
#[inline(always)]
pub(crate) fn halves<S: Simd>(simd: S, words: u32x8<S>) -> [f32x8<S>; 2] {
    #[cfg(target_arch = "x86_64")]
    if let Some(avx2) = simd.level().as_avx2() {
        let words = u32x8::simd_from(avx2, <[u32; 8]>::from(words));
        let [low, high] = convert(avx2, words.into());
        let (low, high) = (f32x8::simd_from(avx2, low), f32x8::simd_from(avx2, high));
        return [f32x8::simd_from(simd, <[f32; 8]>::from(low)), f32x8::simd_from(simd, <[f32; 8]>::from(high))];
    }
    [low_half(simd, words), low_half(simd, words >> 16)]
}

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{
    __m256, __m256i, _mm256_and_si256, _mm256_castsi256_si128, _mm256_cvtph_ps, _mm256_extracti128_si256,
    _mm256_packus_epi32, _mm256_permute4x64_epi64, _mm256_set1_epi32, _mm256_srli_epi32,
};

#[cfg(target_arch = "x86_64")]
fearless_simd::kernel!(
    #[inline]
    fn convert(avx2: Avx2, words: __m256i) -> [__m256; 2] {
        let low = _mm256_and_si256(words, _mm256_set1_epi32(0xFFFF));
        // The low halves of four words are before their high halves.
        let packed = _mm256_packus_epi32(low, _mm256_srli_epi32::<16>(words));
        let packed = _mm256_permute4x64_epi64::<0b11_01_10_00>(packed);
        let high = _mm256_extracti128_si256::<1>(packed);
        [_mm256_cvtph_ps(_mm256_castsi256_si128(packed)), _mm256_cvtph_ps(high)]
    }
);

/// The low 16 bits of words as binary16 numbers.
#[inline(always)]
fn low_half<S: Simd>(simd: S, bits: u32x8<S>) -> f32x8<S> {
    let splat = |word: u32| u32x8::splat(simd, word);
    let sign = (bits & 0x8000) << 16;
    let half = bits & 0x7FFF;
    // The exponent is in binary32's position, still with binary16's bias.
    let shifted = half << 13;
    let normal = shifted + ((127 - 15) << 23);
    // A denormal number gets a leading one, which is then subtracted. No operand is denormal, because those are slow.
    let least = splat((127 - 14) << 23);
    let denormal = (shifted + least).bitcast::<f32x8<S>>() - least.bitcast::<f32x8<S>>();
    let infinity = splat(0x7C00);
    // The mantissa of a NaN is kept, and the NaN made quiet.
    let quiet = half.simd_gt(infinity).select(splat(1 << 22), splat(0));
    let special = shifted | splat(0x7F80_0000) | quiet;
    let magnitude = half.simd_ge(infinity).select(special, normal);
    let is_denormal = half.simd_lt(splat(0x0400));
    let magnitude = is_denormal.select(denormal.bitcast::<u32x8<S>>(), magnitude);
    (magnitude | sign).bitcast()
}
