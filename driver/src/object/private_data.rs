//! Private data: values that layers and applications attach to objects.

use ash::vk;
use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

/// A slot: one value per object, by the serial number of its handle. Values stay until the slot is destroyed.
#[derive(Default)]
pub(crate) struct PrivateDataSlot(Mutex<HashMap<u64, u64>>);

crate::objects! {
    vk::PrivateDataSlot => PrivateDataSlot;
}

impl PrivateDataSlot {
    /// Attaches a value to the object.
    pub(crate) fn set(&self, object: u64, data: u64) {
        let mut values = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        values.insert(object, data);
    }

    /// The value attached to the object, or 0.
    pub(crate) fn get(&self, object: u64) -> u64 {
        let values = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        values.get(&object).copied().unwrap_or(0)
    }
}
