//! The next layer's commands of a device, and the list of all that this layer intercepts.

use std::ffi::CStr;

use gaurast_layer_interface::{Function, command_names, command_type};

/// Calls a macro with the hooks of all commands that the layer intercepts.
macro_rules! device_commands {
    ($use:ident) => {
        $use! {
            destroy_device
            allocate_memory
            free_memory
            map_memory
            unmap_memory
            map_memory2
            unmap_memory2
            create_buffer
            destroy_buffer
            bind_buffer_memory
            bind_buffer_memory2
            get_buffer_device_address
            create_shader_module
            destroy_shader_module
            create_descriptor_set_layout
            destroy_descriptor_set_layout
            create_pipeline_layout
            destroy_pipeline_layout
            create_render_pass
            create_render_pass2
            destroy_render_pass
            create_graphics_pipelines
            destroy_pipeline
            allocate_descriptor_sets
            free_descriptor_sets
            reset_descriptor_pool
            destroy_descriptor_pool
            update_descriptor_sets
            update_descriptor_set_with_template
            allocate_command_buffers
            free_command_buffers
            destroy_command_pool
            begin_command_buffer
            end_command_buffer
            queue_submit
            queue_submit2
            queue_wait_idle
            device_wait_idle
            wait_for_fences
            get_fence_status
            reset_fences
            destroy_fence
            create_semaphore
            destroy_semaphore
            wait_semaphores
            get_semaphore_counter_value
            cmd_bind_pipeline
            cmd_bind_vertex_buffers
            cmd_bind_vertex_buffers2
            cmd_bind_index_buffer
            cmd_bind_descriptor_sets
            cmd_push_descriptor_set
            cmd_set_viewport
            cmd_set_viewport_with_count
            cmd_set_scissor
            cmd_set_scissor_with_count
            cmd_set_blend_constants
            cmd_set_depth_bounds
            cmd_set_stencil_compare_mask
            cmd_set_stencil_write_mask
            cmd_set_stencil_reference
            cmd_set_depth_test_enable
            cmd_set_depth_write_enable
            cmd_set_depth_compare_op
            cmd_set_depth_bounds_test_enable
            cmd_set_stencil_test_enable
            cmd_begin_render_pass
            cmd_begin_render_pass2
            cmd_next_subpass
            cmd_next_subpass2
            cmd_end_render_pass
            cmd_end_render_pass2
            cmd_begin_rendering
            cmd_end_rendering
            cmd_execute_commands
            cmd_draw
            cmd_draw_indexed
            cmd_draw_multi
            cmd_draw_multi_indexed
            cmd_draw_indirect
            cmd_draw_indexed_indirect
            cmd_draw_indirect_count
            cmd_draw_indexed_indirect_count
            cmd_push_constants
            cmd_push_constants2
            cmd_dispatch
            cmd_dispatch_base
            cmd_dispatch_indirect
            cmd_end_query
            cmd_clear_attachments
            cmd_copy_buffer
            cmd_copy_buffer2
            cmd_update_buffer
            cmd_fill_buffer
            cmd_copy_image_to_buffer
            cmd_copy_image_to_buffer2
            cmd_set_gaussian_cameras
            cmd_begin_gaussian_set
            cmd_end_gaussian_set
            cmd_set_gaussian_order
            cmd_set_gaussian_antialiasing
            cmd_set_gaussian_low_pass_variance
            cmd_set_gaussian_alpha_floor
            cmd_set_gaussian_alpha_ceiling
            cmd_set_gaussian_transmittance_floor
            cmd_set_gaussian_spherical_harmonics_degree
            cmd_set_gaussian_exponential_error
            cmd_set_gaussian_contribution_budget
            cmd_bind_gaussian_spherical_harmonics
            cmd_bind_gaussian_decoding_tables
        }
    };
}
pub(crate) use device_commands;

macro_rules! structure {
    ($($name:ident)*) => {
        /// The next layer's commands; `None` is one that the device does not have.
        pub(crate) struct Next {
            $(pub(crate) $name: Option<command_type!($name)>,)*
        }

        impl Next {
            /// Looks all of them up.
            ///
            /// # Safety
            /// `find` gives the commands of those names.
            pub(crate) unsafe fn load(find: impl Fn(&CStr) -> Option<Function>) -> Self {
                Self {$(
                    $name: command_names!($name).into_iter().find_map(|name| {
                        // SAFETY: the caller's promise: a command of this name is a function of this type.
                        find(name).map(|found| unsafe { std::mem::transmute::<Function, command_type!($name)>(found) })
                    }),
                )*}
            }
        }
    };
}
device_commands!(structure);
