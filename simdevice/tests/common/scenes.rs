//! Scenes whose work is traced: triangles, Gaussians, both in one pass, and dispatches before them.

use super::common::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use simdevice::format::ClearValue;
use simdevice::isa::builder::Builder;
use simdevice::isa::ir::{Program, Rate, Type};
use simdevice::isa::op::Op;
use simdevice::packet::Dispatch;
use simdevice::packet::*;
use simdevice::program::bindings::Bindings;
use simdevice::program::compute::ComputeProgram;
use simdevice::program::fragment::GaussianFragmentProgram;
use simdevice::program::interface::{
    DrawPrograms, FragmentInput, FragmentOutput, FragmentPrograms, Interpolation, Sampling, VertexInput, VertexOutput,
    gaussian, resolve,
};
use simdevice::program::vertex::DrawPipeline;
use simdevice::state::gaussian::GaussianState;
use simdevice::state::{CompareOp, DepthStencil, DepthTest, DrawState, Topology};
use simdevice::stats::recorder::Recorder;
use simdevice::{Allocation, BufferRange, CommandProcessor, Config, Device, Format, Packet};
use std::sync::Arc;

/// The kind of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Triangles,
    Gaussians,
    /// Triangles, Gaussians, and triangles again, in one pass.
    Mixed,
    /// Triangles, and Gaussians, some of which the triangles hide.
    Hidden,
    /// Gaussians with a vertex program and a fragment program.
    Shaded,
    /// Dispatches only.
    Dispatches,
}

/// Every kind, with its name in file names.
pub const KINDS: [(Kind, &str); 6] = [
    (Kind::Triangles, "triangles"),
    (Kind::Gaussians, "gaussians"),
    (Kind::Mixed, "mixed"),
    (Kind::Hidden, "hidden"),
    (Kind::Shaded, "shaded"),
    (Kind::Dispatches, "dispatches"),
];

/// The configuration of a recording device, and its recorder.
pub fn recording() -> (Config, Arc<Recorder>) {
    let recorder = Arc::new(Recorder::default());
    let config = Config { recorder: Some(Arc::clone(&recorder)), ..Config::default() };
    (config, recorder)
}

/// Draws a scene in two frames, with `around` packets before and after all of it. Returns the colour attachment's
/// bytes.
pub fn draw(kind: Kind, config: &Config, around: [&[Packet]; 2]) -> Vec<u8> {
    draw_on(&Arc::new(Device::new(config).unwrap()), kind, around)
}

/// As [`draw`], on a device that others may draw on at the same time.
pub fn draw_on(device: &Arc<Device>, kind: Kind, around: [&[Packet]; 2]) -> Vec<u8> {
    let color = image(Format::R8G8B8A8Unorm, 1, 0);
    let depth = image(Format::D32Sfloat, 1, 0);
    let mut processor = CommandProcessor::new(Arc::clone(device));
    let mut packets = around[0].to_vec();
    for frame in 0..2 {
        if matches!(kind, Kind::Mixed | Kind::Dispatches) {
            packets.push(dispatch(device));
        }
        if kind == Kind::Dispatches {
            continue;
        }
        let clear = |value| LoadOp::Clear(value);
        packets.push(Packet::BeginRendering(Box::new(Rendering {
            depth: Some(attachment(&depth, clear(ClearValue::DepthStencil { depth: 1.0, stencil: 0 }))),
            ..rendering(attachment(&color, clear(ClearValue::Float([0.0; 4]))))
        })));
        if !matches!(kind, Kind::Gaussians | Kind::Shaded) {
            packets.push(triangles(device, 3 + frame, 300));
        }
        if kind == Kind::Shaded {
            packets.extend(shaded(device, 9 + frame, 1000));
        } else if kind == Kind::Hidden {
            packets.extend(tested(gaussians(5 + frame, 2000, OVER)));
        } else if kind != Kind::Triangles {
            packets.extend(gaussians(5 + frame, 2000, OVER));
        }
        if kind == Kind::Mixed {
            packets.push(triangles(device, 7 + frame, 40));
        }
        packets.push(Packet::EndRendering);
    }
    for packet in packets.iter().chain(around[1]) {
        processor.execute(packet).unwrap();
    }
    bytes(&color)
}

