//! Render passes: the image depends only on the draws, not on how the device schedules them.

use crate::common::*;
use simdevice::format::{Aspect, ClearValue};
use simdevice::packet::*;
use simdevice::runtime::FlushPolicy;
use simdevice::state::{BlendEquation, BlendEquations, BlendFactor, BlendOp, BlendState, Rect};
use simdevice::stats::counters::{Counter, Counters};
use simdevice::stats::query::{QueryKind, QueryPool, QueryResult};
use simdevice::{CommandProcessor, Config, Device, Format, ImageView, Packet};
use std::sync::Arc;

/// Blending that replaces the destination.
const REPLACE: BlendState = BlendState { equations: None, write_mask: 0xF };

/// A texel of an aspect of a layer.
fn texel(view: &ImageView, aspect: Aspect, layer: u32, x: u32, y: u32) -> [f32; 4] {
    let layout = view.image.subresource(aspect, 0, layer).unwrap();
    let mut out = vec![0; layout.format.texel_size()];
    view.image.read_row(&layout, [x, y, 0], &mut out).unwrap();
    layout.format.decode(&out)
}

/// Executes `packets` as one pass on a device of its own.
fn run(config: &Config, rendering: &Rendering, packets: &[Packet]) -> Counters {
    let device = Arc::new(Device::new(config).unwrap());
    let mut processor = CommandProcessor::new(device);
    let begin = Packet::BeginRendering(Box::new(rendering.clone()));
    for packet in [begin].iter().chain(packets).chain([&Packet::EndRendering]) {
        processor.execute(packet).unwrap();
    }
    processor.counters().clone()
}

fn rect(x: i32, y: i32, width: u32, height: u32) -> Rect {
    Rect { x, y, width, height }
}

fn blend(source: BlendFactor, destination: BlendFactor, op: BlendOp, write_mask: u8) -> BlendState {
    let equation = BlendEquation { source, destination, op };
    BlendState { equations: Some(BlendEquations::both(equation)), write_mask }
}

/// Draws and clears of every kind. A barrier may stand between two of the groups of packets.
fn groups() -> Vec<Vec<Packet>> {
    let color = |index, value| AttachmentClear::Color { index, value: ClearValue::Float(value) };
    vec![
        gaussians(1, 60, OVER),
        vec![clear(
            vec![color(0, [0.3, 0.7, 0.1, 0.5]), AttachmentClear::Depth(0.3)],
            &[rect(20, 10, 50, 33), rect(-5, 70, 30, 900)],
        )],
        gaussians(2, 25, blend(BlendFactor::SrcAlpha, BlendFactor::OneMinusDstColor, BlendOp::Add, 0b1011)),
        gaussians(3, 10, blend(BlendFactor::One, BlendFactor::One, BlendOp::ReverseSubtract, 0b0111)),
        vec![clear(vec![color(1, [1.0, 0.0, 0.0, 1.0]), AttachmentClear::Stencil(0x1F7)], &[rect(100, 3, 7, 60)])],
        gaussians(4, 40, OVER),
    ]
}

struct Images {
    color: [ImageView; 2],
    depth_stencil: ImageView,
}

/// Renders `groups` to images of `format`, with barriers after the groups whose bits of `barriers` are set.
fn render(config: &Config, format: Format, load: LoadOp, barriers: u32) -> (Vec<u8>, Counters) {
    let images = Images {
        color: [image(format, 1, 0x45), image(Format::R5G6B5UnormPack16, 1, 0x45)],
        depth_stencil: image(Format::D24UnormS8Uint, 1, 0x45),
    };
    let rendering = Rendering {
        area: rect(3, 2, 140, 90),
        layer_count: 1,
        view_mask: 0,
        color: images.color.iter().map(|view| Some(attachment(view, load))).collect(),
        depth: Some(attachment(&images.depth_stencil, LoadOp::Load)),
        stencil: Some(attachment(
            &images.depth_stencil,
            LoadOp::Clear(ClearValue::DepthStencil { depth: 0.0, stencil: 9 }),
        )),
    };
    let mut packets = Vec::new();
    for (number, group) in groups().into_iter().enumerate() {
        packets.extend(group);
        if barriers >> number & 1 == 1 {
            packets.push(Packet::Barrier);
        }
    }
    let counters = run(config, &rendering, &packets);
    let [first, second] = &images.color;
    let all = [bytes(first), bytes(second), bytes(&images.depth_stencil)].concat();
    (all, counters)
}

