//! Commands for synchronization.

use super::Command;
use super::buffer::Recorder;
use crate::abi::error::Error;
use crate::sync::Event;
use simdevice::Packet;
use std::sync::Arc;

/// Records a barrier, which makes everything before it visible to everything after it, whatever stages and resources it
/// names.
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

/// Records the setting or resetting of an event.
fn set_event(recorder: &mut Recorder, event: &Arc<Event>, value: bool) -> Result<(), Error> {
    recorder.require_outside_pass()?;
    recorder.push(Command::SetEvent(Arc::clone(event), value));
    Ok(())
}

/// Does nothing: a group has only one device.
#[doc(alias = "vkCmdSetDeviceMask")]
pub(crate) fn cmd_set_device_mask(_recorder: &mut Recorder) -> Result<(), Error> {
    Ok(())
}
