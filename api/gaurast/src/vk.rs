//! What the extension adds to [`ash::vk`]: structures, enums, flags, constants and function types.
//!
//! Names are those of the C header without the `Vk` prefix, as in ash.

mod approximation_state;
mod camera;
mod enums;
mod physical_device;
mod pipeline_state;

pub use approximation_state::*;
pub use camera::*;
pub use enums::*;
pub use physical_device::*;
pub use pipeline_state::*;

/// The type of `vkCmdSetGaussianCameraGAURAST`.
#[allow(non_camel_case_types)]
pub type PFN_vkCmdSetGaussianCameraGAURAST = unsafe extern "system" fn(
    command_buffer: ash::vk::CommandBuffer,
    p_camera: *const GaussianCameraGAURAST<'_>,
);
