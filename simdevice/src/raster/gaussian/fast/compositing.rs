//! Phase 3 of the fast kernel: the alphas of a round through the pixels of each block, which stay in registers.

use super::alphas::Alphas;
use super::staging::{Placed, Reaching, StagedRound};
use crate::gaussian::splats::splat::Splat;
use crate::raster::gaussian::accumulator::Accumulator;
use crate::raster::gaussian::exponent::neg_log2_alphas_f64;
use crate::raster::gaussian::grid::{BLOCK_PIXELS, BLOCKS};
use crate::raster::gaussian::inputs::{Thresholds, TileInputs};
use crate::raster::gaussian::masks::Tally;
use crate::raster::gaussian::mode::Mode;
use crate::raster::gaussian::pixels::{Pixels, Shown, ShownGaussian, accumulate, composite_one, keep, pixels};
use crate::simd::bits_of;
use fearless_simd::{Simd, f32x16, i32x16, prelude::*};

/// No pixel of more transmittance than this, in units of the floor, is looked out for while a round's Gaussians are
/// composited: it is seldom finished by one round, and where it is, that round is composited again.
const FAR_FROM_FLOOR: f32 = 8.0;

/// The account of a round's composition.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Evaluated {
    /// Pairs of a Gaussian and a block whose pixels were evaluated.
    pub(crate) items: u64,
    /// Pairs of a Gaussian and a pixel that accepted it.
    pub(crate) contributions: u64,
    /// True if pixels may have been finished.
    pub(crate) may_have_finished: bool,
}

/// Composites the Gaussians of a round that were `placed`, in the blocks that they may reach.
#[inline(always)]
pub(crate) fn evaluate<S: Simd, M: Mode>(
    accumulator: &mut Accumulator,
    simd: S,
    inputs: &TileInputs<'_>,
    placed: &Placed,
    round: &StagedRound,
    alphas: &mut Alphas,
) -> Evaluated {
    let Placed { reaching, is_capped, .. } = placed;
    let (ranges, thresholds) = (inputs.ranges, inputs.thresholds);
    let floors = &accumulator.neg_log2_floors;
    // Opacities are seldom above the ceiling. Less exact powers may be, whatever the opacity.
    let may_exceed = M::DEPTH.finds_reached() || M::EXPONENTIAL.is_approximate();
    let found = if may_exceed || *is_capped {
        alphas.find::<_, M, true>(simd, reaching, round, floors, ranges, thresholds)
    } else {
        alphas.find::<_, M, false>(simd, reaching, round, floors, ranges, thresholds)
    };
    let refused = composite_all::<_, M>(accumulator, simd, reaching, round, alphas, thresholds);
    Evaluated {
        items: found.blocks,
        contributions: found.pixels.saturating_sub(refused.unwrap_or(0)),
        may_have_finished: refused.is_some(),
    }
}

/// The alphas of a block, in the order of the list.
#[derive(Clone, Copy)]
struct BlockAlphas<'a> {
    block: usize,
    /// A bit for the number in the round of each alpha's Gaussian.
    reaching: u32,
    alphas: &'a [[f32; BLOCK_PIXELS]],
}

/// Composites the alphas of a round; returns how many pixels refused one, since they are finished, or `None` if no
/// pixel was finished in the round. A function of its own, as [`Alphas::find`].
#[inline(never)]
fn composite_all<S: Simd, M: Mode>(
    accumulator: &mut Accumulator,
    simd: S,
    reaching: &Reaching,
    round: &StagedRound,
    alphas: &Alphas,
    thresholds: Thresholds,
) -> Option<u64> {
    simd.vectorize(
        #[inline(always)]
        || {
            let mut refused = None;
            let mut rest = &alphas.alphas[..];
            for (block, &reaching) in reaching.iter().enumerate() {
                let count = reaching.count_ones() as usize;
                let Some((alphas, others)) = rest.split_at_checked(count) else {
                    break;
                };
                rest = others;
                if reaching == 0 {
                    continue;
                }
                let of_block = BlockAlphas { block, reaching, alphas };
                if M::DEPTH.finds_reached()
                    || !composite_far_from_floor::<_, M>(accumulator, simd, of_block, round, thresholds)
                {
                    let more = composite_near_floor::<_, M>(accumulator, simd, of_block, round, thresholds);
                    if let Some(more) = more {
                        refused = Some(refused.unwrap_or(0) + more);
                    }
                }
            }
            refused
        },
    )
}

