//! A device that packets control. Its vertex program writes its inputs.

use gaurast_testkit::packets::{attributes, buffer, image, texels};
use gaurast_tests::compare::{Limits, assert_contract};
use gaurast_tests::oracle::shaded::{OracleOutputs, OracleViewport, render_shaded};
use gaurast_tests::oracle::{OracleOrder, OracleState};
use gaurast_tests::scenes::SceneBuffers;
use simdevice::format::{Aspect, ClearValue};
use simdevice::isa::builder::Builder;
use simdevice::isa::ir::{Rate, Type};
use simdevice::packet::{
    Attachment, AttachmentResolve, AttributeStream, Draw, GaussianAppend, GaussianBegin, GaussianFragmentStage, LoadOp,
    PrimitiveBindings, Rendering, StoreOp,
};
use simdevice::program::bindings::Bindings;
use simdevice::program::interface::{DrawPrograms, VertexInput, VertexOutput, gaussian};
use simdevice::program::vertex::DrawPipeline;
use simdevice::runtime::SimdLevel;
use simdevice::state::gaussian::{Camera, GaussianOrder, GaussianState};
use simdevice::state::{
    BlendState, CompareOp, DepthStencil, DepthTest, DrawState, Rect, ResolveMode, Topology, Viewport,
};
use simdevice::stats::counters::Counters;
use simdevice::{CommandProcessor, Config, Device, Format, ImageView, Packet};
use std::sync::Arc;

/// The picture's size; neither side is a multiple of a tile's.
pub const SIZE: [u32; 2] = [150, 83];

/// The number of floats of a vertex: position, covariance, opacity, colour, key.
const NUMBERS: usize = 12;

pub const UPRIGHT: OracleViewport = OracleViewport { corner: [0.0, 0.0], size: [SIZE[0] as f32, SIZE[1] as f32] };

fn numbers(one: &OracleOutputs) -> [f32; NUMBERS] {
    let mut numbers = [0.0; NUMBERS];
    numbers[..4].copy_from_slice(&one.position);
    numbers[4..7].copy_from_slice(&one.covariance);
    numbers[7] = one.opacity;
    numbers[8..11].copy_from_slice(&one.color);
    numbers[11] = one.key.unwrap_or(0.0);
    numbers
}

/// A triangle at a depth of a quarter that only writes depth. Its edges cross pixels.
pub fn triangle(device: &Device, samples: u32) -> Draw {
    let mut builder = Builder::new();
    for slot in 0..4 {
        let input = builder.input(slot, Type::B32, Rate::Varying);
        let output = builder.output(slot, Type::B32);
        builder.assign(output, input);
    }
    let component = |component| Some(VertexInput::Attribute { stream: 0, component });
    let programs = DrawPrograms {
        vertex: builder.finish().expect("a program"),
        vertex_inputs: (0..4).map(component).collect(),
        vertex_outputs: (0..4).map(|axis| Some(VertexOutput::Position(axis))).collect(),
        varyings: 0,
        captured: None,
        tessellation: None,
        geometry: None,
        fragment: None,
    };
    let corners = [[-0.9f32, -0.8, 0.25, 1.0], [0.8, -0.3, 0.25, 1.0], [-0.2, 0.9, 0.25, 1.0]];
    let state = DrawState {
        samples,
        depth_stencil: DepthStencil {
            depth: Some(DepthTest { compare: CompareOp::Always, write: true }),
            ..DepthStencil::default()
        },
        ..DrawState::new(Topology::TriangleList, SIZE)
    };
    Draw {
        pipeline: Arc::new(DrawPipeline::new(device.level(), &programs).expect("a pipeline")),
        state: Arc::new(state),
        attributes: vec![AttributeStream {
            buffer: buffer(&corners),
            stride: 16,
            offset: 0,
            format: Format::R32G32B32A32Sfloat,
            instance_divisor: None,
        }],
        vertex_bindings: Bindings::default(),
        primitive_bindings: PrimitiveBindings::default(),
        fragment_bindings: Bindings::default(),
        indices: None,
        first: 0,
        count: 3,
        first_instance: 0,
        instance_count: 1,
        draw_index: 0,
        transform_feedback: None,
    }
}

/// A packet of all Gaussians of a scene of degree 0, which the device projects.
pub fn append(scene: &SceneBuffers) -> GaussianAppend {
    GaussianAppend {
        attributes: attributes(scene),
        indices: None,
        first: 0,
        count: scene.positions.len() as u32,
        first_instance: 0,
        instance_count: 1,
    }
}

