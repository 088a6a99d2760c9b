//! The fast kernel: volumes in the order of a tile's list, a round of 32 after the other. Each round has three phases:
//!
//! 1. [`staging`] prepares its Gaussians, and finds the blocks that each may reach.
//! 2. [`alphas`] computes the alphas of all Gaussians in the blocks that they may reach.
//! 3. [`compositing`] composites the alphas, block by block.

mod alphas;
mod compositing;
mod round;
mod staging;

use super::accumulator::{Accumulator, NOT_TERMINATED};
use super::grid::{ALL_BLOCKS, BLOCKS, ROUND};
use super::inputs::{TileCounts, TileInputs};
use super::mode::Mode;
use super::pixels::ShownGaussian;
use super::reached_blocks::hidden_blocks;
use crate::gaussian::splats::splat::Splat;
use crate::stats::optimizations::Optimization;
use crate::stats::recorder;
use crate::stats::recorder::Run;
use alphas::Alphas;
use compositing::{composite_in_f64, evaluate};
use fearless_simd::{Simd, mask32x16, prelude::*};
use round::{OpenBlocks, Round};
use staging::{Placed, StagedRound};
use timing::work::{BlockIntervals, INTERVALS};

/// The kernel's scratch besides the pixels.
#[derive(Debug, Default)]
pub(crate) struct FastScratch {
    staged: StagedRound,
    /// A box of its own, so that both allocations are small.
    alphas: Box<Alphas>,
}

/// Composites a tile's list.
#[inline(always)]
pub(crate) fn composite<S: Simd, M: Mode>(
    scratch: &mut FastScratch,
    simd: S,
    inputs: &TileInputs<'_>,
    accumulator: &mut Accumulator,
    mut runs: Option<&mut Vec<Run>>,
) -> TileCounts {
    let mut counts = TileCounts::default();
    for block in 0..BLOCKS {
        accumulator.find_neg_log2_floors(simd, block, inputs.thresholds.neg_log2_floor);
    }
    let Some(&first) = inputs.list.first() else {
        return counts;
    };
    let mut ahead = [inputs.splat(first); ROUND];
    for (splat, &primitive) in ahead.iter_mut().zip(inputs.list) {
        *splat = inputs.prefetched(primitive);
    }
    let mut intervals = runs.is_some().then(BlockIntervals::default);
    // The open blocks stay the same until a pixel is finished, unless blocks are left out for the transmittance that they have.
    let mut known = None;
    for (number, primitives) in inputs.list.chunks(ROUND).enumerate() {
        let round = ahead;
        let splats = &round[..primitives.len().min(ROUND)];
        let rest = &inputs.list[number * ROUND..];
        let bits = match known {
            Some(bits) if inputs.approximation.least_transmittance == NOT_TERMINATED => bits,
            _ => open_blocks::<_, M>(simd, inputs, accumulator, rest, &mut counts),
        };
        if bits == 0 {
            break;
        }
        let open = OpenBlocks {
            bits,
            count: bits.count_ones() as u8,
            rows: if runs.is_some() { accumulator.open_rows() } else { 0 },
        };
        if M::DEPTH.tests() && inputs.ranges.rejects_rest(splats[0].look.depth, inputs.trend) {
            counts.tiles_hidden += rest.len() as u64;
            if let Some(runs) = &mut runs {
                counts.hidden_rest = rest.len() as u32;
                recorder::push_run(runs, hidden_run(simd, inputs, rest, open));
            }
            break;
        }
        let next = rest.get(ROUND..).unwrap_or_default();
        let before = counts;
        let round = Round { splats, primitives, next, open, is_recorded: runs.is_some() };
        let outcome = composite_round::<_, M>(
            scratch,
            simd,
            inputs,
            accumulator,
            &round,
            &mut ahead,
            &mut intervals,
            &mut counts,
        );
        known = (!outcome.may_have_finished).then_some(bits);
        if let Some(runs) = &mut runs {
            let run = Run {
                primitives: splats.len() as u32,
                rows: open.rows,
                blocks: open.count,
                reached: (counts.items - before.items) as u32,
                hidden: (counts.tiles_hidden - before.tiles_hidden) as u32,
                hidden_blocks: outcome.blocks_of_hidden + (counts.blocks_hidden - before.blocks_hidden) as u32,
                waits: intervals.as_mut().map(BlockIntervals::take),
            };
            recorder::push_run(runs, run);
        }
    }
    accumulator.find_covered(simd);
    counts
}

