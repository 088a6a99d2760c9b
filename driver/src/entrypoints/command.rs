//! Commands that bind state, draw and synchronise.

use crate::capabilities::limits;
use crate::command::record::{Command, Draw, DrawIndirect, IndexBuffer, VertexBuffer};
use crate::command::recorder::Recorder;
use crate::error::Error;
use crate::lower::{camera, rendering};
use crate::object::buffer::Buffer;
use crate::object::event::Event;
use crate::object::pipeline::{self, Pipeline};
use crate::{handle, pointer};
use ash::vk;
use gaurast::vk::GaussianCameraGAURAST;
use simdevice::Packet;
use std::sync::Arc;

/// Records into a command buffer; see [`CommandBuffer::record`](crate::object::command_buffer::CommandBuffer::record).
///
/// # Safety
/// The handle is live.
pub(crate) unsafe fn record(
    command_buffer: vk::CommandBuffer,
    record: impl FnOnce(&mut Recorder) -> Result<(), Error>,
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    unsafe { handle::get(command_buffer)? }.record(record)
}

crate::entry_points! {
    #[doc(alias = "vkCmdExecuteCommands")]
    fn cmd_execute_commands(
        command_buffer: vk::CommandBuffer,
        command_buffer_count: u32,
        command_buffers: *const vk::CommandBuffer,
    ) {
        if handle::get(command_buffer)?.is_secondary() {
            return Err(Error::usage(
                "VUID-vkCmdExecuteCommands-bufferlevel",
                "a secondary command buffer executes others",
            ));
        }
        record(command_buffer, |recorder| {
            let secondaries = pointer::slice(command_buffers, command_buffer_count)?;
            let mut contents = simdevice::host::with_capacity(secondaries.len());
            for &secondary in secondaries {
                let secondary = handle::get(secondary)?;
                if !secondary.is_secondary() {
                    return Err(Error::usage(
                        "VUID-vkCmdExecuteCommands-pCommandBuffers-00088",
                        "a primary command buffer is executed from another",
                    ));
                }
                contents.push(secondary.recorder().contents()?);
            }
            recorder.push(Command::Execute(contents));
            Ok(())
        })
    }
}

#[doc(alias = "vkCmdBindPipeline")]
pub(crate) fn cmd_bind_pipeline(
    recorder: &mut Recorder,
    pipeline_bind_point: vk::PipelineBindPoint,
    pipeline: &Pipeline,
) -> Result<(), Error> {
    let command = match (pipeline, pipeline_bind_point) {
        (Pipeline::Graphics(pipeline), vk::PipelineBindPoint::GRAPHICS) => {
            Command::BindPipeline(Arc::clone(pipeline))
        }
        (Pipeline::Compute(pipeline), vk::PipelineBindPoint::COMPUTE) => {
            Command::BindComputePipeline(Arc::clone(pipeline))
        }
        (_, other) => {
            return Err(Error::usage(
                "VUID-vkCmdBindPipeline-pipelineBindPoint-00779",
                format!("a pipeline is bound at {other:?}, which is not its bind point"),
            ));
        }
    };
    recorder.push(command);
    Ok(())
}

#[doc(alias = "vkCmdSetGaussianCameraGAURAST")]
pub(crate) fn cmd_set_gaussian_camera_gaurast(
    recorder: &mut Recorder,
    camera: &GaussianCameraGAURAST<'_>,
) -> Result<(), Error> {
    let camera = camera::camera(camera)?;
    recorder.push(Command::SetCamera(Box::new(camera)));
    Ok(())
}

#[doc(alias = "vkCmdBindVertexBuffers")]
pub(crate) fn cmd_bind_vertex_buffers(
    recorder: &mut Recorder,
    first_binding: u32,
    buffers: &[Arc<Buffer>],
    offsets: &[vk::DeviceSize],
) -> Result<(), Error> {
    bind_vertex_buffers(recorder, first_binding, buffers, offsets, &[], &[])
}

#[doc(alias = "vkCmdBindVertexBuffers2")]
pub(crate) fn cmd_bind_vertex_buffers2(
    recorder: &mut Recorder,
    first_binding: u32,
    buffers: &[Arc<Buffer>],
    offsets: &[vk::DeviceSize],
    sizes: Option<&[vk::DeviceSize]>,
    strides: Option<&[vk::DeviceSize]>,
) -> Result<(), Error> {
    let (sizes, strides) = (sizes.unwrap_or_default(), strides.unwrap_or_default());
    bind_vertex_buffers(recorder, first_binding, buffers, offsets, sizes, strides)
}

