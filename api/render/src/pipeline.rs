//! The pipeline that draws a scene's Gaussians.

use std::sync::Arc;

use ash::vk;
use gaurast::vk::{
    GaussianAttributeLocationsGAURAST, GaussianLinearizationGAURAST, PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST,
    PipelineGaussianApproximationStateCreateInfoGAURAST, PipelineGaussianFootprintStateCreateInfoGAURAST,
    PipelineGaussianStateCreateInfoGAURAST,
};

use crate::device::Device;
use crate::encoded::Encoding;
use crate::error::{During, RenderError};
use crate::modes::{self, Kept, SigmaPoints};
use crate::settings::Settings;
use crate::target::DEPTH_FORMAT;
use gaurast_scene::GaussianShape;

/// The number of vertex buffers of a decoded scene: positions, shapes, spherical harmonics.
pub(super) const BINDINGS: usize = 3;

/// The layout of Gaussians in vertex buffers.
pub(super) enum VertexLayout<'a> {
    /// Numbers, in buffers of these strides.
    Decoded([u32; BINDINGS]),
    /// Integers that are decoded.
    Encoded(&'a Encoding),
}

impl VertexLayout<'_> {
    /// The strides of the vertex buffers.
    fn strides(&self) -> &[u32] {
        match self {
            Self::Decoded(strides) => strides,
            Self::Encoded(encoding) => &encoding.strides,
        }
    }

    /// The vertex attributes of a pipeline that draws harmonics of degree `sh_degree`.
    fn attributes(&self, sh_degree: u32) -> Vec<vk::VertexInputAttributeDescription> {
        match self {
            Self::Decoded(_) => attributes(sh_degree),
            Self::Encoded(encoding) => encoding.attributes(),
        }
    }
}

/// The first location of the spherical harmonics; those before are position, scale, rotation and
/// opacity.
const FIRST_SH: u32 = 4;

/// A pipeline with its layout.
pub(super) struct GaussianPipeline {
    handle: vk::Pipeline,
    layout: vk::PipelineLayout,
    device: Arc<Device>,
}

impl GaussianPipeline {
    /// A pipeline for vertex buffers of a layout. It draws with `settings`, whose degree must be stored, into an
    /// attachment of `format`, whose contents it replaces. If the settings keep a value, it writes that to a second
    /// attachment, of [`Kept::format`]. If there are triangles (`over_mesh`), Gaussians are blended over them, and a
    /// depth test leaves out those behind them.
    pub(super) fn new(
        device: &Arc<Device>,
        vertices: &VertexLayout<'_>,
        settings: Settings,
        format: vk::Format,
        over_mesh: bool,
    ) -> Result<Self, RenderError> {
        let raw = device.raw();
        // SAFETY: the structure is valid.
        let layout =
            unsafe { raw.create_pipeline_layout(&Default::default(), None) }.during("vkCreatePipelineLayout")?;
        let mut pipeline = Self { handle: vk::Pipeline::null(), layout, device: device.clone() };

        let strides = (0..).zip(vertices.strides());
        let bindings = strides
            .map(|(binding, stride)| vk::VertexInputBindingDescription::default().binding(binding).stride(*stride));
        let bindings: Vec<_> = bindings.collect();
        let attributes = vertices.attributes(settings.sh_degree);
        let vertex_input = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&bindings)
            .vertex_attribute_descriptions(&attributes);
        let input_assembly =
            vk::PipelineInputAssemblyStateCreateInfo::default().topology(PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST);
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
        let rasterization = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
        let multisample =
            vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
        // Without blending, (C, 1 - T) is written to the attachment.
        let (one, rest) = (vk::BlendFactor::ONE, vk::BlendFactor::ONE_MINUS_SRC_ALPHA);
        let attachments = [vk::PipelineColorBlendAttachmentState::default()
            .color_write_mask(vk::ColorComponentFlags::RGBA)
            .blend_enable(over_mesh)
            .src_color_blend_factor(one)
            .dst_color_blend_factor(rest)
            .src_alpha_blend_factor(one)
            .dst_alpha_blend_factor(rest); 2];
        let depth_test = vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(over_mesh)
            .depth_compare_op(vk::CompareOp::GREATER);
        let kept = settings.kept();
        let formats = [format, kept.map_or(vk::Format::UNDEFINED, Kept::format)];
        let count = if kept.is_some() { 2 } else { 1 };
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&attachments[..count]);
        let module = match kept {
            Some(kept) => Some(ShaderModule::new(device, &shader_words(kept.shader()))?),
            None => None,
        };
        let stages: Vec<_> = (module.iter()).map(|module| module.stage(vk::ShaderStageFlags::FRAGMENT)).collect();
        let dynamic_states = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic_states);
        let mut rendering = vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&formats[..count]);
        if over_mesh {
            rendering = rendering.depth_attachment_format(DEPTH_FORMAT);
        }
        let mut gaussian = PipelineGaussianStateCreateInfoGAURAST::default()
            .spherical_harmonics_degree(settings.sh_degree)
            .alpha_floor(settings.alpha_floor)
            .alpha_ceiling(settings.alpha_ceiling)
            .transmittance_floor(settings.transmittance_floor)
            .order(if settings.by_z { modes::LISTED } else { modes::raw_order(settings.order) })
            .geometry(modes::raw_geometry(settings.geometry))
            .precision(settings.precision.raw())
            .antialiasing(modes::raw_antialiasing(settings.antialiasing))
            .low_pass_variance(settings.low_pass_variance.unwrap_or(modes::low_pass_variance(settings.geometry)))
            .attribute_locations(
                GaussianAttributeLocationsGAURAST::default()
                    .position(0)
                    .scale(1)
                    .rotation(2)
                    .opacity(3)
                    .first_spherical_harmonics(FIRST_SH),
            );
        if let VertexLayout::Encoded(encoding) = vertices {
            gaussian = gaussian.flags(encoding.flags());
        }
        if let Some(kept) = kept {
            gaussian = gaussian.resolve_input_locations(kept.locations());
        }
        let mut approximation = PipelineGaussianApproximationStateCreateInfoGAURAST::default()
            .exponential_error(settings.exponential_error)
            .contribution_budget(settings.contribution_budget);
        let mut footprint = PipelineGaussianFootprintStateCreateInfoGAURAST::default()
            .cut_off(settings.cut_off.raw())
            .cut_off_deviations(settings.cut_off_deviations)
            .compensation_floor(settings.compensation_floor);
        let mut unscented = settings.sigma_points.map(SigmaPoints::raw);
        if unscented.is_some() {
            gaussian = gaussian.linearization(GaussianLinearizationGAURAST::UNSCENTED);
        }
        let mut decoding = match vertices {
            VertexLayout::Decoded(_) => None,
            VertexLayout::Encoded(encoding) => Some(encoding.state(settings.sh_degree)),
        };
        let mut create_info = vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&vertex_input)
            .input_assembly_state(&input_assembly)
            .viewport_state(&viewport)
            .rasterization_state(&rasterization)
            .multisample_state(&multisample)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(layout)
            .push_next(&mut gaussian)
            .push_next(&mut approximation)
            .push_next(&mut footprint)
            .push_next(&mut rendering);
        if let Some(decoding) = &mut decoding {
            create_info = create_info.push_next(decoding);
        }
        if let Some(unscented) = &mut unscented {
            create_info = create_info.push_next(unscented);
        }
        if over_mesh {
            create_info = create_info.depth_stencil_state(&depth_test);
        }
        // SAFETY: the structures are valid and live until the call returns.
        let created = unsafe { raw.create_graphics_pipelines(vk::PipelineCache::null(), &[create_info], None) };
        let handles = created.map_err(|(_, result)| result).during("vkCreateGraphicsPipelines")?;
        pipeline.handle = handles[0];
        Ok(pipeline)
    }

    pub(super) fn handle(&self) -> vk::Pipeline {
        self.handle
    }
}

