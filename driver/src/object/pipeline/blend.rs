//! Blend state.

use super::GraphicsPipelineInfo;
use crate::error::Error;
use ash::vk;
use simdevice::state::{BlendEquation, BlendFactor, BlendOp, BlendState};

/// The blend state of all colour attachments.
///
/// # Errors
/// An [`Error`] if there are not as many as attachments, or for what the device lacks.
pub(super) fn blend_states(info: &GraphicsPipelineInfo) -> Result<Vec<BlendState>, Error> {
    if info.blend.len() != info.color_formats.len() {
        return Err(Error::usage(
            "VUID-VkGraphicsPipelineCreateInfo-renderPass-07609",
            format!(
                "the colour blend state's attachmentCount is {}, but the subpass has {} colour attachments",
                info.blend.len(),
                info.color_formats.len()
            ),
        ));
    }
    info.blend.iter().map(blend_state).collect()
}

/// Whether an attachment is blended with the second source of the fragment stage.
pub(super) fn reads_second_source(state: &vk::PipelineColorBlendAttachmentState) -> bool {
    use vk::BlendFactor as F;
    let factors = [
        state.src_color_blend_factor,
        state.dst_color_blend_factor,
        state.src_alpha_blend_factor,
        state.dst_alpha_blend_factor,
    ];
    let is_second = |factor: F| {
        matches!(
            factor,
            F::SRC1_COLOR | F::ONE_MINUS_SRC1_COLOR | F::SRC1_ALPHA | F::ONE_MINUS_SRC1_ALPHA
        )
    };
    state.blend_enable != vk::FALSE && factors.into_iter().any(is_second)
}

/// One attachment's blend state for the device.
///
/// # Errors
/// An [`Error`] for factors and operations that Vulkan does not have.
fn blend_state(state: &vk::PipelineColorBlendAttachmentState) -> Result<BlendState, Error> {
    let equations = if state.blend_enable == vk::FALSE {
        None
    } else {
        let color = equation(
            state.src_color_blend_factor,
            state.dst_color_blend_factor,
            state.color_blend_op,
        )?;
        let alpha = equation(
            state.src_alpha_blend_factor,
            state.dst_alpha_blend_factor,
            state.alpha_blend_op,
        )?;
        Some((color, alpha))
    };
    Ok(BlendState {
        equations,
        write_mask: (state.color_write_mask.as_raw() & 0xf) as u8,
    })
}

fn equation(
    source: vk::BlendFactor,
    destination: vk::BlendFactor,
    op: vk::BlendOp,
) -> Result<BlendEquation, Error> {
    Ok(BlendEquation {
        source: factor(source)?,
        destination: factor(destination)?,
        op: operation(op)?,
    })
}

fn factor(factor: vk::BlendFactor) -> Result<BlendFactor, Error> {
    use vk::BlendFactor as F;
    Ok(match factor {
        F::ZERO => BlendFactor::Zero,
        F::ONE => BlendFactor::One,
        F::SRC_COLOR => BlendFactor::SrcColor,
        F::ONE_MINUS_SRC_COLOR => BlendFactor::OneMinusSrcColor,
        F::DST_COLOR => BlendFactor::DstColor,
        F::ONE_MINUS_DST_COLOR => BlendFactor::OneMinusDstColor,
        F::SRC_ALPHA => BlendFactor::SrcAlpha,
        F::ONE_MINUS_SRC_ALPHA => BlendFactor::OneMinusSrcAlpha,
        F::DST_ALPHA => BlendFactor::DstAlpha,
        F::ONE_MINUS_DST_ALPHA => BlendFactor::OneMinusDstAlpha,
        F::CONSTANT_COLOR => BlendFactor::ConstantColor,
        F::ONE_MINUS_CONSTANT_COLOR => BlendFactor::OneMinusConstantColor,
        F::CONSTANT_ALPHA => BlendFactor::ConstantAlpha,
        F::ONE_MINUS_CONSTANT_ALPHA => BlendFactor::OneMinusConstantAlpha,
        F::SRC_ALPHA_SATURATE => BlendFactor::SrcAlphaSaturate,
        F::SRC1_COLOR => BlendFactor::Src1Color,
        F::ONE_MINUS_SRC1_COLOR => BlendFactor::OneMinusSrc1Color,
        F::SRC1_ALPHA => BlendFactor::Src1Alpha,
        F::ONE_MINUS_SRC1_ALPHA => BlendFactor::OneMinusSrc1Alpha,
        other => {
            return Err(Error::usage(
                "VUID-VkPipelineColorBlendAttachmentState-parameter",
                format!("{other:?} is not a VkBlendFactor"),
            ));
        }
    })
}

fn operation(op: vk::BlendOp) -> Result<BlendOp, Error> {
    Ok(match op {
        vk::BlendOp::ADD => BlendOp::Add,
        vk::BlendOp::SUBTRACT => BlendOp::Subtract,
        vk::BlendOp::REVERSE_SUBTRACT => BlendOp::ReverseSubtract,
        vk::BlendOp::MIN => BlendOp::Min,
        vk::BlendOp::MAX => BlendOp::Max,
        other => {
            return Err(Error::FeatureNotPresent(format!(
                "blend operation {other:?}"
            )));
        }
    })
}
