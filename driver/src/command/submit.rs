//! Submission to queues: batches, and their execution on a queue's thread.

use super::Command;
use super::buffer::PendingUse;
use super::replay::{Execution, replay};
use crate::abi::error::Error;
use crate::abi::handle;
use crate::abi::valid;
use crate::device_sync::DeviceSync;
use crate::instance::Instance;
use crate::payload::Payload;
use crate::queue::Queue;
use crate::sync::{Fence, Semaphore};
use ash::vk;
use simdevice::{CommandProcessor, host};
use std::sync::Arc;

/// The commands of a command buffer at its submission.
pub(crate) type Commands = (Arc<Vec<Command>>, PendingUse);

/// A batch: semaphores to wait for, command buffers, semaphores to signal; or, once it is submitted, their payloads. Each
/// has a timeline's value.
#[derive(Debug)]
pub(crate) struct Batch<S> {
    /// The semaphores or payloads that are waited for first.
    pub(crate) waits: Vec<(Arc<S>, u64)>,
    /// The command buffers that are executed.
    pub(crate) commands: Vec<Commands>,
    /// The semaphores or payloads that are signaled last.
    pub(crate) signals: Vec<(Arc<S>, u64)>,
}

impl Batch<Semaphore> {
    /// The batch with its semaphores' payloads. Imports that are temporary end here, if they are waited for.
    fn take_payloads(self) -> Batch<Payload> {
        let wait = |(semaphore, value): (Arc<Semaphore>, u64)| (semaphore.payloads().take().0, value);
        let signal = |(semaphore, value): (Arc<Semaphore>, u64)| (semaphore.payloads().submit_signal(), value);
        Batch {
            waits: self.waits.into_iter().map(wait).collect(),
            commands: self.commands,
            signals: self.signals.into_iter().map(signal).collect(),
        }
    }
}

/// One `vkQueueSubmit`.
pub(crate) struct Submission {
    /// Its batches.
    pub(crate) batches: Vec<Batch<Payload>>,
    /// The payload of the fence that is signaled when all of them are done.
    pub(crate) fence: Option<Arc<Payload>>,
    /// The state that can be waited for on the device, and its loss.
    pub(crate) sync: Arc<DeviceSync>,
    /// The instance, to which errors are reported.
    pub(crate) instance: Arc<Instance>,
}

impl Submission {
    /// Executes the submission on a queue's thread. If the device is lost, all waiters are woken.
    pub(crate) fn execute(self, processor: &mut CommandProcessor) {
        let mut execution = Execution { processor, sync: &self.sync, instance: &self.instance };
        for batch in self.batches {
            if let Err(error) = execute_batch(batch, &mut execution) {
                let reason = match &error {
                    Error::DeviceLost(_) | Error::DeviceLostByDefect(_) => error.clone(),
                    other => Error::DeviceLost(other.to_string()),
                };
                self.sync.lose(reason);
                self.instance.report(
                    vk::DebugUtilsMessageSeverityFlagsEXT::ERROR,
                    vk::DebugUtilsMessageTypeFlagsEXT::GENERAL,
                    "GAURAST-device-lost",
                    &error.to_string(),
                );
                return;
            }
        }
        if let Some(fence) = self.fence {
            fence.end_signal(0);
        }
    }
}

fn execute_batch(batch: Batch<Payload>, execution: &mut Execution<'_>) -> Result<(), Error> {
    for (payload, value) in &batch.waits {
        execution.wait(payload.outside(), || payload.is_reached(*value))?;
        // A wait for a binary semaphore unsignals it.
        payload.reset();
    }
    for (commands, pending) in batch.commands {
        replay(&commands, execution)?;
        drop(pending);
    }
    for (payload, value) in &batch.signals {
        payload.end_signal(*value);
    }
    Ok(())
}

/// Passes batches to the queue's thread. Nothing fails before that, so that what isn't submitted changes no semaphore.
///
/// # Errors
/// [`Error::DeviceLost`].
pub(crate) fn enqueue(queue: &Queue, batches: Vec<Batch<Semaphore>>, fence: Option<&Arc<Fence>>) -> Result<(), Error> {
    let batches = batches.into_iter().map(Batch::take_payloads).collect();
    let fence = fence.map(|fence| fence.payloads().submit_signal());
    let submission =
        Submission { batches, fence, sync: Arc::clone(queue.sync()), instance: Arc::clone(queue.instance()) };
    queue.submit(Box::new(move |processor| submission.execute(processor)))
}

