//! Phase 1 of the fast kernel: the numbers of a round's Gaussians that the other phases need, and the blocks that each may reach.

use super::round::Round;
use crate::gaussian::splats::identity::Identity;
use crate::gaussian::splats::splat::{Splat, SplatLook};
use crate::raster::gaussian::grid::{
    BLOCK_PIXELS, BLOCKS, BLOCKS_ACROSS, BlockMiddles, HALF, LANE_X, LANE_Y, PLACES, ROUND,
};
use crate::raster::gaussian::inputs::{Thresholds, TileInputs};
use crate::raster::gaussian::mode::Mode;
use crate::raster::gaussian::pixels::ShownGaussian;
use crate::raster::gaussian::reached_blocks::{RANGE_FACTOR, hidden_blocks};
use crate::stats::optimizations::Optimization;
use fearless_simd::{Simd, f32x8, f32x16, i32x16, mask32x16, prelude::*, u32x16};
use isa::float::FusedMultiply;

/// The Gaussians of a round that may reach each block: a bit for each.
pub(crate) type Reaching = [u32; BLOCKS];

/// The Gaussians of a round that may reach each block, while they are found: the bits of eight a byte.
type ReachingBytes = [[u8; ROUND / 8]; BLOCKS];

/// A round's Gaussians in a tile.
#[derive(Debug)]
#[repr(C, align(64))]
pub(crate) struct StagedRound {
    /// `u` at the middle of each column of blocks, by column and then by Gaussian.
    u: [[f32; PLACES]; BLOCKS_ACROSS],
    /// `v` at the middle of each block, by block and then by Gaussian.
    v: [[f32; PLACES]; BLOCKS],
    /// By pair of columns of blocks, then by Gaussian, then by column of the pair: `u^2` less the logarithm of the
    /// opacity at the pixels of two rows of a block. Its other two rows have the same. Like `along` and `looks`, it
    /// is set for Gaussians that may reach a block.
    from_u: [[[f32; BLOCK_PIXELS / 2]; 2 * PLACES]; BLOCKS_ACROSS / 2],
    /// By Gaussian, the addition of a pixel's offset from the middle of its block to `v` there.
    along: [[f32; BLOCK_PIXELS]; PLACES],
    pub(super) looks: [SplatLook; PLACES],
    /// Set if the mode finds Gaussians.
    identities: [Identity; PLACES],
    gathered: Gathered,
}

/// The squares of `u` in a column of blocks: those of Gaussian `number` are at twice that number.
pub(crate) type ColumnSquares = [[f32; BLOCK_PIXELS / 2]; 2 * PLACES - 1];

impl Default for StagedRound {
    fn default() -> Self {
        Self {
            u: [[0.0; PLACES]; BLOCKS_ACROSS],
            v: [[0.0; PLACES]; BLOCKS],
            gathered: Gathered::default(),
            from_u: [[[0.0; BLOCK_PIXELS / 2]; 2 * PLACES]; BLOCKS_ACROSS / 2],
            along: [[0.0; BLOCK_PIXELS]; PLACES],
            looks: [SplatLook::default(); PLACES],
            identities: [Identity::default(); PLACES],
        }
    }
}

/// Numbers by which several Gaussians are placed at a time: by element, and then by Gaussian.
#[derive(Debug)]
struct Gathered {
    mean: [[f64; ROUND]; 2],
    factor: [[f64; ROUND]; 3],
    /// The factor, rounded.
    narrow: [[f32; PLACES]; 3],
    log2_opacity: [f32; ROUND],
    /// Depths, if they are tested.
    depth: [u32; ROUND],
}

impl Default for Gathered {
    fn default() -> Self {
        Self {
            mean: [[0.0; ROUND]; 2],
            factor: [[0.0; ROUND]; 3],
            narrow: [[0.0; PLACES]; 3],
            log2_opacity: [0.0; ROUND],
            depth: [0; ROUND],
        }
    }
}

