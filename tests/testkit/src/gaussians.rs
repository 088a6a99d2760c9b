//! Gaussians: scenes in vertex buffers, and pipelines that draw them.

use ash::vk;
use gaurast::vk::{
    GaussianAttributeLocationsGAURAST, GaussianCameraGAURAST, PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST,
    PipelineGaussianApproximationStateCreateInfoGAURAST, PipelineGaussianFootprintStateCreateInfoGAURAST,
    PipelineGaussianStateCreateInfoGAURAST, PipelineGaussianUnscentedStateCreateInfoGAURAST,
};
use gaurast_oracle::scenes::SceneBuffers;
use half::f16;

use crate::descriptors::Bindings;
use crate::gpu::{Commands, Gpu};
use crate::pass::{Attachments, Bindable, Formats};
use crate::pipeline::{Graphics, Pipeline, Shader, opaque};
use crate::resource::Buffer;

/// Vertex buffers: positions, scales, rotations, opacities, coefficients.
const BINDINGS: u32 = 5;

/// A scene in vertex buffers.
pub struct GaussianScene {
    buffers: [Buffer; BINDINGS as usize],
    /// Number of Gaussians.
    pub count: u32,
    /// Degree of the coefficients.
    pub degree: u32,
}

impl GaussianScene {
    /// Creates the vertex buffers of `scene` on the device.
    pub fn new(gpu: &Gpu, scene: &SceneBuffers) -> Self {
        Self {
            buffers: [
                Buffer::of(gpu, &scene.positions),
                Buffer::of(gpu, &scene.scales),
                Buffer::of(gpu, &scene.rotations),
                Buffer::of(gpu, &scene.opacities),
                Buffer::of(gpu, &scene.sh),
            ],
            count: scene.positions.len() as u32,
            degree: scene.degree,
        }
    }

    /// Creates the vertex buffers of `scene` as half floats; triples get a fourth component.
    pub fn half(gpu: &Gpu, scene: &SceneBuffers) -> Self {
        let half = |values: &[f32]| -> Vec<u16> {
            let values = values.iter();
            values.map(|&value| f16::from_f32(value).to_bits()).collect()
        };
        let triples = |triples: &[[f32; 3]]| {
            let padded: Vec<[f32; 4]> = triples.iter().map(|&[x, y, z]| [x, y, z, 0.0]).collect();
            Buffer::of(gpu, &half(padded.as_flattened()))
        };
        Self {
            buffers: [
                triples(&scene.positions),
                triples(&scene.scales),
                Buffer::of(gpu, &half(scene.rotations.as_flattened())),
                Buffer::of(gpu, &half(&scene.opacities)),
                triples(&scene.sh),
            ],
            count: scene.positions.len() as u32,
            degree: scene.degree,
        }
    }

    /// Binds the scene's vertex buffers and sets the camera.
    ///
    /// # Panics
    /// If the device doesn't draw Gaussians.
    pub fn bind(&self, commands: &Commands, pipeline: &GaussianPipeline, camera: &GaussianCameraGAURAST) {
        commands.bind(pipeline);
        self.bind_buffers(commands);
        commands.camera(camera);
    }

    /// Binds the scene's vertex buffers.
    pub fn bind_buffers(&self, commands: &Commands) {
        for (binding, buffer) in (0..).zip(&self.buffers) {
            commands.vertex_buffer(binding, buffer, 0);
        }
    }

    /// Draws all of it, as seen by `camera`.
    ///
    /// # Panics
    /// If the device doesn't draw Gaussians.
    pub fn draw(&self, commands: &Commands, pipeline: &GaussianPipeline, camera: &GaussianCameraGAURAST) {
        self.bind(commands, pipeline, camera);
        commands.draw(0..self.count);
    }
}

/// Binds the instance buffer that a pipeline with [`GaussianOptions::instances`] reads.
pub fn bind_instances(commands: &Commands, instances: &Buffer) {
    commands.vertex_buffer(INSTANCES, instances, 0);
}

