//! The state of graphics pipelines: create infos with their pointers followed, as far as Vulkan has them read; vertex
//! input; and fixed-function state. The state that a switch enables is kept even if the switch is off, because either
//! may be dynamic without the other.

use super::layout::PipelineLayout;
use crate::abi::error::Error;
use crate::abi::handle;
use crate::abi::valid;
use crate::convert::{self, StencilOpIds, StencilOps};
use crate::physical_device::{formats, limits};
use crate::registry::features::SUPPORTED;
use crate::shader_module::ShaderStage;
use ash::vk;
use gaurast::vk::{
    GAUSSIAN_LOCATION_UNUSED_GAURAST, PipelineGaussianApproximationStateCreateInfoGAURAST,
    PipelineGaussianFootprintStateCreateInfoGAURAST, PipelineGaussianStateCreateInfoGAURAST,
};
use simdevice::Format;
use simdevice::state::gaussian::GaussianState;
use simdevice::state::{
    BlendEquation, BlendFactor, BlendOp, BlendState, CompareOp, DepthBias, DepthStencil, DepthTest,
    DrawState, LogicOp, PolygonMode, StencilFace, StencilOp, Topology,
};
use std::sync::Arc;

/// The state of a graphics pipeline: a `VkGraphicsPipelineCreateInfo` with its pointers followed, in the four parts of
/// a pipeline library. State that the application may omit is empty, `None` or the default.
#[derive(Default)]
pub(crate) struct GraphicsState<'a> {
    /// The vertex input interface.
    pub(crate) vertex_input: VertexInputState<'a>,
    /// The pre-rasterization shaders.
    pub(crate) pre_rasterization: PreRasterizationState<'a>,
    /// The fragment shader.
    pub(crate) fragment_shader: FragmentShaderState<'a>,
    /// The fragment output interface.
    pub(crate) fragment_output: FragmentOutputState<'a>,
    /// The layout.
    pub(crate) layout: Option<&'a Arc<PipelineLayout>>,
    /// The states that are dynamic.
    pub(crate) dynamic: &'a [vk::DynamicState],
    /// The extension's structure.
    pub(crate) gaussian: Option<PipelineGaussianStateCreateInfoGAURAST<'a>>,
    /// The extension's structure of approximations.
    pub(crate) approximation: Option<PipelineGaussianApproximationStateCreateInfoGAURAST<'a>>,
    /// The extension's structure of footprints.
    pub(crate) footprint: Option<PipelineGaussianFootprintStateCreateInfoGAURAST<'a>>,
}

/// The vertex input and input assembly state.
#[derive(Default)]
pub(crate) struct VertexInputState<'a> {
    /// Vertex bindings.
    pub(crate) bindings: &'a [vk::VertexInputBindingDescription],
    /// The instance divisors of bindings that advance by instance, if not 1.
    pub(crate) divisors: &'a [vk::VertexInputBindingDivisorDescriptionKHR],
    /// Vertex attributes.
    pub(crate) attributes: &'a [vk::VertexInputAttributeDescription],
    /// The topology.
    pub(crate) topology: vk::PrimitiveTopology,
    /// True if an index restarts the primitive.
    pub(crate) primitive_restart: bool,
}

/// Vertex bindings and attributes set by a command buffer.
#[derive(Debug, Default)]
pub(crate) struct VertexInput {
    /// Vertex bindings.
    pub(crate) bindings: Vec<vk::VertexInputBindingDescription>,
    /// The instance divisors of bindings that advance by instance.
    pub(crate) divisors: Vec<vk::VertexInputBindingDivisorDescriptionKHR>,
    /// Vertex attributes.
    pub(crate) attributes: Vec<vk::VertexInputAttributeDescription>,
}

impl VertexInput {
    /// The bindings and attributes in the form of a pipeline's.
    pub(crate) fn state(&self) -> VertexInputState<'_> {
        VertexInputState {
            bindings: &self.bindings,
            divisors: &self.divisors,
            attributes: &self.attributes,
            ..Default::default()
        }
    }
}

/// The stages before rasterization, viewports, and rasterization.
#[derive(Default)]
pub(crate) struct PreRasterizationState<'a> {
    /// The shader stages.
    pub(crate) stages: Vec<(vk::ShaderStageFlags, ShaderStage<'a>)>,
    /// The number of viewports. Unless they are dynamic, each has a value in `viewports`.
    pub(crate) viewport_count: u32,
    /// Viewports, unless dynamic.
    pub(crate) viewports: &'a [vk::Viewport],
    /// True if clip space's depths are from -w, not from 0, to w.
    pub(crate) negative_one_to_one: bool,
    /// The number of scissors.
    pub(crate) scissor_count: u32,
    /// Scissors, unless dynamic.
    pub(crate) scissors: &'a [vk::Rect2D],
    /// Rasterization state.
    pub(crate) rasterization: vk::PipelineRasterizationStateCreateInfo<'a>,
    /// True if the provoking vertex is a primitive's last, not its first.
    pub(crate) provoking_last: bool,
    /// The vertex stream that is rasterized.
    pub(crate) rasterized_stream: u32,
    /// The number of vertices of a patch; 0 if the pipeline doesn't say.
    pub(crate) patch_control_points: u32,
    /// True if the origin of the domain of patches is the lower left.
    pub(crate) lower_left_domain: bool,
    /// True if primitives are clipped at the near and far planes; None if the pipeline doesn't say.
    pub(crate) depth_clip: Option<bool>,
    /// The line rasterization state.
    pub(crate) lines: vk::PipelineRasterizationLineStateCreateInfoKHR<'a>,
}

/// The fragment stage, and the depth and stencil tests.
#[derive(Default)]
pub(crate) struct FragmentShaderState<'a> {
    /// The fragment stage; empty if there is none.
    pub(crate) stages: Vec<(vk::ShaderStageFlags, ShaderStage<'a>)>,
    /// Depth and stencil state, if the subpass has such an attachment.
    pub(crate) depth_stencil: Option<vk::PipelineDepthStencilStateCreateInfo<'a>>,
}

