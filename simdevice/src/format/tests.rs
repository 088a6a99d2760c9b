use super::table::{decode_components, encode_components};
use super::*;
use crate::format::Aspect;

/// The first bytes of a texel.
fn first<const N: usize>(texel: &[u8; MAX_TEXEL_SIZE]) -> [u8; N] {
    *texel.first_chunk().unwrap()
}

/// The components of each texel of a compressed format's block, row by row.
pub(super) fn block_texels(format: Format, block: &[u8]) -> Vec<[f32; 4]> {
    let mut whole = [0; MAX_TEXEL_SIZE];
    whole[..block.len()].copy_from_slice(block);
    let plain = format.decompressed().unwrap();
    let [width, height] = format.block_extent();
    let mut decoded = vec![0; (width * height) as usize * plain.texel_size()];
    format.decode_block(&whole, &mut decoded).unwrap();
    decoded.chunks_exact(plain.texel_size()).map(|texel| plain.decode(texel)).collect()
}

/// The formats whose components are decoded and encoded independently of each other.
fn simple() -> impl Iterator<Item = Format> {
    Format::ALL.iter().copied().filter(|format| {
        !matches!(format.numeric(), Numeric::SharedExponent | Numeric::DepthStencil) && format.decompressed().is_none()
    })
}

#[gaurast_runner::test]
fn texels_are_whole_bytes() {
    for format in Format::ALL {
        let bits: u32 = format.components().iter().map(|c| c.bits).sum();
        assert_eq!(bits as usize, format.texel_size() * 8, "{format:?}");
        assert!(format.texel_size() <= MAX_TEXEL_SIZE);
    }
    assert_eq!(Format::R8G8B8A8Unorm.texel_size(), 4);
    assert_eq!(Format::R32G32B32Sfloat.texel_size(), 12);
    assert_eq!(Format::A2B10G10R10UnormPack32.texel_size(), 4);
}

#[gaurast_runner::test]
fn every_code_survives_a_round_trip() {
    for format in simple() {
        let mut shift = 0;
        for component in format.components() {
            let codes = 1u64 << component.bits;
            // Every code of up to 16 bits is tested, and a sample of the wider ones.
            let step = if component.bits <= 16 { 1 } else { codes / 65_521 };
            for code in (0..codes).step_by(step as usize) {
                let texel = (u128::from(code) << shift).to_le_bytes();
                let size = format.texel_size();
                let registers = format.decode(&texel[..size]);
                let out = format.encode(registers);
                let nan = !format.is_integer() && registers.iter().any(|r| r.is_nan());
                let expected = match (format.numeric(), component.bits) {
                    // The least code of a signed normalised component is a second one for -1.
                    (Numeric::Snorm, bits) if code == 1 << (bits - 1) => code + 1,
                    _ if component.channel == Channel::X => 0,
                    _ => code,
                };
                if nan {
                    assert!(format.decode(&out).iter().any(|r| r.is_nan()), "{format:?}");
                } else {
                    let expected = (u128::from(expected) << shift).to_le_bytes();
                    assert_eq!(out[..size], expected[..size], "{format:?} {code:#x}");
                }
            }
            shift += component.bits;
        }
    }
}

#[gaurast_runner::test]
fn every_24_bit_depth_is_distinct() {
    let format = Format::X8D24UnormPack32;
    for code in (0..1u32 << 24).step_by(3).chain([(1 << 24) - 1]) {
        let bytes = code.to_le_bytes();
        assert_eq!(format.encode(format.decode(&bytes))[..4], bytes);
    }
}

#[gaurast_runner::test]
fn packed_formats_have_their_components_in_place() {
    let texel = [1.0, 0.0, 0.0, 0.0];
    let bits16 = |format: Format| u16::from_le_bytes(first(&format.encode(texel)));
    assert_eq!(bits16(Format::R5G6B5UnormPack16), 0xF800);
    assert_eq!(bits16(Format::B5G6R5UnormPack16), 0x001F);
    assert_eq!(bits16(Format::A1R5G5B5UnormPack16), 0x7C00);
    assert_eq!(bits16(Format::A1B5G5R5UnormPack16), 0x001F);
    assert_eq!(bits16(Format::R5G5B5A1UnormPack16), 0xF800);
    assert_eq!(bits16(Format::B5G5R5A1UnormPack16), 0x003E);
    assert_eq!(bits16(Format::R4G4B4A4UnormPack16), 0xF000);
    assert_eq!(bits16(Format::B4G4R4A4UnormPack16), 0x00F0);
    let bits32 = |format: Format| u32::from_le_bytes(first(&format.encode(texel)));
    assert_eq!(bits32(Format::A2B10G10R10UnormPack32), 0x0000_03FF);
    assert_eq!(bits32(Format::A2R10G10B10UnormPack32), 0x3FF0_0000);
    assert_eq!(bits32(Format::R8G8B8A8Unorm), 0x0000_00FF);
    assert_eq!(bits32(Format::B8G8R8A8Unorm), 0x00FF_0000);
    assert_eq!(bits32(Format::A8B8G8R8UnormPack32), 0x0000_00FF);
}

