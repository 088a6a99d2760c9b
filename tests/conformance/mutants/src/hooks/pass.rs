//! Render passes, dynamic rendering and secondary command buffers.

use ash::vk;

use crate::next::next;
use crate::recording::{forget, of};
use crate::table::*;
use gaurast_layer_interface::slice;

use super::gaussian::end_open_set;

/// The copies of a rendering's attachments.
fn changed(
    attachments: &[vk::RenderingAttachmentInfo<'static>],
    is_color: bool,
) -> Vec<vk::RenderingAttachmentInfo<'static>> {
    let change = |mut attachment: vk::RenderingAttachmentInfo<'static>| {
        if is_color && attachment.load_op == vk::AttachmentLoadOp::CLEAR {
            // SAFETY: a colour attachment's clear value is a colour; any bits are floats.
            let color = unsafe { attachment.clear_value.color.float32 };
            if CLEAR_COLOR.strikes(color != [0.0; 4]) {
                attachment.clear_value = vk::ClearValue::default();
            }
            CLEAR_LOADS.replaces(&mut attachment.load_op, vk::AttachmentLoadOp::LOAD);
        }
        if is_color && attachment.load_op == vk::AttachmentLoadOp::LOAD {
            LOAD_CLEARS.replaces(&mut attachment.load_op, vk::AttachmentLoadOp::CLEAR);
        }
        if attachment.resolve_mode == vk::ResolveModeFlags::AVERAGE {
            RESOLVE_MODE.replaces(&mut attachment.resolve_mode, vk::ResolveModeFlags::SAMPLE_ZERO);
        }
        attachment
    };
    attachments.iter().copied().map(change).collect()
}

pub(super) unsafe extern "system" fn cmd_begin_rendering(
    commands: vk::CommandBuffer,
    info: *const vk::RenderingInfo<'_>,
) {
    // SAFETY: see the crate; copies end with the call.
    unsafe {
        let mut info: vk::RenderingInfo<'static> = *info.cast();
        let colors = changed(slice(info.p_color_attachments, info.color_attachment_count), true);
        info.p_color_attachments = colors.as_ptr();
        let area = info.render_area;
        if RENDER_AREA.strikes(area.offset != vk::Offset2D::default()) {
            info.render_area.offset = vk::Offset2D::default();
            info.render_area.extent.width += area.offset.x as u32;
            info.render_area.extent.height += area.offset.y as u32;
        }
        let is_resumed = info.flags.contains(vk::RenderingFlags::RESUMING);
        let drops_draws = RESUMED_DROPPED.strikes(is_resumed) || VIEWS_DROPPED.strikes(info.view_mask.count_ones() > 1);
        of(commands, |recording| recording.drops_draws = drops_draws);
        if RESUMED_CLEARS.strikes(info.flags.intersects(SPLIT)) {
            info.flags &= !SPLIT;
        }
        (next().cmd_begin_rendering)(commands, &raw const info);
    }
}

/// The flags of a rendering in several parts.
const SPLIT: vk::RenderingFlags =
    vk::RenderingFlags::from_raw(vk::RenderingFlags::SUSPENDING.as_raw() | vk::RenderingFlags::RESUMING.as_raw());

pub(super) unsafe extern "system" fn cmd_end_rendering(commands: vk::CommandBuffer) {
    end_open_set(commands);
    of(commands, |recording| recording.drops_draws = false);
    // SAFETY: see the crate.
    unsafe { (next().cmd_end_rendering)(commands) };
}

pub(super) unsafe extern "system" fn cmd_begin_render_pass(
    commands: vk::CommandBuffer,
    info: *const vk::RenderPassBeginInfo<'_>,
    contents: vk::SubpassContents,
) {
    // SAFETY: see the crate.
    unsafe {
        let mut info = *info;
        let mut values = slice(info.p_clear_values, info.clear_value_count).to_vec();
        if PASS_OBJECT_CLEAR.strikes(values.iter().any(|value| value.color.float32 != [0.0; 4])) {
            values.fill(vk::ClearValue::default());
        }
        info.p_clear_values = values.as_ptr();
        (next().cmd_begin_render_pass)(commands, &raw const info, contents);
    }
}

pub(super) unsafe extern "system" fn cmd_next_subpass(commands: vk::CommandBuffer, contents: vk::SubpassContents) {
    end_open_set(commands);
    let drops_draws = SECOND_SUBPASS.strikes(true);
    of(commands, |recording| recording.drops_draws = drops_draws);
    // SAFETY: see the crate.
    unsafe { (next().cmd_next_subpass)(commands, contents) };
}

pub(super) unsafe extern "system" fn cmd_end_render_pass(commands: vk::CommandBuffer) {
    end_open_set(commands);
    of(commands, |recording| recording.drops_draws = false);
    // SAFETY: see the crate.
    unsafe { (next().cmd_end_render_pass)(commands) };
}

pub(super) unsafe extern "system" fn cmd_execute_commands(
    commands: vk::CommandBuffer,
    count: u32,
    secondaries: *const vk::CommandBuffer,
) {
    if SECONDARIES_DROPPED.strikes(count > 0) {
        return;
    }
    // SAFETY: see the crate.
    unsafe {
        let mut secondaries = slice(secondaries, count).to_vec();
        if SECONDARIES_FIRST_ONLY.strikes(count > 1) {
            secondaries.truncate(1);
        }
        if SECONDARIES_REVERSED.strikes(count > 1) {
            secondaries.reverse();
        }
        (next().cmd_execute_commands)(commands, secondaries.len() as u32, secondaries.as_ptr());
    }
}

pub(super) unsafe extern "system" fn begin_command_buffer(
    commands: vk::CommandBuffer,
    info: *const vk::CommandBufferBeginInfo<'_>,
) -> vk::Result {
    forget(commands);
    super::submit::forget_submissions(commands);
    // SAFETY: see the crate.
    unsafe { (next().begin_command_buffer)(commands, info) }
}

pub(super) unsafe extern "system" fn end_command_buffer(commands: vk::CommandBuffer) -> vk::Result {
    let waiting = of(commands, |recording| std::mem::take(&mut recording.after_all));
    waiting.into_iter().for_each(|command| command());
    super::submit::remember_memory();
    // SAFETY: see the crate.
    unsafe { (next().end_command_buffer)(commands) }
}
