//! Submissions: what a queue's thread does for `vkQueueSubmit`.

use crate::command::record::{Command, CopyQueryResults};
use crate::command::recorder::Pending;
use crate::command::replay::{Executor, Lost, replay};
use crate::object::event::Event;
use crate::object::fence::Fence;
use crate::object::instance::Instance;
use crate::object::query_pool;
use crate::object::semaphore::Semaphore;
use crate::object::signals::{Signals, Waited};
use ash::vk;
use simdevice::command_processor::ExecutionError;
use simdevice::{CommandProcessor, Packet};
use std::sync::Arc;

/// What a command buffer held when it was submitted.
pub(crate) type Commands = (Arc<Vec<Command>>, Pending);

/// A batch: semaphores to wait for, command buffers, semaphores to signal; each semaphore with a timeline's value.
#[derive(Debug, Default)]
pub(crate) struct Batch {
    /// What is waited for first.
    pub(crate) waits: Vec<(Arc<Semaphore>, u64)>,
    /// What is executed.
    pub(crate) commands: Vec<Commands>,
    /// What is signaled last.
    pub(crate) signals: Vec<(Arc<Semaphore>, u64)>,
}

/// One `vkQueueSubmit`.
pub(crate) struct Submission {
    /// Its batches.
    pub(crate) batches: Vec<Batch>,
    /// The fence that is signaled when all of them are done.
    pub(crate) fence: Option<Arc<Fence>>,
    /// The device's signals.
    pub(crate) signals: Arc<Signals>,
    /// Who hears of what goes wrong.
    pub(crate) instance: Arc<Instance>,
}

impl Submission {
    /// Executes it on a queue's thread. If the device is lost on the way, everybody who waits is woken.
    pub(crate) fn execute(self, processor: &mut CommandProcessor) {
        let mut executor = QueueExecutor {
            processor,
            signals: &self.signals,
            instance: &self.instance,
        };
        for batch in self.batches {
            if let Err(lost) = execute_batch(batch, &mut executor) {
                let Lost(reason) = &lost;
                self.signals.lose(reason);
                self.instance.report(
                    vk::DebugUtilsMessageSeverityFlagsEXT::ERROR,
                    vk::DebugUtilsMessageTypeFlagsEXT::GENERAL,
                    "GAURAST-device-lost",
                    &lost.to_string(),
                );
                return;
            }
        }
        if let Some(fence) = self.fence {
            fence.signal();
        }
    }
}

fn execute_batch(batch: Batch, executor: &mut QueueExecutor) -> Result<(), Lost> {
    for (semaphore, value) in &batch.waits {
        executor.wait(|| semaphore.is_reached(*value))?;
        semaphore.consume();
    }
    for (commands, pending) in batch.commands {
        replay(&commands, executor)?;
        drop(pending);
    }
    for (semaphore, value) in &batch.signals {
        semaphore.signal(*value);
    }
    Ok(())
}

struct QueueExecutor<'a> {
    processor: &'a mut CommandProcessor,
    signals: &'a Signals,
    instance: &'a Instance,
}

impl QueueExecutor<'_> {
    fn wait(&self, ready: impl Fn() -> bool) -> Result<(), Lost> {
        match self.signals.wait(None, ready) {
            Waited::Ready => Ok(()),
            Waited::TimedOut | Waited::Lost => Err(Lost("it was lost while a queue waited".into())),
        }
    }
}

