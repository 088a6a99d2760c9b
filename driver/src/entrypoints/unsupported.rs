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
    fn queue_bind_sparse(queue: vk::Queue, bind_info_count: u32, bind_info: *const vk::BindSparseInfo<'_>, fence: vk::Fence) -> vk::Result;
    fn create_buffer_view(device: vk::Device, create_info: *const vk::BufferViewCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, view: *mut vk::BufferView) -> vk::Result;
    fn destroy_buffer_view(device: vk::Device, buffer_view: vk::BufferView, allocator: *const vk::AllocationCallbacks<'_>);
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
    fn cmd_bind_descriptor_sets(command_buffer: vk::CommandBuffer, pipeline_bind_point: vk::PipelineBindPoint, layout: vk::PipelineLayout, first_set: u32, descriptor_set_count: u32, descriptor_sets: *const vk::DescriptorSet, dynamic_offset_count: u32, dynamic_offsets: *const u32);
    fn cmd_dispatch(command_buffer: vk::CommandBuffer, group_count_x: u32, group_count_y: u32, group_count_z: u32);
    fn cmd_dispatch_indirect(command_buffer: vk::CommandBuffer, buffer: vk::Buffer, offset: vk::DeviceSize);
    fn cmd_blit_image(command_buffer: vk::CommandBuffer, src_image: vk::Image, src_image_layout: vk::ImageLayout, dst_image: vk::Image, dst_image_layout: vk::ImageLayout, region_count: u32, regions: *const vk::ImageBlit, filter: vk::Filter);
    fn cmd_resolve_image(command_buffer: vk::CommandBuffer, src_image: vk::Image, src_image_layout: vk::ImageLayout, dst_image: vk::Image, dst_image_layout: vk::ImageLayout, region_count: u32, regions: *const vk::ImageResolve);
    fn cmd_push_constants(command_buffer: vk::CommandBuffer, layout: vk::PipelineLayout, stage_flags: vk::ShaderStageFlags, offset: u32, size: u32, values: *const c_void);
    fn cmd_dispatch_base(command_buffer: vk::CommandBuffer, base_group_x: u32, base_group_y: u32, base_group_z: u32, group_count_x: u32, group_count_y: u32, group_count_z: u32);
    fn create_sampler_ycbcr_conversion(device: vk::Device, create_info: *const vk::SamplerYcbcrConversionCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, ycbcr_conversion: *mut vk::SamplerYcbcrConversion) -> vk::Result;
    fn destroy_sampler_ycbcr_conversion(device: vk::Device, ycbcr_conversion: vk::SamplerYcbcrConversion, allocator: *const vk::AllocationCallbacks<'_>);
    fn create_descriptor_update_template(device: vk::Device, create_info: *const vk::DescriptorUpdateTemplateCreateInfo<'_>, allocator: *const vk::AllocationCallbacks<'_>, descriptor_update_template: *mut vk::DescriptorUpdateTemplate) -> vk::Result;
    fn destroy_descriptor_update_template(device: vk::Device, descriptor_update_template: vk::DescriptorUpdateTemplate, allocator: *const vk::AllocationCallbacks<'_>);
    fn update_descriptor_set_with_template(device: vk::Device, descriptor_set: vk::DescriptorSet, descriptor_update_template: vk::DescriptorUpdateTemplate, data: *const c_void);
    fn get_descriptor_set_layout_support(device: vk::Device, create_info: *const vk::DescriptorSetLayoutCreateInfo<'_>, support: *mut vk::DescriptorSetLayoutSupport<'_>);
    fn get_buffer_device_address(device: vk::Device, info: *const vk::BufferDeviceAddressInfo<'_>) -> vk::DeviceAddress;
    fn get_buffer_opaque_capture_address(device: vk::Device, info: *const vk::BufferDeviceAddressInfo<'_>) -> u64;
    fn get_device_memory_opaque_capture_address(device: vk::Device, info: *const vk::DeviceMemoryOpaqueCaptureAddressInfo<'_>) -> u64;
    fn cmd_blit_image2(command_buffer: vk::CommandBuffer, blit_image_info: *const vk::BlitImageInfo2<'_>);
    fn cmd_resolve_image2(command_buffer: vk::CommandBuffer, resolve_image_info: *const vk::ResolveImageInfo2<'_>);
}
