//! Sets of Gaussians in every mode, drawn with and without optimizations.

use crate::common::{HEIGHT, OVER, WIDTH, attachment, bytes, clear, gaussians, gaussians_in, image, rendering, single};
use simdevice::BufferRange;
use simdevice::format::ClearValue;
use simdevice::isa::builder::Builder;
use simdevice::isa::ir::{Program, Rate, Type};
use simdevice::packet::{
    AttachmentClear, AttributeStream, Draw, GaussianBegin, LoadOp, ModelAttributes, PrimitiveBindings,
};
use simdevice::program::bindings::Bindings;
use simdevice::program::interface::{
    DrawPrograms, FragmentInput, FragmentOutput, FragmentPrograms, Interpolation, Sampling, VertexInput, VertexOutput,
};
use simdevice::program::vertex::DrawPipeline;
use simdevice::state::gaussian::{
    Camera, CameraModel, GaussianGeometry, GaussianLinearization, GaussianOrder, GaussianPrecision, GaussianState,
};
use simdevice::state::{CompareOp, DepthTest, DrawState, Rect, Topology};
use simdevice::stats::counters::{Counter, Counters};
use simdevice::stats::optimizations::{Optimization, Optimizations};
use simdevice::{Allocation, CommandProcessor, Config, Device, Format, Packet};
use std::sync::Arc;

/// A program that copies `count` scalars from inputs to outputs.
pub fn pass_on(count: u32) -> Program {
    let mut b = Builder::new();
    for slot in 0..count {
        let input = b.input(slot, Type::B32, Rate::Varying);
        let output = b.output(slot, Type::B32);
        b.assign(output, input);
    }
    b.finish().unwrap()
}

pub fn programs() -> DrawPrograms {
    let attribute = |stream| (0..4).map(move |component| Some(VertexInput::Attribute { stream, component }));
    let position = (0..4).map(|component| Some(VertexOutput::Position(component)));
    let varyings = (0..4).map(|index| Some(VertexOutput::Varying(index)));
    let inputs = (0..4).map(|index| {
        Some(FragmentInput::Varying { index, interpolation: Interpolation::Perspective, sampling: Sampling::Center })
    });
    let outputs = (0..4).map(|component| Some(FragmentOutput::Color { attachment: 0, component, index: 0 }));
    DrawPrograms {
        vertex: pass_on(8),
        vertex_inputs: attribute(0).chain(attribute(1)).collect(),
        vertex_outputs: position.chain(varyings).collect(),
        varyings: 4,
        captured: None,
        tessellation: None,
        geometry: None,
        fragment: Some(FragmentPrograms {
            program: pass_on(4),
            inputs: inputs.collect(),
            outputs: outputs.collect(),
            early_tests: false,
            post_depth_coverage: false,
            discards: false,
            per_sample: false,
            has_side_effects: false,
        }),
    }
}

/// A draw of triangles with corners in clip space, with a depth test or without.
pub fn triangles(device: &Device, corners: &[[f32; 4]], tested: bool) -> Packet {
    let vertices: Vec<[f32; 8]> =
        corners.iter().map(|&[x, y, z, w]| [x, y, z, w, 0.5 + 0.4 * x, 0.5 + 0.4 * y, z, 0.7]).collect();
    let size = size_of_val(&vertices[..]) as u64;
    let memory = Allocation::new_zeroed(size).unwrap();
    memory.write(0, vertices.as_flattened()).unwrap();
    let stream = |offset| AttributeStream {
        buffer: BufferRange { memory: memory.clone(), offset: 0, size },
        stride: 32,
        offset,
        format: Format::R32G32B32A32Sfloat,
        instance_divisor: None,
    };
    let mut state = DrawState::new(Topology::TriangleList, [WIDTH, HEIGHT]);
    state.depth_stencil.depth = tested.then_some(DepthTest { compare: CompareOp::Less, write: true });
    Packet::Draw(Box::new(Draw {
        pipeline: Arc::new(DrawPipeline::new(device.level(), &programs()).unwrap()),
        state: Arc::new(state),
        attributes: vec![stream(0), stream(16)],
        vertex_bindings: Bindings::default(),
        primitive_bindings: PrimitiveBindings::default(),
        fragment_bindings: Bindings::default(),
        indices: None,
        first: 0,
        count: corners.len() as u32,
        first_instance: 0,
        instance_count: 1,
        draw_index: 0,
        transform_feedback: None,
    }))
}

