//! Vulkan objects of the counted workloads, which are destroyed together.

use std::sync::Arc;

use ash::vk;
use gaurast_render::device::{Device, MemoryPreference};
use gaurast_render::{During, RenderError};

/// Objects of one device. They exist until no submission uses any of them.
pub(super) struct Objects {
    images: Vec<(vk::Image, vk::ImageView)>,
    memories: Vec<vk::DeviceMemory>,
    samplers: Vec<vk::Sampler>,
    set_layouts: Vec<vk::DescriptorSetLayout>,
    pools: Vec<vk::DescriptorPool>,
    layouts: Vec<vk::PipelineLayout>,
    modules: Vec<vk::ShaderModule>,
    pipelines: Vec<vk::Pipeline>,
    device: Arc<Device>,
}

impl Objects {
    /// An empty list of objects.
    pub(super) fn new(device: &Arc<Device>) -> Self {
        Self {
            images: Vec::new(),
            memories: Vec::new(),
            samplers: Vec::new(),
            set_layouts: Vec::new(),
            pools: Vec::new(),
            layouts: Vec::new(),
            modules: Vec::new(),
            pipelines: Vec::new(),
            device: device.clone(),
        }
    }

    /// The device of all objects.
    pub(super) fn device(&self) -> &Arc<Device> {
        &self.device
    }

    /// An image with memory, and a view of all its levels.
    pub(super) fn image(
        &mut self,
        create_info: &vk::ImageCreateInfo<'_>,
        aspects: vk::ImageAspectFlags,
    ) -> Result<(vk::Image, vk::ImageView), RenderError> {
        let raw = self.device.raw();
        // SAFETY: the structure is valid.
        let image = unsafe { raw.create_image(create_info, None) }.during("vkCreateImage")?;
        self.images.push((image, vk::ImageView::null()));
        // SAFETY: the image is the device's.
        let requirements = unsafe { raw.get_image_memory_requirements(image) };
        let preferences =
            [vk::MemoryPropertyFlags::DEVICE_LOCAL, vk::MemoryPropertyFlags::empty()].map(MemoryPreference::having);
        let memory_type = self
            .device
            .memory_type(requirements.memory_type_bits, &preferences)
            .ok_or(RenderError::NoMemory("device"))?;
        let allocate_info =
            vk::MemoryAllocateInfo::default().allocation_size(requirements.size).memory_type_index(memory_type);
        // SAFETY: the structure is valid.
        let memory = unsafe { raw.allocate_memory(&allocate_info, None) }.during("vkAllocateMemory")?;
        self.memories.push(memory);
        // SAFETY: the memory is new, and of the size and a type that the image requires.
        unsafe { raw.bind_image_memory(image, memory, 0) }.during("vkBindImageMemory")?;
        let view_info = vk::ImageViewCreateInfo::default()
            .image(image)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(create_info.format)
            .subresource_range(whole(aspects));
        // SAFETY: the structure is valid, and the image is bound to memory.
        let view = unsafe { raw.create_image_view(&view_info, None) }.during("vkCreateImageView")?;
        if let Some(last) = self.images.last_mut() {
            last.1 = view;
        }
        Ok((image, view))
    }

    /// A sampler.
    pub(super) fn sampler(&mut self, create_info: &vk::SamplerCreateInfo<'_>) -> Result<vk::Sampler, RenderError> {
        // SAFETY: the structure is valid.
        let sampler = unsafe { self.device.raw().create_sampler(create_info, None) }.during("vkCreateSampler")?;
        self.samplers.push(sampler);
        Ok(sampler)
    }

