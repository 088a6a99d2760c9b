//! `VK_LAYER_GAURAST_emulation`: the crate `gaurast-emulation` as the library that the Vulkan loader loads.

#![allow(non_snake_case, reason = "a layer's library is named as the layer")]

use ash::vk;
use gaurast_layer_interface::NegotiateLayerInterface;

/// Agrees with the loader on the version of their interface, and gives it the layer's functions.
///
/// # Safety
/// `version` points at the loader's structure, or is null.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn vkNegotiateLoaderLayerInterfaceVersion(
    version: *mut NegotiateLayerInterface,
) -> vk::Result {
    // SAFETY: the caller's promise.
    unsafe { gaurast_layer_interface::negotiate(version, gaurast_emulation::layer_functions()) }
}
