//! The places of a block's pixels and of a tile's blocks.

use crate::limits::TILE_SIZE;
use crate::raster::tile::place;
use crate::state::Rect;

/// Pixels along a tile's side.
pub(crate) const TILE: usize = TILE_SIZE as usize;

/// Pixels of a block, which are the lanes of a vector.
pub(crate) const BLOCK_PIXELS: usize = 16;

/// The side of a block in pixels.
pub(crate) const BLOCK: usize = 4;

/// Blocks of a tile.
pub(crate) const BLOCKS: usize = 16;

/// A bit for each of them.
pub(crate) const ALL_BLOCKS: u64 = (1 << BLOCKS) - 1;

/// Gaussians of a round: as many as phases pass on through the first-level cache, and a word has bits.
pub(crate) const ROUND: usize = 32;

/// The places of arrays that are indexed by a Gaussian's number in its round. They are more than [`ROUND`], so that the
/// number of a word's lowest bit, which is [`ROUND`] for zero, is a place without a check.
pub(crate) const PLACES: usize = ROUND + 8;

/// Half of the distance between a block's first and last pixel centres.
pub(crate) const HALF: f32 = (BLOCK as f32 - 1.0) / 2.0;

/// The offset of each lane's pixel from the middle of its block.
pub(crate) const LANE_X: [f32; BLOCK_PIXELS] = grid(true);

pub(crate) const LANE_Y: [f32; BLOCK_PIXELS] = grid(false);

pub(crate) const LANE_X_64: [f64; BLOCK_PIXELS] = widened(LANE_X);

pub(crate) const LANE_Y_64: [f64; BLOCK_PIXELS] = widened(LANE_Y);

/// Blocks in a row of them, and rows.
pub(crate) const BLOCKS_ACROSS: usize = 4;

/// The middles of a tile's columns of blocks, and of its rows of blocks, in pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BlockMiddles {
    pub(crate) x: [f64; BLOCKS_ACROSS],
    pub(crate) y: [f64; BLOCKS_ACROSS],
}

impl BlockMiddles {
    /// The middles of the blocks of the tile at `corner`.
    #[inline(always)]
    pub(crate) fn new([x, y]: [u32; 2]) -> Self {
        let [x, y] = [f64::from(x), f64::from(y)];
        let [first, second, third, fourth] = [BLOCK_X[0], BLOCK_X[1], BLOCK_X[2], BLOCK_X[3]];
        Self { x: [x + first, x + second, x + third, x + fourth], y: [y + first, y + second, y + third, y + fourth] }
    }
}

/// The offset of the middle of each block from its tile's corner.
pub(crate) const BLOCK_X: [f64; BLOCKS] = middles(true);

pub(crate) const BLOCK_Y: [f64; BLOCKS] = middles(false);

/// The column or row of each lane's pixel, from the block's middle.
const fn grid(column: bool) -> [f32; BLOCK_PIXELS] {
    let mut out = [0.0; BLOCK_PIXELS];
    let mut pixel = 0;
    while pixel < BLOCK_PIXELS {
        let (x, y) = (pixel % BLOCK, pixel / BLOCK);
        out[place(x, y) % BLOCK_PIXELS] = (if column { x } else { y }) as f32 - HALF;
        pixel += 1;
    }
    out
}

/// Numbers of lanes in binary64.
const fn widened(lanes: [f32; BLOCK_PIXELS]) -> [f64; BLOCK_PIXELS] {
    let mut out = [0.0; BLOCK_PIXELS];
    let mut lane = 0;
    while lane < BLOCK_PIXELS {
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
        let at = if column { block % BLOCKS_ACROSS } else { block / BLOCKS_ACROSS };
        out[block] = (BLOCK * at) as f64 + BLOCK as f64 / 2.0;
        block += 1;
    }
    out
}

/// A set of a tile's pixels: by block, a bit for each lane.
pub(crate) type PixelMask = [u32; BLOCKS];

/// Every lane of a block.
pub(crate) const ALL_LANES: u32 = (1 << BLOCK_PIXELS) - 1;

/// The block of a pixel of a tile, and the lane in it.
pub(crate) fn block_and_lane(x: usize, y: usize) -> (usize, usize) {
    let place = place(x, y);
    (place / BLOCK_PIXELS % BLOCKS, place % BLOCK_PIXELS)
}

/// The number of pixels in `lanes`.
pub(crate) fn count(lanes: &PixelMask) -> u32 {
    lanes.iter().map(|lanes| lanes.count_ones()).sum()
}

/// The pixels of `bounds` in the tile at `corner`.
pub(crate) fn lanes_within(bounds: Rect, corner: [u32; 2]) -> PixelMask {
    let tile = Rect { x: corner[0] as i32, y: corner[1] as i32, width: TILE_SIZE, height: TILE_SIZE };
    let inside = bounds.intersect(tile);
    if [inside.width, inside.height] == [TILE_SIZE; 2] {
        return [ALL_LANES; BLOCKS];
    }
    let mut lanes = [0; BLOCKS];
    if inside.is_empty() {
        return lanes;
    }
    let first = [inside.x as u32 - corner[0], inside.y as u32 - corner[1]];
    for y in first[1]..first[1] + inside.height {
        for x in first[0]..first[0] + inside.width {
            let (block, lane) = block_and_lane(x as usize, y as usize);
            lanes[block] |= 1 << lane;
        }
    }
    lanes
}
