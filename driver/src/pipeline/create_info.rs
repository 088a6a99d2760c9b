//! Create infos of graphics pipelines: their pointers are followed as far as Vulkan has them read.

use super::dynamic_state;
use super::parts::{GraphicsState, Parts, VertexInput, all_parts};
use crate::abi::error::Error;
use crate::abi::handle;
use crate::abi::valid;
use crate::convert;
use crate::device::Device;
use crate::shader_module::ShaderStage;
use ash::vk;
use gaurast::vk as gvk;
use std::ffi::c_void;

/// A copy of a structure without its chain. It names all other members, so that none is forgotten.
macro_rules! unchained {
    ($structure:expr, $module:ident::$type:ident { $($member:ident),* $(,)? }) => {{
        let $module::$type { s_type, p_next: _, $($member,)* _marker: _ } = *$structure;
        $module::$type {
            s_type,
            p_next: std::ptr::null(),
            $($member,)*
            _marker: std::marker::PhantomData,
        }
    }};
}

/// Links the libraries of a create info, and reads the parts that it has itself. Pointers that the rest makes
/// irrelevant may be invalid.
///
/// # Errors
/// An [`Error`] that names the valid usage broken.
///
/// # Safety
/// The create info and its chain are valid.
pub(super) unsafe fn read(
    device: &Device,
    info: &vk::GraphicsPipelineCreateInfo<'_>,
    libraries: &[&GraphicsState],
) -> Result<GraphicsState, Error> {
    let mut graphics = GraphicsState::default();
    for library in libraries {
        graphics.link(library)?;
    }
    // SAFETY: the caller's promise.
    unsafe {
        let parts = parts(info, !libraries.is_empty());
        graphics.claim(parts)?;
        if let Some(state) = valid::optional(info.p_dynamic_state) {
            let dynamic = valid::slice(state.p_dynamic_states, state.dynamic_state_count)?;
            let own =
                dynamic.iter().filter(|&&state| dynamic_state::part(state).is_none_or(|part| parts.contains(part)));
            graphics.dynamic.extend(own);
        }
        let shaders = Parts::PRE_RASTERIZATION_SHADERS | Parts::FRAGMENT_SHADER;
        if parts.intersects(shaders) {
            if let Some(layout) = handle::get_optional(info.layout)? {
                graphics.add_layout(layout);
            }
            read_stages(device, info, parts, &mut graphics)?;
        }
        if parts.contains(Parts::VERTEX_INPUT_INTERFACE) {
            read_vertex_input(info, &mut graphics)?;
        }
        if parts.contains(Parts::PRE_RASTERIZATION_SHADERS) {
            read_rasterization(info, &mut graphics)?;
        }
        let draws = !graphics.discards();
        let has_output = draws && parts.contains(Parts::FRAGMENT_OUTPUT_INTERFACE);
        let subpass = if parts.intersects(shaders | Parts::FRAGMENT_OUTPUT_INTERFACE) {
            Subpass::new(info, has_output)?
        } else {
            Subpass::default()
        };
        if parts.contains(Parts::PRE_RASTERIZATION_SHADERS) {
            graphics.pre_rasterization.view_mask = subpass.view_mask;
        }
        if draws && parts.contains(Parts::FRAGMENT_SHADER) {
            // Without a render pass, formats say whether there is such an attachment; the fragment output
            // interface has them.
            let is_unknown = info.render_pass == vk::RenderPass::null() && !has_output;
            if subpass.has_depth || subpass.has_stencil || is_unknown {
                graphics.fragment_shader.depth_stencil = valid::optional(info.p_depth_stencil_state).map(depth_stencil);
            }
        }
        if has_output {
            read_output(info, subpass, &mut graphics)?;
        }
    }
    Ok(graphics)
}

