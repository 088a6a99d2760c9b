//! Execution of an interleaving as packets.

use super::sequence::{Area, DepthTest, Interleaving, Picture, SIZE, Step};
use ash::vk;
use gaurast_testkit::packets::{attributes, buffer, image, stream, texels};
use gaurast_tests::triangles::edges::to_clip;
use simdevice::BufferRange;
use simdevice::format::{Aspect, ClearValue};
use simdevice::isa::builder::Builder;
use simdevice::isa::ir::{Address, Binding, Format as Word, Program, Rate, Space, Type};
use simdevice::isa::op::Op;
use simdevice::packet::{
    Attachment, AttachmentClear, BufferCopyRegion, BufferImageRegion, ClearAttachments, ClearImage, CopyBuffer,
    CopyBufferImage, GaussianAppend, GaussianAttributes, GaussianBegin, LoadOp, PrimitiveBindings, Rendering, StoreOp,
    SubresourceLayers, SubresourceRange,
};
use simdevice::packet::{Dispatch, Draw};
use simdevice::program::bindings::Bindings;
use simdevice::program::compute::ComputeProgram;
use simdevice::program::interface::{
    ComputeInput, DrawPrograms, FragmentInput, FragmentOutput, FragmentPrograms, Interpolation, Sampling, VertexInput,
    VertexOutput,
};
use simdevice::program::vertex::DrawPipeline;
use simdevice::runtime::{FlushPolicy, SimdLevel};
use simdevice::state::gaussian::{Camera, CameraModel, GaussianState};
use simdevice::state::{
    self, BlendEquation, BlendEquations, BlendFactor, BlendOp, BlendState, CompareOp, DepthStencil, DrawState, Rect,
    Topology, Viewport,
};
use simdevice::stats::recorder::Recorder;
use simdevice::{CommandProcessor, Config, Device, Format, ImageView, Packet};
use std::sync::Arc;

/// The number of bytes of a vertex: position and colour.
const VERTEX: u64 = 32;
/// The number of vertices that a workgroup of the compute program changes.
const GROUP: u32 = 24;

/// A device with the programs of interleavings.
pub struct Player {
    device: Arc<Device>,
    pipeline: Arc<DrawPipeline>,
    recolor: Arc<ComputeProgram>,
}

/// The resources of packets.
struct Resources {
    color: ImageView,
    depth: ImageView,
    vertices: BufferRange,
    /// The buffer for texels in transfers.
    texels: BufferRange,
    scenes: Vec<GaussianAttributes>,
}