/// The outcome of placing a round's Gaussians, up to one whose exponents need binary64.
#[derive(Debug, Default)]
pub(crate) struct Placed {
    pub(crate) reaching: Reaching,
    /// True if the alphas of a Gaussian that reaches a block may reach the ceiling.
    pub(crate) is_capped: bool,
    /// The number of Gaussians placed.
    pub(crate) count: u64,
    /// The number in the round of the first Gaussian after those placed.
    pub(crate) end: usize,
    /// Gaussians that depths hide in all of the tile.
    pub(crate) tiles_hidden: u64,
    /// Blocks in which depths hide the others.
    pub(crate) blocks_hidden: u64,
    /// Blocks that those hidden in all of the tile would reach, if work is recorded.
    pub(crate) blocks_of_hidden: u32,
}

impl StagedRound {
    /// Places the Gaussians of a tile's round from number `from` on, before one whose exponents need binary64. Prefetches as many
    /// splats of the next round, and puts them into `ahead`.
    #[inline(never)]
    pub(super) fn place<'a, S: Simd, M: Mode>(
        &mut self,
        simd: S,
        inputs: &TileInputs<'a>,
        round: &Round<'_>,
        from: usize,
        ahead: &mut [&'a Splat; ROUND],
    ) -> Placed {
        simd.vectorize(
            #[inline(always)]
            || {
                let mut placed = Placed::default();
                let open_mask = mask32x16::from_bitmask(simd, round.open.bits);
                let (mut present, mut number) = (0u32, from);
                while let Some(&splat) = round.splats.get(number) {
                    if let Some(&primitive) = round.next.get(number) {
                        ahead[number % ROUND] = inputs.prefetched(primitive);
                    }
                    if M::DEPTH.tests() && inputs.ranges.hides(splat.look.depth) {
                        number += 1;
                        placed.tiles_hidden += 1;
                        if round.is_recorded {
                            placed.blocks_of_hidden += hidden_blocks(simd, splat, inputs, open_mask);
                        }
                        continue;
                    }
                    if splat.needs_f64 {
                        break;
                    }
                    self.gather::<M>(number % ROUND, splat);
                    present |= 1 << (number % ROUND);
                    number += 1;
                }
                placed.end = number;
                placed.count = present.count_ones().into();
                let middles = BlockMiddles::new(inputs.corner);
                let mut reaching = [[0; ROUND / 8]; BLOCKS];
                // A bit for each Gaussian whose alphas may reach the ceiling.
                let mut capped = 0;
                for first in (from / S::f32s::LEN * S::f32s::LEN..number).step_by(S::f32s::LEN) {
                    let some = self.find_blocks(simd, first, &middles, inputs.thresholds, &mut reaching);
                    capped |= (some as u32) << (first % ROUND);
                }
                let mut reaching = u32x16::simd_from(simd, words_of(reaching));
                if !inputs.optimizations.has(Optimization::Blocks) {
                    reaching = u32x16::splat(simd, u32::MAX);
                }
                let open: i32x16<S> = open_mask.to_vector();
                let mut reaching = reaching & open.bitcast::<u32x16<S>>() & present;
                if M::DEPTH.tests() {
                    let mut words = reaching.to_array();
                    for (block, word) in words.iter_mut().enumerate().filter(|(_, word)| **word > 0) {
                        let shown = inputs.ranges.shown(simd, block, &self.gathered.depth);
                        placed.blocks_hidden += u64::from((*word & !shown).count_ones());
                        *word &= shown;
                    }
                    reaching = u32x16::simd_from(simd, words);
                }
                let (low, high) = reaching.split();
                let (low, high) = (low | high).split();
                let mut any = (low | high).to_array().into_iter().fold(0, |any, word| any | word);
                placed.is_capped = any & capped != 0;
                while any != 0 {
                    let number = any.trailing_zeros() as usize;
                    any &= any - 1;
                    if let Some(splat) = round.splats.get(number) {
                        self.record(simd, number, splat);
                        if M::DEPTH.tracks() {
                            self.identities[number] = round.identity::<M>(inputs, number);
                        }
                    }
                }
                placed.reaching = reaching.to_array();
                placed
            },
        )
    }

