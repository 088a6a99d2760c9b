//! Conditional rendering: a word of a buffer decides whether draws, dispatches and clears of attachments are executed.

use super::Command;
use super::buffer::Recorder;
use crate::abi::error::Error;
use crate::abi::handle;
use crate::resource::buffer::{Buffer, BufferRules};
use ash::vk;

/// The rules on the word's place.
const PREDICATE: BufferRules = BufferRules {
    memory: "VUID-VkConditionalRenderingBeginInfoEXT-buffer-01981",
    range: "VUID-VkConditionalRenderingBeginInfoEXT-offset-01983",
};

/// # Safety
/// The info's handle is live.
#[doc(alias = "vkCmdBeginConditionalRenderingEXT")]
pub(crate) unsafe fn cmd_begin_conditional_rendering(
    recorder: &mut Recorder,
    conditional_rendering_begin: &vk::ConditionalRenderingBeginInfoEXT<'_>,
) -> Result<(), Error> {
    let info = conditional_rendering_begin;
    // SAFETY: the caller's promise.
    let buffer: &Buffer = unsafe { handle::get(info.buffer)? };
    let predicate = buffer.range(info.offset, Some(4), &PREDICATE)?;
    if !info.offset.is_multiple_of(4) {
        return Err(Error::usage(
            "VUID-VkConditionalRenderingBeginInfoEXT-offset-01984",
            format!("the offset {} is not a multiple of 4", info.offset),
        ));
    }
    let is_inverted = info.flags.contains(vk::ConditionalRenderingFlagsEXT::INVERTED);
    recorder.push(Command::BeginConditional { predicate, is_inverted });
    Ok(())
}

#[doc(alias = "vkCmdEndConditionalRenderingEXT")]
pub(crate) fn cmd_end_conditional_rendering(recorder: &mut Recorder) -> Result<(), Error> {
    recorder.push(Command::EndConditional);
    Ok(())
}
