use super::*;
use crate::Format;
use crate::format::{Aspect, ClearValue};
use crate::image::{ImageDesc, ImageKind};
use crate::packet::{BufferCopyRegion, CopyImage, ImageCopyRegion, SubresourceLayers, SubresourceRange};
use crate::runtime::Config;
use devmem::Allocation;
use std::sync::Arc;

fn buffer(bytes: &[u8]) -> BufferRange {
    let memory = Allocation::new_zeroed(bytes.len() as u64).unwrap();
    memory.write(0, bytes).unwrap();
    let size = bytes.len() as u64;
    BufferRange { memory, offset: 0, size }
}

fn contents(range: &BufferRange) -> Vec<u8> {
    let mut out = vec![0; range.size as usize];
    range.memory.read(range.offset, &mut out).unwrap();
    out
}

fn image(kind: ImageKind, format: Format, extent: [u32; 3], layers: u32) -> Arc<Image> {
    let desc = ImageDesc { kind, format, extent, mip_levels: 1, array_layers: layers, samples: 1 };
    let memory = Allocation::new_zeroed(desc.memory_size().unwrap()).unwrap();
    Arc::new(Image::new(desc, memory, 0).unwrap())
}

fn color(base_layer: u32, layer_count: u32) -> SubresourceLayers {
    SubresourceLayers { aspect: Aspect::Color, mip_level: 0, base_layer, layer_count }
}

/// The texels of an image with one byte per texel, of all layers and slices.
fn texels(image: &Arc<Image>) -> Vec<u8> {
    let [width, height, depth] = image.desc.extent;
    let layers = image.desc.array_layers;
    let out = buffer(&vec![0xEE; (width * height * depth * layers) as usize]);
    let region = BufferImageRegion {
        buffer_offset: 0,
        buffer_row_length: 0,
        buffer_image_height: 0,
        subresource: color(0, layers),
        image_offset: [0; 3],
        image_extent: image.desc.extent,
    };
    copy_buffer_image(
        &CopyBufferImage { buffer: out.clone(), image: image.clone(), regions: vec![region] },
        Direction::ToBuffer,
        &runtime(1),
    );
    contents(&out)
}

#[gaurast_runner::test]
fn buffers_are_copied_filled_and_updated_within_their_ranges() {
    let source = buffer(&[1, 2, 3, 4, 5, 6, 7, 8]);
    let mut target = buffer(&[0; 16]);
    target.offset = 4;
    target.size = 8;
    let region = |source_offset, target_offset, size| BufferCopyRegion { source_offset, target_offset, size };
    let before = target.memory.generation();
    copy_buffer(&CopyBuffer {
        source: source.clone(),
        target: target.clone(),
        regions: vec![
            region(1, 2, 3),
            region(6, 0, 3),
            region(0, 6, 3),
            region(u64::MAX, 0, 2),
            region(0, u64::MAX, u64::MAX),
        ],
    });
    assert_ne!(target.memory.generation(), before);
    assert_eq!(contents(&target), [0, 0, 2, 3, 4, 0, 0, 0]);

    fill_buffer(&BufferRange { offset: 8, size: u64::MAX, ..target.clone() }, 0x0403_0201);
    let whole = BufferRange { offset: 0, size: 16, ..target.clone() };
    assert_eq!(contents(&whole), [0, 0, 0, 0, 0, 0, 2, 3, 1, 2, 3, 4, 1, 2, 3, 4]);
    update_buffer(&target, &[9; 9]);
    assert_eq!(contents(&target)[0], 0, "too long, hence left out");
    update_buffer(&target, &[9; 8]);
    assert_eq!(contents(&target), [9; 8]);
    fill_buffer(&BufferRange { offset: u64::MAX, size: 8, ..target.clone() }, 1);
    update_buffer(&BufferRange { offset: u64::MAX, size: 8, ..target }, &[1; 8]);
}

#[gaurast_runner::test]
fn long_fills_cover_every_word() {
    let range = buffer(&vec![0; 4 * 2500]);
    fill_buffer(&range, 0x0101_0101);
    assert_eq!(contents(&range), vec![1; 4 * 2500]);
}

#[gaurast_runner::test]
fn rows_slices_and_layers_find_their_place() {
    let image = image(ImageKind::D2, Format::R8Uint, [4, 3, 1], 2);
    let source = buffer(&(0..64).collect::<Vec<u8>>());
    let region = BufferImageRegion {
        buffer_offset: 2,
        buffer_row_length: 5,
        buffer_image_height: 4,
        subresource: color(0, 2),
        image_offset: [1, 1, 0],
        image_extent: [3, 2, 1],
    };
    let copy = CopyBufferImage { buffer: source, image: image.clone(), regions: vec![region] };
    copy_buffer_image(&copy, Direction::ToImage, &runtime(1));
    let expected = [[0, 0, 0, 0, 0, 2, 3, 4, 0, 7, 8, 9], [0, 0, 0, 0, 0, 22, 23, 24, 0, 27, 28, 29]];
    assert_eq!(texels(&image), expected.concat());
}

