//! ETC2 and EAC: blocks of 4x4 texels of 8 bytes for colours, and of 8 bytes for a single component.
//!
//! Khronos Data Format Specification 1.4, "ETC2 Compressed Texture Image Formats". A block is a big-endian word, and its
//! texels are numbered column by column. All arithmetic is in integers, as the specification has it.

use super::block::{SIDE, TEXELS};

/// A word of a block.
#[derive(Clone, Copy, Debug)]
struct Word(u64);

impl Word {
    /// The first or second word of a block.
    fn of(bytes: &[u8; 16], index: usize) -> Self {
        Self(u64::from_be_bytes(bytes.as_chunks::<8>().0[index]))
    }

    /// A field of `count` bits that begins at bit `low`.
    fn field(self, low: u32, count: u32) -> i32 {
        (self.0 >> low & ((1 << count) - 1)) as i32
    }

    fn bit(self, at: u32) -> bool {
        self.field(at, 1) == 1
    }

    /// A two's-complement number of three bits.
    fn delta(self, low: u32) -> i32 {
        let field = self.field(low, 3);
        if field < 4 { field } else { field - 8 }
    }
}

/// Red, green and blue before they are clamped to a byte.
type Rgb = [i32; 3];

/// The four colours among which the texels of a block, or of half a block, choose.
type Palette = [[u8; 4]; 4];

/// The modifiers of the individual and the differential mode: a small one and a large one.
const MODIFIERS: [[i32; 2]; 8] = [[2, 8], [5, 17], [9, 29], [13, 42], [18, 60], [24, 80], [33, 106], [47, 183]];

/// The distances of the T and the H mode.
const DISTANCES: [i32; 8] = [3, 6, 11, 16, 23, 32, 41, 64];

/// The modifiers of a single component, by table.
const COMPONENT_MODIFIERS: [[i32; 8]; 16] = [
    [-3, -6, -9, -15, 2, 5, 8, 14],
    [-3, -7, -10, -13, 2, 6, 9, 12],
    [-2, -5, -8, -13, 1, 4, 7, 12],
    [-2, -4, -6, -13, 1, 3, 5, 12],
    [-3, -6, -8, -12, 2, 5, 7, 11],
    [-3, -7, -9, -11, 2, 6, 8, 10],
    [-4, -7, -8, -11, 3, 6, 7, 10],
    [-3, -5, -8, -11, 2, 4, 7, 10],
    [-2, -6, -8, -10, 1, 5, 7, 9],
    [-2, -5, -8, -10, 1, 4, 7, 9],
    [-2, -4, -8, -10, 1, 3, 7, 9],
    [-2, -5, -7, -10, 1, 4, 6, 9],
    [-3, -4, -7, -10, 2, 3, 6, 9],
    [-1, -2, -3, -10, 0, 1, 2, 9],
    [-4, -6, -8, -9, 3, 5, 7, 8],
    [-3, -5, -7, -9, 2, 4, 6, 8],
];

fn from_4_bits(code: i32) -> i32 {
    code << 4 | code
}

fn from_5_bits(code: i32) -> i32 {
    code << 3 | code >> 2
}

fn from_6_bits(code: i32) -> i32 {
    code << 2 | code >> 4
}

fn from_7_bits(code: i32) -> i32 {
    code << 1 | code >> 6
}

/// The opaque colour at a distance from a base colour.
fn opaque(base: Rgb, distance: i32) -> [u8; 4] {
    let [r, g, b] = base.map(|component| (component + distance).clamp(0, 255) as u8);
    [r, g, b, u8::MAX]
}

/// The coding of the texels of a block of colours.
#[derive(Clone, Copy, Debug)]
enum Colors {
    /// A palette for each half of the block. The halves lie beside each other, or one upon the other if `is_flipped`.
    Palettes { halves: [Palette; 2], is_flipped: bool },
    /// The colours at the block's corner and, from there on, four texels to the right and four texels below.
    Plane { corner: Rgb, right: Rgb, below: Rgb },
}

