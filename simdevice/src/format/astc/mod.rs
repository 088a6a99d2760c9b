//! ASTC: blocks of 16 bytes that have from 4x4 to 12x12 texels, in its LDR profile.
//!
//! Khronos Data Format Specification 1.4, "ASTC Compressed Texture Image Formats". A block is a little-endian number of
//! 128 bits. From bit 0 up come the configuration and the colours' endpoints; from bit 127 down come the weights, with
//! their bits in reverse. All texels of a block that isn't valid, and those whose colours are of the HDR profile, are
//! magenta.

mod endpoint;
mod mode;
mod partition;
#[cfg(test)]
mod reference;
mod sequence;
#[cfg(test)]
mod tests;
mod weight;

use endpoint::{Endpoints, Expansion};
use mode::Mode;
use partition::Partitions;
use sequence::Range;
use weight::Weights;

/// The most texels of a block.
const MAX_TEXELS: usize = 12 * 12;

/// The most partitions of a block.
const MAX_PARTITIONS: usize = 4;

/// A texel of a decoded block: red, green, blue and alpha of 16 bits.
type Texel = [u16; 4];

/// The texels of what is not valid.
const ERROR: Texel = [u16::MAX, 0, u16::MAX, u16::MAX];

/// Decodes a block of `extent` texels to red, green, blue and alpha in binary16.
///
/// As the specification says of the decode mode `decode_float16`, 65535 is 1, and other values are divided by 65536 and
/// rounded towards zero.
pub(super) fn linear(bytes: &[u8; 16], extent: [u32; 2], texels: &mut [u8]) {
    let mut decoded = [ERROR; MAX_TEXELS];
    decode(u128::from_le_bytes(*bytes), extent, Expansion::Linear, &mut decoded);
    for (out, &component) in texels.as_chunks_mut::<2>().0.iter_mut().zip(decoded.as_flattened()) {
        *out = half(component).to_le_bytes();
    }
}

/// Decodes a block of `extent` texels to red, green, blue and alpha of 8 bits, of which the colours are sRGB.
pub(super) fn srgb(bytes: &[u8; 16], extent: [u32; 2], texels: &mut [u8]) {
    let mut decoded = [ERROR; MAX_TEXELS];
    decode(u128::from_le_bytes(*bytes), extent, Expansion::Srgb, &mut decoded);
    for (out, texel) in texels.as_chunks_mut::<4>().0.iter_mut().zip(&decoded) {
        *out = texel.map(|component| (component >> 8) as u8);
    }
}

/// The bits of a component in binary16.
#[inline]
fn half(component: u16) -> u16 {
    // In binary32 the component is exact. Its exponent is larger by 127 - 15, and by the 16 of the division.
    let bits = f32::from(component).to_bits() >> 13;
    let normal = bits.wrapping_sub((127 - 15 + 16) << 10) as u16;
    match component {
        u16::MAX => 0x3C00,
        // Below 2^-14 units are 2^-24.
        0..4 => component << 8,
        _ => normal,
    }
}

/// Decodes a block of `extent` texels, row by row. Leaves `texels` as they are, which is [`ERROR`], if it isn't valid.
fn decode(block: u128, extent: [u32; 2], expansion: Expansion, texels: &mut [Texel; MAX_TEXELS]) {
    let texels = &mut texels[..(extent[0] * extent[1]) as usize];
    if block & 0x1FF == 0x1FC {
        if let Some(color) = void_extent(block) {
            texels.fill(color);
        }
    } else if let Some(block) = Block::read(block, extent) {
        block.write(extent, expansion, texels);
    }
}

/// A field of `count` bits that begins at bit `low`.
fn field(block: u128, low: u32, count: u32) -> u32 {
    (block >> low) as u32 & ((1 << count) - 1)
}

/// The colour of a block that has only one; `None` if the block isn't valid. The area around the block that has the same
/// colour is not needed.
fn void_extent(block: u128) -> Option<Texel> {
    let is_hdr = field(block, 9, 1) == 1;
    if is_hdr || field(block, 10, 2) != 3 {
        return None;
    }
    let [min_s, max_s, min_t, max_t] = [12, 25, 38, 51].map(|low| field(block, low, 13));
    let has_no_area = [min_s, max_s, min_t, max_t] == [0x1FFF; 4];
    if !has_no_area && (min_s >= max_s || min_t >= max_t) {
        return None;
    }
    Some([64, 80, 96, 112].map(|low| field(block, low, 16) as u16))
}