/// The words of a SPIR-V module.
pub(super) fn shader_words(bytes: &[u8]) -> Vec<u32> {
    let words = bytes.chunks_exact(4);
    words.map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]])).collect()
}

/// A shader of one entry point, `main`.
pub(super) struct ShaderModule {
    handle: vk::ShaderModule,
    device: Arc<Device>,
}

impl ShaderModule {
    /// Creates the module of `words`.
    pub(super) fn new(device: &Arc<Device>, words: &[u32]) -> Result<Self, RenderError> {
        let create_info = vk::ShaderModuleCreateInfo::default().code(words);
        // SAFETY: the structure is valid, and the code is a shader of SPIR-V.
        let handle = unsafe { device.raw().create_shader_module(&create_info, None) }.during("vkCreateShaderModule")?;
        Ok(Self { handle, device: device.clone() })
    }

    /// The pipeline stage of the module.
    pub(super) fn stage(&self, stage: vk::ShaderStageFlags) -> vk::PipelineShaderStageCreateInfo<'static> {
        vk::PipelineShaderStageCreateInfo::default().stage(stage).module(self.handle).name(c"main")
    }
}

impl Drop for ShaderModule {
    fn drop(&mut self) {
        // SAFETY: pipelines outlive the modules that they are made of.
        unsafe {
            self.device.raw().destroy_shader_module(self.handle, None);
        }
    }
}

/// The vertex attributes: the places of a Gaussian's numbers in the vertex buffers.
fn attributes(sh_degree: u32) -> Vec<vk::VertexInputAttributeDescription> {
    let attribute = |location: u32, binding: u32, format, offset: usize| {
        vk::VertexInputAttributeDescription::default()
            .location(location)
            .binding(binding)
            .format(format)
            .offset(offset as u32)
    };
    let vec3 = vk::Format::R32G32B32_SFLOAT;
    let vec4 = vk::Format::R32G32B32A32_SFLOAT;
    let scalar = vk::Format::R32_SFLOAT;
    let mut attributes = vec![
        attribute(0, 0, vec3, 0),
        attribute(1, 1, vec3, std::mem::offset_of!(GaussianShape, scale)),
        attribute(2, 1, vec4, std::mem::offset_of!(GaussianShape, rotation)),
        attribute(3, 1, scalar, std::mem::offset_of!(GaussianShape, opacity)),
    ];
    let coefficients = (sh_degree + 1).pow(2);
    attributes.extend((0..coefficients).map(|k| attribute(FIRST_SH + k, 2, vec3, k as usize * size_of::<[f32; 3]>())));
    attributes
}

impl Drop for GaussianPipeline {
    fn drop(&mut self) {
        let raw = self.device.raw();
        // SAFETY: every submission has been waited for, so the device doesn't use the pipeline,
        // which may be null.
        unsafe {
            raw.destroy_pipeline(self.handle, None);
            raw.destroy_pipeline_layout(self.layout, None);
        }
    }
}
