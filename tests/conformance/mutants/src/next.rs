//! The next layer's commands of a device, and the list of all that this layer intercepts.

use std::ffi::CStr;
use std::sync::{Arc, PoisonError, RwLock};

use ash::vk;
use gaurast::vk as gvk;

use gaurast_layer_interface::Function;

/// Calls a macro with a row for each command that the layer intercepts: the name of its hook, its type, and its names,
/// the promoted one first.
macro_rules! device_commands {
    ($use:ident) => {
        $use! {
            allocate_memory: vk::PFN_vkAllocateMemory = ["vkAllocateMemory"];
            free_memory: vk::PFN_vkFreeMemory = ["vkFreeMemory"];
            map_memory: vk::PFN_vkMapMemory = ["vkMapMemory"];
            unmap_memory: vk::PFN_vkUnmapMemory = ["vkUnmapMemory"];
            create_image_view: vk::PFN_vkCreateImageView = ["vkCreateImageView"];
            create_graphics_pipelines: vk::PFN_vkCreateGraphicsPipelines = ["vkCreateGraphicsPipelines"];
            allocate_descriptor_sets: vk::PFN_vkAllocateDescriptorSets = ["vkAllocateDescriptorSets"];
            update_descriptor_sets: vk::PFN_vkUpdateDescriptorSets = ["vkUpdateDescriptorSets"];
            get_query_pool_results: vk::PFN_vkGetQueryPoolResults = ["vkGetQueryPoolResults"];
            create_query_pool: vk::PFN_vkCreateQueryPool = ["vkCreateQueryPool"];
            queue_submit: vk::PFN_vkQueueSubmit = ["vkQueueSubmit"];
            begin_command_buffer: vk::PFN_vkBeginCommandBuffer = ["vkBeginCommandBuffer"];
            end_command_buffer: vk::PFN_vkEndCommandBuffer = ["vkEndCommandBuffer"];
            cmd_bind_pipeline: vk::PFN_vkCmdBindPipeline = ["vkCmdBindPipeline"];
            cmd_bind_vertex_buffers: vk::PFN_vkCmdBindVertexBuffers = ["vkCmdBindVertexBuffers"];
            cmd_bind_vertex_buffers2: vk::PFN_vkCmdBindVertexBuffers2 =
                ["vkCmdBindVertexBuffers2", "vkCmdBindVertexBuffers2EXT"];
            cmd_bind_index_buffer: vk::PFN_vkCmdBindIndexBuffer = ["vkCmdBindIndexBuffer"];
            cmd_bind_descriptor_sets: vk::PFN_vkCmdBindDescriptorSets = ["vkCmdBindDescriptorSets"];
            cmd_push_constants: vk::PFN_vkCmdPushConstants = ["vkCmdPushConstants"];
            cmd_set_viewport: vk::PFN_vkCmdSetViewport = ["vkCmdSetViewport"];
            cmd_set_viewport_with_count: vk::PFN_vkCmdSetViewportWithCount =
                ["vkCmdSetViewportWithCount", "vkCmdSetViewportWithCountEXT"];
            cmd_set_scissor: vk::PFN_vkCmdSetScissor = ["vkCmdSetScissor"];
            cmd_set_scissor_with_count: vk::PFN_vkCmdSetScissorWithCount =
                ["vkCmdSetScissorWithCount", "vkCmdSetScissorWithCountEXT"];
            cmd_clear_attachments: vk::PFN_vkCmdClearAttachments = ["vkCmdClearAttachments"];
            cmd_begin_render_pass: vk::PFN_vkCmdBeginRenderPass = ["vkCmdBeginRenderPass"];
            cmd_next_subpass: vk::PFN_vkCmdNextSubpass = ["vkCmdNextSubpass"];
            cmd_end_render_pass: vk::PFN_vkCmdEndRenderPass = ["vkCmdEndRenderPass"];
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
            cmd_draw_multi: vk::PFN_vkCmdDrawMultiEXT = ["vkCmdDrawMultiEXT"];
            cmd_draw_multi_indexed: vk::PFN_vkCmdDrawMultiIndexedEXT = ["vkCmdDrawMultiIndexedEXT"];
            cmd_dispatch: vk::PFN_vkCmdDispatch = ["vkCmdDispatch"];
            cmd_copy_buffer: vk::PFN_vkCmdCopyBuffer = ["vkCmdCopyBuffer"];
            cmd_update_buffer: vk::PFN_vkCmdUpdateBuffer = ["vkCmdUpdateBuffer"];
            cmd_fill_buffer: vk::PFN_vkCmdFillBuffer = ["vkCmdFillBuffer"];
            cmd_copy_query_pool_results: vk::PFN_vkCmdCopyQueryPoolResults = ["vkCmdCopyQueryPoolResults"];
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

/// Stands for a command that the device does not have. It is never called, since no application has its address.
unsafe extern "system" fn absent() {
    std::process::abort();
}

macro_rules! structure {
    ($($name:ident: $type:ty = [$($command:literal),+];)*) => {
        /// The next layer's commands.
        pub(crate) struct Next {
            $(pub(crate) $name: $type,)*
        }

        impl Next {
            /// Looks all of them up.
            ///
            /// # Safety
            /// `find` gives the commands of those names.
            unsafe fn load(find: impl Fn(&CStr) -> Option<Function>) -> Self {
                Self {$(
                    $name: {
                        let mut found = [$(concat!($command, "\0")),+].into_iter().filter_map(|name| {
                            find(CStr::from_bytes_with_nul(name.as_bytes()).ok()?)
                        });
                        // SAFETY: the caller's promise: a command of this name is a function of this type.
                        unsafe { std::mem::transmute::<Function, $type>(found.next().unwrap_or(absent)) }
                    },
                )*}
            }
        }
    };
}
device_commands!(structure);

/// The commands of the device that was created last. All devices of a driver have the same.
static NEXT: RwLock<Option<Arc<Next>>> = RwLock::new(None);

/// Looks up the commands of a new device.
///
/// # Safety
/// `find` gives the commands of a device by name.
pub(crate) unsafe fn load(find: impl Fn(&CStr) -> Option<Function>) {
    // SAFETY: the caller's promise.
    let loaded = unsafe { Next::load(find) };
    *NEXT.write().unwrap_or_else(PoisonError::into_inner) = Some(Arc::new(loaded));
}

/// The next layer's commands.
///
/// # Panics
/// If there is no device, so that no command can be called.
pub(crate) fn next() -> Arc<Next> {
    let next = NEXT.read().unwrap_or_else(PoisonError::into_inner);
    next.clone().expect("commands are those of a device")
}
