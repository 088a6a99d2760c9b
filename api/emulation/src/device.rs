//! Devices that live, and their command buffers.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError, RwLock};

use ash::vk;
use gaurast_layer_interface::Live;

use crate::emulation::Emulation;
use crate::next::Next;
use crate::recording::Recording;

/// A device.
pub(crate) struct Device {
    pub(crate) next: Arc<Next>,
    pub(crate) get_device_proc_addr: vk::PFN_vkGetDeviceProcAddr,
    /// The emulation, if the application has enabled the extension and it comes from here.
    pub(crate) emulation: Option<Emulation>,
    /// Command buffers, of devices with the extension.
    recordings: RwLock<HashMap<vk::CommandBuffer, Arc<Mutex<Recording>>>>,
}

/// The devices that live.
static DEVICES: Live<Device> = Live::new();

impl Device {
    pub(crate) fn new(
        next: Arc<Next>,
        get_device_proc_addr: vk::PFN_vkGetDeviceProcAddr,
        emulation: Option<Emulation>,
    ) -> Self {
        Self { next, get_device_proc_addr, emulation, recordings: RwLock::default() }
    }

    /// Remembers a device.
    ///
    /// # Safety
    /// The next layer has just made it.
    pub(crate) unsafe fn register(self) {
        // SAFETY: the caller's promise.
        unsafe { DEVICES.insert(self.next.handle(), self) };
    }

    /// The device of a handle of its own, of a queue or of a command buffer.
    ///
    /// # Safety
    /// The handle is valid.
    pub(crate) unsafe fn of<H: vk::Handle>(handle: H) -> Option<Arc<Self>> {
        // SAFETY: the caller's promise.
        unsafe { DEVICES.of(handle) }
    }

    /// Forgets a device, and gives it a last time.
    ///
    /// # Safety
    /// The handle is valid.
    pub(crate) unsafe fn forget(handle: vk::Device) -> Option<Arc<Self>> {
        // SAFETY: the caller's promise.
        unsafe { DEVICES.remove(handle) }
    }

    /// The recording of a command buffer.
    pub(crate) fn recording(&self, commands: vk::CommandBuffer) -> Option<Arc<Mutex<Recording>>> {
        let all = self.recordings.read().unwrap_or_else(PoisonError::into_inner);
        all.get(&commands).cloned()
    }

    pub(crate) fn add_recording(&self, recording: Recording) {
        let mut all = self.recordings.write().unwrap_or_else(PoisonError::into_inner);
        all.insert(recording.commands, Arc::new(Mutex::new(recording)));
    }

    pub(crate) fn remove_recording(&self, commands: vk::CommandBuffer) {
        let mut all = self.recordings.write().unwrap_or_else(PoisonError::into_inner);
        all.remove(&commands);
    }

    /// Drops all that uses the device.
    pub(crate) fn clear(&self) {
        self.recordings.write().unwrap_or_else(PoisonError::into_inner).clear();
        if let Some(emulation) = &self.emulation {
            emulation.clear();
        }
    }
}
