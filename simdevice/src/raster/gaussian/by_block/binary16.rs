//! binary16 rasterization: every operation of a processing element is rounded to binary16.
//!
//! Numbers are held as binary32. Sums and products of binary16 numbers, rounded to binary32 and from there to binary16,
//! are what a binary16 unit gives. The mean and the pixel meet before, in binary64: their difference is what an element
//! is given, rounded. Powers of two come from the polynomial of binary32, unfused, rounded. Nothing depends on the SIMD
//! level, and [`scalar`] says the same without vectors.

use super::block_kernel::BlockKernel;
use crate::gaussian::splats::splat::{Splat, SplatIndex, SplatLook};
use crate::raster::gaussian::accumulator::Accumulator;
use crate::raster::gaussian::grid::{BLOCK_X, BLOCK_Y, LANE_X_64, LANE_Y_64};
use crate::raster::gaussian::inputs::{Thresholds, TileInputs};
use crate::simd::{bits_of, floats_of};
use fearless_simd::{Simd, f32x16, f64x8, mask32x16, prelude::*, u32x16};
use scalar::Splat16;

/// A polynomial fitted to 2^f for f in [-1/2, 1/2], highest power first. Its relative error is 9.2e-8.
#[allow(clippy::approx_constant, reason = "the coefficients are fitted; one comes near ln 2")]
const POWER_OF_TWO: [f32; 6] = [0.001_326_472_7, 0.009_671_513, 0.055_507_336, 0.240_222_42, 0.693_147, 1.0];

// Closures that use vectors are functions here: one that is not inlined would be compiled without the SIMD level's
// instructions.

#[inline(always)]
fn number<S: Simd>(simd: S, value: f32) -> f32x16<S> {
    f32x16::splat(simd, value)
}

/// The nearest binary16 number, ties to even; infinite from 65520 on.
#[inline(always)]
fn round<S: Simd>(simd: S, x: f32x16<S>) -> f32x16<S> {
    let bits: u32x16<S> = bits_of(x);
    // 13 bits go; a carry into the exponent is right.
    let even = (bits >> 13) & u32x16::splat(simd, 1);
    let normal = (bits + even + 0xFFF) & u32x16::splat(simd, !0x1FFF);
    let normal = floats_of(normal);
    let infinite = normal * number(simd, f32::INFINITY);
    let normal = normal.abs().simd_ge(65536.0).select(infinite, normal);
    // Below 2^-14 numbers are 2^-24 apart, as binary32's are between a half and one.
    let small = (x + 0.75) - 0.75;
    x.abs().simd_lt(1.0 / 16384.0).select(small, normal)
}

/// 2 to the power of `x`, rounded; 2 above 1.
#[inline(always)]
fn exp2<S: Simd>(simd: S, x: f32x16<S>) -> f32x16<S> {
    let x = x.max(number(simd, -126.0)).min(number(simd, 1.0));
    let shifter = number(simd, 12_582_912.0);
    let shifted = x + shifter;
    let f = x - (shifted - shifter);
    let [first, rest @ ..] = POWER_OF_TWO;
    let mut p = number(simd, first);
    for coefficient in rest {
        p = p * f + coefficient;
    }
    let exponent = bits_of(shifted) << 23;
    round(simd, floats_of(bits_of(p) + exponent))
}

/// Compositing in the order of the list, in binary16.
pub(crate) struct Half {
    /// The draw's thresholds, rounded.
    thresholds: Thresholds,
}

impl Half {
    /// The kernel of a draw with these thresholds.
    pub(crate) fn new(thresholds: &Thresholds) -> Self {
        Self { thresholds: rounded(thresholds) }
    }
}

impl BlockKernel for Half {
    #[inline(always)]
    fn composite<S: Simd>(
        &mut self,
        simd: S,
        inputs: &TileInputs<'_>,
        index: SplatIndex,
        accumulator: &mut Accumulator,
        block: usize,
    ) -> u64 {
        let thresholds = self.thresholds;
        let splat = index.of(inputs.splats);
        let rounded = Splat16::new(splat);
        let d = offsets(simd, splat, inputs.corner, block);
        let alpha = alpha(simd, &rounded, d, thresholds.alpha_ceiling);
        let shown = if thresholds.depth_mode.tests() {
            inputs.ranges.pixels(simd, block, splat.look.depth)
        } else {
            mask32x16::splat(simd, true)
        };
        let look = SplatLook { color: rounded.color, depth: splat.look.depth };
        accumulate(accumulator, simd, block, alpha, shown, look, thresholds)
    }
}

