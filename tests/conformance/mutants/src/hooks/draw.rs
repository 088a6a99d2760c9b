//! Draws.

use ash::vk;

use crate::mutant::Mutant;
use crate::next::next;
use crate::recording::{Deferred, Recording, of};
use crate::table::*;
use gaurast_layer_interface::slice;

/// The kind of a draw command.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Direct,
    Indexed,
    Indirect,
}

/// Records a draw, as the active mutant wants it in its set.
fn record(commands: vk::CommandBuffer, kind: Kind, is_empty: bool, draw: impl FnOnce() + Send + 'static) {
    let draw: Deferred = Box::new(draw);
    let now = of(commands, |recording| {
        if recording.drops_draws {
            return None;
        }
        if !recording.in_set {
            return Some(draw);
        }
        recording.draws_of_set += 1;
        let number = recording.draws_of_set;
        let is_lost = SET_FIRST_DRAW_ONLY.strikes(number > 1)
            || SET_EIGHT_DRAWS.strikes(number > 8)
            || SET_INDIRECT.strikes(kind == Kind::Indirect)
            || SET_INDEXED.strikes(kind == Kind::Indexed)
            || (SET_EMPTY.is_active() && is_after_empty(recording, is_empty));
        if is_lost {
            return None;
        }
        if SET_LAST_DRAW_ONLY.strikes(number > 1) {
            recording.after_set.clear();
        }
        if SET_LAST_BUFFERS.is_active() || SET_LAST_DRAW_ONLY.is_active() {
            let _ = SET_LAST_BUFFERS.strikes(number > 1);
            let bound = recording.vertex_buffers.clone();
            let is_last_only = SET_LAST_DRAW_ONLY.is_active();
            recording.after_set.push(Box::new(move || {
                if is_last_only {
                    rebind(commands, &bound);
                }
                draw();
            }));
            return None;
        }
        if SET_REVERSED.is_active() {
            let _ = SET_REVERSED.strikes(number > 1);
            let bound = recording.vertex_buffers.clone();
            let reversed = move || {
                rebind(commands, &bound);
                draw();
            };
            recording.after_set.insert(0, Box::new(reversed));
            return None;
        }
        Some(draw)
    });
    if let Some(draw) = now {
        draw();
    }
}

/// Reports whether a draw of a set, empty or not, comes after an empty one.
fn is_after_empty(recording: &mut Recording, is_empty: bool) -> bool {
    if is_empty {
        recording.count("empty draw of a set");
        return false;
    }
    let is_after = recording.times.contains_key("empty draw of a set");
    SET_EMPTY.strikes(is_after)
}

fn rebind(commands: vk::CommandBuffer, bound: &std::collections::HashMap<u32, crate::recording::VertexBuffer>) {
    for (&binding, (buffer, offset)) in bound {
        // SAFETY: see the crate; the application has bound it so.
        unsafe { (next().cmd_bind_vertex_buffers)(commands, binding, 1, buffer, offset) };
    }
}

pub(super) unsafe extern "system" fn cmd_draw(
    commands: vk::CommandBuffer,
    mut vertices: u32,
    mut instances: u32,
    mut first_vertex: u32,
    mut first_instance: u32,
) {
    let is_empty = vertices == 0 || instances == 0;
    FIRST_VERTEX.replaces(&mut first_vertex, 0);
    LAST_VERTEX.changes(&mut vertices, |vertices| vertices.saturating_sub(1));
    VERTICES_BEYOND_10000.changes(&mut vertices, |vertices| vertices.min(10_000));
    VERTICES_BEYOND_65535.changes(&mut vertices, |vertices| vertices.min(0xffff));
    INSTANCES_BEYOND_65535.changes(&mut instances, |instances| instances.min(0xffff));
    INSTANCE_COUNT.changes(&mut instances, |instances| instances.min(1));
    FIRST_INSTANCE.replaces(&mut first_instance, 0);
    ZERO_VERTICES.changes(&mut vertices, |vertices| vertices.max(1));
    ZERO_INSTANCES.changes(&mut instances, |instances| instances.max(1));
    record(commands, Kind::Direct, is_empty, move || {
        // SAFETY: see the crate.
        unsafe { (next().cmd_draw)(commands, vertices, instances, first_vertex, first_instance) };
    });
}

