//! The site of a command: the device and the command buffer that it concerns.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::PoisonError;

use ash::vk;

use crate::device::Device;
use crate::emulation::Emulation;
use crate::next::Next;
use crate::recording::Recording;
use crate::report::tell;

/// A command buffer that a command is recorded in, with what is known of it.
pub(super) struct Site<'a> {
    pub(super) next: &'a Next,
    pub(super) emulation: &'a Emulation,
    pub(super) device: &'a Device,
}

/// Runs a command of a command buffer: `known` where its device has the extension from here, `passed_on` elsewhere. A panic goes
/// no further.
///
/// # Safety
/// The command buffer is valid.
pub(super) unsafe fn record(
    commands: vk::CommandBuffer,
    known: impl FnOnce(&Site<'_>, &mut Recording),
    passed_on: impl FnOnce(&Next),
) {
    // SAFETY: the caller's promise.
    let Some(device) = (unsafe { Device::of(commands) }) else {
        return;
    };
    let ran = catch_unwind(AssertUnwindSafe(|| {
        let recording = device.recording(commands);
        match (&device.emulation, recording) {
            (Some(emulation), Some(recording)) => {
                let mut recording = recording.lock().unwrap_or_else(PoisonError::into_inner);
                known(&Site { next: &device.next, emulation, device: &device }, &mut recording);
            }
            _ => passed_on(&device.next),
        }
    }));
    if ran.is_err() {
        tell("a defect of the layer; a command is left out");
    }
}

/// Runs a command of a device. A panic goes no further.
///
/// # Safety
/// The device is valid.
pub(super) unsafe fn call<H: vk::Handle>(handle: H, run: impl FnOnce(&Device) -> vk::Result) -> vk::Result {
    // SAFETY: the caller's promise.
    let Some(device) = (unsafe { Device::of(handle) }) else {
        return vk::Result::ERROR_INITIALIZATION_FAILED;
    };
    catch_unwind(AssertUnwindSafe(|| run(&device))).unwrap_or_else(|_| {
        tell("a defect of the layer; a command fails");
        vk::Result::ERROR_UNKNOWN
    })
}
