//! Tests of samples: mips, cubes, comparisons, gathers, borders, layers.

use super::*;

#[gaurast_runner::test]
fn the_level_of_detail_chooses_levels_and_filters() {
    let desc = ImageDesc { mip_levels: 4, ..desc(ImageKind::D2, Format::R32Sfloat, [8, 8, 1]) };
    let levels = image(desc, |level, _, _| [level as f32, 0.0, 0.0, 1.0]);
    let lods = [-3.0, 0.0, 0.25, 0.5, 0.75, 1.5, 2.0, 2.9, 3.0, 50.0, f32::NAN, f32::INFINITY];
    let request = |lods: &[f32]| SampleRequest {
        lod: LodRequest::Explicit(std::array::from_fn(|lane| lods[lane.min(lods.len() - 1)].to_bits())),
        ..request(Dimension::D2, &[[0.5; 4]])
    };
    let read = |sampler: Sampler| {
        let answer = table(levels.clone(), sampler).sampled(0, 0, &request(&lods));
        std::array::from_fn::<f32, 12, _>(|lane| floats(&answer, lane)[0])
    };
    assert_eq!(read(Sampler::default()), [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 3.0, 3.0, 3.0, 0.0, 3.0]);
    let linear = Sampler { mipmap_mode: MipmapMode::Linear, ..Sampler::default() };
    assert_eq!(read(linear), [0.0, 0.0, 0.25, 0.5, 0.75, 1.5, 2.0, 2.9, 3.0, 3.0, 0.0, 3.0]);
    let clamped = Sampler { min_lod: 0.5, max_lod: 2.0, mip_lod_bias: 0.25, ..linear };
    assert_eq!(read(clamped), [0.5, 0.5, 0.5, 0.75, 1.0, 1.75, 2.0, 2.0, 2.0, 2.0, 0.5, 2.0]);

    let mut view = levels.clone();
    (view.view.base_mip_level, view.view.level_count) = (1, 2);
    let answer = table(view, linear).sampled(0, 0, &request(&lods));
    assert_eq!(floats(&answer, 0)[0], 1.0);
    assert_eq!(floats(&answer, 9)[0], 2.0);

    let split = Sampler { mag_filter: Filter::Nearest, min_filter: Filter::Linear, ..Sampler::default() };
    let ramp = image(desc, |_, _, [x, ..]| [x as f32, 0.0, 0.0, 1.0]);
    let answer = table(ramp, split).sampled(0, 0, &request(&[0.0, 0.25]));
    assert_eq!(floats(&answer, 0)[0], 4.0, "magnified");
    assert_eq!(floats(&answer, 1)[0], 3.5, "minified");
}

#[gaurast_runner::test]
fn a_gather_begins_lower_left_and_goes_round() {
    let image = image(desc(ImageKind::D2, Format::R8G8B8A8Uint, [4, 4, 1]), |_, _, [x, y, _]| {
        [x + 10 * y, 100 + x, 2, 3].map(f32::from_bits)
    });
    let table = table(image, Sampler::default());
    // The coordinates are between texels (1, 1), (2, 1), (1, 2) and (2, 2).
    let mut request = request(Dimension::D2, &[[0.5, 0.5, 0.0, 0.0]]);
    request.gather = Some(0);
    let one = |answer: [LaneWords; 4]| answer.map(|lanes| lanes[0]);
    assert_eq!(one(table.sampled(0, 0, &request)), [21, 22, 12, 11]);
    request.gather = Some(1);
    assert_eq!(one(table.sampled(0, 0, &request)), [101, 102, 102, 101]);
    request.offset = [[1; 16], [u32::MAX; 16], [0; 16]];
    request.gather = Some(0);
    assert_eq!(one(table.sampled(0, 0, &request)), [12, 13, 3, 2]);
}

#[gaurast_runner::test]
fn comparisons_come_before_the_filter() {
    let depths = |x: u32| if x == 0 { 0.25 } else { 0.75 };
    for format in [Format::D16Unorm, Format::D32Sfloat, Format::X8D24UnormPack32] {
        let image = image(desc(ImageKind::D2, format, [2, 1, 1]), |_, _, [x, ..]| [depths(x), 0.0, 0.0, 1.0]);
        let sampler = Sampler {
            compare_op: Some(CompareOp::LessOrEqual),
            address_modes: [AddressMode::ClampToEdge; 3],
            ..filtered(Filter::Linear)
        };
        let table = table(image, sampler);
        let mut request = request(Dimension::D2, &[[0.4, 0.5, 0.0, 0.0]]);
        let references = [0.1f32, 0.5, 0.9, f32::NAN, 7.0];
        request.compare = Some(std::array::from_fn(|lane| references[lane.min(4)].to_bits()));
        let answer = table.sampled(0, 0, &request);
        let passed = [0, 1, 2, 3].map(|lane| floats(&answer, lane)[0]);
        assert_eq!([passed[0], passed[2], passed[3]], [1.0, 0.0, 0.0]);
        assert!((passed[1] - 0.3).abs() < 1e-6, "the second texel's weight");
        request.gather = Some(0);
        let gathered = floats(&table.sampled(0, 0, &request), 1);
        assert_eq!(gathered, [0.0, 1.0, 1.0, 0.0]);
    }
}

