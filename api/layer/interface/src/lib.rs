//! The interface between Vulkan's loader and layers: the structures of `vk_layer.h`, which the registry does not have, and what
//! a layer does with them and with chains of structures.

mod commands;
mod live;

use std::ffi::{CStr, c_char, c_void};

use ash::vk;

pub use live::{Live, key};

/// The version of the interface that layers speak.
const VERSION: u32 = 2;

/// `PFN_vkGetInstanceProcAddr`, and that of commands whose first parameter is a physical device.
pub type GetInstanceProcAddr = vk::PFN_vkGetInstanceProcAddr;

/// A function of any type.
pub type Function = unsafe extern "system" fn();

/// `VkNegotiateLayerInterface`.
#[repr(C)]
#[derive(Debug)]
pub struct NegotiateLayerInterface {
    s_type: i32,
    p_next: *mut c_void,
    version: u32,
    get_instance_proc_addr: Option<GetInstanceProcAddr>,
    get_device_proc_addr: Option<vk::PFN_vkGetDeviceProcAddr>,
    get_physical_device_proc_addr: Option<GetInstanceProcAddr>,
}

/// The functions of a layer by which commands are looked up.
#[derive(Clone, Copy, Debug)]
pub struct LayerFunctions {
    /// `vkGetInstanceProcAddr`.
    pub get_instance_proc_addr: GetInstanceProcAddr,
    /// `vkGetDeviceProcAddr`.
    pub get_device_proc_addr: vk::PFN_vkGetDeviceProcAddr,
    /// `vk_layerGetPhysicalDeviceProcAddr`.
    pub get_physical_device_proc_addr: GetInstanceProcAddr,
}

impl LayerFunctions {
    /// A layer's own function, if `command` is one of those by which commands are looked up.
    pub fn lookup(&self, command: &CStr) -> vk::PFN_vkVoidFunction {
        // SAFETY: function pointers have one size, and whoever calls it casts it back.
        unsafe {
            if command == c"vkGetInstanceProcAddr" {
                Some(std::mem::transmute::<GetInstanceProcAddr, Function>(self.get_instance_proc_addr))
            } else if command == c"vkGetDeviceProcAddr" {
                Some(std::mem::transmute::<vk::PFN_vkGetDeviceProcAddr, Function>(self.get_device_proc_addr))
            } else {
                None
            }
        }
    }
}

/// The next layer's instance: its handle, and the functions by which its commands are looked up.
#[derive(Clone, Copy, Debug)]
pub struct NextInstance {
    /// The instance.
    pub handle: vk::Instance,
    /// `vkGetInstanceProcAddr`.
    pub get_instance_proc_addr: GetInstanceProcAddr,
    /// `vk_layerGetPhysicalDeviceProcAddr`, if the next layer has it.
    pub get_physical_device_proc_addr: Option<GetInstanceProcAddr>,
}

impl NextInstance {
    /// A command by name, for the application.
    ///
    /// # Safety
    /// The instance lives.
    pub unsafe fn command(&self, name: &CStr) -> vk::PFN_vkVoidFunction {
        // SAFETY: the caller's promise, and the name is a string.
        unsafe { (self.get_instance_proc_addr)(self.handle, name.as_ptr()) }
    }

    /// A command whose first parameter is a physical device, for the loader.
    ///
    /// # Safety
    /// The instance lives.
    pub unsafe fn command_of_physical_device(&self, name: &CStr) -> vk::PFN_vkVoidFunction {
        let get = self.get_physical_device_proc_addr?;
        // SAFETY: the caller's promise, and the name is a string.
        unsafe { get(self.handle, name.as_ptr()) }
    }
}

/// Agrees with the loader on the version of their interface, and gives it the layer's functions: all that a layer's
/// `vkNegotiateLoaderLayerInterfaceVersion` does.
///
/// # Safety
/// `structure` points at the loader's structure, or is null.
pub unsafe fn negotiate(structure: *mut NegotiateLayerInterface, functions: LayerFunctions) -> vk::Result {
    // SAFETY: the caller's promise.
    let Some(structure) = (unsafe { structure.as_mut() }) else {
        return vk::Result::ERROR_INITIALIZATION_FAILED;
    };
    if structure.version < VERSION {
        return vk::Result::ERROR_INITIALIZATION_FAILED;
    }
    structure.version = VERSION;
    structure.get_instance_proc_addr = Some(functions.get_instance_proc_addr);
    structure.get_device_proc_addr = Some(functions.get_device_proc_addr);
    structure.get_physical_device_proc_addr = Some(functions.get_physical_device_proc_addr);
    vk::Result::SUCCESS
}

