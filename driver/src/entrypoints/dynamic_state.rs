//! Commands that set fixed-function state.

use super::command::record;
use crate::command::record::Command;
use crate::error::Error;
use crate::object::pipeline::convert;
use crate::object::pipeline::setting::{self, Setting, faces};
use crate::pointer;
use ash::vk;
use gaurast::vk::PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST;
use simdevice::packet::draw::DepthBias;

/// Records one setting.
///
/// # Safety
/// The handle is live.
unsafe fn set(command_buffer: vk::CommandBuffer, setting: Setting) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    unsafe {
        record(command_buffer, |recorder| {
            recorder.push(Command::Set(setting));
            Ok(())
        })
    }
}

/// Records a setting for each face of a mask.
///
/// # Safety
/// The handle is live.
unsafe fn set_faces(
    command_buffer: vk::CommandBuffer,
    mask: vk::StencilFaceFlags,
    setting: impl Fn(setting::Face) -> Setting,
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    unsafe {
        record(command_buffer, |recorder| {
            faces(mask).for_each(|face| recorder.push(Command::Set(setting(face))));
            Ok(())
        })
    }
}

/// Commands that set one switch.
macro_rules! switches {
    ($($name:ident => $setting:ident;)*) => {
        crate::entry_points! {$(
            fn $name(command_buffer: vk::CommandBuffer, enable: vk::Bool32) {
                set(command_buffer, Setting::$setting(enable != vk::FALSE))
            }
        )*}
    };
}

switches! {
    cmd_set_depth_test_enable => DepthTestEnable;
    cmd_set_depth_write_enable => DepthWriteEnable;
    cmd_set_depth_bounds_test_enable => DepthBoundsTestEnable;
    cmd_set_stencil_test_enable => StencilTestEnable;
    cmd_set_rasterizer_discard_enable => RasterizerDiscardEnable;
    cmd_set_depth_bias_enable => DepthBiasEnable;
    cmd_set_primitive_restart_enable => PrimitiveRestartEnable;
}

crate::entry_points! {
    fn cmd_set_line_width(command_buffer: vk::CommandBuffer, line_width: f32) {
        set(command_buffer, Setting::LineWidth(line_width))
    }

    fn cmd_set_depth_bias(
        command_buffer: vk::CommandBuffer,
        depth_bias_constant_factor: f32,
        depth_bias_clamp: f32,
        depth_bias_slope_factor: f32,
    ) {
        let bias = DepthBias {
            constant: depth_bias_constant_factor,
            clamp: depth_bias_clamp,
            slope: depth_bias_slope_factor,
        };
        set(command_buffer, Setting::DepthBias(bias))
    }

    fn cmd_set_blend_constants(
        command_buffer: vk::CommandBuffer,
        blend_constants: *const [f32; 4],
    ) {
        set(command_buffer, Setting::BlendConstants(*pointer::input(blend_constants)?))
    }

    fn cmd_set_depth_bounds(
        command_buffer: vk::CommandBuffer,
        min_depth_bounds: f32,
        max_depth_bounds: f32,
    ) {
        set(command_buffer, Setting::DepthBounds(min_depth_bounds, max_depth_bounds))
    }

    fn cmd_set_stencil_compare_mask(
        command_buffer: vk::CommandBuffer,
        face_mask: vk::StencilFaceFlags,
        compare_mask: u32,
    ) {
        set_faces(command_buffer, face_mask, |face| {
            Setting::StencilCompareMask(face, compare_mask as u8)
        })
    }

    fn cmd_set_stencil_write_mask(
        command_buffer: vk::CommandBuffer,
        face_mask: vk::StencilFaceFlags,
        write_mask: u32,
    ) {
        set_faces(command_buffer, face_mask, |face| {
            Setting::StencilWriteMask(face, write_mask as u8)
        })
    }

    fn cmd_set_stencil_reference(
        command_buffer: vk::CommandBuffer,
        face_mask: vk::StencilFaceFlags,
        reference: u32,
    ) {
        set_faces(command_buffer, face_mask, |face| {
            Setting::StencilReference(face, reference as u8)
        })
    }

    fn cmd_set_stencil_op(
        command_buffer: vk::CommandBuffer,
        face_mask: vk::StencilFaceFlags,
        fail_op: vk::StencilOp,
        pass_op: vk::StencilOp,
        depth_fail_op: vk::StencilOp,
        compare_op: vk::CompareOp,
    ) {
        record(command_buffer, |recorder| {
            let ops = setting::stencil_ops(fail_op, pass_op, depth_fail_op, compare_op)?;
            faces(face_mask)
                .for_each(|face| recorder.push(Command::Set(Setting::StencilOp(face, ops))));
            Ok(())
        })
    }

    fn cmd_set_cull_mode(command_buffer: vk::CommandBuffer, cull_mode: vk::CullModeFlags) {
        set(command_buffer, setting::cull_mode(cull_mode))
    }

    fn cmd_set_front_face(command_buffer: vk::CommandBuffer, front_face: vk::FrontFace) {
        set(command_buffer, setting::front_face(front_face))
    }

    fn cmd_set_primitive_topology(
        command_buffer: vk::CommandBuffer,
        primitive_topology: vk::PrimitiveTopology,
    ) {
        record(command_buffer, |recorder| {
            // The Gaussian list is a class of its own, so there is nothing to set.
            if primitive_topology != PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST {
                let topology = convert::topology(primitive_topology)?;
                recorder.push(Command::Set(Setting::PrimitiveTopology(topology)));
            }
            Ok(())
        })
    }

    fn cmd_set_depth_compare_op(
        command_buffer: vk::CommandBuffer,
        depth_compare_op: vk::CompareOp,
    ) {
        record(command_buffer, |recorder| {
            let op = convert::compare_op(depth_compare_op)?;
            recorder.push(Command::Set(Setting::DepthCompareOp(op)));
            Ok(())
        })
    }

    /// There is one device.
    fn cmd_set_device_mask(command_buffer: vk::CommandBuffer, _device_mask: u32) {
        record(command_buffer, |_| Ok(()))
    }
}
