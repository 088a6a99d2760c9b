//! Sequences of integers ("integer sequence encoding"): each has some bits, and perhaps a digit of base 3 or 5, which
//! shares bits with the digits beside it.

/// The values of an integer: those of its bits, times those of its digit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Range {
    pub(super) digit: Digit,
    pub(super) bits: u32,
}

/// The digit of an integer, above its bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Digit {
    /// None.
    None,
    /// One of three.
    Trit,
    /// One of five.
    Quint,
}

const fn range(digit: Digit, bits: u32) -> Range {
    Range { digit, bits }
}

/// The ranges of colours, largest first.
const COLORS: [Range; 17] = {
    use Digit::{None, Quint, Trit};
    [
        range(None, 8),
        range(Trit, 6),
        range(Quint, 5),
        range(None, 7),
        range(Trit, 5),
        range(Quint, 4),
        range(None, 6),
        range(Trit, 4),
        range(Quint, 3),
        range(None, 5),
        range(Trit, 3),
        range(Quint, 2),
        range(None, 4),
        range(Trit, 2),
        range(Quint, 1),
        range(None, 3),
        range(Trit, 1),
    ]
};

/// The bits that follow the bits of each integer of a group of five, and belong to all five trits.
const TRIT_BITS: [u32; 5] = [2, 2, 1, 2, 1];

/// The bits that follow the bits of each integer of a group of three, and belong to all three quints.
const QUINT_BITS: [u32; 3] = [3, 2, 2];

/// The trits of each group of eight bits.
static TRITS: [[u8; 5]; 256] = {
    let mut all = [[0; 5]; 256];
    let mut code = 0;
    while code < 256 {
        all[code] = trits(code as u32);
        code += 1;
    }
    all
};

/// The quints of each group of seven bits.
static QUINTS: [[u8; 3]; 128] = {
    let mut all = [[0; 3]; 128];
    let mut code = 0;
    while code < 128 {
        all[code] = quints(code as u32);
        code += 1;
    }
    all
};

const fn bits(word: u32, low: u32, count: u32) -> u32 {
    word >> low & ((1 << count) - 1)
}

/// The digit 2 if its high bit is set, and otherwise its low bit.
const fn low_digit(high: u32, low: u32) -> u32 {
    high << 1 | (low & !high & 1)
}

const fn trits(code: u32) -> [u8; 5] {
    let (rest, t3, t4) = if bits(code, 2, 3) == 0b111 {
        (bits(code, 5, 3) << 2 | bits(code, 0, 2), 2, 2)
    } else if bits(code, 5, 2) == 0b11 {
        (bits(code, 0, 5), bits(code, 7, 1), 2)
    } else {
        (bits(code, 0, 5), bits(code, 5, 2), bits(code, 7, 1))
    };
    let (t0, t1, t2) = if bits(rest, 0, 2) == 0b11 {
        (low_digit(bits(rest, 3, 1), bits(rest, 2, 1)), bits(rest, 4, 1), 2)
    } else if bits(rest, 2, 2) == 0b11 {
        (bits(rest, 0, 2), 2, 2)
    } else {
        (low_digit(bits(rest, 1, 1), bits(rest, 0, 1)), bits(rest, 2, 2), bits(rest, 4, 1))
    };
    [t0 as u8, t1 as u8, t2 as u8, t3 as u8, t4 as u8]
}

const fn quints(code: u32) -> [u8; 3] {
    if bits(code, 1, 2) == 0b11 && bits(code, 5, 2) == 0 {
        let low = bits(code, 0, 1);
        let others = if low == 1 { 0 } else { bits(code, 3, 2) };
        // Bits 4 and 3 of the code are bits 1 and 0 of the quint.
        return [4, 4, (low << 2 | others) as u8];
    }
    let (rest, q2) = if bits(code, 1, 2) == 0b11 {
        (bits(code, 3, 2) << 3 | (bits(code, 5, 2) ^ 0b11) << 1 | bits(code, 0, 1), 4)
    } else {
        (bits(code, 0, 5), bits(code, 5, 2))
    };
    let (q0, q1) = if bits(rest, 0, 3) == 0b101 { (bits(rest, 3, 2), 4) } else { (bits(rest, 0, 3), bits(rest, 3, 2)) };
    [q0 as u8, q1 as u8, q2 as u8]
}

