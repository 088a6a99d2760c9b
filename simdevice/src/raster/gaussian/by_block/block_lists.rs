//! A tile's list, divided by blocks of pixels.

use crate::gaussian::splats::binary16::binary16_headroom;
use crate::gaussian::splats::splat::{Splat, SplatIndex};
use crate::raster::gaussian::accumulator::Accumulator;
use crate::raster::gaussian::grid::{BLOCKS, BlockMiddles};
use crate::raster::gaussian::inputs::{TileCounts, TileInputs};
use crate::raster::gaussian::kernel::Kernel;
use crate::raster::gaussian::reached_blocks::reached_blocks;
use crate::stats::optimizations::Optimization;
use crate::stats::recorder;
use crate::stats::recorder::Run;
use devmem::host;
use fearless_simd::{Simd, mask32x16, prelude::*};
use timing::work::BlockIntervals;

/// The Gaussians that may reach each block, in the order of the tile's list.
pub(crate) type BlockLists = [Vec<u32>; BLOCKS];

/// Divides a tile's list by blocks: what may reach each, in the order of the list.
#[inline(always)]
pub(crate) fn divide<S: Simd>(
    simd: S,
    inputs: &TileInputs<'_>,
    lists: &mut BlockLists,
    accumulator: &Accumulator,
    runs: Option<&mut Vec<Run>>,
) -> TileCounts {
    let mut counts = TileCounts { pairs: inputs.list.len() as u64, ..TileCounts::default() };
    let all = mask32x16::splat(simd, true);
    let bounded = inputs.optimizations.has(Optimization::Blocks);
    let tests_depth = inputs.thresholds.depth_mode.tests();
    for list in &mut *lists {
        list.clear();
    }
    let middles = BlockMiddles::new(inputs.corner);
    let (mut hidden_alone, recorded) = (0, runs.is_some());
    let mut intervals = recorded.then(BlockIntervals::default);
    for &primitive in inputs.list {
        let index = SplatIndex::new(primitive);
        let splat = index.of(inputs.splats);
        let hidden = tests_depth && inputs.ranges.hides(splat.look.depth);
        if hidden {
            counts.tiles_hidden += 1;
            if !recorded {
                continue;
            }
        } else {
            counts.open += BLOCKS as u64;
        }
        let neg_log2_floor = match inputs.kernel {
            Kernel::Half => half_neg_log2_floor(splat, inputs.thresholds.neg_log2_floor),
            kernel => {
                let cut_off =
                    kernel.cut_off().map_or(f32::INFINITY, |cut_off| cut_off.neg_log2_floor(splat.log2_opacity));
                inputs.thresholds.neg_log2_floor.min(cut_off)
            }
        };
        let mut reached = match inputs.kernel.surfel(index) {
            _ if !bounded => all,
            Some(surfel) => mask32x16::from_bitmask(simd, surfel.blocks(inputs.corner)),
            None if splat.needs_f64 => all,
            None => reached_blocks(simd, splat, &middles, neg_log2_floor),
        };
        if hidden {
            hidden_alone += reached.to_bitmask().count_ones();
            continue;
        }
        if tests_depth {
            let shown = inputs.ranges.blocks(simd, splat.look.depth);
            counts.blocks_hidden += u64::from((reached & !shown).to_bitmask().count_ones());
            reached &= shown;
        }
        let mut reached = reached.to_bitmask();
        counts.items += u64::from(reached.count_ones());
        if let Some(intervals) = &mut intervals {
            intervals.evaluate(reached as u16);
        }
        while reached != 0 {
            let list = &mut lists[reached.trailing_zeros() as usize % BLOCKS];
            host::push(list, primitive);
            reached &= reached - 1;
        }
    }
    if let Some(runs) = runs {
        recorder::push_run(
            runs,
            Run {
                primitives: inputs.list.len() as u32,
                rows: accumulator.open_rows(),
                blocks: BLOCKS as u8,
                reached: counts.items as u32,
                hidden: counts.tiles_hidden as u32,
                hidden_blocks: hidden_alone + counts.blocks_hidden as u32,
                waits: intervals.as_mut().map(BlockIntervals::take),
            },
        );
    }
    counts
}

/// The negated logarithm of the alpha floor by which exact arithmetic finds all that binary16 does not put below `neg_log2_floor`.
fn half_neg_log2_floor(splat: &Splat, neg_log2_floor: f32) -> f32 {
    let opacity = f64::from(splat.log2_opacity);
    (binary16_headroom(splat.factor, opacity + f64::from(neg_log2_floor)) - opacity) as f32
}