/// `VK_LAYER_LINK_INFO`: the structure holds the next layer's functions.
const LINK: i32 = 0;
/// `VK_LOADER_DATA_CALLBACK`: the structure holds a function of the loader.
const LOADER_DATA: i32 = 1;

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
#[derive(Clone, Copy, Debug)]
pub struct InstanceLink {
    next: *mut InstanceLink,
    /// The next layer's `vkGetInstanceProcAddr`.
    pub get_instance_proc_addr: GetInstanceProcAddr,
    /// The next layer's `vk_layerGetPhysicalDeviceProcAddr`, if it has it.
    pub get_physical_device_proc_addr: Option<GetInstanceProcAddr>,
}

/// `VkLayerDeviceLink`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct DeviceLink {
    next: *mut DeviceLink,
    /// The next layer's `vkGetInstanceProcAddr`.
    pub get_instance_proc_addr: GetInstanceProcAddr,
    /// The next layer's `vkGetDeviceProcAddr`.
    pub get_device_proc_addr: vk::PFN_vkGetDeviceProcAddr,
}

/// A link of the chain, which knows the next one.
pub trait Link: Copy {
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
pub unsafe fn take_link<L: Link>(chain: *const c_void) -> Option<L> {
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

/// `PFN_vkSetDeviceLoaderData`: makes a queue or command buffer that a layer has got for itself one that the loader knows.
pub type SetDeviceLoaderData = unsafe extern "system" fn(device: vk::Device, object: *mut c_void) -> vk::Result;

/// `VkLayerDeviceCreateInfo` with a function in the place of the link.
#[repr(C)]
struct DataInfo {
    s_type: vk::StructureType,
    p_next: *const c_void,
    function: i32,
    set_loader_data: Option<SetDeviceLoaderData>,
}

/// The loader's function for a layer's own queues and command buffers, if the chain of `VkDeviceCreateInfo` has it.
///
/// # Safety
/// `first` is the chain of a creation info that the loader has passed.
pub unsafe fn set_loader_data(first: *const c_void) -> Option<SetDeviceLoaderData> {
    // SAFETY: the caller's promise.
    let mut structures = unsafe { chain(first) };
    structures.find_map(|structure| {
        let info = std::ptr::from_ref(structure).cast::<DataInfo>();
        // SAFETY: a structure of this type is one of the loader's, of which this function has this member.
        unsafe {
            let is_loader_data =
                structure.s_type == vk::StructureType::LOADER_DEVICE_CREATE_INFO && (*info).function == LOADER_DATA;
            if is_loader_data { (*info).set_loader_data } else { None }
        }
    })
}

/// A command of the next layer by name, as the function that it is.
///
/// # Safety
/// The instance is null or valid, and `F` is the type of the command's function.
pub unsafe fn command<F: Copy>(get: GetInstanceProcAddr, instance: vk::Instance, name: &CStr) -> Option<F> {
    const { assert!(size_of::<F>() == size_of::<usize>()) };
    // SAFETY: the caller's promise; function pointers have one size.
    unsafe {
        let found = get(instance, name.as_ptr())?;
        Some(std::mem::transmute_copy(&found))
    }
}

/// The structures of a chain, in order.
///
/// # Safety
/// `first` is null or begins a valid chain that outlives `'a`.
pub unsafe fn chain<'a>(first: *const c_void) -> impl Iterator<Item = &'a vk::BaseInStructure<'a>> {
    let mut next = first.cast::<vk::BaseInStructure<'a>>();
    std::iter::from_fn(move || {
        // SAFETY: the caller's promise; every structure of a chain begins as `VkBaseInStructure` does.
        let structure = unsafe { next.as_ref() }?;
        next = structure.p_next;
        Some(structure)
    })
}

/// The first structure of a type in a chain.
///
/// # Safety
/// As [`chain`].
pub unsafe fn find<'a, T: vk::TaggedStructure>(first: *const c_void) -> Option<&'a T> {
    // SAFETY: the caller's promise.
    let mut structures = unsafe { chain(first) };
    let found = structures.find(|structure| structure.s_type == T::STRUCTURE_TYPE)?;
    // SAFETY: a structure of this type is a `T`.
    Some(unsafe { &*std::ptr::from_ref(found).cast::<T>() })
}

/// The first structure of a type in the chain of an answer, which the layer may change.
///
/// # Safety
/// `first` is null or begins a valid chain that nobody else uses during `'a`.
pub unsafe fn find_mut<'a, T: vk::TaggedStructure>(first: *mut c_void) -> Option<&'a mut T> {
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
pub unsafe fn slice<'a, T>(first: *const T, count: u32) -> &'a [T] {
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
pub unsafe fn string<'a>(text: *const c_char) -> &'a CStr {
    if text.is_null() {
        return c"";
    }
    // SAFETY: the caller's promise, and not null.
    unsafe { CStr::from_ptr(text) }
}