#[gaurast_runner::test]
fn a_reference_is_clamped_for_unsigned_normalized_depth_only() {
    for (format, expected) in [(Format::D16Unorm, 1.0), (Format::D32Sfloat, 0.0)] {
        let image = image(desc(ImageKind::D2, format, [1, 1, 1]), |_, _, _| [1.0; 4]);
        let sampler = Sampler { compare_op: Some(CompareOp::LessOrEqual), ..Sampler::default() };
        let mut request = request(Dimension::D2, &[[0.5; 4]]);
        request.compare = Some([1.5f32.to_bits(); 16]);
        let answer = table(image, sampler).sampled(0, 0, &request);
        assert_eq!(floats(&answer, 0)[0], expected);
    }
}

#[gaurast_runner::test]
fn borders_have_the_components_of_the_format() {
    let cases = [
        (Format::R8G8B8A8Unorm, [0.25, 0.5, 0.75, 0.125]),
        (Format::B8G8R8A8Unorm, [0.25, 0.5, 0.75, 0.125]),
        (Format::R8G8Unorm, [0.25, 0.5, 0.0, 1.0]),
        (Format::R5G6B5UnormPack16, [0.25, 0.5, 0.75, 1.0]),
        (Format::D32Sfloat, [0.25, 0.0, 0.0, 1.0]),
    ];
    for (format, expected) in cases {
        for filter in [Filter::Nearest, Filter::Linear] {
            let sampler = Sampler {
                address_modes: [AddressMode::ClampToBorder; 3],
                border_color: BorderColor::float([0.25, 0.5, 0.75, 0.125]),
                ..filtered(filter)
            };
            let table = table(image(desc(ImageKind::D2, format, [4, 4, 1]), |_, _, _| [1.0; 4]), sampler);
            let answer = table.sampled(0, 0, &request(Dimension::D2, &[[1.5, 0.5, 0.0, 0.0]]));
            assert_eq!(floats(&answer, 0), expected, "{format:?} {filter:?}");
        }
    }
}

#[gaurast_runner::test]
fn layers_are_rounded_to_even_and_clamped() {
    let desc = ImageDesc { array_layers: 4, ..desc(ImageKind::D2, Format::R32Sfloat, [2, 2, 1]) };
    let image = image(desc, |_, layer, _| [layer as f32, 0.0, 0.0, 1.0]);
    let table = table(image, filtered(Filter::Linear));
    let layers = [-5.0, 0.5, 0.51, 1.5, 2.5, 3.4, 1e30, f32::NAN, f32::NEG_INFINITY];
    let at = layers.map(|layer| [0.5, 0.5, layer, 0.0]);
    let mut request = request(Dimension::D2, &at);
    request.shape.arrayed = true;
    let answer = table.sampled(0, 0, &request);
    let found: [f32; 9] = std::array::from_fn(|lane| floats(&answer, lane)[0]);
    assert_eq!(found, [0.0, 0.0, 1.0, 2.0, 2.0, 3.0, 3.0, 0.0, 0.0]);
}

/// A cube whose texels are a smooth function of the direction.
fn smooth_cube(size: u32) -> SampledImage {
    let desc = ImageDesc { array_layers: 6, ..desc(ImageKind::D2, Format::R32Sfloat, [size, size, 1]) };
    image(desc, |_, face, [x, y, _]| {
        let [s, t] = [x, y].map(|i| (2 * i + 1) as f32 / size as f32 - 1.0);
        let [x, y, z] =
            [[1.0, -t, -s], [-1.0, -t, s], [s, 1.0, t], [s, -1.0, -t], [s, -t, 1.0], [-s, -t, -1.0]][face as usize];
        let length = (x * x + y * y + z * z).sqrt();
        [(0.9 * x + 0.5 * y - 0.7 * z) / length, 0.0, 0.0, 1.0]
    })
}

