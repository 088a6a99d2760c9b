//! The hooks by the names of their commands.

use std::ffi::CStr;

use super::attachments::*;
use super::command_buffers::*;
use super::commands::*;
use super::draws::*;
use super::gaussians::*;
use super::instance::*;
use super::objects::*;
use super::states::*;

gaurast_layer_interface::hooks! {
    /// The hook of an instance's command.
    instance_hook:
    create_instance
    destroy_instance
    enumerate_device_extension_properties
    get_physical_device_features2
    get_physical_device_properties2
    create_device
}

gaurast_layer_interface::hooks! {
    /// The hook of a device's command.
    device_hook:
    destroy_device
    allocate_memory
    create_buffer
    destroy_buffer
    create_image
    destroy_image
    create_image_view
    destroy_image_view
    create_framebuffer
    destroy_framebuffer
    create_descriptor_set_layout
    destroy_descriptor_set_layout
    create_shader_module
    destroy_shader_module
    create_pipeline_layout
    destroy_pipeline_layout
    create_render_pass
    create_render_pass2
    destroy_render_pass
    create_graphics_pipelines
    destroy_pipeline
    create_command_pool
    destroy_command_pool
    reset_command_pool
    allocate_command_buffers
    free_command_buffers
    begin_command_buffer
    end_command_buffer
    reset_command_buffer
    cmd_bind_pipeline
    cmd_bind_vertex_buffers
    cmd_bind_vertex_buffers2
    cmd_bind_index_buffer
    cmd_bind_descriptor_sets
    cmd_push_constants
    cmd_begin_rendering
    cmd_end_rendering
    cmd_begin_render_pass
    cmd_begin_render_pass2
    cmd_next_subpass
    cmd_next_subpass2
    cmd_end_render_pass
    cmd_end_render_pass2
    cmd_execute_commands
    cmd_begin_query
    cmd_end_query
    cmd_begin_conditional_rendering
    cmd_end_conditional_rendering
    cmd_set_viewport
    cmd_set_viewport_with_count
    cmd_set_scissor
    cmd_set_scissor_with_count
    cmd_set_line_width
    cmd_set_depth_bias
    cmd_set_blend_constants
    cmd_set_depth_bounds
    cmd_set_stencil_compare_mask
    cmd_set_stencil_write_mask
    cmd_set_stencil_reference
    cmd_set_cull_mode
    cmd_set_front_face
    cmd_set_primitive_topology
    cmd_set_depth_test_enable
    cmd_set_depth_write_enable
    cmd_set_depth_compare_op
    cmd_set_depth_bounds_test_enable
    cmd_set_stencil_test_enable
    cmd_set_stencil_op
    cmd_set_rasterizer_discard_enable
    cmd_set_depth_bias_enable
    cmd_set_primitive_restart_enable
    cmd_clear_attachments
    cmd_draw
    cmd_draw_indexed
    cmd_draw_indirect
    cmd_draw_indexed_indirect
    cmd_draw_indirect_count
    cmd_draw_indexed_indirect_count
    cmd_draw_multi
    cmd_draw_multi_indexed
    cmd_set_gaussian_cameras
    cmd_begin_gaussian_set
    cmd_end_gaussian_set
    cmd_bind_gaussian_spherical_harmonics
    cmd_bind_gaussian_decoding_tables
    cmd_set_gaussian_order
    cmd_set_gaussian_antialiasing
    cmd_set_gaussian_low_pass_variance
    cmd_set_gaussian_alpha_floor
    cmd_set_gaussian_alpha_ceiling
    cmd_set_gaussian_transmittance_floor
    cmd_set_gaussian_spherical_harmonics_degree
    cmd_set_gaussian_exponential_error
    cmd_set_gaussian_contribution_budget
}

/// Reports whether a command is the extension's own, which drivers below do not have.
pub(crate) fn is_own(name: &CStr) -> bool {
    name.to_bytes().ends_with(b"GAURAST")
}
