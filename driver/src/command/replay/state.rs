//! The state that draws of a command buffer read, as set by the commands replayed so far.

use crate::abi::error::Error;
use crate::command::{BindPoint, BoundSet, DecodingTables, HarmonicsBuffer, IndexBuffer, VertexBuffer};
use crate::descriptor::layout::DescriptorSetLayout;
use crate::descriptor::set::{DescriptorSet, Write};
use crate::pipeline::GraphicsPipeline;
use crate::pipeline::compute::ComputePipeline;
use crate::pipeline::dynamic_state::DynamicStates;
use crate::pipeline::gaussian::GaussianPipeline;
use crate::pipeline::parts::VertexInput;
use ash::vk;
use simdevice::packet::GaussianBegin;
use simdevice::state::gaussian::Camera;
use simdevice::state::{DrawState, Rect, Viewport};
use simdevice::transform_feedback::{CounterBuffers, TransformFeedback};
use std::sync::Arc;

/// Bound state. All of it is undefined, which is `None`, when a command buffer begins.
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
    /// Push constants, up to the last byte that was pushed.
    pub(crate) push_constants: Vec<u8>,
    /// The vertex buffers by binding.
    pub(crate) vertex_buffers: Vec<Option<VertexBuffer>>,
    /// Vertex bindings and attributes, if they are dynamic.
    pub(crate) vertex_input: Option<Arc<VertexInput>>,
    /// The index buffer.
    pub(crate) index_buffer: Option<IndexBuffer>,
    /// Dynamic viewports.
    pub(crate) viewports: Vec<Option<Viewport>>,
    /// Dynamic scissors.
    pub(crate) scissors: Vec<Option<Rect>>,
    /// The number of viewports, if they were set with their count.
    pub(crate) viewport_count: Option<u32>,
    /// The number of scissors, if they were set with their count.
    pub(crate) scissor_count: Option<u32>,
    /// All other dynamic state.
    pub(crate) dynamic_states: DynamicStates,
    /// The fixed-function state of the last draw, unless something in it has changed since.
    pub(crate) draw_state: Option<Arc<DrawState>>,
    /// A dynamic state of the pipeline that was not set for the current draw.
    pub(crate) unset_dynamic: Option<vk::DynamicState>,
    /// The cameras of Gaussian draws, one for all views or one for each, if they were set. Binding another pipeline
    /// keeps them.
    pub(crate) cameras: Box<[Camera]>,
    /// The buffer of spherical harmonics.
    pub(crate) harmonics: Option<HarmonicsBuffer>,
    /// The tables by which attributes are decoded.
    pub(crate) decoding_tables: Option<Box<DecodingTables>>,
    /// The buffers that transform feedback writes.
    pub(crate) captured_buffers: CounterBuffers,
    /// Transform feedback, while it is active.
    pub(crate) transform_feedback: Option<Arc<TransformFeedback>>,
    /// True where draws, dispatches and clears of attachments are not executed.
    pub(crate) discards: bool,
    /// The sorted set that draws share, if one was begun.
    pub(crate) gaussian_set: Option<SharedSet>,
}

/// A sorted set that draws share.
#[derive(Clone, Debug, Default)]
pub(crate) struct SharedSet {
    /// The pipeline and the state of its first draw; `None` before that.
    pub(crate) first: Option<(Arc<GraphicsPipeline>, Box<GaussianBegin>)>,
}

impl State {
    /// The viewport in effect: the pipeline's, or the dynamic one.
    pub(crate) fn viewport(&self, pipeline: &GaussianPipeline) -> Option<Viewport> {
        pipeline.viewport.or_else(|| self.viewports.first().copied().flatten())
    }

    /// The scissor in effect: the pipeline's, or the dynamic one.
    pub(crate) fn scissor(&self, pipeline: &GaussianPipeline) -> Option<Rect> {
        pipeline.scissor.or_else(|| self.scissors.first().copied().flatten())
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

    /// Sets vertex bindings and attributes, whose strides replace those set before.
    pub(crate) fn set_vertex_input(&mut self, input: &Arc<VertexInput>) {
        self.vertex_input = Some(Arc::clone(input));
        for bound in self.vertex_buffers.iter_mut().flatten() {
            bound.stride = None;
        }
    }

    /// The vertex buffer bound at `binding`.
    pub(crate) fn vertex_buffer(&self, binding: u32) -> Option<&VertexBuffer> {
        self.vertex_buffers.get(binding as usize)?.as_ref()
    }
}

/// The element of `slots` at `index`, which grow as needed.
pub(crate) fn slot<T>(slots: &mut Vec<Option<T>>, index: u32) -> &mut Option<T> {
    let index = index as usize;
    if slots.len() <= index {
        slots.resize_with(index + 1, || None);
    }
    &mut slots[index]
}

/// The sets of a bind point, by number.
#[derive(Clone, Debug, Default)]
pub(crate) struct BoundSets(Vec<Option<BoundSet>>);

impl BoundSets {
    /// Binds sets from number `first` on.
    pub(crate) fn bind(&mut self, first: u32, sets: &[Option<BoundSet>]) {
        for (number, set) in (first..).zip(sets) {
            slot(&mut self.0, number).clone_from(set);
        }
    }

    /// Updates descriptors of the pushed set `number`. Descriptors pushed before stay, if the layout is the same.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] if the layout does not have what is written.
    pub(crate) fn push(
        &mut self,
        number: u32,
        layout: &Arc<DescriptorSetLayout>,
        writes: &[Write],
    ) -> Result<(), Error> {
        let same = |bound: &&BoundSet| bound.set.layout().is_push() && Arc::ptr_eq(bound.set.layout(), layout);
        let set = match self.get(number).filter(same) {
            Some(bound) => Arc::clone(&bound.set),
            None => {
                let set = Arc::new(DescriptorSet::new(Arc::clone(layout), 0)?);
                let bound = BoundSet { set: Arc::clone(&set), dynamic_offsets: Vec::new() };
                self.bind(number, &[Some(bound)]);
                set
            }
        };
        writes.iter().try_for_each(|write| set.write(write))
    }

    /// Set `number`.
    pub(crate) fn get(&self, number: u32) -> Option<&BoundSet> {
        self.0.get(number as usize)?.as_ref()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slot_is_replaced_and_the_others_stay() {
        let mut slots = Vec::new();
        for (index, value) in [(2, 5), (3, 6), (1, 7), (2, 8)] {
            *slot(&mut slots, index) = Some(value);
        }
        assert_eq!(slots, [None, Some(7), Some(8), Some(6)]);
    }
}