#[gaurast_runner::test]
fn unorm_rounds_to_nearest_even_and_clamps() {
    let encode = |x| Format::R8Unorm.encode([x, 0.0, 0.0, 0.0])[0];
    // 127.5 is between two codes.
    assert_eq!(encode(0.5), 128);
    assert_eq!(encode(0.5f32.next_down()), 127);
    assert_eq!(encode(-1.0), 0);
    assert_eq!(encode(7.0), 255);
    assert_eq!(encode(f32::NAN), 0);
    assert_eq!(encode(f32::INFINITY), 255);
    // 2.5 / 255 is not a float, but is between two neighbouring ones.
    let tie = (2.5f64 / 255.0) as f32;
    assert_eq!(encode(tie.next_down()), 2);
    assert_eq!(encode(tie.next_up()), 3);
}

#[gaurast_runner::test]
fn fast_rows_agree_with_single_components() {
    let mut values = vec![-0.5, -0.0, 0.0, 1e-9, 0.001, 0.25, 0.5, 0.7, 1.0, 1.5, f32::INFINITY, f32::NEG_INFINITY];
    // The floats around each code and around the middle between two, for bytes and for ten bits.
    for halves in [510, 2046] {
        for half in 0..=halves {
            let at = (f64::from(half) / f64::from(halves)) as f32;
            values.extend((-3..=3).map(|step| f32::from_bits(at.to_bits().saturating_add_signed(step))));
        }
    }
    for format in [
        Format::R8Unorm,
        Format::R8G8Unorm,
        Format::R8G8B8A8Unorm,
        Format::B8G8R8A8Unorm,
        Format::A2B10G10R10UnormPack32,
        Format::A2R10G10B10UnormPack32,
        Format::R8G8B8A8Srgb,
        Format::B8G8R8A8Srgb,
        Format::R16G16B16A16Sfloat,
        Format::R32G32B32A32Sfloat,
        Format::R32G32B32Sfloat,
    ] {
        for &x in &values {
            let texel = [x, x * 0.5, x * 0.25, x * 0.125];
            let size = format.texel_size();
            let fast = format.encode(texel);
            let mut slow = [0; MAX_TEXEL_SIZE];
            encode_components(format.numeric(), format.components(), &texel, &mut slow[..size]);
            assert_eq!(fast, slow, "{format:?} {texel:?}");
            let decoded = decode_components(format.numeric(), format.components(), &slow[..size]);
            assert_eq!(format.decode(&slow), decoded, "{format:?}");
        }
    }
}

#[gaurast_runner::test]
fn srgb_follows_its_definition() {
    let format = Format::R8G8B8A8Srgb;
    for code in 0..=255u8 {
        let [r, _, _, a] = format.decode(&[code; 4]);
        let exact = convert::linear_from_srgb(f64::from(code) / 255.0);
        assert!((f64::from(r) - exact).abs() <= 1e-7 * exact);
        assert_eq!(a, f32::from(code) / 255.0, "alpha is linear");
    }
    // Every 61st float from 2^-20 to 1.
    for bits in (0x3580_0000..=1f32.to_bits()).step_by(61) {
        let linear = f32::from_bits(bits);
        let exact = convert::srgb_from_linear(f64::from(linear)) * 255.0;
        let code = format.encode([linear; 4])[0];
        assert_eq!(code, exact.round_ties_even() as u8, "{linear}");
    }
    assert_eq!(format.encode([1e-7, -1.0, f32::NAN, 2.0])[..4], [0, 0, 0, 255]);
}

/// The components of an integer format's texel.
fn decode_integer<const N: usize>(format: Format, texel: [u8; N]) -> [u32; 4] {
    format.decode(&texel).map(f32::to_bits)
}

/// The bytes of an integer format's texel.
fn encode_integer(format: Format, texel: [u32; 4]) -> [u8; MAX_TEXEL_SIZE] {
    format.encode(texel.map(f32::from_bits))
}

#[gaurast_runner::test]
fn integers_are_sign_extended_and_clamped() {
    assert_eq!(decode_integer(Format::R8G8Sint, [0xFF, 0x7F]), [u32::MAX, 127, 0, 1]);
    assert_eq!(decode_integer(Format::R8G8Uint, [0xFF, 0x7F]), [255, 127, 0, 1]);
    assert_eq!(encode_integer(Format::R8G8Uint, [300, 7, 0, 0])[..2], [255, 7]);
    let low = -300i32 as u32;
    assert_eq!(encode_integer(Format::R8G8Sint, [low, 300, 0, 0])[..2], [0x80, 0x7F]);
    assert_eq!(decode_integer(Format::R32Uint, [1, 0, 0x80, 0x7F])[0], 0x7F80_0001);
}

