//! BC1 to BC7 (also known as DXT, RGTC and BPTC): blocks of 4x4 texels.
//!
//! A decoder of blocks writes their texels row by row, in the format of [`Format::decompressed`](crate::Format).

use half::f16;

/// The number of texels along a side of the blocks of BC, ETC2 and EAC.
pub(super) const SIDE: usize = 4;

/// The number of texels of such a block.
pub(super) const TEXELS: usize = SIDE * SIDE;

/// The most bytes of a decoded block: 12x12 texels of 8 bytes.
pub(crate) const MAX_DECODED_SIZE: usize = 12 * 12 * 8;

/// Writes texels as bytes.
fn write<T: bytemuck::NoUninit>(texels: &[T], out: &mut [u8]) {
    out.copy_from_slice(bytemuck::cast_slice(texels));
}

/// Decodes BC1: two colours and a palette between them, perhaps with transparent black.
pub(super) fn bc1(bytes: &[u8; 16], texels: &mut [u8]) {
    bcdec_rs::bc1(bytes, texels, 4 * SIDE);
}

/// Decodes BC1 without alpha: transparent texels are opaque.
pub(super) fn bc1_rgb(bytes: &[u8; 16], texels: &mut [u8]) {
    bc1(bytes, texels);
    for texel in texels.as_chunks_mut::<4>().0 {
        texel[3] = u8::MAX;
    }
}

/// Decodes BC2: the colours of [`bc1`], and four bits of alpha for each texel.
pub(super) fn bc2(bytes: &[u8; 16], texels: &mut [u8]) {
    bcdec_rs::bc2(bytes, texels, 4 * SIDE);
}

/// Decodes BC3: the colours of [`bc1`], and a palette of alphas.
pub(super) fn bc3(bytes: &[u8; 16], texels: &mut [u8]) {
    bcdec_rs::bc3(bytes, texels, 4 * SIDE);
}

/// Decodes BC4: a palette of red, as floats.
pub(super) fn bc4(bytes: &[u8; 16], signed: bool, texels: &mut [u8]) {
    let mut red = [0f32; TEXELS];
    bcdec_rs::bc4_float(bytes, &mut red, SIDE, signed);
    write(&red, texels);
}

/// Decodes BC5: a palette of red and one of green, as floats.
pub(super) fn bc5(bytes: &[u8; 16], signed: bool, texels: &mut [u8]) {
    let mut both = [0f32; 2 * TEXELS];
    bcdec_rs::bc5_float(bytes, &mut both, 2 * SIDE, signed);
    write(&both, texels);
}

/// Decodes BC6H: red, green and blue in binary16, with an alpha of 1.
pub(super) fn bc6h(bytes: &[u8; 16], signed: bool, texels: &mut [u8]) {
    let mut rgb = [0u16; 3 * TEXELS];
    bcdec_rs::bc6h_half(bytes, &mut rgb, 3 * SIDE, signed);
    let mut halves = [f16::ONE.to_bits(); 4 * TEXELS];
    for (texel, rgb) in halves.as_chunks_mut::<4>().0.iter_mut().zip(rgb.as_chunks::<3>().0) {
        texel[..3].copy_from_slice(rgb);
    }
    write(&halves, texels);
}

/// Decodes BC7: red, green, blue and alpha by up to three palettes.
pub(super) fn bc7(bytes: &[u8; 16], texels: &mut [u8]) {
    bcdec_rs::bc7(bytes, texels, 4 * SIDE);
}

#[cfg(test)]
mod tests {
    use super::MAX_DECODED_SIZE;
    use crate::Format;
    use crate::format::tests::block_texels as texels;

    #[gaurast_runner::test]
    fn only_compressed_formats_have_blocks() {
        for &format in Format::ALL {
            let name = format!("{format:?}");
            let is_compressed = name.ends_with("Block");
            assert_eq!(format.decompressed().is_some(), is_compressed, "{name}");
            assert_eq!(format.block_extent() != [1, 1], is_compressed, "{name}");
            let mut out = [0; MAX_DECODED_SIZE];
            let plain = format.decompressed().map_or(1, Format::texel_size);
            let out = &mut out[..format.block_extent().iter().product::<u32>() as usize * plain];
            assert_eq!(format.decode_block(&[0x5A; 16], out).is_some(), is_compressed, "{name}");
            if is_compressed {
                let is_small =
                    ["Bc1", "Bc4", "Etc2R8G8B8Unorm", "Etc2R8G8B8Srgb", "Etc2R8G8B8A1", "EacR11Unorm", "EacR11Snorm"]
                        .iter()
                        .any(|small| name.starts_with(small));
                assert_eq!(format.texel_size(), if is_small { 8 } else { 16 }, "{name}");
                let [width, height] = format.block_extent();
                let has_name = name.starts_with(&format!("Astc{width}x{height}"));
                assert!(has_name || (!name.starts_with("Astc") && [width, height] == [4, 4]), "{name}");
            }
        }
    }