/// Multisampling, attachments, and blending.
#[derive(Default)]
pub(crate) struct FragmentOutputState<'a> {
    /// Multisample state.
    pub(crate) multisample: vk::PipelineMultisampleStateCreateInfo<'a>,
    /// The mask of samples that can be covered.
    pub(crate) sample_mask: u32,
    /// The logic operation, and true if it is enabled.
    pub(crate) logic_op: (vk::LogicOp, bool),
    /// Blend state by colour attachment; empty if all of it is dynamic.
    pub(crate) blend: &'a [vk::PipelineColorBlendAttachmentState],
    /// Colour write enables by attachment; empty if the pipeline has none.
    pub(crate) color_write_enables: &'a [vk::Bool32],
    /// Blend constants.
    pub(crate) blend_constants: [f32; 4],
    /// The colour formats of the subpass; undefined if the attachment is unused.
    pub(crate) color_formats: Vec<vk::Format>,
    /// The views that draws render to, a bit each; 0 without views.
    pub(crate) view_mask: u32,
}

impl<'a> GraphicsState<'a> {
    /// Follows a create info's pointers. Pointers that the rest of the create info makes irrelevant may be invalid.
    ///
    /// # Safety
    /// The create info and its chain are valid.
    pub(crate) unsafe fn from_create_info(
        info: &'a vk::GraphicsPipelineCreateInfo<'a>,
    ) -> Result<Self, Error> {
        let mut gathered = GraphicsState::default();
        gathered.fragment_output.sample_mask = u32::MAX;
        // SAFETY: the caller's promise.
        unsafe {
            for given in valid::slice(info.p_stages, info.stage_count)? {
                let stages = if given.stage == vk::ShaderStageFlags::FRAGMENT {
                    &mut gathered.fragment_shader.stages
                } else {
                    &mut gathered.pre_rasterization.stages
                };
                stages.push((given.stage, ShaderStage::from_create_info(given)?));
            }
            gathered.layout = handle::get_optional(info.layout)?;
            gathered.gaussian =
                valid::find_in_chain::<PipelineGaussianStateCreateInfoGAURAST>(info.p_next)
                    .copied();
            gathered.approximation = valid::find_in_chain::<
                PipelineGaussianApproximationStateCreateInfoGAURAST,
            >(info.p_next)
            .copied();
            gathered.footprint = valid::find_in_chain::<
                PipelineGaussianFootprintStateCreateInfoGAURAST,
            >(info.p_next)
            .copied();
            if let Some(state) = valid::optional(info.p_dynamic_state) {
                gathered.dynamic = valid::slice(state.p_dynamic_states, state.dynamic_state_count)?;
            }
            if let Some(state) = valid::optional(info.p_vertex_input_state) {
                read_vertex_input(state, &mut gathered)?;
            }
            if let Some(state) = valid::optional(info.p_input_assembly_state) {
                gathered.vertex_input.topology = state.topology;
                gathered.vertex_input.primitive_restart =
                    state.primitive_restart_enable != vk::FALSE;
            }
            if gathered.tessellates()
                && let Some(state) = valid::optional(info.p_tessellation_state)
            {
                gathered.pre_rasterization.patch_control_points = state.patch_control_points;
                let origin = valid::find_in_chain::<
                    vk::PipelineTessellationDomainOriginStateCreateInfo<'_>,
                >(state.p_next);
                gathered.pre_rasterization.lower_left_domain = origin.is_some_and(|state| {
                    state.domain_origin == vk::TessellationDomainOrigin::LOWER_LEFT
                });
            }
            if let Some(state) = valid::optional(info.p_rasterization_state) {
                gathered.pre_rasterization.rasterization = *state;
                let provoking = valid::find_in_chain::<
                    vk::PipelineRasterizationProvokingVertexStateCreateInfoEXT<'_>,
                >(state.p_next);
                gathered.pre_rasterization.provoking_last = provoking.is_some_and(|state| {
                    state.provoking_vertex_mode == vk::ProvokingVertexModeEXT::LAST_VERTEX
                });
                let stream = valid::find_in_chain::<
                    vk::PipelineRasterizationStateStreamCreateInfoEXT<'_>,
                >(state.p_next);
                gathered.pre_rasterization.rasterized_stream =
                    stream.map_or(0, |state| state.rasterization_stream);
            }
            if let Some(state) = valid::optional(info.p_rasterization_state) {
                let clip = valid::find_in_chain::<
                    vk::PipelineRasterizationDepthClipStateCreateInfoEXT<'_>,
                >(state.p_next);
                gathered.pre_rasterization.depth_clip =
                    clip.map(|state| state.depth_clip_enable != vk::FALSE);
                let lines = valid::find_in_chain::<
                    vk::PipelineRasterizationLineStateCreateInfoKHR<'_>,
                >(state.p_next);
                gathered.pre_rasterization.lines = lines.copied().unwrap_or_default();
            }
            if !gathered.discards() {
                read_fragments(info, &mut gathered)?;
            }
        }
        Ok(gathered)
    }

    /// The shader stages.
    pub(crate) fn stages(&self) -> impl Iterator<Item = &(vk::ShaderStageFlags, ShaderStage<'a>)> {
        let (before, fragment) = (&self.pre_rasterization.stages, &self.fragment_shader.stages);
        before.iter().chain(fragment)
    }

    /// Reports whether there are tessellation stages.
    pub(crate) fn tessellates(&self) -> bool {
        let both = vk::ShaderStageFlags::TESSELLATION_CONTROL
            | vk::ShaderStageFlags::TESSELLATION_EVALUATION;
        self.stages().any(|(stage, _)| both.contains(*stage))
    }

