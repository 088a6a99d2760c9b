use super::*;
use crate::format::{Aspect, Format};
use crate::image::{Image, ImageDesc, ImageKind};
use crate::packet::{ImageCopyRegion, SubresourceLayers};
use crate::state::ResolveMode;
use devmem::Allocation;
use std::sync::Arc;

fn resolved(format: Format, mode: ResolveMode, samples: [[f32; 4]; 4]) -> [f32; 4] {
    let mut out = [[9.0; 4]];
    let rows = samples.iter().map(std::slice::from_ref);
    resolve_row(format, mode, rows, &mut out);
    out[0]
}

#[gaurast_runner::test]
fn floats_have_a_mean_and_integers_have_not() {
    let samples = [0.0, 1.0, 0.25, 0.75].map(|x| [x, 1.0, -x, 4.0 * x]);
    let float = Format::R32G32B32A32Sfloat;
    let expected = [
        (ResolveMode::SampleZero, [0.0, 1.0, 0.0, 0.0]),
        (ResolveMode::Average, [0.5, 1.0, -0.5, 2.0]),
        (ResolveMode::Min, [0.0, 1.0, -1.0, 0.0]),
        (ResolveMode::Max, [1.0, 1.0, 0.0, 4.0]),
    ];
    for (mode, expected) in expected {
        assert_eq!(resolved(float, mode, samples), expected, "{mode:?}");
    }
    let integers = [3, -7, i32::MIN, i32::MAX].map(|i: i32| [f32::from_bits(i.cast_unsigned()); 4]);
    let bits = |format, mode| resolved(format, mode, integers)[2].to_bits();
    let (signed, unsigned) = (Format::R32Sint, Format::R32Uint);
    assert_eq!(bits(signed, ResolveMode::Average), 3);
    assert_eq!(bits(signed, ResolveMode::Min), i32::MIN.cast_unsigned());
    assert_eq!(bits(signed, ResolveMode::Max), i32::MAX.cast_unsigned());
    assert_eq!(bits(unsigned, ResolveMode::Average), 3);
    assert_eq!(bits(unsigned, ResolveMode::Min), 3);
    assert_eq!(bits(unsigned, ResolveMode::Max), (-7i32).cast_unsigned());
}

#[gaurast_runner::test]
fn one_sample_is_itself() {
    let mut out = [[0.0; 4]; 2];
    let row = [[0.1, 0.2, 0.3, 0.4], [f32::INFINITY; 4]];
    resolve_row(Format::R32G32B32A32Sfloat, ResolveMode::Average, [row.as_slice()], &mut out);
    assert_eq!(out, row);
}

fn image(format: Format, samples: u32) -> Arc<Image> {
    let desc = ImageDesc { kind: ImageKind::D2, format, extent: [4, 3, 1], mip_levels: 1, array_layers: 2, samples };
    let memory = Allocation::new_zeroed(desc.memory_size().unwrap()).unwrap();
    Arc::new(Image::new(desc, memory, 0).unwrap())
}

#[gaurast_runner::test]
fn a_region_of_each_layer_is_resolved() {
    let source = image(Format::R8G8B8A8Srgb, 4);
    let target = image(Format::R8G8B8A8Srgb, 1);
    let layout = source.subresource(Aspect::Color, 0, 1).unwrap();
    // The samples are black, black, white and white. Their mean is that of linear values, not of codes.
    for sample in 2..4 {
        let row = [255; 16];
        for y in 0..3 {
            source.write_row(&layout.sample(sample), [0, y, 0], &row).unwrap();
        }
    }
    let layers =
        |base_layer, layer_count| SubresourceLayers { aspect: Aspect::Color, mip_level: 0, base_layer, layer_count };
    resolve_image(&ResolveImage {
        source,
        target: target.clone(),
        mode: ResolveMode::Average,
        regions: vec![ImageCopyRegion {
            source: layers(1, 1),
            source_offset: [1, 1, 0],
            target: layers(0, 1),
            target_offset: [2, 0, 0],
            extent: [2, 2, 1],
        }],
    });
    let layout = target.subresource(Aspect::Color, 0, 0).unwrap();
    let rows = [0, 1, 2].map(|y| {
        let mut row = [0u8; 16];
        target.read_row(&layout, [0, y, 0], &mut row).unwrap();
        row
    });
    let grey = [188, 188, 188, 128];
    let mut expected = [0; 16];
    expected[8..12].copy_from_slice(&grey);
    expected[12..].copy_from_slice(&grey);
    assert_eq!(rows, [expected, expected, [0; 16]]);
}
