//! Conversion of draws of points, lines and triangles to packets, and parts that draws of every kind share: bound
//! buffers, indirect parameters, and missing state.

use super::descriptors::{self, DescriptorSetNotBound};
use super::state::State;
use crate::command::{DrawParameters, IndexBuffer};
use crate::options;
use crate::physical_device::limits::MAX_GAUSSIANS;
use crate::pipeline::GraphicsPipeline;
use crate::pipeline::primitives::{PrimitivePipeline, ViewportSource};
use crate::pipeline::stages;
use crate::pipeline::state::AttributeSource;
use ash::vk;
use gaurast_spirv::ScalarType;
use simdevice::BufferRange;
use simdevice::Packet;
use simdevice::packet::{AttributeStream, IndexStream, PrimitiveBindings};
use simdevice::state::DrawState;
use simdevice::state::gaussian::CameraModel;
use std::sync::Arc;

/// The reason that a draw draws nothing: state that it needs is undefined.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum DrawError {
    /// No pipeline is bound.
    #[error("no graphics pipeline is bound")]
    Pipeline,
    /// No camera is set.
    #[error("no camera is set: vkCmdSetGaussianCamerasGAURAST must be recorded before the draw")]
    Camera,
    /// A view has no camera.
    #[error(
        "there are {cameras} cameras, and view {view} would have number {view}: there must be one for all views, or more \
         than the greatest view index (VUID-vkCmdDraw-cameraCount-90063)"
    )]
    CameraOfView {
        /// The view index.
        view: u32,
        /// The number of cameras.
        cameras: usize,
    },
    /// The camera's model is not enabled.
    #[error("{0}")]
    CameraModel(String),
    /// The camera's model doesn't support the pipeline's modes.
    #[error(
        "the pipeline's geometry and precision do not go with a camera whose model is {0:?} \
         (VUID-vkCmdDraw-geometry-90071)"
    )]
    ModeOfCameraModel(CameraModel),
    /// The pipeline's modes don't support a camera whose lens distorts.
    #[error(
        "the pipeline's geometry and order do not go with a camera whose lens distorts (VUID-vkCmdDraw-None-90089)"
    )]
    ModeOfDistortion,
    /// No uniform buffer is bound for the camera.
    #[error("no uniform buffer is bound at set {set}, binding {binding}, where the camera should be")]
    CameraBuffer {
        /// The descriptor set.
        set: u32,
        /// The binding.
        binding: u32,
    },
    /// The uniform buffer holds no valid camera.
    #[error("the camera's uniform buffer: {0}")]
    CameraData(String),
    /// The pipeline is not that of the set's first draw.
    #[error(
        "its pipeline is not that of the first draw of the set that vkCmdBeginGaussianSetGAURAST has begun \
         (VUID-vkCmdDraw-None-90005)"
    )]
    OtherPipelineInSet,
    /// Other state is not that of the set's first draw.
    #[error(
        "cameras, viewport, scissor or dynamic state are not those of the first draw of the set that \
         vkCmdBeginGaussianSetGAURAST has begun (VUID-vkCmdDraw-None-90006)"
    )]
    OtherStateInSet,
    /// No viewport is set.
    #[error("the pipeline's viewport is dynamic and none is set")]
    Viewport,
    /// No scissor is set.
    #[error("the pipeline's scissor is dynamic and none is set")]
    Scissor,
    /// The numbers of viewports and scissors differ.
    #[error("{viewports} viewports and {scissors} scissors are set")]
    ScissorCount {
        /// The number of viewports.
        viewports: usize,
        /// The number of scissors.
        scissors: usize,
    },
    /// A dynamic state is not set.
    #[error("the pipeline's {0:?} is dynamic and was not set")]
    Dynamic(vk::DynamicState),
    /// A dynamic state has a value that a pipeline could not have.
    #[error("a dynamic state was set to what the pipeline may not have: {0} (VUID-vkCmdDraw-dynamic-90060)")]
    DynamicValue(String),
    /// There are more Gaussians than a draw may have.
    #[error(
        "it has {0} Gaussians, but must have at most maxGaussiansPerDraw ({most}) \
         (VUID-vkCmdDraw-maxGaussiansPerDraw-90083)",
        most = MAX_GAUSSIANS
    )]
    TooManyGaussians(u64),
    /// No buffer of spherical harmonics is bound.
    #[error(
        "no buffer of spherical harmonics is bound, which the pipeline's flags ask for \
         (VUID-vkCmdDraw-sphericalHarmonicsBuffer-90018)"
    )]
    Harmonics,
    /// No tables of decodings are bound.
    #[error(
        "no tables are bound by which the pipeline's attributes are decoded \
         (VUID-vkCmdDraw-attributeDecoding-90101)"
    )]
    DecodingTables,
    /// A chunk of Gaussians has none.
    #[error("chunkSize is 0 in the table of an attribute (VUID-vkCmdDraw-attributeDecoding-90101)")]
    ChunkSize,
    /// The vertex input doesn't fit the vertex program.
    #[error("vertex input: {0}")]
    VertexInput(String),
    /// A vertex buffer is not bound.
    #[error("no vertex buffer is bound at binding {0}")]
    VertexBuffer(u32),
    /// No index buffer is bound.
    #[error("no index buffer is bound")]
    IndexBuffer,
    /// A descriptor set that the pipeline reads is not bound.
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
    let bound = state.vertex_buffer(source.binding).ok_or(DrawError::VertexBuffer(source.binding))?;
    let dynamic_stride = bound.stride.filter(|_| pipeline.dynamic_stride);
    Ok(AttributeStream {
        buffer: bound.range.clone(),
        stride: dynamic_stride.unwrap_or(source.stride),
        offset: source.offset,
        format: source.format,
        instance_divisor: source.instance_divisor,
    })
}

