//! Transform feedback: the buffers to which vertices are written before rasterization.

use super::buffer::Recorder;
use super::{Command, DrawByteCount};
use crate::abi::error::Error;
use crate::abi::handle::Handles;
use crate::physical_device::limits;
use crate::query_pool::{QueryPool, require_queries};
use crate::resource::buffer::{Buffer, BufferRules};
use ash::vk;
use simdevice::limits::MAX_TRANSFORM_FEEDBACK_BUFFERS;
use simdevice::transform_feedback::CounterBuffers;
use std::sync::Arc;

/// The rules on the buffers that are written.
const CAPTURED: BufferRules = BufferRules {
    memory: "VUID-vkCmdBindTransformFeedbackBuffersEXT-pBuffers-02364",
    range: "VUID-vkCmdBindTransformFeedbackBuffersEXT-pOffsets-02363",
};

/// The rules on the counter of `vkCmdDrawIndirectByteCountEXT`.
const DRAWN_COUNTER: BufferRules = BufferRules {
    memory: "VUID-vkCmdDrawIndirectByteCountEXT-counterBuffer-04567",
    range: "VUID-vkCmdDrawIndirectByteCountEXT-counterBufferOffset-04568",
};

/// The rules of a command on the counters of buffers.
struct CounterRules {
    /// Transform feedback must be active, or must not be.
    state: &'static str,
    counters: BufferRules,
    count: &'static str,
    alignment: &'static str,
}

const BEGIN_COUNTERS: CounterRules = CounterRules {
    state: "VUID-vkCmdBeginTransformFeedbackEXT-None-02367",
    counters: BufferRules {
        memory: "VUID-vkCmdBeginTransformFeedbackEXT-pCounterBuffers-02372",
        range: "VUID-vkCmdBeginTransformFeedbackEXT-pCounterBufferOffsets-02370",
    },
    count: "VUID-vkCmdBeginTransformFeedbackEXT-firstCounterBuffer-02369",
    alignment: "VUID-vkCmdBeginTransformFeedbackEXT-pCounterBufferOffsets-02370",
};

const END_COUNTERS: CounterRules = CounterRules {
    state: "VUID-vkCmdEndTransformFeedbackEXT-None-02375",
    counters: BufferRules {
        memory: "VUID-vkCmdEndTransformFeedbackEXT-pCounterBuffers-02380",
        range: "VUID-vkCmdEndTransformFeedbackEXT-pCounterBufferOffsets-02378",
    },
    count: "VUID-vkCmdEndTransformFeedbackEXT-firstCounterBuffer-02377",
    alignment: "VUID-vkCmdEndTransformFeedbackEXT-pCounterBufferOffsets-02378",
};

/// Fails if transform feedback is active or not, as it should not be.
fn require_active(recorder: &Recorder, is_active: bool, vuid: &'static str) -> Result<(), Error> {
    if recorder.captures == is_active {
        return Ok(());
    }
    Err(Error::usage(
        vuid,
        match is_active {
            true => "transform feedback is not active",
            false => "transform feedback is active",
        },
    ))
}

/// Fails unless buffers `first..first + count` exist.
fn require_bindings(first: u32, count: usize, vuid: &'static str) -> Result<(), Error> {
    if first as usize + count <= MAX_TRANSFORM_FEEDBACK_BUFFERS {
        return Ok(());
    }
    Err(Error::usage(vuid, format!("there are {MAX_TRANSFORM_FEEDBACK_BUFFERS} buffers of transform feedback")))
}

#[doc(alias = "vkCmdBindTransformFeedbackBuffersEXT")]
pub(crate) fn cmd_bind_transform_feedback_buffers(
    recorder: &mut Recorder,
    first_binding: u32,
    buffers: &[Arc<Buffer>],
    offsets: &[vk::DeviceSize],
    sizes: Option<&[vk::DeviceSize]>,
) -> Result<(), Error> {
    require_active(recorder, false, "VUID-vkCmdBindTransformFeedbackBuffersEXT-None-02365")?;
    require_bindings(first_binding, buffers.len(), "VUID-vkCmdBindTransformFeedbackBuffersEXT-firstBinding-02357")?;
    for (number, (buffer, &offset)) in buffers.iter().zip(offsets).enumerate() {
        if !offset.is_multiple_of(4) {
            return Err(Error::usage(
                "VUID-vkCmdBindTransformFeedbackBuffersEXT-pOffsets-02359",
                format!("the offset {offset} is not a multiple of 4"),
            ));
        }
        let size = sizes.map_or(vk::WHOLE_SIZE, |sizes| sizes[number]);
        let size = (size != vk::WHOLE_SIZE).then_some(size);
        recorder.push(Command::BindTransformFeedbackBuffer {
            binding: first_binding + number as u32,
            buffer: buffer.range(offset, size, &CAPTURED)?,
        });
    }
    Ok(())
}

