//! Semaphores, binary and timeline.

use super::signals::Signals;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// A semaphore.
#[derive(Debug)]
pub(crate) struct Semaphore {
    signals: Arc<Signals>,
    payload: Payload,
}

#[derive(Debug)]
enum Payload {
    Binary(AtomicBool),
    Timeline(AtomicU64),
}

crate::objects! { ash::vk::Semaphore => Semaphore; }

impl Semaphore {
    /// An unsignaled binary semaphore.
    pub(crate) fn new_binary(signals: Arc<Signals>) -> Self {
        Self {
            signals,
            payload: Payload::Binary(AtomicBool::new(false)),
        }
    }

    /// A timeline semaphore with that value.
    pub(crate) fn new_timeline(signals: Arc<Signals>, value: u64) -> Self {
        Self {
            signals,
            payload: Payload::Timeline(AtomicU64::new(value)),
        }
    }

    /// A timeline semaphore's value; `None` for a binary one.
    pub(crate) fn value(&self) -> Option<u64> {
        match &self.payload {
            Payload::Binary(_) => None,
            Payload::Timeline(value) => Some(value.load(Ordering::Acquire)),
        }
    }

    /// Signals it; a timeline semaphore gets `value`.
    pub(crate) fn signal(&self, value: u64) {
        self.signals.change(|| match &self.payload {
            Payload::Binary(signaled) => signaled.store(true, Ordering::Release),
            // A smaller value is the application's error; a timeline never runs backwards.
            Payload::Timeline(current) => {
                current.fetch_max(value, Ordering::AcqRel);
            }
        });
    }

    /// Whether a wait for `value` (which a binary semaphore ignores) is over.
    pub(crate) fn is_reached(&self, value: u64) -> bool {
        match &self.payload {
            Payload::Binary(signaled) => signaled.load(Ordering::Acquire),
            Payload::Timeline(current) => current.load(Ordering::Acquire) >= value,
        }
    }

    /// Ends a queue's wait: a binary semaphore becomes unsignaled.
    pub(crate) fn consume(&self) {
        if let Payload::Binary(signaled) = &self.payload {
            signaled.store(false, Ordering::Release);
        }
    }
}
