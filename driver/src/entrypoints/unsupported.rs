//! Core commands that the driver does not execute yet. Their names must be there, because ash aborts the process
//! when an application calls a core command that wasn't found; calling one fails with a message. One that is recorded
//! makes `vkEndCommandBuffer` fail: it never draws something else.
//!
//! To implement a command, delete its line here and point its row of the dispatch table at the new function.

use crate::entrypoints::{Outcome, Return, guard, vulkan_name};
use crate::error::Error;
use crate::handle;
use ash::vk;
use std::ffi::c_void;

/// What refuses an unsupported command.
trait Refuse: Copy {
    /// Remembers that `command` was refused, where that matters later.
    ///
    /// # Safety
    /// As [`handle::get`].
    unsafe fn refuse(self, command: &str);
}

/// The command returns its error at once.
impl Refuse for vk::Device {
    unsafe fn refuse(self, _: &str) {}
}

/// The command returns its error at once.
impl Refuse for vk::Queue {
    unsafe fn refuse(self, _: &str) {}
}

/// The recording fails when it ends.
impl Refuse for vk::CommandBuffer {
    unsafe fn refuse(self, command: &str) {
        // SAFETY: the caller's promise.
        if let Ok(command_buffer) = unsafe { handle::get(self) } {
            command_buffer.fail(Error::Unsupported {
                command: command.to_owned(),
            });
        }
    }
}

/// What an unsupported command yields.
enum Never {}

impl<R: Return> Outcome<R> for Never {
    fn into_return(self) -> R {
        match self {}
    }
}

fn refuse<H: Refuse>(caller: H, function: &str) -> Result<Never, Error> {
    let command = vulkan_name(function);
    // SAFETY: entry points pass the application's own handle, which is valid or refused.
    unsafe { caller.refuse(&command) };
    Err(Error::Unsupported { command })
}

macro_rules! unsupported {
    ($(fn $name:ident($first:ident: $first_type:ty $(, $argument:ident: $type:ty)*) $(-> $return:ty)?;)*) => {$(
        #[allow(clippy::too_many_arguments, reason = "Vulkan's signature")]
        pub(crate) unsafe extern "system" fn $name($first: $first_type, $(_: $type),*) $(-> $return)? {
            guard($first, stringify!($name), || refuse($first, stringify!($name)))
        }
    )*};
}