impl Colors {
    /// Reads a word. A word with `punchthrough` has no individual mode, and may have transparent texels.
    fn read(word: Word, punchthrough: bool) -> Self {
        if !punchthrough && !word.bit(33) {
            let bases = [[60, 52, 44], [56, 48, 40]].map(|lows| lows.map(|low| from_4_bits(word.field(low, 4))));
            return Self::halves(word, bases, true);
        }
        let codes = [59, 51, 43].map(|low| word.field(low, 5));
        let deltas = [56, 48, 40].map(|low| word.delta(low));
        let sums: Rgb = std::array::from_fn(|channel| codes[channel] + deltas[channel]);
        let is_opaque = !punchthrough || word.bit(33);
        match sums.map(|sum| (0..32).contains(&sum)) {
            [false, ..] => Self::t(word).or_transparent(is_opaque),
            [_, false, _] => Self::h(word).or_transparent(is_opaque),
            [_, _, false] => Self::plane(word),
            _ => {
                Self::halves(word, [codes, sums].map(|base| base.map(from_5_bits)), is_opaque).or_transparent(is_opaque)
            }
        }
    }

    /// The individual and the differential mode. Blocks that aren't opaque have no small modifier.
    fn halves(word: Word, bases: [Rgb; 2], is_opaque: bool) -> Self {
        let half = |half: usize| {
            let [mut small, large] = MODIFIERS[word.field([37, 34][half], 3) as usize];
            if !is_opaque {
                small = 0;
            }
            [small, large, -small, -large].map(|modifier| opaque(bases[half], modifier))
        };
        Self::Palettes { halves: [half(0), half(1)], is_flipped: word.bit(32) }
    }

    fn t(word: Word) -> Self {
        let first = [word.field(59, 2) << 2 | word.field(56, 2), word.field(52, 4), word.field(48, 4)];
        let [first, second] = [first, [44, 40, 36].map(|low| word.field(low, 4))].map(|base| base.map(from_4_bits));
        let distance = DISTANCES[(word.field(34, 2) << 1 | word.field(32, 1)) as usize];
        let palette = [opaque(first, 0), opaque(second, distance), opaque(second, 0), opaque(second, -distance)];
        Self::Palettes { halves: [palette; 2], is_flipped: false }
    }

    fn h(word: Word) -> Self {
        let first =
            [word.field(59, 4), word.field(56, 3) << 1 | word.field(52, 1), word.field(51, 1) << 3 | word.field(47, 3)];
        let [first, second] = [first, [43, 39, 35].map(|low| word.field(low, 4))].map(|base| base.map(from_4_bits));
        // The order of the colours, red first, is a bit of the code.
        let code = word.field(34, 1) << 2 | word.field(32, 1) << 1 | i32::from(first >= second);
        let distance = DISTANCES[code as usize];
        let palette =
            [opaque(first, distance), opaque(first, -distance), opaque(second, distance), opaque(second, -distance)];
        Self::Palettes { halves: [palette; 2], is_flipped: false }
    }

    fn plane(word: Word) -> Self {
        let color = |[r, g, b]: Rgb| [from_6_bits(r), from_7_bits(g), from_6_bits(b)];
        let blue = word.field(48, 1) << 5 | word.field(43, 2) << 3 | word.field(39, 3);
        Self::Plane {
            corner: color([word.field(57, 6), word.field(56, 1) << 6 | word.field(49, 6), blue]),
            right: color([word.field(34, 5) << 1 | word.field(32, 1), word.field(25, 7), word.field(19, 6)]),
            below: color([word.field(13, 6), word.field(6, 7), word.field(0, 6)]),
        }
    }

    /// The same colours, but for transparent black in place of the third of each palette if the block isn't opaque.
    fn or_transparent(mut self, is_opaque: bool) -> Self {
        if let Self::Palettes { halves, .. } = &mut self
            && !is_opaque
        {
            for palette in halves {
                palette[2] = [0; 4];
            }
        }
        self
    }