/// Copies a position and a flat colour.
fn programs() -> DrawPrograms {
    let mut vertex = Builder::new();
    let mut fragment = Builder::new();
    for slot in 0..8 {
        let input = vertex.input(slot, Type::B32, Rate::Varying);
        let output = vertex.output(slot, Type::B32);
        vertex.assign(output, input);
    }
    for slot in 0..4 {
        let input = fragment.input(slot, Type::B32, Rate::Varying);
        let output = fragment.output(slot, Type::B32);
        fragment.assign(output, input);
    }
    let attribute = |stream| (0..4).map(move |component| Some(VertexInput::Attribute { stream, component }));
    let positions = (0..4).map(|axis| Some(VertexOutput::Position(axis)));
    let varyings = (0..4).map(|index| Some(VertexOutput::Varying(index)));
    let inputs = (0..4).map(|index| {
        Some(FragmentInput::Varying { index, interpolation: Interpolation::Flat, sampling: Sampling::Center })
    });
    let outputs = (0..4).map(|component| Some(FragmentOutput::Color { attachment: 0, component, index: 0 }));
    DrawPrograms {
        vertex: vertex.finish().expect("a program"),
        vertex_inputs: attribute(0).chain(attribute(1)).collect(),
        vertex_outputs: positions.chain(varyings).collect(),
        varyings: 4,
        captured: None,
        tessellation: None,
        geometry: None,
        fragment: Some(FragmentPrograms {
            program: fragment.finish().expect("a program"),
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

/// Each invocation changes one vertex's colour: `color / 2 + 1/4`.
fn recolor() -> Program {
    let mut b = Builder::new();
    let group = b.input(0, Type::B32, Rate::Uniform);
    let lane = b.lane_index();
    let (size, bytes) = (b.u32(GROUP), b.u32(VERTEX as u32));
    let (half, quarter) = (b.f32(0.5), b.f32(0.25));
    let first = b.compute(Op::IMul, &[group, size]);
    let vertex = b.compute(Op::IAdd, &[first, lane]);
    let base = b.compute(Op::IMul, &[vertex, bytes]);
    for offset in [16, 20, 24, 28] {
        let address = Address { space: Space::Buffer(Binding::new(0)), base: Some(base), offset };
        let color = b.load(address, Word::B32, 1);
        let halved = b.compute(Op::FMul, &[color[0], half]);
        let changed = b.compute(Op::FAdd, &[halved, quarter]);
        b.store(address, Word::B32, &[changed]);
    }
    b.finish().expect("a program")
}

const WHOLE: Rect = Rect { x: 0, y: 0, width: SIZE, height: SIZE };

const COLOR: SubresourceLayers =
    SubresourceLayers { aspect: Aspect::Color, mip_level: 0, base_layer: 0, layer_count: 1 };

fn rect([x, y, width, height]: Area) -> Rect {
    Rect { x: x as i32, y: y as i32, width, height }
}

fn depth_clear(depth: f32) -> ClearValue {
    ClearValue::DepthStencil { depth, stencil: 0 }
}

fn depth_stencil(test: DepthTest) -> DepthStencil {
    DepthStencil {
        depth: test.map(|(op, write)| state::DepthTest {
            compare: match op {
                vk::CompareOp::LESS => CompareOp::Less,
                vk::CompareOp::LESS_OR_EQUAL => CompareOp::LessOrEqual,
                vk::CompareOp::GREATER => CompareOp::Greater,
                vk::CompareOp::NOT_EQUAL => CompareOp::NotEqual,
                vk::CompareOp::ALWAYS => CompareOp::Always,
                other => panic!("{other:?} is not among the steps"),
            },
            write,
        }),
        ..DepthStencil::default()
    }
}

fn blend(blends: bool) -> BlendState {
    let over = BlendEquation { source: BlendFactor::One, destination: BlendFactor::OneMinusSrcAlpha, op: BlendOp::Add };
    BlendState { equations: blends.then_some(BlendEquations::both(over)), write_mask: 0xF }
}

impl Resources {
    fn new(interleaving: &Interleaving) -> Self {
        let vertices: Vec<[[f32; 4]; 2]> = (interleaving.triangles.iter())
            .flat_map(|triangle| {
                triangle.corners.map(|corner| {
                    let [x, y, _, w] = to_clip(corner);
                    [[x, y, triangle.depth, w], triangle.color]
                })
            })
            .collect();
        Self {
            color: image(Format::R32G32B32A32Sfloat, [SIZE; 2], 1),
            depth: image(Format::D32Sfloat, [SIZE; 2], 1),
            vertices: buffer(vertices.as_flattened()),
            texels: buffer(&vec![0u8; (16 * SIZE * SIZE) as usize]),
            scenes: interleaving.scenes.iter().map(attributes).collect(),
        }
    }

    fn picture(&self) -> Picture {
        Picture { color: texels(&self.color, Aspect::Color), depth: texels(&self.depth, Aspect::Depth) }
    }
}

impl Player {
    /// Creates a device of one thread, since several run at the same time.
    pub fn new(flush: FlushPolicy) -> Self {
        Self::recording(flush, None)
    }

    /// Creates a device as [`Player::new`] does; `recorder`, if given, records its work.
    pub fn recording(flush: FlushPolicy, recorder: Option<Arc<Recorder>>) -> Self {
        let config =
            Config { threads: 1, simd: SimdLevel::Best, macro_tile_size: 32, flush, recorder, ..Config::default() };
        let device = Arc::new(Device::new(&config).expect("a device"));
        let inputs = vec![Some(ComputeInput::WorkgroupId(0))];
        let recolor = ComputeProgram::new(device.level(), recolor(), GROUP, 32, inputs);
        Self {
            pipeline: Arc::new(DrawPipeline::new(device.level(), &programs()).expect("a pipeline")),
            recolor: Arc::new(recolor.expect("a program")),
            device,
        }
    }

    /// The packets of an interleaving.
    pub fn packets(&self, interleaving: &Interleaving) -> Vec<Packet> {
        self.lower(interleaving, &Resources::new(interleaving))
    }

    /// Plays an interleaving and returns the contents of the attachments.
    pub fn play(&self, interleaving: &Interleaving) -> Picture {
        let resources = Resources::new(interleaving);
        let mut processor = CommandProcessor::new(Arc::clone(&self.device));
        for packet in self.lower(interleaving, &resources) {
            processor.execute(&packet).expect("it fits");
        }
        resources.picture()
    }

    fn lower(&self, interleaving: &Interleaving, resources: &Resources) -> Vec<Packet> {
        let steps = interleaving.steps.iter();
        steps.flat_map(|step| self.step(interleaving, resources, step)).collect()
    }

    fn step(&self, interleaving: &Interleaving, resources: &Resources, step: &Step) -> Vec<Packet> {
        match *step {
            Step::BeginPass(clear) => vec![begin_pass(resources, clear)],
            Step::EndPass => vec![Packet::EndRendering],
            Step::Triangles { first, count, blends, test } => {
                vec![self.triangles(resources, [first, count], blends, test)]
            }
            Step::Gaussians { scene, test } => gaussians(interleaving, resources, scene, test),
            Step::ClearAttachments { color, depth, area } => {
                let color = color.map(|color| AttachmentClear::Color { index: 0, value: ClearValue::Float(color) });
                let depth = depth.map(AttachmentClear::Depth);
                vec![Packet::ClearAttachments(ClearAttachments {
                    clears: color.into_iter().chain(depth).collect(),
                    rects: vec![(rect(area), 0, 1)],
                })]
            }
            Step::Barrier => vec![Packet::Barrier],
            Step::Dispatch => {
                let vertices = &resources.vertices;
                let count = (vertices.size / VERTEX) as u32 / GROUP;
                vec![Packet::Dispatch(Box::new(Dispatch {
                    program: Arc::clone(&self.recolor),
                    base: [0; 3],
                    count: [count, 1, 1],
                    bindings: Bindings {
                        buffers: vec![Some(vertices.clone())],
                        written: vec![Arc::clone(&vertices.memory)],
                        ..Bindings::default()
                    },
                }))]
            }
            Step::ClearImage(color) => vec![Packet::ClearImage(ClearImage {
                image: Arc::clone(&resources.color.image),
                value: ClearValue::Float(color),
                ranges: vec![SubresourceRange {
                    aspect: Aspect::Color,
                    base_mip_level: 0,
                    level_count: 1,
                    base_layer: 0,
                    layer_count: 1,
                }],
            })],
            Step::CopyThroughBuffer { from, to } => {
                let [x, y, width, height] = from;
                let copy = |[x, y]: [u32; 2]| CopyBufferImage {
                    buffer: resources.texels.clone(),
                    image: Arc::clone(&resources.color.image),
                    regions: vec![BufferImageRegion {
                        buffer_offset: 0,
                        buffer_row_length: 0,
                        buffer_image_height: 0,
                        subresource: COLOR,
                        image_offset: [x as i32, y as i32, 0],
                        image_extent: [width, height, 1],
                    }],
                };
                vec![Packet::CopyImageToBuffer(copy([x, y])), Packet::CopyBufferToImage(copy(to))]
            }
            Step::CopyColor { from, to } => {
                let color = |triangle: usize, corner: u64| (3 * triangle as u64 + corner) * VERTEX + 16;
                let region = |corner| BufferCopyRegion {
                    source_offset: color(from, corner),
                    target_offset: color(to, corner),
                    size: 16,
                };
                vec![Packet::CopyBuffer(CopyBuffer {
                    source: resources.vertices.clone(),
                    target: resources.vertices.clone(),
                    regions: (0..3).map(region).collect(),
                })]
            }
        }
    }

    fn triangles(&self, resources: &Resources, [first, count]: [usize; 2], blends: bool, test: DepthTest) -> Packet {
        let state = DrawState {
            depth_stencil: depth_stencil(test),
            blend: vec![blend(blends)],
            ..DrawState::new(Topology::TriangleList, [SIZE, SIZE])
        };
        let attribute = |offset| stream(&resources.vertices, VERTEX as u32, offset, Format::R32G32B32A32Sfloat);
        Packet::Draw(Box::new(Draw {
            pipeline: Arc::clone(&self.pipeline),
            state: Arc::new(state),
            attributes: vec![attribute(0), attribute(16)],
            vertex_bindings: Bindings::default(),
            primitive_bindings: PrimitiveBindings::default(),
            fragment_bindings: Bindings::default(),
            indices: None,
            first: 3 * first as u32,
            count: 3 * count as u32,
            first_instance: 0,
            instance_count: 1,
            draw_index: 0,
            transform_feedback: None,
        }))
    }
}

fn begin_pass(resources: &Resources, clear: Option<([f32; 4], f32)>) -> Packet {
    let attachment = |view: &ImageView, value: Option<ClearValue>| {
        Some(Attachment {
            view: view.clone(),
            load: value.map_or(LoadOp::Load, LoadOp::Clear),
            store: StoreOp::Store,
            resolve: None,
            multisampled: None,
        })
    };
    let color = clear.map(|(color, _)| ClearValue::Float(color));
    let depth = clear.map(|(_, depth)| depth_clear(depth));
    Packet::BeginRendering(Box::new(Rendering {
        area: WHOLE,
        layer_count: 1,
        view_mask: 0,
        color: vec![attachment(&resources.color, color)],
        depth: attachment(&resources.depth, depth),
        stencil: None,
    }))
}

fn gaussians(interleaving: &Interleaving, resources: &Resources, scene: usize, test: DepthTest) -> Vec<Packet> {
    let camera = &interleaving.camera;
    let begin = GaussianBegin {
        state: Arc::new(GaussianState {
            depth_stencil: depth_stencil(test),
            blend: vec![blend(true)],
            ..GaussianState::default()
        }),
        further_cameras: Vec::new(),
        camera: Camera {
            model: CameraModel::Pinhole,
            rotation: camera.rotation,
            eye: camera.eye,
            focal_length: camera.focal,
            principal_point: camera.principal,
            near_plane: camera.near,
            far_plane: camera.far,
            depth_coefficients: interleaving.depth_coefficients,
            distortion: None,
        },
        viewport: Viewport { x: 0.0, y: 0.0, width: SIZE as f32, height: SIZE as f32, min_depth: 0.0, max_depth: 1.0 },
        scissor: WHOLE,
    };
    let append = GaussianAppend {
        attributes: resources.scenes[scene].clone(),
        indices: None,
        first: 0,
        count: interleaving.scenes[scene].positions.len() as u32,
        first_instance: 0,
        instance_count: 1,
    };
    vec![Packet::GaussianBegin(Box::new(begin)), Packet::GaussianAppend(Box::new(append)), Packet::GaussianEnd]
}
