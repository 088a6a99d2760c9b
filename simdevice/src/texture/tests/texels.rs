//! Tests of fetches, storage images, texel buffers and queries.

use super::*;
use devmem::BufferRange;
use isa::ir::AtomicOp;

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
    let answer = table.read(0, &request);
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
    assert_eq!(table.read(0, &request)[0][..5], [7, 8, 9, 10, 0]);
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
        assert_eq!(table.read(0, &inside).map(|lanes| lanes[0]), expected, "{format:?}");
        let neighbours = texels(ARRAY, &[[3, 2, 1, 0], [4, 1, 1, 0], [4, 2, 0, 0]]);
        let untouched = table.read(0, &neighbours);
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
        let found = table.read(0, &of_lane(request, lane));
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
        let (all, each) = (together.read(0, &request), read_alone(&alone, &request));
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
    assert_eq!(table.read(0, &request)[0][0], 0);
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
    assert_eq!(table.read(0, &request)[0][0], 1);
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
    let answer = table.read(0, &request);
    assert_eq!(answer[1][..3], [2, 2, 0]);
    assert_eq!(memory.load_u32(24), Some(0));
    let outside = buffer(60, 8);
    assert_eq!(outside.size(0, shape, 0), [0; 4]);
    assert_eq!(outside.read(0, &request), [[0; 16]; 4]);
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
    let read = |image| table(image, Sampler::default()).read(0, &request).map(|lanes| lanes[0]);
    assert_eq!(read(depth), [0.5f32.to_bits(), 0, 0, 1f32.to_bits()]);
    assert_eq!(read(stencil), [77, 0, 0, 1]);
}
