//! Optimizations: each saves work, and none changes a bit.
//!
//! Every scene is drawn twice to a target, since some of what is saved is prepared by the first time.

mod degrees;
mod hidden;
mod unchanged;

use crate::common::*;
use simdevice::format::ClearValue;
use simdevice::isa::builder::Builder;
use simdevice::isa::ir::{Program, Rate, Type};
use simdevice::packet::*;
use simdevice::program::bindings::Bindings;
use simdevice::program::interface::{
    DrawPrograms, FragmentInput, FragmentOutput, FragmentPrograms, Interpolation, Sampling,
    VertexInput, VertexOutput,
};
use simdevice::program::vertex::DrawPipeline;
use simdevice::state::gaussian::{
    Camera, CameraModel, GaussianGeometry, GaussianLinearization, GaussianOrder, GaussianPrecision,
    GaussianState,
};
use simdevice::state::{CompareOp, DepthTest, DrawState, Rect, Topology};
use simdevice::stats::counters::{Counter, Counters};
use simdevice::stats::optimizations::{Optimization, Optimizations};
use simdevice::{Allocation, CommandProcessor, Config, Device, Format, Packet};
use std::sync::Arc;

/// Passes scalars on.
fn pass_on(count: u32) -> Program {
    let mut b = Builder::new();
    for slot in 0..count {
        let input = b.input(slot, Type::B32, Rate::Varying);
        let output = b.output(slot, Type::B32);
        b.assign(output, input);
    }
    b.finish().unwrap()
}

fn programs() -> DrawPrograms {
    let attribute =
        |stream| (0..4).map(move |component| Some(VertexInput::Attribute { stream, component }));
    let position = (0..4).map(|component| Some(VertexOutput::Position(component)));
    let varyings = (0..4).map(|index| Some(VertexOutput::Varying(index)));
    let inputs = (0..4).map(|index| {
        Some(FragmentInput::Varying {
            index,
            interpolation: Interpolation::Perspective,
            sampling: Sampling::Center,
        })
    });
    let outputs = (0..4).map(|component| {
        Some(FragmentOutput::Color {
            attachment: 0,
            component,
            index: 0,
        })
    });
    DrawPrograms {
        vertex: pass_on(8),
        vertex_inputs: attribute(0).chain(attribute(1)).collect(),
        vertex_outputs: position.chain(varyings).collect(),
        varyings: 4,
        fragment: Some(FragmentPrograms {
            program: pass_on(4),
            inputs: inputs.collect(),
            outputs: outputs.collect(),
            early_tests: false,
            discards: false,
            per_sample: false,
            has_side_effects: false,
        }),
    }
}

/// A draw of triangles, given by corners in clip space, that are tested for being nearer or not at all.
fn triangles(device: &Device, corners: &[[f32; 4]], tested: bool) -> Packet {
    let vertices: Vec<[f32; 8]> = corners
        .iter()
        .map(|&[x, y, z, w]| [x, y, z, w, 0.5 + 0.4 * x, 0.5 + 0.4 * y, z, 0.7])
        .collect();
    let size = size_of_val(&vertices[..]) as u64;
    let memory = Allocation::new_zeroed(size).unwrap();
    memory.write(0, vertices.as_flattened()).unwrap();
    let stream = |offset| AttributeStream {
        buffer: BufferRange {
            memory: memory.clone(),
            offset: 0,
            size,
        },
        stride: 32,
        offset,
        format: Format::R32G32B32A32Sfloat,
        instance_divisor: None,
    };
    let mut state = DrawState::new(Topology::TriangleList, [WIDTH, HEIGHT]);
    state.depth_stencil.depth = tested.then_some(DepthTest {
        compare: CompareOp::Less,
        write: true,
    });
    Packet::Draw(Box::new(Draw {
        pipeline: Arc::new(DrawPipeline::new(device.level(), &programs()).unwrap()),
        state: Arc::new(state),
        attributes: vec![stream(0), stream(16)],
        vertex_bindings: Bindings::default(),
        fragment_bindings: Bindings::default(),
        indices: None,
        first: 0,
        count: corners.len() as u32,
        first_instance: 0,
        instance_count: 1,
        draw_index: 0,
    }))
}

/// A triangle over half of the framebuffer and more, at a depth.
fn large(z: f32) -> [[f32; 4]; 3] {
    [
        [-1.0, -1.0, z, 1.0],
        [1.5, -1.0, z, 1.0],
        [-1.0, 1.5, z, 1.0],
    ]
}

