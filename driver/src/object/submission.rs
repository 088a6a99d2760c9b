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
use simdevice::{CommandProcessor, Packet};
use std::sync::Arc;

/// What a command buffer held when it was submitted.
pub(crate) type Commands = (Arc<[Command]>, Pending);

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
            if let Err(Lost(reason)) = execute_batch(batch, &mut executor) {
                self.signals.lose(&reason);
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
        self.processor
            .execute(packet)
            .map_err(|error| Lost(error.to_string()))
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
