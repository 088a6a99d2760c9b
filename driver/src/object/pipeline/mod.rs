//! Pipelines: what draws and dispatches need of their create infos, converted and validated once.
//!
//! The entry points gather the create infos' pointers into a [`GraphicsPipelineInfo`] or a
//! [`StageInfo`](compute::StageInfo); everything here is safe.

mod blend;
pub(crate) mod compute;
pub(crate) mod convert;
pub(crate) mod fixed;
pub(crate) mod gaussian;
pub(crate) mod gaussian_stages;
pub(crate) mod layout;
mod link;
pub(crate) mod polygon;
mod reflect;
pub(crate) mod setting;
mod vertex_input;

use crate::error::Error;
use crate::lower::camera::CameraModels;
use crate::object::device::Device;
use ash::vk;
use compute::{ComputePipeline, StageInfo};
use fixed::FixedState;
use gaurast::vk::{
    PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST, PipelineGaussianApproximationStateCreateInfoGAURAST,
    PipelineGaussianStateCreateInfoGAURAST,
};
use gaussian_stages::{ResolveStage, VertexProjection};
use layout::PipelineLayout;
use polygon::PolygonPipeline;
use simdevice::state::gaussian::GaussianState;
use simdevice::state::{Rect, Viewport};
use std::sync::Arc;
pub(crate) use vertex_input::AttributeSource;

/// What a `VkPipeline` is.
#[derive(Debug)]
pub(crate) enum Pipeline {
    /// For draws.
    Graphics(Arc<GraphicsPipeline>),
    /// For dispatches.
    Compute(Arc<ComputePipeline>),
}

/// A graphics pipeline.
#[derive(Debug)]
pub(crate) struct GraphicsPipeline {
    /// What it draws.
    pub(crate) primitive: Primitive,
    /// Whether vertex strides come from `vkCmdBindVertexBuffers2`.
    pub(crate) dynamic_stride: bool,
}

/// What a pipeline draws.
#[derive(Debug)]
pub(crate) enum Primitive {
    /// Gaussians.
    Gaussian(Box<GaussianPipeline>),
    /// Points, lines or triangles.
    Polygons(Box<PolygonPipeline>),
}

/// The Gaussian part of a pipeline.
#[derive(Debug)]
pub(crate) struct GaussianPipeline {
    /// What the device needs to know; what is dynamic of it is filled in for each draw.
    pub(crate) state: Arc<GaussianState>,
    /// What becomes of fragments, as far as it is static.
    pub(crate) fixed: FixedState,
    /// What the command buffer sets of that.
    pub(crate) dynamic: Vec<vk::DynamicState>,
    /// The viewport, unless it is dynamic.
    pub(crate) viewport: Option<Viewport>,
    /// The scissor, unless it is dynamic.
    pub(crate) scissor: Option<Rect>,
    /// Where draws take their camera from.
    pub(crate) camera: CameraSource,
    /// The models that the camera may have.
    pub(crate) camera_models: CameraModels,
    /// Whether consecutive draws are sorted together.
    pub(crate) merges_draws: bool,
    /// Where Gaussians come from.
    pub(crate) source: GaussianSource,
    /// What makes colours of what they accumulate.
    pub(crate) resolve: Option<ResolveStage>,
}

/// Where the Gaussians of a pipeline come from.
#[derive(Debug)]
pub(crate) enum GaussianSource {
    /// Vertex attributes, which the device projects.
    Attributes(GaussianAttributeSources),
    /// A vertex shader, which projects them itself.
    VertexShader(VertexProjection),
}

/// The attributes of fixed-function projection.
#[derive(Debug)]
pub(crate) struct GaussianAttributeSources {
    /// Where means are read from.
    pub(crate) position: AttributeSource,
    /// Where standard deviations are read from.
    pub(crate) scale: AttributeSource,
    /// Where quaternions are read from.
    pub(crate) rotation: AttributeSource,
    /// Where opacities are read from.
    pub(crate) opacity: AttributeSource,
    /// Where the spherical harmonics' coefficients are read from.
    pub(crate) spherical_harmonics: Vec<AttributeSource>,
    /// Where the rows of model matrices are read from, if there are any.
    pub(crate) model_matrix: Option<[AttributeSource; 3]>,
    /// Where factors of the opacity are read from, if there are any.
    pub(crate) model_opacity: Option<AttributeSource>,
}

/// Where Gaussian draws take their camera from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CameraSource {
    /// There is none: a vertex shader projects.
    None,
    /// `vkCmdSetGaussianCameraGAURAST`.
    Command,
    /// A uniform buffer, read when the draw executes.
    UniformBuffer {
        /// The descriptor set.
        set: u32,
        /// The binding, whose first descriptor it is.
        binding: u32,
    },
}

