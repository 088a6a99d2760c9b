//! Scenes in vertex buffers, and pipelines that draw them.

use ash::vk;
use gaurast::vk::{
    GaussianAttributeLocationsGAURAST, PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST,
    PipelineGaussianStateCreateInfoGAURAST,
};

use half::f16;

use super::{Buffer, Context};
use crate::scenes::SceneBuffers;

/// Vertex buffers: positions, scales, rotations, opacities, coefficients.
const BINDINGS: u32 = 5;

/// A scene in vertex buffers.
pub struct DeviceScene {
    pub(super) buffers: [Buffer; BINDINGS as usize],
    /// Number of Gaussians.
    pub count: u32,
    /// Degree of the coefficients.
    pub degree: u32,
}

impl DeviceScene {
    /// Copies `scene` to the device.
    pub fn new(context: &Context, scene: &SceneBuffers) -> Self {
        Self {
            buffers: [
                Buffer::of(context, &scene.positions),
                Buffer::of(context, &scene.scales),
                Buffer::of(context, &scene.rotations),
                Buffer::of(context, &scene.opacities),
                Buffer::of(context, &scene.sh),
            ],
            count: scene.positions.len() as u32,
            degree: scene.degree,
        }
    }

    /// Copies `scene` to the device as half floats, triples with a fourth component.
    pub fn half(context: &Context, scene: &SceneBuffers) -> Self {
        let half = |values: &[f32]| -> Vec<u16> {
            let values = values.iter();
            values
                .map(|&value| f16::from_f32(value).to_bits())
                .collect()
        };
        let triples = |triples: &[[f32; 3]]| {
            let padded: Vec<[f32; 4]> = triples.iter().map(|&[x, y, z]| [x, y, z, 0.0]).collect();
            Buffer::of(context, &half(padded.as_flattened()))
        };
        Self {
            buffers: [
                triples(&scene.positions),
                triples(&scene.scales),
                Buffer::of(context, &half(scene.rotations.as_flattened())),
                Buffer::of(context, &half(&scene.opacities)),
                triples(&scene.sh),
            ],
            count: scene.positions.len() as u32,
            degree: scene.degree,
        }
    }
}

/// What a [`Pipeline`] is made of.
#[derive(Clone, Copy)]
pub struct PipelineOptions<'a> {
    /// The Gaussian state; its degree and locations are filled in.
    pub state: PipelineGaussianStateCreateInfoGAURAST<'a>,
    /// The degree stored in the scenes that it draws.
    pub stored_degree: u32,
    /// The degree that it draws.
    pub drawn_degree: u32,
    /// The colour attachment's format.
    pub format: vk::Format,
    /// The colour attachment's blend state.
    pub blend: vk::PipelineColorBlendAttachmentState,
    /// The render pass that it is used in, or null for dynamic rendering.
    pub render_pass: vk::RenderPass,
    /// Whether opacity and coefficients advance by instance.
    pub looks_by_instance: bool,
    /// Whether scenes are stored as half floats.
    pub half: bool,
    /// Whether there are model matrices and factors of the opacity, and how they advance; see [`Instance`].
    pub instances: Option<vk::VertexInputRate>,
}

/// A model matrix's rows and a factor of the opacity, as [`Commands::bind_instances`](super::Commands::bind_instances)
/// takes them.
pub type Instance = [f32; 13];

/// The binding of [`Instance`]s, and the locations of what they hold.
pub(super) const INSTANCES: u32 = BINDINGS;
const MODEL_MATRIX: u32 = 24;
const MODEL_OPACITY: u32 = 27;

impl PipelineOptions<'_> {
    /// Draws scenes of `degree` in the default state, replacing what a 32-bit float target holds.
    pub fn new(degree: u32) -> Self {
        Self {
            state: PipelineGaussianStateCreateInfoGAURAST::default(),
            stored_degree: degree,
            drawn_degree: degree,
            format: vk::Format::R32G32B32A32_SFLOAT,
            blend: replace(),
            render_pass: vk::RenderPass::null(),
            looks_by_instance: false,
            half: false,
            instances: None,
        }
    }
}

/// The attachment takes (C, 1 - T).
pub fn replace() -> vk::PipelineColorBlendAttachmentState {
    vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA)
}

/// (C, 1 - T) over what the attachment holds.
pub fn over() -> vk::PipelineColorBlendAttachmentState {
    use vk::BlendFactor as Factor;
    replace()
        .blend_enable(true)
        .src_color_blend_factor(Factor::ONE)
        .dst_color_blend_factor(Factor::ONE_MINUS_SRC_ALPHA)
        .src_alpha_blend_factor(Factor::ONE)
        .dst_alpha_blend_factor(Factor::ONE_MINUS_SRC_ALPHA)
}

