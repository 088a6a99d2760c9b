//! What the layer knows of each command buffer while it is recorded.

use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

use ash::vk;

/// A command that is recorded later.
pub(crate) type Deferred = Box<dyn FnOnce() + Send>;

/// A vertex buffer, and the offset from which on it is read.
pub(crate) type VertexBuffer = (vk::Buffer, vk::DeviceSize);

/// What a command buffer has recorded.
#[derive(Default)]
pub(crate) struct Recording {
    /// True within a set.
    pub(crate) in_set: bool,
    /// The number of draws of the current set.
    pub(crate) draws_of_set: u32,
    /// True if a set of the current pass has been begun, though the application may have ended it.
    pub(crate) set_is_open: bool,
    /// The vertex buffers by binding.
    pub(crate) vertex_buffers: HashMap<u32, VertexBuffer>,
    /// The number of each kind of command.
    pub(crate) times: HashMap<&'static str, u32>,
    /// Commands that wait for the end of a set.
    pub(crate) after_set: Vec<Deferred>,
    /// Commands that wait for the end of the command buffer.
    pub(crate) after_all: Vec<Deferred>,
    /// True while draws are to be dropped.
    pub(crate) drops_draws: bool,
}

impl Recording {
    /// Counts a command of a kind, and returns how many there were before.
    pub(crate) fn count(&mut self, kind: &'static str) -> u32 {
        let times = self.times.entry(kind).or_default();
        *times += 1;
        *times - 1
    }
}

static RECORDINGS: Mutex<Option<HashMap<vk::CommandBuffer, Recording>>> = Mutex::new(None);

fn lock() -> MutexGuard<'static, Option<HashMap<vk::CommandBuffer, Recording>>> {
    RECORDINGS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Looks at a command buffer's recording, or changes it.
pub(crate) fn of<R>(commands: vk::CommandBuffer, look: impl FnOnce(&mut Recording) -> R) -> R {
    look(lock().get_or_insert_default().entry(commands).or_default())
}

/// Forgets what a command buffer has recorded.
pub(crate) fn forget(commands: vk::CommandBuffer) {
    lock().get_or_insert_default().remove(&commands);
}
