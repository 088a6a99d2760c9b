//! Pipelines of points, lines and triangles, to be changed before they are created, and what it takes to draw by them.

use crate::gpu::Gpu;
use crate::scene::{FORMAT, replace};
use ash::vk;

/// The format of depth and stencil.
pub const DEPTH_FORMAT: vk::Format = vk::Format::D32_SFLOAT_S8_UINT;

/// A vertex as most tests store it: a position in clip space and a colour.
pub type Vertex = [f32; 8];

/// A vertex in the middle of the depth range.
pub fn vertex(x: f32, y: f32, color: [f32; 4]) -> Vertex {
    deep_vertex([x, y, 0.5], color)
}

/// A vertex at a depth.
pub fn deep_vertex([x, y, z]: [f32; 3], [r, g, b, a]: [f32; 4]) -> Vertex {
    [x, y, z, 1.0, r, g, b, a]
}

/// A shader stage: its SPIR-V and its specialization constants, by number.
#[derive(Clone)]
pub struct Shader {
    pub stage: vk::ShaderStageFlags,
    pub words: Vec<u32>,
    pub constants: Vec<(u32, f32)>,
}

/// A vertex shader.
pub fn vertex_shader(words: Vec<u32>) -> Shader {
    Shader {
        stage: vk::ShaderStageFlags::VERTEX,
        words,
        constants: Vec::new(),
    }
}

/// A fragment shader.
pub fn fragment_shader(words: Vec<u32>) -> Shader {
    Shader {
        stage: vk::ShaderStageFlags::FRAGMENT,
        words,
        constants: Vec::new(),
    }
}

/// A pipeline for [`Vertex`]es over one colour attachment.
#[derive(Clone)]
pub struct Request {
    pub shaders: Vec<Shader>,
    pub set_layouts: Vec<vk::DescriptorSetLayout>,
    pub bindings: Vec<vk::VertexInputBindingDescription>,
    pub divisors: Vec<vk::VertexInputBindingDivisorDescriptionKHR>,
    pub attributes: Vec<vk::VertexInputAttributeDescription>,
    pub topology: vk::PrimitiveTopology,
    pub restart: bool,
    pub viewports: u32,
    pub provoking_last: bool,
    pub raster: vk::PipelineRasterizationStateCreateInfo<'static>,
    pub multisample: vk::PipelineMultisampleStateCreateInfo<'static>,
    pub depth_stencil: vk::PipelineDepthStencilStateCreateInfo<'static>,
    pub logic_op: Option<vk::LogicOp>,
    pub blend: Vec<vk::PipelineColorBlendAttachmentState>,
    pub blend_constants: [f32; 4],
    pub dynamic: Vec<vk::DynamicState>,
    pub formats: Vec<vk::Format>,
    pub depth_format: vk::Format,
    pub has_layout: bool,
    /// The subpass that it is for, in place of dynamic rendering.
    pub subpass: Option<(vk::RenderPass, u32)>,
}

impl Default for Request {
    fn default() -> Self {
        let attribute = |location| vk::VertexInputAttributeDescription {
            location,
            binding: 0,
            format: vk::Format::R32G32B32A32_SFLOAT,
            offset: location * 16,
        };
        Self {
            shaders: vec![
                vertex_shader(crate::spirv!("colored.vert")),
                fragment_shader(crate::spirv!("colored.frag")),
            ],
            set_layouts: Vec::new(),
            bindings: vec![vk::VertexInputBindingDescription {
                binding: 0,
                stride: size_of::<Vertex>() as u32,
                input_rate: vk::VertexInputRate::VERTEX,
            }],
            divisors: Vec::new(),
            attributes: vec![attribute(0), attribute(1)],
            topology: vk::PrimitiveTopology::TRIANGLE_LIST,
            restart: false,
            viewports: 1,
            provoking_last: false,
            raster: vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0),
            multisample: vk::PipelineMultisampleStateCreateInfo::default()
                .rasterization_samples(vk::SampleCountFlags::TYPE_1),
            depth_stencil: vk::PipelineDepthStencilStateCreateInfo::default(),
            logic_op: None,
            blend: vec![replace()],
            blend_constants: [0.0; 4],
            dynamic: vec![vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR],
            formats: vec![FORMAT],
            depth_format: vk::Format::UNDEFINED,
            has_layout: true,
            subpass: None,
        }
    }
}

/// A pipeline and its layout.
#[derive(Clone, Copy, Debug)]
pub struct Made {
    pub pipeline: vk::Pipeline,
    pub layout: vk::PipelineLayout,
}

impl Made {
    /// Destroys both.
    pub fn destroy(self, gpu: &Gpu) {
        // SAFETY: see the crate.
        unsafe {
            gpu.device.destroy_pipeline(self.pipeline, None);
            gpu.device.destroy_pipeline_layout(self.layout, None);
        }
    }
}

impl Request {
    /// The same with a state more dynamic.
    pub fn with_dynamic(mut self, state: vk::DynamicState) -> Self {
        self.dynamic.push(state);
        self
    }

    /// The same with another fragment shader.
    pub fn with_fragment(mut self, words: Vec<u32>) -> Self {
        self.shaders[1] = fragment_shader(words);
        self
    }

