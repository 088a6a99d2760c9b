//! Instances and devices that live, and what a layer knows of them.

use std::collections::BTreeMap;
use std::sync::{Arc, PoisonError, RwLock};

use ash::vk;

/// Objects that live, by the loader's key of their handles.
#[derive(Debug)]
pub struct Live<T>(RwLock<BTreeMap<usize, Arc<T>>>);

impl<T> Live<T> {
    /// None.
    #[expect(clippy::new_without_default, reason = "it is for statics")]
    pub const fn new() -> Self {
        Self(RwLock::new(BTreeMap::new()))
    }

    /// Remembers what is known of an object.
    ///
    /// # Safety
    /// The handle is valid, and the loader has seen it or is about to.
    pub unsafe fn insert<H: vk::Handle>(&self, handle: H, known: T) {
        // SAFETY: the caller's promise.
        let key = unsafe { key(handle) };
        let mut all = self.0.write().unwrap_or_else(PoisonError::into_inner);
        all.insert(key, Arc::new(known));
    }

    /// The knowledge of the object that a handle is of: its own handle, or that of a physical device of an instance, a queue
    /// or a command buffer of a device.
    ///
    /// # Safety
    /// The handle is valid.
    pub unsafe fn of<H: vk::Handle>(&self, handle: H) -> Option<Arc<T>> {
        // SAFETY: the caller's promise.
        let key = unsafe { key(handle) };
        let all = self.0.read().unwrap_or_else(PoisonError::into_inner);
        all.get(&key).cloned()
    }

    /// Forgets an object, and gives what was known of it a last time.
    ///
    /// # Safety
    /// The handle is valid.
    pub unsafe fn remove<H: vk::Handle>(&self, handle: H) -> Option<Arc<T>> {
        // SAFETY: the caller's promise.
        let key = unsafe { key(handle) };
        let mut all = self.0.write().unwrap_or_else(PoisonError::into_inner);
        all.remove(&key)
    }
}

/// The loader's key of a dispatchable handle's chain: the address that its object begins with. Handles of one
/// instance, and those of one device, have one key.
///
/// # Safety
/// The handle is valid, and the loader has seen it.
pub unsafe fn key<H: vk::Handle>(handle: H) -> usize {
    let object = handle.as_raw() as *const usize;
    if object.is_null() {
        return 0;
    }
    // SAFETY: every dispatchable object begins with the loader's word.
    unsafe { object.read() }
}