    /// Reports whether a state is dynamic.
    pub(crate) fn is_dynamic(&self, state: vk::DynamicState) -> bool {
        self.dynamic.contains(&state)
    }

    /// Reports whether nothing is ever rasterized, so that all rasterization state is ignored.
    pub(crate) fn discards(&self) -> bool {
        self.pre_rasterization
            .rasterization
            .rasterizer_discard_enable
            != vk::FALSE
            && !self.is_dynamic(vk::DynamicState::RASTERIZER_DISCARD_ENABLE)
    }

    /// Reports whether all state of single colour attachments is dynamic, so that the pipeline has none of it.
    fn has_dynamic_blending(&self) -> bool {
        use vk::DynamicState as S;
        [
            S::COLOR_BLEND_ENABLE_EXT,
            S::COLOR_BLEND_EQUATION_EXT,
            S::COLOR_WRITE_MASK_EXT,
        ]
        .into_iter()
        .all(|state| self.is_dynamic(state))
    }

    /// Fails if primitive restart is enabled for a list, which needs the feature `primitiveTopologyListRestart`.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`].
    pub(super) fn require_no_list_restart(&self) -> Result<(), Error> {
        use vk::PrimitiveTopology as T;
        let topology = self.vertex_input.topology;
        let is_list = matches!(
            topology,
            T::POINT_LIST
                | T::LINE_LIST
                | T::TRIANGLE_LIST
                | T::LINE_LIST_WITH_ADJACENCY
                | T::TRIANGLE_LIST_WITH_ADJACENCY
        );
        if !self.vertex_input.primitive_restart
            || !is_list
            || self.is_dynamic(vk::DynamicState::PRIMITIVE_TOPOLOGY)
        {
            return Ok(());
        }
        Err(Error::usage(
            "VUID-VkPipelineInputAssemblyStateCreateInfo-topology-06252",
            format!("primitiveRestartEnable is VK_TRUE, but {topology:?} has no restart"),
        ))
    }

    /// The line width. It is often left at zero in pipelines that draw no lines.
    fn line_width(&self) -> f32 {
        let width = self.pre_rasterization.rasterization.line_width;
        if width == 0.0 || self.is_dynamic(vk::DynamicState::LINE_WIDTH) {
            return 1.0;
        }
        width
    }
}

/// Vertex bindings and attributes.
///
/// # Safety
/// The state and its chain are valid.
unsafe fn read_vertex_input<'a>(
    state: &'a vk::PipelineVertexInputStateCreateInfo<'a>,
    gathered: &mut GraphicsState<'a>,
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    unsafe {
        gathered.vertex_input.bindings = valid::slice(
            state.p_vertex_binding_descriptions,
            state.vertex_binding_description_count,
        )?;
        gathered.vertex_input.attributes = valid::slice(
            state.p_vertex_attribute_descriptions,
            state.vertex_attribute_description_count,
        )?;
        let divisors = valid::find_in_chain::<vk::PipelineVertexInputDivisorStateCreateInfoKHR<'_>>(
            state.p_next,
        );
        if let Some(state) = divisors {
            gathered.vertex_input.divisors = valid::slice(
                state.p_vertex_binding_divisors,
                state.vertex_binding_divisor_count,
            )?;
        }
    }
    Ok(())
}

/// Reads the state of pipelines that rasterize.
///
/// # Safety
/// The create info and its chain are valid.
unsafe fn read_fragments<'a>(
    info: &'a vk::GraphicsPipelineCreateInfo<'a>,
    gathered: &mut GraphicsState<'a>,
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    unsafe {
        let formats = attachment_formats(info)?;
        if let Some(state) = valid::optional(info.p_viewport_state) {
            read_viewports(state, gathered)?;
        }
        if let Some(state) = valid::optional(info.p_multisample_state) {
            gathered.fragment_output.multisample = *state;
            let is_dynamic = gathered.is_dynamic(vk::DynamicState::SAMPLE_MASK_EXT);
            if !is_dynamic && let Some(mask) = valid::optional(state.p_sample_mask) {
                gathered.fragment_output.sample_mask = *mask;
            }
        }
        if formats.has_depth_stencil {
            gathered.fragment_shader.depth_stencil =
                valid::optional(info.p_depth_stencil_state).copied();
        }
        if !formats.color.is_empty()
            && let Some(state) = valid::optional(info.p_color_blend_state)
        {
            gathered.fragment_output.logic_op =
                (state.logic_op, state.logic_op_enable != vk::FALSE);
            if !gathered.has_dynamic_blending() {
                gathered.fragment_output.blend =
                    valid::slice(state.p_attachments, state.attachment_count)?;
            }
            let writes =
                valid::find_in_chain::<vk::PipelineColorWriteCreateInfoEXT<'_>>(state.p_next);
            if let Some(writes) = writes
                && !gathered.is_dynamic(vk::DynamicState::COLOR_WRITE_ENABLE_EXT)
            {
                gathered.fragment_output.color_write_enables =
                    valid::slice(writes.p_color_write_enables, writes.attachment_count)?;
            }
            gathered.fragment_output.blend_constants = state.blend_constants;
        }
        gathered.fragment_output.color_formats = formats.color;
        gathered.fragment_output.view_mask = formats.view_mask;
    }
    Ok(())
}