impl Executor for QueueExecutor<'_> {
    fn execute(&mut self, packet: &Packet) -> Result<(), Lost> {
        match self.processor.execute(packet) {
            // The draw draws nothing, and what follows is as if it weren't there.
            Err(error @ ExecutionError::TooManyGaussians(_)) => {
                self.report(&format!("a draw draws nothing: {error}"));
                Ok(())
            }
            executed => executed.map_err(|error| Lost(error.to_string())),
        }
    }

    fn wait_event(&mut self, event: &Event) -> Result<(), Lost> {
        self.wait(|| event.is_set())
    }

    fn query_results(&mut self, copy: &CopyQueryResults) -> Result<Vec<Packet>, Lost> {
        // Everything before has been executed, so a query that isn't available now never will be by this queue.
        Ok(query_pool::copy_packets(copy))
    }

    fn report(&mut self, message: &str) {
        log::warn!("{message}");
        self.instance.report(
            vk::DebugUtilsMessageSeverityFlagsEXT::WARNING,
            vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION,
            "GAURAST-draw-skipped",
            message,
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;
    use crate::object::queue::Queue;
    use simdevice::packet::BufferRange;
    use simdevice::{Allocation, Device};
    use std::sync::Weak;

    struct Fixture {
        signals: Arc<Signals>,
        queue: Arc<Queue>,
        instance: Arc<Instance>,
    }

    impl Fixture {
        fn new() -> Self {
            let simulated = Arc::new(Device::new(&simdevice::Config::default()).unwrap());
            let signals = Arc::<Signals>::default();
            let processor = CommandProcessor::new(simulated);
            Self {
                queue: Queue::start(Weak::new(), Arc::clone(&signals), processor).unwrap(),
                instance: Instance::new(vk::API_VERSION_1_3, &[]).unwrap(),
                signals,
            }
        }

        /// Submits packets with a fence that a thread waits for, and says how that wait ended.
        fn submit(&self, commands: Vec<Command>) -> Waited {
            let fence = Arc::new(Fence::new(Arc::clone(&self.signals), false));
            let waiter = std::thread::spawn({
                let (signals, fence) = (Arc::clone(&self.signals), Arc::clone(&fence));
                move || signals.wait(None, || fence.is_signaled())
            });
            let mut recorder = crate::command::recorder::Recorder::new();
            recorder.begin(Default::default()).unwrap();
            commands.into_iter().for_each(|c| recorder.push(c));
            recorder.end().unwrap();
            let submission = Submission {
                batches: vec![Batch {
                    commands: vec![recorder.submit().unwrap()],
                    ..Batch::default()
                }],
                fence: Some(fence),
                signals: Arc::clone(&self.signals),
                instance: Arc::clone(&self.instance),
            };
            let submitted = self
                .queue
                .submit(Box::new(move |processor| submission.execute(processor)));
            if let Err(error) = submitted {
                assert!(matches!(error, Error::DeviceLost(_)));
            }
            waiter.join().unwrap()
        }
    }

    fn fill(memory: &Arc<Allocation>) -> Command {
        Command::Packet(Packet::FillBuffer {
            target: BufferRange {
                memory: Arc::clone(memory),
                offset: 0,
                size: 4,
            },
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
        assert_eq!(fixture.submit(vec![fill(&memory)]), Waited::Ready);
        assert_eq!(word(&memory), 7);
        let outside_pass = Command::Packet(Packet::EndRendering);
        let waited = fixture.submit(vec![outside_pass]);
        assert_eq!(waited, Waited::Lost);
        assert!(fixture.signals.check().is_err());
        assert_eq!(fixture.submit(vec![fill(&memory)]), Waited::Lost);
        assert!(fixture.queue.wait_idle().is_err());
        fixture.queue.stop();
    }

    #[test]
    fn a_panic_loses_the_device_and_wakes_who_waits() {
        let fixture = Fixture::new();
        let waiter = std::thread::spawn({
            let signals = Arc::clone(&fixture.signals);
            move || signals.wait(None, || false)
        });
        let panicking = Box::new(|_: &mut CommandProcessor| panic!("in a test"));
        fixture.queue.submit(panicking).unwrap();
        assert_eq!(waiter.join().unwrap(), Waited::Lost);
        let error = fixture.signals.check().unwrap_err();
        assert!(error.to_string().contains("in a test"));
        fixture.queue.stop();
    }
}