#[gaurast_runner::test]
fn what_lies_outside_the_image_is_clipped() {
    let image = image(ImageKind::D2, Format::R8Uint, [4, 3, 1], 1);
    let source = buffer(&(0..64).collect::<Vec<u8>>());
    let region = BufferImageRegion {
        buffer_offset: 0,
        buffer_row_length: 0,
        buffer_image_height: 0,
        subresource: color(0, u32::MAX),
        image_offset: [-1, -2, 0],
        image_extent: [8, 4, 1],
    };
    let copy = CopyBufferImage { buffer: source, image: image.clone(), regions: vec![region] };
    copy_buffer_image(&copy, Direction::ToImage, &runtime(1));
    assert_eq!(texels(&image), [17, 18, 19, 20, 25, 26, 27, 28, 0, 0, 0, 0]);
}

#[gaurast_runner::test]
fn hostile_regions_do_no_harm() {
    let image = image(ImageKind::D3, Format::R8Uint, [4, 3, 2], 1);
    let range = buffer(&[7; 16]);
    let extremes = [0, 1, 3, u32::MAX / 2, u32::MAX];
    for value in extremes {
        for other in extremes {
            for offset in [i32::MIN, -1, 0, 2, i32::MAX] {
                let layers = SubresourceLayers {
                    aspect: Aspect::Color,
                    mip_level: value,
                    base_layer: other,
                    layer_count: value,
                };
                for subresource in [layers, color(0, other)] {
                    let region = BufferImageRegion {
                        buffer_offset: u64::from(value) << (other % 33),
                        buffer_row_length: value,
                        buffer_image_height: other,
                        subresource,
                        image_offset: [offset, 0, offset],
                        image_extent: [other, value, other],
                    };
                    let copy = CopyBufferImage { buffer: range.clone(), image: image.clone(), regions: vec![region] };
                    copy_buffer_image(&copy, Direction::ToImage, &runtime(1));
                    copy_buffer_image(&copy, Direction::ToBuffer, &runtime(1));
                    let region = ImageCopyRegion {
                        source: subresource,
                        source_offset: [offset, 0, 0],
                        target: color(other, value),
                        target_offset: [0, offset, offset],
                        extent: [value, other, value],
                    };
                    copy_image(&CopyImage { source: image.clone(), target: image.clone(), regions: vec![region] });
                }
            }
        }
    }
    assert_eq!(contents(&range).len(), 16);
    assert!(texels(&image).iter().all(|&texel| texel == 7 || texel == 0));
}

#[gaurast_runner::test]
fn layers_of_one_image_become_slices_of_another() {
    let layered = image(ImageKind::D2, Format::R8Uint, [2, 1, 1], 3);
    let solid = image(ImageKind::D3, Format::R8Unorm, [3, 2, 3], 1);
    let region = BufferImageRegion {
        buffer_offset: 0,
        buffer_row_length: 0,
        buffer_image_height: 0,
        subresource: color(0, 3),
        image_offset: [0; 3],
        image_extent: [2, 1, 1],
    };
    let copy = CopyBufferImage { buffer: buffer(&[1, 2, 3, 4, 5, 6]), image: layered.clone(), regions: vec![region] };
    copy_buffer_image(&copy, Direction::ToImage, &runtime(1));
    let region = ImageCopyRegion {
        source: color(1, 2),
        source_offset: [0; 3],
        target: color(0, 1),
        target_offset: [2, 1, 0],
        extent: [2, 1, 2],
    };
    copy_image(&CopyImage { source: layered, target: solid.clone(), regions: vec![region] });
    let expected = [[0, 0, 0, 0, 0, 3], [0, 0, 0, 0, 0, 5], [0; 6]];
    assert_eq!(texels(&solid), expected.concat());
}

#[gaurast_runner::test]
fn clears_write_the_aspect_that_they_name() {
    let image = image(ImageKind::D2, Format::D32SfloatS8Uint, [3, 2, 1], 2);
    let value = ClearValue::DepthStencil { depth: 0.5, stencil: 9 };
    let range = |aspect, base_layer| SubresourceRange {
        aspect,
        base_mip_level: 0,
        level_count: u32::MAX,
        base_layer,
        layer_count: u32::MAX,
    };
    let ranges = vec![range(Aspect::Depth, 1), range(Aspect::Stencil, 0), range(Aspect::Color, 0)];
    clear_image(&ClearImage { image: image.clone(), value, ranges });
    let depth = |layer| {
        let layout = image.subresource(Aspect::Depth, 0, layer).unwrap();
        let mut out = [0; 4];
        image.read_row(&layout, [2, 1, 0], &mut out).unwrap();
        f32::from_le_bytes(out)
    };
    assert_eq!([depth(0), depth(1)], [0.0, 0.5]);
    let layout = image.subresource(Aspect::Stencil, 0, 1).unwrap();
    let mut out = [0; 3];
    image.read_row(&layout, [0, 1, 0], &mut out).unwrap();
    assert_eq!(out, [9; 3]);
}