/// Large triangles, one of them hidden, and small ones, some in perspective.
fn all_triangles(device: &Device) -> Vec<Packet> {
    let small = |number: u32| {
        let at = |by: u32| (number * by % 97) as f32 / 50.0 - 0.95;
        let (x, y, z) = (at(31), at(57), 0.1 + 0.008 * (number % 89) as f32);
        let w = 1.0 + (number % 3) as f32;
        [
            [x, y, z, 1.0],
            [x + 0.1, y, z, 1.0],
            [x * w, (y + 0.2) * w, z * w, w],
        ]
    };
    let several: Vec<[f32; 4]> = (0..200).flat_map(small).collect();
    // Each overwrites the one before it, as a whole or where it is nearer, with small ones between them.
    let mut layers = Vec::new();
    for layer in 0..12 {
        let z = [0.97, 0.95, 0.99, 0.93][layer % 4] - 0.01 * (layer / 4) as f32;
        layers.extend(large(z));
        if layer % 3 == 1 {
            layers.extend((0..5).flat_map(|number| small(9 * layer as u32 + number)));
        }
    }
    // Where it begins before the others and where it ends behind them.
    let slanted = [
        [-1.0, -1.0, 0.2, 1.0],
        [1.5, -1.0, 0.99, 1.0],
        [-1.0, 1.5, 0.99, 1.0],
    ];
    vec![
        triangles(device, &large(0.9), false),
        triangles(device, &layers, false),
        triangles(
            device,
            &[&layers[..], &slanted[..], &layers[..]].concat(),
            true,
        ),
        triangles(device, &large(0.5), true),
        triangles(device, &several, true),
        triangles(device, &large(0.7), true),
    ]
}

/// Gaussians in memory that only the device writes, most of them beside the scissor.
fn mostly_beside(seed: u64, count: u32) -> Vec<Packet> {
    let mut packets = gaussians_in(false, seed, count, OVER);
    if let Packet::GaussianBegin(begin) = &mut packets[0] {
        begin.scissor = Rect {
            x: 0,
            y: 0,
            width: 35,
            height: 40,
        };
    }
    packets
}

/// Gaussians that only the device can write, in a set that begins otherwise.
fn changed(seed: u64, change: impl FnOnce(&mut GaussianBegin)) -> Vec<Packet> {
    let mut packets = gaussians_in(false, seed, 2000, OVER);
    if let Packet::GaussianBegin(begin) = &mut packets[0] {
        change(begin);
    }
    packets
}

/// Three instances of Gaussians, each placed by a matrix and fainter than the one before.
fn placed() -> Vec<Packet> {
    let mut packets = changed(10, |_| {});
    let matrix = |number: f32| {
        let turn = 0.3 * number;
        [
            [turn.cos(), -turn.sin(), 0.0, 0.8 * number],
            [turn.sin(), turn.cos(), 0.2, -0.3 * number],
            [0.0, 0.1, 1.0 - 0.2 * number, 0.4],
            [1.0 - 0.3 * number; 4],
        ]
    };
    let elements = [0.0, 1.0, 2.0].map(matrix);
    let size = size_of_val(&elements) as u64;
    let memory = Allocation::new_zeroed(size).unwrap();
    memory
        .write(0, elements.as_flattened().as_flattened())
        .unwrap();
    let stream = |row: u32| AttributeStream {
        buffer: BufferRange {
            memory: memory.clone(),
            offset: 0,
            size,
        },
        stride: 64,
        offset: 16 * row,
        format: Format::R32G32B32A32Sfloat,
        instance_divisor: Some(1),
    };
    if let Packet::GaussianAppend(append) = &mut packets[1] {
        append.instance_count = 3;
        append.attributes.model = ModelAttributes {
            matrix: Some(Box::new([stream(0), stream(1), stream(2)])),
            opacity: Some(stream(3)),
        };
    }
    packets
}

/// Small Gaussians in another mode, most of them beside the scissor.
fn mode_beside(seed: u64, change: fn(&mut GaussianBegin)) -> Vec<Packet> {
    let mut packets = mostly_beside(seed, 3000);
    if let Packet::GaussianBegin(begin) = &mut packets[0] {
        begin.camera.eye[0] = -0.8;
        change(begin);
    }
    shrink(&packets[1]);
    packets
}

/// Makes the Gaussians of an append a fifth as large.
fn shrink(append: &Packet) {
    let Packet::GaussianAppend(append) = append else {
        panic!("what follows the beginning of a set");
    };
    let stream = &append.attributes.scale;
    for vertex in 0..append.count {
        let at = u64::from(vertex * stream.stride + stream.offset);
        let mut scale = [0.0f32; 3];
        stream.buffer.memory.read(at, &mut scale).unwrap();
        let scale = scale.map(|scale| 0.2 * scale);
        stream.buffer.memory.write(at, &scale).unwrap();
    }
}

