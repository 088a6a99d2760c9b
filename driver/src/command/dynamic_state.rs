//! Commands that set dynamic state. Those whose parameter is the value of a row in
//! `driver/src/pipeline/dynamic_state.rs` are generated instead.

use super::Command;
use super::buffer::Recorder;
use crate::abi::error::Error;
use crate::convert::{self, StencilOpIds, StencilOps};
use crate::physical_device::limits;
use crate::pipeline::dynamic_state::{DynamicState, Face, faces};
use ash::vk;
use gaurast::vk::PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST;
use simdevice::state::{DepthBias, DepthBiasUnit, LineStipple};

/// Records a state.
///
/// # Errors
/// None; it returns a result as all commands do.
pub(crate) fn set(recorder: &mut Recorder, state: DynamicState) -> Result<(), Error> {
    recorder.push(Command::SetDynamicState(state));
    Ok(())
}

/// Records a state for each face of a mask.
///
/// # Errors
/// None; it returns a result as all commands do.
pub(crate) fn set_faces(
    recorder: &mut Recorder,
    mask: vk::StencilFaceFlags,
    state: impl Fn(Face) -> DynamicState,
) -> Result<(), Error> {
    faces(mask).for_each(|face| recorder.push(Command::SetDynamicState(state(face))));
    Ok(())
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
        unit: DepthBiasUnit::DEFAULT,
        clamp: depth_bias_clamp,
        slope: depth_bias_slope_factor,
    };
    set(recorder, DynamicState::DepthBias { bias })
}

#[doc(alias = "vkCmdSetDepthBias2EXT")]
pub(crate) fn cmd_set_depth_bias2(
    recorder: &mut Recorder,
    depth_bias_info: &vk::DepthBiasInfoEXT<'_>,
    representation: Option<&vk::DepthBiasRepresentationInfoEXT<'_>>,
) -> Result<(), Error> {
    let bias = DepthBias {
        constant: depth_bias_info.depth_bias_constant_factor,
        unit: convert::depth_bias_unit(representation)?,
        clamp: depth_bias_info.depth_bias_clamp,
        slope: depth_bias_info.depth_bias_slope_factor,
    };
    set(recorder, DynamicState::DepthBias { bias })
}

#[doc(alias = "vkCmdSetDepthBounds")]
pub(crate) fn cmd_set_depth_bounds(
    recorder: &mut Recorder,
    min_depth_bounds: f32,
    max_depth_bounds: f32,
) -> Result<(), Error> {
    set(recorder, DynamicState::DepthBounds { bounds: (min_depth_bounds, max_depth_bounds) })
}

/// The ids of the rules on the operations of `vkCmdSetStencilOp`.
const STENCIL_OP: StencilOpIds = StencilOpIds {
    fail: "VUID-vkCmdSetStencilOp-failOp-parameter",
    pass: "VUID-vkCmdSetStencilOp-passOp-parameter",
    depth_fail: "VUID-vkCmdSetStencilOp-depthFailOp-parameter",
    compare: "VUID-vkCmdSetStencilOp-compareOp-parameter",
};

#[doc(alias = "vkCmdSetStencilOp")]
pub(crate) fn cmd_set_stencil_op(
    recorder: &mut Recorder,
    face_mask: vk::StencilFaceFlags,
    fail_op: vk::StencilOp,
    pass_op: vk::StencilOp,
    depth_fail_op: vk::StencilOp,
    compare_op: vk::CompareOp,
) -> Result<(), Error> {
    let ops = StencilOps::from_vk(fail_op, pass_op, depth_fail_op, compare_op, &STENCIL_OP)?;
    set_faces(recorder, face_mask, |face| DynamicState::StencilOp { face, ops })
}

#[doc(alias = "vkCmdSetPrimitiveTopology")]
pub(crate) fn cmd_set_primitive_topology(
    recorder: &mut Recorder,
    primitive_topology: vk::PrimitiveTopology,
) -> Result<(), Error> {
    // The Gaussian list is the only topology of its class, so there is nothing to set.
    if primitive_topology == PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST {
        return Ok(());
    }
    let topology = convert::topology(primitive_topology)?;
    set(recorder, DynamicState::PrimitiveTopology { topology })
}

