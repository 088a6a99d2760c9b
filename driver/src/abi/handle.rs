//! Handles: the only place where a Vulkan handle becomes a reference and back.
//!
//! A handle is a pointer to a [`HandleAllocation`], which owns an [`Arc`] of the object. The loader's word comes first,
//! because the loader writes its dispatch table there for dispatchable handles; then a tag, which is checked whenever a
//! handle is used. A handle never gives `&mut T`: objects lock what changes.

use crate::abi::error::Error;
use ash::vk;
use std::cell::UnsafeCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

/// The value that the loader expects in the first word of a dispatchable object (`ICD_LOADER_MAGIC`).
const LOADER_MAGIC: usize = 0x01CD_C0DE;

/// The upper half of every tag; the lower half is the `VkObjectType`.
const TAG_MAGIC: u64 = 0x4741_5553 << 32;

/// The tag of a destroyed object, which is found if its memory has not been reused.
const DESTROYED: u64 = 0;

/// The number of handles created so far.
static MADE: AtomicU64 = AtomicU64::new(0);

/// The number of handles that exist.
static LIVE: AtomicUsize = AtomicUsize::new(0);

/// A Vulkan object: the thing that a handle of type [`Object::Handle`] owns.
pub(crate) trait Object: Send + Sync + 'static {
    /// Its handle's type.
    type Handle: Handle<Object = Self>;

    /// The listener for errors of commands on this object.
    fn reporter(&self) -> Option<Arc<dyn Reporter>> {
        None
    }
}

/// A listener to errors of commands: an instance with its debug messengers.
pub(crate) trait Reporter {
    /// Receives an error of the Vulkan command `command`.
    fn report_error(&self, command: &str, error: &Error);
    /// Receives a use that breaks a rule, and that the device does all the same.
    fn report_warning(&self, error: &Error);
}

/// The handle type of an [`Object`]. Implemented by [`objects!`](crate::objects).
pub(crate) trait Handle: vk::Handle + Copy {
    /// The type of the object that it owns.
    type Object: Object<Handle = Self>;
}

/// Pairs handle types with their objects: `objects! { vk::Device => Device; }`. The object's own [`Object`] methods
/// may be overridden in braces.
macro_rules! objects {
    ($($handle:ty => $object:ty $({ $($methods:item)* })?;)*) => {$(
        impl $crate::abi::handle::Handle for $handle {
            type Object = $object;
        }
        impl $crate::abi::handle::Object for $object {
            type Handle = $handle;
            $($($methods)*)?
        }
    )*};
}

pub(crate) use objects;

/// The allocation that a handle points at.
#[repr(C)]
struct HandleAllocation<T> {
    /// The loader overwrites it with its dispatch table; the driver never reads it.
    loader_word: UnsafeCell<usize>,
    tag: AtomicU64,
    /// A number that distinguishes this handle from earlier ones at the same address.
    serial: u64,
    object: Arc<T>,
}

fn tag<H: vk::Handle>() -> u64 {
    TAG_MAGIC | u64::from(H::TYPE.as_raw() as u32)
}

fn invalid<H: vk::Handle>(raw: u64) -> Error {
    Error::InvalidHandle { expected: H::TYPE, raw }
}

/// Creates a handle that owns `object`.
pub(crate) fn create<T: Object>(object: Arc<T>) -> T::Handle {
    LIVE.fetch_add(1, Ordering::Relaxed);
    let allocation = Box::new(HandleAllocation {
        loader_word: UnsafeCell::new(LOADER_MAGIC),
        tag: AtomicU64::new(tag::<T::Handle>()),
        serial: MADE.fetch_add(1, Ordering::Relaxed),
        object,
    });
    vk::Handle::from_raw(Box::into_raw(allocation) as u64)
}

/// Finds the allocation of a handle, after checking that its address is plausible and its tag is right.
///
/// # Safety
/// As [`get`].
unsafe fn allocation<H: Handle>(handle: H) -> Result<*mut HandleAllocation<H::Object>, Error> {
    let raw = vk::Handle::as_raw(handle);
    let pointer = raw as usize as *mut HandleAllocation<H::Object>;
    if pointer.is_null() || !pointer.is_aligned() {
        return Err(invalid::<H>(raw));
    }
    // SAFETY: the caller promises a handle made by `create` for some object type; `tag` lies at the same offset in
    // every `HandleAllocation` and is atomic.
    let found = unsafe { (*pointer).tag.load(Ordering::Relaxed) };
    if found == tag::<H>() { Ok(pointer) } else { Err(invalid::<H>(raw)) }
}