    #[gaurast_runner::test]
    fn colours_lie_between_two_ends() {
        // Red is first and greater, then comes blue. The codes of the first row are 0, 1, 2, 3.
        let block = [0x00, 0xF8, 0x1F, 0x00, 0b11_10_01_00, 0, 0, 0];
        let row = &texels(Format::Bc1RgbUnormBlock, &block)[..4];
        let byte = |code: u8| f32::from(code) / 255.0;
        assert_eq!(row[0], [1.0, 0.0, 0.0, 1.0]);
        assert_eq!(row[1], [0.0, 0.0, 1.0, 1.0]);
        assert_eq!(row[2], [byte(170), 0.0, byte(85), 1.0]);
        assert_eq!(row[3], [byte(85), 0.0, byte(170), 1.0]);
        // In the other order, code 3 is black, and transparent if there is alpha.
        let block = [0x1F, 0x00, 0x00, 0xF8, 0b11_10_01_00, 0, 0, 0];
        let opaque = &texels(Format::Bc1RgbUnormBlock, &block)[..4];
        let clear = &texels(Format::Bc1RgbaUnormBlock, &block)[..4];
        assert_eq!(opaque[3], [0.0, 0.0, 0.0, 1.0]);
        assert_eq!(clear[3], [0.0; 4]);
        assert_eq!(opaque[..3], clear[..3]);
    }

    #[gaurast_runner::test]
    fn colours_are_those_of_exact_arithmetic_but_for_a_code() {
        let mut state = 1u64;
        for _ in 0..2000 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let block = (state ^ state >> 29).to_le_bytes();
            let ends = [0, 2].map(|at| u16::from_le_bytes([block[at], block[at + 1]]));
            let exact = ends.map(|end| {
                [(end >> 11, 31.0), (end >> 5 & 63, 63.0), (end & 31, 31.0)].map(|(code, max)| f64::from(code) / max)
            });
            let weight = |code: usize| match (ends[0] > ends[1], code) {
                (_, 0) => 0.0,
                (_, 1) => 1.0,
                (true, code) => f64::from(code as u32 - 1) / 3.0,
                (false, _) => 0.5,
            };
            let decoded = texels(Format::Bc1RgbUnormBlock, &block);
            for (index, texel) in decoded.iter().enumerate() {
                let code = usize::from(block[4 + index / 4] >> (2 * (index % 4)) & 3);
                let is_black = ends[0] <= ends[1] && code == 3;
                for channel in 0..3 {
                    let [a, b] = exact.map(|end| end[channel]);
                    let expected = if is_black { 0.0 } else { a + weight(code) * (b - a) };
                    let error = (f64::from(texel[channel]) - expected).abs() * 255.0;
                    assert!(error < 1.0, "{block:?} {index}: {error}");
                }
            }
        }
    }

    #[gaurast_runner::test]
    fn single_components_lie_between_two_ends_exactly() {
        // The ends are 255 and 0. Codes 0 to 7 follow, with 3 bits each.
        let codes: u64 = (0..8u64).fold(0, |all, code| all | code << (3 * code));
        let mut block = (codes << 16 | 0x00FF).to_le_bytes();
        let sevenths = texels(Format::Bc4UnormBlock, &block);
        let expected = [7, 0, 6, 5, 4, 3, 2, 1].map(|n| n as f32 / 7.0);
        for (texel, expected) in sevenths.iter().zip(expected) {
            assert!((texel[0] - expected).abs() < 1e-6, "{texel:?} {expected}");
            assert_eq!(texel[1..], [0.0, 0.0, 1.0]);
        }
        // As signed ends, -1 and 1 are in ascending order, so that there are five steps and then the extremes.
        block[..2].copy_from_slice(&[0x81, 0x7F]);
        let fifths = texels(Format::Bc4SnormBlock, &block);
        let expected = [-1.0, 1.0, -0.6, -0.2, 0.2, 0.6, -1.0, 1.0];
        for (texel, expected) in fifths.iter().zip(expected) {
            assert!((texel[0] - expected).abs() < 1e-6, "{texel:?} {expected}");
        }
    }
}
