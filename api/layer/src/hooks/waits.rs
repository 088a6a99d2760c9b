//! Commands that wait for submissions, or end the objects by which one waits: what the device has written is looked at
//! then.

use ash::vk;

use crate::device::{Device, State};
use crate::hooks::submit::{look_late, take_signalled};
use crate::pending::{LateDraw, Pending};
use gaurast_layer_interface::{find, slice};

const FAILED: vk::Result = vk::Result::ERROR_INITIALIZATION_FAILED;

/// Looks at the draws that `take` gives.
fn settle(own: &Device, take: impl FnOnce(&mut State) -> Vec<LateDraw>) {
    own.observe(|state, faults| {
        for late in take(state) {
            look_late(own, state, &late, faults);
        }
    });
}

/// Hooks of commands after whose success submissions may have ended.
macro_rules! waits {
    ($($name:ident($handle:ident: $handle_type:ty $(, $parameter:ident: $type:ty)*) |$own:ident, $state:ident| $take:expr;)*) => {$(
        pub(super) unsafe extern "system" fn $name($handle: $handle_type $(, $parameter: $type)*) -> vk::Result {
            // SAFETY: see the module above.
            unsafe {
                let Some($own) = Device::of($handle) else { return FAILED };
                let Some(next) = $own.next.$name else { return FAILED };
                let result = next($handle $(, $parameter)*);
                if result == vk::Result::SUCCESS {
                    settle(&$own, |$state| $take);
                }
                result
            }
        }
    )*};
}
waits! {
    queue_wait_idle(queue: vk::Queue) |own, state| state.pending.take_ended(|pending| pending.queue == queue);
    device_wait_idle(device: vk::Device) |own, state| state.pending.take_ended(|_| true);
    wait_for_fences(device: vk::Device, count: u32, fences: *const vk::Fence, all: vk::Bool32, timeout: u64)
        |own, state| take_signalled(&own, state);
    get_fence_status(device: vk::Device, fence: vk::Fence) |own, state| take_signalled(&own, state);
    wait_semaphores(device: vk::Device, info: *const vk::SemaphoreWaitInfo<'_>, timeout: u64)
        |own, state| take_signalled(&own, state);
    get_semaphore_counter_value(device: vk::Device, semaphore: vk::Semaphore, value: *mut u64)
        |own, state| take_signalled(&own, state);
}

/// The draws of submissions that end by one of these fences.
fn of_fences(state: &mut State, fences: &[vk::Fence]) -> Vec<LateDraw> {
    state.pending.take_ended(|pending| fences.contains(&pending.fence))
}

pub(super) unsafe extern "system" fn reset_fences(
    device: vk::Device,
    count: u32,
    fences: *const vk::Fence,
) -> vk::Result {
    // SAFETY: see the module above; a fence that is reset is in no use.
    unsafe {
        let Some(own) = Device::of(device) else {
            return FAILED;
        };
        settle(&own, |state| of_fences(state, slice(fences, count)));
        own.next.reset_fences.map_or(FAILED, |next| next(device, count, fences))
    }
}

pub(super) unsafe extern "system" fn destroy_fence(
    device: vk::Device,
    fence: vk::Fence,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    // SAFETY: see the module above; a fence that is destroyed is in no use.
    unsafe {
        let Some(own) = Device::of(device) else {
            return;
        };
        if fence != vk::Fence::null() {
            settle(&own, |state| of_fences(state, &[fence]));
        }
        if let Some(next) = own.next.destroy_fence {
            next(device, fence, allocator);
        }
    }
}

pub(super) unsafe extern "system" fn create_semaphore(
    device: vk::Device,
    info: *const vk::SemaphoreCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    semaphore: *mut vk::Semaphore,
) -> vk::Result {
    // SAFETY: see the module above.
    unsafe {
        let Some(own) = Device::of(device) else {
            return FAILED;
        };
        let Some(next) = own.next.create_semaphore else {
            return FAILED;
        };
        let result = next(device, info, allocator, semaphore);
        if result == vk::Result::SUCCESS {
            own.observe(|state, _| {
                let ty = find::<vk::SemaphoreTypeCreateInfo<'_>>((*info).p_next);
                if ty.is_some_and(|ty| ty.semaphore_type == vk::SemaphoreType::TIMELINE) {
                    state.objects.timelines.insert(*semaphore);
                }
            });
        }
        result
    }
}

pub(super) unsafe extern "system" fn destroy_semaphore(
    device: vk::Device,
    semaphore: vk::Semaphore,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    // SAFETY: see the module above; a semaphore that is destroyed is in no use.
    unsafe {
        let Some(own) = Device::of(device) else {
            return;
        };
        settle(&own, |state| {
            state.objects.timelines.remove(&semaphore);
            let signals = |pending: &Pending| pending.signals.iter().any(|signal| signal.semaphore == semaphore);
            state.pending.take_ended(signals)
        });
        if let Some(next) = own.next.destroy_semaphore {
            next(device, semaphore, allocator);
        }
    }
}