/// The packets of a draw of Gaussians with a depth test.
fn tested(mut packets: Vec<Packet>) -> Vec<Packet> {
    for packet in &mut packets {
        if let Packet::GaussianBegin(begin) = packet {
            let mut state = GaussianState::clone(&begin.state);
            state.depth_stencil.depth = Some(DepthTest { compare: CompareOp::Less, write: false });
            begin.state = Arc::new(state);
            // Beyond the near plane at 1, depths are those of a perspective projection.
            begin.camera.depth_coefficients = [1.2, -1.2];
        }
    }
    packets
}

/// The numbers of a triangle's vertex: four of the position and four of the colour.
const FLOATS: usize = 8;

/// A program that copies its inputs to its outputs, the colours after some arithmetic.
fn program(squared: std::ops::Range<usize>, count: usize) -> Program {
    let mut b = Builder::new();
    let inputs: Vec<_> = (0..count).map(|slot| b.input(slot as u32, Type::B32, Rate::Varying)).collect();
    for (slot, &input) in inputs.iter().enumerate() {
        let value = if squared.contains(&slot) { b.compute(Op::FMul, &[input, input]) } else { input };
        let output = b.output(slot as u32, Type::B32);
        b.assign(output, value);
    }
    b.finish().unwrap()
}

/// A dispatch that computes and stores nothing.
fn dispatch(device: &Device) -> Packet {
    let mut b = Builder::new();
    let mut value = b.lane_index();
    for _ in 0..50 {
        value = b.compute(Op::IMul, &[value, value]);
    }
    let output = b.output(0, Type::B32);
    b.assign(output, value);
    let program = b.finish().unwrap();
    Packet::Dispatch(Box::new(Dispatch {
        program: Arc::new(ComputeProgram::new(device.level(), program, 64, 32, Vec::new()).unwrap()),
        base: [0; 3],
        count: [40, 2, 1],
        bindings: Bindings::default(),
    }))
}

/// `count` Gaussians drawn with a vertex program and a fragment program.
fn shaded(device: &Device, seed: u64, count: u32) -> Vec<Packet> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut floats: Vec<f32> = Vec::new();
    for _ in 0..count {
        let [x, y] = [0; 2].map(|_| rng.random_range(-1.2..1.2f32));
        let depth = rng.random_range(0.0..1.0f32);
        let [xx, yy] = [0; 2].map(|_| rng.random_range(1.0..60.0f32));
        let xy = rng.random_range(-0.9..0.9f32) * (xx * yy).sqrt();
        floats.extend([x, y, depth, 1.0, xx, xy, yy, rng.random_range(0.1..1.0)]);
        floats.extend([0; 3].map(|_| rng.random_range(0.0..1.0f32)));
        floats.push(depth);
    }
    let size = 4 * floats.len() as u64;
    let memory = Allocation::new_zeroed(size).unwrap();
    memory.write(0, &floats).unwrap();
    let stream = |offset| AttributeStream {
        buffer: BufferRange { memory: memory.clone(), offset: 0, size },
        stride: 48,
        offset,
        format: Format::R32G32B32A32Sfloat,
        instance_divisor: None,
    };
    let inputs = (0..12).map(|slot| Some(VertexInput::Attribute { stream: slot / 4, component: slot % 4 }));
    let position = (0..4).map(|component| Some(VertexOutput::Position(component)));
    let others = (0..gaussian::VARYINGS).map(|number| Some(VertexOutput::Varying(number)));
    let programs = DrawPrograms {
        vertex: program(8..11, 12),
        vertex_inputs: inputs.collect(),
        vertex_outputs: position.chain(others).collect(),
        varyings: gaussian::VARYINGS,
        captured: None,
        tessellation: None,
        geometry: None,
        fragment: None,
    };
    let resolved = FragmentPrograms {
        program: program(0..3, 4),
        inputs: (0..4)
            .map(|number| {
                Some(FragmentInput::Varying {
                    index: resolve::ACCUMULATED + number,
                    interpolation: Interpolation::Flat,
                    sampling: Sampling::Center,
                })
            })
            .collect(),
        outputs: (0..4).map(|component| Some(FragmentOutput::Color { attachment: 0, component, index: 0 })).collect(),
        early_tests: false,
        post_depth_coverage: false,
        discards: false,
        per_sample: false,
        has_side_effects: false,
    };
    vec![
        Packet::GaussianBegin(Box::new(begin(OVER))),
        Packet::GaussianFragmentStage(Box::new(GaussianFragmentStage {
            program: Arc::new(GaussianFragmentProgram::new(device.level(), &resolved).unwrap()),
            bindings: Bindings::default(),
            sample_shading: false,
            alpha_to_coverage: false,
            alpha_to_one: false,
        })),
        Packet::GaussianAppendDraw(Box::new(Draw {
            pipeline: Arc::new(DrawPipeline::of_gaussians(device.level(), &programs).unwrap()),
            state: Arc::new(DrawState::new(Topology::PointList, [WIDTH, HEIGHT])),
            attributes: vec![stream(0), stream(16), stream(32)],
            vertex_bindings: Bindings::default(),
            primitive_bindings: PrimitiveBindings::default(),
            fragment_bindings: Bindings::default(),
            indices: None,
            first: 0,
            count,
            first_instance: 0,
            instance_count: 1,
            draw_index: 0,
            transform_feedback: None,
        })),
        Packet::GaussianEnd,
    ]
}

