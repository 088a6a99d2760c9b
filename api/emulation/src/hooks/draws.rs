//! Draw commands.

use ash::vk;

use crate::draw_call::Call;
use crate::hooks::commands::address;
use crate::hooks::site::{Site, record};
use crate::next::Next;
use crate::recording::{Bound, Recording};

/// Records draws of Gaussians, if the bound pipeline draws them; otherwise passes the command on.
///
/// # Safety
/// The command buffer is valid.
unsafe fn draw<C: Iterator<Item = Call>>(
    commands: vk::CommandBuffer,
    calls: impl FnOnce(&Site<'_>) -> C,
    pass_on: impl Fn(&Next),
) {
    let known = |site: &Site<'_>, recording: &mut Recording| {
        if let Bound::Gaussians(pipeline) = &recording.graphics {
            let pipeline = pipeline.clone();
            for call in calls(site) {
                // SAFETY: the application records the command.
                unsafe { recording.draw(site.emulation, &pipeline, call) };
            }
        } else {
            // SAFETY: as above.
            unsafe { recording.activate_queries(site.next) };
            recording.has_drawn = true;
            pass_on(site.next);
        }
    };
    // SAFETY: the caller's promise.
    unsafe { record(commands, known, &pass_on) };
}

pub(super) unsafe extern "system" fn cmd_draw(
    commands: vk::CommandBuffer,
    count: u32,
    instances: u32,
    first: u32,
    first_instance: u32,
) {
    let call = Call { first, count, first_instance, instances, ..Call::default() };
    // SAFETY: see the crate.
    unsafe {
        draw(
            commands,
            |_| std::iter::once(call),
            |next| next.cmd_draw(commands, count, instances, first, first_instance),
        );
    }
}

pub(super) unsafe extern "system" fn cmd_draw_indexed(
    commands: vk::CommandBuffer,
    count: u32,
    instances: u32,
    first: u32,
    vertex_offset: i32,
    first_instance: u32,
) {
    let call = Call { first, count, vertex_offset, first_instance, instances, is_indexed: true, ..Call::default() };
    // SAFETY: see the crate.
    unsafe {
        draw(
            commands,
            |_| std::iter::once(call),
            |next| next.cmd_draw_indexed(commands, count, instances, first, vertex_offset, first_instance),
        );
    }
}

/// The draws of an indirect command.
///
/// # Safety
/// The buffers are valid.
unsafe fn indirect(
    site: &Site<'_>,
    (buffer, offset): (vk::Buffer, u64),
    count_buffer: Option<(vk::Buffer, u64)>,
    (count, stride): (u32, u32),
    is_indexed: bool,
) -> impl Iterator<Item = Call> + use<> {
    // SAFETY: the caller's promise.
    let (parameters, draw_count) = unsafe {
        let draw_count = count_buffer.map_or(0, |(buffer, offset)| address(site.emulation, buffer, offset));
        (address(site.emulation, buffer, offset), draw_count)
    };
    (0..count).map(move |index| Call {
        is_indexed,
        parameters: parameters + u64::from(index) * u64::from(stride),
        draw_count,
        indirect_index: index,
        ..Call::default()
    })
}

macro_rules! indirect_draws {
    ($($name:ident, $is_indexed:literal;)*) => {$(
        pub(super) unsafe extern "system" fn $name(
            commands: vk::CommandBuffer,
            buffer: vk::Buffer,
            offset: vk::DeviceSize,
            count: u32,
            stride: u32,
        ) {
            // SAFETY: see the crate.
            unsafe {
                draw(
                    commands,
                    |site| indirect(site, (buffer, offset), None, (count, stride), $is_indexed),
                    |next| next.$name(commands, buffer, offset, count, stride),
                );
            }
        }
    )*};
}
indirect_draws! {
    cmd_draw_indirect, false;
    cmd_draw_indexed_indirect, true;
}

macro_rules! counted_draws {
    ($($name:ident, $is_indexed:literal;)*) => {$(
        pub(super) unsafe extern "system" fn $name(
            commands: vk::CommandBuffer,
            buffer: vk::Buffer,
            offset: vk::DeviceSize,
            count_buffer: vk::Buffer,
            count_offset: vk::DeviceSize,
            most: u32,
            stride: u32,
        ) {
            // SAFETY: see the crate.
            unsafe {
                draw(
                    commands,
                    |site| {
                        let count = Some((count_buffer, count_offset));
                        indirect(site, (buffer, offset), count, (most, stride), $is_indexed)
                    },
                    |next| next.$name(commands, buffer, offset, count_buffer, count_offset, most, stride),
                );
            }
        }
    )*};
}
counted_draws! {
    cmd_draw_indirect_count, false;
    cmd_draw_indexed_indirect_count, true;
}

/// The elements of an array with a stride.
///
/// # Safety
/// The array has as many elements.
unsafe fn strided<T: Copy>(first: *const T, count: u32, stride: u32) -> impl Iterator<Item = T> {
    // SAFETY: the caller's promise.
    (0..count as usize).map(move |index| unsafe { first.byte_add(index * stride as usize).read_unaligned() })
}

pub(super) unsafe extern "system" fn cmd_draw_multi(
    commands: vk::CommandBuffer,
    count: u32,
    infos: *const vk::MultiDrawInfoEXT,
    instances: u32,
    first_instance: u32,
    stride: u32,
) {
    // SAFETY: see the crate.
    unsafe {
        draw(
            commands,
            |_| {
                strided(infos, count, stride).map(move |info: vk::MultiDrawInfoEXT| Call {
                    first: info.first_vertex,
                    count: info.vertex_count,
                    first_instance,
                    instances,
                    ..Call::default()
                })
            },
            |next| {
                if let Some(multi) = next.draw_multi {
                    multi(commands, count, infos, instances, first_instance, stride);
                }
            },
        );
    }
}

pub(super) unsafe extern "system" fn cmd_draw_multi_indexed(
    commands: vk::CommandBuffer,
    count: u32,
    infos: *const vk::MultiDrawIndexedInfoEXT,
    instances: u32,
    first_instance: u32,
    stride: u32,
    vertex_offset: *const i32,
) {
    // SAFETY: see the crate.
    unsafe {
        let offset = vertex_offset.as_ref().copied();
        draw(
            commands,
            |_| {
                strided(infos, count, stride).map(move |info: vk::MultiDrawIndexedInfoEXT| Call {
                    first: info.first_index,
                    count: info.index_count,
                    vertex_offset: offset.unwrap_or(info.vertex_offset),
                    first_instance,
                    instances,
                    is_indexed: true,
                    ..Call::default()
                })
            },
            |next| {
                if let Some(multi) = next.draw_multi_indexed {
                    multi(commands, count, infos, instances, first_instance, stride, vertex_offset);
                }
            },
        );
    }
}

pub(super) unsafe extern "system" fn cmd_clear_attachments(
    commands: vk::CommandBuffer,
    attachment_count: u32,
    attachments: *const vk::ClearAttachment,
    rectangle_count: u32,
    rectangles: *const vk::ClearRect,
) {
    // SAFETY: see the crate.
    unsafe {
        let clear = |next: &Next| {
            (next.fp_v1_0().cmd_clear_attachments)(
                commands,
                attachment_count,
                attachments,
                rectangle_count,
                rectangles,
            );
        };
        record(
            commands,
            |site, recording| {
                recording.has_drawn = true;
                clear(site.next);
            },
            clear,
        );
    }
}
