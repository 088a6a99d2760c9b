//! Tests of blits against the specification's formulas, texel by texel in binary64.

use super::*;
use crate::image::{ImageDesc, ImageKind};
use crate::packet::SubresourceLayers;
use devmem::Allocation;
use proptest::prelude::*;
use std::sync::Arc;

fn image(kind: ImageKind, format: Format, extent: [u32; 3], array_layers: u32) -> Arc<Image> {
    let desc = ImageDesc { kind, format, extent, mip_levels: 1, array_layers, samples: 1 };
    let memory = Allocation::new_zeroed(desc.memory_size().unwrap()).unwrap();
    Arc::new(Image::new(desc, memory, 0).unwrap())
}

fn layers(aspect: Aspect, layer_count: u32) -> SubresourceLayers {
    SubresourceLayers { aspect, mip_level: 0, base_layer: 0, layer_count }
}

/// Sets all bytes to pseudo-random values.
fn scramble(image: &Image, seed: u32) {
    let mut state = seed | 1;
    let bytes: Vec<u8> = (0..image.memory.len())
        .map(|_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        })
        .collect();
    image.memory.write(0, &bytes).unwrap();
}

fn texel_bytes(image: &Image, aspect: Aspect, layer: u32, at: [u32; 3]) -> Vec<u8> {
    let layout = image.subresource(aspect, 0, layer).unwrap();
    let mut bytes = vec![0; layout.format.texel_size()];
    image.read_row(&layout, at, &mut bytes).unwrap();
    bytes
}

fn texel(image: &Image, layer: u32, at: [u32; 3]) -> [f32; 4] {
    let format = image.desc.format;
    format.decode(&texel_bytes(image, Aspect::Color, layer, at))
}

fn blit(source: &Arc<Image>, target: &Arc<Image>, filter: Filter, region: ImageBlitRegion) {
    blit_image(&BlitImage { source: source.clone(), target: target.clone(), filter, regions: vec![region] });
}

/// The position in the source of the centre of the target's texel `i` ("Image Copies With Scaling").
fn place(from: [i32; 2], to: [i32; 2], i: u32) -> f64 {
    let scale = f64::from(from[1] - from[0]) / f64::from(to[1] - to[0]);
    (f64::from(i) + 0.5 - f64::from(to[0])) * scale + f64::from(from[0])
}

/// The weighted mean of the eight texels around a position.
fn linear(image: &Image, layer: u32, place: [f64; 3]) -> [f64; 4] {
    let mut sum = [0.0; 4];
    for corner in 0..8 {
        let mut weight = 1.0;
        let at = [0, 1, 2].map(|axis: usize| {
            let shifted = place[axis] - 0.5;
            let second = corner >> axis & 1;
            let fraction = shifted - shifted.floor();
            weight *= if second == 1 { fraction } else { 1.0 - fraction };
            let last = f64::from(image.desc.extent[axis] - 1);
            (shifted.floor() + f64::from(second)).clamp(0.0, last) as u32
        });
        let texel = texel(image, layer, at);
        for (sum, component) in sum.iter_mut().zip(texel) {
            *sum += weight * f64::from(component);
        }
    }
    sum
}