#[doc(alias = "vkCmdBindIndexBuffer")]
pub(crate) fn cmd_bind_index_buffer(
    recorder: &mut Recorder,
    buffer: &Arc<Buffer>,
    offset: vk::DeviceSize,
    index_type: vk::IndexType,
) -> Result<(), Error> {
    let index_size = match index_type {
        vk::IndexType::UINT8_KHR => 1,
        vk::IndexType::UINT16 => 2,
        vk::IndexType::UINT32 => 4,
        other => {
            return Err(Error::FeatureNotPresent(format!("index type {other:?}")));
        }
    };
    let range = buffer.range(offset, None)?;
    recorder.push(Command::BindIndexBuffer(IndexBuffer { range, index_size }));
    Ok(())
}

#[doc(alias = "vkCmdSetViewport")]
pub(crate) fn cmd_set_viewport(
    recorder: &mut Recorder,
    first_viewport: u32,
    viewports: &[vk::Viewport],
) -> Result<(), Error> {
    set_viewports(recorder, first_viewport, viewports, false)
}

#[doc(alias = "vkCmdSetViewportWithCount")]
pub(crate) fn cmd_set_viewport_with_count(
    recorder: &mut Recorder,
    viewports: &[vk::Viewport],
) -> Result<(), Error> {
    set_viewports(recorder, 0, viewports, true)
}

#[doc(alias = "vkCmdSetScissor")]
pub(crate) fn cmd_set_scissor(
    recorder: &mut Recorder,
    first_scissor: u32,
    scissors: &[vk::Rect2D],
) -> Result<(), Error> {
    set_scissors(recorder, first_scissor, scissors, false)
}

#[doc(alias = "vkCmdSetScissorWithCount")]
pub(crate) fn cmd_set_scissor_with_count(
    recorder: &mut Recorder,
    scissors: &[vk::Rect2D],
) -> Result<(), Error> {
    set_scissors(recorder, 0, scissors, true)
}

#[doc(alias = "vkCmdDraw")]
pub(crate) fn cmd_draw(
    recorder: &mut Recorder,
    vertex_count: u32,
    instance_count: u32,
    first_vertex: u32,
    first_instance: u32,
) -> Result<(), Error> {
    recorder.require_pass()?;
    recorder.push(Command::Draw(Draw {
        vertex_offset: None,
        first: first_vertex,
        count: vertex_count,
        first_instance,
        instance_count,
    }));
    Ok(())
}

#[doc(alias = "vkCmdDrawIndexed")]
pub(crate) fn cmd_draw_indexed(
    recorder: &mut Recorder,
    index_count: u32,
    instance_count: u32,
    first_index: u32,
    vertex_offset: i32,
    first_instance: u32,
) -> Result<(), Error> {
    recorder.require_pass()?;
    recorder.push(Command::Draw(Draw {
        vertex_offset: Some(vertex_offset),
        first: first_index,
        count: index_count,
        first_instance,
        instance_count,
    }));
    Ok(())
}

#[doc(alias = "vkCmdDrawIndirect")]
pub(crate) fn cmd_draw_indirect(
    recorder: &mut Recorder,
    buffer: &Buffer,
    offset: vk::DeviceSize,
    draw_count: u32,
    stride: u32,
) -> Result<(), Error> {
    let parameters = (buffer, offset);
    draw_indirect(recorder, parameters, None, draw_count, stride, false)
}

#[doc(alias = "vkCmdDrawIndexedIndirect")]
pub(crate) fn cmd_draw_indexed_indirect(
    recorder: &mut Recorder,
    buffer: &Buffer,
    offset: vk::DeviceSize,
    draw_count: u32,
    stride: u32,
) -> Result<(), Error> {
    let parameters = (buffer, offset);
    draw_indirect(recorder, parameters, None, draw_count, stride, true)
}

#[doc(alias = "vkCmdDrawIndirectCount")]
pub(crate) fn cmd_draw_indirect_count(
    recorder: &mut Recorder,
    buffer: &Buffer,
    offset: vk::DeviceSize,
    count_buffer: &Buffer,
    count_buffer_offset: vk::DeviceSize,
    max_draw_count: u32,
    stride: u32,
) -> Result<(), Error> {
    let parameters = (buffer, offset);
    draw_indirect(
        recorder,
        parameters,
        Some((count_buffer, count_buffer_offset)),
        max_draw_count,
        stride,
        false,
    )
}

#[doc(alias = "vkCmdDrawIndexedIndirectCount")]
pub(crate) fn cmd_draw_indexed_indirect_count(
    recorder: &mut Recorder,
    buffer: &Buffer,
    offset: vk::DeviceSize,
    count_buffer: &Buffer,
    count_buffer_offset: vk::DeviceSize,
    max_draw_count: u32,
    stride: u32,
) -> Result<(), Error> {
    let parameters = (buffer, offset);
    draw_indirect(
        recorder,
        parameters,
        Some((count_buffer, count_buffer_offset)),
        max_draw_count,
        stride,
        true,
    )
}