/// The offsets of a block's pixels from a Gaussian's mean, rounded.
#[inline(always)]
fn offsets<S: Simd>(simd: S, splat: &Splat, corner: [u32; 2], block: usize) -> [f32x16<S>; 2] {
    let middle = |axis: usize, block: f64| block + (f64::from(corner[axis]) - splat.mean[axis]);
    let (x, y) = (middle(0, BLOCK_X[block]), middle(1, BLOCK_Y[block]));
    [round(simd, from_middle(simd, &LANE_X_64, x)), round(simd, from_middle(simd, &LANE_Y_64, y))]
}

/// The sums of lanes' offsets and the middle's, in binary32.
#[inline(always)]
fn from_middle<S: Simd>(simd: S, lanes: &[f64; 16], middle: f64) -> f32x16<S> {
    let (first, last) = (f64x8::from_slice(simd, &lanes[..8]), f64x8::from_slice(simd, &lanes[8..]));
    (first + middle).narrow(last + middle)
}

/// Alpha at offsets from the mean; negative where it is not a number.
#[inline(always)]
fn alpha<S: Simd>(simd: S, g: &Splat16, [dx, dy]: [f32x16<S>; 2], ceiling: f32) -> f32x16<S> {
    let [a, b, c] = g.factor;
    let u = round(simd, dx * a);
    let v = round(simd, round(simd, dx * b) + round(simd, dy * c));
    let q = round(simd, round(simd, u * u) + round(simd, v * v));
    let exponent = round(simd, f32x16::splat(simd, g.log2_opacity) - q);
    let alpha = exp2(simd, exponent).min(f32x16::splat(simd, ceiling));
    let is_number = exponent.simd_eq(exponent);
    is_number.select(alpha, f32x16::splat(simd, -1.0))
}

/// Composites a Gaussian of a colour and a depth in a block, where it is `shown`; returns how many pixels accepted it.
#[inline(always)]
fn accumulate<S: Simd>(
    accumulator: &mut Accumulator,
    simd: S,
    block: usize,
    alpha: f32x16<S>,
    shown: mask32x16<S>,
    SplatLook { color, depth }: SplatLook,
    thresholds: Thresholds,
) -> u64 {
    let zero = f32x16::splat(simd, 0.0);
    let t = f32x16::from_slice(simd, &accumulator.transmittance[block]);
    let weight = round(simd, t * alpha);
    let rest = round(simd, t - weight);
    let reached = alpha.simd_ge(thresholds.alpha_floor) & t.simd_ge(zero) & shown;
    let accepted = reached & rest.simd_ge(thresholds.transmittance_floor);
    let finished = reached & rest.simd_lt(thresholds.transmittance_floor);
    if thresholds.depth_mode.finds_median() {
        let median = u32x16::from_slice(simd, &accumulator.median[block]);
        let first_half = accepted & t.simd_ge(0.5);
        let median = first_half.select(u32x16::splat(simd, depth), median);
        median.store_slice(&mut accumulator.median[block]);
    }
    let t = accepted.select(rest, finished.select(zero - t, t));
    t.store_slice(&mut accumulator.transmittance[block]);
    for (channel, color) in accumulator.color.iter_mut().zip(color) {
        let sum = f32x16::from_slice(simd, &channel[block]);
        let more = round(simd, sum + round(simd, weight * color));
        accepted.select(more, sum).store_slice(&mut channel[block]);
    }
    let accepted = accepted.to_bitmask() as u32;
    accumulator.covered[block] |= accepted;
    u64::from(accepted.count_ones())
}

/// The constants of a draw, as an element has them.
fn rounded(thresholds: &Thresholds) -> Thresholds {
    Thresholds {
        alpha_floor: scalar::round(thresholds.alpha_floor),
        alpha_ceiling: scalar::round(thresholds.alpha_ceiling),
        transmittance_floor: scalar::round(thresholds.transmittance_floor),
        ..*thresholds
    }
}