/// Reads viewports and scissors. The pointers may be invalid if these are dynamic.
///
/// # Safety
/// The state and its chain are valid.
unsafe fn read_viewports<'a>(
    state: &'a vk::PipelineViewportStateCreateInfo<'a>,
    gathered: &mut GraphicsState<'a>,
) -> Result<(), Error> {
    use vk::DynamicState as S;
    gathered.pre_rasterization.viewport_count = state.viewport_count;
    gathered.pre_rasterization.scissor_count = state.scissor_count;
    // SAFETY: the caller's promise.
    let control = unsafe {
        valid::find_in_chain::<vk::PipelineViewportDepthClipControlCreateInfoEXT<'_>>(state.p_next)
    };
    gathered.pre_rasterization.negative_one_to_one =
        control.is_some_and(|control| control.negative_one_to_one != vk::FALSE);
    let is_dynamic = |states: [S; 2]| states.iter().any(|state| gathered.is_dynamic(*state));
    let dynamic_viewports = is_dynamic([S::VIEWPORT, S::VIEWPORT_WITH_COUNT]);
    let dynamic_scissors = is_dynamic([S::SCISSOR, S::SCISSOR_WITH_COUNT]);
    // SAFETY: the caller's promise; a null pointer is not followed.
    unsafe {
        if !dynamic_viewports && !state.p_viewports.is_null() {
            gathered.pre_rasterization.viewports =
                valid::slice(state.p_viewports, state.viewport_count)?;
        }
        if !dynamic_scissors && !state.p_scissors.is_null() {
            gathered.pre_rasterization.scissors =
                valid::slice(state.p_scissors, state.scissor_count)?;
        }
    }
    Ok(())
}

/// The attachments that a pipeline renders to.
#[derive(Default)]
struct AttachmentFormats {
    /// The formats by colour attachment; undefined if unused.
    color: Vec<vk::Format>,
    /// True if there is a depth or stencil attachment.
    has_depth_stencil: bool,
    /// The views that draws render to, a bit each; 0 without views.
    view_mask: u32,
}

/// The formats of the subpass, or of dynamic rendering, in which a pipeline draws.
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
                view_mask: subpass.view_mask,
            });
        }
        let Some(rendering) = valid::find_in_chain::<vk::PipelineRenderingCreateInfo>(info.p_next)
        else {
            return Ok(AttachmentFormats::default());
        };
        let color = valid::slice(
            rendering.p_color_attachment_formats,
            rendering.color_attachment_count,
        )?;
        let undefined = vk::Format::UNDEFINED;
        Ok(AttachmentFormats {
            color: color.to_vec(),
            has_depth_stencil: rendering.depth_attachment_format != undefined
                || rendering.stencil_attachment_format != undefined,
            view_mask: rendering.view_mask,
        })
    }
}

/// The source of an attribute.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct AttributeSource {
    /// The vertex buffer binding.
    pub(crate) binding: u32,
    /// Bytes from one vertex to the next.
    pub(crate) stride: u32,
    /// Bytes from the vertex's start to the attribute.
    pub(crate) offset: u32,
    /// The format in memory.
    pub(crate) format: Format,
    /// The number of instances after which it advances (0: never); `None` if it advances by vertex.
    pub(crate) instance_divisor: Option<u32>,
}

/// Finds the attribute at `location`, which the extension calls `name` and for which it needs `components`.
///
/// # Errors
/// An [`Error`] if the location, its binding or its format is unsuitable.
pub(crate) fn attribute(
    info: &GraphicsState,
    name: &str,
    location: u32,
    components: u32,
) -> Result<AttributeSource, Error> {
    let refuse = |what: String| {
        Error::usage(
            "VUID-VkGaussianAttributeLocationsGAURAST-None-90015",
            if location == GAUSSIAN_LOCATION_UNUSED_GAURAST {
                format!("{name} is unused, but the pipeline reads it")
            } else {
                format!("{name} is location {location}, {what}")
            },
        )
    };
    let source = source(&info.vertex_input, location).map_err(refuse)?;
    let format = source.format;
    if format.is_integer() {
        return Err(refuse(format!(
            "whose format {format:?} does not convert to floating point"
        )));
    }
    if (format.components().len() as u32) < components {
        return Err(refuse(format!(
            "whose format {format:?} has fewer than {components} components"
        )));
    }
    Ok(source)
}

/// Finds the attribute at `location`.
///
/// # Errors
/// The problem with the attribute, as the end of a sentence about its location.
pub(crate) fn source(info: &VertexInputState, location: u32) -> Result<AttributeSource, String> {
    let attribute = info.attributes.iter().find(|a| a.location == location);
    let attribute = attribute.ok_or("which the vertex input state does not have")?;
    let number = attribute.binding;
    let binding = info.bindings.iter().find(|b| b.binding == number);
    let binding = binding
        .ok_or_else(|| format!("whose binding {number} the vertex input state does not have"))?;
    let features = formats::properties(attribute.format).buffer_features;
    let format = formats::device_format(attribute.format)
        .filter(|_| features.contains(vk::FormatFeatureFlags::VERTEX_BUFFER));
    let format = format.ok_or_else(|| {
        format!(
            "whose format {:?} this device does not read as a vertex attribute",
            attribute.format
        )
    })?;
    let instance_divisor = match binding.input_rate {
        vk::VertexInputRate::VERTEX => None,
        vk::VertexInputRate::INSTANCE => {
            let given = info.divisors.iter().find(|it| it.binding == number);
            Some(given.map_or(1, |it| it.divisor))
        }
        rate => return Err(format!("whose binding has the unknown rate {rate:?}")),
    };
    Ok(AttributeSource {
        binding: number,
        stride: binding.stride,
        offset: attribute.offset,
        format,
        instance_divisor,
    })
}

/// The state of a single colour attachment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AttachmentState {
    /// True if blending is enabled.
    pub(super) blend_enable: bool,
    pub(super) equations: BlendEquations,
    /// The components that are written, a bit each, if writes are enabled.
    pub(super) write_mask: u8,
    pub(super) write_enable: bool,
}

/// The equations of colour and alpha.
pub(crate) type BlendEquations = (BlendEquation, BlendEquation);

/// The equation that gives the source.
const REPLACE: BlendEquation = BlendEquation {
    source: BlendFactor::One,
    destination: BlendFactor::Zero,
    op: BlendOp::Add,
};