/// The flags of a create info: those of its chain, or else its own. The first 32 flags of the longer word are those of
/// the shorter, and the device has none of the others.
///
/// # Safety
/// The chain is valid.
pub(super) unsafe fn flags(own: vk::PipelineCreateFlags, chain: *const c_void) -> vk::PipelineCreateFlags {
    // SAFETY: the caller's promise.
    let longer = unsafe { valid::find_in_chain::<vk::PipelineCreateFlags2CreateInfoKHR<'_>>(chain) };
    longer.map_or(own, |given| vk::PipelineCreateFlags::from_raw(given.flags.as_raw() as u32))
}

/// The parts that a create info has itself, beside those of the libraries that it links.
///
/// # Safety
/// The create info and its chain are valid.
unsafe fn parts(info: &vk::GraphicsPipelineCreateInfo<'_>, has_libraries: bool) -> Parts {
    // SAFETY: the caller's promise.
    let (given, flags) = unsafe {
        let given = valid::find_in_chain::<vk::GraphicsPipelineLibraryCreateInfoEXT<'_>>(info.p_next);
        (given, flags(info.flags, info.p_next))
    };
    match given {
        Some(given) => given.flags & all_parts(),
        None if has_libraries || flags.contains(vk::PipelineCreateFlags::LIBRARY_KHR) => Parts::empty(),
        None => all_parts(),
    }
}

/// Reads the shader stages of parts. Stages of other parts are ignored.
///
/// # Safety
/// The create info and its chain are valid.
unsafe fn read_stages(
    device: &Device,
    info: &vk::GraphicsPipelineCreateInfo<'_>,
    parts: Parts,
    graphics: &mut GraphicsState,
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    let (stages, flags) = unsafe { (valid::slice(info.p_stages, info.stage_count)?, flags(info.flags, info.p_next)) };
    let view_is_device = flags.contains(vk::PipelineCreateFlags::VIEW_INDEX_FROM_DEVICE_INDEX);
    for given in stages {
        let (part, stages) = if given.stage == vk::ShaderStageFlags::FRAGMENT {
            let stages = &mut graphics.fragment_shader.stages;
            (Parts::FRAGMENT_SHADER, stages)
        } else {
            let stages = &mut graphics.pre_rasterization.stages;
            (Parts::PRE_RASTERIZATION_SHADERS, stages)
        };
        if parts.contains(part) {
            // SAFETY: the caller's promise.
            let mut stage = unsafe { ShaderStage::from_create_info(device, given)? };
            stage.view_is_device = view_is_device;
            stages.push((given.stage, stage));
        }
    }
    Ok(())
}

/// Reads vertex bindings, attributes and input assembly.
///
/// # Safety
/// The create info and its chain are valid.
unsafe fn read_vertex_input(
    info: &vk::GraphicsPipelineCreateInfo<'_>,
    graphics: &mut GraphicsState,
) -> Result<(), Error> {
    let is_dynamic = graphics.is_dynamic(vk::DynamicState::VERTEX_INPUT_EXT);
    let own = &mut graphics.vertex_input;
    // SAFETY: the caller's promise.
    unsafe {
        if !is_dynamic && let Some(state) = valid::optional(info.p_vertex_input_state) {
            let (bindings, attributes) = (
                valid::slice(state.p_vertex_binding_descriptions, state.vertex_binding_description_count)?,
                valid::slice(state.p_vertex_attribute_descriptions, state.vertex_attribute_description_count)?,
            );
            let divisors = valid::find_in_chain::<vk::PipelineVertexInputDivisorStateCreateInfoKHR<'_>>(state.p_next);
            let divisors =
                divisors.map(|state| valid::slice(state.p_vertex_binding_divisors, state.vertex_binding_divisor_count));
            own.input = VertexInput {
                bindings: bindings.to_vec(),
                divisors: divisors.transpose()?.unwrap_or_default().to_vec(),
                attributes: attributes.to_vec(),
            };
        }
        if let Some(state) = valid::optional(info.p_input_assembly_state) {
            own.topology = state.topology;
            own.primitive_restart = state.primitive_restart_enable != vk::FALSE;
        }
    }
    Ok(())
}

/// Reads tessellation, rasterization, viewports, and the extension's structures.
///
/// # Safety
/// The create info and its chain are valid.
unsafe fn read_rasterization(
    info: &vk::GraphicsPipelineCreateInfo<'_>,
    graphics: &mut GraphicsState,
) -> Result<(), Error> {
    let tessellates = graphics.tessellates();
    let own = &mut graphics.pre_rasterization;
    // SAFETY: the caller's promise.
    unsafe {
        own.gaussian =
            valid::find_in_chain::<gvk::PipelineGaussianStateCreateInfoGAURAST<'_>>(info.p_next).map(gaussian);
        own.approximation = valid::find_in_chain::<gvk::PipelineGaussianApproximationStateCreateInfoGAURAST<'_>>(
            info.p_next,
        )
        .map(|state| {
            unchained!(
                state,
                gvk::PipelineGaussianApproximationStateCreateInfoGAURAST { exponential_error, contribution_budget }
            )
        });
        own.footprint = valid::find_in_chain::<gvk::PipelineGaussianFootprintStateCreateInfoGAURAST<'_>>(info.p_next)
            .map(|state| {
                unchained!(
                    state,
                    gvk::PipelineGaussianFootprintStateCreateInfoGAURAST {
                        cut_off,
                        cut_off_deviations,
                        compensation_floor,
                    }
                )
            });
        own.unscented = valid::find_in_chain::<gvk::PipelineGaussianUnscentedStateCreateInfoGAURAST<'_>>(info.p_next)
            .map(|state| {
                unchained!(
                    state,
                    gvk::PipelineGaussianUnscentedStateCreateInfoGAURAST {
                        alpha,
                        beta,
                        kappa,
                        picture_margin,
                        all_sigma_points,
                    }
                )
            });
        own.decoding = valid::find_in_chain::<gvk::PipelineGaussianDecodingStateCreateInfoGAURAST<'_>>(info.p_next)
            .map(|state| {
                unchained!(
                    state,
                    gvk::PipelineGaussianDecodingStateCreateInfoGAURAST {
                        position,
                        signed_log_position,
                        scale,
                        rotation,
                        opacity,
                        color,
                        base_color,
                        spherical_harmonics,
                    }
                )
            });
        if tessellates && let Some(state) = valid::optional(info.p_tessellation_state) {
            own.patch_control_points = state.patch_control_points;
            let origin = valid::find_in_chain::<vk::PipelineTessellationDomainOriginStateCreateInfo<'_>>(state.p_next);
            own.lower_left_domain =
                origin.is_some_and(|state| state.domain_origin == vk::TessellationDomainOrigin::LOWER_LEFT);
        }
        if let Some(state) = valid::optional(info.p_rasterization_state) {
            own.rasterization = rasterization(state);
            let representation = valid::find_in_chain::<vk::DepthBiasRepresentationInfoEXT<'_>>(state.p_next);
            own.depth_bias_unit = convert::depth_bias_unit(representation)?;
            let provoking =
                valid::find_in_chain::<vk::PipelineRasterizationProvokingVertexStateCreateInfoEXT<'_>>(state.p_next);
            own.provoking_last =
                provoking.is_some_and(|state| state.provoking_vertex_mode == vk::ProvokingVertexModeEXT::LAST_VERTEX);
            let stream = valid::find_in_chain::<vk::PipelineRasterizationStateStreamCreateInfoEXT<'_>>(state.p_next);
            own.rasterized_stream = stream.map_or(0, |state| state.rasterization_stream);
            let clip = valid::find_in_chain::<vk::PipelineRasterizationDepthClipStateCreateInfoEXT<'_>>(state.p_next);
            own.depth_clip = clip.map(|state| state.depth_clip_enable != vk::FALSE);
            let lines = valid::find_in_chain::<vk::PipelineRasterizationLineStateCreateInfoKHR<'_>>(state.p_next);
            own.lines = lines.map(line_rasterization).unwrap_or_default();
        }
        if !graphics.discards()
            && let Some(state) = valid::optional(info.p_viewport_state)
        {
            read_viewports(state, graphics)?;
        }
    }
    Ok(())
}

