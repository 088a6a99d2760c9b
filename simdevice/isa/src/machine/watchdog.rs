//! Stops programs that don't end.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use thiserror::Error;

/// The reason that a batch was stopped.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum Stopped {
    /// It ran longer than the watchdog allows.
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
    /// The longest time that one batch may take.
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
}

impl<'a> Watch<'a> {
    pub fn new(watchdog: Watchdog<'a>) -> Self {
        Self { watchdog, left: PATIENCE, start: None }
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
        let start = *self.start.get_or_insert_with(Instant::now);
        if start.elapsed() > self.watchdog.limit {
            return Err(Stopped::TimedOut { limit: self.watchdog.limit });
        }
        Ok(())
    }
}
