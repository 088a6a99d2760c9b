//! Fences, semaphores and events.

use crate::abi::error::Error;
use crate::abi::handle::objects;
use crate::abi::sanitizer::{acquire, release};
use crate::device::Device;
use crate::device_sync::{DeviceSync, WaitResult, deadline};
use ash::vk;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

objects! {
    vk::Fence => Fence;
    vk::Semaphore => Semaphore;
    vk::Event => Event;
}

/// A fence.
#[derive(Debug)]
pub(crate) struct Fence {
    sync: Arc<DeviceSync>,
    signaled: AtomicBool,
}

impl Fence {
    /// A fence, signaled or not.
    pub(crate) fn new(sync: Arc<DeviceSync>, signaled: bool) -> Self {
        Self { sync, signaled: AtomicBool::new(signaled) }
    }

    /// Reports whether it is signaled.
    pub(crate) fn is_signaled(&self) -> bool {
        let is_signaled = self.signaled.load(Ordering::Acquire);
        if is_signaled {
            acquire(self);
        }
        is_signaled
    }

    /// Signals the fence.
    pub(crate) fn signal(&self) {
        release(self);
        self.sync.update(|| self.signaled.store(true, Ordering::Release));
    }

    /// Resets the fence.
    pub(crate) fn reset(&self) {
        self.signaled.store(false, Ordering::Release);
    }
}

/// A semaphore.
#[derive(Debug)]
pub(crate) struct Semaphore {
    sync: Arc<DeviceSync>,
    payload: Payload,
}

#[derive(Debug)]
enum Payload {
    Binary(AtomicBool),
    Timeline(AtomicU64),
}

impl Semaphore {
    /// An unsignaled binary semaphore.
    pub(crate) fn new_binary(sync: Arc<DeviceSync>) -> Self {
        Self { sync, payload: Payload::Binary(AtomicBool::new(false)) }
    }

    /// A timeline semaphore with an initial value.
    pub(crate) fn new_timeline(sync: Arc<DeviceSync>, value: u64) -> Self {
        Self { sync, payload: Payload::Timeline(AtomicU64::new(value)) }
    }

    /// The value of a timeline semaphore; `None` for a binary one.
    pub(crate) fn value(&self) -> Option<u64> {
        match &self.payload {
            Payload::Binary(_) => None,
            Payload::Timeline(value) => {
                let value = value.load(Ordering::Acquire);
                acquire(self);
                Some(value)
            }
        }
    }

    /// Signals the semaphore; a timeline semaphore gets `value`.
    pub(crate) fn signal(&self, value: u64) {
        release(self);
        self.sync.update(|| match &self.payload {
            Payload::Binary(signaled) => signaled.store(true, Ordering::Release),
            // A smaller value is the application's error; a timeline never decreases.
            Payload::Timeline(current) => {
                current.fetch_max(value, Ordering::AcqRel);
            }
        });
    }

    /// Reports whether a wait for `value` (which a binary semaphore ignores) has ended.
    pub(crate) fn is_reached(&self, value: u64) -> bool {
        let is_reached = match &self.payload {
            Payload::Binary(signaled) => signaled.load(Ordering::Acquire),
            Payload::Timeline(current) => current.load(Ordering::Acquire) >= value,
        };
        if is_reached {
            acquire(self);
        }
        is_reached
    }

    /// Ends a queue's wait: a binary semaphore becomes unsignaled.
    pub(crate) fn consume(&self) {
        if let Payload::Binary(signaled) = &self.payload {
            signaled.store(false, Ordering::Release);
        }
    }
}

/// An event.
#[derive(Debug)]
pub(crate) struct Event {
    sync: Arc<DeviceSync>,
    value: AtomicBool,
}

impl Event {
    /// An event that is not set.
    pub(crate) fn new(sync: Arc<DeviceSync>) -> Self {
        Self { sync, value: AtomicBool::new(false) }
    }

    /// Reports whether it is set.
    pub(crate) fn is_set(&self) -> bool {
        let is_set = self.value.load(Ordering::Acquire);
        if is_set {
            acquire(self);
        }
        is_set
    }

    /// Sets or resets the event.
    pub(crate) fn set(&self, value: bool) {
        release(self);
        self.sync.update(|| self.value.store(value, Ordering::Release));
    }
}

/// The result of a wait.
fn wait_result(waited: WaitResult, loss: impl FnOnce() -> Result<(), Error>) -> Result<vk::Result, Error> {
    match waited {
        WaitResult::Ready => Ok(vk::Result::SUCCESS),
        WaitResult::TimedOut => Ok(vk::Result::TIMEOUT),
        WaitResult::Lost => loss().map(|()| vk::Result::ERROR_DEVICE_LOST),
    }
}

