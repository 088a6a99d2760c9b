//! Tiles: 16x16 pixels of a macro-tile, and the order of their pixels in tile buffers.
//!
//! Pixels are stored in an order in which 2x2 quads are consecutive, then 4x4 blocks, then rows of blocks. A quad is
//! four lanes of a vector, and a block is all sixteen.

pub use crate::limits::MAX_FRAMEBUFFER_SIZE;
use crate::limits::{MAX_MACRO_TILE_SIZE, TILE_SIZE};
use crate::state::Rect;

/// The side of a tile in pixels.
pub const SIDE: usize = TILE_SIZE as usize;
/// The number of pixels of a tile.
pub const AREA: usize = SIDE * SIDE;
// A tile buffer has one bit per tile in a 64-bit word.
const _: () = assert!((MAX_MACRO_TILE_SIZE / TILE_SIZE).pow(2) <= u64::BITS);

/// The index in the tile of the pixel at (x, y) from its corner.
#[inline(always)]
pub const fn place(x: usize, y: usize) -> usize {
    (x & 1) | (y & 1) << 1 | (x & 2) << 1 | (y & 2) << 2 | (x & 12) << 2 | (y & 12) << 4
}

/// A tile of a macro-tile: its index there, and the pixels of it that the pass may touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tile {
    /// The index in the macro-tile, row by row.
    pub index: usize,
    /// The column and row in tiles from the framebuffer's corner.
    pub at: [u32; 2],
    /// The pixels that the pass may touch. Never empty, and never left of or above the framebuffer.
    pub pixels: Rect,
}

impl Tile {
    /// The tiles of macro-tile (`column`, `row`) of `size` pixels that have pixels of `area`.
    pub fn of_macro_tile(size: u32, [column, row]: [u32; 2], area: Rect) -> impl Iterator<Item = Self> {
        let side = size / TILE_SIZE;
        (0..side * side).filter_map(move |index| {
            let at = [column * side + index % side, row * side + index / side];
            let whole = Rect {
                x: (at[0] * TILE_SIZE) as i32,
                y: (at[1] * TILE_SIZE) as i32,
                width: TILE_SIZE,
                height: TILE_SIZE,
            };
            let pixels = whole.intersect(area);
            (!pixels.is_empty()).then_some(Self { index: index as usize, at, pixels })
        })
    }

    /// The rows of `rect` that lie in this tile's pixels: y, and the columns, both in pixels from the tile's corner.
    pub fn rows(&self, rect: Rect) -> impl Iterator<Item = (usize, std::ops::Range<usize>)> {
        let part = self.pixels.intersect(rect);
        let inside = |at: i32| (at as u32 % TILE_SIZE) as usize;
        let (x, y) = (inside(part.x), inside(part.y));
        let height = if part.is_empty() { 0 } else { part.height };
        (y..y + height as usize).map(move |y| (y, x..x + part.width as usize))
    }

    /// The pixel of the framebuffer at (x, y) from the tile's corner.
    pub(super) fn pixel(&self, x: usize, y: usize) -> [u32; 2] {
        [self.at[0] * TILE_SIZE + x as u32, self.at[1] * TILE_SIZE + y as u32]
    }
}

/// Vulkan's standard sample positions of 4 samples, in 1/256 pixels.
pub const SAMPLES_4: [[i32; 2]; 4] = [[96, 32], [224, 96], [32, 160], [160, 224]];

/// The position of the only sample of a pixel, its centre, in 1/256 pixels.
pub const CENTER: [[i32; 2]; 1] = [[128, 128]];

/// The column of each lane of a block.
pub const LANE_X: [i32; 16] = lanes(0);

/// The row of each lane of a block.
pub const LANE_Y: [i32; 16] = lanes(1);

/// The coordinates of a block's pixels along an axis, lane by lane: bits 0 and 2 of a lane are its column, 1 and 3 its
/// row.
const fn lanes(axis: usize) -> [i32; 16] {
    let mut out = [0; 16];
    let mut lane = 0;
    while lane < 16 {
        let bits = lane >> axis;
        out[lane] = (bits & 1 | (bits >> 1) & 2) as i32;
        lane += 1;
    }
    out
}

/// The column of the first pixel of each block of a tile, from the tile's corner.
pub const BLOCK_X: [i32; 16] = [0, 4, 8, 12, 0, 4, 8, 12, 0, 4, 8, 12, 0, 4, 8, 12];

/// The row of the first pixel of each block of a tile, from the tile's corner.
pub const BLOCK_Y: [i32; 16] = [0, 0, 0, 0, 4, 4, 4, 4, 8, 8, 8, 8, 12, 12, 12, 12];

/// The number of blocks of a tile.
pub(super) const BLOCKS: usize = 16;

/// The first pixel of a block of the tile at pixel `at`.
#[inline(always)]
pub(super) fn block_corner([x, y]: [i32; 2], block: usize) -> [i32; 2] {
    [x + (block % 4 * 4) as i32, y + (block / 4 * 4) as i32]
}

#[cfg(test)]
mod tests {
    use super::*;

    const AREA_20X17: Rect = Rect { x: 3, y: 0, width: 17, height: 17 };

    #[gaurast_runner::test]
    fn tiles_are_clipped_to_the_area() {
        let tiles: Vec<_> = Tile::of_macro_tile(32, [0, 0], AREA_20X17).collect();
        let rects: Vec<_> = tiles
            .iter()
            .map(|tile| {
                let Rect { x, y, width, height } = tile.pixels;
                (tile.index, x, y, width, height)
            })
            .collect();
        assert_eq!(rects, [(0, 3, 0, 13, 16), (1, 16, 0, 4, 16), (2, 3, 16, 13, 1), (3, 16, 16, 4, 1)]);
        assert_eq!(tiles[3].rows(AREA_20X17).collect::<Vec<_>>(), [(0, 0..4)]);
        assert_eq!(Tile::of_macro_tile(32, [1, 0], AREA_20X17).count(), 0);
    }

    #[gaurast_runner::test]
    fn quads_and_blocks_are_consecutive() {
        let mut seen = [false; AREA];
        for y in 0..SIDE {
            for x in 0..SIDE {
                let at = place(x, y);
                assert!(!std::mem::replace(&mut seen[at], true));
                assert_eq!(at / 16, y / 4 * 4 + x / 4);
                assert_eq!(at / 4 % 4, y / 2 % 2 * 2 + x / 2 % 2);
                assert_eq!(at % 4, y % 2 * 2 + x % 2);
            }
        }
    }
}