const FORMATS: [Format; 6] = [
    Format::R8G8B8A8Unorm,
    Format::B8G8R8A8Srgb,
    Format::R8G8B8A8Snorm,
    Format::R16G16B16A16Sfloat,
    Format::R32G32B32A32Sfloat,
    Format::B10G11R11UfloatPack32,
];
const CLEAR: LoadOp = LoadOp::Clear(ClearValue::Float([0.1, 0.2, 0.3, 1.0]));

#[gaurast_runner::test]
fn flushing_never_changes_a_bit() {
    for format in FORMATS {
        for load in [LoadOp::Load, CLEAR] {
            let (never, _) = render(&single(), format, load, 0);
            let every_draw = Config { flush: FlushPolicy::EveryDraw, ..single() };
            assert!(render(&every_draw, format, load, 0).0 == never, "{format:?} {load:?}");
            let no_budget = Config { bin_budget_bytes: 0, ..single() };
            assert!(render(&no_budget, format, load, 0).0 == never, "{format:?} {load:?}");
            for barriers in [0b1, 0b10010, 0b100100, 0b11011] {
                let some = render(&single(), format, load, barriers).0;
                assert!(some == never, "{format:?} {load:?} {barriers:#b}");
            }
        }
    }
}

#[gaurast_runner::test]
fn the_size_of_a_macro_tile_never_changes_a_bit() {
    for format in FORMATS {
        for load in [LoadOp::Load, CLEAR] {
            let (usual, _) = render(&single(), format, load, 0);
            for macro_tile_size in [16, 48, 128] {
                let config = Config { macro_tile_size, ..single() };
                let other = render(&config, format, load, 0b100).0;
                assert!(other == usual, "{format:?} {load:?} {macro_tile_size}");
            }
        }
    }
}

#[gaurast_runner::test]
fn the_number_of_threads_never_changes_a_bit_or_a_count() {
    let work = |counters: &Counters| {
        [Counter::TilePairs, Counter::TilePairsEvaluated, Counter::BlockEvaluations, Counter::PixelContributions]
            .map(|counter| counters.get(counter))
    };
    let (image, counters) = render(&single(), Format::R8G8B8A8Unorm, LoadOp::Load, 0);
    assert!(work(&counters).iter().all(|&count| count > 0));
    for threads in [2, 5] {
        for macro_tile_size in [16, 64] {
            let config = Config { threads, macro_tile_size, ..Config::default() };
            let (other, counted) = render(&config, Format::R8G8B8A8Unorm, LoadOp::Load, 0);
            assert!(other == image, "{threads} threads");
            assert_eq!(work(&counted), work(&counters));
        }
    }
}

/// The fragments of a draw, from a floating-point attachment; `None` where it covers no pixel.
fn fragments(draw: &[Packet]) -> Vec<Option<[f32; 4]>> {
    let view = image(Format::R32G32B32A32Sfloat, 1, 0);
    let uncovered = [-1.0; 4];
    let load = LoadOp::Clear(ClearValue::Float(uncovered));
    run(&single(), &rendering(attachment(&view, load)), draw);
    (0..HEIGHT)
        .flat_map(|y| (0..WIDTH).map(move |x| (x, y)))
        .map(|(x, y)| texel(&view, Aspect::Color, 0, x, y))
        .map(|texel| (texel != uncovered).then_some(texel))
        .collect()
}

