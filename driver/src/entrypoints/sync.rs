//! Fences, semaphores and events.

use crate::error::Error;
use crate::object::event::Event;
use crate::object::fence::Fence;
use crate::object::semaphore::Semaphore;
use crate::object::signals::{Waited, deadline};
use crate::{handle, pnext, pointer};
use ash::vk;
use std::sync::Arc;

crate::entry_points! {
    #[doc(alias = "vkCreateFence")]
    fn create_fence(
        device: vk::Device,
        create_info: *const vk::FenceCreateInfo<'_>,
        _allocator: *const vk::AllocationCallbacks<'_>,
        fence: *mut vk::Fence,
    ) -> vk::Result {
        let signals = handle::get(device)?.signals();
        let signaled = pointer::input(create_info)?.flags.contains(vk::FenceCreateFlags::SIGNALED);
        let object = Fence::new(Arc::clone(signals), signaled);
        pointer::output(fence, handle::create(Arc::new(object)))
    }

    #[doc(alias = "vkResetFences")]
    fn reset_fences(_device: vk::Device, fence_count: u32, fences: *const vk::Fence) -> vk::Result {
        let fences = handle::get_all(pointer::slice(fences, fence_count)?)?;
        fences.iter().for_each(|fence| fence.reset());
        Ok(())
    }

    #[doc(alias = "vkGetFenceStatus")]
    fn get_fence_status(device: vk::Device, fence: vk::Fence) -> vk::Result {
        if handle::get(fence)?.is_signaled() {
            return Ok(vk::Result::SUCCESS);
        }
        handle::get(device)?.signals().check()?;
        Ok(vk::Result::NOT_READY)
    }

    #[doc(alias = "vkWaitForFences")]
    fn wait_for_fences(
        device: vk::Device,
        fence_count: u32,
        fences: *const vk::Fence,
        wait_all: vk::Bool32,
        timeout: u64,
    ) -> vk::Result {
        let signals = handle::get(device)?.signals();
        let fences = handle::get_all(pointer::slice(fences, fence_count)?)?;
        let waited = signals.wait(deadline(timeout), || {
            let mut signaled = fences.iter().map(|fence| fence.is_signaled());
            if wait_all == vk::FALSE { signaled.any(|s| s) } else { signaled.all(|s| s) }
        });
        outcome(waited, || signals.check())
    }

    #[doc(alias = "vkCreateSemaphore")]
    fn create_semaphore(
        device: vk::Device,
        create_info: *const vk::SemaphoreCreateInfo<'_>,
        _allocator: *const vk::AllocationCallbacks<'_>,
        semaphore: *mut vk::Semaphore,
    ) -> vk::Result {
        let device = handle::get(device)?;
        let signals = Arc::clone(device.signals());
        let info = pointer::input(create_info)?;
        let exports = pnext::find::<vk::ExportSemaphoreCreateInfo>(info.p_next);
        if exports.is_some_and(|export| !export.handle_types.is_empty()) {
            return Err(Error::FeatureNotPresent("exporting semaphores".into()));
        }
        let object = match pnext::find::<vk::SemaphoreTypeCreateInfo>(info.p_next) {
            Some(kind) if kind.semaphore_type == vk::SemaphoreType::TIMELINE => {
                Semaphore::new_timeline(signals, kind.initial_value)
            }
            _ => Semaphore::new_binary(signals),
        };
        pointer::output(semaphore, handle::create(Arc::new(object)))
    }

    #[doc(alias = "vkGetSemaphoreCounterValue")]
    fn get_semaphore_counter_value(
        device: vk::Device,
        semaphore: vk::Semaphore,
        value: *mut u64,
    ) -> vk::Result {
        handle::get(device)?.signals().check()?;
        pointer::output(value, timeline_value(handle::get(semaphore)?)?)
    }

    #[doc(alias = "vkWaitSemaphores")]
    fn wait_semaphores(
        device: vk::Device,
        wait_info: *const vk::SemaphoreWaitInfo<'_>,
        timeout: u64,
    ) -> vk::Result {
        let signals = handle::get(device)?.signals();
        let info = pointer::input(wait_info)?;
        let semaphores = handle::get_all(pointer::slice(info.p_semaphores, info.semaphore_count)?)?;
        let values = pointer::slice(info.p_values, info.semaphore_count)?;
        for semaphore in &semaphores {
            timeline_value(semaphore)?;
        }
        let any = info.flags.contains(vk::SemaphoreWaitFlags::ANY);
        let waited = signals.wait(deadline(timeout), || {
            let mut reached = semaphores.iter().zip(values).map(|(s, &value)| s.is_reached(value));
            if any { reached.any(|r| r) } else { reached.all(|r| r) }
        });
        outcome(waited, || signals.check())
    }

    #[doc(alias = "vkSignalSemaphore")]
    fn signal_semaphore(
        _device: vk::Device,
        signal_info: *const vk::SemaphoreSignalInfo<'_>,
    ) -> vk::Result {
        let info = pointer::input(signal_info)?;
        let semaphore = handle::get(info.semaphore)?;
        timeline_value(semaphore)?;
        semaphore.signal(info.value);
        Ok(())
    }

    #[doc(alias = "vkCreateEvent")]
    fn create_event(
        device: vk::Device,
        create_info: *const vk::EventCreateInfo<'_>,
        _allocator: *const vk::AllocationCallbacks<'_>,
        event: *mut vk::Event,
    ) -> vk::Result {
        pointer::input(create_info)?;
        let object = Event::new(Arc::clone(handle::get(device)?.signals()));
        pointer::output(event, handle::create(Arc::new(object)))
    }

    #[doc(alias = "vkGetEventStatus")]
    fn get_event_status(device: vk::Device, event: vk::Event) -> vk::Result {
        handle::get(device)?.signals().check()?;
        Ok(if handle::get(event)?.is_set() {
            vk::Result::EVENT_SET
        } else {
            vk::Result::EVENT_RESET
        })
    }

    #[doc(alias = "vkSetEvent")]
    fn set_event(_device: vk::Device, event: vk::Event) -> vk::Result {
        handle::get(event)?.set(true);
        Ok(())
    }

    #[doc(alias = "vkResetEvent")]
    fn reset_event(_device: vk::Device, event: vk::Event) -> vk::Result {
        handle::get(event)?.set(false);
        Ok(())
    }
}

/// What a wait returns to the application.
fn outcome(waited: Waited, loss: impl FnOnce() -> Result<(), Error>) -> Result<vk::Result, Error> {
    match waited {
        Waited::Ready => Ok(vk::Result::SUCCESS),
        Waited::TimedOut => Ok(vk::Result::TIMEOUT),
        Waited::Lost => loss().map(|()| vk::Result::ERROR_DEVICE_LOST),
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
