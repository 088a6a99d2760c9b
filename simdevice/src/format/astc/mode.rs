//! The block mode: the grid of weights, their range, and whether there are two weights at each place.

use super::sequence::{Digit, Range};

/// The most weights of a block.
pub(super) const MAX_WEIGHTS: usize = 64;

/// A block mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Mode {
    /// The width and height of the grid of weights.
    pub(super) grid: [u32; 2],
    /// The range of weights.
    pub(super) range: Range,
    /// True if each place of the grid has two weights.
    pub(super) is_dual: bool,
}

impl Mode {
    /// Reads the 11 bits of a mode; `None` if it is reserved.
    pub(super) fn read(bits: u32) -> Option<Self> {
        let field = |low: u32, count: u32| bits >> low & ((1 << count) - 1);
        // A field between other two that are of the grid, in all modes.
        let a = field(5, 2);
        let (mut is_dual, mut is_precise) = (field(10, 1) == 1, field(9, 1) == 1);
        let (grid, high) = if field(0, 2) != 0 {
            let b = field(7, 2);
            let grid = match field(2, 2) {
                0 => [b + 4, a + 2],
                1 => [b + 8, a + 2],
                2 => [a + 2, b + 8],
                _ if field(8, 1) == 0 => [a + 2, (b & 1) + 6],
                _ => [(b & 1) + 2, a + 2],
            };
            (grid, field(0, 2))
        } else {
            let grid = match field(7, 2) {
                0 => [12, a + 2],
                1 => [a + 2, 12],
                2 => {
                    // The bits of the other flags are the grid's.
                    (is_dual, is_precise) = (false, false);
                    [a + 6, field(9, 2) + 6]
                }
                _ if a == 0 => [6, 10],
                _ if a == 1 => [10, 6],
                _ => return None,
            };
            (grid, field(2, 2))
        };
        let range = weight_range(high << 1 | field(4, 1), is_precise)?;
        Some(Self { grid, range, is_dual })
    }

    /// The number of weights.
    pub(super) fn weight_count(&self) -> usize {
        let [width, height] = self.grid;
        (width * height * (1 + u32::from(self.is_dual))) as usize
    }

    /// The number of bits that the weights take; `None` if these, or the weights, are too few or too many.
    pub(super) fn weight_bits(&self) -> Option<u32> {
        let count = self.weight_count();
        let bits = self.range.size(count);
        (count <= MAX_WEIGHTS && (24..=96).contains(&bits)).then_some(bits)
    }
}

/// The range of weights with a code, of low or of high precision; `None` if it is reserved.
fn weight_range(code: u32, is_precise: bool) -> Option<Range> {
    use Digit::{None as Bits, Quint, Trit};
    let (digit, bits) = match (code, is_precise) {
        (2, false) => (Bits, 1),
        (3, false) => (Trit, 0),
        (4, false) => (Bits, 2),
        (5, false) => (Quint, 0),
        (6, false) => (Trit, 1),
        (7, false) => (Bits, 3),
        (2, true) => (Quint, 1),
        (3, true) => (Trit, 2),
        (4, true) => (Bits, 4),
        (5, true) => (Quint, 2),
        (6, true) => (Trit, 3),
        (7, true) => (Bits, 5),
        _ => return None,
    };
    Some(Range { digit, bits })
}