/// Composites a block's alphas, if no pixel comes so near the floor that it is finished; else it changes nothing.
/// Returns whether it did.
#[inline(always)]
fn composite_far_from_floor<S: Simd, M: Mode>(
    accumulator: &mut Accumulator,
    simd: S,
    of_block: BlockAlphas<'_>,
    round: &StagedRound,
    thresholds: Thresholds,
) -> bool {
    let block = of_block.block;
    let floor = thresholds.transmittance_floor;
    let mut pixels = pixels(accumulator, simd, block);
    let before = pixels.transmittance;
    // As whole numbers, transmittances are in the order of what they stand for, and greater than all where a pixel is
    // finished. (Masks are not combined here: that would be calls, before which the pixels leave their registers.)
    let near = f32x16::splat(simd, FAR_FROM_FLOOR * floor);
    if bits_of(before).simd_lt(bits_of(near)).any_true() {
        return false;
    }
    // What is finished has alphas of zero.
    pixels.transmittance = before.max(0.0);
    let mut shown = Shown::load(accumulator, simd, block, M::DEPTH, thresholds.depth_unit);
    if shown.may_choose(pixels.transmittance) {
        composite_open::<_, M, true>(simd, &mut pixels, &mut shown, of_block, round);
    } else {
        composite_open::<_, M, false>(simd, &mut pixels, &mut shown, of_block, round);
    }
    let signs: i32x16<S> = before.bitcast();
    let below = pixels.transmittance.simd_lt(floor).to_vector();
    // What is finished has a sign, and is none of those.
    if (below & (signs ^ -1)).simd_lt(0).any_true() {
        return false;
    }
    pixels.transmittance = signs.simd_lt(0).select(before, pixels.transmittance);
    keep(accumulator, block, pixels);
    shown.keep(accumulator, block);
    true
}

/// Composites a block's alphas, as if no pixel were finished by them. With `CHOOSES`, some may be the median or the nearest.
#[inline(always)]
fn composite_open<S: Simd, M: Mode, const CHOOSES: bool>(
    simd: S,
    pixels: &mut Pixels<S>,
    shown: &mut Shown<S>,
    BlockAlphas { mut reaching, alphas, .. }: BlockAlphas<'_>,
    round: &StagedRound,
) {
    for alpha in alphas {
        let gaussian = round.gaussian::<M>(reaching.trailing_zeros() as usize);
        reaching &= reaching.wrapping_sub(1);
        let passed = pixels.pass(f32x16::from_slice(simd, alpha));
        if CHOOSES {
            shown.choose(simd, pixels.transmittance, passed.weight, gaussian);
        }
        shown.add(simd, passed.weight, gaussian);
        pixels.transmittance = passed.rest;
        pixels.add(simd, passed.weight, gaussian.look.color);
    }
}

/// Composites a block's alphas; returns how many pixels refused one, or `None` if no pixel was finished. A function of
/// its own, so that what goes the quick way has the registers for itself.
#[inline(never)]
fn composite_near_floor<S: Simd, M: Mode>(
    accumulator: &mut Accumulator,
    simd: S,
    of_block: BlockAlphas<'_>,
    round: &StagedRound,
    thresholds: Thresholds,
) -> Option<u64> {
    simd.vectorize(
        #[inline(always)]
        || {
            let mut rest = of_block;
            if !M::DEPTH.finds_reached() {
                rest = composite_until_finished::<_, M>(accumulator, simd, rest, round, thresholds);
                if rest.alphas.is_empty() {
                    return None;
                }
            }
            let refused = composite_carefully::<_, M>(accumulator, simd, rest, round, thresholds);
            Some(refused)
        },
    )
}

