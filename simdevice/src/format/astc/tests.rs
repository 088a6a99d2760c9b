use super::reference;
use super::*;
use crate::Format;
use crate::format::tests::block_texels;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;

const EXTENTS: [[u32; 2]; 14] = [
    [4, 4],
    [5, 4],
    [5, 5],
    [6, 5],
    [6, 6],
    [8, 5],
    [8, 6],
    [8, 8],
    [10, 5],
    [10, 6],
    [10, 8],
    [10, 10],
    [12, 10],
    [12, 12],
];

/// A block of fields, each a value at its lowest bit.
fn block(fields: &[(u32, u128)]) -> u128 {
    fields.iter().fold(0, |all, &(low, value)| all | value << low)
}

fn decoded(block: u128, extent: [u32; 2], expansion: Expansion) -> Vec<Texel> {
    let mut texels = [ERROR; MAX_TEXELS];
    decode(block, extent, expansion, &mut texels);
    texels[..(extent[0] * extent[1]) as usize].to_vec()
}

/// A 4x4 block: the grid is 4x4 with weights of 2 bits, of one partition with an endpoint mode. The endpoints' integers
/// are bytes.
fn simple(mode: u128, values: &[u8], weights: &[u8; 16]) -> u128 {
    // W = 0 and H = 2: the grid is 4 by 4. The range's code is 4.
    let grid = block(&[(0, 0b10), (5, 2)]);
    let values = values.iter().enumerate().map(|(index, &value)| (17 + 8 * index as u32, u128::from(value)));
    let weights = weights.iter().enumerate().map(|(index, &weight)| (2 * index as u32, u128::from(weight)));
    let weights = block(&weights.collect::<Vec<_>>()).reverse_bits();
    grid | mode << 13 | block(&values.collect::<Vec<_>>()) | weights
}

#[gaurast_runner::test]
fn weights_lie_between_the_endpoints() {
    // Luminance from 0 to 255, with weights of 0, 21, 43 and 64 sixty-fourths.
    let block = simple(0, &[0, 255], &[0, 1, 2, 3, 3, 2, 1, 0, 0, 0, 0, 0, 3, 3, 3, 3]);
    let texels = decoded(block, [4, 4], Expansion::Linear);
    let grey = |weight: u32| {
        let level = ((65535 * weight + 32) / 64) as u16;
        [level, level, level, u16::MAX]
    };
    assert_eq!(texels[..4], [0, 21, 43, 64].map(grey));
    assert_eq!(texels[4..8], [64, 43, 21, 0].map(grey));
    assert_eq!(texels[12..], [64; 4].map(grey));
    // In sRGB, the bytes are those of eight bits, rounded.
    let texels = block_texels(Format::Astc4x4SrgbBlock, &block.to_le_bytes());
    assert_eq!(texels[3], [1.0; 4]);
    assert_eq!(texels[0], [0.0, 0.0, 0.0, 1.0]);
}

#[gaurast_runner::test]
fn colours_are_read_from_their_integers() {
    // Red 10 to 20, green 30 to 40, blue 50 to 60: the second sum is greater, so the order is that of the integers.
    let weights = [0, 3, 0, 3, 0, 3, 0, 3, 0, 3, 0, 3, 0, 3, 0, 3];
    let texels = decoded(simple(8, &[10, 20, 30, 40, 50, 60], &weights), [4, 4], Expansion::Linear);
    let color = |bytes: [u8; 4]| bytes.map(|byte| u16::from(byte) * 257);
    assert_eq!(texels[..2], [[10, 30, 50, 255], [20, 40, 60, 255]].map(color));
    // The other order is contracted: red and green are means with blue.
    let texels = decoded(simple(8, &[20, 10, 40, 30, 60, 50], &weights), [4, 4], Expansion::Linear);
    assert_eq!(texels[..2], [[30, 40, 50, 255], [40, 50, 60, 255]].map(color));
    // A base and a scale of a half.
    let texels = decoded(simple(6, &[200, 100, 50, 128], &weights), [4, 4], Expansion::Linear);
    assert_eq!(texels[..2], [[100, 50, 25, 255], [200, 100, 50, 255]].map(color));
    // A base and an offset of 5 and of -3 (of six bits, and the base's high bit).
    let texels =
        decoded(simple(5, &[40 << 1, 5 << 1, 30 << 1, 0x80 | 61 << 1 & 0x7F], &weights), [4, 4], Expansion::Linear);
    assert_eq!(texels[..2], [[40, 40, 40, 158], [45, 45, 45, 155]].map(color));
    // In sRGB, half of a byte's unit follows it.
    let texels = decoded(simple(0, &[7, 9], &weights), [4, 4], Expansion::Srgb);
    assert_eq!(texels[0], [0x780, 0x780, 0x780, 0xFF80]);
}

