//! Commands that draw and dispatch.

use super::buffer::Recorder;
use super::{Command, DrawIndirect, DrawParameters};
use crate::abi::error::Error;
use crate::abi::valid;
use crate::resource::buffer::{Buffer, BufferRules};
use ash::vk;
use std::sync::Arc;

/// The rules on the parameters of `vkCmdDrawIndirect` and similar commands.
const DRAW_INDIRECT: BufferRules =
    BufferRules { memory: "VUID-vkCmdDrawIndirect-buffer-02708", range: "VUID-vkCmdDrawIndirect-drawCount-00488" };

/// The rules on the count of `vkCmdDrawIndirectCount` and similar commands.
const DRAW_COUNT: BufferRules = BufferRules {
    memory: "VUID-vkCmdDrawIndirectCount-countBuffer-02714",
    range: "VUID-vkCmdDrawIndirectCount-countBufferOffset-04129",
};

/// The rules on the parameters of `vkCmdDispatchIndirect`.
const DISPATCH_INDIRECT: BufferRules =
    BufferRules { memory: "VUID-vkCmdDispatchIndirect-buffer-02708", range: "VUID-vkCmdDispatchIndirect-offset-00407" };

#[doc(alias = "vkCmdDraw")]
pub(crate) fn cmd_draw(
    recorder: &mut Recorder,
    vertex_count: u32,
    instance_count: u32,
    first_vertex: u32,
    first_instance: u32,
) -> Result<(), Error> {
    recorder.require_pass()?;
    recorder.push(Command::Draw(DrawParameters {
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
    recorder.push(Command::Draw(DrawParameters {
        vertex_offset: Some(vertex_offset),
        first: first_index,
        count: index_count,
        first_instance,
        instance_count,
    }));
    Ok(())
}

/// The elements of an array that lie `stride` bytes apart.
///
/// # Safety
/// The pointer has `count` elements, `stride` bytes apart.
unsafe fn strided<T: Copy>(first: *const T, count: u32, stride: u32) -> Result<Vec<T>, Error> {
    if first.is_null() && count > 0 {
        return Err(Error::NullPointer { what: std::any::type_name::<T>() });
    }
    let element = |index: u32| {
        // SAFETY: the caller's promise.
        unsafe { first.byte_add(index as usize * stride as usize).read_unaligned() }
    };
    Ok(simdevice::host::collect((0..count).map(element)))
}

/// Records draws that each know their draw index.
fn draw_multi(recorder: &mut Recorder, draws: Vec<DrawParameters>) -> Result<(), Error> {
    recorder.require_pass()?;
    recorder.push(Command::DrawMulti(draws));
    Ok(())
}

/// # Safety
/// The array has as many infos as the count says, `stride` bytes apart.
#[doc(alias = "vkCmdDrawMultiEXT")]
pub(crate) unsafe fn cmd_draw_multi(
    recorder: &mut Recorder,
    draw_count: u32,
    vertex_info: *const vk::MultiDrawInfoEXT,
    instance_count: u32,
    first_instance: u32,
    stride: u32,
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    let infos = unsafe { strided(vertex_info, draw_count, stride)? };
    let draws = infos.into_iter().map(|info| DrawParameters {
        vertex_offset: None,
        first: info.first_vertex,
        count: info.vertex_count,
        first_instance,
        instance_count,
    });
    draw_multi(recorder, draws.collect())
}

/// # Safety
/// As [`cmd_draw_multi`].
#[doc(alias = "vkCmdDrawMultiIndexedEXT")]
pub(crate) unsafe fn cmd_draw_multi_indexed(
    recorder: &mut Recorder,
    draw_count: u32,
    index_info: *const vk::MultiDrawIndexedInfoEXT,
    instance_count: u32,
    first_instance: u32,
    stride: u32,
    vertex_offset: *const i32,
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    let (infos, offset) = unsafe { (strided(index_info, draw_count, stride)?, valid::optional(vertex_offset)) };
    let draws = infos.into_iter().map(|info| DrawParameters {
        // One offset for all takes precedence over those of each draw.
        vertex_offset: Some(offset.copied().unwrap_or(info.vertex_offset)),
        first: info.first_index,
        count: info.index_count,
        first_instance,
        instance_count,
    });
    draw_multi(recorder, draws.collect())
}

#[doc(alias = "vkCmdDrawIndirect")]
pub(crate) fn cmd_draw_indirect(
    recorder: &mut Recorder,
    buffer: &Buffer,
    offset: vk::DeviceSize,
    draw_count: u32,
    stride: u32,
) -> Result<(), Error> {
    let draws = draws(buffer, offset, draw_count, stride)?;
    draw_indirect(recorder, draws)
}

#[doc(alias = "vkCmdDrawIndexedIndirect")]
pub(crate) fn cmd_draw_indexed_indirect(
    recorder: &mut Recorder,
    buffer: &Buffer,
    offset: vk::DeviceSize,
    draw_count: u32,
    stride: u32,
) -> Result<(), Error> {
    let draws = draws(buffer, offset, draw_count, stride)?;
    draw_indirect(recorder, DrawIndirect { indexed: true, ..draws })
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
    let draws = DrawIndirect {
        count: Some(count_buffer.range(count_buffer_offset, Some(4), &DRAW_COUNT)?),
        ..draws(buffer, offset, max_draw_count, stride)?
    };
    draw_indirect(recorder, draws)
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
    let draws = DrawIndirect {
        count: Some(count_buffer.range(count_buffer_offset, Some(4), &DRAW_COUNT)?),
        indexed: true,
        ..draws(buffer, offset, max_draw_count, stride)?
    };
    draw_indirect(recorder, draws)
}

#[doc(alias = "vkCmdDispatch")]
pub(crate) fn cmd_dispatch(
    recorder: &mut Recorder,
    group_count_x: u32,
    group_count_y: u32,
    group_count_z: u32,
) -> Result<(), Error> {
    dispatch(recorder, [0; 3], [group_count_x, group_count_y, group_count_z])
}

#[doc(alias = "vkCmdDispatchBase")]
pub(crate) fn cmd_dispatch_base(
    recorder: &mut Recorder,
    base_group_x: u32,
    base_group_y: u32,
    base_group_z: u32,
    group_count_x: u32,
    group_count_y: u32,
    group_count_z: u32,
) -> Result<(), Error> {
    let base = [base_group_x, base_group_y, base_group_z];
    dispatch(recorder, base, [group_count_x, group_count_y, group_count_z])
}

#[doc(alias = "vkCmdDispatchIndirect")]
pub(crate) fn cmd_dispatch_indirect(
    recorder: &mut Recorder,
    buffer: &Arc<Buffer>,
    offset: vk::DeviceSize,
) -> Result<(), Error> {
    recorder.require_outside_pass()?;
    let size = size_of::<vk::DispatchIndirectCommand>() as u64;
    let range = buffer.range(offset, Some(size), &DISPATCH_INDIRECT)?;
    recorder.push(Command::DispatchIndirect(range));
    Ok(())
}

/// Records a dispatch.
fn dispatch(recorder: &mut Recorder, base: [u32; 3], count: [u32; 3]) -> Result<(), Error> {
    recorder.require_outside_pass()?;
    recorder.push(Command::Dispatch { base, count });
    Ok(())
}

/// Draws without indices, `draw_count` of them, whose parameters are in a buffer.
fn draws(buffer: &Buffer, offset: vk::DeviceSize, draw_count: u32, stride: u32) -> Result<DrawIndirect, Error> {
    Ok(DrawIndirect {
        parameters: buffer.range(offset, None, &DRAW_INDIRECT)?,
        draw_count,
        count: None,
        stride,
        indexed: false,
    })
}

/// Records draws whose parameters are in a buffer.
fn draw_indirect(recorder: &mut Recorder, draws: DrawIndirect) -> Result<(), Error> {
    recorder.require_pass()?;
    recorder.push(Command::DrawIndirect(draws));
    Ok(())
}
