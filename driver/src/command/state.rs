//! The state that a command buffer's draws read, as the commands replayed so far have left it.

use super::bound::{BindPoint, BoundSets};
use super::record::{IndexBuffer, VertexBuffer};
use crate::object::pipeline::compute::ComputePipeline;
use crate::object::pipeline::setting::Settings;
use crate::object::pipeline::{GaussianPipeline, GaussianSource, GraphicsPipeline, Primitive};
use simdevice::state::gaussian::Camera;
use simdevice::state::{DrawState, Rect, Viewport};
use std::sync::Arc;

/// Bound state. All of it is undefined when a command buffer begins; here "undefined" is `None`.
#[derive(Clone, Debug, Default)]
pub(crate) struct State {
    /// The graphics pipeline.
    pub(crate) pipeline: Option<Arc<GraphicsPipeline>>,
    /// The compute pipeline.
    pub(crate) compute_pipeline: Option<Arc<ComputePipeline>>,
    /// The descriptor sets of draws.
    pub(crate) graphics_sets: BoundSets,
    /// The descriptor sets of dispatches.
    pub(crate) compute_sets: BoundSets,
    /// Push constants, as far as any were pushed.
    pub(crate) push_constants: Vec<u8>,
    /// The vertex buffers by binding.
    pub(crate) vertex_buffers: Vec<Option<VertexBuffer>>,
    /// The index buffer.
    pub(crate) index_buffer: Option<IndexBuffer>,
    /// Dynamic viewports.
    pub(crate) viewports: Vec<Option<Viewport>>,
    /// Dynamic scissors.
    pub(crate) scissors: Vec<Option<Rect>>,
    /// How many viewports were set with their count.
    pub(crate) viewport_count: Option<u32>,
    /// How many scissors were set with their count.
    pub(crate) scissor_count: Option<u32>,
    /// All other dynamic state.
    pub(crate) settings: Settings,
    /// The fixed-function state that the last draw made of all this, unless something has changed since.
    pub(crate) draw_state: Option<Arc<DrawState>>,
    /// The camera of Gaussian draws; kept when another pipeline is bound.
    pub(crate) camera: Option<Camera>,
    /// Whether draws are being merged into a sorted set that has begun.
    pub(crate) set_is_open: bool,
}

impl State {
    /// The viewport in effect: the pipeline's, or the dynamic one.
    pub(crate) fn viewport(&self, pipeline: &GaussianPipeline) -> Option<Viewport> {
        pipeline
            .viewport
            .or_else(|| self.viewports.first().copied().flatten())
    }

    /// The scissor in effect: the pipeline's, or the dynamic one.
    pub(crate) fn scissor(&self, pipeline: &GaussianPipeline) -> Option<Rect> {
        pipeline
            .scissor
            .or_else(|| self.scissors.first().copied().flatten())
    }

    /// Whether the pipeline's Gaussians are projected by a vertex shader.
    pub(crate) fn shades_gaussians(&self) -> bool {
        let primitive = self.pipeline.as_ref().map(|pipeline| &pipeline.primitive);
        matches!(primitive, Some(Primitive::Gaussian(gaussian))
            if matches!(gaussian.source, GaussianSource::VertexShader(_)))
    }

    /// The descriptor sets of a bind point.
    pub(crate) fn sets_mut(&mut self, bind_point: BindPoint) -> &mut BoundSets {
        match bind_point {
            BindPoint::Graphics => &mut self.graphics_sets,
            BindPoint::Compute => &mut self.compute_sets,
        }
    }

    /// Replaces push constants from byte `offset` on.
    pub(crate) fn push_constants(&mut self, offset: u32, bytes: &[u8]) {
        let range = offset as usize..offset as usize + bytes.len();
        if self.push_constants.len() < range.end {
            self.push_constants.resize(range.end, 0);
        }
        self.push_constants[range].copy_from_slice(bytes);
    }

    /// The vertex buffer bound at `binding`.
    pub(crate) fn vertex_buffer(&self, binding: u32) -> Option<&VertexBuffer> {
        self.vertex_buffers.get(binding as usize)?.as_ref()
    }
}

/// Replaces the elements of `slots` from `first` on by `values`, growing it as needed.
pub(crate) fn bind<T: Clone>(slots: &mut Vec<Option<T>>, first: u32, values: &[T]) {
    let first = first as usize;
    let end = first + values.len();
    if slots.len() < end {
        slots.resize(end, None);
    }
    for (slot, value) in slots[first..end].iter_mut().zip(values) {
        *slot = Some(value.clone());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn binding_replaces_a_range_and_leaves_the_rest() {
        let mut slots = Vec::new();
        bind(&mut slots, 2, &[5, 6]);
        bind(&mut slots, 1, &[7]);
        bind(&mut slots, 2, &[8]);
        assert_eq!(slots, [None, Some(7), Some(8), Some(6)]);
    }
}