/// The sources of attributes, from the command buffer's dynamic vertex input.
///
/// # Errors
/// [`DrawError::Dynamic`] if none is set, [`DrawError::VertexInput`] for sources that don't fit the program.
fn dynamic_sources(state: &State, locations: &[(u32, ScalarType)]) -> Result<Vec<AttributeSource>, DrawError> {
    let missing = DrawError::Dynamic(vk::DynamicState::VERTEX_INPUT_EXT);
    let input = state.vertex_input.as_ref().ok_or(missing)?;
    stages::attributes(input, locations).map_err(|error| DrawError::VertexInput(error.to_string()))
}

/// The stream that an indexed draw's indices are read from.
///
/// # Errors
/// [`DrawError::IndexBuffer`].
pub(super) fn indices(state: &State, draw: &DrawParameters) -> Result<Option<IndexStream>, DrawError> {
    let Some(vertex_offset) = draw.vertex_offset else {
        return Ok(None);
    };
    let bound = state.index_buffer.as_ref().ok_or(DrawError::IndexBuffer)?;
    let IndexBuffer { range, index_size, restart } = bound;
    Ok(Some(IndexStream { buffer: range.clone(), index_size: *index_size, vertex_offset, restart: *restart }))
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
    let bindings = |resources| descriptors::bindings(resources, &state.graphics_sets, &state.push_constants);
    Ok(Packet::Draw(Box::new(simdevice::packet::Draw {
        pipeline: Arc::clone(&primitives.programs),
        attributes: attributes.collect::<Result<_, _>>()?,
        vertex_bindings: bindings(&primitives.vertex_resources)?,
        primitive_bindings: PrimitiveBindings {
            control: bindings(&primitives.control_resources)?,
            evaluation: bindings(&primitives.evaluation_resources)?,
            geometry: bindings(&primitives.geometry_resources)?,
        },
        fragment_bindings: bindings(&primitives.fragment_resources)?,
        indices: indices(state, parameters)?,
        first: parameters.first,
        count: parameters.count,
        first_instance: parameters.first_instance,
        instance_count: parameters.instance_count,
        draw_index,
        transform_feedback: state.transform_feedback.clone(),
        state: draw_state(state, primitives)?,
    })))
}

/// The fixed-function state. It is computed again only if something in it has changed since the last draw.
fn draw_state(state: &mut State, primitives: &PrimitivePipeline) -> Result<Arc<DrawState>, DrawError> {
    if let Some(fixed) = primitives.state.as_ref().or(state.draw_state.as_ref()) {
        return Ok(Arc::clone(fixed));
    }
    let mut fixed = primitives.fixed.clone();
    if let Err(unset) = state.dynamic_states.apply(&primitives.dynamic, &mut fixed) {
        if options::is_strict().unwrap_or(false) {
            return Err(DrawError::Dynamic(unset));
        }
        state.unset_dynamic = Some(unset);
    }
    if !fixed.draw.rasterizer_discard {
        if let Some(count) = dynamic_count(primitives.viewports, state.viewport_count) {
            fixed.draw.viewports = set(&state.viewports, count).ok_or(DrawError::Viewport)?;
        }
        if let Some(count) = dynamic_count(primitives.scissors, state.scissor_count) {
            fixed.draw.scissors = set(&state.scissors, count).ok_or(DrawError::Scissor)?;
        }
        let (viewports, scissors) = (fixed.draw.viewports.len(), fixed.draw.scissors.len());
        if viewports != scissors {
            return Err(DrawError::ScissorCount { viewports, scissors });
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

/// The first `count` values; None if there are none or one of them is not set.
fn set<T: Copy>(slots: &[Option<T>], count: u32) -> Option<Vec<T>> {
    slots.get(..count as usize).filter(|slots| !slots.is_empty())?.iter().copied().collect()
}

/// Reads the number of draws.
pub(super) fn read_count(range: &BufferRange) -> Option<u32> {
    let mut count = [0];
    range.memory.read(range.offset, &mut count).ok()?;
    Some(count[0])
}

/// Reads `VkDrawIndirectCommand` or `VkDrawIndexedIndirectCommand`.
pub(super) fn read_draw(parameters: &BufferRange, offset: u64, indexed: bool) -> Option<DrawParameters> {
    let mut words = [0u32; 5];
    let words = &mut words[..if indexed { 5 } else { 4 }];
    if offset.checked_add(size_of_val(words) as u64)? > parameters.size {
        return None;
    }
    let offset = parameters.offset.checked_add(offset)?;
    parameters.memory.read(offset, words).ok()?;
    Some(match *words {
        [count, instance_count, first, vertex_offset, first_instance] => {
            DrawParameters { vertex_offset: Some(vertex_offset as i32), first, count, first_instance, instance_count }
        }
        [count, instance_count, first, first_instance] => {
            DrawParameters { vertex_offset: None, first, count, first_instance, instance_count }
        }
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
