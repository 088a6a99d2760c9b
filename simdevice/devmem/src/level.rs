//! The SIMD levels that kernels are compiled for.

use fearless_simd::{Level, Simd};

/// A SIMD level by name. Pictures without Gaussians are the same at all levels, and those with Gaussians have the same
/// error bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SimdLevel {
    /// The best level of this processor.
    Best,
    /// The least level of this architecture (SSE2 on x86-64).
    Baseline,
    /// AVX2 and FMA.
    Avx2,
    /// AVX-512 as of Ice Lake.
    Avx512,
}

impl SimdLevel {
    /// Every level with the name that selects it.
    pub const NAMES: &[(&str, Self)] =
        &[("best", Self::Best), ("sse2", Self::Baseline), ("avx2", Self::Avx2), ("avx512", Self::Avx512)];

    /// The level of that name, in any case.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::NAMES.iter().find(|(known, _)| known.eq_ignore_ascii_case(name)).map(|&(_, level)| level)
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
        Self::NAMES.iter().filter(|(_, level)| *level != Self::Best && level.resolve().is_some()).copied().collect()
    }
}

/// Runs an operation with the instructions of a [`Level`], as `fearless_simd::dispatch` does, on one of the levels that
/// kernels are compiled for: the baseline is used for all below AVX2.
///
/// Each level is a copy of all kernels. A level for SSE 4.2 would gain a tenth over SSE2, on processors older than
/// 2013.
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
                $crate::__vectorize!($crate::level::baseline(level), $simd => $operation)
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
        let $simd = $crate::level::any_simd(token);
        $crate::fearless_simd::Simd::vectorize(
            token,
            #[inline(always)]
            || $operation,
        )
    }};
}

/// Hides the type of a token's level, so that an operation is written for all of them.
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
