//! Commands that set fixed-function state.

use crate::command::record::Command;
use crate::command::recorder::Recorder;
use crate::error::Error;
use crate::object::pipeline::convert;
use crate::object::pipeline::setting::{self, Face, Setting, faces};
use ash::vk;
use gaurast::vk::PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST;
use simdevice::state::DepthBias;

/// Records one setting.
fn set(recorder: &mut Recorder, setting: Setting) -> Result<(), Error> {
    recorder.push(Command::Set(setting));
    Ok(())
}

/// Records a setting for each face of a mask.
fn set_faces(
    recorder: &mut Recorder,
    mask: vk::StencilFaceFlags,
    setting: impl Fn(Face) -> Setting,
) -> Result<(), Error> {
    faces(mask).for_each(|face| recorder.push(Command::Set(setting(face))));
    Ok(())
}

#[doc(alias = "vkCmdSetDepthTestEnable")]
pub(crate) fn cmd_set_depth_test_enable(
    recorder: &mut Recorder,
    depth_test_enable: bool,
) -> Result<(), Error> {
    set(recorder, Setting::DepthTestEnable(depth_test_enable))
}

#[doc(alias = "vkCmdSetDepthWriteEnable")]
pub(crate) fn cmd_set_depth_write_enable(
    recorder: &mut Recorder,
    depth_write_enable: bool,
) -> Result<(), Error> {
    set(recorder, Setting::DepthWriteEnable(depth_write_enable))
}

#[doc(alias = "vkCmdSetDepthBoundsTestEnable")]
pub(crate) fn cmd_set_depth_bounds_test_enable(
    recorder: &mut Recorder,
    depth_bounds_test_enable: bool,
) -> Result<(), Error> {
    set(
        recorder,
        Setting::DepthBoundsTestEnable(depth_bounds_test_enable),
    )
}

#[doc(alias = "vkCmdSetStencilTestEnable")]
pub(crate) fn cmd_set_stencil_test_enable(
    recorder: &mut Recorder,
    stencil_test_enable: bool,
) -> Result<(), Error> {
    set(recorder, Setting::StencilTestEnable(stencil_test_enable))
}

#[doc(alias = "vkCmdSetRasterizerDiscardEnable")]
pub(crate) fn cmd_set_rasterizer_discard_enable(
    recorder: &mut Recorder,
    rasterizer_discard_enable: bool,
) -> Result<(), Error> {
    set(
        recorder,
        Setting::RasterizerDiscardEnable(rasterizer_discard_enable),
    )
}

#[doc(alias = "vkCmdSetDepthBiasEnable")]
pub(crate) fn cmd_set_depth_bias_enable(
    recorder: &mut Recorder,
    depth_bias_enable: bool,
) -> Result<(), Error> {
    set(recorder, Setting::DepthBiasEnable(depth_bias_enable))
}

#[doc(alias = "vkCmdSetPrimitiveRestartEnable")]
pub(crate) fn cmd_set_primitive_restart_enable(
    recorder: &mut Recorder,
    primitive_restart_enable: bool,
) -> Result<(), Error> {
    set(
        recorder,
        Setting::PrimitiveRestartEnable(primitive_restart_enable),
    )
}

#[doc(alias = "vkCmdSetLineWidth")]
pub(crate) fn cmd_set_line_width(recorder: &mut Recorder, line_width: f32) -> Result<(), Error> {
    set(recorder, Setting::LineWidth(line_width))
}

#[doc(alias = "vkCmdSetDepthBias")]
pub(crate) fn cmd_set_depth_bias(
    recorder: &mut Recorder,
    depth_bias_constant_factor: f32,
    depth_bias_clamp: f32,
    depth_bias_slope_factor: f32,
) -> Result<(), Error> {
    let bias = DepthBias {
        constant: depth_bias_constant_factor,
        clamp: depth_bias_clamp,
        slope: depth_bias_slope_factor,
    };
    set(recorder, Setting::DepthBias(bias))
}

