//! Tests that filtering 16 lanes at once and lane by lane gives the same bits, for random requests.

use super::*;
use crate::token_of;
use gaurast_runner::{Case, simd_levels};
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A random coordinate: ordinary, on an edge, far away, or NaN.
fn coordinate(rng: &mut ChaCha8Rng) -> f32 {
    match rng.random_range(0..10) {
        0 => rng.random_range(-4i32..5) as f32 / 4.0,
        1 => *[0.0, -0.0, 1.0, -1.0, 0.5, f32::EPSILON, -1e-10].choose(rng).unwrap(),
        2 => f32::from_bits(rng.random()),
        3 => *[f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, 8_388_607.5, -3e9].choose(rng).unwrap(),
        4 => rng.random_range(-1000.0..1000.0),
        _ => rng.random_range(-1.5..2.5),
    }
}

fn lanes(mut value: impl FnMut() -> u32) -> LaneWords {
    std::array::from_fn(|_| value())
}

fn random_lod(rng: &mut ChaCha8Rng) -> LodRequest {
    match rng.random_range(0..5) {
        4 => LodRequest::Automatic,
        0 => LodRequest::Explicit(lanes(|| rng.random_range(-1f32..5.0).to_bits())),
        1 => LodRequest::Gradient {
            dx: [(); 3].map(|()| lanes(|| rng.random_range(-0.5f32..0.5).to_bits())),
            dy: [(); 3].map(|()| lanes(|| rng.random_range(-0.5f32..0.5).to_bits())),
            minimum: lanes(|| rng.random_range(0f32..2.0).to_bits()),
        },
        2 => LodRequest::Implicit { bias: lanes(|| coordinate(rng).to_bits()), minimum: [0; 16] },
        _ => LodRequest::Explicit([0; 16]),
    }
}

fn random_sampler(rng: &mut ChaCha8Rng) -> Sampler {
    let filters = [Filter::Nearest, Filter::Linear];
    let unnormalized = rng.random_range(0..8) == 0;
    Sampler {
        mag_filter: *filters.choose(rng).unwrap(),
        min_filter: *filters.choose(rng).unwrap(),
        mipmap_mode: *[MipmapMode::Nearest, MipmapMode::Linear].choose(rng).unwrap(),
        address_modes: [(); 3].map(|()| *MODES.choose(rng).unwrap()),
        mip_lod_bias: *[0.0, -0.5, 1.25].choose(rng).unwrap(),
        min_lod: *[0.0, 0.75].choose(rng).unwrap(),
        max_lod: *[1000.0, 1.5].choose(rng).unwrap(),
        compare_op: None,
        border_color: BorderColor::float([0.25, 0.5, 0.75, 1.0]),
        has_seams: rng.random_range(0..4) == 0,
        unnormalized_coordinates: unnormalized,
        max_anisotropy: *[1.0, 1.0, 4.0].choose(rng).unwrap(),
        reduction: Reduction::WeightedAverage,
    }
}

/// All comparisons.
const COMPARISONS: [CompareOp; 8] = [
    CompareOp::Never,
    CompareOp::Less,
    CompareOp::Equal,
    CompareOp::LessOrEqual,
    CompareOp::Greater,
    CompareOp::NotEqual,
    CompareOp::GreaterOrEqual,
    CompareOp::Always,
];

fn assert_agree(case: &Case, image: &SampledImage, sampler: Sampler, request: &SampleRequest) {
    let level = token_of(case);
    let binding = ImageBinding::Sampled(image.clone());
    let table = ImageTable::new(level, [binding], [Some(sampler)]);
    let batched = table.sampled(0, 0, request);
    let one_by_one = table.lane_by_lane().sampled(0, 0, request);
    for lane in (0..16).filter(|lane| request.mask >> lane & 1 != 0) {
        let (a, b) = (floats(&batched, lane), floats(&one_by_one, lane));
        let same = a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan());
        assert!(same, "lane {lane}: {a:?}, {b:?}\n{:?}\n{sampler:?}\n{request:?}", image.view.image.desc);
    }
}

