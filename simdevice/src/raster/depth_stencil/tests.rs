use super::*;
use crate::format::depth::{ordered, unordered};
use crate::token_of;
use devmem::dispatch;
use fearless_simd::f32x16;
use gaurast_runner::{Case, simd_levels};
use isa::level::SimdLevel;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The encoding of a depth by the format's own encoder.
fn expected(format: Format, depth: f32) -> u32 {
    let [a, b, c, d, ..] = format.encode([depth, 0.0, 0.0, 0.0]);
    match format {
        Format::D16Unorm => u32::from_le_bytes([a, b, 0, 0]),
        Format::X8D24UnormPack32 => u32::from_le_bytes([a, b, c, 0]),
        _ => ordered(u32::from_le_bytes([a, b, c, d])),
    }
}

#[gaurast_runner::test(each = simd_levels())]
fn depths_become_the_nearest_numbers_of_their_format(case: &Case) {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut depths: Vec<f32> = (0..40_000)
        .map(|round| match round % 4 {
            0 => rng.random_range(0.0..1.0),
            1 => rng.random_range(0.0f32..1.0).powi(9),
            // Near the middle between two codes.
            2 => ((f64::from(rng.random_range(0..1u32 << 16)) + 0.5) / 65_535.0) as f32,
            _ => ((f64::from(rng.random_range(0..1u32 << 24)) + 0.5) / 16_777_215.0) as f32,
        })
        .collect();
    depths.extend([0.0, 1.0, 0.5, f32::from_bits(1), 0.999_999_94, 2.0, -1.0, -0.0]);
    let level = token_of(case);
    for format in [Format::D16Unorm, Format::X8D24UnormPack32, Format::D32Sfloat] {
        let code = DepthEncoding::of(format);
        for chunk in depths.as_chunks::<16>().0 {
            let codes: [u32; 16] = dispatch!(level, simd => {
                code.encode(simd, f32x16::simd_from(simd, *chunk), (0.0, 1.0)).into()
            });
            for (depth, found) in chunk.iter().zip(codes) {
                let inside = if *depth > 0.0 { depth.min(1.0) } else { 0.0 };
                assert_eq!(found, expected(format, inside), "{format:?} {depth}");
                assert_eq!(found, code.encode_one(inside), "{format:?} {depth}");
            }
        }
    }
}

#[gaurast_runner::test]
fn depth_is_clamped_to_the_viewports_range() {
    let level = SimdLevel::Best.resolve().unwrap();
    let depths = std::array::from_fn(|lane| lane as f32 / 10.0 - 0.2);
    let codes: [u32; 16] = dispatch!(level, simd => {
        DepthEncoding::Float.encode(simd, f32x16::simd_from(simd, depths), (0.25, 0.5)).into()
    });
    for (depth, code) in depths.into_iter().zip(codes) {
        assert_eq!(DepthEncoding::Float.decode(code), depth.clamp(0.25, 0.5));
    }
}

#[gaurast_runner::test(each = simd_levels())]
fn codes_of_floats_are_ordered_as_the_depths(case: &Case) {
    let level = token_of(case);
    let depths: [f32; 16] = [
        f32::NEG_INFINITY,
        f32::MIN,
        -2.0,
        -1.0,
        -0.5,
        -f32::MIN_POSITIVE,
        -f32::from_bits(1),
        0.0,
        f32::from_bits(1),
        f32::MIN_POSITIVE,
        0.5,
        1.0,
        1.5,
        1e9,
        f32::MAX,
        f32::INFINITY,
    ];
    let float = DepthEncoding::Float;
    let all = (f32::NEG_INFINITY, f32::INFINITY);
    let codes: [u32; 16] = dispatch!(level, simd => float.encode(simd, f32x16::simd_from(simd, depths), all).into());
    assert!(codes.is_sorted_by(|a, b| a < b), "{codes:?}");
    for (depth, code) in depths.into_iter().zip(codes) {
        assert_eq!(float.encode_one(depth), code, "{depth}");
        assert_eq!(float.decode(code).to_bits(), depth.to_bits());
    }
    assert_eq!(float.encode_one(-0.0), float.encode_one(0.0));
    for bits in [1 << 31, f32::NAN.to_bits(), u32::MAX] {
        assert_eq!(unordered(ordered(bits)), bits, "an image may hold any bits");
    }
}
