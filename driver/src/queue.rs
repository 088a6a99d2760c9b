//! Queues: each has a thread, which runs submissions in order on its own command processor.
//!
//! A submission is a closure. If the device is lost, because an earlier submission panicked, the closures that wait are
//! dropped without being run. Code that must wake waiters even then does so in the `Drop` of a value that the closure
//! captures.

use crate::abi::error::Error;
use crate::abi::guard::panic_message;
use crate::abi::handle::{Reporter, objects};
use crate::abi::sanitizer::{acquire, ignore_thread, release};
use crate::device_sync::DeviceSync;
use crate::instance::Instance;
use ash::vk;
use simdevice::CommandProcessor;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

/// A unit of a queue's work.
pub(crate) type Work = Box<dyn FnOnce(&mut CommandProcessor) + Send>;

/// A queue of a device.
pub(crate) struct Queue {
    instance: Arc<Instance>,
    sync: Arc<DeviceSync>,
    /// The thread; None once the queue is stopped.
    worker: Mutex<Option<Worker>>,
}

struct Worker {
    work: Sender<Work>,
    thread: JoinHandle<()>,
}

objects! {
    vk::Queue => Queue {
        fn reporter(&self) -> Option<Arc<dyn Reporter>> {
            Some(Arc::clone(&self.instance) as _)
        }
    };
}

impl Queue {
    /// Starts the thread of a queue whose work runs on `processor`.
    ///
    /// # Errors
    /// [`Error::InitializationFailed`] if the host can't start a thread.
    pub(crate) fn start(
        instance: Arc<Instance>,
        sync: Arc<DeviceSync>,
        processor: CommandProcessor,
    ) -> Result<Arc<Self>, Error> {
        let (work, receiver) = channel();
        let thread_sync = Arc::clone(&sync);
        let thread = std::thread::Builder::new()
            .name("gaurast-queue".to_owned())
            .spawn(move || run(&receiver, processor, &thread_sync))
            .map_err(|error| Error::InitializationFailed(format!("the queue's thread cannot start: {error}")))?;
        Ok(Arc::new(Self { instance, sync, worker: Mutex::new(Some(Worker { work, thread })) }))
    }

    /// The instance of its device.
    pub(crate) fn instance(&self) -> &Arc<Instance> {
        &self.instance
    }

    /// The state that can be waited for on its device, and its loss.
    pub(crate) fn sync(&self) -> &Arc<DeviceSync> {
        &self.sync
    }

    /// Appends work.
    ///
    /// # Errors
    /// [`Error::DeviceLost`]; the work is dropped.
    pub(crate) fn submit(&self, work: Work) -> Result<(), Error> {
        self.sync.check()?;
        release(&*work);
        let worker = self.worker.lock().unwrap_or_else(PoisonError::into_inner);
        worker
            .as_ref()
            .and_then(|worker| worker.work.send(work).ok())
            .ok_or_else(|| Error::DeviceLost("its queue has stopped".to_owned()))
    }

    /// Waits until everything submitted before has been executed.
    ///
    /// # Errors
    /// [`Error::DeviceLost`].
    pub(crate) fn wait_idle(&self) -> Result<(), Error> {
        let (done, wait) = channel();
        let idle = Arc::new(());
        let reached = Arc::clone(&idle);
        self.submit(Box::new(move |_| {
            release(&*reached);
            // The receiver exists as long as this closure.
            let _ = done.send(());
        }))?;
        // The sender is dropped without a message only if the queue dropped the work.
        let waited = wait.recv();
        acquire(&*idle);
        self.sync.check()?;
        waited.map_err(|_| Error::DeviceLost("its queue has stopped".to_owned()))
    }

    /// Executes the submitted work, ends the thread and joins it.
    pub(crate) fn stop(&self) {
        let worker = self.worker.lock().unwrap_or_else(PoisonError::into_inner).take();
        let Some(Worker { work, thread }) = worker else {
            return;
        };
        drop(work);
        if thread.join().is_err() {
            log::error!("a queue's thread panicked outside its work");
        }
    }
}

/// The queue's thread: runs work until the queue is stopped. After a panic it drops further work instead of running it.
fn run(work: &Receiver<Work>, mut processor: CommandProcessor, sync: &DeviceSync) {
    ignore_thread();
    while let Ok(work) = work.recv() {
        acquire(&*work);
        let executed = catch_unwind(AssertUnwindSafe(|| {
            if sync.check().is_ok() {
                work(&mut processor);
            } else {
                drop(work);
            }
        }));
        if let Err(panic) = executed {
            sync.lose(Error::DeviceLostByDefect(panic_message(panic.as_ref()).to_owned()));
        }
    }
}

#[doc(alias = "vkQueueWaitIdle")]
pub(crate) fn queue_wait_idle(queue: &Queue) -> Result<(), Error> {
    queue.wait_idle()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::Options;
    use std::sync::atomic::{AtomicUsize, Ordering};

    fn queue() -> Arc<Queue> {
        let simulated = simdevice::Device::new(&simdevice::Config::default()).unwrap();
        Queue::start(
            Instance::new(0, &[], Options::default()).unwrap(),
            Arc::default(),
            CommandProcessor::new(Arc::new(simulated)),
        )
        .unwrap()
    }

    #[test]
    fn work_is_done_in_order_before_the_queue_is_idle() {
        let queue = queue();
        let (sent, received) = channel();
        for index in 0..10 {
            let sent = sent.clone();
            queue.submit(Box::new(move |_| sent.send(index).unwrap())).unwrap();
        }
        queue.wait_idle().unwrap();
        assert_eq!(received.try_iter().collect::<Vec<_>>(), (0..10).collect::<Vec<_>>());
        queue.stop();
        queue.stop();
        assert!(queue.submit(Box::new(|_| ())).is_err());
    }

    #[test]
    fn a_panic_loses_the_device_and_drops_what_waits() {
        struct Dropped(Arc<AtomicUsize>);
        impl Drop for Dropped {
            fn drop(&mut self) {
                self.0.fetch_add(1, Ordering::Relaxed);
            }
        }
        let queue = queue();
        let (go, wait) = channel::<()>();
        let dropped = Arc::new(AtomicUsize::new(0));
        queue
            .submit(Box::new(move |_| {
                let _ = wait.recv();
                panic!("provoked");
            }))
            .unwrap();
        let ran = Arc::new(AtomicUsize::new(0));
        let (waiting, counted) = (Dropped(Arc::clone(&dropped)), Arc::clone(&ran));
        queue
            .submit(Box::new(move |_| {
                let _waiting = waiting;
                counted.fetch_add(1, Ordering::Relaxed);
            }))
            .unwrap();
        go.send(()).unwrap();
        let error = queue.wait_idle().unwrap_err();
        assert_eq!(error.result(), vk::Result::ERROR_DEVICE_LOST);
        assert!(error.to_string().contains("provoked"), "{error}");
        queue.stop();
        assert_eq!(dropped.load(Ordering::Relaxed), 1);
        assert_eq!(ran.load(Ordering::Relaxed), 0);
    }
}