#[gaurast_runner::test(each = simd_levels())]
fn at_once_or_one_by_one_is_the_same(case: &Case) {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let formats = [
        Format::R8Unorm,
        Format::R8G8Unorm,
        Format::R8G8B8A8Unorm,
        Format::B8G8R8A8Unorm,
        Format::R8G8B8A8Srgb,
        Format::B8G8R8A8Srgb,
        Format::R16Unorm,
        Format::R16Sfloat,
        Format::R16G16Sfloat,
        Format::R16G16B16A16Sfloat,
        Format::R32Sfloat,
        Format::R32G32Sfloat,
        Format::R32G32B32A32Sfloat,
        Format::R32G32Uint,
        Format::D16Unorm,
        Format::D32Sfloat,
        Format::D32SfloatS8Uint,
    ];
    for round in 0..2000 {
        let format = *formats.choose(&mut rng).unwrap();
        let dimensions = [Dimension::D1, Dimension::D2, Dimension::D3, Dimension::Cube];
        let dimension = *dimensions.choose(&mut rng).unwrap();
        let size = |rng: &mut ChaCha8Rng| rng.random_range(1..14);
        let [x, y, z] = [(); 3].map(|()| size(&mut rng));
        let (kind, extent) = match dimension {
            Dimension::D1 => (ImageKind::D1, [x, 1, 1]),
            Dimension::D3 => (ImageKind::D3, [x, y, z]),
            Dimension::Cube => (ImageKind::D2, [x, x, 1]),
            _ => (ImageKind::D2, [x, y, 1]),
        };
        let arrayed = dimension != Dimension::D3 && rng.random();
        let elements = if arrayed { 3 } else { 1 };
        let desc = ImageDesc {
            mip_levels: rng.random_range(1..4),
            array_layers: elements * if dimension == Dimension::Cube { 6 } else { 1 },
            ..desc(kind, format, extent)
        };
        let texels: Vec<[f32; 4]> = (0..97).map(|_| rng.random()).collect();
        let mut image = image(desc, |level, layer, [x, y, z]| {
            texels[(7 * level + 31 * layer + x + 14 * y + 5 * z) as usize % texels.len()]
        });
        if round % 3 == 0 {
            image.swizzle =
                [ComponentSwizzle::Blue, ComponentSwizzle::One, ComponentSwizzle::Red, ComponentSwizzle::Zero];
        }
        let mut sampler = random_sampler(&mut rng);
        let coordinates: Vec<[f32; 4]> = (0..16)
            .map(|_| {
                let mut at = [(); 4].map(|()| coordinate(&mut rng));
                if arrayed {
                    at[dimension.coordinates()] = rng.random_range(-2.0..5.0);
                }
                at
            })
            .collect();
        let mut request = request(dimension, &coordinates);
        request.shape.arrayed = arrayed;
        request.lod = random_lod(&mut rng);
        request.mask = if round % 2 == 0 { u16::MAX } else { rng.random() };
        if round % 5 == 0 {
            request.offset = [(); 3].map(|()| lanes(|| rng.random_range(-9i32..10) as u32));
        }
        if round % 50 == 0 {
            request.offset = [(); 3].map(|()| lanes(|| rng.random()));
        }
        if format.aspects()[0] == Aspect::Depth && rng.random() {
            sampler.compare_op = Some(*COMPARISONS.choose(&mut rng).unwrap());
            request.compare = Some(lanes(|| coordinate(&mut rng).to_bits()));
        }
        assert_agree(case, &image, sampler, &request);
    }
}

/// The coordinates of four quads on a surface: anywhere, rotated, near or far. In some cases all are special values.
fn surface_coordinates(rng: &mut ChaCha8Rng) -> Vec<[f32; 4]> {
    let mut at = Vec::new();
    let odd = rng.random_range(0..4) == 0;
    for _ in 0..4 {
        let first = [(); 3].map(|()| rng.random_range(-2.0..3.0f32));
        let step = 2f32.powf(rng.random_range(-9.0..1.0));
        let [right, below] = [(); 2].map(|()| [(); 3].map(|()| step * rng.random_range(-1.0..1.0)));
        for lane in 0..4 {
            let (x, y) = ((lane & 1) as f32, (lane >> 1) as f32);
            let [s, t, r] = [0, 1, 2].map(|axis| first[axis] + x * right[axis] + y * below[axis]);
            at.push(if odd { [(); 4].map(|()| coordinate(rng)) } else { [s, t, r, 0.0] });
        }
    }
    at
}