    /// Makes `splat` the round's Gaussian `number`.
    #[inline(always)]
    fn gather<M: Mode>(&mut self, number: usize, splat: &Splat) {
        let Gathered { mean, factor, log2_opacity, depth, .. } = &mut self.gathered;
        for (lanes, &part) in mean.iter_mut().zip(&splat.mean) {
            lanes[number] = part;
        }
        for (lanes, &part) in factor.iter_mut().zip(&splat.factor) {
            lanes[number] = part;
        }
        log2_opacity[number] = splat.log2_opacity;
        if M::DEPTH.tests() {
            depth[number] = splat.look.depth;
        }
    }

    /// Finds `from_u`, `along` and the look of `splat`, the round's Gaussian `number`, whose `u` is known.
    #[inline(always)]
    fn record<S: Simd>(&mut self, simd: S, number: usize, splat: &Splat) {
        self.looks[number] = splat.look;
        let narrow = &self.gathered.narrow;
        let [a, b, c] = [narrow[0][number], narrow[1][number], narrow[2][number]];
        let log2_opacity = f32x8::splat(simd, splat.log2_opacity);
        let columns = f32x8::from_slice(simd, &LANE_X[..BLOCK_PIXELS / 2]);
        let across = columns * a;
        for (from_u, u) in self.from_u.iter_mut().zip(self.u.as_chunks::<2>().0) {
            for (column, u) in u.iter().enumerate() {
                let u = across + u[number];
                let to = &mut from_u[2 * number + column];
                u.fused_sub(u, log2_opacity).store_slice(to);
            }
        }
        let v_of_column = columns * b;
        let rows = f32x16::simd_from(simd, LANE_Y);
        let along = rows.fused_add(f32x16::splat(simd, c), v_of_column.combine(v_of_column));
        along.store_slice(&mut self.along[number]);
    }

    /// Finds `u` and `v` of the Gaussians from number `first` on, as many as a vector has lanes, and which blocks each
    /// may reach. Returns a bit for each whose alphas may reach the ceiling.
    #[inline(always)]
    fn find_blocks<S: Simd>(
        &mut self,
        simd: S,
        first: usize,
        middles: &BlockMiddles,
        thresholds: Thresholds,
        reaching: &mut ReachingBytes,
    ) -> u64 {
        let lanes = first..first + S::f32s::LEN;
        let wide = |lanes: &[f64; ROUND]| -> Wide<S> {
            let middle = first + S::f64s::LEN;
            Wide(
                S::f64s::from_slice(simd, &lanes[first..middle]),
                S::f64s::from_slice(simd, &lanes[middle..middle + S::f64s::LEN]),
            )
        };
        let Gathered { mean, factor, narrow, log2_opacity, .. } = &mut self.gathered;
        let (x, y) = (wide(&mean[0]), wide(&mean[1]));
        let (a, b, c) = (wide(&factor[0]), wide(&factor[1]), wide(&factor[2]));
        let log2_opacity = S::f32s::from_slice(simd, &log2_opacity[lanes.clone()]);
        // The base-2 logarithm of the ratio of opacity and floor, with a margin for rounding.
        let log2_range = log2_opacity.fused_add(
            S::f32s::splat(simd, RANGE_FACTOR),
            S::f32s::splat(simd, thresholds.neg_log2_floor * RANGE_FACTOR + 1e-3),
        );
        let capped = log2_opacity.simd_gt(thresholds.least_capped).to_bitmask();
        let (narrow_a, narrow_b, narrow_c) = (a.narrow(), b.narrow(), c.narrow());
        narrow_a.store_slice(&mut narrow[0][lanes.clone()]);
        narrow_b.store_slice(&mut narrow[1][lanes.clone()]);
        narrow_c.store_slice(&mut narrow[2][lanes.clone()]);
        let around_u = narrow_a.abs() * HALF;
        let around_v = (narrow_b.abs() + narrow_c.abs()) * HALF;
        let zero = S::f32s::splat(simd, 0.0);
        let mut v_of_column = [b; BLOCKS_ACROSS];
        let mut least_u = [zero; BLOCKS_ACROSS];
        for column in 0..BLOCKS_ACROSS {
            let dx = x.distance_to(simd, middles.x[column]);
            let u = dx.times(a).narrow();
            u.store_slice(&mut self.u[column][lanes.clone()]);
            v_of_column[column] = dx.times(b);
            let least = (u.abs() - around_u).max(zero);
            least_u[column] = least * least;
        }
        for row in 0..BLOCKS_ACROSS {
            let v_of_row = y.distance_to(simd, middles.y[row]).times(c);
            for column in 0..BLOCKS_ACROSS {
                let block = row * BLOCKS_ACROSS + column;
                let v = v_of_column[column].plus(v_of_row).narrow();
                v.store_slice(&mut self.v[block][lanes.clone()]);
                // The least |u| and |v| over a block's centres, each for itself: together they bound u^2 + v^2.
                let least_v = (v.abs() - around_v).max(zero);
                let least = least_v.fused_add(least_v, least_u[column]);
                let may_reach = least.simd_le(log2_range).to_bitmask();
                set_bits(&mut reaching[block], first, S::f32s::LEN, may_reach);
            }
        }
        capped
    }

