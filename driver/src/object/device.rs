//! Logical devices.

use crate::capabilities::memory;
use crate::dispatch::Enabled;
use crate::environment::{self, Dump};
use crate::error::Error;
use crate::handle;
use crate::object::instance::Instance;
use crate::object::memory::Heap;
use crate::object::queue::Queue;
use crate::object::signals::Signals;
use crate::registry::features::Features;
use ash::vk;
use simdevice::CommandProcessor;
use std::ffi::CStr;
use std::sync::{Arc, OnceLock};

/// A logical device over a simulated device of its own.
pub(crate) struct Device {
    instance: Arc<Instance>,
    extensions: Vec<&'static CStr>,
    features: Features,
    simulated: Arc<simdevice::Device>,
    dump: Dump,
    signals: Arc<Signals>,
    heap: Arc<Heap>,
    queues: OnceLock<Vec<vk::Queue>>,
}

crate::objects! {
    vk::Device => Device {
        fn reporting_instance(&self) -> Option<Arc<Instance>> {
            Some(Arc::clone(&self.instance))
        }
    };
}

impl Device {
    /// Opens a device with `queue_count` queues.
    ///
    /// # Errors
    /// [`Error::InitializationFailed`] if the host gives no thread for a queue, or the environment makes no sense.
    pub(crate) fn new(
        instance: Arc<Instance>,
        extensions: Vec<&'static CStr>,
        features: Features,
        simulated: simdevice::Device,
        queue_count: u32,
    ) -> Result<Arc<Self>, Error> {
        let device = Arc::new(Self {
            instance,
            extensions,
            features,
            simulated: Arc::new(simulated),
            dump: environment::dump()?,
            signals: Arc::default(),
            heap: Arc::new(Heap::new(memory::heap_size())),
            queues: OnceLock::new(),
        });
        let start = |_| {
            let processor = CommandProcessor::new(Arc::clone(&device.simulated));
            Queue::start(
                Arc::downgrade(&device),
                Arc::clone(&device.signals),
                processor,
            )
        };
        let queues: Vec<_> = (0..queue_count).map(start).collect::<Result<_, _>>()?;
        device
            .queues
            .get_or_init(|| queues.into_iter().map(handle::create).collect());
        Ok(device)
    }

    /// The features that the application enabled.
    pub(crate) fn features(&self) -> &Features {
        &self.features
    }

    /// The simulated device.
    pub(crate) fn simulated(&self) -> &simdevice::Device {
        &self.simulated
    }

    /// Whether the device's programs are printed as pipelines are created.
    pub(crate) fn dumps_ir(&self) -> bool {
        self.dump.ir
    }

    /// What is waited for on it, and whether it is lost.
    pub(crate) fn signals(&self) -> &Arc<Signals> {
        &self.signals
    }

    /// The heap of a memory type and whether the host may map memory of it; `None` if there is no such type.
    pub(crate) fn memory_type(&self, index: u32) -> Option<(&Arc<Heap>, bool)> {
        let properties = memory::type_properties(index)?;
        let host_visible = properties.contains(vk::MemoryPropertyFlags::HOST_VISIBLE);
        Some((&self.heap, host_visible))
    }

    /// The handle of queue `index`.
    pub(crate) fn queue(&self, index: u32) -> Option<vk::Queue> {
        self.queues().get(index as usize).copied()
    }

    /// The handles of its queues.
    pub(crate) fn queues(&self) -> &[vk::Queue] {
        self.queues.get().map_or(&[], Vec::as_slice)
    }

    /// What gates commands that are looked up through this device.
    pub(crate) fn enabled(&self) -> Enabled<'_> {
        Enabled {
            device_extensions: &self.extensions,
            ..self.instance.enabled()
        }
    }

    /// Executes what its queues were given and joins their threads.
    pub(crate) fn stop(&self) {
        for &queue in self.queues() {
            // SAFETY: the handle was made with the device and lives as long.
            match unsafe { handle::get(queue) } {
                Ok(queue) => queue.stop(),
                Err(error) => log::error!("a queue's handle was overwritten: {error}"),
            }
        }
    }

    /// Its instance.
    pub(crate) fn instance(&self) -> &Arc<Instance> {
        &self.instance
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        for &queue in self.queues() {
            // SAFETY: the handle was made with the device, and the application may not use it once that is destroyed.
            if let Err(error) = unsafe { handle::destroy(queue) } {
                log::error!("a queue's handle was overwritten: {error}");
            }
        }
    }
}