/// Makes transform feedback active or ends it. Returns its counter buffers.
fn set_active(
    recorder: &mut Recorder,
    is_active: bool,
    first: u32,
    buffers: Option<Handles<'_, vk::Buffer>>,
    offsets: Option<&[vk::DeviceSize]>,
    rules: &CounterRules,
) -> Result<Box<CounterBuffers>, Error> {
    recorder.require_pass()?;
    require_active(recorder, !is_active, rules.state)?;
    recorder.captures = is_active;
    let mut counters = Box::<CounterBuffers>::default();
    let Some(buffers) = buffers else {
        return Ok(counters);
    };
    require_bindings(first, buffers.len(), rules.count)?;
    for (number, buffer) in buffers.objects().enumerate() {
        let offset = offsets.map_or(0, |offsets| offsets[number]);
        if let Some(buffer) = buffer? {
            if !offset.is_multiple_of(4) {
                return Err(Error::usage(rules.alignment, format!("the offset {offset} is not a multiple of 4")));
            }
            counters[first as usize + number] = Some(buffer.range(offset, Some(4), &rules.counters)?);
        }
    }
    Ok(counters)
}

#[doc(alias = "vkCmdBeginTransformFeedbackEXT")]
pub(crate) fn cmd_begin_transform_feedback(
    recorder: &mut Recorder,
    first_counter_buffer: u32,
    counter_buffers: Option<Handles<'_, vk::Buffer>>,
    counter_buffer_offsets: Option<&[vk::DeviceSize]>,
) -> Result<(), Error> {
    let (first, buffers, offsets) = (first_counter_buffer, counter_buffers, counter_buffer_offsets);
    let counters = set_active(recorder, true, first, buffers, offsets, &BEGIN_COUNTERS)?;
    recorder.push(Command::BeginTransformFeedback(counters));
    Ok(())
}

#[doc(alias = "vkCmdEndTransformFeedbackEXT")]
pub(crate) fn cmd_end_transform_feedback(
    recorder: &mut Recorder,
    first_counter_buffer: u32,
    counter_buffers: Option<Handles<'_, vk::Buffer>>,
    counter_buffer_offsets: Option<&[vk::DeviceSize]>,
) -> Result<(), Error> {
    let (first, buffers, offsets) = (first_counter_buffer, counter_buffers, counter_buffer_offsets);
    let counters = set_active(recorder, false, first, buffers, offsets, &END_COUNTERS)?;
    recorder.push(Command::EndTransformFeedback(counters));
    Ok(())
}

#[doc(alias = "vkCmdDrawIndirectByteCountEXT")]
pub(crate) fn cmd_draw_indirect_byte_count(
    recorder: &mut Recorder,
    instance_count: u32,
    first_instance: u32,
    counter_buffer: &Arc<Buffer>,
    counter_buffer_offset: vk::DeviceSize,
    counter_offset: u32,
    vertex_stride: u32,
) -> Result<(), Error> {
    recorder.require_pass()?;
    let most = limits::properties().max_transform_feedback_buffer_data_stride;
    if vertex_stride == 0 || vertex_stride > most {
        return Err(Error::usage(
            "VUID-vkCmdDrawIndirectByteCountEXT-vertexStride-02289",
            format!("the stride is {vertex_stride}, not 1 to {most}"),
        ));
    }
    if !counter_buffer_offset.is_multiple_of(4) {
        return Err(Error::usage(
            "VUID-vkCmdDrawIndirectByteCountEXT-counterBufferOffset-04568",
            format!("the offset {counter_buffer_offset} is not a multiple of 4"),
        ));
    }
    recorder.push(Command::DrawByteCount(DrawByteCount {
        counter: counter_buffer.range(counter_buffer_offset, Some(4), &DRAWN_COUNTER)?,
        counter_offset,
        vertex_stride,
        first_instance,
        instance_count,
    }));
    Ok(())
}

#[doc(alias = "vkCmdBeginQueryIndexedEXT")]
pub(crate) fn cmd_begin_query_indexed(
    recorder: &mut Recorder,
    query_pool: &Arc<QueryPool>,
    query: u32,
    index: u32,
) -> Result<(), Error> {
    require_queries(query_pool, query, 1, "VUID-vkCmdBeginQueryIndexedEXT-query-00802")?;
    super::query::begin_query(recorder, query_pool, query, index)
}

#[doc(alias = "vkCmdEndQueryIndexedEXT")]
pub(crate) fn cmd_end_query_indexed(
    recorder: &mut Recorder,
    query_pool: &Arc<QueryPool>,
    query: u32,
) -> Result<(), Error> {
    super::query::cmd_end_query(recorder, query_pool, query)
}