/// The batch of a `VkSubmitInfo`.
///
/// # Safety
/// The info, its chain and its handles are valid.
unsafe fn batch(info: &vk::SubmitInfo<'_>) -> Result<Batch<Semaphore>, Error> {
    // SAFETY: the caller's promise.
    unsafe {
        let values = valid::find_in_chain::<vk::TimelineSemaphoreSubmitInfo>(info.p_next);
        let (wait_values, signal_values) = match values {
            None => (&[][..], &[][..]),
            Some(values) => (
                valid::slice(values.p_wait_semaphore_values, values.wait_semaphore_value_count)?,
                valid::slice(values.p_signal_semaphore_values, values.signal_semaphore_value_count)?,
            ),
        };
        let waits = valid::slice(info.p_wait_semaphores, info.wait_semaphore_count)?;
        let signals = valid::slice(info.p_signal_semaphores, info.signal_semaphore_count)?;
        let command_buffers = valid::slice(info.p_command_buffers, info.command_buffer_count)?;
        Ok(Batch {
            waits: with_values(handle::get_all(waits)?, wait_values),
            commands: commands(command_buffers.iter().copied())?,
            signals: with_values(handle::get_all(signals)?, signal_values),
        })
    }
}

/// Pairs semaphores with timeline values; binary semaphores need none.
pub(crate) fn with_values(semaphores: Vec<Arc<Semaphore>>, values: &[u64]) -> Vec<(Arc<Semaphore>, u64)> {
    let values = values.iter().copied().chain(std::iter::repeat(0));
    host::collect(semaphores.into_iter().zip(values))
}

/// The batch of a `VkSubmitInfo2`.
///
/// # Safety
/// The info and its handles are valid.
unsafe fn batch2(info: &vk::SubmitInfo2<'_>) -> Result<Batch<Semaphore>, Error> {
    // SAFETY: the caller's promise.
    unsafe {
        let waits = valid::slice(info.p_wait_semaphore_infos, info.wait_semaphore_info_count)?;
        let signals = valid::slice(info.p_signal_semaphore_infos, info.signal_semaphore_info_count)?;
        let command_buffers = valid::slice(info.p_command_buffer_infos, info.command_buffer_info_count)?;
        Ok(Batch {
            waits: with_values(semaphores(waits)?, &timeline_values(waits)),
            commands: commands(command_buffers.iter().map(|info| info.command_buffer))?,
            signals: with_values(semaphores(signals)?, &timeline_values(signals)),
        })
    }
}

/// The semaphores of infos.
///
/// # Safety
/// The handles are live.
unsafe fn semaphores(infos: &[vk::SemaphoreSubmitInfo<'_>]) -> Result<Vec<Arc<Semaphore>>, Error> {
    // SAFETY: the caller's promise.
    infos.iter().map(|info| unsafe { handle::get(info.semaphore).cloned() }).collect()
}

/// The timeline values of infos.
fn timeline_values(infos: &[vk::SemaphoreSubmitInfo<'_>]) -> Vec<u64> {
    host::collect(infos.iter().map(|info| info.value))
}

/// The present commands of command buffers.
///
/// # Safety
/// The handles are live.
unsafe fn commands(command_buffers: impl Iterator<Item = vk::CommandBuffer>) -> Result<Vec<Commands>, Error> {
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
            command_buffer.recorder().submit(command_buffer.device().enabled())
        })
        .collect()
}

