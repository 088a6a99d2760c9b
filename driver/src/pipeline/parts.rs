//! The state of graphics pipelines in the four parts of a pipeline library, as owned data. The state that a switch
//! enables is kept even if the switch is off, because either may be dynamic without the other.

use super::layout::PipelineLayout;
use crate::abi::error::Error;
use crate::shader_module::ShaderStage;
use ash::vk;
use gaurast::vk::{
    PipelineGaussianApproximationStateCreateInfoGAURAST, PipelineGaussianDecodingStateCreateInfoGAURAST,
    PipelineGaussianFootprintStateCreateInfoGAURAST, PipelineGaussianStateCreateInfoGAURAST,
    PipelineGaussianUnscentedStateCreateInfoGAURAST,
};
use simdevice::state::DepthBiasUnit;
use std::sync::Arc;

/// A set of parts.
pub(crate) type Parts = vk::GraphicsPipelineLibraryFlagsEXT;

/// Each part with its name.
const NAMES: [(Parts, &str); 4] = [
    (Parts::VERTEX_INPUT_INTERFACE, "vertex input interface"),
    (Parts::PRE_RASTERIZATION_SHADERS, "pre-rasterization shaders"),
    (Parts::FRAGMENT_SHADER, "fragment shader"),
    (Parts::FRAGMENT_OUTPUT_INTERFACE, "fragment output interface"),
];

/// All parts.
pub(crate) fn all_parts() -> Parts {
    NAMES.iter().fold(Parts::empty(), |parts, (part, _)| parts | *part)
}

/// The names of parts.
fn names(parts: Parts) -> String {
    let found = NAMES.iter().filter(|(part, _)| parts.contains(*part));
    let found: Vec<_> = found.map(|(_, name)| *name).collect();
    found.join(", ")
}

/// The state of a graphics pipeline or of a library: `VkGraphicsPipelineCreateInfo` with its pointers followed. State
/// that the application may omit, or that is of a part that isn't there, is empty, `None` or the default.
#[derive(Clone, Debug, Default)]
pub(crate) struct GraphicsState {
    /// The parts that are there.
    pub(crate) parts: Parts,
    /// The vertex input interface.
    pub(crate) vertex_input: VertexInputState,
    /// The pre-rasterization shaders.
    pub(crate) pre_rasterization: PreRasterizationState,
    /// The fragment shader.
    pub(crate) fragment_shader: FragmentShaderState,
    /// The fragment output interface.
    pub(crate) fragment_output: FragmentOutputState,
    /// The layout: the union of those of the parts.
    pub(crate) layout: Option<Arc<PipelineLayout>>,
    /// The states of these parts that are dynamic.
    pub(crate) dynamic: Vec<vk::DynamicState>,
}

/// The vertex input and input assembly state.
#[derive(Clone, Debug, Default)]
pub(crate) struct VertexInputState {
    /// Vertex bindings and attributes.
    pub(crate) input: VertexInput,
    /// The topology.
    pub(crate) topology: vk::PrimitiveTopology,
    /// True if an index restarts the primitive.
    pub(crate) primitive_restart: bool,
}

/// Vertex bindings and attributes of a pipeline, or set by a command buffer.
#[derive(Clone, Debug, Default)]
pub(crate) struct VertexInput {
    /// Vertex bindings.
    pub(crate) bindings: Vec<vk::VertexInputBindingDescription>,
    /// The instance divisors of bindings that advance by instance, if not 1.
    pub(crate) divisors: Vec<vk::VertexInputBindingDivisorDescriptionKHR>,
    /// Vertex attributes.
    pub(crate) attributes: Vec<vk::VertexInputAttributeDescription>,
}

/// The stages before rasterization, viewports, rasterization, and the extension's state.
#[derive(Clone, Debug, Default)]
pub(crate) struct PreRasterizationState {
    /// The shader stages.
    pub(crate) stages: Vec<(vk::ShaderStageFlags, ShaderStage)>,
    /// The number of viewports. Unless they are dynamic, each has a value in `viewports`.
    pub(crate) viewport_count: u32,
    /// Viewports, unless dynamic.
    pub(crate) viewports: Vec<vk::Viewport>,
    /// True if clip space's depths are from -w, not from 0, to w.
    pub(crate) negative_one_to_one: bool,
    /// The number of scissors.
    pub(crate) scissor_count: u32,
    /// Scissors, unless dynamic.
    pub(crate) scissors: Vec<vk::Rect2D>,
    /// Rasterization state.
    pub(crate) rasterization: vk::PipelineRasterizationStateCreateInfo<'static>,
    /// The unit of the constant depth bias.
    pub(crate) depth_bias_unit: DepthBiasUnit,
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
    pub(crate) lines: vk::PipelineRasterizationLineStateCreateInfoKHR<'static>,
    /// The views that draws render to, a bit each; 0 without views.
    pub(crate) view_mask: u32,
    /// The extension's structure.
    pub(crate) gaussian: Option<PipelineGaussianStateCreateInfoGAURAST<'static>>,
    /// The extension's structure of approximations.
    pub(crate) approximation: Option<PipelineGaussianApproximationStateCreateInfoGAURAST<'static>>,
    /// The extension's structure of footprints.
    pub(crate) footprint: Option<PipelineGaussianFootprintStateCreateInfoGAURAST<'static>>,
    /// The extension's structure of sigma points.
    pub(crate) unscented: Option<PipelineGaussianUnscentedStateCreateInfoGAURAST<'static>>,
    /// The extension's structure of decodings.
    pub(crate) decoding: Option<PipelineGaussianDecodingStateCreateInfoGAURAST<'static>>,
}