    /// The colour of texel (x, y).
    fn at(&self, word: Word, [x, y]: [usize; 2]) -> [u8; 4] {
        match self {
            Self::Palettes { halves, is_flipped } => {
                let texel = (x * SIDE + y) as u32;
                let half = if *is_flipped { y } else { x } / 2;
                halves[half][(word.field(16 + texel, 1) << 1 | word.field(texel, 1)) as usize]
            }
            Self::Plane { corner, right, below } => {
                let (x, y) = (x as i32, y as i32);
                let component = |channel: usize| {
                    let corner = corner[channel];
                    (x * (right[channel] - corner) + y * (below[channel] - corner) + 4 * corner + 2) >> 2
                };
                opaque([component(0), component(1), component(2)], 0)
            }
        }
    }
}

/// The coordinates of the texels of a block, row by row.
fn places() -> impl Iterator<Item = [usize; 2]> {
    (0..TEXELS).map(|texel| [texel % SIDE, texel / SIDE])
}

fn write_colors(word: Word, punchthrough: bool, texels: &mut [u8]) {
    let colors = Colors::read(word, punchthrough);
    for (out, at) in texels.as_chunks_mut::<4>().0.iter_mut().zip(places()) {
        *out = colors.at(word, at);
    }
}

/// Decodes ETC2 without alpha.
pub(super) fn rgb(bytes: &[u8; 16], texels: &mut [u8]) {
    write_colors(Word::of(bytes, 0), false, texels);
}

/// Decodes ETC2 with one bit of alpha ("punchthrough").
pub(super) fn rgb_a1(bytes: &[u8; 16], texels: &mut [u8]) {
    write_colors(Word::of(bytes, 0), true, texels);
}

/// Decodes ETC2 with alpha in a word of its own.
pub(super) fn rgba(bytes: &[u8; 16], texels: &mut [u8]) {
    write_colors(Word::of(bytes, 1), false, texels);
    let alpha = Component::read(Word::of(bytes, 0));
    let base = alpha.word.field(56, 8);
    for (out, at) in texels.as_chunks_mut::<4>().0.iter_mut().zip(places()) {
        out[3] = (base + alpha.modifier(at) * alpha.multiplier).clamp(0, 255) as u8;
    }
}

/// A word that has a single component of the texels.
#[derive(Clone, Copy, Debug)]
struct Component {
    word: Word,
    multiplier: i32,
    table: &'static [i32; 8],
}

impl Component {
    fn read(word: Word) -> Self {
        let table = &COMPONENT_MODIFIERS[word.field(48, 4) as usize];
        Self { word, multiplier: word.field(52, 4), table }
    }

    /// The modifier of texel (x, y).
    fn modifier(&self, [x, y]: [usize; 2]) -> i32 {
        let texel = (x * SIDE + y) as u32;
        self.table[self.word.field(45 - 3 * texel, 3) as usize]
    }

    /// The value of texel (x, y) in [0, 1], or in [-1, 1] if signed: one of 11 bits, divided by the greatest.
    fn value(&self, at: [usize; 2], signed: bool) -> f32 {
        let step = if self.multiplier == 0 { 1 } else { 8 * self.multiplier };
        let base = self.word.field(56, 8);
        let offset = self.modifier(at) * step;
        if signed {
            // -128 means -127.
            let base = i32::from(base as u8 as i8).max(-127);
            (8 * base + offset).clamp(-1023, 1023) as f32 / 1023.0
        } else {
            (8 * base + 4 + offset).clamp(0, 2047) as f32 / 2047.0
        }
    }
}

/// Decodes EAC with `N` components, a word each, as floats.
pub(super) fn eac<const N: usize>(bytes: &[u8; 16], signed: bool, texels: &mut [u8]) {
    let components: [Component; N] = std::array::from_fn(|index| Component::read(Word::of(bytes, index)));
    for (out, at) in texels.chunks_exact_mut(4 * N).zip(places()) {
        let values = components.map(|component| component.value(at, signed));
        out.copy_from_slice(bytemuck::cast_slice(&values));
    }
}

#[cfg(test)]
mod tests {
    use crate::Format;
    use crate::format::tests::block_texels;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// A word of fields, each a value at its lowest bit.
    fn word(fields: &[(u32, u64)]) -> u64 {
        fields.iter().fold(0, |all, &(low, value)| all | value << low)
    }