/// A pipeline whose vertex program writes its inputs.
fn pipeline(device: &Device, with_key: bool) -> Arc<DrawPipeline> {
    let mut builder = Builder::new();
    for slot in 0..NUMBERS as u32 {
        let input = builder.input(slot, Type::B32, Rate::Varying);
        let output = builder.output(slot, Type::B32);
        builder.assign(output, input);
    }
    let varyings = if with_key { gaussian::VARYINGS } else { gaussian::DEPTH_KEY };
    let positions = (0..4).map(|axis| Some(VertexOutput::Position(axis)));
    let varying = |number| (number < varyings).then_some(VertexOutput::Varying(number));
    let programs = DrawPrograms {
        vertex: builder.finish().expect("a program"),
        vertex_inputs: (0..NUMBERS)
            .map(|number| Some(VertexInput::Attribute { stream: number / 4, component: number % 4 }))
            .collect(),
        vertex_outputs: positions.chain((0..gaussian::VARYINGS).map(varying)).collect(),
        varyings,
        captured: None,
        tessellation: None,
        geometry: None,
        fragment: None,
    };
    Arc::new(DrawPipeline::of_gaussians(device.level(), &programs).expect("a pipeline"))
}

/// Blending in which a fragment replaces the attachment's contents.
pub const REPLACE: BlendState = BlendState { equations: None, write_mask: 0xF };

/// A set of Gaussians to draw.
pub struct Case<'a> {
    pub state: OracleState,
    pub viewport: OracleViewport,
    pub outputs: &'a [OracleOutputs],
    /// The parts of them that are separate draws.
    pub draws: Vec<Draw>,
    /// True if clip space's depths are from -w, not from 0, to w.
    pub negative_one_to_one: bool,
    pub depth: Option<(CompareOp, bool)>,
    pub resolve: Option<GaussianFragmentStage>,
    /// The draws before.
    pub before: Vec<Draw>,
    /// Gaussians that the device projects, with their camera, in place of the draws.
    pub fixed: Option<(GaussianAppend, Camera)>,
    /// The blending of each colour attachment. All attachments are cleared to `clear`.
    pub blend: Vec<BlendState>,
    pub clear: [f32; 4],
    /// The depth attachment's format.
    pub depth_format: Format,
    pub samples: u32,
}

/// The results of drawing.
pub struct Drawn {
    /// The colours of the first attachment.
    pub color: Vec<[f32; 4]>,
    /// The colours of the other attachments.
    pub others: Vec<Vec<[f32; 4]>>,
    /// The depths, if their format is binary32.
    pub depth: Vec<f32>,
    pub counters: Counters,
}

/// A draw of Gaussians `first..first + count`.
pub fn draw(device: &Device, outputs: &[OracleOutputs], first: u32, count: u32) -> Draw {
    let numbers: Vec<_> = outputs.iter().flat_map(numbers).collect();
    let numbers = buffer(&numbers);
    let stream = |number: u32| AttributeStream {
        buffer: numbers.clone(),
        stride: 4 * NUMBERS as u32,
        offset: 16 * number,
        format: Format::R32G32B32A32Sfloat,
        instance_divisor: None,
    };
    Draw {
        pipeline: pipeline(device, outputs.iter().all(|one| one.key.is_some())),
        state: Arc::new(DrawState::new(Topology::PointList, [0; 2])),
        attributes: (0..3).map(stream).collect(),
        vertex_bindings: Bindings::default(),
        primitive_bindings: PrimitiveBindings::default(),
        fragment_bindings: Bindings::default(),
        indices: None,
        first,
        count,
        first_instance: 0,
        instance_count: 1,
        draw_index: 0,
        transform_feedback: None,
    }
}

pub fn whole<'a>(device: &Device, outputs: &'a [OracleOutputs]) -> Case<'a> {
    Case {
        state: OracleState::default(),
        viewport: UPRIGHT,
        outputs,
        draws: vec![draw(device, outputs, 0, outputs.len() as u32)],
        negative_one_to_one: false,
        depth: None,
        resolve: None,
        before: Vec::new(),
        fixed: None,
        blend: vec![REPLACE],
        clear: [0.0; 4],
        depth_format: Format::D32Sfloat,
        samples: 1,
    }
}

