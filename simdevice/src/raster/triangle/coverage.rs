//! Coverage: finds the samples that a primitive covers by exact integer edge functions, first for a tile, then for its
//! 4x4 blocks, then for the samples.

use super::setup::{Edge, TriangleSetup};
use crate::raster::tile::SIDE;
use crate::raster::tile::{BLOCK_X, BLOCK_Y, LANE_X, LANE_Y};
use crate::state::Rect;
use fearless_simd::{Simd, i32x16, mask32x16, prelude::*};

/// The lanes of a block whose column is less than the index. `ROWS_BELOW` is the same for rows.
const COLUMNS_BELOW: [u16; 5] = below(LANE_X);
const ROWS_BELOW: [u16; 5] = below(LANE_Y);

const fn below(of: [i32; 16]) -> [u16; 5] {
    let mut out = [0; 5];
    let mut limit = 0;
    while limit < 5 {
        let mut lane = 0;
        while lane < 16 {
            if of[lane] < limit as i32 {
                out[limit] |= 1 << lane;
            }
            lane += 1;
        }
        limit += 1;
    }
    out
}

/// The bound of slopes for which an edge's values in a tile fit into 32 bits.
const MAX_SLOPE: i64 = 1 << 26;

/// The samples of a tile that a primitive covers.
#[derive(Clone, Debug)]
pub struct Coverage<const N: usize> {
    /// A bit for each block: 1 if a sample of it may be covered.
    pub blocks: u32,
    /// The covered lanes for each block and sample. Undefined for blocks whose bit in `blocks` is 0.
    pub lanes: [[u16; N]; 16],
}

impl<const N: usize> Default for Coverage<N> {
    fn default() -> Self {
        Self { blocks: 0, lanes: [[0; N]; 16] }
    }
}

/// An edge that crosses a tile, with its values at the samples of the tile's first pixel.
#[derive(Clone, Copy)]
struct Crossing<'a, const N: usize> {
    edge: &'a Edge,
    values: [i64; N],
}

impl<const N: usize> Coverage<N> {
    /// Finds the covered samples of the tile at pixel (x, y), within the primitive's bounds. Returns true if there may
    /// be any.
    #[inline(always)]
    pub fn find<S: Simd>(&mut self, simd: S, setup: &TriangleSetup, x: i32, y: i32) -> bool {
        self.blocks = 0;
        let part = setup.bounds.intersect(Rect { x, y, width: SIDE as u32, height: SIDE as u32 });
        if part.is_empty() {
            return false;
        }
        // The coordinates are in pixels from the tile's corner.
        let (left, top) = (part.x - x, part.y - y);
        let (right, bottom) = (left + part.width as i32, top + part.height as i32);
        let mut crossings = [Crossing { edge: &setup.edges()[0], values: [0; N] }; 4];
        let (mut count, mut is_wide) = (0, false);
        for edge in setup.edges() {
            let at = edge.a * i64::from(x) + edge.b * i64::from(y);
            let mut values = [0; N];
            let (mut least, mut greatest) = (i64::MAX, i64::MIN);
            for (value, c) in values.iter_mut().zip(edge.c) {
                *value = at + c;
                least = least.min(*value);
                greatest = greatest.max(*value);
            }
            let last = SIDE as i64 - 1;
            if greatest + last * (edge.a.max(0) + edge.b.max(0)) < 0 {
                return false;
            }
            if least + last * (edge.a.min(0) + edge.b.min(0)) < 0 {
                crossings[count] = Crossing { edge, values };
                count += 1;
                is_wide |= edge.a.abs() + edge.b.abs() >= MAX_SLOPE;
            }
        }
        let crossings = &crossings[..count];
        let columns = (left as usize / 4, (right as usize).div_ceil(4));
        let rows = (top as usize / 4, (bottom as usize).div_ceil(4));
        let across = (1u32 << columns.1) - (1 << columns.0);
        for row in rows.0..rows.1 {
            self.blocks |= across << (4 * row);
        }
        if count == 0 {
            self.lanes = [[u16::MAX; N]; 16];
        } else if is_wide {
            self.evaluate_wide(crossings);
        } else if self.blocks.count_ones() > 3 {
            self.evaluate_blocks(simd, crossings);
        } else {
            self.evaluate_few(simd, crossings);
        }
        if part.width < SIDE as u32 || part.height < SIDE as u32 {
            self.cut([left, right], [top, bottom]);
        }
        self.blocks != 0
    }

    /// True if every sample of the tile is covered.
    pub fn is_whole(&self) -> bool {
        self.blocks == 0xFFFF && self.lanes.as_flattened().iter().all(|&lanes| lanes == u16::MAX)
    }

    /// Removes the samples of the tile at pixel (x, y) for which `covers`, given pixel and sample, is false.
    #[cold]
    pub fn restrict(&mut self, [x, y]: [i32; 2], covers: impl Fn([i32; 2], usize) -> bool) {
        for block in bits(self.blocks) {
            let mut any = 0;
            for (sample, lanes) in self.lanes[block].iter_mut().enumerate() {
                for lane in bits((*lanes).into()) {
                    let pixel = [x + BLOCK_X[block] + LANE_X[lane], y + BLOCK_Y[block] + LANE_Y[lane]];
                    if !covers(pixel, sample) {
                        *lanes &= !(1 << lane);
                    }
                }
                any |= *lanes;
            }
            self.blocks &= !(u32::from(any == 0) << block);
        }
    }