impl AttachmentState {
    /// The state that writes the source unchanged.
    const WRITTEN: Self = Self {
        blend_enable: false,
        equations: (REPLACE, REPLACE),
        write_mask: 0xf,
        write_enable: true,
    };

    /// The state for the device.
    fn blend_state(self) -> BlendState {
        BlendState {
            equations: self.blend_enable.then_some(self.equations),
            write_mask: if self.write_enable {
                self.write_mask
            } else {
                0
            },
        }
    }
}

/// The state of all colour attachments.
///
/// # Errors
/// An [`Error`] if their number is not that of the attachments, or for state that the device doesn't support.
fn attachment_states(info: &GraphicsState) -> Result<Vec<AttachmentState>, Error> {
    let enables = info.fragment_output.color_write_enables;
    let with_enables = |index: usize, state: AttachmentState| AttachmentState {
        write_enable: enables.get(index).is_none_or(|&enable| enable != vk::FALSE),
        ..state
    };
    if info.has_dynamic_blending() {
        let count = info.fragment_output.color_formats.len();
        let states = (0..count).map(|index| with_enables(index, AttachmentState::WRITTEN));
        return Ok(states.collect());
    }
    if info.fragment_output.blend.len() != info.fragment_output.color_formats.len() {
        return Err(Error::usage(
            "VUID-VkGraphicsPipelineCreateInfo-renderPass-07609",
            format!(
                "the colour blend state's attachmentCount is {}, but the subpass has {} colour attachments",
                info.fragment_output.blend.len(),
                info.fragment_output.color_formats.len()
            ),
        ));
    }
    let given = info.fragment_output.blend.iter().enumerate();
    given
        .map(|(index, given)| {
            let blend_enable = given.blend_enable != vk::FALSE;
            let mut state = AttachmentState {
                blend_enable,
                write_mask: convert::write_mask(given.color_write_mask),
                ..AttachmentState::WRITTEN
            };
            // An unused value may be anything.
            let may_blend =
                blend_enable || info.is_dynamic(vk::DynamicState::COLOR_BLEND_ENABLE_EXT);
            if may_blend && !info.is_dynamic(vk::DynamicState::COLOR_BLEND_EQUATION_EXT) {
                state.equations = convert::blend_equations(given)?;
            }
            Ok(with_enables(index, state))
        })
        .collect()
}