/// The object of a handle.
///
/// # Errors
/// [`Error::InvalidHandle`] if the handle is null or of another type.
///
/// # Safety
/// A handle that isn't null was made by [`create`], for whatever type, and isn't destroyed while `'a` lasts.
pub(crate) unsafe fn get<'a, H: Handle>(handle: H) -> Result<&'a Arc<H::Object>, Error> {
    // SAFETY: the caller's promise is `allocation`'s.
    let allocation = unsafe { allocation(handle)? };
    // SAFETY: the tag says that this allocation holds an `Arc<H::Object>`, and it lives for `'a`.
    Ok(unsafe { &(*allocation).object })
}

/// The object of a handle that may be null.
///
/// # Errors
/// [`Error::InvalidHandle`] if the handle is of another type.
///
/// # Safety
/// As [`get`].
pub(crate) unsafe fn get_optional<'a, H: Handle>(handle: H) -> Result<Option<&'a Arc<H::Object>>, Error> {
    if vk::Handle::as_raw(handle) == 0 {
        return Ok(None);
    }
    // SAFETY: the caller's promise is `get`'s.
    unsafe { get(handle) }.map(Some)
}

/// The objects of several handles.
///
/// # Errors
/// [`Error::InvalidHandle`] if any is null or of another type.
///
/// # Safety
/// As [`get`], for the time of the call.
pub(crate) unsafe fn get_all<H: Handle>(handles: &[H]) -> Result<Vec<Arc<H::Object>>, Error> {
    handles
        .iter()
        // SAFETY: the caller's promise is `get`'s.
        .map(|&handle| unsafe { get(handle) }.cloned())
        .collect()
}

/// Live handles, whose objects are looked up one by one, without a list of objects.
#[derive(Clone, Copy)]
pub(crate) struct Handles<'a, H>(&'a [H]);

impl<'a, H: Handle> Handles<'a, H> {
    /// The handles of an array.
    ///
    /// # Safety
    /// As [`get`], for each.
    pub(crate) unsafe fn new(handles: &'a [H]) -> Self {
        Self(handles)
    }

    /// The number of handles.
    pub(crate) fn len(self) -> usize {
        self.0.len()
    }

    /// The handles' objects, `None` for null handles; [`Error::InvalidHandle`] for a handle of another type.
    pub(crate) fn objects(self) -> impl Iterator<Item = Result<Option<&'a Arc<H::Object>>, Error>> {
        // SAFETY: the promise of `new`.
        self.0.iter().map(|&handle| unsafe { get_optional(handle) })
    }
}

/// The objects of several handles, `None` for null handles.
///
/// # Errors
/// [`Error::InvalidHandle`] if any is of another type.
///
/// # Safety
/// As [`get`], for the time of the call.
pub(crate) unsafe fn get_all_optional<H: Handle>(handles: &[H]) -> Result<Vec<Option<Arc<H::Object>>>, Error> {
    handles
        .iter()
        // SAFETY: the caller's promise is `get_optional`'s.
        .map(|&handle| Ok(unsafe { get_optional(handle) }?.cloned()))
        .collect()
}

/// Destroys a handle and returns the object that it owned. A null handle is ignored.
///
/// # Errors
/// [`Error::InvalidHandle`] if the handle is of another type; it is not destroyed.
///
/// # Safety
/// As [`get`]; and nothing uses the handle during or after this call.
pub(crate) unsafe fn destroy<H: Handle>(handle: H) -> Result<Option<Arc<H::Object>>, Error> {
    if vk::Handle::as_raw(handle) == 0 {
        return Ok(None);
    }
    // SAFETY: the caller's promise is `allocation`'s.
    let allocation = unsafe { allocation(handle)? };
    // SAFETY: `create` made this allocation by `Box::into_raw`, and the caller promises that nothing else uses it.
    let allocation = unsafe { Box::from_raw(allocation) };
    allocation.tag.store(DESTROYED, Ordering::Relaxed);
    LIVE.fetch_sub(1, Ordering::Relaxed);
    Ok(Some(allocation.object))
}