#[doc(alias = "vkCmdSetBlendConstants")]
pub(crate) fn cmd_set_blend_constants(
    recorder: &mut Recorder,
    blend_constants: &[f32; 4],
) -> Result<(), Error> {
    set(recorder, Setting::BlendConstants(*blend_constants))
}

#[doc(alias = "vkCmdSetDepthBounds")]
pub(crate) fn cmd_set_depth_bounds(
    recorder: &mut Recorder,
    min_depth_bounds: f32,
    max_depth_bounds: f32,
) -> Result<(), Error> {
    set(
        recorder,
        Setting::DepthBounds(min_depth_bounds, max_depth_bounds),
    )
}

#[doc(alias = "vkCmdSetStencilCompareMask")]
pub(crate) fn cmd_set_stencil_compare_mask(
    recorder: &mut Recorder,
    face_mask: vk::StencilFaceFlags,
    compare_mask: u32,
) -> Result<(), Error> {
    set_faces(recorder, face_mask, |face| {
        Setting::StencilCompareMask(face, compare_mask as u8)
    })
}

#[doc(alias = "vkCmdSetStencilWriteMask")]
pub(crate) fn cmd_set_stencil_write_mask(
    recorder: &mut Recorder,
    face_mask: vk::StencilFaceFlags,
    write_mask: u32,
) -> Result<(), Error> {
    set_faces(recorder, face_mask, |face| {
        Setting::StencilWriteMask(face, write_mask as u8)
    })
}

#[doc(alias = "vkCmdSetStencilReference")]
pub(crate) fn cmd_set_stencil_reference(
    recorder: &mut Recorder,
    face_mask: vk::StencilFaceFlags,
    reference: u32,
) -> Result<(), Error> {
    set_faces(recorder, face_mask, |face| {
        Setting::StencilReference(face, reference as u8)
    })
}

#[doc(alias = "vkCmdSetStencilOp")]
pub(crate) fn cmd_set_stencil_op(
    recorder: &mut Recorder,
    face_mask: vk::StencilFaceFlags,
    fail_op: vk::StencilOp,
    pass_op: vk::StencilOp,
    depth_fail_op: vk::StencilOp,
    compare_op: vk::CompareOp,
) -> Result<(), Error> {
    let ops = setting::stencil_ops(fail_op, pass_op, depth_fail_op, compare_op)?;
    set_faces(recorder, face_mask, |face| Setting::StencilOp(face, ops))
}

#[doc(alias = "vkCmdSetCullMode")]
pub(crate) fn cmd_set_cull_mode(
    recorder: &mut Recorder,
    cull_mode: vk::CullModeFlags,
) -> Result<(), Error> {
    set(recorder, setting::cull_mode(cull_mode))
}

#[doc(alias = "vkCmdSetFrontFace")]
pub(crate) fn cmd_set_front_face(
    recorder: &mut Recorder,
    front_face: vk::FrontFace,
) -> Result<(), Error> {
    set(recorder, setting::front_face(front_face))
}

#[doc(alias = "vkCmdSetPrimitiveTopology")]
pub(crate) fn cmd_set_primitive_topology(
    recorder: &mut Recorder,
    primitive_topology: vk::PrimitiveTopology,
) -> Result<(), Error> {
    // The Gaussian list is a class of its own, so there is nothing to set.
    if primitive_topology == PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST {
        return Ok(());
    }
    let topology = convert::topology(primitive_topology)?;
    set(recorder, Setting::PrimitiveTopology(topology))
}

#[doc(alias = "vkCmdSetDepthCompareOp")]
pub(crate) fn cmd_set_depth_compare_op(
    recorder: &mut Recorder,
    depth_compare_op: vk::CompareOp,
) -> Result<(), Error> {
    let op = convert::compare_op(depth_compare_op)?;
    set(recorder, Setting::DepthCompareOp(op))
}

/// There is one device.
#[doc(alias = "vkCmdSetDeviceMask")]
pub(crate) fn cmd_set_device_mask(_recorder: &mut Recorder) -> Result<(), Error> {
    Ok(())
}
