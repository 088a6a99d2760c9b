//! Binding, render pass instances, queries and conditions.

use std::sync::PoisonError;

use ash::vk;
use gaurast_layer_interface::slice;

use crate::bindings::{BoundSet, PushConstants};
use crate::draw_call::{IndexBuffer, VertexBuffer};
use crate::emulation::Emulation;
use crate::hooks::site::{Site, record};
use crate::pass::{Object, Pass, Rendering};
use crate::recording::{Bound, Condition, Query, Recording};
use crate::work::Work;

pub(super) unsafe extern "system" fn cmd_bind_pipeline(
    commands: vk::CommandBuffer,
    point: vk::PipelineBindPoint,
    pipeline: vk::Pipeline,
) {
    // SAFETY: see the crate, for this and all below.
    unsafe {
        record(
            commands,
            |site, recording| {
                if point == vk::PipelineBindPoint::GRAPHICS {
                    if let Some(own) = site.emulation.objects().pipelines.get(&pipeline) {
                        recording.graphics = Bound::Gaussians(own.clone());
                        return;
                    }
                    recording.graphics = Bound::Other(pipeline);
                } else if point == vk::PipelineBindPoint::COMPUTE {
                    recording.compute = pipeline;
                }
                site.next.cmd_bind_pipeline(commands, point, pipeline);
            },
            |next| next.cmd_bind_pipeline(commands, point, pipeline),
        );
    }
}

/// The address of a buffer, and the bytes from an offset on.
///
/// # Safety
/// The buffer is valid, or null.
unsafe fn located(emulation: &Emulation, buffer: vk::Buffer, offset: u64) -> (u64, u64) {
    let size = emulation.objects().buffers.get(&buffer).copied().unwrap_or(0);
    if buffer == vk::Buffer::null() || size == 0 {
        return (0, 0);
    }
    let info = vk::BufferDeviceAddressInfo::default().buffer(buffer);
    // SAFETY: the caller's promise; all buffers that are known have an address.
    let address = unsafe { emulation.next.get_buffer_device_address(&info) };
    (address + offset, size.saturating_sub(offset))
}

/// The buffer, and the address of a place in it. 0 if it is null.
///
/// # Safety
/// The buffer is valid.
pub(super) unsafe fn address(emulation: &Emulation, buffer: vk::Buffer, offset: u64) -> u64 {
    // SAFETY: the caller's promise.
    unsafe { located(emulation, buffer, offset).0 }
}

pub(super) unsafe extern "system" fn cmd_bind_vertex_buffers(
    commands: vk::CommandBuffer,
    first: u32,
    count: u32,
    buffers: *const vk::Buffer,
    offsets: *const vk::DeviceSize,
) {
    // SAFETY: see the crate.
    unsafe {
        let pass_on = |next: &crate::next::Next| {
            (next.fp_v1_0().cmd_bind_vertex_buffers)(commands, first, count, buffers, offsets);
        };
        record(
            commands,
            |site, recording| {
                let (buffers, offsets) = (slice(buffers, count), slice(offsets, count));
                for ((number, &buffer), &offset) in (first..).zip(buffers).zip(offsets) {
                    let (address, size) = located(site.emulation, buffer, offset);
                    let stride = recording.vertex_buffers.get(&number).and_then(|before| before.stride);
                    recording.vertex_buffers.insert(number, VertexBuffer { buffer, offset, address, size, stride });
                }
                pass_on(site.next);
            },
            pass_on,
        );
    }
}