fn corners() -> impl Strategy<Value = [i32; 2]> {
    (-3i32..12, 1i32..9, any::<bool>())
        .prop_map(|(first, length, mirrored)| if mirrored { [first + length, first] } else { [first, first + length] })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[gaurast_runner::test]
    fn linear_blits_are_weighted_means(
        seed: u32,
        from in [corners(), corners(), corners()],
        to in [corners(), corners(), corners()],
        srgb: bool,
    ) {
        let format = if srgb { Format::R8G8B8A8Srgb } else { Format::R8G8B8A8Unorm };
        let source = image(ImageKind::D3, format, [9, 7, 5], 1);
        let target = image(ImageKind::D3, Format::R32G32B32A32Sfloat, [8, 9, 6], 1);
        scramble(&source, seed);
        let both = |corners: [[i32; 2]; 3]| [0, 1].map(|end| corners.map(|axis| axis[end]));
        blit(&source, &target, Filter::Linear, ImageBlitRegion {
            source: layers(Aspect::Color, 1),
            source_corners: both(from),
            target: layers(Aspect::Color, 1),
            target_corners: both(to),
        });
        for at in target.desc.extent.into_iter().fold(vec![vec![]], |all, size| {
            all.iter().flat_map(|at: &Vec<u32>| (0..size).map(|i| [at.as_slice(), &[i]].concat())).collect()
        }) {
            let at = [at[0], at[1], at[2]];
            let inside = (0..3).all(|axis| {
                let [first, last] = [to[axis][0].min(to[axis][1]), to[axis][0].max(to[axis][1])];
                (first..last).contains(&at[axis].cast_signed())
            });
            let expected = if inside {
                linear(&source, 0, [0, 1, 2].map(|axis| place(from[axis], to[axis], at[axis])))
            } else {
                [0.0; 4]
            };
            let found = texel(&target, 0, at);
            for (found, expected) in found.into_iter().zip(expected) {
                prop_assert!((f64::from(found) - expected).abs() < 1e-6, "{at:?}: {found} {expected}");
            }
        }
    }

    #[gaurast_runner::test]
    fn nearest_blits_take_the_texel_that_the_centre_lies_in(
        seed: u32,
        from in [corners(), corners()],
        to in [corners(), corners()],
    ) {
        let source = image(ImageKind::D2, Format::R16G16Uint, [9, 7, 1], 2);
        let target = image(ImageKind::D2, Format::R32G32Uint, [8, 9, 1], 2);
        scramble(&source, seed);
        let both = |[x, y]: [[i32; 2]; 2]| [[x[0], y[0], 0], [x[1], y[1], 1]];
        blit(&source, &target, Filter::Nearest, ImageBlitRegion {
            source: layers(Aspect::Color, 2),
            source_corners: both(from),
            target: layers(Aspect::Color, 2),
            target_corners: both(to),
        });
        for (layer, y, x) in (0..2).flat_map(|l| (0..9).flat_map(move |y| (0..8).map(move |x| (l, y, x)))) {
            let at: [u32; 2] = [x, y];
            let inside = (0..2).all(|axis| {
                let [first, last] = [to[axis][0].min(to[axis][1]), to[axis][0].max(to[axis][1])];
                (first..last).contains(&at[axis].cast_signed())
            });
            // Positions at edges between texels are skipped, because binary64 may round to either side.
            let places = [0, 1].map(|axis| place(from[axis], to[axis], at[axis]));
            if inside && places.iter().any(|place| (place - place.round()).abs() < 1e-9) {
                continue;
            }
            let expected = if inside {
                let clamp = |axis: usize| {
                    let last = f64::from(source.desc.extent[axis] - 1);
                    places[axis].floor().clamp(0.0, last) as u32
                };
                texel(&source, layer, [clamp(0), clamp(1), 0])
            } else {
                let zero = f32::from_bits(0);
                [zero, zero, zero, f32::from_bits(1)]
            };
            let found = texel(&target, layer, [x, y, 0]);
            prop_assert_eq!(found.map(f32::to_bits), expected.map(f32::to_bits), "{:?}", at);
        }
    }
}

#[gaurast_runner::test]
fn a_centre_on_an_edge_between_texels_lies_in_the_second() {
    // The width is halved: the centres are at 1, 3 and 5 of six texels.
    let source = image(ImageKind::D1, Format::R8Uint, [6, 1, 1], 1);
    let layout = source.subresource(Aspect::Color, 0, 0).unwrap();
    source.write_row(&layout, [0; 3], &[10, 11, 12, 13, 14, 15]).unwrap();
    let target = image(ImageKind::D1, Format::R8Uint, [3, 1, 1], 1);
    let region = |width, mirrored: bool| ImageBlitRegion {
        source: layers(Aspect::Color, 1),
        source_corners: [[0; 3], [6, 1, 1]],
        target: layers(Aspect::Color, 1),
        target_corners: if mirrored { [[width, 0, 0], [0, 1, 1]] } else { [[0; 3], [width, 1, 1]] },
    };
    let read = || {
        let layout = target.subresource(Aspect::Color, 0, 0).unwrap();
        let mut out = [0; 3];
        target.read_row(&layout, [0; 3], &mut out).unwrap();
        out
    };
    blit(&source, &target, Filter::Nearest, region(3, false));
    assert_eq!(read(), [11, 13, 15]);
    blit(&source, &target, Filter::Nearest, region(3, true));
    assert_eq!(read(), [15, 13, 11]);
    blit(&source, &target, Filter::Nearest, region(0, false));
    assert_eq!(read(), [15, 13, 11], "an empty box");
}

