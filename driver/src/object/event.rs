//! Events: what hosts and queues set, and queues wait for.

use super::signals::Signals;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// An event.
#[derive(Debug)]
pub(crate) struct Event {
    signals: Arc<Signals>,
    value: AtomicBool,
}

crate::objects! { ash::vk::Event => Event; }

impl Event {
    /// An event that is not set.
    pub(crate) fn new(signals: Arc<Signals>) -> Self {
        Self {
            signals,
            value: AtomicBool::new(false),
        }
    }

    /// Whether it is set.
    pub(crate) fn is_set(&self) -> bool {
        self.value.load(Ordering::Acquire)
    }

    /// Sets or resets it.
    pub(crate) fn set(&self, value: bool) {
        self.signals
            .change(|| self.value.store(value, Ordering::Release));
    }
}