pub(super) unsafe extern "system" fn cmd_bind_vertex_buffers2(
    commands: vk::CommandBuffer,
    first: u32,
    count: u32,
    buffers: *const vk::Buffer,
    offsets: *const vk::DeviceSize,
    sizes: *const vk::DeviceSize,
    strides: *const vk::DeviceSize,
) {
    // SAFETY: see the crate.
    unsafe {
        let pass_on = |next: &crate::next::Next| {
            (next.fp_v1_3().cmd_bind_vertex_buffers2)(commands, first, count, buffers, offsets, sizes, strides);
        };
        record(
            commands,
            |site, recording| {
                let given = slice(sizes, if sizes.is_null() { 0 } else { count });
                let by = slice(strides, if strides.is_null() { 0 } else { count });
                let pairs = slice(buffers, count).iter().zip(slice(offsets, count));
                for (index, (&buffer, &offset)) in pairs.enumerate() {
                    let number = first + index as u32;
                    let (address, whole) = located(site.emulation, buffer, offset);
                    let size = given.get(index).map_or(whole, |&size| size.min(whole));
                    let before = recording.vertex_buffers.get(&number).and_then(|before| before.stride);
                    let stride = by.get(index).map(|&stride| stride as u32).or(before);
                    recording.vertex_buffers.insert(number, VertexBuffer { buffer, offset, address, size, stride });
                }
                pass_on(site.next);
            },
            pass_on,
        );
    }
}

pub(super) unsafe extern "system" fn cmd_bind_index_buffer(
    commands: vk::CommandBuffer,
    buffer: vk::Buffer,
    offset: vk::DeviceSize,
    ty: vk::IndexType,
) {
    // SAFETY: see the crate.
    unsafe {
        record(
            commands,
            |site, recording| {
                let (address, size) = located(site.emulation, buffer, offset);
                let bytes = match ty {
                    vk::IndexType::UINT16 => 2,
                    vk::IndexType::UINT32 => 4,
                    _ => 1,
                };
                recording.index_buffer = Some(IndexBuffer { buffer, offset, ty, address, size, bytes });
                site.next.cmd_bind_index_buffer(commands, buffer, offset, ty);
            },
            |next| next.cmd_bind_index_buffer(commands, buffer, offset, ty),
        );
    }
}

pub(super) unsafe extern "system" fn cmd_bind_descriptor_sets(
    commands: vk::CommandBuffer,
    point: vk::PipelineBindPoint,
    layout: vk::PipelineLayout,
    first: u32,
    count: u32,
    sets: *const vk::DescriptorSet,
    offset_count: u32,
    offsets: *const u32,
) {
    // SAFETY: see the crate.
    unsafe {
        let (sets, offsets) = (slice(sets, count), slice(offsets, offset_count));
        record(
            commands,
            |site, recording| {
                let objects = site.emulation.objects();
                let layouts = objects.layouts.get(&layout).map(Vec::as_slice).unwrap_or_default();
                let mut rest = offsets;
                for (number, &set) in (first..).zip(sets) {
                    let own = layouts.get(number as usize).and_then(|layout| objects.set_layouts.get(layout));
                    let (own, after) = rest.split_at(own.copied().unwrap_or(0).min(rest.len()));
                    rest = after;
                    let bound = BoundSet { layout, set, offsets: own.to_vec() };
                    recording.descriptors.insert((point.as_raw(), number), bound);
                }
                site.next.cmd_bind_descriptor_sets(commands, point, layout, first, sets, offsets);
            },
            |next| next.cmd_bind_descriptor_sets(commands, point, layout, first, sets, offsets),
        );
    }
}

pub(super) unsafe extern "system" fn cmd_push_constants(
    commands: vk::CommandBuffer,
    layout: vk::PipelineLayout,
    stages: vk::ShaderStageFlags,
    offset: u32,
    size: u32,
    values: *const std::ffi::c_void,
) {
    // SAFETY: see the crate.
    unsafe {
        let bytes = slice(values.cast::<u8>(), size);
        record(
            commands,
            |site, recording| {
                recording.push_constants(PushConstants { layout, stages, offset, bytes: bytes.to_vec() });
                site.next.cmd_push_constants(commands, layout, stages, offset, bytes);
            },
            |next| next.cmd_push_constants(commands, layout, stages, offset, bytes),
        );
    }
}

pub(super) unsafe extern "system" fn cmd_begin_rendering(
    commands: vk::CommandBuffer,
    info: *const vk::RenderingInfo<'_>,
) {
    // SAFETY: see the crate.
    unsafe {
        record(
            commands,
            |site, recording| recording.pass = Some(Pass::Rendering(Rendering::begin(site.next, commands, &*info))),
            |next| next.cmd_begin_rendering(commands, &*info),
        );
    }
}

