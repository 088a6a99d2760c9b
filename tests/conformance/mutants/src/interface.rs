//! The loader's interface to layers: the structures of `vk_layer.h`, which the registry does not have.

use std::ffi::{CStr, c_char, c_void};

use ash::vk;

/// The version of the interface that this layer speaks.
pub(crate) const VERSION: u32 = 2;

/// `PFN_vkGetInstanceProcAddr`, and that of commands whose first parameter is a physical device.
pub(crate) type GetInstanceProcAddr = vk::PFN_vkGetInstanceProcAddr;

/// A function of any type.
pub(crate) type Function = unsafe extern "system" fn();

/// `VkNegotiateLayerInterface`.
#[repr(C)]
#[derive(Debug)]
pub struct NegotiateLayerInterface {
    s_type: i32,
    p_next: *mut c_void,
    pub(crate) version: u32,
    pub(crate) get_instance_proc_addr: Option<GetInstanceProcAddr>,
    pub(crate) get_device_proc_addr: Option<vk::PFN_vkGetDeviceProcAddr>,
    pub(crate) get_physical_device_proc_addr: Option<GetInstanceProcAddr>,
}

/// `VK_LAYER_LINK_INFO`: the structure holds the next layer's functions.
const LINK: i32 = 0;

/// `VkLayerInstanceCreateInfo` or `VkLayerDeviceCreateInfo`, of which `L` is the link.
#[repr(C)]
struct CreateInfo<L> {
    s_type: vk::StructureType,
    p_next: *const c_void,
    function: i32,
    link: *mut L,
}

/// `VkLayerInstanceLink`.
#[repr(C)]
#[derive(Clone, Copy)]
pub(crate) struct InstanceLink {
    next: *mut InstanceLink,
    pub(crate) get_instance_proc_addr: GetInstanceProcAddr,
    pub(crate) get_physical_device_proc_addr: Option<GetInstanceProcAddr>,
}

/// `VkLayerDeviceLink`.
#[repr(C)]
#[derive(Clone, Copy)]
pub(crate) struct DeviceLink {
    next: *mut DeviceLink,
    pub(crate) get_instance_proc_addr: GetInstanceProcAddr,
    pub(crate) get_device_proc_addr: vk::PFN_vkGetDeviceProcAddr,
}

/// A link of the chain, which knows the next one.
pub(crate) trait Link: Copy {
    /// The type of the structure that holds it.
    const HOLDER: vk::StructureType;

    /// The next layer's link.
    fn next(&self) -> *mut Self;
}

impl Link for InstanceLink {
    const HOLDER: vk::StructureType = vk::StructureType::LOADER_INSTANCE_CREATE_INFO;

    fn next(&self) -> *mut Self {
        self.next
    }
}

impl Link for DeviceLink {
    const HOLDER: vk::StructureType = vk::StructureType::LOADER_DEVICE_CREATE_INFO;

    fn next(&self) -> *mut Self {
        self.next
    }
}

/// Takes this layer's link from the chain of a creation info, in which the next layer finds its own then.
///
/// # Safety
/// `chain` is the chain of a creation info that the loader has passed.
pub(crate) unsafe fn take_link<L: Link>(chain: *const c_void) -> Option<L> {
    let mut structure = chain.cast::<CreateInfo<L>>().cast_mut();
    while !structure.is_null() {
        // SAFETY: every structure of a chain begins with its type and the next one's address; those of the holder's
        // type are the loader's, which lets layers change them. Nothing but these members is touched in others.
        unsafe {
            if (*structure).s_type == L::HOLDER && (*structure).function == LINK && !(*structure).link.is_null() {
                let link = *(*structure).link;
                (*structure).link = link.next();
                return Some(link);
            }
            structure = (*structure).p_next.cast::<CreateInfo<L>>().cast_mut();
        }
    }
    None
}

/// The first structure of a type in the chain of an answer, which the layer may change.
///
/// # Safety
/// `first` is null or begins a valid chain that nobody else uses during `'a`.
pub(crate) unsafe fn find<'a, T: vk::TaggedStructure>(first: *mut c_void) -> Option<&'a mut T> {
    let mut structure = first.cast::<vk::BaseOutStructure<'a>>();
    while !structure.is_null() {
        // SAFETY: the caller's promise; every structure of a chain begins as `VkBaseOutStructure` does, and one of
        // this type is a `T`.
        unsafe {
            if (*structure).s_type == T::STRUCTURE_TYPE {
                return Some(&mut *structure.cast::<T>());
            }
            structure = (*structure).p_next;
        }
    }
    None
}

/// An array of a structure's; null or nothing is empty.
///
/// # Safety
/// `first` is null or begins `count` values that live as long as `'a`.
pub(crate) unsafe fn slice<'a, T>(first: *const T, count: u32) -> &'a [T] {
    if first.is_null() || count == 0 {
        return &[];
    }
    // SAFETY: the caller's promise, and not null.
    unsafe { std::slice::from_raw_parts(first, count as usize) }
}

/// A string; null is empty.
///
/// # Safety
/// `text` is null or a string that lives as long as `'a`.
pub(crate) unsafe fn string<'a>(text: *const c_char) -> &'a CStr {
    if text.is_null() {
        return c"";
    }
    // SAFETY: the caller's promise, and not null.
    unsafe { CStr::from_ptr(text) }
}