#[gaurast_runner::test]
fn depth_and_stencil_keep_their_bits() {
    let make = || image(ImageKind::D2, Format::D24UnormS8Uint, [5, 4, 1], 1);
    let (source, target) = (make(), make());
    scramble(&source, 77);
    for aspect in [Aspect::Depth, Aspect::Stencil] {
        // The image is rotated by half a turn. A linear filter has no effect on depth.
        let region = ImageBlitRegion {
            source: layers(aspect, 1),
            source_corners: [[0, 0, 0], [5, 4, 1]],
            target: layers(aspect, 1),
            target_corners: [[5, 4, 0], [0, 0, 1]],
        };
        blit(&source, &target, Filter::Linear, region);
        for y in 0..4 {
            for x in 0..5 {
                assert_eq!(
                    texel_bytes(&target, aspect, 0, [x, y, 0]),
                    texel_bytes(&source, aspect, 0, [4 - x, 3 - y, 0]),
                );
            }
        }
    }
}

#[gaurast_runner::test]
fn components_are_converted_clamped_and_filled_in() {
    let convert = |from: Format, texel: [f32; 4], to: Format| {
        let source = image(ImageKind::D2, from, [1, 1, 1], 1);
        let target = image(ImageKind::D2, to, [1, 1, 1], 1);
        let layout = source.subresource(Aspect::Color, 0, 0).unwrap();
        source.write_row(&layout, [0; 3], &from.encode(texel)[..from.texel_size()]).unwrap();
        let whole = [[0; 3], [1; 3]];
        let region = ImageBlitRegion {
            source: layers(Aspect::Color, 1),
            source_corners: whole,
            target: layers(Aspect::Color, 1),
            target_corners: whole,
        };
        blit(&source, &target, Filter::Linear, region);
        texel_bytes(&target, Aspect::Color, 0, [0; 3])
    };
    let (snorm, unorm) = (Format::R8G8B8A8Snorm, Format::R8G8B8A8Unorm);
    let texel = [-1.0, 1.0, 0.5, 0.25];
    assert_eq!(convert(snorm, texel, unorm), [0, 255, 129, 64]);
    assert_eq!(convert(Format::R32Sfloat, [7.0, 0.0, 0.0, 0.0], Format::B8G8R8A8Unorm), [0, 0, 255, 255]);
    assert_eq!(convert(unorm, [0.5, 0.0, 1.0, 0.5], Format::R8G8B8A8Srgb), [188, 0, 255, 128]);
    let integers = [300u32, 70_000, 5, 6].map(f32::from_bits);
    assert_eq!(convert(Format::R32G32B32A32Uint, integers, Format::R8G8B8A8Uint), [255, 255, 5, 6]);
    let signed = [-300i32, 300, -1, 0].map(|i| f32::from_bits(i.cast_unsigned()));
    assert_eq!(convert(Format::R32G32B32A32Sint, signed, Format::R8G8B8A8Sint), [0x80, 127, 0xFF, 0]);
}

#[gaurast_runner::test]
fn hostile_regions_touch_nothing_else() {
    let source = image(ImageKind::D2, Format::R8Unorm, [4, 4, 1], 1);
    let target = image(ImageKind::D2, Format::R8Unorm, [4, 4, 1], 1);
    scramble(&source, 3);
    let extremes = [i32::MIN, -1, 0, 4, i32::MAX];
    for filter in [Filter::Nearest, Filter::Linear] {
        for a in extremes {
            for b in extremes {
                for (layer, count) in [(0, u32::MAX), (u32::MAX, 1), (1, u32::MAX)] {
                    let subresource = SubresourceLayers { base_layer: layer, ..layers(Aspect::Color, count) };
                    let region = ImageBlitRegion {
                        source: subresource,
                        source_corners: [[a; 3], [b; 3]],
                        target: subresource,
                        target_corners: [[b, a, 0], [a, b, 1]],
                    };
                    blit(&source, &target, filter, region);
                }
            }
        }
    }
}
