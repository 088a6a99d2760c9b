//! The next layer's commands of a device, and the list of all that this layer intercepts.

use std::ffi::CStr;
use std::sync::{Arc, PoisonError, RwLock};

use gaurast_layer_interface::{Function, command_names, command_type};

/// Calls a macro with the hooks of all commands that the layer intercepts.
macro_rules! device_commands {
    ($use:ident) => {
        $use! {
            allocate_memory
            free_memory
            map_memory
            unmap_memory
            create_image_view
            create_graphics_pipelines
            allocate_descriptor_sets
            update_descriptor_sets
            get_query_pool_results
            create_query_pool
            queue_submit
            begin_command_buffer
            end_command_buffer
            cmd_bind_pipeline
            cmd_bind_vertex_buffers
            cmd_bind_vertex_buffers2
            cmd_bind_index_buffer
            cmd_bind_descriptor_sets
            cmd_push_constants
            cmd_set_viewport
            cmd_set_viewport_with_count
            cmd_set_scissor
            cmd_set_scissor_with_count
            cmd_clear_attachments
            cmd_begin_render_pass
            cmd_next_subpass
            cmd_end_render_pass
            cmd_begin_rendering
            cmd_end_rendering
            cmd_execute_commands
            cmd_draw
            cmd_draw_indexed
            cmd_draw_indirect
            cmd_draw_indexed_indirect
            cmd_draw_indirect_count
            cmd_draw_indexed_indirect_count
            cmd_draw_multi
            cmd_draw_multi_indexed
            cmd_dispatch
            cmd_copy_buffer
            cmd_update_buffer
            cmd_fill_buffer
            cmd_copy_query_pool_results
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

/// Stands for a command that the device does not have. It is never called, since no application has its address.
unsafe extern "system" fn absent() {
    std::process::abort();
}

macro_rules! structure {
    ($($name:ident)*) => {
        /// The next layer's commands.
        pub(crate) struct Next {
            $(pub(crate) $name: command_type!($name),)*
        }

        impl Next {
            /// Looks all of them up.
            ///
            /// # Safety
            /// `find` gives the commands of those names.
            unsafe fn load(find: impl Fn(&CStr) -> Option<Function>) -> Self {
                Self {$(
                    $name: {
                        let found = command_names!($name).into_iter().find_map(&find);
                        // SAFETY: the caller's promise: a command of this name is a function of this type.
                        unsafe { std::mem::transmute::<Function, command_type!($name)>(found.unwrap_or(absent)) }
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
