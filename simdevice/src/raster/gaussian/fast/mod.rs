//! The fast kernel: volumes in the order of a tile's list, a round of 32 after the other. Each round is staged
//! ([`staging`]): what the others need of its Gaussians, and which blocks each may reach. Then the alphas of all that
//! are reached are found, and then blended, block by block ([`pixels`]).
//!
//! [`staging`]: super::staging
//! [`pixels`]: super::pixels

mod alphas;
mod compositing;
mod staging;

use super::accumulator::{Accumulator, NOT_TERMINATED};
use super::depth_ranges::DepthRanges;
use super::fast::alphas::Alphas;
use super::fast::compositing::{evaluate, evaluate_steep};
use super::fast::staging::StagedRound;
use super::grid::{ALL_BLOCKS, BLOCKS, ROUND};
use super::inputs::{TileCounts, TileInputs};
use super::mode::{DepthMode, NO_DEPTH};
use super::reached_blocks::hidden_blocks;
use crate::gaussian::splats::splat::Splat;
use crate::stats::optimizations::Optimization;
use crate::stats::recorder;
use crate::stats::recorder::Run;
use fearless_simd::{Simd, mask32x16, prelude::*};

/// The kernel's scratch besides the pixels.
#[derive(Debug, Default)]
pub(crate) struct FastScratch {
    staged: StagedRound,
    /// Apart, so that both are small enough never to be wanting.
    alphas: Box<Alphas>,
}

/// The blocks of a tile that are not finished before a round.
#[derive(Clone, Copy)]
struct Open {
    /// A bit for each.
    bits: u64,
    /// The number of them.
    blocks: u8,
    /// Rows of pixels with an unfinished one, if work is recorded.
    rows: u8,
}

/// Gaussians that are composited together.
struct Round<'a> {
    splats: &'a [&'a Splat],
    /// The primitives of the round after.
    next: &'a [u32],
    open: Open,
    is_recorded: bool,
}

/// Composites a task's list.
#[inline(always)]
pub(crate) fn composite<S: Simd, const DEPTH: DepthMode>(
    scratch: &mut FastScratch,
    simd: S,
    task: &TileInputs<'_>,
    (accumulator, ranges): (&mut Accumulator, &DepthRanges),
    mut runs: Option<&mut Vec<Run>>,
) -> TileCounts {
    let mut work = TileCounts::default();
    for block in 0..BLOCKS {
        accumulator.find_most_fall(simd, block, task.thresholds.most_fall);
    }
    let Some(&first) = task.list.first() else {
        return work;
    };
    let mut ahead = [task.splat(first); ROUND];
    for (splat, &primitive) in ahead.iter_mut().zip(task.list) {
        *splat = task.prefetched(primitive);
    }
    // The open blocks stay the same until a pixel is finished, unless blocks are left out for the light that they have.
    let mut known = None;
    for (number, primitives) in task.list.chunks(ROUND).enumerate() {
        let round = ahead;
        let splats = &round[..primitives.len().min(ROUND)];
        let rest = &task.list[number * ROUND..];
        let bits = match known {
            Some(bits) if task.way.light == NOT_TERMINATED => bits,
            _ => open_blocks::<_, DEPTH>(simd, task, accumulator, rest, &mut work),
        };
        if bits == 0 {
            break;
        }
        let open = Open {
            bits,
            blocks: bits.count_ones() as u8,
            rows: if runs.is_some() { accumulator.open_rows() } else { 0 },
        };
        if DEPTH > NO_DEPTH && ranges.rejects_rest(splats[0].look.depth, task.trend) {
            work.tiles_hidden += rest.len() as u64;
            if let Some(runs) = &mut runs {
                work.hidden_rest = rest.len() as u32;
                recorder::push_run(runs, hidden_run(simd, task, rest, open));
            }
            break;
        }
        let next = rest.get(ROUND..).unwrap_or_default();
        let before = work;
        let round = Round { splats, next, open, is_recorded: runs.is_some() };
        let outcome = composite_round::<_, DEPTH>(
            scratch,
            simd,
            task,
            (&mut *accumulator, ranges),
            (&round, &mut ahead),
            &mut work,
        );
        known = (!outcome.may_have_finished).then_some(bits);
        if let Some(runs) = &mut runs {
            let run = Run {
                primitives: splats.len() as u32,
                rows: open.rows,
                blocks: open.blocks,
                reached: (work.items - before.items) as u32,
                hidden: (work.tiles_hidden - before.tiles_hidden) as u32,
                hidden_blocks: outcome.blocks_of_hidden + (work.blocks_hidden - before.blocks_hidden) as u32,
            };
            recorder::push_run(runs, run);
        }
    }
    accumulator.find_covered(simd);
    work
}

