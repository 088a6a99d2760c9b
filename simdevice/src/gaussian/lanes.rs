//! The lanes of a group: arrays of numbers, sets of lanes, and the binary logarithm.

use fearless_simd::{Simd, prelude::*};

/// The Gaussians of a group. The working set of preprocessing one group fits into the processor's caches.
pub(crate) const GROUP: usize = 256;

/// A binary64 number for each Gaussian of a group.
///
/// Some thirty of these arrays are read in parallel. With a cache line more than a power of two they do not compete for
/// the same sets of the first-level cache.
pub(crate) type GroupF64 = [f64; GROUP + 8];

/// A zero for each Gaussian of a group.
pub(crate) const NO_GROUP_F64: GroupF64 = [0.0; GROUP + 8];

/// The length of arrays of binary32 attributes. They are read one after the other, so they need no padding.
pub(crate) const F32_LANES: usize = GROUP;

const WORDS: usize = GROUP / 64;

/// A set of lanes of a group.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Bits([u64; WORDS]);

impl Bits {
    /// The lanes `0..len`.
    pub(crate) fn first(len: usize) -> Self {
        let mut bits = Self::default();
        for (number, word) in bits.0.iter_mut().enumerate() {
            let from = len.saturating_sub(64 * number);
            *word = if from >= 64 { u64::MAX } else { (1 << from) - 1 };
        }
        bits
    }

    /// Adds the lanes of `mask`. The first of them is lane `at`, a multiple of the mask's width.
    #[inline(always)]
    pub(crate) fn set<S: Simd, M: SimdMask<S>>(&mut self, at: usize, mask: M) {
        self.0[at / 64 % WORDS] |= mask.to_bitmask() << (at % 64);
    }

    /// True if the set contains `lane`.
    #[inline(always)]
    pub(crate) fn has(&self, lane: usize) -> bool {
        self.0[lane / 64 % WORDS] >> (lane % 64) & 1 == 1
    }

    /// The bits of `len` lanes from `at` on. `len` divides 64, and `at` is a multiple of it.
    #[inline(always)]
    pub(crate) fn group(&self, at: usize, len: usize) -> u64 {
        self.0[at / 64 % WORDS] >> (at % 64) & (u64::MAX >> (64 - len))
    }

    /// Adds `lane` if `member`.
    #[inline(always)]
    pub(crate) fn set_one(&mut self, lane: usize, member: bool) {
        self.0[lane / 64 % WORDS] |= u64::from(member) << (lane % 64);
    }

    /// The intersection of both sets.
    pub(crate) fn and(mut self, other: &Self) -> Self {
        for (word, other) in self.0.iter_mut().zip(other.0) {
            *word &= other;
        }
        self
    }

    /// The lanes of this set that are not in `other`.
    pub(crate) fn without(mut self, other: &Self) -> Self {
        for (word, other) in self.0.iter_mut().zip(other.0) {
            *word &= !other;
        }
        self
    }

    /// The number of lanes.
    pub(crate) fn count(&self) -> u64 {
        self.0.iter().map(|word| u64::from(word.count_ones())).sum()
    }

    /// Calls `f` with each lane, in order.
    #[inline(always)]
    pub(crate) fn for_each(&self, mut f: impl FnMut(usize)) {
        for (number, &word) in self.0.iter().enumerate() {
            let mut rest = word;
            while rest != 0 {
                f(64 * number + rest.trailing_zeros() as usize);
                rest &= rest - 1;
            }
        }
    }
}

/// The base-2 logarithm of positive normal numbers below 2^1000, to 1e-13; negative infinity for other numbers.
#[inline(always)]
pub(crate) fn log2<S: Simd>(simd: S, x: S::f64s) -> S::f64s {
    let number = |value: f64| S::f64s::splat(simd, value);
    let bits: S::u64s = x.bitcast();
    // The mantissa is taken in [sqrt(1/2), sqrt(2)): subtracting the bits of sqrt(1/2) makes the exponent field match.
    let bias = S::u64s::splat(simd, 1023 << 52);
    let sqrt_half = S::u64s::splat(simd, std::f64::consts::FRAC_1_SQRT_2.to_bits());
    let biased = (bits - sqrt_half + bias) >> 52;
    let mantissa: S::f64s = (bits - (biased << 52) + bias).bitcast();
    // The integer in the low bits of 2^52 becomes a number without a conversion.
    let shifter = number(4_503_599_627_370_496.0);
    let shifted: S::f64s = (biased | shifter.bitcast::<S::u64s>()).bitcast();
    let exponent = shifted - shifter - 1023.0;
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let s2 = s * s;
    // log2(m) = 2 / ln 2 (s + s^3 / 3 + s^5 / 5 + ...), |s| < 0.1716: the omitted terms are below 1e-15.
    let mut series = number(1.0 / 17.0);
    for denominator in [15.0, 13.0, 11.0, 9.0, 7.0, 5.0, 3.0, 1.0] {
        series = series * s2 + 1.0 / denominator;
    }
    let value = exponent + s * series * (2.0 / std::f64::consts::LN_2);
    let normal = x.simd_ge(f64::MIN_POSITIVE);
    normal.select(value, number(f64::NEG_INFINITY))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::token_of;
    use devmem::dispatch;
    use gaurast_runner::{Case, simd_levels};

    #[gaurast_runner::test(each = simd_levels())]
    fn the_logarithm_is_exact_enough(case: &Case) {
        let level = token_of(case);
        let of = |x: f64| dispatch!(level, simd => log2(simd, SimdBase::splat(simd, x)).as_slice()[0]);
        let mut x = 1e-45f64;
        while x < 4e38 {
            let error = (of(x) - x.log2()).abs();
            assert!(error <= 1e-13 * x.log2().abs().max(1.0), "{x}: {error}");
            x *= 1.003_7;
        }
        assert_eq!(of(0.0), f64::NEG_INFINITY);
        assert_eq!(of(1.0), 0.0);
    }

    #[gaurast_runner::test]
    fn sets_of_lanes_are_sets() {
        let mut odd = Bits::default();
        (0..GROUP).for_each(|lane| odd.set_one(lane, lane % 2 == 1));
        let some = Bits::first(70);
        assert_eq!(some.count(), 70);
        assert_eq!(Bits::first(GROUP).count(), GROUP as u64);
        assert_eq!(some.and(&odd).count(), 35);
        let mut lanes = Vec::new();
        some.without(&odd).for_each(|lane| lanes.push(lane));
        assert_eq!(lanes, (0..70).step_by(2).collect::<Vec<_>>());
    }
}
