//! `VK_LAYER_GAURAST_mutants`: a Vulkan layer that makes any driver of `VK_GAURAST_gaussian_primitive_topology` wrong in
//! one way, the _mutant_ that the environment's `GAURAST_MUTANT` names. It tests the conformance cases: each mutant must
//! fail one of its chapter.
//!
//! Commands are passed on as they are, but for those that the mutant concerns. A mutant counts how often it changed
//! something; the count is written to the file that `GAURAST_MUTANT_REPORT` names.
//!
//! | module | has |
//! |---|---|
//! | [`table`] | all mutants: name, chapter, what is wrong |
//! | [`mutant`] | a mutant, the active one, and its count |
//! | [`environment`] | the variables that choose it, and say where its count is written |
//! | `below` | the functions of the next layer by which commands are looked up |
//! | `hooks` | the commands that are intercepted, by chapter of Vulkan |
//! | `request` | a pipeline that is created, as a copy that may be changed |
//! | `recording` | what is known of each command buffer |
//! | `next` | the next layer's commands |
//!
//! The reason for all `unsafe` in `hooks` is the same. These are Vulkan's commands: the application keeps their valid
//! usage, so that what pointers name is there, and what a mutant changes keeps it where it is passed on.

mod below;
pub mod environment;
mod hooks;
pub mod mutant;
mod next;
mod recording;
mod request;
pub mod table;

use std::ffi::c_char;

use ash::vk;

pub use crate::mutant::Mutant;
pub use crate::table::MUTANTS;

use crate::below::below;
use gaurast_layer_interface::{LayerFunctions, NegotiateLayerInterface, string};

/// Agrees with the loader on the version of their interface, and gives it the layer's functions.
///
/// # Safety
/// `version` points at the loader's structure, or is null.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn vkNegotiateLoaderLayerInterfaceVersion(
    version: *mut NegotiateLayerInterface,
) -> vk::Result {
    // SAFETY: the caller's promise.
    unsafe { gaurast_layer_interface::negotiate(version, FUNCTIONS) }
}

/// The layer's functions.
const FUNCTIONS: LayerFunctions =
    LayerFunctions { get_instance_proc_addr, get_device_proc_addr, get_physical_device_proc_addr };

/// `vkGetInstanceProcAddr`.
unsafe extern "system" fn get_instance_proc_addr(
    instance: vk::Instance,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    // SAFETY: the name is a string, or null.
    let command = unsafe { string(name) };
    if let Some(own) = FUNCTIONS.lookup(command) {
        return Some(own);
    }
    if instance == vk::Instance::null() {
        return hooks::instance_hook(command).filter(|_| command == c"vkCreateInstance");
    }
    // SAFETY: the instance is valid, and the name is a string.
    let next = unsafe { (below()?.get_instance_proc_addr)(instance, name) }?;
    let hook = hooks::instance_hook(command).or_else(|| hooks::device_hook(command));
    Some(hook.unwrap_or(next))
}

/// `vkGetDeviceProcAddr`.
unsafe extern "system" fn get_device_proc_addr(device: vk::Device, name: *const c_char) -> vk::PFN_vkVoidFunction {
    // SAFETY: the name is a string, or null.
    let command = unsafe { string(name) };
    if command == c"vkGetDeviceProcAddr" {
        return FUNCTIONS.lookup(command);
    }
    // SAFETY: the device is valid, and the name is a string.
    let next = unsafe { (below()?.get_device_proc_addr?)(device, name) }?;
    Some(hooks::device_hook(command).unwrap_or(next))
}

/// `vk_layerGetPhysicalDeviceProcAddr`.
unsafe extern "system" fn get_physical_device_proc_addr(
    instance: vk::Instance,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    // SAFETY: the instance is valid, and the name is a string.
    unsafe { (below()?.get_physical_device_proc_addr?)(instance, name) }
}