/// A `VkGraphicsPipelineCreateInfo` with its pointers followed. State that the application may leave out is
/// empty, `None` or the default.
#[derive(Default)]
pub(crate) struct GraphicsPipelineInfo<'a> {
    /// The shader stages.
    pub(crate) stages: Vec<(vk::ShaderStageFlags, StageInfo<'a>)>,
    /// The layout.
    pub(crate) layout: Option<&'a Arc<PipelineLayout>>,
    /// Vertex bindings.
    pub(crate) bindings: &'a [vk::VertexInputBindingDescription],
    /// How many instances an element lasts, of bindings that advance by instance and where that isn't one.
    pub(crate) divisors: &'a [vk::VertexInputBindingDivisorDescriptionKHR],
    /// Vertex attributes.
    pub(crate) attributes: &'a [vk::VertexInputAttributeDescription],
    /// The topology.
    pub(crate) topology: vk::PrimitiveTopology,
    /// Whether an index restarts the primitive.
    pub(crate) primitive_restart: bool,
    /// How many viewports; one each is given unless they are dynamic.
    pub(crate) viewport_count: u32,
    /// Viewports, unless dynamic.
    pub(crate) viewports: &'a [vk::Viewport],
    /// How many scissors.
    pub(crate) scissor_count: u32,
    /// Scissors, unless dynamic.
    pub(crate) scissors: &'a [vk::Rect2D],
    /// Rasterization state.
    pub(crate) rasterization: vk::PipelineRasterizationStateCreateInfo<'a>,
    /// Whether a primitive's last vertex, not its first, is the provoking one.
    pub(crate) provoking_last: bool,
    /// Multisample state.
    pub(crate) multisample: vk::PipelineMultisampleStateCreateInfo<'a>,
    /// The samples that may be covered.
    pub(crate) sample_mask: u32,
    /// Depth and stencil state, if the subpass has such an attachment.
    pub(crate) depth_stencil: Option<vk::PipelineDepthStencilStateCreateInfo<'a>>,
    /// The logic operation, if it is enabled.
    pub(crate) logic_op: Option<vk::LogicOp>,
    /// Blend state by colour attachment.
    pub(crate) blend: &'a [vk::PipelineColorBlendAttachmentState],
    /// Blend constants.
    pub(crate) blend_constants: [f32; 4],
    /// What is dynamic.
    pub(crate) dynamic: &'a [vk::DynamicState],
    /// The colour formats of the subpass; undefined where the attachment is unused.
    pub(crate) color_formats: Vec<vk::Format>,
    /// The extension's structure.
    pub(crate) gaussian: Option<PipelineGaussianStateCreateInfoGAURAST<'a>>,
    /// The extension's structure of approximations.
    pub(crate) approximation: Option<PipelineGaussianApproximationStateCreateInfoGAURAST<'a>>,
}

crate::objects! { vk::Pipeline => Pipeline; }

impl GraphicsPipelineInfo<'_> {
    /// Whether a state is dynamic.
    pub(crate) fn is_dynamic(&self, state: vk::DynamicState) -> bool {
        self.dynamic.contains(&state)
    }

    /// Whether nothing is ever rasterized, so that all state of rasterization is left out.
    pub(crate) fn discards(&self) -> bool {
        self.rasterization.rasterizer_discard_enable != vk::FALSE
            && !self.is_dynamic(vk::DynamicState::RASTERIZER_DISCARD_ENABLE)
    }

    /// The width of lines. Pipelines that draw none often leave it at zero.
    fn line_width(&self) -> f32 {
        let width = self.rasterization.line_width;
        if width == 0.0 || self.is_dynamic(vk::DynamicState::LINE_WIDTH) {
            return 1.0;
        }
        width
    }
}

impl GraphicsPipeline {
    /// Creates a pipeline.
    ///
    /// # Errors
    /// An [`Error`] that names the valid usage broken, or the feature that the device lacks.
    pub(crate) fn new(device: &Device, info: &GraphicsPipelineInfo) -> Result<Self, Error> {
        let primitive = if info.topology == PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST {
            let gaussian = GaussianPipeline::new(device, info)?;
            Primitive::Gaussian(Box::new(gaussian))
        } else {
            Primitive::Polygons(Box::new(PolygonPipeline::new(device, info)?))
        };
        Ok(Self {
            primitive,
            dynamic_stride: info.is_dynamic(vk::DynamicState::VERTEX_INPUT_BINDING_STRIDE),
        })
    }
}

/// A pipeline cache. Pipelines are cheap to make, so it stays empty.
#[derive(Debug)]
pub(crate) struct PipelineCache;

crate::objects! {
    vk::PipelineCache => PipelineCache;
}

/// A viewport for the device.
pub(crate) fn viewport(viewport: vk::Viewport) -> Viewport {
    Viewport {
        x: viewport.x,
        y: viewport.y,
        width: viewport.width,
        height: viewport.height,
        min_depth: viewport.min_depth,
        max_depth: viewport.max_depth,
    }
}
