//! The table itself. To add a command, add a row to the block of its scope and gate (or a block): the `PFN_` type,
//! which the function is checked against and which gives the command's name, then the function. An alias of another
//! command's type states its own name: `PFN_vkCmdBeginRendering as "vkCmdBeginRenderingKHR" = ...`.

use super::Gate::{Core, DeviceExtension, InstanceExtension};
use super::{Command, Scope};
use crate::entrypoints::*;
use ash::vk::*;
use gaurast::gaussian_primitive_topology;
use gaurast::vk::PFN_vkCmdSetGaussianCameraGAURAST;
use std::ffi::CStr;

const DEBUG_UTILS: &CStr = ash::ext::debug_utils::NAME;
const GET_PHYSICAL_DEVICE_PROPERTIES2: &CStr = ash::khr::get_physical_device_properties2::NAME;
const PERFORMANCE_QUERY: &CStr = ash::khr::performance_query::NAME;
const PUSH_DESCRIPTOR: &CStr = ash::khr::push_descriptor::NAME;
const DYNAMIC_RENDERING: &CStr = ash::khr::dynamic_rendering::NAME;
const SYNCHRONIZATION2: &CStr = ash::khr::synchronization2::NAME;
const GAUSSIAN_PRIMITIVE_TOPOLOGY: &CStr = gaussian_primitive_topology::NAME;

const PREFIX: &str = "PFN_";

macro_rules! command_name {
    ($pfn:ident) => {
        stringify!($pfn).split_at(PREFIX.len()).1
    };
    ($pfn:ident $name:literal) => {
        $name
    };
}

macro_rules! commands {
    ($($scope:ident, $gate:expr => {
        $($pfn:ident $(as $name:literal)? = $function:path;)*
    })*) => {
        /// Every command of the driver.
        pub(super) static COMMANDS: &[Command] = &[$($(Command {
            name: command_name!($pfn $($name)?),
            function: {
                let function: $pfn = $function;
                // SAFETY: function pointers have one size, and callers of a void function cast it back first.
                unsafe { std::mem::transmute::<$pfn, unsafe extern "system" fn()>(function) }
            },
            scope: Scope::$scope,
            gate: $gate,
        },)*)*];
    };
}