    /// A pipeline layout of one descriptor set, and that set. It has one descriptor of `kind` at each binding below
    /// `count`.
    pub(super) fn descriptors(
        &mut self,
        kind: vk::DescriptorType,
        count: u32,
        stages: vk::ShaderStageFlags,
    ) -> Result<(vk::PipelineLayout, vk::DescriptorSet), RenderError> {
        let raw = self.device.raw();
        let bindings: Vec<_> = (0..count)
            .map(|binding| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(binding)
                    .descriptor_type(kind)
                    .descriptor_count(1)
                    .stage_flags(stages)
            })
            .collect();
        let create_info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        // SAFETY: the structure is valid.
        let set_layout =
            unsafe { raw.create_descriptor_set_layout(&create_info, None) }.during("vkCreateDescriptorSetLayout")?;
        self.set_layouts.push(set_layout);
        let set_layouts = [set_layout];
        let create_info = vk::PipelineLayoutCreateInfo::default().set_layouts(&set_layouts);
        // SAFETY: the structure is valid.
        let layout = unsafe { raw.create_pipeline_layout(&create_info, None) }.during("vkCreatePipelineLayout")?;
        self.layouts.push(layout);
        let sizes = [vk::DescriptorPoolSize { ty: kind, descriptor_count: count }];
        let create_info = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
        // SAFETY: the structure is valid.
        let pool = unsafe { raw.create_descriptor_pool(&create_info, None) }.during("vkCreateDescriptorPool")?;
        self.pools.push(pool);
        let allocate_info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&set_layouts);
        // SAFETY: the structure is valid, and the pool is large enough for the set.
        let sets = unsafe { raw.allocate_descriptor_sets(&allocate_info) }.during("vkAllocateDescriptorSets")?;
        Ok((layout, sets[0]))
    }

    /// A shader stage of the SPIR-V `code`, which is valid and has the entry point `main`.
    pub(super) fn stage(
        &mut self,
        stage: vk::ShaderStageFlags,
        code: &[u8],
    ) -> Result<vk::PipelineShaderStageCreateInfo<'static>, RenderError> {
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(code);
        let create_info = vk::ShaderModuleCreateInfo::default().code(&words);
        // SAFETY: the code is valid SPIR-V.
        let module =
            unsafe { self.device.raw().create_shader_module(&create_info, None) }.during("vkCreateShaderModule")?;
        self.modules.push(module);
        Ok(vk::PipelineShaderStageCreateInfo::default().stage(stage).module(module).name(c"main"))
    }

    /// A graphics pipeline, whose structures are valid.
    pub(super) fn graphics_pipeline(
        &mut self,
        create_info: vk::GraphicsPipelineCreateInfo<'_>,
    ) -> Result<vk::Pipeline, RenderError> {
        // SAFETY: the structures are valid and live until the call returns.
        let created =
            unsafe { (self.device.raw()).create_graphics_pipelines(vk::PipelineCache::null(), &[create_info], None) };
        self.keep(created, "vkCreateGraphicsPipelines")
    }

    /// A compute pipeline, whose structures are valid.
    pub(super) fn compute_pipeline(
        &mut self,
        create_info: vk::ComputePipelineCreateInfo<'_>,
    ) -> Result<vk::Pipeline, RenderError> {
        // SAFETY: the structures are valid and live until the call returns.
        let created =
            unsafe { (self.device.raw()).create_compute_pipelines(vk::PipelineCache::null(), &[create_info], None) };
        self.keep(created, "vkCreateComputePipelines")
    }

    fn keep(
        &mut self,
        created: Result<Vec<vk::Pipeline>, (Vec<vk::Pipeline>, vk::Result)>,
        call: &'static str,
    ) -> Result<vk::Pipeline, RenderError> {
        let pipelines = created.map_err(|(_, result)| result).during(call)?;
        self.pipelines.extend_from_slice(&pipelines);
        Ok(pipelines[0])
    }
}

/// All levels of the only layer of an image.
fn whole(aspects: vk::ImageAspectFlags) -> vk::ImageSubresourceRange {
    vk::ImageSubresourceRange::default().aspect_mask(aspects).level_count(vk::REMAINING_MIP_LEVELS).layer_count(1)
}

/// A barrier that changes an image from the undefined layout to layout `to`, without access masks.
pub(super) fn begin_image(
    image: vk::Image,
    aspects: vk::ImageAspectFlags,
    to: vk::ImageLayout,
) -> vk::ImageMemoryBarrier<'static> {
    vk::ImageMemoryBarrier::default()
        .image(image)
        .new_layout(to)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .subresource_range(whole(aspects))
}

impl Drop for Objects {
    fn drop(&mut self) {
        let raw = self.device.raw();
        // SAFETY: every submission has been waited for, and each object is destroyed before the objects that it uses.
        // Pools free their sets, and views may be null.
        unsafe {
            for pipeline in &self.pipelines {
                raw.destroy_pipeline(*pipeline, None);
            }
            for module in &self.modules {
                raw.destroy_shader_module(*module, None);
            }
            for layout in &self.layouts {
                raw.destroy_pipeline_layout(*layout, None);
            }
            for pool in &self.pools {
                raw.destroy_descriptor_pool(*pool, None);
            }
            for layout in &self.set_layouts {
                raw.destroy_descriptor_set_layout(*layout, None);
            }
            for sampler in &self.samplers {
                raw.destroy_sampler(*sampler, None);
            }
            for (image, view) in &self.images {
                raw.destroy_image_view(*view, None);
                raw.destroy_image(*image, None);
            }
            for memory in &self.memories {
                raw.free_memory(*memory, None);
            }
        }
    }
}
