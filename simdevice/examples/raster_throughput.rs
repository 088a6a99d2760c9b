//! Throughput of triangle mode: fill, tiny triangles, arithmetic, overdraw and multisampling at 1920x1080.
//!
//! `cargo run --release -p simdevice --example raster_throughput [workers [words of a scene's name]]`

use simdevice::format::ClearValue;
use simdevice::image::{ImageDesc, ImageKind};
use simdevice::isa::builder::Builder;
use simdevice::isa::ir::{Program, Rate, Type};
use simdevice::isa::op::Op;
use simdevice::packet::*;
use simdevice::program::bindings::Bindings;
use simdevice::program::interface::{
    DrawPrograms, FragmentInput, FragmentOutput, FragmentPrograms, Interpolation, Sampling, VertexInput, VertexOutput,
};
use simdevice::program::vertex::DrawPipeline;
use simdevice::state::{
    BlendEquation, BlendEquations, BlendFactor, BlendOp, BlendState, CompareOp, DepthStencil, DepthTest, DrawState,
    Rect, Topology,
};
use simdevice::stats::counters::Counter;
use simdevice::{Allocation, BufferRange, CommandProcessor, Config, Device, Format, Image, ImageView, Packet};
use std::sync::Arc;

const WIDTH: u32 = 1920;
const HEIGHT: u32 = 1080;
/// Floats of a vertex: position in clip space, colour.
const FLOATS: usize = 8;

/// Passes position and colour on.
fn vertex_program() -> Program {
    let mut b = Builder::new();
    for slot in 0..FLOATS as u32 {
        let input = b.input(slot, Type::B32, Rate::Varying);
        let output = b.output(slot, Type::B32);
        b.assign(output, input);
    }
    b.finish().expect("a valid program")
}

/// The colour as it is, or after `rounds` rounds of four fused multiply-adds.
fn fragment_program(rounds: u32) -> Program {
    let mut b = Builder::new();
    let factor = b.f32(0.99);
    for slot in 0..4 {
        let input = b.input(slot, Type::B32, Rate::Varying);
        let output = b.output(slot, Type::B32);
        let mut value = input;
        for _ in 0..rounds {
            value = b.compute(Op::FFma, &[value, factor, input]);
        }
        b.assign(output, value);
    }
    b.finish().expect("a valid program")
}

fn programs(rounds: u32) -> DrawPrograms {
    let attribute = |stream| (0..4).map(move |component| Some(VertexInput::Attribute { stream, component }));
    let position = (0..4).map(|component| Some(VertexOutput::Position(component)));
    let varyings = (0..4).map(|index| Some(VertexOutput::Varying(index)));
    let inputs = (0..4).map(|index| {
        Some(FragmentInput::Varying { index, interpolation: Interpolation::Perspective, sampling: Sampling::Center })
    });
    let outputs = (0..4).map(|component| Some(FragmentOutput::Color { attachment: 0, component, index: 0 }));
    DrawPrograms {
        vertex: vertex_program(),
        vertex_inputs: attribute(0).chain(attribute(1)).collect(),
        vertex_outputs: position.chain(varyings).collect(),
        varyings: 4,
        captured: None,
        tessellation: None,
        geometry: None,
        fragment: Some(FragmentPrograms {
            program: fragment_program(rounds),
            inputs: inputs.collect(),
            outputs: outputs.collect(),
            early_tests: false,
            discards: false,
            per_sample: false,
            has_side_effects: false,
        }),
    }
}

/// The scenes that are drawn.
struct Scene {
    name: &'static str,
    vertices: Vec<[f32; FLOATS]>,
    samples: u32,
    depth: bool,
    blend: bool,
    rounds: u32,
}

fn state(scene: &Scene) -> DrawState {
    let over = BlendEquation { source: BlendFactor::One, destination: BlendFactor::OneMinusSrcAlpha, op: BlendOp::Add };
    DrawState {
        samples: scene.samples,
        depth_stencil: DepthStencil {
            depth: scene.depth.then_some(DepthTest { compare: CompareOp::LessOrEqual, write: true }),
            bounds: None,
            stencil: None,
        },
        blend: vec![BlendState { equations: scene.blend.then_some(BlendEquations::both(over)), write_mask: 0xF }],
        ..DrawState::new(Topology::TriangleList, [WIDTH, HEIGHT])
    }
}

fn buffer<T: bytemuck::NoUninit>(elements: &[T]) -> BufferRange {
    let size = size_of_val(elements) as u64;
    let memory = Allocation::new_zeroed(size).expect("memory");
    memory.write(0, elements).expect("it fits");
    BufferRange { memory, offset: 0, size }
}

fn target(format: Format, samples: u32) -> ImageView {
    let desc =
        ImageDesc { kind: ImageKind::D2, format, extent: [WIDTH, HEIGHT, 1], mip_levels: 1, array_layers: 1, samples };
    let memory = Allocation::new_zeroed(desc.memory_size().expect("it fits")).expect("memory");
    ImageView {
        image: Arc::new(Image::new(desc, memory, 0).expect("an image")),
        format,
        base_mip_level: 0,
        level_count: 1,
        base_layer: 0,
        layer_count: 1,
    }
}