commands! {
    Global, Core(API_VERSION_1_0) => {
        PFN_vkGetInstanceProcAddr = instance::get_instance_proc_addr;
        PFN_vkCreateInstance = instance::create_instance;
        PFN_vkEnumerateInstanceExtensionProperties = instance::enumerate_instance_extension_properties;
        PFN_vkEnumerateInstanceLayerProperties = instance::enumerate_instance_layer_properties;
    }
    Instance, Core(API_VERSION_1_0) => {
        PFN_vkDestroyInstance = instance::destroy_instance;
        PFN_vkEnumeratePhysicalDevices = instance::enumerate_physical_devices;
    }
    PhysicalDevice, Core(API_VERSION_1_0) => {
        PFN_vkGetPhysicalDeviceFeatures = physical_device::get_physical_device_features;
        PFN_vkGetPhysicalDeviceFormatProperties = physical_device::get_physical_device_format_properties;
        PFN_vkGetPhysicalDeviceImageFormatProperties = physical_device::get_physical_device_image_format_properties;
        PFN_vkGetPhysicalDeviceProperties = physical_device::get_physical_device_properties;
        PFN_vkGetPhysicalDeviceQueueFamilyProperties = physical_device::get_physical_device_queue_family_properties;
        PFN_vkGetPhysicalDeviceMemoryProperties = physical_device::get_physical_device_memory_properties;
        PFN_vkCreateDevice = device::create_device;
        PFN_vkEnumerateDeviceExtensionProperties = physical_device::enumerate_device_extension_properties;
        PFN_vkEnumerateDeviceLayerProperties = physical_device::enumerate_device_layer_properties;
        PFN_vkGetPhysicalDeviceSparseImageFormatProperties = physical_device::get_physical_device_sparse_image_format_properties;
    }
    Device, Core(API_VERSION_1_0) => {
        PFN_vkGetDeviceProcAddr = device::get_device_proc_addr;
        PFN_vkDestroyDevice = device::destroy_device;
        PFN_vkGetDeviceQueue = device::get_device_queue;
        PFN_vkQueueSubmit = queue::queue_submit;
        PFN_vkQueueWaitIdle = queue::queue_wait_idle;
        PFN_vkDeviceWaitIdle = queue::device_wait_idle;
        PFN_vkAllocateMemory = memory::allocate_memory;
        PFN_vkFreeMemory = memory::free_memory;
        PFN_vkMapMemory = memory::map_memory;
        PFN_vkUnmapMemory = memory::unmap_memory;
        PFN_vkFlushMappedMemoryRanges = memory::flush_mapped_memory_ranges;
        PFN_vkInvalidateMappedMemoryRanges = memory::invalidate_mapped_memory_ranges;
        PFN_vkGetDeviceMemoryCommitment = memory::get_device_memory_commitment;
        PFN_vkBindBufferMemory = memory::bind_buffer_memory;
        PFN_vkBindImageMemory = memory::bind_image_memory;
        PFN_vkGetBufferMemoryRequirements = buffer::get_buffer_memory_requirements;
        PFN_vkGetImageMemoryRequirements = image::get_image_memory_requirements;
        PFN_vkGetImageSparseMemoryRequirements = image::get_image_sparse_memory_requirements;
        PFN_vkQueueBindSparse = unsupported::queue_bind_sparse;
        PFN_vkCreateFence = sync::create_fence;
        PFN_vkDestroyFence = sync::destroy_fence;
        PFN_vkResetFences = sync::reset_fences;
        PFN_vkGetFenceStatus = sync::get_fence_status;
        PFN_vkWaitForFences = sync::wait_for_fences;
        PFN_vkCreateSemaphore = sync::create_semaphore;
        PFN_vkDestroySemaphore = sync::destroy_semaphore;
        PFN_vkCreateEvent = sync::create_event;
        PFN_vkDestroyEvent = sync::destroy_event;
        PFN_vkGetEventStatus = sync::get_event_status;
        PFN_vkSetEvent = sync::set_event;
        PFN_vkResetEvent = sync::reset_event;
        PFN_vkCreateQueryPool = query::create_query_pool;
        PFN_vkDestroyQueryPool = query::destroy_query_pool;
        PFN_vkGetQueryPoolResults = query::get_query_pool_results;
        PFN_vkCreateBuffer = buffer::create_buffer;
        PFN_vkDestroyBuffer = buffer::destroy_buffer;
        PFN_vkCreateBufferView = buffer_view::create_buffer_view;
        PFN_vkDestroyBufferView = buffer_view::destroy_buffer_view;
        PFN_vkCreateImage = image::create_image;
        PFN_vkDestroyImage = image::destroy_image;
        PFN_vkGetImageSubresourceLayout = image::get_image_subresource_layout;
        PFN_vkCreateImageView = image::create_image_view;
        PFN_vkDestroyImageView = image::destroy_image_view;
        PFN_vkCreateShaderModule = pipeline::create_shader_module;
        PFN_vkDestroyShaderModule = pipeline::destroy_shader_module;
        PFN_vkCreatePipelineCache = pipeline::create_pipeline_cache;
        PFN_vkDestroyPipelineCache = pipeline::destroy_pipeline_cache;
        PFN_vkGetPipelineCacheData = pipeline::get_pipeline_cache_data;
        PFN_vkMergePipelineCaches = pipeline::merge_pipeline_caches;
        PFN_vkCreateGraphicsPipelines = graphics_pipeline::create_graphics_pipelines;
        PFN_vkCreateComputePipelines = compute_pipeline::create_compute_pipelines;
        PFN_vkDestroyPipeline = pipeline::destroy_pipeline;
        PFN_vkCreatePipelineLayout = pipeline::create_pipeline_layout;
        PFN_vkDestroyPipelineLayout = pipeline::destroy_pipeline_layout;
        PFN_vkCreateSampler = sampler::create_sampler;
        PFN_vkDestroySampler = sampler::destroy_sampler;
        PFN_vkCreateDescriptorSetLayout = descriptor::create_descriptor_set_layout;
        PFN_vkDestroyDescriptorSetLayout = descriptor::destroy_descriptor_set_layout;
        PFN_vkCreateDescriptorPool = descriptor::create_descriptor_pool;
        PFN_vkDestroyDescriptorPool = descriptor::destroy_descriptor_pool;
        PFN_vkResetDescriptorPool = descriptor::reset_descriptor_pool;
        PFN_vkAllocateDescriptorSets = descriptor::allocate_descriptor_sets;
        PFN_vkFreeDescriptorSets = descriptor::free_descriptor_sets;
        PFN_vkUpdateDescriptorSets = descriptor_update::update_descriptor_sets;
        PFN_vkCreateFramebuffer = render_pass::create_framebuffer;
        PFN_vkDestroyFramebuffer = render_pass::destroy_framebuffer;
        PFN_vkCreateRenderPass = render_pass::create_render_pass;
        PFN_vkDestroyRenderPass = render_pass::destroy_render_pass;
        PFN_vkGetRenderAreaGranularity = render_pass::get_render_area_granularity;
        PFN_vkCreateCommandPool = command_buffer::create_command_pool;
        PFN_vkDestroyCommandPool = command_buffer::destroy_command_pool;
        PFN_vkResetCommandPool = command_buffer::reset_command_pool;
        PFN_vkAllocateCommandBuffers = command_buffer::allocate_command_buffers;
        PFN_vkFreeCommandBuffers = command_buffer::free_command_buffers;
        PFN_vkBeginCommandBuffer = command_buffer::begin_command_buffer;
        PFN_vkEndCommandBuffer = command_buffer::end_command_buffer;
        PFN_vkResetCommandBuffer = command_buffer::reset_command_buffer;
        PFN_vkCmdBindPipeline = command::cmd_bind_pipeline;
        PFN_vkCmdSetViewport = command::cmd_set_viewport;
        PFN_vkCmdSetScissor = command::cmd_set_scissor;
        PFN_vkCmdSetLineWidth = dynamic_state::cmd_set_line_width;
        PFN_vkCmdSetDepthBias = dynamic_state::cmd_set_depth_bias;
        PFN_vkCmdSetBlendConstants = dynamic_state::cmd_set_blend_constants;
        PFN_vkCmdSetDepthBounds = dynamic_state::cmd_set_depth_bounds;
        PFN_vkCmdSetStencilCompareMask = dynamic_state::cmd_set_stencil_compare_mask;
        PFN_vkCmdSetStencilWriteMask = dynamic_state::cmd_set_stencil_write_mask;
        PFN_vkCmdSetStencilReference = dynamic_state::cmd_set_stencil_reference;
        PFN_vkCmdBindDescriptorSets = compute::cmd_bind_descriptor_sets;
        PFN_vkCmdBindIndexBuffer = command::cmd_bind_index_buffer;
        PFN_vkCmdBindVertexBuffers = command::cmd_bind_vertex_buffers;
        PFN_vkCmdDraw = command::cmd_draw;
        PFN_vkCmdDrawIndexed = command::cmd_draw_indexed;
        PFN_vkCmdDrawIndirect = command::cmd_draw_indirect;
        PFN_vkCmdDrawIndexedIndirect = command::cmd_draw_indexed_indirect;
        PFN_vkCmdDispatch = compute::cmd_dispatch;
        PFN_vkCmdDispatchIndirect = compute::cmd_dispatch_indirect;
        PFN_vkCmdCopyBuffer = transfer::cmd_copy_buffer;
        PFN_vkCmdCopyImage = transfer::cmd_copy_image;
        PFN_vkCmdBlitImage = transfer::cmd_blit_image;
        PFN_vkCmdCopyBufferToImage = transfer::cmd_copy_buffer_to_image;
        PFN_vkCmdCopyImageToBuffer = transfer::cmd_copy_image_to_buffer;
        PFN_vkCmdUpdateBuffer = transfer::cmd_update_buffer;
        PFN_vkCmdFillBuffer = transfer::cmd_fill_buffer;
        PFN_vkCmdClearColorImage = transfer::cmd_clear_color_image;
        PFN_vkCmdClearDepthStencilImage = transfer::cmd_clear_depth_stencil_image;
        PFN_vkCmdClearAttachments = transfer::cmd_clear_attachments;
        PFN_vkCmdResolveImage = transfer::cmd_resolve_image;
        PFN_vkCmdSetEvent = command::cmd_set_event;
        PFN_vkCmdResetEvent = command::cmd_reset_event;
        PFN_vkCmdWaitEvents = command::cmd_wait_events;
        PFN_vkCmdPipelineBarrier = command::cmd_pipeline_barrier;
        PFN_vkCmdBeginQuery = query::cmd_begin_query;
        PFN_vkCmdEndQuery = query::cmd_end_query;
        PFN_vkCmdResetQueryPool = query::cmd_reset_query_pool;
        PFN_vkCmdWriteTimestamp = query::cmd_write_timestamp;
        PFN_vkCmdCopyQueryPoolResults = query::cmd_copy_query_pool_results;
        PFN_vkCmdPushConstants = compute::cmd_push_constants;
        PFN_vkCmdBeginRenderPass = rendering::cmd_begin_render_pass;
        PFN_vkCmdNextSubpass = rendering::cmd_next_subpass;
        PFN_vkCmdEndRenderPass = rendering::cmd_end_render_pass;
        PFN_vkCmdExecuteCommands = command::cmd_execute_commands;
    }
    Global, Core(API_VERSION_1_1) => {
        PFN_vkEnumerateInstanceVersion = instance::enumerate_instance_version;
    }
    Instance, Core(API_VERSION_1_1) => {
        PFN_vkEnumeratePhysicalDeviceGroups = instance::enumerate_physical_device_groups;
    }
    PhysicalDevice, Core(API_VERSION_1_1) => {
        PFN_vkGetPhysicalDeviceFeatures2 = physical_device::get_physical_device_features2;
        PFN_vkGetPhysicalDeviceProperties2 = physical_device::get_physical_device_properties2;
        PFN_vkGetPhysicalDeviceFormatProperties2 = physical_device::get_physical_device_format_properties2;
        PFN_vkGetPhysicalDeviceImageFormatProperties2 = physical_device::get_physical_device_image_format_properties2;
        PFN_vkGetPhysicalDeviceQueueFamilyProperties2 = physical_device::get_physical_device_queue_family_properties2;
        PFN_vkGetPhysicalDeviceMemoryProperties2 = physical_device::get_physical_device_memory_properties2;
        PFN_vkGetPhysicalDeviceSparseImageFormatProperties2 = physical_device::get_physical_device_sparse_image_format_properties2;
        PFN_vkGetPhysicalDeviceExternalBufferProperties = physical_device::get_physical_device_external_buffer_properties;
        PFN_vkGetPhysicalDeviceExternalFenceProperties = physical_device::get_physical_device_external_fence_properties;
        PFN_vkGetPhysicalDeviceExternalSemaphoreProperties = physical_device::get_physical_device_external_semaphore_properties;
    }
    Device, Core(API_VERSION_1_1) => {
        PFN_vkBindBufferMemory2 = memory::bind_buffer_memory2;
        PFN_vkBindImageMemory2 = memory::bind_image_memory2;
        PFN_vkGetDeviceGroupPeerMemoryFeatures = device::get_device_group_peer_memory_features;
        PFN_vkCmdSetDeviceMask = dynamic_state::cmd_set_device_mask;
        PFN_vkCmdDispatchBase = compute::cmd_dispatch_base;
        PFN_vkGetImageMemoryRequirements2 = image::get_image_memory_requirements2;
        PFN_vkGetBufferMemoryRequirements2 = buffer::get_buffer_memory_requirements2;
        PFN_vkGetImageSparseMemoryRequirements2 = image::get_image_sparse_memory_requirements2;
        PFN_vkTrimCommandPool = command_buffer::trim_command_pool;
        PFN_vkGetDeviceQueue2 = device::get_device_queue2;
        PFN_vkCreateSamplerYcbcrConversion = unsupported::create_sampler_ycbcr_conversion;
        PFN_vkDestroySamplerYcbcrConversion = unsupported::destroy_sampler_ycbcr_conversion;
        PFN_vkCreateDescriptorUpdateTemplate = descriptor_update::create_descriptor_update_template;
        PFN_vkDestroyDescriptorUpdateTemplate = descriptor_update::destroy_descriptor_update_template;
        PFN_vkUpdateDescriptorSetWithTemplate = descriptor_update::update_descriptor_set_with_template;
        PFN_vkGetDescriptorSetLayoutSupport = descriptor::get_descriptor_set_layout_support;
    }
    Device, Core(API_VERSION_1_2) => {
        PFN_vkCmdDrawIndirectCount = command::cmd_draw_indirect_count;
        PFN_vkCmdDrawIndexedIndirectCount = command::cmd_draw_indexed_indirect_count;
        PFN_vkCreateRenderPass2 = render_pass::create_render_pass2;
        PFN_vkCmdBeginRenderPass2 = rendering::cmd_begin_render_pass2;
        PFN_vkCmdNextSubpass2 = rendering::cmd_next_subpass2;
        PFN_vkCmdEndRenderPass2 = rendering::cmd_end_render_pass2;
        PFN_vkResetQueryPool = query::reset_query_pool;
        PFN_vkGetSemaphoreCounterValue = sync::get_semaphore_counter_value;
        PFN_vkWaitSemaphores = sync::wait_semaphores;
        PFN_vkSignalSemaphore = sync::signal_semaphore;
        PFN_vkGetBufferDeviceAddress = unsupported::get_buffer_device_address;
        PFN_vkGetBufferOpaqueCaptureAddress = unsupported::get_buffer_opaque_capture_address;
        PFN_vkGetDeviceMemoryOpaqueCaptureAddress = unsupported::get_device_memory_opaque_capture_address;
    }
    PhysicalDevice, Core(API_VERSION_1_3) => {
        PFN_vkGetPhysicalDeviceToolProperties = physical_device::get_physical_device_tool_properties;
    }
    Device, Core(API_VERSION_1_3) => {
        PFN_vkCreatePrivateDataSlot = private_data::create_private_data_slot;
        PFN_vkDestroyPrivateDataSlot = private_data::destroy_private_data_slot;
        PFN_vkSetPrivateData = private_data::set_private_data;
        PFN_vkGetPrivateData = private_data::get_private_data;
        PFN_vkCmdSetEvent2 = command::cmd_set_event2;
        PFN_vkCmdResetEvent2 = command::cmd_reset_event2;
        PFN_vkCmdWaitEvents2 = command::cmd_wait_events2;
        PFN_vkCmdPipelineBarrier2 = command::cmd_pipeline_barrier2;
        PFN_vkCmdWriteTimestamp2 = query::cmd_write_timestamp2;
        PFN_vkQueueSubmit2 = queue::queue_submit2;
        PFN_vkCmdCopyBuffer2 = transfer::cmd_copy_buffer2;
        PFN_vkCmdCopyImage2 = transfer::cmd_copy_image2;
        PFN_vkCmdCopyBufferToImage2 = transfer::cmd_copy_buffer_to_image2;
        PFN_vkCmdCopyImageToBuffer2 = transfer::cmd_copy_image_to_buffer2;
        PFN_vkCmdBlitImage2 = transfer::cmd_blit_image2;
        PFN_vkCmdResolveImage2 = transfer::cmd_resolve_image2;
        PFN_vkCmdBeginRendering = rendering::cmd_begin_rendering;
        PFN_vkCmdEndRendering = rendering::cmd_end_rendering;
        PFN_vkCmdSetCullMode = dynamic_state::cmd_set_cull_mode;
        PFN_vkCmdSetFrontFace = dynamic_state::cmd_set_front_face;
        PFN_vkCmdSetPrimitiveTopology = dynamic_state::cmd_set_primitive_topology;
        PFN_vkCmdSetViewportWithCount = command::cmd_set_viewport_with_count;
        PFN_vkCmdSetScissorWithCount = command::cmd_set_scissor_with_count;
        PFN_vkCmdBindVertexBuffers2 = command::cmd_bind_vertex_buffers2;
        PFN_vkCmdSetDepthTestEnable = dynamic_state::cmd_set_depth_test_enable;
        PFN_vkCmdSetDepthWriteEnable = dynamic_state::cmd_set_depth_write_enable;
        PFN_vkCmdSetDepthCompareOp = dynamic_state::cmd_set_depth_compare_op;
        PFN_vkCmdSetDepthBoundsTestEnable = dynamic_state::cmd_set_depth_bounds_test_enable;
        PFN_vkCmdSetStencilTestEnable = dynamic_state::cmd_set_stencil_test_enable;
        PFN_vkCmdSetStencilOp = dynamic_state::cmd_set_stencil_op;
        PFN_vkCmdSetRasterizerDiscardEnable = dynamic_state::cmd_set_rasterizer_discard_enable;
        PFN_vkCmdSetDepthBiasEnable = dynamic_state::cmd_set_depth_bias_enable;
        PFN_vkCmdSetPrimitiveRestartEnable = dynamic_state::cmd_set_primitive_restart_enable;
        PFN_vkGetDeviceBufferMemoryRequirements = buffer::get_device_buffer_memory_requirements;
        PFN_vkGetDeviceImageMemoryRequirements = image::get_device_image_memory_requirements;
        PFN_vkGetDeviceImageSparseMemoryRequirements = image::get_device_image_sparse_memory_requirements;
    }

    Instance, InstanceExtension(DEBUG_UTILS) => {
        PFN_vkCreateDebugUtilsMessengerEXT = debug_utils::create_debug_utils_messenger_ext;
        PFN_vkDestroyDebugUtilsMessengerEXT = debug_utils::destroy_debug_utils_messenger_ext;
        PFN_vkSubmitDebugUtilsMessageEXT = debug_utils::submit_debug_utils_message_ext;
    }
    Device, InstanceExtension(DEBUG_UTILS) => {
        PFN_vkSetDebugUtilsObjectNameEXT = debug_utils::set_debug_utils_object_name_ext;
        PFN_vkSetDebugUtilsObjectTagEXT = debug_utils::set_debug_utils_object_tag_ext;
        PFN_vkQueueBeginDebugUtilsLabelEXT = debug_utils::queue_begin_debug_utils_label_ext;
        PFN_vkQueueEndDebugUtilsLabelEXT = debug_utils::queue_end_debug_utils_label_ext;
        PFN_vkQueueInsertDebugUtilsLabelEXT = debug_utils::queue_insert_debug_utils_label_ext;
        PFN_vkCmdBeginDebugUtilsLabelEXT = debug_utils::cmd_begin_debug_utils_label_ext;
        PFN_vkCmdEndDebugUtilsLabelEXT = debug_utils::cmd_end_debug_utils_label_ext;
        PFN_vkCmdInsertDebugUtilsLabelEXT = debug_utils::cmd_insert_debug_utils_label_ext;
    }

    PhysicalDevice, InstanceExtension(GET_PHYSICAL_DEVICE_PROPERTIES2) => {
        PFN_vkGetPhysicalDeviceFeatures2 as "vkGetPhysicalDeviceFeatures2KHR" = physical_device::get_physical_device_features2;
        PFN_vkGetPhysicalDeviceProperties2 as "vkGetPhysicalDeviceProperties2KHR" = physical_device::get_physical_device_properties2;
        PFN_vkGetPhysicalDeviceFormatProperties2 as "vkGetPhysicalDeviceFormatProperties2KHR" = physical_device::get_physical_device_format_properties2;
        PFN_vkGetPhysicalDeviceImageFormatProperties2 as "vkGetPhysicalDeviceImageFormatProperties2KHR" = physical_device::get_physical_device_image_format_properties2;
        PFN_vkGetPhysicalDeviceQueueFamilyProperties2 as "vkGetPhysicalDeviceQueueFamilyProperties2KHR" = physical_device::get_physical_device_queue_family_properties2;
        PFN_vkGetPhysicalDeviceMemoryProperties2 as "vkGetPhysicalDeviceMemoryProperties2KHR" = physical_device::get_physical_device_memory_properties2;
        PFN_vkGetPhysicalDeviceSparseImageFormatProperties2 as "vkGetPhysicalDeviceSparseImageFormatProperties2KHR" = physical_device::get_physical_device_sparse_image_format_properties2;
    }

    PhysicalDevice, DeviceExtension(PERFORMANCE_QUERY) => {
        PFN_vkEnumeratePhysicalDeviceQueueFamilyPerformanceQueryCountersKHR = physical_device::enumerate_physical_device_queue_family_performance_query_counters_khr;
        PFN_vkGetPhysicalDeviceQueueFamilyPerformanceQueryPassesKHR = physical_device::get_physical_device_queue_family_performance_query_passes_khr;
    }
    Device, DeviceExtension(PERFORMANCE_QUERY) => {
        PFN_vkAcquireProfilingLockKHR = device::acquire_profiling_lock_khr;
        PFN_vkReleaseProfilingLockKHR = device::release_profiling_lock_khr;
    }

    Device, DeviceExtension(PUSH_DESCRIPTOR) => {
        PFN_vkCmdPushDescriptorSetKHR = compute::cmd_push_descriptor_set_khr;
        PFN_vkCmdPushDescriptorSetWithTemplateKHR = compute::cmd_push_descriptor_set_with_template_khr;
    }

    Device, DeviceExtension(DYNAMIC_RENDERING) => {
        PFN_vkCmdBeginRendering as "vkCmdBeginRenderingKHR" = rendering::cmd_begin_rendering;
        PFN_vkCmdEndRendering as "vkCmdEndRenderingKHR" = rendering::cmd_end_rendering;
    }
    Device, DeviceExtension(SYNCHRONIZATION2) => {
        PFN_vkCmdPipelineBarrier2 as "vkCmdPipelineBarrier2KHR" = command::cmd_pipeline_barrier2;
        PFN_vkCmdSetEvent2 as "vkCmdSetEvent2KHR" = command::cmd_set_event2;
        PFN_vkCmdResetEvent2 as "vkCmdResetEvent2KHR" = command::cmd_reset_event2;
        PFN_vkCmdWaitEvents2 as "vkCmdWaitEvents2KHR" = command::cmd_wait_events2;
        PFN_vkCmdWriteTimestamp2 as "vkCmdWriteTimestamp2KHR" = query::cmd_write_timestamp2;
        PFN_vkQueueSubmit2 as "vkQueueSubmit2KHR" = queue::queue_submit2;
    }
    Device, DeviceExtension(GAUSSIAN_PRIMITIVE_TOPOLOGY) => {
        PFN_vkCmdSetGaussianCameraGAURAST = command::cmd_set_gaussian_camera_gaurast;
    }
}
