//! Dynamic state that no pipeline reads yet: Gaussian pipelines have no lines, faces, depth or stencil tests, and one
//! that asks for such state to be dynamic where it would matter fails creation.

use super::command::record;
use ash::vk;

macro_rules! unread {
    ($(fn $name:ident($first:ident: $first_type:ty $(, $argument:ident: $type:ty)*);)*) => {
        crate::entry_points! {$(
            fn $name($first: $first_type $(, $argument: $type)*) {
                record($first, |_| Ok(()))
            }
        )*}
    };
}

unread! {
    fn cmd_set_line_width(command_buffer: vk::CommandBuffer, _line_width: f32);
    fn cmd_set_depth_bias(command_buffer: vk::CommandBuffer, _depth_bias_constant_factor: f32, _depth_bias_clamp: f32, _depth_bias_slope_factor: f32);
    fn cmd_set_depth_bounds(command_buffer: vk::CommandBuffer, _min_depth_bounds: f32, _max_depth_bounds: f32);
    fn cmd_set_stencil_compare_mask(command_buffer: vk::CommandBuffer, _face_mask: vk::StencilFaceFlags, _compare_mask: u32);
    fn cmd_set_stencil_write_mask(command_buffer: vk::CommandBuffer, _face_mask: vk::StencilFaceFlags, _write_mask: u32);
    fn cmd_set_stencil_reference(command_buffer: vk::CommandBuffer, _face_mask: vk::StencilFaceFlags, _reference: u32);
    fn cmd_set_cull_mode(command_buffer: vk::CommandBuffer, _cull_mode: vk::CullModeFlags);
    fn cmd_set_front_face(command_buffer: vk::CommandBuffer, _front_face: vk::FrontFace);
    fn cmd_set_primitive_topology(command_buffer: vk::CommandBuffer, _primitive_topology: vk::PrimitiveTopology);
    fn cmd_set_depth_test_enable(command_buffer: vk::CommandBuffer, _depth_test_enable: vk::Bool32);
    fn cmd_set_depth_write_enable(command_buffer: vk::CommandBuffer, _depth_write_enable: vk::Bool32);
    fn cmd_set_depth_compare_op(command_buffer: vk::CommandBuffer, _depth_compare_op: vk::CompareOp);
    fn cmd_set_depth_bounds_test_enable(command_buffer: vk::CommandBuffer, _depth_bounds_test_enable: vk::Bool32);
    fn cmd_set_stencil_test_enable(command_buffer: vk::CommandBuffer, _stencil_test_enable: vk::Bool32);
    fn cmd_set_stencil_op(command_buffer: vk::CommandBuffer, _face_mask: vk::StencilFaceFlags, _fail_op: vk::StencilOp, _pass_op: vk::StencilOp, _depth_fail_op: vk::StencilOp, _compare_op: vk::CompareOp);
    fn cmd_set_rasterizer_discard_enable(command_buffer: vk::CommandBuffer, _rasterizer_discard_enable: vk::Bool32);
    fn cmd_set_depth_bias_enable(command_buffer: vk::CommandBuffer, _depth_bias_enable: vk::Bool32);
    fn cmd_set_primitive_restart_enable(command_buffer: vk::CommandBuffer, _primitive_restart_enable: vk::Bool32);
    fn cmd_set_device_mask(command_buffer: vk::CommandBuffer, _device_mask: u32);
}