/// The blocks that are not finished, a bit for each, before the `rest` of a list. Counts those that are left out since
/// they have too little light.
#[inline(always)]
fn open_blocks<S: Simd, const DEPTH: DepthMode>(
    simd: S,
    task: &TileInputs<'_>,
    accumulator: &Accumulator,
    rest: &[u32],
    work: &mut TileCounts,
) -> u64 {
    if !task.optimizations.has(Optimization::EarlyTermination) {
        return ALL_BLOCKS;
    }
    let open = accumulator.open_blocks(simd, task.way.light);
    if DEPTH <= NO_DEPTH && task.way.light != NOT_TERMINATED {
        let left_out = accumulator.open_blocks(simd, NOT_TERMINATED) & !open;
        // If no block is open, none will be.
        let of = if open == 0 { rest.len() } else { rest.len().min(ROUND) };
        work.blocks_left_out += u64::from(left_out.count_ones()) * of as u64;
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
#[inline(always)]
fn composite_round<'a, S: Simd, const DEPTH: DepthMode>(
    scratch: &mut FastScratch,
    simd: S,
    task: &TileInputs<'a>,
    (accumulator, ranges): (&mut Accumulator, &DepthRanges),
    (round, ahead): (&Round<'_>, &mut [&'a Splat; ROUND]),
    work: &mut TileCounts,
) -> RoundOutcome {
    let (open, blocks) = (round.open.bits, u64::from(round.open.blocks));
    let mut outcome = RoundOutcome { blocks_of_hidden: 0, may_have_finished: false };
    let mut from = 0;
    loop {
        let placed = scratch.staged.place::<_, DEPTH>(
            simd,
            task,
            (round.splats, from),
            (round.next, &mut *ahead),
            (open, ranges),
            round.is_recorded,
        );
        work.open += placed.count * blocks;
        work.tiles_hidden += placed.tiles_hidden;
        work.blocks_hidden += placed.blocks_hidden;
        outcome.blocks_of_hidden += placed.blocks_of_hidden;
        let staged = (&scratch.staged, &mut *scratch.alphas);
        let evaluated = evaluate::<_, DEPTH>(
            accumulator,
            simd,
            (&placed.reaching, placed.is_capped),
            staged,
            ranges,
            task.thresholds,
        );
        work.items += evaluated.items;
        work.contributions += evaluated.contributions;
        outcome.may_have_finished |= evaluated.may_have_finished;
        let Some(&splat) = round.splats.get(placed.end) else {
            break;
        };
        // It is steep; those before it were composited.
        let shown = if DEPTH <= NO_DEPTH { open } else { open & ranges.blocks(simd, splat.look.depth).to_bitmask() };
        let exact = u64::from(shown.count_ones());
        work.open += blocks;
        work.blocks_hidden += blocks - exact;
        work.items += exact;
        work.contributions += evaluate_steep::<_, DEPTH>(accumulator, simd, splat, shown, ranges, task);
        outcome.may_have_finished = true;
        from = placed.end + 1;
    }
    work.pairs += round.splats.len() as u64;
    outcome
}

/// The record in a trace of the Gaussians at a list's end that depths hide in all of the tile.
#[inline(always)]
fn hidden_run<S: Simd>(simd: S, task: &TileInputs<'_>, rest: &[u32], open: Open) -> Run {
    let mut run = Run {
        primitives: rest.len() as u32,
        rows: open.rows,
        blocks: open.blocks,
        hidden: rest.len() as u32,
        ..Run::default()
    };
    let open = mask32x16::from_bitmask(simd, open.bits);
    for &primitive in rest {
        run.hidden_blocks += hidden_blocks(simd, task.splat(primitive), task, open);
    }
    run
}
