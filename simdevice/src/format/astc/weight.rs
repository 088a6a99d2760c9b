//! The weights of a block: their values, and those of texels between the places of their grid.

use super::mode::{MAX_WEIGHTS, Mode};
use super::sequence::{Digit, Range};

/// The widest grid.
const MAX_SIDE: usize = 12;

/// The weights of a plane, row by row, with zeros after the last for the neighbours of those at the edges.
type Plane = [u8; MAX_WEIGHTS + MAX_SIDE + 1];

/// The weights of a block, from 0 to 64.
#[derive(Clone, Debug)]
pub(super) struct Weights {
    planes: [Plane; 2],
    grid: [u32; 2],
}

/// A place between two weights along an axis: the first, and sixteenths of the way to the second.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Place {
    index: u32,
    fraction: u32,
}

impl Place {
    /// The place of texel `texel` of `extent` texels on an axis with `grid` weights.
    fn new(texel: u32, extent: u32, grid: u32) -> Self {
        let scale = (1024 + extent / 2) / (extent - 1);
        let at = (scale * texel * (grid - 1) + 32) >> 6;
        Self { index: at >> 4, fraction: at & 15 }
    }
}

impl Weights {
    pub(super) fn read(block: u128, mode: &Mode) -> Self {
        let count = mode.weight_count();
        let mut values = [0; MAX_WEIGHTS];
        mode.range.read(block.reverse_bits(), &mut values[..count]);
        let mut planes = [[0; MAX_WEIGHTS + MAX_SIDE + 1]; 2];
        for (index, &value) in values[..count].iter().enumerate() {
            let (plane, index) = if mode.is_dual { (index % 2, index / 2) } else { (0, index) };
            planes[plane][index] = unquantized(value, mode.range);
        }
        Self { planes, grid: mode.grid }
    }

    /// The places of the texels of a row.
    pub(super) fn columns(&self, extent: u32) -> [Place; MAX_SIDE] {
        let mut places = [Place::default(); MAX_SIDE];
        for (place, texel) in places.iter_mut().zip(0..extent) {
            *place = Place::new(texel, extent, self.grid[0]);
        }
        places
    }

    /// The place of a row of texels.
    pub(super) fn row(&self, y: u32, extent: u32) -> Place {
        Place::new(y, extent, self.grid[1])
    }

    /// The weight of a plane at a place.
    pub(super) fn at(&self, plane: usize, column: Place, row: Place) -> u32 {
        let width = self.grid[0] as usize;
        let first = row.index as usize * width + column.index as usize;
        let both = column.fraction * row.fraction;
        let w11 = (both + 8) >> 4;
        let (w10, w01) = (row.fraction - w11, column.fraction - w11);
        let w00 = 16 + w11 - column.fraction - row.fraction;
        let at = |index: usize| u32::from(self.planes[plane][index]);
        (at(first) * w00 + at(first + 1) * w01 + at(first + width) * w10 + at(first + width + 1) * w11 + 8) >> 4
    }
}

/// The weight, from 0 to 64, of a value of a range.
fn unquantized(value: u8, range: Range) -> u8 {
    let value = u32::from(value);
    let low = value & ((1 << range.bits) - 1);
    let digit = value >> range.bits;
    let [a, b] = [low & 1, low >> 1 & 1];
    let (factor, summand) = match (range.digit, range.bits) {
        (Digit::None, bits) => {
            // The bits are repeated up to six.
            let repeated = value << (6 - bits) | value << 6 >> (2 * bits) | value << 6 >> (3 * bits);
            return spread(if bits == 1 { 63 * value } else { repeated & 63 });
        }
        (Digit::Trit, 0) => return spread([0, 32, 63][digit as usize]),
        (Digit::Quint, 0) => return spread([0, 16, 32, 47, 63][digit as usize]),
        (Digit::Trit, 1) => (50, 0),
        (Digit::Trit, 2) => (23, b << 6 | b << 2 | b),
        (Digit::Trit, _) => (11, (low >> 1) << 5 | low >> 1),
        (Digit::Quint, 1) => (28, 0),
        (Digit::Quint, _) => (13, b << 6 | b << 1),
    };
    let mask = a * 0x7F;
    let mixed = (digit * factor + summand) ^ mask;
    spread(mask & 0x20 | mixed >> 2)
}

/// A weight from 0 to 63 in the range from 0 to 64.
fn spread(weight: u32) -> u8 {
    (weight + u32::from(weight > 32)) as u8
}

#[cfg(test)]
mod tests {
    use super::super::sequence::{Digit, Range};
    use super::*;

    #[gaurast_runner::test]
    fn values_of_a_range_are_spread_evenly() {
        for (digit, bits, digits) in [(Digit::None, 1..6, 1u8), (Digit::Trit, 0..4, 3), (Digit::Quint, 0..3, 5)] {
            for bits in bits {
                let count = digits << bits;
                let mut weights: Vec<_> = (0..count).map(|value| unquantized(value, Range { digit, bits })).collect();
                weights.sort_unstable();
                for (index, &weight) in weights.iter().enumerate() {
                    let exact = 64.0 * index as f32 / f32::from(count - 1);
                    assert!((f32::from(weight) - exact).abs() < 1.5, "{digit:?} {bits}: {weights:?}");
                }
                assert!(weights.windows(2).all(|pair| pair[0] < pair[1]), "{digit:?} {bits}: {weights:?}");
                assert_eq!((weights[0], weights[weights.len() - 1]), (0, 64));
            }
        }
    }
}
