//! Tests of filters and levels of detail against the specification's formulas in binary64.

use super::super::addressing;
use super::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The wrapping operation, in steps of one period or texel until the index is in the image.
fn walk(mode: AddressMode, i: i32, size: i32) -> Option<u32> {
    let mut at = i;
    while !(0..size).contains(&at) {
        at = match mode {
            AddressMode::Repeat => at + if at < 0 { size } else { -size },
            // The index is reflected at the edge beyond which it lies.
            AddressMode::MirroredRepeat if at < 0 => -1 - at,
            AddressMode::MirroredRepeat => 2 * size - 1 - at,
            AddressMode::ClampToEdge => at + if at < 0 { 1 } else { -1 },
            AddressMode::ClampToBorder => return None,
            AddressMode::MirrorClampToEdge if at < 0 => -1 - at,
            AddressMode::MirrorClampToEdge => at - 1,
        };
    }
    Some(at as u32)
}

#[gaurast_runner::test]
fn indices_wrap_as_specified() {
    for mode in MODES {
        for size in 1..9 {
            for i in -40..41 {
                let wrapped = addressing::wrap(mode, i, size as u32);
                assert_eq!(wrapped, walk(mode, i, size), "{mode:?} {i} of {size}");
            }
        }
        for i in [i32::MIN, i32::MAX] {
            assert!(addressing::wrap(mode, i, 7).is_none_or(|index| index < 7));
        }
    }
}

/// The indices of both texels and the weight of the second, by the formulas.
fn linear(mode: AddressMode, s: f64, size: i32, offset: i32) -> ([Option<u32>; 2], f64) {
    let u = s * f64::from(size) + f64::from(offset) - 0.5;
    let first = u.floor() as i32;
    let indices = [walk(mode, first, size), walk(mode, first + 1, size)];
    (indices, u - u.floor())
}

#[gaurast_runner::test]
fn filters_are_weighted_means() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let border = 0.625;
    for mode in MODES {
        for _ in 0..60 {
            let extent = [rng.random_range(1..8), rng.random_range(1..8), rng.random_range(1..8)];
            let texels: Vec<f32> = (0..512).map(|_| rng.random()).collect();
            let value = |[x, y, z]: [u32; 3]| texels[(x + 8 * y + 64 * z) as usize];
            let image = image(desc(ImageKind::D3, Format::R32Sfloat, extent), |_, _, at| [value(at), 0.0, 0.0, 1.0]);
            let sampler = Sampler {
                address_modes: [mode; 3],
                border_color: BorderColor::float([border, 0.0, 0.0, 0.0]),
                ..filtered(Filter::Linear)
            };
            let table = table(image, sampler);
            let coordinates: Vec<[f32; 4]> = (0..16).map(|_| [(); 4].map(|()| rng.random_range(-2.5..2.5))).collect();
            let mut request = request(Dimension::D3, &coordinates);
            let offsets = [(); 3].map(|()| rng.random_range(-8..8));
            request.offset = offsets.map(|offset: i32| [offset as u32; 16]);
            let answer = table.sampled(0, 0, &request);
            for (lane, at) in coordinates.iter().enumerate() {
                let axes = [0, 1, 2].map(|axis| {
                    let size = extent[axis] as i32;
                    linear(mode, f64::from(at[axis]), size, offsets[axis])
                });
                let mut mean = 0.0;
                for corner in 0..8 {
                    let bit = [0, 1, 2].map(|axis| corner >> axis & 1);
                    let weight: f64 = (0..3)
                        .map(|axis| match bit[axis] {
                            0 => 1.0 - axes[axis].1,
                            _ => axes[axis].1,
                        })
                        .product();
                    let index = [0, 1, 2].map(|axis| axes[axis].0[bit[axis]]);
                    let texel = match index {
                        [Some(x), Some(y), Some(z)] => value([x, y, z]),
                        _ => border,
                    };
                    mean += weight * f64::from(texel);
                }
                let error = (f64::from(floats(&answer, lane)[0]) - mean).abs();
                assert!(error < 1e-5, "{mode:?} {at:?} of {extent:?}: {error}");
            }
        }
    }
}

#[gaurast_runner::test]
fn nearest_texels_are_those_that_hold_the_point() {
    for mode in MODES {
        let image = image(desc(ImageKind::D2, Format::R32Sfloat, [5, 3, 1]), |_, _, [x, y, _]| {
            [(x + 10 * y) as f32, 0.0, 0.0, 1.0]
        });
        let sampler = Sampler {
            address_modes: [mode; 3],
            border_color: BorderColor::float([-1.0, 0.0, 0.0, 0.0]),
            ..filtered(Filter::Nearest)
        };
        let table = table(image, sampler);
        for step in -60..60 {
            let s = (step as f32 + 0.25) / 20.0;
            let answer = table.sampled(0, 0, &request(Dimension::D2, &[[s, -s, 0.0, 0.0]]));
            let x = walk(mode, (f64::from(s) * 5.0).floor() as i32, 5);
            let y = walk(mode, (f64::from(-s) * 3.0).floor() as i32, 3);
            let expected = x.zip(y).map_or(-1.0, |(x, y)| (x + 10 * y) as f32);
            assert_eq!(floats(&answer, 0)[0], expected, "{mode:?} {s}");
        }
    }
}

#[gaurast_runner::test]
fn levels_of_detail_follow_the_footprint() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let desc = ImageDesc { mip_levels: 7, ..desc(ImageKind::D2, Format::R8G8B8A8Unorm, [100, 64, 1]) };
    let sampler = Sampler {
        mipmap_mode: MipmapMode::Linear,
        mip_lod_bias: 0.25,
        min_lod: 0.5,
        max_lod: 4.0,
        ..filtered(Filter::Linear)
    };
    let table = table(image(desc, |_, _, _| [0.0; 4]), sampler);
    for _ in 0..200 {
        let coordinates: Vec<[f32; 4]> = (0..16).map(|_| [(); 4].map(|()| rng.random_range(-0.3..0.3))).collect();
        let mut request = request(Dimension::D2, &coordinates);
        request.lod = LodRequest::Implicit { bias: [0; 16], minimum: [0; 16] };
        let [clamped, unclamped] = table.lod(0, 0, &request).map(|lanes| lanes.map(f32::from_bits));
        for lane in 0..16 {
            let quad = lane & !3;
            let scale = |other: usize| {
                let change =
                    |axis: usize| f64::from(coordinates[quad + other][axis]) - f64::from(coordinates[quad][axis]);
                (change(0) * 100.0).hypot(change(1) * 64.0)
            };
            let expected = scale(1).max(scale(2)).log2() + 0.25;
            assert!((f64::from(unclamped[lane]) - expected).abs() < 1e-5);
            assert!((f64::from(clamped[lane]) - expected.clamp(0.5, 4.0)).abs() < 1e-5);
        }
    }
}
