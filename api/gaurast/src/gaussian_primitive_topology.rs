//! `VK_GAURAST_gaussian_primitive_topology`: names, version and device-level functions.
//!
//! The module has the shape of ash's own extension modules (see [`ash::ext::mesh_shader`]).

use core::ffi::{CStr, c_void};

use crate::ash_compat;
use crate::vk::{GaussianCameraGAURAST, PFN_vkCmdSetGaussianCameraGAURAST};

/// The extension's name, for `ppEnabledExtensionNames`.
pub const NAME: &CStr = c"VK_GAURAST_gaussian_primitive_topology";

/// The revision of the extension that this crate describes.
pub const SPEC_VERSION: u32 = 1;

/// The extension number, which fixes the block of enum values: 1000000000 + (number - 1) * 1000.
///
/// It is not registered with Khronos. It is far above the numbers that are.
pub const EXTENSION_NUMBER: u32 = 998;

/// VK_GAURAST_gaussian_primitive_topology device-level functions.
#[derive(Clone)]
pub struct Device {
    fp: DeviceFn,
    handle: ash::vk::Device,
}

impl Device {
    /// Loads the functions of `device`, on which the extension must be enabled.
    ///
    /// As everywhere in ash, a function that the device lacks is only noticed when it is called:
    /// the call then ends the process with a message.
    pub fn new(instance: &ash::Instance, device: &ash::Device) -> Self {
        let handle = device.handle();
        let fp = DeviceFn::load(ash_compat::device_loader(instance, handle));
        Self { fp, handle }
    }

    /// The raw function pointers.
    #[inline]
    pub fn fp(&self) -> &DeviceFn {
        &self.fp
    }

    /// The device whose functions these are.
    #[inline]
    pub fn device(&self) -> ash::vk::Device {
        self.handle
    }

    /// `vkCmdSetGaussianCameraGAURAST`: sets the camera of the Gaussian draws that follow in
    /// `command_buffer`, for pipelines whose camera source is
    /// [`COMMAND`](crate::vk::GaussianCameraSourceGAURAST::COMMAND).
    ///
    /// The camera is command buffer state: undefined when recording begins, kept when another
    /// pipeline is bound, and not inherited by secondary command buffers. `camera` is copied.
    ///
    /// # Safety
    ///
    /// `command_buffer` must belong to [`Self::device`] and be recording, with external access
    /// synchronised, as for every `vkCmd*`; `camera` must satisfy the valid usage stated on
    /// [`GaussianCameraGAURAST`], and its `p_next` chain must be valid.
    #[inline]
    pub unsafe fn cmd_set_gaussian_camera(
        &self,
        command_buffer: ash::vk::CommandBuffer,
        camera: &GaussianCameraGAURAST<'_>,
    ) {
        // SAFETY: the caller keeps the function's contract; `camera` is a live reference.
        unsafe { (self.fp.cmd_set_gaussian_camera_gaurast)(command_buffer, camera) }
    }
}

/// Raw VK_GAURAST_gaussian_primitive_topology device-level function pointers.
#[derive(Clone)]
pub struct DeviceFn {
    /// `vkCmdSetGaussianCameraGAURAST`.
    pub cmd_set_gaussian_camera_gaurast: PFN_vkCmdSetGaussianCameraGAURAST,
}

impl DeviceFn {
    /// Loads every function through `load`, which takes a function's name and returns its address,
    /// or null where there is none.
    ///
    /// What `load` returns must be null or the function of that name.
    pub fn load<F: FnMut(&CStr) -> *const c_void>(mut load: F) -> Self {
        Self {
            cmd_set_gaussian_camera_gaurast: ash_compat::load_cmd_set_gaussian_camera(&mut load),
        }
    }
}
