//! Draws of points, lines and triangles as packets, and what draws of every kind have in common: bound buffers, indirect
//! parameters, and state that is missing.

use super::descriptors::{self, DescriptorSetNotBound};
use super::state::State;
use crate::command::DrawParameters;
use crate::pipeline::GraphicsPipeline;
use crate::pipeline::primitives::{PrimitivePipeline, ViewportSource};
use crate::pipeline::stages;
use crate::pipeline::state::AttributeSource;
use ash::vk;
use gaurast_spirv::ScalarType;
use simdevice::Packet;
use simdevice::packet::{AttributeStream, BufferRange, IndexStream};
use simdevice::state::DrawState;
use simdevice::state::gaussian::CameraModel;
use std::sync::Arc;

/// The reason that a draw draws nothing: state that it needs is undefined.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum DrawError {
    /// No pipeline.
    #[error("no graphics pipeline is bound")]
    Pipeline,
    /// No camera.
    #[error("no camera is set: vkCmdSetGaussianCamerasGAURAST must be recorded before the draw")]
    Camera,
    /// No camera of a view.
    #[error(
        "there are {cameras} cameras, and view {view} would have number {view}: there must be one for all views, or more \
         than the greatest view index (VUID-vkCmdDraw-cameraCount-90063)"
    )]
    CameraOfView {
        /// The view index.
        view: u32,
        /// Cameras.
        cameras: usize,
    },
    /// A camera of a model that is not enabled.
    #[error(
        "the camera's model is {0:?}, and its feature is not enabled (VUID-VkGaussianCameraGAURAST-model-90079)"
    )]
    CameraModel(CameraModel),
    /// A camera of a model that Gaussians of the pipeline's modes cannot be seen by.
    #[error(
        "the pipeline's geometry and precision do not go with a camera whose model is {0:?} \
         (VUID-vkCmdDraw-geometry-90071)"
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
    /// Another pipeline than that of the set's first draw.
    #[error(
        "its pipeline is not that of the first draw of the set that vkCmdBeginGaussianSetGAURAST has begun \
         (VUID-vkCmdDraw-None-90005)"
    )]
    OtherPipelineInSet,
    /// Other state than that of the set's first draw.
    #[error(
        "cameras, viewport, scissor or dynamic state are not those of the first draw of the set that \
         vkCmdBeginGaussianSetGAURAST has begun (VUID-vkCmdDraw-None-90006)"
    )]
    OtherStateInSet,
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
    /// Dynamic state whose values a pipeline could not have.
    #[error(
        "a dynamic state was set to what the pipeline may not have: {0} (VUID-vkCmdDraw-dynamic-90060)"
    )]
    DynamicValue(String),
    /// No buffer of spherical harmonics.
    #[error(
        "no buffer of spherical harmonics is bound, which the pipeline's flags ask for \
         (VUID-vkCmdDraw-sphericalHarmonicsBuffer-90018)"
    )]
    Harmonics,
    /// Vertex input that the vertex program cannot read.
    #[error("vertex input: {0}")]
    VertexInput(String),
    /// No vertex buffer.
    #[error("no vertex buffer is bound at binding {0}")]
    VertexBuffer(u32),
    /// No index buffer.
    #[error("no index buffer is bound")]
    IndexBuffer,
    /// Something that the pipeline reads is not bound.
    #[error(transparent)]
    DescriptorSetNotBound(#[from] DescriptorSetNotBound),
}

/// The stream that an attribute is read from.
///
/// # Errors
/// [`DrawError::VertexBuffer`].
pub(super) fn attribute_stream(
    state: &State,
    pipeline: &GraphicsPipeline,
    source: &AttributeSource,
) -> Result<AttributeStream, DrawError> {
    let bound = state
        .vertex_buffer(source.binding)
        .ok_or(DrawError::VertexBuffer(source.binding))?;
    let dynamic_stride = bound.stride.filter(|_| pipeline.dynamic_stride);
    Ok(AttributeStream {
        buffer: bound.range.clone(),
        stride: dynamic_stride.unwrap_or(source.stride),
        offset: source.offset,
        format: source.format,
        instance_divisor: source.instance_divisor,
    })
}

/// The sources of attributes that the command buffer has set.
///
/// # Errors
/// [`DrawError::Dynamic`] if it has set none, [`DrawError::VertexInput`] for those that are not as the program reads them.
fn dynamic_sources(
    state: &State,
    locations: &[(u32, ScalarType)],
) -> Result<Vec<AttributeSource>, DrawError> {
    let missing = DrawError::Dynamic(vk::DynamicState::VERTEX_INPUT_EXT);
    let input = state.vertex_input.as_ref().ok_or(missing)?;
    stages::attributes(&input.state(), locations)
        .map_err(|error| DrawError::VertexInput(error.to_string()))
}

/// The stream that an indexed draw's indices are read from.
///
/// # Errors
/// [`DrawError::IndexBuffer`].
pub(super) fn indices(
    state: &State,
    draw: &DrawParameters,
) -> Result<Option<IndexStream>, DrawError> {
    let Some(vertex_offset) = draw.vertex_offset else {
        return Ok(None);
    };
    let bound = state.index_buffer.as_ref().ok_or(DrawError::IndexBuffer)?;
    Ok(Some(IndexStream {
        buffer: bound.range.clone(),
        index_size: bound.index_size,
        vertex_offset,
    }))
}

