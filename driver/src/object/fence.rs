//! Fences: what a queue tells the host.

use super::signals::Signals;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A fence.
#[derive(Debug)]
pub(crate) struct Fence {
    signals: Arc<Signals>,
    signaled: AtomicBool,
}

crate::objects! { ash::vk::Fence => Fence; }

impl Fence {
    /// A fence, signaled or not.
    pub(crate) fn new(signals: Arc<Signals>, signaled: bool) -> Self {
        Self {
            signals,
            signaled: AtomicBool::new(signaled),
        }
    }

    /// Whether it is signaled.
    pub(crate) fn is_signaled(&self) -> bool {
        self.signaled.load(Ordering::Acquire)
    }

    /// Signals it.
    pub(crate) fn signal(&self) {
        self.signals
            .change(|| self.signaled.store(true, Ordering::Release));
    }

    /// Makes it unsignaled.
    pub(crate) fn reset(&self) {
        self.signaled.store(false, Ordering::Release);
    }
}
