//! The creation of graphics pipelines: their create infos' pointers followed, as far as Vulkan has them read.

use super::compute_pipeline::stage;
use super::pipeline::{create_each, withhold_feedback};
use crate::error::Error;
use crate::object::device::Device;
use crate::object::pipeline::{GraphicsPipeline, GraphicsPipelineInfo, Pipeline};
use crate::{handle, pnext, pointer};
use ash::vk;
use gaurast::vk::{
    PipelineGaussianApproximationStateCreateInfoGAURAST, PipelineGaussianStateCreateInfoGAURAST,
};
use std::sync::Arc;

crate::entry_points! {
    #[doc(alias = "vkCreateGraphicsPipelines")]
    fn create_graphics_pipelines(
        device: vk::Device,
        _pipeline_cache: vk::PipelineCache,
        create_info_count: u32,
        create_infos: *const vk::GraphicsPipelineCreateInfo<'_>,
        _allocator: *const vk::AllocationCallbacks<'_>,
        pipelines: *mut vk::Pipeline,
    ) -> vk::Result {
        let device = handle::get(device)?;
        let infos = pointer::slice(create_infos, create_info_count)?;
        create_each(infos, pipelines, |info| new_graphics_pipeline(device, info))
    }
}

/// Makes one pipeline.
///
/// # Safety
/// The create info and its chain are valid.
unsafe fn new_graphics_pipeline(
    device: &Device,
    info: &vk::GraphicsPipelineCreateInfo<'_>,
) -> Result<vk::Pipeline, Error> {
    // SAFETY: the caller's promise.
    let gathered = unsafe {
        withhold_feedback(info.p_next)?;
        gather(info)?
    };
    let pipeline = GraphicsPipeline::new(device, &gathered)?;
    let pipeline = Pipeline::Graphics(Arc::new(pipeline));
    Ok(handle::create(Arc::new(pipeline)))
}

/// Follows a create info's pointers. Those that the rest of the create info makes meaningless may point anywhere.
///
/// # Safety
/// The create info and its chain are valid.
unsafe fn gather<'a>(
    info: &'a vk::GraphicsPipelineCreateInfo<'a>,
) -> Result<GraphicsPipelineInfo<'a>, Error> {
    let mut gathered = GraphicsPipelineInfo {
        sample_mask: u32::MAX,
        ..GraphicsPipelineInfo::default()
    };
    // SAFETY: the caller's promise.
    unsafe {
        for given in pointer::slice(info.p_stages, info.stage_count)? {
            gathered.stages.push((given.stage, stage(given)?));
        }
        gathered.layout = handle::get_optional(info.layout)?;
        gathered.gaussian =
            pnext::find::<PipelineGaussianStateCreateInfoGAURAST>(info.p_next).copied();
        gathered.approximation =
            pnext::find::<PipelineGaussianApproximationStateCreateInfoGAURAST>(info.p_next)
                .copied();
        if let Some(state) = pointer::optional(info.p_dynamic_state) {
            gathered.dynamic = pointer::slice(state.p_dynamic_states, state.dynamic_state_count)?;
        }
        if let Some(state) = pointer::optional(info.p_vertex_input_state) {
            gather_vertex_input(state, &mut gathered)?;
        }
        if let Some(state) = pointer::optional(info.p_input_assembly_state) {
            gathered.topology = state.topology;
            gathered.primitive_restart = state.primitive_restart_enable != vk::FALSE;
        }
        if let Some(state) = pointer::optional(info.p_rasterization_state) {
            gathered.rasterization = *state;
            let provoking = pnext::find::<
                vk::PipelineRasterizationProvokingVertexStateCreateInfoEXT<'_>,
            >(state.p_next);
            gathered.provoking_last = provoking.is_some_and(|state| {
                state.provoking_vertex_mode == vk::ProvokingVertexModeEXT::LAST_VERTEX
            });
        }
        if !gathered.discards() {
            gather_fragments(info, &mut gathered)?;
        }
    }
    Ok(gathered)
}

/// Vertex bindings and attributes.
///
/// # Safety
/// The state and its chain are valid.
unsafe fn gather_vertex_input<'a>(
    state: &'a vk::PipelineVertexInputStateCreateInfo<'a>,
    gathered: &mut GraphicsPipelineInfo<'a>,
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    unsafe {
        gathered.bindings = pointer::slice(
            state.p_vertex_binding_descriptions,
            state.vertex_binding_description_count,
        )?;
        gathered.attributes = pointer::slice(
            state.p_vertex_attribute_descriptions,
            state.vertex_attribute_description_count,
        )?;
        let divisors =
            pnext::find::<vk::PipelineVertexInputDivisorStateCreateInfoKHR<'_>>(state.p_next);
        if let Some(state) = divisors {
            gathered.divisors = pointer::slice(
                state.p_vertex_binding_divisors,
                state.vertex_binding_divisor_count,
            )?;
        }
    }
    Ok(())
}

