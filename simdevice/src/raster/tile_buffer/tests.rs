use super::*;
use crate::format::Aspect;
use crate::image::{Image, ImageDesc, ImageKind, ImageView};
use crate::packet::StoreOp;
use crate::token_of;
use devmem::Allocation;
use gaurast_runner::{Case, simd_levels};
use std::sync::Arc;

fn view(format: Format, extent: [u32; 3], kind: ImageKind, samples: u32) -> ImageView {
    let desc = ImageDesc { kind, format, extent, mip_levels: 1, array_layers: 1, samples };
    let memory = Allocation::new_zeroed(desc.memory_size().unwrap()).unwrap();
    ImageView {
        image: Arc::new(Image::new(desc, memory, 0).unwrap()),
        format,
        base_mip_level: 0,
        level_count: 1,
        base_layer: 0,
        layer_count: 1,
    }
}

const AREA_20X17: Rect = Rect { x: 3, y: 0, width: 17, height: 17 };

fn pixel(x: i32, y: i32) -> Rect {
    Rect { x, y, width: 1, height: 1 }
}

#[gaurast_runner::test]
fn untouched_tiles_keep_their_bytes_and_touched_ones_are_stored() {
    let view = view(Format::R8G8B8A8Unorm, [20, 17, 1], ImageKind::D2, 1);
    let memory = view.image.memory.clone();
    memory.fill(0, memory.len(), 7).unwrap();
    let target = Target::new(&view, Aspect::Color, 1, StoreOp::Store).unwrap();
    assert_eq!(target.extent(), [20, 17]);
    let mut plane = TileBuffer::new(32, Some(&target));
    for tile in Tile::of_macro_tile(32, [0, 0], AREA_20X17) {
        if tile.index == 1 {
            plane.load_or_clear(&target, 0, &tile);
            assert_eq!(plane.sample_mut(1, 0)[..4], [7; 4]);
            plane.fill_rect(target.format(), &tile, pixel(17, 1), &[255; 4]);
        }
        plane.finish(&target, 0, &tile, true);
    }
    let mut bytes = vec![0u8; memory.len() as usize];
    memory.read(0, &mut bytes).unwrap();
    let changed: Vec<_> = (0..bytes.len()).filter(|&at| bytes[at] != 7).collect();
    let pitch = 128;
    assert_eq!(changed, (0..4).map(|at| pitch + 17 * 4 + at).collect::<Vec<_>>());
}

#[gaurast_runner::test]
fn texels_of_every_size_survive_a_load_and_a_store() {
    for &format in Format::ALL {
        for &aspect in format.aspects() {
            for samples in [1, 4] {
                let view = view(format, [20, 17, 1], ImageKind::D2, samples);
                let memory = view.image.memory.clone();
                let before: Vec<u8> = (0..memory.len()).map(|at| (at * 7 % 251) as u8).collect();
                memory.write(0, &before).unwrap();
                let target = Target::new(&view, aspect, 1, StoreOp::Store).unwrap();
                let mut plane = TileBuffer::new(32, Some(&target));
                for tile in Tile::of_macro_tile(32, [0, 0], AREA_20X17) {
                    plane.load_or_clear(&target, 0, &tile);
                    plane.finish(&target, 0, &tile, true);
                }
                let mut after = vec![0u8; before.len()];
                memory.read(0, &mut after).unwrap();
                if target.format() == Format::X8D24UnormPack32 {
                    // The unused bits may have any value.
                    let layout = view.image.subresource(aspect, 0, 0).unwrap();
                    let end = (layout.offset + layout.size) as usize;
                    (layout.offset as usize + 3..end).step_by(4).for_each(|at| after[at] = before[at]);
                }
                assert_eq!(after, before, "{format:?}");
            }
        }
    }
}

