//! The hooks by the names of their commands.

use std::ffi::CStr;

use ash::vk;
use gaurast::vk as gvk;
use gaurast_layer_interface::Function;

use super::command_buffers::*;
use super::commands::*;
use super::draws::*;
use super::gaussians::*;
use super::instance::*;
use super::objects::*;
use super::states::*;

macro_rules! table {
    ($(#[$meta:meta])* $lookup:ident: $($hook:ident: $type:ty = [$($command:literal),+];)*) => {
        $(#[$meta])*
        pub(crate) fn $lookup(name: &CStr) -> Option<Function> {
            match name.to_bytes() {
                $(
                    $(bytes if bytes == $command.as_bytes() => {
                        let hook: $type = $hook;
                        // SAFETY: function pointers have one size, and whoever calls it casts it back.
                        Some(unsafe { std::mem::transmute::<$type, Function>(hook) })
                    })+
                )*
                _ => None,
            }
        }
    };
}

table! {
    /// The hook of an instance's command.
    instance_hook:
    create_instance: vk::PFN_vkCreateInstance = ["vkCreateInstance"];
    destroy_instance: vk::PFN_vkDestroyInstance = ["vkDestroyInstance"];
    enumerate_device_extension_properties: vk::PFN_vkEnumerateDeviceExtensionProperties =
        ["vkEnumerateDeviceExtensionProperties"];
    get_physical_device_features2: vk::PFN_vkGetPhysicalDeviceFeatures2 =
        ["vkGetPhysicalDeviceFeatures2", "vkGetPhysicalDeviceFeatures2KHR"];
    get_physical_device_properties2: vk::PFN_vkGetPhysicalDeviceProperties2 =
        ["vkGetPhysicalDeviceProperties2", "vkGetPhysicalDeviceProperties2KHR"];
    create_device: vk::PFN_vkCreateDevice = ["vkCreateDevice"];
}

table! {
    /// The hook of a device's command.
    device_hook:
    destroy_device: vk::PFN_vkDestroyDevice = ["vkDestroyDevice"];
    allocate_memory: vk::PFN_vkAllocateMemory = ["vkAllocateMemory"];
    create_buffer: vk::PFN_vkCreateBuffer = ["vkCreateBuffer"];
    destroy_buffer: vk::PFN_vkDestroyBuffer = ["vkDestroyBuffer"];
    create_descriptor_set_layout: vk::PFN_vkCreateDescriptorSetLayout = ["vkCreateDescriptorSetLayout"];
    destroy_descriptor_set_layout: vk::PFN_vkDestroyDescriptorSetLayout = ["vkDestroyDescriptorSetLayout"];
    create_pipeline_layout: vk::PFN_vkCreatePipelineLayout = ["vkCreatePipelineLayout"];
    destroy_pipeline_layout: vk::PFN_vkDestroyPipelineLayout = ["vkDestroyPipelineLayout"];
    create_render_pass: vk::PFN_vkCreateRenderPass = ["vkCreateRenderPass"];
    create_render_pass2: vk::PFN_vkCreateRenderPass2 = ["vkCreateRenderPass2", "vkCreateRenderPass2KHR"];
    destroy_render_pass: vk::PFN_vkDestroyRenderPass = ["vkDestroyRenderPass"];
    create_graphics_pipelines: vk::PFN_vkCreateGraphicsPipelines = ["vkCreateGraphicsPipelines"];
    destroy_pipeline: vk::PFN_vkDestroyPipeline = ["vkDestroyPipeline"];
    create_command_pool: vk::PFN_vkCreateCommandPool = ["vkCreateCommandPool"];
    destroy_command_pool: vk::PFN_vkDestroyCommandPool = ["vkDestroyCommandPool"];
    reset_command_pool: vk::PFN_vkResetCommandPool = ["vkResetCommandPool"];
    allocate_command_buffers: vk::PFN_vkAllocateCommandBuffers = ["vkAllocateCommandBuffers"];
    free_command_buffers: vk::PFN_vkFreeCommandBuffers = ["vkFreeCommandBuffers"];
    begin_command_buffer: vk::PFN_vkBeginCommandBuffer = ["vkBeginCommandBuffer"];
    end_command_buffer: vk::PFN_vkEndCommandBuffer = ["vkEndCommandBuffer"];
    reset_command_buffer: vk::PFN_vkResetCommandBuffer = ["vkResetCommandBuffer"];
    cmd_bind_pipeline: vk::PFN_vkCmdBindPipeline = ["vkCmdBindPipeline"];
    cmd_bind_vertex_buffers: vk::PFN_vkCmdBindVertexBuffers = ["vkCmdBindVertexBuffers"];
    cmd_bind_vertex_buffers2: vk::PFN_vkCmdBindVertexBuffers2 =
        ["vkCmdBindVertexBuffers2", "vkCmdBindVertexBuffers2EXT"];
    cmd_bind_index_buffer: vk::PFN_vkCmdBindIndexBuffer = ["vkCmdBindIndexBuffer"];
    cmd_bind_descriptor_sets: vk::PFN_vkCmdBindDescriptorSets = ["vkCmdBindDescriptorSets"];
    cmd_push_constants: vk::PFN_vkCmdPushConstants = ["vkCmdPushConstants"];
    cmd_begin_rendering: vk::PFN_vkCmdBeginRendering = ["vkCmdBeginRendering", "vkCmdBeginRenderingKHR"];
    cmd_end_rendering: vk::PFN_vkCmdEndRendering = ["vkCmdEndRendering", "vkCmdEndRenderingKHR"];
    cmd_begin_render_pass: vk::PFN_vkCmdBeginRenderPass = ["vkCmdBeginRenderPass"];
    cmd_begin_render_pass2: vk::PFN_vkCmdBeginRenderPass2 = ["vkCmdBeginRenderPass2", "vkCmdBeginRenderPass2KHR"];
    cmd_next_subpass: vk::PFN_vkCmdNextSubpass = ["vkCmdNextSubpass"];
    cmd_next_subpass2: vk::PFN_vkCmdNextSubpass2 = ["vkCmdNextSubpass2", "vkCmdNextSubpass2KHR"];
    cmd_end_render_pass: vk::PFN_vkCmdEndRenderPass = ["vkCmdEndRenderPass"];
    cmd_end_render_pass2: vk::PFN_vkCmdEndRenderPass2 = ["vkCmdEndRenderPass2", "vkCmdEndRenderPass2KHR"];
    cmd_execute_commands: vk::PFN_vkCmdExecuteCommands = ["vkCmdExecuteCommands"];
    cmd_begin_query: vk::PFN_vkCmdBeginQuery = ["vkCmdBeginQuery"];
    cmd_end_query: vk::PFN_vkCmdEndQuery = ["vkCmdEndQuery"];
    cmd_begin_conditional_rendering: vk::PFN_vkCmdBeginConditionalRenderingEXT =
        ["vkCmdBeginConditionalRenderingEXT"];
    cmd_end_conditional_rendering: vk::PFN_vkCmdEndConditionalRenderingEXT = ["vkCmdEndConditionalRenderingEXT"];
    cmd_set_viewport: vk::PFN_vkCmdSetViewport = ["vkCmdSetViewport"];
    cmd_set_viewport_with_count: vk::PFN_vkCmdSetViewportWithCount =
        ["vkCmdSetViewportWithCount", "vkCmdSetViewportWithCountEXT"];
    cmd_set_scissor: vk::PFN_vkCmdSetScissor = ["vkCmdSetScissor"];
    cmd_set_scissor_with_count: vk::PFN_vkCmdSetScissorWithCount =
        ["vkCmdSetScissorWithCount", "vkCmdSetScissorWithCountEXT"];
    cmd_set_line_width: vk::PFN_vkCmdSetLineWidth = ["vkCmdSetLineWidth"];
    cmd_set_depth_bias: vk::PFN_vkCmdSetDepthBias = ["vkCmdSetDepthBias"];
    cmd_set_blend_constants: vk::PFN_vkCmdSetBlendConstants = ["vkCmdSetBlendConstants"];
    cmd_set_depth_bounds: vk::PFN_vkCmdSetDepthBounds = ["vkCmdSetDepthBounds"];
    cmd_set_stencil_compare_mask: vk::PFN_vkCmdSetStencilCompareMask = ["vkCmdSetStencilCompareMask"];
    cmd_set_stencil_write_mask: vk::PFN_vkCmdSetStencilWriteMask = ["vkCmdSetStencilWriteMask"];
    cmd_set_stencil_reference: vk::PFN_vkCmdSetStencilReference = ["vkCmdSetStencilReference"];
    cmd_set_cull_mode: vk::PFN_vkCmdSetCullMode = ["vkCmdSetCullMode", "vkCmdSetCullModeEXT"];
    cmd_set_front_face: vk::PFN_vkCmdSetFrontFace = ["vkCmdSetFrontFace", "vkCmdSetFrontFaceEXT"];
    cmd_set_primitive_topology: vk::PFN_vkCmdSetPrimitiveTopology =
        ["vkCmdSetPrimitiveTopology", "vkCmdSetPrimitiveTopologyEXT"];
    cmd_set_depth_test_enable: vk::PFN_vkCmdSetDepthTestEnable =
        ["vkCmdSetDepthTestEnable", "vkCmdSetDepthTestEnableEXT"];
    cmd_set_depth_write_enable: vk::PFN_vkCmdSetDepthWriteEnable =
        ["vkCmdSetDepthWriteEnable", "vkCmdSetDepthWriteEnableEXT"];
    cmd_set_depth_compare_op: vk::PFN_vkCmdSetDepthCompareOp = ["vkCmdSetDepthCompareOp", "vkCmdSetDepthCompareOpEXT"];
    cmd_set_depth_bounds_test_enable: vk::PFN_vkCmdSetDepthBoundsTestEnable =
        ["vkCmdSetDepthBoundsTestEnable", "vkCmdSetDepthBoundsTestEnableEXT"];
    cmd_set_stencil_test_enable: vk::PFN_vkCmdSetStencilTestEnable =
        ["vkCmdSetStencilTestEnable", "vkCmdSetStencilTestEnableEXT"];
    cmd_set_stencil_op: vk::PFN_vkCmdSetStencilOp = ["vkCmdSetStencilOp", "vkCmdSetStencilOpEXT"];
    cmd_set_rasterizer_discard_enable: vk::PFN_vkCmdSetRasterizerDiscardEnable =
        ["vkCmdSetRasterizerDiscardEnable", "vkCmdSetRasterizerDiscardEnableEXT"];
    cmd_set_depth_bias_enable: vk::PFN_vkCmdSetDepthBiasEnable =
        ["vkCmdSetDepthBiasEnable", "vkCmdSetDepthBiasEnableEXT"];
    cmd_set_primitive_restart_enable: vk::PFN_vkCmdSetPrimitiveRestartEnable =
        ["vkCmdSetPrimitiveRestartEnable", "vkCmdSetPrimitiveRestartEnableEXT"];
    cmd_draw: vk::PFN_vkCmdDraw = ["vkCmdDraw"];
    cmd_draw_indexed: vk::PFN_vkCmdDrawIndexed = ["vkCmdDrawIndexed"];
    cmd_draw_indirect: vk::PFN_vkCmdDrawIndirect = ["vkCmdDrawIndirect"];
    cmd_draw_indexed_indirect: vk::PFN_vkCmdDrawIndexedIndirect = ["vkCmdDrawIndexedIndirect"];
    cmd_draw_indirect_count: vk::PFN_vkCmdDrawIndirectCount = ["vkCmdDrawIndirectCount", "vkCmdDrawIndirectCountKHR"];
    cmd_draw_indexed_indirect_count: vk::PFN_vkCmdDrawIndexedIndirectCount =
        ["vkCmdDrawIndexedIndirectCount", "vkCmdDrawIndexedIndirectCountKHR"];
    cmd_draw_multi: vk::PFN_vkCmdDrawMultiEXT = ["vkCmdDrawMultiEXT"];
    cmd_draw_multi_indexed: vk::PFN_vkCmdDrawMultiIndexedEXT = ["vkCmdDrawMultiIndexedEXT"];
    cmd_set_gaussian_cameras: gvk::PFN_vkCmdSetGaussianCamerasGAURAST = ["vkCmdSetGaussianCamerasGAURAST"];
    cmd_begin_gaussian_set: gvk::PFN_vkCmdBeginGaussianSetGAURAST = ["vkCmdBeginGaussianSetGAURAST"];
    cmd_end_gaussian_set: gvk::PFN_vkCmdEndGaussianSetGAURAST = ["vkCmdEndGaussianSetGAURAST"];
    cmd_bind_gaussian_spherical_harmonics: gvk::PFN_vkCmdBindGaussianSphericalHarmonicsGAURAST =
        ["vkCmdBindGaussianSphericalHarmonicsGAURAST"];
    cmd_set_gaussian_order: gvk::PFN_vkCmdSetGaussianOrderGAURAST = ["vkCmdSetGaussianOrderGAURAST"];
    cmd_set_gaussian_antialiasing: gvk::PFN_vkCmdSetGaussianAntialiasingGAURAST =
        ["vkCmdSetGaussianAntialiasingGAURAST"];
    cmd_set_gaussian_low_pass_variance: gvk::PFN_vkCmdSetGaussianLowPassVarianceGAURAST =
        ["vkCmdSetGaussianLowPassVarianceGAURAST"];
    cmd_set_gaussian_alpha_floor: gvk::PFN_vkCmdSetGaussianAlphaFloorGAURAST = ["vkCmdSetGaussianAlphaFloorGAURAST"];
    cmd_set_gaussian_alpha_ceiling: gvk::PFN_vkCmdSetGaussianAlphaCeilingGAURAST =
        ["vkCmdSetGaussianAlphaCeilingGAURAST"];
    cmd_set_gaussian_transmittance_floor: gvk::PFN_vkCmdSetGaussianTransmittanceFloorGAURAST =
        ["vkCmdSetGaussianTransmittanceFloorGAURAST"];
    cmd_set_gaussian_spherical_harmonics_degree: gvk::PFN_vkCmdSetGaussianSphericalHarmonicsDegreeGAURAST =
        ["vkCmdSetGaussianSphericalHarmonicsDegreeGAURAST"];
    cmd_set_gaussian_exponential_error: gvk::PFN_vkCmdSetGaussianExponentialErrorGAURAST =
        ["vkCmdSetGaussianExponentialErrorGAURAST"];
    cmd_set_gaussian_contribution_budget: gvk::PFN_vkCmdSetGaussianContributionBudgetGAURAST =
        ["vkCmdSetGaussianContributionBudgetGAURAST"];
}

/// Reports whether a command is the extension's own, which drivers below do not have.
pub(crate) fn is_own(name: &CStr) -> bool {
    name.to_bytes().ends_with(b"GAURAST")
}