/// The blocks that are not finished, a bit for each, before the `rest` of a list. Counts those that are left out since
/// they have too little transmittance.
#[inline(always)]
fn open_blocks<S: Simd, M: Mode>(
    simd: S,
    inputs: &TileInputs<'_>,
    accumulator: &Accumulator,
    rest: &[u32],
    counts: &mut TileCounts,
) -> u64 {
    if !inputs.optimizations.has(Optimization::EarlyTermination) {
        return ALL_BLOCKS;
    }
    let open = accumulator.open_blocks(simd, inputs.approximation.least_transmittance);
    if !M::DEPTH.tests() && inputs.approximation.least_transmittance != NOT_TERMINATED {
        let left_out = accumulator.open_blocks(simd, NOT_TERMINATED) & !open;
        // If no block is open, none will be.
        let of = if open == 0 { rest.len() } else { rest.len().min(ROUND) };
        counts.blocks_left_out += u64::from(left_out.count_ones()) * of as u64;
    }
    open
}

/// The outcome of a round, besides its account.
struct RoundOutcome {
    /// Blocks that Gaussians would reach that depths hide in all of the tile, if work is recorded.
    blocks_of_hidden: u32,
    /// True if pixels may have been finished.
    may_have_finished: bool,
}

/// Composites a round, and brings the next one's splats `ahead`.
#[expect(clippy::too_many_arguments, reason = "the inputs, the state and the record of one round")]
#[inline(always)]
fn composite_round<'a, S: Simd, M: Mode>(
    scratch: &mut FastScratch,
    simd: S,
    inputs: &TileInputs<'a>,
    accumulator: &mut Accumulator,
    round: &Round<'_>,
    ahead: &mut [&'a Splat; ROUND],
    intervals: &mut Option<BlockIntervals>,
    counts: &mut TileCounts,
) -> RoundOutcome {
    let (open, blocks) = (round.open.bits, u64::from(round.open.count));
    let mut outcome = RoundOutcome { blocks_of_hidden: 0, may_have_finished: false };
    let mut from = 0;
    loop {
        let placed = scratch.staged.place::<_, M>(simd, inputs, round, from, ahead);
        counts.open += placed.count * blocks;
        counts.tiles_hidden += placed.tiles_hidden;
        counts.blocks_hidden += placed.blocks_hidden;
        outcome.blocks_of_hidden += placed.blocks_of_hidden;
        let evaluated = evaluate::<_, M>(accumulator, simd, inputs, &placed, &scratch.staged, &mut scratch.alphas);
        counts.items += evaluated.items;
        counts.contributions += evaluated.contributions;
        outcome.may_have_finished |= evaluated.may_have_finished;
        if let Some(intervals) = intervals {
            record_intervals(intervals, &placed, from);
        }
        let Some(&splat) = round.splats.get(placed.end) else {
            break;
        };
        // Its exponents need binary64; those before it were composited.
        let shown =
            if !M::DEPTH.tests() { open } else { open & inputs.ranges.blocks(simd, splat.look.depth).to_bitmask() };
        let exact = u64::from(shown.count_ones());
        if let Some(intervals) = intervals {
            intervals.evaluate(shown as u16);
        }
        counts.open += blocks;
        counts.blocks_hidden += blocks - exact;
        counts.items += exact;
        let gaussian = ShownGaussian { look: splat.look, identity: round.identity::<M>(inputs, placed.end) };
        counts.contributions += composite_in_f64::<_, M>(accumulator, simd, splat, gaussian, shown, inputs);
        outcome.may_have_finished = true;
        from = placed.end + 1;
    }
    counts.pairs += round.splats.len() as u64;
    outcome
}

/// Adds the blocks that a round's Gaussians from number `from` on reach, one Gaussian after the other.
#[cold]
fn record_intervals(intervals: &mut BlockIntervals, placed: &Placed, from: usize) {
    for number in from..placed.end {
        let words = placed.reaching.iter().enumerate();
        let blocks = words.fold(0, |blocks, (block, word)| blocks | ((word >> number & 1) as u16) << block);
        intervals.evaluate(blocks);
    }
}

/// The record in a trace of the Gaussians at a list's end that depths hide in all of the tile.
#[inline(always)]
fn hidden_run<S: Simd>(simd: S, inputs: &TileInputs<'_>, rest: &[u32], open: OpenBlocks) -> Run {
    let mut run = Run {
        primitives: rest.len() as u32,
        rows: open.rows,
        blocks: open.count,
        hidden: rest.len() as u32,
        // None of them is evaluated.
        waits: Some([0; INTERVALS]),
        ..Run::default()
    };
    let open = mask32x16::from_bitmask(simd, open.bits);
    for &primitive in rest {
        run.hidden_blocks += hidden_blocks(simd, inputs.splat(primitive), inputs, open);
    }
    run
}
