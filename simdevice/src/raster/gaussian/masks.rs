//! Operations on masks, in the form that is quick where they are registers of bits, and in that where they are vectors.

use fearless_simd::{Simd, f32x16, i32x16, mask32x16, prelude::*};

/// True if masks are registers of bits, as they are at the level whose vectors have 16 words.
#[inline(always)]
fn are_bits<S: Simd>() -> bool {
    S::f32s::LEN == 16
}

/// The floats in the lanes of a mask, and zero in the others.
#[inline(always)]
pub(crate) fn only<S: Simd>(simd: S, mask: mask32x16<S>, floats: f32x16<S>) -> f32x16<S> {
    if are_bits::<S>() {
        mask.select(floats, f32x16::splat(simd, 0.0))
    } else {
        (floats.bitcast::<i32x16<S>>() & mask.to_vector()).bitcast()
    }
}

/// The number of set lanes of masks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tally<S: Simd> {
    lanes: i32x16<S>,
    bits: u64,
}

impl<S: Simd> Tally<S> {
    #[inline(always)]
    pub(crate) fn new(simd: S) -> Self {
        Self { lanes: i32x16::splat(simd, 0), bits: 0 }
    }

    /// Counts the lanes of a mask.
    #[inline(always)]
    pub(crate) fn add(&mut self, mask: mask32x16<S>) {
        if are_bits::<S>() {
            self.bits += u64::from(mask.to_bitmask().count_ones());
        } else {
            self.lanes -= mask.to_vector();
        }
    }

    /// Counts the lanes of a mask that `others` lacks.
    #[inline(always)]
    pub(crate) fn add_without(&mut self, mask: mask32x16<S>, others: mask32x16<S>) {
        if are_bits::<S>() {
            self.bits += u64::from((mask.to_bitmask() & !others.to_bitmask()).count_ones());
        } else {
            // Masks are not combined: that would be calls.
            self.lanes -= mask.to_vector() & (others.to_vector() ^ -1);
        }
    }

    /// The number of lanes counted; no lane may be counted 2^31 times.
    #[inline(always)]
    pub(crate) fn total(self) -> u64 {
        if are_bits::<S>() {
            return self.bits;
        }
        let lanes = self.lanes.to_array();
        lanes.iter().map(|&lane| u64::from(lane.unsigned_abs())).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::token_of;
    use devmem::dispatch;
    use gaurast_runner::{Case, simd_levels};

    #[gaurast_runner::test(each = simd_levels())]
    fn lanes_are_counted(case: &Case) {
        let (all, without) = dispatch!(token_of(case), simd => {
            let mask = |bits| mask32x16::from_bitmask(simd, bits);
            let (mut all, mut without) = (Tally::new(simd), Tally::new(simd));
            for bits in [0, 0b1011, 0xFFFF, 1 << 15] {
                all.add(mask(bits));
                without.add_without(mask(bits), mask(0b1110));
            }
            (all.total(), without.total())
        });
        assert_eq!((all, without), (20, 15));
    }
}