/// `count` random triangles that hide each other, large ones first.
fn triangles(device: &Device, seed: u64, count: u32) -> Packet {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut floats: Vec<f32> = Vec::new();
    for number in 0..count {
        let middle = [0; 2].map(|_| rng.random_range(-1.0..1.0f32));
        let size = if number % 20 == 0 { 1.5 } else { 0.15 };
        let z = rng.random_range(0.1..0.9f32);
        for _ in 0..3 {
            let [x, y] = middle.map(|at| at + rng.random_range(-size..size));
            floats.extend([x, y, z, 1.0]);
            floats.extend([0; 4].map(|_| rng.random_range(0.0..1.0f32)));
        }
    }
    let size = 4 * floats.len() as u64;
    let memory = Allocation::new_zeroed(size).unwrap();
    memory.write(0, &floats).unwrap();
    let stream = |offset| AttributeStream {
        buffer: BufferRange { memory: memory.clone(), offset: 0, size },
        stride: 4 * FLOATS as u32,
        offset,
        format: Format::R32G32B32A32Sfloat,
        instance_divisor: None,
    };
    let attribute = |stream| (0..4).map(move |component| Some(VertexInput::Attribute { stream, component }));
    let position = (0..4).map(|component| Some(VertexOutput::Position(component)));
    let color = (0..4).map(|component| FragmentOutput::Color { attachment: 0, component, index: 0 });
    let varying =
        |index| FragmentInput::Varying { index, interpolation: Interpolation::Perspective, sampling: Sampling::Center };
    let programs = DrawPrograms {
        vertex: program(4..8, FLOATS),
        vertex_inputs: attribute(0).chain(attribute(1)).collect(),
        vertex_outputs: position.chain((0..4).map(|number| Some(VertexOutput::Varying(number)))).collect(),
        varyings: 4,
        captured: None,
        tessellation: None,
        geometry: None,
        fragment: Some(FragmentPrograms {
            program: program(0..4, 4),
            inputs: (0..4).map(|index| Some(varying(index))).collect(),
            outputs: color.map(Some).collect(),
            early_tests: false,
            post_depth_coverage: false,
            discards: false,
            per_sample: false,
            has_side_effects: false,
        }),
    };
    let state = DrawState {
        depth_stencil: DepthStencil {
            depth: Some(DepthTest { compare: CompareOp::Less, write: true }),
            bounds: None,
            stencil: None,
        },
        ..DrawState::new(Topology::TriangleList, [WIDTH, HEIGHT])
    };
    Packet::Draw(Box::new(Draw {
        pipeline: Arc::new(DrawPipeline::new(device.level(), &programs).unwrap()),
        state: Arc::new(state),
        attributes: vec![stream(0), stream(16)],
        vertex_bindings: Bindings::default(),
        primitive_bindings: PrimitiveBindings::default(),
        fragment_bindings: Bindings::default(),
        indices: None,
        first: 0,
        count: 3 * count,
        first_instance: 0,
        instance_count: 1,
        draw_index: 0,
        transform_feedback: None,
    }))
}
