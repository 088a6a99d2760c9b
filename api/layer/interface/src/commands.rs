//! The commands that layers intercept: their types and names.

/// Makes the macros that know the commands.
macro_rules! commands {
    ($($name:ident: $type:ty = [$($command:literal),+];)*) => {
        /// The type of a command's function, given the command's name as that of a hook: `command_type!(cmd_draw)`.
        #[macro_export]
        macro_rules! command_type {
            $(($name) => { $type };)*
        }

        /// The names of a command, the promoted one first.
        #[macro_export]
        macro_rules! command_names {
            $(($name) => { [$($command),+] };)*
        }
    };
}

commands! {
    create_instance: ::ash::vk::PFN_vkCreateInstance = [c"vkCreateInstance"];
    destroy_instance: ::ash::vk::PFN_vkDestroyInstance = [c"vkDestroyInstance"];
    enumerate_device_extension_properties: ::ash::vk::PFN_vkEnumerateDeviceExtensionProperties =
        [c"vkEnumerateDeviceExtensionProperties"];
    get_physical_device_features2: ::ash::vk::PFN_vkGetPhysicalDeviceFeatures2 =
        [c"vkGetPhysicalDeviceFeatures2", c"vkGetPhysicalDeviceFeatures2KHR"];
    get_physical_device_properties2: ::ash::vk::PFN_vkGetPhysicalDeviceProperties2 =
        [c"vkGetPhysicalDeviceProperties2", c"vkGetPhysicalDeviceProperties2KHR"];
    create_device: ::ash::vk::PFN_vkCreateDevice = [c"vkCreateDevice"];
    create_messenger: ::ash::vk::PFN_vkCreateDebugUtilsMessengerEXT = [c"vkCreateDebugUtilsMessengerEXT"];
    destroy_messenger: ::ash::vk::PFN_vkDestroyDebugUtilsMessengerEXT = [c"vkDestroyDebugUtilsMessengerEXT"];
    destroy_device: ::ash::vk::PFN_vkDestroyDevice = [c"vkDestroyDevice"];
    allocate_memory: ::ash::vk::PFN_vkAllocateMemory = [c"vkAllocateMemory"];
    create_buffer: ::ash::vk::PFN_vkCreateBuffer = [c"vkCreateBuffer"];
    destroy_buffer: ::ash::vk::PFN_vkDestroyBuffer = [c"vkDestroyBuffer"];
    create_descriptor_set_layout: ::ash::vk::PFN_vkCreateDescriptorSetLayout = [c"vkCreateDescriptorSetLayout"];
    destroy_descriptor_set_layout: ::ash::vk::PFN_vkDestroyDescriptorSetLayout = [c"vkDestroyDescriptorSetLayout"];
    create_pipeline_layout: ::ash::vk::PFN_vkCreatePipelineLayout = [c"vkCreatePipelineLayout"];
    destroy_pipeline_layout: ::ash::vk::PFN_vkDestroyPipelineLayout = [c"vkDestroyPipelineLayout"];
    create_render_pass: ::ash::vk::PFN_vkCreateRenderPass = [c"vkCreateRenderPass"];
    create_render_pass2: ::ash::vk::PFN_vkCreateRenderPass2 = [c"vkCreateRenderPass2", c"vkCreateRenderPass2KHR"];
    destroy_render_pass: ::ash::vk::PFN_vkDestroyRenderPass = [c"vkDestroyRenderPass"];
    create_graphics_pipelines: ::ash::vk::PFN_vkCreateGraphicsPipelines = [c"vkCreateGraphicsPipelines"];
    destroy_pipeline: ::ash::vk::PFN_vkDestroyPipeline = [c"vkDestroyPipeline"];
    create_command_pool: ::ash::vk::PFN_vkCreateCommandPool = [c"vkCreateCommandPool"];
    destroy_command_pool: ::ash::vk::PFN_vkDestroyCommandPool = [c"vkDestroyCommandPool"];
    reset_command_pool: ::ash::vk::PFN_vkResetCommandPool = [c"vkResetCommandPool"];
    allocate_command_buffers: ::ash::vk::PFN_vkAllocateCommandBuffers = [c"vkAllocateCommandBuffers"];
    free_command_buffers: ::ash::vk::PFN_vkFreeCommandBuffers = [c"vkFreeCommandBuffers"];
    begin_command_buffer: ::ash::vk::PFN_vkBeginCommandBuffer = [c"vkBeginCommandBuffer"];
    end_command_buffer: ::ash::vk::PFN_vkEndCommandBuffer = [c"vkEndCommandBuffer"];
    reset_command_buffer: ::ash::vk::PFN_vkResetCommandBuffer = [c"vkResetCommandBuffer"];
    free_memory: ::ash::vk::PFN_vkFreeMemory = [c"vkFreeMemory"];
    map_memory: ::ash::vk::PFN_vkMapMemory = [c"vkMapMemory"];
    unmap_memory: ::ash::vk::PFN_vkUnmapMemory = [c"vkUnmapMemory"];
    map_memory2: ::ash::vk::PFN_vkMapMemory2KHR = [c"vkMapMemory2KHR"];
    unmap_memory2: ::ash::vk::PFN_vkUnmapMemory2KHR = [c"vkUnmapMemory2KHR"];
    bind_buffer_memory: ::ash::vk::PFN_vkBindBufferMemory = [c"vkBindBufferMemory"];
    bind_buffer_memory2: ::ash::vk::PFN_vkBindBufferMemory2 = [c"vkBindBufferMemory2", c"vkBindBufferMemory2KHR"];
    get_buffer_device_address: ::ash::vk::PFN_vkGetBufferDeviceAddress =
        [c"vkGetBufferDeviceAddress", c"vkGetBufferDeviceAddressKHR", c"vkGetBufferDeviceAddressEXT"];
    create_shader_module: ::ash::vk::PFN_vkCreateShaderModule = [c"vkCreateShaderModule"];
    destroy_shader_module: ::ash::vk::PFN_vkDestroyShaderModule = [c"vkDestroyShaderModule"];
    allocate_descriptor_sets: ::ash::vk::PFN_vkAllocateDescriptorSets = [c"vkAllocateDescriptorSets"];
    free_descriptor_sets: ::ash::vk::PFN_vkFreeDescriptorSets = [c"vkFreeDescriptorSets"];
    reset_descriptor_pool: ::ash::vk::PFN_vkResetDescriptorPool = [c"vkResetDescriptorPool"];
    destroy_descriptor_pool: ::ash::vk::PFN_vkDestroyDescriptorPool = [c"vkDestroyDescriptorPool"];
    update_descriptor_sets: ::ash::vk::PFN_vkUpdateDescriptorSets = [c"vkUpdateDescriptorSets"];
    update_descriptor_set_with_template: ::ash::vk::PFN_vkUpdateDescriptorSetWithTemplate =
        [c"vkUpdateDescriptorSetWithTemplate", c"vkUpdateDescriptorSetWithTemplateKHR"];
    queue_submit: ::ash::vk::PFN_vkQueueSubmit = [c"vkQueueSubmit"];
    queue_submit2: ::ash::vk::PFN_vkQueueSubmit2 = [c"vkQueueSubmit2", c"vkQueueSubmit2KHR"];
    queue_wait_idle: ::ash::vk::PFN_vkQueueWaitIdle = [c"vkQueueWaitIdle"];
    device_wait_idle: ::ash::vk::PFN_vkDeviceWaitIdle = [c"vkDeviceWaitIdle"];
    wait_for_fences: ::ash::vk::PFN_vkWaitForFences = [c"vkWaitForFences"];
    get_fence_status: ::ash::vk::PFN_vkGetFenceStatus = [c"vkGetFenceStatus"];
    reset_fences: ::ash::vk::PFN_vkResetFences = [c"vkResetFences"];
    destroy_fence: ::ash::vk::PFN_vkDestroyFence = [c"vkDestroyFence"];
    create_semaphore: ::ash::vk::PFN_vkCreateSemaphore = [c"vkCreateSemaphore"];
    destroy_semaphore: ::ash::vk::PFN_vkDestroySemaphore = [c"vkDestroySemaphore"];
    wait_semaphores: ::ash::vk::PFN_vkWaitSemaphores = [c"vkWaitSemaphores", c"vkWaitSemaphoresKHR"];
    get_semaphore_counter_value: ::ash::vk::PFN_vkGetSemaphoreCounterValue =
        [c"vkGetSemaphoreCounterValue", c"vkGetSemaphoreCounterValueKHR"];
    create_image: ::ash::vk::PFN_vkCreateImage = [c"vkCreateImage"];
    destroy_image: ::ash::vk::PFN_vkDestroyImage = [c"vkDestroyImage"];
    create_image_view: ::ash::vk::PFN_vkCreateImageView = [c"vkCreateImageView"];
    destroy_image_view: ::ash::vk::PFN_vkDestroyImageView = [c"vkDestroyImageView"];
    create_framebuffer: ::ash::vk::PFN_vkCreateFramebuffer = [c"vkCreateFramebuffer"];
    destroy_framebuffer: ::ash::vk::PFN_vkDestroyFramebuffer = [c"vkDestroyFramebuffer"];
    get_query_pool_results: ::ash::vk::PFN_vkGetQueryPoolResults = [c"vkGetQueryPoolResults"];
    create_query_pool: ::ash::vk::PFN_vkCreateQueryPool = [c"vkCreateQueryPool"];
    cmd_bind_pipeline: ::ash::vk::PFN_vkCmdBindPipeline = [c"vkCmdBindPipeline"];
    cmd_bind_vertex_buffers: ::ash::vk::PFN_vkCmdBindVertexBuffers = [c"vkCmdBindVertexBuffers"];
    cmd_bind_vertex_buffers2: ::ash::vk::PFN_vkCmdBindVertexBuffers2 =
        [c"vkCmdBindVertexBuffers2", c"vkCmdBindVertexBuffers2EXT"];
    cmd_bind_index_buffer: ::ash::vk::PFN_vkCmdBindIndexBuffer = [c"vkCmdBindIndexBuffer"];
    cmd_bind_descriptor_sets: ::ash::vk::PFN_vkCmdBindDescriptorSets = [c"vkCmdBindDescriptorSets"];
    cmd_push_constants: ::ash::vk::PFN_vkCmdPushConstants = [c"vkCmdPushConstants"];
    cmd_push_constants2: ::ash::vk::PFN_vkCmdPushConstants2KHR = [c"vkCmdPushConstants2KHR"];
    cmd_begin_rendering: ::ash::vk::PFN_vkCmdBeginRendering = [c"vkCmdBeginRendering", c"vkCmdBeginRenderingKHR"];
    cmd_end_rendering: ::ash::vk::PFN_vkCmdEndRendering = [c"vkCmdEndRendering", c"vkCmdEndRenderingKHR"];
    cmd_begin_render_pass: ::ash::vk::PFN_vkCmdBeginRenderPass = [c"vkCmdBeginRenderPass"];
    cmd_begin_render_pass2: ::ash::vk::PFN_vkCmdBeginRenderPass2 =
        [c"vkCmdBeginRenderPass2", c"vkCmdBeginRenderPass2KHR"];
    cmd_next_subpass: ::ash::vk::PFN_vkCmdNextSubpass = [c"vkCmdNextSubpass"];
    cmd_next_subpass2: ::ash::vk::PFN_vkCmdNextSubpass2 = [c"vkCmdNextSubpass2", c"vkCmdNextSubpass2KHR"];
    cmd_end_render_pass: ::ash::vk::PFN_vkCmdEndRenderPass = [c"vkCmdEndRenderPass"];
    cmd_end_render_pass2: ::ash::vk::PFN_vkCmdEndRenderPass2 = [c"vkCmdEndRenderPass2", c"vkCmdEndRenderPass2KHR"];
    cmd_execute_commands: ::ash::vk::PFN_vkCmdExecuteCommands = [c"vkCmdExecuteCommands"];
    cmd_begin_query: ::ash::vk::PFN_vkCmdBeginQuery = [c"vkCmdBeginQuery"];
    cmd_end_query: ::ash::vk::PFN_vkCmdEndQuery = [c"vkCmdEndQuery"];
    cmd_begin_conditional_rendering: ::ash::vk::PFN_vkCmdBeginConditionalRenderingEXT =
        [c"vkCmdBeginConditionalRenderingEXT"];
    cmd_end_conditional_rendering: ::ash::vk::PFN_vkCmdEndConditionalRenderingEXT =
        [c"vkCmdEndConditionalRenderingEXT"];
    cmd_set_viewport: ::ash::vk::PFN_vkCmdSetViewport = [c"vkCmdSetViewport"];
    cmd_set_viewport_with_count: ::ash::vk::PFN_vkCmdSetViewportWithCount =
        [c"vkCmdSetViewportWithCount", c"vkCmdSetViewportWithCountEXT"];
    cmd_set_scissor: ::ash::vk::PFN_vkCmdSetScissor = [c"vkCmdSetScissor"];
    cmd_set_scissor_with_count: ::ash::vk::PFN_vkCmdSetScissorWithCount =
        [c"vkCmdSetScissorWithCount", c"vkCmdSetScissorWithCountEXT"];
    cmd_set_line_width: ::ash::vk::PFN_vkCmdSetLineWidth = [c"vkCmdSetLineWidth"];
    cmd_set_depth_bias: ::ash::vk::PFN_vkCmdSetDepthBias = [c"vkCmdSetDepthBias"];
    cmd_set_blend_constants: ::ash::vk::PFN_vkCmdSetBlendConstants = [c"vkCmdSetBlendConstants"];
    cmd_set_depth_bounds: ::ash::vk::PFN_vkCmdSetDepthBounds = [c"vkCmdSetDepthBounds"];
    cmd_set_stencil_compare_mask: ::ash::vk::PFN_vkCmdSetStencilCompareMask = [c"vkCmdSetStencilCompareMask"];
    cmd_set_stencil_write_mask: ::ash::vk::PFN_vkCmdSetStencilWriteMask = [c"vkCmdSetStencilWriteMask"];
    cmd_set_stencil_reference: ::ash::vk::PFN_vkCmdSetStencilReference = [c"vkCmdSetStencilReference"];
    cmd_set_cull_mode: ::ash::vk::PFN_vkCmdSetCullMode = [c"vkCmdSetCullMode", c"vkCmdSetCullModeEXT"];
    cmd_set_front_face: ::ash::vk::PFN_vkCmdSetFrontFace = [c"vkCmdSetFrontFace", c"vkCmdSetFrontFaceEXT"];
    cmd_set_primitive_topology: ::ash::vk::PFN_vkCmdSetPrimitiveTopology =
        [c"vkCmdSetPrimitiveTopology", c"vkCmdSetPrimitiveTopologyEXT"];
    cmd_set_depth_test_enable: ::ash::vk::PFN_vkCmdSetDepthTestEnable =
        [c"vkCmdSetDepthTestEnable", c"vkCmdSetDepthTestEnableEXT"];
    cmd_set_depth_write_enable: ::ash::vk::PFN_vkCmdSetDepthWriteEnable =
        [c"vkCmdSetDepthWriteEnable", c"vkCmdSetDepthWriteEnableEXT"];
    cmd_set_depth_compare_op: ::ash::vk::PFN_vkCmdSetDepthCompareOp =
        [c"vkCmdSetDepthCompareOp", c"vkCmdSetDepthCompareOpEXT"];
    cmd_set_depth_bounds_test_enable: ::ash::vk::PFN_vkCmdSetDepthBoundsTestEnable =
        [c"vkCmdSetDepthBoundsTestEnable", c"vkCmdSetDepthBoundsTestEnableEXT"];
    cmd_set_stencil_test_enable: ::ash::vk::PFN_vkCmdSetStencilTestEnable =
        [c"vkCmdSetStencilTestEnable", c"vkCmdSetStencilTestEnableEXT"];
    cmd_set_stencil_op: ::ash::vk::PFN_vkCmdSetStencilOp = [c"vkCmdSetStencilOp", c"vkCmdSetStencilOpEXT"];
    cmd_set_rasterizer_discard_enable: ::ash::vk::PFN_vkCmdSetRasterizerDiscardEnable =
        [c"vkCmdSetRasterizerDiscardEnable", c"vkCmdSetRasterizerDiscardEnableEXT"];
    cmd_set_depth_bias_enable: ::ash::vk::PFN_vkCmdSetDepthBiasEnable =
        [c"vkCmdSetDepthBiasEnable", c"vkCmdSetDepthBiasEnableEXT"];
    cmd_set_primitive_restart_enable: ::ash::vk::PFN_vkCmdSetPrimitiveRestartEnable =
        [c"vkCmdSetPrimitiveRestartEnable", c"vkCmdSetPrimitiveRestartEnableEXT"];
    cmd_draw: ::ash::vk::PFN_vkCmdDraw = [c"vkCmdDraw"];
    cmd_draw_indexed: ::ash::vk::PFN_vkCmdDrawIndexed = [c"vkCmdDrawIndexed"];
    cmd_draw_indirect: ::ash::vk::PFN_vkCmdDrawIndirect = [c"vkCmdDrawIndirect"];
    cmd_draw_indexed_indirect: ::ash::vk::PFN_vkCmdDrawIndexedIndirect = [c"vkCmdDrawIndexedIndirect"];
    cmd_draw_indirect_count: ::ash::vk::PFN_vkCmdDrawIndirectCount =
        [c"vkCmdDrawIndirectCount", c"vkCmdDrawIndirectCountKHR"];
    cmd_draw_indexed_indirect_count: ::ash::vk::PFN_vkCmdDrawIndexedIndirectCount =
        [c"vkCmdDrawIndexedIndirectCount", c"vkCmdDrawIndexedIndirectCountKHR"];
    cmd_draw_multi: ::ash::vk::PFN_vkCmdDrawMultiEXT = [c"vkCmdDrawMultiEXT"];
    cmd_draw_multi_indexed: ::ash::vk::PFN_vkCmdDrawMultiIndexedEXT = [c"vkCmdDrawMultiIndexedEXT"];
    cmd_push_descriptor_set: ::ash::vk::PFN_vkCmdPushDescriptorSetKHR = [c"vkCmdPushDescriptorSetKHR"];
    cmd_copy_buffer: ::ash::vk::PFN_vkCmdCopyBuffer = [c"vkCmdCopyBuffer"];
    cmd_copy_buffer2: ::ash::vk::PFN_vkCmdCopyBuffer2 = [c"vkCmdCopyBuffer2", c"vkCmdCopyBuffer2KHR"];
    cmd_update_buffer: ::ash::vk::PFN_vkCmdUpdateBuffer = [c"vkCmdUpdateBuffer"];
    cmd_fill_buffer: ::ash::vk::PFN_vkCmdFillBuffer = [c"vkCmdFillBuffer"];
    cmd_copy_image_to_buffer: ::ash::vk::PFN_vkCmdCopyImageToBuffer = [c"vkCmdCopyImageToBuffer"];
    cmd_copy_image_to_buffer2: ::ash::vk::PFN_vkCmdCopyImageToBuffer2 =
        [c"vkCmdCopyImageToBuffer2", c"vkCmdCopyImageToBuffer2KHR"];
    cmd_clear_attachments: ::ash::vk::PFN_vkCmdClearAttachments = [c"vkCmdClearAttachments"];
    cmd_dispatch: ::ash::vk::PFN_vkCmdDispatch = [c"vkCmdDispatch"];
    cmd_dispatch_base: ::ash::vk::PFN_vkCmdDispatchBase = [c"vkCmdDispatchBase", c"vkCmdDispatchBaseKHR"];
    cmd_dispatch_indirect: ::ash::vk::PFN_vkCmdDispatchIndirect = [c"vkCmdDispatchIndirect"];
    cmd_copy_query_pool_results: ::ash::vk::PFN_vkCmdCopyQueryPoolResults = [c"vkCmdCopyQueryPoolResults"];
    cmd_set_gaussian_cameras: ::gaurast::vk::PFN_vkCmdSetGaussianCamerasGAURAST = [c"vkCmdSetGaussianCamerasGAURAST"];
    cmd_begin_gaussian_set: ::gaurast::vk::PFN_vkCmdBeginGaussianSetGAURAST = [c"vkCmdBeginGaussianSetGAURAST"];
    cmd_end_gaussian_set: ::gaurast::vk::PFN_vkCmdEndGaussianSetGAURAST = [c"vkCmdEndGaussianSetGAURAST"];
    cmd_bind_gaussian_spherical_harmonics: ::gaurast::vk::PFN_vkCmdBindGaussianSphericalHarmonicsGAURAST =
        [c"vkCmdBindGaussianSphericalHarmonicsGAURAST"];
    cmd_bind_gaussian_decoding_tables: ::gaurast::vk::PFN_vkCmdBindGaussianDecodingTablesGAURAST =
        [c"vkCmdBindGaussianDecodingTablesGAURAST"];
    cmd_set_gaussian_order: ::gaurast::vk::PFN_vkCmdSetGaussianOrderGAURAST = [c"vkCmdSetGaussianOrderGAURAST"];
    cmd_set_gaussian_antialiasing: ::gaurast::vk::PFN_vkCmdSetGaussianAntialiasingGAURAST =
        [c"vkCmdSetGaussianAntialiasingGAURAST"];
    cmd_set_gaussian_low_pass_variance: ::gaurast::vk::PFN_vkCmdSetGaussianLowPassVarianceGAURAST =
        [c"vkCmdSetGaussianLowPassVarianceGAURAST"];
    cmd_set_gaussian_alpha_floor: ::gaurast::vk::PFN_vkCmdSetGaussianAlphaFloorGAURAST =
        [c"vkCmdSetGaussianAlphaFloorGAURAST"];
    cmd_set_gaussian_alpha_ceiling: ::gaurast::vk::PFN_vkCmdSetGaussianAlphaCeilingGAURAST =
        [c"vkCmdSetGaussianAlphaCeilingGAURAST"];
    cmd_set_gaussian_transmittance_floor: ::gaurast::vk::PFN_vkCmdSetGaussianTransmittanceFloorGAURAST =
        [c"vkCmdSetGaussianTransmittanceFloorGAURAST"];
    cmd_set_gaussian_spherical_harmonics_degree: ::gaurast::vk::PFN_vkCmdSetGaussianSphericalHarmonicsDegreeGAURAST =
        [c"vkCmdSetGaussianSphericalHarmonicsDegreeGAURAST"];
    cmd_set_gaussian_exponential_error: ::gaurast::vk::PFN_vkCmdSetGaussianExponentialErrorGAURAST =
        [c"vkCmdSetGaussianExponentialErrorGAURAST"];
    cmd_set_gaussian_contribution_budget: ::gaurast::vk::PFN_vkCmdSetGaussianContributionBudgetGAURAST =
        [c"vkCmdSetGaussianContributionBudgetGAURAST"];
}

/// Defines a function that finds the hook of a command by name. Each hook is a function in scope that is called as the command.
#[macro_export]
macro_rules! hooks {
    ($(#[$meta:meta])* $lookup:ident: $($name:ident)*) => {
        $(#[$meta])*
        pub(crate) fn $lookup(name: &::std::ffi::CStr) -> Option<$crate::Function> {
            $(
                if $crate::command_names!($name).contains(&name) {
                    let hook: $crate::command_type!($name) = $name;
                    // SAFETY: function pointers have one size, and whoever calls it casts it back.
                    return Some(unsafe {
                        ::std::mem::transmute::<$crate::command_type!($name), $crate::Function>(hook)
                    });
                }
            )*
            None
        }
    };
}