    /// Creates it.
    pub fn create(&self, gpu: &Gpu) -> Result<Made, vk::Result> {
        let layout = self.layout(gpu);
        let created = self.create_over(gpu, layout);
        if created.is_err() {
            // SAFETY: see the crate.
            unsafe { gpu.device.destroy_pipeline_layout(layout, None) };
        }
        created.map(|pipeline| Made { pipeline, layout })
    }

    fn layout(&self, gpu: &Gpu) -> vk::PipelineLayout {
        let ranges = [vk::PushConstantRange::default()
            .stage_flags(vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT)
            .size(64)];
        let info = vk::PipelineLayoutCreateInfo::default()
            .set_layouts(&self.set_layouts)
            .push_constant_ranges(&ranges);
        // SAFETY: see the crate.
        unsafe { gpu.device.create_pipeline_layout(&info, None).unwrap() }
    }

    fn create_over(
        &self,
        gpu: &Gpu,
        layout: vk::PipelineLayout,
    ) -> Result<vk::Pipeline, vk::Result> {
        let device = &gpu.device;
        let modules: Vec<_> = self
            .shaders
            .iter()
            .map(|shader| {
                let info = vk::ShaderModuleCreateInfo::default().code(&shader.words);
                // SAFETY: see the crate.
                unsafe { device.create_shader_module(&info, None).unwrap() }
            })
            .collect();
        let entries: Vec<Vec<_>> = self.shaders.iter().map(map_entries).collect();
        let values: Vec<Vec<f32>> = self
            .shaders
            .iter()
            .map(|shader| shader.constants.iter().map(|it| it.1).collect())
            .collect();
        let specializations: Vec<_> = std::iter::zip(&entries, &values)
            .map(|(entries, values)| {
                vk::SpecializationInfo::default()
                    .map_entries(entries)
                    .data(bytemuck::cast_slice(values))
            })
            .collect();
        let stages: Vec<_> = (0..self.shaders.len())
            .map(|index| {
                vk::PipelineShaderStageCreateInfo::default()
                    .stage(self.shaders[index].stage)
                    .module(modules[index])
                    .name(c"main")
                    .specialization_info(&specializations[index])
            })
            .collect();
        let created = self.create_of(gpu, layout, &stages);
        for module in modules {
            // SAFETY: see the crate.
            unsafe { device.destroy_shader_module(module, None) };
        }
        created
    }

    fn create_of(
        &self,
        gpu: &Gpu,
        layout: vk::PipelineLayout,
        stages: &[vk::PipelineShaderStageCreateInfo],
    ) -> Result<vk::Pipeline, vk::Result> {
        let mut divisors = vk::PipelineVertexInputDivisorStateCreateInfoKHR::default()
            .vertex_binding_divisors(&self.divisors);
        let mut vertex_input = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&self.bindings)
            .vertex_attribute_descriptions(&self.attributes);
        if !self.divisors.is_empty() {
            vertex_input = vertex_input.push_next(&mut divisors);
        }
        let mut provoking = vk::PipelineRasterizationProvokingVertexStateCreateInfoEXT::default()
            .provoking_vertex_mode(vk::ProvokingVertexModeEXT::LAST_VERTEX);
        let mut raster = self.raster;
        if self.provoking_last {
            raster = raster.push_next(&mut provoking);
        }
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
            .topology(self.topology)
            .primitive_restart_enable(self.restart);
        let viewport = vk::PipelineViewportStateCreateInfo::default()
            .viewport_count(self.viewports)
            .scissor_count(self.viewports);
        let blend = vk::PipelineColorBlendStateCreateInfo::default()
            .attachments(&self.blend)
            .logic_op_enable(self.logic_op.is_some())
            .logic_op(self.logic_op.unwrap_or_default())
            .blend_constants(self.blend_constants);
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&self.dynamic);
        let mut rendering = vk::PipelineRenderingCreateInfo::default()
            .color_attachment_formats(&self.formats)
            .depth_attachment_format(self.depth_format)
            .stencil_attachment_format(if self.depth_format == DEPTH_FORMAT {
                self.depth_format
            } else {
                vk::Format::UNDEFINED
            });
        let info = vk::GraphicsPipelineCreateInfo::default()
            .stages(stages)
            .vertex_input_state(&vertex_input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&raster)
            .multisample_state(&self.multisample)
            .depth_stencil_state(&self.depth_stencil)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(if self.has_layout {
                layout
            } else {
                vk::PipelineLayout::null()
            });
        let info = match self.subpass {
            Some((render_pass, subpass)) => info.render_pass(render_pass).subpass(subpass),
            None => info.push_next(&mut rendering),
        };
        let cache = vk::PipelineCache::null();
        // SAFETY: see the crate.
        let created = unsafe { gpu.device.create_graphics_pipelines(cache, &[info], None) };
        match created {
            Ok(pipelines) => Ok(pipelines[0]),
            Err((pipelines, error)) => {
                assert_eq!(pipelines, [vk::Pipeline::null()]);
                Err(error)
            }
        }
    }
}

fn map_entries(shader: &Shader) -> Vec<vk::SpecializationMapEntry> {
    let entry = |(index, &(constant_id, _)): (usize, &(u32, f32))| vk::SpecializationMapEntry {
        constant_id,
        offset: index as u32 * 4,
        size: 4,
    };
    shader.constants.iter().enumerate().map(entry).collect()
}