/// A barrier makes everything before it visible to everything after it, whatever it names.
#[doc(alias = "vkCmdPipelineBarrier")]
#[doc(alias = "vkCmdPipelineBarrier2")]
pub(crate) fn cmd_pipeline_barrier(recorder: &mut Recorder) -> Result<(), Error> {
    recorder.packet(Packet::Barrier);
    Ok(())
}

#[doc(alias = "vkCmdSetEvent")]
#[doc(alias = "vkCmdSetEvent2")]
pub(crate) fn cmd_set_event(recorder: &mut Recorder, event: &Arc<Event>) -> Result<(), Error> {
    set_event(recorder, event, true)
}

#[doc(alias = "vkCmdResetEvent")]
#[doc(alias = "vkCmdResetEvent2")]
pub(crate) fn cmd_reset_event(recorder: &mut Recorder, event: &Arc<Event>) -> Result<(), Error> {
    set_event(recorder, event, false)
}

#[doc(alias = "vkCmdWaitEvents")]
#[doc(alias = "vkCmdWaitEvents2")]
pub(crate) fn cmd_wait_events(recorder: &mut Recorder, events: &[Arc<Event>]) -> Result<(), Error> {
    recorder.push(Command::WaitEvents(events.to_vec()));
    recorder.packet(Packet::Barrier);
    Ok(())
}

/// Records vertex buffers; `sizes` and `strides` are empty or have one for each.
fn bind_vertex_buffers(
    recorder: &mut Recorder,
    first: u32,
    buffers: &[Arc<Buffer>],
    offsets: &[vk::DeviceSize],
    sizes: &[vk::DeviceSize],
    strides: &[vk::DeviceSize],
) -> Result<(), Error> {
    let bindings = limits::properties().max_vertex_input_bindings;
    if u64::from(first) + buffers.len() as u64 > u64::from(bindings) {
        return Err(Error::usage(
            "VUID-vkCmdBindVertexBuffers-firstBinding-00625",
            format!("there are {bindings} vertex input bindings"),
        ));
    }
    let mut bound = simdevice::host::with_capacity(buffers.len());
    for (index, (buffer, &offset)) in buffers.iter().zip(offsets).enumerate() {
        let size = sizes.get(index).copied().unwrap_or(vk::WHOLE_SIZE);
        bound.push(VertexBuffer {
            range: buffer.range(offset, (size != vk::WHOLE_SIZE).then_some(size))?,
            stride: strides.get(index).map(|&stride| stride as u32),
        });
    }
    recorder.push(Command::BindVertexBuffers {
        first,
        buffers: bound,
    });
    Ok(())
}

/// Fails for viewports and scissors beyond those that the device has.
fn require_viewports(first: u32, count: u32) -> Result<(), Error> {
    let available = limits::properties().max_viewports;
    if u64::from(first) + u64::from(count) <= u64::from(available) {
        return Ok(());
    }
    Err(Error::usage(
        "VUID-vkCmdSetViewport-firstViewport-01223",
        format!("there are {available} viewports"),
    ))
}

/// Records viewports.
fn set_viewports(
    recorder: &mut Recorder,
    first: u32,
    viewports: &[vk::Viewport],
    with_count: bool,
) -> Result<(), Error> {
    require_viewports(first, viewports.len() as u32)?;
    recorder.push(Command::SetViewports {
        first,
        viewports: viewports.iter().copied().map(pipeline::viewport).collect(),
        with_count,
    });
    Ok(())
}

/// Records scissors.
fn set_scissors(
    recorder: &mut Recorder,
    first: u32,
    scissors: &[vk::Rect2D],
    with_count: bool,
) -> Result<(), Error> {
    require_viewports(first, scissors.len() as u32)?;
    recorder.push(Command::SetScissors {
        first,
        scissors: scissors.iter().copied().map(rendering::rect).collect(),
        with_count,
    });
    Ok(())
}

/// A buffer and an offset in it.
type Place<'a> = (&'a Buffer, vk::DeviceSize);

/// Records draws whose numbers lie in a buffer.
fn draw_indirect(
    recorder: &mut Recorder,
    (buffer, offset): Place<'_>,
    count: Option<Place<'_>>,
    draw_count: u32,
    stride: u32,
    indexed: bool,
) -> Result<(), Error> {
    recorder.require_pass()?;
    let parameters = buffer.range(offset, None)?;
    let count = match count {
        Some((buffer, offset)) => Some(buffer.range(offset, Some(4))?),
        None => None,
    };
    recorder.push(Command::DrawIndirect(DrawIndirect {
        parameters,
        draw_count,
        count,
        stride,
        indexed,
    }));
    Ok(())
}

/// Records the setting or resetting of an event.
fn set_event(recorder: &mut Recorder, event: &Arc<Event>, value: bool) -> Result<(), Error> {
    recorder.require_outside_pass()?;
    recorder.push(Command::SetEvent(Arc::clone(event), value));
    Ok(())
}
