//! Fences, semaphores and events, and the handles by which fences and semaphores are shared.

use crate::abi::error::Error;
use crate::abi::handle::objects;
use crate::abi::sanitizer::{acquire, release};
use crate::device::Device;
use crate::device_sync::{DeviceSync, WaitResult, deadline};
use crate::external::{self, Kind};
use crate::payload::{Payload, Payloads, outside};
use crate::physical_device::external::{shares_fences, shares_semaphores};
use ash::vk;
use simdevice::host;
use std::ffi::c_int;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

objects! {
    vk::Fence => Fence;
    vk::Semaphore => Semaphore;
    vk::Event => Event;
}

/// A fence.
#[derive(Debug)]
pub(crate) struct Fence {
    sync: Arc<DeviceSync>,
    payloads: Payloads,
    exports: vk::ExternalFenceHandleTypeFlags,
}

impl Fence {
    /// Its payload.
    pub(crate) fn payloads(&self) -> &Payloads {
        &self.payloads
    }

    /// Signals the fence.
    pub(crate) fn signal(&self) {
        self.payloads.current().signal(0);
    }

    /// Resets the fence. An import that is temporary ends before that.
    fn reset(&self) {
        self.payloads.restore().reset();
    }
}

/// A semaphore.
#[derive(Debug)]
pub(crate) struct Semaphore {
    sync: Arc<DeviceSync>,
    payloads: Payloads,
    is_timeline: bool,
    exports: vk::ExternalSemaphoreHandleTypeFlags,
}

impl Semaphore {
    /// Its payload.
    pub(crate) fn payloads(&self) -> &Payloads {
        &self.payloads
    }

    /// Signals the semaphore; a timeline semaphore gets `value`.
    pub(crate) fn signal(&self, value: u64) {
        self.payloads.current().signal(value);
    }