pub(super) unsafe extern "system" fn cmd_draw_indexed(
    commands: vk::CommandBuffer,
    indices: u32,
    mut instances: u32,
    mut first_index: u32,
    mut offset: i32,
    mut first_instance: u32,
) {
    let is_empty = indices == 0 || instances == 0;
    FIRST_INDEX.replaces(&mut first_index, 0);
    VERTEX_OFFSET.replaces(&mut offset, 0);
    INDEXED_INSTANCE_COUNT.changes(&mut instances, |instances| instances.min(1));
    INDEXED_FIRST_INSTANCE.replaces(&mut first_instance, 0);
    let is_unindexed = INDICES_IGNORED.strikes(true);
    record(commands, Kind::Indexed, is_empty, move || {
        let next = next();
        // SAFETY: see the crate.
        unsafe {
            if is_unindexed {
                (next.cmd_draw)(commands, indices, instances, first_index, first_instance);
            } else {
                (next.cmd_draw_indexed)(commands, indices, instances, first_index, offset, first_instance);
            }
        }
    });
}

/// The mutants of a kind of indirect draws.
struct Indirect {
    dropped: &'static Mutant,
    offset: &'static Mutant,
    stride: &'static Mutant,
    first_only: &'static Mutant,
}

/// Makes the active mutant's change to an indirect draw; returns false if it is dropped.
fn change(mutants: &Indirect, offset: &mut vk::DeviceSize, count: &mut u32, stride: &mut u32, packed: u32) -> bool {
    mutants.offset.replaces(offset, 0);
    if *count > 1 {
        mutants.stride.replaces(stride, packed);
        mutants.first_only.replaces(count, 1);
    }
    !mutants.dropped.strikes(*count > 0)
}

const INDIRECT: Indirect = Indirect {
    dropped: &INDIRECT_DROPPED,
    offset: &INDIRECT_OFFSET,
    stride: &INDIRECT_STRIDE,
    first_only: &INDIRECT_FIRST_ONLY,
};

pub(super) unsafe extern "system" fn cmd_draw_indirect(
    commands: vk::CommandBuffer,
    buffer: vk::Buffer,
    mut offset: vk::DeviceSize,
    mut count: u32,
    mut stride: u32,
) {
    if change(&INDIRECT, &mut offset, &mut count, &mut stride, 16) {
        record(commands, Kind::Indirect, count == 0, move || {
            // SAFETY: see the crate.
            unsafe { (next().cmd_draw_indirect)(commands, buffer, offset, count, stride) };
        });
    }
}

const INDEXED_INDIRECT: Indirect = Indirect {
    dropped: &INDEXED_INDIRECT_DROPPED,
    offset: &INDEXED_INDIRECT_OFFSET,
    stride: &INDEXED_INDIRECT_STRIDE,
    first_only: &INDEXED_INDIRECT_FIRST_ONLY,
};

pub(super) unsafe extern "system" fn cmd_draw_indexed_indirect(
    commands: vk::CommandBuffer,
    buffer: vk::Buffer,
    mut offset: vk::DeviceSize,
    mut count: u32,
    mut stride: u32,
) {
    if change(&INDEXED_INDIRECT, &mut offset, &mut count, &mut stride, 20) {
        record(commands, Kind::Indirect, count == 0, move || {
            // SAFETY: see the crate.
            unsafe { (next().cmd_draw_indexed_indirect)(commands, buffer, offset, count, stride) };
        });
    }
}