#[gaurast_runner::test]
fn attachments_are_quantised_after_every_draw() {
    let draws = [(1, 60), (2, 80), (5, 70)];
    for format in [Format::R8G8B8A8Unorm, Format::R8G8B8A8Srgb, Format::R16G16B16A16Sfloat] {
        let background = [0.2, 0.4, 0.6, 1.0];
        let view = image(format, 1, 0);
        let load = LoadOp::Clear(ClearValue::Float(background));
        let packets: Vec<Packet> = draws.iter().flat_map(|&(seed, count)| gaussians(seed, count, OVER)).collect();
        run(&single(), &rendering(attachment(&view, load)), &packets);

        let is_normalised = format != Format::R16G16B16A16Sfloat;
        let over = |source: [f32; 4], destination: [f32; 4]| {
            let [s, d] =
                [source, destination].map(|color| color.map(|it| if is_normalised { it.clamp(0.0, 1.0) } else { it }));
            std::array::from_fn(|component| s[component] + d[component] * (1.0 - s[3]))
        };
        let quantize = |texel: [f32; 4]| format.decode(&format.encode(texel));
        let background = quantize(background);
        let mut expected = vec![background; (WIDTH * HEIGHT) as usize];
        let mut once = expected.clone();
        for (seed, count) in draws {
            let fragments = fragments(&gaussians(seed, count, REPLACE));
            assert!(fragments.iter().any(Option::is_some));
            for ((texel, once), fragment) in expected.iter_mut().zip(&mut once).zip(fragments) {
                if let Some(source) = fragment {
                    *texel = quantize(over(source, *texel));
                    *once = over(source, *once);
                }
            }
        }
        let drawn: Vec<_> = (0..HEIGHT)
            .flat_map(|y| (0..WIDTH).map(move |x| (x, y)))
            .map(|(x, y)| texel(&view, Aspect::Color, 0, x, y))
            .collect();
        assert!(drawn == expected, "{format:?}");
        let once: Vec<_> = once.into_iter().map(quantize).collect();
        assert!(drawn != once, "the scene tells the two apart");
    }
}

#[gaurast_runner::test]
fn a_clear_at_the_beginning_fills_the_area_and_nothing_else() {
    let view = image(Format::R8G8B8A8Unorm, 1, 0x11);
    let mut pass = rendering(attachment(&view, CLEAR));
    pass.area = rect(17, 5, 70, 40);
    run(&single(), &pass, &[]);
    let cleared = [26.0, 51.0, 76.0, 255.0].map(|code: f32| code / 255.0);
    for (x, y) in [(17, 5), (86, 5), (17, 44), (86, 44), (50, 20)] {
        let close = texel(&view, Aspect::Color, 0, x, y).iter().zip(cleared).all(|(a, b)| (a - b).abs() < 0.004);
        assert!(close, "({x}, {y})");
    }
    for (x, y) in [(16, 5), (87, 5), (17, 4), (17, 45), (0, 0), (149, 82)] {
        let kept = [17.0 / 255.0; 4];
        assert_eq!(texel(&view, Aspect::Color, 0, x, y), kept, "({x}, {y})");
    }
}

#[gaurast_runner::test]
fn what_no_draw_touches_keeps_its_bytes() {
    // A signalling NaN and the second code of -1 would not survive a conversion.
    for (format, byte) in [(Format::R16G16B16A16Sfloat, 0x7C), (Format::R8G8B8A8Snorm, 0x80)] {
        let view = image(format, 1, byte);
        let before = bytes(&view);
        let generation = view.image.memory.generation();
        let pass = rendering(attachment(&view, LoadOp::Load));
        run(&single(), &pass, &[]);
        assert!(bytes(&view) == before);
        assert_eq!(view.image.memory.generation(), generation);
        let mut packets = gaussians(1, 0, OVER);
        packets.push(clear(
            vec![AttachmentClear::Color { index: 0, value: ClearValue::Float([1.0; 4]) }],
            &[rect(33, 20, 2, 2)],
        ));
        run(&single(), &pass, &packets);
        let after = bytes(&view);
        let texel_size = format.texel_size();
        let pitch = view.image.subresource(Aspect::Color, 0, 0).unwrap().row_pitch as usize;
        for (at, (before, after)) in before.iter().zip(&after).enumerate() {
            let (x, y) = (at % pitch / texel_size, at / pitch);
            let in_tile = (32..48).contains(&x) && (16..32).contains(&y);
            assert!(in_tile || before == after, "({x}, {y})");
        }
        assert!(before != after);
        assert_ne!(view.image.memory.generation(), generation);
    }
}

#[gaurast_runner::test]
fn only_what_is_to_be_stored_is_stored_at_the_end() {
    for store in [StoreOp::DontCare, StoreOp::None] {
        for load in [CLEAR, LoadOp::Load, LoadOp::DontCare] {
            let view = image(Format::R8G8B8A8Unorm, 1, 0x11);
            let before = bytes(&view);
            let mut color = attachment(&view, load);
            color.store = store;
            run(&single(), &rendering(color), &gaussians(1, 50, OVER));
            assert!(bytes(&view) == before, "{store:?} {load:?}");
        }
    }
}