impl Range {
    /// The largest range of which `count` integers fit `bits`; `None` if there is no such range for colours.
    pub(super) fn of_colors(count: usize, bits: u32) -> Option<Self> {
        COLORS.into_iter().find(|range| range.size(count) <= bits)
    }

    /// The number of bits of `count` integers.
    pub(super) fn size(self, count: usize) -> u32 {
        let count = count as u32;
        let digits = match self.digit {
            Digit::None => 0,
            Digit::Trit => (8 * count).div_ceil(5),
            Digit::Quint => (7 * count).div_ceil(3),
        };
        count * self.bits + digits
    }

    /// Reads integers from the low bits of a stream: the bits of each, and above them its digit.
    pub(super) fn read(self, stream: u128, out: &mut [u8]) {
        // The last group is read as if zeros followed.
        let size = self.size(out.len());
        let mut stream = Stream(stream & (u128::MAX >> (128 - size)));
        match self.digit {
            Digit::None => {
                for value in out {
                    *value = stream.next(self.bits) as u8;
                }
            }
            Digit::Trit => self.read_groups(&mut stream, TRIT_BITS, &TRITS, out),
            Digit::Quint => self.read_groups(&mut stream, QUINT_BITS, &QUINTS, out),
        }
    }

    /// Reads groups of `N` integers, whose digits are looked up.
    fn read_groups<const N: usize>(self, stream: &mut Stream, bits: [u32; N], digits: &[[u8; N]], out: &mut [u8]) {
        for group in out.chunks_mut(N) {
            let mut low = [0; N];
            let (mut code, mut shift) = (0, 0);
            for (low, bits) in low.iter_mut().zip(bits) {
                *low = stream.next(self.bits);
                code |= stream.next(bits) << shift;
                shift += bits;
            }
            let digits = digits[code as usize];
            for ((value, low), digit) in group.iter_mut().zip(low).zip(digits) {
                *value = digit << self.bits | low as u8;
            }
        }
    }
}

/// Bits that are read from the lowest up, and zeros after them.
#[derive(Debug)]
struct Stream(u128);

impl Stream {
    fn next(&mut self, count: u32) -> u32 {
        let bits = self.0 as u32 & ((1 << count) - 1);
        self.0 >>= count;
        bits
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[gaurast_runner::test]
    fn every_combination_of_digits_has_a_code() {
        let trits: BTreeSet<_> = TRITS.iter().collect();
        assert_eq!(trits.len(), 243);
        assert!(trits.iter().all(|digits| digits.iter().all(|&digit| digit < 3)));
        let quints: BTreeSet<_> = QUINTS.iter().collect();
        assert_eq!(quints.len(), 125);
        assert!(quints.iter().all(|digits| digits.iter().all(|&digit| digit < 5)));
    }

    #[gaurast_runner::test]
    fn integers_are_read_from_interleaved_bits() {
        let mut values = [0; 3];
        range(Digit::None, 3).read(0b101_011_110, &mut values);
        assert_eq!(values, [0b110, 0b011, 0b101]);
        // The integers' bits are 1, 0 and 1. Three bits, two and two of the code of their quints follow them.
        let code = QUINTS.iter().position(|&quints| quints == [1, 3, 2]).unwrap() as u128;
        let stream = 1 | (code & 7) << 1 | (code >> 3 & 3) << 5 | 1 << 7 | (code >> 5) << 8;
        range(Digit::Quint, 1).read(stream, &mut values);
        assert_eq!(values, [3, 6, 5]);
    }

    #[gaurast_runner::test]
    fn a_last_group_lacks_bits_that_are_zero() {
        // Two trits take four bits: the first four of a code whose other four are zero.
        assert_eq!(range(Digit::Trit, 0).size(2), 4);
        let mut values = [0; 2];
        range(Digit::Trit, 0).read(0xF6, &mut values);
        assert_eq!(values, [TRITS[6][0], TRITS[6][1]]);
    }

    #[gaurast_runner::test]
    fn colours_have_the_largest_range_that_fits() {
        assert_eq!(Range::of_colors(2, 111), Some(range(Digit::None, 8)));
        assert_eq!(Range::of_colors(8, 63), Some(range(Digit::Trit, 6)));
        assert_eq!(Range::of_colors(18, 47), Some(range(Digit::Trit, 1)));
        assert_eq!(Range::of_colors(18, 46), None);
    }
}
