//! Tests of fetches, storage images, texel buffers and queries.

use super::*;
use crate::token_of;
use devmem::BufferRange;
use gaurast_runner::{Case, simd_levels};
use isa::ir::AtomicOp;
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// An access at these coordinates, lane by lane. Only as many lanes as coordinates are active.
fn texels(shape: ImageShape, coordinates: &[[u32; 4]]) -> TexelRequest {
    let at = |lane: usize| coordinates[lane.min(coordinates.len() - 1)];
    TexelRequest {
        mask: ((1u32 << coordinates.len()) - 1) as u16,
        shape,
        coordinate: [0, 1, 2, 3].map(|axis| std::array::from_fn(|lane| at(lane)[axis])),
        level: [0; 16],
        sample: [0; 16],
    }
}

fn storage(image: SampledImage) -> ImageTable {
    let level = SimdLevel::Best.resolve().unwrap();
    let binding = ImageBinding::Storage(StorageImage { view: image.view });
    ImageTable::new(level, [binding], [])
}

const ARRAY: ImageShape = ImageShape { dimension: Dimension::D2, arrayed: true, multisampled: false };

#[gaurast_runner::test]
fn fetches_reach_levels_layers_and_samples_within_bounds() {
    let desc = ImageDesc { mip_levels: 2, array_layers: 3, ..desc(ImageKind::D2, Format::R32G32Uint, [4, 4, 1]) };
    let image = image(desc, |level, layer, [x, y, _]| [x + 10 * y, 100 * level + layer, 0, 0].map(f32::from_bits));
    let table = table(image, Sampler::default());
    let mut request = texels(
        ARRAY,
        &[[3, 2, 1, 0], [1, 1, 2, 0], [2, 0, 0, 0], [4, 0, 0, 0], [0, 0, 3, 0], [u32::MAX, 0, 0, 0], [0, 0, 0, 0]],
    );
    request.level[1] = 1;
    request.level[2] = 1;
    request.level[6] = 2;
    let answer = table.texels(0, &request);
    let found: [[u32; 4]; 7] = std::array::from_fn(|lane| answer.map(|lanes| lanes[lane]));
    assert_eq!(found[0], [23, 1, 0, 1]);
    assert_eq!(found[1], [11, 102, 0, 1]);
    // Components that the format lacks are zeros, and an alpha of 1.
    assert_eq!(found[2..], [[0, 0, 0, 1]; 5], "outside");
}

#[gaurast_runner::test]
fn samples_are_told_apart() {
    let desc = ImageDesc { samples: 4, ..desc(ImageKind::D2, Format::R32Uint, [2, 2, 1]) };
    let image = image(desc, |_, _, _| [0.0; 4]);
    let memory = &image.view.image.memory;
    let layout = desc.subresource(Aspect::Color, 0, 0).unwrap();
    for sample in 0..4 {
        memory.store_u32(u64::from(sample) * layout.sample_pitch, sample + 7);
    }
    let table = table(image, Sampler::default());
    let multisampled = ImageShape { multisampled: true, ..shape(Dimension::D2) };
    let mut request = texels(multisampled, &[[0; 4]; 5]);
    request.sample = std::array::from_fn(|lane| lane as u32);
    assert_eq!(table.texels(0, &request)[0][..5], [7, 8, 9, 10, 0]);
    assert_eq!(table.samples(0), 4);
}

