//! Command buffers.

use crate::error::Error;

use crate::object::device::Device;
use crate::object::instance::Instance;
use ash::vk;
use std::sync::{Arc, Mutex, PoisonError};

/// A command buffer.
pub(crate) struct CommandBuffer {
    device: Arc<Device>,
    /// The first thing that went wrong while recording; `vkEndCommandBuffer` fails with it.
    error: Mutex<Option<Error>>,
}

crate::objects! {
    vk::CommandBuffer => CommandBuffer {
        fn reporting_instance(&self) -> Option<Arc<Instance>> {
            self.device.reporting_instance()
        }
    };
}

impl CommandBuffer {
    /// Makes `vkEndCommandBuffer` fail with the first error that a recorded command met.
    pub(crate) fn fail(&self, error: Error) {
        let mut first = self.error.lock().unwrap_or_else(PoisonError::into_inner);
        first.get_or_insert(error);
    }
}
