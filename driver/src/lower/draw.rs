//! What draws of every kind have in common: bound buffers, and state that is missing.

use super::bindings::Unbound;
use crate::command::record::Draw;
use crate::command::state::State;
use crate::object::pipeline::{AttributeSource, GraphicsPipeline};
use ash::vk;
use simdevice::packet::{AttributeStream, IndexStream};
use simdevice::state::gaussian::CameraModel;

/// Why a draw draws nothing: state that it needs is undefined.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Undrawn {
    /// No pipeline.
    #[error("no graphics pipeline is bound")]
    Pipeline,
    /// No camera.
    #[error("no camera is set: vkCmdSetGaussianCameraGAURAST must be recorded before the draw")]
    Camera,
    /// A camera of a model that is not enabled.
    #[error(
        "the camera's model is {0:?}, and its feature is not enabled (VUID-VkGaussianCameraGAURAST-model-parameter)"
    )]
    CameraModel(CameraModel),
    /// A camera of a model that Gaussians of the pipeline's modes cannot be seen by.
    #[error(
        "the pipeline's geometry and precision do not go with a camera whose model is {0:?} \
         (VUID-vkCmdDraw-geometry-GAURAST)"
    )]
    ModeOfCameraModel(CameraModel),
    /// No uniform buffer where the camera should be.
    #[error(
        "no uniform buffer is bound at set {set}, binding {binding}, where the camera should be"
    )]
    CameraBuffer {
        /// The descriptor set.
        set: u32,
        /// The binding.
        binding: u32,
    },
    /// A uniform buffer that holds no camera.
    #[error("the camera's uniform buffer: {0}")]
    CameraData(String),
    /// No viewport.
    #[error("the pipeline's viewport is dynamic and none is set")]
    Viewport,
    /// No scissor.
    #[error("the pipeline's scissor is dynamic and none is set")]
    Scissor,
    /// Not as many scissors as viewports.
    #[error("{viewports} viewports and {scissors} scissors are set")]
    ScissorCount {
        /// Viewports.
        viewports: usize,
        /// Scissors.
        scissors: usize,
    },
    /// Dynamic state that is not set.
    #[error("the pipeline's {0:?} is dynamic and was not set")]
    Dynamic(vk::DynamicState),
    /// No vertex buffer.
    #[error("no vertex buffer is bound at binding {0}")]
    VertexBuffer(u32),
    /// No index buffer.
    #[error("no index buffer is bound")]
    IndexBuffer,
    /// Something that the pipeline reads is not bound.
    #[error(transparent)]
    Unbound(#[from] Unbound),
}

/// Where an attribute is read from.
///
/// # Errors
/// [`Undrawn::VertexBuffer`].
pub(super) fn attribute_stream(
    state: &State,
    pipeline: &GraphicsPipeline,
    source: &AttributeSource,
) -> Result<AttributeStream, Undrawn> {
    let bound = state
        .vertex_buffer(source.binding)
        .ok_or(Undrawn::VertexBuffer(source.binding))?;
    let dynamic_stride = bound.stride.filter(|_| pipeline.dynamic_stride);
    Ok(AttributeStream {
        buffer: bound.range.clone(),
        stride: dynamic_stride.unwrap_or(source.stride),
        offset: source.offset,
        format: source.format,
        instance_divisor: source.instance_divisor,
    })
}

/// Where an indexed draw's indices are read from.
///
/// # Errors
/// [`Undrawn::IndexBuffer`].
pub(super) fn indices(state: &State, draw: &Draw) -> Result<Option<IndexStream>, Undrawn> {
    let Some(vertex_offset) = draw.vertex_offset else {
        return Ok(None);
    };
    let bound = state.index_buffer.as_ref().ok_or(Undrawn::IndexBuffer)?;
    Ok(Some(IndexStream {
        buffer: bound.range.clone(),
        index_size: bound.index_size,
        vertex_offset,
    }))
}