/// `layers` rectangles over everything, of two triangles each.
fn layers(layers: u32) -> Vec<[f32; FLOATS]> {
    let corner = |x: f32, y: f32, layer: u32| {
        let alpha = 0.3 + layer as f32 / 100.0;
        let shade = (x + 1.0) / 2.0 * alpha;
        [x, y, 0.5, 1.0, shade, (y + 1.0) / 2.0 * alpha, 0.1, alpha]
    };
    (0..layers)
        .flat_map(|layer| {
            [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]]
                .map(|[x, y]| corner(x, y, layer))
        })
        .collect()
}

/// A grid of `columns` x `rows` rectangles of two triangles each, over everything.
fn grid(columns: u32, rows: u32) -> Vec<[f32; FLOATS]> {
    let vertex = |column: u32, row: u32| {
        let (x, y) = (column as f32 / columns as f32, row as f32 / rows as f32);
        let z = 0.5 + 0.3 * (x * 40.0).sin() * (y * 40.0).cos();
        [2.0 * x - 1.0, 2.0 * y - 1.0, z, 1.0, x, y, 1.0 - x, 1.0]
    };
    let quad = |column, row| [[0, 0], [1, 0], [0, 1], [0, 1], [1, 0], [1, 1]].map(|[x, y]| vertex(column + x, row + y));
    (0..rows).flat_map(|row| (0..columns).flat_map(move |column| quad(column, row))).collect()
}

fn scenes() -> Vec<Scene> {
    let scene = |name, vertices| Scene { name, vertices, samples: 1, depth: false, blend: false, rounds: 0 };
    vec![
        scene("fill", layers(1)),
        scene("fill, 8 layers", layers(8)),
        Scene { depth: true, ..scene("fill with depth, 8 layers", layers(8)) },
        Scene { blend: true, ..scene("overdraw, 32 layers blended", layers(32)) },
        Scene { rounds: 16, ..scene("arithmetic, 8 layers", layers(8)) },
        Scene { depth: true, ..scene("tiny, 1M triangles", grid(960, 540)) },
        Scene { depth: true, ..scene("small, 65k triangles", grid(240, 135)) },
        Scene { samples: 4, depth: true, ..scene("4 samples, 65k triangles", grid(240, 135)) },
        Scene { samples: 4, ..scene("4 samples, fill 8 layers", layers(8)) },
    ]
}

fn main() {
    let mut words = std::env::args().skip(1);
    let threads = words.next().and_then(|word| word.parse().ok());
    let wanted: Vec<String> = words.collect();
    let config = Config { threads: threads.unwrap_or(0), ..Config::default() };
    let device = Arc::new(Device::new(&config).expect("a device"));
    println!("{} workers", device.runtime().threads());
    for scene in scenes() {
        if wanted.iter().all(|word| scene.name.contains(word.as_str())) {
            measure(&device, &scene);
        }
    }
}

/// Draws a scene a few times, and prints the best time of the tile engine.
fn measure(device: &Arc<Device>, scene: &Scene) {
    let pipeline = DrawPipeline::new(device.level(), &programs(scene.rounds)).expect("valid programs");
    let vertices = buffer(&scene.vertices);
    let stream = |offset| AttributeStream {
        buffer: vertices.clone(),
        stride: 4 * FLOATS as u32,
        offset,
        format: Format::R32G32B32A32Sfloat,
        instance_divisor: None,
    };
    let draw = Draw {
        pipeline: Arc::new(pipeline),
        state: Arc::new(state(scene)),
        attributes: vec![stream(0), stream(16)],
        vertex_bindings: Bindings::default(),
        primitive_bindings: PrimitiveBindings::default(),
        fragment_bindings: Bindings::default(),
        indices: None,
        first: 0,
        count: scene.vertices.len() as u32,
        first_instance: 0,
        instance_count: 1,
        draw_index: 0,
        transform_feedback: None,
    };
    let attachment = |format, value| Attachment {
        view: target(format, scene.samples),
        load: LoadOp::Clear(value),
        store: StoreOp::Store,
        resolve: None,
    };
    let depth = ClearValue::DepthStencil { depth: 1.0, stencil: 0 };
    let rendering = Rendering {
        area: Rect { x: 0, y: 0, width: WIDTH, height: HEIGHT },
        layer_count: 1,
        view_mask: 0,
        color: vec![Some(attachment(Format::R8G8B8A8Unorm, ClearValue::Float([0.0; 4])))],
        depth: scene.depth.then(|| attachment(Format::D32Sfloat, depth)),
        stencil: None,
    };
    let packets = [Packet::BeginRendering(Box::new(rendering)), Packet::Draw(Box::new(draw)), Packet::EndRendering];
    let mut best: Option<(u64, CommandProcessor)> = None;
    for _ in 0..12 {
        let mut processor = CommandProcessor::new(Arc::clone(device));
        for packet in &packets {
            processor.execute(packet).expect("it works");
        }
        let time = processor.counters().get(Counter::RasterTime);
        if best.as_ref().is_none_or(|(least, _)| time < *least) {
            best = Some((time, processor));
        }
    }
    if let Some((time, processor)) = best {
        let counters = processor.counters();
        let fragments = counters.get(Counter::FragmentInvocations);
        let batches = counters.get(Counter::ShaderBatches);
        println!(
            "{:28} {:8.2} ms raster, {:8.2} ms geometry, {:6.2} ns a fragment, {:9} fragments, {:6} batches",
            scene.name,
            time as f64 / 1e6,
            counters.get(Counter::GeometryTime) as f64 / 1e6,
            time as f64 / fragments.max(1) as f64,
            fragments,
            batches,
        );
    }
}