#[gaurast_runner::test]
fn a_void_extent_is_one_colour() {
    let colors = [(64, 0x1234), (80, 0x8000), (96, 0xFFFF), (112, 3)];
    let fields = |low: u128, extent: u128| {
        let mut fields = vec![(0, low), (12, extent)];
        fields.extend(colors);
        block(&fields)
    };
    let everywhere = (1 << 52) - 1;
    for extent in EXTENTS {
        let texels = decoded(fields(0xDFC, everywhere), extent, Expansion::Srgb);
        assert!(texels.iter().all(|texel| *texel == [0x1234, 0x8000, 0xFFFF, 3]), "{extent:?}");
    }
    // An area from (1, 3) to (2, 4) is valid, an empty one is not.
    let area = |s: [u128; 2], t: [u128; 2]| s[0] | s[1] << 13 | t[0] << 26 | t[1] << 39;
    assert_ne!(decoded(fields(0xDFC, area([1, 2], [3, 4])), [4, 4], Expansion::Linear)[0], ERROR);
    assert_eq!(decoded(fields(0xDFC, area([2, 2], [3, 4])), [4, 4], Expansion::Linear)[0], ERROR);
    assert_eq!(decoded(fields(0xDFC, area([1, 2], [4, 3])), [4, 4], Expansion::Linear)[0], ERROR);
    // The colour is of the HDR profile, and a reserved bit is zero.
    assert_eq!(decoded(fields(0xFFC, everywhere), [4, 4], Expansion::Linear)[0], ERROR);
    assert_eq!(decoded(fields(0x5FC, everywhere), [4, 4], Expansion::Linear)[0], ERROR);
    let texels = block_texels(Format::Astc12x12UnormBlock, &fields(0xDFC, everywhere).to_le_bytes());
    assert_eq!(texels.len(), 144);
    // 0x8000 is a half, and all ones are 1.
    assert_eq!(texels[143][1..3], [0.5, 1.0]);
}

#[gaurast_runner::test]
fn what_is_not_valid_is_magenta() {
    let invalid =
        |block: u128, extent: [u32; 2]| decoded(block, extent, Expansion::Linear).iter().all(|texel| *texel == ERROR);
    let valid = simple(0, &[0, 255], &[0; 16]);
    assert!(!invalid(valid, [4, 4]));
    // A reserved range, a grid of 8x4, and one of 4x5.
    assert!(invalid(valid & !0xF, [4, 4]));
    assert!(invalid(valid | 1 << 2, [4, 4]));
    assert!(invalid(valid | 3 << 5, [4, 4]) && !invalid(valid | 3 << 5, [5, 5]));
    // An endpoint mode of the HDR profile.
    assert!(invalid(valid | 2 << 13, [4, 4]));
    // Two planes of four partitions.
    assert!(invalid(valid | 1 << 10 | 3 << 11, [4, 4]));
    for format in [Format::Astc4x4UnormBlock, Format::Astc4x4SrgbBlock, Format::Astc12x10UnormBlock] {
        assert!(block_texels(format, &[0; 16]).iter().all(|texel| *texel == [1.0, 0.0, 1.0, 1.0]));
    }
}

#[gaurast_runner::test]
fn components_become_halves_that_are_rounded_towards_zero() {
    for component in 0..=u16::MAX {
        let found = half::f16::from_bits(half(component));
        let exact = if component == u16::MAX { 1.0 } else { f64::from(component) / 65536.0 };
        let next = half::f16::from_bits(found.to_bits() + 1);
        assert!(found.to_f64() <= exact && exact < next.to_f64(), "{component}: {found}");
    }
}

/// A block of random bits, but often of a mode, endpoints and grid that are valid.
fn random_block(rng: &mut ChaCha8Rng, extent: [u32; 2]) -> u128 {
    let mut block: u128 = rng.random();
    for _ in 0..20 {
        let is_likely = reference::texel(block, extent, [0; 2], false).is_ok();
        if is_likely || rng.random_ratio(1, 30) {
            break;
        }
        // Another block mode, often of one partition or of one endpoint mode.
        block = block >> 11 << 11 | rng.random_range(0..2048);
        if rng.random_ratio(1, 3) {
            block &= !(3 << 11);
        } else if rng.random_ratio(1, 2) {
            block &= !(3 << 23);
        }
    }
    if rng.random_ratio(1, 30) {
        block = block & !0xFFF | 0xDFC;
    }
    block
}

#[gaurast_runner::test]
fn random_blocks_are_those_of_the_specification() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut errors = BTreeMap::new();
    let mut valid = 0;
    for extent in EXTENTS {
        for _ in 0..400 {
            let block = random_block(&mut rng, extent);
            for expansion in [Expansion::Linear, Expansion::Srgb] {
                let found = decoded(block, extent, expansion);
                for (index, found) in found.iter().enumerate() {
                    let at = [index as u32 % extent[0], index as u32 / extent[0]];
                    let expected = reference::texel(block, extent, at, expansion == Expansion::Srgb);
                    assert_eq!(*found, expected.unwrap_or(ERROR), "{block:#034x} {extent:?} {at:?}: {expected:?}");
                    match expected {
                        Ok(_) => valid += 1,
                        Err(reason) => *errors.entry(reason).or_insert(0) += 1,
                    }
                }
            }
        }
    }
    // Blocks of all kinds were met.
    let others: u32 = errors.values().sum();
    assert!(valid > others, "{valid} texels are valid, and these are not: {errors:?}");
    assert!(errors.len() >= 8, "{errors:?}");
}

#[gaurast_runner::test]
fn any_bytes_decode_to_fractions() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for round in 0..20_000 {
        let extent = EXTENTS[round % EXTENTS.len()];
        let mut bytes: [u8; 16] = rng.random();
        if round % 2 == 1 {
            // Few bits are set, or few are not.
            let others: [u8; 16] = rng.random();
            let all = round % 4 == 1;
            bytes = std::array::from_fn(|at| if all { bytes[at] | others[at] } else { bytes[at] & others[at] });
        }
        let mut texels = [0; 8 * MAX_TEXELS];
        linear(&bytes, extent, &mut texels[..(8 * extent[0] * extent[1]) as usize]);
        let halves = texels.as_chunks::<2>().0.iter().map(|&bytes| u16::from_le_bytes(bytes));
        assert!(halves.max() <= Some(0x3C00), "{bytes:?} {extent:?}");
    }
}
