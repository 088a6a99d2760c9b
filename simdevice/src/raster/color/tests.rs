use super::*;
use crate::token_of;
use devmem::dispatch;
use gaurast_runner::{Case, simd_levels};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Tests every float near every 8-bit code and near the middle between two codes.
#[gaurast_runner::test(each = simd_levels())]
fn bytes_are_the_nearest_and_read_back_as_their_format_says(case: &Case) {
    let mut values = vec![f32::NAN, f32::INFINITY, -1.0, -0.0, 2.0, f32::MIN_POSITIVE];
    for half in 0..=510 {
        let at = (f64::from(half) / 510.0) as f32;
        values.extend((-4..=4).map(|step| f32::from_bits(at.to_bits().saturating_add_signed(step))));
    }
    while !values.len().is_multiple_of(16) {
        values.push(0.3);
    }
    let format = Format::R8G8B8A8Unorm;
    let level = token_of(case);
    for chunk in values.as_chunks::<16>().0 {
        let (packed, unpacked): ([u32; 16], [f32; 16]) = dispatch!(level, simd => {
            let value = f32x16::simd_from(simd, *chunk);
            let packed = pack_unorm8(simd, &[value; 4], false);
            let [.., blue, _] = unpack_unorm8(simd, packed, true);
            (packed.into(), blue.into())
        });
        for (lane, value) in chunk.iter().enumerate() {
            let bytes = packed[lane].to_le_bytes();
            assert_eq!(bytes, format.encode([*value; 4])[..4], "{value}");
            assert_eq!(unpacked[lane], format.decode(&bytes)[0], "{value}");
        }
    }
}

#[gaurast_runner::test]
fn stores_touch_only_their_lanes() {
    let values = std::array::from_fn(|lane| 100 + lane as u32);
    let quads = QuadAddresses { first: [8, 0, 8, 4], consecutive: false, distinct: false };
    let mut words = [7; 16];
    // Quads 0 and 2 have the same address, each with different lanes.
    quads.store(&mut words, 0b1111_0110_0000_1001, &values);
    assert_eq!(words, [7, 7, 7, 7, 112, 113, 114, 115, 100, 109, 110, 103, 7, 7, 7, 7]);
    let block = QuadAddresses { first: [0, 4, 8, 12], consecutive: true, distinct: true };
    block.store(&mut words, u16::MAX, &values);
    assert_eq!(words, values);
    assert_eq!(block.load(&words), values);
}

#[gaurast_runner::test(each = simd_levels())]
fn kernels_of_usual_equations_have_the_bits_of_the_equations(case: &Case) {
    let level = token_of(case);
    let mut rng = ChaCha8Rng::seed_from_u64(19);
    for equation in [PREMULTIPLIED, STRAIGHT] {
        let state = BlendState { equations: Some(BlendEquations::both(equation)), write_mask: 0xF };
        let kernel = ColorOutput::new(&state, None, [0.0; 4], Format::B8G8R8A8Unorm).unwrap();
        assert!(kernel.over.is_some());
        let general = ColorOutput { over: None, ..kernel.clone() };
        let other = ColorOutput::new(&state, None, [0.0; 4], Format::R16G16B16A16Sfloat).unwrap();
        assert_eq!(other.codec, Codec::Other);
        for _ in 0..200 {
            let source: [[f32; 16]; 4] = std::array::from_fn(|_| std::array::from_fn(|_| rng.random_range(-0.2..1.2)));
            let stored: [u32; 16] = rng.random();
            let write = |output: &ColorOutput| {
                let mut words = stored;
                dispatch!(level, simd => {
                    let [r, g, b, a] = source;
                    let load = |lanes| f32x16::simd_from(simd, lanes);
                    let source = [load(r), load(g), load(b), load(a)];
                    let quads = QuadAddresses { first: [0, 4, 8, 12], consecutive: true, distinct: true };
                    output.write(simd, &source, &source, 0xFBFF, &quads, &mut words);
                });
                words
            };
            assert_eq!(write(&kernel), write(&general), "{equation:?}");
        }
    }
}