fn timeline_value(semaphore: &Semaphore) -> Result<u64, Error> {
    semaphore.value().ok_or_else(|| {
        Error::usage(
            "VUID-vkGetSemaphoreCounterValue-semaphore-03255",
            "the semaphore is binary, but the command takes a timeline semaphore",
        )
    })
}

#[doc(alias = "vkCreateFence")]
pub(crate) fn create_fence(device: &Device, create_info: &vk::FenceCreateInfo<'_>) -> Result<Arc<Fence>, Error> {
    let signaled = create_info.flags.contains(vk::FenceCreateFlags::SIGNALED);
    Ok(Arc::new(Fence::new(Arc::clone(device.sync()), signaled)))
}

#[doc(alias = "vkResetFences")]
pub(crate) fn reset_fences(fences: &[Arc<Fence>]) -> Result<(), Error> {
    fences.iter().for_each(|fence| fence.reset());
    Ok(())
}

#[doc(alias = "vkGetFenceStatus")]
pub(crate) fn get_fence_status(device: &Device, fence: &Fence) -> Result<vk::Result, Error> {
    if fence.is_signaled() {
        return Ok(vk::Result::SUCCESS);
    }
    device.sync().check()?;
    Ok(vk::Result::NOT_READY)
}

#[doc(alias = "vkWaitForFences")]
pub(crate) fn wait_for_fences(
    device: &Device,
    fences: &[Arc<Fence>],
    wait_all: bool,
    timeout: u64,
) -> Result<vk::Result, Error> {
    let sync = device.sync();
    let waited = sync.wait(deadline(timeout), || {
        let mut signaled = fences.iter().map(|fence| fence.is_signaled());
        if wait_all { signaled.all(|s| s) } else { signaled.any(|s| s) }
    });
    wait_result(waited, || sync.check())
}

#[doc(alias = "vkCreateSemaphore")]
pub(crate) fn create_semaphore(
    device: &Device,
    exports: Option<&vk::ExportSemaphoreCreateInfo<'_>>,
    kind: Option<&vk::SemaphoreTypeCreateInfo<'_>>,
) -> Result<Arc<Semaphore>, Error> {
    let sync = Arc::clone(device.sync());
    if exports.is_some_and(|export| !export.handle_types.is_empty()) {
        return Err(Error::FeatureNotPresent("exporting semaphores".into()));
    }
    Ok(Arc::new(match kind {
        Some(kind) if kind.semaphore_type == vk::SemaphoreType::TIMELINE => {
            Semaphore::new_timeline(sync, kind.initial_value)
        }
        _ => Semaphore::new_binary(sync),
    }))
}

#[doc(alias = "vkGetSemaphoreCounterValue")]
pub(crate) fn get_semaphore_counter_value(device: &Device, semaphore: &Semaphore) -> Result<u64, Error> {
    device.sync().check()?;
    timeline_value(semaphore)
}

#[doc(alias = "vkWaitSemaphores")]
pub(crate) fn wait_semaphores(
    device: &Device,
    flags: vk::SemaphoreWaitFlags,
    semaphores: &[Arc<Semaphore>],
    values: &[u64],
    timeout: u64,
) -> Result<vk::Result, Error> {
    let sync = device.sync();
    for semaphore in semaphores {
        timeline_value(semaphore)?;
    }
    let any = flags.contains(vk::SemaphoreWaitFlags::ANY);
    let waited = sync.wait(deadline(timeout), || {
        let mut reached = semaphores.iter().zip(values).map(|(s, &value)| s.is_reached(value));
        if any { reached.any(|r| r) } else { reached.all(|r| r) }
    });
    wait_result(waited, || sync.check())
}

#[doc(alias = "vkSignalSemaphore")]
pub(crate) fn signal_semaphore(semaphore: &Semaphore, value: u64) -> Result<(), Error> {
    timeline_value(semaphore)?;
    semaphore.signal(value);
    Ok(())
}

#[doc(alias = "vkCreateEvent")]
pub(crate) fn create_event(device: &Device, _create_info: &vk::EventCreateInfo<'_>) -> Result<Arc<Event>, Error> {
    Ok(Arc::new(Event::new(Arc::clone(device.sync()))))
}

#[doc(alias = "vkGetEventStatus")]
pub(crate) fn get_event_status(device: &Device, event: &Event) -> Result<vk::Result, Error> {
    device.sync().check()?;
    Ok(if event.is_set() { vk::Result::EVENT_SET } else { vk::Result::EVENT_RESET })
}

#[doc(alias = "vkSetEvent")]
pub(crate) fn set_event(event: &Event) -> Result<(), Error> {
    event.set(true);
    Ok(())
}

#[doc(alias = "vkResetEvent")]
pub(crate) fn reset_event(event: &Event) -> Result<(), Error> {
    event.set(false);
    Ok(())
}