/// A block whose texels lie between the two endpoints of their partition.
#[derive(Clone, Debug)]
struct Block {
    weights: Weights,
    /// The component that has weights of its own.
    second_plane: Option<usize>,
    partitions: Option<Partitions>,
    endpoints: [Option<Endpoints>; MAX_PARTITIONS],
}

impl Block {
    /// Reads a block; `None` if it isn't valid.
    fn read(block: u128, extent: [u32; 2]) -> Option<Self> {
        let mode = Mode::read(field(block, 0, 11))?;
        let partition_count = field(block, 11, 2) + 1;
        let is_too_large = mode.grid[0] > extent[0] || mode.grid[1] > extent[1];
        if is_too_large || (mode.is_dual && partition_count == 4) {
            return None;
        }
        let weight_bits = mode.weight_bits()?;
        // The fields below the weights are read from the weights down.
        let mut end = 128 - weight_bits;
        let modes = if partition_count == 1 {
            [field(block, 13, 4); MAX_PARTITIONS]
        } else {
            let (modes, extra_bits) = endpoint_modes(block, partition_count, end);
            end -= extra_bits;
            modes
        };
        let modes = &modes[..partition_count as usize];
        let second_plane = mode.is_dual.then(|| {
            end -= 2;
            field(block, end, 2) as usize
        });
        let begin = if partition_count == 1 { 17 } else { 29 };
        let count = modes.iter().map(|&mode| endpoint::value_count(mode)).sum::<usize>();
        if count > endpoint::MAX_VALUES {
            return None;
        }
        let range = Range::of_colors(count, end.checked_sub(begin)?)?;
        let mut values = [0; endpoint::MAX_VALUES];
        range.read(block >> begin, &mut values[..count]);
        let mut rest = &values[..count];
        let mut endpoints = [None; MAX_PARTITIONS];
        for (endpoints, &mode) in endpoints.iter_mut().zip(modes) {
            let (values, others) = rest.split_at(endpoint::value_count(mode));
            *endpoints = Endpoints::decode(mode, values, range);
            rest = others;
        }
        Some(Self {
            weights: Weights::read(block, &mode),
            second_plane,
            partitions: (partition_count > 1).then(|| Partitions::new(field(block, 13, 10), partition_count, extent)),
            endpoints,
        })
    }

    /// Writes the texels row by row.
    fn write(&self, extent: [u32; 2], expansion: Expansion, texels: &mut [Texel]) {
        let endpoints = self.endpoints.map(|endpoints| endpoints.map(|endpoints| endpoints.expand(expansion)));
        let columns = self.weights.columns(extent[0]);
        let width = extent[0] as usize;
        for (y, row) in texels.chunks_exact_mut(width).enumerate() {
            let taps = self.weights.row(y as u32, extent[1]);
            for (x, texel) in row.iter_mut().enumerate() {
                let partition = self.partitions.as_ref().map_or(0, |all| all.at([x as u32, y as u32]));
                let Some([from, to]) = endpoints[partition] else {
                    continue;
                };
                let first = self.weights.at(0, columns[x], taps);
                let mut weights = [first; 4];
                if let Some(component) = self.second_plane {
                    weights[component] = self.weights.at(1, columns[x], taps);
                }
                *texel = std::array::from_fn(|component| {
                    let weight = weights[component];
                    let [from, to] = [from, to].map(|end| u32::from(end[component]));
                    ((from * (64 - weight) + to * weight + 32) >> 6) as u16
                });
            }
        }
    }
}

/// The endpoint modes of several partitions, and the number of bits below the weights that are part of them. The weights
/// begin at bit `end`.
fn endpoint_modes(block: u128, partition_count: u32, end: u32) -> ([u32; MAX_PARTITIONS], u32) {
    let classes = field(block, 23, 2);
    let low = field(block, 25, 4);
    if classes == 0 {
        return ([low; MAX_PARTITIONS], 0);
    }
    let extra_bits = 3 * partition_count - 4;
    let all = low | field(block, end - extra_bits, extra_bits) << 4;
    let mode = |partition: u32| {
        let class = classes - 1 + (all >> partition & 1);
        class << 2 | (all >> (partition_count + 2 * partition) & 3)
    };
    ([0, 1, 2, 3].map(mode), extra_bits)
}
