//! The SIMD levels that kernels are compiled for, and lookups that their vectors lack.

use fearless_simd::{Level, Simd, prelude::*, u32x8, u32x16};
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// A SIMD level by name. All levels give images within the same bound of the exact one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SimdLevel {
    /// The best that this processor has.
    Best,
    /// The least that this architecture has (SSE2 on x86-64).
    Baseline,
    /// AVX2 and FMA.
    Avx2,
    /// AVX-512 as of Ice Lake.
    Avx512,
}

impl SimdLevel {
    /// Every level with the name that selects it.
    pub const NAMES: &[(&str, Self)] = &[
        ("best", Self::Best),
        ("sse2", Self::Baseline),
        ("avx2", Self::Avx2),
        ("avx512", Self::Avx512),
    ];

    /// The level of that name, in any case.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::NAMES
            .iter()
            .find(|(known, _)| known.eq_ignore_ascii_case(name))
            .map(|&(_, level)| level)
    }

    /// The level's token, if this processor supports it.
    pub fn resolve(self) -> Option<Level> {
        let best = Level::new();
        match self {
            Self::Best => Some(best),
            Self::Baseline => Some(Level::baseline()),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => best.as_avx2().map(Level::Avx2),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => best.as_avx512().map(Level::Avx512),
            #[cfg(not(target_arch = "x86_64"))]
            _ => None,
        }
    }

    /// The levels that this processor supports, without repetition.
    pub fn supported() -> Vec<(&'static str, Self)> {
        Self::NAMES
            .iter()
            .filter(|(_, level)| *level != Self::Best && level.resolve().is_some())
            .copied()
            .collect()
    }
}

/// Runs an operation with the instructions of a [`Level`], as `fearless_simd::dispatch` does, on one of the levels that
/// kernels are compiled for: the baseline stands for all below AVX2.
///
/// Each level is a copy of all kernels, and SSE 4.2 gains a tenth over SSE2, on processors older than 2013.
#[cfg(target_arch = "x86_64")]
#[macro_export]
macro_rules! dispatch {
    ($level:expr, $simd:pat => $operation:expr) => {
        match $level {
            $crate::fearless_simd::Level::Avx512(token) => {
                $crate::__vectorize!(token, $simd => $operation)
            }
            $crate::fearless_simd::Level::Avx2(token) => $crate::__vectorize!(token, $simd => $operation),
            level => {
                $crate::__vectorize!($crate::simd::baseline(level), $simd => $operation)
            }
        }
    };
}

/// Runs an operation with the instructions of a [`Level`], as `fearless_simd::dispatch` does.
#[cfg(not(target_arch = "x86_64"))]
#[macro_export]
macro_rules! dispatch {
    ($level:expr, $simd:pat => $operation:expr) => {
        $crate::fearless_simd::dispatch!($level, $simd => $operation)
    };
}

/// Runs an operation with a token's instructions.
#[cfg(target_arch = "x86_64")]
#[doc(hidden)]
#[macro_export]
macro_rules! __vectorize {
    ($token:expr, $simd:pat => $operation:expr) => {{
        let token = $token;
        let $simd = $crate::simd::any_simd(token);
        $crate::fearless_simd::Simd::vectorize(
            token,
            #[inline(always)]
            || $operation,
        )
    }};
}

/// Hides which level a token is of, so that an operation is written for all of them.
#[doc(hidden)]
#[inline(always)]
pub fn any_simd<S: Simd>(token: S) -> impl Simd {
    token
}

/// The token of the level that every x86-64 processor has.
#[cfg(target_arch = "x86_64")]
#[doc(hidden)]
#[inline(always)]
pub fn baseline(level: Level) -> fearless_simd::x86::Sse2 {
    level.as_sse2().expect("x86-64 has SSE2")
}

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

/// How many words a table may have for processors of a level to look them up by one instruction, if they can.
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

/// The words of a table at these places, modulo its length. It is quick where the length is what [`places`] says.
#[inline(always)]
pub fn look_up<S: Simd, const PLACES: usize>(
    simd: S,
    table: &[u32; PLACES],
    places: u32x16<S>,
) -> u32x16<S> {
    #[cfg(target_arch = "x86_64")]
    match (table.as_chunks::<16>().0, table.as_chunks::<8>().0) {
        ([low, high], _) => {
            if let Some(avx512) = simd.level().as_avx512() {
                let vector = |words: [u32; 16]| u32x16::simd_from(avx512, words);
                let of = vector(places.into());
                let found =
                    permute_32(avx512, vector(*low).into(), of.into(), vector(*high).into());
                return u32x16::simd_from(
                    simd,
                    <[u32; 16]>::from(u32x16::simd_from(avx512, found)),
                );
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

    fn gathered(words: &[AtomicU32], places: [u32; 8]) -> [u32; 8] {
        dispatch!(Level::new(), simd => {
            gather(simd, words, u32x8::simd_from(simd, places)).into()
        })
    }

    #[test]
    fn nothing_beyond_the_end_is_read() {
        let words: Vec<AtomicU32> = (0..5).map(|word| AtomicU32::new(10 + word)).collect();
        let places = [0, 4, 5, u32::MAX, 2, 1 << 31, 3, 1];
        assert_eq!(gathered(&words, places), [10, 14, 14, 14, 12, 14, 13, 11]);
        assert_eq!(gathered(&words[..1], places), [10; 8]);
        assert_eq!(gathered(&[], places), [0; 8]);
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