/// Reports whether blending of an attachment reads the second source of the fragment stage.
pub(crate) fn reads_second_source(state: &vk::PipelineColorBlendAttachmentState) -> bool {
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

/// A feature of the device: true if it is supported, and its name.
macro_rules! supported {
    ($feature:ident) => {
        (SUPPORTED.$feature, stringify!($feature))
    };
}

/// The state of a pipeline, or of a draw.
#[derive(Clone, Debug)]
pub(crate) struct FixedFunctionState {
    /// All state except depth bias, depth, stencil, logic operations and the state of single colour attachments.
    pub(crate) draw: DrawState,
    /// The number of vertices of a patch.
    pub(super) patch_control_points: u32,
    pub(super) depth_bias_enable: bool,
    pub(super) depth_bias: DepthBias,
    pub(super) depth_test: bool,
    pub(super) depth_write: bool,
    pub(super) depth_compare: CompareOp,
    pub(super) depth_bounds_test: bool,
    pub(super) depth_bounds: (f32, f32),
    pub(super) stencil_test: bool,
    pub(super) stencil: [StencilFace; 2],
    /// The state of Gaussians, if the pipeline draws them.
    pub(super) gaussian: Option<Box<GaussianState>>,
    pub(super) logic_op_enable: bool,
    pub(super) logic_op: LogicOp,
    pub(super) attachments: Vec<AttachmentState>,
}

/// The ids of the rules on the operations of `VkStencilOpState`.
const STENCIL_OP_STATE: StencilOpIds = StencilOpIds {
    fail: "VUID-VkStencilOpState-failOp-parameter",
    pass: "VUID-VkStencilOpState-passOp-parameter",
    depth_fail: "VUID-VkStencilOpState-depthFailOp-parameter",
    compare: "VUID-VkStencilOpState-compareOp-parameter",
};

/// A stencil face that changes nothing.
const KEEP: StencilFace = StencilFace {
    fail: StencilOp::Keep,
    pass: StencilOp::Keep,
    depth_fail: StencilOp::Keep,
    compare: CompareOp::Always,
    compare_mask: 0xFF,
    write_mask: 0xFF,
    reference: 0,
};

impl FixedFunctionState {
    /// Validates and converts the static state of a pipeline.
    ///
    /// # Errors
    /// An [`Error`] that names the valid usage broken, or the feature that the device lacks.
    pub(crate) fn new(info: &GraphicsState) -> Result<Self, Error> {
        let mut state = Self::of(info, convert::topology(info.vertex_input.topology)?)?;
        if !info.discards() {
            state.set_viewports(info)?;
            state.set_samples(info)?;
            state.set_depth_stencil(info)?;
            state.set_blend(info)?;
        }
        Ok(state)
    }

    /// As [`FixedFunctionState::new`], for the fragments of Gaussians.
    ///
    /// # Errors
    /// As there.
    pub(crate) fn of_gaussians(info: &GraphicsState) -> Result<Self, Error> {
        // The topology has no effect.
        let mut state = Self::of(info, Topology::TriangleStrip)?;
        if !info
            .fragment_output
            .multisample
            .rasterization_samples
            .is_empty()
        {
            state.set_samples(info)?;
        }
        state.set_depth_stencil(info)?;
        state.set_blend(info)?;
        Ok(state)
    }

    /// The state with vertex assembly and rasterization of the pipeline; all other state has no effect.
    fn of(info: &GraphicsState, topology: Topology) -> Result<Self, Error> {
        let raster = &info.pre_rasterization.rasterization;
        let polygon_mode = convert::polygon_mode(raster.polygon_mode)?;
        let needs = [
            (
                polygon_mode != PolygonMode::Fill,
                supported!(fill_mode_non_solid),
                "a polygon mode but FILL",
            ),
            (
                raster.depth_clamp_enable != vk::FALSE,
                supported!(depth_clamp),
                "depthClampEnable",
            ),
            (
                raster.depth_bias_enable != vk::FALSE && raster.depth_bias_clamp != 0.0,
                supported!(depth_bias_clamp),
                "depthBiasClamp",
            ),
            (
                !matches!(
                    info.pre_rasterization.lines.line_rasterization_mode,
                    vk::LineRasterizationModeKHR::DEFAULT
                        | vk::LineRasterizationModeKHR::RECTANGULAR
                ),
                (
                    SUPPORTED.bresenham_lines && SUPPORTED.smooth_lines,
                    "bresenhamLines or smoothLines",
                ),
                "a line rasterization mode but DEFAULT and RECTANGULAR",
            ),
            (
                info.pre_rasterization.lines.stippled_line_enable != vk::FALSE
                    && !info.is_dynamic(vk::DynamicState::LINE_STIPPLE_ENABLE_EXT),
                supported!(stippled_rectangular_lines),
                "stippledLineEnable",
            ),
            (
                info.line_width() != 1.0,
                supported!(wide_lines),
                "a line width but 1",
            ),
        ];
        require_all(&needs)?;
        let draw = DrawState {
            topology,
            primitive_restart: info.vertex_input.primitive_restart,
            viewports: Vec::new(),
            scissors: Vec::new(),
            depth_clamp: raster.depth_clamp_enable != vk::FALSE,
            unrestricted_depth: false,
            depth_clip: info.pre_rasterization.depth_clip,
            negative_one_to_one: info.pre_rasterization.negative_one_to_one,
            rasterizer_discard: raster.rasterizer_discard_enable != vk::FALSE,
            polygon_mode,
            cull_front: false,
            cull_back: false,
            front_clockwise: false,
            depth_bias: None,
            line_width: info.line_width(),
            provoking_last: info.pre_rasterization.provoking_last,
            rasterized_stream: info.pre_rasterization.rasterized_stream,
            lower_left_domain: info.pre_rasterization.lower_left_domain,
            samples: 1,
            sample_mask: u32::MAX,
            sample_shading: false,
            alpha_to_coverage: false,
            alpha_to_one: false,
            depth_stencil: DepthStencil {
                depth: None,
                bounds: None,
                stencil: None,
            },
            logic_op: None,
            blend: Vec::new(),
            blend_constants: [0.0; 4],
        };
        let mut state = Self {
            draw,
            patch_control_points: info.pre_rasterization.patch_control_points,
            depth_bias_enable: raster.depth_bias_enable != vk::FALSE,
            depth_bias: DepthBias {
                constant: raster.depth_bias_constant_factor,
                clamp: raster.depth_bias_clamp,
                slope: raster.depth_bias_slope_factor,
            },
            depth_test: false,
            depth_write: false,
            depth_compare: CompareOp::Always,
            depth_bounds_test: false,
            depth_bounds: (0.0, 1.0),
            stencil_test: false,
            stencil: [KEEP; 2],
            gaussian: None,
            logic_op_enable: false,
            logic_op: LogicOp::Copy,
            attachments: Vec::new(),
        };
        state.set_cull_mode(raster.cull_mode);
        state.set_front_face(raster.front_face);
        Ok(state)
    }

    fn set_viewports(&mut self, info: &GraphicsState) -> Result<(), Error> {
        use vk::DynamicState as S;
        let counts = [
            info.pre_rasterization.viewport_count,
            info.pre_rasterization.scissor_count,
        ];
        let dynamic = [
            info.is_dynamic(S::VIEWPORT_WITH_COUNT),
            info.is_dynamic(S::SCISSOR_WITH_COUNT),
        ];
        for (count, dynamic) in counts.into_iter().zip(dynamic) {
            if count > limits::properties().max_viewports {
                return Err(Error::usage(
                    "VUID-VkPipelineViewportStateCreateInfo-viewportCount-01218",
                    format!("{count} viewports or scissors are more than maxViewports"),
                ));
            }
            if count == 0 && !dynamic {
                return Err(Error::usage(
                    "VUID-VkPipelineViewportStateCreateInfo-viewportCount-04135",
                    "there is no viewport or no scissor, and their count is not dynamic",
                ));
            }
        }
        if counts[0] != counts[1] && dynamic == [false; 2] {
            return Err(Error::usage(
                "VUID-VkPipelineViewportStateCreateInfo-scissorCount-04134",
                format!(
                    "there are {} viewports, but {} scissors",
                    counts[0], counts[1]
                ),
            ));
        }
        let has = |given: usize, count: u32| given == count as usize;
        let static_viewports = !(dynamic[0] || info.is_dynamic(S::VIEWPORT));
        let static_scissors = !(dynamic[1] || info.is_dynamic(S::SCISSOR));
        if (static_viewports && !has(info.pre_rasterization.viewports.len(), counts[0]))
            || (static_scissors && !has(info.pre_rasterization.scissors.len(), counts[1]))
        {
            return Err(Error::usage(
                "VUID-VkGraphicsPipelineCreateInfo-pDynamicStates-04130",
                "the pipeline has no viewports or scissors, and they are not dynamic",
            ));
        }
        if static_viewports {
            self.draw.viewports = info
                .pre_rasterization
                .viewports
                .iter()
                .copied()
                .map(convert::viewport)
                .collect();
        }
        if static_scissors {
            self.draw.scissors = info
                .pre_rasterization
                .scissors
                .iter()
                .copied()
                .map(convert::rect)
                .collect();
        }
        Ok(())
    }

    fn set_samples(&mut self, info: &GraphicsState) -> Result<(), Error> {
        let multisample = &info.fragment_output.multisample;
        let samples = multisample.rasterization_samples;
        let supported = limits::properties().framebuffer_no_attachments_sample_counts;
        let count = samples.as_raw();
        if !count.is_power_of_two() || !supported.contains(samples) {
            return Err(Error::FeatureNotPresent(format!(
                "rasterizationSamples {samples:?} (there are {supported:?})"
            )));
        }
        let needs = [
            (
                multisample.sample_shading_enable != vk::FALSE,
                supported!(sample_rate_shading),
                "sampleShadingEnable",
            ),
            (
                multisample.alpha_to_one_enable != vk::FALSE,
                supported!(alpha_to_one),
                "alphaToOneEnable",
            ),
        ];
        require_all(&needs)?;
        let draw = &mut self.draw;
        draw.samples = count;
        draw.sample_mask = info.fragment_output.sample_mask;
        // The device shades a pixel once or at every sample, and the requested number is a minimum.
        let shaded = (multisample.min_sample_shading * count as f32).ceil();
        draw.sample_shading = multisample.sample_shading_enable != vk::FALSE && shaded > 1.0;
        draw.alpha_to_coverage = multisample.alpha_to_coverage_enable != vk::FALSE;
        draw.alpha_to_one = multisample.alpha_to_one_enable != vk::FALSE;
        Ok(())
    }

    fn set_depth_stencil(&mut self, info: &GraphicsState) -> Result<(), Error> {
        let Some(state) = &info.fragment_shader.depth_stencil else {
            return Ok(());
        };
        let bounds_test = state.depth_bounds_test_enable != vk::FALSE;
        require_all(&[(
            bounds_test,
            supported!(depth_bounds),
            "depthBoundsTestEnable",
        )])?;
        self.depth_test = state.depth_test_enable != vk::FALSE;
        self.depth_write = state.depth_write_enable != vk::FALSE;
        self.depth_bounds_test = bounds_test;
        self.depth_bounds = (state.min_depth_bounds, state.max_depth_bounds);
        // An unused value may be anything.
        let may_test = |enabled, state| enabled || info.is_dynamic(state);
        let tests_depth = may_test(self.depth_test, vk::DynamicState::DEPTH_TEST_ENABLE);
        if tests_depth && !info.is_dynamic(vk::DynamicState::DEPTH_COMPARE_OP) {
            self.depth_compare = convert::compare_op(
                state.depth_compare_op,
                "VUID-VkPipelineDepthStencilStateCreateInfo-depthCompareOp-parameter",
            )?;
        }
        self.stencil_test = state.stencil_test_enable != vk::FALSE;
        let tests_stencil = may_test(self.stencil_test, vk::DynamicState::STENCIL_TEST_ENABLE);
        let static_ops = tests_stencil && !info.is_dynamic(vk::DynamicState::STENCIL_OP);
        for (face, given) in [state.front, state.back].into_iter().enumerate() {
            if static_ops {
                let ops = StencilOps::from_vk(
                    given.fail_op,
                    given.pass_op,
                    given.depth_fail_op,
                    given.compare_op,
                    &STENCIL_OP_STATE,
                )?;
                ops.set(&mut self.stencil[face]);
            }
            self.stencil[face].compare_mask = given.compare_mask as u8;
            self.stencil[face].write_mask = given.write_mask as u8;
            self.stencil[face].reference = given.reference as u8;
        }
        Ok(())
    }

    fn set_blend(&mut self, info: &GraphicsState) -> Result<(), Error> {
        let (op, enable) = info.fragment_output.logic_op;
        require_all(&[(enable, supported!(logic_op), "logicOpEnable")])?;
        self.logic_op_enable = enable;
        // An unused value may be anything.
        let may_operate = enable || info.is_dynamic(vk::DynamicState::LOGIC_OP_ENABLE_EXT);
        if may_operate && !info.is_dynamic(vk::DynamicState::LOGIC_OP_EXT) {
            self.logic_op = convert::logic_op(op)?;
        }
        self.attachments = attachment_states(info)?;
        self.draw.blend_constants = info.fragment_output.blend_constants;
        Ok(())
    }

    /// Sets the faces that are culled.
    pub(super) fn set_cull_mode(&mut self, mode: vk::CullModeFlags) {
        self.draw.cull_front = mode.contains(vk::CullModeFlags::FRONT);
        self.draw.cull_back = mode.contains(vk::CullModeFlags::BACK);
    }

    /// Sets the face that is the front.
    pub(super) fn set_front_face(&mut self, face: vk::FrontFace) {
        self.draw.front_clockwise = face == vk::FrontFace::CLOCKWISE;
    }

    /// Reports whether anything is rasterized.
    pub(super) fn rasterizes(&self) -> bool {
        !self.draw.rasterizer_discard
    }

    /// Reports whether lines are drawn, so that their width is used.
    pub(super) fn draws_lines(&self) -> bool {
        let draw = &self.draw;
        let are_lines =
            draw.polygon_mode == PolygonMode::Line || class(draw.topology) == Class::Lines;
        self.rasterizes() && are_lines
    }

    /// Reports whether patches are drawn.
    pub(super) fn draws_patches(&self) -> bool {
        class(self.draw.topology) == Class::Patches
    }

    /// Sets the number of vertices of a patch.
    pub(super) fn set_patch_control_points(&mut self, count: u32) {
        self.patch_control_points = count.min(limits::MAX_PATCH_SIZE);
    }

    /// Reports whether depth bias is enabled.
    pub(super) fn biases_depth(&self) -> bool {
        self.rasterizes() && self.depth_bias_enable
    }

    /// Reports whether the depth bounds test is enabled.
    pub(super) fn tests_depth_bounds(&self) -> bool {
        self.rasterizes() && self.depth_bounds_test
    }

    /// Reports whether the depth test is enabled.
    pub(super) fn tests_depth(&self) -> bool {
        self.rasterizes() && self.depth_test
    }

    /// Reports whether the stencil test is enabled.
    pub(super) fn tests_stencil(&self) -> bool {
        self.rasterizes() && self.stencil_test
    }

    /// Reports whether an attachment's blending uses the blend constants.
    pub(super) fn blends_by_constants(&self) -> bool {
        self.rasterizes() && !self.logic_op_enable && blends_by_constants(&self.attachments)
    }

    /// Reports whether a logic operation replaces blending.
    pub(super) fn operates(&self) -> bool {
        self.rasterizes() && self.logic_op_enable
    }

    /// Reports whether fragments are written to a colour attachment.
    pub(super) fn has_colors(&self) -> bool {
        self.rasterizes() && !self.attachments.is_empty()
    }

    /// Reports whether a colour attachment is blended.
    pub(super) fn blends(&self) -> bool {
        self.rasterizes()
            && self
                .attachments
                .iter()
                .any(|attachment| attachment.blend_enable)
    }

    /// Changes the state of a colour attachment, if it exists.
    pub(super) fn set_attachment(&mut self, index: usize, set: impl FnOnce(&mut AttachmentState)) {
        if let Some(attachment) = self.attachments.get_mut(index) {
            set(attachment);
        }
    }

    /// Reports whether Gaussians are drawn.
    pub(super) fn draws_gaussians(&self) -> bool {
        self.gaussian.is_some()
    }

    /// Changes the state of Gaussians, if any are drawn.
    pub(super) fn set_gaussian(&mut self, set: impl FnOnce(&mut GaussianState)) {
        if let Some(state) = &mut self.gaussian {
            set(state);
        }
    }

    /// The state of Gaussians, combined with the rest of the state that they use.
    pub(crate) fn gaussian_state(&self) -> GaussianState {
        let converted = self.draw_state();
        GaussianState {
            sample_mask: converted.sample_mask,
            depth_stencil: converted.depth_stencil,
            logic_op: converted.logic_op,
            blend: converted.blend,
            blend_constants: converted.blend_constants,
            negative_one_to_one: converted.negative_one_to_one,
            ..self.gaussian.as_deref().cloned().unwrap_or_default()
        }
    }

    /// The state for the device.
    pub(crate) fn draw_state(&self) -> DrawState {
        DrawState {
            depth_bias: self.depth_bias_enable.then_some(self.depth_bias),
            depth_stencil: DepthStencil {
                depth: self.depth_test.then_some(DepthTest {
                    compare: self.depth_compare,
                    write: self.depth_write,
                }),
                bounds: self.depth_bounds_test.then_some(self.depth_bounds),
                stencil: self.stencil_test.then_some(self.stencil),
            },
            topology: match self.draw.topology {
                Topology::PatchList { .. } => Topology::PatchList {
                    control_points: self.patch_control_points,
                },
                other => other,
            },
            logic_op: self.logic_op_enable.then_some(self.logic_op),
            blend: self.attachments.iter().map(|it| it.blend_state()).collect(),
            ..self.draw.clone()
        }
    }
}

/// Reports whether an attachment's blending uses the blend constants.
fn blends_by_constants(attachments: &[AttachmentState]) -> bool {
    let blended = attachments
        .iter()
        .filter(|attachment| attachment.blend_enable);
    blended
        .map(|attachment| attachment.equations)
        .flat_map(|(color, alpha)| {
            [
                color.source,
                color.destination,
                alpha.source,
                alpha.destination,
            ]
        })
        .any(|factor| {
            matches!(
                factor,
                BlendFactor::ConstantColor
                    | BlendFactor::OneMinusConstantColor
                    | BlendFactor::ConstantAlpha
                    | BlendFactor::OneMinusConstantAlpha
            )
        })
}

/// The class of primitives that a topology makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Class {
    /// Points.
    Points,
    /// Lines.
    Lines,
    /// Triangles.
    Triangles,
    /// Patches.
    Patches,
}