#[gaurast_runner::test]
fn what_is_written_is_read_back() {
    let floats = [0.5f32, -1.0, 0.25, 1.0].map(f32::to_bits);
    let cases = [
        (Format::R32G32B32A32Sfloat, floats, floats),
        (Format::R16G16B16A16Sfloat, floats, floats),
        (Format::R8G8B8A8Snorm, [1f32, -1.0, 0.0, 1.0].map(f32::to_bits), [1f32, -1.0, 0.0, 1.0].map(f32::to_bits)),
        (Format::R32Sfloat, floats, [floats[0], 0, 0, 1f32.to_bits()]),
        (Format::R8G8B8A8Uint, [1, 2, 3, 255], [1, 2, 3, 255]),
        (Format::R16G16B16A16Sint, [1, u32::MAX, 3, 9], [1, u32::MAX, 3, 9]),
        (Format::R8Uint, [200, 2, 3, 4], [200, 0, 0, 1]),
        (Format::R16Uint, [60_000, 2, 3, 4], [60_000, 0, 0, 1]),
    ];
    for (format, written, expected) in cases {
        let desc = ImageDesc { array_layers: 2, ..desc(ImageKind::D2, format, [5, 3, 1]) };
        let table = storage(image(desc, |_, _, _| [0.0; 4]));
        let inside = texels(ARRAY, &[[4, 2, 1, 0]]);
        let value = written.map(|component| [component; 16]);
        table.write(0, &inside, &value);
        assert_eq!(table.texels(0, &inside).map(|lanes| lanes[0]), expected, "{format:?}");
        let neighbours = texels(ARRAY, &[[3, 2, 1, 0], [4, 1, 1, 0], [4, 2, 0, 0]]);
        let untouched = table.texels(0, &neighbours);
        assert_eq!(untouched[0][..3], [0; 3], "{format:?}");
    }
}

/// The same access of one lane.
fn of_lane(request: &TexelRequest, lane: usize) -> TexelRequest {
    TexelRequest { mask: request.mask & 1 << lane, ..*request }
}

/// The answers of the lanes of an access, read one by one.
fn read_alone(table: &ImageTable, request: &TexelRequest) -> [LaneWords; 4] {
    let mut out: [LaneWords; 4] = [[0; 16]; 4];
    for lane in 0..16 {
        let found = table.texels(0, &of_lane(request, lane));
        for (out, found) in out.iter_mut().zip(found) {
            out[lane] = found[lane];
        }
    }
    out
}

/// Lanes are decoded and encoded together; each must read and write what it does alone.
#[gaurast_runner::test]
fn lanes_together_do_as_each_alone() {
    let mut checked = 0;
    for &format in Format::ALL {
        if !format.aspects().contains(&Aspect::Color) || format.decompressed().is_some() {
            continue;
        }
        checked += 1;
        let desc = desc(ImageKind::D2, format, [5, 4, 1]);
        let filled = || {
            let texel = |x: u32, y: u32| [x as f32 / 4.0, y as f32 / 3.0, 0.3, 0.7];
            storage(image(desc, |_, _, [x, y, _]| texel(x, y)))
        };
        let (together, alone) = (filled(), filled());
        // Some lanes are outside, and some are not active.
        let at: Vec<[u32; 4]> = (0..16).map(|lane| [lane % 6, lane / 3, 0, 0]).collect();
        let mut request = texels(shape(Dimension::D2), &at);
        request.mask = 0b1101_1110_1011_0111;
        let (all, each) = (together.texels(0, &request), read_alone(&alone, &request));
        assert_eq!(all, each, "{format:?}");
        let value = |factor: u32, lane: u32| match format.is_integer() {
            true => factor * lane * 4,
            false => ((factor * lane) as f32 / 100.0).to_bits(),
        };
        let values: [LaneWords; 4] =
            [3, 7, 11, 13].map(|factor| std::array::from_fn(|lane| value(factor, lane as u32)));
        together.write(0, &request, &values);
        for lane in 0..16 {
            alone.write(0, &of_lane(&request, lane), &values);
        }
        let (all, each) = (read_alone(&together, &request), read_alone(&alone, &request));
        assert_eq!(all, each, "{format:?}");
    }
    assert!(checked > 50, "{checked}");
}

/// Formats that are accessed 16 lanes at once, and some that are not.
const ACCESSED: [Format; 24] = [
    Format::R8Unorm,
    Format::R8G8Unorm,
    Format::R8G8B8A8Unorm,
    Format::B8G8R8A8Unorm,
    Format::A8B8G8R8UnormPack32,
    Format::R8G8B8A8Srgb,
    Format::B8G8R8A8Srgb,
    Format::R8G8B8A8Uint,
    Format::R16Unorm,
    Format::R16Sfloat,
    Format::R16G16Sfloat,
    Format::R16G16B16A16Sfloat,
    Format::R16G16B16A16Uint,
    Format::R32Sfloat,
    Format::R32Uint,
    Format::R32Sint,
    Format::R32G32Sfloat,
    Format::R32G32Uint,
    Format::R32G32B32A32Sfloat,
    Format::R32G32B32A32Uint,
    Format::R32G32B32A32Sint,
    Format::A2B10G10R10UnormPack32,
    Format::D16Unorm,
    Format::D32Sfloat,
];