/// The state of pipelines that rasterize.
///
/// # Safety
/// The create info and its chain are valid.
unsafe fn gather_fragments<'a>(
    info: &'a vk::GraphicsPipelineCreateInfo<'a>,
    gathered: &mut GraphicsPipelineInfo<'a>,
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    unsafe {
        let formats = attachment_formats(info)?;
        if let Some(state) = pointer::optional(info.p_viewport_state) {
            gather_viewports(state, gathered)?;
        }
        if let Some(state) = pointer::optional(info.p_multisample_state) {
            gathered.multisample = *state;
            if let Some(mask) = pointer::optional(state.p_sample_mask) {
                gathered.sample_mask = *mask;
            }
        }
        if formats.has_depth_stencil {
            gathered.depth_stencil = pointer::optional(info.p_depth_stencil_state).copied();
        }
        if !formats.color.is_empty()
            && let Some(state) = pointer::optional(info.p_color_blend_state)
        {
            gathered.logic_op = (state.logic_op_enable != vk::FALSE).then_some(state.logic_op);
            gathered.blend = pointer::slice(state.p_attachments, state.attachment_count)?;
            gathered.blend_constants = state.blend_constants;
        }
        gathered.color_formats = formats.color;
    }
    Ok(())
}

/// Viewports and scissors; their pointers may be anything where they are dynamic.
///
/// # Safety
/// The state is valid.
unsafe fn gather_viewports<'a>(
    state: &'a vk::PipelineViewportStateCreateInfo<'a>,
    gathered: &mut GraphicsPipelineInfo<'a>,
) -> Result<(), Error> {
    use vk::DynamicState as S;
    gathered.viewport_count = state.viewport_count;
    gathered.scissor_count = state.scissor_count;
    let is_dynamic = |states: [S; 2]| states.iter().any(|state| gathered.is_dynamic(*state));
    let dynamic_viewports = is_dynamic([S::VIEWPORT, S::VIEWPORT_WITH_COUNT]);
    let dynamic_scissors = is_dynamic([S::SCISSOR, S::SCISSOR_WITH_COUNT]);
    // SAFETY: the caller's promise; a null pointer is not followed.
    unsafe {
        if !dynamic_viewports && !state.p_viewports.is_null() {
            gathered.viewports = pointer::slice(state.p_viewports, state.viewport_count)?;
        }
        if !dynamic_scissors && !state.p_scissors.is_null() {
            gathered.scissors = pointer::slice(state.p_scissors, state.scissor_count)?;
        }
    }
    Ok(())
}

/// What a pipeline renders to.
#[derive(Default)]
struct AttachmentFormats {
    /// By colour attachment; undefined where unused.
    color: Vec<vk::Format>,
    /// Whether there is a depth or stencil attachment.
    has_depth_stencil: bool,
}

/// The formats of the subpass, or of dynamic rendering, that a pipeline is for.
///
/// # Safety
/// The create info and its chain are valid.
unsafe fn attachment_formats(
    info: &vk::GraphicsPipelineCreateInfo<'_>,
) -> Result<AttachmentFormats, Error> {
    // SAFETY: the caller's promise.
    unsafe {
        if let Some(render_pass) = handle::get_optional(info.render_pass)? {
            let index = info.subpass as usize;
            let missing = || {
                Error::usage(
                    "VUID-VkGraphicsPipelineCreateInfo-renderPass-06046",
                    format!("the render pass has no subpass {index}"),
                )
            };
            let subpass = render_pass.subpasses.get(index).ok_or_else(missing)?;
            return Ok(AttachmentFormats {
                color: render_pass.color_formats(index).ok_or_else(missing)?,
                has_depth_stencil: subpass.depth_stencil.is_some(),
            });
        }
        let Some(rendering) = pnext::find::<vk::PipelineRenderingCreateInfo>(info.p_next) else {
            return Ok(AttachmentFormats::default());
        };
        let color = pointer::slice(
            rendering.p_color_attachment_formats,
            rendering.color_attachment_count,
        )?;
        let undefined = vk::Format::UNDEFINED;
        Ok(AttachmentFormats {
            color: color.to_vec(),
            has_depth_stencil: rendering.depth_attachment_format != undefined
                || rendering.stencil_attachment_format != undefined,
        })
    }
}
