//! Submissions whose end is awaited, since they write what their draws read.

use std::sync::Arc;

use ash::vk;

use crate::recording::Draw;

/// The most submissions that are remembered: of a program that never waits, the oldest are forgotten.
const MOST: usize = 64;

/// A timeline semaphore's value that a submission signals.
#[derive(Clone, Copy)]
pub(crate) struct Signal {
    pub(crate) semaphore: vk::Semaphore,
    pub(crate) value: u64,
}

/// A draw that is looked at when its submission has ended.
#[derive(Clone)]
pub(crate) struct LateDraw {
    pub(crate) draw: Arc<Draw>,
    /// Compute shaders run after it in its submission, which may write what it has read.
    pub(crate) is_followed: bool,
}

/// A submission.
pub(crate) struct Pending {
    pub(crate) queue: vk::Queue,
    pub(crate) fence: vk::Fence,
    pub(crate) signals: Vec<Signal>,
    pub(crate) draws: Vec<LateDraw>,
}

/// Submissions, in order.
#[derive(Default)]
pub(crate) struct Submissions(Vec<Pending>);

impl Submissions {
    /// Remembers a submission, if it has anything to look at.
    pub(crate) fn push(&mut self, pending: Pending) {
        if pending.draws.is_empty() {
            return;
        }
        if self.0.len() == MOST {
            self.0.remove(0);
        }
        self.0.push(pending);
    }

    /// The draws of submissions that have ended: those that `has_ended` tells, and those before them on their queues.
    pub(crate) fn take_ended(&mut self, has_ended: impl Fn(&Pending) -> bool) -> Vec<LateDraw> {
        let mut ended = Vec::new();
        while let Some(last) = self.0.iter().rposition(&has_ended) {
            let queue = self.0[last].queue;
            let mut kept = Vec::new();
            for (index, pending) in self.0.drain(..).enumerate() {
                if index <= last && pending.queue == queue {
                    ended.extend(pending.draws);
                } else {
                    kept.push(pending);
                }
            }
            self.0 = kept;
        }
        ended
    }
}