/// Modes that are bounded by other means than volumes in binary32 before a pinhole, with one of the ways in which those are
/// drawn to compare with.
fn bounded_modes() -> Vec<(&'static str, Vec<Packet>)> {
    fn state(begin: &mut GaussianBegin) -> &mut GaussianState {
        Arc::make_mut(&mut begin.state)
    }
    fn parallel(begin: &mut GaussianBegin) {
        begin.camera.model = CameraModel::Orthographic;
        begin.camera.focal_length = [30.0; 2];
    }
    let mut placed = placed();
    shrink(&placed[1]);
    if let Packet::GaussianBegin(begin) = &mut placed[0] {
        begin.scissor = Rect {
            x: 0,
            y: 0,
            width: 35,
            height: 40,
        };
    }
    let modes: [(&str, Change); 7] = [
        ("volumes", |_| {}),
        ("flat", |begin| {
            state(begin).geometry = GaussianGeometry::Surfel;
        }),
        ("flat, orthographic", |begin| {
            parallel(begin);
            state(begin).geometry = GaussianGeometry::Surfel;
        }),
        ("binary16", |begin| {
            state(begin).precision = GaussianPrecision::Float16;
        }),
        ("binary16, orthographic", |begin| {
            parallel(begin);
            state(begin).precision = GaussianPrecision::Float16;
        }),
        ("unscented", |begin| {
            state(begin).linearization = GaussianLinearization::Unscented;
            // The farther off, the smaller.
            begin.camera.eye[2] = -6.0;
        }),
        ("unscented, orthographic", |begin| {
            parallel(begin);
            state(begin).linearization = GaussianLinearization::Unscented;
        }),
    ];
    let modes = modes.into_iter().zip(20..);
    let modes = modes.map(|((name, change), seed)| (name, mode_beside(seed, change)));
    modes.chain([("placed", placed)]).collect()
}

/// Makes a set's state or camera another mode's.
type Change = fn(&mut GaussianBegin);

#[gaurast_runner::test]
fn every_mode_has_bounds_that_change_no_bit() {
    let over_black = LoadOp::Clear(ClearValue::Float([0.0, 0.0, 0.0, 1.0]));
    for (mode, packets) in bounded_modes() {
        let (without, _) = draw(Optimizations::NONE, &packets, over_black);
        let saved = |optimizations, counter| {
            let (image, counters) = draw(optimizations, &packets, over_black);
            assert!(image == without, "{mode}");
            counters.get(counter)
        };
        let chunks = Optimizations::ALL.without(Optimization::Bounds);
        let by_chunks = saved(chunks, Counter::OutsideByClusters);
        let bounds = Optimizations::ALL.without(Optimization::ClusterCulling);
        let by_bounds = saved(bounds, Counter::OutsideByBounds);
        assert!(by_chunks > 0, "{mode}: no chunk is beside the picture");
        assert!(by_bounds > 2 * by_chunks, "{mode}: {by_bounds} {by_chunks}");
    }
}