/// The options of a [`GaussianPipeline`].
#[derive(Clone)]
pub struct GaussianOptions<'a> {
    /// The Gaussian state. The pipeline sets its degree and locations.
    pub state: PipelineGaussianStateCreateInfoGAURAST<'a>,
    /// The approximations that it may use.
    pub approximation: Option<PipelineGaussianApproximationStateCreateInfoGAURAST<'static>>,
    /// The pixels that Gaussians may reach.
    pub footprint: Option<PipelineGaussianFootprintStateCreateInfoGAURAST<'static>>,
    /// The sigma points of the unscented transform.
    pub unscented: Option<PipelineGaussianUnscentedStateCreateInfoGAURAST<'static>>,
    /// The resolve shader.
    pub resolve: Option<Shader>,
    /// The descriptor set.
    pub set: Option<&'a Bindings>,
    /// The degree stored in the scenes that it draws.
    pub stored_degree: u32,
    /// The degree that it draws.
    pub drawn_degree: u32,
    /// True if opacity and coefficients advance by instance.
    pub looks_by_instance: bool,
    /// True if scenes are stored as half floats.
    pub half: bool,
    /// The input rate of model matrices and opacity factors ([`Instance`]), or `None` if there are none.
    pub instances: Option<vk::VertexInputRate>,
    /// The formats of its attachments.
    pub formats: Formats,
    /// The render pass in which it is used, or `None` for dynamic rendering.
    pub render_pass: Option<vk::RenderPass>,
    /// True if depths before the viewport are from -1, not from 0, to 1.
    pub negative_one_to_one: bool,
    /// Depth and stencil tests.
    pub depth_stencil: vk::PipelineDepthStencilStateCreateInfo<'static>,
    /// The samples of each 32 that are written.
    pub sample_mask: u32,
    /// Blending of each colour attachment; further attachments use the first.
    pub blend: Vec<vk::PipelineColorBlendAttachmentState>,
    /// A logic operation instead of blending.
    pub logic_op: Option<vk::LogicOp>,
    /// Dynamic states in addition to viewport and scissor.
    pub dynamic: Vec<vk::DynamicState>,
}

/// A model matrix's rows and a factor of the opacity, as bindings of instances hold them.
pub type Instance = [f32; 13];

/// The binding of [`Instance`]s; their locations follow.
const INSTANCES: u32 = BINDINGS;
const MODEL_MATRIX: u32 = 24;
const MODEL_OPACITY: u32 = 27;

impl GaussianOptions<'_> {
    /// Options for scenes of `degree` in the default state, which replace the contents of a 32-bit float target,
    /// without tests.
    pub fn new(degree: u32) -> Self {
        Self {
            state: PipelineGaussianStateCreateInfoGAURAST::default(),
            approximation: None,
            footprint: None,
            unscented: None,
            resolve: None,
            set: None,
            stored_degree: degree,
            drawn_degree: degree,
            looks_by_instance: false,
            half: false,
            instances: None,
            formats: Formats::of(vk::Format::R32G32B32A32_SFLOAT),
            render_pass: None,
            negative_one_to_one: false,
            depth_stencil: vk::PipelineDepthStencilStateCreateInfo::default(),
            sample_mask: u32::MAX,
            blend: vec![opaque()],
            logic_op: None,
            dynamic: Vec::new(),
        }
    }

    /// Options for scenes of `degree` in the default state, which blend over the contents of a target, without tests.
    pub fn over(degree: u32, target: &impl Attachments) -> Self {
        Self { formats: target.attachment_formats(), blend: vec![over()], ..Self::new(degree) }
    }

    /// All state of the pipeline.
    pub fn graphics(&self) -> Graphics<'_> {
        let mut locations = attribute_locations();
        if self.instances.is_some() {
            locations = locations.first_model_matrix(MODEL_MATRIX).model_opacity(MODEL_OPACITY);
        }
        let state = self.state.spherical_harmonics_degree(self.drawn_degree).attribute_locations(locations);
        let mut blend = self.blend.clone();
        blend.resize(self.formats.colors.len(), self.blend[0]);
        let mut dynamic = vec![vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        dynamic.extend(&self.dynamic);
        Graphics {
            shaders: self.resolve.iter().cloned().collect(),
            set_layouts: self.set.iter().map(|set| set.layout).collect(),
            bindings: bindings(self),
            attributes: all_attributes(self),
            topology: PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST,
            sample_mask: Some(self.sample_mask),
            negative_one_to_one: self.negative_one_to_one,
            depth_stencil: self.depth_stencil,
            logic_op: self.logic_op,
            blend,
            dynamic,
            multisample: vk::PipelineMultisampleStateCreateInfo::default()
                .rasterization_samples(vk::SampleCountFlags::from_raw(self.formats.samples)),
            formats: self.formats.colors.clone(),
            depth_format: self.formats.depth,
            subpass: self.render_pass.map(|pass| (pass, 0)),
            gaussian: Some(state),
            approximation: self.approximation,
            footprint: self.footprint,
            unscented: self.unscented,
            ..Graphics::default()
        }
    }
}