/// An access of 16 lanes to places in and around an image: anywhere, or in rows, in order or with lanes exchanged.
fn random_access(rng: &mut ChaCha8Rng, shape: ImageShape, levels: u32) -> TexelRequest {
    let mut request = texels(shape, &[[0; 4]]);
    request.mask = if rng.random() { u16::MAX } else { rng.random() };
    let in_rows = rng.random_range(0..3) == 0;
    let exchanged = if rng.random() { 0 } else { rng.random_range(0..16) };
    for (axis, lanes) in request.coordinate.iter_mut().enumerate() {
        let first = rng.random_range(0..3);
        for (lane, coordinate) in (0..).zip(lanes) {
            *coordinate = match rng.random_range(0..40) {
                0 if !in_rows => rng.random(),
                _ if in_rows && axis == 0 => first + (lane ^ exchanged),
                _ if in_rows => first,
                _ => rng.random_range(0..14),
            };
        }
    }
    let level = rng.random_range(0..levels + 1);
    request.level = [level; 16];
    if rng.random_range(0..8) == 0 {
        request.level = std::array::from_fn(|_| rng.random_range(0..levels + 1));
    }
    request
}

/// Bits of floats and integers: ordinary, special or any.
fn random_value(rng: &mut ChaCha8Rng) -> u32 {
    match rng.random_range(0..5) {
        0 => rng.random(),
        1 => rng.random_range(0..300),
        2 => [f32::NAN, f32::INFINITY, -0.0, 0.5 / 255.0, 1.5 / 255.0, 65_519.9, 1e-7].choose(rng).unwrap().to_bits(),
        _ => rng.random_range(-0.5..1.5_f32).to_bits(),
    }
}

fn random_bytes(rng: &mut ChaCha8Rng, memory: &Allocation) {
    let bytes: Vec<u8> = (0..memory.len()).map(|_| rng.random()).collect();
    memory.write(0, &bytes).unwrap();
}

fn bytes_of(memory: &Allocation) -> Vec<u8> {
    let mut bytes = vec![0; memory.len() as usize];
    memory.read(0, &mut bytes).unwrap();
    bytes
}

/// Asserts that an access at once reads and writes what it reads and writes lane by lane.
fn assert_agree(rng: &mut ChaCha8Rng, table: &ImageTable, memory: &Allocation, request: &TexelRequest, format: Format) {
    let alone = table.clone().lane_by_lane();
    let (found, expected) = (table.texels(0, request), alone.texels(0, request));
    assert_eq!(found, expected, "{format:?} {request:?}");
    let values: [LaneWords; 4] = [(); 4].map(|()| std::array::from_fn(|_| random_value(rng)));
    let before = bytes_of(memory);
    table.write(0, request, &values);
    let found = bytes_of(memory);
    memory.write(0, &before).unwrap();
    alone.write(0, request, &values);
    assert!(found == bytes_of(memory), "{format:?} {request:?} {values:?}");
}