/// Reads viewports and scissors. The pointers may be invalid if these are dynamic.
///
/// # Safety
/// The state and its chain are valid.
unsafe fn read_viewports(
    state: &vk::PipelineViewportStateCreateInfo<'_>,
    graphics: &mut GraphicsState,
) -> Result<(), Error> {
    use vk::DynamicState as S;
    let is_dynamic = |states: [S; 2]| states.iter().any(|state| graphics.is_dynamic(*state));
    let dynamic_viewports = is_dynamic([S::VIEWPORT, S::VIEWPORT_WITH_COUNT]);
    let dynamic_scissors = is_dynamic([S::SCISSOR, S::SCISSOR_WITH_COUNT]);
    let own = &mut graphics.pre_rasterization;
    own.viewport_count = state.viewport_count;
    own.scissor_count = state.scissor_count;
    // SAFETY: the caller's promise; a null pointer is not followed.
    unsafe {
        let control = valid::find_in_chain::<vk::PipelineViewportDepthClipControlCreateInfoEXT<'_>>(state.p_next);
        own.negative_one_to_one = control.is_some_and(|control| control.negative_one_to_one != vk::FALSE);
        if !dynamic_viewports && !state.p_viewports.is_null() {
            own.viewports = valid::slice(state.p_viewports, state.viewport_count)?.to_vec();
        }
        if !dynamic_scissors && !state.p_scissors.is_null() {
            own.scissors = valid::slice(state.p_scissors, state.scissor_count)?.to_vec();
        }
    }
    Ok(())
}

