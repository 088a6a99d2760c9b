//! The SIMD levels that kernels are compiled for.

use fearless_simd::Level;

/// A SIMD level by name. All levels give images within the same bound of the exact one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SimdLevel {
    /// The best that this processor has.
    Best,
    /// The least that this architecture has (SSE2 on x86-64).
    Baseline,
    /// SSE 4.2.
    Sse4_2,
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
        ("sse4.2", Self::Sse4_2),
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
            Self::Sse4_2 => best.as_sse4_2().map(Level::Sse4_2),
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