/// A triangle over more than half of the framebuffer, at a depth.
pub fn large(z: f32) -> [[f32; 4]; 3] {
    [[-1.0, -1.0, z, 1.0], [1.5, -1.0, z, 1.0], [-1.0, 1.5, z, 1.0]]
}

/// Large triangles, one of them hidden, and small ones, some in perspective.
pub fn all_triangles(device: &Device) -> Vec<Packet> {
    let small = |number: u32| {
        let at = |by: u32| (number * by % 97) as f32 / 50.0 - 0.95;
        let (x, y, z) = (at(31), at(57), 0.1 + 0.008 * (number % 89) as f32);
        let w = 1.0 + (number % 3) as f32;
        [[x, y, z, 1.0], [x + 0.1, y, z, 1.0], [x * w, (y + 0.2) * w, z * w, w]]
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
    // Its depth is nearer than the others' at one end, and farther at the other.
    let slanted = [[-1.0, -1.0, 0.2, 1.0], [1.5, -1.0, 0.99, 1.0], [-1.0, 1.5, 0.99, 1.0]];
    vec![
        triangles(device, &large(0.9), false),
        triangles(device, &layers, false),
        triangles(device, &[&layers[..], &slanted[..], &layers[..]].concat(), true),
        triangles(device, &large(0.5), true),
        triangles(device, &several, true),
        triangles(device, &large(0.7), true),
    ]
}

/// Gaussians in memory that only the device writes, most of them outside the scissor.
pub fn mostly_beside(seed: u64, count: u32) -> Vec<Packet> {
    let mut packets = gaussians_in(false, seed, count, OVER);
    if let Packet::GaussianBegin(begin) = &mut packets[0] {
        begin.scissor = Rect { x: 0, y: 0, width: 35, height: 40 };
    }
    packets
}

/// Gaussians that only the device can write, in a set whose begin packet is changed.
pub fn changed(seed: u64, change: impl FnOnce(&mut GaussianBegin)) -> Vec<Packet> {
    let mut packets = gaussians_in(false, seed, 2000, OVER);
    if let Packet::GaussianBegin(begin) = &mut packets[0] {
        change(begin);
    }
    packets
}

/// Three instances of Gaussians, each placed by a matrix and less opaque than the one before.
pub fn placed() -> Vec<Packet> {
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
    memory.write(0, elements.as_flattened().as_flattened()).unwrap();
    let stream = |row: u32| AttributeStream {
        buffer: BufferRange { memory: memory.clone(), offset: 0, size },
        stride: 64,
        offset: 16 * row,
        format: Format::R32G32B32A32Sfloat,
        instance_divisor: Some(1),
    };
    if let Packet::GaussianAppend(append) = &mut packets[1] {
        append.instance_count = 3;
        append.attributes.model =
            ModelAttributes { matrix: Some(Box::new([stream(0), stream(1), stream(2)])), opacity: Some(stream(3)) };
    }
    packets
}

/// Small Gaussians in another mode, most of them outside the scissor.
pub fn mode_beside(seed: u64, change: fn(&mut GaussianBegin)) -> Vec<Packet> {
    let mut packets = mostly_beside(seed, 3000);
    if let Packet::GaussianBegin(begin) = &mut packets[0] {
        begin.camera.eye[0] = -0.8;
        change(begin);
    }
    shrink(&packets[1]);
    packets
}

/// Scales the Gaussians of an append packet by one fifth.
pub fn shrink(append: &Packet) {
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

/// Modes that need other bounds than those of binary32 volumes under a pinhole camera, and one mode that uses these,
/// for comparison.
pub fn bounded_modes() -> Vec<(&'static str, Vec<Packet>)> {
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
        begin.scissor = Rect { x: 0, y: 0, width: 35, height: 40 };
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
            // A Gaussian that is farther away is smaller.
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

/// A change of a set's state or camera to another mode.
pub type Change = fn(&mut GaussianBegin);

/// Scenes, each with its packets and its attachment's load operation: Gaussians in modes without a fast path; few
/// Gaussians; many; many that only the device can write, all of the same depth in one scene; several draws with a clear
/// between them.
pub fn scenes() -> Vec<(&'static str, Vec<Packet>, LoadOp)> {
    let clear_part = clear(
        vec![AttachmentClear::Color { index: 0, value: ClearValue::Float([0.4, 0.1, 0.9, 0.5]) }],
        &[Rect { x: 30, y: 20, width: 40, height: 40 }],
    );
    let over_black = LoadOp::Clear(ClearValue::Float([0.0, 0.0, 0.0, 1.0]));
    let several = [gaussians(3, 20, OVER), vec![clear_part], gaussians(4, 300, OVER)];
    let mut ties = gaussians_in(false, 6, 3000, OVER);
    if let Packet::GaussianBegin(begin) = &mut ties[0] {
        begin.state = Arc::new(GaussianState { order: GaussianOrder::Primitive, ..(*begin.state).clone() });
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
        begin.state =
            Arc::new(GaussianState { linearization: GaussianLinearization::Unscented, ..(*begin.state).clone() });
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
        ("behind a wall", walled(11, 1.3, 0.99), over_black),
        ("behind half a wall", walled(12, 0.0, 0.9), LoadOp::Load),
        ("bands", with_bands_of_zeros(), over_black),
        ("alone", gaussians_in(false, 13, 300, OVER), over_black),
        ("ties", ties, LoadOp::Load),
        ("several", several.concat(), LoadOp::Load),
        ("nothing", Vec::new(), over_black),
    ]
}

/// Draws a scene twice on a device of its own, over triangles if the attachment is loaded. Returns the bytes of colours
/// and depths, and the counters.
pub fn draw(optimizations: Optimizations, packets: &[Packet], load: LoadOp) -> (Vec<u8>, Counters) {
    let config = Config { optimizations, ..single() };
    let target = image(Format::R32G32B32A32Sfloat, 1, 0x3E);
    let depth = image(Format::D32Sfloat, 1, 0);
    let device = Arc::new(Device::new(&config).unwrap());
    let mut processor = CommandProcessor::new(Arc::clone(&device));
    let mut rendering = rendering(attachment(&target, load));
    let far = ClearValue::DepthStencil { depth: 1.0, stencil: 0 };
    rendering.depth = Some(attachment(&depth, LoadOp::Clear(far)));
    // A pipeline belongs to one device.
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

/// Draws a scene over black, in a pass of its own. Returns the counters of the pass. The picture must equal that of a
/// device without optimizations.
pub fn draw_as_without_skips(processor: &mut CommandProcessor, packets: &[Packet]) -> Counters {
    let over_black = LoadOp::Clear(ClearValue::Float([0.0, 0.0, 0.0, 1.0]));
    let before = processor.counters().clone();
    let target = image(Format::R32G32B32A32Sfloat, 1, 0x3E);
    let rendering = rendering(attachment(&target, over_black));
    let begin = [Packet::BeginRendering(Box::new(rendering))];
    for packet in begin.iter().chain(packets).chain([&Packet::EndRendering]) {
        processor.execute(packet).unwrap();
    }
    // Depths are not compared here.
    let (expected, _) = draw(Optimizations::NONE, packets, over_black);
    assert!(bytes(&target) == expected[..bytes(&target).len()]);
    processor.counters().since(&before)
}

/// The counters of each of four passes that draw the same packets. After each pass, `change` is called with the pass's
/// number and the device's memory. All images must equal those of a device without chunks.
pub fn draw_again(config: &Config, change: impl Fn(usize, &Allocation)) -> Vec<Counters> {
    let packets = mostly_beside(7, 20_000);
    let Packet::GaussianAppend(append) = &packets[1] else {
        panic!("a set begins, is filled and is resolved");
    };
    let memory = &append.attributes.position.buffer.memory;
    let target = image(Format::R32G32B32A32Sfloat, 1, 0);
    let clear = LoadOp::Clear(ClearValue::Float([0.0; 4]));
    let begin = [Packet::BeginRendering(Box::new(rendering(attachment(&target, clear))))];
    let mut processor = CommandProcessor::new(Arc::new(Device::new(config).unwrap()));
    let passes = (0..4).map(|pass| {
        let before = processor.counters().clone();
        for packet in begin.iter().chain(&packets).chain([&Packet::EndRendering]) {
            processor.execute(packet).unwrap();
        }
        let plain = Config { optimizations: Optimizations::ALL.without(Optimization::ClusterCulling), ..single() };
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

pub fn chunks_built(passes: &[Counters]) -> Vec<u64> {
    let built = passes.iter().map(|pass| pass.get(Counter::ClustersBuilt));
    built.collect()
}

/// Gaussians that only the device can write. The first of them form a wall in front of the others: large, opaque, and
/// at most `right` to the right of the middle.
pub fn walled(seed: u64, right: f32, opacity: f32) -> Vec<Packet> {
    const FLOATS: u64 = 14;
    let packets = gaussians_in(false, seed, 12_000, OVER);
    let Packet::GaussianAppend(append) = &packets[1] else {
        panic!("what follows the beginning of a set");
    };
    let memory = &append.attributes.position.buffer.memory;
    shrink(&packets[1]);
    for vertex in 0..600u64 {
        let (column, row) = (vertex % 30, vertex / 30);
        let x = -1.3 + (1.3 + right) * column as f32 / 29.0;
        let y = -1.0 + 0.1 * row as f32;
        let z = 1.2 + 0.0005 * ((vertex * 37) % 600) as f32;
        let at = 4 * FLOATS * vertex;
        memory.write(at, &[x, y, z, 0.3, 0.25, 0.35]).unwrap();
        memory.write(at + 40, &[opacity]).unwrap();
    }
    packets
}

/// Gaussians with coefficients of three degrees; those of the second and third are zero in parts of space.
pub fn with_bands_of_zeros() -> Vec<Packet> {
    let mut packets = gaussians_in(false, 44, 4000, OVER);
    let Packet::GaussianAppend(append) = &mut packets[1] else {
        panic!("what follows the beginning of a set");
    };
    const FLOATS: u32 = 27;
    let size = 4 * u64::from(FLOATS * append.count);
    let memory = Allocation::new(size, false).unwrap();
    for vertex in 0..append.count {
        let position = &append.attributes.position;
        let at = u64::from(vertex * position.stride + position.offset);
        let mut place = [0.0f32; 3];
        position.buffer.memory.read(at, &mut place).unwrap();
        let degree = if place[0] > 0.5 {
            2
        } else if place[1] > 0.0 {
            1
        } else {
            0
        };
        let mut coefficients = [0.0f32; FLOATS as usize];
        for (k, value) in coefficients.iter_mut().enumerate() {
            if k < 3 * (degree + 1) * (degree + 1) {
                *value = ((vertex as usize * 31 + k * 17) % 23) as f32 * 0.04 - 0.3;
            }
        }
        let at = u64::from(4 * FLOATS * vertex);
        memory.write(at, &coefficients).unwrap();
    }
    append.attributes.spherical_harmonics = (0..9)
        .map(|k| AttributeStream {
            buffer: BufferRange { memory: memory.clone(), offset: 0, size },
            stride: 4 * FLOATS,
            offset: 12 * k,
            format: Format::R32G32B32Sfloat,
            instance_divisor: None,
        })
        .collect();
    if let Packet::GaussianBegin(begin) = &mut packets[0] {
        Arc::make_mut(&mut begin.state).sh_degree = 2;
    }
    packets
}