pub(super) unsafe extern "system" fn cmd_end_rendering(commands: vk::CommandBuffer) {
    // SAFETY: see the crate.
    unsafe {
        record(
            commands,
            |site, recording| {
                recording.pass = None;
                site.next.cmd_end_rendering(commands);
            },
            |next| next.cmd_end_rendering(commands),
        );
    }
}

/// Notes that an instance of a render pass object begins.
///
/// # Safety
/// The information is valid.
unsafe fn note_begin(
    emulation: &Emulation,
    recording: &mut Recording,
    info: &vk::RenderPassBeginInfo<'_>,
    contents: vk::SubpassContents,
) {
    let objects = emulation.objects();
    let known = objects.render_passes.get(&info.render_pass).cloned();
    let attachments = objects.framebuffers.get(&info.framebuffer).cloned().unwrap_or_default();
    // SAFETY: the caller's promise.
    recording.pass = known.map(|known| Pass::Object(unsafe { Object::new(known, info, attachments, contents) }));
}

fn note_next(recording: &mut Recording, contents: vk::SubpassContents) {
    if let Some(Pass::Object(object)) = &mut recording.pass {
        object.next_subpass(contents);
    }
}

pub(super) unsafe extern "system" fn cmd_begin_render_pass(
    commands: vk::CommandBuffer,
    info: *const vk::RenderPassBeginInfo<'_>,
    contents: vk::SubpassContents,
) {
    // SAFETY: see the crate.
    unsafe {
        record(
            commands,
            |site, recording| {
                note_begin(site.emulation, recording, &*info, contents);
                site.next.cmd_begin_render_pass(commands, &*info, contents);
            },
            |next| next.cmd_begin_render_pass(commands, &*info, contents),
        );
    }
}

pub(super) unsafe extern "system" fn cmd_begin_render_pass2(
    commands: vk::CommandBuffer,
    info: *const vk::RenderPassBeginInfo<'_>,
    begin: *const vk::SubpassBeginInfo<'_>,
) {
    // SAFETY: see the crate.
    unsafe {
        record(
            commands,
            |site, recording| {
                note_begin(site.emulation, recording, &*info, (*begin).contents);
                site.next.cmd_begin_render_pass2(commands, &*info, &*begin);
            },
            |next| next.cmd_begin_render_pass2(commands, &*info, &*begin),
        );
    }
}

pub(super) unsafe extern "system" fn cmd_next_subpass(commands: vk::CommandBuffer, contents: vk::SubpassContents) {
    // SAFETY: see the crate.
    unsafe {
        record(
            commands,
            |site, recording| {
                note_next(recording, contents);
                site.next.cmd_next_subpass(commands, contents);
            },
            |next| next.cmd_next_subpass(commands, contents),
        );
    }
}

pub(super) unsafe extern "system" fn cmd_next_subpass2(
    commands: vk::CommandBuffer,
    begin: *const vk::SubpassBeginInfo<'_>,
    end: *const vk::SubpassEndInfo<'_>,
) {
    // SAFETY: see the crate.
    unsafe {
        record(
            commands,
            |site, recording| {
                note_next(recording, (*begin).contents);
                site.next.cmd_next_subpass2(commands, &*begin, &*end);
            },
            |next| next.cmd_next_subpass2(commands, &*begin, &*end),
        );
    }
}

pub(super) unsafe extern "system" fn cmd_end_render_pass(commands: vk::CommandBuffer) {
    // SAFETY: see the crate.
    unsafe {
        record(
            commands,
            |site, recording| {
                recording.pass = None;
                site.next.cmd_end_render_pass(commands);
            },
            |next| next.cmd_end_render_pass(commands),
        );
    }
}

pub(super) unsafe extern "system" fn cmd_end_render_pass2(
    commands: vk::CommandBuffer,
    end: *const vk::SubpassEndInfo<'_>,
) {
    // SAFETY: see the crate.
    unsafe {
        record(
            commands,
            |site, recording| {
                recording.pass = None;
                site.next.cmd_end_render_pass2(commands, &*end);
            },
            |next| next.cmd_end_render_pass2(commands, &*end),
        );
    }
}