    /// The object that its files are of.
    fn kind(&self) -> Kind {
        if self.is_timeline { Kind::TimelineSemaphore } else { Kind::BinarySemaphore }
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
    semaphore.payloads.current().value().ok_or_else(|| {
        Error::usage(
            "VUID-vkGetSemaphoreCounterValue-semaphore-03255",
            "the semaphore is binary, but the command takes a timeline semaphore",
        )
    })
}

#[doc(alias = "vkCreateFence")]
pub(crate) fn create_fence(
    device: &Device,
    create_info: &vk::FenceCreateInfo<'_>,
    exports: Option<&vk::ExportFenceCreateInfo<'_>>,
) -> Result<Arc<Fence>, Error> {
    let sync = device.sync();
    let is_signaled = create_info.flags.contains(vk::FenceCreateFlags::SIGNALED);
    let exports = exports.map_or_else(Default::default, |exports| exports.handle_types);
    if !exports.is_empty() && !shares_fences(exports) {
        return Err(Error::usage(
            "VUID-VkExportFenceCreateInfo-handleTypes-01446",
            format!("a fence cannot have handles of types {exports:?}: it can have opaque or sync file descriptors"),
        ));
    }
    let payload = if exports == vk::ExternalFenceHandleTypeFlags::OPAQUE_FD {
        Payload::shared(sync, Kind::Fence, is_signaled.into())?
    } else {
        Payload::binary(sync, is_signaled)
    };
    Ok(Arc::new(Fence { sync: Arc::clone(sync), payloads: Payloads::new(payload), exports }))
}

#[doc(alias = "vkResetFences")]
pub(crate) fn reset_fences(fences: &[Arc<Fence>]) -> Result<(), Error> {
    fences.iter().for_each(|fence| fence.reset());
    Ok(())
}

#[doc(alias = "vkGetFenceStatus")]
pub(crate) fn get_fence_status(device: &Device, fence: &Fence) -> Result<vk::Result, Error> {
    if fence.payloads.current().is_reached(0) {
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
    let payloads = host::collect(fences.iter().map(|fence| fence.payloads.current()));
    let waited = sync.wait_for(deadline(timeout), outside(&payloads), || {
        let mut signaled = payloads.iter().map(|payload| payload.is_reached(0));
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
    let sync = device.sync();
    let initial = kind.filter(|kind| kind.semaphore_type == vk::SemaphoreType::TIMELINE).map(|kind| kind.initial_value);
    let is_timeline = initial.is_some();
    let exports = exports.map_or_else(Default::default, |exports| exports.handle_types);
    if !exports.is_empty() && !shares_semaphores(exports, is_timeline) {
        return Err(Error::usage(
            "VUID-VkExportSemaphoreCreateInfo-handleTypes-01124",
            format!(
                "a semaphore cannot have handles of types {exports:?}: a binary one can have opaque or sync file \
                 descriptors, a timeline opaque ones"
            ),
        ));
    }
    let payload = match initial {
        _ if exports == vk::ExternalSemaphoreHandleTypeFlags::OPAQUE_FD => {
            let kind = if is_timeline { Kind::TimelineSemaphore } else { Kind::BinarySemaphore };
            Payload::shared(sync, kind, initial.unwrap_or(0))?
        }
        Some(value) => Payload::timeline(sync, value),
        None => Payload::binary(sync, false),
    };
    Ok(Arc::new(Semaphore { sync: Arc::clone(sync), payloads: Payloads::new(payload), is_timeline, exports }))
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
    let payloads = host::collect(semaphores.iter().map(|semaphore| semaphore.payloads.current()));
    let waited = sync.wait_for(deadline(timeout), outside(&payloads), || {
        let mut reached = payloads.iter().zip(values).map(|(payload, &value)| payload.is_reached(value));
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

/// A kind of descriptor by which payloads are exported.
#[derive(Clone, Copy)]
enum FileKind {
    Opaque,
    Sync,
}

/// The rules on the export of a payload.
struct ExportRules {
    /// The payload must have such a descriptor.
    kind: &'static str,
    /// A sync file's payload must be signaled, or submitted to be.
    signal: &'static str,
}

/// A descriptor of the present payload of a fence or a semaphore, which `exports` such ones. The export of a sync file
/// unsignals the object.
fn export(
    sync: &Arc<DeviceSync>,
    payloads: &Payloads,
    kind: Option<FileKind>,
    exports: bool,
    rules: &ExportRules,
) -> Result<c_int, Error> {
    let payload = payloads.current();
    match (kind, payload.file()) {
        (Some(FileKind::Opaque), Some(file)) => external::export(file),
        (Some(FileKind::Sync), _) if payload.has_sync_file(exports) => {
            let fd = payload.export_sync_file()?;
            let fd = fd.ok_or_else(|| {
                Error::usage(rules.signal, "a sync file is exported that nothing submitted will signal")
            })?;
            // What is submitted signals the file alone.
            if let (_, false) = payloads.take() {
                payloads.replace(Payload::binary(sync, false), false);
            }
            Ok(fd)
        }
        _ => Err(Error::usage(rules.kind, "the object's payload has no handles of this type")),
    }
}

#[doc(alias = "vkGetSemaphoreFdKHR")]
pub(crate) fn get_semaphore_fd(
    semaphore: &Semaphore,
    handle_type: vk::ExternalSemaphoreHandleTypeFlags,
) -> Result<c_int, Error> {
    let kind = match handle_type {
        vk::ExternalSemaphoreHandleTypeFlags::OPAQUE_FD => Some(FileKind::Opaque),
        vk::ExternalSemaphoreHandleTypeFlags::SYNC_FD => Some(FileKind::Sync),
        _ => None,
    };
    let rules = ExportRules {
        kind: "VUID-VkSemaphoreGetFdInfoKHR-handleType-01132",
        signal: "VUID-VkSemaphoreGetFdInfoKHR-handleType-01135",
    };
    export(&semaphore.sync, &semaphore.payloads, kind, semaphore.exports.contains(handle_type), &rules)
}

#[doc(alias = "vkImportSemaphoreFdKHR")]
pub(crate) fn import_semaphore_fd(
    semaphore: &Semaphore,
    flags: vk::SemaphoreImportFlags,
    handle_type: vk::ExternalSemaphoreHandleTypeFlags,
    fd: c_int,
) -> Result<(), Error> {
    use vk::ExternalSemaphoreHandleTypeFlags as Types;
    let is_temporary = flags.contains(vk::SemaphoreImportFlags::TEMPORARY);
    let payload = match handle_type {
        Types::OPAQUE_FD if is_temporary && semaphore.is_timeline => {
            return Err(Error::usage(
                "VUID-VkImportSemaphoreFdInfoKHR-flags-03323",
                "a timeline semaphore is imported temporarily",
            ));
        }
        Types::OPAQUE_FD => Payload::import(&semaphore.sync, semaphore.kind(), fd)?,
        Types::SYNC_FD if !is_temporary => {
            return Err(Error::usage(
                "VUID-VkImportSemaphoreFdInfoKHR-handleType-07307",
                "a sync file is imported without VK_SEMAPHORE_IMPORT_TEMPORARY_BIT",
            ));
        }
        Types::SYNC_FD if !semaphore.is_timeline => Payload::import_sync_file(&semaphore.sync, fd)?,
        _ => {
            return Err(Error::usage(
                "VUID-VkImportSemaphoreFdInfoKHR-handleType-01143",
                format!("the semaphore cannot be imported by a handle of type {handle_type:?}"),
            ));
        }
    };
    semaphore.payloads.replace(payload, is_temporary);
    take_descriptor(fd);
    Ok(())
}

#[doc(alias = "vkGetFenceFdKHR")]
pub(crate) fn get_fence_fd(fence: &Fence, handle_type: vk::ExternalFenceHandleTypeFlags) -> Result<c_int, Error> {
    let kind = match handle_type {
        vk::ExternalFenceHandleTypeFlags::OPAQUE_FD => Some(FileKind::Opaque),
        vk::ExternalFenceHandleTypeFlags::SYNC_FD => Some(FileKind::Sync),
        _ => None,
    };
    let rules = ExportRules {
        kind: "VUID-VkFenceGetFdInfoKHR-handleType-01453",
        signal: "VUID-VkFenceGetFdInfoKHR-handleType-01454",
    };
    export(&fence.sync, &fence.payloads, kind, fence.exports.contains(handle_type), &rules)
}

#[doc(alias = "vkImportFenceFdKHR")]
pub(crate) fn import_fence_fd(
    fence: &Fence,
    flags: vk::FenceImportFlags,
    handle_type: vk::ExternalFenceHandleTypeFlags,
    fd: c_int,
) -> Result<(), Error> {
    use vk::ExternalFenceHandleTypeFlags as Types;
    let is_temporary = flags.contains(vk::FenceImportFlags::TEMPORARY);
    let payload = match handle_type {
        Types::OPAQUE_FD => Payload::import(&fence.sync, Kind::Fence, fd)?,
        Types::SYNC_FD if !is_temporary => {
            return Err(Error::usage(
                "VUID-VkImportFenceFdInfoKHR-handleType-07306",
                "a sync file is imported without VK_FENCE_IMPORT_TEMPORARY_BIT",
            ));
        }
        Types::SYNC_FD => Payload::import_sync_file(&fence.sync, fd)?,
        _ => {
            return Err(Error::usage(
                "VUID-VkImportFenceFdInfoKHR-handleType-01464",
                format!("a fence cannot be imported by a handle of type {handle_type:?}"),
            ));
        }
    };
    fence.payloads.replace(payload, is_temporary);
    take_descriptor(fd);
    Ok(())
}

/// Closes a descriptor that has been imported; -1 is none.
fn take_descriptor(fd: c_int) {
    if fd >= 0 {
        // SAFETY: an import gives an open descriptor to the driver, which has used it.
        unsafe { external::close(fd) };
    }
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