/// Blending of (C, 1 - T) over the attachment's contents.
pub fn over() -> vk::PipelineColorBlendAttachmentState {
    use vk::BlendFactor as Factor;
    opaque()
        .blend_enable(true)
        .src_color_blend_factor(Factor::ONE)
        .dst_color_blend_factor(Factor::ONE_MINUS_SRC_ALPHA)
        .src_alpha_blend_factor(Factor::ONE)
        .dst_alpha_blend_factor(Factor::ONE_MINUS_SRC_ALPHA)
}

/// A pipeline that draws [`GaussianScene`]s, with dynamic viewport and scissor.
pub struct GaussianPipeline(Pipeline);

impl GaussianPipeline {
    /// Creates the pipeline.
    ///
    /// # Panics
    /// If the driver refuses it.
    pub fn new(gpu: &Gpu, options: &GaussianOptions<'_>) -> Self {
        Self(options.graphics().create(gpu).expect("a pipeline"))
    }
}

impl Bindable for GaussianPipeline {
    fn handles(&self) -> (vk::Pipeline, vk::PipelineLayout) {
        self.0.handles()
    }
}

fn bindings(options: &GaussianOptions<'_>) -> Vec<vk::VertexInputBindingDescription> {
    let mut bindings = scene_bindings(options.stored_degree, options.looks_by_instance).to_vec();
    if options.half {
        let triples = (options.stored_degree + 1).pow(2);
        for (binding, stride) in bindings.iter_mut().zip([8, 8, 8, 2, 8 * triples]) {
            binding.stride = stride;
        }
    }
    bindings.extend(options.instances.map(|input_rate| vk::VertexInputBindingDescription {
        binding: INSTANCES,
        stride: size_of::<Instance>() as u32,
        input_rate,
    }));
    bindings
}

fn all_attributes(options: &GaussianOptions<'_>) -> Vec<vk::VertexInputAttributeDescription> {
    let mut attributes = attributes(options.drawn_degree);
    if options.half {
        for attribute in &mut attributes {
            (attribute.format, attribute.offset) = match attribute.format {
                vk::Format::R32_SFLOAT => (vk::Format::R16_SFLOAT, 0),
                _ => (vk::Format::R16G16B16A16_SFLOAT, attribute.offset / 12 * 8),
            };
        }
    }
    let attribute = |location, format, floats: u32| vk::VertexInputAttributeDescription {
        location,
        binding: INSTANCES,
        format,
        offset: 4 * floats,
    };
    if options.instances.is_some() {
        let row = |row| attribute(MODEL_MATRIX + row, vk::Format::R32G32B32A32_SFLOAT, 4 * row);
        attributes.extend((0..3).map(row));
        attributes.push(attribute(MODEL_OPACITY, vk::Format::R32_SFLOAT, 12));
    }
    attributes
}

/// The attribute locations of a Gaussian.
pub fn attribute_locations() -> GaussianAttributeLocationsGAURAST {
    GaussianAttributeLocationsGAURAST::default()
        .position(0)
        .scale(1)
        .rotation(2)
        .opacity(3)
        .first_spherical_harmonics(4)
}

/// The bindings of a scene: positions, scales, rotations, opacities, coefficients.
pub fn scene_bindings(degree: u32, looks_by_instance: bool) -> [vk::VertexInputBindingDescription; BINDINGS as usize] {
    let triples = (degree + 1).pow(2);
    let strides = [12, 12, 16, 4, 12 * triples];
    std::array::from_fn(|binding| {
        let by_instance = looks_by_instance && binding >= 3;
        vk::VertexInputBindingDescription {
            binding: binding as u32,
            stride: strides[binding],
            input_rate: if by_instance { vk::VertexInputRate::INSTANCE } else { vk::VertexInputRate::VERTEX },
        }
    })
}

/// The attributes in those bindings, with coefficients up to a degree.
pub fn attributes(degree: u32) -> Vec<vk::VertexInputAttributeDescription> {
    let attribute = |location: u32, binding, format, offset| vk::VertexInputAttributeDescription {
        location,
        binding,
        format,
        offset,
    };
    let triple = vk::Format::R32G32B32_SFLOAT;
    let mut attributes = vec![
        attribute(0, 0, triple, 0),
        attribute(1, 1, triple, 0),
        attribute(2, 2, vk::Format::R32G32B32A32_SFLOAT, 0),
        attribute(3, 3, vk::Format::R32_SFLOAT, 0),
    ];
    attributes.extend((0..(degree + 1).pow(2)).map(|k| attribute(4 + k, 4, triple, 12 * k)));
    attributes
}
