//! Decodes a fuzzer's bytes into choices. After the last byte, all choices are zero.

/// The bytes that are not used yet.
#[derive(Clone, Copy, Debug)]
pub struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    /// Choices from `bytes`.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self(bytes)
    }

    /// True if no byte is left.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// A byte.
    pub fn byte(&mut self) -> u8 {
        match self.0 {
            [first, rest @ ..] => {
                self.0 = rest;
                *first
            }
            [] => 0,
        }
    }

    /// A number below `count`, which is not 0 and at most 256.
    pub fn below(&mut self, count: usize) -> usize {
        usize::from(self.byte()) % count
    }

    /// One of some values.
    pub fn one<T: Clone>(&mut self, values: &[T]) -> T {
        values[self.below(values.len())].clone()
    }

    /// True in one of `count` cases.
    pub fn rarely(&mut self, count: usize) -> bool {
        self.below(count) == count - 1
    }

    /// Four bytes.
    pub fn word(&mut self) -> u32 {
        u32::from_le_bytes([0; 4].map(|_| self.byte()))
    }

    /// A small number in most cases; sometimes any number, or an edge case.
    pub fn number(&mut self, usual: u32) -> u32 {
        match self.below(16) {
            0 => self.word(),
            1 => self.one(&[u32::MAX, u32::MAX - 1, 1 << 31, i32::MAX.cast_unsigned(), 1 << 16, 0]),
            _ => self.word() % usual.max(1),
        }
    }

    /// A number as [`Bytes::number`] gives it, with twice as many bits.
    pub fn long(&mut self, usual: u32) -> u64 {
        match self.below(32) {
            0 => u64::from(self.word()) << 32 | u64::from(self.word()),
            1 => self.one(&[u64::MAX, u64::MAX - 3, 1 << 63, 1 << 40, u64::from(u32::MAX) + 1]),
            _ => self.number(usual).into(),
        }
    }

    /// A number of ordinary size in most cases; sometimes a huge one, a tiny one, or NaN.
    pub fn float(&mut self) -> f32 {
        match self.below(12) {
            0 => f32::from_bits(self.word()),
            1 => self.one(&[
                f32::NAN,
                f32::INFINITY,
                f32::NEG_INFINITY,
                f32::MAX,
                f32::MIN_POSITIVE,
                1e-40,
                -0.0,
                1e20,
                -1e20,
            ]),
            2 => 0.0,
            3 => 1.0,
            _ => f32::from(u16::from_le_bytes([self.byte(), self.byte()])) / 8192.0 - 2.0,
        }
    }
}
