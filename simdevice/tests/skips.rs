//! Skips: each saves work, and none changes a bit.

mod common;

use common::*;
use simdevice::bindings::Bindings;
use simdevice::counters::{Counter, Counters};
use simdevice::geometry::DrawPipeline;
use simdevice::isa::builder::Builder;
use simdevice::isa::ir::{Program, Rate, Type};
use simdevice::packet::draw::*;
use simdevice::packet::*;
use simdevice::skips::{Skip, Skips};
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
        pipeline: Arc::new(DrawPipeline::new(device, &programs()).unwrap()),
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
    vec![
        triangles(device, &large(0.9), false),
        triangles(device, &large(0.5), true),
        triangles(device, &several, true),
        triangles(device, &large(0.7), true),
    ]
}

/// Few Gaussians, many, and several draws with a clear between them; how the attachment begins.
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
    vec![
        ("few", gaussians(1, 12, OVER), LoadOp::Load),
        ("many", gaussians(2, 5000, OVER), over_black),
        ("several", several.concat(), LoadOp::Load),
        ("nothing", Vec::new(), over_black),
    ]
}

/// Draws a scene, over triangles where the attachment is loaded, on a device of its own; gives colours and depths.
fn draw(skips: Skips, packets: &[Packet], load: LoadOp) -> (Vec<u8>, Counters) {
    let config = Config { skips, ..single() };
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
    let begin = Packet::BeginRendering(Box::new(rendering));
    // A pipeline belongs to its device.
    let triangles = match load {
        LoadOp::Load => all_triangles(&device),
        _ => Vec::new(),
    };
    let all = [begin].into_iter().chain(triangles);
    for packet in all.collect::<Vec<_>>().iter().chain(packets) {
        processor.execute(packet).unwrap();
    }
    processor.execute(&Packet::EndRendering).unwrap();
    let images = [bytes(&target), bytes(&depth)].concat();
    (images, processor.counters().clone())
}

#[test]
fn every_skip_saves_work_and_changes_no_bit() {
    let mut saved = Counters::default();
    for (scene, packets, load) in scenes() {
        let (image, counters) = draw(Skips::ALL, &packets, load);
        saved.add_all(&counters);
        let (other, without) = draw(Skips::NONE, &packets, load);
        assert!(other == image, "{scene}: without any skip");
        for &skip in Skip::ALL {
            assert_eq!(without.get(skip.counter()), 0, "{scene}: {skip:?}");
            for skips in [Skips::ALL.without(skip), Skips::NONE.with(skip)] {
                let (other, counters) = draw(skips, &packets, load);
                assert!(other == image, "{scene}: {skips:?}");
                let count = counters.get(skip.counter());
                assert!(count == 0 || skips.has(skip), "{scene}: {skip:?}");
            }
        }
    }
    for &skip in Skip::ALL {
        assert!(saved.get(skip.counter()) > 0, "{skip:?} saved nothing");
    }
}

#[test]
fn without_skips_everything_is_worked_on() {
    for (scene, packets, load) in scenes() {
        let (_, counters) = draw(Skips::NONE, &packets, load);
        let pairs = counters.get(Counter::TilePairs);
        assert_eq!(counters.get(Counter::TilePairsEvaluated), pairs, "{scene}");
        assert_eq!(
            counters.get(Counter::BlockEvaluations),
            16 * pairs,
            "{scene}"
        );
    }
}