    /// The texels of an ETC2 word as bytes.
    fn bytes(format: Format, word: u64) -> Vec<[u8; 4]> {
        let texels = block_texels(format, &word.to_be_bytes());
        texels.iter().map(|texel| texel.map(|component| (255.0 * component).round() as u8)).collect()
    }

    const RGB: Format = Format::Etc2R8G8B8UnormBlock;
    const RGB_A1: Format = Format::Etc2R8G8B8A1UnormBlock;

    /// Indices 0 to 3 for the first four texels, which lie below each other.
    const FIRST_COLUMN: u64 = 0b1100 << 16 | 0b1010;

    /// The texels of the first column.
    fn first_column(format: Format, word: u64) -> [[u8; 4]; 4] {
        let texels = bytes(format, word | FIRST_COLUMN);
        [0, 4, 8, 12].map(|texel| texels[texel])
    }

    #[gaurast_runner::test]
    fn halves_of_the_individual_mode_have_colours_of_their_own() {
        // The specification's example: (4, 11, 9) with table 4, and (14, 3, 8) with table 0.
        let colors = [(60, 4), (52, 11), (44, 9), (56, 14), (48, 3), (40, 8), (37, 4), (34, 0)];
        let word = word(&colors);
        let expected = [[86, 205, 171, 255], [128, 247, 213, 255], [50, 169, 135, 255], [8, 127, 93, 255]];
        assert_eq!(first_column(RGB, word), expected);
        // The other half is to the right, or below if the block is flipped.
        let texels = bytes(RGB, word);
        assert_eq!([texels[1], texels[2]], [[86, 205, 171, 255], [240, 53, 138, 255]]);
        let texels = bytes(RGB, word | 1 << 32);
        assert_eq!([texels[3], texels[7], texels[8]], [[86, 205, 171, 255], [86, 205, 171, 255], [240, 53, 138, 255]]);
    }

    #[gaurast_runner::test]
    fn halves_of_the_differential_mode_are_close() {
        // The specification's example: (28, 4, 3), and (-4, 2, 0) from there.
        let colors = [(59, 28), (51, 4), (43, 3), (56, 4), (48, 2), (40, 0), (37, 2), (34, 2), (33, 1)];
        let texels = bytes(RGB, word(&colors));
        assert_eq!([texels[0], texels[3]], [[240, 42, 33, 255], [207, 58, 33, 255]]);
    }

    #[gaurast_runner::test]
    fn t_and_h_modes_have_four_colours() {
        // Red and its difference leave the range: T. Base colours are (15, 2, 12) and (4, 12, 13), and the distance
        // is 32, whose code is 5.
        let t = word(&[
            (61, 7),
            (59, 3),
            (56, 3),
            (52, 2),
            (48, 12),
            (44, 4),
            (40, 12),
            (36, 13),
            (34, 2),
            (33, 1),
            (32, 1),
        ]);
        let expected = [[255, 34, 204, 255], [100, 236, 253, 255], [68, 204, 221, 255], [36, 172, 189, 255]];
        assert_eq!(first_column(RGB, t), expected);
        // Green and its difference leave the range: H. The first colour, (7, 14, 8), is greater than (1, 2, 3), so the
        // distance's code is 0b011.
        let h =
            word(&[(59, 7), (56, 7), (52, 0), (51, 1), (50, 1), (47, 0), (43, 1), (39, 2), (35, 3), (33, 1), (32, 1)]);
        let expected = [[135, 254, 152, 255], [103, 222, 120, 255], [33, 50, 67, 255], [1, 18, 35, 255]];
        assert_eq!(first_column(RGB, h), expected);
    }

