//! The pipeline that blends quads from back to front, and the buffer from which it reads them.

use std::sync::Arc;

use ash::vk;

use gaurast_render::device::Device;
use gaurast_render::resource::Buffer;
use gaurast_render::{COLOR_FORMAT, During, RenderError};

/// The push constants: the size of a pixel in normalised device coordinates, and the alpha floor.
pub(super) type Push = [f32; 3];

/// The stages that read the push constants.
const STAGES: vk::ShaderStageFlags =
    vk::ShaderStageFlags::from_raw(vk::ShaderStageFlags::VERTEX.as_raw() | vk::ShaderStageFlags::FRAGMENT.as_raw());

/// A pipeline, its layouts and its descriptor set.
pub(super) struct QuadPipeline {
    handle: vk::Pipeline,
    layout: vk::PipelineLayout,
    set_layout: vk::DescriptorSetLayout,
    pool: vk::DescriptorPool,
    set: vk::DescriptorSet,
    device: Arc<Device>,
}

impl QuadPipeline {
    pub(super) fn new(device: &Arc<Device>) -> Result<Self, RenderError> {
        let mut pipeline = Self {
            handle: vk::Pipeline::null(),
            layout: vk::PipelineLayout::null(),
            set_layout: vk::DescriptorSetLayout::null(),
            pool: vk::DescriptorPool::null(),
            set: vk::DescriptorSet::null(),
            device: device.clone(),
        };
        pipeline.create_layouts()?;
        pipeline.create_set()?;
        let mut modules = [vk::ShaderModule::null(); 2];
        let created = pipeline.create(&mut modules);
        for module in modules {
            // SAFETY: the pipeline no longer needs its modules, which may be null.
            unsafe { device.raw().destroy_shader_module(module, None) };
        }
        created?;
        Ok(pipeline)
    }

    fn create_layouts(&mut self) -> Result<(), RenderError> {
        let raw = self.device.raw();
        let bindings = [vk::DescriptorSetLayoutBinding::default()
            .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
            .descriptor_count(1)
            .stage_flags(vk::ShaderStageFlags::VERTEX)];
        let create_info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        // SAFETY: the structure is valid.
        self.set_layout =
            unsafe { raw.create_descriptor_set_layout(&create_info, None) }.during("vkCreateDescriptorSetLayout")?;
        let layouts = [self.set_layout];
        let ranges = [vk::PushConstantRange::default().stage_flags(STAGES).size(size_of::<Push>() as u32)];
        let create_info = vk::PipelineLayoutCreateInfo::default().set_layouts(&layouts).push_constant_ranges(&ranges);
        // SAFETY: the structure is valid.
        self.layout = unsafe { raw.create_pipeline_layout(&create_info, None) }.during("vkCreatePipelineLayout")?;
        Ok(())
    }

    fn create_set(&mut self) -> Result<(), RenderError> {
        let raw = self.device.raw();
        let sizes = [vk::DescriptorPoolSize { ty: vk::DescriptorType::STORAGE_BUFFER, descriptor_count: 1 }];
        let create_info = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
        // SAFETY: the structure is valid.
        self.pool = unsafe { raw.create_descriptor_pool(&create_info, None) }.during("vkCreateDescriptorPool")?;
        let layouts = [self.set_layout];
        let allocate_info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(self.pool).set_layouts(&layouts);
        // SAFETY: the structure is valid, and the pool is large enough for the set.
        let sets = unsafe { raw.allocate_descriptor_sets(&allocate_info) }.during("vkAllocateDescriptorSets")?;
        self.set = sets[0];
        Ok(())
    }