/// Composites the first of a block's alphas, up to one that finishes a pixel, and returns the others.
#[inline(always)]
fn composite_until_finished<'a, S: Simd, M: Mode>(
    accumulator: &mut Accumulator,
    simd: S,
    of_block: BlockAlphas<'a>,
    round: &StagedRound,
    thresholds: Thresholds,
) -> BlockAlphas<'a> {
    let BlockAlphas { block, mut reaching, mut alphas } = of_block;
    let floor = f32x16::splat(simd, thresholds.transmittance_floor);
    let mut pixels = pixels(accumulator, simd, block);
    let mut shown = Shown::load(accumulator, simd, block, M::DEPTH, thresholds.depth_unit);
    let before = pixels.transmittance;
    let signs: i32x16<S> = before.bitcast();
    // What is finished has alphas of zero: here its transmittance stays the greatest.
    let greatest = f32x16::splat(simd, f32::MAX);
    pixels.transmittance = signs.simd_lt(0).select(greatest, before);
    while let [alpha, rest @ ..] = alphas {
        let passed = pixels.pass(f32x16::from_slice(simd, alpha));
        if passed.rest.simd_lt(floor).any_true() {
            break;
        }
        let gaussian = round.gaussian::<M>(reaching.trailing_zeros() as usize);
        reaching &= reaching.wrapping_sub(1);
        alphas = rest;
        shown.choose(simd, pixels.transmittance, passed.weight, gaussian);
        shown.add(simd, passed.weight, gaussian);
        pixels.transmittance = passed.rest;
        pixels.add(simd, passed.weight, gaussian.look.color);
    }
    pixels.transmittance = signs.simd_lt(0).select(before, pixels.transmittance);
    keep(accumulator, block, pixels);
    shown.keep(accumulator, block);
    BlockAlphas { block, reaching, alphas }
}

/// Composites a block's alphas; returns the number of pixels that refused one.
#[inline(always)]
fn composite_carefully<S: Simd, M: Mode>(
    accumulator: &mut Accumulator,
    simd: S,
    of_block: BlockAlphas<'_>,
    round: &StagedRound,
    thresholds: Thresholds,
) -> u64 {
    let BlockAlphas { block, mut reaching, alphas } = of_block;
    let thresholds = Thresholds { depth_mode: M::DEPTH, ..thresholds };
    let mut pixels = pixels(accumulator, simd, block);
    let mut shown = Shown::load(accumulator, simd, block, M::DEPTH, thresholds.depth_unit);
    let mut refused = Tally::new(simd);
    for alpha in alphas {
        let gaussian = round.gaussian::<M>(reaching.trailing_zeros() as usize);
        reaching &= reaching.wrapping_sub(1);
        let alpha = f32x16::from_slice(simd, alpha);
        let goes_on = composite_one(simd, &mut pixels, &mut shown, alpha, gaussian, thresholds);
        refused.add_without(alpha.simd_gt(0.0), goes_on);
    }
    keep(accumulator, block, pixels);
    shown.keep(accumulator, block);
    accumulator.find_neg_log2_floors(simd, block, thresholds.neg_log2_floor);
    refused.total()
}

/// Composites one Gaussian in `blocks`, its exponents formed in binary64; returns the number of pixels that accepted it.
#[inline(always)]
pub(crate) fn composite_in_f64<S: Simd, M: Mode>(
    accumulator: &mut Accumulator,
    simd: S,
    splat: &Splat,
    gaussian: ShownGaussian,
    blocks: u64,
    inputs: &TileInputs<'_>,
) -> u64 {
    let thresholds = Thresholds { depth_mode: M::DEPTH, exponential: M::EXPONENTIAL, ..inputs.thresholds };
    let mut contributions = 0;
    for block in (0..BLOCKS).filter(|block| blocks >> block & 1 == 1) {
        let neg_log2_alpha = neg_log2_alphas_f64(simd, splat, inputs, block);
        contributions += accumulate(accumulator, simd, block, neg_log2_alpha, gaussian, inputs.ranges, thresholds);
        accumulator.find_neg_log2_floors(simd, block, thresholds.neg_log2_floor);
    }
    contributions
}