/// Gaussians in modes that have no fast path, few Gaussians, many, many that only the device can write, of which all are equally deep in one scene, and several draws with a clear between them; how the attachment begins.
fn scenes() -> Vec<(&'static str, Vec<Packet>, LoadOp)> {
    let clear_part = clear(
        vec![AttachmentClear::Color {
            index: 0,
            value: ClearValue::Float([0.4, 0.1, 0.9, 0.5]),
        }],
        &[Rect {
            x: 30,
            y: 20,
            width: 40,
            height: 40,
        }],
    );
    let over_black = LoadOp::Clear(ClearValue::Float([0.0, 0.0, 0.0, 1.0]));
    let several = [
        gaussians(3, 20, OVER),
        vec![clear_part],
        gaussians(4, 300, OVER),
    ];
    let mut ties = gaussians_in(false, 6, 3000, OVER);
    if let Packet::GaussianBegin(begin) = &mut ties[0] {
        begin.state = Arc::new(GaussianState {
            order: GaussianOrder::Primitive,
            ..(*begin.state).clone()
        });
    }
    let panorama = changed(8, |begin| {
        begin.camera = Camera {
            model: CameraModel::Equirectangular,
            eye: [0.1, 0.2, 3.5],
            focal_length: [WIDTH as f32 / std::f32::consts::TAU, 24.0],
            ..begin.camera
        };
    });
    let unscented = changed(9, |begin| {
        begin.state = Arc::new(GaussianState {
            linearization: GaussianLinearization::Unscented,
            ..(*begin.state).clone()
        });
    });
    let in_mode = |seed: u64, change: fn(&mut GaussianState)| {
        let mut packets = gaussians(seed, 500, OVER);
        if let Packet::GaussianBegin(begin) = &mut packets[0] {
            change(Arc::make_mut(&mut begin.state));
        }
        packets
    };
    let per_pixel = in_mode(8, |state| state.order = GaussianOrder::PerPixel);
    let flat = in_mode(9, |state| state.geometry = GaussianGeometry::Surfel);
    let half = in_mode(10, |state| state.precision = GaussianPrecision::Float16);
    vec![
        ("per pixel", per_pixel, LoadOp::Load),
        ("flat", flat, over_black),
        ("binary16", half, over_black),
        ("panorama", panorama, over_black),
        ("unscented", unscented, LoadOp::Load),
        ("placed", placed(), over_black),
        ("few", gaussians(1, 12, OVER), LoadOp::Load),
        ("many", gaussians(2, 5000, OVER), over_black),
        ("clusters", mostly_beside(5, 6000), over_black),
        ("behind a wall", hidden::walled(11, 1.3, 0.99), over_black),
        (
            "behind half a wall",
            hidden::walled(12, 0.0, 0.9),
            LoadOp::Load,
        ),
        ("bands", unchanged::with_bands_of_zeros(), over_black),
        ("alone", gaussians_in(false, 13, 300, OVER), over_black),
        ("ties", ties, LoadOp::Load),
        ("several", several.concat(), LoadOp::Load),
        ("nothing", Vec::new(), over_black),
    ]
}

/// Draws a scene twice, over triangles where the attachment is loaded, on a device of its own; gives colours and depths.
fn draw(optimizations: Optimizations, packets: &[Packet], load: LoadOp) -> (Vec<u8>, Counters) {
    let config = Config {
        optimizations,
        ..single()
    };
    let target = image(Format::R32G32B32A32Sfloat, 1, 0x3E);
    let depth = image(Format::D32Sfloat, 1, 0);
    let device = Arc::new(Device::new(&config).unwrap());
    let mut processor = CommandProcessor::new(Arc::clone(&device));
    let mut rendering = rendering(attachment(&target, load));
    let far = ClearValue::DepthStencil {
        depth: 1.0,
        stencil: 0,
    };
    rendering.depth = Some(attachment(&depth, LoadOp::Clear(far)));
    // A pipeline belongs to its device.
    let triangles = match load {
        LoadOp::Load => all_triangles(&device),
        _ => Vec::new(),
    };
    let begin = [Packet::BeginRendering(Box::new(rendering))];
    for _ in 0..2 {
        let all = begin.iter().chain(&triangles).chain(packets);
        for packet in all.chain([&Packet::EndRendering]) {
            processor.execute(packet).unwrap();
        }
    }
    let images = [bytes(&target), bytes(&depth)].concat();
    (images, processor.counters().clone())
}

/// Draws a scene over black, in a pass of its own; gives what that counted. The picture is that of a device without optimizations.
fn draw_as_without_skips(processor: &mut CommandProcessor, packets: &[Packet]) -> Counters {
    let over_black = LoadOp::Clear(ClearValue::Float([0.0, 0.0, 0.0, 1.0]));
    let before = processor.counters().clone();
    let target = image(Format::R32G32B32A32Sfloat, 1, 0x3E);
    let rendering = rendering(attachment(&target, over_black));
    let begin = [Packet::BeginRendering(Box::new(rendering))];
    for packet in begin.iter().chain(packets).chain([&Packet::EndRendering]) {
        processor.execute(packet).unwrap();
    }
    // Depths are not among what is drawn here.
    let (expected, _) = draw(Optimizations::NONE, packets, over_black);
    assert!(bytes(&target) == expected[..bytes(&target).len()]);
    processor.counters().since(&before)
}

#[gaurast_runner::test]
fn every_skip_saves_work() {
    let mut saved = Counters::default();
    for (_, packets, load) in scenes() {
        saved.add_all(&draw(Optimizations::ALL, &packets, load).1);
    }
    for &optimization in Optimization::ALL {
        assert!(
            saved.get(optimization.counter()) > 0,
            "{optimization:?} saved nothing"
        );
    }
}