/// The fragment stage, and the depth and stencil tests.
#[derive(Clone, Debug, Default)]
pub(crate) struct FragmentShaderState {
    /// The fragment stage; empty if there is none.
    pub(crate) stages: Vec<(vk::ShaderStageFlags, ShaderStage)>,
    /// Depth and stencil state. It has no effect if the subpass has no such attachment.
    pub(crate) depth_stencil: Option<vk::PipelineDepthStencilStateCreateInfo<'static>>,
}

/// Multisampling, attachments, and blending.
#[derive(Clone, Debug)]
pub(crate) struct FragmentOutputState {
    /// Multisample state, without the mask.
    pub(crate) multisample: vk::PipelineMultisampleStateCreateInfo<'static>,
    /// The mask of samples that can be covered.
    pub(crate) sample_mask: u32,
    /// The logic operation, and true if it is enabled.
    pub(crate) logic_op: (vk::LogicOp, bool),
    /// Blend state by colour attachment; empty if all of it is dynamic.
    pub(crate) blend: Vec<vk::PipelineColorBlendAttachmentState>,
    /// Colour write enables by attachment; empty if the pipeline has none.
    pub(crate) color_write_enables: Vec<vk::Bool32>,
    /// Blend constants.
    pub(crate) blend_constants: [f32; 4],
    /// The colour formats of the subpass; undefined if the attachment is unused.
    pub(crate) color_formats: Vec<vk::Format>,
    /// The location whose output each colour attachment takes; empty if it is the attachment's number.
    pub(crate) color_locations: Vec<u32>,
    /// True if the subpass has a depth attachment.
    pub(crate) has_depth: bool,
    /// True if the subpass has a stencil attachment.
    pub(crate) has_stencil: bool,
    /// True if fragments read colour attachments in rasterization order.
    pub(crate) reads_colors: bool,
}

impl Default for FragmentOutputState {
    fn default() -> Self {
        Self {
            multisample: vk::PipelineMultisampleStateCreateInfo::default(),
            sample_mask: u32::MAX,
            logic_op: Default::default(),
            blend: Vec::new(),
            color_write_enables: Vec::new(),
            blend_constants: [0.0; 4],
            color_formats: Vec::new(),
            color_locations: Vec::new(),
            has_depth: false,
            has_stencil: false,
            reads_colors: false,
        }
    }
}

impl GraphicsState {
    /// Links a library: adds its parts.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] if a part is there already.
    pub(crate) fn link(&mut self, library: &Self) -> Result<(), Error> {
        self.claim(library.parts)?;
        let has = |part| library.parts.contains(part);
        if has(Parts::VERTEX_INPUT_INTERFACE) {
            self.vertex_input = library.vertex_input.clone();
        }
        if has(Parts::PRE_RASTERIZATION_SHADERS) {
            self.pre_rasterization = library.pre_rasterization.clone();
        }
        if has(Parts::FRAGMENT_SHADER) {
            self.fragment_shader = library.fragment_shader.clone();
        }
        if has(Parts::FRAGMENT_OUTPUT_INTERFACE) {
            self.fragment_output = library.fragment_output.clone();
        }
        self.dynamic.extend(&library.dynamic);
        if let Some(layout) = &library.layout {
            self.add_layout(layout);
        }
        Ok(())
    }

    /// Reports whether fragments read attachments in rasterization order.
    pub(super) fn reads_attachments(&self) -> bool {
        use vk::PipelineDepthStencilStateCreateFlags as F;
        let reading =
            F::RASTERIZATION_ORDER_ATTACHMENT_DEPTH_ACCESS_EXT | F::RASTERIZATION_ORDER_ATTACHMENT_STENCIL_ACCESS_EXT;
        let depth_stencil = self.fragment_shader.depth_stencil;
        self.fragment_output.reads_colors || depth_stencil.is_some_and(|state| state.flags.intersects(reading))
    }