/// Reads multisampling and blending.
///
/// # Safety
/// The create info and its chain are valid.
unsafe fn read_output(
    info: &vk::GraphicsPipelineCreateInfo<'_>,
    subpass: Subpass,
    graphics: &mut GraphicsState,
) -> Result<(), Error> {
    use vk::DynamicState as S;
    let has_dynamic_blending = graphics.has_dynamic_blending();
    let [dynamic_mask, dynamic_enables] =
        [S::SAMPLE_MASK_EXT, S::COLOR_WRITE_ENABLE_EXT].map(|state| graphics.is_dynamic(state));
    let own = &mut graphics.fragment_output;
    own.has_depth = subpass.has_depth;
    own.has_stencil = subpass.has_stencil;
    own.color_formats = subpass.color_formats;
    // SAFETY: the caller's promise.
    unsafe {
        let locations = valid::find_in_chain::<vk::RenderingAttachmentLocationInfoKHR<'_>>(info.p_next);
        if let Some(given) = locations.filter(|given| !given.p_color_attachment_locations.is_null()) {
            own.color_locations =
                valid::slice(given.p_color_attachment_locations, given.color_attachment_count)?.to_vec();
        }
        if let Some(state) = valid::optional(info.p_multisample_state) {
            own.multisample = multisample(state);
            if !dynamic_mask && let Some(mask) = valid::optional(state.p_sample_mask) {
                own.sample_mask = *mask;
            }
        }
        if !own.color_formats.is_empty()
            && let Some(state) = valid::optional(info.p_color_blend_state)
        {
            own.logic_op = (state.logic_op, state.logic_op_enable != vk::FALSE);
            if !has_dynamic_blending {
                own.blend = valid::slice(state.p_attachments, state.attachment_count)?.to_vec();
            }
            let writes = valid::find_in_chain::<vk::PipelineColorWriteCreateInfoEXT<'_>>(state.p_next);
            if let Some(writes) = writes
                && !dynamic_enables
            {
                let enables = valid::slice(writes.p_color_write_enables, writes.attachment_count)?;
                own.color_write_enables = enables.to_vec();
            }
            own.blend_constants = state.blend_constants;
            let flag = vk::PipelineColorBlendStateCreateFlags::RASTERIZATION_ORDER_ATTACHMENT_ACCESS_EXT;
            own.reads_colors = state.flags.contains(flag);
        }
    }
    Ok(())
}

/// The subpass, or the dynamic rendering, in which a pipeline draws.
#[derive(Default)]
struct Subpass {
    /// The formats by colour attachment; undefined if unused.
    color_formats: Vec<vk::Format>,
    /// True if there is a depth attachment.
    has_depth: bool,
    /// True if there is a stencil attachment.
    has_stencil: bool,
    /// The views that draws render to, a bit each; 0 without views.
    view_mask: u32,
}

