//! Commands that write buffers: copies, updates, fills and dispatches.

use ash::vk;

use crate::mutant::Mutant;
use crate::next::next;
use crate::recording::of;
use crate::table::*;
use gaurast_layer_interface::slice;

/// Records a command, but not if one mutant is active, and late if another is.
fn record(
    commands: vk::CommandBuffer,
    dropped: &'static Mutant,
    late: &'static Mutant,
    command: impl FnOnce() + Send + 'static,
) {
    if dropped.strikes(true) {
        return;
    }
    if late.strikes(true) {
        of(commands, |recording| recording.after_all.push(Box::new(command)));
    } else {
        command();
    }
}

pub(super) unsafe extern "system" fn cmd_copy_buffer(
    commands: vk::CommandBuffer,
    from: vk::Buffer,
    to: vk::Buffer,
    count: u32,
    regions: *const vk::BufferCopy,
) {
    // SAFETY: see the crate.
    let regions = unsafe { slice(regions, count).to_vec() };
    record(commands, &COPY_DROPPED, &COPY_LATE, move || {
        // SAFETY: see the crate.
        unsafe { (next().cmd_copy_buffer)(commands, from, to, count, regions.as_ptr()) };
    });
}

pub(super) unsafe extern "system" fn cmd_update_buffer(
    commands: vk::CommandBuffer,
    buffer: vk::Buffer,
    offset: vk::DeviceSize,
    size: vk::DeviceSize,
    bytes: *const std::ffi::c_void,
) {
    let is_later = of(commands, |recording| recording.count("update")) > 0;
    if UPDATE_FIRST_ONLY.strikes(is_later) {
        return;
    }
    // SAFETY: see the crate.
    let bytes = unsafe { slice(bytes.cast::<u8>(), size as u32).to_vec() };
    record(commands, &UPDATE_DROPPED, &UPDATE_LATE, move || {
        // SAFETY: see the crate.
        unsafe { (next().cmd_update_buffer)(commands, buffer, offset, size, bytes.as_ptr().cast()) };
    });
}

pub(super) unsafe extern "system" fn cmd_fill_buffer(
    commands: vk::CommandBuffer,
    buffer: vk::Buffer,
    offset: vk::DeviceSize,
    size: vk::DeviceSize,
    value: u32,
) {
    if !FILL_DROPPED.strikes(true) {
        // SAFETY: see the crate.
        unsafe { (next().cmd_fill_buffer)(commands, buffer, offset, size, value) };
    }
}

pub(super) unsafe extern "system" fn cmd_dispatch(commands: vk::CommandBuffer, x: u32, y: u32, z: u32) {
    record(commands, &DISPATCH_DROPPED, &DISPATCH_LATE, move || {
        // SAFETY: see the crate.
        unsafe { (next().cmd_dispatch)(commands, x, y, z) };
    });
}

pub(super) unsafe extern "system" fn cmd_copy_query_pool_results(
    commands: vk::CommandBuffer,
    pool: vk::QueryPool,
    first: u32,
    count: u32,
    buffer: vk::Buffer,
    offset: vk::DeviceSize,
    stride: vk::DeviceSize,
    flags: vk::QueryResultFlags,
) {
    if !OCCLUSION_COPIED.strikes(count > 0) {
        let copy = next().cmd_copy_query_pool_results;
        // SAFETY: see the crate.
        unsafe { copy(commands, pool, first, count, buffer, offset, stride, flags) };
    }
}