#[gaurast_runner::test]
fn depth_and_stencil_keep_their_precision() {
    let view = view(Format::D24UnormS8Uint, [16, 16, 1], ImageKind::D2, 1);
    let mut depth = Target::new(&view, Aspect::Depth, 1, StoreOp::Store).unwrap();
    depth.clear = Some(Format::X8D24UnormPack32.encode([0.75, 0.0, 0.0, 0.0]));
    let mut stencil = Target::new(&view, Aspect::Stencil, 1, StoreOp::Store).unwrap();
    stencil.clear = Some([3; MAX_TEXEL_SIZE]);
    let area = Rect { x: 0, y: 0, width: 16, height: 16 };
    let [tile] = Tile::of_macro_tile(16, [0, 0], area).collect::<Vec<_>>()[..] else {
        panic!("one tile");
    };
    let mut depths = TileBuffer::new(16, Some(&depth));
    let mut stencils = TileBuffer::new(16, Some(&stencil));
    depths.load_or_clear(&depth, 0, &tile);
    depths.words_mut()[5] = 0xFF_FFFE;
    depths.finish(&depth, 0, &tile, true);
    stencils.load_or_clear(&stencil, 0, &tile);
    stencils.bytes_mut()[6] = 200;
    stencils.finish(&stencil, 0, &tile, true);
    (depth.clear, stencil.clear) = (None, None);
    depths.load_or_clear(&depth, 0, &tile);
    assert_eq!(depths.words_mut()[4..6], [0xBF_FFFF, 0xFF_FFFE]);
    stencils.load_or_clear(&stencil, 0, &tile);
    assert_eq!(stencils.bytes_mut()[5..8], [3, 200, 3]);
}

#[gaurast_runner::test]
fn what_cannot_be_rendered_to_is_refused() {
    let color = view(Format::R8Unorm, [4, 4, 1], ImageKind::D2, 1);
    let new = |view: &ImageView, aspect| Target::new(view, aspect, 1, StoreOp::Store).err();
    assert_eq!(new(&color, Aspect::Depth), Some(AttachmentError::Format(Format::R8Unorm)));
    let wider = ImageView { format: Format::R32Sfloat, ..color.clone() };
    assert_eq!(new(&wider, Aspect::Color), Some(AttachmentError::Format(Format::R32Sfloat)));
    let missing = ImageView { base_layer: u32::MAX, ..color };
    assert!(matches!(new(&missing, Aspect::Color), Some(AttachmentError::Subresource { .. })));
    let two = view(Format::R8Unorm, [4, 4, 1], ImageKind::D2, 2);
    assert_eq!(new(&two, Aspect::Color), Some(AttachmentError::Samples(2)));
    let solid = view(Format::R8Unorm, [4, 4, 3], ImageKind::D3, 1);
    let target = Target::new(&solid, Aspect::Color, 9, StoreOp::Store).unwrap();
    assert_eq!(target.layer_count(), 3, "slices are layers");
}

/// Tests the kernel for the mean of four samples of bytes against the general way.
#[gaurast_runner::test(each = simd_levels())]
fn means_of_bytes_are_those_of_the_format(case: &Case) {
    let format = Format::R8G8B8A8Unorm;
    let image = view(format, [20, 17, 1], ImageKind::D2, 4);
    let memory = image.image.memory.clone();
    let bytes: Vec<u8> = (0..memory.len()).map(|at| (at * at * 31 % 256) as u8).collect();
    memory.write(0, &bytes).unwrap();
    let target = Target::new(&image, Aspect::Color, 1, StoreOp::Store).unwrap();
    let resolved = view(format, [20, 17, 1], ImageKind::D2, 1);
    let resolve = Target::new(&resolved, Aspect::Color, 1, StoreOp::Store).unwrap();
    let level = token_of(case);
    let mut plane = TileBuffer::new(32, Some(&target));
    for tile in Tile::of_macro_tile(32, [0, 0], AREA_20X17) {
        plane.load_or_clear(&target, 0, &tile);
        plane.resolve(level, &target, &resolve, ResolveMode::Average, 0, &tile);
    }
    for y in 0..17 {
        for x in 3..20 {
            let mut samples = [[0; 4]; 4];
            for (sample, bytes) in samples.iter_mut().enumerate() {
                let rows = target.sample(0, sample as u32).unwrap();
                rows.read([x, y], bytes);
            }
            let decoded = samples.map(|bytes| [format.decode(&bytes)]);
            let mut mean = [[0.0; 4]];
            let rows = decoded.iter().map(|texel| &texel[..]);
            resolve_row(format, ResolveMode::Average, rows, &mut mean);
            let mut found = [0; 4];
            let rows = resolve.sample(0, 0).unwrap();
            rows.read([x, y], &mut found);
            assert_eq!(found, format.encode(mean[0])[..4], "{x} {y}");
        }
    }
}
