//! Where the pixels of a block and the blocks of a tile are.

use super::{BLOCK, BLOCKS, LANES};
use crate::raster::tile::place;

/// Half of the distance between a block's first and last pixel centres.
pub(super) const HALF: f32 = (BLOCK as f32 - 1.0) / 2.0;
/// The offset of each lane's pixel from the middle of its block.
pub(super) const LANE_X: [f32; LANES] = grid(true);
pub(super) const LANE_Y: [f32; LANES] = grid(false);
pub(super) const LANE_X_64: [f64; LANES] = widened(LANE_X);
pub(super) const LANE_Y_64: [f64; LANES] = widened(LANE_Y);
/// Blocks in a row of them, and rows.
pub(super) const BLOCKS_ACROSS: usize = 4;
/// The offsets of the middles of columns of blocks from their tile's corner, and of rows.
pub(super) const BLOCK_COLUMNS: [f64; BLOCKS_ACROSS] =
    [BLOCK_X[0], BLOCK_X[1], BLOCK_X[2], BLOCK_X[3]];
pub(super) const BLOCK_ROWS: [f64; BLOCKS_ACROSS] =
    [BLOCK_Y[0], BLOCK_Y[4], BLOCK_Y[8], BLOCK_Y[12]];
/// The offset of the middle of each block from its tile's corner.
pub(super) const BLOCK_X: [f64; BLOCKS] = middles(true);
pub(super) const BLOCK_Y: [f64; BLOCKS] = middles(false);

/// The column or row of each lane's pixel, from the block's middle.
const fn grid(column: bool) -> [f32; LANES] {
    let mut out = [0.0; LANES];
    let mut pixel = 0;
    while pixel < LANES {
        let (x, y) = (pixel % BLOCK, pixel / BLOCK);
        out[place(x, y) % LANES] = (if column { x } else { y }) as f32 - HALF;
        pixel += 1;
    }
    out
}

/// The same numbers in binary64.
const fn widened(lanes: [f32; LANES]) -> [f64; LANES] {
    let mut out = [0.0; LANES];
    let mut lane = 0;
    while lane < LANES {
        out[lane] = lanes[lane] as f64;
        lane += 1;
    }
    out
}

/// The middle, in x or y, of each block of a tile.
const fn middles(column: bool) -> [f64; BLOCKS] {
    let mut out = [0.0; BLOCKS];
    let mut block = 0;
    while block < BLOCKS {
        let at = if column {
            block % BLOCKS_ACROSS
        } else {
            block / BLOCKS_ACROSS
        };
        out[block] = (BLOCK * at) as f64 + BLOCK as f64 / 2.0;
        block += 1;
    }
    out
}
