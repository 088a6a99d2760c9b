//! The physical device: an instance has one. What it can do is in [`capabilities`](crate::capabilities).

use crate::error::Error;
use crate::object::instance::Instance;
use ash::vk;
use std::sync::{Arc, Weak};

/// The simulated GauRast device, before an application opens it.
pub(crate) struct PhysicalDevice {
    instance: Weak<Instance>,
}

crate::objects! {
    vk::PhysicalDevice => PhysicalDevice {
        fn reporting_instance(&self) -> Option<Arc<Instance>> {
            self.instance.upgrade()
        }
    };
}

impl PhysicalDevice {
    /// The physical device of an instance, which may be under construction.
    pub(crate) fn new(instance: Weak<Instance>) -> Self {
        Self { instance }
    }

    /// Its instance.
    ///
    /// # Errors
    /// [`Error::InvalidHandle`] if the instance has been destroyed.
    pub(crate) fn require_instance(&self) -> Result<Arc<Instance>, Error> {
        self.instance.upgrade().ok_or(Error::InvalidHandle {
            expected: vk::ObjectType::INSTANCE,
            raw: 0,
        })
    }
}