/// The class of a topology. A dynamic topology must stay in its class.
pub(crate) fn class(topology: Topology) -> Class {
    match topology {
        Topology::PointList => Class::Points,
        Topology::LineList
        | Topology::LineStrip
        | Topology::LineListWithAdjacency
        | Topology::LineStripWithAdjacency => Class::Lines,
        Topology::TriangleList
        | Topology::TriangleStrip
        | Topology::TriangleFan
        | Topology::TriangleListWithAdjacency
        | Topology::TriangleStripWithAdjacency => Class::Triangles,
        Topology::PatchList { .. } => Class::Patches,
    }
}

/// Fails for the first required feature that the device lacks.
fn require_all(needs: &[(bool, (bool, &str), &str)]) -> Result<(), Error> {
    let lacks = |needed: bool, is_supported: bool| needed && !is_supported;
    match needs
        .iter()
        .find(|(needed, (is_supported, _), _)| lacks(*needed, *is_supported))
    {
        None => Ok(()),
        Some((_, (_, feature), what)) => Err(Error::FeatureNotPresent(format!(
            "{what} (feature {feature})"
        ))),
    }
}

/// True for each colour attachment whose source has an effect.
pub(crate) fn live_color_outputs(info: &GraphicsState, fixed: &FixedFunctionState) -> Vec<bool> {
    // Dynamic state may be enabled.
    let any_mask = info.is_dynamic(vk::DynamicState::COLOR_WRITE_MASK_EXT);
    let mut live_outputs: Vec<_> =
        std::iter::zip(&fixed.attachments, &info.fragment_output.color_formats)
            .map(|(attachment, format)| {
                (any_mask || attachment.write_mask != 0) && *format != vk::Format::UNDEFINED
            })
            .collect();
    if fixed.draw.alpha_to_coverage
        || info.is_dynamic(vk::DynamicState::ALPHA_TO_COVERAGE_ENABLE_EXT)
    {
        match live_outputs.first_mut() {
            Some(first) => *first = true,
            None => live_outputs.push(true),
        }
    }
    live_outputs
}