/// Formats that are sampled 16 lanes at once, and one that is not filtered.
const SAMPLED: [Format; 18] = [
    Format::R8Unorm,
    Format::R8G8Unorm,
    Format::R8G8B8A8Unorm,
    Format::B8G8R8A8Unorm,
    Format::R8G8B8A8Srgb,
    Format::B8G8R8A8Srgb,
    Format::R16Unorm,
    Format::R16Sfloat,
    Format::R16G16Sfloat,
    Format::R16G16B16A16Sfloat,
    Format::R32Sfloat,
    Format::R32G32Sfloat,
    Format::R32G32B32A32Sfloat,
    Format::R32Uint,
    Format::D16Unorm,
    Format::D16Unorm,
    Format::D32Sfloat,
    Format::D32Sfloat,
];

#[gaurast_runner::test(each = simd_levels())]
fn plain_samples_are_the_same_one_by_one(case: &Case) {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    for round in 0..4000 {
        let largest = if round % 7 == 0 { 3 } else { 70 };
        let [width, mut height]: [u32; 2] = [(); 2].map(|()| rng.random_range(1..largest));
        let is_cube = round % 4 == 0;
        if is_cube {
            height = width;
        }
        let format = *SAMPLED.choose(&mut rng).unwrap();
        let desc = ImageDesc {
            mip_levels: if is_cube && rng.random() { 1 } else { rng.random_range(1..=width.max(height).ilog2() + 1) },
            array_layers: if is_cube { 6 } else { 1 },
            ..desc(ImageKind::D2, format, [width, height, 1])
        };
        let mut texels: Vec<[f32; 4]> = (0..97).map(|_| rng.random()).collect();
        if round % 8 == 1 {
            // Infinities and denormal numbers, of binary16 too.
            let special = [f32::INFINITY, -0.0, 1e-6, 1e-40, f32::NAN, -65_504.0];
            for (texel, special) in texels.iter_mut().zip(special) {
                *texel = [special; 4];
            }
        }
        let mut image = image(desc, |level, layer, [x, y, _]| {
            texels[(7 * level + 31 * layer + x + 14 * y) as usize % texels.len()]
        });
        if round % 3 == 0 {
            image.swizzle =
                [ComponentSwizzle::Blue, ComponentSwizzle::One, ComponentSwizzle::Alpha, ComponentSwizzle::Zero];
        }
        let mut sampler = Sampler {
            mag_filter: Filter::Linear,
            min_filter: Filter::Linear,
            unnormalized_coordinates: false,
            ..random_sampler(&mut rng)
        };
        let dimension = if is_cube { Dimension::Cube } else { Dimension::D2 };
        let mut request = request(dimension, &surface_coordinates(&mut rng));
        request.lod = LodRequest::Automatic;
        request.mask = if round % 2 == 0 { u16::MAX } else { rng.random() };
        if round % 10 == 0 {
            request.offset[round / 10 % 2] = [2; 16];
        }
        if format.aspects()[0] == Aspect::Depth && rng.random_range(0..8) != 0 {
            sampler.compare_op = Some(*COMPARISONS.choose(&mut rng).unwrap());
            let texel = texels.choose(&mut rng).unwrap()[0].to_bits();
            request.compare = Some(lanes(|| if rng.random() { texel } else { coordinate(&mut rng).to_bits() }));
        }
        assert_agree(case, &image, sampler, &request);
    }
}

#[gaurast_runner::test(each = simd_levels())]
fn a_level_of_weight_zero_is_not_read(case: &Case) {
    let desc = ImageDesc { mip_levels: 2, ..desc(ImageKind::D2, Format::R32Sfloat, [4, 4, 1]) };
    let image = image(desc, |level, _, _| [if level == 0 { 0.5 } else { f32::INFINITY }, 0.0, 0.0, 1.0]);
    let sampler = Sampler { mipmap_mode: MipmapMode::Linear, ..Sampler::default() };
    let mut request = request(Dimension::D2, &[[0.3, 0.3, 0.0, 0.0]]);
    request.lod = LodRequest::Explicit(std::array::from_fn(|lane| (lane as f32 % 2.0).to_bits()));
    assert_agree(case, &image, sampler, &request);
    let answer = table(image, sampler).sampled(0, 0, &request);
    assert_eq!(floats(&answer, 0)[0], 0.5);
    assert_eq!(floats(&answer, 1)[0], f32::INFINITY);
}