#[gaurast_runner::test(each = simd_levels())]
fn accesses_at_once_are_those_one_by_one(case: &Case) {
    let mut rng = ChaCha8Rng::seed_from_u64(17);
    for round in 0..2500 {
        let format = *ACCESSED.choose(&mut rng).unwrap();
        let dimension = *[Dimension::D1, Dimension::D2, Dimension::D2, Dimension::D3].choose(&mut rng).unwrap();
        let arrayed = dimension != Dimension::D3 && rng.random();
        let [x, y, z] = [(); 3].map(|()| rng.random_range(1..30));
        let (kind, extent) = match dimension {
            Dimension::D1 => (ImageKind::D1, [x, 1, 1]),
            Dimension::D3 => (ImageKind::D3, [x, y, z]),
            _ => (ImageKind::D2, [x, y, 1]),
        };
        let mip_levels = rng.random_range(1..4);
        let desc = ImageDesc { mip_levels, array_layers: if arrayed { 5 } else { 1 }, ..desc(kind, format, extent) };
        let memory = Allocation::new_zeroed(desc.memory_size().unwrap()).unwrap();
        random_bytes(&mut rng, &memory);
        let view = ImageView {
            image: Arc::new(Image::new(desc, memory.clone(), 0).unwrap()),
            format,
            base_mip_level: 0,
            level_count: mip_levels,
            base_layer: 0,
            layer_count: desc.array_layers,
        };
        let aspect = format.aspects()[0];
        let binding = if round % 2 == 0 && aspect == Aspect::Color {
            ImageBinding::Storage(StorageImage { view })
        } else {
            let swizzle =
                [ComponentSwizzle::Blue, ComponentSwizzle::One, ComponentSwizzle::Alpha, ComponentSwizzle::Red];
            ImageBinding::Sampled(SampledImage {
                view,
                aspect,
                swizzle: if rng.random() { swizzle } else { IDENTITY },
                chroma: None,
            })
        };
        let table = ImageTable::new(token_of(case), [binding], []);
        for _ in 0..4 {
            let request = random_access(&mut rng, ImageShape { arrayed, ..shape(dimension) }, mip_levels);
            assert_agree(&mut rng, &table, &memory, &request, format);
        }
    }
}

#[gaurast_runner::test(each = simd_levels())]
fn accesses_of_buffers_at_once_are_those_one_by_one(case: &Case) {
    let mut rng = ChaCha8Rng::seed_from_u64(18);
    for _ in 0..1000 {
        let format = *ACCESSED[..22].choose(&mut rng).unwrap();
        let memory = Allocation::new_zeroed(rng.random_range(200..300)).unwrap();
        random_bytes(&mut rng, &memory);
        let offset = *[0, 4, 16, 24, 2].choose(&mut rng).unwrap();
        // Some buffers end with the memory, within a word or a texel.
        let size = if rng.random() { memory.len() - offset } else { rng.random_range(0..memory.len() - offset) };
        let range = BufferRange { memory: memory.clone(), offset, size };
        let table = ImageTable::new(token_of(case), [ImageBinding::TexelBuffer(TexelBuffer { range, format })], []);
        for _ in 0..4 {
            let mut request = random_access(&mut rng, shape(Dimension::Buffer), 1);
            let first = rng.random_range(0..40);
            request.coordinate[0] = request.coordinate[0].map(|x| x.wrapping_add(first));
            assert_agree(&mut rng, &table, &memory, &request, format);
        }
    }
}

#[gaurast_runner::test]
fn writes_outside_vanish() {
    let image = image(desc(ImageKind::D2, Format::R32Uint, [3, 3, 1]), |_, _, _| [0.0; 4]);
    let memory = image.view.image.memory.clone();
    let table = storage(image);
    let outside = [[3, 0, 0, 0], [0, 3, 0, 0], [u32::MAX, 0, 0, 0], [0, u32::MAX, 0, 0]];
    let request = texels(shape(Dimension::D2), &outside);
    table.write(0, &request, &[[7; 16]; 4]);
    table.atomic(0, &request, AtomicOp::IAdd, &[7; 16], &[0; 16]);
    assert!((0..memory.len() / 4).all(|word| memory.load_u32(4 * word) == Some(0)));
}

#[gaurast_runner::test]
fn sampled_images_are_not_written() {
    let image = image(desc(ImageKind::D2, Format::R32Uint, [3, 3, 1]), |_, _, _| [0.0; 4]);
    let table = table(image, Sampler::default());
    let request = texels(shape(Dimension::D2), &[[1, 1, 0, 0]]);
    table.write(0, &request, &[[7; 16]; 4]);
    table.atomic(0, &request, AtomicOp::IAdd, &[7; 16], &[0; 16]);
    assert_eq!(table.texels(0, &request)[0][0], 0);
}

