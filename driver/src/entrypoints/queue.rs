//! Submission to queues.

use crate::error::Error;
use crate::object::device::Device;
use crate::object::queue::Queue;
use crate::object::semaphore::Semaphore;
use crate::object::submission::{Batch, Commands, Submission};
use crate::{handle, pnext, pointer};
use ash::vk;
use std::sync::Arc;

crate::entry_points! {
    #[doc(alias = "vkQueueSubmit")]
    fn queue_submit(
        queue: vk::Queue,
        submit_count: u32,
        submits: *const vk::SubmitInfo<'_>,
        fence: vk::Fence,
    ) -> vk::Result {
        let queue = handle::get(queue)?;
        let submits = pointer::slice(submits, submit_count)?;
        let mut batches = simdevice::host::with_capacity(submits.len());
        for submit in submits {
            batches.push(batch(submit)?);
        }
        enqueue(queue, batches, fence)
    }

    #[doc(alias = "vkQueueSubmit2")]
    fn queue_submit2(
        queue: vk::Queue,
        submit_count: u32,
        submits: *const vk::SubmitInfo2<'_>,
        fence: vk::Fence,
    ) -> vk::Result {
        let queue = handle::get(queue)?;
        let submits = pointer::slice(submits, submit_count)?;
        let mut batches = simdevice::host::with_capacity(submits.len());
        for submit in submits {
            batches.push(batch2(submit)?);
        }
        enqueue(queue, batches, fence)
    }

    #[doc(alias = "vkQueueWaitIdle")]
    fn queue_wait_idle(queue: vk::Queue) -> vk::Result {
        handle::get(queue)?.wait_idle()
    }

    #[doc(alias = "vkDeviceWaitIdle")]
    fn device_wait_idle(device: vk::Device) -> vk::Result {
        let device: &Arc<Device> = handle::get(device)?;
        device.queues().iter().try_for_each(|&queue| handle::get(queue)?.wait_idle())
    }
}

/// Hands batches to the queue's thread.
///
/// # Safety
/// The fence is live or null.
unsafe fn enqueue(queue: &Queue, batches: Vec<Batch>, fence: vk::Fence) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    let fence = unsafe { handle::get_optional(fence)? }.cloned();
    let device = queue.device()?;
    let submission = Submission {
        batches,
        fence,
        signals: Arc::clone(device.signals()),
        instance: Arc::clone(device.instance()),
    };
    queue.submit(Box::new(move |processor| submission.execute(processor)))
}

/// The batch of a `VkSubmitInfo`.
///
/// # Safety
/// The info, its chain and its handles are valid.
unsafe fn batch(info: &vk::SubmitInfo<'_>) -> Result<Batch, Error> {
    // SAFETY: the caller's promise.
    unsafe {
        let values = pnext::find::<vk::TimelineSemaphoreSubmitInfo>(info.p_next);
        let (wait_values, signal_values) = match values {
            None => (&[][..], &[][..]),
            Some(values) => (
                pointer::slice(
                    values.p_wait_semaphore_values,
                    values.wait_semaphore_value_count,
                )?,
                pointer::slice(
                    values.p_signal_semaphore_values,
                    values.signal_semaphore_value_count,
                )?,
            ),
        };
        let waits = pointer::slice(info.p_wait_semaphores, info.wait_semaphore_count)?;
        let signals = pointer::slice(info.p_signal_semaphores, info.signal_semaphore_count)?;
        let command_buffers = pointer::slice(info.p_command_buffers, info.command_buffer_count)?;
        Ok(Batch {
            waits: with_values(handle::get_all(waits)?, wait_values),
            commands: commands(command_buffers.iter().copied())?,
            signals: with_values(handle::get_all(signals)?, signal_values),
        })
    }
}

/// Pairs semaphores with a timeline's values; binary semaphores need none.
fn with_values(semaphores: Vec<Arc<Semaphore>>, values: &[u64]) -> Vec<(Arc<Semaphore>, u64)> {
    let values = values.iter().copied().chain(std::iter::repeat(0));
    semaphores.into_iter().zip(values).collect()
}

/// The batch of a `VkSubmitInfo2`.
///
/// # Safety
/// The info and its handles are valid.
unsafe fn batch2(info: &vk::SubmitInfo2<'_>) -> Result<Batch, Error> {
    // SAFETY: the caller's promise.
    unsafe {
        let waits = pointer::slice(info.p_wait_semaphore_infos, info.wait_semaphore_info_count)?;
        let signals = pointer::slice(
            info.p_signal_semaphore_infos,
            info.signal_semaphore_info_count,
        )?;
        let command_buffers =
            pointer::slice(info.p_command_buffer_infos, info.command_buffer_info_count)?;
        Ok(Batch {
            waits: semaphores(waits)?,
            commands: commands(command_buffers.iter().map(|info| info.command_buffer))?,
            signals: semaphores(signals)?,
        })
    }
}

/// Semaphores with their values.
///
/// # Safety
/// The handles are live.
unsafe fn semaphores(
    infos: &[vk::SemaphoreSubmitInfo<'_>],
) -> Result<Vec<(Arc<Semaphore>, u64)>, Error> {
    infos
        .iter()
        .map(|info| {
            // SAFETY: the caller's promise.
            let semaphore = unsafe { handle::get(info.semaphore)? };
            Ok((Arc::clone(semaphore), info.value))
        })
        .collect()
}

/// What command buffers hold now.
///
/// # Safety
/// The handles are live.
unsafe fn commands(
    command_buffers: impl Iterator<Item = vk::CommandBuffer>,
) -> Result<Vec<Commands>, Error> {
    command_buffers
        .map(|command_buffer| {
            // SAFETY: the caller's promise.
            let command_buffer = unsafe { handle::get(command_buffer)? };
            if command_buffer.is_secondary() {
                return Err(Error::usage(
                    "VUID-VkSubmitInfo-pCommandBuffers-00075",
                    "a secondary command buffer is submitted",
                ));
            }
            command_buffer.recorder().submit()
        })
        .collect()
}