#[doc(alias = "vkCmdSetDepthCompareOp")]
pub(crate) fn cmd_set_depth_compare_op(recorder: &mut Recorder, depth_compare_op: vk::CompareOp) -> Result<(), Error> {
    let op = convert::compare_op(depth_compare_op, "VUID-vkCmdSetDepthCompareOp-depthCompareOp-parameter")?;
    set(recorder, DynamicState::DepthCompareOp { op })
}

#[doc(alias = "vkCmdSetPolygonModeEXT")]
pub(crate) fn cmd_set_polygon_mode(recorder: &mut Recorder, polygon_mode: vk::PolygonMode) -> Result<(), Error> {
    let mode = convert::polygon_mode(polygon_mode)?;
    set(recorder, DynamicState::PolygonMode { mode })
}

#[doc(alias = "vkCmdSetLogicOpEXT")]
pub(crate) fn cmd_set_logic_op(recorder: &mut Recorder, logic_op: vk::LogicOp) -> Result<(), Error> {
    let op = convert::logic_op(logic_op)?;
    set(recorder, DynamicState::LogicOp { op })
}

/// Sets the sample mask. Only its first word matters, because no pixel has more samples than a word has bits.
#[doc(alias = "vkCmdSetSampleMaskEXT")]
pub(crate) fn cmd_set_sample_mask(recorder: &mut Recorder, sample_mask: Option<&vk::SampleMask>) -> Result<(), Error> {
    let mask = sample_mask.copied().unwrap_or(u32::MAX);
    set(recorder, DynamicState::SampleMask { mask })
}

#[doc(alias = "vkCmdSetLineRasterizationModeEXT")]
pub(crate) fn cmd_set_line_rasterization_mode(
    recorder: &mut Recorder,
    line_rasterization_mode: vk::LineRasterizationModeEXT,
) -> Result<(), Error> {
    let vuid = "VUID-vkCmdSetLineRasterizationModeEXT-lineRasterizationMode-parameter";
    let mode = convert::line_mode(line_rasterization_mode, vuid)?;
    set(recorder, DynamicState::LineRasterizationMode { mode })
}

#[doc(alias = "vkCmdSetLineStippleEXT")]
pub(crate) fn cmd_set_line_stipple(
    recorder: &mut Recorder,
    line_stipple_factor: u32,
    line_stipple_pattern: u16,
) -> Result<(), Error> {
    let stipple = LineStipple { factor: line_stipple_factor, pattern: line_stipple_pattern };
    set(recorder, DynamicState::LineStipple { stipple })
}

#[doc(alias = "vkCmdSetColorBlendEnableEXT")]
pub(crate) fn cmd_set_color_blend_enable(
    recorder: &mut Recorder,
    first_attachment: u32,
    color_blend_enables: &[vk::Bool32],
) -> Result<(), Error> {
    set_attachments(recorder, first_attachment, color_blend_enables, |attachment, &enable| {
        let enable = enable != vk::FALSE;
        Ok(DynamicState::ColorBlendEnable { attachment, enable })
    })
}

#[doc(alias = "vkCmdSetColorBlendEquationEXT")]
pub(crate) fn cmd_set_color_blend_equation(
    recorder: &mut Recorder,
    first_attachment: u32,
    color_blend_equations: &[vk::ColorBlendEquationEXT],
) -> Result<(), Error> {
    set_attachments(recorder, first_attachment, color_blend_equations, |attachment, given| {
        let state = vk::PipelineColorBlendAttachmentState {
            src_color_blend_factor: given.src_color_blend_factor,
            dst_color_blend_factor: given.dst_color_blend_factor,
            color_blend_op: given.color_blend_op,
            src_alpha_blend_factor: given.src_alpha_blend_factor,
            dst_alpha_blend_factor: given.dst_alpha_blend_factor,
            alpha_blend_op: given.alpha_blend_op,
            ..Default::default()
        };
        let equations = convert::blend_equations(&state)?;
        Ok(DynamicState::ColorBlendEquation { attachment, equations })
    })
}