#[gaurast_runner::test]
fn atomics_act_in_order_of_lanes() {
    let image = image(desc(ImageKind::D2, Format::R32Uint, [2, 2, 1]), |_, _, _| [0.0; 4]);
    let table = storage(image);
    let request = texels(shape(Dimension::D2), &[[1, 0, 0, 0]; 4]);
    let old = table.atomic(0, &request, AtomicOp::IAdd, &[5; 16], &[0; 16]);
    assert_eq!(old[..5], [0, 5, 10, 15, 0]);
    let old = table.atomic(0, &request, AtomicOp::CompareExchange, &[1; 16], &[20; 16]);
    assert_eq!(old[..4], [20, 1, 1, 1]);
    assert_eq!(table.texels(0, &request)[0][0], 1);
}

#[gaurast_runner::test]
fn texel_buffers_end_where_their_range_does() {
    let memory = Allocation::new_zeroed(64).unwrap();
    let level = SimdLevel::Best.resolve().unwrap();
    let buffer = |offset, size| {
        let range = BufferRange { memory: memory.clone(), offset, size };
        let format = Format::R16G16Uint;
        ImageTable::new(level, [ImageBinding::TexelBuffer(TexelBuffer { range, format })], [])
    };
    let table = buffer(16, 10);
    let shape = shape(Dimension::Buffer);
    assert_eq!(table.size(0, shape, 0), [2, 0, 0, 0]);
    let request = texels(shape, &[[0; 4], [1, 0, 0, 0], [2, 0, 0, 0]]);
    table.write(0, &request, &[[1; 16], [2; 16], [3; 16], [4; 16]]);
    let answer = table.texels(0, &request);
    assert_eq!(answer[1][..3], [2, 2, 0]);
    assert_eq!(memory.load_u32(24), Some(0));
    let outside = buffer(60, 8);
    assert_eq!(outside.size(0, shape, 0), [0; 4]);
    assert_eq!(outside.texels(0, &request), [[0; 16]; 4]);
}

#[gaurast_runner::test]
fn queries_tell_what_is_there() {
    let desc = ImageDesc { mip_levels: 3, array_layers: 12, ..desc(ImageKind::D2, Format::R8Unorm, [20, 20, 1]) };
    let cubes = image(desc, |_, _, _| [0.0; 4]);
    let table = table(cubes, Sampler::default());
    let cube_array = ImageShape { arrayed: true, ..shape(Dimension::Cube) };
    assert_eq!(table.size(0, cube_array, 0), [20, 20, 2, 0]);
    assert_eq!(table.size(0, ARRAY, 1), [10, 10, 12, 0]);
    assert_eq!(table.size(0, shape(Dimension::Cube), 2), [5, 5, 0, 0]);
    assert_eq!(table.size(0, ARRAY, 3), [0; 4]);
    assert_eq!((table.levels(0), table.samples(0)), (3, 1));
    assert_eq!((table.levels(1), table.samples(1)), (0, 0));
    assert_eq!(table.size(1, ARRAY, 0), [0; 4]);
}

#[gaurast_runner::test]
fn stencil_and_depth_are_planes_of_their_own() {
    let desc = desc(ImageKind::D2, Format::D32SfloatS8Uint, [2, 2, 1]);
    let depth = image(desc, |_, _, _| [0.5, 0.0, 0.0, 0.0]);
    let stencil = SampledImage { aspect: Aspect::Stencil, ..depth.clone() };
    let layout = desc.subresource(Aspect::Stencil, 0, 0).unwrap();
    depth.view.image.write_row(&layout, [1, 1, 0], &[77]).unwrap();
    let request = texels(shape(Dimension::D2), &[[1, 1, 0, 0]]);
    let read = |image| table(image, Sampler::default()).texels(0, &request).map(|lanes| lanes[0]);
    assert_eq!(read(depth), [0.5f32.to_bits(), 0, 0, 1f32.to_bits()]);
    assert_eq!(read(stencil), [77, 0, 0, 1]);
}