pub(super) unsafe extern "system" fn cmd_draw_indirect_count(
    commands: vk::CommandBuffer,
    buffer: vk::Buffer,
    offset: vk::DeviceSize,
    count_buffer: vk::Buffer,
    mut count_offset: vk::DeviceSize,
    mut maximum: u32,
    mut stride: u32,
) {
    if COUNT_DROPPED.strikes(maximum > 0) {
        return;
    }
    COUNT_OFFSET.replaces(&mut count_offset, 0);
    COUNT_MAXIMUM.changes(&mut maximum, |maximum| 2 * maximum);
    COUNT_STRIDE.replaces(&mut stride, 16);
    let is_counted = !COUNT_IGNORED.strikes(true);
    record(commands, Kind::Indirect, false, move || {
        let next = next();
        // SAFETY: see the crate.
        unsafe {
            if is_counted {
                let draw = next.cmd_draw_indirect_count;
                draw(commands, buffer, offset, count_buffer, count_offset, maximum, stride);
            } else {
                (next.cmd_draw_indirect)(commands, buffer, offset, maximum, stride);
            }
        }
    });
}

pub(super) unsafe extern "system" fn cmd_draw_indexed_indirect_count(
    commands: vk::CommandBuffer,
    buffer: vk::Buffer,
    offset: vk::DeviceSize,
    count_buffer: vk::Buffer,
    mut count_offset: vk::DeviceSize,
    mut maximum: u32,
    stride: u32,
) {
    if INDEXED_COUNT_DROPPED.strikes(maximum > 0) {
        return;
    }
    INDEXED_COUNT_OFFSET.replaces(&mut count_offset, 0);
    INDEXED_COUNT_MAXIMUM.changes(&mut maximum, |maximum| 2 * maximum);
    let is_counted = !INDEXED_COUNT_IGNORED.strikes(true);
    record(commands, Kind::Indirect, false, move || {
        let next = next();
        // SAFETY: see the crate.
        unsafe {
            if is_counted {
                let draw = next.cmd_draw_indexed_indirect_count;
                draw(commands, buffer, offset, count_buffer, count_offset, maximum, stride);
            } else {
                (next.cmd_draw_indexed_indirect)(commands, buffer, offset, maximum, stride);
            }
        }
    });
}

pub(super) unsafe extern "system" fn cmd_draw_multi(
    commands: vk::CommandBuffer,
    mut count: u32,
    draws: *const vk::MultiDrawInfoEXT,
    instances: u32,
    mut first_instance: u32,
    mut stride: u32,
) {
    if MULTI_DROPPED.strikes(count > 0) {
        return;
    }
    MULTI_FIRST_ONLY.changes(&mut count, |count| count.min(1));
    MULTI_STRIDE.replaces(&mut stride, size_of::<vk::MultiDrawInfoEXT>() as u32);
    MULTI_FIRST_INSTANCE.replaces(&mut first_instance, 0);
    // SAFETY: see the crate.
    unsafe { (next().cmd_draw_multi)(commands, count, draws, instances, first_instance, stride) };
}

pub(super) unsafe extern "system" fn cmd_draw_multi_indexed(
    commands: vk::CommandBuffer,
    mut count: u32,
    draws: *const vk::MultiDrawIndexedInfoEXT,
    instances: u32,
    first_instance: u32,
    stride: u32,
    mut offset: *const i32,
) {
    MULTI_INDEXED_FIRST_ONLY.changes(&mut count, |count| count.min(1));
    MULTI_INDEXED_OFFSET.replaces(&mut offset, std::ptr::null());
    // SAFETY: see the crate.
    unsafe { (next().cmd_draw_multi_indexed)(commands, count, draws, instances, first_instance, stride, offset) };
}

pub(super) unsafe extern "system" fn cmd_clear_attachments(
    commands: vk::CommandBuffer,
    count: u32,
    attachments: *const vk::ClearAttachment,
    rectangle_count: u32,
    rectangles: *const vk::ClearRect,
) {
    // SAFETY: see the crate.
    let (attachments, rectangles) =
        unsafe { (slice(attachments, count).to_vec(), slice(rectangles, rectangle_count).to_vec()) };
    let clear: Deferred = Box::new(move || {
        let clear = next().cmd_clear_attachments;
        // SAFETY: see the crate.
        unsafe { clear(commands, count, attachments.as_ptr(), rectangle_count, rectangles.as_ptr()) };
    });
    let now = of(commands, |recording| {
        if SET_CLEARED.strikes(recording.in_set) {
            recording.after_set.push(clear);
            return None;
        }
        Some(clear)
    });
    if let Some(clear) = now {
        clear();
    }
}