#[gaurast_runner::test(each = simd_levels())]
fn whole_blocks_of_wide_texels_are_what_their_lanes_are(case: &Case) {
    let level = token_of(case);
    let mut rng = ChaCha8Rng::seed_from_u64(20);
    for equations in [None, Some(BlendEquations { color: PREMULTIPLIED, alpha: STRAIGHT })] {
        let state = BlendState { equations, write_mask: 0xF };
        let format = Format::R32G32B32A32Sfloat;
        let output = ColorOutput::new(&state, None, [0.0; 4], format).unwrap();
        assert_eq!(output.codec, Codec::Words);
        let source: [[f32; 16]; 4] = std::array::from_fn(|_| std::array::from_fn(|_| rng.random_range(-0.2..1.2)));
        // The quads before and after the block must not change.
        let stored: [u32; 96] = std::array::from_fn(|_| rng.random::<f32>().to_bits());
        let write = |lanes: &[u16], consecutive| {
            let mut words = stored;
            dispatch!(level, simd => {
                let [r, g, b, a] = source;
                let load = |lanes| f32x16::simd_from(simd, lanes);
                let source = [load(r), load(g), load(b), load(a)];
                let quads = QuadAddresses { first: [4, 8, 12, 16], consecutive, distinct: consecutive };
                for &lanes in lanes {
                    output.write(simd, &source, &source, lanes, &quads, &mut words);
                }
            });
            words
        };
        let lanes: Vec<u16> = (0..16).map(|lane| 1 << lane).collect();
        assert_eq!(write(&[u16::MAX], true), write(&lanes, false), "{equations:?}");
        assert_ne!(write(&[u16::MAX], true), stored);
    }
}

/// Kernels of usual equations write the bits that the equations write lane by lane, also to quads that are known to be
/// distinct.
#[gaurast_runner::test(each = simd_levels())]
fn kernels_for_whole_texels_write_what_the_equations_write(case: &Case) {
    let level = token_of(case);
    let mut rng = ChaCha8Rng::seed_from_u64(21);
    for (format, equation) in [
        (Format::R32G32B32A32Sfloat, PREMULTIPLIED),
        (Format::R32G32B32A32Sfloat, STRAIGHT),
        (Format::R8G8B8A8Unorm, PREMULTIPLIED),
        (Format::B8G8R8A8Unorm, STRAIGHT),
    ] {
        let equations = Some(BlendEquations::both(equation));
        let output =
            |write_mask| ColorOutput::new(&BlendState { equations, write_mask }, None, [0.0; 4], format).unwrap();
        let kernel = output(0xF).over_kernel().expect("a kernel");
        assert!(output(0b0111).over_kernel().is_none());
        let output = ColorOutput { over: None, ..output(0xF) };
        for _ in 0..200 {
            let source: [[f32; 16]; 4] = std::array::from_fn(|_| std::array::from_fn(|_| rng.random_range(-0.2..1.2)));
            // Some of these are infinite or NaN.
            let stored: [u32; 96] = std::array::from_fn(|_| rng.random::<u32>() | rng.random::<u32>());
            let lanes: u16 = rng.random();
            let write = |lanes: &[u16], kernel: Option<OverKernel>, distinct| {
                let mut words = stored;
                dispatch!(level, simd => {
                    let [r, g, b, a] = source;
                    let load = |lanes| f32x16::simd_from(simd, lanes);
                    let source = [load(r), load(g), load(b), load(a)];
                    let quads = QuadAddresses { first: [12, 0, 20, 4], consecutive: false, distinct };
                    for &lanes in lanes {
                        match kernel {
                            None => output.write(simd, &source, &source, lanes, &quads, &mut words),
                            Some(OverKernel::Unorm8 { over, bgra }) => {
                                blend_bytes_over(simd, over, bgra, &source, lanes, &quads, &mut words);
                            }
                            Some(OverKernel::Words { over }) => {
                                blend_words_over(simd, over, &source, lanes, &quads, &mut words);
                            }
                        }
                    }
                });
                words
            };
            let each: Vec<u16> = (0..16).map(|lane| lanes & 1 << lane).collect();
            let expected = write(&each, None, false);
            assert_eq!(write(&[lanes], Some(kernel), true), expected, "{format:?} {equation:?}");
            assert_eq!(write(&[lanes], Some(kernel), false), expected, "{format:?} {equation:?}");
            assert_eq!(write(&[0], Some(kernel), true), stored);
        }
    }
}
