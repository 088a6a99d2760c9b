//! Commands that bind state, draw and synchronise.

use crate::capabilities::limits;
use crate::command::record::{Command, Draw, DrawIndirect, IndexBuffer, VertexBuffer};
use crate::command::recorder::Recorder;
use crate::error::Error;
use crate::lower::camera::camera;
use crate::lower::rendering;
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
    #[doc(alias = "vkCmdBindPipeline")]
    fn cmd_bind_pipeline(
        command_buffer: vk::CommandBuffer,
        pipeline_bind_point: vk::PipelineBindPoint,
        pipeline: vk::Pipeline,
    ) {
        record(command_buffer, |recorder| {
            let command = match (&**handle::get(pipeline)?, pipeline_bind_point) {
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
        })
    }

    #[doc(alias = "vkCmdSetGaussianCameraGAURAST")]
    fn cmd_set_gaussian_camera_gaurast(
        command_buffer: vk::CommandBuffer,
        p_camera: *const GaussianCameraGAURAST<'_>,
    ) {
        record(command_buffer, |recorder| {
            let camera = camera(pointer::input(p_camera)?)?;
            recorder.push(Command::SetCamera(Box::new(camera)));
            Ok(())
        })
    }

    #[doc(alias = "vkCmdBindVertexBuffers")]
    fn cmd_bind_vertex_buffers(
        command_buffer: vk::CommandBuffer,
        first_binding: u32,
        binding_count: u32,
        buffers: *const vk::Buffer,
        offsets: *const vk::DeviceSize,
    ) {
        record(command_buffer, |recorder| {
            let buffers = pointer::slice(buffers, binding_count)?;
            let offsets = pointer::slice(offsets, binding_count)?;
            bind_vertex_buffers(recorder, first_binding, buffers, offsets, &[], &[])
        })
    }

    #[doc(alias = "vkCmdBindVertexBuffers2")]
    fn cmd_bind_vertex_buffers2(
        command_buffer: vk::CommandBuffer,
        first_binding: u32,
        binding_count: u32,
        buffers: *const vk::Buffer,
        offsets: *const vk::DeviceSize,
        sizes: *const vk::DeviceSize,
        strides: *const vk::DeviceSize,
    ) {
        record(command_buffer, |recorder| {
            let optional = |values: *const vk::DeviceSize| {
                pointer::slice(values, if values.is_null() { 0 } else { binding_count })
            };
            let buffers = pointer::slice(buffers, binding_count)?;
            let offsets = pointer::slice(offsets, binding_count)?;
            let (sizes, strides) = (optional(sizes)?, optional(strides)?);
            bind_vertex_buffers(recorder, first_binding, buffers, offsets, sizes, strides)
        })
    }

    #[doc(alias = "vkCmdBindIndexBuffer")]
    fn cmd_bind_index_buffer(
        command_buffer: vk::CommandBuffer,
        buffer: vk::Buffer,
        offset: vk::DeviceSize,
        index_type: vk::IndexType,
    ) {
        record(command_buffer, |recorder| {
            let index_size = match index_type {
                vk::IndexType::UINT8_KHR => 1,
                vk::IndexType::UINT16 => 2,
                vk::IndexType::UINT32 => 4,
                other => {
                    return Err(Error::FeatureNotPresent(format!("index type {other:?}")));
                }
            };
            let range = handle::get(buffer)?.range(offset, None)?;
            recorder.push(Command::BindIndexBuffer(IndexBuffer { range, index_size }));
            Ok(())
        })
    }

    #[doc(alias = "vkCmdSetViewport")]
    fn cmd_set_viewport(
        command_buffer: vk::CommandBuffer,
        first_viewport: u32,
        viewport_count: u32,
        viewports: *const vk::Viewport,
    ) {
        set_viewports(command_buffer, first_viewport, viewport_count, viewports, false)
    }

    #[doc(alias = "vkCmdSetViewportWithCount")]
    fn cmd_set_viewport_with_count(
        command_buffer: vk::CommandBuffer,
        viewport_count: u32,
        viewports: *const vk::Viewport,
    ) {
        set_viewports(command_buffer, 0, viewport_count, viewports, true)
    }

    #[doc(alias = "vkCmdSetScissor")]
    fn cmd_set_scissor(
        command_buffer: vk::CommandBuffer,
        first_scissor: u32,
        scissor_count: u32,
        scissors: *const vk::Rect2D,
    ) {
        set_scissors(command_buffer, first_scissor, scissor_count, scissors, false)
    }

    #[doc(alias = "vkCmdSetScissorWithCount")]
    fn cmd_set_scissor_with_count(
        command_buffer: vk::CommandBuffer,
        scissor_count: u32,
        scissors: *const vk::Rect2D,
    ) {
        set_scissors(command_buffer, 0, scissor_count, scissors, true)
    }

    #[doc(alias = "vkCmdDraw")]
    fn cmd_draw(
        command_buffer: vk::CommandBuffer,
        vertex_count: u32,
        instance_count: u32,
        first_vertex: u32,
        first_instance: u32,
    ) {
        record(command_buffer, |recorder| {
            recorder.require_pass()?;
            recorder.push(Command::Draw(Draw {
                vertex_offset: None,
                first: first_vertex,
                count: vertex_count,
                first_instance,
                instance_count,
            }));
            Ok(())
        })
    }

    #[doc(alias = "vkCmdDrawIndexed")]
    fn cmd_draw_indexed(
        command_buffer: vk::CommandBuffer,
        index_count: u32,
        instance_count: u32,
        first_index: u32,
        vertex_offset: i32,
        first_instance: u32,
    ) {
        record(command_buffer, |recorder| {
            recorder.require_pass()?;
            recorder.push(Command::Draw(Draw {
                vertex_offset: Some(vertex_offset),
                first: first_index,
                count: index_count,
                first_instance,
                instance_count,
            }));
            Ok(())
        })
    }

    #[doc(alias = "vkCmdDrawIndirect")]
    fn cmd_draw_indirect(
        command_buffer: vk::CommandBuffer,
        buffer: vk::Buffer,
        offset: vk::DeviceSize,
        draw_count: u32,
        stride: u32,
    ) {
        let parameters = (buffer, offset);
        draw_indirect(command_buffer, parameters, None, draw_count, stride, false)
    }

    #[doc(alias = "vkCmdDrawIndexedIndirect")]
    fn cmd_draw_indexed_indirect(
        command_buffer: vk::CommandBuffer,
        buffer: vk::Buffer,
        offset: vk::DeviceSize,
        draw_count: u32,
        stride: u32,
    ) {
        let parameters = (buffer, offset);
        draw_indirect(command_buffer, parameters, None, draw_count, stride, true)
    }

    #[doc(alias = "vkCmdDrawIndirectCount")]
    fn cmd_draw_indirect_count(
        command_buffer: vk::CommandBuffer,
        buffer: vk::Buffer,
        offset: vk::DeviceSize,
        count_buffer: vk::Buffer,
        count_buffer_offset: vk::DeviceSize,
        max_draw_count: u32,
        stride: u32,
    ) {
        let parameters = (buffer, offset);
        let count = Some((count_buffer, count_buffer_offset));
        draw_indirect(command_buffer, parameters, count, max_draw_count, stride, false)
    }

    #[doc(alias = "vkCmdDrawIndexedIndirectCount")]
    fn cmd_draw_indexed_indirect_count(
        command_buffer: vk::CommandBuffer,
        buffer: vk::Buffer,
        offset: vk::DeviceSize,
        count_buffer: vk::Buffer,
        count_buffer_offset: vk::DeviceSize,
        max_draw_count: u32,
        stride: u32,
    ) {
        let parameters = (buffer, offset);
        let count = Some((count_buffer, count_buffer_offset));
        draw_indirect(command_buffer, parameters, count, max_draw_count, stride, true)
    }

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

    #[doc(alias = "vkCmdPipelineBarrier")]
    fn cmd_pipeline_barrier(
        command_buffer: vk::CommandBuffer,
        _src_stage_mask: vk::PipelineStageFlags,
        _dst_stage_mask: vk::PipelineStageFlags,
        _dependency_flags: vk::DependencyFlags,
        _memory_barrier_count: u32,
        _memory_barriers: *const vk::MemoryBarrier<'_>,
        _buffer_memory_barrier_count: u32,
        _buffer_memory_barriers: *const vk::BufferMemoryBarrier<'_>,
        _image_memory_barrier_count: u32,
        _image_memory_barriers: *const vk::ImageMemoryBarrier<'_>,
    ) {
        barrier(command_buffer)
    }

    #[doc(alias = "vkCmdPipelineBarrier2")]
    fn cmd_pipeline_barrier2(
        command_buffer: vk::CommandBuffer,
        _dependency_info: *const vk::DependencyInfo<'_>,
    ) {
        barrier(command_buffer)
    }

    #[doc(alias = "vkCmdSetEvent")]
    fn cmd_set_event(
        command_buffer: vk::CommandBuffer,
        event: vk::Event,
        _stage_mask: vk::PipelineStageFlags,
    ) {
        set_event(command_buffer, event, true)
    }

    #[doc(alias = "vkCmdSetEvent2")]
    fn cmd_set_event2(
        command_buffer: vk::CommandBuffer,
        event: vk::Event,
        _dependency_info: *const vk::DependencyInfo<'_>,
    ) {
        set_event(command_buffer, event, true)
    }

    #[doc(alias = "vkCmdResetEvent")]
    fn cmd_reset_event(
        command_buffer: vk::CommandBuffer,
        event: vk::Event,
        _stage_mask: vk::PipelineStageFlags,
    ) {
        set_event(command_buffer, event, false)
    }

    #[doc(alias = "vkCmdResetEvent2")]
    fn cmd_reset_event2(
        command_buffer: vk::CommandBuffer,
        event: vk::Event,
        _stage_mask: vk::PipelineStageFlags2,
    ) {
        set_event(command_buffer, event, false)
    }

    #[doc(alias = "vkCmdWaitEvents")]
    fn cmd_wait_events(
        command_buffer: vk::CommandBuffer,
        event_count: u32,
        events: *const vk::Event,
        _src_stage_mask: vk::PipelineStageFlags,
        _dst_stage_mask: vk::PipelineStageFlags,
        _memory_barrier_count: u32,
        _memory_barriers: *const vk::MemoryBarrier<'_>,
        _buffer_memory_barrier_count: u32,
        _buffer_memory_barriers: *const vk::BufferMemoryBarrier<'_>,
        _image_memory_barrier_count: u32,
        _image_memory_barriers: *const vk::ImageMemoryBarrier<'_>,
    ) {
        wait_events(command_buffer, event_count, events)
    }

    #[doc(alias = "vkCmdWaitEvents2")]
    fn cmd_wait_events2(
        command_buffer: vk::CommandBuffer,
        event_count: u32,
        events: *const vk::Event,
        _dependency_infos: *const vk::DependencyInfo<'_>,
    ) {
        wait_events(command_buffer, event_count, events)
    }
}