fn runtime(threads: usize) -> Runtime {
    let config = Config { threads, ..Config::default() };
    Runtime::new(&config).unwrap()
}

#[gaurast_runner::test]
fn workers_copy_what_one_thread_does() {
    // The image's rows follow one another without a gap, or do not.
    for width in [700, 704] {
        workers_copy_rows_of(width);
    }
}

fn workers_copy_rows_of(width: u32) {
    let size = [width, 500];
    let image = image(ImageKind::D2, Format::R32Uint, [size[0], size[1], 1], 1);
    // Rows that are apart, that follow one another, and that overlap, of which the last one counts.
    for row_length in [size[0] + 9, 0, size[0] - 300] {
        let stride = if row_length == 0 { size[0] } else { row_length };
        let texels = stride * size[1] + size[0];
        let texel = |at: u32| at.wrapping_mul(0x9E37_79B9);
        let words: Vec<u32> = (0..texels).map(texel).collect();
        let source = buffer(bytemuck::cast_slice(&words));
        let region = BufferImageRegion {
            buffer_offset: 8,
            buffer_row_length: row_length,
            buffer_image_height: 0,
            subresource: color(0, 1),
            image_offset: [0; 3],
            image_extent: [size[0], size[1], 1],
        };
        let copy = |buffer: &BufferRange, direction, threads| {
            let copy = CopyBufferImage { buffer: buffer.clone(), image: image.clone(), regions: vec![region] };
            copy_buffer_image(&copy, direction, &runtime(threads));
        };
        copy(&source, Direction::ToImage, 3);
        let [alone, shared] = [1, 3].map(|threads| {
            let out = buffer(&vec![0; 4 * texels as usize]);
            copy(&out, Direction::ToBuffer, threads);
            contents(&out)
        });
        assert!(alone == shared, "rows of {stride}");
        for at in [0, 1, stride, stride * (size[1] - 1) + size[0] - 1] {
            let at = at as usize + 2;
            let written = &shared[4 * at..4 * at + 4];
            assert_eq!(written, words[at].to_le_bytes(), "{at}, rows of {stride}");
        }
    }
}

#[gaurast_runner::test]
fn of_rows_without_a_gap_those_are_copied_that_fit_the_buffer() {
    let image = image(ImageKind::D2, Format::R32Uint, [64, 8, 1], 1);
    let words: Vec<u32> = (0..64 * 8).map(|at| at + 1).collect();
    let mut range = buffer(bytemuck::cast_slice(&words));
    // The last row lacks a byte.
    range.size -= 1;
    let region = BufferImageRegion {
        buffer_offset: 0,
        buffer_row_length: 0,
        buffer_image_height: 0,
        subresource: color(0, 1),
        image_offset: [0; 3],
        image_extent: [64, 8, 1],
    };
    let copy = CopyBufferImage { buffer: range, image: image.clone(), regions: vec![region] };
    copy_buffer_image(&copy, Direction::ToImage, &runtime(1));
    let mut copied = vec![0u32; 64 * 8];
    image.memory.read(0, &mut copied).unwrap();
    assert_eq!(copied[..64 * 7], words[..64 * 7]);
    assert_eq!(copied[64 * 7..], [0; 64]);
}

#[gaurast_runner::test]
fn images_without_gaps_are_copied_as_others_are() {
    for width in [60, 64] {
        let [source, target] = [(); 2].map(|()| image(ImageKind::D2, Format::R32Uint, [width, 8, 1], 1));
        let layout = source.subresource(Aspect::Color, 0, 0).unwrap();
        let row_of = |y: u32| (0..width).map(move |x| 1000 * (y + 1) + x);
        for y in 0..8 {
            let row: Vec<u32> = row_of(y).collect();
            source.write_row(&layout, [0, y, 0], bytemuck::cast_slice(&row)).unwrap();
        }
        let region = ImageCopyRegion {
            source: color(0, 1),
            source_offset: [0, 1, 0],
            target: color(0, 1),
            target_offset: [0, 3, 0],
            extent: [width, 4, 1],
        };
        copy_image(&CopyImage { source, target: target.clone(), regions: vec![region] });
        for y in 0..8 {
            let mut row = vec![0u32; width as usize];
            let bytes = bytemuck::cast_slice_mut(&mut row);
            target.read_row(&layout, [0, y, 0], bytes).unwrap();
            let expected: Vec<u32> = match y {
                3..7 => row_of(y - 2).collect(),
                _ => vec![0; width as usize],
            };
            assert_eq!(row, expected, "row {y} of {width}");
        }
    }
}