unsupported! {
    fn queue_submit(queue: vk::Queue, submit_count: u32, submits: *const vk::SubmitInfo<'_>, fence: vk::Fence) -> vk::Result;
    fn queue_wait_idle(queue: vk::Queue) -> vk::Result;
    fn device_wait_idle(device: vk::Device) -> vk::Result;
    fn allocate_memory(device: vk::Device, allocate_info: *const vk::MemoryAllocateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, memory: *mut vk::DeviceMemory) -> vk::Result;
    fn free_memory(device: vk::Device, memory: vk::DeviceMemory, allocator: *const vk::AllocationCallbacks<'_>);
    fn map_memory(device: vk::Device, memory: vk::DeviceMemory, offset: vk::DeviceSize, size: vk::DeviceSize, flags: vk::MemoryMapFlags, data: *mut *mut c_void) -> vk::Result;
    fn unmap_memory(device: vk::Device, memory: vk::DeviceMemory);
    fn flush_mapped_memory_ranges(device: vk::Device, memory_range_count: u32, memory_ranges: *const vk::MappedMemoryRange<'_>) -> vk::Result;
    fn invalidate_mapped_memory_ranges(device: vk::Device, memory_range_count: u32, memory_ranges: *const vk::MappedMemoryRange<'_>) -> vk::Result;
    fn get_device_memory_commitment(device: vk::Device, memory: vk::DeviceMemory, committed_memory_in_bytes: *mut vk::DeviceSize);
    fn bind_buffer_memory(device: vk::Device, buffer: vk::Buffer, memory: vk::DeviceMemory, memory_offset: vk::DeviceSize) -> vk::Result;
    fn bind_image_memory(device: vk::Device, image: vk::Image, memory: vk::DeviceMemory, memory_offset: vk::DeviceSize) -> vk::Result;
    fn get_buffer_memory_requirements(device: vk::Device, buffer: vk::Buffer, memory_requirements: *mut vk::MemoryRequirements);
    fn get_image_memory_requirements(device: vk::Device, image: vk::Image, memory_requirements: *mut vk::MemoryRequirements);
    fn get_image_sparse_memory_requirements(device: vk::Device, image: vk::Image, sparse_memory_requirement_count: *mut u32, sparse_memory_requirements: *mut vk::SparseImageMemoryRequirements);
    fn queue_bind_sparse(queue: vk::Queue, bind_info_count: u32, bind_info: *const vk::BindSparseInfo<'_>, fence: vk::Fence) -> vk::Result;
    fn create_fence(device: vk::Device, create_info: *const vk::FenceCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, fence: *mut vk::Fence) -> vk::Result;
    fn destroy_fence(device: vk::Device, fence: vk::Fence, allocator: *const vk::AllocationCallbacks<'_>);
    fn reset_fences(device: vk::Device, fence_count: u32, fences: *const vk::Fence) -> vk::Result;
    fn get_fence_status(device: vk::Device, fence: vk::Fence) -> vk::Result;
    fn wait_for_fences(device: vk::Device, fence_count: u32, fences: *const vk::Fence, wait_all: vk::Bool32, timeout: u64) -> vk::Result;
    fn create_semaphore(device: vk::Device, create_info: *const vk::SemaphoreCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, semaphore: *mut vk::Semaphore) -> vk::Result;
    fn destroy_semaphore(device: vk::Device, semaphore: vk::Semaphore, allocator: *const vk::AllocationCallbacks<'_>);
    fn create_event(device: vk::Device, create_info: *const vk::EventCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, event: *mut vk::Event) -> vk::Result;
    fn destroy_event(device: vk::Device, event: vk::Event, allocator: *const vk::AllocationCallbacks<'_>);
    fn get_event_status(device: vk::Device, event: vk::Event) -> vk::Result;
    fn set_event(device: vk::Device, event: vk::Event) -> vk::Result;
    fn reset_event(device: vk::Device, event: vk::Event) -> vk::Result;
    fn create_query_pool(device: vk::Device, create_info: *const vk::QueryPoolCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, query_pool: *mut vk::QueryPool) -> vk::Result;
    fn destroy_query_pool(device: vk::Device, query_pool: vk::QueryPool, allocator: *const vk::AllocationCallbacks<'_>);
    fn get_query_pool_results(device: vk::Device, query_pool: vk::QueryPool, first_query: u32, query_count: u32, data_size: usize, data: *mut c_void, stride: vk::DeviceSize, flags: vk::QueryResultFlags) -> vk::Result;
    fn create_buffer(device: vk::Device, create_info: *const vk::BufferCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, buffer: *mut vk::Buffer) -> vk::Result;
    fn destroy_buffer(device: vk::Device, buffer: vk::Buffer, allocator: *const vk::AllocationCallbacks<'_>);
    fn create_buffer_view(device: vk::Device, create_info: *const vk::BufferViewCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, view: *mut vk::BufferView) -> vk::Result;
    fn destroy_buffer_view(device: vk::Device, buffer_view: vk::BufferView, allocator: *const vk::AllocationCallbacks<'_>);
    fn create_image(device: vk::Device, create_info: *const vk::ImageCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, image: *mut vk::Image) -> vk::Result;
    fn destroy_image(device: vk::Device, image: vk::Image, allocator: *const vk::AllocationCallbacks<'_>);
    fn get_image_subresource_layout(device: vk::Device, image: vk::Image, subresource: *const vk::ImageSubresource, layout: *mut vk::SubresourceLayout);
    fn create_image_view(device: vk::Device, create_info: *const vk::ImageViewCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, view: *mut vk::ImageView) -> vk::Result;
    fn destroy_image_view(device: vk::Device, image_view: vk::ImageView, allocator: *const vk::AllocationCallbacks<'_>);
    fn create_shader_module(device: vk::Device, create_info: *const vk::ShaderModuleCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, shader_module: *mut vk::ShaderModule) -> vk::Result;
    fn destroy_shader_module(device: vk::Device, shader_module: vk::ShaderModule, allocator: *const vk::AllocationCallbacks<'_>);
    fn create_pipeline_cache(device: vk::Device, create_info: *const vk::PipelineCacheCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, pipeline_cache: *mut vk::PipelineCache) -> vk::Result;
    fn destroy_pipeline_cache(device: vk::Device, pipeline_cache: vk::PipelineCache, allocator: *const vk::AllocationCallbacks<'_>);
    fn get_pipeline_cache_data(device: vk::Device, pipeline_cache: vk::PipelineCache, data_size: *mut usize, data: *mut c_void) -> vk::Result;
    fn merge_pipeline_caches(device: vk::Device, dst_cache: vk::PipelineCache, src_cache_count: u32, src_caches: *const vk::PipelineCache) -> vk::Result;
    fn create_graphics_pipelines(device: vk::Device, pipeline_cache: vk::PipelineCache, create_info_count: u32, create_infos: *const vk::GraphicsPipelineCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, pipelines: *mut vk::Pipeline) -> vk::Result;
    fn create_compute_pipelines(device: vk::Device, pipeline_cache: vk::PipelineCache, create_info_count: u32, create_infos: *const vk::ComputePipelineCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, pipelines: *mut vk::Pipeline) -> vk::Result;
    fn destroy_pipeline(device: vk::Device, pipeline: vk::Pipeline, allocator: *const vk::AllocationCallbacks<'_>);
    fn create_pipeline_layout(device: vk::Device, create_info: *const vk::PipelineLayoutCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, pipeline_layout: *mut vk::PipelineLayout) -> vk::Result;
    fn destroy_pipeline_layout(device: vk::Device, pipeline_layout: vk::PipelineLayout, allocator: *const vk::AllocationCallbacks<'_>);
    fn create_sampler(device: vk::Device, create_info: *const vk::SamplerCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, sampler: *mut vk::Sampler) -> vk::Result;
    fn destroy_sampler(device: vk::Device, sampler: vk::Sampler, allocator: *const vk::AllocationCallbacks<'_>);
    fn create_descriptor_set_layout(device: vk::Device, create_info: *const vk::DescriptorSetLayoutCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, set_layout: *mut vk::DescriptorSetLayout) -> vk::Result;
    fn destroy_descriptor_set_layout(device: vk::Device, descriptor_set_layout: vk::DescriptorSetLayout, allocator: *const vk::AllocationCallbacks<'_>);
    fn create_descriptor_pool(device: vk::Device, create_info: *const vk::DescriptorPoolCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, descriptor_pool: *mut vk::DescriptorPool) -> vk::Result;
    fn destroy_descriptor_pool(device: vk::Device, descriptor_pool: vk::DescriptorPool, allocator: *const vk::AllocationCallbacks<'_>);
    fn reset_descriptor_pool(device: vk::Device, descriptor_pool: vk::DescriptorPool, flags: vk::DescriptorPoolResetFlags) -> vk::Result;
    fn allocate_descriptor_sets(device: vk::Device, allocate_info: *const vk::DescriptorSetAllocateInfo<'_>, descriptor_sets: *mut vk::DescriptorSet) -> vk::Result;
    fn free_descriptor_sets(device: vk::Device, descriptor_pool: vk::DescriptorPool, descriptor_set_count: u32, descriptor_sets: *const vk::DescriptorSet) -> vk::Result;
    fn update_descriptor_sets(device: vk::Device, descriptor_write_count: u32, descriptor_writes: *const vk::WriteDescriptorSet<'_>, descriptor_copy_count: u32, descriptor_copies: *const vk::CopyDescriptorSet<'_>);
    fn create_framebuffer(device: vk::Device, create_info: *const vk::FramebufferCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, framebuffer: *mut vk::Framebuffer) -> vk::Result;
    fn destroy_framebuffer(device: vk::Device, framebuffer: vk::Framebuffer, allocator: *const vk::AllocationCallbacks<'_>);
    fn create_render_pass(device: vk::Device, create_info: *const vk::RenderPassCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, render_pass: *mut vk::RenderPass) -> vk::Result;
    fn destroy_render_pass(device: vk::Device, render_pass: vk::RenderPass, allocator: *const vk::AllocationCallbacks<'_>);
    fn get_render_area_granularity(device: vk::Device, render_pass: vk::RenderPass, granularity: *mut vk::Extent2D);
    fn create_command_pool(device: vk::Device, create_info: *const vk::CommandPoolCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, command_pool: *mut vk::CommandPool) -> vk::Result;
    fn destroy_command_pool(device: vk::Device, command_pool: vk::CommandPool, allocator: *const vk::AllocationCallbacks<'_>);
    fn reset_command_pool(device: vk::Device, command_pool: vk::CommandPool, flags: vk::CommandPoolResetFlags) -> vk::Result;
    fn allocate_command_buffers(device: vk::Device, allocate_info: *const vk::CommandBufferAllocateInfo<'_>, command_buffers: *mut vk::CommandBuffer) -> vk::Result;
    fn free_command_buffers(device: vk::Device, command_pool: vk::CommandPool, command_buffer_count: u32, command_buffers: *const vk::CommandBuffer);
    fn begin_command_buffer(command_buffer: vk::CommandBuffer, begin_info: *const vk::CommandBufferBeginInfo<'_>) -> vk::Result;
    fn end_command_buffer(command_buffer: vk::CommandBuffer) -> vk::Result;
    fn reset_command_buffer(command_buffer: vk::CommandBuffer, flags: vk::CommandBufferResetFlags) -> vk::Result;
    fn cmd_bind_pipeline(command_buffer: vk::CommandBuffer, pipeline_bind_point: vk::PipelineBindPoint, pipeline: vk::Pipeline);
    fn cmd_set_viewport(command_buffer: vk::CommandBuffer, first_viewport: u32, viewport_count: u32, viewports: *const vk::Viewport);
    fn cmd_set_scissor(command_buffer: vk::CommandBuffer, first_scissor: u32, scissor_count: u32, scissors: *const vk::Rect2D);
    fn cmd_set_line_width(command_buffer: vk::CommandBuffer, line_width: f32);
    fn cmd_set_depth_bias(command_buffer: vk::CommandBuffer, depth_bias_constant_factor: f32, depth_bias_clamp: f32, depth_bias_slope_factor: f32);
    fn cmd_set_blend_constants(command_buffer: vk::CommandBuffer, blend_constants: *const [f32; 4usize]);
    fn cmd_set_depth_bounds(command_buffer: vk::CommandBuffer, min_depth_bounds: f32, max_depth_bounds: f32);
    fn cmd_set_stencil_compare_mask(command_buffer: vk::CommandBuffer, face_mask: vk::StencilFaceFlags, compare_mask: u32);
    fn cmd_set_stencil_write_mask(command_buffer: vk::CommandBuffer, face_mask: vk::StencilFaceFlags, write_mask: u32);
    fn cmd_set_stencil_reference(command_buffer: vk::CommandBuffer, face_mask: vk::StencilFaceFlags, reference: u32);
    fn cmd_bind_descriptor_sets(command_buffer: vk::CommandBuffer, pipeline_bind_point: vk::PipelineBindPoint, layout: vk::PipelineLayout, first_set: u32, descriptor_set_count: u32, descriptor_sets: *const vk::DescriptorSet, dynamic_offset_count: u32, dynamic_offsets: *const u32);
    fn cmd_bind_index_buffer(command_buffer: vk::CommandBuffer, buffer: vk::Buffer, offset: vk::DeviceSize, index_type: vk::IndexType);
    fn cmd_bind_vertex_buffers(command_buffer: vk::CommandBuffer, first_binding: u32, binding_count: u32, buffers: *const vk::Buffer, offsets: *const vk::DeviceSize);
    fn cmd_draw(command_buffer: vk::CommandBuffer, vertex_count: u32, instance_count: u32, first_vertex: u32, first_instance: u32);
    fn cmd_draw_indexed(command_buffer: vk::CommandBuffer, index_count: u32, instance_count: u32, first_index: u32, vertex_offset: i32, first_instance: u32);
    fn cmd_draw_indirect(command_buffer: vk::CommandBuffer, buffer: vk::Buffer, offset: vk::DeviceSize, draw_count: u32, stride: u32);
    fn cmd_draw_indexed_indirect(command_buffer: vk::CommandBuffer, buffer: vk::Buffer, offset: vk::DeviceSize, draw_count: u32, stride: u32);
    fn cmd_dispatch(command_buffer: vk::CommandBuffer, group_count_x: u32, group_count_y: u32, group_count_z: u32);
    fn cmd_dispatch_indirect(command_buffer: vk::CommandBuffer, buffer: vk::Buffer, offset: vk::DeviceSize);
    fn cmd_copy_buffer(command_buffer: vk::CommandBuffer, src_buffer: vk::Buffer, dst_buffer: vk::Buffer, region_count: u32, regions: *const vk::BufferCopy);
    fn cmd_copy_image(command_buffer: vk::CommandBuffer, src_image: vk::Image, src_image_layout: vk::ImageLayout, dst_image: vk::Image, dst_image_layout: vk::ImageLayout, region_count: u32, regions: *const vk::ImageCopy);
    fn cmd_blit_image(command_buffer: vk::CommandBuffer, src_image: vk::Image, src_image_layout: vk::ImageLayout, dst_image: vk::Image, dst_image_layout: vk::ImageLayout, region_count: u32, regions: *const vk::ImageBlit, filter: vk::Filter);
    fn cmd_copy_buffer_to_image(command_buffer: vk::CommandBuffer, src_buffer: vk::Buffer, dst_image: vk::Image, dst_image_layout: vk::ImageLayout, region_count: u32, regions: *const vk::BufferImageCopy);
    fn cmd_copy_image_to_buffer(command_buffer: vk::CommandBuffer, src_image: vk::Image, src_image_layout: vk::ImageLayout, dst_buffer: vk::Buffer, region_count: u32, regions: *const vk::BufferImageCopy);
    fn cmd_update_buffer(command_buffer: vk::CommandBuffer, dst_buffer: vk::Buffer, dst_offset: vk::DeviceSize, data_size: vk::DeviceSize, data: *const c_void);
    fn cmd_fill_buffer(command_buffer: vk::CommandBuffer, dst_buffer: vk::Buffer, dst_offset: vk::DeviceSize, size: vk::DeviceSize, data: u32);
    fn cmd_clear_color_image(command_buffer: vk::CommandBuffer, image: vk::Image, image_layout: vk::ImageLayout, color: *const vk::ClearColorValue, range_count: u32, ranges: *const vk::ImageSubresourceRange);
    fn cmd_clear_depth_stencil_image(command_buffer: vk::CommandBuffer, image: vk::Image, image_layout: vk::ImageLayout, depth_stencil: *const vk::ClearDepthStencilValue, range_count: u32, ranges: *const vk::ImageSubresourceRange);
    fn cmd_clear_attachments(command_buffer: vk::CommandBuffer, attachment_count: u32, attachments: *const vk::ClearAttachment, rect_count: u32, rects: *const vk::ClearRect);
    fn cmd_resolve_image(command_buffer: vk::CommandBuffer, src_image: vk::Image, src_image_layout: vk::ImageLayout, dst_image: vk::Image, dst_image_layout: vk::ImageLayout, region_count: u32, regions: *const vk::ImageResolve);
    fn cmd_set_event(command_buffer: vk::CommandBuffer, event: vk::Event, stage_mask: vk::PipelineStageFlags);
    fn cmd_reset_event(command_buffer: vk::CommandBuffer, event: vk::Event, stage_mask: vk::PipelineStageFlags);
    fn cmd_wait_events(command_buffer: vk::CommandBuffer, event_count: u32, events: *const vk::Event, src_stage_mask: vk::PipelineStageFlags, dst_stage_mask: vk::PipelineStageFlags, memory_barrier_count: u32, memory_barriers: *const vk::MemoryBarrier<'_>, buffer_memory_barrier_count: u32, buffer_memory_barriers: *const vk::BufferMemoryBarrier<'_>, image_memory_barrier_count: u32, image_memory_barriers: *const vk::ImageMemoryBarrier<'_>);
    fn cmd_pipeline_barrier(command_buffer: vk::CommandBuffer, src_stage_mask: vk::PipelineStageFlags, dst_stage_mask: vk::PipelineStageFlags, dependency_flags: vk::DependencyFlags, memory_barrier_count: u32, memory_barriers: *const vk::MemoryBarrier<'_>, buffer_memory_barrier_count: u32, buffer_memory_barriers: *const vk::BufferMemoryBarrier<'_>, image_memory_barrier_count: u32, image_memory_barriers: *const vk::ImageMemoryBarrier<'_>);
    fn cmd_begin_query(command_buffer: vk::CommandBuffer, query_pool: vk::QueryPool, query: u32, flags: vk::QueryControlFlags);
    fn cmd_end_query(command_buffer: vk::CommandBuffer, query_pool: vk::QueryPool, query: u32);
    fn cmd_reset_query_pool(command_buffer: vk::CommandBuffer, query_pool: vk::QueryPool, first_query: u32, query_count: u32);
    fn cmd_write_timestamp(command_buffer: vk::CommandBuffer, pipeline_stage: vk::PipelineStageFlags, query_pool: vk::QueryPool, query: u32);
    fn cmd_copy_query_pool_results(command_buffer: vk::CommandBuffer, query_pool: vk::QueryPool, first_query: u32, query_count: u32, dst_buffer: vk::Buffer, dst_offset: vk::DeviceSize, stride: vk::DeviceSize, flags: vk::QueryResultFlags);
    fn cmd_push_constants(command_buffer: vk::CommandBuffer, layout: vk::PipelineLayout, stage_flags: vk::ShaderStageFlags, offset: u32, size: u32, values: *const c_void);
    fn cmd_begin_render_pass(command_buffer: vk::CommandBuffer, render_pass_begin: *const vk::RenderPassBeginInfo<'_>, contents: vk::SubpassContents);
    fn cmd_next_subpass(command_buffer: vk::CommandBuffer, contents: vk::SubpassContents);
    fn cmd_end_render_pass(command_buffer: vk::CommandBuffer);
    fn cmd_execute_commands(command_buffer: vk::CommandBuffer, command_buffer_count: u32, command_buffers: *const vk::CommandBuffer);
    fn bind_buffer_memory2(device: vk::Device, bind_info_count: u32, bind_infos: *const vk::BindBufferMemoryInfo<'_>) -> vk::Result;
    fn bind_image_memory2(device: vk::Device, bind_info_count: u32, bind_infos: *const vk::BindImageMemoryInfo<'_>) -> vk::Result;
    fn cmd_set_device_mask(command_buffer: vk::CommandBuffer, device_mask: u32);
    fn cmd_dispatch_base(command_buffer: vk::CommandBuffer, base_group_x: u32, base_group_y: u32, base_group_z: u32, group_count_x: u32, group_count_y: u32, group_count_z: u32);
    fn get_image_memory_requirements2(device: vk::Device, info: *const vk::ImageMemoryRequirementsInfo2<'_>, memory_requirements: *mut vk::MemoryRequirements2<'_>);
    fn get_buffer_memory_requirements2(device: vk::Device, info: *const vk::BufferMemoryRequirementsInfo2<'_>, memory_requirements: *mut vk::MemoryRequirements2<'_>);
    fn get_image_sparse_memory_requirements2(device: vk::Device, info: *const vk::ImageSparseMemoryRequirementsInfo2<'_>, sparse_memory_requirement_count: *mut u32, sparse_memory_requirements: *mut vk::SparseImageMemoryRequirements2<'_>);
    fn trim_command_pool(device: vk::Device, command_pool: vk::CommandPool, flags: vk::CommandPoolTrimFlags);
    fn create_sampler_ycbcr_conversion(device: vk::Device, create_info: *const vk::SamplerYcbcrConversionCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, ycbcr_conversion: *mut vk::SamplerYcbcrConversion) -> vk::Result;
    fn destroy_sampler_ycbcr_conversion(device: vk::Device, ycbcr_conversion: vk::SamplerYcbcrConversion, allocator: *const vk::AllocationCallbacks<'_>);
    fn create_descriptor_update_template(device: vk::Device, create_info: *const vk::DescriptorUpdateTemplateCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, descriptor_update_template: *mut vk::DescriptorUpdateTemplate) -> vk::Result;
    fn destroy_descriptor_update_template(device: vk::Device, descriptor_update_template: vk::DescriptorUpdateTemplate, allocator: *const vk::AllocationCallbacks<'_>);
    fn update_descriptor_set_with_template(device: vk::Device, descriptor_set: vk::DescriptorSet, descriptor_update_template: vk::DescriptorUpdateTemplate, data: *const c_void);
    fn get_descriptor_set_layout_support(device: vk::Device, create_info: *const vk::DescriptorSetLayoutCreateInfo<'_>, support: *mut vk::DescriptorSetLayoutSupport<'_>);
    fn cmd_draw_indirect_count(command_buffer: vk::CommandBuffer, buffer: vk::Buffer, offset: vk::DeviceSize, count_buffer: vk::Buffer, count_buffer_offset: vk::DeviceSize, max_draw_count: u32, stride: u32);
    fn cmd_draw_indexed_indirect_count(command_buffer: vk::CommandBuffer, buffer: vk::Buffer, offset: vk::DeviceSize, count_buffer: vk::Buffer, count_buffer_offset: vk::DeviceSize, max_draw_count: u32, stride: u32);
    fn create_render_pass2(device: vk::Device, create_info: *const vk::RenderPassCreateInfo2<'_>, allocator: *const vk::AllocationCallbacks<'_>, render_pass: *mut vk::RenderPass) -> vk::Result;
    fn cmd_begin_render_pass2(command_buffer: vk::CommandBuffer, render_pass_begin: *const vk::RenderPassBeginInfo<'_>, subpass_begin_info: *const vk::SubpassBeginInfo<'_>);
    fn cmd_next_subpass2(command_buffer: vk::CommandBuffer, subpass_begin_info: *const vk::SubpassBeginInfo<'_>, subpass_end_info: *const vk::SubpassEndInfo<'_>);
    fn cmd_end_render_pass2(command_buffer: vk::CommandBuffer, subpass_end_info: *const vk::SubpassEndInfo<'_>);
    fn reset_query_pool(device: vk::Device, query_pool: vk::QueryPool, first_query: u32, query_count: u32);
    fn get_semaphore_counter_value(device: vk::Device, semaphore: vk::Semaphore, value: *mut u64) -> vk::Result;
    fn wait_semaphores(device: vk::Device, wait_info: *const vk::SemaphoreWaitInfo<'_>, timeout: u64) -> vk::Result;
    fn signal_semaphore(device: vk::Device, signal_info: *const vk::SemaphoreSignalInfo<'_>) -> vk::Result;
    fn get_buffer_device_address(device: vk::Device, info: *const vk::BufferDeviceAddressInfo<'_>) -> vk::DeviceAddress;
    fn get_buffer_opaque_capture_address(device: vk::Device, info: *const vk::BufferDeviceAddressInfo<'_>) -> u64;
    fn get_device_memory_opaque_capture_address(device: vk::Device, info: *const vk::DeviceMemoryOpaqueCaptureAddressInfo<'_>) -> u64;
    fn create_private_data_slot(device: vk::Device, create_info: *const vk::PrivateDataSlotCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, private_data_slot: *mut vk::PrivateDataSlot) -> vk::Result;
    fn destroy_private_data_slot(device: vk::Device, private_data_slot: vk::PrivateDataSlot, allocator: *const vk::AllocationCallbacks<'_>);
    fn set_private_data(device: vk::Device, object_type: vk::ObjectType, object_handle: u64, private_data_slot: vk::PrivateDataSlot, data: u64) -> vk::Result;
    fn get_private_data(device: vk::Device, object_type: vk::ObjectType, object_handle: u64, private_data_slot: vk::PrivateDataSlot, data: *mut u64);
    fn cmd_set_event2(command_buffer: vk::CommandBuffer, event: vk::Event, dependency_info: *const vk::DependencyInfo<'_>);
    fn cmd_reset_event2(command_buffer: vk::CommandBuffer, event: vk::Event, stage_mask: vk::PipelineStageFlags2);
    fn cmd_wait_events2(command_buffer: vk::CommandBuffer, event_count: u32, events: *const vk::Event, dependency_infos: *const vk::DependencyInfo<'_>);
    fn cmd_pipeline_barrier2(command_buffer: vk::CommandBuffer, dependency_info: *const vk::DependencyInfo<'_>);
    fn cmd_write_timestamp2(command_buffer: vk::CommandBuffer, stage: vk::PipelineStageFlags2, query_pool: vk::QueryPool, query: u32);
    fn queue_submit2(queue: vk::Queue, submit_count: u32, submits: *const vk::SubmitInfo2<'_>, fence: vk::Fence) -> vk::Result;
    fn cmd_copy_buffer2(command_buffer: vk::CommandBuffer, copy_buffer_info: *const vk::CopyBufferInfo2<'_>);
    fn cmd_copy_image2(command_buffer: vk::CommandBuffer, copy_image_info: *const vk::CopyImageInfo2<'_>);
    fn cmd_copy_buffer_to_image2(command_buffer: vk::CommandBuffer, copy_buffer_to_image_info: *const vk::CopyBufferToImageInfo2<'_>);
    fn cmd_copy_image_to_buffer2(command_buffer: vk::CommandBuffer, copy_image_to_buffer_info: *const vk::CopyImageToBufferInfo2<'_>);
    fn cmd_blit_image2(command_buffer: vk::CommandBuffer, blit_image_info: *const vk::BlitImageInfo2<'_>);
    fn cmd_resolve_image2(command_buffer: vk::CommandBuffer, resolve_image_info: *const vk::ResolveImageInfo2<'_>);
    fn cmd_begin_rendering(command_buffer: vk::CommandBuffer, rendering_info: *const vk::RenderingInfo<'_>);
    fn cmd_end_rendering(command_buffer: vk::CommandBuffer);
    fn cmd_set_cull_mode(command_buffer: vk::CommandBuffer, cull_mode: vk::CullModeFlags);
    fn cmd_set_front_face(command_buffer: vk::CommandBuffer, front_face: vk::FrontFace);
    fn cmd_set_primitive_topology(command_buffer: vk::CommandBuffer, primitive_topology: vk::PrimitiveTopology);
    fn cmd_set_viewport_with_count(command_buffer: vk::CommandBuffer, viewport_count: u32, viewports: *const vk::Viewport);
    fn cmd_set_scissor_with_count(command_buffer: vk::CommandBuffer, scissor_count: u32, scissors: *const vk::Rect2D);
    fn cmd_bind_vertex_buffers2(command_buffer: vk::CommandBuffer, first_binding: u32, binding_count: u32, buffers: *const vk::Buffer, offsets: *const vk::DeviceSize, sizes: *const vk::DeviceSize, strides: *const vk::DeviceSize);
    fn cmd_set_depth_test_enable(command_buffer: vk::CommandBuffer, depth_test_enable: vk::Bool32);
    fn cmd_set_depth_write_enable(command_buffer: vk::CommandBuffer, depth_write_enable: vk::Bool32);
    fn cmd_set_depth_compare_op(command_buffer: vk::CommandBuffer, depth_compare_op: vk::CompareOp);
    fn cmd_set_depth_bounds_test_enable(command_buffer: vk::CommandBuffer, depth_bounds_test_enable: vk::Bool32);
    fn cmd_set_stencil_test_enable(command_buffer: vk::CommandBuffer, stencil_test_enable: vk::Bool32);
    fn cmd_set_stencil_op(command_buffer: vk::CommandBuffer, face_mask: vk::StencilFaceFlags, fail_op: vk::StencilOp, pass_op: vk::StencilOp, depth_fail_op: vk::StencilOp, compare_op: vk::CompareOp);
    fn cmd_set_rasterizer_discard_enable(command_buffer: vk::CommandBuffer, rasterizer_discard_enable: vk::Bool32);
    fn cmd_set_depth_bias_enable(command_buffer: vk::CommandBuffer, depth_bias_enable: vk::Bool32);
    fn cmd_set_primitive_restart_enable(command_buffer: vk::CommandBuffer, primitive_restart_enable: vk::Bool32);
    fn get_device_buffer_memory_requirements(device: vk::Device, info: *const vk::DeviceBufferMemoryRequirements<'_>, memory_requirements: *mut vk::MemoryRequirements2<'_>);
    fn get_device_image_memory_requirements(device: vk::Device, info: *const vk::DeviceImageMemoryRequirements<'_>, memory_requirements: *mut vk::MemoryRequirements2<'_>);
    fn get_device_image_sparse_memory_requirements(device: vk::Device, info: *const vk::DeviceImageMemoryRequirements<'_>, sparse_memory_requirement_count: *mut u32, sparse_memory_requirements: *mut vk::SparseImageMemoryRequirements2<'_>);
    fn cmd_set_gaussian_camera_gaurast(command_buffer: vk::CommandBuffer, camera: *const gaurast::vk::GaussianCameraGAURAST<'_>);
}