    /// Adds parts to those that are there.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] if one of them is there already.
    pub(super) fn claim(&mut self, parts: Parts) -> Result<(), Error> {
        let twice = self.parts & parts;
        if !twice.is_empty() {
            return Err(Error::usage(
                "VUID-VkGraphicsPipelineCreateInfo-pLibraries-06611",
                format!("the pipeline gets these parts twice: {}", names(twice)),
            ));
        }
        self.parts |= parts;
        Ok(())
    }

    /// Makes the layout the union of itself and another.
    pub(super) fn add_layout(&mut self, layout: &Arc<PipelineLayout>) {
        self.layout = Some(match &self.layout {
            None => Arc::clone(layout),
            Some(own) => PipelineLayout::union(own, layout),
        });
    }

    /// Refuses to make a pipeline of fewer parts than it needs.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] names the parts that are missing.
    pub(crate) fn require_complete(&self) -> Result<(), Error> {
        let mut needed = Parts::VERTEX_INPUT_INTERFACE | Parts::PRE_RASTERIZATION_SHADERS;
        if !self.discards() {
            needed |= Parts::FRAGMENT_SHADER | Parts::FRAGMENT_OUTPUT_INTERFACE;
        }
        let missing = needed & !self.parts;
        if missing.is_empty() {
            return Ok(());
        }
        Err(Error::usage(
            "GAURAST-pipeline-incomplete",
            format!(
                "the pipeline is no library, and neither it nor a library that it links has these parts: {}",
                names(missing)
            ),
        ))
    }

    /// The shader stages.
    pub(crate) fn stages(&self) -> impl Iterator<Item = &(vk::ShaderStageFlags, ShaderStage)> {
        let (before, fragment) = (&self.pre_rasterization.stages, &self.fragment_shader.stages);
        before.iter().chain(fragment)
    }

    /// The shader stages, to be changed.
    pub(super) fn stages_mut(&mut self) -> impl Iterator<Item = &mut (vk::ShaderStageFlags, ShaderStage)> {
        let before = self.pre_rasterization.stages.iter_mut();
        before.chain(&mut self.fragment_shader.stages)
    }

    /// Depth and stencil state, if the subpass has such an attachment.
    pub(crate) fn depth_stencil(&self) -> Option<&vk::PipelineDepthStencilStateCreateInfo<'static>> {
        let state = self.fragment_shader.depth_stencil.as_ref();
        state.filter(|_| self.fragment_output.has_depth || self.fragment_output.has_stencil)
    }

    /// Reports whether there are tessellation stages.
    pub(crate) fn tessellates(&self) -> bool {
        let both = vk::ShaderStageFlags::TESSELLATION_CONTROL | vk::ShaderStageFlags::TESSELLATION_EVALUATION;
        self.stages().any(|(stage, _)| both.contains(*stage))
    }

    /// Reports whether a state is dynamic.
    pub(crate) fn is_dynamic(&self, state: vk::DynamicState) -> bool {
        self.dynamic.contains(&state)
    }

    /// Reports whether nothing is ever rasterized, so that all rasterization state is ignored.
    pub(crate) fn discards(&self) -> bool {
        self.pre_rasterization.rasterization.rasterizer_discard_enable != vk::FALSE
            && !self.is_dynamic(vk::DynamicState::RASTERIZER_DISCARD_ENABLE)
    }

    /// Reports whether all state of single colour attachments is dynamic, so that the pipeline has none of it.
    pub(super) fn has_dynamic_blending(&self) -> bool {
        use vk::DynamicState as S;
        [S::COLOR_BLEND_ENABLE_EXT, S::COLOR_BLEND_EQUATION_EXT, S::COLOR_WRITE_MASK_EXT]
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
        if !self.vertex_input.primitive_restart || !is_list || self.is_dynamic(vk::DynamicState::PRIMITIVE_TOPOLOGY) {
            return Ok(());
        }
        Err(Error::usage(
            "VUID-VkPipelineInputAssemblyStateCreateInfo-topology-06252",
            format!("primitiveRestartEnable is VK_TRUE, but {topology:?} has no restart"),
        ))
    }

    /// The line width. It is often left at zero in pipelines that draw no lines.
    pub(super) fn line_width(&self) -> f32 {
        let width = self.pre_rasterization.rasterization.line_width;
        if width == 0.0 || self.is_dynamic(vk::DynamicState::LINE_WIDTH) {
            return 1.0;
        }
        width
    }
}
