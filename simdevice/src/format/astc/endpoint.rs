//! Endpoints: the two colours between which the texels of a partition lie.

use super::sequence::{Digit, Range};

/// The most integers of a block's endpoints.
pub(super) const MAX_VALUES: usize = 18;

/// The two colours of a partition: red, green, blue and alpha of 8 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Endpoints([[u8; 4]; 2]);

/// The expansion of the components of endpoints to 16 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Expansion {
    /// The byte twice.
    Linear,
    /// The byte, and half of its unit.
    Srgb,
}

/// The number of integers of an endpoint mode.
pub(super) fn value_count(mode: u32) -> usize {
    2 * (mode as usize / 4 + 1)
}

/// A colour before it is clamped.
type Color = [i32; 4];

const OPAQUE: i32 = 255;

impl Endpoints {
    /// The endpoints of an endpoint mode and its integers of a range; `None` for modes of the HDR profile.
    pub(super) fn decode(mode: u32, values: &[u8], range: Range) -> Option<Self> {
        let mut v = [0i32; 8];
        for (v, &value) in v.iter_mut().zip(values) {
            *v = i32::from(unquantized(value, range));
        }
        let grey = |luminance: i32, alpha: i32| [luminance, luminance, luminance, alpha];
        let scaled = |alphas: [i32; 2]| {
            let base = [v[0], v[1], v[2]];
            let [r, g, b] = base.map(|component| (component * v[3]) >> 8);
            [[r, g, b, alphas[0]], [base[0], base[1], base[2], alphas[1]]]
        };
        let colors = match mode {
            0 => [grey(v[0], OPAQUE), grey(v[1], OPAQUE)],
            1 => {
                let low = v[0] >> 2 | v[1] & 0xC0;
                [grey(low, OPAQUE), grey(low + (v[1] & 0x3F), OPAQUE)]
            }
            4 => [grey(v[0], v[2]), grey(v[1], v[3])],
            5 => {
                let [base, alpha] = [0, 2].map(|at| base_and_offset([v[at], v[at + 1]]));
                [grey(base[0], alpha[0]), grey(base[0] + base[1], alpha[0] + alpha[1])]
            }
            6 => scaled([OPAQUE; 2]),
            8 => direct(&[v[0], v[1], v[2], v[3], v[4], v[5], OPAQUE, OPAQUE]),
            // An offset of zero from opaque.
            9 => offset(pairs(&v), [OPAQUE, 0]),
            10 => scaled([v[4], v[5]]),
            12 => direct(&v),
            13 => offset(pairs(&v), base_and_offset([v[6], v[7]])),
            _ => return None,
        };
        Some(Self(colors.map(|color| color.map(|component| component.clamp(0, 255) as u8))))
    }

    /// The colours in 16 bits.
    pub(super) fn expand(self, expansion: Expansion) -> [[u16; 4]; 2] {
        self.0.map(|color| {
            color.map(|component| {
                let low = if expansion == Expansion::Srgb { 0x80 } else { component };
                u16::from_be_bytes([component, low])
            })
        })
    }
}

/// Two colours as they are, or in the other order and contracted.
fn direct(v: &[i32; 8]) -> [Color; 2] {
    let [first, second] = [0, 1].map(|at| [v[at], v[at + 2], v[at + 4], v[at + 6]]);
    if sum(second) >= sum(first) { [first, second] } else { [contracted(second), contracted(first)] }
}

/// A colour and its sum with an offset, of pairs of base and offset; or in the other order and contracted.
fn offset([r, g, b]: [[i32; 2]; 3], alpha: [i32; 2]) -> [Color; 2] {
    let pairs = [r, g, b, alpha];
    let base = pairs.map(|[base, _]| base);
    let moved = pairs.map(|[base, offset]| base + offset);
    let offsets = r[1] + g[1] + b[1];
    if offsets >= 0 { [base, moved] } else { [contracted(moved), contracted(base)] }
}

fn sum([r, g, b, _]: Color) -> i32 {
    r + g + b
}

/// The bases and offsets of red, green and blue.
fn pairs(v: &[i32; 8]) -> [[i32; 2]; 3] {
    [0, 2, 4].map(|at| base_and_offset([v[at], v[at + 1]]))
}

/// A byte and a signed number of six bits: the highest bit of the second integer is the first one's.
fn base_and_offset([base, offset]: [i32; 2]) -> [i32; 2] {
    let six_bits = offset >> 1 & 0x3F;
    [base >> 1 | offset & 0x80, if six_bits < 32 { six_bits } else { six_bits - 64 }]
}

/// A colour whose red and green are relative to blue ("blue contraction").
fn contracted([r, g, b, a]: Color) -> Color {
    [(r + b) >> 1, (g + b) >> 1, b, a]
}

/// The byte of an integer of a range.
fn unquantized(value: u8, range: Range) -> u8 {
    let value = u32::from(value);
    let low = value & ((1 << range.bits) - 1);
    let digit = value >> range.bits;
    // The bits above the lowest.
    let high = low >> 1;
    let (factor, summand) = match (range.digit, range.bits) {
        (Digit::None, bits) => {
            // The bits are repeated up to eight. Colours have at least three.
            let repeated = value << 8 >> bits | value << 8 >> (2 * bits) | value << 8 >> (3 * bits);
            return repeated as u8;
        }
        (Digit::Trit, 1) => (204, 0),
        (Digit::Trit, 2) => (93, high * 0b1_0001_0110),
        (Digit::Trit, 3) => (44, high << 7 | high << 2 | high),
        (Digit::Trit, 4) => (22, high << 6 | high),
        (Digit::Trit, 5) => (11, high << 5 | high >> 2),
        (Digit::Trit, _) => (5, high << 4 | high >> 4),
        (Digit::Quint, 1) => (113, 0),
        (Digit::Quint, 2) => (54, high * 0b1_0000_1100),
        (Digit::Quint, 3) => (26, high << 7 | high << 1 | high >> 1),
        (Digit::Quint, 4) => (13, high << 6 | high >> 1),
        (Digit::Quint, _) => (6, high << 5 | high >> 3),
    };
    let mask = (low & 1) * 0x1FF;
    let mixed = (digit * factor + summand) ^ mask;
    (mask & 0x80 | mixed >> 2) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[gaurast_runner::test]
    fn values_of_a_range_are_spread_evenly() {
        for (digit, bits, digits) in [(Digit::None, 3..9, 1u32), (Digit::Trit, 1..7, 3), (Digit::Quint, 1..6, 5)] {
            for bits in bits {
                let count = digits << bits;
                let mut bytes: Vec<_> =
                    (0..count).map(|value| unquantized(value as u8, Range { digit, bits })).collect();
                bytes.sort_unstable();
                for (index, &byte) in bytes.iter().enumerate() {
                    let exact = 255.0 * index as f32 / (count - 1) as f32;
                    assert!((f32::from(byte) - exact).abs() < 1.5, "{digit:?} {bits}: {bytes:?}");
                }
                assert!(bytes.windows(2).all(|pair| pair[0] < pair[1]), "{digit:?} {bits}: {bytes:?}");
                assert_eq!((bytes[0], bytes[bytes.len() - 1]), (0, 255));
            }
        }
    }
}
