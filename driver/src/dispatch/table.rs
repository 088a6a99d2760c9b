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
    Device, Core(API_VERSION_1_0) => {
        PFN_vkGetDeviceProcAddr = device::get_device_proc_addr;
        PFN_vkDestroyDevice = device::destroy_device;
        PFN_vkGetDeviceQueue = device::get_device_queue;
        PFN_vkQueueSubmit = unsupported::queue_submit;
        PFN_vkQueueWaitIdle = unsupported::queue_wait_idle;
        PFN_vkDeviceWaitIdle = unsupported::device_wait_idle;
        PFN_vkAllocateMemory = unsupported::allocate_memory;
        PFN_vkFreeMemory = unsupported::free_memory;
        PFN_vkMapMemory = unsupported::map_memory;
        PFN_vkUnmapMemory = unsupported::unmap_memory;
        PFN_vkFlushMappedMemoryRanges = unsupported::flush_mapped_memory_ranges;
        PFN_vkInvalidateMappedMemoryRanges = unsupported::invalidate_mapped_memory_ranges;
        PFN_vkGetDeviceMemoryCommitment = unsupported::get_device_memory_commitment;
        PFN_vkBindBufferMemory = unsupported::bind_buffer_memory;
        PFN_vkBindImageMemory = unsupported::bind_image_memory;
        PFN_vkGetBufferMemoryRequirements = unsupported::get_buffer_memory_requirements;
        PFN_vkGetImageMemoryRequirements = unsupported::get_image_memory_requirements;
        PFN_vkGetImageSparseMemoryRequirements = unsupported::get_image_sparse_memory_requirements;
        PFN_vkQueueBindSparse = unsupported::queue_bind_sparse;
        PFN_vkCreateFence = unsupported::create_fence;
        PFN_vkDestroyFence = unsupported::destroy_fence;
        PFN_vkResetFences = unsupported::reset_fences;
        PFN_vkGetFenceStatus = unsupported::get_fence_status;
        PFN_vkWaitForFences = unsupported::wait_for_fences;
        PFN_vkCreateSemaphore = unsupported::create_semaphore;
        PFN_vkDestroySemaphore = unsupported::destroy_semaphore;
        PFN_vkCreateEvent = unsupported::create_event;
        PFN_vkDestroyEvent = unsupported::destroy_event;
        PFN_vkGetEventStatus = unsupported::get_event_status;
        PFN_vkSetEvent = unsupported::set_event;
        PFN_vkResetEvent = unsupported::reset_event;
        PFN_vkCreateQueryPool = unsupported::create_query_pool;
        PFN_vkDestroyQueryPool = unsupported::destroy_query_pool;
        PFN_vkGetQueryPoolResults = unsupported::get_query_pool_results;
        PFN_vkCreateBuffer = unsupported::create_buffer;
        PFN_vkDestroyBuffer = unsupported::destroy_buffer;
        PFN_vkCreateBufferView = unsupported::create_buffer_view;
        PFN_vkDestroyBufferView = unsupported::destroy_buffer_view;
        PFN_vkCreateImage = unsupported::create_image;
        PFN_vkDestroyImage = unsupported::destroy_image;
        PFN_vkGetImageSubresourceLayout = unsupported::get_image_subresource_layout;
        PFN_vkCreateImageView = unsupported::create_image_view;
        PFN_vkDestroyImageView = unsupported::destroy_image_view;
        PFN_vkCreateShaderModule = unsupported::create_shader_module;
        PFN_vkDestroyShaderModule = unsupported::destroy_shader_module;
        PFN_vkCreatePipelineCache = unsupported::create_pipeline_cache;
        PFN_vkDestroyPipelineCache = unsupported::destroy_pipeline_cache;
        PFN_vkGetPipelineCacheData = unsupported::get_pipeline_cache_data;
        PFN_vkMergePipelineCaches = unsupported::merge_pipeline_caches;
        PFN_vkCreateGraphicsPipelines = unsupported::create_graphics_pipelines;
        PFN_vkCreateComputePipelines = unsupported::create_compute_pipelines;
        PFN_vkDestroyPipeline = unsupported::destroy_pipeline;
        PFN_vkCreatePipelineLayout = unsupported::create_pipeline_layout;
        PFN_vkDestroyPipelineLayout = unsupported::destroy_pipeline_layout;
        PFN_vkCreateSampler = unsupported::create_sampler;
        PFN_vkDestroySampler = unsupported::destroy_sampler;
        PFN_vkCreateDescriptorSetLayout = unsupported::create_descriptor_set_layout;
        PFN_vkDestroyDescriptorSetLayout = unsupported::destroy_descriptor_set_layout;
        PFN_vkCreateDescriptorPool = unsupported::create_descriptor_pool;
        PFN_vkDestroyDescriptorPool = unsupported::destroy_descriptor_pool;
        PFN_vkResetDescriptorPool = unsupported::reset_descriptor_pool;
        PFN_vkAllocateDescriptorSets = unsupported::allocate_descriptor_sets;
        PFN_vkFreeDescriptorSets = unsupported::free_descriptor_sets;
        PFN_vkUpdateDescriptorSets = unsupported::update_descriptor_sets;
        PFN_vkCreateFramebuffer = unsupported::create_framebuffer;
        PFN_vkDestroyFramebuffer = unsupported::destroy_framebuffer;
        PFN_vkCreateRenderPass = unsupported::create_render_pass;
        PFN_vkDestroyRenderPass = unsupported::destroy_render_pass;
        PFN_vkGetRenderAreaGranularity = unsupported::get_render_area_granularity;
        PFN_vkCreateCommandPool = unsupported::create_command_pool;
        PFN_vkDestroyCommandPool = unsupported::destroy_command_pool;
        PFN_vkResetCommandPool = unsupported::reset_command_pool;
        PFN_vkAllocateCommandBuffers = unsupported::allocate_command_buffers;
        PFN_vkFreeCommandBuffers = unsupported::free_command_buffers;
        PFN_vkBeginCommandBuffer = unsupported::begin_command_buffer;
        PFN_vkEndCommandBuffer = unsupported::end_command_buffer;
        PFN_vkResetCommandBuffer = unsupported::reset_command_buffer;
        PFN_vkCmdBindPipeline = unsupported::cmd_bind_pipeline;
        PFN_vkCmdSetViewport = unsupported::cmd_set_viewport;
        PFN_vkCmdSetScissor = unsupported::cmd_set_scissor;
        PFN_vkCmdSetLineWidth = unsupported::cmd_set_line_width;
        PFN_vkCmdSetDepthBias = unsupported::cmd_set_depth_bias;
        PFN_vkCmdSetBlendConstants = unsupported::cmd_set_blend_constants;
        PFN_vkCmdSetDepthBounds = unsupported::cmd_set_depth_bounds;
        PFN_vkCmdSetStencilCompareMask = unsupported::cmd_set_stencil_compare_mask;
        PFN_vkCmdSetStencilWriteMask = unsupported::cmd_set_stencil_write_mask;
        PFN_vkCmdSetStencilReference = unsupported::cmd_set_stencil_reference;
        PFN_vkCmdBindDescriptorSets = unsupported::cmd_bind_descriptor_sets;
        PFN_vkCmdBindIndexBuffer = unsupported::cmd_bind_index_buffer;
        PFN_vkCmdBindVertexBuffers = unsupported::cmd_bind_vertex_buffers;
        PFN_vkCmdDraw = unsupported::cmd_draw;
        PFN_vkCmdDrawIndexed = unsupported::cmd_draw_indexed;
        PFN_vkCmdDrawIndirect = unsupported::cmd_draw_indirect;
        PFN_vkCmdDrawIndexedIndirect = unsupported::cmd_draw_indexed_indirect;
        PFN_vkCmdDispatch = unsupported::cmd_dispatch;
        PFN_vkCmdDispatchIndirect = unsupported::cmd_dispatch_indirect;
        PFN_vkCmdCopyBuffer = unsupported::cmd_copy_buffer;
        PFN_vkCmdCopyImage = unsupported::cmd_copy_image;
        PFN_vkCmdBlitImage = unsupported::cmd_blit_image;
        PFN_vkCmdCopyBufferToImage = unsupported::cmd_copy_buffer_to_image;
        PFN_vkCmdCopyImageToBuffer = unsupported::cmd_copy_image_to_buffer;
        PFN_vkCmdUpdateBuffer = unsupported::cmd_update_buffer;
        PFN_vkCmdFillBuffer = unsupported::cmd_fill_buffer;
        PFN_vkCmdClearColorImage = unsupported::cmd_clear_color_image;
        PFN_vkCmdClearDepthStencilImage = unsupported::cmd_clear_depth_stencil_image;
        PFN_vkCmdClearAttachments = unsupported::cmd_clear_attachments;
        PFN_vkCmdResolveImage = unsupported::cmd_resolve_image;
        PFN_vkCmdSetEvent = unsupported::cmd_set_event;
        PFN_vkCmdResetEvent = unsupported::cmd_reset_event;
        PFN_vkCmdWaitEvents = unsupported::cmd_wait_events;
        PFN_vkCmdPipelineBarrier = unsupported::cmd_pipeline_barrier;
        PFN_vkCmdBeginQuery = unsupported::cmd_begin_query;
        PFN_vkCmdEndQuery = unsupported::cmd_end_query;
        PFN_vkCmdResetQueryPool = unsupported::cmd_reset_query_pool;
        PFN_vkCmdWriteTimestamp = unsupported::cmd_write_timestamp;
        PFN_vkCmdCopyQueryPoolResults = unsupported::cmd_copy_query_pool_results;
        PFN_vkCmdPushConstants = unsupported::cmd_push_constants;
        PFN_vkCmdBeginRenderPass = unsupported::cmd_begin_render_pass;
        PFN_vkCmdNextSubpass = unsupported::cmd_next_subpass;
        PFN_vkCmdEndRenderPass = unsupported::cmd_end_render_pass;
        PFN_vkCmdExecuteCommands = unsupported::cmd_execute_commands;
    }
    Global, Core(API_VERSION_1_1) => {
        PFN_vkEnumerateInstanceVersion = instance::enumerate_instance_version;
    }
    Instance, Core(API_VERSION_1_1) => {
        PFN_vkEnumeratePhysicalDeviceGroups = instance::enumerate_physical_device_groups;
    }
    Device, Core(API_VERSION_1_1) => {
        PFN_vkBindBufferMemory2 = unsupported::bind_buffer_memory2;
        PFN_vkBindImageMemory2 = unsupported::bind_image_memory2;
        PFN_vkGetDeviceGroupPeerMemoryFeatures = device::get_device_group_peer_memory_features;
        PFN_vkCmdSetDeviceMask = unsupported::cmd_set_device_mask;
        PFN_vkCmdDispatchBase = unsupported::cmd_dispatch_base;
        PFN_vkGetImageMemoryRequirements2 = unsupported::get_image_memory_requirements2;
        PFN_vkGetBufferMemoryRequirements2 = unsupported::get_buffer_memory_requirements2;
        PFN_vkGetImageSparseMemoryRequirements2 = unsupported::get_image_sparse_memory_requirements2;
        PFN_vkTrimCommandPool = unsupported::trim_command_pool;
        PFN_vkGetDeviceQueue2 = device::get_device_queue2;
        PFN_vkCreateSamplerYcbcrConversion = unsupported::create_sampler_ycbcr_conversion;
        PFN_vkDestroySamplerYcbcrConversion = unsupported::destroy_sampler_ycbcr_conversion;
        PFN_vkCreateDescriptorUpdateTemplate = unsupported::create_descriptor_update_template;
        PFN_vkDestroyDescriptorUpdateTemplate = unsupported::destroy_descriptor_update_template;
        PFN_vkUpdateDescriptorSetWithTemplate = unsupported::update_descriptor_set_with_template;
        PFN_vkGetDescriptorSetLayoutSupport = unsupported::get_descriptor_set_layout_support;
    }
    Device, Core(API_VERSION_1_2) => {
        PFN_vkCmdDrawIndirectCount = unsupported::cmd_draw_indirect_count;
        PFN_vkCmdDrawIndexedIndirectCount = unsupported::cmd_draw_indexed_indirect_count;
        PFN_vkCreateRenderPass2 = unsupported::create_render_pass2;
        PFN_vkCmdBeginRenderPass2 = unsupported::cmd_begin_render_pass2;
        PFN_vkCmdNextSubpass2 = unsupported::cmd_next_subpass2;
        PFN_vkCmdEndRenderPass2 = unsupported::cmd_end_render_pass2;
        PFN_vkResetQueryPool = unsupported::reset_query_pool;
        PFN_vkGetSemaphoreCounterValue = unsupported::get_semaphore_counter_value;
        PFN_vkWaitSemaphores = unsupported::wait_semaphores;
        PFN_vkSignalSemaphore = unsupported::signal_semaphore;
        PFN_vkGetBufferDeviceAddress = unsupported::get_buffer_device_address;
        PFN_vkGetBufferOpaqueCaptureAddress = unsupported::get_buffer_opaque_capture_address;
        PFN_vkGetDeviceMemoryOpaqueCaptureAddress = unsupported::get_device_memory_opaque_capture_address;
    }
    Device, Core(API_VERSION_1_3) => {
        PFN_vkCreatePrivateDataSlot = unsupported::create_private_data_slot;
        PFN_vkDestroyPrivateDataSlot = unsupported::destroy_private_data_slot;
        PFN_vkSetPrivateData = unsupported::set_private_data;
        PFN_vkGetPrivateData = unsupported::get_private_data;
        PFN_vkCmdSetEvent2 = unsupported::cmd_set_event2;
        PFN_vkCmdResetEvent2 = unsupported::cmd_reset_event2;
        PFN_vkCmdWaitEvents2 = unsupported::cmd_wait_events2;
        PFN_vkCmdPipelineBarrier2 = unsupported::cmd_pipeline_barrier2;
        PFN_vkCmdWriteTimestamp2 = unsupported::cmd_write_timestamp2;
        PFN_vkQueueSubmit2 = unsupported::queue_submit2;
        PFN_vkCmdCopyBuffer2 = unsupported::cmd_copy_buffer2;
        PFN_vkCmdCopyImage2 = unsupported::cmd_copy_image2;
        PFN_vkCmdCopyBufferToImage2 = unsupported::cmd_copy_buffer_to_image2;
        PFN_vkCmdCopyImageToBuffer2 = unsupported::cmd_copy_image_to_buffer2;
        PFN_vkCmdBlitImage2 = unsupported::cmd_blit_image2;
        PFN_vkCmdResolveImage2 = unsupported::cmd_resolve_image2;
        PFN_vkCmdBeginRendering = unsupported::cmd_begin_rendering;
        PFN_vkCmdEndRendering = unsupported::cmd_end_rendering;
        PFN_vkCmdSetCullMode = unsupported::cmd_set_cull_mode;
        PFN_vkCmdSetFrontFace = unsupported::cmd_set_front_face;
        PFN_vkCmdSetPrimitiveTopology = unsupported::cmd_set_primitive_topology;
        PFN_vkCmdSetViewportWithCount = unsupported::cmd_set_viewport_with_count;
        PFN_vkCmdSetScissorWithCount = unsupported::cmd_set_scissor_with_count;
        PFN_vkCmdBindVertexBuffers2 = unsupported::cmd_bind_vertex_buffers2;
        PFN_vkCmdSetDepthTestEnable = unsupported::cmd_set_depth_test_enable;
        PFN_vkCmdSetDepthWriteEnable = unsupported::cmd_set_depth_write_enable;
        PFN_vkCmdSetDepthCompareOp = unsupported::cmd_set_depth_compare_op;
        PFN_vkCmdSetDepthBoundsTestEnable = unsupported::cmd_set_depth_bounds_test_enable;
        PFN_vkCmdSetStencilTestEnable = unsupported::cmd_set_stencil_test_enable;
        PFN_vkCmdSetStencilOp = unsupported::cmd_set_stencil_op;
        PFN_vkCmdSetRasterizerDiscardEnable = unsupported::cmd_set_rasterizer_discard_enable;
        PFN_vkCmdSetDepthBiasEnable = unsupported::cmd_set_depth_bias_enable;
        PFN_vkCmdSetPrimitiveRestartEnable = unsupported::cmd_set_primitive_restart_enable;
        PFN_vkGetDeviceBufferMemoryRequirements = unsupported::get_device_buffer_memory_requirements;
        PFN_vkGetDeviceImageMemoryRequirements = unsupported::get_device_image_memory_requirements;
        PFN_vkGetDeviceImageSparseMemoryRequirements = unsupported::get_device_image_sparse_memory_requirements;
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

    Device, DeviceExtension(PERFORMANCE_QUERY) => {
        PFN_vkAcquireProfilingLockKHR = device::acquire_profiling_lock_khr;
        PFN_vkReleaseProfilingLockKHR = device::release_profiling_lock_khr;
    }

    Device, DeviceExtension(DYNAMIC_RENDERING) => {
        PFN_vkCmdBeginRendering as "vkCmdBeginRenderingKHR" = unsupported::cmd_begin_rendering;
        PFN_vkCmdEndRendering as "vkCmdEndRenderingKHR" = unsupported::cmd_end_rendering;
    }
    Device, DeviceExtension(SYNCHRONIZATION2) => {
        PFN_vkCmdPipelineBarrier2 as "vkCmdPipelineBarrier2KHR" = unsupported::cmd_pipeline_barrier2;
        PFN_vkCmdSetEvent2 as "vkCmdSetEvent2KHR" = unsupported::cmd_set_event2;
        PFN_vkCmdResetEvent2 as "vkCmdResetEvent2KHR" = unsupported::cmd_reset_event2;
        PFN_vkCmdWaitEvents2 as "vkCmdWaitEvents2KHR" = unsupported::cmd_wait_events2;
        PFN_vkCmdWriteTimestamp2 as "vkCmdWriteTimestamp2KHR" = unsupported::cmd_write_timestamp2;
        PFN_vkQueueSubmit2 as "vkQueueSubmit2KHR" = unsupported::queue_submit2;
    }
    Device, DeviceExtension(GAUSSIAN_PRIMITIVE_TOPOLOGY) => {
        PFN_vkCmdSetGaussianCameraGAURAST = unsupported::cmd_set_gaussian_camera_gaurast;
    }
}