    #[gaurast_runner::test]
    fn planes_are_interpolated_and_rounded() {
        // Blue and its difference leave the range: a plane. Red rises to the right, green below, blue is 255.
        let corner = [(57, 0), (56, 0), (49, 0), (48, 1), (43, 3), (45, 7), (39, 7)];
        let others = [(34, 31), (33, 1), (32, 1), (25, 0), (19, 63), (13, 0), (6, 127), (0, 63)];
        // The bits from 47 to 45 belong to no field and make blue overflow.
        let texels = bytes(RGB, word(&corner) | word(&others));
        for (index, texel) in texels.iter().enumerate() {
            let quarter = |steps: usize| ((255 * steps + 2) / 4) as u8;
            assert_eq!(*texel, [quarter(index % 4), quarter(index / 4), 255, 255], "{index}");
        }
        // A plane is opaque in any case.
        let not_opaque = (word(&corner) | word(&others)) & !(1 << 33);
        assert_eq!(bytes(RGB_A1, not_opaque), texels);
    }

    #[gaurast_runner::test]
    fn index_2_is_transparent_in_blocks_that_are_not_opaque() {
        let colors = word(&[(59, 16), (51, 16), (43, 16), (37, 4), (34, 4)]);
        let grey = |level: u8| [level, level, level, 255];
        assert_eq!(first_column(RGB_A1, colors), [grey(132), grey(192), [0; 4], grey(72)]);
        assert_eq!(first_column(RGB_A1, colors | 1 << 33), [grey(150), grey(192), grey(114), grey(72)]);
        let t = word(&[(61, 7), (59, 3), (56, 3), (44, 4), (40, 12), (36, 13), (34, 2), (32, 1)]);
        assert_eq!(first_column(RGB_A1, t)[1..3], [[100, 236, 253, 255], [0; 4]]);
    }

    #[gaurast_runner::test]
    fn components_have_a_base_and_a_modifier() {
        // The specification's example: base 103 with table 13 and multiplier 2; texel b has index 3.
        let of = |base: u64, multiplier: u64| word(&[(56, base), (52, multiplier), (48, 13), (42, 3)]);
        let rgba = [of(103, 2), 0].map(u64::to_be_bytes).concat();
        let alpha = block_texels(Format::Etc2R8G8B8A8UnormBlock, &rgba)[4][3];
        assert_eq!((255.0 * alpha).round(), 83.0);
        let red = |format: Format, word: u64| block_texels(format, &word.to_be_bytes())[4];
        let unsigned = |word: u64| red(Format::EacR11UnormBlock, word)[0];
        assert_eq!(unsigned(of(103, 2)), 668.0 / 2047.0);
        assert_eq!(unsigned(of(103, 0)), 818.0 / 2047.0);
        assert_eq!(unsigned(of(0, 15)), 0.0);
        let signed = |word: u64| red(Format::EacR11SnormBlock, word)[0];
        assert_eq!(signed(of(60, 2)), 320.0 / 1023.0);
        assert_eq!(signed(of(60, 0)), 470.0 / 1023.0);
        // -128 is -127, from which nothing is left but -1.
        assert_eq!(signed(of(128, 0)), -1.0);
        assert_eq!(signed(word(&[(56, 128), (48, 13), (42, 7)])), -1007.0 / 1023.0);
        // Green has the second word.
        let both = [of(103, 2), of(103, 0)].map(u64::to_be_bytes).concat();
        let texel = block_texels(Format::EacR11G11UnormBlock, &both)[4];
        assert_eq!(texel, [668.0 / 2047.0, 818.0 / 2047.0, 0.0, 1.0]);
    }

    #[gaurast_runner::test]
    fn any_bytes_decode_to_fractions() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let formats = Format::ALL.iter().filter(|format| {
            let name = format!("{format:?}");
            name.starts_with("Etc2") || name.starts_with("Eac")
        });
        let formats: Vec<_> = formats.collect();
        assert_eq!(formats.len(), 10);
        for _ in 0..5000 {
            let block: [u8; 16] = rng.random();
            for &&format in &formats {
                let lowest = if format!("{format:?}").contains("Snorm") { -1.0 } else { 0.0 };
                let texels = block_texels(format, &block);
                assert!(
                    texels.as_flattened().iter().all(|value| (lowest..=1.0).contains(value)),
                    "{format:?} {block:?}"
                );
            }
        }
    }
}