/// The definition of binary16 rasterization, one number at a time.
pub(crate) mod scalar {
    use crate::gaussian::splats::splat::Splat;

    /// The nearest binary16 number, ties to even; infinite from 65520 on.
    pub(crate) fn round(x: f32) -> f32 {
        if x.abs() < 1.0 / 16384.0 {
            return (x + 0.75) - 0.75;
        }
        if x.is_nan() {
            return x;
        }
        let bits = x.to_bits();
        let rounded = f32::from_bits((bits + (bits >> 13 & 1) + 0xFFF) & !0x1FFF);
        if rounded.abs() >= 65536.0 { f32::INFINITY.copysign(x) } else { rounded }
    }

    /// The greatest binary16 number.
    const GREATEST: f32 = 65504.0;

    /// The numbers of a Gaussian, as an element has them.
    #[derive(Clone, Copy, Debug)]
    pub(crate) struct Splat16 {
        pub(crate) factor: [f32; 3],
        pub(crate) log2_opacity: f32,
        pub(crate) color: [f32; 3],
    }

    impl Splat16 {
        pub(crate) fn new(splat: &Splat) -> Self {
            Self {
                factor: splat.factor.map(|f| round(f as f32)),
                log2_opacity: round(splat.log2_opacity),
                // An infinite colour times a weight that underflows would be no number.
                color: splat.look.color.map(|c| round(c).clamp(-GREATEST, GREATEST)),
            }
        }
    }

    #[cfg(test)]
    pub(crate) use definition::*;

    /// The definition that vectors are tested against.
    #[cfg(test)]
    mod definition {
        use super::super::POWER_OF_TWO;
        use super::{Splat16, round};
        use crate::state::gaussian::GaussianState;

        pub(crate) fn exp2(x: f32) -> f32 {
            let x = x.clamp(-126.0, 1.0);
            let shifted = x + 12_582_912.0;
            let f = x - (shifted - 12_582_912.0);
            let p = POWER_OF_TWO.iter().fold(0.0, |p, c| p * f + c);
            round(f32::from_bits(p.to_bits().wrapping_add(shifted.to_bits() << 23)))
        }

        /// The constants of the draw, as an element has them.
        #[derive(Clone, Copy, Debug)]
        pub(crate) struct State {
            pub(crate) alpha_floor: f32,
            alpha_ceiling: f32,
            transmittance_floor: f32,
        }

        impl State {
            pub(crate) fn new(state: &GaussianState) -> Self {
                Self {
                    alpha_floor: round(state.alpha_floor),
                    alpha_ceiling: round(state.alpha_ceiling),
                    transmittance_floor: round(state.transmittance_floor),
                }
            }
        }

        /// Alpha at an offset from the mean; negative where it is not a number.
        pub(crate) fn alpha(g: &Splat16, d: [f32; 2], state: &State) -> f32 {
            let [dx, dy] = d.map(round);
            let [a, b, c] = g.factor;
            let u = round(dx * a);
            let v = round(round(dx * b) + round(dy * c));
            let exponent = round(g.log2_opacity - round(round(u * u) + round(v * v)));
            if exponent.is_nan() {
                return -1.0;
            }
            exp2(exponent).min(state.alpha_ceiling)
        }

        /// The sums of an element.
        #[derive(Clone, Copy, Debug)]
        pub(crate) struct Pixel {
            pub(crate) color: [f32; 3],
            pub(crate) transmittance: f32,
            pub(crate) covered: bool,
            finished: bool,
        }

        impl Default for Pixel {
            fn default() -> Self {
                Self { color: [0.0; 3], transmittance: 1.0, covered: false, finished: false }
            }
        }

        impl Pixel {
            /// Adds the next Gaussian; tells whether it contributed while at least half was left.
            pub(crate) fn add(&mut self, g: &Splat16, alpha: f32, state: &State) -> bool {
                let t = self.transmittance;
                let weight = round(t * alpha);
                let rest = round(t - weight);
                self.finished |= rest < state.transmittance_floor;
                if self.finished {
                    return false;
                }
                for (sum, color) in self.color.iter_mut().zip(g.color) {
                    *sum = round(*sum + round(weight * color));
                }
                self.transmittance = rest;
                self.covered = true;
                t >= 0.5
            }
        }
    }
}