/// A pipeline that draws [`DeviceScene`]s, with dynamic viewport and scissor.
pub struct Pipeline {
    pub(super) raw: vk::Pipeline,
    layout: vk::PipelineLayout,
    context: Context,
}

impl Pipeline {
    /// Creates it.
    ///
    /// # Panics
    /// If the driver refuses it.
    pub fn new(context: &Context, options: &PipelineOptions) -> Self {
        let bindings = bindings(options);
        let attributes = all_attributes(options);
        let vertex_input = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&bindings)
            .vertex_attribute_descriptions(&attributes);
        let input_assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
            .topology(PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST);
        let viewport = vk::PipelineViewportStateCreateInfo::default()
            .viewport_count(1)
            .scissor_count(1);
        let rasterization = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
        let multisample = vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::TYPE_1);
        let attachments = [options.blend];
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&attachments);
        let dynamic_states = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic_states);
        let formats = [options.format];
        let mut rendering =
            vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&formats);
        let mut locations = attribute_locations();
        if options.instances.is_some() {
            locations = locations
                .first_model_matrix(MODEL_MATRIX)
                .model_opacity(MODEL_OPACITY);
        }
        let mut state = options
            .state
            .spherical_harmonics_degree(options.drawn_degree)
            .attribute_locations(locations);
        let mut create_info = vk::GraphicsPipelineCreateInfo::default()
            .vertex_input_state(&vertex_input)
            .input_assembly_state(&input_assembly)
            .viewport_state(&viewport)
            .rasterization_state(&rasterization)
            .multisample_state(&multisample)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .render_pass(options.render_pass)
            .push_next(&mut state);
        if options.render_pass == vk::RenderPass::null() {
            create_info = create_info.push_next(&mut rendering);
        }
        let device = context.device();
        // SAFETY: see `contexts`.
        unsafe {
            let layout = device
                .create_pipeline_layout(&vk::PipelineLayoutCreateInfo::default(), None)
                .expect("a layout");
            let create_infos = [create_info.layout(layout)];
            let pipelines = device
                .create_graphics_pipelines(vk::PipelineCache::null(), &create_infos, None)
                .expect("a pipeline");
            Self {
                raw: pipelines[0],
                layout,
                context: context.clone(),
            }
        }
    }
}

fn bindings(options: &PipelineOptions) -> Vec<vk::VertexInputBindingDescription> {
    let mut bindings = scene_bindings(options.stored_degree, options.looks_by_instance).to_vec();
    if options.half {
        let triples = (options.stored_degree + 1).pow(2);
        for (binding, stride) in bindings.iter_mut().zip([8, 8, 8, 2, 8 * triples]) {
            binding.stride = stride;
        }
    }
    bindings.extend(
        options
            .instances
            .map(|input_rate| vk::VertexInputBindingDescription {
                binding: INSTANCES,
                stride: size_of::<Instance>() as u32,
                input_rate,
            }),
    );
    bindings
}

fn all_attributes(options: &PipelineOptions) -> Vec<vk::VertexInputAttributeDescription> {
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

/// Where those attributes are.
pub(crate) fn attribute_locations() -> GaussianAttributeLocationsGAURAST {
    GaussianAttributeLocationsGAURAST::default()
        .position(0)
        .scale(1)
        .rotation(2)
        .opacity(3)
        .first_spherical_harmonics(4)
}

/// A scene's bindings: positions, scales, rotations, opacities, coefficients.
pub(crate) fn scene_bindings(
    degree: u32,
    looks_by_instance: bool,
) -> [vk::VertexInputBindingDescription; BINDINGS as usize] {
    let triples = (degree + 1).pow(2);
    let strides = [12, 12, 16, 4, 12 * triples];
    std::array::from_fn(|binding| {
        let by_instance = looks_by_instance && binding >= 3;
        vk::VertexInputBindingDescription {
            binding: binding as u32,
            stride: strides[binding],
            input_rate: if by_instance {
                vk::VertexInputRate::INSTANCE
            } else {
                vk::VertexInputRate::VERTEX
            },
        }
    })
}

/// The attributes in those bindings, up to a degree.
pub(crate) fn attributes(degree: u32) -> Vec<vk::VertexInputAttributeDescription> {
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

impl Drop for Pipeline {
    fn drop(&mut self) {
        let device = self.context.device();
        // SAFETY: see `contexts`.
        unsafe {
            device.destroy_pipeline(self.raw, None);
            device.destroy_pipeline_layout(self.layout, None);
        }
    }
}