/// A number that no other handle of this process has or had.
///
/// # Errors
/// [`Error::InvalidHandle`] if the handle is null or not of `object_type`.
///
/// # Safety
/// As [`get`], for a handle given as its type and bits.
pub(crate) unsafe fn serial(object_type: vk::ObjectType, raw: u64) -> Result<u64, Error> {
    let pointer = raw as usize as *const HandleAllocation<()>;
    let invalid = Error::InvalidHandle { expected: object_type, raw };
    if pointer.is_null() || !pointer.is_aligned() {
        return Err(invalid);
    }
    // SAFETY: the caller promises a handle made by `create` for some object type; what precedes the object, which
    // isn't touched, lies at the same offsets in every `HandleAllocation`.
    let (tag, serial) = unsafe { ((*pointer).tag.load(Ordering::Relaxed), (*pointer).serial) };
    if tag == TAG_MAGIC | u64::from(object_type.as_raw() as u32) { Ok(serial) } else { Err(invalid) }
}

/// The number of Vulkan objects that this process has handles of, over all instances. Tests find leaks with it.
pub fn live_handles() -> usize {
    LIVE.load(Ordering::Relaxed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::instance::Instance;
    use crate::listeners::DebugMessenger;
    use crate::options::Options;

    fn messenger() -> Arc<DebugMessenger> {
        Arc::new(DebugMessenger::new(&vk::DebugUtilsMessengerCreateInfoEXT::default()))
    }

    fn is_invalid<T>(result: Result<T, Error>) -> bool {
        matches!(result, Err(Error::InvalidHandle { .. }))
    }

    #[test]
    fn a_dispatchable_handle_begins_with_the_loaders_word() {
        let instance = create(Instance::new(0, &[], Options::default()).unwrap());
        let pointer = vk::Handle::as_raw(instance) as usize as *const usize;
        // SAFETY: the handle is live and points at a `HandleAllocation`, whose first word this is.
        assert_eq!(unsafe { pointer.read() }, 0x01CD_C0DE);
        // SAFETY: the handle is live and not used again.
        assert!(unsafe { destroy(instance) }.unwrap().is_some());
    }

    #[test]
    fn a_handle_owns_its_object_until_it_is_destroyed() {
        let object = messenger();
        let handle = create(Arc::clone(&object));
        // SAFETY: the handle is live.
        let found = unsafe { get(handle) }.unwrap();
        assert!(Arc::ptr_eq(found, &object));
        assert_eq!(Arc::strong_count(&object), 2);
        // SAFETY: the handle is live and not used again.
        drop(unsafe { destroy(handle) }.unwrap());
        assert_eq!(Arc::strong_count(&object), 1);
    }

    #[test]
    fn wrong_handles_are_refused() {
        let handle = create(messenger());
        let raw = vk::Handle::as_raw(handle);
        // SAFETY: the handle is live, though its type is another; null and odd addresses aren't followed.
        unsafe {
            assert!(is_invalid(get(<vk::Device as vk::Handle>::from_raw(raw))));
            assert!(is_invalid(destroy(<vk::Device as vk::Handle>::from_raw(raw))));
            assert!(is_invalid(get(vk::Device::null())));
            assert!(is_invalid(get(<vk::Device as vk::Handle>::from_raw(raw + 1))));
            assert!(is_invalid(get_all(&[vk::Device::null()])));
            assert!(is_invalid(serial(vk::ObjectType::DEVICE, raw)));
            assert!(is_invalid(serial(vk::ObjectType::DEVICE, 0)));
            assert!(serial(vk::ObjectType::DEBUG_UTILS_MESSENGER_EXT, raw).is_ok());
            assert!(get_optional(vk::Device::null()).unwrap().is_none());
            assert!(destroy(vk::Device::null()).unwrap().is_none());
            assert!(destroy(handle).unwrap().is_some());
        }
    }
}
