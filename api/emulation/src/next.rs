//! The next layer's commands of a device.

use std::ffi::CStr;
use std::ops::Deref;

use ash::vk;

use crate::instance::Instance;

/// The next layer's device.
pub(crate) struct Next {
    device: ash::Device,
    pub(crate) memory: vk::PhysicalDeviceMemoryProperties,
    /// Nanoseconds of a step of timestamps.
    pub(crate) timestamp_period: f32,
    /// The greatest width and height of a viewport.
    pub(crate) max_viewport: [u32; 2],
    pub(crate) max_vertex_bindings: u32,
    pub(crate) max_vertex_attributes: u32,
    pub(crate) draw_multi: Option<vk::PFN_vkCmdDrawMultiEXT>,
    pub(crate) draw_multi_indexed: Option<vk::PFN_vkCmdDrawMultiIndexedEXT>,
    pub(crate) begin_conditional_rendering: Option<vk::PFN_vkCmdBeginConditionalRenderingEXT>,
    pub(crate) end_conditional_rendering: Option<vk::PFN_vkCmdEndConditionalRenderingEXT>,
}

impl Next {
    /// # Safety
    /// The device was created a moment ago, and the function is the next layer's.
    pub(crate) unsafe fn new(
        handle: vk::Device,
        instance: &Instance,
        physical_device: vk::PhysicalDevice,
        get: vk::PFN_vkGetDeviceProcAddr,
    ) -> Self {
        // SAFETY: the caller's promise; each name is that of a command of the member's type.
        unsafe {
            let load = |name: &CStr| get(handle, name.as_ptr()).map_or(std::ptr::null(), |found| found as *const _);
            let limits = instance.next.get_physical_device_properties(physical_device).limits;
            Self {
                device: ash::Device::load_with(load, handle),
                memory: instance.next.get_physical_device_memory_properties(physical_device),
                timestamp_period: limits.timestamp_period,
                max_viewport: limits.max_viewport_dimensions,
                max_vertex_bindings: limits.max_vertex_input_bindings,
                max_vertex_attributes: limits.max_vertex_input_attributes,
                draw_multi: find(get, handle, c"vkCmdDrawMultiEXT"),
                draw_multi_indexed: find(get, handle, c"vkCmdDrawMultiIndexedEXT"),
                begin_conditional_rendering: find(get, handle, c"vkCmdBeginConditionalRenderingEXT"),
                end_conditional_rendering: find(get, handle, c"vkCmdEndConditionalRenderingEXT"),
            }
        }
    }
}

impl Deref for Next {
    type Target = ash::Device;

    fn deref(&self) -> &ash::Device {
        &self.device
    }
}

/// # Safety
/// `F` is the type of the command's function.
unsafe fn find<F: Copy>(get: vk::PFN_vkGetDeviceProcAddr, device: vk::Device, name: &CStr) -> Option<F> {
    const { assert!(size_of::<F>() == size_of::<usize>()) };
    // SAFETY: function pointers have one size.
    unsafe { get(device, name.as_ptr()).map(|found| std::mem::transmute_copy(&found)) }
}