/// Executes secondary command buffers whose sets are computed before.
///
/// # Safety
/// The command buffers are valid.
unsafe fn execute(site: &Site<'_>, recording: &mut Recording, works: &[Work], buffers: &[vk::CommandBuffer]) {
    if buffers.is_empty() {
        return;
    }
    // SAFETY: the caller's promise.
    unsafe {
        recording.before_secondaries(site.emulation, works);
        recording.activate_queries(site.next);
        site.next.cmd_execute_commands(recording.commands, buffers);
    }
}

pub(super) unsafe extern "system" fn cmd_execute_commands(
    commands: vk::CommandBuffer,
    count: u32,
    buffers: *const vk::CommandBuffer,
) {
    // SAFETY: see the crate.
    unsafe {
        let buffers = slice(buffers, count);
        record(
            commands,
            |site, recording| {
                let mut works: Vec<Work> = Vec::new();
                let mut first = 0;
                for (index, &secondary) in buffers.iter().enumerate() {
                    let Some(known) = site.device.recording(secondary) else {
                        continue;
                    };
                    let known = known.lock().unwrap_or_else(PoisonError::into_inner);
                    if known.works().iter().any(|work| work.tests.is_some()) {
                        // They are tested against what those before store.
                        execute(site, recording, &works, &buffers[first..index]);
                        works.clear();
                        first = index;
                    }
                    works.extend_from_slice(known.works());
                }
                execute(site, recording, &works, &buffers[first..]);
                // All state is undefined now.
                recording.graphics = Bound::Nothing;
                recording.compute = vk::Pipeline::null();
                recording.states.clear();
                recording.constants.clear();
                recording.descriptors.clear();
            },
            |next| next.cmd_execute_commands(commands, buffers),
        );
    }
}

pub(super) unsafe extern "system" fn cmd_begin_query(
    commands: vk::CommandBuffer,
    pool: vk::QueryPool,
    index: u32,
    flags: vk::QueryControlFlags,
) {
    // SAFETY: see the crate.
    unsafe {
        record(
            commands,
            |site, recording| {
                if matches!(recording.pass, Some(Pass::Rendering(_) | Pass::Object(_))) {
                    // The pass may yet be broken: the query begins with the first draw.
                    recording.queries.push(Query { pool, index, flags, is_active: false });
                } else {
                    site.next.cmd_begin_query(commands, pool, index, flags);
                }
            },
            |next| next.cmd_begin_query(commands, pool, index, flags),
        );
    }
}

pub(super) unsafe extern "system" fn cmd_end_query(commands: vk::CommandBuffer, pool: vk::QueryPool, index: u32) {
    // SAFETY: see the crate.
    unsafe {
        record(
            commands,
            |site, recording| {
                recording.activate_queries(site.next);
                recording.queries.retain(|query| (query.pool, query.index) != (pool, index));
                site.next.cmd_end_query(commands, pool, index);
            },
            |next| next.cmd_end_query(commands, pool, index),
        );
    }
}

pub(super) unsafe extern "system" fn cmd_begin_conditional_rendering(
    commands: vk::CommandBuffer,
    info: *const vk::ConditionalRenderingBeginInfoEXT<'_>,
) {
    // SAFETY: see the crate.
    unsafe {
        let pass_on = |next: &crate::next::Next| {
            if let Some(begin) = next.begin_conditional_rendering {
                begin(commands, info);
            }
        };
        record(
            commands,
            |site, recording| {
                if recording.pass.is_some() {
                    let (buffer, offset, flags) = ((*info).buffer, (*info).offset, (*info).flags);
                    recording.condition = Some(Condition { buffer, offset, flags });
                }
                pass_on(site.next);
            },
            pass_on,
        );
    }
}

pub(super) unsafe extern "system" fn cmd_end_conditional_rendering(commands: vk::CommandBuffer) {
    // SAFETY: see the crate.
    unsafe {
        let pass_on = |next: &crate::next::Next| {
            if let Some(end) = next.end_conditional_rendering {
                end(commands);
            }
        };
        record(
            commands,
            |site, recording| {
                recording.condition = None;
                pass_on(site.next);
            },
            pass_on,
        );
    }
}