#[gaurast_runner::test]
fn scaled_and_signed_normalised_components() {
    assert_eq!(Format::R8G8Uscaled.decode(&[200, 3]), [200.0, 3.0, 0.0, 1.0]);
    assert_eq!(Format::R8G8Sscaled.decode(&[0x80, 3]), [-128.0, 3.0, 0.0, 1.0]);
    assert_eq!(Format::R8G8Snorm.decode(&[0x80, 0x81]), [-1.0, -1.0, 0.0, 1.0]);
    assert_eq!(Format::R8G8Snorm.encode([-2.0, f32::NAN, 0.0, 0.0])[..2], [0x81, 0]);
}

#[gaurast_runner::test]
fn unsigned_floats_round_to_nearest() {
    let encode = |x| u32::from_le_bytes(first(&Format::B10G11R11UfloatPack32.encode([x, 0.0, 0.0, 0.0])));
    assert_eq!(encode(1.0), 15 << 6);
    assert_eq!(encode(1.0 + 1.0 / 128.0), 15 << 6, "a tie goes to even");
    assert_eq!(encode(1.0 + 3.0 / 128.0), (15 << 6) + 2);
    assert_eq!(encode(1.999_999), 16 << 6);
    assert_eq!(encode(-1.0), 0);
    assert_eq!(encode(1e9), (31 << 6) - 1, "the greatest finite number");
    assert_eq!(encode(f32::INFINITY), 31 << 6);
    assert_eq!(encode(2f32.powi(-20)), 1, "the least denormal number");
}

#[gaurast_runner::test]
fn shared_exponents() {
    let format = Format::E5B9G9R9UfloatPack32;
    for texel in [[1.0, 0.5, 0.25, 1.0], [65_408.0, 0.0, 128.0, 1.0], [0.0, 0.0, 0.0, 1.0]] {
        assert_eq!(format.decode(&format.encode(texel)), texel);
    }
    let largest = format.decode(&format.encode([1e9, -3.0, f32::NAN, 1.0]));
    assert_eq!(largest, [65_408.0, 0.0, 0.0, 1.0]);
    let [r, ..] = format.decode(&format.encode([0.999_99, 0.1, 0.1, 1.0]));
    assert_eq!(r, 1.0, "a mantissa that rounds up carries into the exponent");
}

#[gaurast_runner::test]
fn planes_of_depth_and_stencil() {
    let format = Format::D24UnormS8Uint;
    assert_eq!(format.aspects(), [Aspect::Depth, Aspect::Stencil]);
    assert_eq!(format.plane(Aspect::Depth), Some(Format::X8D24UnormPack32));
    assert_eq!(format.plane(Aspect::Stencil), Some(Format::S8Uint));
    assert_eq!(format.plane(Aspect::Color), None);
    assert_eq!(Format::R8Unorm.plane(Aspect::Depth), None);
    assert_eq!(Format::D32Sfloat.plane(Aspect::Depth), Some(Format::D32Sfloat));
}

#[gaurast_runner::test]
fn clear_values_follow_the_format() {
    let value = ClearValue::DepthStencil { depth: 1.0, stencil: 0x1FE };
    let format = Format::D24UnormS8Uint;
    assert_eq!(format.encode_clear(Aspect::Depth, value)[..4], [0xFF, 0xFF, 0xFF, 0]);
    assert_eq!(format.encode_clear(Aspect::Stencil, value)[0], 0xFE);
    let value = ClearValue::Int([-1, 2, 0, 0]);
    assert_eq!(Format::R8G8Sint.encode_clear(Aspect::Color, value)[..2], [0xFF, 2]);
    let value = ClearValue::Float([1.0, 0.5, 0.0, 1.0]);
    assert_eq!(Format::B8G8R8A8Unorm.encode_clear(Aspect::Color, value)[..4], [0, 128, 255, 255]);
}

#[gaurast_runner::test]
fn short_texels_are_padded_with_zeros() {
    assert_eq!(Format::R8G8B8A8Unorm.decode(&[255]), [1.0, 0.0, 0.0, 0.0]);
    assert_eq!(Format::R32Sfloat.decode(&[]), [0.0, 0.0, 0.0, 1.0]);
}

#[gaurast_runner::test]
fn rows_stop_where_either_slice_does() {
    for format in simple() {
        let size = format.texel_size();
        let bytes = vec![0x3C; 7 * size];
        let mut out = [[9.0; 4]; 9];
        format.decode_row(&bytes[..7 * size - 1], &mut out);
        assert_eq!(out[6..], [[9.0; 4]; 3], "{format:?}");
        let one = format.decode(&bytes);
        assert_eq!(
            out[..6].as_flattened().iter().map(|x| x.to_bits()).collect::<Vec<_>>(),
            one.map(f32::to_bits).repeat(6)
        );
        let mut back = vec![0xEE; 9 * size];
        format.encode_row(&out[..6], &mut back);
        let mut expected = format.encode(one)[..size].repeat(6);
        expected.resize(9 * size, 0xEE);
        assert_eq!(back, expected, "{format:?}");
        format.encode_row(&out[..6], &mut back[..2 * size - 1]);
    }
}