/// Records vertex buffers; `sizes` and `strides` are empty or have one for each.
///
/// # Safety
/// The handles are live.
unsafe fn bind_vertex_buffers(
    recorder: &mut Recorder,
    first: u32,
    buffers: &[vk::Buffer],
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
    for (index, (&buffer, &offset)) in buffers.iter().zip(offsets).enumerate() {
        let size = sizes.get(index).copied().unwrap_or(vk::WHOLE_SIZE);
        // SAFETY: the caller's promise.
        let buffer = unsafe { handle::get(buffer)? };
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
///
/// # Safety
/// The handle is live and the pointer is valid for the count.
unsafe fn set_viewports(
    command_buffer: vk::CommandBuffer,
    first: u32,
    count: u32,
    viewports: *const vk::Viewport,
    with_count: bool,
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    unsafe {
        record(command_buffer, |recorder| {
            require_viewports(first, count)?;
            let viewports = pointer::slice(viewports, count)?;
            recorder.push(Command::SetViewports {
                first,
                viewports: viewports.iter().copied().map(pipeline::viewport).collect(),
                with_count,
            });
            Ok(())
        })
    }
}

/// Records scissors.
///
/// # Safety
/// The handle is live and the pointer is valid for the count.
unsafe fn set_scissors(
    command_buffer: vk::CommandBuffer,
    first: u32,
    count: u32,
    scissors: *const vk::Rect2D,
    with_count: bool,
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    unsafe {
        record(command_buffer, |recorder| {
            require_viewports(first, count)?;
            let scissors = pointer::slice(scissors, count)?;
            recorder.push(Command::SetScissors {
                first,
                scissors: scissors.iter().copied().map(rendering::rect).collect(),
                with_count,
            });
            Ok(())
        })
    }
}

/// A buffer and an offset in it.
type Place = (vk::Buffer, vk::DeviceSize);

/// Records draws whose numbers lie in a buffer.
///
/// # Safety
/// The handles are live.
unsafe fn draw_indirect(
    command_buffer: vk::CommandBuffer,
    (buffer, offset): Place,
    count: Option<Place>,
    draw_count: u32,
    stride: u32,
    indexed: bool,
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    unsafe {
        record(command_buffer, |recorder| {
            recorder.require_pass()?;
            let parameters = handle::get(buffer)?.range(offset, None)?;
            let count = match count {
                Some((buffer, offset)) => Some(handle::get(buffer)?.range(offset, Some(4))?),
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
        })
    }
}

/// Records a barrier. It makes everything before it visible to everything after it, whatever it names.
///
/// # Safety
/// The handle is live.
unsafe fn barrier(command_buffer: vk::CommandBuffer) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    unsafe {
        record(command_buffer, |recorder| {
            recorder.packet(Packet::Barrier);
            Ok(())
        })
    }
}

/// Records the setting or resetting of an event.
///
/// # Safety
/// The handles are live.
unsafe fn set_event(
    command_buffer: vk::CommandBuffer,
    event: vk::Event,
    value: bool,
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    unsafe {
        record(command_buffer, |recorder| {
            recorder.require_outside_pass()?;
            let event = Arc::clone(handle::get(event)?);
            recorder.push(Command::SetEvent(event, value));
            Ok(())
        })
    }
}

/// Records a wait for events.
///
/// # Safety
/// The handles are live and the pointer is valid for the count.
unsafe fn wait_events(
    command_buffer: vk::CommandBuffer,
    count: u32,
    events: *const vk::Event,
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    unsafe {
        record(command_buffer, |recorder| {
            let events = handle::get_all(pointer::slice(events, count)?)?;
            recorder.push(Command::WaitEvents(events));
            recorder.packet(Packet::Barrier);
            Ok(())
        })
    }
}
