//! The next layer's commands of a device, and the list of all that this layer intercepts.

use std::ffi::CStr;

use ash::vk;
use gaurast::vk as gvk;
use gaurast_layer_interface::Function;

/// Calls a macro with a row for each command that the layer intercepts: the name of its hook, its type, and its names,
/// the promoted one first.
macro_rules! device_commands {
    ($use:ident) => {
        $use! {
            destroy_device: vk::PFN_vkDestroyDevice = ["vkDestroyDevice"];
            allocate_memory: vk::PFN_vkAllocateMemory = ["vkAllocateMemory"];
            free_memory: vk::PFN_vkFreeMemory = ["vkFreeMemory"];
            map_memory: vk::PFN_vkMapMemory = ["vkMapMemory"];
            unmap_memory: vk::PFN_vkUnmapMemory = ["vkUnmapMemory"];
            map_memory2: vk::PFN_vkMapMemory2KHR = ["vkMapMemory2KHR"];
            unmap_memory2: vk::PFN_vkUnmapMemory2KHR = ["vkUnmapMemory2KHR"];
            create_buffer: vk::PFN_vkCreateBuffer = ["vkCreateBuffer"];
            destroy_buffer: vk::PFN_vkDestroyBuffer = ["vkDestroyBuffer"];
            bind_buffer_memory: vk::PFN_vkBindBufferMemory = ["vkBindBufferMemory"];
            bind_buffer_memory2: vk::PFN_vkBindBufferMemory2 = ["vkBindBufferMemory2", "vkBindBufferMemory2KHR"];
            get_buffer_device_address: vk::PFN_vkGetBufferDeviceAddress =
                ["vkGetBufferDeviceAddress", "vkGetBufferDeviceAddressKHR", "vkGetBufferDeviceAddressEXT"];
            create_shader_module: vk::PFN_vkCreateShaderModule = ["vkCreateShaderModule"];
            destroy_shader_module: vk::PFN_vkDestroyShaderModule = ["vkDestroyShaderModule"];
            create_descriptor_set_layout: vk::PFN_vkCreateDescriptorSetLayout = ["vkCreateDescriptorSetLayout"];
            destroy_descriptor_set_layout: vk::PFN_vkDestroyDescriptorSetLayout = ["vkDestroyDescriptorSetLayout"];
            create_pipeline_layout: vk::PFN_vkCreatePipelineLayout = ["vkCreatePipelineLayout"];
            destroy_pipeline_layout: vk::PFN_vkDestroyPipelineLayout = ["vkDestroyPipelineLayout"];
            create_render_pass: vk::PFN_vkCreateRenderPass = ["vkCreateRenderPass"];
            create_render_pass2: vk::PFN_vkCreateRenderPass2 = ["vkCreateRenderPass2", "vkCreateRenderPass2KHR"];
            destroy_render_pass: vk::PFN_vkDestroyRenderPass = ["vkDestroyRenderPass"];
            create_graphics_pipelines: vk::PFN_vkCreateGraphicsPipelines = ["vkCreateGraphicsPipelines"];
            destroy_pipeline: vk::PFN_vkDestroyPipeline = ["vkDestroyPipeline"];
            allocate_descriptor_sets: vk::PFN_vkAllocateDescriptorSets = ["vkAllocateDescriptorSets"];
            free_descriptor_sets: vk::PFN_vkFreeDescriptorSets = ["vkFreeDescriptorSets"];
            reset_descriptor_pool: vk::PFN_vkResetDescriptorPool = ["vkResetDescriptorPool"];
            destroy_descriptor_pool: vk::PFN_vkDestroyDescriptorPool = ["vkDestroyDescriptorPool"];
            update_descriptor_sets: vk::PFN_vkUpdateDescriptorSets = ["vkUpdateDescriptorSets"];
            update_descriptor_set_with_template: vk::PFN_vkUpdateDescriptorSetWithTemplate =
                ["vkUpdateDescriptorSetWithTemplate", "vkUpdateDescriptorSetWithTemplateKHR"];
            allocate_command_buffers: vk::PFN_vkAllocateCommandBuffers = ["vkAllocateCommandBuffers"];
            free_command_buffers: vk::PFN_vkFreeCommandBuffers = ["vkFreeCommandBuffers"];
            destroy_command_pool: vk::PFN_vkDestroyCommandPool = ["vkDestroyCommandPool"];
            begin_command_buffer: vk::PFN_vkBeginCommandBuffer = ["vkBeginCommandBuffer"];
            end_command_buffer: vk::PFN_vkEndCommandBuffer = ["vkEndCommandBuffer"];
            queue_submit: vk::PFN_vkQueueSubmit = ["vkQueueSubmit"];
            queue_submit2: vk::PFN_vkQueueSubmit2 = ["vkQueueSubmit2", "vkQueueSubmit2KHR"];
            cmd_bind_pipeline: vk::PFN_vkCmdBindPipeline = ["vkCmdBindPipeline"];
            cmd_bind_vertex_buffers: vk::PFN_vkCmdBindVertexBuffers = ["vkCmdBindVertexBuffers"];
            cmd_bind_vertex_buffers2: vk::PFN_vkCmdBindVertexBuffers2 =
                ["vkCmdBindVertexBuffers2", "vkCmdBindVertexBuffers2EXT"];
            cmd_bind_index_buffer: vk::PFN_vkCmdBindIndexBuffer = ["vkCmdBindIndexBuffer"];
            cmd_bind_descriptor_sets: vk::PFN_vkCmdBindDescriptorSets = ["vkCmdBindDescriptorSets"];
            cmd_push_descriptor_set: vk::PFN_vkCmdPushDescriptorSetKHR = ["vkCmdPushDescriptorSetKHR"];
            cmd_set_viewport: vk::PFN_vkCmdSetViewport = ["vkCmdSetViewport"];
            cmd_set_viewport_with_count: vk::PFN_vkCmdSetViewportWithCount =
                ["vkCmdSetViewportWithCount", "vkCmdSetViewportWithCountEXT"];
            cmd_set_scissor: vk::PFN_vkCmdSetScissor = ["vkCmdSetScissor"];
            cmd_set_scissor_with_count: vk::PFN_vkCmdSetScissorWithCount =
                ["vkCmdSetScissorWithCount", "vkCmdSetScissorWithCountEXT"];
            cmd_set_blend_constants: vk::PFN_vkCmdSetBlendConstants = ["vkCmdSetBlendConstants"];
            cmd_set_depth_bounds: vk::PFN_vkCmdSetDepthBounds = ["vkCmdSetDepthBounds"];
            cmd_set_stencil_compare_mask: vk::PFN_vkCmdSetStencilCompareMask = ["vkCmdSetStencilCompareMask"];
            cmd_set_stencil_write_mask: vk::PFN_vkCmdSetStencilWriteMask = ["vkCmdSetStencilWriteMask"];
            cmd_set_stencil_reference: vk::PFN_vkCmdSetStencilReference = ["vkCmdSetStencilReference"];
            cmd_set_depth_test_enable: vk::PFN_vkCmdSetDepthTestEnable =
                ["vkCmdSetDepthTestEnable", "vkCmdSetDepthTestEnableEXT"];
            cmd_set_depth_write_enable: vk::PFN_vkCmdSetDepthWriteEnable =
                ["vkCmdSetDepthWriteEnable", "vkCmdSetDepthWriteEnableEXT"];
            cmd_set_depth_compare_op: vk::PFN_vkCmdSetDepthCompareOp =
                ["vkCmdSetDepthCompareOp", "vkCmdSetDepthCompareOpEXT"];
            cmd_set_depth_bounds_test_enable: vk::PFN_vkCmdSetDepthBoundsTestEnable =
                ["vkCmdSetDepthBoundsTestEnable", "vkCmdSetDepthBoundsTestEnableEXT"];
            cmd_set_stencil_test_enable: vk::PFN_vkCmdSetStencilTestEnable =
                ["vkCmdSetStencilTestEnable", "vkCmdSetStencilTestEnableEXT"];
            cmd_begin_render_pass: vk::PFN_vkCmdBeginRenderPass = ["vkCmdBeginRenderPass"];
            cmd_begin_render_pass2: vk::PFN_vkCmdBeginRenderPass2 =
                ["vkCmdBeginRenderPass2", "vkCmdBeginRenderPass2KHR"];
            cmd_next_subpass: vk::PFN_vkCmdNextSubpass = ["vkCmdNextSubpass"];
            cmd_next_subpass2: vk::PFN_vkCmdNextSubpass2 = ["vkCmdNextSubpass2", "vkCmdNextSubpass2KHR"];
            cmd_end_render_pass: vk::PFN_vkCmdEndRenderPass = ["vkCmdEndRenderPass"];
            cmd_end_render_pass2: vk::PFN_vkCmdEndRenderPass2 = ["vkCmdEndRenderPass2", "vkCmdEndRenderPass2KHR"];
            cmd_begin_rendering: vk::PFN_vkCmdBeginRendering = ["vkCmdBeginRendering", "vkCmdBeginRenderingKHR"];
            cmd_end_rendering: vk::PFN_vkCmdEndRendering = ["vkCmdEndRendering", "vkCmdEndRenderingKHR"];
            cmd_execute_commands: vk::PFN_vkCmdExecuteCommands = ["vkCmdExecuteCommands"];
            cmd_draw: vk::PFN_vkCmdDraw = ["vkCmdDraw"];
            cmd_draw_indexed: vk::PFN_vkCmdDrawIndexed = ["vkCmdDrawIndexed"];
            cmd_draw_indirect: vk::PFN_vkCmdDrawIndirect = ["vkCmdDrawIndirect"];
            cmd_draw_indexed_indirect: vk::PFN_vkCmdDrawIndexedIndirect = ["vkCmdDrawIndexedIndirect"];
            cmd_draw_indirect_count: vk::PFN_vkCmdDrawIndirectCount =
                ["vkCmdDrawIndirectCount", "vkCmdDrawIndirectCountKHR"];
            cmd_draw_indexed_indirect_count: vk::PFN_vkCmdDrawIndexedIndirectCount =
                ["vkCmdDrawIndexedIndirectCount", "vkCmdDrawIndexedIndirectCountKHR"];
            cmd_copy_buffer: vk::PFN_vkCmdCopyBuffer = ["vkCmdCopyBuffer"];
            cmd_copy_buffer2: vk::PFN_vkCmdCopyBuffer2 = ["vkCmdCopyBuffer2", "vkCmdCopyBuffer2KHR"];
            cmd_update_buffer: vk::PFN_vkCmdUpdateBuffer = ["vkCmdUpdateBuffer"];
            cmd_fill_buffer: vk::PFN_vkCmdFillBuffer = ["vkCmdFillBuffer"];
            cmd_copy_image_to_buffer: vk::PFN_vkCmdCopyImageToBuffer = ["vkCmdCopyImageToBuffer"];
            cmd_copy_image_to_buffer2: vk::PFN_vkCmdCopyImageToBuffer2 =
                ["vkCmdCopyImageToBuffer2", "vkCmdCopyImageToBuffer2KHR"];
            cmd_set_gaussian_cameras: gvk::PFN_vkCmdSetGaussianCamerasGAURAST = ["vkCmdSetGaussianCamerasGAURAST"];
            cmd_begin_gaussian_set: gvk::PFN_vkCmdBeginGaussianSetGAURAST = ["vkCmdBeginGaussianSetGAURAST"];
            cmd_end_gaussian_set: gvk::PFN_vkCmdEndGaussianSetGAURAST = ["vkCmdEndGaussianSetGAURAST"];
            cmd_set_gaussian_order: gvk::PFN_vkCmdSetGaussianOrderGAURAST = ["vkCmdSetGaussianOrderGAURAST"];
            cmd_set_gaussian_antialiasing: gvk::PFN_vkCmdSetGaussianAntialiasingGAURAST =
                ["vkCmdSetGaussianAntialiasingGAURAST"];
            cmd_set_gaussian_low_pass_variance: gvk::PFN_vkCmdSetGaussianLowPassVarianceGAURAST =
                ["vkCmdSetGaussianLowPassVarianceGAURAST"];
            cmd_set_gaussian_alpha_floor: gvk::PFN_vkCmdSetGaussianAlphaFloorGAURAST =
                ["vkCmdSetGaussianAlphaFloorGAURAST"];
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
            cmd_bind_gaussian_spherical_harmonics: gvk::PFN_vkCmdBindGaussianSphericalHarmonicsGAURAST =
                ["vkCmdBindGaussianSphericalHarmonicsGAURAST"];
        }
    };
}
pub(crate) use device_commands;

macro_rules! structure {
    ($($name:ident: $type:ty = [$($command:literal),+];)*) => {
        /// The next layer's commands; `None` is one that the device does not have.
        pub(crate) struct Next {
            $(pub(crate) $name: Option<$type>,)*
        }

        impl Next {
            /// Looks all of them up.
            ///
            /// # Safety
            /// `find` gives the commands of those names.
            pub(crate) unsafe fn load(find: impl Fn(&CStr) -> Option<Function>) -> Self {
                Self {$(
                    $name: [$(concat!($command, "\0")),+].into_iter().find_map(|name| {
                        let name = CStr::from_bytes_with_nul(name.as_bytes()).ok()?;
                        // SAFETY: the caller's promise: a command of this name is a function of this type.
                        find(name).map(|found| unsafe { std::mem::transmute::<Function, $type>(found) })
                    }),
                )*}
            }
        }
    };
}
device_commands!(structure);