#[doc(alias = "vkCmdSetColorWriteMaskEXT")]
pub(crate) fn cmd_set_color_write_mask(
    recorder: &mut Recorder,
    first_attachment: u32,
    color_write_masks: &[vk::ColorComponentFlags],
) -> Result<(), Error> {
    set_attachments(recorder, first_attachment, color_write_masks, |attachment, &mask| {
        let mask = convert::write_mask(mask);
        Ok(DynamicState::ColorWriteMask { attachment, mask })
    })
}

#[doc(alias = "vkCmdSetColorWriteEnableEXT")]
pub(crate) fn cmd_set_color_write_enable(
    recorder: &mut Recorder,
    color_write_enables: &[vk::Bool32],
) -> Result<(), Error> {
    set_attachments(recorder, 0, color_write_enables, |attachment, &enable| {
        let enable = enable != vk::FALSE;
        Ok(DynamicState::ColorWriteEnable { attachment, enable })
    })
}

/// Records a state for each of several colour attachments.
fn set_attachments<T>(
    recorder: &mut Recorder,
    first: u32,
    values: &[T],
    state: impl Fn(usize, &T) -> Result<DynamicState, Error>,
) -> Result<(), Error> {
    for (attachment, value) in (first as usize..).zip(values) {
        set(recorder, state(attachment, value)?)?;
    }
    Ok(())
}

#[doc(alias = "vkCmdSetViewport")]
pub(crate) fn cmd_set_viewport(
    recorder: &mut Recorder,
    first_viewport: u32,
    viewports: &[vk::Viewport],
) -> Result<(), Error> {
    set_viewports(recorder, first_viewport, viewports)
}

#[doc(alias = "vkCmdSetViewportWithCount")]
pub(crate) fn cmd_set_viewport_with_count(recorder: &mut Recorder, viewports: &[vk::Viewport]) -> Result<(), Error> {
    set_viewports(recorder, 0, viewports)?;
    recorder.push(Command::SetViewportCount(viewports.len() as u32));
    Ok(())
}

#[doc(alias = "vkCmdSetScissor")]
pub(crate) fn cmd_set_scissor(
    recorder: &mut Recorder,
    first_scissor: u32,
    scissors: &[vk::Rect2D],
) -> Result<(), Error> {
    set_scissors(recorder, first_scissor, scissors)
}

#[doc(alias = "vkCmdSetScissorWithCount")]
pub(crate) fn cmd_set_scissor_with_count(recorder: &mut Recorder, scissors: &[vk::Rect2D]) -> Result<(), Error> {
    set_scissors(recorder, 0, scissors)?;
    recorder.push(Command::SetScissorCount(scissors.len() as u32));
    Ok(())
}

/// Fails for viewports and scissors beyond those that the device supports.
fn require_viewports(first: u32, count: u32) -> Result<(), Error> {
    let available = limits::properties().max_viewports;
    if u64::from(first) + u64::from(count) <= u64::from(available) {
        return Ok(());
    }
    Err(Error::usage("VUID-vkCmdSetViewport-firstViewport-01223", format!("there are {available} viewports")))
}

/// Records viewports.
fn set_viewports(recorder: &mut Recorder, first: u32, viewports: &[vk::Viewport]) -> Result<(), Error> {
    require_viewports(first, viewports.len() as u32)?;
    for (index, &viewport) in (first..).zip(viewports) {
        let viewport = convert::viewport(viewport);
        recorder.push(Command::SetViewport { index, viewport });
    }
    Ok(())
}

/// Records scissors.
fn set_scissors(recorder: &mut Recorder, first: u32, scissors: &[vk::Rect2D]) -> Result<(), Error> {
    require_viewports(first, scissors.len() as u32)?;
    for (index, &scissor) in (first..).zip(scissors) {
        let scissor = convert::rect(scissor);
        recorder.push(Command::SetScissor { index, scissor });
    }
    Ok(())
}
