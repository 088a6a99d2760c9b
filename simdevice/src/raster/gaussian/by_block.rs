//! Draws whose modes the kernel has no fast path for: a tile's list is parted by blocks first, and exponents are formed in
//! binary64 at every pixel.

use super::chunk::Record;
use super::grid::{BLOCK_X, BLOCK_Y, LANE_X_64, LANE_Y_64};
use super::{BLOCKS, CHUNK, GaussianTile, NO_DEPTH, Task, Work, pixels::falls_64, wide_sums};
use crate::gaussian::rays::RayDepths;
use crate::gaussian::splat::{Splat, half_room};
use crate::gaussian::surfel::Surfel;
use crate::gaussian::{GaussianDraw, locate};
use crate::state::gaussian::GaussianPrecision;
use crate::stats::optimizations::Skip;
use crate::stats::recorder;
use crate::stats::recorder::Run;
use devmem::dispatch;
use devmem::host;
use fearless_simd::{Level, Simd, f32x16, f64x8, mask32x16, prelude::*};

/// How a tile is composited; chosen once for a draw.
#[derive(Clone, Copy, Debug)]
pub(super) enum TileMode<'a> {
    /// Volumes in the order of the list, in binary32.
    Fast,
    /// Volumes in the order of the list, in binary16.
    Half,
    /// Whatever shapes, in the order of the list or each pixel's own.
    Exact {
        /// By batch, as the splats, if those are 2D Gaussians.
        surfels: Option<&'a [Vec<Surfel>]>,
        /// Of 2D Gaussians' filter, if there is one.
        inverse_low_pass: Option<f64>,
        /// What pixels sort by, if each does so for itself.
        depths: Option<RayDepths<'a>>,
        /// Whether sums are kept in binary64 where the order is the list's; each pixel's own order always does so.
        wide_sums: bool,
    },
}

/// How far alpha may fall in exact arithmetic where binary16 does not put it below `most_fall`.
fn half_most_fall(splat: &Splat, most_fall: f32) -> f32 {
    let opacity = f64::from(splat.log2_opacity);
    (half_room(splat.factor, opacity + f64::from(most_fall)) - opacity) as f32
}

impl<'a> TileMode<'a> {
    pub(super) fn of(draw: &'a GaussianDraw) -> Self {
        let (surfels, depths) = (draw.surfels(), draw.ray_depths());
        if draw.state.precision == GaussianPrecision::Float16 {
            Self::Half
        } else if surfels.is_none() && depths.is_none() && !wide_sums::pays(&draw.state) {
            Self::Fast
        } else {
            let variance = f64::from(draw.state.low_pass_variance);
            Self::Exact {
                surfels,
                inverse_low_pass: (variance > 0.0).then(|| 1.0 / variance),
                depths,
                wide_sums: wide_sums::pays(&draw.state),
            }
        }
    }

    /// The same, but that pixels take the list's order.
    pub(super) fn in_list_order(self) -> Self {
        match self {
            Self::Exact {
                surfels,
                inverse_low_pass,
                wide_sums,
                ..
            } => Self::Exact {
                surfels,
                inverse_low_pass,
                depths: None,
                wide_sums,
            },
            other => other,
        }
    }

    fn surfel(self, (batch, place): (usize, usize)) -> Option<&'a Surfel> {
        match self {
            Self::Exact { surfels, .. } => Some(&surfels?[batch][place]),
            _ => None,
        }
    }
}

impl Task<'_> {
    /// How far a primitive's alpha has fallen at a block's pixels.
    #[inline(always)]
    pub(super) fn falls<S: Simd>(
        &self,
        simd: S,
        (batch, place): (usize, usize),
        block: usize,
    ) -> f32x16<S> {
        let splat = &self.splats[batch][place];
        let TileMode::Exact {
            surfels: Some(surfels),
            inverse_low_pass,
            ..
        } = self.mode
        else {
            return falls_64(simd, splat, self, block);
        };
        let surfel = &surfels[batch][place];
        let from_mean = |axis: usize| f64::from(self.corner[axis]) - splat.mean[axis];
        let middle = [BLOCK_X[block] + from_mean(0), BLOCK_Y[block] + from_mean(1)];
        let opacity = f64x8::splat(simd, splat.log2_opacity.into());
        let fall = |first: usize| {
            let dx = f64x8::from_slice(simd, &LANE_X_64[first..first + 8]) + middle[0];
            let dy = f64x8::from_slice(simd, &LANE_Y_64[first..first + 8]) + middle[1];
            surfel.falloff(simd, dx, dy, inverse_low_pass) - opacity
        };
        let fall: f32x16<S> = fall(0).narrow(fall(8));
        fall.max(-1.0)
    }
}

