//! Waiting by the host and by queue threads: fences, semaphores and events of a device share one lock and one condition
//! variable, so that a wait for any of several is simple, and losing the device wakes every waiter.

use crate::abi::error::Error;
use simdevice::shared;
use std::os::fd::BorrowedFd;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};

/// A device's lock and condition variable for everything that can be waited for.
///
/// The values are atomics of the objects; they change only inside [`DeviceSync::update`].
#[derive(Debug, Default)]
pub(crate) struct DeviceSync {
    gate: Mutex<()>,
    changed: Condvar,
    lost: OnceLock<Error>,
}

/// The end of a wait.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum WaitResult {
    /// The condition is met.
    Ready,
    /// The timeout has expired.
    TimedOut,
    /// The device was lost before the condition was met.
    Lost,
}

/// A place where others than the device change what is waited for.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Outside<'a> {
    /// A word in memory that processes share, which is woken at changes.
    Word(&'a AtomicU32),
    /// A file that becomes readable.
    File(BorrowedFd<'a>),
    /// Several places, or a place and values of the device.
    Several,
}

impl Outside<'_> {
    /// The longest time in which a waiter does not notice that the device is lost.
    const LOSS: Duration = Duration::from_millis(10);

    /// The time between looks at several places.
    const LOOK: Duration = Duration::from_micros(200);

    /// Waits for a change since the word was `seen`, or for `time`; may return early.
    fn wait(self, seen: u32, time: Duration) {
        match self {
            Self::Word(word) => shared::wait(word, seen, time.min(Self::LOSS)),
            Self::File(file) => {
                is_readable(file, time.min(Self::LOSS));
            }
            Self::Several => std::thread::sleep(time.min(Self::LOOK)),
        }
    }

    /// The word, before one looks at what it is for.
    fn seen(self) -> u32 {
        match self {
            Self::Word(word) => word.load(Ordering::Acquire),
            Self::File(_) | Self::Several => 0,
        }
    }
}

/// Waits until a file is readable or broken, at most for `time`. Returns false if it is not; may return early.
pub(crate) fn is_readable(file: BorrowedFd<'_>, time: Duration) -> bool {
    #[cfg(target_os = "linux")]
    {
        use rustix::event::{PollFd, PollFlags, Timespec, poll};
        // A time that the clock can't represent is longer than any wait.
        let time = Timespec::try_from(time).ok();
        poll(&mut [PollFd::from_borrowed_fd(file, PollFlags::IN)], time.as_ref()).is_ok_and(|count| count > 0)
    }
    #[cfg(not(target_os = "linux"))]
    {
        let _ = file;
        std::thread::sleep(time.min(Outside::LOOK));
        true
    }
}

impl DeviceSync {
    fn lock(&self) -> MutexGuard<'_, ()> {
        // The lock guards no data of its own, so that a panic under it leaves nothing inconsistent.
        self.gate.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes values that others may wait for, and wakes them.
    pub(crate) fn update<R>(&self, update: impl FnOnce() -> R) -> R {
        let guard = self.lock();
        let result = update();
        drop(guard);
        self.changed.notify_all();
        result
    }

    /// Marks the device as lost and wakes every waiter. Only the first reason is kept, because others follow from it.
    pub(crate) fn lose(&self, reason: Error) {
        log::error!("{reason}");
        self.update(|| {
            self.lost.get_or_init(|| reason);
        });
    }

    /// Fails if the device is lost. Commands that may return `VK_ERROR_DEVICE_LOST` call this first.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], or [`Error::DeviceLostByDefect`].
    pub(crate) fn check(&self) -> Result<(), Error> {
        self.lost.get().map_or(Ok(()), |reason| Err(reason.clone()))
    }

    /// Waits until `ready`, at most until `deadline` (forever without one).
    pub(crate) fn wait(&self, deadline: Option<Instant>, ready: impl Fn() -> bool) -> WaitResult {
        let mut guard = self.lock();
        loop {
            if ready() {
                return WaitResult::Ready;
            }
            if self.lost.get().is_some() {
                return WaitResult::Lost;
            }
            guard = match deadline {
                None => self.changed.wait(guard).unwrap_or_else(PoisonError::into_inner),
                Some(deadline) => {
                    let left = deadline.saturating_duration_since(Instant::now());
                    if left.is_zero() {
                        return WaitResult::TimedOut;
                    }
                    self.changed.wait_timeout(guard, left).unwrap_or_else(PoisonError::into_inner).0
                }
            };
        }
    }

    /// Waits as [`Self::wait`] for what others than the device may change, who are `outside`.
    pub(crate) fn wait_for(
        &self,
        deadline: Option<Instant>,
        outside: Option<Outside<'_>>,
        ready: impl Fn() -> bool,
    ) -> WaitResult {
        let Some(outside) = outside else {
            return self.wait(deadline, ready);
        };
        loop {
            let seen = outside.seen();
            if ready() {
                return WaitResult::Ready;
            }
            if self.lost.get().is_some() {
                return WaitResult::Lost;
            }
            let left = deadline.map_or(Duration::MAX, |end| end.saturating_duration_since(Instant::now()));
            if left.is_zero() {
                return WaitResult::TimedOut;
            }
            outside.wait(seen, left);
        }
    }
}

/// The time `nanoseconds` from now; `None`, which means forever, if the clock can't represent it.
pub(crate) fn deadline(nanoseconds: u64) -> Option<Instant> {
    Instant::now().checked_add(Duration::from_nanos(nanoseconds))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};

    #[test]
    fn a_change_wakes_a_waiter() {
        let sync = Arc::new(DeviceSync::default());
        let value = Arc::new(AtomicBool::new(false));
        let waiter = std::thread::spawn({
            let (sync, value) = (sync.clone(), value.clone());
            move || sync.wait(None, || value.load(Ordering::Acquire))
        });
        sync.update(|| value.store(true, Ordering::Release));
        assert_eq!(waiter.join().unwrap(), WaitResult::Ready);
    }

    #[test]
    fn a_wait_ends_at_its_deadline_or_when_the_device_is_lost() {
        let sync = Arc::new(DeviceSync::default());
        assert_eq!(sync.wait(deadline(0), || false), WaitResult::TimedOut);
        assert_eq!(sync.wait(deadline(1000), || false), WaitResult::TimedOut);
        let waiter = std::thread::spawn({
            let sync = sync.clone();
            move || sync.wait(None, || false)
        });
        sync.lose(Error::DeviceLost("a test".to_owned()));
        assert_eq!(waiter.join().unwrap(), WaitResult::Lost);
        assert_eq!(sync.wait(None, || true), WaitResult::Ready);
        assert!(sync.check().unwrap_err().to_string().contains("a test"));
    }
}