    /// Removes lanes outside of these columns and rows.
    #[inline(always)]
    fn cut(&mut self, [left, right]: [i32; 2], [top, bottom]: [i32; 2]) {
        for block in bits(self.blocks) {
            let (x, y) = (BLOCK_X[block], BLOCK_Y[block]);
            let within = |table: &[u16; 5], first: i32, end: i32, at: i32| {
                let below = |limit: i32| table[(limit - at).clamp(0, 4) as usize];
                below(end) & !below(first)
            };
            let inside = within(&COLUMNS_BELOW, left, right, x) & within(&ROWS_BELOW, top, bottom, y);
            for lanes in &mut self.lanes[block] {
                *lanes &= inside;
            }
        }
    }

    /// Evaluates every lane of a few blocks.
    #[inline(always)]
    fn evaluate_few<S: Simd>(&mut self, simd: S, crossings: &[Crossing<'_, N>]) {
        for block in bits(self.blocks) {
            let mut any = 0;
            for sample in 0..N {
                let mut outside = i32x16::splat(simd, 0);
                for crossing in crossings {
                    let edge = crossing.edge;
                    let at = edge.a as i32 * BLOCK_X[block] + edge.b as i32 * BLOCK_Y[block];
                    let lanes = i32x16::simd_from(simd, edge.lanes);
                    outside |= lanes + (at + crossing.values[sample] as i32);
                }
                let lanes = !(outside.simd_lt(0).to_bitmask() as u16);
                self.lanes[block][sample] = lanes;
                any |= lanes;
            }
            self.blocks &= !(u32::from(any == 0) << block);
        }
    }

    /// Evaluates whole blocks first, then the lanes of blocks that edges cross.
    #[inline(always)]
    fn evaluate_blocks<S: Simd>(&mut self, simd: S, crossings: &[Crossing<'_, N>]) {
        let mut values = [[0i32; 16]; 4];
        let (mut whole, mut some) = ([u32::MAX; N], [u32::MAX; N]);
        for (crossing, values) in crossings.iter().zip(&mut values) {
            let (a, b) = (crossing.edge.a as i32, crossing.edge.b as i32);
            let blocks = i32x16::simd_from(simd, BLOCK_X) * a + i32x16::simd_from(simd, BLOCK_Y) * b;
            blocks.store_slice(values);
            let (low, high) = (3 * (a.min(0) + b.min(0)), 3 * (a.max(0) + b.max(0)));
            for sample in 0..N {
                let first = blocks + crossing.values[sample] as i32;
                whole[sample] &= (first + low).simd_ge(0).to_bitmask() as u32;
                some[sample] &= (first + high).simd_ge(0).to_bitmask() as u32;
            }
        }
        let mut any = 0;
        for some in some {
            any |= some;
        }
        self.blocks &= any;
        for block in bits(self.blocks) {
            let mut any = 0;
            for sample in 0..N {
                let lanes = if whole[sample] >> block & 1 == 1 {
                    u16::MAX
                } else if some[sample] >> block & 1 == 0 {
                    0
                } else {
                    let mut outside = i32x16::splat(simd, 0);
                    for (crossing, values) in crossings.iter().zip(&values) {
                        let lanes = i32x16::simd_from(simd, crossing.edge.lanes);
                        outside |= lanes + (values[block] + crossing.values[sample] as i32);
                    }
                    let outside: mask32x16<S> = outside.simd_lt(0);
                    !(outside.to_bitmask() as u16)
                };
                self.lanes[block][sample] = lanes;
                any |= lanes;
            }
            self.blocks &= !(u32::from(any == 0) << block);
        }
    }

    /// Evaluates every lane in 64 bits, for edges whose slopes need more than 32 bits.
    #[cold]
    fn evaluate_wide(&mut self, crossings: &[Crossing<'_, N>]) {
        for block in bits(self.blocks) {
            for sample in 0..N {
                let mut lanes = 0;
                for lane in 0..16 {
                    let x = i64::from(BLOCK_X[block] + LANE_X[lane]);
                    let y = i64::from(BLOCK_Y[block] + LANE_Y[lane]);
                    let inside = crossings
                        .iter()
                        .all(|crossing| crossing.values[sample] + crossing.edge.a * x + crossing.edge.b * y >= 0);
                    lanes |= u16::from(inside) << lane;
                }
                self.lanes[block][sample] = lanes;
            }
        }
    }
}

/// The numbers of the bits that are set, in ascending order.
#[inline(always)]
pub fn bits(mut word: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let bit = word.trailing_zeros() as usize;
        word &= word.wrapping_sub(1);
        (bit < 32).then_some(bit)
    })
}

#[cfg(test)]
pub(super) mod tests;
