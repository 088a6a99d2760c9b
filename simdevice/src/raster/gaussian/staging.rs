//! Phase 1 of the tile kernel: what the others need of a round's Gaussians in a tile, and which blocks each may reach.

use super::depth_ranges::DepthRanges;
use super::grid::{BLOCK_PIXELS, BLOCKS, BLOCKS_ACROSS, BlockMiddles, HALF, LANE_X, LANE_Y, ROUND};
use super::inputs::{DepthMode, NO_DEPTH, TileInputs};
use crate::gaussian::splat::Splat;
use crate::stats::optimizations::Optimization;
use fearless_simd::{Simd, f32x8, f32x16, f64x4, i32x8, i32x16, mask32x16, prelude::*, u32x16};

/// What rounding may do to exponents, relative to them.
const ROOM_FACTOR: f32 = 1.0 + 1e-5;

/// Which of a round's Gaussians may reach each block: a bit for each.
pub(super) type Reaching = [u32; BLOCKS];

/// A round's Gaussians in a tile.
#[derive(Debug, Default)]
pub(super) struct StagedRound {
    pub(super) records: [StagedSplat; ROUND],
    pub(super) looks: [SplatColor; ROUND],
}

/// What it takes to find alphas.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
pub(super) struct StagedSplat {
    /// By column of blocks, `u^2` less the logarithm of the opacity at the pixels of two rows: both pairs of a block's rows
    /// have the same.
    pub(super) from_u: [[f32; BLOCK_PIXELS / 2]; BLOCKS_ACROSS],
    /// `v` at the middle of each block.
    pub(super) v: [f32; BLOCKS],
    /// What a pixel's offset from the middle of its block adds to that.
    pub(super) along: [f32; BLOCK_PIXELS],
}

/// What it takes to composite.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SplatColor {
    pub(super) color: [f32; 3],
    /// As [`Splat::depth`].
    pub(super) depth: u32,
}

/// What became of a round's Gaussians, up to a steep one.
#[derive(Debug, Default)]
pub(super) struct Placed {
    pub(super) reaching: Reaching,
    /// How many there are.
    pub(super) count: u64,
    /// The round's first that is steep from where they begin, or its end.
    pub(super) end: usize,
    /// Those that depths hide in all of the tile.
    pub(super) tiles_hidden: u64,
    /// Blocks in which depths hide the others.
    pub(super) blocks_hidden: u64,
    /// Blocks that those hidden in all of the tile would reach, if work is recorded.
    pub(super) blocks_of_hidden: u32,
}

impl StagedRound {
    /// Places the Gaussians of a tile's round from number `from` on, before one that is steep, and has as many of the next round
    /// on their way. `open` are the blocks that are not finished.
    #[inline(never)]
    pub(super) fn place<S: Simd, const DEPTH: DepthMode>(
        &mut self,
        simd: S,
        task: &TileInputs<'_>,
        (round, from, next): (&[u32], usize, &[u32]),
        (open, ranges): (u64, &DepthRanges),
        is_recorded: bool,
    ) -> Placed {
        simd.vectorize(
            #[inline(always)]
            || {
                let mut placed = Placed::default();
                let middles = BlockMiddles::new(task.corner);
                let most_fall = task.thresholds.most_fall;
                let bounded = task.optimizations.has(Optimization::Blocks);
                // Masks are not combined here: that would be calls.
                let open_mask = mask32x16::from_bitmask(simd, open);
                let open = open_mask.to_vector();
                let (mut reaching, all) = (i32x16::splat(simd, 0), i32x16::splat(simd, -1));
                let mut number = from;
                // The Gaussian's bit in words; the first one's comes back after the last one's.
                let mut bit = i32x8::splat(simd, 1 << (from % ROUND));
                while let Some(&primitive) = round.get(number) {
                    task.prefetch(next.get(number));
                    let splat = task.splat(primitive);
                    if DEPTH > NO_DEPTH && ranges.hides(splat.depth) {
                        number += 1;
                        bit += bit;
                        placed.tiles_hidden += 1;
                        if is_recorded {
                            placed.blocks_of_hidden += hidden_blocks(simd, splat, task, open_mask);
                        }
                        continue;
                    }
                    if splat.needs_f64 {
                        break;
                    }
                    let at = number % ROUND;
                    number += 1;
                    let reached = self.records[at].place(simd, splat, &middles, most_fall);
                    self.looks[at] = SplatColor {
                        color: splat.color,
                        depth: splat.depth,
                    };
                    placed.count += 1;
                    let mut reached = if bounded { reached.to_vector() } else { all };
                    if DEPTH > NO_DEPTH {
                        reached &= open;
                        let shown = ranges.blocks(simd, splat.depth).to_vector();
                        let hidden = (reached & (shown ^ -1)).simd_lt(0).to_bitmask();
                        placed.blocks_hidden += u64::from(hidden.count_ones());
                        reached &= shown;
                    }
                    reaching |= reached & bit.combine(bit);
                    bit += bit;
                }
                placed.end = number;
                placed.reaching = (reaching & open).bitcast::<u32x16<S>>().to_array();
                placed
            },
        )
    }
}