    /// Gaussian `number` as pixels show it.
    #[inline(always)]
    pub(super) fn gaussian<M: Mode>(&self, number: usize) -> ShownGaussian {
        let identity = if M::DEPTH.tracks() { self.identities[number] } else { Identity::default() };
        ShownGaussian { look: self.looks[number], identity }
    }

    /// The squares of `u` in a block's column of blocks.
    #[inline(always)]
    pub(crate) fn column(&self, block: usize) -> Option<&ColumnSquares> {
        self.from_u[block % BLOCKS_ACROSS / 2][block % 2..].first_chunk()
    }

    /// Minus the base-2 logarithms of a Gaussian's alphas at a block's pixels. `column` is that of the block.
    #[inline(always)]
    pub(super) fn neg_log2_alphas<S: Simd>(
        &self,
        simd: S,
        number: usize,
        block: usize,
        column: &ColumnSquares,
    ) -> f32x16<S> {
        let from_u = f32x8::from_slice(simd, &column[2 * number]);
        let v = f32x16::from_slice(simd, &self.along[number]) + self.v[block][number];
        v.fused_add(v, from_u.combine(from_u))
    }
}

/// Sets the bits of `count` Gaussians from number `first` on, a multiple of `count`, in bytes where they are zero.
#[inline(always)]
fn set_bits(bytes: &mut [u8; ROUND / 8], first: usize, count: usize, bits: u64) {
    let at = first / 8 % bytes.len();
    match count {
        8 => bytes[at] = bits as u8,
        16 => bytes[at & !1..][..2].copy_from_slice(&(bits as u16).to_le_bytes()),
        _ => bytes[at] |= (bits << (first % 8)) as u8,
    }
}

/// The words of which these are the bytes, the lowest first.
#[inline(always)]
fn words_of(bytes: ReachingBytes) -> Reaching {
    let mut words: Reaching = bytemuck::cast(bytes);
    for word in &mut words {
        *word = u32::from_le(*word);
    }
    words
}

/// A binary64 number for each lane of a vector of binary32.
#[derive(Clone, Copy)]
struct Wide<S: Simd>(S::f64s, S::f64s);

impl<S: Simd> Wide<S> {
    #[inline(always)]
    fn times(self, other: Self) -> Self {
        Self(self.0 * other.0, self.1 * other.1)
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        Self(self.0 + other.0, self.1 + other.1)
    }

    /// The distance from each number to `place`.
    #[inline(always)]
    fn distance_to(self, simd: S, place: f64) -> Self {
        let place = S::f64s::splat(simd, place);
        Self(place - self.0, place - self.1)
    }

    /// Each rounded.
    #[inline(always)]
    fn narrow(self) -> S::f32s {
        self.0.narrow(self.1)
    }
}
