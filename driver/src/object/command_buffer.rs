//! Command pools and their command buffers.

use crate::command::recorder::Recorder;
use crate::error::Error;
use crate::handle;
use crate::object::device::Device;
use crate::object::instance::Instance;
use ash::vk;
use simdevice::host;
use std::collections::HashSet;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A command pool. It owns the handles of its command buffers.
pub(crate) struct CommandPool {
    device: Arc<Device>,
    /// Whether single command buffers may be reset.
    resets_single: bool,
    buffers: Mutex<HashSet<vk::CommandBuffer>>,
}

/// A command buffer.
pub(crate) struct CommandBuffer {
    device: Arc<Device>,
    level: vk::CommandBufferLevel,
    resets_single: bool,
    recorder: Mutex<Recorder>,
}

crate::objects! {
    vk::CommandPool => CommandPool;
    vk::CommandBuffer => CommandBuffer {
        fn reporting_instance(&self) -> Option<Arc<Instance>> {
            self.device.reporting_instance()
        }
    };
}

impl CommandPool {
    /// An empty pool.
    pub(crate) fn new(device: Arc<Device>, flags: vk::CommandPoolCreateFlags) -> Self {
        Self {
            device,
            resets_single: flags.contains(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER),
            buffers: Mutex::default(),
        }
    }

    fn lock(&self) -> MutexGuard<'_, HashSet<vk::CommandBuffer>> {
        self.buffers.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Makes a command buffer.
    pub(crate) fn allocate(&self, level: vk::CommandBufferLevel) -> vk::CommandBuffer {
        let buffer = handle::create(Arc::new(CommandBuffer {
            device: Arc::clone(&self.device),
            level,
            resets_single: self.resets_single,
            recorder: Mutex::new(Recorder::new()),
        }));
        self.lock().insert(buffer);
        buffer
    }

    /// Frees command buffers of this pool; others are left alone.
    ///
    /// # Errors
    /// [`Error::Usage`] if one is not of this pool.
    ///
    /// # Safety
    /// Nothing uses the handles any more.
    pub(crate) unsafe fn free(&self, buffers: &[vk::CommandBuffer]) -> Result<(), Error> {
        let null = vk::CommandBuffer::null();
        for &buffer in buffers.iter().filter(|&&buffer| buffer != null) {
            if !self.lock().remove(&buffer) {
                return Err(Error::usage(
                    "VUID-vkFreeCommandBuffers-pCommandBuffers-parent",
                    "a command buffer is not of the pool",
                ));
            }
            // SAFETY: the pool made the handle and has not destroyed it, and the caller uses it no more.
            unsafe { handle::destroy(buffer) }?;
        }
        Ok(())
    }

    /// Frees every command buffer.
    ///
    /// # Safety
    /// As [`CommandPool::free`].
    pub(crate) unsafe fn free_all(&self) -> Result<(), Error> {
        let all: Vec<_> = self.lock().iter().copied().collect();
        // SAFETY: the caller's promise.
        unsafe { self.free(&all) }
    }

    /// Resets every command buffer.
    ///
    /// # Errors
    /// [`Error::Usage`] if one is pending.
    pub(crate) fn reset(&self) -> Result<(), Error> {
        self.lock().iter().try_for_each(|&buffer| {
            // SAFETY: the pool made the handle and has not destroyed it.
            unsafe { handle::get(buffer) }?.recorder().reset()
        })
    }
}

impl CommandBuffer {
    /// Its recorder. Vulkan has the application use a command buffer from one thread at a time, so that nobody waits.
    pub(crate) fn recorder(&self) -> MutexGuard<'_, Recorder> {
        self.recorder.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether it is a secondary command buffer.
    pub(crate) fn is_secondary(&self) -> bool {
        self.level == vk::CommandBufferLevel::SECONDARY
    }

    /// Whether it may be reset by itself, be it by beginning it again.
    pub(crate) fn resets_single(&self) -> bool {
        self.resets_single
    }

    /// Ends recording.
    ///
    /// # Errors
    /// That of [`Recorder::end`], or [`Error::Panic`] if a command panicked while it was recorded and so is missing.
    pub(crate) fn end(&self) -> Result<(), Error> {
        let panicked = self.recorder.is_poisoned();
        self.recorder.clear_poison();
        let mut recorder = self.recorder();
        if panicked {
            recorder.fail(Error::Panic(
                "a command panicked while it was recorded".into(),
            ));
        }
        recorder.end()
    }

    /// Records: an error of `record` is reported now, and `vkEndCommandBuffer` fails with the first.
    ///
    /// # Errors
    /// That of `record`, or [`Error::Usage`] if the command buffer is not recording.
    pub(crate) fn record(
        &self,
        record: impl FnOnce(&mut Recorder) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let mut recorder = self.recorder();
        recorder.require_recording()?;
        let recorded = host::catch(|| record(&mut recorder))
            .unwrap_or_else(|memory| Err(Error::OutOfHostMemory(memory.to_string())));
        recorded.inspect_err(|error| recorder.fail(error.clone()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registry::features::Features;

    #[test]
    fn a_panic_while_recording_fails_the_recording() {
        let instance = Instance::new(vk::API_VERSION_1_3, &[]).unwrap();
        let simulated = simdevice::Device::new(&simdevice::Config::default()).unwrap();
        let features = Features::NONE;
        let device = Device::new(instance, Vec::new(), features, simulated, 0).unwrap();
        let buffer = CommandBuffer {
            device,
            level: vk::CommandBufferLevel::PRIMARY,
            resets_single: true,
            recorder: Mutex::new(Recorder::new()),
        };
        buffer.recorder().begin(Default::default()).unwrap();
        let record = || buffer.record(|_| panic!("in a test"));
        assert!(std::panic::catch_unwind(std::panic::AssertUnwindSafe(record)).is_err());
        assert!(matches!(buffer.end(), Err(Error::Panic(_))));
        buffer.recorder().begin(Default::default()).unwrap();
        buffer.end().unwrap();
    }
}
