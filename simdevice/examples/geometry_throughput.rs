//! Throughput of the front end of triangle draws: vertices and triangles a second, before tiles.
//!
//! `cargo run --release -p simdevice --example geometry_throughput`

use simdevice::image::{ImageDesc, ImageKind};
use simdevice::isa::builder::Builder;
use simdevice::isa::ir::{Address, Format as Element, Program, Rate, Space, Type};
use simdevice::isa::op::Op;
use simdevice::packet::*;
use simdevice::program::bindings::Bindings;
use simdevice::program::interface::{
    DrawPrograms, FragmentInput, FragmentPrograms, Interpolation, Sampling, VertexInput, VertexOutput,
};
use simdevice::program::vertex::DrawPipeline;
use simdevice::state::{BlendState, DrawState, Topology};
use simdevice::stats::counters::Counter;
use simdevice::{Allocation, BufferRange, CommandProcessor, Config, Device, Format, Image, ImageView, Packet};
use std::sync::Arc;

const WIDTH: u32 = 1920;
const HEIGHT: u32 = 1080;

/// Position times a 4x4 matrix of push constants; a normal is passed on.
fn vertex_program() -> Program {
    let mut b = Builder::new();
    let inputs: Vec<_> = (0..6).map(|slot| b.input(slot, Type::B32, Rate::Varying)).collect();
    let address = Address { space: Space::PushConstants, base: None, offset: 0 };
    let matrix = b.load(address, Element::B32, 16);
    for row in 0..4 {
        let mut sum = matrix[4 * row + 3];
        for column in 0..3 {
            sum = b.compute(Op::FFma, &[matrix[4 * row + column], inputs[column], sum]);
        }
        let out = b.output(row as u32, Type::B32);
        b.assign(out, sum);
    }
    for component in 0..3 {
        let out = b.output(4 + component, Type::B32);
        b.assign(out, inputs[3 + component as usize]);
    }
    b.finish().expect("a valid program")
}

fn programs() -> DrawPrograms {
    let attribute = |stream| (0..3).map(move |component| Some(VertexInput::Attribute { stream, component }));
    let position = (0..4).map(|component| Some(VertexOutput::Position(component)));
    let varyings = (0..3).map(|index| Some(VertexOutput::Varying(index)));
    let inputs = (0..3).map(|index| {
        Some(FragmentInput::Varying { index, interpolation: Interpolation::Perspective, sampling: Sampling::Center })
    });
    DrawPrograms {
        vertex: vertex_program(),
        vertex_inputs: attribute(0).chain(attribute(1)).collect(),
        vertex_outputs: position.chain(varyings).collect(),
        varyings: 3,
        captured: None,
        tessellation: None,
        geometry: None,
        fragment: Some(FragmentPrograms {
            program: Program::default(),
            inputs: inputs.collect(),
            outputs: Vec::new(),
            early_tests: false,
            discards: false,
            per_sample: false,
            has_side_effects: false,
        }),
    }
}

fn state(cull_back: bool) -> DrawState {
    DrawState {
        cull_back,
        // No fragment work: what is measured comes before it.
        blend: vec![BlendState { equations: None, write_mask: 0 }],
        ..DrawState::new(Topology::TriangleList, [WIDTH, HEIGHT])
    }
}

fn buffer<T: bytemuck::NoUninit>(elements: &[T]) -> BufferRange {
    let size = size_of_val(elements) as u64;
    let memory = Allocation::new_zeroed(size).expect("memory");
    memory.write(0, elements).expect("it fits");
    BufferRange { memory, offset: 0, size }
}

/// A grid of `side` x `side` quads that fills the screen, as vertices of position and normal, and indices.
fn grid(side: u32) -> (Vec<[f32; 6]>, Vec<u32>) {
    let at = |step: u32| step as f32 / side as f32 * 2.0 - 1.0;
    let place = |row, column| [at(column), at(row), 0.5, 0.0, 0.0, 1.0];
    let vertices = (0..=side).flat_map(|row| (0..=side).map(move |column| place(row, column)));
    let quad = |row, column| {
        let a = row * (side + 1) + column;
        [a, a + 1, a + side + 1, a + side + 1, a + 1, a + side + 2]
    };
    let indices = (0..side).flat_map(|row| (0..side).flat_map(move |column| quad(row, column)));
    (vertices.collect(), indices.collect())
}