#[gaurast_runner::test]
fn clears_reach_the_layers_and_attachments_that_they_name() {
    let color = image(Format::R8G8B8A8Uint, 3, 1);
    let depth = image(Format::D32SfloatS8Uint, 3, 0);
    let pass = Rendering {
        area: EVERYTHING,
        layer_count: 3,
        view_mask: 0,
        color: vec![None, Some(attachment(&color, LoadOp::Load))],
        depth: Some(attachment(&depth, LoadOp::Clear(ClearValue::DepthStencil { depth: 1.0, stencil: 0 }))),
        stencil: None,
    };
    let value = ClearValue::Uint([300, 2, 3, 4]);
    let packet = Packet::ClearAttachments(ClearAttachments {
        clears: vec![
            AttachmentClear::Color { index: 1, value },
            AttachmentClear::Color { index: 0, value },
            AttachmentClear::Color { index: usize::MAX, value },
            AttachmentClear::Depth(0.25),
            AttachmentClear::Stencil(7),
        ],
        rects: vec![(rect(10, 10, 5, 5), 1, u32::MAX), (rect(0, 0, 1, 1), u32::MAX, 5)],
    });
    run(&single(), &pass, &[packet]);
    let color = |layer, x| texel(&color, Aspect::Color, layer, x, 12).map(f32::to_bits);
    assert_eq!([color(0, 12), color(1, 9), color(2, 15)], [[1; 4]; 3]);
    assert_eq!([color(1, 12), color(2, 14)], [[255, 2, 3, 4]; 2]);
    let at = |layer, x| texel(&depth, Aspect::Depth, layer, x, 12)[0];
    assert_eq!([at(0, 12), at(1, 12), at(2, 14), at(2, 15)], [1.0, 0.25, 0.25, 1.0]);
    let stencil = texel(&depth, Aspect::Stencil, 1, 12, 12)[0];
    assert_eq!(stencil.to_bits(), 0, "the pass has no stencil attachment");
}

#[gaurast_runner::test]
fn integer_attachments_take_no_colour_and_masked_ones_none_either() {
    for (format, blend) in [(Format::R8G8B8A8Uint, OVER), (Format::R8G8B8A8Unorm, BlendState { write_mask: 0, ..OVER })]
    {
        let view = image(format, 1, 0x80);
        let before = bytes(&view);
        let pass = rendering(attachment(&view, LoadOp::Load));
        run(&single(), &pass, &gaussians(1, 50, blend));
        assert!(bytes(&view) == before);
    }
}

#[gaurast_runner::test]
fn hostile_areas_and_rectangles_do_no_harm() {
    let extremes = [i32::MIN, -1, 0, 149, i32::MAX];
    let sizes = [0, 1, u32::MAX];
    for x in extremes {
        for width in sizes {
            let hostile = rect(x, x, width, width);
            let view = image(Format::R8G8B8A8Unorm, 1, 0);
            let mut pass = rendering(attachment(&view, CLEAR));
            pass.layer_count = u32::MAX;
            let value = ClearValue::Float([1.0; 4]);
            let packets = [clear(vec![AttachmentClear::Color { index: 0, value }], &[hostile])];
            run(&single(), &pass, &packets);
            pass.area = hostile;
            pass.layer_count = 0;
            run(&single(), &pass, &gaussians(1, 5, OVER));
            pass.color.clear();
            run(&single(), &pass, &gaussians(1, 5, OVER));
        }
    }
}

#[gaurast_runner::test]
fn a_query_inside_a_pass_counts_what_was_drawn_in_it() {
    let view = image(Format::R8G8B8A8Unorm, 1, 0);
    let pool = Arc::new(QueryPool::new(QueryKind::Performance, 1));
    let query = |begin: bool| {
        let (pool, index) = (pool.clone(), 0);
        if begin { Packet::BeginQuery { pool, index } } else { Packet::EndQuery { pool, index } }
    };
    let packets = [gaussians(1, 30, OVER), vec![query(true)], gaussians(2, 20, OVER), vec![query(false)]];
    let pass = rendering(attachment(&view, LoadOp::Load));
    let whole = run(&single(), &pass, &packets.concat());
    let Some(QueryResult::Performance(part)) = pool.result(0) else {
        panic!("the query ended");
    };
    assert_eq!(part.get(Counter::GaussiansRead), 20);
    assert!(part.get(Counter::PixelContributions) > 0);
    assert!(part.get(Counter::PixelContributions) < whole.get(Counter::PixelContributions));
    assert!(whole.get(Counter::RasterTime) > 0);
}
