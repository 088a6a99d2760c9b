//! Pipelines: what draws and dispatches need of their create infos, converted and validated once.
//!
//! The entry points gather the create infos' pointers into a [`GraphicsPipelineInfo`] or a
//! [`StageInfo`](compute::StageInfo); everything here is safe.

mod blend;
pub(crate) mod compute;
mod gaussian;
pub(crate) mod layout;
mod vertex_input;

use crate::capabilities::features::EnabledFeatures;
use crate::error::Error;
use crate::lower::rendering;
use ash::vk;
use compute::ComputePipeline;
use gaurast::vk::{
    PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST, PipelineGaussianStateCreateInfoGAURAST,
};
use simdevice::packet::{GaussianState, Rect, Viewport};
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
    /// The viewport, unless it is dynamic.
    pub(crate) viewport: Option<Viewport>,
    /// The scissor, unless it is dynamic.
    pub(crate) scissor: Option<Rect>,
    /// Whether the blend constants are dynamic.
    pub(crate) dynamic_blend_constants: bool,
    /// Whether vertex strides come from `vkCmdBindVertexBuffers2`.
    pub(crate) dynamic_stride: bool,
}

/// What a pipeline draws. Triangles are not drawn yet, so there is one kind so far.
#[derive(Debug)]
pub(crate) enum Primitive {
    /// Gaussians with fixed-function projection.
    Gaussian(Box<GaussianPipeline>),
}

/// The Gaussian part of a pipeline.
#[derive(Debug)]
pub(crate) struct GaussianPipeline {
    /// What the device needs to know.
    pub(crate) state: Arc<GaussianState>,
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
}

/// A `VkGraphicsPipelineCreateInfo` with its pointers followed. State that the application may leave out is
/// empty, `None` or the default.
#[derive(Debug, Default)]
pub(crate) struct GraphicsPipelineInfo<'a> {
    /// The shader stages.
    pub(crate) stages: &'a [vk::PipelineShaderStageCreateInfo<'a>],
    /// Vertex bindings.
    pub(crate) bindings: &'a [vk::VertexInputBindingDescription],
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
    /// Scissors, unless dynamic.
    pub(crate) scissors: &'a [vk::Rect2D],
    /// Rasterization state.
    pub(crate) rasterization: vk::PipelineRasterizationStateCreateInfo<'a>,
    /// Samples per pixel.
    pub(crate) samples: vk::SampleCountFlags,
    /// Depth and stencil state.
    pub(crate) depth_stencil: vk::PipelineDepthStencilStateCreateInfo<'a>,
    /// Whether the logic operation is enabled.
    pub(crate) logic_op: bool,
    /// Blend state by colour attachment.
    pub(crate) blend: &'a [vk::PipelineColorBlendAttachmentState],
    /// Blend constants.
    pub(crate) blend_constants: [f32; 4],
    /// What is dynamic.
    pub(crate) dynamic: &'a [vk::DynamicState],
    /// The colour formats of the subpass; undefined where the attachment is unused.
    pub(crate) color_formats: Vec<vk::Format>,
    /// Whether alpha makes coverage, or becomes one.
    pub(crate) alpha_to: bool,
    /// The extension's structure.
    pub(crate) gaussian: Option<PipelineGaussianStateCreateInfoGAURAST<'a>>,
}

crate::objects! { vk::Pipeline => Pipeline; }

impl GraphicsPipeline {
    /// Creates a pipeline.
    ///
    /// # Errors
    /// An [`Error`] that names the valid usage broken, or the feature that the device lacks.
    pub(crate) fn new(
        info: &GraphicsPipelineInfo,
        features: &EnabledFeatures,
    ) -> Result<Self, Error> {
        let is_dynamic = |state| info.dynamic.contains(&state);
        let primitive = match info.topology {
            PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST => {
                let gaussian = GaussianPipeline::new(info, features)?;
                Primitive::Gaussian(Box::new(gaussian))
            }
            topology => {
                return Err(Error::FeatureNotPresent(format!(
                    "a pipeline of topology {topology:?} (only the Gaussian list is drawn so far)"
                )));
            }
        };
        Ok(Self {
            primitive,
            viewport: fixed(
                "viewport",
                is_dynamic(vk::DynamicState::VIEWPORT)
                    || is_dynamic(vk::DynamicState::VIEWPORT_WITH_COUNT),
                info.viewports,
            )?
            .map(viewport),
            scissor: fixed(
                "scissor",
                is_dynamic(vk::DynamicState::SCISSOR)
                    || is_dynamic(vk::DynamicState::SCISSOR_WITH_COUNT),
                info.scissors,
            )?
            .map(rendering::rect),
            dynamic_blend_constants: is_dynamic(vk::DynamicState::BLEND_CONSTANTS),
            dynamic_stride: is_dynamic(vk::DynamicState::VERTEX_INPUT_BINDING_STRIDE),
        })
    }
}

/// The state's first element, unless it is dynamic.
fn fixed<T: Copy>(name: &str, dynamic: bool, values: &[T]) -> Result<Option<T>, Error> {
    match (dynamic, values.first()) {
        (true, _) => Ok(None),
        (false, Some(&value)) => Ok(Some(value)),
        (false, None) => Err(Error::usage(
            "VUID-VkGraphicsPipelineCreateInfo-pDynamicStates-04130",
            format!("the pipeline has no {name}, and its {name} is not dynamic"),
        )),
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