#[gaurast_runner::test]
fn cubes_are_smooth_across_edges_and_corners() {
    let table = table(smooth_cube(16), filtered(Filter::Linear));
    let mut at = Vec::new();
    for step in 0..=1600 {
        // The path crosses edges and passes near a corner.
        let angle = step as f32 / 1600.0 * std::f32::consts::TAU;
        at.push([angle.cos(), angle.sin(), angle.sin() * 0.97 + 0.01, 0.0]);
    }
    let values: Vec<f32> = at
        .chunks(16)
        .flat_map(|lanes| {
            let answer = table.sampled(0, 0, &request(Dimension::Cube, lanes));
            (0..lanes.len()).map(move |lane| floats(&answer, lane)[0])
        })
        .collect();
    for (pair, direction) in values.windows(2).zip(&at) {
        assert!((pair[0] - pair[1]).abs() < 0.012, "a jump at {direction:?}");
    }
    for (value, [x, y, z, _]) in values.iter().zip(&at) {
        let length = (x * x + y * y + z * z).sqrt();
        let exact = (0.9 * x + 0.5 * y - 0.7 * z) / length;
        assert!((value - exact).abs() < 0.02, "{value} is not {exact}");
    }
}

#[gaurast_runner::test]
fn a_constant_cube_is_constant_everywhere() {
    let desc = ImageDesc { array_layers: 6, ..desc(ImageKind::D2, Format::R8G8B8A8Unorm, [1, 1, 1]) };
    let color = [1.0, 0.2, 0.4, 0.6];
    let table = table(image(desc, |_, _, _| color), filtered(Filter::Linear));
    for x in -3..4 {
        for y in -3..4 {
            for z in -3..4 {
                let direction = [x as f32, y as f32, z as f32, 0.0];
                let answer = table.sampled(0, 0, &request(Dimension::Cube, &[direction]));
                let found = floats(&answer, 0);
                for c in 0..4 {
                    assert!((found[c] - color[c]).abs() < 1e-6, "{direction:?}: {found:?}");
                }
            }
        }
    }
}

#[gaurast_runner::test]
fn srgb_is_decoded_before_it_is_filtered() {
    let image = image(desc(ImageKind::D2, Format::R8G8B8A8Srgb, [2, 1, 1]), |_, _, [x, ..]| [x as f32; 4]);
    let sampler = Sampler { address_modes: [AddressMode::ClampToEdge; 3], ..filtered(Filter::Linear) };
    let answer = table(image, sampler).sampled(0, 0, &request(Dimension::D2, &[[0.5; 4]]));
    assert_eq!(floats(&answer, 0), [0.5; 4]);
}

#[gaurast_runner::test]
fn integers_are_never_mixed() {
    let image = image(desc(ImageKind::D2, Format::R8G8B8A8Sint, [2, 2, 1]), |_, _, [x, y, _]| {
        [-(x as i32) - 1, y as i32, -128, 127].map(|i| f32::from_bits(i as u32))
    });
    let table = table(image, filtered(Filter::Linear));
    let answer = table.sampled(0, 0, &request(Dimension::D2, &[[0.9, 0.6, 0.0, 0.0]]));
    let found = answer.map(|lanes| lanes[0].cast_signed());
    assert_eq!(found, [-2, 1, -128, 127]);
}

#[gaurast_runner::test]
fn unnormalized_coordinates_count_texels() {
    let image = image(desc(ImageKind::D2, Format::R32Sfloat, [5, 3, 1]), |_, _, [x, y, _]| {
        [(x + 10 * y) as f32, 0.0, 0.0, 1.0]
    });
    let sampler = Sampler {
        address_modes: [AddressMode::ClampToEdge; 3],
        unnormalized_coordinates: true,
        ..filtered(Filter::Linear)
    };
    let table = table(image, sampler);
    let at = [[1.5, 1.5, 0.0, 0.0], [2.0, 1.5, 0.0, 0.0], [99.0, -7.0, 0.0, 0.0]];
    let answer = table.sampled(0, 0, &request(Dimension::D2, &at));
    assert_eq!([0, 1, 2].map(|lane| floats(&answer, lane)[0]), [11.0, 11.5, 4.0]);
}

#[gaurast_runner::test]
fn what_is_not_bound_reads_zero() {
    let level = SimdLevel::Best.resolve().unwrap();
    let table = ImageTable::new(level, [ImageBinding::Unbound], [None, Some(Sampler::default())]);
    let request = request(Dimension::D2, &[[0.5; 4]]);
    for (image, sampler) in [(0, 0), (0, 1), (9, 1), (u32::MAX, u32::MAX)] {
        assert_eq!(table.sampled(image, sampler, &request), [[0; 16]; 4]);
        assert_eq!(table.lod(image, sampler, &request), [[0; 16]; 2]);
    }
}
