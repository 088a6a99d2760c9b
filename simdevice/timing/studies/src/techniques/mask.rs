//! The pixels of a tile as bits.

use timing::work::TILE_SIDE;

const SIDE: usize = TILE_SIDE as usize;

/// A set of pixels of a tile: a word for each row, a bit for each pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Mask(pub [u16; SIDE]);

impl Mask {
    /// The pixels that satisfy a condition on column and row.
    pub fn of(condition: impl Fn(usize, usize) -> bool) -> Self {
        let row = |y: usize| (0..SIDE).fold(0, |bits, x| bits | u16::from(condition(x, y)) << x);
        Self(std::array::from_fn(row))
    }

    /// True if a pixel is in the set.
    pub fn has(&self, x: usize, y: usize) -> bool {
        self.0[y] >> x & 1 == 1
    }

    /// The pixels of both sets.
    pub fn and(&self, other: &Self) -> Self {
        Self(std::array::from_fn(|y| self.0[y] & other.0[y]))
    }

    /// The number of pixels.
    pub fn count(&self) -> u64 {
        self.rows().sum()
    }

    /// The number of pixels in each row.
    pub fn rows(&self) -> impl Iterator<Item = u64> {
        self.0.iter().map(|row| u64::from(row.count_ones()))
    }

    /// True if there is no pixel.
    pub fn is_empty(&self) -> bool {
        self.0 == [0; SIDE]
    }

    /// The quads of 2x2 pixels that have a pixel, a bit each, in rows of eight.
    pub fn quads(&self) -> u64 {
        (0..64).fold(0, |bits, quad| bits | u64::from(self.any(quad % 8 * 2, quad / 8 * 2, 2)) << quad)
    }

    /// The blocks of 4x4 pixels that have a pixel, a bit each, in rows of four.
    pub fn blocks(&self) -> u16 {
        (0..16).fold(0, |bits, block| bits | u16::from(self.any(block % 4 * 4, block / 4 * 4, 4)) << block)
    }

    /// True if a square of pixels from a corner has a pixel.
    fn any(&self, x: usize, y: usize, side: usize) -> bool {
        let columns = ((1 << side) - 1) << x;
        self.0[y..y + side].iter().any(|row| row & columns != 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_in_their_quads_and_blocks() {
        let mask = Mask::of(|x, y| (x, y) == (5, 9) || (x, y) == (15, 15));
        assert!(mask.has(5, 9) && !mask.has(9, 5));
        assert_eq!((mask.count(), mask.rows().max()), (2, Some(1)));
        assert_eq!(mask.quads(), 1 << (4 * 8 + 2) | 1 << 63);
        assert_eq!(mask.blocks(), 1 << (2 * 4 + 1) | 1 << 15);
        assert!(mask.and(&Mask::of(|x, _| x < 5)).is_empty());
        assert_eq!(Mask::of(|_, _| true).quads(), u64::MAX);
    }
}