impl StagedSplat {
    /// Makes this the record of `splat` in a tile. Returns which blocks it may reach.
    #[inline(always)]
    pub(super) fn place<S: Simd>(
        &mut self,
        simd: S,
        splat: &Splat,
        middles: &BlockMiddles,
        most_fall: f32,
    ) -> mask32x16<S> {
        let [a, b, c] = splat.factor;
        // In each column of blocks, and each row.
        let dx = f64x4::from_slice(simd, &middles.x) - splat.mean[0];
        let dy = f64x4::from_slice(simd, &middles.y) - splat.mean[1];
        let (u, sheared, sunk) = (dx * a, dx * b, dy * c);
        let row = |row: usize| sheared + f64x4::splat(simd, sunk[row]);
        let u: f32x8<S> = u.narrow(u);
        let upper: f32x8<S> = row(0).narrow(row(1));
        let lower: f32x8<S> = row(2).narrow(row(3));
        let v = upper.combine(lower);
        v.store_slice(&mut self.v);
        let [a, b, c] = [a as f32, b as f32, c as f32];
        let columns = f32x8::from_slice(simd, &LANE_X[..BLOCK_PIXELS / 2]);
        let across = columns * a;
        let log2_opacity = f32x8::splat(simd, splat.log2_opacity);
        for (column, from_u) in self.from_u.iter_mut().enumerate() {
            let u = across + u[column];
            u.mul_sub(u, log2_opacity).store_slice(from_u);
        }
        let sheared = columns * b;
        let rows = f32x16::simd_from(simd, LANE_Y);
        let along = rows.mul_add(f32x16::splat(simd, c), sheared.combine(sheared));
        along.store_slice(&mut self.along);
        // How far the exponent may fall, with a margin for rounding.
        let room = log2_opacity.mul_add(ROOM_FACTOR, most_fall * ROOM_FACTOR + 1e-3);
        // The least |u| and |v| over a block's centres, each for itself: together they bound u^2 + v^2.
        let least_u = (u.abs() - HALF * a.abs()).max(0.0);
        let least_v = (v.abs() - HALF * (b.abs() + c.abs())).max(0.0);
        let least_u = least_u * least_u;
        let least = least_v.mul_add(least_v, least_u.combine(least_u));
        least.simd_le(room.combine(room))
    }

    /// How far alpha has fallen at a block's pixels: minus its base-2 logarithm.
    #[inline(always)]
    pub(super) fn falls<S: Simd>(&self, simd: S, block: usize) -> f32x16<S> {
        let from_u = f32x8::from_slice(simd, &self.from_u[block % BLOCKS_ACROSS]);
        let v = f32x16::from_slice(simd, &self.along) + self.v[block];
        v.mul_add(v, from_u.combine(from_u))
    }
}

/// Of the `open` blocks of a tile, those that a Gaussian would be evaluated in if depths did not hide it.
#[inline(always)]
pub(super) fn hidden_blocks<S: Simd>(
    simd: S,
    splat: &Splat,
    task: &TileInputs<'_>,
    open: mask32x16<S>,
) -> u32 {
    let bounded = task.optimizations.has(Optimization::Blocks) && !splat.needs_f64;
    let reached = if bounded {
        let most_fall = task.thresholds.most_fall;
        let middles = BlockMiddles::new(task.corner);
        open & StagedSplat::default().place(simd, splat, &middles, most_fall)
    } else {
        open
    };
    reached.to_bitmask().count_ones()
}