impl Subpass {
    /// The subpass of a create info. Without `reads_formats` the formats of dynamic rendering are ignored.
    ///
    /// # Safety
    /// The create info and its chain are valid.
    unsafe fn new(info: &vk::GraphicsPipelineCreateInfo<'_>, reads_formats: bool) -> Result<Self, Error> {
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
                return Ok(Self {
                    color_formats: render_pass.color_formats(index).ok_or_else(missing)?,
                    has_depth: subpass.depth_stencil.is_some(),
                    has_stencil: subpass.depth_stencil.is_some(),
                    view_mask: subpass.view_mask,
                });
            }
            let Some(rendering) = valid::find_in_chain::<vk::PipelineRenderingCreateInfo<'_>>(info.p_next) else {
                return Ok(Self::default());
            };
            if !reads_formats {
                return Ok(Self { view_mask: rendering.view_mask, ..Self::default() });
            }
            let color = valid::slice(rendering.p_color_attachment_formats, rendering.color_attachment_count)?;
            let undefined = vk::Format::UNDEFINED;
            Ok(Self {
                color_formats: color.to_vec(),
                has_depth: rendering.depth_attachment_format != undefined,
                has_stencil: rendering.stencil_attachment_format != undefined,
                view_mask: rendering.view_mask,
            })
        }
    }
}

fn rasterization(
    state: &vk::PipelineRasterizationStateCreateInfo<'_>,
) -> vk::PipelineRasterizationStateCreateInfo<'static> {
    unchained!(
        state,
        vk::PipelineRasterizationStateCreateInfo {
            flags,
            depth_clamp_enable,
            rasterizer_discard_enable,
            polygon_mode,
            cull_mode,
            front_face,
            depth_bias_enable,
            depth_bias_constant_factor,
            depth_bias_clamp,
            depth_bias_slope_factor,
            line_width,
        }
    )
}

fn line_rasterization(
    state: &vk::PipelineRasterizationLineStateCreateInfoKHR<'_>,
) -> vk::PipelineRasterizationLineStateCreateInfoKHR<'static> {
    unchained!(
        state,
        vk::PipelineRasterizationLineStateCreateInfoKHR {
            line_rasterization_mode,
            stippled_line_enable,
            line_stipple_factor,
            line_stipple_pattern,
        }
    )
}

fn depth_stencil(
    state: &vk::PipelineDepthStencilStateCreateInfo<'_>,
) -> vk::PipelineDepthStencilStateCreateInfo<'static> {
    unchained!(
        state,
        vk::PipelineDepthStencilStateCreateInfo {
            flags,
            depth_test_enable,
            depth_write_enable,
            depth_compare_op,
            depth_bounds_test_enable,
            stencil_test_enable,
            front,
            back,
            min_depth_bounds,
            max_depth_bounds,
        }
    )
}

/// Multisample state without the pointer to the mask.
fn multisample(state: &vk::PipelineMultisampleStateCreateInfo<'_>) -> vk::PipelineMultisampleStateCreateInfo<'static> {
    let copy = unchained!(
        state,
        vk::PipelineMultisampleStateCreateInfo {
            flags,
            rasterization_samples,
            sample_shading_enable,
            min_sample_shading,
            p_sample_mask,
            alpha_to_coverage_enable,
            alpha_to_one_enable,
        }
    );
    vk::PipelineMultisampleStateCreateInfo { p_sample_mask: std::ptr::null(), ..copy }
}

fn gaussian(
    state: &gvk::PipelineGaussianStateCreateInfoGAURAST<'_>,
) -> gvk::PipelineGaussianStateCreateInfoGAURAST<'static> {
    unchained!(
        state,
        gvk::PipelineGaussianStateCreateInfoGAURAST {
            flags,
            projection_mode,
            geometry,
            linearization,
            spherical_harmonics_degree,
            attribute_locations,
            vertex_output_locations,
            resolve_input_locations,
            order,
            precision,
            antialiasing,
            low_pass_variance,
            alpha_floor,
            alpha_ceiling,
            transmittance_floor,
            camera_source,
            camera_set,
            camera_binding,
            camera_count,
        }
    )
}