/// # Safety
/// The submits, their chains and their handles are valid.
#[doc(alias = "vkQueueSubmit")]
pub(crate) unsafe fn queue_submit(
    queue: &Queue,
    submits: &[vk::SubmitInfo<'_>],
    fence: Option<&Arc<Fence>>,
) -> Result<(), Error> {
    let mut batches = host::with_capacity(submits.len());
    for submit in submits {
        // SAFETY: the caller's promise.
        batches.push(unsafe { batch(submit)? });
    }
    enqueue(queue, batches, fence)
}

/// # Safety
/// The submits and their handles are valid.
#[doc(alias = "vkQueueSubmit2")]
pub(crate) unsafe fn queue_submit2(
    queue: &Queue,
    submits: &[vk::SubmitInfo2<'_>],
    fence: Option<&Arc<Fence>>,
) -> Result<(), Error> {
    let mut batches = host::with_capacity(submits.len());
    for submit in submits {
        // SAFETY: the caller's promise.
        batches.push(unsafe { batch2(submit)? });
    }
    enqueue(queue, batches, fence)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device_sync::WaitResult;
    use crate::enabled::Enabled;
    use crate::options::Options;
    use crate::queue::Queue;
    use simdevice::Allocation;
    use simdevice::BufferRange;
    use simdevice::Device;
    use simdevice::Packet;

    struct Fixture {
        sync: Arc<DeviceSync>,
        queue: Arc<Queue>,
        instance: Arc<Instance>,
    }

    impl Fixture {
        fn new() -> Self {
            let instance = Instance::new(vk::API_VERSION_1_3, &[], Options::default()).unwrap();
            let simulated = Arc::new(Device::new(&simdevice::Config::default()).unwrap());
            let sync = Arc::<DeviceSync>::default();
            let processor = CommandProcessor::new(simulated);
            Self { queue: Queue::start(Arc::clone(&instance), Arc::clone(&sync), processor).unwrap(), instance, sync }
        }

        /// Submits packets with a fence that a thread waits for. Returns the end of that wait.
        fn submit(&self, commands: Vec<Command>) -> WaitResult {
            let fence = Payload::binary(&self.sync, false);
            let waiter = std::thread::spawn({
                let (sync, fence) = (Arc::clone(&self.sync), Arc::clone(&fence));
                move || sync.wait(None, || fence.is_reached(0))
            });
            let mut recorder = super::super::buffer::Recorder::new();
            recorder.begin(&Enabled::strict(), Default::default()).unwrap();
            commands.into_iter().for_each(|c| recorder.push(c));
            recorder.end().unwrap();
            let submission = Submission {
                batches: vec![Batch {
                    waits: Vec::new(),
                    commands: vec![recorder.submit(&Enabled::strict()).unwrap()],
                    signals: Vec::new(),
                }],
                fence: Some(fence),
                sync: Arc::clone(&self.sync),
                instance: Arc::clone(&self.instance),
            };
            let submitted = self.queue.submit(Box::new(move |processor| submission.execute(processor)));
            if let Err(error) = submitted {
                assert!(matches!(error, Error::DeviceLost(_)));
            }
            waiter.join().unwrap()
        }
    }

    fn fill(memory: &Arc<Allocation>) -> Command {
        Command::Packet(Packet::FillBuffer {
            target: BufferRange { memory: Arc::clone(memory), offset: 0, size: 4 },
            word: 7,
        })
    }

    fn word(memory: &Allocation) -> u32 {
        let mut word = [0];
        memory.read(0, &mut word).unwrap();
        word[0]
    }

    #[test]
    fn an_execution_error_loses_the_device_and_wakes_who_waits() {
        let fixture = Fixture::new();
        let memory = Allocation::new_zeroed(4).unwrap();
        assert_eq!(fixture.submit(vec![fill(&memory)]), WaitResult::Ready);
        assert_eq!(word(&memory), 7);
        let outside_pass = Command::Packet(Packet::EndRendering);
        let waited = fixture.submit(vec![outside_pass]);
        assert_eq!(waited, WaitResult::Lost);
        assert!(fixture.sync.check().is_err());
        assert_eq!(fixture.submit(vec![fill(&memory)]), WaitResult::Lost);
        assert!(fixture.queue.wait_idle().is_err());
        fixture.queue.stop();
    }

    #[test]
    fn a_panic_loses_the_device_and_wakes_who_waits() {
        let fixture = Fixture::new();
        let waiter = std::thread::spawn({
            let sync = Arc::clone(&fixture.sync);
            move || sync.wait(None, || false)
        });
        let panicking = Box::new(|_: &mut CommandProcessor| panic!("in a test"));
        fixture.queue.submit(panicking).unwrap();
        assert_eq!(waiter.join().unwrap(), WaitResult::Lost);
        let error = fixture.sync.check().unwrap_err();
        assert!(error.to_string().contains("in a test"));
        fixture.queue.stop();
    }
}