#[gaurast_runner::test(each = gaurast_runner::shards(4))]
fn no_skip_changes_a_bit(case: &gaurast_runner::Case) {
    let all = scenes().into_iter().enumerate();
    for (_, (scene, packets, load)) in all.filter(|(number, _)| case.shard().has(*number)) {
        let (image, _) = draw(Optimizations::ALL, &packets, load);
        let (other, without) = draw(Optimizations::NONE, &packets, load);
        assert!(other == image, "{scene}: without any optimization");
        for &optimization in Optimization::ALL {
            assert_eq!(
                without.get(optimization.counter()),
                0,
                "{scene}: {optimization:?}"
            );
            for optimizations in [
                Optimizations::ALL.without(optimization),
                Optimizations::NONE.with(optimization),
            ] {
                let (other, counters) = draw(optimizations, &packets, load);
                assert!(other == image, "{scene}: {optimizations:?}");
                let count = counters.get(optimization.counter());
                assert!(
                    count == 0 || optimizations.has(optimization),
                    "{scene}: {optimization:?}"
                );
            }
        }
    }
}

#[gaurast_runner::test]
fn without_skips_everything_is_worked_on() {
    for (scene, packets, load) in scenes() {
        let (_, counters) = draw(Optimizations::NONE, &packets, load);
        let pairs = counters.get(Counter::TilePairs);
        assert_eq!(counters.get(Counter::TilePairsEvaluated), pairs, "{scene}");
        assert_eq!(
            counters.get(Counter::BlockEvaluations),
            16 * pairs,
            "{scene}"
        );
    }
}

/// What a device counts in each of four passes that draw the same, between which `change` is called with the pass's number
/// and the device's memory; all images are those of a device without chunks.
fn draw_again(config: &Config, change: impl Fn(usize, &Allocation)) -> Vec<Counters> {
    let packets = mostly_beside(7, 20_000);
    let Packet::GaussianAppend(append) = &packets[1] else {
        panic!("a set begins, is filled and is resolved");
    };
    let memory = &append.attributes.position.buffer.memory;
    let target = image(Format::R32G32B32A32Sfloat, 1, 0);
    let clear = LoadOp::Clear(ClearValue::Float([0.0; 4]));
    let begin = [Packet::BeginRendering(Box::new(rendering(attachment(
        &target, clear,
    ))))];
    let mut processor = CommandProcessor::new(Arc::new(Device::new(config).unwrap()));
    let passes = (0..4).map(|pass| {
        let before = processor.counters().clone();
        for packet in begin.iter().chain(&packets).chain([&Packet::EndRendering]) {
            processor.execute(packet).unwrap();
        }
        let plain = Config {
            optimizations: Optimizations::ALL.without(Optimization::ClusterCulling),
            ..single()
        };
        let drawn = bytes(&target);
        let mut other = CommandProcessor::new(Arc::new(Device::new(&plain).unwrap()));
        for packet in begin.iter().chain(&packets).chain([&Packet::EndRendering]) {
            other.execute(packet).unwrap();
        }
        assert!(bytes(&target) == drawn, "pass {pass}");
        change(pass, memory);
        processor.counters().since(&before)
    });
    passes.collect()
}

fn chunks_built(passes: &[Counters]) -> Vec<u64> {
    let built = passes.iter().map(|pass| pass.get(Counter::ClustersBuilt));
    built.collect()
}

#[gaurast_runner::test]
fn chunks_are_made_once() {
    let passes = draw_again(&single(), |_, _| {});
    assert_eq!(chunks_built(&passes), [0, 79, 0, 0]);
    let left_out = |pass: &Counters| pass.get(Counter::OutsideByClusters);
    assert_eq!(left_out(&passes[0]), 0);
    assert!(left_out(&passes[3]) > 0);
    for pass in &passes {
        assert_eq!(pass.get(Counter::GaussiansRead), 20_000);
        let drawn = pass.get(Counter::GaussiansDrawn);
        assert_eq!(drawn, passes[0].get(Counter::GaussiansDrawn));
    }
}

#[gaurast_runner::test]
fn chunks_are_made_anew_when_the_memory_was_written() {
    let far = [0.0f32, 0.0, 1e3];
    let passes = draw_again(&single(), |pass, memory| {
        if pass == 1 {
            memory.write(0, &far).unwrap();
            memory.bump_generation();
        }
    });
    assert_eq!(chunks_built(&passes), [0, 79, 0, 79]);
}

#[gaurast_runner::test]
fn chunks_stay_within_their_budget() {
    let config = Config {
        cluster_budget_bytes: 100_000,
        ..single()
    };
    assert_eq!(chunks_built(&draw_again(&config, |_, _| {})), [0; 4]);
}