impl GaussianTile {
    /// Composites a tile in another mode than the fast one.
    pub(super) fn composite_by_block(
        &mut self,
        level: Level,
        task: &Task<'_>,
        layer: usize,
        runs: Option<&mut Vec<Run>>,
    ) -> Work {
        match task.mode {
            TileMode::Half => dispatch!(level, simd =>
                self.composite_half(simd, task, layer, runs)),
            TileMode::Exact {
                depths: Some(depths),
                ..
            } => dispatch!(level, simd =>
                self.composite_per_pixel(simd, task, depths, layer, runs)),
            TileMode::Exact {
                wide_sums: true, ..
            } => dispatch!(level, simd =>
                self.composite_wide(simd, task, layer, runs)),
            TileMode::Fast | TileMode::Exact { .. } => dispatch!(level, simd =>
                self.composite_in_order(simd, task, layer, runs)),
        }
    }

    /// Composites a tile in the order of its list.
    #[inline(always)]
    fn composite_in_order<S: Simd>(
        &mut self,
        simd: S,
        task: &Task<'_>,
        layer: usize,
        runs: Option<&mut Vec<Run>>,
    ) -> Work {
        let mut work = self.part(simd, task, layer, runs);
        let layer = &mut self.layers[layer];
        for (block, list) in self.lists.iter().enumerate() {
            for chunk in list.chunks(CHUNK) {
                if task.skips.has(Skip::Saturated) && layer.open_lanes(block) == 0 {
                    break;
                }
                for &primitive in chunk {
                    let (batch, place) = locate(primitive);
                    let splat = &task.splats[batch][place];
                    let fall = task.falls(simd, (batch, place), block);
                    let look = (splat.color, splat.depth);
                    work.contributions +=
                        layer.accumulate(simd, block, fall, look, &self.passing, task.thresholds);
                }
            }
        }
        layer.find_covered(simd);
        work
    }

    /// Parts a tile's list by blocks: what may reach each, in the order of the list.
    #[inline(always)]
    pub(super) fn part<S: Simd>(
        &mut self,
        simd: S,
        task: &Task<'_>,
        layer: usize,
        runs: Option<&mut Vec<Run>>,
    ) -> Work {
        let mut work = Work {
            pairs: task.list.len() as u64,
            ..Work::default()
        };
        let all = mask32x16::splat(simd, true);
        let bounded = task.skips.has(Skip::Blocks);
        let tests_depth = task.thresholds.depth_mode > NO_DEPTH;
        for list in &mut self.lists {
            list.clear();
        }
        let mut record = Record::default();
        let (mut hidden_alone, recorded) = (0, runs.is_some());
        for &primitive in task.list {
            let (batch, place) = locate(primitive);
            let splat = &task.splats[batch][place];
            let hidden = tests_depth && self.passing.hides(splat.depth);
            if hidden {
                work.tiles_hidden += 1;
                if !recorded {
                    continue;
                }
            } else {
                work.open += BLOCKS as u64;
            }
            let most_fall = match task.mode {
                TileMode::Half => half_most_fall(splat, task.thresholds.most_fall),
                _ => task.thresholds.most_fall,
            };
            let mut reached = match task.mode.surfel((batch, place)) {
                _ if !bounded => all,
                Some(surfel) => mask32x16::from_bitmask(simd, surfel.blocks(task.corner)),
                None if splat.steep => all,
                None => record.place(simd, splat, task.corner.map(f64::from), most_fall),
            };
            if hidden {
                hidden_alone += reached.to_bitmask().count_ones();
                continue;
            }
            if tests_depth {
                let shown = self.passing.blocks(simd, splat.depth);
                work.blocks_hidden += u64::from((reached & !shown).to_bitmask().count_ones());
                reached &= shown;
            }
            let mut reached = reached.to_bitmask();
            work.items += u64::from(reached.count_ones());
            while reached != 0 {
                let list = &mut self.lists[reached.trailing_zeros() as usize % BLOCKS];
                host::push(list, primitive);
                reached &= reached - 1;
            }
        }
        if let Some(runs) = runs {
            recorder::push_run(
                runs,
                Run {
                    primitives: task.list.len() as u32,
                    rows: self.layers[layer].open_rows(),
                    blocks: BLOCKS as u8,
                    reached: work.items as u32,
                    hidden: work.tiles_hidden as u32,
                    hidden_blocks: hidden_alone + work.blocks_hidden as u32,
                },
            );
        }
        work
    }
}