/// The packet of one draw.
///
/// # Errors
/// [`DrawError`] where bound state that the draw needs is missing.
pub(super) fn primitives(
    state: &mut State,
    pipeline: &GraphicsPipeline,
    primitives: &PrimitivePipeline,
    parameters: &DrawParameters,
    draw_index: u32,
) -> Result<Packet, DrawError> {
    let dynamic_sources = match &primitives.dynamic_locations {
        Some(locations) => Some(dynamic_sources(state, locations)?),
        None => None,
    };
    let attributes = dynamic_sources
        .as_ref()
        .unwrap_or(&primitives.attributes)
        .iter()
        .map(|source| attribute_stream(state, pipeline, source));
    let bindings =
        |resources| descriptors::bindings(resources, &state.graphics_sets, &state.push_constants);
    Ok(Packet::Draw(Box::new(simdevice::packet::Draw {
        pipeline: Arc::clone(&primitives.programs),
        attributes: attributes.collect::<Result<_, _>>()?,
        vertex_bindings: bindings(&primitives.vertex_resources)?,
        fragment_bindings: bindings(&primitives.fragment_resources)?,
        indices: indices(state, parameters)?,
        first: parameters.first,
        count: parameters.count,
        first_instance: parameters.first_instance,
        instance_count: parameters.instance_count,
        draw_index,
        state: draw_state(state, primitives)?,
    })))
}

/// The fixed-function state, which is made anew only when something of it has changed since the last draw.
fn draw_state(
    state: &mut State,
    primitives: &PrimitivePipeline,
) -> Result<Arc<DrawState>, DrawError> {
    if let Some(fixed) = primitives.state.as_ref().or(state.draw_state.as_ref()) {
        return Ok(Arc::clone(fixed));
    }
    let mut fixed = primitives.fixed.clone();
    state
        .dynamic_states
        .apply(&primitives.dynamic, &mut fixed)
        .map_err(DrawError::Dynamic)?;
    if !fixed.draw.rasterizer_discard {
        if let Some(count) = dynamic_count(primitives.viewports, state.viewport_count) {
            fixed.draw.viewports = set(&state.viewports, count).ok_or(DrawError::Viewport)?;
        }
        if let Some(count) = dynamic_count(primitives.scissors, state.scissor_count) {
            fixed.draw.scissors = set(&state.scissors, count).ok_or(DrawError::Scissor)?;
        }
        let (viewports, scissors) = (fixed.draw.viewports.len(), fixed.draw.scissors.len());
        if viewports != scissors {
            return Err(DrawError::ScissorCount {
                viewports,
                scissors,
            });
        }
    }
    let converted = Arc::new(fixed.draw_state());
    state.draw_state = Some(Arc::clone(&converted));
    Ok(converted)
}

/// The number of viewports or scissors that the command buffer sets; `None` if the pipeline has them.
fn dynamic_count(origin: ViewportSource, set: Option<u32>) -> Option<u32> {
    match origin {
        ViewportSource::Static => None,
        ViewportSource::Dynamic(count) => Some(count),
        ViewportSource::DynamicWithCount => Some(set.unwrap_or(0)),
    }
}

/// The first `count` of what is set, if there are any and all are there.
fn set<T: Copy>(slots: &[Option<T>], count: u32) -> Option<Vec<T>> {
    slots
        .get(..count as usize)
        .filter(|slots| !slots.is_empty())?
        .iter()
        .copied()
        .collect()
}

/// Reads how many draws there are.
pub(super) fn read_count(range: &BufferRange) -> Option<u32> {
    let mut count = [0];
    range.memory.read(range.offset, &mut count).ok()?;
    Some(count[0])
}

/// Reads `VkDrawIndirectCommand` or `VkDrawIndexedIndirectCommand`.
pub(super) fn read_draw(
    parameters: &BufferRange,
    offset: u64,
    indexed: bool,
) -> Option<DrawParameters> {
    let mut words = [0u32; 5];
    let words = &mut words[..if indexed { 5 } else { 4 }];
    if offset.checked_add(size_of_val(words) as u64)? > parameters.size {
        return None;
    }
    let offset = parameters.offset.checked_add(offset)?;
    parameters.memory.read(offset, words).ok()?;
    Some(match *words {
        [count, instance_count, first, vertex_offset, first_instance] => DrawParameters {
            vertex_offset: Some(vertex_offset as i32),
            first,
            count,
            first_instance,
            instance_count,
        },
        [count, instance_count, first, first_instance] => DrawParameters {
            vertex_offset: None,
            first,
            count,
            first_instance,
            instance_count,
        },
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn viewports_are_there_when_all_are_set() {
        assert_eq!(set(&[Some(1), Some(2), None], 2), Some(vec![1, 2]));
        assert_eq!(set(&[Some(1), None], 2), None);
        assert_eq!(set(&[Some(1)], 2), None);
        assert_eq!(set::<u8>(&[], 0), None);
    }
}