fn target() -> ImageView {
    let desc = ImageDesc {
        kind: ImageKind::D2,
        format: Format::R8G8B8A8Unorm,
        extent: [WIDTH, HEIGHT, 1],
        mip_levels: 1,
        array_layers: 1,
        samples: 1,
    };
    let memory = Allocation::new_zeroed(desc.memory_size().expect("it fits")).expect("memory");
    ImageView {
        image: Arc::new(Image::new(desc, memory, 0).expect("an image")),
        format: desc.format,
        base_mip_level: 0,
        level_count: 1,
        base_layer: 0,
        layer_count: 1,
    }
}

fn main() {
    let threads = std::env::args().nth(1).and_then(|word| word.parse().ok());
    let config = Config { threads: threads.unwrap_or(0), ..Config::default() };
    let device = Arc::new(Device::new(&config).expect("a device"));
    println!("{} workers", device.runtime().threads());
    let pipeline = Arc::new(DrawPipeline::new(device.level(), &programs()).expect("valid programs"));
    let identity: Vec<u8> = (0..16).flat_map(|at| f32::to_le_bytes(if at % 5 == 0 { 1.0 } else { 0.0 })).collect();
    let scenes = [
        ("tiny, shared", 708, true, false),
        ("tiny, not indexed", 708, false, false),
        ("tiny, all culled", 708, true, true),
        ("large, shared", 30, true, false),
    ];
    for (name, side, indexed, culled) in scenes {
        let (vertices, list) = grid(side);
        let expanded: Vec<[f32; 6]> = list.iter().map(|&index| vertices[index as usize]).collect();
        let vertices = buffer(if indexed { &vertices } else { &expanded });
        let stream = |offset| AttributeStream {
            buffer: vertices.clone(),
            stride: 24,
            offset,
            format: Format::R32G32B32Sfloat,
            instance_divisor: None,
        };
        let mut state = state(culled);
        state.front_clockwise ^= culled;
        let draw = Draw {
            pipeline: Arc::clone(&pipeline),
            state: Arc::new(state),
            attributes: vec![stream(0), stream(12)],
            vertex_bindings: Bindings { push_constants: identity.clone(), ..Bindings::default() },
            primitive_bindings: PrimitiveBindings::default(),
            fragment_bindings: Bindings::default(),
            indices: indexed.then(|| IndexStream { buffer: buffer(&list), index_size: 4, vertex_offset: 0 }),
            first: 0,
            count: list.len() as u32,
            first_instance: 0,
            instance_count: 1,
            draw_index: 0,
            transform_feedback: None,
        };
        measure(name, &device, &draw);
    }
}

/// Draws a few times, and prints the best time and what was done.
fn measure(name: &str, device: &Arc<Device>, draw: &Draw) {
    let view = target();
    let mut best = u64::MAX;
    let mut line = String::new();
    for _ in 0..9 {
        let mut processor = CommandProcessor::new(Arc::clone(device));
        let attachment =
            Attachment { resolve: None, view: view.clone(), load: LoadOp::DontCare, store: StoreOp::DontCare };
        let rendering = Rendering {
            area: draw.state.scissors[0],
            layer_count: 1,
            view_mask: 0,
            color: vec![Some(attachment)],
            depth: None,
            stencil: None,
        };
        for packet in [Packet::BeginRendering(Box::new(rendering)), Packet::Draw(Box::new(draw.clone()))] {
            processor.execute(&packet).expect("it is drawn");
        }
        let counters = processor.counters();
        let time = counters.get(Counter::GeometryTime);
        if time < best {
            best = time;
            let rate = |counter| counters.get(counter) as f64 * 1e3 / time as f64;
            line = format!(
                "{:.2} ms ({:.2} ms binning): {:.1} M vertices/s, {:.1} M triangles/s, {} drawn",
                time as f64 / 1e6,
                counters.get(Counter::BinningTime) as f64 / 1e6,
                rate(Counter::VertexInvocations),
                rate(Counter::InputPrimitives),
                counters.get(Counter::PrimitivesDrawn),
            );
        }
    }
    println!("{name:18} {line}");
}