impl Case<'_> {
    fn state(&self) -> GaussianState {
        let state = &self.state;
        GaussianState {
            order: match state.order {
                OracleOrder::ViewDepth => GaussianOrder::ViewDepth,
                OracleOrder::RadialDistance => GaussianOrder::RadialDistance,
                OracleOrder::Primitive => GaussianOrder::Primitive,
                OracleOrder::PerPixel => GaussianOrder::PerPixel,
            },
            opacity_compensated: state.opacity_compensated,
            low_pass_variance: state.low_pass,
            alpha_floor: state.alpha_floor,
            alpha_ceiling: state.alpha_ceiling,
            transmittance_floor: state.transmittance_floor,
            negative_one_to_one: self.negative_one_to_one,
            depth_stencil: DepthStencil {
                depth: self.depth.map(|(compare, write)| DepthTest { compare, write }),
                ..DepthStencil::default()
            },
            blend: self.blend.clone(),
            ..GaussianState::default()
        }
    }

    /// Draws it over cleared attachments, with depths of one half.
    pub fn run(&self, device: &Arc<Device>) -> Drawn {
        let color = |_: &BlendState| image(Format::R32G32B32A32Sfloat, SIZE, self.samples);
        let colors: Vec<_> = self.blend.iter().map(color).collect();
        let resolved: Vec<_> = (self.blend.iter()).map(|_| image(Format::R32G32B32A32Sfloat, SIZE, 1)).collect();
        let depth = image(self.depth_format, SIZE, self.samples);
        let attachment = |view: &ImageView, value| Attachment {
            view: view.clone(),
            load: LoadOp::Clear(value),
            store: StoreOp::Store,
            resolve: None,
            multisampled: None,
        };
        let everything = Rect { x: 0, y: 0, width: SIZE[0], height: SIZE[1] };
        let stored = ClearValue::DepthStencil { depth: 0.5, stencil: 0 };
        let given = Viewport {
            x: self.viewport.corner[0],
            y: self.viewport.corner[1],
            width: self.viewport.size[0],
            height: self.viewport.size[1],
            min_depth: 0.0,
            max_depth: 1.0,
        };
        let (appends, camera) = match &self.fixed {
            Some((append, camera)) => (vec![append.clone()], *camera),
            None => (Vec::new(), Camera::default()),
        };
        let draws = if appends.is_empty() { &self.draws[..] } else { &[] };
        let mut packets = vec![Packet::BeginRendering(Box::new(Rendering {
            area: everything,
            layer_count: 1,
            view_mask: 0,
            color: std::iter::zip(&colors, &resolved)
                .map(|(color, to)| {
                    let attachment = attachment(color, ClearValue::Float(self.clear));
                    let mode = ResolveMode::Average;
                    Some(Attachment {
                        resolve: (self.samples > 1).then(|| AttachmentResolve { view: to.clone(), mode }),
                        ..attachment
                    })
                })
                .collect(),
            depth: Some(attachment(&depth, stored)),
            stencil: None,
        }))];
        let before = self.before.iter().cloned();
        packets.extend(before.map(|draw| Packet::Draw(Box::new(draw))));
        packets.push(Packet::GaussianBegin(Box::new(GaussianBegin {
            state: Arc::new(self.state()),
            camera,
            further_cameras: Vec::new(),
            viewport: Viewport { x: 0.0, y: 0.0, width: SIZE[0] as f32, height: SIZE[1] as f32, ..given },
            scissor: everything,
        })));
        let shader = self.resolve.iter().cloned();
        packets.extend(shader.map(|shader| Packet::GaussianFragmentStage(Box::new(shader))));
        let append = |append| Packet::GaussianAppend(Box::new(append));
        packets.extend(appends.into_iter().map(append));
        packets.extend(draws.iter().map(|draw| {
            let state = DrawState { viewports: vec![given], ..DrawState::clone(&draw.state) };
            Packet::GaussianAppendDraw(Box::new(Draw { state: Arc::new(state), ..draw.clone() }))
        }));
        packets.extend([Packet::GaussianEnd, Packet::EndRendering]);
        let mut processor = CommandProcessor::new(Arc::clone(device));
        for packet in &packets {
            processor.execute(packet).expect("it fits");
        }
        let drawn = if self.samples > 1 { &resolved } else { &colors };
        let mut drawn = drawn.iter().map(|view| texels(view, Aspect::Color));
        let has_floats = self.depth_format == Format::D32Sfloat && self.samples == 1;
        Drawn {
            color: drawn.next().expect("an attachment"),
            others: drawn.collect(),
            depth: if has_floats { texels(&depth, Aspect::Depth) } else { Vec::new() },
            counters: processor.counters().clone(),
        }
    }

    /// Draws it and compares it with the reference.
    #[track_caller]
    pub fn check(&self, name: &str, device: &Arc<Device>) -> Drawn {
        let drawn = self.run(device);
        let reference = render_shaded(self.outputs, SIZE, &self.viewport, &self.state);
        assert!(reference.nominal.iter().any(|rgba| rgba[3] > 0.9), "{name}: it is empty");
        assert_contract(name, &drawn.color, &reference, Limits::ENVELOPE_ONLY);
        drawn
    }
}

pub fn device(simd: SimdLevel) -> Arc<Device> {
    let config = Config { threads: 2, simd, ..Config::default() };
    Arc::new(Device::new(&config).expect("a device"))
}
