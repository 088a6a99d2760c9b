//! Stops programs that don't end.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use thiserror::Error;

/// The reason that a batch was stopped.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum Stopped {
    /// It took more time than the watchdog allows.
    #[error("a shader batch ran longer than {limit:?}")]
    TimedOut {
        /// The limit.
        limit: Duration,
    },
    /// Another thread asked it to stop.
    #[error("a shader batch was cancelled")]
    Cancelled,
}

/// The time limit of a batch, and a flag that stops it early.
#[derive(Clone, Copy, Debug)]
pub struct Watchdog<'a> {
    /// The longest time that one batch may take. Of the second half only the time counts in which a processor runs the batch, so
    /// that other programs on a busy machine don't stop it.
    pub limit: Duration,
    /// Set by another thread to stop all batches that watch it (a lost device).
    pub cancel: Option<&'a AtomicBool>,
}

impl Default for Watchdog<'_> {
    fn default() -> Self {
        Self { limit: Duration::from_secs(5), cancel: None }
    }
}

/// Back edges between two readings of the clock.
const PATIENCE: u32 = 64;

/// A watchdog while a batch runs. The clock is first read after some back edges, so that short programs don't read it.
pub(super) struct Watch<'a> {
    watchdog: Watchdog<'a>,
    left: u32,
    start: Option<Instant>,
    /// The thread's processor time when half of the limit had passed.
    half: Option<Duration>,
}

/// The processor time of this thread.
#[cfg(unix)]
fn processor_time() -> Duration {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    Duration::new(time.tv_sec.unsigned_abs(), time.tv_nsec as u32)
}

/// The time, where that of a thread is not known.
#[cfg(not(unix))]
fn processor_time() -> Duration {
    use std::sync::LazyLock;
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    START.elapsed()
}

impl<'a> Watch<'a> {
    pub fn new(watchdog: Watchdog<'a>) -> Self {
        Self { watchdog, left: PATIENCE, start: None, half: None }
    }

    /// Counts a back edge.
    #[inline(always)]
    pub fn tick(&mut self) -> Result<(), Stopped> {
        self.left -= 1;
        if self.left == 0 { self.look() } else { Ok(()) }
    }

    #[cold]
    #[inline(never)]
    fn look(&mut self) -> Result<(), Stopped> {
        self.left = PATIENCE;
        if self.watchdog.cancel.is_some_and(|cancel| cancel.load(Ordering::Relaxed)) {
            return Err(Stopped::Cancelled);
        }
        let half_limit = self.watchdog.limit / 2;
        if self.start.get_or_insert_with(Instant::now).elapsed() > half_limit {
            let spent = processor_time();
            if spent - *self.half.get_or_insert(spent) > half_limit {
                return Err(Stopped::TimedOut { limit: self.watchdog.limit });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[gaurast_runner::test]
    fn waiting_is_no_work() {
        let limit = Duration::from_millis(20);
        let mut watch = Watch::new(Watchdog { limit, cancel: None });
        let look = |watch: &mut Watch<'_>| (0..PATIENCE).try_for_each(|_| watch.tick());
        for _ in 0..6 {
            assert_eq!(look(&mut watch), Ok(()));
            std::thread::sleep(limit / 2);
        }
        let stopped = loop {
            if let Err(stopped) = look(&mut watch) {
                break stopped;
            }
        };
        assert_eq!(stopped, Stopped::TimedOut { limit });
    }
}
