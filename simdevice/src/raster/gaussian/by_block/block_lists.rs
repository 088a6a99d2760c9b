//! A tile's list, divided by blocks of pixels.

use crate::gaussian::splats::binary16::binary16_headroom;
use crate::gaussian::splats::splat::{Splat, locate};
use crate::raster::gaussian::accumulator::Accumulator;
use crate::raster::gaussian::depth_ranges::DepthRanges;
use crate::raster::gaussian::grid::{BLOCKS, BlockMiddles};
use crate::raster::gaussian::inputs::{TileCounts, TileInputs};
use crate::raster::gaussian::kernel::Kernel;
use crate::raster::gaussian::mode::NO_DEPTH;
use crate::raster::gaussian::reached_blocks::reached_blocks;
use crate::stats::optimizations::Optimization;
use crate::stats::recorder;
use crate::stats::recorder::Run;
use devmem::host;
use fearless_simd::{Simd, mask32x16, prelude::*};

/// The Gaussians that may reach each block, in the order of the tile's list.
pub(crate) type BlockLists = [Vec<u32>; BLOCKS];

/// Parts a tile's list by blocks: what may reach each, in the order of the list.
#[inline(always)]
pub(crate) fn part<S: Simd>(
    simd: S,
    task: &TileInputs<'_>,
    lists: &mut BlockLists,
    (accumulator, ranges): (&Accumulator, &DepthRanges),
    runs: Option<&mut Vec<Run>>,
) -> TileCounts {
    let mut work = TileCounts { pairs: task.list.len() as u64, ..TileCounts::default() };
    let all = mask32x16::splat(simd, true);
    let bounded = task.optimizations.has(Optimization::Blocks);
    let tests_depth = task.thresholds.depth_mode > NO_DEPTH;
    for list in &mut *lists {
        list.clear();
    }
    let middles = BlockMiddles::new(task.corner);
    let (mut hidden_alone, recorded) = (0, runs.is_some());
    for &primitive in task.list {
        let (batch, place) = locate(primitive);
        let splat = &task.splats[batch][place];
        let hidden = tests_depth && ranges.hides(splat.look.depth);
        if hidden {
            work.tiles_hidden += 1;
            if !recorded {
                continue;
            }
        } else {
            work.open += BLOCKS as u64;
        }
        let most_fall = match task.mode {
            Kernel::Half => half_most_fall(splat, task.thresholds.most_fall),
            _ => task.thresholds.most_fall,
        };
        let mut reached = match task.mode.surfel((batch, place)) {
            _ if !bounded => all,
            Some(surfel) => mask32x16::from_bitmask(simd, surfel.blocks(task.corner)),
            None if splat.needs_f64 => all,
            None => reached_blocks(simd, splat, &middles, most_fall),
        };
        if hidden {
            hidden_alone += reached.to_bitmask().count_ones();
            continue;
        }
        if tests_depth {
            let shown = ranges.blocks(simd, splat.look.depth);
            work.blocks_hidden += u64::from((reached & !shown).to_bitmask().count_ones());
            reached &= shown;
        }
        let mut reached = reached.to_bitmask();
        work.items += u64::from(reached.count_ones());
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
                primitives: task.list.len() as u32,
                rows: accumulator.open_rows(),
                blocks: BLOCKS as u8,
                reached: work.items as u32,
                hidden: work.tiles_hidden as u32,
                hidden_blocks: hidden_alone + work.blocks_hidden as u32,
            },
        );
    }
    work
}

/// The greatest fall of alpha in exact arithmetic where binary16 does not put it below `most_fall`.
fn half_most_fall(splat: &Splat, most_fall: f32) -> f32 {
    let opacity = f64::from(splat.log2_opacity);
    (binary16_headroom(splat.factor, opacity + f64::from(most_fall)) - opacity) as f32
}