    /// Makes the pipeline of shader modules that the caller destroys.
    fn create(&mut self, modules: &mut [vk::ShaderModule; 2]) -> Result<(), RenderError> {
        let raw = self.device.raw();
        let code: [&[u8]; 2] = [include_bytes!("shaders/quad.vert.spv"), include_bytes!("shaders/quad.frag.spv")];
        for (module, code) in modules.iter_mut().zip(code) {
            let words: Vec<u32> = bytemuck::pod_collect_to_vec(code);
            let create_info = vk::ShaderModuleCreateInfo::default().code(&words);
            // SAFETY: the code is valid SPIR-V.
            *module = unsafe { raw.create_shader_module(&create_info, None) }.during("vkCreateShaderModule")?;
        }
        let stage =
            |stage, module| vk::PipelineShaderStageCreateInfo::default().stage(stage).module(module).name(c"main");
        let stages =
            [stage(vk::ShaderStageFlags::VERTEX, modules[0]), stage(vk::ShaderStageFlags::FRAGMENT, modules[1])];
        let vertex_input = vk::PipelineVertexInputStateCreateInfo::default();
        let input_assembly =
            vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
        let rasterization = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
        let multisample =
            vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
        // Premultiplied "over", for alpha too: the attachment ends with (C, 1 - T).
        let attachments = [vk::PipelineColorBlendAttachmentState::default()
            .blend_enable(true)
            .src_color_blend_factor(vk::BlendFactor::ONE)
            .dst_color_blend_factor(vk::BlendFactor::ONE_MINUS_SRC_ALPHA)
            .src_alpha_blend_factor(vk::BlendFactor::ONE)
            .dst_alpha_blend_factor(vk::BlendFactor::ONE_MINUS_SRC_ALPHA)
            .color_write_mask(vk::ColorComponentFlags::RGBA)];
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&attachments);
        let dynamic_states = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic_states);
        let formats = [COLOR_FORMAT];
        let mut rendering = vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&formats);
        let create_info = vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&vertex_input)
            .input_assembly_state(&input_assembly)
            .viewport_state(&viewport)
            .rasterization_state(&rasterization)
            .multisample_state(&multisample)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(self.layout)
            .push_next(&mut rendering);
        // SAFETY: the structures are valid and live until the call returns.
        let created = unsafe { raw.create_graphics_pipelines(vk::PipelineCache::null(), &[create_info], None) };
        let handles = created.map_err(|(_, result)| result).during("vkCreateGraphicsPipelines")?;
        self.handle = handles[0];
        Ok(())
    }

    /// Reads quads from `buffer` from now on. No submission may be pending.
    pub(super) fn pull_from(&self, buffer: &Buffer) {
        let info = [vk::DescriptorBufferInfo { buffer: buffer.handle(), offset: 0, range: vk::WHOLE_SIZE }];
        let write = vk::WriteDescriptorSet::default()
            .dst_set(self.set)
            .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
            .buffer_info(&info);
        // SAFETY: the set is unused, and the buffer is a storage buffer of the same device.
        unsafe { self.device.raw().update_descriptor_sets(&[write], &[]) };
    }

    /// Binds the pipeline and its descriptor set, and sets the push constants.
    pub(super) fn bind(&self, commands: vk::CommandBuffer, push: &Push) {
        let (raw, graphics) = (self.device.raw(), vk::PipelineBindPoint::GRAPHICS);
        // SAFETY: the command buffer is recording, and everything is of the same device.
        unsafe {
            raw.cmd_bind_pipeline(commands, graphics, self.handle);
            raw.cmd_bind_descriptor_sets(commands, graphics, self.layout, 0, &[self.set], &[]);
            raw.cmd_push_constants(commands, self.layout, STAGES, 0, bytemuck::cast_slice(push));
        }
    }
}

impl Drop for QuadPipeline {
    fn drop(&mut self) {
        let raw = self.device.raw();
        // SAFETY: every submission has been waited for; handles may be null; the pool frees its
        // set.
        unsafe {
            raw.destroy_pipeline(self.handle, None);
            raw.destroy_pipeline_layout(self.layout, None);
            raw.destroy_descriptor_pool(self.pool, None);
            raw.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}
